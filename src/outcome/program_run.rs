//! The result of a run as plain data. In: filled by [`crate::job`]. Out: [`ProgramRun`]: toolpath, engagement, caps, times and diagnostics of a
//! program, and of the rewritten program where there is one.

use super::answers::Answers;
use super::over_limits::{FixedFeed, Over};
use crate::diag::Diagnostic;
use crate::engage::EngagementMap;
use crate::ids::BlockId;
use crate::machine::{Job, LimitKind};
use crate::nc::{Program, Toolpath};
use crate::rewrite::Stats;
use crate::schedule::{FeedPiece, Node, Problem, Realised, Schedule};
use crate::setup::Assumption;

/// One program as it runs: as programmed and, where its feeds were optimised, as written.
#[derive(Debug)]
pub struct ProgramRun {
    /// The program as it was read.
    pub program: Program,
    /// Machine, tools, stock, limits.
    pub job: Job,
    /// Defaults in force.
    pub assumptions: Vec<Assumption>,
    /// What the program does.
    pub toolpath: Toolpath,
    /// What the cutter meets.
    pub map: EngagementMap,
    /// Caps and floors.
    pub problem: Problem,
    /// The same with the block-delete switch on, where blocks hang on it.
    pub switched: Option<Box<Switched>>,
    /// Feeds as programmed.
    pub before: Vec<FeedPiece>,
    /// Time as programmed.
    pub realised_before: Realised,
    /// What was said about the input and the cuts.
    pub diagnostics: Vec<Diagnostic>,
    /// The new feeds; `None` for a simulation.
    pub written: Option<Written>,
    /// What was asked besides.
    pub answers: Answers,
    /// Time of each stage, s: parse, simulate, schedule, rewrite, check.
    pub stage_s: [f64; 5],
}

/// The program with the block-delete switch on.
#[derive(Debug)]
pub struct Switched {
    /// What it does.
    pub toolpath: Toolpath,
    /// What the cutter meets.
    pub map: EngagementMap,
    /// Caps and floors.
    pub problem: Problem,
}

/// The rewritten program.
#[derive(Debug)]
pub struct Written {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// The files it calls, each with its name and its bytes, where they are written again.
    pub files: Vec<(String, Vec<u8>)>,
    /// Feeds it commands, on the moves of the original.
    pub after: Vec<FeedPiece>,
    /// Time it takes.
    pub realised_after: Realised,
    /// The answer it was written from.
    pub schedule: Schedule,
    /// F words and blocks.
    pub stats: Stats,
    /// Blocks that kept their feed although it might have changed, and why, in order.
    pub kept: Vec<(BlockId, String)>,
    /// What reading it back and simulating it again gave.
    pub check: Check,
}

impl Written {
    /// Time above that of the continuous optimum, %.
    pub fn loss_percent(&self) -> f64 {
        let best = self.schedule.continuous_s;
        if best > 0.0 { 100.0 * (self.realised_after.total_s / best - 1.0) } else { 0.0 }
    }

    /// Bytes of the program and of the files it calls.
    pub fn length(&self) -> usize {
        self.bytes.len() + self.files.iter().map(|(_, bytes)| bytes.len()).sum::<usize>()
    }
}

/// What reading the written program back gave.
#[derive(Debug, Clone, Default)]
pub struct Check {
    /// Only feeds, split points and our comments differ.
    pub identical: bool,
    /// What else differs, one sentence each.
    pub differences: Vec<String>,
    /// Loads over limits of everything that cuts, on commanded feeds, frozen, kept and infeasible places included.
    pub over: Over,
    /// Largest rate of change of force over its limit, on commanded feeds, frozen, kept and infeasible places left out; `None`
    /// where none is limited.
    pub force_rate_ratio: Option<f64>,
    /// Motions of the written program that were simulated again at the finer spacing: those cut in pieces and those near a limit. The
    /// others keep the stations of the first simulation.
    pub simulated_again: usize,
    /// How often caps were tightened after simulating again.
    pub rounds: usize,
    /// Spacing of the stations of what was simulated again, mm.
    pub spacing_mm: f64,
}

/// A place where a limit cannot be met.
#[derive(Debug, Clone, PartialEq)]
pub struct Infeasible {
    /// Line of the original.
    pub line: u32,
    /// The limit.
    pub limit: LimitKind,
    /// Length of the place, mm.
    pub length_mm: f64,
}

impl ProgramRun {
    /// Feeds after: those written, or the programmed ones.
    pub fn after(&self) -> &[FeedPiece] {
        self.written.as_ref().map_or(&self.before, |written| &written.after)
    }
    /// Time after: as written, or as programmed.
    pub fn realised_after(&self) -> &Realised {
        self.written.as_ref().map_or(&self.realised_before, |written| &written.realised_after)
    }
    /// Places where a limit cannot be met, one entry per line and limit.
    pub fn infeasible(&self) -> Vec<Infeasible> {
        let mut found: Vec<Infeasible> = Vec::new();
        for node in &self.problem.nodes {
            let Some(limit) = node.infeasible else { continue };
            let line = self.toolpath.moves[node.move_id.ix()].line;
            match found.iter_mut().rev().take(4).find(|known| known.line == line && known.limit == limit) {
                Some(known) => known.length_mm += node.length_mm(),
                None => found.push(Infeasible { line, limit, length_mm: node.length_mm() }),
            }
        }
        found
    }
    /// Why the feed of each node was not free to be chosen, by node.
    pub fn fixed_feeds(&self) -> Vec<Option<FixedFeed>> {
        let kept = |block: BlockId| {
            let known = self.written.as_ref().map_or(&[][..], |written| &written.kept);
            known.binary_search_by_key(&block, |(block, _)| *block).is_ok()
        };
        let of = |node: &Node| {
            let motion = &self.toolpath.moves[node.move_id.ix()];
            FixedFeed::of(motion, std::iter::once(node), kept(motion.block))
        };
        self.problem.nodes.iter().map(of).collect()
    }
    /// Share of the cutting length where a limit cannot be met.
    pub fn infeasible_share(&self) -> f64 {
        let cutting = self.problem.nodes.iter().filter(|node| node.cutting);
        let (all, bad) = cutting.fold((0.0, 0.0), |(all, bad), node| {
            let length = node.length_mm();
            (all + length, bad + if node.infeasible.is_some() { length } else { 0.0 })
        });
        if all > 0.0 { bad / all } else { 0.0 }
    }
    /// Lines whose feed was left alone, and why: frozen by what they are, or kept by the rewriting.
    pub fn frozen(&self) -> Vec<(u32, String)> {
        let mut frozen: Vec<(u32, String)> = Vec::new();
        for motion in &self.toolpath.moves {
            if let Some(why) = motion.freeze
                && frozen.last().is_none_or(|(line, _)| *line != motion.line)
            {
                frozen.push((motion.line, why.why().to_owned()));
            }
        }
        let kept = |(block, why): &(BlockId, String)| match self.program.place(*block) {
            (line, None) => (line, why.clone()),
            (line, Some(file)) => (line, format!("in {file}: {why}")),
        };
        frozen.extend(self.written.iter().flat_map(|written| written.kept.iter().map(kept)));
        frozen.sort();
        frozen.dedup_by_key(|(line, why)| (*line, why.starts_with("in ")));
        frozen
    }
}
