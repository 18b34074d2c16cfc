//! The part of a circle inside a disc. In: a circle about the cutter's axis, a disc in the same frame. Out: the covered angles, and where they
//! end.

use super::gaps::{Dir, Gaps};
use std::f64::consts::PI;

/// Two directions nearer to each other than this count as one, rad: the accuracy of borders.
pub(super) const LEAST_RAD: f64 = 1e-7;
/// An end may fall short of the point that a stretch begins at by this much through rounding, rad.
const ASIDE_RAD: f64 = 1e-5;

/// Covers a circle of radius `r` by a disc with the square `square` of its radius.
pub(super) fn disc(gaps: &mut Gaps, r: f64, [x, y]: [f64; 2], square: f64) {
    let Some([a, b]) = gaps.hull() else { return };
    if square <= 0.0 {
        return;
    }
    let d2 = x * x + y * y;
    let above = r * r + d2 - square;
    let twice = [2.0 * r * x, 2.0 * r * y];
    let (first, last) = (a.along(twice) >= above, b.along(twice) >= above);
    if !first && !last && !gaps.may_meet(twice, above) {
        return;
    }
    if d2 < 1e-24 {
        if above <= 0.0 {
            gaps.0.clear();
        }
        return;
    }
    if first && last && !gaps.may_meet([-twice[0], -twice[1]], -above) {
        gaps.0.clear();
        return;
    }
    let d = d2.sqrt();
    gaps.cover_cap([x / d, y / d], above / (2.0 * r * d));
}

/// The direction in which a circle of radius `r` about the origin, inside a disc at `at`, leaves that disc; `None`: nowhere.
pub(super) fn end_of_disc(at: &Dir, r: f64, [x, y]: [f64; 2], radius: f64) -> Option<Dir> {
    let d = (x * x + y * y).sqrt();
    let above = r * r + d * d - radius * radius;
    if d < 1e-12 || above <= -2.0 * r * d {
        return None;
    }
    end_of_cap(at, [x / d, y / d], above / (2.0 * r * d))
}

/// The direction in which the circle, outside a disc at `at`, comes back to the tangent of the disc nearest to that point; `None`: nowhere.
pub(super) fn end_of_clear(at: &Dir, r: f64, [x, y]: [f64; 2], radius: f64) -> Option<Dir> {
    let off = [r * at.at[0] - x, r * at.at[1] - y];
    let by = 1.0 / (off[0] * off[0] + off[1] * off[1]).sqrt();
    let normal = off.map(|x| x * by);
    let least = (normal[0] * x + normal[1] * y + radius) / r;
    if least <= -1.0 { None } else { end_of_cap(at, normal, least) }
}

/// The counter-clockwise end of the cap of directions with a component of at least `least` along a unit vector. `at` lies in the cap; the
/// end is at least [`LEAST_RAD`] from it. `None` if the end lies beyond the turn that `at` is in.
fn end_of_cap(at: &Dir, [x, y]: [f64; 2], least: f64) -> Option<Dir> {
    let least = least.min(1.0);
    let side = ((1.0 - least) * (1.0 + least)).sqrt();
    let end = Dir::of([x * least - y * side, y * least + x * side]);
    let turn = at.at[0] * end.at[1] - at.at[1] * end.at[0];
    if at.along(end.at) > 0.0 && turn.abs() < LEAST_RAD || (turn < 0.0 && turn > -ASIDE_RAD && at.along(end.at) > 0.0) {
        let [cos, sin] = at.at;
        return ahead_of(at, Dir::of([cos - LEAST_RAD * sin, sin + LEAST_RAD * cos]));
    }
    ahead_of(at, end)
}

/// `next`, if it comes after `at` in the same turn.
fn ahead_of(at: &Dir, next: Dir) -> Option<Dir> {
    (next.key > at.key).then_some(next)
}

/// Half the angle that a disc at distance `d` covers of a circle of radius `r`, the square of its radius given.
pub(super) fn half_width(r: f64, d: f64, square: f64) -> f64 {
    let above = r * r + d * d - square;
    if d < 1e-12 {
        return if above <= 0.0 { PI } else { 0.0 };
    }
    (above / (2.0 * r * d)).clamp(-1.0, 1.0).acos()
}
