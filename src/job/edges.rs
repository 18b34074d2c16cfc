//! Wear of the edges before new feeds are known. In: a choice. Out: the history that caps are worked out with; and the type for the place from
//! which on a tool is too worn for any feed.

use crate::engage::EngagementMap;
use crate::machine::{Job, LimitKind};
use crate::nc::Toolpath;
use crate::schedule;
use crate::schedule::history::History;

/// The wear that caps are worked out with before new feeds are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EdgeWear {
    /// Worn as at the programmed feeds.
    AsProgrammed,
    /// Not worn: an upper bound of all caps.
    Unworn,
}

impl EdgeWear {
    /// The history of a program as it stands, with these edges.
    pub fn history(self, toolpath: &Toolpath, map: &EngagementMap, job: &Job) -> History {
        let history = History::of(toolpath, map, job, &schedule::as_programmed(toolpath));
        if self == EdgeWear::Unworn { history.unworn() } else { history }
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
