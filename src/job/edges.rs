//! How worn the cutting edges are taken to be when caps are worked out; and the place from which a tool is too worn for any feed.

use crate::engage::EngagementMap;
use crate::machine::{Job, LimitKind};
use crate::nc::Toolpath;
use crate::schedule;
use crate::schedule::history::History;

/// The wear that caps are worked out with before new feeds are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edges {
    /// Worn by the program as it stands.
    AsProgrammed,
    /// Not worn: no feeds leave higher caps.
    Unworn,
}

impl Edges {
    /// The history of a program as it stands, with these edges.
    pub fn history(self, toolpath: &Toolpath, map: &EngagementMap, job: &Job) -> History {
        let history = History::of(toolpath, map, job, &schedule::as_programmed(toolpath));
        if self == Edges::Unworn { history.unworn() } else { history }
    }
}

/// Where a tool is worn out: no feeds hold the limit from there on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WornOut {
    /// The tool.
    pub tool: u32,
    /// First line.
    pub line: u32,
    /// The limit.
    pub kind: LimitKind,
    /// What its teeth have slid by then, m.
    pub slid_m: f64,
}
