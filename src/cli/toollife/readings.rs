//! Readings at check points. In: a table with the check points, or a whole log; the run over the program that they belong to.
//! Out: one load for each check point, in order.

use super::super::error::CliError;
use super::super::input;
use super::super::learn::{mapping, refused, sample};
use super::arguments::LifeUpdate;
use crate::job::tool_life::{CheckCut, LoadKind, ToolRun};
use crate::learn::align::line::by_line;
use crate::learn::align::{Aligned, by_position};
use crate::learn::log::columns::{Frame, read as read_frame};
use crate::learn::log::resultant::{Sample, resultant};
use crate::learn::log::{Log, read_log};
use crate::learn::program::timeline::{Timeline, timeline};
use crate::outcome::ProgramRun;
use crate::setup::ToolState;

/// Columns that a reading may stand in.
const COLUMNS: [(&str, LoadKind); 3] = [
    ("force_xy_n", LoadKind::ForcePeak),
    ("force_xy_mean_n", LoadKind::ForceMean),
    ("spindle_power_w", LoadKind::Power),
];
/// Fewest samples of a log that make a reading.
const LEAST_SAMPLES: usize = 3;

/// The load read at one check point.
pub struct Reading {
    /// Its number.
    pub check: u32,
    /// The cuts that it was read in.
    pub cuts: Vec<CheckCut>,
    /// Load: N, or W at the motor shaft.
    pub load: f64,
    /// Which.
    pub kind: LoadKind,
}

/// Everything that was read.
pub struct Told {
    /// In order.
    pub readings: Vec<Reading>,
    /// What is to be known.
    pub notes: Vec<String>,
}

/// Reads the file that `--measured` names.
pub fn read(command: &LifeUpdate, run: &ProgramRun, tool: u32, state: &ToolState) -> Result<Told, CliError> {
    let path = &command.measured;
    let bytes = input::file(path)?;
    let mapping = mapping(command.map.columns.as_deref())?;
    let cuts = ToolRun::new(run, tool).checks();
    if cuts.is_empty() {
        return Err(CliError::new("the program has no check points", "run `feedwright toollife plan` on it"));
    }
    let frame = read_frame(&bytes, &mapping).ok().filter(|frame| frame.numbers("check").is_some());
    let told = if let Some(frame) = frame {
        of_table(&frame, &cuts, run, state)?
    } else {
        let mut log = read_log(&bytes, &mapping).map_err(|error| refused(&error.into(), path))?;
        resultant(&mut log, sample(command.samples.sample), command.samples.window);
        of_log(&log, &cuts, run, state, sample(command.samples.sample))?
    };
    if told.readings.is_empty() {
        return Err(CliError::new(
            format!("{} has no reading that is new", path.display()),
            "fill in force_xy_n or spindle_power_w at the check points that were passed",
        ));
    }
    Ok(told)
}

fn fault(text: String, help: &str) -> CliError {
    CliError::new(text, format!("{help}; nothing was written"))
}

/// The first cell of a column that is filled in but holds no number, with its row from 1.
fn no_number<'a>(frame: &'a Frame, name: &'a str) -> Option<(&'a str, usize, &'a str)> {
    let (cells, values) = (frame.text(name)?, frame.numbers(name)?);
    let row = (0..cells.len()).find(|&row| !cells[row].trim().is_empty() && !values[row].is_finite())?;
    Some((name, row + 1, cells[row].trim()))
}

/// Which column holds the readings.
fn column(frame: &Frame) -> Result<(Vec<f64>, LoadKind), CliError> {
    let filled = |(name, kind): (&str, LoadKind)| {
        let values = frame.numbers(name)?;
        values.iter().any(|value| value.is_finite()).then_some((values, kind))
    };
    if let Some((name, row, cell)) = COLUMNS.into_iter().find_map(|(name, _)| no_number(frame, name)) {
        return Err(fault(
            format!("`{cell}` in row {row}, column {name}, is no number"),
            "write the reading with a decimal point, or leave the cell empty",
        ));
    }
    let found: Vec<_> = COLUMNS.into_iter().filter_map(filled).collect();
    match <[_; 1]>::try_from(found) {
        Ok([one]) => Ok(one),
        Err(found) if found.is_empty() => Err(fault(
            "no load was filled in".into(),
            "give force_xy_n (peak resultant), force_xy_mean_n or spindle_power_w at the check points that were passed",
        )),
        Err(_) => {
            Err(fault("loads of two kinds are filled in".into(), "leave one column: forces tell more than power"))
        }
    }
}

fn of_table(frame: &Frame, cuts: &[CheckCut], run: &ProgramRun, state: &ToolState) -> Result<Told, CliError> {
    let (values, kind) = column(frame)?;
    let (checks, cycles) = (frame.numbers("check").unwrap_or_default(), frame.numbers("cycle"));
    let (lines, programs) = (frame.numbers("line"), frame.text("program"));
    let sha = &state.program.sha256[..8.min(state.program.sha256.len())];
    let mut readings: Vec<Reading> = Vec::new();
    let mut last = state.program.read;
    let mut taken: Vec<(u32, Option<u32>)> = Vec::new();
    for row in (0..values.len()).filter(|row| values[*row].is_finite()) {
        let at = format!("row {} of the table", row + 1);
        if let Some(program) =
            programs.map(|programs| programs[row].as_str()).filter(|name| !name.is_empty() && *name != sha)
        {
            return Err(fault(
                format!("{at} belongs to another program: {program}, and this one is {sha}"),
                "give the table that was written beside this program",
            ));
        }
        let number = checks[row];
        if !(number >= 1.0 && number.fract() == 0.0) {
            return Err(fault(format!("{at} has no number of a check point"), "fill in its column `check`"));
        }
        let number = number as u32;
        let cycle = cycles.as_ref().map(|cycles| cycles[row]).filter(|cycle| *cycle >= 1.0).map(|cycle| cycle as u32);
        let here: Vec<CheckCut> = cuts
            .iter()
            .filter(|cut| cut.number == number && cycle.is_none_or(|cycle| cut.cycle == cycle))
            .copied()
            .collect();
        if here.is_empty() {
            return Err(fault(
                format!("{at}: the program has no check point {number} with this cut"),
                "give the table of this program",
            ));
        }
        let line = lines.as_ref().map_or(f64::NAN, |lines| lines[row]);
        if line.is_finite() && !here.iter().any(|cut| f64::from(cut.line) == line) {
            return Err(fault(
                format!(
                    "{at} belongs to another program: check point {number} stands at line {}, not {line}",
                    here[0].line
                ),
                "give the table that was written beside this program",
            ));
        }
        if number <= state.program.read {
            return Err(fault(format!("{at}: check point {number} was taken in before"), "leave it out"));
        }
        if taken.contains(&(number, cycle)) {
            return Err(fault(format!("{at}: check point {number} is there twice"), "keep one reading of each cut"));
        }
        if number < last {
            return Err(fault(
                format!("{at}: check point {number} comes after {last}, so the readings are out of order"),
                "give them in the order in which they were cut",
            ));
        }
        taken.push((number, cycle));
        last = number;
        let load = if kind == LoadKind::Power { shaft(run, values[row]) } else { values[row] };
        match readings.last_mut().filter(|reading| reading.check == number) {
            Some(reading) => {
                let count = reading.cuts.len() as f64;
                reading.load = (reading.load * count + load) / (count + 1.0);
                reading.cuts.extend(here);
            }
            None => readings.push(Reading { check: number, cuts: here, load, kind }),
        }
    }
    Ok(Told { readings, notes: Vec::new() })
}

/// Power at the motor shaft where the meter reads this, W.
fn shaft(run: &ProgramRun, reading_w: f64) -> f64 {
    reading_w * run.job.machine.spindle.efficiency.at(reading_w)
}

fn of_log(log: &Log, cuts: &[CheckCut], run: &ProgramRun, state: &ToolState, sample: Sample) -> Result<Told, CliError> {
    let find = |name: &str| log.measured.iter().find(|(known, _)| *known == name).map(|(_, values)| values);
    let force = if sample == Sample::Mean { LoadKind::ForceMean } else { LoadKind::ForcePeak };
    let (values, kind) = find("force_xy_n")
        .map(|values| (values, force))
        .or_else(|| find("spindle_power_w").map(|values| (values, LoadKind::Power)))
        .ok_or_else(|| {
            fault("the log has no force in the plane and no spindle power".into(), "name its columns with --columns")
        })?;
    let line = timeline(&run.toolpath, &run.map, &run.job, None);
    let Some(aligned) = by_position(log, &line).or_else(|| by_line(log, &line, &[])) else {
        return Err(fault(
            "the log cannot be laid along the program".into(),
            "it needs positions (x_mm, y_mm, z_mm) or line numbers of this very program",
        ));
    };
    let mut readings = Vec::new();
    let mut numbers: Vec<u32> = cuts.iter().map(|cut| cut.number).filter(|n| *n > state.program.read).collect();
    numbers.dedup();
    for number in numbers {
        let mut loads = Vec::new();
        let mut here = Vec::new();
        for cut in cuts.iter().filter(|cut| cut.number == number) {
            let inside = within(&aligned, &line, cut);
            let read: Vec<f64> = inside.into_iter().map(|sample| values[sample]).filter(|v| v.is_finite()).collect();
            if read.len() >= LEAST_SAMPLES {
                loads.push(read.iter().sum::<f64>() / read.len() as f64);
                here.push(*cut);
            }
        }
        if here.is_empty() {
            continue;
        }
        let mean = loads.iter().sum::<f64>() / loads.len() as f64;
        let load = if kind == LoadKind::Power { shaft(run, mean) } else { mean };
        readings.push(Reading { check: number, cuts: here, load, kind });
    }
    Ok(Told { readings, notes: log.warnings.clone() })
}

/// Samples of the log within the reading of a cut.
fn within(aligned: &Aligned, line: &Timeline, cut: &CheckCut) -> Vec<usize> {
    let inside = |time_s: f64| {
        let spot = line.at(time_s).map(|spot| &line.spots[spot]);
        spot.is_some_and(|spot| {
            spot.move_id == Some(cut.place.move_id)
                && (cut.place.read_mm[0]..=cut.place.read_mm[1]).contains(&spot.middle_mm)
        })
    };
    let samples = aligned.program_s.iter().enumerate();
    samples.filter(|(_, time_s)| time_s.is_finite() && inside(**time_s)).map(|(sample, _)| sample).collect()
}
