//! A diagnosis as it stands: its data and split, what was tried, refused and believed so far.

use crate::effects::{Acts, Covariate, Effect};
use crate::learn::dataset::samples::Data;
use crate::learn::diagnose::criteria::Criteria;
use crate::learn::diagnose::free_curve::Along;
use crate::learn::diagnose::memory::Memory;
use crate::learn::diagnose::trial::Trial;
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
    /// Effects that the model begins with: those of a model learned before. They stay where they still pay.
    pub known: Vec<FittedEffect>,
    /// By what it decides.
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
    pub(in crate::learn) data: &'a Data,
    pub(in crate::learn) train: Data,
    pub(in crate::learn) split: &'a Split,
    pub(in crate::learn) options: &'a Options,
    pub(in crate::learn) tried: usize,
    pub(in crate::learn) rejected: Vec<Rejected>,
    pub(in crate::learn) evidence: Vec<(&'static str, String, f64, [f64; 2])>,
    /// Two effects that explain the residual only together: neither stays without the other.
    pub(in crate::learn) pair: Vec<&'static str>,
    /// Held-out residual of the base model on the training blocks.
    pub(in crate::learn) base_residual: Vec<f64>,
    /// Noise of neighbouring readings; 0 where it is not known.
    pub(in crate::learn) floor: f64,
    /// The same with what they share.
    pub(in crate::learn) noise: f64,
    /// What was tried so far, on these data with these weights.
    pub(in crate::learn) memory: Memory,
    /// The samples along every covariate that a curve may follow.
    pub(in crate::learn) along: Vec<(Covariate, Along)>,
}

impl Diagnosis<'_> {
    pub(in crate::learn) fn criteria(&self) -> &Criteria {
        &self.options.criteria
    }

    /// The samples along a covariate.
    pub(in crate::learn) fn along(&self, covariate: Covariate) -> Option<&Along> {
        self.along.iter().find(|(each, _)| *each == covariate).map(|(_, along)| along)
    }

    pub(in crate::learn) fn is_timed(&self, effect: &Effect) -> bool {
        self.data.timed_acceleration.is_some() && effect.acts == Acts::Motion
    }

    /// Least score of an effect.
    pub(in crate::learn) fn threshold(&self) -> f64 {
        self.criteria().least_score(self.data.is_series())
    }

    pub(in crate::learn) fn reject(&mut self, trial: &Trial, why: String) {
        self.rejected.retain(|r| r.name != trial.effect.name);
        self.rejected.push(Rejected { name: trial.effect.name.into(), why });
    }

    pub(in crate::learn) fn kinds(&self) -> Vec<usize> {
        let mut kinds: Vec<usize> = self.data.used().map(|i| self.data.kind[i]).collect();
        kinds.sort_unstable();
        kinds.dedup();
        if kinds.len() < 2 { Vec::new() } else { kinds }
    }
}
