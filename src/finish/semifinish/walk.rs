//! How far a path lies beside the curve that it takes the place of, both walked in order. In: the curve, the pieces in
//! its place. Out: an upper bound of their Fréchet distance, mm.
//!
//! Two paths a and b are within δ of each other in the order of walking if both can be walked from end to end, s(τ)
//! along a and t(τ) along b, without a step back, so that |a(s) − b(t)| ≤ δ at every τ (Alt and Godau 1995). Such a walk
//! is constructed here: in short steps along the pieces, each to the nearest place of the curve that is not behind the
//! one before. Within a step both fractions grow linearly. With D₀ and D₁ the differences at its ends
//!
//! |D(τ)| ≤ max(|D₀|, |D₁|) + (A Δs² + B Δt²)/8,
//!
//! where A and B bound the second derivatives of the curves by their fractions: 0 for a line, r θ² + 2 |Δr θ| for an
//! arc of radius r that turns by θ while its radius changes by Δr.

use crate::path::{Curve, Vec3};
use std::f64::consts::TAU;

/// Steps are so short that the second derivative of each curve adds no more than this to the bound, mm.
const FINE_MM: f64 = 1e-6;
/// Most steps along a piece; longer ones only make the bound larger.
const STEPS: f64 = 1e5;
/// Iterations for the nearest place on a helix.
const NEARER: usize = 4;

/// Upper bound of the Fréchet distance of a curve and the pieces in its place, mm.
pub fn apart_mm(curve: &Curve, pieces: &[Curve]) -> f64 {
    if pieces == [*curve] {
        return 0.0;
    }
    let (mut far_mm, mut at) = (0.0_f64, 0.0);
    for (index, piece) in pieces.iter().enumerate() {
        let count = steps(curve, piece);
        for k in 1..=count {
            let [t0, t1] = [k - 1, k].map(|k| k as f64 / count as f64);
            let last = index + 1 == pieces.len() && k == count;
            let next = if last { 1.0 } else { ahead(curve, at, place(piece, t1)) };
            far_mm = far_mm.max(step_mm((curve, [at, next]), (piece, [t0, t1])));
            at = next;
        }
    }
    far_mm
}

/// Angle by which a curve turns, rad.
pub fn turned_rad(curve: &Curve) -> f64 {
    match curve {
        Curve::Line { .. } => 0.0,
        Curve::Arc(arc) => arc.sweep_rad.abs(),
    }
}

/// Number of steps along a piece.
fn steps(curve: &Curve, piece: &Curve) -> usize {
    let length = curve.length();
    let share = if length > 0.0 { piece.length() / length } else { 0.0 };
    let count = |bend_mm: f64| (bend_mm / (8.0 * FINE_MM)).sqrt();
    (share * count(bend_mm(curve))).max(count(bend_mm(piece))).ceil().clamp(1.0, STEPS) as usize
}

/// Bound of the second derivative of a curve by its fraction, mm.
fn bend_mm(curve: &Curve) -> f64 {
    match curve {
        Curve::Line { .. } => 0.0,
        Curve::Arc(arc) => {
            let (turned, change) = (arc.sweep_rad.abs(), (arc.radius_end_mm - arc.radius_mm).abs());
            arc.radius_mm.max(arc.radius_end_mm) * turned * turned + 2.0 * change * turned
        }
    }
}

/// The point at a fraction of a curve.
fn place(curve: &Curve, fraction: f64) -> Vec3 {
    curve.point(fraction * curve.length())
}

/// The fraction of a curve nearest to a point, followed from the fraction `at` and not behind it.
fn ahead(curve: &Curve, at: f64, point: Vec3) -> f64 {
    let length = curve.length();
    if length <= 0.0 {
        return at;
    }
    let nearer = |s: f64| {
        let s = s.clamp(at, 1.0);
        s + (point - place(curve, s)).dot(&curve.tangent(s * length)) / length
    };
    let nearest = match curve {
        Curve::Line { .. } => nearer(at),
        Curve::Arc(arc) => {
            let (a, b, _) = arc.plane.axes();
            let angle = (point[b] - arc.centre[b]).atan2(point[a] - arc.centre[a]);
            let turned = angle - arc.start_rad - at * arc.sweep_rad;
            // The short way round from where the walk is.
            let turned = turned - TAU * (turned / TAU).round();
            let flat = if arc.sweep_rad == 0.0 { at } else { at + turned / arc.sweep_rad };
            if arc.rise_mm == 0.0 { flat } else { (0..NEARER).fold(flat, |s, _| nearer(s)) }
        }
    };
    nearest.clamp(at, 1.0)
}

/// Bound of the distance in a step of the walk, mm: between two fractions of each curve.
fn step_mm((curve, [s0, s1]): (&Curve, [f64; 2]), (piece, [t0, t1]): (&Curve, [f64; 2])) -> f64 {
    let bend_mm = (bend_mm(curve) * (s1 - s0).powi(2) + bend_mm(piece) * (t1 - t0).powi(2)) / 8.0;
    let parts = (bend_mm / (2.0 * FINE_MM)).sqrt().ceil().clamp(1.0, STEPS);
    let off = |k: usize| {
        let u = k as f64 / parts;
        (place(curve, s0 + u * (s1 - s0)) - place(piece, t0 + u * (t1 - t0))).norm()
    };
    (0..=parts as usize).map(off).fold(0.0, f64::max) + bend_mm / (parts * parts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::{Arc, Plane};
    use std::f64::consts::FRAC_PI_2;

    /// An arc of radius r about the origin from +X, turning by an angle and rising.
    fn arc(r: f64, sweep: f64, rise: f64) -> Curve {
        let to = Vec3::new(r * sweep.cos(), r * sweep.sin(), rise);
        Curve::Arc(Arc::new(Plane::Xy, Vec3::new(r, 0.0, 0.0), to, Vec3::zeros(), sweep))
    }

    fn lines(points: &[Vec3]) -> Vec<Curve> {
        points.windows(2).map(|two| Curve::Line { from: two[0], to: two[1] }).collect()
    }

    /// Points of a curve, `count` intervals apart.
    fn points(curve: &Curve, count: usize) -> Vec<Vec3> {
        (0..=count).map(|k| place(curve, k as f64 / count as f64)).collect()
    }

    #[test]
    fn parallel_arcs_are_as_far_apart_as_their_radii() {
        for sweep in [FRAC_PI_2, -FRAC_PI_2, 1.9 * FRAC_PI_2, -TAU, TAU] {
            for rise in [0.0, 3.0] {
                let far = apart_mm(&arc(10.0, sweep, rise), &[arc(10.3, sweep, rise)]);
                assert!((far - 0.3).abs() < 1e-4 && far >= 0.3 - 1e-9, "{sweep} {rise}: {far}");
                assert_eq!(apart_mm(&arc(10.0, sweep, rise), &[arc(10.0, sweep, rise)]), 0.0);
            }
        }
    }

    /// Chords are off by their sagitta r (1 − cos θ/2n).
    #[test]
    fn chords_in_order_are_off_by_their_sagitta() {
        for (sweep, rise) in [(FRAC_PI_2, 0.0), (-TAU, 0.0), (TAU, 2.0)] {
            let of = arc(10.0, sweep, rise);
            let far = apart_mm(&of, &lines(&points(&of, 90)));
            let sagitta = 10.0 * (1.0 - (0.5 * sweep.abs() / 90.0).cos());
            assert!(far >= sagitta - 1e-9 && far < sagitta + 1e-4, "{sweep} {rise}: {far} {sagitta}");
        }
    }

    /// Two points exchanged, the way there and back, and a circle walked twice lie on the curve, but not in its order.
    #[test]
    fn points_of_the_curve_in_another_order_are_far_from_it() {
        let quarter = arc(10.0, FRAC_PI_2, 0.0);
        let mut swapped = points(&quarter, 10);
        swapped.swap(4, 6);
        // A step back of two intervals of 1.57 mm: each of its ends is matched half of it away at best.
        let back = apart_mm(&quarter, &lines(&swapped));
        assert!(back > 1.5 && back < 3.2, "{back}");
        let there = points(&quarter, 10);
        let again = [&there[..], &there.iter().rev().copied().collect::<Vec<_>>(), &there].concat();
        assert!(apart_mm(&quarter, &lines(&again)) > 7.0);
        let circle = arc(10.0, TAU, 0.0);
        let round = points(&circle, 36);
        assert!(apart_mm(&circle, &lines(&round)) < 0.04);
        assert!(apart_mm(&circle, &lines(&[&round[..], &round[1..]].concat())) > 10.0);
        let other_way: Vec<Vec3> = round.iter().rev().copied().collect();
        assert!(apart_mm(&circle, &lines(&other_way)) > 10.0);
        assert!(apart_mm(&quarter, &[arc(10.0, FRAC_PI_2 - TAU, 0.0)]) > 10.0);
    }

    #[test]
    fn lines_are_as_far_apart_as_their_ends() {
        let line = |a: [f64; 3], b: [f64; 3]| Curve::Line { from: a.into(), to: b.into() };
        let far = apart_mm(&line([0.0; 3], [5.0, 0.0, 0.0]), &[line([0.0, 0.1, 0.0], [5.0, 0.0, 0.3])]);
        assert_eq!(far, 0.3);
        // Back and forth on the line.
        let folded = lines(&[[0.0; 3], [4.0, 0.0, 0.0], [1.0, 0.0, 0.0], [5.0, 0.0, 0.0]].map(Vec3::from));
        assert!((apart_mm(&line([0.0; 3], [5.0, 0.0, 0.0]), &folded) - 3.0).abs() < 1e-9);
    }
}
