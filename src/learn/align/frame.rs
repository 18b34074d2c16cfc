//! A log whose positions are machine coordinates while the program has work coordinates. In: log, timeline. Out: the
//! shift of the log against the program, mm, if there is one.
//!
//! Each axis gives up to three guesses of the shift: differences of the minima, of the medians and of the maxima of log
//! and path. The guess under which most positions lie near the path is refined by least squares: for a position p whose
//! nearest point of the path is q, on a line along t, the shift δ minimises Σ |(I − t tᵀ)(p − δ − q)|². It is accepted
//! if with it nearly all positions lie on the path, and without it few. Positions in inches are found the same way: as they are written few lie
//! on the path, and times 25.4 nearly all do, with a shift or without.

use crate::learn::log::Log;
use crate::learn::program::timeline::Timeline;
use crate::path::Vec3;
use crate::units::MM_PER_INCH;

/// Distance within which a position lies on the path, mm: as in the alignment; and near it, for a guess: about the
/// distance between two samples, as corners are rarely sampled exactly.
const ON_PATH_MM: f64 = 1.0;
const NEAR_MM: f64 = 6.0;
/// Least share of positions on the path with the shift, and largest share without it. Judgement.
const IN_FRAME: f64 = 0.8;
const ELSEWHERE: f64 = 0.5;
/// Number of positions of the log that are used, and most iterations of least squares.
const PLACES: usize = 240;
const ROUNDS: usize = 12;
/// Guesses of an axis closer than this count as one, mm.
const SAME_MM: f64 = 0.05;

/// The shift of a log's positions against the program, mm; `None` if there is none.
pub fn shift_mm(log: &Log, timeline: &Timeline) -> Option<Vec3> {
    let places = places(log)?;
    let path: Vec<(Vec3, Vec3)> = timeline.spots.iter().filter(|s| s.length_mm > 0.0).map(|s| (s.from, s.to)).collect();
    if places.len() < PLACES / 4 || path.is_empty() {
        return None;
    }
    if share_within(&places, &path, Vec3::zeros(), ON_PATH_MM) >= ELSEWHERE {
        return None;
    }
    let guesses = [0, 1, 2].map(|axis| guesses(log, &path, axis));
    let mut best = (0.0, Vec3::zeros());
    for x in &guesses[0] {
        for y in &guesses[1] {
            for z in &guesses[2] {
                let shift = Vec3::new(*x, *y, *z);
                let share = share_within(&places, &path, shift, NEAR_MM);
                best = if share > best.0 { (share, shift) } else { best };
            }
        }
    }
    let found = refined(&places, &path, best.1);
    (share_within(&places, &path, found, ON_PATH_MM) >= IN_FRAME).then_some(found)
}

/// The positions of a log in millimetres if they are inches, which its header does not say.
fn from_inches(log: &Log, timeline: &Timeline) -> Option<[Vec<f64>; 3]> {
    let path: Vec<(Vec3, Vec3)> = timeline.spots.iter().filter(|s| s.length_mm > 0.0).map(|s| (s.from, s.to)).collect();
    let axes = log.position_mm.as_ref().filter(|_| !path.is_empty())?;
    let scaled = [0, 1, 2].map(|axis| axes[axis].iter().map(|inches| inches * MM_PER_INCH).collect::<Vec<f64>>());
    let times = Log { time_s: log.time_s.clone(), position_mm: Some(scaled), ..Log::default() };
    let share = |log: &Log| share_within(&places(log).unwrap_or_default(), &path, Vec3::zeros(), ON_PATH_MM);
    let [as_written, as_inches] = [log, &times].map(share);
    // The few millimetres that inches of a small part are may lie on the path too, if not as well.
    let is_here = as_inches >= IN_FRAME && as_inches > as_written;
    let is_found = is_here || (as_written < ELSEWHERE && shift_mm(&times, timeline).is_some());
    is_found.then_some(times.position_mm).flatten()
}

/// Subtracts the shift from the positions of a log, with a warning; positions in inches become millimetres first.
pub fn in_work_frame(log: &mut Log, timeline: &Timeline) {
    if let Some(axes) = from_inches(log, timeline) {
        log.position_mm = Some(axes);
        log.warnings.push("the positions are inches: times 25.4 they lie on the path of the program".to_owned());
    }
    let Some(shift) = shift_mm(log, timeline) else { return };
    if let Some(axes) = &mut log.position_mm {
        for (axis, by) in axes.iter_mut().zip(shift.iter()) {
            for value in axis {
                *value -= by;
            }
        }
    }
    if is_of_other_depth(&shift, timeline) {
        log.higher_mm = Some(shift.z);
    }
    log.warnings.push(format!(
        "the positions are not those of the work frame (machine coordinates?): X {:+.3} Y {:+.3} Z {:+.3} mm against \
         the program, taken off",
        shift.x, shift.y, shift.z
    ));
}

/// Does a shift leave X and Y where they are, and Z within the heights of the path? Another zero of Z and cuts of another depth then look the
/// same; a shift beyond those heights is that of machine coordinates, or the length of a tool.
fn is_of_other_depth(shift: &Vec3, timeline: &Timeline) -> bool {
    let heights = || timeline.spots.iter().flat_map(|spot| [spot.from.z, spot.to.z]);
    let range_mm = heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min);
    shift.xy().amax() <= ON_PATH_MM && (ON_PATH_MM..range_mm).contains(&shift.z.abs())
}

/// Positions at which the machine moves, spread evenly over the log.
fn places(log: &Log) -> Option<Vec<Vec3>> {
    let axes = log.position_mm.as_ref()?;
    let at = |i: usize| Vec3::new(axes[0][i], axes[1][i], axes[2][i]);
    let moves = |i: &usize| (at(*i) - at(*i - 1)).norm() > 1e-3;
    let all: Vec<Vec3> =
        (1..log.time_s.len()).filter(moves).map(at).filter(|p| p.iter().all(|v| v.is_finite())).collect();
    Some(all.iter().step_by(all.len().div_ceil(PLACES).max(1)).copied().collect())
}

/// Guesses of the shift of an axis, mm.
fn guesses(log: &Log, path: &[(Vec3, Vec3)], axis: usize) -> Vec<f64> {
    let sorted = |mut values: Vec<f64>| {
        values.retain(|v| v.is_finite());
        values.sort_by(f64::total_cmp);
        values
    };
    let seen = sorted(log.position_mm.as_ref().map(|axes| axes[axis].clone()).unwrap_or_default());
    let known = sorted(path.iter().flat_map(|(from, to)| [from[axis], to[axis]]).collect());
    let mut found: Vec<f64> = Vec::new();
    for share in [0.0, 0.5, 1.0] {
        let of = |values: &[f64]| values.get(((values.len().max(1) - 1) as f64 * share) as usize).copied();
        let guess = of(&seen).zip(of(&known)).map(|(a, b)| a - b);
        found.extend(guess.filter(|g| found.iter().all(|other| (g - other).abs() > SAME_MM)));
    }
    found
}

/// Nearest point of the path and the unit tangent there.
fn nearest(path: &[(Vec3, Vec3)], p: Vec3) -> (Vec3, Vec3) {
    let mut best = (f64::INFINITY, Vec3::zeros(), Vec3::zeros());
    for (from, to) in path {
        let along = to - from;
        let t = ((p - from).dot(&along) / along.norm_squared().max(1e-12)).clamp(0.0, 1.0);
        let point = from + along * t;
        let distance = (p - point).norm_squared();
        if distance < best.0 {
            best = (distance, point, along);
        }
    }
    (best.1, best.2 / best.2.norm().max(1e-9))
}

fn share_within(places: &[Vec3], path: &[(Vec3, Vec3)], shift: Vec3, mm: f64) -> f64 {
    let near = places.iter().filter(|p| (nearest(path, *p - shift).0 - (*p - shift)).norm() < mm).count();
    near as f64 / places.len().max(1) as f64
}

/// The shift refined by least squares over the positions near the path.
fn refined(places: &[Vec3], path: &[(Vec3, Vec3)], mut shift: Vec3) -> Vec3 {
    for _ in 0..ROUNDS {
        let (mut normal, mut rhs) = (nalgebra::Matrix3::zeros(), Vec3::zeros());
        for place in places {
            let p = place - shift;
            let (point, along) = nearest(path, p);
            let off = p - point;
            if off.norm() > NEAR_MM {
                continue;
            }
            let across = nalgebra::Matrix3::identity() - along * along.transpose();
            normal += across;
            rhs += across * off;
        }
        let Some(step) = normal.try_inverse().map(|inverse| inverse * rhs) else { break };
        shift += step;
        if step.norm() < 1e-5 {
            break;
        }
    }
    shift
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::program::timeline::{Activity, Spot};

    /// Three passes to and fro at two depths, and the way between.
    fn timeline() -> Timeline {
        let mut at = Vec3::new(-10.0, 0.0, 5.0);
        let mut spots = Vec::new();
        let mut to = |p: Vec3| {
            spots.push(Spot {
                start_s: 0.0,
                end_s: 1.0,
                activity: Activity::Feed,
                move_id: None,
                middle_mm: 0.0,
                line: 1,
                block: 0,
                tool: 1,
                coolant: false,
                rps: 100.0,
                from: at,
                to: p,
                direction: Vec3::x(),
                length_mm: (p - at).norm(),
                curvature_per_mm: 0.0,
                engaged: crate::force::contact::Engaged::default(),
            });
            at = p;
        };
        for (z, y) in [(-1.0, 0.0), (-1.0, 4.0), (-2.5, 9.0), (-2.5, 16.0)] {
            to(Vec3::new(-10.0, y, 5.0));
            to(Vec3::new(-10.0, y, z));
            to(Vec3::new(60.0, y, z));
            to(Vec3::new(60.0, y, 5.0));
        }
        Timeline { spots, ..Timeline::default() }
    }

    /// A place every 0.7 mm of the path from `skip` mm on, shifted.
    fn log(timeline: &Timeline, shift: Vec3, skip: f64) -> Log {
        let mut axes = [Vec::new(), Vec::new(), Vec::new()];
        let mut gone = 0.0;
        for spot in &timeline.spots {
            let n = (spot.length_mm / 0.7).ceil() as usize;
            for k in 0..n {
                let p = spot.from + (spot.to - spot.from) * (k as f64 / n as f64) + shift;
                gone += spot.length_mm / n as f64;
                if gone > skip {
                    axes.iter_mut().zip(p.iter()).for_each(|(axis, v)| axis.push(*v));
                }
            }
        }
        Log { time_s: (0..axes[0].len()).map(|i| 0.1 * i as f64).collect(), position_mm: Some(axes), ..Log::default() }
    }

    #[test]
    fn machine_coordinates_are_brought_to_the_work_frame_and_it_is_said() {
        let timeline = timeline();
        let shift = Vec3::new(-312.417, 148.2, -95.05);
        let mut machine = log(&timeline, shift, 0.0);
        let found = shift_mm(&machine, &timeline).unwrap();
        assert!((found - shift).norm() < 0.01, "{found}");
        in_work_frame(&mut machine, &timeline);
        assert!(machine.warnings[0].contains("X -312.417 Y +148.200 Z -95.050"), "{:?}", machine.warnings);
        assert_eq!(shift_mm(&machine, &timeline), None);
    }

    #[test]
    fn a_shift_of_z_within_the_heights_of_the_path_may_be_another_depth() {
        let timeline = timeline();
        let higher = |shift: Vec3| {
            let mut log = log(&timeline, shift, 0.0);
            in_work_frame(&mut log, &timeline);
            log.higher_mm.map(f64::round)
        };
        assert_eq!(higher(Vec3::new(0.0, 0.0, 4.0)), Some(4.0));
        assert_eq!([Vec3::new(0.0, 0.0, 120.0), Vec3::new(40.0, -7.3, 4.0), Vec3::zeros()].map(higher), [None; 3]);
    }

    #[test]
    fn positions_in_inches_are_found_in_the_work_frame_and_elsewhere_and_others_are_left() {
        let timeline = timeline();
        let read = |shift: Vec3, unit_mm: f64| {
            let mut log = log(&timeline, shift, 0.0);
            log.position_mm.iter_mut().flatten().flatten().for_each(|value| *value /= unit_mm);
            let first = log.position_mm.as_ref().unwrap()[0][0];
            in_work_frame(&mut log, &timeline);
            let is_said = log.warnings.iter().any(|warning| warning.contains("inches"));
            (log.position_mm.unwrap()[0][0] - first, is_said)
        };
        let (by, is_said) = read(Vec3::zeros(), 25.4);
        assert!((by + 10.0 - 10.0 / 25.4).abs() < 0.05 && is_said, "{by}");
        assert!(read(Vec3::new(-312.4, 148.2, -95.0), 25.4).1);
        assert_eq!(read(Vec3::zeros(), 1.0), (0.0, false));
        assert!(!read(Vec3::zeros(), 10.0).1 && !read(Vec3::new(40.0, -7.3, 120.0), 1.0).1);
    }

    #[test]
    fn a_log_that_begins_in_mid_program_is_found_by_its_other_corners() {
        let timeline = timeline();
        let shift = Vec3::new(40.0, -7.3, 120.0);
        let found = shift_mm(&log(&timeline, shift, 100.0), &timeline).unwrap();
        assert!((found - shift).norm() < 0.01, "{found}");
    }

    #[test]
    fn a_log_of_another_program_is_not_pressed_onto_the_path() {
        let timeline = timeline();
        let mut other = log(&timeline, Vec3::zeros(), 0.0);
        // A circle of 40 mm.
        let n = other.time_s.len();
        let angle = |i: usize| 12.0 * i as f64 / n as f64;
        let circle = |f: fn(f64) -> f64| (0..n).map(|i| 400.0 + 40.0 * f(angle(i))).collect();
        other.position_mm = Some([circle(f64::cos), circle(f64::sin), (0..n).map(|i| 0.05 * i as f64).collect()]);
        assert_eq!(shift_mm(&other, &timeline), None);
    }
}
