//! `learn --experiment`: test cuts that separate confounded effects.
//!
//! In: job, data of the log, report with confounded effects. Each rival is fitted to the data together with the other
//! effects found. Every series of cuts on the list below is simulated, and each rival predicts its readings with the
//! coefficients from the log. The series on which the predictions differ most (root mean square over the whole run) is
//! written. It is assumed to be run after the log, with the same edge and a warm machine, on a fresh block. Out:
//! [`Experiment`].

use crate::effects::{self, State};
use crate::learn::align::{Aligned, Method};
use crate::learn::calibrate::plan::block;
use crate::learn::calibrate::test_program::{Action, Pass, program};
use crate::learn::dataset::binning::{bin_log, channels};
use crate::learn::dataset::samples::Data;
use crate::learn::diagnose::candidates::starts;
use crate::learn::log::Log;
use crate::learn::log::columns::DataError;
use crate::learn::log::resultant::MEAN_FORCE;
use crate::learn::log::resultant::Sample;
use crate::learn::model::design::FittedEffect;
use crate::learn::model::design::in_model;
use crate::learn::model::fit::{Fitted, fit, predict};
use crate::learn::model::whitening::whitened;
use crate::learn::program::simulated::ProgramView;
use crate::learn::program::simulated::{SimulatedProgram, simulate_for};
use crate::learn::report::{Confounded, LearnReport};
use crate::machine::wear::Lengths;
use crate::machine::{Box3, Job, Tool};

/// Test cuts on which rivals differ.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Rivals, as in the report.
    pub names: Vec<String>,
    /// What is cut.
    pub what: String,
    /// NC program.
    pub program: String,
    /// Root mean square difference of the predictions of the two closest rivals, unit of the reading.
    pub difference: f64,
    /// Noise floor of the log, if it is known.
    pub noise: Option<f64>,
}

/// Readings per second of the simulated run.
const RATE_HZ: f64 = 5.0;

/// Test cuts for the first group of confounded effects of a report; `None` if there is none.
pub fn experiment(data: &Data, report: &LearnReport, job: &Job) -> Result<Option<Experiment>, DataError> {
    let laws = |group: &&Confounded| group.names.iter().filter(|name| effects::named(name).is_some()).count() > 1;
    let Some(confounded) = report.confounded.iter().find(laws) else { return Ok(None) };
    let rivals = rivals(data, report, confounded);
    if rivals.len() < 2 {
        return Err(DataError::Unfit("the rivals of this log cannot be fitted again".into()));
    }
    let tool = job.tools.first().ok_or_else(|| DataError::Unfit("the setup has no tool".into()))?;
    let block = block(job)?;
    let mut best: Option<Experiment> = None;
    for (what, actions) in programmes(job, tool, &block) {
        let title = [format!("separates {}", confounded.names.join(" from ")), what.to_owned()];
        let Ok(text) = program(&title, &actions, tool, &block) else { continue };
        let Some(difference) = difference(&text, &rivals, job, data) else { continue };
        if best.as_ref().is_none_or(|b| difference > b.difference) {
            best = Some(Experiment {
                names: confounded.names.clone(),
                what: what.to_owned(),
                program: text,
                difference,
                noise: report.noise_floor,
            });
        }
    }
    best.map(Some).ok_or_else(|| DataError::Unfit("no programme of test cuts fits into the stock of the setup".into()))
}

/// Each rival fitted together with the other effects found.
pub fn rivals(data: &Data, report: &LearnReport, confounded: &Confounded) -> Vec<Fitted> {
    let Some(scaled) = whitened(data) else { return Vec::new() };
    let others: Vec<FittedEffect> =
        report.effects.iter().filter(|e| !confounded.names.contains(&e.name)).filter_map(in_model).collect();
    let with = |one: &FittedEffect| others.iter().cloned().chain([one.clone()]).collect::<Vec<FittedEffect>>();
    let best = |name: &String| {
        let present = fit(&scaled, &others, 12)?;
        let begin = starts(effects::named(name)?, &scaled, &present);
        let trials = begin.iter().filter_map(|one| fit(&scaled, &with(one), 12));
        trials.min_by(|a, b| a.squares.total_cmp(&b.squares))
    };
    confounded.names.iter().filter_map(best).collect()
}

/// Least root mean square difference between the predictions of any two rivals.
pub fn difference(program: &str, rivals: &[Fitted], job: &Job, learned: &Data) -> Option<f64> {
    let force = learned.channel_names.iter().find(|name| name.starts_with("force"));
    let sample = force.map(|name| if name == MEAN_FORCE { Sample::Mean } else { Sample::Peak });
    let prepared = simulate_for(program.as_bytes(), job, sample, None).ok()?;
    let mut data = data_without_readings(&prepared, job, &learned.channel_names);
    continue_after(&mut data, learned);
    let predicted: Vec<Vec<f64>> = rivals.iter().map(|r| predict(&data, &r.model)).collect();
    let between = |a: &[f64], b: &[f64]| {
        (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len().max(1) as f64).sqrt()
    };
    let pairs = (0..predicted.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
    pairs.map(|(a, b)| between(&predicted[a], &predicted[b])).min_by(f64::total_cmp)
}

/// The data of a log of a program, with readings of 0.
fn data_without_readings(prepared: &SimulatedProgram, job: &Job, channel_names: &[String]) -> Data {
    let count = (prepared.timeline().total_s() * RATE_HZ) as usize;
    let time_s: Vec<f64> = (0..count).map(|k| (k as f64 + 0.5) / RATE_HZ).collect();
    let known_name =
        |name: &String| crate::learn::log::quantity::MEASURED.iter().copied().find(|m| name.starts_with(m));
    let measured = channel_names.iter().filter_map(known_name).map(|name| (name, vec![0.0; count])).collect();
    let sample_uncertainty_s = vec![0.0; time_s.len()];
    let aligned =
        Aligned { program_s: time_s.clone(), method: Method::Position, sample_uncertainty_s, ..Aligned::default() };
    let log = Log { time_s, measured, ..Log::default() };
    let known: ProgramView = prepared.known(job);
    bin_log(&log, &aligned, &known, &channels(&log)).0
}

/// Adds the time, sliding distance and volume at the end of the log.
fn continue_after(data: &mut Data, learned: &Data) {
    let last = |of: fn(&State) -> f64| learned.state.iter().map(of).filter(|v| v.is_finite()).fold(0.0, f64::max);
    let (time, volume) = (last(|s| s.time_s), last(|s| s.volume_mm3));
    let slid = Lengths([last(|s| s.slid.0[0]), last(|s| s.slid.0[1]), last(|s| s.slid.0[2]), last(|s| s.slid.0[3])]);
    for state in &mut data.state {
        state.time_s += time;
        state.slid = state.slid.and(&slid);
        state.volume_mm3 += volume;
    }
}

/// The series of cuts to choose from.
fn programmes(job: &Job, tool: &Tool, block: &Box3) -> Vec<(&'static str, Vec<Action>)> {
    let d = tool.diameter_mm;
    let rps = (0.6 * job.machine.spindle.max_rps).min(3.3e3 / (std::f64::consts::PI * d));
    let deep = (0.3 * d).min(0.3 * (block.max.z - block.min.z));
    let teeth = f64::from(tool.flutes);
    let pass = |axial: f64, radial: f64, up: bool, rps: f64, per_tooth: &[f64]| {
        let feeds_mm_s = per_tooth.iter().map(|f| f * d * teeth * rps).collect();
        Action::Pass(Pass { axial_mm: axial, radial_mm: radial * d, up, rps, feeds_mm_s, note: String::new() })
    };
    let air = |seconds: f64, rps: f64| Action::Air { rps, seconds };
    let feed = [0.006];
    let same =
        |count: usize, up: bool| (0..count).map(move |_| pass(deep, 0.25, up, rps, &[0.006])).collect::<Vec<_>>();
    let speeds = [0.4, 0.6, 0.8, 1.0].map(|x| x * rps);
    let mut sides = Vec::new();
    for k in 0..6 {
        sides.push(pass(deep, 0.25, k % 2 == 1, rps, &feed));
    }
    vec![
        (
            "the same cut again and again, with air before and after",
            [vec![air(20.0, rps)], same(10, false), vec![air(20.0, rps)]].concat(),
        ),
        ("air for two minutes, then cuts", [vec![air(60.0, rps), air(60.0, rps)], same(3, false)].concat()),
        (
            "four feeds a decade apart at the same engagement",
            (0..4).map(|_| pass(deep, 0.25, false, rps, &[0.001, 0.0025, 0.005, 0.01])).collect(),
        ),
        ("climb and conventional passes of the same depth in turn", sides),
        ("conventional passes alone", same(5, true)),
        (
            "the same cut in steps of depth, deepest first",
            [1.0, 0.75, 0.5, 0.25].iter().map(|x| pass(x * deep, 0.25, false, rps, &feed)).collect(),
        ),
        (
            "the same cut in steps of width",
            [0.05, 0.1, 0.2, 0.4, 0.7].iter().map(|b| pass(deep, *b, false, rps, &feed)).collect(),
        ),
        (
            "four spindle speeds, air and cut at each",
            speeds.iter().flat_map(|n| [air(8.0, *n), pass(deep, 0.25, false, *n, &feed)]).collect(),
        ),
        (
            "narrow and wide cuts at small and large feeds",
            [0.1, 0.5, 0.1, 0.5].iter().map(|b| pass(deep, *b, false, rps, &[0.002, 0.01])).collect(),
        ),
    ]
}
