//! Data for the tests of a diagnosis. In: the share by which each reading exceeds the load, and the state of each
//! sample. Out: [`Data`] with one coefficient, and a diagnosis of it in five folds.

use crate::effects::{State, named};
use crate::learn::dataset::samples::{Base, Class, Data, UNBOUNDED};
use crate::learn::diagnose::diagnosis::{Diagnosis, Options};
use crate::learn::diagnose::free_curve::along_all;
use crate::learn::diagnose::trial_cache::TrialCache;
use crate::learn::model::cross_validation::{Split, held_out_residuals};
use crate::learn::model::design::FittedEffect;

/// Number of blocks, and samples per block.
pub(super) const BLOCKS: usize = 24;
pub(super) const EACH: usize = 40;
/// Standard deviation of the noise between −1 and 1: 1/√3.
pub(super) const NOISE: f64 = 0.58;

/// Loads of 100 to 160; the reading of sample i is 1 + `share(i)` times that, with noise between −`noise` and `noise`.
pub(super) fn made(share: impl Fn(usize) -> f64, noise: f64, state: impl Fn(usize) -> State) -> Data {
    let n = BLOCKS * EACH;
    let load = |i: usize| 100.0 + 10.0 * (i % 7) as f64;
    let wobble = |i: usize| noise * (((i * 7919) % 101) as f64 / 50.0 - 1.0);
    let base = Base { name: "k_tc".into(), unit: String::new(), class: Class::Cutting, prior: None, bounds: UNBOUNDED };
    Data {
        base: vec![base],
        columns: vec![(0..n).map(load).collect()],
        reading: (0..n).map(|i| load(i) * (1.0 + share(i)) + wobble(i)).collect(),
        weight: vec![1.0; n],
        state: (0..n).map(state).collect(),
        span_s: vec![1.0; n],
        readings_per_sample: vec![1.0; n],
        run: vec![0; n],
        channel: vec![0; n],
        block: (0..n).map(|i| i / EACH).collect(),
        kind: vec![0; n],
        ..Data::default()
    }
}

/// An effect with its first parameters fitted from these values; the others change nothing.
pub(super) fn in_first(name: &str, values: &[f64]) -> FittedEffect {
    let effect = named(name).unwrap();
    let others = effect.parameters.iter().skip(values.len()).map(|parameter| parameter.neutral.unwrap());
    let free = (0..effect.parameters.len()).map(|k| k < values.len()).collect();
    FittedEffect { effect, values: values.iter().copied().chain(others).collect(), free }
}

/// Every fifth block left out in turn.
pub(super) fn fifths(data: &Data) -> Split {
    let fold = data.block.iter().map(|block| block % 5).collect();
    Split { test: vec![false; data.len()], fold, folds: 5, how: String::new() }
}

/// A diagnosis with the base model fitted.
pub(super) fn begun<'a>(data: &'a Data, split: &'a Split, options: &'a Options, noise: f64) -> Diagnosis<'a> {
    Diagnosis {
        data,
        train: data.clone(),
        split,
        options,
        tried: 0,
        rejected: Vec::new(),
        evidence: Vec::new(),
        pair: Vec::new(),
        shown_by_idle: Vec::new(),
        base_residual: held_out_residuals(data, &[], split),
        floor: NOISE * noise,
        noise: NOISE * noise,
        cache: TrialCache::default(),
        along: along_all(data),
    }
}
