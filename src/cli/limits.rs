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
use crate::machine::{CutKind, Job, LimitKind, Scope, Tool};
use crate::report::{in_report_unit, short};
use crate::schedule::operations::{Segment, segments, whole_tools};
use crate::schedule::reference::{Distribution, distributions};
use crate::units::Dimension;

/// Shares of the cut length that are printed; the third is the suggestion.
const SHARES: [f64; 5] = [0.5, 0.9, 0.95, 0.99, 1.0];

#[derive(Serialize)]
struct Report<'a> {
    written_by: &'static str,
    file: &'a str,
    tools: Vec<ToolPart>,
    operations: Vec<OperationPart>,
}

/// An operation of the program: cuts of one tool, under one comment, of one kind.
#[derive(Serialize)]
struct OperationPart {
    name: String,
    kind: &'static str,
    first_line: u32,
    last_line: Option<u32>,
    /// Least and largest axial depth, mm.
    depths_mm: [f64; 2],
    #[serde(flatten)]
    cuts: ToolPart,
}

#[derive(Serialize)]
struct ToolPart {
    number: u32,
    /// A tap, reamer or probe: no limit changes its feed.
    keeps_feed: bool,
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
    let (toolpath, map) = (&done.run.toolpath, &done.run.map);
    let found = distributions(&whole_tools(toolpath, map), toolpath, map, &done.run.job);
    let parts = segments(&job::sections(&done.run.program, toolpath, map), toolpath, map, &done.run.job);
    let of_parts = distributions(&parts, toolpath, map, &done.run.job);
    let operations: Vec<OperationPart> = of_parts
        .chunk_by(|a, b| a.segment == b.segment)
        .map(|loads| operation(&parts[loads[0].segment], tool(loads, &done.run.job)))
        .collect();
    let tools: Vec<ToolPart> =
        found.chunk_by(|a, b| a.tool == b.tool).map(|loads| tool(loads, &done.run.job)).collect();
    match json {
        Some(output) => {
            let report = Report { written_by: crate::report::WRITTEN_BY, file: &done.source.name, tools, operations };
            output.write((serde_json::to_string_pretty(&report).expect("plain data") + "\n").as_bytes())?;
        }
        None => screen::put(words(&tools, &operations).as_bytes())?,
    }
    Ok(Outcome::Done)
}

fn operation(of: &Segment, cuts: ToolPart) -> OperationPart {
    let Scope { lines, kind, depths_mm, .. } = of.scope;
    OperationPart {
        name: of.name.clone(),
        kind: kind.map_or("all", CutKind::name),
        first_line: lines.0.max(1),
        last_line: (lines.1 < u32::MAX).then_some(lines.1),
        depths_mm,
        cuts,
    }
}

fn tool(loads: &[Distribution], job: &Job) -> ToolPart {
    ToolPart {
        number: loads[0].tool,
        keeps_feed: job.tool(loads[0].tool).is_some_and(Tool::is_frozen),
        cut_length_mm: loads[0].length_mm(),
        loads: loads.iter().map(|found| load(found, job.inch)).collect(),
    }
}

fn load(found: &Distribution, inch: bool) -> LoadPart {
    let (unit, per_unit) = setup_unit(found.kind, inch);
    let [p50, p90, p95, p99, max] = SHARES.map(|share| in_report_unit(found.kind, found.quantile(share)) / per_unit);
    LoadPart { name: found.kind.name(), unit, p50, p90, p95, p99, max, suggested: p95 }
}

/// The unit a bare number of this limit has in the setup, and what it is in the unit of the report.
fn setup_unit(kind: LimitKind, inch: bool) -> (&'static str, f64) {
    let length = Dimension::Length;
    let factor = length.factor(length.bare(inch)).filter(|_| kind == LimitKind::Deflection && inch);
    factor.map_or((kind.unit(), 1.0), |factor| (length.bare(inch), factor))
}

fn words(tools: &[ToolPart], operations: &[OperationPart]) -> String {
    let mut text = String::new();
    for tool in tools {
        text += &format!(
            "T{}: {} mm of cuts; loads that a share of them stays below\n",
            tool.number,
            short(tool.cut_length_mm)
        );
        text += &table(tool);
    }
    if operations.len() > tools.len() {
        text += "\nBy operation (what one survives says nothing about another):\n";
        for operation in operations {
            text += &heading(operation);
            text += &table(&operation.cuts);
        }
    }
    text
}

fn heading(operation: &OperationPart) -> String {
    let last = operation.last_line.map_or_else(|| "the end".to_owned(), |line| line.to_string());
    format!(
        "T{} {}, {}, up to {} mm deep, lines {} to {last}: {} mm of cuts\n",
        operation.cuts.number,
        if operation.name.is_empty() { "(no comment)" } else { &operation.name },
        operation.kind,
        short(operation.depths_mm[1]),
        operation.first_line,
        short(operation.cuts.cut_length_mm)
    )
}

fn table(tool: &ToolPart) -> String {
    let mut text = format!("  {:<20}{:>10}{:>10}{:>10}{:>10}{:>10}\n", "", "50 %", "90 %", "95 %", "99 %", "largest");
    for load in &tool.loads {
        let row = [load.p50, load.p90, load.p95, load.p99, load.max];
        let cells = row.iter().fold(String::new(), |text, value| text + &format!("{:>10}", short(*value)));
        text += &format!("  {:<20}{cells} {}\n", load.name, load.unit);
    }
    text + &suggestion(tool)
}

/// A line for the tool's table in the setup: the loads it meets, of those that hold a feed down. A drill has no force in the
/// plane, so its axial force stands in; what would be written as 0 is rounding and no limit.
fn suggestion(tool: &ToolPart) -> String {
    if tool.keeps_feed {
        return "  no limit to propose: this tool keeps its programmed feeds\n".to_owned();
    }
    let written = |kind: LimitKind| {
        let load = tool.loads.iter().find(|load| load.name == kind.name())?;
        let value = short(load.suggested);
        (value != "0").then(|| format!("{} = {value}", load.name))
    };
    let force = written(LimitKind::ForceXy).or_else(|| written(LimitKind::ForceAxial));
    let items: Vec<String> =
        [force, written(LimitKind::Power), written(LimitKind::Deflection)].into_iter().flatten().collect();
    if items.is_empty() {
        return "  no limit to propose: nothing is cut\n".to_owned();
    }
    format!(
        "  suggested (95 % of the length stays below), in the setup's units:\n  limits = {{ {} }}\n",
        items.join(", ")
    )
}
