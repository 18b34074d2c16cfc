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
use crate::report::{Distribution, distributions};

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
    let done = run(source, command.setup.as_deref(), job::simulate, global, screen)?;
    let found = distributions(&done.run);
    match json {
        Some(output) => {
            let report = Report {
                written_by: crate::report::WRITTEN_BY,
                file: &done.source.name,
                tools: found.iter().map(part).collect(),
            };
            output.write((serde_json::to_string_pretty(&report).expect("plain data") + "\n").as_bytes())?;
        }
        None => screen::put(words(&found).as_bytes())?,
    }
    Ok(Outcome::Done)
}

fn part(tool: &Distribution) -> ToolPart {
    let load = |(kind, q): &(crate::machine::LimitKind, [f64; 5])| LoadPart {
        name: kind.name(),
        unit: kind.unit(),
        p50: q[0],
        p90: q[1],
        p95: q[2],
        p99: q[3],
        max: q[4],
        suggested: q[2],
    };
    ToolPart { number: tool.number, cut_length_mm: tool.cut_length_mm, loads: tool.loads.iter().map(load).collect() }
}

fn words(found: &[Distribution]) -> String {
    use crate::report::short;
    let mut text = String::new();
    for tool in found {
        text += &format!(
            "T{}: {} mm of cuts; loads that a share of them stays below\n",
            tool.number,
            short(tool.cut_length_mm)
        );
        text += &format!("  {:<20}{:>10}{:>10}{:>10}{:>10}{:>10}\n", "", "50 %", "90 %", "95 %", "99 %", "largest");
        for (kind, q) in &tool.loads {
            let cells = q.iter().fold(String::new(), |text, value| text + &format!("{:>10}", short(*value)));
            text += &format!("  {:<20}{cells} {}\n", kind.name(), kind.unit());
        }
        text += "  suggested (what 95 % of the length stays below):\n  limits = { ";
        let suggested: Vec<String> = tool
            .loads
            .iter()
            .filter(|(kind, q)| suggest(*kind) && q[2] > 0.0)
            .map(|(kind, q)| format!("{} = {}", kind.name(), short(q[2])))
            .collect();
        text += &format!("{} }}\n", suggested.join(", "));
    }
    text
}

fn suggest(kind: crate::machine::LimitKind) -> bool {
    use crate::machine::LimitKind::{Deflection, ForceXy, Power};
    matches!(kind, ForceXy | Power | Deflection)
}
