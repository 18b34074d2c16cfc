//! The independent checker: measures a solution against the constraints themselves, not against what the solver was told.
//! In: a chain with b at its points. Out: the worst violation of caps, accelerations and jerk, as shares.

use super::exact_pass::{Chain, Leg};

/// Worst violations; 0 means met exactly.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Residuals {
    /// Of a cap or an acceleration, as a share of the largest b.
    pub bound: f64,
    /// Of the jerk, as a share of its limit.
    pub jerk: f64,
}

/// Residuals of b at the points `first..=last`, `b[0]` belonging to `first`.
pub fn residuals(chain: &Chain, caps: &[f64], first: usize, b: &[f64]) -> Residuals {
    let scale = b.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let mut worst = Residuals::default();
    for (i, b) in b.iter().enumerate() {
        let over = (b - caps[first + i]).max(-b);
        worst.bound = worst.bound.max(if over.is_nan() { f64::INFINITY } else { over / scale });
    }
    for i in 1..b.len() {
        let over = acceleration_excess(chain, &chain.legs[first + i - 1], b[i - 1], b[i]);
        worst.bound = worst.bound.max(over / scale);
    }
    for i in 1..b.len().max(1) - 1 {
        let (before, after) = (&chain.legs[first + i - 1], &chain.legs[first + i]);
        worst.jerk = worst.jerk.max(jerk_share(before, after, [b[i - 1], b[i], b[i + 1]]) - 1.0);
    }
    worst
}

fn acceleration_excess(chain: &Chain, leg: &Leg, b0: f64, b1: f64) -> f64 {
    if leg.row_count == 0 {
        return (b1 - b0).abs() - 2.0 * leg.accel_mm_s2 * leg.ds_mm;
    }
    let excess = |row: &super::exact_pass::Row| (row.p * b0 + row.q * b1 - row.r) / row.p.abs().max(row.q.abs());
    chain.rows_of(leg).iter().map(excess).fold(f64::NEG_INFINITY, f64::max)
}

/// Jerk at the point between two legs as a share of its limit: |Δa|·v over the limit times the mean length.
pub fn jerk_share(before: &Leg, after: &Leg, [b0, b1, b2]: [f64; 3]) -> f64 {
    let change = (b2 - b1) / (2.0 * after.ds_mm) - (b1 - b0) / (2.0 * before.ds_mm);
    let limit = before.jerk_mm_s3.min(after.jerk_mm_s3) * 0.5 * (before.ds_mm + after.ds_mm);
    change.abs() * b1.sqrt() / limit
}
