//! Evaluation of a model on data that it was not fitted to. In: a job with the model; a log of a program, or a table of
//! steady cuts. Out: [`Evaluation`]: errors of the model, of its coefficients without its effects, and of the mean of
//! the readings. Nothing is fitted.

use crate::engage::Loader;
use crate::learn::dataset::binning::channels;
use crate::learn::dataset::errors::errors;
use crate::learn::dataset::samples::{Class, Data};
use crate::learn::diagnose::ceiling::without_ceilings;
use crate::learn::diagnose::criteria::Criteria;
use crate::learn::diagnose::unnamed::with_predicted_loads;
use crate::learn::log::columns::DataError;
use crate::learn::log::read_log;
use crate::learn::log::resultant::resultant;
use crate::learn::model::design::{FittedEffect, in_model_file, in_quantity_of};
use crate::learn::model::fit::{Model, predict};
use crate::learn::program::declared::in_force;
use crate::learn::program::simulated::{simulate_declared, simulate_for};
use crate::learn::report::{Ceiling, Errors};
use crate::learn::session::{LearnError, LogOptions, dataset_of, of_another_program, of_one_run};
use crate::machine::Job;
use crate::machine::material::{ForceModel, RelativeLoad};

/// Errors of one measured quantity, in its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct OfQuantity {
    /// Quantity and unit.
    pub name: String,
    /// Samples that count.
    pub samples: usize,
    /// Errors of the model.
    pub model: Errors,
    /// Errors of its coefficients without its effects.
    pub without_effects: Errors,
    /// Root mean square about the mean of the readings; a useful model is better than that.
    pub about_mean: f64,
    /// Mean of reading − prediction.
    pub bias: f64,
    /// Median of |error| / |reading| over the samples in a cut, percent.
    pub median_of_cuts: f64,
}

/// Errors of a model.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Evaluation {
    /// Samples read.
    pub samples: usize,
    /// How the log was aligned with its program, and the uncertainty of that, s; `None` for tables.
    pub tied: Option<(&'static str, f64)>,
    /// Effects of the model on loads and readings.
    pub effects: Vec<String>,
    /// Quantity by quantity.
    pub quantities: Vec<OfQuantity>,
    /// What is odd about the log.
    pub warnings: Vec<String>,
}

/// Evaluates the model of a job on a log of one of its programs. Effects on geometry and motion already act in the job.
pub fn of_log(
    program: &[u8],
    job: &Job,
    log: &[u8],
    options: &LogOptions,
    loader: Option<Loader>,
) -> Result<Evaluation, LearnError> {
    let mut log = read_log(log, &options.mapping)?;
    resultant(&mut log, options.sample, options.window_s);
    let channels = channels(&log);
    let prepared = match channels.force_xy {
        // Here other geometries only weigh samples and help to align by the load, and their peak forces about a runout take minutes.
        Some(_) => simulate_declared(program, job, Some(options.sample), loader)?,
        None => simulate_for(program, job, None, loader)?,
    };
    let (log, aligned) = of_one_run(log, &prepared, job, &channels)?;
    let (data, aligned, _) = dataset_of(&prepared, job, &log, &channels, aligned);
    let found = of_data(&data, job)?;
    let mut warnings = log.warnings;
    warnings.extend(found.warnings.iter().cloned().chain(of_another_program(&aligned)));
    let tied = Some((aligned.method.name(), aligned.uncertainty_s));
    Ok(Evaluation { samples: log.time_s.len(), tied, warnings, ..found })
}

/// Evaluates the model of a job on data.
pub fn of_data(data: &Data, job: &Job) -> Result<Evaluation, DataError> {
    let base: Vec<f64> = data.base.iter().map(|base| coefficient(&base.name, data, job)).collect::<Result<_, _>>()?;
    let effects: Vec<FittedEffect> =
        in_model_file(&job.process).into_iter().map(|each| in_quantity_of(data, each)).collect();
    let plain = Model { base: base.clone(), effects: Vec::new() };
    // What stops at a ceiling of the meter tells of no error.
    let (below, mut ceilings) = without_ceilings(&about_model_speed(steady(data), job), &Criteria::default());
    for ceiling in &mut ceilings {
        ceiling.read_at_meter(&job.machine.spindle);
    }
    let data = &with_predicted_loads(&below, &predict(data, &plain));
    let without = predict(data, &plain);
    let predicted = predict(data, &Model { base, effects: effects.clone() });
    let of = |(c, name): (usize, &String)| {
        let on = |p: &[f64]| errors(data, |i| if data.channel[i] == c { data.reading[i] - p[i] } else { f64::NAN });
        let members: Vec<usize> = data.used().filter(|i| data.channel[*i] == c).collect();
        let weight: f64 = members.iter().map(|i| data.weight[*i]).sum();
        let mean = |of: &dyn Fn(usize) -> f64| members.iter().map(|&i| data.weight[i] * of(i)).sum::<f64>() / weight;
        let middle = mean(&|i| data.reading[i]);
        OfQuantity {
            name: name.clone(),
            samples: members.len(),
            model: on(&predicted),
            without_effects: on(&without),
            about_mean: mean(&|i| (data.reading[i] - middle).powi(2)).sqrt(),
            bias: mean(&|i| data.reading[i] - predicted[i]),
            median_of_cuts: median_of_cuts(data, &members, &predicted),
        }
    };
    let quantities = data.channel_names.iter().enumerate().map(of).collect();
    let effects = effects.iter().map(|each| each.effect.name.to_owned()).collect();
    let warnings = ceilings.iter().map(Ceiling::in_words).collect();
    Ok(Evaluation { samples: data.len(), tied: None, effects, quantities, warnings })
}

/// Median of |error| / |reading| over those of some samples that are in a cut, percent.
fn median_of_cuts(data: &Data, members: &[usize], predicted: &[f64]) -> f64 {
    let loads: Vec<usize> = (0..data.base.len()).filter(|&k| data.base[k].class != Class::Tare).collect();
    let in_cut = members.iter().filter(|&&i| loads.iter().any(|&k| data.columns[k][i] != 0.0));
    let mut errors: Vec<f64> =
        in_cut.map(|&i| 100.0 * ((data.reading[i] - predicted[i]) / data.reading[i]).abs()).collect();
    errors.sort_by(f64::total_cmp);
    errors.get(errors.len() / 2).copied().unwrap_or(0.0)
}

/// The data without the samples in which the spindle runs up: no model has the power that accelerates its mass.
fn steady(data: &Data) -> Data {
    let Some(run_up) = data.base.iter().position(|base| base.name == "run_up") else { return data.clone() };
    let runs_up = |i: usize| data.columns[run_up][i] > 0.0;
    data.with_weights((0..data.len()).map(|i| if runs_up(i) { 0.0 } else { data.weight[i] }).collect())
}

/// The data with the tare's law about the speed at which the model has its tare, instead of one of their own.
fn about_model_speed(mut data: Data, job: &Job) -> Data {
    let relative = job.process.relative.as_ref().and_then(|relative| relative.tare_rps);
    if let Some(rps) = job.process.tare_rps.or(relative) {
        data.state
            .iter_mut()
            .filter(|state| state.reference_rps.is_finite())
            .for_each(|state| state.reference_rps = rps);
    }
    data
}

/// Value of a base coefficient in the job.
fn coefficient(name: &str, data: &Data, job: &Job) -> Result<f64, DataError> {
    let unfit = |why: &str| DataError::Unfit(why.to_owned());
    let linear = || in_force(job).ok_or_else(|| unfit("the model has no linear edge coefficients to compare"));
    let cutting = data.base.iter().find(|b| b.class == Class::Cutting && !b.unit.starts_with("N/"));
    if let Some(unit) = cutting.and_then(|b| b.unit.split('/').next()) {
        return of_relative(name, unit, job);
    }
    match name {
        "tare" => Ok(tare_w(data, job)),
        "run_up" => Ok(0.0),
        "k_tc" => linear().map(|k| k.k_tc),
        "k_te" => linear().map(|k| k.k_te),
        "k_rc" => linear().map(|k| k.k_rc),
        "k_re" => linear().map(|k| k.k_re),
        other => of_layer(other, job).ok_or_else(|| unfit(&format!("the model has no {other}"))),
    }
}

/// Coefficient of a load in percent or ampere: no other model predicts such readings.
fn of_relative(name: &str, unit: &str, job: &Job) -> Result<f64, DataError> {
    let learned = job.process.relative.as_ref().filter(|relative| relative.unit == unit);
    let Some(RelativeLoad { tare, k_tc, k_te, .. }) = learned else {
        return Err(DataError::Unfit(format!(
            "the load is in {unit}, and the model has no coefficients in {unit}: learn it from such a log, or take readings in W, N·m or N"
        )));
    };
    Ok(match name {
        "tare" => *tare,
        "k_tc" => *k_tc,
        "k_te" => *k_te,
        _ => 0.0,
    })
}

/// Coefficient of a layer model.
fn of_layer(name: &str, job: &Job) -> Option<f64> {
    let Some(ForceModel::Named { parameters, .. }) = &job.process.base else { return None };
    parameters.iter().find(|(own, _)| own == name).map(|(_, value)| *value)
}

/// Tare of the model at the reference speed of the data, W: the learned tare times the ratio of the declared tares at
/// the two speeds. Without a declared tare its torque is the same at both.
fn tare_w(data: &Data, job: &Job) -> f64 {
    let declared = &job.machine.spindle.tare_w;
    let rps = data.state.iter().map(|state| state.reference_rps).find(|rps| rps.is_finite()).unwrap_or(0.0);
    let Some(learned_w) = job.process.tare_w else { return declared.at(rps) };
    let Some(learned_rps) = job.process.tare_rps else { return learned_w };
    let there_w = declared.at(learned_rps);
    let is_torque = data.channel_names.first().is_some_and(|name| name.starts_with("spindle_torque"));
    match there_w > 0.0 {
        true => learned_w * declared.at(rps) / there_w,
        false if is_torque => learned_w * rps / learned_rps,
        false => learned_w,
    }
}
