//! Patterns that bear no name, as rivals of the effects that do. In: residuals on data left out, the load of the cut, a
//! covariate. Out: the residuals after a free factor on that load in every bin of the covariate.
//!
//! In a bin f = Σ w r l / Σ w l², over the samples of the other folds: r the residual, l the load of the cut. Such a
//! pattern takes the shape of anything that depends on its covariate. If one along a covariate that an effect knows
//! nothing of explains more than the effect does, then the effect only stands in for what is not in the list. And what
//! a pattern along an effect's own covariate takes away is a misfit of that effect's form before it is another effect.

use crate::effects::Covariate;
use crate::learn::dataset::samples::Data;
use crate::learn::diagnose::criteria::is_clearly_better;
use crate::learn::diagnose::residual::{COVARIATES, bins_of};
use crate::learn::model::cross_validation::{Split, improvement_by_block, t_statistic};

/// Bins along a covariate.
const BINS: usize = 10;
/// What free patterns are learned from.
pub struct FreePatterns<'a> {
    /// Samples.
    pub data: &'a Data,
    /// Folds.
    pub split: &'a Split,
    /// Load of the cut, by the present model.
    pub load: &'a [f64],
}

/// The pattern along one of the covariates that clearly explains more of `before` than what led to `after` does, and
/// the squares that either leaves over those before.
pub fn better_pattern(
    free: &FreePatterns,
    covariates: &[Covariate],
    before: &[f64],
    after: &[f64],
) -> Option<(Covariate, [f64; 2])> {
    let squares = |r: &[f64]| {
        let finite = free.data.used().filter(|i| r[*i].is_finite());
        finite.map(|i| free.data.weight[i] * r[i].powi(2)).sum::<f64>()
    };
    let whole = squares(before).max(1e-300);
    let left = |covariate: &Covariate| {
        let pattern = free.corrected(before, *covariate)?;
        let better = t_statistic(&improvement_by_block(free.data, after, &pattern));
        is_clearly_better(better).then(|| (*covariate, [squares(&pattern) / whole, squares(after) / whole]))
    };
    covariates.iter().filter_map(left).min_by(|a, b| a.1[0].total_cmp(&b.1[0]))
}

impl FreePatterns<'_> {
    /// The residual less the pattern along a covariate; `None` where that does not vary.
    fn corrected(&self, residual: &[f64], covariate: Covariate) -> Option<Vec<f64>> {
        let values: Vec<f64> = match covariate {
            Covariate::Load => self.load.to_vec(),
            other => self.data.state.iter().map(|state| other.of(state)).collect(),
        };
        let known = |i: &usize| values[*i].is_finite() && residual[*i].is_finite() && self.load[*i] > 0.0;
        let used: Vec<usize> = self.data.used().filter(known).collect();
        if used.len() < 8 * BINS {
            return None;
        }
        let bins = bins_of(&used, &values, BINS)?;
        let count = bins.iter().max().map_or(1, |m| m + 1);
        // Sums of every fold and of all, bin by bin.
        let mut sums = vec![vec![[0.0; 2]; count]; self.split.folds + 1];
        for (&i, &bin) in used.iter().zip(&bins) {
            let weighted = self.data.weight[i] * self.load[i];
            for row in [self.split.fold[i], self.split.folds] {
                sums[row][bin][0] += weighted * residual[i];
                sums[row][bin][1] += weighted * self.load[i];
            }
        }
        let mut corrected = residual.to_vec();
        for (&i, &bin) in used.iter().zip(&bins) {
            let (all, own) = (sums[self.split.folds][bin], sums[self.split.fold[i]][bin]);
            let others = all[1] - own[1];
            if others > 0.0 {
                corrected[i] -= self.load[i] * (all[0] - own[0]) / others;
            }
        }
        Some(corrected)
    }
}

/// Covariates that none of these effects depends on.
pub fn unrelated_covariates(effects: &[crate::learn::model::design::FittedEffect]) -> Vec<Covariate> {
    let known = |c: &Covariate| effects.iter().any(|u| u.effect.covariates.contains(c));
    COVARIATES.into_iter().filter(|c| !known(c)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::path::Vec3;

    /// Cuts along X and Y in turn in 20 blocks; along Y everything takes a tenth more.
    fn crossed() -> (Data, Split, Vec<f64>) {
        let n = 400;
        let along_y = |i: usize| (i / 7) % 2 == 1;
        let direction = |i: usize| if along_y(i) { Vec3::new(0.0, 1.0, 0.0) } else { Vec3::new(1.0, 0.0, 0.0) };
        let load: Vec<f64> = (0..n).map(|i| 100.0 + (i % 5) as f64).collect();
        let wobble = |i: usize| ((i * 7919) % 101) as f64 / 50.0 - 1.0;
        let data = Data {
            reading: (0..n).map(|i| if along_y(i) { 0.1 * load[i] } else { 0.0 } + wobble(i)).collect(),
            weight: vec![1.0; n],
            state: (0..n).map(|i| State { direction: direction(i), time_s: i as f64, ..State::default() }).collect(),
            block: (0..n).map(|i| i / 20).collect(),
            ..Data::default()
        };
        let fold = (0..n).map(|i| (i / 20) % 5).collect();
        (data, Split { test: vec![false; n], fold, folds: 5, how: String::new() }, load)
    }

    #[test]
    fn the_pattern_that_is_there_beats_what_stands_in_for_it() {
        let (data, split, load) = crossed();
        let free = FreePatterns { data: &data, split: &split, load: &load };
        let before = data.reading.clone();
        // Something that takes away half of every residual.
        let half: Vec<f64> = before.iter().map(|r| 0.7 * r).collect();
        let (along, [pattern, named]) = better_pattern(&free, &COVARIATES, &before, &half).unwrap();
        assert!(matches!(along, Covariate::DirectionX | Covariate::DirectionY));
        assert!(pattern < 0.02 && (named - 0.49).abs() < 1e-9, "{pattern} {named}");
        // Nothing beats what leaves the noise alone, and a pattern along time does not know the direction.
        let noise: Vec<f64> =
            before.iter().zip(&data.state).zip(&load).map(|((r, s), l)| r - 0.1 * l * s.direction.y).collect();
        assert_eq!(better_pattern(&free, &COVARIATES, &before, &noise), None);
        assert_eq!(better_pattern(&free, &[Covariate::Time], &before, &half), None);
    }
}
