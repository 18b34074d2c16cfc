//! `limits`. In: a program with its setup. Out: the distribution of loads along the cut of each tool as programmed, and the reference limits that
//! follow from it.
//!
//! The reference of a load is the value that 95 % of the cut length stays below. The usual cuts of the program then stay as they are, the rare
//! heavy ones are slowed down, and light ones may run faster up to it.

use clap::Args;
use serde::Serialize;
use std::path::PathBuf;

use super::error::CliError;
use super::input;
use super::options::{Common, Global};
use super::output::{Kind, Output, Outputs};
use super::screen::{self, Screen};
use super::work::{inputs, run};
use crate::job;
use crate::job::propose::{Proposal, ReferenceLimit, propose};
use crate::machine::{CutKind, Job, LimitKind, Scope, Tool};
use crate::report::{Outcome, short};
use crate::schedule::operations::{Segment, segments, whole_tools};
use crate::schedule::reference::{Distribution, distributions};
use crate::setup::amend::{Amendment, amend};
use crate::units::{Dimension, MM_PER_INCH};
use std::path::Path;

/// `limits`.
#[derive(Debug, Args)]
pub struct Limits {
    /// NC program; - is standard input.
    pub program: PathBuf,
    /// Setup and report.
    #[command(flatten)]
    pub common: Common,
    /// Put the proposed limits into the setup file; what it limits already stays.
    #[arg(long)]
    pub write: bool,
}

/// Shares of the cut length that are printed; the third is the suggestion.
const SHARES: [f64; 5] = [0.5, 0.9, 0.95, 0.99, 1.0];

#[derive(Serialize)]
struct Report<'a> {
    written_by: &'static str,
    file: &'a str,
    tools: Vec<ToolPart>,
    operations: Vec<OperationPart>,
    proposed: Vec<ProposalPart>,
}

/// Limits proposed for a tool or for one of its operations, in the setup's units.
#[derive(Serialize)]
struct ProposalPart {
    tool: u32,
    operation: Option<String>,
    lines: Option<[u32; 2]>,
    limits: Vec<ProposedLimit>,
}

#[derive(Serialize)]
struct ProposedLimit {
    name: &'static str,
    unit: &'static str,
    value: f64,
    reason: String,
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
    let setup = command.common.setup.clone().or_else(|| input::beside(&source)).filter(|_| command.write);
    let mut read = inputs(&source, command.common.setup(), global);
    read.retain(|path| Some(path) != setup.as_ref());
    let mut outputs = Outputs::new(read, global.force);
    let json = command.common.json().map(|path| outputs.open(path, Kind::Json)).transpose()?;
    let into_setup = match setup {
        Some(path) => Some((outputs.open_over(&path, Kind::Setup)?, path)),
        None if command.write => {
            return Err(CliError::new("--write has no setup to write into", "make one with `feedwright init`"));
        }
        None => None,
    };
    let done = run(source, command.common.setup(), job::simulate, global, job::Wanted::default(), screen)?;
    let (toolpath, map) = (&done.run.toolpath, &done.run.map);
    let found = distributions(&whole_tools(toolpath, map), toolpath, map, &done.run.job);
    let parts = segments(&job::sections(&done.run.program, toolpath, map), toolpath, map, &done.run.job);
    let of_parts = distributions(&parts, toolpath, map, &done.run.job);
    let operations: Vec<OperationPart> = of_parts
        .chunk_by(|a, b| a.segment == b.segment)
        .map(|loads| operation(&parts[loads[0].segment], tool(loads, &done.run.job)))
        .collect();
    let proposals = propose(&done.run);
    let tools: Vec<ToolPart> =
        found.chunk_by(|a, b| a.tool == b.tool).map(|loads| tool(loads, &done.run.job)).collect();
    match json {
        Some(output) => {
            let proposed = proposals.iter().map(|one| proposed(one, done.run.job.inch)).collect();
            let file = &done.source.name;
            let report = Report { written_by: crate::report::WRITTEN_BY, file, tools, operations, proposed };
            output.write((serde_json::to_string_pretty(&report).expect("plain data") + "\n").as_bytes())?;
        }
        None => screen::print(&words(&tools, &operations, &proposals, done.run.job.inch))?,
    }
    let written = into_setup.map(|(output, path)| write(output, &path, &proposals, done.run.job.inch, screen));
    let written = written.transpose()?;
    outputs.commit()?;
    if let Some(said) = written {
        screen.say(&said);
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
    let [p50, p90, p95, p99, max] = SHARES.map(|share| found.kind.in_report_unit(found.quantile(share)) / per_unit);
    LoadPart { name: found.kind.name(), unit, p50, p90, p95, p99, max, suggested: p95 }
}

/// The unit a bare number of this limit has in the setup, and what it is in the unit of the report.
fn setup_unit(kind: LimitKind, inch: bool) -> (&'static str, f64) {
    let length = Dimension::Length;
    let factor = length.factor(length.bare(inch)).filter(|_| kind == LimitKind::Deflection && inch);
    factor.map_or((kind.unit(), 1.0), |factor| (length.bare(inch), factor))
}

fn proposed(proposal: &Proposal, inch: bool) -> ProposalPart {
    let limit = |item: &ReferenceLimit| {
        let (unit, per_unit) = setup_unit(item.kind, inch);
        let value = item.kind.in_report_unit(item.value) / per_unit;
        ProposedLimit { name: item.kind.name(), unit, value, reason: why(item, inch) }
    };
    ProposalPart {
        tool: proposal.tool,
        operation: proposal.operation.as_ref().map(|(name, _)| name.clone()),
        lines: proposal.operation.as_ref().map(|(_, lines)| *lines),
        limits: proposal.items.iter().map(limit).collect(),
    }
}

fn words(tools: &[ToolPart], operations: &[OperationPart], proposals: &[Proposal], inch: bool) -> String {
    let mut text = String::new();
    let of_tool = |number: u32| proposals.iter().find(|one| one.tool == number && one.operation.is_none());
    for tool in tools {
        text += &format!(
            "T{}: {} of cuts; loads that a share of them stays below\n",
            tool.number,
            length(tool.cut_length_mm, inch)
        );
        text += &table(tool);
        text += &of_tool(tool.number).map_or_else(String::new, |one| suggestion(one, inch));
    }
    if operations.len() > tools.len() {
        text += "\nBy operation (what one survives says nothing about another):\n";
        for operation in operations {
            text += &heading(operation, inch);
            text += &table(&operation.cuts);
        }
    }
    let mut parts = proposals.iter().filter(|one| one.operation.is_some()).peekable();
    if parts.peek().is_some() {
        text += "\nProposed for operations of tools that have several:\n";
    }
    for one in parts {
        let Some((name, [first, last])) = &one.operation else { continue };
        text +=
            &format!("T{} {name}, lines {first} to {last}, {} of cuts\n", one.tool, length(one.cut_length_mm, inch));
        text += &suggestion(one, inch);
    }
    text
}

/// A length in the unit of the setup.
fn length(mm: f64, inch: bool) -> String {
    if inch { format!("{} in", short(mm / MM_PER_INCH)) } else { format!("{} mm", short(mm)) }
}

fn heading(operation: &OperationPart, inch: bool) -> String {
    let last = operation.last_line.map_or_else(|| "the end".to_owned(), |line| line.to_string());
    format!(
        "T{} {}, {}, up to {} deep, lines {} to {last}: {} of cuts\n",
        operation.cuts.number,
        if operation.name.is_empty() { "(no comment)" } else { &operation.name },
        operation.kind,
        length(operation.depths_mm[1], inch),
        operation.first_line,
        length(operation.cuts.cut_length_mm, inch)
    )
}

fn table(tool: &ToolPart) -> String {
    let mut text = format!("  {:<20}{:>10}{:>10}{:>10}{:>10}{:>10}\n", "", "50 %", "90 %", "95 %", "99 %", "largest");
    for load in &tool.loads {
        let row = [load.p50, load.p90, load.p95, load.p99, load.max];
        let cells = row.iter().fold(String::new(), |text, value| text + &format!("{:>10}", short(*value)));
        text += &format!("  {:<20}{cells} {}\n", load.name, load.unit);
    }
    text
}

/// The limits that are proposed, as a line for the setup, and below it why.
fn suggestion(proposal: &Proposal, inch: bool) -> String {
    if proposal.keeps_feed {
        return "  no limit to propose: this tool keeps its programmed feeds\n".to_owned();
    }
    if proposal.items.is_empty() {
        return "  no limit to propose: nothing is cut\n".to_owned();
    }
    let items: Vec<String> = proposal
        .items
        .iter()
        .map(|item| format!("{} = {}", item.kind.name(), in_setup(item.kind, item.value, inch)))
        .collect();
    let why = proposal.items.iter().map(|item| format!("  # {}: {}\n", item.kind.name(), why(item, inch)));
    format!("  proposed, in the setup's units:\n  limits = {{ {} }}\n{}", items.join(", "), why.collect::<String>())
}

fn why(item: &ReferenceLimit, inch: bool) -> String {
    item.why(&|kind, value| format!("{} {}", in_setup(kind, value, inch), setup_unit(kind, inch).0))
}

/// A value as the setup takes it.
fn in_setup(kind: LimitKind, value: f64, inch: bool) -> String {
    short(kind.in_report_unit(value) / setup_unit(kind, inch).1)
}

/// Puts the proposals into the setup, and gives the sentence that says so.
fn write(output: Output, path: &Path, proposals: &[Proposal], inch: bool, screen: Screen) -> Result<String, CliError> {
    let text = std::fs::read_to_string(path).map_err(|error| CliError::file("read", path, &error))?;
    let amendments: Vec<Amendment> =
        proposals.iter().filter(|one| !one.items.is_empty()).map(|one| amendment(one, inch)).collect();
    let (new, left) = amend(&text, &amendments).map_err(|error| {
        CliError::new(
            format!("{}: {error}", path.display()),
            "nothing was written; put the lines that `feedwright limits` prints into the setup by hand",
        )
    })?;
    for sentence in left {
        screen.say(&format!("kept      {sentence}"));
    }
    if new == text {
        return Ok(format!("unchanged {}: it has every limit that is proposed", path.display()));
    }
    output.write(new.as_bytes())?;
    Ok(format!("written   {}", path.display()))
}

fn amendment(proposal: &Proposal, inch: bool) -> Amendment {
    let limit =
        |item: &ReferenceLimit| (item.kind.name().to_owned(), in_setup(item.kind, item.value, inch), why(item, inch));
    let name = proposal.operation.as_ref().map_or("", |(name, _)| name.as_str());
    // A comment in the setup is one line of plain characters.
    let plain: String = name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    Amendment {
        tool: proposal.tool,
        lines: proposal.operation.as_ref().map(|(_, lines)| *lines),
        limits: proposal.items.iter().map(limit).collect(),
        heading: format!("T{} {plain}", proposal.tool).trim_end().to_owned(),
    }
}
