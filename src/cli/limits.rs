//! `limits`: how loads are distributed along the cut of each tool as programmed, and the reference limits they suggest.
//!
//! The reference of a load is what 95 % of the cut length stays below: cuts that are usual for this program stay as they
//! are, the rare heavy ones are slowed down, and light ones may be speeded up to it.

use serde::Serialize;

use super::Outcome;
use super::args::{Global, Limits};
use super::error::CliError;
use super::input;
use super::output::{Kind, Outputs};
use super::screen::{self, Screen};
use super::work::{inputs, run};
use crate::job;
use crate::machine::LimitKind;
use crate::report::{in_report_unit, short};
use crate::schedule::reference::{Distribution, distributions};

/// Shares of the cut length that are printed; the third is the suggestion.
const SHARES: [f64; 5] = [0.5, 0.9, 0.95, 0.99, 1.0];

#[derive(Serialize)]
struct Report<'a> {
    written_by: &'static str,
    file: &'a str,
    tools: Vec<ToolPart>,
}

#[derive(Serialize)]
struct ToolPart {
    number: u32,
    cut_length_mm: f64,
    loads: Vec<LoadPart>,
}

#[derive(Serialize)]
struct LoadPart {
    name: &'static str,
    unit: &'static str,
    p50: f64,
    p90: f64,
    p95: f64,
    p99: f64,
    max: f64,
    suggested: f64,
}

/// Prints the distributions.
pub fn limits(command: &Limits, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let source = input::program(&command.program)?;
    let mut outputs = Outputs::new(inputs(&source, command.setup.as_deref(), global), global.force);
    let json = command.json.as_deref().map(|path| outputs.open(path, Kind::Json)).transpose()?;
    let done = run(source, command.setup.as_deref(), job::simulate, global, job::Wanted::default(), screen)?;
    let found = distributions(&done.run.toolpath, &done.run.map, &done.run.job);
    let tools: Vec<ToolPart> = found.chunk_by(|a, b| a.tool == b.tool).map(tool).collect();
    match json {
        Some(output) => {
            let report = Report { written_by: crate::report::WRITTEN_BY, file: &done.source.name, tools };
            output.write((serde_json::to_string_pretty(&report).expect("plain data") + "\n").as_bytes())?;
        }
        None => screen::put(words(&tools).as_bytes())?,
    }
    Ok(Outcome::Done)
}

fn tool(loads: &[Distribution]) -> ToolPart {
    ToolPart { number: loads[0].tool, cut_length_mm: loads[0].length_mm(), loads: loads.iter().map(load).collect() }
}

fn load(found: &Distribution) -> LoadPart {
    let [p50, p90, p95, p99, max] = SHARES.map(|share| in_report_unit(found.kind, found.quantile(share)));
    LoadPart { name: found.kind.name(), unit: found.kind.unit(), p50, p90, p95, p99, max, suggested: p95 }
}

fn words(tools: &[ToolPart]) -> String {
    let mut text = String::new();
    for tool in tools {
        text += &format!(
            "T{}: {} mm of cuts; loads that a share of them stays below\n",
            tool.number,
            short(tool.cut_length_mm)
        );
        text += &format!("  {:<20}{:>10}{:>10}{:>10}{:>10}{:>10}\n", "", "50 %", "90 %", "95 %", "99 %", "largest");
        for load in &tool.loads {
            let row = [load.p50, load.p90, load.p95, load.p99, load.max];
            let cells = row.iter().fold(String::new(), |text, value| text + &format!("{:>10}", short(*value)));
            text += &format!("  {:<20}{cells} {}\n", load.name, load.unit);
        }
        text += &suggestion(tool);
    }
    text
}

/// A line for the tool's table in the setup.
fn suggestion(tool: &ToolPart) -> String {
    let names = [LimitKind::ForceXy, LimitKind::Power, LimitKind::Deflection].map(LimitKind::name);
    let worth = |load: &&LoadPart| names.contains(&load.name) && load.suggested > 0.0;
    let items: Vec<String> =
        tool.loads.iter().filter(worth).map(|load| format!("{} = {}", load.name, short(load.suggested))).collect();
    format!("  suggested (95 % of the length stays below; lengths in mm):\n  limits = {{ {} }}\n", items.join(", "))
}
