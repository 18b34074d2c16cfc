//! Loads against their limits, of everything that cuts. In: for each station the loads, the limits in force, and whether the feed could be
//! chosen. Out: [`Over`]: the largest of each load of each tool with its line, and the places above a limit.
//!
//! No place is left out: one whose feed is frozen, kept or infeasible counts like any other and is marked by [`FixedFeed`].

use crate::machine::{Job, LimitKind};
use crate::nc::Move;
use crate::schedule::Node;

/// Ratio of load to limit up to which the limit counts as met in the written file: predictions at two spacings of the simulation differ by
/// about a percent.
pub const LIMIT_TOLERANCE: f64 = 1.01;

/// Why the feed of a place could not be chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FixedFeed {
    /// A limit is exceeded even at the lowest feed allowed.
    Infeasible,
    /// The program text or the setup does not let the programmed feed change.
    Frozen,
    /// No other feed could be written here.
    Kept,
}

impl FixedFeed {
    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            FixedFeed::Infeasible => "infeasible",
            FixedFeed::Frozen => "frozen",
            FixedFeed::Kept => "kept",
        }
    }

    /// The same in the words of the shop.
    pub fn plain(self) -> &'static str {
        match self {
            FixedFeed::Infeasible => "too heavy at the lowest feed allowed",
            FixedFeed::Frozen => "its feed is not to be changed",
            FixedFeed::Kept => "its feed could not be rewritten",
        }
    }

    /// Of a stretch of a move: `nodes` are those on it, `kept` says whether the rewriting kept its block.
    pub fn of<'a>(motion: &Move, mut nodes: impl Iterator<Item = &'a Node>, kept: bool) -> Option<Self> {
        let held = nodes.try_fold(false, |held, node| (node.infeasible.is_none()).then_some(held || !node.free));
        match held {
            None => Some(FixedFeed::Infeasible),
            Some(held) if held || motion.freeze.is_some() => Some(FixedFeed::Frozen),
            Some(_) => kept.then_some(FixedFeed::Kept),
        }
    }
}

/// A bound on a load that is in force at a station.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadLimit {
    /// The load.
    pub kind: LimitKind,
    /// In the unit of [`crate::machine::Limits`].
    pub limit: f64,
    /// It is the spindle's curve at this speed, not a number of the setup.
    pub of_spindle: bool,
}

/// Limits on loads that are in force, those of the spindle's curves at `rps` included.
pub fn load_limits<'a>(rule: &'a [(LimitKind, f64)], job: &Job, rps: f64) -> impl Iterator<Item = LoadLimit> + 'a {
    let spindle = &job.machine.spindle;
    let power = spindle.power_w.as_ref().map(|table| (LimitKind::Power, table.at(rps)));
    let torque = spindle.torque_nmm.as_ref().map(|table| (LimitKind::Torque, table.at(rps)));
    let of_spindle = |of_spindle| move |(kind, limit)| LoadLimit { kind, limit, of_spindle };
    rule.iter().copied().map(of_spindle(false)).chain(power.into_iter().chain(torque).map(of_spindle(true)))
}

/// A stretch of the path that cuts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Line of the original.
    pub line: u32,
    /// Tool number.
    pub tool: u32,
    /// Its length, mm.
    pub length_mm: f64,
    /// Why its feed was not free to be chosen; `None`: it was.
    pub fixed: Option<FixedFeed>,
}

/// The largest load under one limit, as a share of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Worst {
    /// The limit.
    pub limit: LoadLimit,
    /// The load, in the unit of its limit.
    pub value: f64,
    /// Where.
    pub place: Place,
}

impl Worst {
    /// Load over limit.
    pub fn ratio(&self) -> f64 {
        self.value / self.limit.limit
    }
}

/// Places above a limit whose feed could not be chosen for one reason, or could be.
#[derive(Debug, Clone, PartialEq)]
pub struct Beyond {
    /// The reason; `None`: their feed was free to be chosen.
    pub fixed: Option<FixedFeed>,
    /// Their lines of the original, each once, in order of the cuts.
    pub lines: Vec<u32>,
    /// Their length, mm.
    pub length_mm: f64,
    /// The worst of them.
    pub worst: Worst,
}

/// Loads over limits of a whole program.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Over {
    /// The largest of each load of each tool under each of its limits.
    pub worst: Vec<Worst>,
    /// Places at which a load is more than [`LIMIT_TOLERANCE`] times its limit.
    pub beyond: Vec<Beyond>,
    /// Largest load over its limit where the feed was free to be chosen.
    pub free_ratio: f64,
    /// The ratio that 99 % of the cut length stays below, frozen, kept and infeasible places included.
    pub p99_ratio: f64,
}

impl Over {
    /// Enters a station: `loads` are its limits with the load under each. Returns its largest ratio.
    pub fn add(&mut self, place: &Place, loads: impl Iterator<Item = (LoadLimit, f64)>) -> f64 {
        let mut worst: Option<Worst> = None;
        for (limit, value) in loads {
            let found = Worst { limit, value, place: *place };
            self.raise(&found);
            if worst.is_none_or(|known| found.ratio() > known.ratio()) {
                worst = Some(found);
            }
        }
        let Some(worst) = worst else { return 0.0 };
        if place.fixed.is_none() {
            self.free_ratio = self.free_ratio.max(worst.ratio());
        }
        if worst.ratio() > LIMIT_TOLERANCE {
            let lines = vec![place.line];
            self.put_beyond(Beyond { fixed: place.fixed, lines, length_mm: place.length_mm, worst });
        }
        worst.ratio()
    }

    /// Takes in what was found further on.
    pub fn join(&mut self, later: Over) {
        later.worst.iter().for_each(|worst| self.raise(worst));
        later.beyond.into_iter().for_each(|beyond| self.put_beyond(beyond));
        self.free_ratio = self.free_ratio.max(later.free_ratio);
        self.p99_ratio = self.p99_ratio.max(later.p99_ratio);
    }

    /// The largest load over its limit, of everything.
    pub fn largest(&self) -> Option<&Worst> {
        self.worst.iter().reduce(|most, worst| if worst.ratio() > most.ratio() { worst } else { most })
    }

    /// The same as a number; 0 where no load is limited.
    pub fn ratio(&self) -> f64 {
        self.largest().map_or(0.0, Worst::ratio)
    }

    fn raise(&mut self, found: &Worst) {
        // A curve has another value at each speed: one entry, at the speed where most of it is used.
        let same = |known: &&mut Worst| {
            let (a, b) = (&known.limit, &found.limit);
            let value = a.of_spindle || a.limit == b.limit;
            known.place.tool == found.place.tool && a.kind == b.kind && a.of_spindle == b.of_spindle && value
        };
        match self.worst.iter_mut().find(same) {
            Some(known) if found.ratio() > known.ratio() => *known = *found,
            Some(_) => {}
            None => self.worst.push(*found),
        }
    }

    fn put_beyond(&mut self, found: Beyond) {
        let Some(known) = self.beyond.iter_mut().find(|known| known.fixed == found.fixed) else {
            self.beyond.push(found);
            return;
        };
        known.length_mm += found.length_mm;
        let skip = usize::from(known.lines.last() == found.lines.first());
        known.lines.extend(&found.lines[skip..]);
        if found.worst.ratio() > known.worst.ratio() {
            known.worst = found.worst;
        }
    }
}

/// The value that 99 % of the length stays below; of pairs of value and length.
pub fn p99(mut found: Vec<(f64, f64)>) -> f64 {
    use rayon::prelude::*;
    found.par_sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: f64 = found.iter().map(|(_, length)| length).sum();
    let mut below = 0.0;
    let at = found.iter().find(|(_, length)| {
        below += length;
        below >= 0.99 * all
    });
    at.map_or(0.0, |(value, _)| *value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(line: u32, fixed: Option<FixedFeed>) -> Place {
        Place { line, tool: 1, length_mm: 2.0, fixed }
    }

    fn force(limit: f64, value: f64) -> std::iter::Once<(LoadLimit, f64)> {
        std::iter::once((LoadLimit { kind: LimitKind::ForceXy, limit, of_spindle: false }, value))
    }

    #[test]
    fn what_is_apart_counts_and_is_told_apart() {
        let mut over = Over::default();
        over.add(&place(4, None), force(100.0, 100.9));
        assert!(over.beyond.is_empty(), "1.009 is met");
        over.add(&place(5, Some(FixedFeed::Frozen)), force(100.0, 220.0));
        over.add(&place(5, Some(FixedFeed::Frozen)), force(100.0, 120.0));
        over.add(&place(9, None), force(100.0, 101.1));
        assert_eq!((over.ratio(), over.free_ratio), (2.2, 1.011));
        let told: Vec<_> = over.beyond.iter().map(|b| (b.fixed, b.lines.clone(), b.length_mm)).collect();
        assert_eq!(told, [(Some(FixedFeed::Frozen), vec![5], 4.0), (None, vec![9], 2.0)]);
    }

    #[test]
    fn stretches_join_to_what_one_pass_gives() {
        let (mut whole, mut parts) = (Over::default(), [Over::default(), Over::default()]);
        for (index, (line, value)) in [(1, 150.0), (2, 90.0), (2, 170.0), (3, 160.0)].into_iter().enumerate() {
            whole.add(&place(line, None), force(100.0, value));
            parts[index / 2].add(&place(line, None), force(100.0, value));
        }
        let [mut first, second] = parts;
        first.join(second);
        assert_eq!(first, whole);
    }
}
