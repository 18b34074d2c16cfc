//! Cross-validation. In: data, effects. Out: the split into samples for the fit, folds for choosing models and data
//! kept for the judgement, always by whole blocks (set-ups, parts, passes or stretches of time) because neighbouring
//! samples share their errors; held-out residuals, and the significance of an improvement.

use crate::effects::Place;
use crate::learn::dataset::samples::Data;
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::fit_weighed;
use rayon::prelude::*;

/// A split of the samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Split {
    /// Kept for the final judgement. All false: too few blocks; the judgement leaves out one block at a time.
    pub test: Vec<bool>,
    /// Fold of each sample for choosing between models.
    pub fold: Vec<usize>,
    /// Number of folds.
    pub folds: usize,
    /// One clause for the report.
    pub how: String,
}

/// Fewest blocks of which some are kept for the final judgement.
const ENOUGH_BLOCKS: usize = 15;

/// With at least [`ENOUGH_BLOCKS`] blocks every fifth is kept for the judgement and the rest are dealt to five folds;
/// with fewer, every block is a fold. `what` names the blocks ("set-up", "stretch of time").
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

/// Fits one kind only, with its blocks as folds, and keeps all other kinds for the judgement.
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

/// The weights with 0 for the samples that are `out`.
pub fn without(data: &Data, out: impl Fn(usize) -> bool) -> Vec<f64> {
    (0..data.len()).map(|i| if out(i) { 0.0 } else { data.weight[i] }).collect()
}

/// Most iterations of the fit without a fold.
const FOLD_ROUNDS: usize = 12;

/// Residual of each sample under the model fitted without its fold; NaN without weight. The fit starts from `effects`,
/// with the factors of curves at neutral.
pub fn held_out_residuals(data: &Data, effects: &[FittedEffect], split: &Split) -> Vec<f64> {
    let begun: Vec<FittedEffect> = effects.iter().map(with_curve_at_neutral).collect();
    let of_fold = |fold: usize| -> Vec<(usize, f64)> {
        let held: Vec<usize> = data.used().filter(|i| split.fold[*i] == fold).collect();
        if held.is_empty() {
            return Vec::new();
        }
        let others = without(data, |i| split.fold[i] == fold);
        let Some(fitted) = fit_weighed(data, &others, &begun, FOLD_ROUNDS) else { return Vec::new() };
        held.into_iter().map(|i| (i, data.reading[i] - fitted.predicted[i])).collect()
    };
    let folds: Vec<Vec<(usize, f64)>> = (0..split.folds).into_par_iter().map(of_fold).collect();
    let mut residuals = vec![f64::NAN; data.len()];
    folds.into_iter().flatten().for_each(|(i, residual)| residuals[i] = residual);
    residuals
}

/// The effect with the factors of a curve at neutral. A factor is determined only by samples near its knot; if all of
/// these are held out, a start value from the fit to all samples would leak them into their own prediction.
fn with_curve_at_neutral(each: &FittedEffect) -> FittedEffect {
    let mut each = each.clone();
    if each.effect.parameters.iter().any(|p| p.place == Some(Place::Knot)) {
        let parameters = each.effect.parameters.iter().zip(&each.free);
        for (value, (parameter, free)) in each.values.iter_mut().zip(parameters) {
            *value = parameter.neutral.filter(|_| *free).unwrap_or(*value);
        }
    }
    each
}

/// Σ w (before² − after²) of each block, over samples where both are finite.
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

/// The same for each case: a block of a log, a cut of a table. Neighbouring samples of a log share their errors, cuts
/// of a table do not, and a table has too few set-ups to estimate their scatter.
pub fn improvement_by_case(data: &Data, before: &[f64], after: &[f64]) -> Vec<f64> {
    if data.is_series() {
        return improvement_by_block(data, before, after);
    }
    let known = data.used().filter(|i| before[*i].is_finite() && after[*i].is_finite());
    known.map(|i| data.weight[i] * (before[i].powi(2) - after[i].powi(2))).collect()
}

/// Gain of a model over another on held-out data, over its standard error. With δ = before − after the gain is
///
/// Σ w (before² − after²) = Σ w δ² + 2 Σ w δ·after.
///
/// The standard error is the least of three estimates from the scatter between cases, as each is too large in its own
/// situation:
/// 1. that of the gain: too large if an effect acts in few blocks only;
/// 2. that of the second term alone, the first being certain: too large if the rest is correlated with δ;
/// 3. that of the ratio R = Σa/Σb of the squares after (a) to those before (b), √Σ(aᵢ − R bᵢ)²/Σb (Cochran, Sampling
///    Techniques, ch. 6): small if each case loses the same share of its squares, even if few cases have large ones.
pub fn certainty_of_gain(data: &Data, before: &[f64], after: &[f64]) -> f64 {
    let differs = |i: usize| data.weight[i] * (before[i] - after[i]);
    let sums = |case: Vec<usize>| {
        let certain: f64 = case.iter().map(|&i| differs(i) * (before[i] - after[i])).sum();
        let rest: f64 = case.iter().map(|&i| 2.0 * differs(i) * after[i]).sum();
        let squares: f64 = case.iter().map(|&i| data.weight[i] * before[i].powi(2)).sum();
        [certain + rest, rest, squares]
    };
    let cases = cases(data, |i| before[i].is_finite() && after[i].is_finite());
    let each: Vec<[f64; 3]> = cases.into_iter().map(sums).collect();
    let n = each.len() as f64;
    let gain: f64 = each.iter().map(|of| of[0]).sum();
    let scatter = each.iter().map(|of| (of[0] - gain / n).powi(2)).sum::<f64>() * n / (n - 1.0).max(1.0);
    let of_rest = each.iter().map(|of| of[1].powi(2)).sum::<f64>();
    // b − a = gain, so that a − R b = (1 − R) b − gain.
    let share = gain / each.iter().map(|of| of[2]).sum::<f64>().max(1e-300);
    let of_ratio = each.iter().map(|of| (share * of[2] - of[0]).powi(2)).sum::<f64>() * n / (n - 1.0).max(1.0);
    let variance = scatter.min(of_rest).min(of_ratio);
    if variance > 0.0 { gain / variance.sqrt() } else { 0.0 }
}

/// Share κ of an effect that data it was not fitted on bear out, and its standard error. δ = before − after is what the effect predicts
/// there, and κ = Σ w δ·before / Σ w δ²: 1 where it is there as fitted, 0 where there is nothing of it, NaN where it predicts nothing. The
/// standard error is from the scatter between cases, √Σ(Σ w δ·before − κ Σ w δ²)²/Σ w δ² (of a ratio: Cochran, Sampling Techniques, ch. 6).
pub fn share_borne_out(data: &Data, before: &[f64], after: &[f64]) -> [f64; 2] {
    let predicted = |i: usize| before[i] - after[i];
    let sums = |case: Vec<usize>| {
        let of = |value: &dyn Fn(usize) -> f64| -> f64 { case.iter().map(|&i| data.weight[i] * value(i)).sum() };
        [of(&|i| predicted(i) * before[i]), of(&|i| predicted(i).powi(2))]
    };
    let each: Vec<[f64; 2]> =
        cases(data, |i| before[i].is_finite() && after[i].is_finite()).into_iter().map(sums).collect();
    let whole: f64 = each.iter().map(|of| of[1]).sum();
    let share = each.iter().map(|of| of[0]).sum::<f64>() / whole;
    let scatter = each.iter().map(|of| (of[0] - share * of[1]).powi(2)).sum::<f64>();
    [share, scatter.sqrt() / whole]
}

/// The samples with weight of each case (block of a log, cut of a table) that are `known`.
fn cases(data: &Data, known: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
    let used = data.used().filter(|i| known(*i));
    if !data.is_series() {
        return used.map(|i| vec![i]).collect();
    }
    let blocks = data.blocks();
    let mut cases = vec![Vec::new(); blocks.len()];
    used.for_each(|i| blocks.binary_search(&data.block[i]).into_iter().for_each(|b| cases[b].push(i)));
    cases
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A log of 24 blocks of 40 samples.
    fn data() -> Data {
        let n = 960;
        Data {
            reading: vec![0.0; n],
            weight: vec![1.0; n],
            block: (0..n).map(|i| i / 40).collect(),
            span_s: vec![1.0; n],
            run: vec![0; n],
            ..Data::default()
        }
    }

    /// Scatter of about ±1 without a pattern.
    fn wobble(i: usize) -> f64 {
        ((i * 7919) % 101) as f64 / 50.0 - 1.0
    }

    /// (t, certainty) of the gain if one model leaves `before(block)` and another `after(block)`, plus scatter.
    fn gained(before: impl Fn(usize) -> f64, after: impl Fn(usize) -> f64) -> (f64, f64) {
        let data = data();
        let left = |of: &dyn Fn(usize) -> f64| (0..960).map(|i| of(i / 40) + wobble(i)).collect::<Vec<f64>>();
        let (before, after) = (left(&before), left(&after));
        (t_statistic(&improvement_by_case(&data, &before, &after)), certainty_of_gain(&data, &before, &after))
    }

    #[test]
    fn what_only_few_blocks_show_is_as_certain_as_the_rest_is_small() {
        let few = |block: usize| if block < 3 { 2.0 } else { 0.0 };
        let (t, certainty) = gained(few, |_| 0.0);
        assert!(t < 2.0 && certainty > 5.0, "{t} {certainty}");
        // Exchanged, it is a significant loss.
        assert!(gained(|_| 0.0, few).1 < -1.0);
    }

    #[test]
    fn a_large_share_gone_from_the_few_blocks_that_leave_most_is_certain_though_some_is_left_there() {
        // One model removes half of the residual of three blocks, another half of that of one of them.
        let few = |block: usize| if block < 3 { 4.0 } else { 0.0 };
        let (t, certainty) = gained(few, |block| 0.5 * few(block));
        assert!(t < 2.0 && certainty > 3.0, "{t} {certainty}");
        let (_, one) = gained(few, |block| if block == 0 { 2.0 } else { few(block) });
        assert!(one < 2.0, "{one}");
    }

    #[test]
    fn what_is_gained_in_every_block_is_certain_however_much_is_left() {
        let (t, certainty) = gained(|block| 2.0 + (block % 2) as f64, |block| 1.0 + 0.5 * (block % 2) as f64);
        assert!(t > 4.0 && certainty >= t, "{t} {certainty}");
    }

    #[test]
    fn what_is_gained_here_and_lost_there_is_not_certain() {
        let off = |block: usize| if block.is_multiple_of(2) { 1.0 } else { -1.0 };
        let (_, certainty) = gained(|block| if block == 7 { 1.2 } else { 0.0 }, |block| 0.3 * off(block));
        assert!(certainty < 2.0, "{certainty}");
        assert_eq!(gained(|_| 0.0, |_| 0.0).1, 0.0);
    }

    /// Share borne out of an effect of 2 in the first blocks, `few` of them, where `there` of it is there and blocks differ by ±`off`.
    fn borne_out(few: usize, there: f64, off: f64) -> [f64; 2] {
        let effect = |block: usize| if block < few { 2.0 } else { 0.0 };
        let before = |i: usize| {
            let block = i / 40;
            there * effect(block) + wobble(i) + if block.is_multiple_of(2) { off } else { -off }
        };
        let after = |i: usize| before(i) - effect(i / 40);
        share_borne_out(&data(), &(0..960).map(before).collect::<Vec<_>>(), &(0..960).map(after).collect::<Vec<_>>())
    }

    #[test]
    fn what_an_effect_predicts_is_borne_out_as_far_as_it_is_there_and_as_surely_as_blocks_agree() {
        for there in [0.0, 0.5, 1.0] {
            let [share, std_error] = borne_out(12, there, 0.0);
            assert!((share - there).abs() < 0.05 && std_error < 0.05, "{there}: {share} {std_error}");
        }
        // Where blocks differ by as much as it predicts, two of them tell nothing of it, and twelve do.
        assert!(borne_out(2, 0.0, 2.0)[1] > 0.5 && borne_out(12, 0.0, 2.0)[1] < 0.35);
        assert!(borne_out(0, 1.0, 0.0)[0].is_nan());
    }
}
