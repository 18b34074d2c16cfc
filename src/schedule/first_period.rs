//! The servo period in which the control goes from one primitive to the next. In: a plan and the speeds at its points, as fast as its primitives
//! allow. Out: the time of each leg, with the speeds that are left.
//!
//! A primitive ends within a period, and for the rest of that period, half of one in the mean, the next one is planned as if nothing followed it
//! (`tpHandleSplitCycle` in LinuxCNC's `tp.c` gives `tpUpdateCycle` no next segment): where it cannot stop on it, it brakes with all of its
//! acceleration. From v₀ to v₀ − a T/2, T being the period, then on as planned over what is left of it. Where the path is a chain of short lines and
//! arcs on which the speed should rise, that is lost at each of them.

use super::control::{Control, Plan, time_of_leg};
use super::corner::SERVO_S;
use super::exact_pass::Leg;
use crate::ids::MoveId;

/// The part of a period that is left when a primitive ends within it, s: anything from none to all of it.
const LEFT_S: f64 = 0.5 * SERVO_S;

/// Time of each leg of a plan, s; `b` is the square of the speed at its points.
pub fn leg_times(plan: &Plan, mut b: Vec<f64>, control: &Control, is_rapid: impl Fn(MoveId) -> bool) -> Vec<f64> {
    let mut times = Vec::with_capacity(plan.chain.legs.len());
    for (i, leg) in plan.chain.legs.iter().enumerate() {
        let ramps = plan.chain.point_b[i + 1] > 0.0 && !is_rapid(plan.moves[i]);
        let late = control.looks_late && plan.chain.point_b[i] > 0.0;
        let (first_s, from, rest) = if late { braked(leg, b[i]) } else { (0.0, b[i], *leg) };
        b[i + 1] = b[i + 1].min(from + 2.0 * rest.accel_mm_s2 * rest.ds_mm);
        times.push(first_s + time_of_leg(&rest, [from, b[i + 1]], ramps, control));
    }
    times
}

/// What is left of the first period of a leg, the square of the speed after it, and the rest of the leg.
fn braked(leg: &Leg, b: f64) -> (f64, f64, Leg) {
    let stops = b <= 2.0 * leg.accel_mm_s2 * leg.ds_mm;
    let speed = (b.sqrt() - leg.accel_mm_s2 * LEFT_S).max(0.0);
    let way_mm = 0.5 * (b.sqrt() + speed) * LEFT_S;
    if stops || way_mm >= leg.ds_mm || speed <= 0.0 {
        return (0.0, b, *leg);
    }
    (LEFT_S, speed * speed, Leg { ds_mm: leg.ds_mm - way_mm, ..*leg })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leg(ds_mm: f64) -> Leg {
        Leg { ds_mm, cap_b: 900.0, accel_mm_s2: 500.0, jerk_mm_s3: f64::INFINITY, first_row: 0, row_count: 0 }
    }

    /// At 25 mm/s and 500 mm/s² the way to a stop is 0.625 mm: on 0.62 mm it brakes for half a period, by 0.25 mm/s, on 0.63 mm it does not.
    #[test]
    fn it_brakes_where_it_cannot_stop() {
        let (first_s, b, rest) = braked(&leg(0.62), 625.0);
        assert!((first_s - 0.0005).abs() < 1e-12 && (b.sqrt() - 24.75).abs() < 1e-12);
        assert!((rest.ds_mm - (0.62 - 0.0005 * 24.875)).abs() < 1e-12);
        let (first_s, b, rest) = braked(&leg(0.63), 625.0);
        assert!(first_s == 0.0 && b == 625.0 && rest == leg(0.63));
    }

    /// Ten legs of 0.1 mm on which the speed rises from 20 mm/s at 500 mm/s²: at the beginning of each half a period of braking in place of
    /// half a period of rising. Only a control that looks late loses them, and a first leg after a stop loses nothing.
    #[test]
    fn rising_is_late_on_each_short_leg() {
        let mut plan = Plan::default();
        plan.chain.legs = vec![Leg { cap_b: f64::INFINITY, ..leg(0.1) }; 10];
        plan.chain.point_b = vec![f64::INFINITY; 11];
        plan.moves = (0..10).map(MoveId).collect();
        let b: Vec<f64> = (0..11).map(|k| 400.0 + 100.0 * f64::from(k)).collect();
        let exact = Control {
            look_ahead: None,
            joins_lines: false,
            kink_share: 0.1,
            kink_slows: false,
            slow_before_stop: false,
            ramp_s: 0.0,
            looks_late: false,
            feed_changes_anywhere: false,
        };
        let late = Control { looks_late: true, ..exact };
        let total = |control: &Control| leg_times(&plan, b.clone(), control, |_| false).iter().sum::<f64>();
        let expected = (1400f64.sqrt() - 20.0) / 500.0;
        assert!((total(&exact) - expected).abs() < 1e-9);
        // Each leg takes a period more to reach the same speed, less what the lower speed shortens.
        let lost = total(&late) - expected;
        assert!(lost > 0.002 && lost < 0.006, "{lost}");
    }
}
