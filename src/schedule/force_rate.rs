//! The limit on the rate of change of force. In: nodes with caps, the loads of each as functions of feed. Out: lower caps where the cutter
//! enters or leaves material, or the engagement changes otherwise, so that the peak force in the plane rises and falls no faster than
//! allowed.
//!
//! Between the middles of two neighbouring pieces, ds apart, both at feed v, the force changes by |F₂(v) − F₁(v)| in ds/v; the
//! highest v with |F₂(v) − F₁(v)| v / ds ≤ rate caps both. Where nothing is cut, F is 0.

use super::problem::Node;
use crate::numeric::bisect;

/// Halvings of the interval in which the highest feed is sought.
const HALVINGS: u32 = 40;

/// Highest feed at which the force changes no faster than `rate_n_s` from a piece to the next, at most `most_mm_s`.
pub fn highest(
    before: &dyn Fn(f64) -> f64,
    after: &dyn Fn(f64) -> f64,
    ds_mm: f64,
    rate_n_s: f64,
    most_mm_s: f64,
) -> f64 {
    let rate = |feed: f64| (after(feed) - before(feed)).abs() * feed / ds_mm;
    if rate(most_mm_s) <= rate_n_s {
        return most_mm_s;
    }
    bisect(|feed| rate(feed) <= rate_n_s, 0.0, most_mm_s, HALVINGS)[0]
}

/// Distance between the middles of two pieces that touch, mm.
pub fn between_mm(a: &Node, b: &Node) -> f64 {
    0.5 * (a.length_mm() + b.length_mm())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entering_a_cut_of_constant_stiffness() {
        // F = 2 v + 30 behind, nothing before, 1 mm apart, 800 N/s: 2 v² + 30 v = 800.
        let v = highest(&|_| 0.0, &|feed| 2.0 * feed + 30.0, 1.0, 800.0, 100.0);
        assert!((2.0 * v * v + 30.0 * v - 800.0).abs() < 1e-6, "{v}");
        assert_eq!(highest(&|_| 10.0, &|_| 10.0, 1.0, 800.0, 100.0), 100.0);
    }
}
