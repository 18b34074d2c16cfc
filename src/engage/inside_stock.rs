//! The part of a ring that lies inside the blanks, before any cut. In: the blanks, a position, the angles of a ring that nothing has swept.
//! Out: those of them inside some blank.

use super::gaps::{Gaps, Interval, chord};
use super::nominate::Sample;
use crate::stock::Blank;

/// Height of the stock where there is none, mm.
const FAR_BELOW: f64 = -1e6;

/// The parts of the gaps of a ring of radius `r` at height `z` that lie in some blank.
pub fn in_blanks(blanks: &[Blank], sample: &Sample, gaps: Gaps, r: f64, z: f64) -> Vec<Interval> {
    if let [blank] = blanks {
        let mut gaps = gaps;
        in_blank(blank, sample, &mut gaps, r, z);
        return gaps.0;
    }
    let mut inside = Vec::new();
    for blank in blanks {
        let mut part = gaps.clone();
        in_blank(blank, sample, &mut part, r, z);
        inside.extend(part.0);
    }
    inside.sort_unstable_by(|a: &Interval, b| a[0].key.total_cmp(&b[0].key));
    inside
}

fn in_blank(blank: &Blank, sample: &Sample, gaps: &mut Gaps, r: f64, z: f64) {
    let [dx, dy] = sample.dir;
    let (x, y) = (sample.tip.x, sample.tip.y);
    if gaps.is_empty() {
        return;
    }
    match blank {
        Blank::Box(extent) => {
            if z < extent.min.z || z > extent.max.z {
                gaps.0.clear();
            }
            // The four sides as the cutter sees them, the feed along x.
            gaps.cover_cap([-dx, dy], (x - extent.min.x) / r);
            gaps.cover_cap([dx, -dy], (extent.max.x - x) / r);
            gaps.cover_cap([-dy, -dx], (y - extent.min.y) / r);
            gaps.cover_cap([dy, dx], (extent.max.y - y) / r);
        }
        Blank::Cylinder { centre, radius, z: [low, high] } => {
            if z < *low || z > *high {
                gaps.0.clear();
            }
            let (u, v) = (centre[0] - x, centre[1] - y);
            let d = u.hypot(v);
            // Beyond the cylinder: cos(β − β₀) < (r² + d² − R²)/(2 r d).
            if d > 1e-12 {
                let axis = [-(u * dx + v * dy) / d, -(v * dx - u * dy) / d];
                gaps.cover_cap(axis, -(r * r + d * d - radius * radius) / (2.0 * r * d));
            } else if r > *radius {
                gaps.0.clear();
            }
        }
        Blank::Heights(relief) => {
            if z < relief.extent.min.z {
                gaps.0.clear();
                return;
            }
            let place = |[cos, sin]: [f64; 2]| [x + r * (cos * dx - sin * dy), y + r * (cos * dy + sin * dx)];
            let above = |at: [f64; 2]| {
                let [x, y] = place(at);
                relief.surface(x, y).max(FAR_BELOW) - z
            };
            // An arc of less than half a turn lies within the circle over its chord.
            let inside = |[from, to]: &Interval| {
                let ahead = from.at[0] * to.at[1] - from.at[1] * to.at[0] > 0.0;
                let middle = [0, 1].map(|axis| 0.5 * (from.at[axis] + to.at[axis]));
                ahead && relief.lowest_about(place(middle), 0.5 * r * chord(from, to)) > z
            };
            gaps.keep_points(r, relief.cell[0].min(relief.cell[1]), &inside, &above);
        }
    }
}
