//! The instant or the region at which the load changes, found by a score test. In: data, the present model. Out: an
//! instant, or a rectangle in X and Y.
//!
//! With sensitivity s of the reading and the Jacobian J of the present model, the score of a mask m is (Σ m w s r)² /
//! (Σ m w s² − vᵀ(JᵀWJ)⁻¹v), v = Σ m w s J (Rao 1948). All these sums are additive over cells, so thousands of masks
//! cost no more than one pass over the samples.

use crate::learn::dataset::samples::{Class, Data};
use crate::learn::model::fit::{Fitted, jacobian, part, pseudo_inverse};
use nalgebra::{DMatrix, DVector};

/// Sums over a set of samples that the score of a mask needs.
#[derive(Clone)]
struct Sums {
    /// Σ w s r, Σ w s² and Σ w s J.
    g: f64,
    ss: f64,
    sj: DVector<f64>,
}

impl Sums {
    fn zero(p: usize) -> Self {
        Self { g: 0.0, ss: 0.0, sj: DVector::zeros(p) }
    }
    fn add(&mut self, other: &Sums, sign: f64) {
        self.g += sign * other.g;
        self.ss += sign * other.ss;
        self.sj.axpy(sign, &other.sj, 1.0);
    }
}

/// Score test of masks.
struct Score {
    each: Vec<Sums>,
    used: Vec<usize>,
    inverse: DMatrix<f64>,
    p: usize,
}

impl Score {
    fn new(data: &Data, present: &Fitted, sensitivity: &[f64]) -> Self {
        let j = jacobian(data, present);
        let p = j.len();
        let residual = present.residuals(data);
        let used: Vec<usize> = data.used().collect();
        let mut normal = DMatrix::<f64>::zeros(p, p);
        let mut each = Vec::with_capacity(used.len());
        for &i in &used {
            let row = DVector::from_fn(p, |a, _| j[a][i]);
            normal.syger(data.weight[i], &row, &row, 1.0);
            let (w, s) = (data.weight[i], sensitivity[i]);
            each.push(Sums { g: w * s * residual[i], ss: w * s * s, sj: row * (w * s) });
        }
        let mut full = DMatrix::from_fn(p, p, |a, b| normal[(a.max(b), a.min(b))]);
        // Priors separate columns that these cuts cannot, as in the fit.
        for (b, sd) in data.base.iter().enumerate().filter_map(|(b, base)| Some((b, base.prior?.1))) {
            full[(b, b)] += 1.0 / (sd * sd);
        }
        let inverse = pseudo_inverse(&full);
        Self { each, used, inverse, p }
    }

    fn gain(&self, sums: &Sums) -> f64 {
        let row = |a: usize| (0..self.p).map(|b| self.inverse[(a, b)] * sums.sj[b]).sum::<f64>();
        let rest = sums.ss - (0..self.p).map(|a| sums.sj[a] * row(a)).sum::<f64>();
        if rest > 1e-6 * sums.ss && sums.ss > 0.0 { sums.g * sums.g / rest } else { 0.0 }
    }

    fn of_mask(&self, mask: impl Fn(usize) -> bool) -> f64 {
        let mut sums = Sums::zero(self.p);
        for (k, &i) in self.used.iter().enumerate() {
            if mask(i) {
                sums.add(&self.each[k], 1.0);
            }
        }
        self.gain(&sums)
    }
}

/// Fewest samples or cuts before and after an instant: fewer may be outliers, as in the parts of a curve. Judgement.
const FEWEST: usize = 6;

/// The instant of best score, from which on the load of the cut is higher for the tools that have cut before it, s: no edge cuts more easily
/// for having chipped.
pub fn instant(data: &Data, present: &Fitted) -> Option<f64> {
    let score = Score::new(data, present, &part(data, present, &[Class::Cutting, Class::Edge]));
    let n = score.used.len();
    let mut order: Vec<usize> = (0..n).collect();
    let margin = (n / 50 + 1).max(FEWEST);
    let time = |k: usize| data.state[score.used[k]].time_s;
    order.sort_by(|a, b| time(*a).total_cmp(&time(*b)));
    let (mut sums, mut best) = (Sums::zero(score.p), (0.0, f64::NAN));
    // Sums of the tools in the sums, by the times at which they first cut.
    let mut tools: Vec<(f64, Sums)> = Vec::new();
    for (rank, &k) in order.iter().enumerate().rev() {
        sums.add(&score.each[k], 1.0);
        let since_s = data.state[score.used[k]].in_use_since_s;
        match tools.iter_mut().find(|(known, _)| *known == since_s) {
            Some((_, own)) => own.add(&score.each[k], 1.0),
            None => tools.push((since_s, score.each[k].clone())),
        }
        // A tool that first cuts after this instant has not changed at it.
        let at_s = time(k);
        tools.retain(|(since_s, own)| {
            let stays = *since_s <= at_s;
            if !stays {
                sums.add(own, -1.0);
            }
            stays
        });
        let inside = rank >= margin && rank + margin <= n;
        let gain = if inside && sums.g > 0.0 { score.gain(&sums) } else { 0.0 };
        if gain > best.0 {
            best = (gain, time(k));
        }
    }
    (!best.1.is_nan()).then_some(best.1)
}

/// Cells of the work in X and in Y.
const GRID: usize = 12;

/// The region of best score in which the load of the cut differs: [x_min, x_max, y_min, y_max], mm.
pub fn region(data: &Data, present: &Fitted) -> Option<[f64; 4]> {
    let sensitivity = part(data, present, &[Class::Cutting, Class::Edge]);
    let top = sensitivity.iter().copied().fold(0.0, f64::max);
    let cutting: Vec<usize> = data.used().filter(|i| sensitivity[*i] > 0.02 * top).collect();
    let [x, y] = edges(data, &cutting)?;
    let score = Score::new(data, present, &sensitivity);
    let place = |i: usize| (cell(&x, data.state[i].position.x), cell(&y, data.state[i].position.y));
    // prefix[a][b]: sums over the cells left of a and below b (summed-area table), from which any rectangle follows by
    // four terms.
    let mut prefix = vec![vec![Sums::zero(score.p); GRID + 1]; GRID + 1];
    for (k, &i) in score.used.iter().enumerate() {
        let (a, b) = place(i);
        prefix[a + 1][b + 1].add(&score.each[k], 1.0);
    }
    for a in 1..=GRID {
        for b in 1..=GRID {
            let (left, below, corner) =
                (prefix[a - 1][b].clone(), prefix[a][b - 1].clone(), prefix[a - 1][b - 1].clone());
            prefix[a][b].add(&left, 1.0);
            prefix[a][b].add(&below, 1.0);
            prefix[a][b].add(&corner, -1.0);
        }
    }
    let mut best = (0.0, [0, GRID, 0, GRID]);
    for a0 in 0..GRID {
        for a1 in a0 + 1..=GRID {
            for b0 in 0..GRID {
                for b1 in b0 + 1..=GRID {
                    let mut sums = prefix[a1][b1].clone();
                    sums.add(&prefix[a0][b1], -1.0);
                    sums.add(&prefix[a1][b0], -1.0);
                    sums.add(&prefix[a0][b0], 1.0);
                    let gain = score.gain(&sums);
                    if gain > best.0 {
                        best = (gain, [a0, a1, b0, b1]);
                    }
                }
            }
        }
    }
    if best.0 <= 0.0 {
        return None;
    }
    let [a0, a1, b0, b1] = best.1;
    Some(refine(data, &score, [x[a0], x[a1], y[b0], y[b1]], [x[1] - x[0], y[1] - y[0]]))
}

/// Cell edges in x and y; `None` if the cuts have no extent.
fn edges(data: &Data, cutting: &[usize]) -> Option<[Vec<f64>; 2]> {
    let axis = |index: usize| {
        let values = cutting.iter().map(|i| data.state[*i].position[index]);
        let (lo, hi) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
        let (lo, hi) = (lo - 1e-6, hi + 1e-6);
        (hi > lo).then(|| (0..=GRID).map(|k| lo + (hi - lo) * k as f64 / GRID as f64).collect::<Vec<f64>>())
    };
    Some([axis(0)?, axis(1)?])
}

fn cell(edges: &[f64], value: f64) -> usize {
    edges.partition_point(|edge| *edge <= value).saturating_sub(1).min(GRID - 1)
}

/// Moves one side of the box at a time while the score rises.
fn refine(data: &Data, score: &Score, start: [f64; 4], step: [f64; 2]) -> [f64; 4] {
    let gain = |b: &[f64; 4]| {
        score.of_mask(|i| {
            let p = data.state[i].position;
            p.x >= b[0] && p.x <= b[1] && p.y >= b[2] && p.y <= b[3]
        })
    };
    let (mut at, mut best) = (start, gain(&start));
    for shrink in [0.5, 0.25, 0.125] {
        for side in 0..4 {
            for sign in [-1.0, 1.0] {
                let mut trial = at;
                trial[side] += sign * shrink * step[side / 2];
                let value = gain(&trial);
                if value > best {
                    (at, best) = (trial, value);
                }
            }
        }
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::learn::diagnose::made_data::made;
    use crate::learn::model::fit::fit;

    #[test]
    fn an_instant_has_some_cuts_on_either_side() {
        // Of sixty cuts the first few take a fifth less.
        let found = |first: usize| {
            let state = |i: usize| State { time_s: i as f64, ..State::default() };
            let mut data = made(|i| if i < first { -0.2 } else { 0.0 }, 1.0, state);
            (60..data.len()).for_each(|i| data.weight[i] = 0.0);
            instant(&data, &fit(&data, &[], 0).unwrap()).unwrap()
        };
        assert_eq!([found(8), found(6)], [8.0, 6.0]);
        // Cuts 20 to 39 take more, and from 40 on another tool cuts as it should.
        let state =
            |i: usize| State { time_s: i as f64, in_use_since_s: if i < 40 { 0.0 } else { 40.0 }, ..State::default() };
        let mut data = made(|i| if (20..40).contains(&i) { 0.3 } else { 0.0 }, 1.0, state);
        (60..data.len()).for_each(|i| data.weight[i] = 0.0);
        assert_eq!(instant(&data, &fit(&data, &[], 0).unwrap()), Some(20.0));
        assert!(found(3) >= 6.0, "{}", found(3));
    }
}
