//! Stock proud of its model, or not where its model stands: top face and side faces shifted outward, all sides alike or
//! each by itself. A shifted zero point moves one side of a pair outward and the other inward.

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
    ],
    // The top, the sides alike, both; one face; a zero point that is shifted, or every side as it stands. Not the top beside
    // single faces: what stands out above and beside at once is simulated for all sides alike only, and without it the faces
    // come out too far by the share of the top in the depth of the cut.
    forms: &[&[0], &[1], &[0, 1], &[2], &[3], &[4], &[5], &[2, 3, 4, 5]],
    change,
    separated_by: "one pass over the raw face and one below it",
    geometry: &[Geometry::StockTop, Geometry::StockSide],
    ..BARE
};

const fn face(name: &'static str, meaning: &'static str) -> Parameter {
    Parameter { name, unit: "mm", min: -5.0, max: 5.0, starts: &[0.0], neutral: Some(0.0), place: None, meaning }
}

fn change(p: &[f64], _: &State) -> Change {
    let faces = [p[2], p[3], p[4], p[5]];
    Change { stock_top_mm: p[0], stock_side_mm: p[1], stock_faces_mm: faces, ..Change::default() }
}
