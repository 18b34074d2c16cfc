//! The answer of a diagnosis. In: base model and final model. Out: [`LearnReport`] with errors on data that neither was
//! fitted on, what is left, and the verdict.

use crate::learn::dataset::errors::errors;
use crate::learn::dataset::samples::Data;
use crate::learn::diagnose::criteria::{is_structure, tells_apart};
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::residual::{noise_floor, patterns};
use crate::learn::model::cross_validation::without;
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::Fitted;
use crate::learn::report::{Added, ChannelError, LearnReport, Transfer, Unexplained, Value};

impl Diagnosis<'_> {
    /// Held-out errors of each measured quantity.
    fn channels(&self, fitted: &Fitted) -> Vec<ChannelError> {
        let (base, last) = (self.unseen(&[]), self.unseen(&fitted.model.effects));
        let on =
            |r: &[f64], c: usize| errors(self.data, |i| if self.data.channel[i] == c { r[i] } else { f64::NAN }).rmse;
        let names = self.data.channel_names.iter().enumerate();
        names
            .map(|(c, name)| ChannelError { name: name.clone(), base_rmse: on(&base, c), final_rmse: on(&last, c) })
            .collect()
    }

    pub(in crate::learn) fn report(&mut self, base: &Fitted, fitted: &Fitted) -> LearnReport {
        let data = self.data;
        let errors_of = |f: &Fitted, d: &Data| errors(d, |i| d.reading[i] - f.predicted[i]);
        let effects = fitted.model.effects.iter().enumerate().map(|(e, each)| self.added(e, each, fitted)).collect();
        let used = data.used().count();
        LearnReport {
            samples: data.len(),
            used,
            train: self.train.used().count(),
            test: if self.split.test.iter().any(|t| *t) { used - self.train.used().count() } else { used },
            how: self.split.how.clone(),
            base: values(data, base),
            condition: base.condition,
            base_train: errors_of(base, &self.train),
            base_test: self.judged(&[]),
            effects,
            rejected: std::mem::take(&mut self.rejected),
            final_train: errors_of(fitted, &self.train),
            final_test: self.judged(&fitted.model.effects),
            channels: self.channels(fitted),
            final_base: values(data, fitted),
            covariance: covariance(data, fitted),
            tare_rps: data.state.iter().map(|state| state.reference_rps).find(|rps| rps.is_finite()),
            noise_floor: noise_floor(data, &fitted.residuals(data)),
            transfer: self.transfer(base, fitted),
            variants_tried: self.tried,
            supports_model: tells_apart(base.condition),
            ..LearnReport::default()
        }
    }

    fn added(&self, e: usize, each: &FittedEffect, fitted: &Fitted) -> Added {
        let found = self.evidence.iter().rev().find(|(name, ..)| *name == each.effect.name);
        let (_, evidence, p_value, errors) =
            found.cloned().unwrap_or((each.effect.name, String::new(), 1.0, [f64::NAN; 2]));
        let first: usize =
            fitted.model.effects[..e].iter().map(|u| u.values.len()).sum::<usize>() + fitted.model.base.len();
        let parameters =
            each.effect.parameters.iter().zip(&each.values).enumerate().map(|(k, (parameter, value))| Value {
                name: parameter.name.into(),
                value: *value,
                std_error: fitted.covariance[(first + k, first + k)].max(0.0).sqrt(),
                unit: parameter.unit.into(),
            });
        Added {
            name: each.effect.name.into(),
            parameters: parameters.collect(),
            p_value,
            test_rmse_before: errors[0],
            test_rmse_after: errors[1],
            evidence,
        }
    }

    fn transfer(&self, base: &Fitted, fitted: &Fitted) -> Vec<Transfer> {
        let trained: Vec<usize> = self.train.used().map(|i| self.data.kind[i]).collect();
        let other = |kind: &usize| !trained.contains(kind);
        self.kinds()
            .into_iter()
            .filter(other)
            .map(|kind| {
                let only = self.data.with_weights(without(self.data, |i| self.data.kind[i] != kind));
                Transfer {
                    kind: self.data.kind_names[kind].clone(),
                    samples: only.used().count(),
                    rmse_before: errors(&only, |i| only.reading[i] - base.predicted[i]).rmse,
                    rmse_after: errors(&only, |i| only.reading[i] - fitted.predicted[i]).rmse,
                }
            })
            .collect()
    }
}

fn values(data: &Data, fitted: &Fitted) -> Vec<Value> {
    let value = |(b, base): (usize, &crate::learn::dataset::samples::Base)| Value {
        name: base.name.clone(),
        value: fitted.model.base[b],
        std_error: fitted.std_error(b),
        unit: base.unit.clone(),
    };
    data.base.iter().enumerate().map(value).collect()
}

fn covariance(data: &Data, fitted: &Fitted) -> Vec<Vec<f64>> {
    let p = data.base.len();
    (0..p).map(|a| (0..p).map(|b| fitted.covariance[(a, b)]).collect()).collect()
}

pub(in crate::learn) fn unexplained(data: &Data, fitted: &Fitted, seed: u64) -> Option<Unexplained> {
    let residual = fitted.residuals(data);
    let strongest = patterns(data, &residual, &fitted.predicted, seed).into_iter().next()?;
    is_structure(strongest.test_r2, data.is_series())
        .then_some(Unexplained { test_r2_of_residual_structure: strongest.test_r2, largest_correlate: strongest.along })
}

pub(in crate::learn) fn verdict(report: &LearnReport) -> String {
    let names: Vec<&str> = report.effects.iter().map(|e| e.name.as_str()).collect();
    let (before, after) = (report.base_test.rmse, report.final_test.rmse);
    let found = match names.as_slice() {
        [] => "Nothing to add: no effect of the list explains the residual".to_owned(),
        some => format!("The residual is explained by {}; held-out error {before:.4} → {after:.4}", some.join(" and ")),
    };
    let rivals =
        report.confounded.iter().map(|c| format!("{} cannot be told from {}", c.names[0], c.names[1..].join(", ")));
    let left = report.unexplained.as_ref().map(|u| {
        format!(
            "{:.0} % of the remaining variance follows {} and is unexplained",
            100.0 * u.test_r2_of_residual_structure,
            u.largest_correlate
        )
    });
    let mut parts: Vec<String> = std::iter::once(found).chain(rivals).chain(left).collect();
    if report.effects.is_empty() && report.unexplained.is_none() {
        parts[0] = format!("Nothing to add: what is left ({after:.4}) has no structure beyond noise");
    }
    parts.join("; ") + "."
}
