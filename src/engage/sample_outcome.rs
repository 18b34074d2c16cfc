//! The result at a sample: its arcs, and the stock near it. In: arcs. Out: [`Outcome`], turned to another heading, united with others, compared
//! with another.

use super::arcs::area_of;
use super::cutter::Cutter;
use super::scene::{Cut, RawArc};
use super::union::unite;

/// An arc that ends this near to the end of the leading half ends there, rad.
const EDGE_RAD: f32 = 1e-4;
/// Turn of the heading from which on the removal area is worked out anew, rad: a smaller turn changes it by less than 1/300.
const BEND_RAD: f64 = 2e-3;
/// A turn of the heading below this counts as none, rad.
pub const STRAIGHT_RAD: f64 = 1e-4;
/// Angle by which arcs may differ and still count as equal, rad.
const EQUAL_RAD: f32 = 2e-3;
/// Steps in which the bounds of partial rings are kept.
pub const PARTS: f32 = 256.0;

/// The result at a sample.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Its arcs, sorted by slice.
    pub arcs: Vec<RawArc>,
    /// Their removal area.
    pub cut: Cut,
    /// Nothing stands within the clearance.
    pub clear: bool,
    /// How far stock stands into the shank and into the holder, mm.
    pub struck: [f32; 2],
    /// Stock stands above the neck of the tool where it cuts: the field cannot hold what remains.
    pub undercut: bool,
}

impl Outcome {
    /// The outcome of a stretch with these places: the union of their arcs, the largest of their figures; `None` if none is engaged.
    pub fn of_places<'a>(places: impl IntoIterator<Item = &'a Self>) -> Option<Self> {
        let mut engaged = places.into_iter().filter(|place| !place.arcs.is_empty());
        let mut all = engaged.next()?.clone();
        for place in engaged {
            unite(&mut all.arcs, &place.arcs);
            all.cut.area_mm2 = all.cut.area_mm2.max(place.cut.area_mm2);
            all.cut.top_mm = all.cut.top_mm.max(place.cut.top_mm);
            all.cut.rub_mm = all.cut.rub_mm.max(place.cut.rub_mm);
            all.struck = [0, 1].map(|k| all.struck[k].max(place.struck[k]));
            all.undercut |= place.undercut;
        }
        all.cut.arcs = all.arcs.len() as u32;
        Some(all)
    }
    /// The same engagement seen from a heading that is `by_rad` further counter-clockwise. Engaged arcs keep their place in space, clipped to
    /// the new leading half; an arc that reached the end of the leading half before does so again.
    fn turned(&self, by_rad: f64) -> Self {
        let (by, half_turn) = (by_rad as f32, std::f32::consts::PI);
        let at_end = |angle: f32| angle.abs() < EDGE_RAD || (angle - half_turn).abs() < EDGE_RAD;
        let turned = |angle: f32| if at_end(angle) { angle } else { (angle + by).clamp(0.0, half_turn) };
        let mut arcs = self.arcs.clone();
        let leading = |arc: &RawArc| arc.angles[0] > -EDGE_RAD && arc.angles[1] < half_turn + EDGE_RAD;
        arcs.iter_mut().filter(|arc| leading(arc)).for_each(|arc| arc.angles = arc.angles.map(turned));
        arcs.retain(|arc| arc.angles[0] < arc.angles[1]);
        Self { arcs, ..self.clone() }
    }
    /// The same engagement after the path turns counter-clockwise by `by_rad` onto a tangent (horizontal, vertical part), with the removal
    /// area worked out anew.
    pub fn beyond_bend(&self, by_rad: f64, cutter: &Cutter, tangent: [f64; 2]) -> Self {
        let mut seen = self.turned(by_rad);
        if by_rad.abs() < BEND_RAD {
            return seen;
        }
        let [before, after] = [&self.arcs, &seen.arcs].map(|arcs| area_of(cutter, tangent, arcs));
        if before > 0.0 {
            seen.cut.area_mm2 *= after / before;
        }
        seen
    }
}

/// Angle from one horizontal heading to another, counter-clockwise, rad.
pub fn turn_rad(from: [f64; 2], to: [f64; 2]) -> f64 {
    (from[0] * to[1] - from[1] * to[0]).atan2(from[0] * to[0] + from[1] * to[1])
}

/// Are these arcs equal within [`EQUAL_RAD`]?
pub fn same(a: &[RawArc], b: &[RawArc]) -> bool {
    a.len() == b.len()
        && a.iter().zip(b).all(|(a, b)| {
            let near =
                |k: usize| (a.angles[k] - b.angles[k]).abs() < EQUAL_RAD && (a.part[k] - b.part[k]).abs() < 0.5 / PARTS;
            a.slice == b.slice && near(0) && near(1)
        })
}
