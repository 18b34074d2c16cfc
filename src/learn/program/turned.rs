//! Stock that is turned on the table. In: a toolpath, an upright axis, an angle. Out: the toolpath as the turned stock meets it: turned
//! the other way round about that axis, beside stock that stays where it is.

use crate::engage::workpiece::stock_shift;
use crate::machine::{Job, StockShape};
use crate::nc::Toolpath;
use crate::path::{Arc, Curve, Plane, Vec3};

/// The toolpath as stock turned counter-clockwise by this about its middle meets it; `None` where the stock is not a box, or an arc does
/// not lie in the plane XY.
pub(in crate::learn) fn path_at_turned_stock(path: &Toolpath, job: &Job, by_rad: f64) -> Option<Toolpath> {
    let stock = job.stocks.iter().find(|stock| matches!(stock.shape, StockShape::Box(_)))?;
    let StockShape::Box(blank) = &stock.shape else { return None };
    let middle = 0.5 * (blank.min + blank.max) + stock_shift(job, path, stock);
    let mut turned = path.clone();
    for motion in &mut turned.moves {
        motion.set_curve(turned_back(&motion.curve(), middle, by_rad)?);
    }
    Some(turned)
}

/// A curve turned clockwise by this about an upright axis.
fn turned_back(curve: &Curve, about: Vec3, by_rad: f64) -> Option<Curve> {
    let (sin, cos) = by_rad.sin_cos();
    let place = |p: Vec3| {
        let (x, y) = (p.x - about.x, p.y - about.y);
        Vec3::new(about.x + cos * x + sin * y, about.y - sin * x + cos * y, p.z)
    };
    match curve {
        Curve::Line { from, to } => Some(Curve::Line { from: place(*from), to: place(*to) }),
        Curve::Arc(arc) if arc.plane == Plane::Xy => {
            let [from, to, centre] = [arc.from, arc.to, arc.centre].map(place);
            Some(Curve::Arc(Arc { from, to, centre, start_rad: arc.start_rad - by_rad, ..*arc }))
        }
        Curve::Arc(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_turns_clockwise_about_the_axis_and_keeps_its_shape() {
        let about = Vec3::new(10.0, 0.0, 0.0);
        let line = Curve::Line { from: Vec3::new(20.0, 0.0, 3.0), to: Vec3::new(10.0, 5.0, 3.0) };
        let turned = turned_back(&line, about, 0.01).unwrap();
        assert!((turned.from() - Vec3::new(10.0 + 10.0 * 0.01_f64.cos(), -10.0 * 0.01_f64.sin(), 3.0)).norm() < 1e-12);
        let half = Arc::new(Plane::Xy, Vec3::new(15.0, 0.0, 0.0), Vec3::new(5.0, 0.0, 0.0), about, 3.0);
        let turned = turned_back(&Curve::Arc(half), about, 0.3).unwrap();
        assert!((turned.length() - half.length()).abs() < 1e-12 && (turned.point(0.0) - turned.from()).norm() < 1e-12);
        let middle = Curve::Arc(half).point(0.5 * half.length());
        let back = turned_back(&Curve::Line { from: middle, to: middle }, about, 0.3).unwrap();
        assert!((turned.point(0.5 * half.length()) - back.from()).norm() < 1e-9);
        let upright = Arc::new(Plane::Zx, half.from, half.to, about, 3.0);
        assert!(turned_back(&Curve::Arc(upright), about, 0.3).is_none());
    }
}
