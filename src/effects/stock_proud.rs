//! Stock that stands proud of its model, or elsewhere. In: nothing of the cut. Out: distances, mm, by which the top face and the side faces
//! lie further out, all sides alike or each by its own, the angle by which it is turned, and the slope of the top. A shifted zero point moves
//! one face of a pair outward and the other inward; one that was set askew turns the stock as well. A blank that was sawn askew or lies on a
//! chip has a top that is not level.

use super::{Acts, BARE, Change, Covariate, Effect, Geometry, Parameter, State};

/// `stock-proud`.
pub const EFFECT: Effect = Effect {
    name: "stock-proud",
    meaning: "the stock is larger than its model, or stands elsewhere",
    acts: Acts::Geometry,
    covariates: &[Covariate::AxialDepth, Covariate::RadialDepth, Covariate::X, Covariate::Y, Covariate::Z],
    parameters: &[
        Parameter {
            name: "top",
            unit: "mm",
            min: -5.0,
            max: 5.0,
            starts: &[0.0],
            neutral: Some(0.0),
            place: None,
            meaning: "how much higher",
        },
        Parameter {
            name: "side",
            unit: "mm",
            min: -5.0,
            max: 5.0,
            starts: &[0.0],
            neutral: Some(0.0),
            place: None,
            meaning: "how much wider on each side",
        },
        face("x_min", "how much further out the face towards −x stands than that"),
        face("x_max", "the same of the face towards +x"),
        face("y_min", "the same of the face towards −y"),
        face("y_max", "the same of the face towards +y"),
        Parameter {
            name: "turn",
            unit: "rad",
            min: -0.1,
            max: 0.1,
            starts: &[0.0],
            neutral: Some(0.0),
            place: None,
            meaning: "how far it is turned, counter-clockwise seen from above",
        },
        slope("slope_x", "how much higher it is per 100 mm towards +x; top is then that at the zero point"),
        slope("slope_y", "the same towards +y"),
    ],
    // The top; the sides alike; both; one face; all four faces (a shifted zero point); the turn; both of these; the top with a slope. The top together with
    // single faces is not among them: the corner that stands out both above and beside is simulated for equal sides only, and without it the faces would be
    // estimated too far out, by the share of the top in the depth of cut.
    forms: &[&[0], &[1], &[0, 1], &[2], &[3], &[4], &[5], &[2, 3, 4, 5], &[6], &[2, 3, 4, 5, 6], &[0, 7, 8]],
    change,
    separated_by: "one pass over the raw face and one below it",
    geometry: &[Geometry::StockTop, Geometry::StockSide],
    ..BARE
};

const fn face(name: &'static str, meaning: &'static str) -> Parameter {
    Parameter { name, unit: "mm", min: -5.0, max: 5.0, starts: &[0.0], neutral: Some(0.0), place: None, meaning }
}

const fn slope(name: &'static str, meaning: &'static str) -> Parameter {
    Parameter { name, unit: "mm/100 mm", min: -5.0, max: 5.0, starts: &[0.0], neutral: Some(0.0), place: None, meaning }
}

fn change(p: &[f64], _: &State) -> Change {
    let faces = [p[2], p[3], p[4], p[5]];
    Change {
        stock_top_mm: p[0],
        stock_side_mm: p[1],
        stock_faces_mm: faces,
        stock_turn_rad: p[6],
        stock_slope: [p[7] / 100.0, p[8] / 100.0],
        ..Change::default()
    }
}
