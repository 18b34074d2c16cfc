//! The numbers of the report. In: a run. Out: per limit the largest loads before and after and how constant they are; per tool time, length and
//! largest loads; binding limits with their prices.

use super::bounds::{self, Share};
use super::verdict::Verdict;
use crate::engage::Station;
use crate::force::Loads;
use crate::machine::{LimitKind, Limits};
use crate::nc::MoveKind;
use crate::outcome::ProgramRun;
use crate::outcome::over_limits::{FixedFeed, LoadLimit, Over, Place, load_limits as limits_in_force, p99};
use crate::outcome::station_loads::{StationLoads, each_station};
use crate::schedule::rules::{Rules, rules};

/// One limit, for one tool where it is a load.
#[derive(Debug, Clone)]
pub struct LimitFigure {
    /// Which.
    pub kind: LimitKind,
    /// Its value in the unit of [`LimitKind::unit`]; `None` where it is not one number.
    pub limit: Option<f64>,
    /// The tool it holds for; `None`: all.
    pub tool: Option<u32>,
    /// It is the spindle's own curve; `limit` is its value at the speed where most of it is used.
    pub of_spindle: bool,
    /// Largest load as programmed.
    pub before_max: Option<f64>,
    /// Largest load as written, of everything that cuts: frozen, kept and infeasible blocks included.
    pub after_max: Option<f64>,
    /// Both over the limit.
    pub ratios: [Option<f64>; 2],
    /// Where the largest load as written is, and why its feed was not free to be chosen if it was not.
    pub at: Option<Place>,
    /// The load that 99 % of the cut length stays below, as written.
    pub after_p99: Option<f64>,
    /// Share of the time in which it holds the feed down, %.
    pub active_time_percent: f64,
    /// Seconds saved per unit more of it.
    pub shadow_price: Option<f64>,
    /// Share of the cut length within 5 % of the limit.
    pub within_5_percent: f64,
    /// Share of the cut length within 10 % of the limit.
    pub within_10_percent: f64,
}

/// Totals of one tool.
#[derive(Debug, Clone)]
pub struct ToolFigure {
    /// Number.
    pub number: u32,
    /// Largest power as written, W.
    pub power_max_w: f64,
    /// Power limit in force, or what 95 % of its cut length stays below as programmed, W.
    pub power_ref_w: f64,
    /// Largest resultant as written, N.
    pub force_peak_n: f64,
    /// Largest bending stress as written, MPa, and the line where it is.
    pub bending: (f64, u32),
    /// Time in cuts as written, s.
    pub cut_time_s: f64,
    /// Length of its cuts, mm.
    pub cut_length_mm: f64,
}

/// All numbers.
#[derive(Debug, Clone)]
pub struct Figures {
    /// Limits, loads first, in the order of [`LimitKind::ALL`].
    pub limits: Vec<LimitFigure>,
    /// Tools, by number.
    pub tools: Vec<ToolFigure>,
    /// Length over commanded feed, rapids at rapid, dwells, s.
    pub programmed_s: f64,
    /// What bounds the feed: shares of the cutting time that add to 100 %; empty for a simulation.
    pub bounds: Vec<Share>,
    /// The verdict.
    pub verdict: Verdict,
}

impl Figures {
    /// Tools that are bent beyond what their material allows: line and sentence.
    pub fn overbent(&self, run: &ProgramRun) -> Vec<(u32, String)> {
        let beyond = |tool: &ToolFigure| {
            let allowable_mpa = run.job.tool(tool.number)?.allowable_stress_mpa?;
            let (stress_mpa, line) = tool.bending;
            let text = format!(
                "T{} is bent to {stress_mpa:.0} MPa here, its material allows {allowable_mpa:.0}: set limits.bending_stress, or a \
                 shorter overhang",
                tool.number
            );
            (stress_mpa > allowable_mpa).then_some((line, text))
        };
        self.tools.iter().filter_map(beyond).collect()
    }
}

/// The numbers of a run.
pub fn figures(run: &ProgramRun) -> Figures {
    let rules = rules(&run.toolpath, &run.map, &run.job);
    let mut tallies = Tallies::default();
    let apart = run.fixed_feeds();
    each_station(run, &mut |found| tallies.add(run, &rules, &apart, found));
    let over = match &run.written {
        Some(written) => written.check.over.clone(),
        None => Over { p99_ratio: p99(tallies.ratios), ..tallies.over },
    };
    let mut limits: Vec<LimitFigure> = tallies.limits.into_iter().map(|tally| tally.figure(&over)).collect();
    share_active_time(run, &mut limits);
    limits.sort_by_key(|figure| (figure.kind, figure.tool, figure.of_spindle));
    let mut tools: Vec<ToolFigure> = tallies.tools.into_iter().map(|tally| tally.figure(run)).collect();
    tools.sort_by_key(|tool| tool.number);
    let bounds = run.written.as_ref().map(bounds::shares).unwrap_or_default();
    Figures { limits, tools, programmed_s: programmed_s(run), bounds, verdict: Verdict::new(run, over) }
}

/// Quantities with a weight each: a weighted quantile is asked of them at the end.
#[derive(Debug, Default)]
struct Weighted(Vec<(f32, f32)>);

impl Weighted {
    fn push(&mut self, value: f64, weight: f64) {
        self.0.push((value as f32, weight as f32));
    }
    /// The least value that at least `share` of the weight does not exceed.
    fn quantile(&mut self, share: f64) -> Option<f64> {
        self.0.sort_by(|a, b| a.0.total_cmp(&b.0));
        let all: f64 = self.0.iter().map(|(_, weight)| f64::from(*weight)).sum();
        let mut below = 0.0;
        let found = self.0.iter().find(|(_, weight)| {
            below += f64::from(*weight);
            below >= share * all
        });
        found.map(|(value, _)| f64::from(*value))
    }
}

#[derive(Debug)]
struct LimitTally {
    limit: LoadLimit,
    tool: u32,
    before_max: f64,
    after_max: f64,
    ratios: [f64; 2],
    after: Weighted,
    length: f64,
    within_5: f64,
    within_10: f64,
}

impl LimitTally {
    fn add(&mut self, found: &StationLoads, limit: f64) {
        let length = found.station.length_mm();
        let kind = self.limit.kind;
        let (before, after) = (bounded(&found.before, kind), bounded(&found.after, kind));
        self.before_max = self.before_max.max(before);
        self.after_max = self.after_max.max(after);
        if after / limit > self.ratios[1] {
            self.limit.limit = limit;
        }
        self.ratios = [self.ratios[0].max(before / limit), self.ratios[1].max(after / limit)];
        self.after.push(after, length);
        self.length += length;
        let off = (after / limit - 1.0).abs();
        self.within_5 += if off <= 0.05 { length } else { 0.0 };
        self.within_10 += if off <= 0.10 { length } else { 0.0 };
    }
    /// The row; the largest load as written is that of the written file.
    fn figure(mut self, over: &Over) -> LimitFigure {
        let kind = self.limit.kind;
        let shown = |value| kind.in_report_unit(value);
        let share = |part: f64| if self.length > 0.0 { part / self.length } else { 0.0 };
        let worst = over.worst.iter().find(|worst| {
            let (a, b) = (&worst.limit, &self.limit);
            let same = (a.kind, a.of_spindle, worst.place.tool) == (b.kind, b.of_spindle, self.tool);
            same && (a.of_spindle || a.limit == b.limit)
        });
        let (limit, after_max, ratio) = worst.map_or((self.limit.limit, self.after_max, self.ratios[1]), |worst| {
            (worst.limit.limit, worst.value, worst.ratio())
        });
        LimitFigure {
            kind,
            limit: Some(shown(limit)),
            tool: Some(self.tool),
            of_spindle: self.limit.of_spindle,
            before_max: Some(shown(self.before_max)),
            after_max: Some(shown(after_max)),
            ratios: [Some(self.ratios[0]), Some(ratio)],
            at: worst.map(|worst| worst.place),
            within_5_percent: share(self.within_5),
            within_10_percent: share(self.within_10),
            // Stations of the program and of the written file lie differently: never more than the largest.
            after_p99: self.after.quantile(0.99).map(|value| shown(value.min(after_max))),
            active_time_percent: 0.0,
            shadow_price: None,
        }
    }
}

fn bounded(loads: &Loads, kind: LimitKind) -> f64 {
    loads.bounded_by(kind).unwrap_or(0.0)
}

#[derive(Debug)]
struct ToolTally {
    number: u32,
    power_max_w: f64,
    power_before: Weighted,
    force_peak_n: f64,
    bending: (f64, u32),
    cut_time_s: f64,
    cut_length_mm: f64,
}

impl ToolTally {
    fn add(&mut self, found: &StationLoads, line: u32) {
        if found.after.bending_stress_mpa > self.bending.0 {
            self.bending = (found.after.bending_stress_mpa, line);
        }
        let length = found.station.length_mm();
        self.power_max_w = self.power_max_w.max(found.after.power_w);
        self.force_peak_n = self.force_peak_n.max(found.after.force_xy_peak_n);
        self.power_before.push(found.before.power_w, length);
        self.cut_time_s += length / found.feed_after_mm_s.max(f64::MIN_POSITIVE);
        self.cut_length_mm += length;
    }
    fn figure(mut self, run: &ProgramRun) -> ToolFigure {
        let limits = limits_of_tool(run, self.number);
        ToolFigure {
            number: self.number,
            power_max_w: self.power_max_w,
            power_ref_w: limits.power_w.or_else(|| self.power_before.quantile(0.95)).unwrap_or(0.0),
            force_peak_n: self.force_peak_n,
            bending: self.bending,
            cut_time_s: self.cut_time_s,
            cut_length_mm: self.cut_length_mm,
        }
    }
}

fn limits_of_tool(run: &ProgramRun, number: u32) -> Limits {
    run.job.tool(number).map_or(run.job.limits, |tool| run.job.limits.overridden_by(&tool.limits))
}

#[derive(Debug, Default)]
struct Tallies {
    limits: Vec<LimitTally>,
    tools: Vec<ToolTally>,
    /// As programmed, with the ratio and length of each station; filled where nothing is written.
    over: Over,
    ratios: Vec<(f64, f64)>,
}

impl Tallies {
    fn add(&mut self, run: &ProgramRun, rules: &Rules, apart: &[Option<FixedFeed>], found: &StationLoads) {
        if found.station.arc_count == 0 {
            return;
        }
        let motion = &run.toolpath.moves[found.station.move_id.ix()];
        let number = motion.tool;
        let limits = || limits_in_force(&rules.of(found.station.move_id).loads, &run.job, motion.spin.rps);
        for limit in limits() {
            self.limit(limit, number).add(found, limit.limit);
        }
        if run.written.is_none() {
            let length_mm = found.station.length_mm();
            let apart = node_at(run, found.station).and_then(|node| apart[node]);
            let place = Place { line: motion.line, tool: number, length_mm, fixed: apart };
            let ratio = self.over.add(&place, limits().map(|limit| (limit, bounded(&found.before, limit.kind))));
            self.ratios.push((ratio, length_mm));
        }
        self.tool(number).add(found, motion.line);
    }
    fn limit(&mut self, limit: LoadLimit, tool: u32) -> &mut LimitTally {
        let known = self.limits.iter().position(|known| {
            let (a, b) = (&known.limit, &limit);
            known.tool == tool
                && (a.kind, a.of_spindle) == (b.kind, b.of_spindle)
                && (a.of_spindle || a.limit == b.limit)
        });
        let at = known.unwrap_or_else(|| {
            let zero = 0.0;
            self.limits.push(LimitTally {
                limit,
                tool,
                before_max: zero,
                after_max: zero,
                ratios: [zero; 2],
                after: Weighted::default(),
                length: zero,
                within_5: zero,
                within_10: zero,
            });
            self.limits.len() - 1
        });
        &mut self.limits[at]
    }
    fn tool(&mut self, number: u32) -> &mut ToolTally {
        let known = self.tools.iter().position(|t| t.number == number);
        let at = known.unwrap_or_else(|| {
            self.tools.push(ToolTally {
                number,
                power_max_w: 0.0,
                power_before: Weighted::default(),
                force_peak_n: 0.0,
                bending: (0.0, 0),
                cut_time_s: 0.0,
                cut_length_mm: 0.0,
            });
            self.tools.len() - 1
        });
        &mut self.tools[at]
    }
}

/// Active time and price of every limit; limits on motion get rows of their own.
fn share_active_time(run: &ProgramRun, limits: &mut Vec<LimitFigure>) {
    let Some(written) = &run.written else { return };
    let schedule = &written.schedule;
    let whole: f64 = schedule.active_s.iter().map(|(_, s)| s).sum();
    for &(kind, seconds) in &schedule.active_s {
        let percent = if whole > 0.0 { 100.0 * seconds / whole } else { 0.0 };
        if !limits.iter().any(|figure| figure.kind == kind) {
            limits.push(motion_row(run, kind));
        }
        let length: Vec<f64> = tool_lengths(run, limits, kind);
        let all: f64 = length.iter().sum();
        let binding: Vec<bool> = (0..limits.len()).map(|row| binds(limits, row)).collect();
        let rows = limits.iter_mut().zip(binding).filter(|(figure, _)| figure.kind == kind);
        for ((figure, is_binding), own) in rows.zip(length) {
            figure.active_time_percent = if all > 0.0 { percent * own / all } else { percent };
            let of_row = |tool: u32| figure.tool.is_none_or(|own| own == tool) && is_binding;
            let prices = schedule.shadow_prices.iter().filter(|price| price.kind == kind && of_row(price.tool));
            figure.shadow_price = prices.map(|price| price.per_unit_s).reduce(|a, b| a + b);
        }
    }
}

/// Of the limits of one kind on one tool, which are that of the setup and what its spindle has, the lower one binds.
fn binds(limits: &[LimitFigure], row: usize) -> bool {
    let value = |figure: &LimitFigure| figure.limit.unwrap_or(f64::INFINITY);
    let own = &limits[row];
    let lower = |other: &LimitFigure| (other.kind, other.tool) == (own.kind, own.tool) && value(other) < value(own);
    !limits.iter().any(lower)
}

/// Index of the node of a station.
pub(super) fn node_at(run: &ProgramRun, station: &Station) -> Option<usize> {
    let range = run.problem.of_move.get(station.move_id.ix())?;
    let nodes = &run.problem.nodes[range.start as usize..range.end as usize];
    let middle = 0.5 * (station.from_mm + station.to_mm);
    let at = nodes.partition_point(|node| node.to_mm < middle);
    (at < nodes.len()).then_some(range.start as usize + at)
}

/// Time at the commanded feed of the pieces that a limit holds, for each row of that limit.
fn tool_lengths(run: &ProgramRun, limits: &[LimitFigure], kind: LimitKind) -> Vec<f64> {
    let of_kind = (0..limits.len()).filter(|row| limits[*row].kind == kind);
    let rows: Vec<Option<u32>> = of_kind.map(|row| limits[row].tool.filter(|_| binds(limits, row))).collect();
    let mut times = vec![0.0; rows.len()];
    if rows.len() < 2 {
        return times;
    }
    let Some(written) = &run.written else { return times };
    for piece in written.schedule.pieces.iter().filter(|piece| piece.limit == kind) {
        let tool = run.toolpath.moves[piece.move_id.ix()].tool;
        if let Some(row) = rows.iter().position(|row| *row == Some(tool)) {
            times[row] += (piece.to_mm - piece.from_mm) / piece.feed_mm_s.max(f64::MIN_POSITIVE);
        }
    }
    times
}

fn motion_row(run: &ProgramRun, kind: LimitKind) -> LimitFigure {
    let machine = &run.job.machine;
    let limits = &run.job.limits;
    let least = |value: fn(&crate::machine::Axis) -> f64| machine.axes.iter().map(value).fold(f64::INFINITY, f64::min);
    let value = match kind {
        LimitKind::Velocity => Some(least(|axis| axis.velocity_mm_s)),
        LimitKind::Acceleration => Some(least(|axis| axis.acceleration_mm_s2)),
        LimitKind::Jerk => Some(least(|axis| axis.jerk_mm_s3.unwrap_or(f64::INFINITY))).filter(|jerk| jerk.is_finite()),
        LimitKind::Corner => Some(machine.corner_tolerance_mm),
        LimitKind::BlockTime => Some(machine.block_time_s),
        LimitKind::AirFeed => run.job.air_feed.map(|air| air.feed_mm_s),
        _ => limits.value(kind),
    };
    LimitFigure {
        kind,
        limit: value.map(|value| kind.in_report_unit(value)),
        tool: None,
        of_spindle: false,
        before_max: None,
        after_max: None,
        ratios: [None; 2],
        at: None,
        after_p99: None,
        active_time_percent: 0.0,
        shadow_price: None,
        within_5_percent: 0.0,
        within_10_percent: 0.0,
    }
}

fn programmed_s(run: &ProgramRun) -> f64 {
    let rapid = run.job.machine.rapid_mm_s;
    let moves = run.toolpath.moves.iter().map(|motion| {
        let speed = if motion.kind == MoveKind::Rapid { rapid } else { motion.feed.mm_s };
        if speed > 0.0 { motion.curve().length() / speed } else { 0.0 }
    });
    let dwells = run.toolpath.events().map(|event| match event {
        crate::nc::Event::Dwell { seconds, .. } => seconds,
        _ => 0.0,
    });
    moves.sum::<f64>() + dwells.sum::<f64>()
}
