//! The operations of a program. In: where comments between cuts begin a new section of the text, toolpath, engagement. Out:
//! [`Segment`]s: cuts of one tool, under one comment, of one kind.
//!
//! Posts write the name of an operation as a comment before its first cut, and a tool does one thing at a time: a segment ends
//! at a tool change and at a comment that stands between cuts. Within a section the moves that leave the final surface
//! (finishing) are apart from those that do not (roughing), wherever they stand.

use crate::engage::EngagementMap;
use crate::ids::MoveId;
use crate::nc::{Move, Toolpath};

/// A stretch of the text that a comment between cuts begins.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// Its first physical line, 1-based.
    pub first_line: u32,
    /// What the comment says; empty where there is none.
    pub name: String,
}

/// Cuts of one tool, under one comment, of one kind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// Tool number.
    pub tool: u32,
    /// First and last physical line of its section.
    pub lines: (u32, u32),
    /// Only moves that leave the final surface, or only those that do not; `None`: both.
    pub finishing: Option<bool>,
    /// What the comment says; empty where there is none.
    pub name: String,
}

impl Segment {
    /// Does a move belong to it? `finishes`: it leaves the final surface.
    pub fn holds(&self, motion: &Move, finishes: bool) -> bool {
        let within = (self.lines.0..=self.lines.1).contains(&motion.line);
        self.tool == motion.tool && within && self.finishing.is_none_or(|finishing| finishing == finishes)
    }
}

/// Does a move leave the final surface anywhere?
pub fn finishes(id: MoveId, map: &EngagementMap) -> bool {
    map.stations_of(id).iter().any(|station| station.flags.final_surface)
}

/// The segments in which anything is cut, in the order of their first cuts.
pub fn segments(sections: &[Section], toolpath: &Toolpath, map: &EngagementMap) -> Vec<Segment> {
    let mut found: Vec<Segment> = Vec::new();
    for (id, motion) in cutting(toolpath, map) {
        let finishing = finishes(id, map);
        if found.iter().rev().any(|segment| segment.holds(motion, finishing)) {
            continue;
        }
        let after = sections.partition_point(|section| section.first_line <= motion.line);
        let begin = after.checked_sub(1).map(|index| &sections[index]);
        let lines = (
            begin.map_or(0, |section| section.first_line),
            sections.get(after).map_or(u32::MAX, |next| next.first_line - 1),
        );
        let name = begin.map(|section| section.name.clone()).unwrap_or_default();
        found.push(Segment { tool: motion.tool, lines, finishing: Some(finishing), name });
    }
    found
}

/// Everything that each tool cuts, by number.
pub fn whole_tools(toolpath: &Toolpath, map: &EngagementMap) -> Vec<Segment> {
    let mut tools: Vec<u32> = cutting(toolpath, map).map(|(_, motion)| motion.tool).collect();
    tools.sort_unstable();
    tools.dedup();
    let whole = |tool| Segment { tool, lines: (0, u32::MAX), finishing: None, name: String::new() };
    tools.into_iter().map(whole).collect()
}

fn cutting<'a>(toolpath: &'a Toolpath, map: &'a EngagementMap) -> impl Iterator<Item = (MoveId, &'a Move)> {
    toolpath.iter_moves().filter(|(id, _)| map.stations_of(*id).iter().any(|station| station.arc_count > 0))
}
