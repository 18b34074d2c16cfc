//! One verdict on a run. In: a finished [`ProgramRun`] and its loads over limits ([`Over`]). Out: [`Verdict`]: outcome, headline and
//! faults. Exit code, first line, tables, JSON, CSV, HTML and colours are read from it, so that none can say another thing.
//!
//! What counts as a fault. *Always*: a collision, a tool that cuts with the spindle at rest or without known loads, stock and
//! program that do not meet, an error in the program. *Of a written program*: a load beyond its limit by more than 1 %, wherever it is (frozen and
//! kept blocks included), a limit that cannot be met, a force that changes too fast. A simulation changes nothing: loads beyond
//! their limits are what it was asked for, so they stand in its headline and are no fault.

use super::number::length;
use super::words::plain;
use crate::diag::Severity;
use crate::engage::EventKind;
use crate::nc::{Doubted, Toolpath};
use crate::outcome::over_limits::{Beyond, FixedFeed, LIMIT_TOLERANCE, Over, Worst};
use crate::outcome::{ProgramRun, Written};

/// Share of the cutting length above which limits that cannot be met are probably wrong.
pub const HOPELESS: f64 = 0.2;
/// Lines that a sentence names.
const NAMED: usize = 4;

/// How a run ended, the better first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// Nothing is wrong.
    Done,
    /// Done, but something is: see the faults.
    Unmet,
}

impl Outcome {
    /// Exit code of the process.
    pub fn exit_code(self) -> u8 {
        match self {
            Outcome::Done => 0,
            Outcome::Unmet => 1,
        }
    }
    /// Name in the JSON report.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Done => "done",
            Outcome::Unmet => "unmet",
        }
    }
}

/// What can be wrong, the gravest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FaultKind {
    /// Nothing, or next to nothing, of the feed motion meets the stock.
    NoMeeting,
    /// Limits that cannot be met on more than [`HOPELESS`] of the cutting length.
    Hopeless,
    /// The cutter removes material at rapid.
    CutAtRapid,
    /// The tool touches a fixture.
    Fixture,
    /// The holder meets stock.
    Holder,
    /// The shank meets stock.
    Shank,
    /// A tool cuts while the spindle stands still.
    SpindleStopped,
    /// No loads can be predicted for a tool that cuts.
    NoLoads,
    /// Any other error in program or setup.
    Program,
    /// More than feeds differs.
    MoreThanFeeds,
    /// A limit is exceeded even at the lowest feed allowed.
    Infeasible,
    /// A load is beyond its limit where text or setup keep the feed.
    Frozen,
    /// A load is beyond its limit where the rewriting kept the feed.
    Kept,
    /// A load is beyond its limit where the feed was free to be chosen.
    Beyond,
    /// The force changes faster than its limit allows.
    ForceRate,
}

impl FaultKind {
    /// Name in the JSON report.
    pub fn name(self) -> &'static str {
        match self {
            FaultKind::NoMeeting => "no-meeting",
            FaultKind::Hopeless => "hopeless",
            FaultKind::CutAtRapid => "cut-at-rapid",
            FaultKind::Fixture => "fixture",
            FaultKind::Holder => "holder",
            FaultKind::Shank => "shank",
            FaultKind::SpindleStopped => "spindle-stopped",
            FaultKind::NoLoads => "no-loads",
            FaultKind::Program => "program",
            FaultKind::MoreThanFeeds => "more-than-feeds",
            FaultKind::Infeasible => "infeasible",
            FaultKind::Frozen => "frozen",
            FaultKind::Kept => "kept",
            FaultKind::Beyond => "beyond",
            FaultKind::ForceRate => "force-rate",
        }
    }

    /// Does the program stay unwritten because of it?
    pub fn holds_back(self) -> Option<HeldBack> {
        match self {
            FaultKind::NoMeeting => Some(HeldBack::NoMeeting),
            FaultKind::Hopeless => Some(HeldBack::Hopeless),
            FaultKind::CutAtRapid | FaultKind::Fixture | FaultKind::Holder | FaultKind::Shank => {
                Some(HeldBack::Collision)
            }
            _ => None,
        }
    }

    /// The fault that an event of the simulation is.
    pub fn of_event(kind: EventKind) -> Option<Self> {
        match kind {
            EventKind::CutAtRapid => Some(FaultKind::CutAtRapid),
            EventKind::FixtureContact => Some(FaultKind::Fixture),
            EventKind::HolderContact => Some(FaultKind::Holder),
            EventKind::ShankContact => Some(FaultKind::Shank),
            EventKind::SpindleStopped => Some(FaultKind::SpindleStopped),
            EventKind::PlungeNotCentreCutting | EventKind::Undercut => None,
        }
    }
}

/// Why a program stays unwritten.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum HeldBack {
    /// Stock and program do not meet: nothing that was predicted holds.
    NoMeeting,
    /// Limits are probably wrong.
    Hopeless,
    /// A collision.
    Collision,
}

/// One kind of fault.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// What.
    pub kind: FaultKind,
    /// One sentence without its full stop.
    pub text: String,
    /// Lines of the original, each once, in order; empty where it is not a matter of lines.
    pub lines: Vec<u32>,
    /// Length of path, mm; 0 where that is not known.
    pub length_mm: f64,
    /// The worst load of it, where it is one.
    pub worst: Option<Worst>,
}

/// The verdict on a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// What the exit code follows.
    pub outcome: Outcome,
    /// One sentence without its full stop.
    pub headline: String,
    /// What is wrong, the gravest first.
    pub faults: Vec<Fault>,
    /// Loads over limits of everything that cuts: as written, or as programmed where nothing is written.
    pub over: Over,
    /// A new program was made.
    pub rewritten: bool,
}

impl Verdict {
    /// The verdict on a run whose loads over limits are these.
    pub fn new(run: &ProgramRun, over: Over) -> Self {
        let mut faults = of_engagement(run);
        if let Some(written) = &run.written {
            faults.extend(of_written(run, written, &over));
        }
        faults.sort_by_key(|fault| fault.kind);
        let outcome = if faults.is_empty() { Outcome::Done } else { Outcome::Unmet };
        let rewritten = run.written.is_some();
        let headline =
            faults.first().map_or_else(|| good(&over, &unseen(run), rewritten), |fault| headline(fault, faults.len()));
        Self { outcome, headline, faults, over, rewritten }
    }

    /// Why the program stays unwritten, the gravest first; empty: it may be written.
    pub fn held_back(&self) -> Vec<HeldBack> {
        let mut reasons: Vec<HeldBack> = self.faults.iter().filter_map(|fault| fault.kind.holds_back()).collect();
        reasons.dedup();
        reasons
    }

    /// What the largest load is, where it is, and what the same number is without the places whose feed was not free.
    pub fn largest(&self) -> String {
        let Some(worst) = self.over.largest() else { return "no load is limited".into() };
        let apart = self.over.worst.iter().any(|worst| worst.place.fixed.is_some()) || !self.over.beyond.is_empty();
        let free = if apart && self.rewritten {
            format!("; {:.3} where the feed was free to be chosen", self.over.free_ratio)
        } else {
            String::new()
        };
        format!("largest load {:.3} of its limit ({}){free}", worst.ratio(), place(worst))
    }
}

fn headline(first: &Fault, count: usize) -> String {
    match count {
        1 => first.text.clone(),
        2 => format!("{}, and one more kind of fault", first.text),
        _ => format!("{}, and {} more kinds of fault", first.text, count - 1),
    }
}

/// The headline of a run without a fault.
fn good(over: &Over, unseen: &[u32], rewritten: bool) -> String {
    let Some(worst) = over.largest() else {
        return "no load limit is in force: no load was judged".into();
    };
    let (ratio, at) = (worst.ratio(), place(worst));
    let largest = format!("largest load {ratio:.3} of its limit ({at})");
    let but = if unseen.is_empty() { String::new() } else { format!("; not counted: what {} may cut", named(unseen)) };
    match over.beyond.len() {
        0 if rewritten && unseen.is_empty() => format!("every limit is met: {largest}, all cuts counted"),
        0 if rewritten => format!("every limit is met by what is simulated: {largest}{but}"),
        0 => format!("as programmed every limit is met: {largest}{but}"),
        _ => {
            let lines: usize = over.beyond.iter().map(|beyond| beyond.lines.len()).sum();
            let s = if lines == 1 { "" } else { "s" };
            format!("as programmed {lines} line{s} beyond a limit: {largest}{but}")
        }
    }
}

/// Lines, each once, that cut or may cut what is not simulated: cycles that are not read, programs that are missing, codes that are not known,
/// undercuts, behind which the stock is not known either.
pub fn unseen(run: &ProgramRun) -> Vec<u32> {
    let open =
        |doubted: &&Doubted| doubted.doubt.may_run_anything() && !run.job.confirmed.contains(&doubted.doubt.name());
    let of = |toolpath: &Toolpath| {
        let doubted = toolpath.doubts.iter().filter(open).map(|doubted| doubted.line);
        toolpath.unseen_cuts.iter().copied().chain(doubted).collect::<Vec<u32>>()
    };
    let undercut = run.map.events.iter().filter(|event| event.kind == EventKind::Undercut);
    let mut lines = of(&run.toolpath);
    lines.extend(undercut.map(|event| run.toolpath.moves[event.move_id.ix()].line));
    lines.extend(run.switched.iter().flat_map(|switched| of(&switched.toolpath)));
    lines.sort_unstable();
    lines.dedup();
    lines
}

/// The limit, the tool and the line of a load, and why its feed is not free.
fn place(worst: &Worst) -> String {
    let of_spindle = if worst.limit.of_spindle { ", all there is" } else { "" };
    let apart = worst.place.fixed.map_or_else(String::new, |apart| format!(", {}", apart.plain()));
    let (name, tool, line) = (plain(worst.limit.kind), worst.place.tool, worst.place.line);
    format!("{name}{of_spindle}, T{tool}, line {line}{apart}")
}

/// Faults that hold whatever the feeds are.
fn of_engagement(run: &ProgramRun) -> Vec<Fault> {
    let mut faults: Vec<Fault> = Vec::new();
    let switched = run.switched.iter().map(|switched| (&switched.map, &switched.toolpath));
    for (map, toolpath) in std::iter::once((&run.map, &run.toolpath)).chain(switched) {
        for event in &map.events {
            let line = toolpath.moves[event.move_id.ix()].line;
            if let Some(kind) = FaultKind::of_event(event.kind) {
                put(&mut faults, kind, Some(line));
            }
        }
    }
    for said in &run.diagnostics {
        match (said.code, said.line) {
            ("engage::untouched" | "engage::misses", line) => put(&mut faults, FaultKind::NoMeeting, line),
            ("force::no-loads", line) => put(&mut faults, FaultKind::NoLoads, line),
            // Events of the simulation are taken from the map.
            (code, line) if said.severity == Severity::Error && !code.starts_with("engage::") => {
                put(&mut faults, FaultKind::Program, line);
                if let Some(fault) = faults.iter_mut().find(|fault| fault.kind == FaultKind::Program) {
                    fault.text =
                        if fault.text.is_empty() { said.text.clone() } else { std::mem::take(&mut fault.text) };
                }
            }
            _ => {}
        }
    }
    for fault in &mut faults {
        fault.lines.sort_unstable();
        fault.lines.dedup();
        fault.text = match fault.kind {
            FaultKind::NoMeeting => "stock and program do not meet: nothing is raised, nothing is written".into(),
            FaultKind::Program => format!("{}, {}", fault.text, named(&fault.lines)),
            kind => format!("{}, {}", happens(kind), named(&fault.lines)),
        };
    }
    faults
}

fn put(faults: &mut Vec<Fault>, kind: FaultKind, line: Option<u32>) {
    match faults.iter_mut().find(|fault| fault.kind == kind) {
        Some(fault) => fault.lines.extend(line),
        None => faults.push(Fault {
            kind,
            text: String::new(),
            lines: line.into_iter().collect(),
            length_mm: 0.0,
            worst: None,
        }),
    }
}

fn happens(kind: FaultKind) -> &'static str {
    match kind {
        FaultKind::CutAtRapid => "collision: the cutter removes material at rapid",
        FaultKind::Fixture => "collision: the tool touches a fixture",
        FaultKind::Holder => "collision: the holder meets stock",
        FaultKind::Shank => "collision: the shank meets stock",
        FaultKind::SpindleStopped => "the tool cuts while the spindle stands still",
        _ => "no loads can be predicted for a tool that cuts",
    }
}

/// Faults of a program that was rewritten.
fn of_written(run: &ProgramRun, written: &Written, over: &Over) -> Vec<Fault> {
    let inch = run.toolpath.inch;
    let beyond = |found: &Beyond| beyond(found, inch);
    let mut faults: Vec<Fault> =
        over.beyond.iter().filter(|b| b.fixed != Some(FixedFeed::Infeasible)).map(beyond).collect();
    faults.extend(infeasible(run, over));
    let plain = |kind, text: String| Fault { kind, text, lines: Vec::new(), length_mm: 0.0, worst: None };
    if !written.check.identical {
        faults.push(plain(FaultKind::MoreThanFeeds, "more than feeds differs in the rewritten program".into()));
    }
    if let Some(ratio) = written.check.force_rate_ratio.filter(|ratio| *ratio > LIMIT_TOLERANCE) {
        let text = format!("the force changes at {ratio:.3} of limits.force_rate, frozen and kept blocks left out");
        faults.push(plain(FaultKind::ForceRate, text));
    }
    faults
}

fn beyond(found: &Beyond, inch: bool) -> Fault {
    let (kind, why) = match found.fixed {
        None => (FaultKind::Beyond, "in the written program"),
        Some(FixedFeed::Kept) => (FaultKind::Kept, "where the rewriting had to keep the programmed feed"),
        Some(_) => (FaultKind::Frozen, "where text or setup keep the programmed feed"),
    };
    let worst = &found.worst;
    let text = format!(
        "{} of T{} is {:.3} of its limit {why}, {}, {}",
        plain(worst.limit.kind),
        worst.place.tool,
        worst.ratio(),
        named(&found.lines),
        length(found.length_mm, inch)
    );
    Fault { kind, text, lines: found.lines.clone(), length_mm: found.length_mm, worst: Some(*worst) }
}

/// Limits that cannot be met even at the lowest feed allowed.
fn infeasible(run: &ProgramRun, over: &Over) -> Option<Fault> {
    let places = run.infeasible();
    let first = places.first()?;
    let mut lines: Vec<u32> = places.iter().map(|place| place.line).collect();
    lines.sort_unstable();
    lines.dedup();
    let length_mm = places.iter().map(|place| place.length_mm).sum();
    let worst = over.beyond.iter().find(|b| b.fixed == Some(FixedFeed::Infeasible)).map(|b| b.worst);
    let share = run.infeasible_share();
    let load = worst.map_or_else(
        || plain(first.limit).to_owned(),
        |worst| format!("{} of T{} is {:.3} of its limit", plain(worst.limit.kind), worst.place.tool, worst.ratio()),
    );
    let (kind, text) = if share > HOPELESS {
        let text = format!(
            "Limits cannot be met on {:.0} % of the cutting length, even at the lowest feed allowed: they are probably wrong \
             ({load})",
            100.0 * share
        );
        (FaultKind::Hopeless, text)
    } else {
        let at = named(&lines);
        let met = if worst.is_some() { "" } else { " cannot be met" };
        (
            FaultKind::Infeasible,
            format!("{load}{met} even at the lowest feed allowed, {at}, {}", length(length_mm, run.toolpath.inch)),
        )
    };
    Some(Fault { kind, text, lines, length_mm, worst })
}

/// "line 12", "lines 12, 14", "7 lines from 12, 14, 20, 31".
fn named(lines: &[u32]) -> String {
    let shown: Vec<String> = lines.iter().take(NAMED).map(ToString::to_string).collect();
    match lines.len() {
        0 => "everywhere".into(),
        1 => format!("line {}", shown[0]),
        count if count <= NAMED => format!("lines {}", shown.join(", ")),
        count => format!("{count} lines ({}, …)", shown.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_named_up_to_a_few() {
        assert_eq!(named(&[12]), "line 12");
        assert_eq!(named(&[1, 2, 3, 4]), "lines 1, 2, 3, 4");
        assert_eq!(named(&[1, 2, 3, 4, 9]), "5 lines (1, 2, 3, 4, …)");
    }
}
