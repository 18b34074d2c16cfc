//! The JSON report of `optimize` and `simulate`. In: a run with its figures. Out: text with the documented keys in their order; metric whatever
//! the unit of the program, feeds in mm/min.

use schemars::JsonSchema;
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeMap;

use super::blocks::{BlockRow, blocks};
use super::bounds::Share;
use super::figures::{Figures, LimitFigure};
use super::marks::WRITTEN_BY;
use super::provenance::{Provenance, sha256};
use super::verdict::{Fault, Verdict};
use crate::diag::{self, Severity};
use crate::outcome::answers::Answers;
use crate::outcome::over_limits::Worst;
use crate::outcome::{ProgramRun, Written};
use crate::setup::Assumption;

/// What the caller asks for besides the figures.
#[derive(Debug, Clone, Copy, Default)]
pub struct Extras {
    /// With one entry per block.
    pub blocks: bool,
    /// With time per stage; peak memory in bytes where it is known.
    pub timings: Option<Option<u64>>,
}

/// What `optimize` and `simulate` found. Metric whatever the program's unit; feeds in mm/min; `line` is the physical line of the program,
/// from 1.
#[derive(Serialize, JsonSchema)]
struct Report<'a> {
    written_by: &'static str,
    verdict: VerdictPart<'a>,
    program: ProgramPart<'a>,
    time: TimePart<'a>,
    limits: Vec<LimitPart>,
    bounds: Vec<BoundPart>,
    #[serde(skip_serializing_if = "Option::is_none")]
    blocks: Option<Vec<BlockRow>>,
    constancy: Vec<ConstancyPart>,
    check: Option<CheckPart<'a>>,
    infeasible: Vec<InfeasiblePart>,
    infeasible_length_percent: f64,
    output: Option<OutputPart>,
    stock: StockPart,
    #[serde(skip_serializing_if = "Option::is_none")]
    performance: Option<PerformancePart>,
    assumptions: Vec<AssumptionPart<'a>>,
    frozen: Vec<FrozenPart>,
    warnings: Vec<WarningPart<'a>>,
    tool: Vec<ToolPart>,
    #[serde(flatten)]
    answers: &'a Answers,
    provenance: &'a Provenance,
}

/// Everything that cuts is counted, frozen, kept and infeasible blocks included, but for `free_worst_ratio`.
#[derive(Serialize, JsonSchema)]
struct VerdictPart<'a> {
    outcome: &'static str,
    exit_code: u8,
    headline: &'a str,
    worst: Option<WorstPart>,
    free_worst_ratio: f64,
    faults: Vec<FaultPart<'a>>,
}

#[derive(Serialize, JsonSchema)]
struct WorstPart {
    name: &'static str,
    of_spindle: bool,
    tool: u32,
    line: u32,
    ratio: f64,
    apart: Option<&'static str>,
}

#[derive(Serialize, JsonSchema)]
struct FaultPart<'a> {
    kind: &'static str,
    text: &'a str,
    lines: &'a [u32],
    length_mm: f64,
    worst: Option<WorstPart>,
    holds_back: bool,
}

#[derive(Serialize, JsonSchema)]
struct ProgramPart<'a> {
    file: &'a str,
    blocks: usize,
    motions: usize,
    dialect: &'static str,
    sha256: String,
}

#[derive(Serialize, JsonSchema)]
struct TimePart<'a> {
    programmed_s: f64,
    realised_before_s: f64,
    realised_after_s: f64,
    saved_percent: f64,
    /// A measured cycle time or log backs it.
    saving_confirmed: bool,
    by_cause: BTreeMap<&'a str, f64>,
}

#[derive(Serialize, JsonSchema)]
struct LimitPart {
    name: &'static str,
    unit: &'static str,
    limit: Option<f64>,
    of_spindle: bool,
    tool: Option<u32>,
    before_max: Option<f64>,
    after_max: Option<f64>,
    before_ratio: Option<f64>,
    after_ratio: Option<f64>,
    after_line: Option<u32>,
    after_apart: Option<&'static str>,
    after_p99: Option<f64>,
    active_time_percent: f64,
    shadow_price: Option<f64>,
}

/// Share of the cutting time; all of them add to 100.
#[derive(Serialize, JsonSchema)]
struct BoundPart {
    name: &'static str,
    reason: Option<String>,
    percent: f64,
}

#[derive(Serialize, JsonSchema)]
struct ConstancyPart {
    name: &'static str,
    tool: Option<u32>,
    reference: f64,
    within_5_percent: f64,
    within_10_percent: f64,
}

#[derive(Serialize, JsonSchema)]
struct CheckPart<'a> {
    geometry_identical: bool,
    differences: &'a [String],
    /// Of everything that cuts, frozen, kept and infeasible blocks included.
    resimulated_worst_ratio: f64,
    resimulated_p99_ratio: f64,
    /// The same without frozen, kept and infeasible blocks.
    free_worst_ratio: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    resimulated_force_rate_ratio: Option<f64>,
    /// Motions cut in pieces or near a limit; the others keep the stations of the first simulation.
    simulated_again: usize,
    rounds: usize,
    spacing_mm: f64,
}

#[derive(Serialize, JsonSchema)]
struct InfeasiblePart {
    line: u32,
    limit: &'static str,
    reason: String,
    length_mm: f64,
}

#[derive(Serialize, JsonSchema)]
struct OutputPart {
    f_words_before: usize,
    f_words_after: usize,
    f_words_changed: usize,
    f_words_inserted: usize,
    blocks_added: usize,
    bytes_before: usize,
    bytes_after: usize,
    loss_vs_continuous_percent: f64,
    growth_blocks: f64,
    growth_bytes: f64,
    max_growth_costs_s: f64,
    solved_by: String,
}

#[derive(Serialize, JsonSchema)]
struct StockPart {
    initial_mm3: f64,
    removed_mm3: f64,
    remaining_mm3: f64,
    cell_mm: f64,
}

#[derive(Serialize, JsonSchema)]
struct PerformancePart {
    stage_s: StagePart,
    peak_memory_bytes: Option<u64>,
}

#[derive(Serialize, JsonSchema)]
struct StagePart {
    parse: f64,
    simulate: f64,
    schedule: f64,
    rewrite: f64,
    check: f64,
}

/// A value that the setup does not give.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct AssumptionPart<'a> {
    key: &'a str,
    value: &'a str,
    source: &'a str,
}

/// All of them.
pub(super) fn assumption_parts(all: &[Assumption]) -> Vec<AssumptionPart<'_>> {
    all.iter().map(|a| AssumptionPart { key: &a.key, value: &a.value, source: &a.source }).collect()
}

#[derive(Serialize, JsonSchema)]
struct FrozenPart {
    line: u32,
    why: String,
}

#[derive(Serialize, JsonSchema)]
struct WarningPart<'a> {
    line: Option<u32>,
    code: &'static str,
    severity: &'static str,
    text: Cow<'a, str>,
    /// In how many places; `line` is that of the first.
    count: u32,
}

#[derive(Serialize, JsonSchema)]
struct ToolPart {
    number: u32,
    power_max_w: f64,
    power_ref_w: f64,
    force_peak_n: f64,
    cut_time_s: f64,
    cut_length_mm: f64,
}

/// JSON Schema of the report.
pub fn json_schema() -> String {
    // What is written, not what could be read.
    let schema = schemars::generate::SchemaSettings::default().for_serialize().into_generator();
    let schema = schema.into_root_schema_for::<Report<'static>>();
    serde_json::to_string_pretty(&schema).expect("a schema is plain data") + "\n"
}

/// The report as text.
pub fn json(run: &ProgramRun, figures: &Figures, from: &Provenance, file: &str, extras: Extras) -> String {
    let report = Report {
        written_by: WRITTEN_BY,
        verdict: verdict(&figures.verdict),
        program: program(run, file),
        time: time(run, figures),
        limits: figures.limits.iter().map(limit).collect(),
        bounds: figures.bounds.iter().map(bound).collect(),
        blocks: extras.blocks.then(|| blocks(run)),
        constancy: figures.limits.iter().filter_map(constancy).collect(),
        check: run.written.as_ref().map(check),
        infeasible: infeasible(run),
        infeasible_length_percent: 100.0 * run.infeasible_share(),
        output: run.written.as_ref().map(|written| output(run, written)),
        stock: stock(run),
        performance: extras.timings.map(|peak_memory_bytes| performance(run, peak_memory_bytes)),
        assumptions: assumption_parts(&run.assumptions),
        frozen: run.frozen().into_iter().map(|(line, why)| FrozenPart { line, why }).collect(),
        warnings: warnings(run, figures),
        tool: tools(figures),
        answers: &run.answers,
        provenance: from,
    };
    serde_json::to_string_pretty(&report).expect("the report is plain data") + "\n"
}

fn verdict(verdict: &Verdict) -> VerdictPart<'_> {
    VerdictPart {
        outcome: verdict.outcome.name(),
        exit_code: verdict.outcome.exit_code(),
        headline: &verdict.headline,
        worst: verdict.over.largest().map(worst),
        free_worst_ratio: verdict.over.free_ratio,
        faults: verdict.faults.iter().map(fault).collect(),
    }
}

fn worst(worst: &Worst) -> WorstPart {
    WorstPart {
        name: worst.limit.kind.name(),
        of_spindle: worst.limit.of_spindle,
        tool: worst.place.tool,
        line: worst.place.line,
        ratio: worst.ratio(),
        apart: worst.place.fixed.map(crate::outcome::over_limits::FixedFeed::name),
    }
}

fn fault(fault: &Fault) -> FaultPart<'_> {
    FaultPart {
        kind: fault.kind.name(),
        text: &fault.text,
        lines: &fault.lines,
        length_mm: fault.length_mm,
        worst: fault.worst.as_ref().map(worst),
        holds_back: fault.kind.holds_back().is_some(),
    }
}

fn program<'a>(run: &ProgramRun, file: &'a str) -> ProgramPart<'a> {
    ProgramPart {
        file,
        blocks: run.program.own_len(),
        motions: run.toolpath.moves.len(),
        dialect: run.program.dialect().name(),
        sha256: sha256(run.program.own_text()),
    }
}

fn time<'a>(run: &'a ProgramRun, figures: &Figures) -> TimePart<'a> {
    let (before, after) = (run.realised_before.total_s, run.realised_after().total_s);
    TimePart {
        programmed_s: figures.programmed_s,
        realised_before_s: before,
        realised_after_s: after,
        saved_percent: if before > 0.0 { 100.0 * (1.0 - after / before) } else { 0.0 },
        saving_confirmed: run.answers.cycle.as_ref().is_some_and(|cycle| cycle.saved_percent.is_some()),
        by_cause: run.realised_after().by_cause.iter().copied().collect(),
    }
}

fn limit(figure: &LimitFigure) -> LimitPart {
    LimitPart {
        name: figure.kind.name(),
        unit: figure.kind.unit(),
        limit: figure.limit,
        tool: figure.tool,
        of_spindle: figure.of_spindle,
        before_max: figure.before_max,
        after_max: figure.after_max,
        before_ratio: figure.ratios[0],
        after_ratio: figure.ratios[1],
        after_line: figure.at.map(|place| place.line),
        after_apart: figure.at.and_then(|place| place.fixed).map(crate::outcome::over_limits::FixedFeed::name),
        after_p99: figure.after_p99,
        active_time_percent: figure.active_time_percent,
        shadow_price: figure.shadow_price,
    }
}

fn bound(share: &Share) -> BoundPart {
    BoundPart { name: share.name, reason: share.reason.clone(), percent: share.percent }
}

fn constancy(figure: &LimitFigure) -> Option<ConstancyPart> {
    figure.after_max?;
    Some(ConstancyPart {
        name: figure.kind.name(),
        tool: figure.tool,
        reference: figure.limit?,
        within_5_percent: figure.within_5_percent,
        within_10_percent: figure.within_10_percent,
    })
}

fn check(written: &Written) -> CheckPart<'_> {
    let check = &written.check;
    CheckPart {
        geometry_identical: check.identical,
        differences: &check.differences,
        resimulated_worst_ratio: check.over.ratio(),
        resimulated_p99_ratio: check.over.p99_ratio,
        free_worst_ratio: check.over.free_ratio,
        resimulated_force_rate_ratio: check.force_rate_ratio,
        simulated_again: check.simulated_again,
        rounds: check.rounds,
        spacing_mm: check.spacing_mm,
    }
}

fn infeasible(run: &ProgramRun) -> Vec<InfeasiblePart> {
    let part = |place: crate::outcome::Infeasible| InfeasiblePart {
        line: place.line,
        limit: place.limit.name(),
        reason: format!("{} is exceeded even at the lowest feed allowed", place.limit.name()),
        length_mm: place.length_mm,
    };
    run.infeasible().into_iter().map(part).collect()
}

fn output(run: &ProgramRun, written: &Written) -> OutputPart {
    OutputPart {
        f_words_before: written.stats.f_words_before,
        f_words_after: written.stats.f_words_after,
        f_words_changed: written.stats.f_words_changed,
        f_words_inserted: written.stats.f_words_inserted,
        blocks_added: written.stats.blocks_added,
        bytes_before: run.program.own_text().len(),
        bytes_after: written.bytes.len(),
        loss_vs_continuous_percent: written.loss_percent(),
        growth_blocks: 1.0 + written.stats.blocks_added as f64 / (run.program.len() as f64).max(1.0),
        growth_bytes: written.length() as f64 / (run.program.text().len() as f64).max(1.0),
        max_growth_costs_s: written.schedule.bound_costs_s,
        solved_by: written.schedule.how.clone(),
    }
}

fn stock(run: &ProgramRun) -> StockPart {
    StockPart {
        initial_mm3: run.map.initial_mm3,
        removed_mm3: run.map.removed_mm3,
        remaining_mm3: run.map.remaining_mm3,
        cell_mm: run.map.cell_mm,
    }
}

fn performance(run: &ProgramRun, peak_memory_bytes: Option<u64>) -> PerformancePart {
    let [parse, simulate, schedule, rewrite, check] = run.stage_s;
    PerformancePart { stage_s: StagePart { parse, simulate, schedule, rewrite, check }, peak_memory_bytes }
}

fn warnings<'a>(run: &'a ProgramRun, figures: &Figures) -> Vec<WarningPart<'a>> {
    let said = diag::kinds(&run.diagnostics).into_iter().map(|kind| WarningPart {
        line: kind.first.line,
        code: kind.first.code,
        severity: match kind.first.severity {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        },
        text: Cow::Owned(kind.text()),
        count: kind.places,
    });
    let bent = figures.overbent(run).into_iter().map(|(line, text)| WarningPart {
        line: Some(line),
        code: "bending-stress",
        severity: "warning",
        text: Cow::Owned(text),
        count: 1,
    });
    said.chain(bent).collect()
}

fn tools(figures: &Figures) -> Vec<ToolPart> {
    let part = |tool: &super::figures::ToolFigure| ToolPart {
        number: tool.number,
        power_max_w: tool.power_max_w,
        power_ref_w: tool.power_ref_w,
        force_peak_n: tool.force_peak_n,
        cut_time_s: tool.cut_time_s,
        cut_length_mm: tool.cut_length_mm,
    };
    figures.tools.iter().map(part).collect()
}
