//! Speed through the corner between two moves. In: directions and lengths of both, path tolerance, axis accelerations.
//! Out: highest speed, mm/s.
//!
//! The control rounds a corner that turns by φ with an arc that stays within the tolerance δ of it: its radius is
//! R = δ·cos(φ/2) / (1 − cos(φ/2)), and it takes R·tan(φ/2) of both moves, of which it may use half. Along it
//! v² = a·R, a being what the axes give in the direction of the change. A bend so small that the jump of velocity
//! v·2 sin(φ/2) is made in one servo period T at that acceleration needs no rounding.

use crate::machine::Axis;
use crate::path::Vec3;

/// Servo period of a control, s.
pub const SERVO_S: f64 = 0.001;

/// One side of a corner.
#[derive(Debug, Clone, Copy)]
pub struct Side {
    /// Unit direction of travel at the corner.
    pub tangent: Vec3,
    /// Length of the move, mm.
    pub length_mm: f64,
}

/// Highest speed through the corner, mm/s; infinite where the path goes straight on.
pub fn corner_speed(before: Side, after: Side, tolerance_mm: f64, axes: &[Axis; 3]) -> f64 {
    let change = after.tangent - before.tangent;
    let jump = change.norm(); // 2 sin(φ/2)
    if jump < 1e-9 {
        return f64::INFINITY;
    }
    let accel = along(axes, change / jump);
    let sin = (0.5 * jump).min(1.0);
    let cos = (1.0 - sin * sin).sqrt();
    let step = accel * SERVO_S / jump;
    if cos <= 0.0 {
        return step;
    }
    let within_tolerance = tolerance_mm * cos / (1.0 - cos);
    let within_moves = 0.5 * before.length_mm.min(after.length_mm) * cos / sin;
    step.max((accel * within_tolerance.min(within_moves)).sqrt())
}

/// Highest acceleration in a unit direction, mm/s².
pub fn along(axes: &[Axis; 3], direction: Vec3) -> f64 {
    least_ratio(axes.map(|axis| axis.acceleration_mm_s2), direction)
}

/// Highest velocity in a unit direction, mm/s.
pub fn speed_along(axes: &[Axis; 3], direction: Vec3) -> f64 {
    least_ratio(axes.map(|axis| axis.velocity_mm_s), direction)
}

/// Highest jerk in a unit direction, mm/s³; infinite when no axis has a limit.
pub fn jerk_along(axes: &[Axis; 3], direction: Vec3) -> f64 {
    least_ratio(axes.map(|axis| axis.jerk_mm_s3.unwrap_or(f64::INFINITY)), direction)
}

fn least_ratio(limit: [f64; 3], direction: Vec3) -> f64 {
    (0..3).filter(|&i| direction[i].abs() > 1e-9).map(|i| limit[i] / direction[i].abs()).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes(accel: f64) -> [Axis; 3] {
        [Axis { velocity_mm_s: 100.0, acceleration_mm_s2: accel, jerk_mm_s3: None }; 3]
    }

    #[test]
    fn right_angle_within_tolerance() {
        let side = |x, y| Side { tangent: Vec3::new(x, y, 0.0), length_mm: 1e3 };
        let v = corner_speed(side(1.0, 0.0), side(0.0, 1.0), 0.01, &axes(500.0));
        // The change points along the diagonal, where two axes give √2 of one; R = δ / (√2 − 1).
        let expected = (500.0 * 2f64.sqrt() * 0.01 / (2f64.sqrt() - 1.0)).sqrt();
        assert!((v - expected).abs() < 1e-9, "{v} {expected}");
        assert!(corner_speed(side(1.0, 0.0), side(1.0, 0.0), 0.0, &axes(500.0)).is_infinite());
        assert!(corner_speed(side(1.0, 0.0), side(-1.0, 0.0), 0.1, &axes(500.0)) <= 0.25 + 1e-12);
    }
}
