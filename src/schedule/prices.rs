//! What bounds the feed, for how long, and what more of it would save. In: problem, continuous optimum, written feeds. Out: prices per node,
//! shadow prices per kind of limit, cutting time of the written program by binding limit.
//!
//! Prices are those of the continuous optimum. The time is that at the written feed: where an F word holds a place below the speed of the
//! optimum, the place whose cap the word comes from is what bounds it ([`Holder`]).
//!
//! The price of a cap on b comes from the reverse sweep of the exact pass, or from the multipliers of the convex program
//! inside its windows, which cover every place where arcs or jerk couple speeds (there the derivative of the sweeps would be a
//! product of ill-conditioned factors); b = F² makes it a price of the feed, and the cap's own derivative a price of the
//! limit behind it.

use super::exact_pass::{cap_prices, exact_pass, time_slopes};
use super::optimum::Optimum;
use super::problem::{Holder, Kept, KeptPlace, NotRaised, Problem, ShadowPrice};
use crate::machine::LimitKind;
use crate::nc::Toolpath;

/// Share of its cap that a speed must reach for the cap to count as binding; below it the accelerations of the machine do.
const AT_CAP: f64 = 0.98;

/// Prices of a continuous optimum.
#[derive(Debug, Clone, Default)]
pub struct Prices {
    /// Seconds that 1 mm/s more of the cap of each node saves.
    pub node_s: Vec<f64>,
    /// What one more unit of a limit changes the time by.
    pub shadow: Vec<ShadowPrice>,
}

/// Cutting time by what bounds it.
#[derive(Debug, Clone, Default)]
pub struct Active {
    /// By limit, s.
    pub by_limit_s: Vec<(LimitKind, f64)>,
    /// That of [`LimitKind::Programmed`] by the reason why the feed is not raised, s.
    pub not_raised_s: Vec<(Kept, f64)>,
}

/// Prices of an optimum.
pub fn prices(problem: &Problem, toolpath: &Toolpath, optimum: &Optimum) -> Prices {
    let node_s = node_prices(problem, optimum);
    let mut shadow: Vec<ShadowPrice> = Vec::new();
    for (node, price_s) in
        problem.nodes.iter().zip(&node_s).filter(|(node, price_s)| *price_s * node.cap.per_unit != 0.0)
    {
        let (kind, tool) = (node.cap.kind, toolpath.moves[node.move_id.ix()].tool);
        let at = shadow.iter().position(|known| (known.kind, known.tool) == (kind, tool)).unwrap_or_else(|| {
            shadow.push(ShadowPrice { kind, tool, per_unit_s: 0.0 });
            shadow.len() - 1
        });
        shadow[at].per_unit_s -= price_s * node.cap.per_unit;
    }
    Prices { node_s, shadow }
}

/// Cutting time of the written program by what bounds it; `holders` by node.
pub fn active(problem: &Problem, toolpath: &Toolpath, optimum: &Optimum, holders: &[Holder]) -> Active {
    let mut by_limit = [0.0; LimitKind::ALL.len()];
    let mut not_raised_s: Vec<(Kept, f64)> = Vec::new();
    let runs_again = |tag: usize| toolpath.moves[problem.nodes[tag].move_id.ix()].shared.is_some();
    for (i, leg_s) in optimum.leg_times().into_iter().enumerate() {
        let tag = optimum.tags[i] as usize;
        if !problem.nodes[tag].cutting {
            continue;
        }
        let length_mm = optimum.chain.legs[i].ds_mm;
        let holder = holders[tag];
        let is_elsewhere = holder.is_elsewhere(length_mm / leg_s);
        let (kind, node, time_s) = if is_elsewhere {
            let node = &problem.nodes[holder.node as usize];
            (if node.free { node.cap.kind } else { LimitKind::Programmed }, node, length_mm / holder.feed_mm_s)
        } else {
            (binding(problem, optimum, i, leg_s), &problem.nodes[tag], leg_s)
        };
        by_limit[kind as usize] += time_s;
        let why = node.not_raised.or((!node.cutting).then_some(NotRaised::Air));
        if let (LimitKind::Programmed, Some(why)) = (kind, why) {
            let place = if !is_elsewhere {
                KeptPlace::Here
            } else if runs_again(tag) {
                KeptPlace::AnotherRun
            } else {
                KeptPlace::SameFeed
            };
            let kept = Kept { why, place };
            match not_raised_s.iter_mut().find(|(known, _)| *known == kept) {
                Some((_, seconds)) => *seconds += time_s,
                None => not_raised_s.push((kept, time_s)),
            }
        }
    }
    Active { by_limit_s: listed(by_limit), not_raised_s }
}

fn listed(values: [f64; LimitKind::ALL.len()]) -> Vec<(LimitKind, f64)> {
    LimitKind::ALL.into_iter().zip(values).filter(|(_, value)| *value != 0.0).collect()
}

/// What bounds a leg.
pub fn binding(problem: &Problem, optimum: &Optimum, leg: usize, time_s: f64) -> LimitKind {
    let node = &problem.nodes[optimum.tags[leg] as usize];
    let cap_b = optimum.chain.legs[leg].cap_b;
    let speed = optimum.chain.legs[leg].ds_mm / time_s;
    if speed < AT_CAP * cap_b.sqrt() {
        return if optimum.is_windowed(leg) { LimitKind::Jerk } else { LimitKind::Acceleration };
    }
    if own(node.cap.feed_mm_s, cap_b) { node.cap.kind } else { LimitKind::Velocity }
}

/// Is the cap of a leg the cap of its node, and not the speed limit of an axis?
fn own(feed_mm_s: f64, cap_b: f64) -> bool {
    (feed_mm_s * feed_mm_s - cap_b).abs() <= 1e-9 * cap_b
}

fn node_prices(problem: &Problem, optimum: &Optimum) -> Vec<f64> {
    let chain = &optimum.chain;
    // Outside the windows these are the speeds of the optimum. No price is carried across the ends of a window.
    let exact = cap_prices(chain, &exact_pass(chain));
    let point = |i: usize| {
        let window = optimum.window_price_s[i];
        if window.is_nan() { exact.point_s[i] } else { window }
    };
    let mut node_s = vec![0.0; problem.nodes.len()];
    for (i, leg) in chain.legs.iter().enumerate() {
        let tag = optimum.tags[i] as usize;
        let feed = problem.nodes[tag].cap.feed_mm_s;
        if !own(feed, leg.cap_b) {
            continue;
        }
        let inside = if optimum.is_windowed(i) { 0.0 } else { -time_slopes(leg, optimum.b[i], optimum.b[i + 1])[2] };
        // A point belongs to the leg whose cap holds it; to the one before it when both do.
        let first = chain.point_b[i] > leg.cap_b && (i == 0 || chain.legs[i - 1].cap_b > leg.cap_b);
        let last = chain.point_b[i + 1] > leg.cap_b && chain.legs.get(i + 1).is_none_or(|next| next.cap_b >= leg.cap_b);
        let ends = [(first, i), (last, i + 1)].iter().filter(|(is, _)| *is).map(|(_, at)| point(*at)).sum::<f64>();
        node_s[tag] += (ends + inside) * 2.0 * feed;
    }
    node_s
}
