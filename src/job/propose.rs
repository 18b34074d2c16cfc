//! Limits to propose for a program that runs well as it is. In: a simulated run. Out: for each tool, and for each of its operations
//! where it has several, reference limits, each with the reason for its value.
//!
//! The program has been run, so loads that [`SHARE`] of a tool's cut length stays below are known to be safe. These are proposed, unless the
//! tool's strength or the spindle allows less. Higher loads that tool and spindle would allow are mentioned but not proposed, because nobody has
//! tried them.

use crate::machine::{Job, LimitKind, Scope};
use crate::outcome::{ProgramRun, StationLoads, each_station};
use crate::report::words::plain;
use crate::schedule::operations::{Segment, whole_tools};
use crate::schedule::reference::{Distribution, distributions};

/// Share of the cut length: usual cuts stay as they are, the rare heavy ones are slowed down.
pub const SHARE: f64 = 0.95;
/// Least deflection worth a limit, mm. Our judgement: neither machine nor gauge of a shop holds a micrometre.
pub const LEAST_DEFLECTION_MM: f64 = 0.001;
/// A load below this is none, in the unit of its limit: a drill has no force in the plane but for rounding.
const NOTHING: f64 = 1e-6;

/// One limit, in the unit of [`crate::machine::Limits`].
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceLimit {
    /// Which.
    pub kind: LimitKind,
    /// Its value.
    pub value: f64,
    /// What gave it.
    pub reason: Reason,
}

/// What gave a limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reason {
    /// What the program does as it stands; with what the tool's strength or the spindle would give, where that is known.
    Does {
        /// In the unit of the limit.
        bound: Option<f64>,
    },
    /// The tool's strength or the spindle gives less than the program asks for.
    Bound {
        /// What the program does, in the unit of the limit.
        does: f64,
    },
}

/// Limits of one tool or one of its operations.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// Tool number.
    pub tool: u32,
    /// Comment and first and last line of the operation; `None`: all the tool does.
    pub operation: Option<(String, [u32; 2])>,
    /// Length of its cuts, mm.
    pub cut_length_mm: f64,
    /// A tap, reamer or probe keeps its feed: nothing to limit.
    pub keeps_feed: bool,
    /// The limits.
    pub items: Vec<ReferenceLimit>,
}

/// What holds a tool besides the program: per unit of force in the plane the bending stress, and the spindle's power.
#[derive(Debug, Clone, Copy, Default)]
struct Held {
    /// Largest bending stress over force in the plane, MPa/N.
    stress_per_force: f64,
    /// Least power that the spindle gives at the speeds of its cuts, W.
    power_w: Option<f64>,
}

/// Proposals by tool, each before those of its operations.
pub fn propose(run: &ProgramRun) -> Vec<Proposal> {
    let (toolpath, map, job) = (&run.toolpath, &run.map, &run.job);
    let held = held(run);
    let of = |segments: &[Segment]| -> Vec<(usize, Vec<Distribution>)> {
        let found = distributions(segments, toolpath, map, job);
        found.chunk_by(|a, b| a.segment == b.segment).map(|loads| (loads[0].segment, loads.to_vec())).collect()
    };
    let tools = whole_tools(toolpath, map);
    let operations = operations(run, &tools);
    let by_operation = of(&operations);
    let mut proposals = Vec::new();
    for (segment, loads) in of(&tools) {
        let tool = tools[segment].scope.tool;
        let bounds = held.iter().find(|(number, _)| *number == tool).map_or_else(Held::default, |(_, held)| *held);
        proposals.push(proposal(job, tool, None, &loads, bounds));
        let own: Vec<_> = by_operation.iter().filter(|(index, _)| operations[*index].scope.tool == tool).collect();
        for (index, loads) in own.iter().filter(|_| own.len() > 1) {
            let Segment { scope, name } = &operations[*index];
            let lines = [scope.lines.0.max(1), scope.lines.1.min(run.program.own_len() as u32)];
            proposals.push(proposal(job, tool, Some((name.clone(), lines)), loads, bounds));
        }
    }
    proposals
}

/// One segment for each tool in each section of the text.
fn operations(run: &ProgramRun, tools: &[Segment]) -> Vec<Segment> {
    let sections = super::sections(&run.program, &run.toolpath, &run.map);
    let ends = sections.iter().skip(1).map(|next| next.first_line - 1).chain([u32::MAX]);
    let each = |(section, end): (&crate::schedule::operations::Section, u32)| {
        let of = |tool: &Segment| Segment {
            scope: Scope { lines: (section.first_line, end), ..tool.scope },
            name: section.name.clone(),
        };
        tools.iter().map(of).collect::<Vec<_>>()
    };
    sections.iter().zip(ends).flat_map(each).collect()
}

fn held(run: &ProgramRun) -> Vec<(u32, Held)> {
    let mut found: Vec<(u32, Held)> = Vec::new();
    each_station(run, &mut |station: &StationLoads| {
        let motion = &run.toolpath.moves[station.station.move_id.ix()];
        if station.station.arc_count == 0 {
            return;
        }
        let at = found.iter().position(|(tool, _)| *tool == motion.tool).unwrap_or_else(|| {
            found.push((motion.tool, Held::default()));
            found.len() - 1
        });
        let held = &mut found[at].1;
        if station.before.force_xy_peak_n > NOTHING {
            let ratio = station.before.bending_stress_mpa / station.before.force_xy_peak_n;
            held.stress_per_force = held.stress_per_force.max(ratio);
        }
        let curve = run.job.machine.spindle.power_w.as_ref().map(|table| table.at(motion.spin.rps));
        held.power_w = held.power_w.into_iter().chain(curve).reduce(f64::min);
    });
    found
}

fn proposal(
    job: &Job,
    tool: u32,
    operation: Option<(String, [u32; 2])>,
    loads: &[Distribution],
    held: Held,
) -> Proposal {
    let allowable = job.tool(tool).and_then(|tool| tool.allowable_stress_mpa);
    let strength = allowable.filter(|_| held.stress_per_force > 0.0).map(|mpa| mpa / held.stress_per_force);
    let item = |kind: LimitKind, least: f64, bound: Option<f64>| {
        let does = loads.iter().find(|load| load.kind == kind)?.quantile(SHARE);
        let reason = match bound {
            Some(bound) if bound < does => Reason::Bound { does },
            bound => Reason::Does { bound },
        };
        let value = bound.map_or(does, |bound| bound.min(does));
        (does > least).then_some(ReferenceLimit { kind, value, reason })
    };
    let force = item(LimitKind::ForceXy, NOTHING, strength).or_else(|| item(LimitKind::ForceAxial, NOTHING, None));
    let power = item(LimitKind::Power, NOTHING, held.power_w);
    let deflection = item(LimitKind::Deflection, LEAST_DEFLECTION_MM, None);
    let keeps_feed = job.tool(tool).is_some_and(crate::machine::Tool::is_frozen);
    let items = if keeps_feed { Vec::new() } else { [force, power, deflection].into_iter().flatten().collect() };
    let cut_length_mm = loads.first().map_or(0.0, Distribution::length_mm);
    Proposal { tool, operation, cut_length_mm, keeps_feed, items }
}

impl ReferenceLimit {
    /// The reason as a clause; `shown` writes a value of this kind with its unit.
    pub fn why(&self, shown: &dyn Fn(LimitKind, f64) -> String) -> String {
        let bound = match self.kind {
            LimitKind::Power => "the spindle at this speed",
            _ => "the tool's strength",
        };
        match self.reason {
            Reason::Does { bound: None } => format!("{:.0} % of its cuts stay below this already", 100.0 * SHARE),
            Reason::Does { bound: Some(value) } => format!(
                "{:.0} % of its cuts stay below this already; {bound} would give {}",
                100.0 * SHARE,
                shown(self.kind, value)
            ),
            Reason::Bound { does } => {
                format!("all that {bound} gives; the program asks for {} {}", plain(self.kind), shown(self.kind, does))
            }
        }
    }
}
