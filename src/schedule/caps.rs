//! Limits → feed caps. In: toolpath, engagement, job. Out: a [`Problem`]: for each piece of path the highest and the lowest
//! feed, and what they come from.
//!
//! A load limit overrules every minimum feed; the minimum is then listed as a conflict. A load limit that cannot be met at all, or only
//! at less than [`LEAST`] of the lowest feed asked for, makes the piece infeasible: it runs at that lowest feed.
//!
//! A feed may rise above the programmed one in a cut only where a load limit applies that some load comes near
//! ([`super::idle_limits`]), in air only where the engagement map says that the tool touches nothing, or right beside a cut whose entry may rise, up
//! to the cap of that cut, and nowhere that [`super::not_raised`] gives a reason against it. Where the setup asks for a confidence, caps leave a
//! margin for the uncertainty of the process model
//! ([`super::confidence`]).

use rayon::prelude::*;

use super::confidence::{Margin, doubt, places};
use super::cutters::{Cutters, SLIVER_MM, skims};
use super::history::{self, History};
use super::idle_limits::{self, CANCELLED, Idle};
use super::known_loads::KnownLoads;
use super::not_raised::{self, EarlierOutput, Reasons};
use super::problem::{Bound, Conflict, Node, NotRaised, Problem};
use super::realise::as_programmed;
use super::rules::{Rule, Rules, rules};
use super::{force_rate, ramps};
use crate::engage::{EngagementMap, Station};
use crate::force::{Cap, LoadLine};
use crate::ids::MoveId;
use crate::machine::limits::{FEED_CHANGE_MAX, FEED_CHANGE_MIN};
use crate::machine::{Job, LimitKind, Mode, Spindle};
use crate::nc::{Move, MoveKind, Toolpath};
use crate::units::{mm_s_from_mm_min, nm_from_nmm, nmm_from_nm};

/// Share of the lowest feed asked for below which a load limit counts as impossible to meet.
pub const LEAST: f64 = 0.1;

/// The bounds of a program whose tools wear and warm up as they do at the programmed feeds.
pub fn problem(toolpath: &Toolpath, map: &EngagementMap, job: &Job) -> Problem {
    problem_after(toolpath, map, job, &History::of(toolpath, map, job, &as_programmed(toolpath)), None)
}

/// The bounds of a program where each tool has cut `history` before it comes to a place. `standing`: if Feedwright rewrote the program
/// before, the feeds that stand in the file; `toolpath` then has the original feeds.
pub fn problem_after(
    toolpath: &Toolpath,
    map: &EngagementMap,
    job: &Job,
    history: &History,
    earlier: Option<EarlierOutput<'_>>,
) -> Problem {
    let rules = rules(toolpath, map, job);
    let cutters = Cutters::after(toolpath, map, job, history);
    let mut work: Vec<(MoveId, Option<&Station>)> = Vec::with_capacity(map.stations.len());
    let mut of_move = Vec::with_capacity(toolpath.moves.len());
    for index in 0..toolpath.moves.len() {
        let (id, start) = (MoveId(index as u32), work.len() as u32);
        let stations = map.stations_of(id);
        if stations.is_empty() {
            work.push((id, None));
        }
        work.extend(stations.iter().map(|station| (id, Some(station))));
        of_move.push(start..work.len() as u32);
    }
    let uncertainty = doubt(job, places(toolpath, map, job));
    let others: Vec<Cutters> = uncertainty.jobs.iter().map(|job| Cutters::after(toolpath, map, job, history)).collect();
    let reasons = Reasons::new(toolpath, map, job, &rules, &cutters);
    let idle = idle_limits::idle(toolpath, map, &rules, &cutters);
    let (cutters, deviations) = (&cutters, uncertainty.deviations);
    let context = Context { toolpath, map, job, rules: &rules, cutters, others, deviations, reasons, idle };
    let mut known = KnownLoads::with_room_for(rules.most_loads());
    known.make_room(work.len());
    let (each, past) = (known.each, history::is_asked_for(job));
    let room = known.feeds_mm_s.par_iter_mut().zip(known.loads.par_chunks_mut(each));
    let answered = work.par_iter().zip(room).map(|((id, station), (feed_mm_s, loads))| {
        let mut at_programmed = AtProgrammed { feed_mm_s, loads: if past { &mut [] } else { loads } };
        context.node(*id, *station, &mut at_programmed)
    });
    let answers: Vec<(Node, Option<(Bound, Bound)>)> = answered.collect();
    let known = known.keep_only(work.iter().map(|(_, station)| station.is_some()));
    let conflicts = answers
        .iter()
        .enumerate()
        .filter_map(|(node, (_, conflict))| conflict.map(|(floor, cap)| Conflict { node, floor, cap }))
        .collect();
    let nodes = answers.into_iter().map(|(node, _)| node).collect();
    let mut problem = Problem { nodes, of_move, conflicts, known };
    context.keep_force_rates(&mut problem, &work);
    approaches(&mut problem, &work, toolpath, &rules, job);
    let touches: Vec<bool> = work.iter().map(|(_, station)| not_raised::touches(*station)).collect();
    not_raised::entries(&mut problem, toolpath, job, &rules, &touches);
    if let Some(earlier) = earlier {
        not_raised::keep_earlier_ends(&mut problem, &earlier);
    }
    slivers(&mut problem);
    ramps::apply(&mut problem, toolpath, &rules, job);
    problem
}

/// Gives very short stretches of air (up to `SLIVER_MM`) the cap of the cut beside them, and very short approaches beside clear air the cap
/// of that air. Where exactly a cut or an approach begins is known no better than this; a feed that changed there would change at another
/// place whenever blocks are split.
fn slivers(problem: &mut Problem) {
    for range in &problem.of_move {
        let nodes = &mut problem.nodes[range.start as usize..range.end as usize];
        for i in 0..nodes.len() {
            if nodes[i].cutting || !nodes[i].free || nodes[i].length_mm() > SLIVER_MM {
                continue;
            }
            let beside = [i + 1, i.wrapping_sub(1)].into_iter().filter_map(|k| nodes.get(k));
            let cut = beside.clone().find(|node| node.cutting && node.free);
            let is_air = |node: &&Node| node.cap.kind == LimitKind::AirFeed && node.length_mm() > SLIVER_MM;
            let air = || beside.clone().find(is_air).filter(|_| nodes[i].not_raised.is_none());
            if let Some(node) = cut.or_else(air).copied() {
                nodes[i].cap = node.cap;
                nodes[i].floor = node.floor;
                nodes[i].not_raised = nodes[i].not_raised.or(node.not_raised);
            }
        }
    }
}

/// Lets air right beside a cut follow that cut, up to its cap, where the setup lets entries rise and knows the clamps, in a block that cannot be split.
/// A pass that begins and ends beside the stock, as every one in plain language is one block, would else keep its feed as a whole. Where the
/// stock may stand proud of its shape, the cut begins that much earlier, with the same engagement: its cap holds for that too. `work`: the
/// station of each node.
fn approaches(
    problem: &mut Problem,
    work: &[(MoveId, Option<&Station>)],
    toolpath: &Toolpath,
    rules: &Rules,
    job: &Job,
) {
    for (index, range) in problem.of_move.iter().enumerate() {
        let rule = rules.of(MoveId(index as u32));
        let can_be_split = job.output.split && toolpath.moves[index].splittable;
        if rule.raise.entries != Some(true) || can_be_split || !job.fixtures_are_known {
            continue;
        }
        let range = range.start as usize..range.end as usize;
        let (nodes, work) = (&mut problem.nodes[range.clone()], &work[range]);
        let rises = |node: &Node| node.free && node.not_raised.is_none() && !node.uncertain;
        let is_close = |k: usize, node: &Node| {
            let in_air = work[k].1.is_some_and(|station| !station.flags.clear_air);
            in_air && !node.cutting && rises(node) && node.cap.kind == LimitKind::Programmed
        };
        let mut k = 0;
        while k < nodes.len() {
            let end = (k..nodes.len()).find(|at| !is_close(*at, &nodes[*at])).unwrap_or(nodes.len());
            let beside = [k.checked_sub(1), (end < nodes.len()).then_some(end)];
            let cuts = beside.into_iter().flatten().map(|at| &nodes[at]).filter(|node| node.cutting);
            let all_rise = cuts.clone().all(rises);
            let lowest_cap = cuts.map(|node| node.cap.feed_mm_s).min_by(f64::total_cmp).filter(|_| all_rise);
            let highest = lowest_cap.unwrap_or(0.0).min(highest_feed(rule).feed_mm_s);
            for node in nodes[k..end].iter_mut().filter(|node| node.cap.feed_mm_s < highest) {
                node.cap = Bound { feed_mm_s: highest, kind: LimitKind::FeedChange, per_unit: node.programmed_mm_s };
            }
            k = end + 1;
        }
    }
}

struct Context<'a> {
    toolpath: &'a Toolpath,
    map: &'a EngagementMap,
    job: &'a Job,
    rules: &'a Rules,
    cutters: &'a Cutters,
    /// The cutters with each process model that is one standard deviation away.
    others: Vec<Cutters>,
    deviations: f64,
    reasons: Reasons<'a>,
    /// By rule: where no load comes near any of its load limits, the limit that one comes nearest to.
    idle: Vec<Option<Idle>>,
}

/// Where to put the loads of a station at its programmed feed, and that feed. Both slices are empty where nobody needs the loads.
struct AtProgrammed<'a> {
    feed_mm_s: &'a mut f64,
    loads: &'a mut [f64],
}

impl Context<'_> {
    fn node(
        &self,
        id: MoveId,
        station: Option<&Station>,
        at_programmed: &mut AtProgrammed<'_>,
    ) -> (Node, Option<(Bound, Bound)>) {
        let motion = &self.toolpath.moves[id.ix()];
        if motion.kind == MoveKind::Rapid {
            let rapid = bound(self.job.machine.rapid_mm_s, LimitKind::Velocity);
            return (plain(id, motion, None, rapid), None);
        }
        let rule = self.rules.of(id);
        let programmed = bound(motion.feed.mm_s, LimitKind::Programmed);
        let mut node = plain(id, motion, station, programmed);
        node.free = rule.mode != Mode::Keep && motion.freeze.is_none() && !self.excluded(motion.line);
        node.not_raised = self.reasons.of(id, station);
        if !node.free {
            return (node, None);
        }
        let mut asked = None;
        match station {
            Some(station) if node.cutting => {
                asked = self.in_cut(&mut node, (rule, motion, station), at_programmed);
            }
            Some(station) if station.flags.clear_air => node.cap = self.in_air(rule, programmed),
            _ => node.cap = lesser(programmed, highest_feed(rule)),
        }
        if let Some(why) = node.not_raised {
            not_raised::hold_at_programmed(&mut node, why);
        }
        node.floor.feed_mm_s = node.floor.feed_mm_s.min(node.cap.feed_mm_s);
        // Where entries, plunges and the like keep their feed, a minimum is not expected to raise it; below a load limit it is told all the same.
        let expected = node.not_raised.is_none_or(|why| why == NotRaised::NoLoadLimit) || node.cap.kind.is_load();
        let short = asked.filter(|floor: &Bound| expected && node.cap.feed_mm_s < floor.feed_mm_s * (1.0 - SHORT));
        let conflict = short.map(|floor| (floor, node.cap));
        (node, conflict)
    }

    /// Loads of a station as functions of feed.
    fn line(&self, cutters: &Cutters, motion: &Move, station: &Station) -> Option<LoadLine> {
        Some(cutters.of(station.move_id)?.line(&cutters.cut(self.map, motion, station)))
    }

    /// Lowers caps where the force would change faster than the limit on its rate from one node to the next.
    fn keep_force_rates(&self, problem: &mut Problem, work: &[(MoveId, Option<&Station>)]) {
        if self.rules.rules.iter().all(|rule| rule.limits.force_rate_n_s.is_none()) {
            return;
        }
        let nodes = &problem.nodes;
        let caps: Vec<Option<Bound>> = work
            .par_windows(2)
            .zip(nodes.par_windows(2))
            .map(|(work, nodes)| self.rate_cap([work[0].1?, work[1].1?], [&nodes[0], &nodes[1]]))
            .collect();
        for (i, cap) in caps.into_iter().enumerate() {
            let Some(cap) = cap else { continue };
            for node in problem.nodes[i..i + 2].iter_mut().filter(|node| node.free) {
                node.cap = lesser(node.cap, cap);
                node.floor.feed_mm_s = node.floor.feed_mm_s.min(node.cap.feed_mm_s);
            }
        }
    }

    fn rate_cap(&self, stations: [&Station; 2], nodes: [&Node; 2]) -> Option<Bound> {
        let motions = nodes.map(|node| &self.toolpath.moves[node.move_id.ix()]);
        let joined = motions.iter().all(|motion| motion.kind == MoveKind::Feed);
        if !joined || !(nodes[0].cutting || nodes[1].cutting) {
            return None;
        }
        let rate_n_s = self.rules.of(nodes[1].move_id).limits.force_rate_n_s?;
        let lines = [0, 1].map(|i| self.line(self.cutters, motions[i], stations[i]));
        let force = |i: usize, feed: f64| lines[i].as_ref().map_or(0.0, |line| line.loads(feed).force_xy_peak_n);
        let most = nodes[0].cap.feed_mm_s.max(nodes[1].cap.feed_mm_s);
        let highest = |rate: f64| {
            let ds_mm = force_rate::between_mm(nodes[0], nodes[1]);
            force_rate::highest(&|feed| force(0, feed), &|feed| force(1, feed), ds_mm, rate, most)
        };
        let feed_mm_s = highest(rate_n_s);
        let per_unit = (highest(1.001 * rate_n_s) - feed_mm_s) / (0.001 * rate_n_s);
        (feed_mm_s < most && feed_mm_s > 0.0).then_some(Bound { feed_mm_s, kind: LimitKind::ForceRate, per_unit })
    }

    fn excluded(&self, line: u32) -> bool {
        self.job.output.exclude.iter().any(|&(first, last)| (first..=last).contains(&line))
    }

    fn in_air(&self, rule: &Rule, programmed: Bound) -> Bound {
        let wanted = match self.job.air_feed {
            Some(air) if air.feed_mm_s > programmed.feed_mm_s => {
                Bound { feed_mm_s: air.feed_mm_s, kind: LimitKind::AirFeed, per_unit: mm_s_from_mm_min(1.0) }
            }
            _ => programmed,
        };
        lesser(wanted, highest_feed(rule))
    }

    /// Sets cap and floor of a node in a cut. Returns the minimum feed that the setup asks for, as it is asked for.
    fn in_cut(
        &self,
        node: &mut Node,
        (rule, motion, station): (&Rule, &Move, &Station),
        at_programmed: &mut AtProgrammed<'_>,
    ) -> Option<Bound> {
        let programmed = node.programmed_mm_s;
        let line = self.line(self.cutters, motion, station);
        let others: Vec<LoadLine> =
            self.others.iter().filter_map(|cutters| self.line(cutters, motion, station)).collect();
        let spindle = &self.job.machine.spindle;
        let measured_mm = self.job.process.measured_feed(motion.tool).filter(|_| self.job.confidence.is_some());
        let margin = Margin { others: &others, deviations: self.deviations, measured_mm };
        let cap = |line: &LoadLine, kind, limit| margin.cap(line, kind, limit);
        let floor = lowest_feed(line.as_ref(), rule, programmed);
        let acts = self.idle[self.rules.index_of(node.move_id)].is_none();
        let most = rule.limits.feed_change_max.unwrap_or(FEED_CHANGE_MAX[0]);
        let answers = || line.as_ref().is_some_and(|line| answers(line, rule, programmed));
        let highest = if acts && !skims(station) && answers() {
            Bound { feed_mm_s: programmed * most, kind: LimitKind::FeedChange, per_unit: programmed }
        } else {
            node.not_raised = node.not_raised.or(Some(NotRaised::NoLoadLimit));
            bound(programmed, LimitKind::Programmed)
        };
        let allowed = lesser(highest, highest_feed(rule));
        let of_loads = |line| load_cap(line, &cap, rule, (spindle, motion.spin.rps), allowed.feed_mm_s);
        let load = line.as_ref().map_or(LoadCap::Free, of_loads);
        node.floor = Bound { feed_mm_s: floor.feed_mm_s.min(allowed.feed_mm_s), ..floor };
        let lowest = node.floor.feed_mm_s;
        match load {
            LoadCap::Free => node.cap = allowed,
            LoadCap::At(cap) if cap.feed_mm_s >= LEAST * lowest => node.cap = lesser(cap, allowed),
            LoadCap::At(Bound { kind, .. }) | LoadCap::Impossible(kind) => {
                node.cap = Bound { feed_mm_s: lowest.min(programmed), kind, per_unit: 0.0 };
                node.infeasible = Some(kind);
                return None;
            }
        }
        if let (Some(line), true) = (&line, node.not_raised.is_some() && node.cap.feed_mm_s >= programmed) {
            // The feed stays: these loads are kept for the check of the written file.
            let found = line.loads(programmed);
            let kinds = rule.loads.iter().copied().chain(curves(spindle, motion.spin.rps)).map(|(kind, _)| kind);
            if !at_programmed.loads.is_empty() {
                *at_programmed.feed_mm_s = programmed;
            }
            for (load, kind) in at_programmed.loads.iter_mut().zip(kinds) {
                *load = found.bounded_by(kind).unwrap_or(0.0);
            }
        }
        (floor.kind != LimitKind::FeedChange).then_some(floor)
    }
}

/// Share by which a minimum must lie above a cap to be missed: above the rounding of the sums, far below what an F word can show.
const SHORT: f64 = 1e-6;

/// Highest feed that every load limit allows.
enum LoadCap {
    Free,
    At(Bound),
    Impossible(LimitKind),
}

/// The cap of one load.
type CapOf<'a> = dyn Fn(&LoadLine, LimitKind, f64) -> Cap + 'a;

fn load_cap(line: &LoadLine, cap: &CapOf, rule: &Rule, (spindle, rps): (&Spindle, f64), allowed_mm_s: f64) -> LoadCap {
    // The lowest cap with one percent of its limit, in the unit of reports; and the next cap above it.
    let (mut least, mut next_mm_s): (Option<(Bound, f64)>, f64) = (None, allowed_mm_s);
    for (kind, value) in rule.loads.iter().copied().chain(curves(spindle, rps)) {
        match cap(line, kind, value) {
            Cap::Free => {}
            Cap::Unreachable => return LoadCap::Impossible(kind),
            Cap::Feed { feed_mm_s, per_unit } => {
                // Prices are told per unit of the report.
                let told = |per: f64, value: f64| (Bound { feed_mm_s, kind, per_unit: per }, 0.01 * value);
                let torque = kind == LimitKind::Torque;
                let found =
                    if torque { told(nmm_from_nm(per_unit), nm_from_nmm(value)) } else { told(per_unit, value) };
                match &mut least {
                    Some((known, _)) if known.feed_mm_s <= feed_mm_s => next_mm_s = next_mm_s.min(feed_mm_s),
                    Some(known) => next_mm_s = next_mm_s.min(std::mem::replace(known, found).0.feed_mm_s),
                    None => least = Some(found),
                }
            }
        }
    }
    // Where another cap lies close above, one percent more of this limit raises the feed only up to that cap: the slope is taken over it.
    least.map_or(LoadCap::Free, |(bound, percent)| {
        let most = (next_mm_s - bound.feed_mm_s).max(0.0) / percent;
        LoadCap::At(Bound { per_unit: bound.per_unit.min(most), ..bound })
    })
}

/// Does a load that is limited grow with the feed here? An axial limit says nothing about a slot whose edges have no axial force.
fn answers(line: &LoadLine, rule: &Rule, feed_mm_s: f64) -> bool {
    let [low, high] = [feed_mm_s, 2.0 * feed_mm_s].map(|feed| line.loads(feed));
    let grows = |(kind, limit): &(LimitKind, f64)| {
        let [low, high] = [low, high].map(|loads| loads.bounded_by(*kind).unwrap_or(0.0));
        high > low && high > CANCELLED * limit
    };
    rule.loads.iter().any(grows)
}

/// Power and torque that the spindle has at a speed, each as a limit in the unit of [`crate::machine::Limits`].
fn curves(spindle: &Spindle, rps: f64) -> impl Iterator<Item = (LimitKind, f64)> {
    let curve = [
        (LimitKind::Power, spindle.power_w.as_ref().map(|table| table.at(rps))),
        (LimitKind::Torque, spindle.torque_nmm.as_ref().map(|table| table.at(rps))),
    ];
    curve.into_iter().filter_map(|(kind, value)| Some((kind, value?)))
}

/// Lowest feed asked for in a cut: the largest of the minima.
fn lowest_feed(line: Option<&LoadLine>, rule: &Rule, programmed_mm_s: f64) -> Bound {
    let change = rule.limits.feed_change_min.unwrap_or(FEED_CHANGE_MIN);
    let mut floor = bound(programmed_mm_s * change, LimitKind::FeedChange);
    if let Some(feed_mm_s) = rule.limits.feed_min_mm_s {
        floor = greater(floor, bound(feed_mm_s, LimitKind::FeedMin));
    }
    let thin =
        line.zip(rule.limits.chip_thickness_min_mm).map(|(line, least)| line.cap(LimitKind::ChipThickness, least));
    if let Some(Cap::Feed { feed_mm_s, .. }) = thin {
        floor = greater(floor, bound(feed_mm_s, LimitKind::ChipThicknessMin));
    }
    floor
}

fn highest_feed(rule: &Rule) -> Bound {
    let feed_mm_s = rule.limits.feed_max_mm_s.unwrap_or(f64::INFINITY);
    Bound { feed_mm_s, kind: LimitKind::Feed, per_unit: mm_s_from_mm_min(1.0) }
}

fn plain(id: MoveId, motion: &Move, station: Option<&Station>, cap: Bound) -> Node {
    Node {
        move_id: id,
        from_mm: station.map_or(0.0, |station| station.from_mm),
        to_mm: station.map_or_else(|| motion.curve().length(), |station| station.to_mm),
        cap,
        floor: bound(0.0, LimitKind::FeedMin),
        programmed_mm_s: motion.feed.mm_s,
        cutting: station.is_some_and(|station| station.arc_count > 0),
        free: false,
        uncertain: station.is_none_or(|station| station.flags.uncertain),
        final_surface: station.is_some_and(|station| station.flags.final_surface),
        not_raised: None,
        cap_if_raised: None,
        infeasible: None,
    }
}

fn bound(feed_mm_s: f64, kind: LimitKind) -> Bound {
    Bound { feed_mm_s, kind, per_unit: 0.0 }
}

/// The lower of two; the first when they are equal.
fn lesser(a: Bound, b: Bound) -> Bound {
    if b.feed_mm_s < a.feed_mm_s { b } else { a }
}

fn greater(a: Bound, b: Bound) -> Bound {
    if b.feed_mm_s > a.feed_mm_s { b } else { a }
}
