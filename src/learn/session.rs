//! The whole of `learn`. In: a program, a job, a measured log. Out: [`LearnReport`], from which the process model
//! follows.

use crate::engage::{EngageError, Loader};
use crate::learn::align::frame::in_work_frame;
use crate::learn::align::line::{acceleration_shown, by_line, count_from_first};
use crate::learn::align::load::by_load;
use crate::learn::align::one_run::one_run;
use crate::learn::align::stretch;
use crate::learn::align::{Aligned, Method, by_position};
use crate::learn::dataset::binning::{Channels, bin_log, channels};
use crate::learn::dataset::measured_feed::measured_feed;
use crate::learn::dataset::measured_speed::other_speeds;
use crate::learn::dataset::samples::Data;
use crate::learn::diagnose::ceiling::without_ceilings;
use crate::learn::diagnose::criteria::{covers_in_part, is_of_another_program, is_slower, is_stretch_of_a_machine};
use crate::learn::diagnose::doubts::{self, covered, unseen_ends};
use crate::learn::diagnose::{Options, diagnose, over_time};
use crate::learn::log::columns::DataError;
use crate::learn::log::gaps::median_step;
use crate::learn::log::resultant::MEAN_FORCE;
use crate::learn::log::resultant::{Sample, resultant};
use crate::learn::log::signal::reject_dead_signals;
use crate::learn::log::{Log, read_any_log};
use crate::learn::machine_times::times_alone;
use crate::learn::model::cross_validation::by_blocks;
use crate::learn::model::design::FittedEffect;
use crate::learn::model::design::changes;
use crate::learn::model::design::in_model;
use crate::learn::model::fit::fit;
use crate::learn::program::other_geometry::SizeChanges;
use crate::learn::program::peak_forces::About;
use crate::learn::program::runout_grid::RunoutGrid;
use crate::learn::program::simulated::ProgramView;
use crate::learn::program::simulated::SimulatedProgram;
use crate::learn::program::simulated::simulate_for;
use crate::learn::program::timeline::Timeline;
use crate::learn::program::variant::OtherGeometry;
use crate::learn::reading_time::at_readings;
use crate::learn::report::{Alignment, FeedEvent, LearnReport};
use crate::learn::runout::data_about_best_runout;
use crate::machine::Job;
use crate::machine::material::LinearEdge;
use std::ops::Range;

/// How a log is learned from.
#[derive(Debug, Clone, Default)]
pub struct LogOptions {
    /// Columns renamed: (theirs, ours).
    pub mapping: Vec<(String, String)>,
    /// What a sample of a force is: instantaneous, mean or peak.
    pub sample: Sample,
    /// Time over which that sample is taken, s.
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

/// Number of stretches of a log for which the uncertainty of the alignment is reported.
const STRETCHES: usize = 20;
/// Most rounds in which the cut is simulated again with the stock and tool sizes that were found.
const SIZE_ROUNDS: usize = 2;

/// The report with its data.
#[derive(Debug, Clone)]
pub struct Learned {
    /// The report.
    pub report: LearnReport,
    /// The aligned data it rests on.
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
    let mut log = read_any_log(log, &options.mapping)?;
    resultant(&mut log, options.sample, options.window_s);
    let channels = channels(&log);
    let prepared = simulate_for(program, job, channels.force_xy.map(|_| options.sample), loader)?;
    let (log, aligned) = of_one_run(log, &prepared, job, &channels)?;
    if log.measured.is_empty() {
        let report = times_alone(&prepared, &log, &aligned)?;
        return Ok(Learned {
            report: LearnReport { alignment: Some(alignment_of(&aligned, &log)), ..report },
            data: Data::default(),
        });
    }
    let mut learned = learn_with_data(&prepared, job, &log, &channels, aligned, options, loader)?;
    if options.sample == Sample::Mean {
        learned.data.channel_names.iter_mut().for_each(|name| *name = name.replace("force_xy_n", MEAN_FORCE));
    }
    Ok(learned)
}

/// Learns from a log that was read, with its program already simulated.
#[cfg(feature = "rooms")]
pub fn learn(
    prepared: &SimulatedProgram,
    job: &Job,
    log: &Log,
    channels: &Channels,
    options: &LogOptions,
) -> Result<LearnReport, LearnError> {
    let aligned = aligned(prepared, job, log, channels)?;
    learn_with_data(prepared, job, log, channels, aligned, options, None).map(|learned| learned.report)
}

/// The same, with the data it was learned from; `loader` reads the files of stock.
pub fn learn_with_data(
    prepared: &SimulatedProgram,
    job: &Job,
    log: &Log,
    channels: &Channels,
    aligned: Aligned,
    options: &LogOptions,
    loader: Option<Loader>,
) -> Result<Learned, LearnError> {
    let (mut data, aligned, mut lowered) = dataset_of(prepared, job, log, channels, aligned);
    // Stretches are held against each other in the declared geometry, whatever geometry is found.
    let windows = fit(&data, &[], 0).map(|base| over_time::windows(&data, &base));
    let answer = |data: &Data| {
        diagnose(data, &by_blocks(data, "stretch of time"), &options.diagnosis)
            .ok_or_else(|| DataError::Unfit("too few samples of the log belong to the program".into()))
    };
    let mut report = answer(&data)?;
    let (mut sizes, mut others) = (SizeChanges::usual(job), prepared.others.clone());
    for _ in 0..SIZE_ROUNDS {
        let Some(found) = SizeChanges::found(job, &changes(&report.effects)).filter(|found| !found.is_near(&sizes))
        else {
            break;
        };
        let Some(again) = prepared.with_sizes(job, found, loader) else { break };
        (sizes, others) = (found, again);
        let known = ProgramView { others: &others, ..prepared.known(job) };
        let (nearer, doubtful) = bin_log(log, &aligned, &known, channels);
        data = Data { timed_acceleration: data.timed_acceleration, clock_s: data.clock_s, ..nearer };
        lowered = doubtful;
        report = answer(&data)?;
    }
    let taken = LogData { prepared, others: &others, job, log, channels, aligned: &aligned };
    if let Some(nearer) = taken.about_the_runout(&report) {
        data = Data { timed_acceleration: data.timed_acceleration, clock_s: data.clock_s, ..nearer };
        report = answer(&data)?;
    }
    report.read_at_meter(&job.machine.spindle, &data.channel_names);
    report.samples = log.time_s.len();
    report.down_weighted = lowered;
    report.alignment = Some(alignment_of(&aligned, log));
    report.events = measured_feed(log, &aligned, &prepared.timeline)
        .map_or_else(Vec::new, |feed| feed.events(log, &aligned, &prepared.timeline));
    report.events.extend(holds_as_events(&aligned, &prepared.timeline, log));
    report.events.extend(elsewhere_as_events(&aligned, &prepared.timeline, log));
    report.events.sort_by(|a, b| a.time_s[0].total_cmp(&b.time_s[0]));
    report.warnings.extend(log.warnings.iter().cloned());
    report.warnings.extend(other_speeds(log, &aligned, &prepared.timeline));
    let covered = covered(&aligned, &prepared.timeline);
    if covers_in_part(covered) {
        report.warnings.push(format!("the log covers {:.0} % of the program", 100.0 * covered));
    }
    report.warnings.extend(slow_readings(log));
    report.warnings.extend(unseen_ends(&aligned, &prepared.timeline));
    // What stops at a ceiling says nothing of the coefficients.
    let (below, _) = without_ceilings(&data, &options.diagnosis.criteria);
    let doubts = doubts::of_log(&report, &aligned, &prepared.timeline, log, &below);
    if !doubts.is_empty() {
        report.supports_model = false;
        let why = doubts.join("; ");
        let end = if why.ends_with(['.', '?']) { "" } else { "." };
        report.verdict = format!("The data do not support a model: {why}{end} {}", report.verdict);
        report.warnings.extend(doubts);
    }
    if let Some(windows) = windows {
        report.windows = windows;
        report.wear = over_time::in_words(&report.windows).filter(|_| over_time::may_be_the_edge(&report));
    }
    Ok(Learned { report, data })
}

/// The holds of an alignment by lines or by the load as events; by positions they are feeds of zero.
fn holds_as_events(aligned: &Aligned, timeline: &Timeline, log: &Log) -> Vec<FeedEvent> {
    let event = |(from_s, to_s): &(f64, f64)| {
        let after = log.time_s.partition_point(|time| time < to_s);
        let at_s = aligned.program_s.get(after..)?.iter().find(|at_s| at_s.is_finite())?;
        let line = timeline.spots[timeline.at(*at_s)?].line;
        Some(FeedEvent { time_s: [*from_s, *to_s], lines: [line; 2], ratio: 0.0, elsewhere: false })
    };
    aligned.holds.iter().filter_map(event).collect()
}

/// The stretches of an alignment that are elsewhere than in the program, between samples that are in it.
fn elsewhere_as_events(aligned: &Aligned, timeline: &Timeline, log: &Log) -> Vec<FeedEvent> {
    let line = |i: usize| timeline.at(aligned.program_s[i]).map(|k| timeline.spots[k].line);
    let event = |stretch: &Range<usize>| {
        let (before, after) = (stretch.start.checked_sub(1)?, stretch.end);
        Some(FeedEvent {
            time_s: [log.time_s[stretch.start], log.time_s[after]],
            lines: [line(before)?, line(after)?],
            ratio: 0.0,
            elsewhere: true,
        })
    };
    aligned.elsewhere(log).iter().filter_map(event).collect()
}

/// The data of an aligned log, its alignment at the times of the readings, and the number of samples of reduced weight.
pub fn dataset_of(
    prepared: &SimulatedProgram,
    job: &Job,
    log: &Log,
    channels: &Channels,
    aligned: Aligned,
) -> (Data, Aligned, usize) {
    let known = prepared.known(job);
    let bin = |aligned: &Aligned| bin_log(log, aligned, &known, channels);
    let (aligned, (mut data, lowered)) = at_readings(log, aligned, &bin);
    data.timed_acceleration = aligned.acceleration.filter(|(factor, nats)| is_slower(*factor, *nats));
    data.clock_s = aligned.uncertainty_s;
    (data, aligned, lowered)
}

/// What the data of a log are made from.
struct LogData<'a> {
    prepared: &'a SimulatedProgram,
    others: &'a [OtherGeometry],
    job: &'a Job,
    log: &'a Log,
    channels: &'a Channels,
    aligned: &'a Aligned,
}

impl LogData<'_> {
    /// The data of a log in which a runout was found, with the forces linearised about it; `None` if there is none.
    fn about_the_runout(&self, report: &LearnReport) -> Option<Data> {
        let wanted = self.prepared.forces.filter(|_| self.channels.force_xy.is_some())?;
        let effects: Vec<FittedEffect> = report.effects.iter().filter_map(in_model).collect();
        let base = |name: &str| report.final_base.iter().find(|v| v.name == name).map(|v| v.value);
        let coefficients = LinearEdge {
            k_tc: base("k_tc")?,
            k_rc: base("k_rc")?,
            k_te: base("k_te")?,
            k_re: base("k_re")?,
            ..LinearEdge::default()
        };
        data_about_best_runout(&effects, coefficients, &|grid, k| self.about(grid, k, wanted))
    }

    /// The data with the forces linearised about the runouts of a grid, at these coefficients.
    fn about(&self, grid: RunoutGrid, coefficients: LinearEdge, wanted: Sample) -> Data {
        let (prepared, about) = (self.prepared, About { grid, coefficients: Some(coefficients) });
        let timeline = prepared.timeline.with_runouts(&prepared.path, &prepared.map, self.job, wanted, about);
        let known = ProgramView { others: self.others, ..prepared.known_at(self.job, &timeline, grid) };
        bin_log(self.log, self.aligned, &known, self.channels).0
    }
}

/// Least length of a stretch of a log that belongs to nothing, over that of the program, at whose ends other runs of the program are looked
/// for; by the load, in which a run is found only if it is long, and slowly. Judgement.
const OUTSIDE: f64 = 0.05;
const OUTSIDE_BY_LOAD: f64 = 0.3;

/// A log with positions in the work frame, of one run of the program if it holds several, and its alignment.
pub fn of_one_run(
    mut log: Log,
    prepared: &SimulatedProgram,
    job: &Job,
    channels: &Channels,
) -> Result<(Log, Aligned), LearnError> {
    reject_dead_signals(&log)?;
    in_work_frame(&mut log, &prepared.timeline);
    if log.position_mm.is_none() {
        count_from_first(&mut log, &prepared.timeline);
    }
    let align = |log: &Log| match aligned(prepared, job, log, channels) {
        // A load is found anywhere, more or less; places and lines are not.
        Ok(found) if found.method != Method::Load || of_another_program(&found).is_none() => {
            let share = covered(&found, &prepared.timeline);
            Some((found, share))
        }
        _ => None,
    };
    let whole = aligned(prepared, job, &log, channels)?;
    let shortest_s = prepared.timeline.total_s() * if whole.method == Method::Load { OUTSIDE_BY_LOAD } else { OUTSIDE };
    match one_run(&log, &whole, shortest_s, &align) {
        Some(log) => aligned(prepared, job, &log, channels).map(|found| (log, found)),
        None => Ok((log, whole)),
    }
}

/// In words, if a log is not that of this program.
pub fn of_another_program(aligned: &Aligned) -> Option<String> {
    let percent = 100.0 * aligned.misfit;
    is_of_another_program(aligned.misfit, aligned.method == Method::Load)
        .then(|| format!("{percent:.0} % of the log do not fit this program: is it the log of another one?"))
}

/// Aligns a log with its program: by position, by line, or by its load.
pub fn aligned(prepared: &SimulatedProgram, job: &Job, log: &Log, channels: &Channels) -> Result<Aligned, LearnError> {
    let by_position = by_position(log, &prepared.timeline).map(|aligned| {
        let acceleration = acceleration_shown(log, &aligned.program_s, &prepared.timeline, &prepared.slower);
        Aligned { acceleration, ..aligned }
    });
    by_position
        .or_else(|| by_line(log, &prepared.timeline, &prepared.slower))
        .map_or_else(|| found_by_load(prepared, job, log, channels), Ok)
}

/// Aligns a log by its load.
fn found_by_load(
    prepared: &SimulatedProgram,
    job: &Job,
    log: &Log,
    channels: &Channels,
) -> Result<Aligned, LearnError> {
    let index = channels.spindle.map(|(k, ..)| k).or(channels.force_xy);
    let unfit = |why: &str| LearnError::from(DataError::Unfit(why.to_owned()));
    let index = index.ok_or_else(|| unfit("the log has neither a load nor places or lines of this program"))?;
    by_load(log, index, &prepared.known(job)).ok_or_else(|| unfit(&not_found(log, &prepared.timeline)))
}

/// Longest step from reading to reading at which a load can be found in its program, s: eight readings in a window of the alignment.
const STEP_TO_BE_FOUND_S: f64 = 0.75;

/// Readings so far apart smear entries and corners where each is a mean: a cut of 10 mm at 1200 mm/min takes half a second.
const SMEARS_S: f64 = 0.5;

/// In words, if readings are far apart.
fn slow_readings(log: &Log) -> Option<String> {
    let step_s = median_step(&log.time_s);
    (step_s >= SMEARS_S && !log.measured.is_empty()).then(|| {
        format!(
            "readings are {step_s:.2} s apart: if each is a mean over that time, it smears entries and corners, what follows the distance since \
             entry is its own, and peaks are missing; read it five times a second or more"
        )
    })
}

/// Why a log cannot be found in its program by its load alone.
fn not_found(log: &Log, timeline: &Timeline) -> String {
    let (lasts_s, program_s) = (log.time_s.last().copied().unwrap_or(0.0), timeline.total_s());
    let step_s = median_step(&log.time_s);
    if !is_stretch_of_a_machine(lasts_s / program_s.max(1e-9)) {
        return format!(
            "the log lasts {lasts_s:.1} s and the program {program_s:.1} s: is the unit of its time right?"
        );
    }
    if step_s > STEP_TO_BE_FOUND_S {
        return format!(
            "readings are {step_s:.2} s apart, too far to find them in the program by the load alone: log positions or lines too, or read \
             it four times a second or more"
        );
    }
    format!(
        "the log is too short ({lasts_s:.1} s, {} readings) to be found in the program by its load alone",
        log.time_s.len()
    )
}

fn alignment_of(aligned: &Aligned, log: &Log) -> Alignment {
    let pairs: Vec<(f64, f64)> =
        log.time_s.iter().zip(&aligned.program_s).filter(|(_, p)| p.is_finite()).map(|(t, p)| (*t, *p)).collect();
    let first = pairs.first().copied().unwrap_or_default();
    Alignment {
        offset_s: first.0 - first.1,
        stretch: stretch(aligned, log),
        method: aligned.method.name().to_owned(),
        uncertainty_s: aligned.uncertainty_s,
        stretches: stretches(aligned, log),
        outside: outside(aligned),
        read_later_s: aligned.read_later_s,
        pauses: aligned.pauses.clone(),
    }
}

/// Root mean square uncertainty of the placed samples in each of [`STRETCHES`] parts of the log.
fn stretches(aligned: &Aligned, log: &Log) -> Vec<([f64; 2], f64)> {
    let placed: Vec<usize> = (0..log.time_s.len()).filter(|i| aligned.program_s[*i].is_finite()).collect();
    let stretch = |members: &[usize]| {
        let squares: f64 = members.iter().map(|i| aligned.sample_uncertainty_s[*i].powi(2)).sum();
        let ends = [members[0], members[members.len() - 1]].map(|i| log.time_s[i]);
        (ends, (squares / members.len() as f64).sqrt())
    };
    placed.chunks(placed.len().div_ceil(STRETCHES).max(1)).map(stretch).collect()
}

/// Number of samples before the first placed one, of unplaced ones between placed ones, and after the last.
fn outside(aligned: &Aligned) -> [usize; 3] {
    let placed: Vec<bool> = aligned.program_s.iter().map(|t| t.is_finite()).collect();
    let all = placed.len();
    let first = placed.iter().position(|p| *p).unwrap_or(all);
    let last = placed.iter().rposition(|p| *p).map_or(all, |k| k + 1);
    [first, placed[first..last].iter().filter(|p| !**p).count(), all - last]
}
