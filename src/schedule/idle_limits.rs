//! Load limits far above every load. In: toolpath, engagement and rules. Out: for each rule of which no load limit is ever nearly
//! reached, the limit that a load comes nearest to.
//!
//! Such a limit says nothing about this job: 4500 N where 300 N occur is a default, a typing error or a wrong unit. It must not permit a
//! higher feed, because nothing but `feed_change` would then end the rise.

use super::cutters::{Cutters, skims};
use super::rules::{Rule, Rules};
use crate::engage::{EngagementMap, Station};
use crate::ids::MoveId;
use crate::machine::{LimitKind, Mode};
use crate::nc::{Move, Toolpath};
use rayon::prelude::*;

/// Share of a limit that some load must reach, at the highest feed allowed, for the limit to count. A tenth is our judgement, not a
/// measurement: a limit more than ten times above every load is wrong by an order of magnitude (300 N under a limit of 4500 N is 7 %);
/// a limit of which a cut reaches a quarter was chosen by somebody.
pub const ACTS_FROM: f64 = 0.1;

/// Share of a limit below which a load counts as 0: forces of opposite edges that cancel apart from rounding.
pub const CANCELLED: f64 = 1e-9;

/// The limit of a rule that comes nearest to being reached, and how near.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Idle {
    /// Which limit.
    pub kind: LimitKind,
    /// Its value, in the unit of [`crate::machine::Limits`].
    pub limit: f64,
    /// The largest load at the highest feeds allowed, in the same unit.
    pub load: f64,
    /// Where that load is met.
    pub move_id: MoveId,
}

/// By rule: the limit that comes nearest, where none acts; `None` where one does, or nothing is cut, or there is none.
pub fn idle(toolpath: &Toolpath, map: &EngagementMap, rules: &Rules, cutters: &Cutters) -> Vec<Option<Idle>> {
    let of_rule = |index: usize| {
        let rule = &rules.rules[index];
        let mine = |station: &&Station| rules.index_of(station.move_id) == index;
        let nearest = |station: &Station| nearest(toolpath, map, rule, cutters, station);
        if rule.loads.is_empty() || rule.mode != Mode::Optimise {
            return None;
        }
        let acts = |station: &Station| nearest(station).is_some_and(|idle| idle.share() >= ACTS_FROM);
        let stations = || map.stations.par_iter().filter(mine);
        if stations().any(acts) {
            return None;
        }
        let met: Vec<Idle> = stations().filter_map(nearest).collect();
        met.into_iter().reduce(|a, b| if b.share() > a.share() { b } else { a })
    };
    (0..rules.rules.len()).map(of_rule).collect()
}

impl Idle {
    fn share(&self) -> f64 {
        self.load / self.limit
    }
}

/// The limit that the loads of a station come nearest to at the highest feed allowed.
fn nearest(
    toolpath: &Toolpath,
    map: &EngagementMap,
    rule: &Rule,
    cutters: &Cutters,
    station: &Station,
) -> Option<Idle> {
    let motion: &Move = &toolpath.moves[station.move_id.ix()];
    if station.arc_count == 0 || skims(station) || motion.freeze.is_some() || motion.feed.mm_s <= 0.0 {
        return None;
    }
    let highest_mm_s = rule.highest_in_cut_mm_s(motion.feed.mm_s);
    let loads = cutters.of(station.move_id)?.loads(&cutters.cut(map, motion, station), highest_mm_s);
    let of = |&(kind, limit): &(LimitKind, f64)| {
        Some(Idle { kind, limit, load: loads.bounded_by(kind)?, move_id: station.move_id })
    };
    rule.loads.iter().filter_map(of).reduce(|a, b| if b.share() > a.share() { b } else { a })
}
