//! Passes of one height each, from the top downwards (constant z). In: the tool on the surface, its steep part, bounds, feeds to
//! choose from, a reference force. Out: the passes in order of cutting, with active bounds.
//!
//! At every place p of a level the next pass may step downhill by s, as far as [`Reach`] allows; that is a step down of
//!
//! Δz = H(p) − H(p + s·side),
//!
//! H the height of the tip. The next level is lower by the least Δz of all places whose step stays on descending steep
//! ground. It is not so low either that a place between the two, at which steep ground begins, is farther above it than such a
//! step. If the steep ground ends, so that no place of a pass can make the whole step, the remainder gets a level on
//! its edge if it is wider than half the step-over before it. Each curve of a level is a pass of its own, cut after
//! those above it. Closed ones run with the surface on their right (climb milling with M3); open ones alternate their
//! direction. What they leave where steep ground ends is cut along its ends ([`ends`](super::ends)).
//!
//! Step-over and least step-over are measured along the surface here, because seen from above they vanish on a wall.

use super::drop::Contact;
use super::ends::{self, End};
use super::levels::{Curve, downhill};
use super::order::{LevelStretch, order};
use super::passes::{Constant, Requirements, bound, feed_for};
use super::plan::{Pass, Plan, Spot, StepLimit};
use super::reach::{Bounds, Reach, ToolOnSurface};
use super::section::Beside;
use super::steep::Steep;
use crate::numeric::bisect;
use crate::path::Vec3;
use rayon::prelude::*;

/// A place bounds a level if its allowed step down exceeds the chosen one by at most this share: its force is then as
/// close to the reference, as force grows no faster than the step-over.
const BOUNDS_WITHIN: f64 = 0.02;
/// Steps bounded by the force are refined if they exceed the least by less than this share, which is more than the
/// error of the linear interpolation.
const SETTLED_WITHIN: f64 = 0.2;
/// Bisections of a distance along the slope: of 3 mm to 0.2 µm.
const HALVINGS: u32 = 14;
/// A step of at least this share of the distance to the end of the ground is one to its end.
const END_WITHIN: f64 = 0.999;
/// Factor on the distance between attempts to find the pass above.
const FARTHER: f64 = 1.5;
/// Least z component of a normal by which lengths are divided: a wall of 89.4°.
const UPRIGHT: f64 = 0.01;

/// A level: its spots, and the stretch of each.
struct Level {
    spots: Vec<(Spot, usize)>,
    height_mm: f64,
}

/// Allowed steps from a place to the level below.
struct Below {
    /// Index of the spot.
    spot: usize,
    /// Heading, and direction downhill.
    ways: [[f64; 2]; 2],
    /// For each feed the step down, mm, and what bounds it.
    steps: Vec<(f64, StepLimit)>,
    /// For each feed: does the step stay on steep ground?
    whole: Vec<bool>,
    /// Distance to the lower end of the steep ground, seen from above and vertically, mm; `None` if it is beyond the
    /// largest step.
    end_mm: Option<[f64; 2]>,
    reach: Option<Reach>,
    /// Length of the pass at this place, mm.
    length_mm: f64,
    /// Tangent of the slope.
    slope: f64,
}

/// Converts step-over bounds along the surface to bounds seen from above.
pub fn along_surface(bounds: &Bounds, contact: &Contact) -> Bounds {
    let lean = contact.normal.z.max(UPRIGHT);
    Bounds { least_mm: lean * bounds.least_mm, largest_mm: lean * bounds.largest_mm, ..*bounds }
}

/// Heading of a pass with the higher ground on its right, from the downhill direction.
pub fn heading(down: [f64; 2]) -> [f64; 2] {
    [down[1], -down[0]]
}

/// Plans the passes over the steep ground.
pub fn plan(on_surface: &ToolOnSurface, steep: &Steep, required: &Requirements) -> Plan {
    let least_mm = required.bounds.least_mm * steep.least_sine();
    let mut plan = Plan { everywhere_mm: vec![[f64::INFINITY; 2]; required.feeds_mm_s.len()], ..Plan::default() };
    let (mut strands, mut before): (Vec<LevelStretch>, Option<(Level, Vec<StepLimit>)>) = (Vec::new(), None);
    let (mut places, mut beyond) = (0usize, 0usize);
    let top = |below_mm: f64| steep.highest_below(on_surface.dropper, below_mm);
    let borders = ends::borders(on_surface, steep, required.bounds.scallop_mm);
    let begins: Vec<End> = borders.iter().flat_map(|border| ends::of(on_surface, border)).collect();
    // At the very top only single points are steep: start the least step below.
    let mut next = top(f64::INFINITY).map(|top| top - least_mm);
    while let Some(height_mm) = next {
        let level = add_level((on_surface, steep, required), height_mm, before.as_ref(), &mut strands);
        let mut below: Vec<Below> = (0..level.spots.len())
            .into_par_iter()
            .filter_map(|k| allowed((on_surface, steep, required), level.spots[k].0.at, k))
            .collect();
        lengths(&level, &mut below);
        places += below.len();
        beyond += below.iter().filter(|place| is_beyond(place)).count();
        let mut everywhere = |below: &[Below]| {
            for (k, least) in plan.everywhere_mm.iter_mut().enumerate() {
                let whole = below.iter().filter(|place| !is_beyond(place) && place.whole[k]);
                *least = [whole.map(|place| place.steps[k].0).fold(least[0], f64::min); 2];
            }
        };
        everywhere(&below);
        let step = chosen(&level, &below, required).map(|k| {
            settle(on_surface, &level, &mut below, (required, k));
            (k, step_down(&level, &below, k).unwrap_or(least_mm).max(least_mm))
        });
        // Steep ground that begins on the way is no farther above the next level than a step.
        let step = step.map(|(k, step_mm)| {
            if required.constant.is_some() {
                return (k, step_mm);
            }
            let low_mm = height_mm - step_mm;
            let between = begins.par_iter().filter(|end| (low_mm..height_mm).contains(&end.tip_mm));
            let from: Vec<(f64, Below)> = between
                .filter_map(|end| Some((end.tip_mm, allowed((on_surface, steep, required), end.at, 0)?)))
                .filter(|(_, place)| place.whole[k])
                .collect();
            let down_to =
                from.iter().map(|(tip_mm, place)| tip_mm - place.steps[k].0.max(least_mm)).fold(low_mm, f64::max);
            let from: Vec<Below> =
                from.into_iter().filter(|(tip_mm, _)| *tip_mm > down_to).map(|(_, place)| place).collect();
            everywhere(&from);
            (k, height_mm - down_to)
        });
        let limits = limits(on_surface, &level, &below, step);
        next = if let Some((_, step_mm)) = step {
            Some(height_mm - step_mm).filter(|_| top(height_mm).is_some())
        } else {
            let last = below.iter().filter_map(|place| place.end_mm).map(|[_, down]| down).fold(least_mm, f64::max);
            top(height_mm - last).map(|top| top - least_mm)
        };
        before = Some((level, limits));
    }
    plan.out_of_reach = beyond as f64 / places.max(1) as f64;
    let mut strands = order(strands, None);
    let last = strands.last().and_then(|strand| strand.spots.last()).map(|spot| spot.at);
    strands.extend(order(ends::stretches(on_surface, required, &borders, &strands), last));
    let pass = |strand: LevelStretch| Pass { stretches: vec![strand.spots], back: false, level_mm: strand.level_mm };
    plan.passes = strands.into_iter().map(pass).collect();
    plan
}

/// Does even the least step-over exceed the force at every feed?
fn is_beyond(place: &Below) -> bool {
    place.steps.iter().all(|(_, limit)| *limit == StepLimit::Least)
}

/// Adds the stretches of a level.
fn add_level(
    (on_surface, steep, required): (&ToolOnSurface, &Steep, &Requirements),
    height_mm: f64,
    before: Option<&(Level, Vec<StepLimit>)>,
    strands: &mut Vec<LevelStretch>,
) -> Level {
    let mut level = Level { spots: Vec::new(), height_mm };
    for Curve { mut points, closed } in steep.stretches(on_surface.dropper, height_mm) {
        let find = |p: &[f64; 2]| above((on_surface, steep, required), *p, height_mm, before.map(|(level, _)| level));
        let mut uphill: Vec<Above> = points.par_iter().map(find).collect();
        let of = |above: &Above| Some(before?.0.spots[above.pass?.1].1);
        let mut parents: Vec<usize> = uphill.iter().filter_map(of).collect();
        let back = !closed && parents.first().is_some_and(|k| !strands[*k].closed && !strands[*k].back);
        if back {
            points.reverse();
            uphill.reverse();
        }
        let limit = |above: &Above| above.pass.and_then(|(_, k)| Some(before?.1[k])).unwrap_or(StepLimit::Edge);
        let sign = if back { -1.0 } else { 1.0 };
        let spot = |(p, above): (&[f64; 2], &Above)| {
            spot_at((on_surface, required), (*p, height_mm), (above, limit(above)), sign)
        };
        let spots: Vec<Spot> = points.par_iter().zip(&uphill).filter_map(spot).collect();
        parents.sort_unstable();
        parents.dedup();
        level.spots.extend(spots.iter().map(|spot| (*spot, strands.len())));
        strands.push(LevelStretch { spots, closed, back, parents, level_mm: Some(height_mm) });
    }
    level
}

/// The pass or the end of the surface uphill of a place.
struct Above {
    /// The pass above: place on it, mm, and its nearest spot.
    pass: Option<([f64; 2], usize)>,
    /// Without a pass: the end of the surface, if it is near, mm.
    end: Option<Vec3>,
}

/// Searches uphill from a place for the pass above.
fn above(
    (on_surface, steep, required): (&ToolOnSurface, &Steep, &Requirements),
    p: [f64; 2],
    height_mm: f64,
    before: Option<&Level>,
) -> Above {
    let none = Above { pass: None, end: None };
    let Some(contact) = on_surface.dropper.drop(p) else { return none };
    let Some(down) = downhill(&contact) else { return none };
    let at = |by_mm: f64| [0, 1].map(|axis| p[axis] - by_mm * down[axis]);
    let drop = |by_mm: f64| on_surface.dropper.drop(at(by_mm));
    let on = |by_mm: f64| drop(by_mm).is_some_and(|contact| steep.holds(&contact));
    let far_mm = required.bounds.largest_mm;
    if let Some(before) = before {
        let lower = |by_mm: f64| drop(by_mm).is_some_and(|contact| contact.tip_mm < before.height_mm);
        let guess_mm = (before.height_mm - height_mm) * contact.normal.z / contact.normal.x.hypot(contact.normal.y);
        let tries = std::iter::successors(Some(guess_mm), |by_mm| Some(FARTHER * by_mm));
        let beyond = tries.take_while(|by_mm| *by_mm < far_mm).chain([far_mm]).find(|by_mm| !lower(*by_mm));
        let found = beyond.map(|beyond| bisect(lower, 0.0, beyond, HALVINGS)[1]);
        if let Some(by_mm) = found.filter(|by_mm| on(0.5 * by_mm) && drop(*by_mm).is_some()) {
            let place = at(by_mm);
            let far = |k: &usize| {
                let q = before.spots[*k].0.at;
                (q[0] - place[0]).hypot(q[1] - place[1])
            };
            let nearest = (0..before.spots.len()).min_by(|a, b| far(a).total_cmp(&far(b)));
            // The level curve exists there, but there may be no pass: passes end, and short stretches are left out.
            let there = nearest.filter(|k| far(k) < 0.5 * on_surface.shape().radius_mm());
            if let Some(there) = there {
                return Above { pass: Some((place, there)), end: None };
            }
        }
    }
    let whole = |by_mm: f64| drop(by_mm).is_some_and(|contact| !contact.rim);
    let end = (!whole(far_mm)).then(|| bisect(whole, 0.0, far_mm, HALVINGS)[0]);
    Above { pass: None, end: end.and_then(drop).map(|contact| contact.point) }
}

/// A spot of a pass with its loads; `sign`: −1 with the higher ground on its left.
fn spot_at(
    (on_surface, required): (&ToolOnSurface, &Requirements),
    (at, height_mm): ([f64; 2], f64),
    (above, limit): (&Above, StepLimit),
    sign: f64,
) -> Option<Spot> {
    let contact = on_surface.dropper.drop(at)?;
    let down = downhill(&contact)?;
    let (beside, step_mm) = if let Some((place, _)) = above.pass {
        let tip = Vec3::new(place[0], place[1], on_surface.dropper.drop(place)?.tip_mm);
        (Beside::Pass(tip), (tip - Vec3::new(at[0], at[1], height_mm)).norm())
    } else {
        let uphill = Vec3::new(-down[0], -down[1], 0.0);
        let nowhere = contact.point + 10.0 * on_surface.shape().radius_mm() * uphill;
        (Beside::Edge(above.end.map_or(nowhere, |end| end + 1e-3 * uphill)), 0.0)
    };
    let here = on_surface.here(at, heading(down).map(|x| sign * x), beside)?;
    let line = on_surface.line(&here);
    let feed_mm_s = required.fastest_mm_s(&line);
    let force_n = line.loads(feed_mm_s).force_xy_peak_n;
    let tip = Vec3::new(at[0], at[1], height_mm);
    let before = match beside {
        Beside::Pass(tip) => Some(tip),
        Beside::Edge(_) => None,
    };
    Some(Spot { at, step_mm, feed_mm_s, force_n, scallop_mm: here.scallop_mm, beside: before, limit, tip })
}

/// Allowed steps from a place, that of a spot, to the level below.
fn allowed(
    (on_surface, steep, required): (&ToolOnSurface, &Steep, &Requirements),
    p: [f64; 2],
    spot: usize,
) -> Option<Below> {
    let contact = on_surface.dropper.drop(p)?;
    let down = downhill(&contact)?;
    let ways = [heading(down), down];
    let slope = contact.normal.x.hypot(contact.normal.y) / contact.normal.z.max(UPRIGHT);
    let bounds = along_surface(&required.bounds_at(p), &contact);
    let drop = |by_mm: f64| on_surface.dropper.drop([0, 1].map(|axis| p[axis] + by_mm * down[axis]));
    let goes_down = |c: &Contact| steep.holds(c) && c.normal.x * down[0] + c.normal.y * down[1] > 0.0;
    let on = |by_mm: f64| drop(by_mm).is_some_and(|contact| goes_down(&contact));
    let deep = |by_mm: f64| drop(by_mm).map_or(0.0, |there| contact.tip_mm - there.tip_mm);
    let end = |far_mm: f64| (!on(far_mm)).then(|| bisect(on, 0.0, far_mm, HALVINGS)[0]);
    let (reach, end, overs) = match required.constant {
        Some(Constant::Down(step) | Constant::Above(step) | Constant::Along(step)) => {
            let over = step / slope;
            (None, end(over), vec![(over, StepLimit::Neighbours)])
        }
        None => {
            // Beyond the end the tool rolls over an edge or touches the other side of a valley: loads there do not
            // apply.
            let end = end(bounds.largest_mm);
            let largest_mm = end.unwrap_or(bounds.largest_mm).max(bounds.least_mm);
            let reach = on_surface.reach(p, (ways[0], ways[1]), &Bounds { largest_mm, ..bounds })?;
            let overs = required.feeds_mm_s.iter().map(|feed| bound(&reach, *feed, required, largest_mm)).collect();
            (Some(reach), end, overs)
        }
    };
    let overs: Vec<(f64, StepLimit)> = overs;
    let whole: Vec<bool> = overs.iter().map(|(over, _)| end.is_none_or(|end| *over < END_WITHIN * end)).collect();
    let step = |((over, limit), whole): (&(f64, StepLimit), &bool)| match required.constant {
        Some(Constant::Down(step)) => (step, *limit),
        _ => (if *whole { deep(*over) } else { over * slope }, *limit),
    };
    let steps = overs.iter().zip(&whole).map(step).collect();
    let end_mm = end.map(|by_mm| [by_mm, deep(by_mm).max(0.0)]);
    Some(Below { spot, ways, steps, whole, end_mm, reach, length_mm: 0.0, slope })
}

/// Distributes the length of every stretch over its places.
fn lengths(level: &Level, below: &mut [Below]) {
    let of = |k: usize| level.spots[k].1;
    for place in below {
        let (here, last) = (place.spot, level.spots.len() - 1);
        let beside = [here.saturating_sub(1), (here + 1).min(last)].into_iter().filter(|other| of(*other) == of(here));
        place.length_mm = beside.map(|other| 0.5 * (level.spots[other].0.tip - level.spots[here].0.tip).norm()).sum();
    }
}

/// The step down for feed number `k` of the requirements, mm: the least over places that can make the whole step; for a stretch
/// without such a place, down to its end if the remainder is wider than half the step-over before it.
fn step_down(level: &Level, below: &[Below], k: usize) -> Option<f64> {
    let of = |place: &Below| level.spots[place.spot].1;
    let stretch = |places: &[Below]| {
        let whole = places.iter().filter(|place| place.whole[k]).map(|place| place.steps[k].0).reduce(f64::min);
        let before = |place: &Below| level.spots[place.spot].0.step_mm;
        let end = |place: &Below| {
            place.end_mm.filter(|[over, down]| over.hypot(*down) > 0.5 * before(place)).map(|[_, down]| down)
        };
        whole.or_else(|| places.iter().filter_map(end).reduce(f64::max))
    };
    below.chunk_by(|a, b| of(a) == of(b)).filter_map(stretch).reduce(f64::min)
}

/// Index of the feed in the requirements with which the level below clears the largest area per second.
fn chosen(level: &Level, below: &[Below], required: &Requirements) -> Option<usize> {
    let rate = |k: usize| {
        let step_mm = step_down(level, below, k)?;
        let area: f64 = below.iter().map(|place| place.length_mm * step_mm / place.slope).sum();
        let time: f64 = below.iter().map(|place| place.length_mm / feed_for(&place.steps, step_mm, required)).sum();
        Some((k, area / time.max(f64::MIN_POSITIVE)))
    };
    let rates = (0..required.feeds_mm_s.len()).filter_map(rate);
    rates.reduce(|a, b| if b.1 > a.1 { b } else { a }).map(|(k, _)| k)
}

/// Refines the steps bounded by the force that may be the least.
fn settle(on_surface: &ToolOnSurface, level: &Level, below: &mut [Below], (required, k): (&Requirements, usize)) {
    let Some(least) = step_down(level, below, k) else { return };
    let ask = [required.feeds_mm_s[k], required.reference_n];
    let may_be = |place: &&mut Below| {
        let (step, limit) = place.steps[k];
        place.whole[k] && limit == StepLimit::Force && step < (1.0 + SETTLED_WITHIN) * least
    };
    below.par_iter_mut().filter(may_be).for_each(|place| {
        let Some(reach) = &place.reach else { return };
        let p = level.spots[place.spot].0.at;
        let over = on_surface.settled_mm(p, (place.ways[0], place.ways[1]), reach, ask);
        let tip = |by_mm: f64| on_surface.dropper.drop([0, 1].map(|axis| p[axis] + by_mm * place.ways[1][axis]));
        if let (Some(from), Some(to)) = (tip(0.0), tip(over)) {
            place.steps[k].0 = from.tip_mm - to.tip_mm;
        }
    });
}

/// Does a place bound a level?
fn bounds(own_mm: f64, taken_mm: f64) -> bool {
    own_mm <= (1.0 + BOUNDS_WITHIN) * taken_mm
}

/// What bounds the level below each spot.
fn limits(on_surface: &ToolOnSurface, level: &Level, below: &[Below], step: Option<(usize, f64)>) -> Vec<StepLimit> {
    let mut limits = vec![StepLimit::Edge; level.spots.len()];
    let Some((k, taken_mm)) = step else { return limits };
    let limit = |place: &Below| match place.steps[k] {
        _ if is_cut_short(on_surface, level, place, taken_mm) => StepLimit::Edge,
        (own_mm, limit) if place.whole[k] && bounds(own_mm, taken_mm) => limit,
        _ => StepLimit::Neighbours,
    };
    let found: Vec<StepLimit> = below.par_iter().map(limit).collect();
    below.iter().zip(found).for_each(|(place, limit)| limits[place.spot] = limit);
    limits
}

/// Does the surface end so close below the pass that the engagement is smaller? A corner of radius r is in stock of
/// thickness t down to √(2 r t) below the contact along the slope.
fn is_cut_short(on_surface: &ToolOnSurface, level: &Level, place: &Below, step_mm: f64) -> bool {
    let p = level.spots[place.spot].0.at;
    let Some(contact) = on_surface.dropper.drop(p) else { return true };
    let meets_mm = (2.0 * on_surface.shape().corner_mm * (on_surface.stock_mm)(&contact)).sqrt();
    let by_mm = step_mm / place.slope + meets_mm * contact.normal.z;
    let there = on_surface.dropper.drop([0, 1].map(|axis| p[axis] + by_mm * place.ways[1][axis]));
    there.is_none_or(|contact| contact.rim)
}

/// The plan of the largest constant step down that keeps force and scallop at all places of the varying plan, at its
/// best feed; see [`Plan::everywhere_mm`].
pub fn constant(
    on_surface: &ToolOnSurface,
    steep: &Steep,
    required: &Requirements,
    everywhere_mm: &[[f64; 2]],
) -> Option<(Constant, f64, Plan)> {
    let step = |k: usize| everywhere_mm[k][0];
    let rate = |k: usize| required.feeds_mm_s[k] * step(k);
    let feeds = (0..required.feeds_mm_s.len()).filter(|k| step(*k).is_finite());
    let k = feeds.reduce(|a, b| if rate(b) > rate(a) { b } else { a })?;
    let (step, feed) = (Constant::Down(step(k)), required.feeds_mm_s[k]);
    let required = Requirements { feeds_mm_s: vec![feed], constant: Some(step), ..required.clone() };
    Some((step, feed, plan(on_surface, steep, &required)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_bounds_a_level_within_a_fiftieth() {
        assert!(bounds(1.019, 1.0) && !bounds(1.021, 1.0));
    }

    /// Downhill along +Y a pass with the higher ground on its right runs along +X.
    #[test]
    fn the_higher_ground_is_on_the_right() {
        assert_eq!(heading([0.0, 1.0]), [1.0, 0.0]);
    }
}
