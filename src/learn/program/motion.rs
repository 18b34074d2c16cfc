//! Speed and acceleration along the path at a time of the program. In: timeline, machine. Out: mm/s, mm/s².
//!
//! A rapid is one spot that begins and ends at rest: v = min(a·t, v_max, a·(T − t)) over time, or min(√(2 a s), v_max,
//! √(2 a (L − s))) over distance, with the limits of the axes in its direction and the rapid speed. Along feed moves
//! the speed is that of the spot, and the acceleration the difference of the neighbouring speeds over the time between
//! their middles.

use crate::learn::program::timeline::{Activity, Spot, Timeline};
use crate::machine::{Axis, Machine};

/// Speed and acceleration at `time_s` of the spot `index`. `by_way`: the elapsed share of a rapid's time stands for the
/// share of its length, as for samples placed by their positions.
pub fn motion(timeline: &Timeline, index: usize, time_s: f64, by_way: bool, machine: &Machine) -> (f64, f64) {
    let spot = &timeline.spots[index];
    match spot.activity {
        Activity::Rapid => rapid(spot, time_s, by_way, machine),
        Activity::Feed => (spot.speed_mm_s(), change(&timeline.spots, index)),
        _ => (0.0, 0.0),
    }
}

fn rapid(spot: &Spot, time_s: f64, by_way: bool, machine: &Machine) -> (f64, f64) {
    let along = |of: fn(&Axis) -> f64| {
        let each = machine.axes.iter().zip(spot.direction.iter());
        each.map(|(axis, d)| of(axis) / d.abs().max(1e-9)).fold(f64::INFINITY, f64::min)
    };
    let (most, a) = (along(|axis| axis.velocity_mm_s).min(machine.rapid_mm_s), along(|axis| axis.acceleration_mm_s2));
    let (since, left) = ((time_s - spot.start_s).max(0.0), (spot.end_s - time_s).max(0.0));
    let way_mm = spot.length_mm * since.min(left) / (spot.end_s - spot.start_s).max(1e-9);
    let ramp = if by_way { (2.0 * a * way_mm).sqrt() } else { a * since.min(left) };
    if ramp < most { (ramp, if since < left { a } else { -a }) } else { (most, 0.0) }
}

fn change(spots: &[Spot], index: usize) -> f64 {
    let near = |k: usize| spots.get(k).filter(|s| s.activity == Activity::Feed).unwrap_or(&spots[index]);
    let (before, after) = (near(index.wrapping_sub(1)), near(index + 1));
    let middle = |s: &Spot| f64::midpoint(s.start_s, s.end_s);
    let between = middle(after) - middle(before);
    if between > 1e-9 { (after.speed_mm_s() - before.speed_mm_s()) / between } else { 0.0 }
}
