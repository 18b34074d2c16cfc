//! Passes along the ends of steep ground. In: the tool on the surface, the borders of its steep part, passes of one height. Out: stretches of
//! passes along those borders where passes of one height leave more than the scallop limit.
//!
//! Steep ground rarely ends at one height: at a rim, at shallower ground above, at a floor below. Between the last pass of one height and
//! such an end a strip stays that may be as wide as a whole step, and a step leaves its scallop limit only between two passes. At every place
//! of a border the height left at the point that the tool would touch there is measured against all passes of one height; where it is above
//! the limit, a pass follows the border. Where steep ground ends at the side, passes end there one above the other, and less is left.

use super::left::{distance_mm, reach_mm};
use super::levels::{Curve, downhill};
use super::near::Near;
use super::order::LevelStretch;
use super::passes::Requirements;
use super::path::finely_level;
use super::plan::{Spot, StepLimit, is_beyond};
use super::reach::ToolOnSurface;
use super::section::Beside;
use super::steep::{Steep, Under, bridge, short_mm};
use crate::path::{self, Vec3};
use rayon::prelude::*;

/// Part of the scallop limit that may stay beyond a pass that runs beside the end of the ground, and by which chords of passes of one height may
/// be off for the measurement.
const PART: f64 = 0.02;

/// A place at which steep ground ends.
#[derive(Debug, Clone, Copy)]
pub struct End {
    /// The place, mm.
    pub at: [f64; 2],
    /// Height of the tip there, mm.
    pub tip_mm: f64,
}

/// The borders of the steep ground, so close that a pass along their chords leaves nothing to speak of beyond them.
pub fn borders(on_surface: &ToolOnSurface, steep: &Steep, scallop_mm: f64) -> Vec<Curve> {
    steep.borders(on_surface.dropper, beside_mm(on_surface.shape().corner_mm, scallop_mm))
}

/// How far beside the end of the ground a pass may run, mm: a corner of radius r at a distance d leaves d²/2r there.
fn beside_mm(corner_mm: f64, scallop_mm: f64) -> f64 {
    (2.0 * corner_mm * PART * scallop_mm).sqrt()
}

/// The places of a border.
pub fn of(on_surface: &ToolOnSurface, border: &Curve) -> Vec<End> {
    let end = |at: &[f64; 2]| Some(End { at: *at, tip_mm: on_surface.dropper.drop(*at)?.tip_mm });
    border.points.par_iter().filter_map(end).collect()
}

/// The stretches of the borders along which passes of one height leave more than the scallop limit.
pub fn stretches(
    on_surface: &ToolOnSurface,
    required: &Requirements,
    borders: &[Curve],
    levels: &[LevelStretch],
) -> Vec<LevelStretch> {
    let curves = curves(on_surface, levels, required.bounds.scallop_mm);
    let near = Near::new(&curves, reach_mm(on_surface.shape(), required.bounds.scallop_mm));
    borders.iter().flat_map(|border| along(on_surface, required, border, &near)).collect()
}

/// Passes of one height as chords.
fn curves(on_surface: &ToolOnSurface, levels: &[LevelStretch], scallop_mm: f64) -> Vec<path::Curve> {
    let points = |level: &LevelStretch| {
        let level_mm = level.level_mm?;
        Some(finely_level(&level.spots, level_mm, on_surface.dropper, 5.0 * PART * scallop_mm))
    };
    let chords = |points: Vec<(Vec3, StepLimit)>| {
        let chord = |two: &[(Vec3, StepLimit)]| path::Curve::Line { from: two[0].0, to: two[1].0 };
        points.windows(2).map(chord).collect::<Vec<_>>()
    };
    levels.par_iter().filter_map(points).flat_map_iter(chords).collect()
}

/// The stretches of one border.
fn along(on_surface: &ToolOnSurface, required: &Requirements, border: &Curve, near: &Near) -> Vec<LevelStretch> {
    let dropper = on_surface.dropper;
    let too_high = |p: &[f64; 2]| {
        dropper.drop(*p).is_some_and(|contact| {
            let left_mm = distance_mm(near, on_surface.shape(), contact.point, contact.normal);
            is_beyond(left_mm.min((on_surface.stock_mm)(&contact)), required.bounds.scallop_mm)
        })
    };
    let high: Vec<bool> = border.points.par_iter().map(too_high).collect();
    let mut kept = widened(&high, border.closed);
    let points: Vec<([f64; 2], Under)> = border.points.iter().map(|p| (*p, Under::Steep)).collect();
    bridge(&points, &mut kept, border.closed, short_mm(dropper));
    let whole = border.closed && kept.iter().all(|kept| *kept);
    let mut numbers: Vec<usize> = (0..kept.len()).collect();
    // Rotated to start at a gap, so that no stretch of a closed border wraps around.
    let first_gap = kept.iter().position(|kept| !kept).filter(|_| border.closed).unwrap_or(0);
    numbers.rotate_left(first_gap);
    let runs = numbers.chunk_by(|a, b| kept[*a] == kept[*b]).filter(|run| kept[run[0]] && run.len() > 1);
    let places = |run: &[usize]| run.iter().map(|k| border.points[*k]).collect::<Vec<_>>();
    runs.map(|run| stretch((on_surface, required), places(run), whole, near)).collect()
}

/// Where a value is true, and one place more either way.
fn widened(high: &[bool], closed: bool) -> Vec<bool> {
    let last = high.len() - 1;
    let before = |k: usize| if k > 0 { Some(k - 1) } else { Some(last).filter(|_| closed) };
    let after = |k: usize| if k < last { Some(k + 1) } else { Some(0).filter(|_| closed) };
    (0..high.len()).map(|k| high[k] || [before(k), after(k)].into_iter().flatten().any(|k| high[k])).collect()
}

/// A stretch along some places, with the higher ground on its right.
fn stretch(
    (on_surface, required): (&ToolOnSurface, &Requirements),
    mut places: Vec<[f64; 2]>,
    closed: bool,
    near: &Near,
) -> LevelStretch {
    let falls_right = |k: usize| {
        let way = heading(&places, k, closed);
        let down = on_surface.dropper.drop(places[k]).as_ref().and_then(downhill).unwrap_or_default();
        down[0] * way[1] - down[1] * way[0]
    };
    if (0..places.len()).map(falls_right).sum::<f64>() > 0.0 {
        places.reverse();
    }
    let spot = |k: usize| spot((on_surface, required), places[k], heading(&places, k, closed), near);
    let spots = (0..places.len()).into_par_iter().filter_map(spot).collect();
    LevelStretch { spots, closed, back: false, parents: Vec::new(), level_mm: None }
}

/// Unit direction of a line of places at one of them.
fn heading(places: &[[f64; 2]], k: usize, closed: bool) -> [f64; 2] {
    let count = places.len();
    let (before, after) =
        if closed { ((k + count - 1) % count, (k + 1) % count) } else { (k.saturating_sub(1), (k + 1).min(count - 1)) };
    let along = [0, 1].map(|axis| places[after][axis] - places[before][axis]);
    let length = along[0].hypot(along[1]);
    if length > 0.0 { along.map(|x| x / length) } else { [1.0, 0.0] }
}

/// A spot of a pass along a border with its loads, beside the nearest pass of one height.
fn spot(
    (on_surface, required): (&ToolOnSurface, &Requirements),
    at: [f64; 2],
    ahead: [f64; 2],
    near: &Near,
) -> Option<Spot> {
    let tip = Vec3::new(at[0], at[1], on_surface.dropper.drop(at)?.tip_mm);
    let beside = near.nearest(tip).map(|(beside, _)| beside);
    let nowhere = tip + 10.0 * on_surface.shape().radius_mm() * Vec3::new(-ahead[1], ahead[0], 0.0);
    let here = on_surface.here(at, ahead, beside.map_or(Beside::Edge(nowhere), Beside::Pass))?;
    let line = on_surface.line(&here);
    let feed_mm_s = required.fastest_mm_s(&line);
    let force_n = line.loads(feed_mm_s).force_xy_peak_n;
    let step_mm = beside.map_or(0.0, |beside| (tip - beside).norm());
    Some(Spot { at, step_mm, feed_mm_s, force_n, scallop_mm: here.scallop_mm, beside, limit: StepLimit::Edge, tip })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On level ground the end lies √(r² + d²) − r from a corner that passes d beside it: up to 0.0002 mm at a limit of 0.01 mm.
    #[test]
    fn a_pass_may_run_so_far_beside_the_end_that_a_fiftieth_of_the_limit_stays() {
        let (corner_mm, beside_mm) = (3.0, beside_mm(3.0, 0.01));
        let left_mm = |beside_mm: f64| beside_mm.hypot(corner_mm) - corner_mm;
        assert!(left_mm(0.995 * beside_mm) < 0.0002 && left_mm(1.005 * beside_mm) > 0.0002);
    }

    #[test]
    fn a_stretch_begins_and_ends_one_place_beside_what_is_too_high() {
        let high = [true, false, false, false, true, false];
        assert_eq!(widened(&high, true), [true, true, false, true, true, true]);
        assert_eq!(widened(&high, false), [true, true, false, true, true, true]);
        assert_eq!(widened(&[false, false, false, true], true), [true, false, true, true]);
        assert_eq!(widened(&[false, false, false, true], false), [false, false, true, true]);
    }
}
