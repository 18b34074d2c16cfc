//! `toolpath`. In: a program. Out: its motions as interpreted, for comparison with a control.

use clap::Args;
use serde::Serialize;
use std::path::PathBuf;

use super::error::CliError;
use super::input;
use super::options::{Common, Global, SETUP_OF_MOTIONS};
use super::output::{Kind, Outputs};
use super::screen::{self, Screen};
use crate::nc::{self, Environment, Event, FeedMode, Move, MoveKind, Toolpath};
use crate::path::{Curve, Vec3};
use crate::report::Outcome;
use crate::units::{mm_min_from_mm_s, rpm_from_rps};

/// `toolpath`.
#[derive(Debug, Args)]
#[command(mut_arg("setup", |arg| arg.help(SETUP_OF_MOTIONS)))]
pub struct Motions {
    /// NC program; - is standard input.
    pub program: PathBuf,
    /// Setup and report.
    #[command(flatten)]
    pub common: Common,
}

#[derive(Serialize)]
struct Report {
    written_by: &'static str,
    motions: Vec<Motion>,
}

#[derive(Serialize, Default)]
struct Motion {
    line: u32,
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    to: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    plane: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    centre: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    turns: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    feed_mm_min: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    feed_mode: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    value: Option<f64>,
}

/// Prints the motions.
pub fn toolpath(command: &Motions, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let source = input::program(&command.program)?;
    let setup = input::setup_if_any(command.common.setup(), &source, global)?;
    let inputs = source.path.clone().into_iter().chain(command.common.setup.clone());
    let mut outputs = Outputs::new(inputs, global.force);
    let json = command.common.json().map(|path| outputs.open(path, Kind::Json)).transpose()?;
    let job = setup.as_ref().map(|setup| &setup.job);
    let program = input::parse(&source, global, job)?;
    let folder = source.path.as_deref().and_then(std::path::Path::parent).map(std::path::Path::to_owned);
    let load = |name: &str| super::work::subprogram(folder.as_deref(), name);
    let environment = Environment { load: &load, ..job.map(Environment::from_job).unwrap_or_default() };
    let environment = nc::unit::with_its_unit(&program, environment, job);
    let path = nc::interpret(&program, &environment);
    screen.diagnostics(&source.name, &source.bytes, &path.diagnostics);
    match json {
        Some(output) => output.write_with(|out| Ok(serde_json::to_writer(out, &report(&path))?))?,
        None => screen::put(nc::print::toolpath_text(&path).as_bytes())?,
    }
    outputs.commit()?;
    Ok(Outcome::Done)
}

fn report(path: &Toolpath) -> Report {
    Report { written_by: crate::report::WRITTEN_BY, motions: path.events().map(|event| motion(path, event)).collect() }
}

fn motion(path: &Toolpath, event: Event) -> Motion {
    let other = |line, kind, value| Motion { line, kind, value, ..Motion::default() };
    match event {
        Event::Move(id) => of_move(&path.moves[id.ix()], path.shift_at(id)),
        Event::Dwell { seconds, line } => other(line, "dwell", Some(seconds)),
        Event::Tool { number, line } => other(line, "tool", Some(f64::from(number))),
        Event::Spindle { spin, line } => {
            let rpm = rpm_from_rps(spin.rps);
            other(line, "spindle", Some(if spin.reverse { -rpm } else { rpm }))
        }
        Event::Stop { line, .. } => other(line, "stop", None),
    }
}

fn of_move(motion: &Move, shift: Vec3) -> Motion {
    let array = |p: Vec3| [p.x, p.y, p.z];
    let mut out = Motion { line: motion.line, to: Some(array(motion.curve().to() - shift)), ..Motion::default() };
    out.kind = if motion.kind == MoveKind::Rapid { "rapid" } else { "feed" };
    if let Curve::Arc(arc) = motion.curve() {
        out.kind = "arc";
        out.plane = Some(arc.plane.name());
        out.centre = Some(array(arc.centre - shift));
        out.turns = Some(arc.sweep_rad / std::f64::consts::TAU);
    }
    if motion.kind == MoveKind::Feed {
        out.feed_mm_min = Some(mm_min_from_mm_s(motion.feed.mm_s));
        out.feed_mode = Some(match motion.feed.mode {
            FeedMode::PerMinute => "per-minute",
            FeedMode::InverseTime => "inverse-time",
            FeedMode::PerRev => "per-revolution",
        });
    }
    out
}
