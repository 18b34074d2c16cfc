//! The whole of `learn`: a program, a job and a measured log in; a [`LearnReport`] and the process model out.

use crate::engage::{EngageError, Loader};
use crate::learn::align::Method;
use crate::learn::align::line::{by_line, paced};
use crate::learn::align::load::by_load;
use crate::learn::align::{Aligned, by_position};
use crate::learn::dataset::binning::{Channels, cells, channels};
use crate::learn::dataset::samples::{Base, Class, Data};
use crate::learn::diagnose::{Options, diagnose};
use crate::learn::log::columns::DataError;
use crate::learn::log::resultant::MEAN_FORCE;
use crate::learn::log::resultant::{Sample, resultant};
use crate::learn::log::{Log, read_log};
use crate::learn::model::cross_validation::by_blocks;
use crate::learn::model::design::Use;
use crate::learn::model::design::used;
use crate::learn::program::other_geometry::Sizes;
use crate::learn::program::peak_forces::About;
use crate::learn::program::runout_grid::RunoutGrid;
use crate::learn::program::simulated::Known;
use crate::learn::program::simulated::Prepared;
use crate::learn::program::simulated::prepare_for;
use crate::learn::program::variant::OtherGeometry;
use crate::learn::report::{Alignment, LearnReport, Value};
use crate::learn::runout::settled;
use crate::machine::Job;
use crate::machine::material::LinearEdge;

/// How a log is learned from.
#[derive(Debug, Clone, Default)]
pub struct LogOptions {
    /// Columns renamed: (theirs, ours).
    pub mapping: Vec<(String, String)>,
    /// What a sample of a force is, and over which time, s.
    pub sample: Sample,
    /// Window of that sample, s.
    pub window_s: Option<f64>,
    /// The diagnosis.
    pub diagnosis: Options,
}

/// Why nothing can be learned.
#[derive(Debug, thiserror::Error)]
pub enum LearnError {
    /// The log.
    #[error(transparent)]
    Data(#[from] DataError),
    /// The simulation.
    #[error(transparent)]
    Engage(#[from] EngageError),
}

/// Time of the log over that of the program, beyond which the clock is wrong rather than the machine slow.
const STRETCH: [f64; 2] = [0.1, 10.0];
/// The times of the blocks show another acceleration when it is below this share of the declared one, with so many nats.
const LEAST_SLOWER: f64 = 0.6;
const SHOWN_NATS: f64 = 30.0;
/// Time in motion at an end of the program that no sample belongs to, beyond which it is said, s.
const UNSEEN_S: f64 = 1.0;
/// Stretches of a log for which the uncertainty of the alignment is said.
const STRETCHES: usize = 20;
/// Rounds in which the cut is simulated anew with the stock and the tool that were found.
const GROWN_ROUNDS: usize = 2;

/// What was learned, and from what.
#[derive(Debug, Clone)]
pub struct Learned {
    /// The answer.
    pub report: LearnReport,
    /// The aligned data behind it.
    pub data: Data,
}

/// Learns from a log in CSV or adapter output; `loader` reads the files of stock.
pub fn run(
    program: &[u8],
    job: &Job,
    log: &[u8],
    options: &LogOptions,
    loader: Option<Loader>,
) -> Result<Learned, LearnError> {
    let mut log = read_log(log, &options.mapping)?;
    resultant(&mut log, options.sample, options.window_s);
    let channels = channels(&log);
    let prepared = prepare_for(program, job, channels.force_xy.map(|_| options.sample), loader)?;
    let mut learned = learn_with_data(&prepared, job, &log, &channels, options, loader)?;
    if options.sample == Sample::Mean {
        learned.data.channel_names.iter_mut().for_each(|name| *name = name.replace("force_xy_n", MEAN_FORCE));
    }
    Ok(learned)
}

/// Learns from a log that was read, with what was prepared for its program.
pub fn learn(
    prepared: &Prepared,
    job: &Job,
    log: &Log,
    channels: &Channels,
    options: &LogOptions,
) -> Result<LearnReport, LearnError> {
    learn_with_data(prepared, job, log, channels, options, None).map(|learned| learned.report)
}

/// The same, with the data it was learned from; `loader` reads the files of stock.
pub fn learn_with_data(
    prepared: &Prepared,
    job: &Job,
    log: &Log,
    channels: &Channels,
    options: &LogOptions,
    loader: Option<Loader>,
) -> Result<Learned, LearnError> {
    refuse_dead(log)?;
    let (mut data, aligned, mut lowered) = data_of(prepared, job, log, channels)?;
    let answer = |data: &Data| {
        diagnose(data, &by_blocks(data, "stretch of time"), &options.diagnosis)
            .ok_or_else(|| DataError::Unfit("too few samples of the log belong to the program".into()))
    };
    let mut report = answer(&data)?;
    let (mut sizes, mut others) = (Sizes::usual(job), prepared.others.clone());
    for _ in 0..GROWN_ROUNDS {
        let Some(found) = Sizes::found(job, &report).filter(|found| !found.is_near(&sizes)) else { break };
        let again = prepared.grown_as(job, found, loader);
        // Without what reads the files of stock there is nothing to grow.
        if again.len() < others.len() {
            break;
        }
        (sizes, others) = (found, again);
        let known = Known { others: others.clone(), ..prepared.known(job) };
        let (nearer, doubtful) = cells(log, &aligned, &known, channels);
        data = Data { timed_acceleration: data.timed_acceleration, clock_s: data.clock_s, ..nearer };
        lowered = doubtful;
        report = answer(&data)?;
    }
    let taken = Taken { prepared, others: &others, job, log, channels, aligned: &aligned };
    if let Some(nearer) = taken.about_the_runout(&report) {
        data = Data { timed_acceleration: data.timed_acceleration, clock_s: data.clock_s, ..nearer };
        report = answer(&data)?;
    }
    report.samples = log.time_s.len();
    report.down_weighted = lowered;
    report.alignment = Some(described(&aligned, log));
    report.warnings.extend(log.warnings.iter().cloned());
    let covered = covered(&aligned, prepared);
    if covered < 0.9 {
        report.warnings.push(format!("the log covers {:.0} % of the program", 100.0 * covered));
    }
    report.warnings.extend(unseen_ends(&aligned, prepared));
    let doubts = doubts(&report, &aligned, prepared, log, &data);
    if !doubts.is_empty() {
        report.supports_model = false;
        report.verdict = format!("The data do not support a model: {}. {}", doubts.join("; "), report.verdict);
        report.warnings.extend(doubts);
    }
    if let Some(base) = crate::learn::model::fit::fit(&data, &[], 0) {
        report.windows = crate::learn::diagnose::over_time::windows(&data, &base);
        report.wear = crate::learn::diagnose::over_time::said(&report.windows);
    }
    Ok(Learned { report, data })
}

/// Signals that cannot say anything.
fn refuse_dead(log: &Log) -> Result<(), LearnError> {
    for (name, values) in &log.measured {
        let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        let (lo, hi) = known.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(*v), hi.max(*v)));
        if known.len() < 20 {
            return Err(DataError::Unfit(format!("{name} has only {} values; 20 are the least", known.len())).into());
        }
        crate::learn::log::plausible::changes(name, lo, hi)?;
    }
    Ok(())
}

/// Why no model should rest on these data.
fn doubts(report: &LearnReport, aligned: &Aligned, prepared: &Prepared, log: &Log, data: &Data) -> Vec<String> {
    let mut doubts = Vec::new();
    for (name, values) in &log.measured {
        let missing = values.iter().filter(|v| !v.is_finite()).count();
        if missing * 2 > values.len() {
            doubts.push(format!("{} % of {name} are missing", 100 * missing / values.len()));
        }
    }
    let most = if aligned.method == Method::Load { 0.6 } else { 0.3 };
    if aligned.misfit > most {
        doubts.push(format!(
            "{:.0} % of the log do not fit this program: is it the log of another one?",
            100.0 * aligned.misfit
        ));
    }
    let covered = covered(aligned, prepared);
    if covered < 0.3 {
        doubts.push(format!("the log covers only {:.0} % of the program", 100.0 * covered));
    }
    let stretch = described(aligned, log).stretch;
    if !(STRETCH[0]..=STRETCH[1]).contains(&stretch) {
        doubts.push(format!(
            "the clock of the log takes {stretch:.3} times as long as the program: is the unit of its time right?"
        ));
    }
    let declared = data.base.iter().find(|b| b.name == "k_tc").and_then(|b| b.prior).map(|(value, _)| value);
    doubts.extend(crate::learn::log::plausible::doubts(&unaided(data), declared));
    if let Some(ratio) = over_declared(data).filter(|ratio| !(0.05..=20.0).contains(ratio)) {
        doubts.push(format!(
            "the forces would be {ratio:.4} times the declared ones: are the units right, or columns swapped?"
        ));
    }
    if report.base_train.r2 < 0.2 && report.effects.is_empty() {
        doubts.push("the predicted load explains next to nothing of the measured one".into());
    }
    doubts
}

/// Base coefficients of a spindle reading as the data alone have them: what the setup declares must not hide a wrong unit.
/// Forces cannot do without it.
fn unaided(data: &Data) -> Vec<Value> {
    if !data.base.iter().any(|b| b.class == Class::Tare) {
        return Vec::new();
    }
    let base = data.base.iter().cloned().map(|b| Base { prior: None, ..b }).collect();
    let fitted = crate::learn::model::fit::fit(&Data { base, ..data.clone() }, &[], 0);
    let value = |(b, f): (usize, &crate::learn::model::fit::Fitted)| Value {
        name: data.base[b].name.clone(),
        value: f.model.base[b],
        std_error: f.std_error(b),
        unit: data.base[b].unit.clone(),
    };
    fitted.iter().flat_map(|f| (0..data.base.len()).map(move |b| value((b, f)))).collect()
}

/// Measured forces over those by the declared coefficients; `None` where something else is measured, or none are declared.
fn over_declared(data: &Data) -> Option<f64> {
    if data.base.iter().any(|b| b.class == Class::Tare) {
        return None;
    }
    let declared: Vec<f64> = data.base.iter().map(|b| b.prior.map_or(0.0, |(value, _)| value)).collect();
    let predicted = |i: usize| declared.iter().zip(&data.columns).map(|(k, column)| k * column[i]).sum::<f64>();
    let (mut both, mut square) = (0.0, 0.0);
    for i in data.used() {
        both += data.weight[i] * data.reading[i] * predicted(i);
        square += data.weight[i] * predicted(i).powi(2);
    }
    (square > 0.0).then(|| both / square)
}

/// Share of the program's time between the first and the last sample that belong to it.
fn covered(aligned: &Aligned, prepared: &Prepared) -> f64 {
    let placed = aligned.program_s.iter().copied().filter(|t| t.is_finite());
    let (first, last) = placed.fold((f64::INFINITY, 0.0), |(lo, hi), t| (f64::min(lo, t), f64::max(hi, t)));
    ((last - first) / prepared.timeline.total_s().max(1e-9)).max(0.0)
}

/// What no sample belongs to at the beginning of the program and at its end, where the machine moves for longer than
/// [`UNSEEN_S`].
fn unseen_ends(aligned: &Aligned, prepared: &Prepared) -> Vec<String> {
    let placed = aligned.program_s.iter().copied().filter(|t| t.is_finite());
    let (first, last) = placed.fold((f64::INFINITY, 0.0), |(lo, hi), t| (f64::min(lo, t), f64::max(hi, t)));
    let moving = |from: f64, to: f64| -> f64 {
        let moves = prepared.timeline.spots.iter().filter(|s| s.move_id.is_some());
        moves.map(|s| (s.end_s.min(to) - s.start_s.max(from)).max(0.0)).sum()
    };
    let ends = [("first", moving(0.0, first)), ("last", moving(last, f64::INFINITY))];
    let said = |(end, moving_s): (&str, f64)| {
        format!(
            "no sample belongs to the {end} {moving_s:.1} s in which the program moves: does the log hold all of it?"
        )
    };
    ends.into_iter().filter(|(_, moving_s)| *moving_s > UNSEEN_S).map(said).collect()
}

/// The aligned data of a log.
pub fn data_of(
    prepared: &Prepared,
    job: &Job,
    log: &Log,
    channels: &Channels,
) -> Result<(Data, Aligned, usize), LearnError> {
    let aligned = aligned(prepared, job, log, channels)?;
    let (mut data, lowered) = cells(log, &aligned, &prepared.known(job), channels);
    let shown = |(factor, nats): &(f64, f64)| *factor < LEAST_SLOWER && *nats > SHOWN_NATS;
    data.timed_acceleration = aligned.acceleration.filter(shown);
    data.clock_s = aligned.uncertainty_s;
    Ok((data, aligned, lowered))
}

/// What the data of a log are made from.
struct Taken<'a> {
    prepared: &'a Prepared,
    others: &'a [OtherGeometry],
    job: &'a Job,
    log: &'a Log,
    channels: &'a Channels,
    aligned: &'a Aligned,
}

impl Taken<'_> {
    /// The data of a log in which a runout was found, with the forces taken about it; `None` where there is none.
    fn about_the_runout(&self, report: &LearnReport) -> Option<Data> {
        let wanted = self.prepared.forces.filter(|_| self.channels.force_xy.is_some())?;
        let effects: Vec<Use> = report.effects.iter().filter_map(used).collect();
        let base = |name: &str| report.final_base.iter().find(|v| v.name == name).map(|v| v.value);
        let coefficients = LinearEdge {
            k_tc: base("k_tc")?,
            k_rc: base("k_rc")?,
            k_te: base("k_te")?,
            k_re: base("k_re")?,
            ..LinearEdge::default()
        };
        settled(&effects, coefficients, &|grid, k| self.about(grid, k, wanted))
    }

    /// The data with the forces taken about the runouts of a grid, at these coefficients.
    fn about(&self, grid: RunoutGrid, coefficients: LinearEdge, wanted: Sample) -> Data {
        let (prepared, about) = (self.prepared, About { grid, coefficients: Some(coefficients) });
        let timeline = prepared.timeline.with_runouts(&prepared.path, &prepared.map, self.job, wanted, about);
        let known = Known { others: self.others.to_vec(), ..prepared.known_at(self.job, &timeline, grid) };
        cells(self.log, self.aligned, &known, self.channels).0
    }
}

/// A log tied to its program: by position, by line, or by its load.
pub fn aligned(prepared: &Prepared, job: &Job, log: &Log, channels: &Channels) -> Result<Aligned, LearnError> {
    let by_position = by_position(log, &prepared.timeline).map(|aligned| {
        let acceleration = paced(log, &aligned.program_s, &prepared.timeline, &prepared.slower);
        Aligned { acceleration, ..aligned }
    });
    by_position
        .or_else(|| by_line(log, &prepared.timeline, &prepared.slower))
        .map_or_else(|| found_by_load(prepared, job, log, channels), Ok)
}

/// The log found in the program by its load.
fn found_by_load(prepared: &Prepared, job: &Job, log: &Log, channels: &Channels) -> Result<Aligned, LearnError> {
    let index = channels.spindle.map(|(k, ..)| k).or(channels.force_xy);
    let unfit = |why: &str| LearnError::from(DataError::Unfit(why.into()));
    let index = index.ok_or_else(|| unfit("the log measures nothing that a load can be compared with"))?;
    by_load(log, index, &prepared.known(job)).ok_or_else(|| unfit("the log is too short to be found in the program"))
}

fn described(aligned: &Aligned, log: &Log) -> Alignment {
    let pairs: Vec<(f64, f64)> =
        log.time_s.iter().zip(&aligned.program_s).filter(|(_, p)| p.is_finite()).map(|(t, p)| (*t, *p)).collect();
    let (first, last) = (pairs.first().copied().unwrap_or_default(), pairs.last().copied().unwrap_or_default());
    Alignment {
        offset_s: first.0 - first.1,
        stretch: (last.0 - first.0) / (last.1 - first.1).max(1e-9),
        method: aligned.method.name().to_owned(),
        uncertainty_s: aligned.uncertainty_s,
        stretches: stretches(aligned, log),
        outside: outside(aligned),
        pauses: aligned.pauses.clone(),
    }
}

/// Uncertainty of the samples within the program, by [`STRETCHES`] of the log.
fn stretches(aligned: &Aligned, log: &Log) -> Vec<([f64; 2], f64)> {
    let placed: Vec<usize> = (0..log.time_s.len()).filter(|i| aligned.program_s[*i].is_finite()).collect();
    let stretch = |members: &[usize]| {
        let squares: f64 = members.iter().map(|i| aligned.each_s[*i].powi(2)).sum();
        let ends = [members[0], members[members.len() - 1]].map(|i| log.time_s[i]);
        (ends, (squares / members.len() as f64).sqrt())
    };
    placed.chunks(placed.len().div_ceil(STRETCHES).max(1)).map(stretch).collect()
}

/// How many samples are before the first that is placed, between placed ones, and after the last.
fn outside(aligned: &Aligned) -> [usize; 3] {
    let placed: Vec<bool> = aligned.program_s.iter().map(|t| t.is_finite()).collect();
    let all = placed.len();
    let first = placed.iter().position(|p| *p).unwrap_or(all);
    let last = placed.iter().rposition(|p| *p).map_or(all, |k| k + 1);
    [first, placed[first..last].iter().filter(|p| !**p).count(), all - last]
}
