//! What readings say of a tool. In: its state, the run over the program that they belong to, the readings. Out: the state with them
//! taken in, the trend, and what is to be known.

use super::super::error::CliError;
use super::readings::{Reading, Told};
use crate::job::tool_life::{CheckCut, LoadKind, ToolRun};
use crate::machine::{Job, WearLaw};
use crate::report::Run;
use crate::report::life::ReadRow;
use crate::setup::{PlannedProgram, ReadingState, ToolState};
use crate::toollife::index::{Seen, seen};
use crate::toollife::trend::{self, Known, Trend, trend};

/// Standard deviation of a reading before any is there, as a share of the load; judgement: what dynamometers and spindle
/// drives repeat to.
const REPEATS: f64 = 0.02;
/// A rate that falls by this many of its deviations is no wear.
const FALLS: f64 = 2.0;

/// Law with the rate as known now.
pub fn law_of(state: &ToolState, job: &Job, tool: u32) -> WearLaw {
    let declared = job.tool(tool).and_then(|tool| tool.wear).map(|wear| wear.law);
    WearLaw {
        rate_per_mm: 1e-3 * state.rate_per_m,
        feed_per_tooth_mm: state.feed_per_tooth_mm,
        exponent: state.exponent,
        end: state.end,
        rate_scatter: state.rate_deviation_per_m / state.rate_known_per_m,
        end_scatter: declared.map_or(0.0, |law| law.end_scatter),
    }
}

/// The state in which a tool begins a program: as the setup declares it, or as it left its last program.
pub fn begun(run: &Run, number: u32, old: Option<ToolState>, assurance: f64) -> ToolState {
    let tool = run.job.tool(number).expect("a tool of the program");
    let wear = tool.wear.expect("a tool with a law of wear");
    let (fresh, unit) = run.job.fresh_index(tool).expect("the setup was checked for it");
    let model = run.job.process.base.as_ref().or_else(|| run.job.material(tool).map(|material| &material.model));
    let rate_per_m = 1e3 * wear.law.rate_per_mm;
    let index = wear.index.unwrap_or(fresh);
    let fresh_state = ToolState {
        tool: number,
        diameter_mm: tool.diameter_mm,
        flutes: tool.flutes,
        model: model.map_or_else(String::new, |model| model.name().to_owned()),
        index_unit: unit.to_owned(),
        fresh,
        end: wear.law.end,
        index,
        rate_per_m,
        rate_known_per_m: rate_per_m,
        rate_deviation_per_m: wear.law.rate_scatter * rate_per_m,
        feed_per_tooth_mm: wear.law.feed_per_tooth_mm,
        exponent: wear.law.exponent,
        cut_m: 0.0,
        wear_m: (index - fresh) / rate_per_m,
        target_m: 0.0,
        assurance,
        program: PlannedProgram { file: String::new(), sha256: String::new(), cut_m: 0.0, wear_m: 0.0, read: 0 },
        readings: Vec::new(),
    };
    let Some(old) = old else { return fresh_state };
    // The last program was cut to its end.
    let wear_m = old.wear_m + old.program.wear_m;
    let index = old.index + old.rate_per_m * old.program.wear_m;
    ToolState { index, wear_m, cut_m: old.cut_m + old.program.cut_m, assurance, program: fresh_state.program, ..old }
}

/// What readings say.
pub struct Readings {
    /// Trend of the index.
    pub trend: Trend,
    /// Each reading.
    pub rows: Vec<ReadRow>,
}

/// What is known of rate and noise before the readings.
fn known(state: &ToolState, noise: f64) -> Known {
    Known { rate: state.rate_known_per_m, rate_deviation: state.rate_deviation_per_m, noise }
}

/// Standard deviation of the index from one reading: a share of the load at the edge as it is.
pub fn noise(seen_from: &ToolRun, cut: Option<&CheckCut>, state: &ToolState) -> f64 {
    let per_worn = |cut| {
        let [a, b] = [0.0, 1.0].map(|worn| seen_from.load(cut, LoadKind::ForcePeak, Some(worn)));
        REPEATS * a / (b - a) * state.fresh
    };
    cut.map(per_worn).filter(|noise| noise.is_finite()).unwrap_or(REPEATS * state.fresh)
}

/// The trend of what was read so far, or what is known without.
pub fn trend_of(state: &ToolState, noise: f64) -> Trend {
    let known = known(state, noise);
    trend(&readings(state), &known).unwrap_or_else(|| Trend::before(state.wear_m, state.index, &known))
}

fn readings(state: &ToolState) -> Vec<trend::Reading> {
    state.readings.iter().map(|reading| trend::Reading { at_m: reading.wear_m, index: reading.index }).collect()
}

/// Takes readings into the state: the index of each, the trend, and with it the rate and the index at the program's beginning.
pub fn take_in(
    run: &Run,
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
    let first = told.readings.first().and_then(|reading| reading.cuts.first());
    let noise = noise(&seen_from, first, &state);
    let found = trend_of(&state, noise);
    let falls = falls(&state, noise);
    let rate = if falls { state.rate_known_per_m } else { found.rate };
    let trend = Trend { rate, ..found };
    state.rate_per_m = rate;
    state.index = trend.at(state.wear_m);
    let notes = notes(&state, &trend, falls);
    Ok((state, Readings { trend, rows }, notes))
}

/// The index at one check point.
fn of_reading(seen_from: &ToolRun, reading: &Reading, state: &ToolState) -> Result<(ReadRow, ReadingState), CliError> {
    let Reading { check, cuts, load, kind } = reading;
    let count = cuts.len() as f64;
    let predicted = |worn: Option<f64>| cuts.iter().map(|cut| seen_from.load(cut, *kind, worn)).sum::<f64>() / count;
    let worn_out = state.end / state.fresh - 1.0;
    let worn = match seen(*load, worn_out, &|worn| predicted(Some(worn))) {
        Seen::Worn(worn) => worn,
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
    let [cut_m, wear_m] = [0, 1].map(|k| cuts.iter().map(|cut| [cut.cut_m, cut.wear_m][k]).sum::<f64>() / count);
    let total_m = state.cut_m + cut_m;
    let program = state.program.sha256.chars().take(8).collect();
    let wear_m = state.wear_m + wear_m;
    let row = ReadRow { check: *check, total_m, load: *load, predicted: predicted(None), index };
    Ok((row, ReadingState { program, check: *check, cut_m: total_m, wear_m, load: *load, index }))
}

/// Do the readings fall, for themselves, with certainty?
fn falls(state: &ToolState, noise: f64) -> bool {
    let known = known(state, noise);
    let free = Known { rate_deviation: 1e3 * known.rate_deviation, ..known };
    let alone = trend(&readings(state), &free).filter(|_| state.readings.len() > 2);
    alone.is_some_and(|alone| alone.rate < -FALLS * alone.rate_variance.sqrt())
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
