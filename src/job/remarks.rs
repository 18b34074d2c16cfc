//! Diagnostics about a program and its simulation. In: program, toolpath, engagement, schedule, job. Out: one diagnostic or assumption for each
//! finding: tools that the setup does not describe, collisions, limits that never act, minima that are not kept …

use crate::diag::{Diagnostic, Severity};
use crate::effects::wear;
use crate::engage::{EngagementMap, EventKind};
use crate::force::Cutter;
use crate::ids::MoveId;
use crate::machine::{Job, LimitKind, Tool};
use crate::nc::unit::{self, Witness};
use crate::nc::{Environment, Event, Freeze, Move, MoveKind, Program, Toolpath};
use crate::report::short;
use crate::rewrite;
use crate::schedule::cutters::Cutters;
use crate::schedule::idle_limits::{CANCELLED, Idle, idle};
use crate::schedule::rules::rules;
use crate::schedule::{Conflict, Node, NotRaised, Problem, Schedule, as_programmed};
use crate::setup::Assumption;
use crate::units::mm_min_from_mm_s;

/// Where the program calls no tool and the setup has just one, that one is meant; a toolpath read without the setup calls
/// it 0.
pub fn tool_assumption(toolpath: &Toolpath, job: &mut Job) -> Option<Assumption> {
    let called = toolpath.between.iter().any(|(_, event)| matches!(event, Event::Tool { number, .. } if *number != 0));
    let [only] = job.tools.as_mut_slice() else { return None };
    if called || only.number == 0 {
        return None;
    }
    let number = only.number;
    let without = |motion: &Move| motion.kind == MoveKind::Feed && motion.tool == 0;
    if toolpath.moves.iter().any(without) {
        only.number = 0;
    }
    let listed = if only.number == 0 { " (listed as T0)" } else { "" };
    Some(Assumption {
        key: "tool".into(),
        value: format!("T{number} for every move{listed}"),
        source: "the program calls no tool, the setup has one".into(),
    })
}

/// Tools of feed moves that the setup does not describe, each with the first line that needs it.
pub fn unknown_tools(toolpath: &Toolpath, job: &Job) -> Vec<(u32, u32)> {
    let mut unknown: Vec<(u32, u32)> = Vec::new();
    for motion in toolpath.moves.iter().filter(|motion| motion.kind == MoveKind::Feed) {
        let known = job.tool(motion.tool).is_some() || unknown.iter().any(|(number, _)| *number == motion.tool);
        if !known {
            unknown.push((motion.tool, motion.line));
        }
    }
    unknown
}

/// What was written as NaN or as infinity in place of a number, if anything was.
pub fn not_finite(toolpath: &Toolpath) -> Vec<Diagnostic> {
    toolpath.diagnostics.iter().filter(|diagnostic| diagnostic.code == "nc::not-finite").cloned().collect()
}

/// Taps, reamers and probes keep their feeds.
pub fn freeze_tools(toolpath: &mut Toolpath, job: &Job) {
    for motion in toolpath.moves.iter_mut().filter(|motion| motion.kind == MoveKind::Feed) {
        if motion.freeze.is_none() && job.tool(motion.tool).is_some_and(Tool::is_frozen) {
            motion.freeze = Some(Freeze::Tool);
        }
    }
}

/// Files whose feeds stay.
pub fn files(program: &Program, toolpath: &Toolpath) -> Option<Diagnostic> {
    let stays = |motion: &&Move| motion.freeze == Some(Freeze::OtherFile);
    let first = toolpath.moves.iter().find(stays)?;
    let names: Vec<&str> = toolpath.files[program.files().len()..].iter().map(|file| file.name.as_str()).collect();
    let text = format!("the feeds of {} stay: input files are never overwritten", names.join(", "));
    let help = "write the program into another folder with -o: its subprograms are then written beside it";
    Some(Diagnostic::new("nc::other-file", Severity::Note, text).on_line(first.line).help(help))
}

/// Collisions and other dangerous events, as diagnostics.
pub fn events(map: &EngagementMap, toolpath: &Toolpath) -> Vec<Diagnostic> {
    let one = |event: &crate::engage::Event| {
        let (code, severity, text, help) = words(event.kind);
        let motion = &toolpath.moves[event.move_id.ix()];
        let detail = if event.detail.is_empty() { String::new() } else { format!(": {}", event.detail) };
        Diagnostic::new(code, severity, format!("{text}{detail}")).on_line(motion.line).help(help)
    };
    map.events.iter().map(one).collect()
}

/// Operations that no move is under: a misspelt comment, a tool or lines that cut nothing, or a later operation that takes all.
/// `origins`: which of the `count` operations of the setup each of the job's is.
pub fn idle_operations(
    toolpath: &Toolpath,
    map: &EngagementMap,
    job: &Job,
    origins: &[usize],
    count: usize,
) -> Vec<Diagnostic> {
    let rules = rules(toolpath, map, job);
    let idle = |index: &usize| rules.rules.iter().filter_map(|rule| rule.operation).all(|one| origins[one] != *index);
    let said = |index: usize| {
        let text = format!("no feed move is under [[operation]] {} of the setup", index + 1);
        let help = "check what it matches; of several that match a move, the last one applies";
        Diagnostic::new("setup::idle-operation", Severity::Warning, text).help(help)
    };
    (0..count).filter(idle).map(said).collect()
}

/// A program that Feedwright has written before and whose original feeds are lost.
pub fn forgotten(program: &Program) -> Option<Diagnostic> {
    if !rewrite::forgets(program) {
        return None;
    }
    let text = "an earlier run wrote these feeds, and the original ones are lost (F words or notes were changed since, or there was no room to list them): no feed is raised";
    let help = "optimise the original again; or delete the line FEEDWRIGHT … FEEDS ONLY, so that these feeds count as the original ones";
    Some(Diagnostic::new("rewrite::forgotten", Severity::Warning, text).help(help))
}

/// Repairs in the files of the stock; and a remark if nothing of the stock is cut.
pub fn stock(map: &EngagementMap, toolpath: &Toolpath) -> Vec<Diagnostic> {
    let note = |note: &String| Diagnostic::new("engage::stock-file", Severity::Note, note.clone());
    let mut found: Vec<Diagnostic> = map.notes.iter().map(note).collect();
    let feeds = toolpath.moves.iter().find(|motion| motion.kind == MoveKind::Feed);
    if let Some(met_mm3) = map.misses_cuts() {
        let text = format!(
            "the path removes {:.0} mm³ of the stock, but the cuts that were found take {met_mm3:.0} mm³: loads are missing, no feed is raised",
            map.removed_mm3
        );
        let help = "does the program begin in the stock, or go through it at rapid? If not, this is a fault of Feedwright: please report it";
        found.push(Diagnostic::new("engage::missed", Severity::Warning, text).help(help));
    }
    if let Some(first) = feeds.filter(|_| map.touches_nothing()) {
        let text = "the program never touches the stock: nothing is cut, no load can be predicted, no feed is raised";
        let help = "check [stock] and its offset: are its coordinates those of the program?";
        found.push(Diagnostic::new("engage::untouched", Severity::Error, text).on_line(first.line).help(help));
    }
    found
}

/// Load limits far above every load, which therefore do not permit a higher feed.
pub fn idle_limits(toolpath: &Toolpath, map: &EngagementMap, job: &Job) -> Vec<Diagnostic> {
    let rules = rules(toolpath, map, job);
    let cutters = Cutters::new(toolpath, map, job, &as_programmed(toolpath));
    let said = |idle: Idle| {
        let motion = &toolpath.moves[idle.move_id.ix()];
        let [limit, load] = [idle.limit, idle.load].map(|value| short(idle.kind.in_report_unit(value)));
        let (name, unit, tool) = (idle.kind.name(), idle.kind.unit(), motion.tool);
        let help = "give what this tool, part or spindle can take; `feedwright limits` shows the loads of the program";
        let (severity, why) = if idle.load > CANCELLED * idle.limit {
            (Severity::Warning, format!("never acts: T{tool} meets {load} {unit} at most, at the highest feed allowed"))
        } else {
            (Severity::Note, format!("does not apply to T{tool}, which has no such load"))
        };
        let text = format!("{name} = {limit} {unit} {why}; it does not permit a higher feed");
        Diagnostic::new("schedule::limit-never-acts", severity, text).on_line(motion.line).help(help)
    };
    idle(toolpath, map, &rules, &cutters).into_iter().flatten().map(said).collect()
}

/// Tools of which the setup says when they are worn out, or how far they are, while nothing says how they wear.
pub fn without_rate(job: &Job) -> Vec<Diagnostic> {
    let without = |tool: &&Tool| tool.wear.is_some() && wear::of_tool(job, tool).is_none();
    let said = |tool: &Tool| {
        let text = format!(
            "`wear` of T{} gives no rate, and neither does the process model: it counts as unworn",
            tool.number
        );
        let help = "give rate, feed_per_tooth and exponent, or a --model in which `learn` found flank-wear";
        Diagnostic::new("setup::wear", Severity::Warning, text).help(help)
    };
    job.tools.iter().filter(without).map(said).collect()
}

/// `feed_change` where it holds the feed for longer than any other limit.
pub fn held_by_feed_change(schedule: &Schedule, job: &Job) -> Option<Diagnostic> {
    let whole: f64 = schedule.active_s.iter().map(|(_, seconds)| seconds).sum();
    let (kind, seconds) = schedule.active_s.iter().copied().reduce(|a, b| if b.1 > a.1 { b } else { a })?;
    let most = job.limits.feed_change_max.filter(|_| kind == LimitKind::FeedChange && seconds > 0.0)?;
    let text = format!(
        "feed_change.max = {most} and not a load limit is binding in {:.0} % of the cutting time",
        100.0 * seconds / whole
    );
    let help = if job.process.is_measured() {
        "raise it if feeds may change by more than that"
    } else {
        "coefficients are not measured: with `calibrate` or `learn` the default is 2, or write limits.feed_change"
    };
    Some(Diagnostic::new("schedule::feed-change", Severity::Note, text).help(help))
}

/// Time that is not saved because the setup does not say what clamps the part.
pub fn held_by_clamps(problem: &Problem) -> Option<Diagnostic> {
    let held = problem
        .nodes
        .iter()
        .filter(|node| node.not_raised == Some(NotRaised::Fixtures) && node.cap_if_raised.is_some());
    let seconds: f64 = held.map(|node| node.length_mm() / node.programmed_mm_s).sum();
    let text = format!(
        "{seconds:.0} s in the air beside the blank keep their feed: the setup does not say what clamps the part"
    );
    let help = "give the clamps as [[fixture]] boxes, or fixtures = \"none\" where the part is held from below";
    (seconds >= 0.5).then(|| Diagnostic::new("schedule::fixtures", Severity::Note, text).help(help))
}

/// Minima that gave way to a load limit or to how much a feed may change, one sentence for each pair of them: with both feeds, where they are
/// furthest apart.
pub fn overruled(problem: &Problem, toolpath: &Toolpath) -> Vec<Diagnostic> {
    let said = |pair: &Pair| {
        let ([lowest, highest], [asks, allows]) = pair.told();
        let of_load = pair.furthest.cap.kind.is_load();
        if !of_load {
            let held = match pair.furthest.cap.kind {
                LimitKind::Programmed => "no load limit acts there and it stays",
                _ => "how much it may change (feed_change, feed) leaves it",
            };
            let text = format!(
                "{asks} asks for {lowest} mm/min or more, but the feed is not raised to that: {held} at {highest}, here and on {:.1} mm in all",
                pair.length_mm
            );
            return (text, "allow more change (limits.feed_change), program a higher feed, or lower the minimum");
        }
        let text = format!(
            "{asks} asks for {lowest} mm/min or more, {allows} allows {highest}: the load limit is kept, here and on {:.1} mm in all",
            pair.length_mm
        );
        (text, "lower the minimum, or allow more of the load")
    };
    minima(&told(problem), problem, toolpath, &said)
}

/// The conflicts that are told: those with loads, and the others where they are no matter of the beginnings and ends of cuts.
fn told(problem: &Problem) -> Vec<Conflict> {
    let length_mm = |nodes: &mut dyn Iterator<Item = &Node>| nodes.map(Node::length_mm).sum::<f64>();
    let cutting_mm = length_mm(&mut problem.nodes.iter().filter(|node| node.cutting));
    let (of_loads, others): (Vec<Conflict>, Vec<Conflict>) =
        problem.conflicts.iter().partition(|conflict| conflict.cap.kind.is_load());
    let others_mm = length_mm(&mut others.iter().map(|conflict| &problem.nodes[conflict.node]));
    if others_mm >= OF_CUTS * cutting_mm { problem.conflicts.clone() } else { of_loads }
}

/// Share of the cutting length on which a minimum must lie above how much feeds may change, to be told: where a cut begins and ends chips are thin
/// at any feed. Our judgement.
const OF_CUTS: f64 = 0.2;

/// A feed per tooth below which an edge slips over the metal rather than cuts, mm: 0.3 of a radius of the edge of 0.01 mm. The thinnest chip
/// is 0.2 to 0.4 of that radius in steel and aluminium (Liu, DeVor, Kapoor 2006), and edges of carbide cutters have 0.005 to 0.02 mm.
const RUBBING_MM: f64 = 0.003;

/// Cuts that a limit slows to less than [`RUBBING_MM`] per tooth.
pub fn rubbing(problem: &Problem, toolpath: &Toolpath, job: &Job) -> Option<Diagnostic> {
    let per_tooth = |node: &Node| {
        let motion = &toolpath.moves[node.move_id.ix()];
        let teeth_per_s = job.tool(motion.tool).map_or(0.0, |tool| f64::from(tool.flutes)) * motion.spin.rps;
        (node.cap.feed_mm_s / teeth_per_s, motion.line)
    };
    let held = |node: &&Node| node.cutting && node.infeasible.is_none() && node.cap.feed_mm_s < node.programmed_mm_s;
    let held = problem.nodes.iter().filter(held);
    let thin: Vec<(f64, u32, f64)> = held
        .map(|node| (per_tooth(node), node))
        .filter(|((chip_mm, _), _)| *chip_mm < RUBBING_MM)
        .map(|((chip_mm, line), node)| (chip_mm, line, node.length_mm()))
        .collect();
    let (least_mm, line, _) = thin.iter().copied().reduce(|a, b| if b.0 < a.0 { b } else { a })?;
    let whole_mm: f64 = thin.iter().map(|(.., length_mm)| length_mm).sum();
    let text = format!(
        "limits leave {} mm per tooth here, and less than {RUBBING_MM} mm on {whole_mm:.1} mm in all: so thin a chip rubs more than it is cut",
        short(least_mm)
    );
    let help = "take less depth or width, or allow more of the load";
    Some(Diagnostic::new("schedule::rubbing", Severity::Warning, text).on_line(line).help(help))
}

/// Minima that the written feeds do not keep because the F word serves another place of the block too.
pub fn missed(schedule: &Schedule, problem: &Problem, toolpath: &Toolpath) -> Vec<Diagnostic> {
    let told = told(problem);
    let is_told = |missed: &Conflict| told.binary_search_by_key(&missed.node, |known| known.node).is_ok();
    let rest: Vec<Conflict> = schedule.missed.iter().filter(|missed| !is_told(missed)).copied().collect();
    let said = |pair: &Pair| {
        let ([lowest, highest], [asks, allows]) = pair.told();
        let text = format!(
            "{asks} asks for {lowest} mm/min or more, but its F word also covers a place where {allows} allows only {highest}, here and on {:.1} mm in all",
            pair.length_mm
        );
        (text, "allow the block to be split (output.split, output.minimum_length), or lower the minimum")
    };
    minima(&rest, problem, toolpath, &said)
}

/// A minimum and what it gave way to, where they are furthest apart, and the length over which they are at odds.
struct Pair {
    furthest: Conflict,
    length_mm: f64,
}

impl Pair {
    /// Both feeds in mm/min, and the names of what they come from.
    fn told(&self) -> ([String; 2], [&'static str; 2]) {
        let both = [self.furthest.floor, self.furthest.cap];
        (both.map(|bound| format!("{:.0}", mm_min_from_mm_s(bound.feed_mm_s))), both.map(|bound| bound.kind.name()))
    }
}

fn minima(
    conflicts: &[Conflict],
    problem: &Problem,
    toolpath: &Toolpath,
    said: &dyn Fn(&Pair) -> (String, &'static str),
) -> Vec<Diagnostic> {
    let mut pairs: Vec<Pair> = Vec::new();
    let apart = |of: &Conflict| of.floor.feed_mm_s / of.cap.feed_mm_s;
    for conflict in conflicts {
        let length_mm = problem.nodes[conflict.node].length_mm();
        let same = |known: &Conflict| (known.floor.kind, known.cap.kind) == (conflict.floor.kind, conflict.cap.kind);
        let Some(pair) = pairs.iter_mut().find(|pair| same(&pair.furthest)) else {
            pairs.push(Pair { furthest: *conflict, length_mm });
            continue;
        };
        pair.length_mm += length_mm;
        if apart(conflict) > apart(&pair.furthest) {
            pair.furthest = *conflict;
        }
    }
    let diagnostic = |pair: &Pair| {
        let (text, help) = said(pair);
        let line = toolpath.moves[problem.nodes[pair.furthest.node].move_id.ix()].line;
        Diagnostic::new("schedule::minimum", Severity::Warning, text).on_line(line).help(help)
    };
    pairs.iter().map(diagnostic).collect()
}

/// Windows of the convex program that were left to the exact pass.
pub fn refused(schedule: &Schedule) -> Option<Diagnostic> {
    let [windows, _, refused] = schedule.windows;
    let text = format!(
        "{refused} of {windows} windows of the convex program have no answer that passes the check: there the speeds ignore jerk limits, and no price is given"
    );
    let help = "feeds and loads do not depend on it; --dump-problem shows the problem";
    (refused > 0).then(|| Diagnostic::new("schedule::refused", Severity::Warning, text).help(help))
}

/// Cuts whose loads cannot be predicted, once per tool and speed, and runout that leaves teeth idle.
pub fn cutters(map: &EngagementMap, toolpath: &Toolpath, job: &Job) -> Vec<Diagnostic> {
    let mut seen: Vec<(u32, f64)> = Vec::new();
    let mut found = Vec::new();
    for (index, motion) in toolpath.moves.iter().enumerate() {
        let key = (motion.tool, motion.spin.rps);
        let cuts = map.stations_of(MoveId(index as u32)).iter().any(|station| station.arc_count > 0);
        if !cuts || motion.spin.rps <= 0.0 || seen.contains(&key) {
            continue;
        }
        seen.push(key);
        let Some(tool) = job.tool(motion.tool) else { continue };
        found.extend(no_loads(map, tool, motion.spin.rps, job).map(|said| said.on_line(motion.line)));
        found.extend(idle_teeth(tool, motion.feed.mm_s / motion.spin.rps).map(|said| said.on_line(motion.line)));
    }
    found
}

fn no_loads(map: &EngagementMap, tool: &Tool, rps: f64, job: &Job) -> Option<Diagnostic> {
    let material = job.material(tool)?;
    let slices = map.slices_of(tool.number);
    match Cutter::new(tool, material, &job.machine.spindle, &job.process, slices, rps) {
        Ok(cutter) => not_held(&cutter, tool, job),
        Err(error) => {
            let text = format!("no loads are predicted for T{} from here on, no feed is raised: {error}", tool.number);
            let said = Diagnostic::new("force::no-loads", Severity::Error, text);
            Some(said.help("correct it in the setup, or in the program"))
        }
    }
}

/// A limit on a load that the force model does not give.
fn not_held(cutter: &Cutter, tool: &Tool, job: &Job) -> Option<Diagnostic> {
    let limits = job.limits.overridden_by(&tool.limits).loads();
    let (kind, _) = limits.into_iter().find(|(kind, _)| cutter.silent_about().contains(kind))?;
    let text =
        format!("limits.{} is not held for T{}: its force model does not give that load", kind.name(), tool.number);
    let said = Diagnostic::new("force::limit-not-held", Severity::Warning, text);
    Some(said.help("take another force model (`feedwright library models`), or drop the limit"))
}

/// Two teeth in a row differ in radius by at most 2 ρ sin(π/N): beyond the feed per tooth one of them cuts nothing.
fn idle_teeth(tool: &Tool, feed_per_rev_mm: f64) -> Option<Diagnostic> {
    let teeth = f64::from(tool.flutes.max(1));
    let (runout, feed) = (tool.runout?.offset_mm, feed_per_rev_mm / teeth);
    let step = 2.0 * runout * (std::f64::consts::PI / teeth).sin();
    let text =
        format!("the runout of T{} ({runout} mm) leaves teeth idle at a feed per tooth of {feed:.4} mm", tool.number);
    let help = format!("at this feed runout should stay below {:.4} mm", runout * feed / step);
    (step > feed).then(|| Diagnostic::new("force::runout", Severity::Note, text).help(help))
}

fn words(kind: EventKind) -> (&'static str, Severity, &'static str, &'static str) {
    match kind {
        EventKind::CutAtRapid => (
            "engage::cut-at-rapid",
            Severity::Error,
            "the cutter removes material at rapid",
            "check the stock and the retract heights",
        ),
        EventKind::ShankContact => {
            ("engage::shank", Severity::Error, "the shank meets stock", "check flute_length, or use a longer tool")
        }
        EventKind::HolderContact => (
            "engage::holder",
            Severity::Error,
            "the holder meets stock",
            "check overhang and holder, or use a longer tool",
        ),
        EventKind::FixtureContact => (
            "engage::fixture",
            Severity::Error,
            "the tool touches a fixture",
            "check the [[fixture]] boxes and the program before cutting",
        ),
        EventKind::PlungeNotCentreCutting => (
            "engage::plunge",
            Severity::Warning,
            "a tool that does not cut at its centre plunges into material",
            "ramp in, or drill a pilot hole",
        ),
        EventKind::Undercut => (
            "engage::undercut",
            Severity::Warning,
            "the stock model cannot show an undercut here; the feed is not raised",
            "",
        ),
        EventKind::SpindleStopped => (
            "engage::spindle-stopped",
            Severity::Error,
            "the tool cuts while the spindle stands still: no feed is raised",
            "check the S word and M3/M4 before this line; where the control has the speed, give rpm in its [[tool]]",
        ),
    }
}

/// The unit of a program that does not say it: put into the job, and handed back as an assumption, what is said of it, and
/// whether it is sure. Nothing where the program or the setup tells it.
pub fn unit(program: &Program, environment: &Environment<'_>, job: &mut Job) -> Option<(Assumption, Diagnostic, bool)> {
    if job.machine.unsaid.inch.is_some() {
        return None;
    }
    let found = unit::infer(program, environment, Witness::of(job))?;
    job.machine.unsaid.inch = Some(found.inch);
    let name = if found.inch { "inch" } else { "mm" };
    let why = if found.why.is_empty() { "nothing in it suggests inches".to_owned() } else { found.why.join(", ") };
    let told =
        Assumption { key: "machine.program_unit".into(), value: name.into(), source: format!("inferred: {why}") };
    let (severity, end) = if found.sure { (Severity::Note, "") } else { (Severity::Warning, ": no feed is raised") };
    let text = format!("there is neither G20 nor G21: the program is read in {name}, because {why}{end}");
    let help = format!("write G20 or G21 into the program, or program_unit = \"{name}\" under [machine]");
    Some((told, Diagnostic::new("nc::unit", severity, text).help(help), found.sure))
}
