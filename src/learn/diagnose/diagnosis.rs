//! The state of a diagnosis: its data and split, and what was tried, rejected and accepted so far.

use crate::effects::{Acts, Covariate, Effect};
use crate::learn::dataset::samples::Data;
use crate::learn::diagnose::criteria::Criteria;
use crate::learn::diagnose::free_curve::Along;
use crate::learn::diagnose::trial::Trial;
use crate::learn::diagnose::trial_cache::TrialCache;
use crate::learn::model::cross_validation::Split;
use crate::learn::model::design::FittedEffect;
use crate::learn::report::Rejected;

/// How a diagnosis is run.
#[derive(Debug, Clone)]
pub struct Options {
    /// Effects that may be named.
    pub candidates: Vec<&'static Effect>,
    /// Most effects that are added.
    pub max_effects: usize,
    /// Seed of the permutation tests.
    pub seed: u64,
    /// Effects of a model learned before, with which the search begins. Those that no longer earn their score are
    /// removed.
    pub known: Vec<FittedEffect>,
    /// Thresholds.
    pub criteria: Criteria,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            candidates: crate::effects::ALL.to_vec(),
            max_effects: 4,
            seed: 1,
            known: Vec::new(),
            criteria: Criteria::default(),
        }
    }
}

/// See the head of the file.
#[derive(Clone)]
pub(in crate::learn) struct Diagnosis<'a> {
    /// All samples.
    pub(in crate::learn) data: &'a Data,
    /// The same without weight on those kept for the judgement.
    pub(in crate::learn) train: Data,
    pub(in crate::learn) split: &'a Split,
    pub(in crate::learn) options: &'a Options,
    /// Number of models fitted, for the Bonferroni correction.
    pub(in crate::learn) tried: usize,
    pub(in crate::learn) rejected: Vec<Rejected>,
    /// Of each accepted effect: name, evidence in words, p value, error on the data kept for the judgement before and
    /// after.
    pub(in crate::learn) evidence: Vec<(&'static str, String, f64, [f64; 2])>,
    /// Two effects that explain the residual only together: if one is removed, so is the other.
    pub(in crate::learn) pair: Vec<&'static str>,
    /// Effects on the tare that the readings without a cut show by themselves ([`super::idle`]).
    pub(in crate::learn) shown_by_idle: Vec<FittedEffect>,
    /// Held-out residual of the base model on the training blocks.
    pub(in crate::learn) base_residual: Vec<f64>,
    /// Noise floor, unit of the scaled reading; 0 if it is not known.
    pub(in crate::learn) floor: f64,
    /// The same for autocorrelated noise.
    pub(in crate::learn) noise: f64,
    /// Trials fitted so far on these data and weights.
    pub(in crate::learn) cache: TrialCache,
    /// The samples in order of each covariate that a curve may follow.
    pub(in crate::learn) along: Vec<(Covariate, Along)>,
}

impl Diagnosis<'_> {
    pub(in crate::learn) fn criteria(&self) -> &Criteria {
        &self.options.criteria
    }

    /// The samples in order of a covariate.
    pub(in crate::learn) fn along(&self, covariate: Covariate) -> Option<&Along> {
        self.along.iter().find(|(each, _)| *each == covariate).map(|(_, along)| along)
    }

    /// Is it the slower acceleration that was fitted to the block times?
    pub(in crate::learn) fn is_timed(&self, effect: &Effect) -> bool {
        self.data.timed_acceleration.is_some() && effect.acts == Acts::Motion
    }

    /// Is the effect shown by data of its own, apart from the loads: by block times, or by readings without a cut? It then needs no
    /// score beside the others and has no rivals among them.
    pub(in crate::learn) fn has_own_data(&self, effect: &Effect) -> bool {
        self.is_timed(effect) || self.shown_by_idle.iter().any(|own| own.effect.name == effect.name)
    }

    /// Need it not be asked again beside the other effects of this model? Losses of a drive change the tare too: beside them what the readings
    /// without a cut showed before has to hold its place in all readings.
    pub(in crate::learn) fn is_settled(&self, effect: &Effect, model: &[FittedEffect]) -> bool {
        self.has_own_data(effect) && (self.is_timed(effect) || !model.iter().any(|each| each.effect.has_losses()))
    }

    /// Number of parameters that were fitted for an effect, here or to the readings without a cut.
    pub(in crate::learn) fn parameters_of(&self, each: &FittedEffect) -> usize {
        let own = self.shown_by_idle.iter().find(|own| own.effect.name == each.effect.name);
        own.unwrap_or(each).free_count()
    }

    /// Least score of an effect.
    pub(in crate::learn) fn threshold(&self) -> f64 {
        self.criteria().least_score(self.data.is_series())
    }

    pub(in crate::learn) fn reject(&mut self, trial: &Trial, why: String) {
        self.rejected.retain(|r| r.name != trial.effect.name);
        self.rejected.push(Rejected { name: trial.effect.name.into(), why });
    }

    /// Kinds of cuts (operations of a log) in the data; empty if there is only one.
    pub(in crate::learn) fn kinds(&self) -> Vec<usize> {
        let mut kinds: Vec<usize> = self.data.used().map(|i| self.data.kind[i]).collect();
        kinds.sort_unstable();
        kinds.dedup();
        if kinds.len() < 2 { Vec::new() } else { kinds }
    }
}
