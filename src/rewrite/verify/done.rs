//! What the control does in the lines of a program. In: its toolpaths, one for each position of the block-delete switches. Out: [`Done`].

use crate::ids::BlockId;
use crate::nc::{FeedMode, Freeze, Move, MoveKind, Toolpath};
use crate::path::Curve;

/// What the control does in each line of a program.
#[derive(Debug, Default)]
pub struct Done {
    /// Comes to it.
    reached: Vec<bool>,
    /// Moves in it.
    moves: Vec<bool>,
    /// Moves in it under radius compensation.
    compensated: Vec<bool>,
    /// Moves at a feed in it that may be another.
    feeds: Vec<bool>,
    /// Moves at a feed in it, whatever that belongs to.
    fed: Vec<bool>,
    /// The letters of a centre that its arcs have, by their plane.
    pub centres: Vec<Option<[u8; 2]>>,
    /// Feeds that are not per minute, anywhere.
    pub other_units: bool,
    /// The program is in inches.
    pub inch: bool,
}

impl Done {
    /// Nothing yet, for a program of so many lines.
    pub fn new(lines: usize) -> Self {
        let none = || vec![false; lines];
        Self {
            reached: none(),
            moves: none(),
            compensated: none(),
            feeds: none(),
            fed: none(),
            centres: vec![None; lines],
            other_units: false,
            inch: false,
        }
    }
    /// Adds what is done in one position of the block-delete switch.
    pub fn add(&mut self, toolpath: &Toolpath) {
        for (line, reached) in self.reached.iter_mut().enumerate() {
            *reached |= toolpath.reached.holds(BlockId(line as u32));
        }
        for motion in &toolpath.moves {
            if let Some(moves) = self.moves.get_mut(motion.block.ix()) {
                *moves = true;
            }
            if let Some(compensated) = self.compensated.get_mut(motion.block.ix()) {
                *compensated |= motion.compensated;
            }
            if let Some(fed) = self.fed.get_mut(motion.block.ix()) {
                *fed |= motion.kind == MoveKind::Feed;
            }
            if let (Curve::Arc(arc), Some(centre)) = (motion.curve(), self.centres.get_mut(motion.block.ix())) {
                let (first, second, _) = arc.plane.axes();
                *centre = Some([first, second].map(|axis| b"IJK"[axis]));
            }
        }
        self.inch |= toolpath.inch;
        let other_unit = |motion: &Move| motion.kind == MoveKind::Feed && motion.feed.mode != FeedMode::PerMinute;
        self.other_units |= toolpath.moves.iter().any(other_unit);
        // A move made by another file stands at the line of its call.
        let own = |motion: &&Move| {
            let others = [Freeze::OtherFile, Freeze::Synchronised, Freeze::Probe, Freeze::NotUnderstood, Freeze::Cycle];
            let others = others.map(Some);
            motion.kind == MoveKind::Feed && !others.contains(&motion.freeze)
        };
        for motion in toolpath.moves.iter().filter(own) {
            if let Some(feeds) = self.feeds.get_mut(motion.block.ix()) {
                *feeds = true;
            }
        }
    }
    /// Lines that move the tool, that are executed otherwise, and that are never reached.
    pub fn lines(&self) -> [usize; 3] {
        let mut found = [0; 3];
        for (reached, moves) in self.reached.iter().zip(&self.moves) {
            found[if *moves {
                0
            } else if *reached {
                1
            } else {
                2
            }] += 1;
        }
        found
    }
    /// Does the control come to this line?
    pub fn reaches(&self, line: usize) -> bool {
        self.reached.get(line) == Some(&true)
    }
    /// Does the control move in this line?
    pub fn moves(&self, line: usize) -> bool {
        self.moves.get(line) == Some(&true)
    }
    /// Does it under radius compensation?
    pub fn compensated(&self, line: usize) -> bool {
        self.compensated.get(line) == Some(&true)
    }
    /// Does it move at a feed in this line, whatever that belongs to?
    pub fn fed(&self, line: usize) -> bool {
        self.fed.get(line) == Some(&true)
    }
    /// Does it move in this line at a feed that may be another?
    pub fn feeds(&self, line: usize) -> bool {
        self.feeds.get(line) == Some(&true)
    }
}
