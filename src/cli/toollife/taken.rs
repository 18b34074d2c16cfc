//! Evaluation of readings. In: the state of a tool, the run over the program in which they were taken, the readings. Out: the state with the
//! readings added, the trend of wear, and remarks.

use super::super::error::CliError;
use super::readings::{Reading, Told};
use crate::effects::wear;
use crate::job::tool_life::{CheckCut, LoadKind, ToolRun};
use crate::machine::{Job, Wear, WearLaw, WearRate};
use crate::outcome::ProgramRun;
use crate::report;
use crate::report::life::ReadRow;
use crate::setup::{PlannedProgram, ReadingState, ToolState};
use crate::toollife::exponent::{self, Estimate, Lengths};
use crate::toollife::index::{Seen, seen};
use crate::toollife::trend::{self, Known, Trend, trend};

/// Standard deviation of a reading before any is there, as a share of the load; judgement: what dynamometers and spindle
/// drives repeat to.
const REPEATS: f64 = 0.02;
/// A rate that falls by this many of its deviations is no wear.
const FALLS: f64 = 2.0;

/// Law with the rate as known now: a straight line.
pub fn law_of(state: &ToolState, job: &Job, tool: u32) -> WearLaw {
    let declared = declared(job, tool).map(|wear| wear.law);
    let along = WearRate::along_path(1e-3 * state.rate_per_m, state.feed_per_tooth_mm, state.exponent);
    WearLaw {
        rate: WearRate { counted: state.counted, ..along },
        end: state.end,
        rate_scatter: state.rate_deviation_per_m / state.rate_known_per_m,
        end_scatter: declared.map_or(0.0, |law| law.end_scatter),
    }
}

/// What setup and process model say of its wear.
fn declared(job: &Job, tool: u32) -> Option<Wear> {
    job.tool(tool).and_then(|tool| wear::of_tool(job, tool))
}

/// The state in which a tool begins a program: as the setup declares it, or as it left its last program.
pub fn begun(run: &ProgramRun, number: u32, old: Option<ToolState>, assurance: f64) -> ToolState {
    let tool = run.job.tool(number).expect("a tool of the program");
    let Wear { law, fresh, index } = declared(&run.job, number).expect("a tool with a law of wear");
    let unit = run.job.fresh_index(tool).map_or("of the fresh edge", |(_, unit)| unit);
    let model = run.job.process.base.as_ref().or_else(|| run.job.material(tool).map(|material| &material.model));
    // The line from a fresh edge to its end.
    let rate_per_m = 1e3 * (law.end - fresh) / law.life_mm(fresh);
    let fresh_state = ToolState {
        tool: number,
        diameter_mm: tool.diameter_mm,
        flutes: tool.flutes,
        model: model.map_or_else(String::new, |model| model.name().to_owned()),
        index_unit: unit.to_owned(),
        fresh,
        end: law.end,
        index,
        rate_per_m,
        rate_known_per_m: rate_per_m,
        rate_deviation_per_m: law.rate_scatter * rate_per_m,
        feed_per_tooth_mm: law.rate.feed_per_tooth_mm,
        counted: law.rate.counted,
        exponent: law.rate.exponent,
        cut_m: 0.0,
        lengths_m: Lengths::at_reference((index - fresh) / rate_per_m).0,
        target_m: 0.0,
        assurance,
        program: PlannedProgram {
            file: String::new(),
            sha256: String::new(),
            cut_m: 0.0,
            lengths_m: [0.0; 4],
            read: 0,
        },
        readings: Vec::new(),
    };
    let Some(old) = old else { return fresh_state };
    // The last program was cut to its end.
    let lengths_m = Lengths(old.lengths_m).and(&Lengths(old.program.lengths_m)).0;
    let index = old.index_behind();
    ToolState { index, lengths_m, cut_m: old.cut_m + old.program.cut_m, assurance, program: fresh_state.program, ..old }
}

/// What readings say.
pub struct Readings {
    /// Trend of the index.
    pub trend: Trend,
    /// Each reading.
    pub rows: Vec<ReadRow>,
    /// What they say of the exponent of the feed.
    pub exponent: Option<Estimate>,
}

/// What is known of rate and noise before the readings.
fn known(state: &ToolState, noise: f64) -> Known {
    Known { rate: state.rate_known_per_m, rate_deviation: state.rate_deviation_per_m, noise }
}

/// Standard deviation of the index from one reading of this kind: a share of the load at the edge as it is.
pub fn noise(seen_from: &ToolRun, cut: Option<&CheckCut>, kind: LoadKind, state: &ToolState) -> f64 {
    let per_worn = |cut| {
        let [a, b] = [0.0, 1.0].map(|worn| seen_from.load(cut, kind, Some(worn)));
        REPEATS * a / (b - a) * state.fresh
    };
    cut.map(per_worn).filter(|noise| noise.is_finite()).unwrap_or(REPEATS * state.fresh)
}

/// The trend of what was read so far, or what is known without. An edge is never sharper than a fresh one: where the trend says so, the readings
/// are no peaks, or the coefficients are too high, and the line is raised to a fresh edge where the program begins, so that no life is won by it.
pub fn trend_of(state: &ToolState, noise: f64) -> Trend {
    let known = known(state, noise);
    let now_m = state.wear_m();
    let found = trend(&readings(state), &known).unwrap_or_else(|| Trend::before(now_m, state.index, &known));
    Trend { index: found.index + (state.fresh - found.at(now_m)).max(0.0), ..found }
}

fn readings(state: &ToolState) -> Vec<trend::Reading> {
    let at_m = |reading: &ReadingState| Lengths(reading.lengths_m).at(state.exponent);
    state.readings.iter().map(|reading| trend::Reading { at_m: at_m(reading), index: reading.index }).collect()
}

/// What all readings say of the exponent.
fn exponent_seen(state: &ToolState, noise: f64, declared: f64) -> Option<Estimate> {
    let readings: Vec<(Lengths, f64)> =
        state.readings.iter().map(|reading| (Lengths(reading.lengths_m), reading.index)).collect();
    exponent::estimate(&readings, &known(state, noise), declared)
}

/// Takes readings into the state: the index of each, the trend, and with it the rate and the index at the program's beginning.
pub fn take_in(
    run: &ProgramRun,
    tool: u32,
    mut state: ToolState,
    told: &Told,
) -> Result<(ToolState, Readings, Vec<String>), CliError> {
    let seen_from = ToolRun::new(run, tool);
    let mut rows = Vec::new();
    for reading in &told.readings {
        let (row, kept) = of_reading(&seen_from, reading, &state)?;
        state.program.read = row.check;
        state.readings.push(kept);
        rows.push(row);
    }
    let first = told.readings.first();
    let kind = first.map_or(LoadKind::ForcePeak, |reading| reading.kind);
    let noise = noise(&seen_from, first.and_then(|reading| reading.cuts.first()), kind, &state);
    let declared = declared(&run.job, tool).map_or(state.exponent, |wear| wear.law.rate.exponent);
    let exponent = exponent_seen(&state, noise, declared);
    state.exponent = exponent::trusted(exponent.as_ref(), declared, state.assurance);
    let found = trend_of(&state, noise);
    let falls = falls(&state, noise);
    let rate = if falls { state.rate_known_per_m } else { found.rate };
    let trend = Trend { rate, ..found };
    state.rate_per_m = rate;
    state.index = trend.at(state.wear_m());
    let mut notes = notes(&state, &trend, falls);
    notes.extend(rows.last().and_then(|row| below_fresh(&seen_from, row, told, noise, &state)));
    notes.extend(exponent.map(|seen| of_exponent(&seen, declared, state.exponent)));
    Ok((state, Readings { trend, rows, exponent }, notes))
}

/// The index at one check point.
fn of_reading(seen_from: &ToolRun, reading: &Reading, state: &ToolState) -> Result<(ReadRow, ReadingState), CliError> {
    let Reading { check, cuts, load, kind } = reading;
    let count = cuts.len() as f64;
    let predicted = |worn: Option<f64>| cuts.iter().map(|cut| seen_from.load(cut, *kind, worn)).sum::<f64>() / count;
    let worn_out = state.end / state.fresh - 1.0;
    let worn = match seen(*load, worn_out, &|worn| predicted(Some(worn))) {
        Seen::Worn(worn) => worn,
        Seen::Blind => {
            let [fresh, end] = [0.0, worn_out].map(|worn| predicted(Some(worn)));
            let unit = kind.unit();
            return Err(CliError::new(
                format!(
                    "check point {check}: this load does not tell the wear: a fresh edge gives {fresh:.1} {unit} there, a worn-out one \
                     {end:.1} {unit}"
                ),
                "read the force instead of the power, or read where more is cut; nothing was written",
            ));
        }
        Seen::Implausible(unit) => {
            let [fresh, end] = [0.0, worn_out].map(|worn| predicted(Some(worn)));
            let (unit_of, hint) =
                (kind.unit(), unit.map_or_else(String::new, |unit| format!("; it looks like {unit}")));
            return Err(CliError::new(
                format!(
                    "check point {check}: {load} {unit_of} is no load of this cut: a fresh edge loads {fresh:.1} {unit_of}, \
                     a worn-out one {end:.1} {unit_of}{hint}"
                ),
                "correct the unit of the column, or the reading; nothing was written",
            ));
        }
    };
    let index = state.fresh * (1.0 + worn);
    let cut_m = cuts.iter().map(|cut| cut.cut_m).sum::<f64>() / count;
    let lengths = cuts.iter().map(|cut| seen_from.lengths(Some(cut)).0);
    let mean = lengths.fold([0.0; 4], |sum, each| [0, 1, 2, 3].map(|k| sum[k] + each[k] / count));
    let total_m = state.cut_m + cut_m;
    let program = state.program.sha256.chars().take(8).collect();
    let lengths_m = Lengths(state.lengths_m).and(&Lengths(mean)).0;
    let row = ReadRow { check: *check, total_m, load: *load, unit: kind.unit(), predicted: predicted(None), index };
    Ok((row, ReadingState { program, check: *check, cut_m: total_m, lengths_m, load: *load, index }))
}

/// Do the readings fall, for themselves, with certainty?
fn falls(state: &ToolState, noise: f64) -> bool {
    let known = known(state, noise);
    let free = Known { rate_deviation: 1e3 * known.rate_deviation, ..known };
    let alone = trend(&readings(state), &free).filter(|_| state.readings.len() > 2);
    alone.is_some_and(|alone| alone.rate < -FALLS * alone.rate_variance.sqrt())
}

/// The last reading, where it lies below what a fresh edge loads by more than readings scatter.
fn below_fresh(seen_from: &ToolRun, row: &ReadRow, told: &Told, noise: f64, state: &ToolState) -> Option<String> {
    let reading = told.readings.last()?;
    let fresh = reading.cuts.iter().map(|cut| seen_from.load(cut, reading.kind, Some(0.0))).sum::<f64>()
        / reading.cuts.len() as f64;
    (row.index < state.fresh - 3.0 * noise).then(|| {
        format!(
            "check point {} reads {}, less than the {} of a fresh edge: are the coefficients too high, or is it no peak (--sample)? The edge counts as fresh where the program begins",
            row.check,
            report::short(row.load),
            report::short(fresh)
        )
    })
}

/// What the readings say of the exponent, in a sentence.
fn of_exponent(seen: &Estimate, declared: f64, used: f64) -> String {
    let [power, deviation, declared] = [seen.power, seen.deviation, declared].map(report::short);
    let said = format!("the readings give the law of wear the exponent {power} ± {deviation}");
    if seen.refutes {
        let spares = if used > 0.0 { "spares this tool" } else { "is not sure to spare this tool" };
        let used = report::short(used);
        format!("{said}, not {declared} as declared: {used} is used, a slower feed {spares}; correct wear in the setup")
    } else if seen.is_told {
        format!("{said}; {declared} as declared is used")
    } else {
        format!(
            "the readings cannot tell the exponent of the law of wear, {declared} as declared is used: their feeds are too much alike; \
             two feeds a factor of two apart would tell it"
        )
    }
}

fn notes(state: &ToolState, trend: &Trend, falls: bool) -> Vec<String> {
    let mut notes = Vec::new();
    if state.readings.len() == 1 {
        notes.push("one check point tells the wear, and no rate: that of the setup is used".to_owned());
    }
    if falls {
        let asks = "was the tool or the insert changed (--new-tool), or has the sensor drifted?";
        notes.push(format!("the readings fall, which no wear does: {asks} The rate of the setup is used"));
    }
    if trend.run_in > 0 {
        notes.push(format!("the first {} readings belong to the run-in of the edge and are left out", trend.run_in));
    }
    if trend.outliers > 0 {
        notes.push(format!("{} readings lie off the trend and hardly count", trend.outliers));
    }
    notes
}
