//! What the report on learning plots: measured and predicted readings in order, with and without the effects, and the
//! mean residual along every covariate. In: data, report. Out: plain numbers for [`crate::report`].

use crate::learn::dataset::samples::Data;
use crate::learn::diagnose::residual::COVARIATES;
use crate::learn::diagnose::unnamed::with_predicted_loads;
use crate::learn::model::design::FittedEffect;
use crate::learn::model::design::in_model;
use crate::learn::model::fit::fit;
use crate::learn::model::whitening::whitened;
use crate::learn::report::LearnReport;

/// One measured quantity over the run.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Its name.
    pub name: String,
    /// s; the order of the cuts in a table.
    pub time_s: Vec<f64>,
    /// Readings.
    pub measured: Vec<f64>,
    /// Predicted by the base model.
    pub before: Vec<f64>,
    /// Predicted with the effects found.
    pub after: Vec<f64>,
}

/// Mean residual in bins of a covariate.
#[derive(Debug, Clone, PartialEq)]
pub struct CovariateCurve {
    /// The covariate.
    pub name: String,
    /// (mean covariate, mean residual of the base model, of the final model, samples) of each bin.
    pub bins: Vec<[f64; 4]>,
}

/// Everything that is plotted.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curves {
    /// Measured quantities.
    pub traces: Vec<Trace>,
    /// Residuals along covariates, the one with the largest Σ n r̄² of the base model first.
    pub along: Vec<CovariateCurve>,
}

/// Bins of a covariate.
const BINS: usize = 14;

/// The plots; empty if the model cannot be fitted.
pub fn curves(data: &Data, report: &LearnReport) -> Curves {
    let unnamed = report.unnamed.iter().map(|u| &u.added);
    let effects: Vec<FittedEffect> = report.effects.iter().chain(unnamed).filter_map(in_model).collect();
    let fits = |data: Data| {
        let base = fit(&data, &[], 0)?;
        let last = fit(&with_predicted_loads(&data, &base.predicted), &effects, 25)?;
        Some((base, last))
    };
    let Some((base, last)) = whitened(data).and_then(fits) else {
        return Curves::default();
    };
    let channels = data.channel_names.iter().enumerate();
    let traces = channels.map(|(c, name)| trace(data, c, name, &base.predicted, &last.predicted)).collect();
    let residual = |predicted: &[f64]| -> Vec<f64> { data.reading.iter().zip(predicted).map(|(y, p)| y - p).collect() };
    let (before, after) = (residual(&base.predicted), residual(&last.predicted));
    let mut along: Vec<CovariateCurve> = COVARIATES
        .iter()
        .filter_map(|c| {
            let values: Vec<f64> = data.state.iter().map(|state| c.of(state)).collect();
            binned(data, c.name(), &values, &before, &after)
        })
        .collect();
    let structure = |a: &CovariateCurve| a.bins.iter().map(|b| b[3] * b[1] * b[1]).sum::<f64>();
    along.sort_by(|a, b| structure(b).total_cmp(&structure(a)));
    Curves { traces, along }
}

fn trace(data: &Data, channel: usize, name: &str, before: &[f64], after: &[f64]) -> Trace {
    let members: Vec<usize> = data.used().filter(|i| data.channel[*i] == channel).collect();
    let take = |values: &[f64]| members.iter().map(|i| values[*i]).collect::<Vec<f64>>();
    let time =
        |(k, i): (usize, &usize)| if data.state[*i].time_s.is_finite() { data.state[*i].time_s } else { k as f64 };
    Trace {
        name: name.to_owned(),
        time_s: members.iter().enumerate().map(time).collect(),
        measured: take(&data.reading),
        before: take(before),
        after: take(after),
    }
}

/// Mean residuals in bins of equal numbers of samples; `None` if the covariate does not vary.
fn binned(data: &Data, name: &str, values: &[f64], before: &[f64], after: &[f64]) -> Option<CovariateCurve> {
    let mut members: Vec<usize> = data.used().filter(|i| values[*i].is_finite()).collect();
    members.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let (first, last) = (values[*members.first()?], values[*members.last()?]);
    if last - first <= 1e-9 * last.abs().max(1e-9) || members.len() < 4 {
        return None;
    }
    let size = members.len().div_ceil(BINS).max(1);
    let bin = |part: &[usize]| {
        let weight: f64 = part.iter().map(|i| data.weight[*i]).sum();
        let mean = |of: &[f64]| part.iter().map(|i| data.weight[*i] * of[*i]).sum::<f64>() / weight.max(1e-300);
        [mean(values), mean(before), mean(after), part.len() as f64]
    };
    Some(CovariateCurve { name: name.to_owned(), bins: members.chunks(size).map(bin).collect() })
}
