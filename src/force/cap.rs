//! Arithmetic of caps. In: caps, or a load that can only be sampled. Out: the lower of two, a cap in another unit, the first feed at which a
//! sampled load crosses its limit.

use super::loads::Cap;

/// The lower of two caps.
pub(super) fn lower(a: Cap, b: Cap) -> Cap {
    match (a, b) {
        (Cap::Unreachable, _) | (_, Cap::Unreachable) => Cap::Unreachable,
        (Cap::Free, other) | (other, Cap::Free) => other,
        (Cap::Feed { feed_mm_s: x, .. }, Cap::Feed { feed_mm_s: y, .. }) => {
            if x <= y {
                a
            } else {
                b
            }
        }
    }
}

/// A cap whose feed is multiplied by `feed` and whose derivative by `per_unit`.
pub(super) fn scaled(cap: Cap, feed: f64, per_unit: f64) -> Cap {
    match cap {
        Cap::Feed { feed_mm_s, per_unit: slope } => {
            Cap::Feed { feed_mm_s: feed_mm_s * feed, per_unit: slope * per_unit }
        }
        Cap::Free | Cap::Unreachable => cap,
    }
}

/// Relative width to which a crossing is narrowed down.
const NARROW: f64 = 1e-10;

/// First crossing from below of `load` over a rising grid of feeds: the load is within `limit` at every grid feed below
/// the answer, and at the answer. `Free` when it is within the limit on the whole grid.
pub(super) fn first_crossing(grid: &[f64], limit: f64, load: impl Fn(f64) -> f64) -> Cap {
    let mut below = 0.0;
    for (k, &f) in grid.iter().enumerate() {
        if load(f) <= limit {
            below = f;
            continue;
        }
        if k == 0 {
            return Cap::Unreachable;
        }
        return between(below, f, limit, load);
    }
    Cap::Free
}

/// Where `load` crosses `limit` between a feed within it and one beyond it: bisection with regula falsi (Illinois).
fn between(below: f64, above: f64, limit: f64, load: impl Fn(f64) -> f64) -> Cap {
    let (mut lo, mut hi) = (below, above);
    let (mut at_lo, mut at_hi) = (load(lo) - limit, load(hi) - limit);
    let mut last_side = 0;
    for _ in 0..60 {
        if hi - lo <= NARROW * hi {
            break;
        }
        let middle = lo + (hi - lo) * (at_lo / (at_lo - at_hi)).clamp(0.01, 0.99);
        let value = load(middle) - limit;
        if value <= 0.0 {
            (lo, at_lo) = (middle, value);
            if last_side == -1 {
                at_hi *= 0.5;
            }
            last_side = -1;
        } else {
            (hi, at_hi) = (middle, value);
            if last_side == 1 {
                at_lo *= 0.5;
            }
            last_side = 1;
        }
    }
    let step = 1e-4 * lo;
    let slope = (load(lo) - load(lo - step)) / step;
    Cap::Feed { feed_mm_s: lo, per_unit: if slope > 0.0 { slope.recip() } else { 0.0 } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_crossing_from_below_counts() {
        let hump = |f: f64| 10.0 * f - f * f; // passes 21 at f = 3 and again, falling, at 7
        let grid: Vec<f64> = (0..100).map(|k| 0.1 * f64::from(k)).collect();
        let Cap::Feed { feed_mm_s, per_unit } = first_crossing(&grid, 21.0, hump) else { panic!() };
        assert!((feed_mm_s - 3.0).abs() < 1e-8 && (per_unit - 0.25).abs() < 1e-3);
        assert_eq!(first_crossing(&grid, 26.0, hump), Cap::Free);
        assert_eq!(first_crossing(&grid, -1.0, hump), Cap::Unreachable);
    }
}
