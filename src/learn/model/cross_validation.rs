//! Which samples a model is fitted on, chosen on, and finally judged on. Always whole blocks (set-ups, parts, passes or
//! stretches of time), never neighbouring samples.

use crate::effects::Place;
use crate::learn::dataset::samples::Data;
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::fit;
use rayon::prelude::*;

/// A split of the samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Split {
    /// Kept for the final judgement; all false: there are too few blocks, the judgement is by leaving out one block at
    /// a time.
    pub test: Vec<bool>,
    /// Fold of each sample for choosing between models.
    pub fold: Vec<usize>,
    /// Number of folds.
    pub folds: usize,
    /// One clause for the report.
    pub how: String,
}

/// Fewest blocks that can spare some for the final judgement.
const ENOUGH_BLOCKS: usize = 15;

/// Every fifth block is kept for the judgement where there are enough of them; the rest go to five folds in turn.
/// With fewer blocks every block is a fold. `what` names the blocks ("set-up", "stretch of time").
pub fn by_blocks(data: &Data, what: &str) -> Split {
    let blocks = data.blocks();
    let rank = |i: usize| blocks.binary_search(&data.block[i]).unwrap_or(0);
    if blocks.len() < ENOUGH_BLOCKS {
        return Split {
            test: vec![false; data.len()],
            fold: (0..data.len()).map(rank).collect(),
            folds: blocks.len(),
            how: format!("leaving out one {what} at a time ({} of them)", blocks.len()),
        };
    }
    Split {
        test: (0..data.len()).map(|i| rank(i) % 5 == 2).collect(),
        fold: (0..data.len()).map(|i| (rank(i) / 5 + rank(i)) % 5).collect(),
        folds: 5,
        how: format!("every fifth {what} held out; chosen by five folds of whole {what}s"),
    }
}

/// Trains on the samples of one kind only and keeps the named blocks of it for the judgement.
pub fn by_kind(data: &Data, kind: usize, what: &str) -> Split {
    let blocks = data.blocks();
    let rank = |i: usize| blocks.binary_search(&data.block[i]).unwrap_or(0);
    Split {
        test: (0..data.len()).map(|i| data.kind[i] != kind).collect(),
        fold: (0..data.len()).map(rank).collect(),
        folds: blocks.len(),
        how: format!("fitted on {}, by leaving out one {what} at a time", data.kind_names[kind]),
    }
}

/// Weights with the samples that `out` names left out.
pub fn without(data: &Data, out: impl Fn(usize) -> bool) -> Vec<f64> {
    (0..data.len()).map(|i| if out(i) { 0.0 } else { data.weight[i] }).collect()
}

/// Most rounds of the fit without a fold; one that has come to rest stops by itself.
const FOLD_ROUNDS: usize = 12;

/// Residual of every sample that counts under a model that has not seen its fold; parameters begin at `effects`, but for the
/// factors of curves.
pub fn held_out_residuals(data: &Data, effects: &[FittedEffect], split: &Split) -> Vec<f64> {
    let begun: Vec<FittedEffect> = effects.iter().map(with_curve_forgotten).collect();
    let of_fold = |fold: usize| -> Vec<(usize, f64)> {
        let held: Vec<usize> = data.used().filter(|i| split.fold[*i] == fold).collect();
        if held.is_empty() {
            return Vec::new();
        }
        let others = data.with_weights(without(data, |i| split.fold[i] == fold));
        let Some(fitted) = fit(&others, &begun, FOLD_ROUNDS) else { return Vec::new() };
        held.into_iter().map(|i| (i, data.reading[i] - fitted.predicted[i])).collect()
    };
    let folds: Vec<Vec<(usize, f64)>> = (0..split.folds).into_par_iter().map(of_fold).collect();
    let mut residuals = vec![f64::NAN; data.len()];
    folds.into_iter().flatten().for_each(|(i, residual)| residuals[i] = residual);
    residuals
}

/// The effect as a fit to some of the samples may begin with it. A factor of a curve is told by the samples about its knot alone:
/// left at what all samples gave, it would carry those that are left out into their own prediction.
fn with_curve_forgotten(each: &FittedEffect) -> FittedEffect {
    let mut each = each.clone();
    if each.effect.parameters.iter().any(|p| p.place == Some(Place::Knot)) {
        let parameters = each.effect.parameters.iter().zip(&each.free);
        for (value, (parameter, free)) in each.values.iter_mut().zip(parameters) {
            *value = parameter.neutral.filter(|_| *free).unwrap_or(*value);
        }
    }
    each
}

/// Per block: Σ w r² before minus after, over samples that both have.
pub fn improvement_by_block(data: &Data, before: &[f64], after: &[f64]) -> Vec<f64> {
    let blocks = data.blocks();
    let mut sums = vec![0.0; blocks.len()];
    for i in data.used().filter(|i| before[*i].is_finite() && after[*i].is_finite()) {
        if let Ok(b) = blocks.binary_search(&data.block[i]) {
            sums[b] += data.weight[i] * (before[i].powi(2) - after[i].powi(2));
        }
    }
    sums
}

/// The same per case: per block of a log, per cut of a table. Neighbouring samples share their errors, cuts of a table do not, and
/// the few set-ups that there are say little of their own scatter.
pub fn improvement_by_case(data: &Data, before: &[f64], after: &[f64]) -> Vec<f64> {
    if data.is_series() {
        return improvement_by_block(data, before, after);
    }
    let known = data.used().filter(|i| before[*i].is_finite() && after[*i].is_finite());
    known.map(|i| data.weight[i] * (before[i].powi(2) - after[i].powi(2))).collect()
}

/// Mean over its standard error.
pub fn t_statistic(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    if n < 2.0 {
        return 0.0;
    }
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    if variance > 0.0 { mean / (variance / n).sqrt() } else { 0.0 }
}
