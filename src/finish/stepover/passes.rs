//! Passes side by side. In: the tool on the surface, bounds, feeds to choose from, a reference force. Out: passes as curves y(x) with
//! feeds and active bounds.
//!
//! The frame is rotated so that passes run along X and follow each other towards +Y. It is divided into columns along
//! X, in each of which the surface is machined on some stretches of Y. In each column the next pass may be as far from
//! pass y_k as [`Reach`] allows; over gaps it goes to the start of the next stretch, and a remainder at the end of a
//! stretch that is wider than half a step-over gets a pass on its edge. The slope of a pass against X is at most L; the
//! next pass is the largest curve of that slope below the allowed values,
//!
//! y_{k+1}(x) = min over x' of allowed(x') + L |x − x'|.
//!
//! It nowhere exceeds what is allowed; L = 0 gives straight passes.
//!
//! Step-over and feed are chosen together, as the allowed step-over depends on the feed. Candidates are: every feed of
//! the list in all columns, and in each column the feed of the largest product of feed and step-over. Where a curve has
//! a smaller step-over than its feed allows, the feed is raised as far as the force permits. The candidate that clears
//! the largest area per second becomes the next pass.
//!
//! As it is written, in lines and arcs with rounded coordinates, it may leave more than it does on the surface itself. Where the two passes as
//! they are written leave more than the limit, the step-over is shortened, and the pass is laid again.

use super::columns::{Columns, HALVINGS, is_on};
use super::drop::Dropper;
use super::lowered::Lowered;
use super::path::{Drawing, as_written};
use super::plan::{Pass, Plan, Spot, StepLimit};
use super::reach::{Bounds, Reach, ToolOnSurface};
use super::section::Beside;
use super::written::with_scallops;
use crate::force::{Cap, LoadLine};
use crate::machine::LimitKind;
use crate::machine::limits::FEED_CHANGE_MIN;
use crate::numeric::bisect;
use crate::path::{Curve, Vec3};
use rayon::prelude::*;

/// Limits and choices for the passes.
#[derive(Debug, Clone, PartialEq)]
pub struct Requirements {
    /// Bounds of step-over and scallop.
    pub bounds: Bounds,
    /// Where the scallop limit is lower.
    pub lowered: Lowered,
    /// Reference force, which is not exceeded, N.
    pub reference_n: f64,
    /// Feeds to choose from, mm/s, the largest last.
    pub feeds_mm_s: Vec<f64>,
    /// Largest slope of a pass against its direction (tangent).
    pub turn: f64,
    /// Constant step-over of all passes, instead of the allowed one.
    pub constant: Option<Constant>,
}

impl Requirements {
    /// The bounds at a place in the plane.
    pub fn bounds_at(&self, at: [f64; 2]) -> Bounds {
        Bounds { scallop_mm: self.lowered.share(at) * self.bounds.scallop_mm, ..self.bounds }
    }

    /// Highest feed with at most the reference force, mm/s, between [`FEED_CHANGE_MIN`] times the largest feed and the
    /// largest feed.
    pub fn fastest_mm_s(&self, line: &LoadLine) -> f64 {
        let top = self.feeds_mm_s.last().copied().unwrap_or(1.0);
        let cap = match line.cap(LimitKind::ForceXy, self.reference_n) {
            Cap::Free => top,
            Cap::Feed { feed_mm_s, .. } => feed_mm_s,
            Cap::Unreachable => 0.0,
        };
        cap.clamp(FEED_CHANGE_MIN * top, top)
    }
}

/// A constant step-over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Constant {
    /// Seen from above, mm.
    Above(f64),
    /// Along the surface, mm: the largest distance between two passes.
    Along(f64),
    /// Of passes of one height: vertical, mm.
    Down(f64),
}

/// Shortest distance of a spot from the next one, mm: a digit of a program.
const APART_MM: f64 = 1e-3;

/// Allowed step-overs of a column for the next pass.
struct Allowed {
    /// For each feed the step-over, mm, and what bounds it; empty in a gap.
    steps: Vec<(f64, StepLimit)>,
    /// The places that bound them, in the column and at ends of the pass beside it.
    reaches: Vec<([f64; 2], Reach)>,
    /// For each feed the index of the place that bounds it.
    by: Vec<usize>,
}

impl Allowed {
    /// Of so many places the least step-overs.
    fn least(reaches: Vec<([f64; 2], Reach)>, required: &Requirements) -> Self {
        let own = |feed: f64| {
            let steps = reaches.iter().map(|(_, reach)| bound(reach, feed, required, required.bounds.largest_mm));
            let least = steps.enumerate().reduce(|a, b| if b.1.0 < a.1.0 { b } else { a });
            least.unwrap_or((0, (required.bounds.least_mm, StepLimit::Edge)))
        };
        let (by, steps) = required.feeds_mm_s.iter().map(|feed| own(*feed)).unzip();
        Self { steps, reaches, by }
    }
}

/// Plans the passes over the columns. `drawing`: how they are written; `None`: the scallop limit is held without regard to that.
pub fn plan(on_surface: &ToolOnSurface, columns: &Columns, required: &Requirements, drawing: Option<&Drawing>) -> Plan {
    let count = columns.stretches.len();
    let mut plan = Plan { everywhere_mm: vec![[f64::INFINITY; 2]; required.feeds_mm_s.len()], ..Plan::default() };
    let begin: Vec<f64> = (0..count).map(|i| columns.start(i, f64::NEG_INFINITY, 0.0)).collect();
    let half = (on_surface.shape().radius_mm() / columns.column_mm).round() as usize;
    let mut curve = below(&begin, required.turn, &columns.at_mm, half);
    let (mut places, mut beyond) = (0usize, 0usize);
    let area = (on_surface, columns, required);
    let mut laid = pass_along(area, &curve, None, &vec![StepLimit::Edge; count], way(0));
    while curve.iter().any(|y| y.is_finite()) {
        let (pass, ends) = laid;
        plan.passes.push(pass);
        let ahead = headings(&curve, &columns.at_mm, way(plan.passes.len()));
        let column = |i: usize| {
            let mut allowed = Allowed { steps: Vec::new(), reaches: Vec::new(), by: Vec::new() };
            let Some(_) = columns.stretch(i, curve[i]) else { return allowed };
            let at = [columns.x(i), curve[i]];
            match required.constant {
                None => {
                    // Where the pass ends beside the column, the surface may allow less than in it.
                    let places = [at].into_iter().chain(ends[i].iter().flatten().copied());
                    let reach =
                        |p: [f64; 2]| Some((p, on_surface.reach(p, (ahead[i], [0.0, 1.0]), &required.bounds_at(p))?));
                    let reaches: Vec<([f64; 2], Reach)> = places.filter_map(reach).collect();
                    if !reaches.is_empty() {
                        allowed = Allowed::least(reaches, required);
                    }
                }
                Some(Constant::Above(step)) => allowed.steps = vec![(step, StepLimit::Neighbours)],
                Some(Constant::Along(step)) => {
                    let leans = on_surface.leans(at, ahead[i]).unwrap_or(1.0);
                    allowed.steps = vec![(step * leans, StepLimit::Neighbours)];
                }
                // Parallel passes step to the side.
                Some(Constant::Down(_)) => {}
            }
            allowed
        };
        let mut allowed: Vec<Allowed> = (0..count).into_par_iter().map(column).collect();
        for (allowed, (_, reach)) in allowed.iter().filter_map(|allowed| Some((allowed, allowed.reaches.first()?))) {
            places += 1;
            if allowed.steps.iter().all(|(_, limit)| *limit == StepLimit::Least) {
                beyond += 1;
                continue;
            }
            for (least, (step, _)) in plan.everywhere_mm.iter_mut().zip(&allowed.steps) {
                *least = [least[0].min(*step), least[1].min(*step / reach.leans)];
            }
        }
        let best = chosen(columns, &curve, &allowed, (required, half));
        let settle = |(i, allowed): (usize, &mut Allowed)| {
            let k = best[i];
            let by = allowed.by.get(k).and_then(|by| allowed.reaches.get(*by));
            let (Some((at, reach)), Some(step)) = (by, allowed.steps.get_mut(k)) else { return };
            if step.1 == StepLimit::Force {
                let ask = [required.feeds_mm_s[k], required.reference_n];
                step.0 = on_surface.settled_mm(*at, (ahead[i], [0.0, 1.0]), reach, ask);
            }
        };
        allowed.par_iter_mut().enumerate().for_each(settle);
        let next;
        (next, laid) = lay(area, &curve, (&mut allowed, &best), plan.passes.len(), drawing.zip(plan.passes.last()));
        curve = next;
    }
    plan.out_of_reach = beyond as f64 / places.max(1) as f64;
    plan
}

/// A pass, and for each column where it ends beside it.
type Laid = (Pass, Vec<Ends>);

/// The curve of the next pass, and the pass along it. With a drawing and the pass before, it is laid again with shorter step-overs until both
/// as they are written keep the scallop limit.
fn lay(
    area: (&ToolOnSurface, &Columns, &Requirements),
    curve: &[f64],
    (allowed, best): (&mut [Allowed], &[usize]),
    number: usize,
    written: Option<(&Drawing, &Pass)>,
) -> (Vec<f64>, Laid) {
    let (on_surface, columns, required) = area;
    let half = (on_surface.shape().radius_mm() / columns.column_mm).round() as usize;
    let along = |allowed: &[Allowed]| {
        let NextPass { next, limits, .. } = next_pass(columns, curve, allowed, best, (required, half));
        let laid = pass_along(area, &next, Some(curve), &limits, way(number));
        (next, laid)
    };
    let (mut next, mut laid) = along(allowed);
    let Some((drawing, before)) = written else { return (next, laid) };
    let first = next.clone();
    let before = as_written(before, on_surface.dropper, drawing);
    let shortest = shortest(required, drawing);
    for _ in 0..TRIALS {
        let left = left_as_written(on_surface, &before, &laid.0, (required, drawing));
        if !shorten(columns, [curve, &next, &first], (allowed, best), &left, (required, shortest)) {
            break;
        }
        (next, laid) = along(allowed);
    }
    (next, laid)
}

/// Most times that a pass is laid again with shorter step-overs.
const TRIALS: usize = 8;
/// Share by which the scallop between two passes as they are written may be above the limit: a fifth of what counts as beyond it.
const OVER: f64 = 2e-3;

/// Share of a step-over to which it is shortened at most: lines and arcs off by the tolerance leave scallops higher by as much. What is
/// higher than that, at the foot of a wall, is not due to them.
fn shortest(required: &Requirements, drawing: &Drawing) -> f64 {
    (1.0 - drawing.tolerance_mm / required.bounds.scallop_mm).max(0.0).sqrt()
}

/// The spots of a stretch, and places midway between them beside the pass before.
fn with_middles(stretch: &[Spot], dropper: &Dropper) -> Vec<Spot> {
    let middle = |two: &[Spot]| {
        let mean = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|axis| 0.5 * (a[axis] + b[axis]));
        let tip = |at: [f64; 2]| Some(Vec3::new(at[0], at[1], dropper.drop(at)?.tip_mm));
        let at = mean(two[0].at, two[1].at);
        let [a, b] = [two[0].beside?, two[1].beside?];
        Some(Spot { at, tip: tip(at)?, beside: Some(tip(mean([a.x, a.y], [b.x, b.y]))?), ..two[0] })
    };
    stretch.iter().copied().chain(stretch.windows(2).filter_map(middle)).collect()
}

/// The spots of a pass, and places between them, with the scallops that it leaves as it is written beside the motions of the pass before.
fn left_as_written(
    on_surface: &ToolOnSurface,
    before: &[Curve],
    pass: &Pass,
    (required, drawing): (&Requirements, &Drawing),
) -> Vec<Spot> {
    let curves: Vec<Curve> = before.iter().copied().chain(as_written(pass, on_surface.dropper, drawing)).collect();
    let stretches = pass.stretches.iter().map(|stretch| with_middles(stretch, on_surface.dropper)).collect();
    let plan = Plan { passes: vec![Pass { stretches, ..*pass }], ..Plan::default() };
    let plan = with_scallops(on_surface, plan, (&curves, 0.0), required.bounds.scallop_mm);
    plan.passes.into_iter().flat_map(|pass| pass.stretches).flatten().collect()
}

/// Shortens the step-overs beside the spots whose scallop is above the limit, as its root, down to a share of those to the curve that was laid
/// first. Is any of them shorter now?
fn shorten(
    columns: &Columns,
    [curve, next, first]: [&[f64]; 3],
    (allowed, best): (&mut [Allowed], &[usize]),
    left: &[Spot],
    (required, shortest): (&Requirements, f64),
) -> bool {
    let mut shorter = false;
    for spot in left.iter().filter(|spot| spot.beside.is_some()) {
        let limit_mm = required.bounds_at(spot.at).scallop_mm;
        if spot.scallop_mm <= (1.0 + OVER) * limit_mm {
            continue;
        }
        // Where a pass ends beside a column, that one alone has a step-over.
        let Some(i) = columns.beside(spot.at[0]).into_iter().find(|i| !allowed[*i].steps.is_empty()) else { continue };
        let least_mm = required.bounds.least_mm.max(shortest * (first[i] - curve[i]));
        let wanted_mm = ((next[i] - curve[i]) * (limit_mm / spot.scallop_mm).sqrt()).max(least_mm);
        if let Some(step) = allowed[i].steps.get_mut(best[i]).filter(|(step_mm, _)| wanted_mm < *step_mm) {
            shorter |= wanted_mm < next[i] - curve[i];
            *step = (wanted_mm, StepLimit::Scallop);
        }
    }
    shorter
}

/// The step-over allowed at a feed, at most `largest_mm`, and what bounds it.
pub fn bound(reach: &Reach, feed_mm_s: f64, required: &Requirements, largest_mm: f64) -> (f64, StepLimit) {
    let (step, within) = reach.step_mm(feed_mm_s, required.reference_n);
    let limit = match step {
        _ if !within => StepLimit::Least,
        step if step < reach.by_scallop_mm => StepLimit::Force,
        step if step < largest_mm => StepLimit::Scallop,
        _ => StepLimit::Largest,
    };
    (step, limit)
}

/// For each column the index of the feed in the requirements with which the next pass clears the largest area per second.
fn chosen(columns: &Columns, curve: &[f64], allowed: &[Allowed], rules: (&Requirements, usize)) -> Vec<usize> {
    let (required, count) = (rules.0, rules.0.feeds_mm_s.len());
    let product = |steps: &[(f64, StepLimit)], k: usize| required.feeds_mm_s[k] * steps[k].0;
    let own = |allowed: &Allowed| {
        let steps = &allowed.steps;
        (0..steps.len()).reduce(|a, b| if product(steps, b) > product(steps, a) { b } else { a }).unwrap_or(0)
    };
    let of_one_feed = (0..count).map(|k| vec![k; allowed.len()]);
    let candidates: Vec<Vec<usize>> = of_one_feed.chain([allowed.iter().map(own).collect()]).collect();
    let rate = |candidate: &Vec<usize>| {
        let next = next_pass(columns, curve, allowed, candidate, rules);
        if next.time_s > 0.0 { next.gain_mm2 / next.time_s } else { 0.0 }
    };
    let rates: Vec<f64> = candidates.par_iter().map(rate).collect();
    let best = (0..rates.len()).reduce(|a, b| if rates[b] > rates[a] { b } else { a }).unwrap_or(0);
    candidates.into_iter().nth(best).unwrap_or_default()
}

/// Feed with the reference force at a step-over, mm/s, interpolated between the two feeds whose allowed steps enclose
/// it.
pub fn feed_for(steps: &[(f64, StepLimit)], step_mm: f64, required: &Requirements) -> f64 {
    let feeds = &required.feeds_mm_s;
    let Some(k) = (0..steps.len()).rev().find(|k| steps[*k].0 >= step_mm - 1e-9) else {
        return feeds.first().copied().unwrap_or(1.0);
    };
    let Some((beyond, _)) = steps.get(k + 1) else { return feeds[k] };
    let within = steps[k].0;
    feeds[k] + (feeds[k + 1] - feeds[k]) * ((within - step_mm) / (within - beyond).max(1e-12)).clamp(0.0, 1.0)
}

/// The next pass for one choice of feeds.
#[derive(Default)]
struct NextPass {
    next: Vec<f64>,
    limits: Vec<StepLimit>,
    /// Machined area between the passes, mm².
    gain_mm2: f64,
    /// Time along the next pass, s.
    time_s: f64,
}

/// How far behind the start of a stretch its first pass may lie, in steps. Up to half a step its border has no higher scallop than lies between
/// two passes, so that stretches that start a little one after the other need no pass each. Half of that, as the first pass along a border
/// meets stock ahead of it too: with 0.5 a saddle at 6 N met 6.9 N there (54 passes), with 0.25 6.06 (60), with 0 6.06 (70).
const LATE: f64 = 0.25;

/// The next pass if column i uses feed number `feeds[i]` of the requirements.
fn next_pass(
    columns: &Columns,
    curve: &[f64],
    allowed: &[Allowed],
    feeds: &[usize],
    (required, half): (&Requirements, usize),
) -> NextPass {
    let own_step = |i: usize| {
        let known = allowed[i].steps.get(feeds[i]).copied();
        known.unwrap_or((required.bounds.least_mm, StepLimit::Edge))
    };
    let on = (0..curve.len()).filter(|i| columns.on(*i, curve[*i]));
    let late_mm = LATE * on.map(|i| own_step(i).0).reduce(f64::min).unwrap_or(0.0);
    let column = |i: usize| {
        let y = curve[i];
        let next = || (columns.start(i, y, late_mm), StepLimit::Edge);
        let Some([_, end]) = columns.stretch(i, y) else { return next() };
        let (step, limit) = own_step(i);
        if y + step <= end {
            (y + step, limit)
        } else if end - y > 0.5 * step {
            (end, StepLimit::Edge)
        } else {
            next()
        }
    };
    let (tops, mut limits): (Vec<f64>, Vec<StepLimit>) = (0..curve.len()).map(column).unzip();
    let next = below(&tops, required.turn, &columns.at_mm, half);
    let (mut gain_mm2, mut time_s) = (0.0, 0.0);
    for i in 0..curve.len() {
        if next[i] < tops[i] - 1e-9 && tops[i].is_finite() {
            limits[i] = StepLimit::Neighbours;
        }
        if columns.on(i, curve[i]) && next[i].is_finite() {
            gain_mm2 += (next[i] - curve[i]) * columns.width(i);
            let longer = allowed[i].reaches.first().map_or(1.0, |(_, reach)| reach.longer);
            time_s += longer * columns.width(i) / feed_for(&allowed[i].steps, next[i] - curve[i], required);
        }
    }
    NextPass { next, limits, gain_mm2, time_s }
}

/// Running mean of the running minimum, both over `half` columns either way: nowhere above the curve, without its fine
/// waves.
fn smooth(curve: &[f64], half: usize) -> Vec<f64> {
    let window = |i: usize| i.saturating_sub(half)..(i + half + 1).min(curve.len());
    let least: Vec<f64> =
        (0..curve.len()).map(|i| curve[window(i)].iter().fold(f64::INFINITY, |a, b| a.min(*b))).collect();
    (0..curve.len()).map(|i| least[window(i)].iter().sum::<f64>() / window(i).len() as f64).collect()
}

/// Largest curve with slope of at most `turn` below the tops; smoothed if `turn` > 0, because fine waves of one pass
/// would grow in the next.
fn below(tops: &[f64], turn: f64, at_mm: &[f64], half: usize) -> Vec<f64> {
    let mut curve = if turn > 0.0 { smooth(tops, half) } else { tops.to_vec() };
    let rise = |i: usize| turn * (at_mm[i] - at_mm[i - 1]);
    for i in 1..curve.len() {
        curve[i] = curve[i].min(curve[i - 1] + rise(i));
    }
    for i in (1..curve.len()).rev() {
        curve[i - 1] = curve[i - 1].min(curve[i] + rise(i));
    }
    curve
}

/// Direction of a pass: alternating, the first along +X.
fn way(pass: usize) -> f64 {
    if pass.is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// Unit heading of a curve at each column, along +X or against it.
fn headings(curve: &[f64], at_mm: &[f64], way: f64) -> Vec<[f64; 2]> {
    let last = curve.len() - 1;
    let heading = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
        let slope = (curve[b] - curve[a]) / (at_mm[b] - at_mm[a]);
        let slope = if slope.is_finite() { slope } else { 0.0 };
        let length = slope.hypot(1.0);
        [way / length, way * slope / length]
    };
    (0..curve.len()).map(heading).collect()
}

/// Where a pass ends beside a column, on its left and on its right, mm.
type Ends = [Option<[f64; 2]>; 2];

/// A pass along a curve, with loads at its spots: one in each column, and one where the machined surface ends between two; and for each column
/// where that is.
fn pass_along(
    (on_surface, columns, required): (&ToolOnSurface, &Columns, &Requirements),
    curve: &[f64],
    before: Option<&[f64]>,
    limits: &[StepLimit],
    way: f64,
) -> Laid {
    let ahead = headings(curve, &columns.at_mm, way);
    let in_column = |i: usize| {
        let at = [columns.x(i), curve[i]];
        let [from, _] = columns.stretch(i, curve[i])?;
        spot_at((on_surface, required), at, (ahead[i], limits[i]), [before.map(|before| before[i]), Some(from)])
    };
    let spots: Vec<Option<Spot>> = (0..curve.len()).into_par_iter().map(in_column).collect();
    // The last place on the way from a column on the surface to a neighbour off it.
    let end = |i: usize, off: usize| {
        let on_the_way = |values: &dyn Fn(usize) -> f64, t: f64| values(i) + t * (values(off) - values(i));
        let at = |t: f64| [on_the_way(&|k| columns.x(k), t), on_the_way(&|k| curve[k], t)];
        let t = bisect(|t| is_on(on_surface, at(t)), 0.0, 1.0, HALVINGS)[0];
        let before = before.map(|before| on_the_way(&|k| before[k], t));
        let far = (at(t)[0] - columns.x(i)).abs() > APART_MM;
        far.then(|| spot_at((on_surface, required), at(t), (ahead[i], limits[i]), [before, None])).flatten()
    };
    let ends = |i: usize| {
        let off = |k: &usize| spots[i].is_some() && spots.get(*k).is_some_and(Option::is_none);
        [i.wrapping_sub(1), i + 1].map(|k| Some(k).filter(off).and_then(|off| end(i, off)))
    };
    let ends: Vec<[Option<Spot>; 2]> = (0..curve.len()).into_par_iter().map(ends).collect();
    let mut stretches: Vec<Vec<Spot>> = Vec::new();
    let mut open = false;
    for (spot, [begin, end]) in spots.iter().zip(&ends) {
        if let Some(spot) = spot {
            if !open {
                stretches.push(Vec::new());
            }
            stretches.last_mut().into_iter().for_each(|stretch| stretch.extend(begin.iter().chain([spot]).chain(end)));
        }
        open = spot.is_some();
    }
    // A stretch of one spot is shorter than a digit of the program.
    stretches.retain(|stretch| stretch.len() > 1);
    let places = ends.iter().map(|two| two.map(|spot| spot.map(|spot| spot.at))).collect();
    (Pass { stretches, back: way < 0.0, level_mm: None }, places)
}

/// A spot of a pass with its loads; `before`: Y of the pass before there; `from`: start of the stretch of the surface there, looked for where
/// it is not known.
fn spot_at(
    (on_surface, required): (&ToolOnSurface, &Requirements),
    at: [f64; 2],
    (ahead, limit): ([f64; 2], StepLimit),
    [before, from]: [Option<f64>; 2],
) -> Option<Spot> {
    let from = from.unwrap_or_else(|| start_of(on_surface, at, before.unwrap_or(at[1] - required.bounds.largest_mm)));
    // The pass before is on the same stretch; otherwise the stock starts at the end of the stretch.
    let beside = before.filter(|y| *y >= from - 1e-6).and_then(|y| {
        let tip = on_surface.dropper.drop([at[0], y])?.tip_mm;
        Some((Vec3::new(at[0], y, tip), at[1] - y))
    });
    let contact = on_surface.dropper.drop([at[0], from])?;
    let edge = (Beside::Edge(contact.point - 1e-3 * Vec3::y()), 0.0);
    let (stock, step_mm) = beside.map_or(edge, |(tip, step_mm)| (Beside::Pass(tip), step_mm));
    let here = on_surface.here(at, ahead, stock)?;
    let line = on_surface.line(&here);
    let feed_mm_s = required.fastest_mm_s(&line);
    let force_n = line.loads(feed_mm_s).force_xy_peak_n;
    let limit = if step_mm > 0.0 { limit } else { StepLimit::Edge };
    let (scallop_mm, beside) = (here.scallop_mm, beside.map(|(tip, _)| tip));
    Some(Spot { at, step_mm, feed_mm_s, force_n, scallop_mm, beside, limit, tip: here.tip })
}

/// Where the machined surface under a place begins, mm, looked for down to a Y.
fn start_of(on_surface: &ToolOnSurface, at: [f64; 2], down_to_mm: f64) -> f64 {
    let on = |y: f64| is_on(on_surface, [at[0], y]);
    let parts = f64::from(LOOKS_BESIDE);
    let look = |k: u32| at[1] + (down_to_mm - at[1]) * f64::from(k) / parts;
    let first_off = (1..=LOOKS_BESIDE).find(|k| !on(look(*k)));
    first_off.map_or(down_to_mm, |k| bisect(on, look(k - 1), look(k), HALVINGS)[0])
}

/// Places looked at between a pass and the one before for an end of the surface there: narrower gaps do not matter to stock and scallop.
const LOOKS_BESIDE: u32 = 4;

#[cfg(test)]
mod tests {
    use super::*;

    /// Y of the pass after one at 0 with a step of 1 mm, if beside it another stretch of the surface starts at `start_mm`.
    fn next_mm(start_mm: f64) -> f64 {
        let columns = Columns {
            at_mm: (0..4).map(f64::from).collect(),
            column_mm: 1.0,
            stretches: vec![vec![[0.0, 20.0]], vec![[0.0, 20.0]], vec![[start_mm, 20.0]], vec![[start_mm, 20.0]]],
        };
        let allowed: Vec<Allowed> = (0..4)
            .map(|_| Allowed { steps: vec![(1.0, StepLimit::Scallop)], reaches: Vec::new(), by: vec![0] })
            .collect();
        let required = Requirements {
            bounds: Bounds { scallop_mm: 0.01, least_mm: 0.1, largest_mm: 2.0 },
            lowered: Lowered::nowhere(3.0),
            reference_n: 10.0,
            feeds_mm_s: vec![10.0],
            turn: 0.0,
            constant: None,
        };
        let next = next_pass(&columns, &[0.0; 4], &allowed, &[0; 4], (&required, 0)).next;
        assert!(next.iter().all(|y| (y - next[0]).abs() < 1e-12), "a straight pass: {next:?}");
        next[0]
    }

    #[test]
    fn a_stretch_that_starts_less_than_a_quarter_of_a_step_before_a_pass_shares_it_and_an_earlier_one_pulls_it_back() {
        assert!((next_mm(0.76) - 1.0).abs() < 1e-12 && (next_mm(3.0) - 1.0).abs() < 1e-12);
        assert!((next_mm(0.7) - 0.95).abs() < 1e-12 && (next_mm(0.2) - 0.45).abs() < 1e-12);
    }
}
