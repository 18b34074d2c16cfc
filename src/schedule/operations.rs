//! The operations of a program. In: where comments between cuts begin a new section of the text, toolpath, engagement, job.
//! Out: [`Segment`]s: cuts of one tool, under one comment, of one kind, of about one depth.
//!
//! Posts write the name of an operation as a comment before its first cut, so a segment ends at a tool change and at a comment between
//! cuts. Within such a section cuts downwards, finishing and roughing belong to separate segments, in whatever order they come. So do
//! depths: sorted by depth, a cut more than [`DEEPER`] times as deep as the one before begins another segment.

use super::kinds_of_cut::cuts;
use crate::engage::EngagementMap;
use crate::ids::MoveId;
use crate::machine::{Cut, CutKind, Job, Scope};
use crate::nc::{Move, Toolpath};

/// Axial depths that differ by more than this are those of two operations. Our judgement: the last level of a pocket and the
/// overlap of two levels lie within it, facing and slotting do not.
pub const DEEPER: f64 = 2.0;

/// A stretch of the text that a comment between cuts begins.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// Its first physical line, 1-based.
    pub first_line: u32,
    /// What the comment says; empty where there is none.
    pub name: String,
}

/// Cuts of one tool, under one comment, of one kind, of about one depth.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// Which cuts belong to it.
    pub scope: Scope,
    /// What the comment says; empty where there is none.
    pub name: String,
}

/// Cuts of one tool, in one section, of one kind.
struct Group {
    of: (u32, usize, CutKind),
    /// Axial depths, mm, each with the first move that cuts it.
    depths: Vec<(f64, MoveId)>,
}

/// The operation whose scope fits a cut best.
pub fn nearest<'a>(scopes: impl Iterator<Item = &'a Scope>, motion: &Move, cut: Cut) -> Option<usize> {
    let distances = scopes.enumerate().filter_map(|(index, scope)| {
        let (other, apart) = scope.distance(motion.tool, motion.line, cut)?;
        Some((index, other, apart))
    });
    let nearer = |a: &(usize, bool, f64), b: &(usize, bool, f64)| a.1.cmp(&b.1).then(a.2.total_cmp(&b.2));
    distances.min_by(nearer).map(|(index, ..)| index)
}

/// The segments in which anything is cut, in the order of their first cuts.
pub fn segments(sections: &[Section], toolpath: &Toolpath, map: &EngagementMap, job: &Job) -> Vec<Segment> {
    let cuts = cuts(toolpath, map, job);
    let mut groups: Vec<Group> = Vec::new();
    for (id, motion) in cutting(toolpath, map) {
        let Some(cut) = cuts[id.ix()] else { continue };
        let section = sections.partition_point(|section| section.first_line <= motion.line);
        let of = (motion.tool, section, cut.kind);
        match groups.iter_mut().rev().find(|group| group.of == of) {
            Some(group) if group.depths.last().is_some_and(|(depth_mm, _)| *depth_mm == cut.depth_mm) => {}
            Some(group) => group.depths.push((cut.depth_mm, id)),
            None => groups.push(Group { of, depths: vec![(cut.depth_mm, id)] }),
        }
    }
    let mut found: Vec<(MoveId, Segment)> = Vec::new();
    for Group { of: (tool, section, kind), mut depths } in groups {
        depths.sort_by(|a, b| a.0.total_cmp(&b.0));
        for alike in depths.chunk_by(|a, b| b.0 <= DEEPER * a.0) {
            let first = alike.iter().map(|(_, id)| *id).min().unwrap_or(MoveId(0));
            let depths_mm = [alike[0].0, alike[alike.len() - 1].0];
            let scope = Scope { tool, lines: lines(sections, section), kind: Some(kind), depths_mm };
            let name = section.checked_sub(1).map(|index| sections[index].name.clone()).unwrap_or_default();
            found.push((first, Segment { scope, name }));
        }
    }
    found.sort_by_key(|(first, _)| *first);
    found.into_iter().map(|(_, segment)| segment).collect()
}

/// First and last line of a section; 0 is the text before the first one.
fn lines(sections: &[Section], section: usize) -> (u32, u32) {
    let first = section.checked_sub(1).map_or(0, |index| sections[index].first_line);
    (first, sections.get(section).map_or(u32::MAX, |next| next.first_line - 1))
}

/// Everything that each tool cuts, by number.
pub fn whole_tools(toolpath: &Toolpath, map: &EngagementMap) -> Vec<Segment> {
    let mut tools: Vec<u32> = cutting(toolpath, map).map(|(_, motion)| motion.tool).collect();
    tools.sort_unstable();
    tools.dedup();
    let scope = |tool| Scope { tool, lines: (0, u32::MAX), kind: None, depths_mm: [0.0, f64::INFINITY] };
    tools.into_iter().map(|tool| Segment { scope: scope(tool), name: String::new() }).collect()
}

/// Does a move leave the final surface anywhere?
pub fn finishes(id: MoveId, map: &EngagementMap) -> bool {
    map.stations_of(id).iter().any(|station| station.flags.final_surface)
}

fn cutting<'a>(toolpath: &'a Toolpath, map: &'a EngagementMap) -> impl Iterator<Item = (MoveId, &'a Move)> {
    toolpath.iter_moves().filter(|(id, _)| map.stations_of(*id).iter().any(|station| station.arc_count > 0))
}
