//! Feeds that hold their limits on edges that wear: wear depends on the feeds, caps depend on the wear. In: a problem, and the same
//! problem with the wear that the feeds solved from it cause. Out: lower caps, and whether they still change, or that no feeds hold the
//! limits.
//!
//! Variables. Station i is ds mm long; a tooth slides w mm in material in a revolution, at n rev/s and feed v it slides
//! a/v with a = w n ds. What it has slid at station i is S_i = Σ_{j<i} a_j/v_j + ½ a_i/v_i. Edge forces grow with S, so the cap
//! c_i(S), the highest feed within the load limits, falls with S. Wanted are the highest feeds with v_i ≤ c_i(S_i(v)).
//!
//! **There is a highest solution, and falling caps find it.** T(v) = c(S(v)) is monotone: higher feeds everywhere slide
//! less, so T(v) ≥ T(u) where v ≥ u. Begin with edges that have not slid, v⁰ = c(0), and take v^{k+1} = T(v^k). Any feeds u
//! that hold the limits have u ≤ T(u) ≤ c(0) = v⁰, hence u ≤ T(u) ≤ T(v⁰) = v¹ and so on: the iterates fall, and never
//! below feeds that hold the limits. They converge to the highest of these; and where an iterate leaves a station no feed
//! within its limits, no feeds do at all: slower ones only slide further. That is a refusal, with its reason.
//! F words and accelerations keep feeds below the caps; they only make the iterates lower, and caps are
//! never raised again, so the argument holds for what is written.
//!
//! **How fast.** S_i rests on what lies before station i alone. With λ = (a/ds) |c′(S)| / v² per mm of path an error δS of one
//! round leaves at most ∫λ δS of it in the next, after k rounds at most M^k / k! of it, M = ∫λ dx (Picard's bound for
//! Volterra's equation). In an even cut dv/dx = c′ a/(ds v), so λ dx = −dv/v and M is ln(v first / v last): feeds that fall
//! to a hundredth have M = 4.6, and 18 rounds leave less than 0.2 % ([`ROUNDS`] is twice that).
//!
//! **On which side it runs away.** With a load F = E (1 + g S) + K v in an even cut, limit L, reserve u = L − E (1 + g S) and
//! α = a/ds: v = u/K and du/dx = −E g α K / u, so
//!
//! ```text
//! u² = u₀² − 2 E g α K x        up to x* = u₀² / (2 E g α K).
//! ```
//! Before x* the feeds √(u₀² − 2 E g α K x) / K hold the limit; beyond x* none do, however slow: a tool that must go further
//! has to be changed. (One feed for the whole cut lasts for x*/2 at most, at v = u₀ / 2K.)
//!
//! **Where slower feeds spare the edge** (a law of its own with p > 0, [`crate::machine::wear`]) the argument turns round: T falls where
//! v rises. v¹ = T(v⁰) then lies below the feeds wanted and v² above, so caps that could only fall would stay at v¹: safe, but too
//! low. Here the caps of each round are taken from the wear of the round before, whether that makes them lower or higher ([`follow`]). The
//! wear at a station still depends only on what comes before it, so Picard's bound holds unchanged, and the limit of the iteration is the
//! only solution of v_i = c_i(S_i(v)). In an even cut with F = E (1 + g I) + K v and dI/dx = k v it is v = v₀ e^(−E g k x / K).
//!
//! F words are rounded and written only where they are worth their price, so feeds jump when caps change a little, and caps that may
//! rise can oscillate about the solution. In the second half of the rounds, more than Picard's bound needs, caps therefore only fall here
//! too, and come to rest slightly below the solution.
//!
//! Time since the start also depends on the feeds (a spindle that warms up). The same rounds serve for it: caps only fall, so the written
//! feeds hold their limits; where slower feeds would allow higher caps, that is not used.

use super::problem::{Node, Problem};
use crate::machine::LimitKind;

/// The iteration over wear ends when no load changes by more than this share of its limit in a round: a fifth of what the check of the
/// written file allows.
pub const SETTLED: f64 = 0.002;
/// Most rounds.
pub const ROUNDS: usize = 36;

/// Gives `problem` the caps of `worn`, the same problem with the wear that the feeds solved from it cause. A cap only falls, except where
/// slower feeds spare the edge (`spares`): there it becomes the lower cap of `worn` and `fresh`, the problem with unworn edges. Returns the
/// first node, of those whose caps only fall, at which no feed holds the limits any more, and the limit.
pub fn follow(
    problem: &mut Problem,
    fresh: &Problem,
    worn: &Problem,
    spares: &dyn Fn(&Node) -> bool,
) -> Option<(usize, LimitKind)> {
    let mut worn_out = None;
    let nodes = problem.nodes.iter_mut().zip(&fresh.nodes).zip(&worn.nodes).enumerate();
    for (index, ((node, fresh), worn)) in nodes {
        if !node.free || fresh.infeasible.is_some() {
            continue;
        }
        if spares(node) {
            *node = Node { cap: fresh.cap, floor: fresh.floor, infeasible: None, ..*node };
        } else if node.infeasible.is_some() {
            continue;
        } else if let Some(kind) = worn.infeasible {
            worn_out = worn_out.or(Some((index, kind)));
        }
        if worn.cap.feed_mm_s < node.cap.feed_mm_s {
            node.cap = worn.cap;
            node.floor.feed_mm_s = node.floor.feed_mm_s.min(node.cap.feed_mm_s);
            node.infeasible = worn.infeasible;
        }
    }
    worn_out
}

/// The largest change of a cap in a cut, as a share of the cap of a fresh edge there. This bounds the change of any load as a share of its
/// limit: a load is E + K v, and with c the cap of a fresh edge K c is below the limit. (As a share of the present cap the change is not
/// bounded, because caps go to zero where an edge is worn out.)
pub fn largest_change(before: &Problem, after: &Problem, fresh: &Problem) -> f64 {
    let nodes = before.nodes.iter().zip(&after.nodes).zip(&fresh.nodes);
    let cuts = nodes.filter(|((node, _), _)| node.cutting && node.free);
    let change =
        |((a, b), fresh): ((&Node, &Node), &Node)| (b.cap.feed_mm_s - a.cap.feed_mm_s).abs() / fresh.cap.feed_mm_s;
    cuts.map(change).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schedule::problem::{Bound, Node};

    /// F = E (1 + g S) + K v in an even cut; what of it does not depend on the feed, the limit, and α.
    const E: f64 = 40.0;
    const G: f64 = 3e-5;
    const K: f64 = 8.0;
    const LIMIT: f64 = 200.0;
    const ALPHA: f64 = 1500.0;
    /// Lowest feed asked for, mm/s.
    const FLOOR: f64 = 0.05;
    const DS_MM: f64 = 0.5;

    /// x*.
    fn furthest_mm() -> f64 {
        (LIMIT - E).powi(2) / (2.0 * E * G * ALPHA * K)
    }

    /// An even cut of so many stations behind these feeds, whose way in material is `ALPHA` times their power −1 per mm.
    fn posed(count: usize, feeds: Option<&[f64]>) -> Problem {
        posed_by(count, feeds, -1)
    }

    fn posed_by(count: usize, feeds: Option<&[f64]>, exponent: i32) -> Problem {
        let mut slid = 0.0;
        let node = |i: usize| {
            let way = feeds.map_or(0.0, |feeds| ALPHA * DS_MM * feeds[i].powi(exponent));
            let cap = (LIMIT - E * (1.0 + G * (slid + 0.5 * way))) / K;
            slid += way;
            let bound = |feed_mm_s| Bound { feed_mm_s, kind: LimitKind::Power, per_unit: 0.0 };
            Node {
                from_mm: DS_MM * i as f64,
                to_mm: DS_MM * (i + 1) as f64,
                programmed_mm_s: 5.0,
                infeasible: (cap < FLOOR).then_some(LimitKind::Power),
                ..Node::between(bound(FLOOR), bound(cap.max(FLOOR)))
            }
        };
        Problem { nodes: (0..count).map(node).collect(), ..Problem::default() }
    }

    /// Rounds until caps rest, and the caps; or the place that is worn out.
    fn settled(length_mm: f64) -> Result<(usize, Vec<f64>), f64> {
        let count = (length_mm / DS_MM) as usize;
        rests(count, -1)
    }

    fn rests(count: usize, exponent: i32) -> Result<(usize, Vec<f64>), f64> {
        let fresh = posed(count, None);
        let mut problem = fresh.clone();
        for round in 1..=ROUNDS {
            let before = problem.clone();
            let feeds: Vec<f64> = problem.nodes.iter().map(|node| node.cap.feed_mm_s).collect();
            let worn = posed_by(count, Some(&feeds), exponent);
            if let Some((node, _)) = follow(&mut problem, &fresh, &worn, &|_| exponent > 0) {
                return Err(problem.nodes[node].from_mm);
            }
            if largest_change(&before, &problem, &fresh) <= SETTLED {
                return Ok((round, problem.nodes.iter().map(|node| node.cap.feed_mm_s).collect()));
            }
        }
        panic!("no rest within {ROUNDS} rounds");
    }

    /// dS/dx = α v: v = v₀ e^(−E g α x / K). The first round alone would leave v₀ (1 − E g α x / K), which is nothing at the end
    /// of this cut.
    #[test]
    fn where_slower_feeds_spare_the_edge_caps_come_to_rest_at_the_closed_form() {
        let per_mm = E * G * ALPHA / K;
        let (rounds, caps) = rests((1.2 / per_mm / DS_MM) as usize, 1).expect("slower feeds spare it");
        assert!(rounds <= 12, "{rounds}");
        for (i, cap) in caps.iter().enumerate() {
            let exact = (LIMIT - E) / K * (-per_mm * DS_MM * (i as f64 + 0.5)).exp();
            assert!((cap / exact - 1.0).abs() < 0.05, "{i} of {}: {cap} for {exact}", caps.len());
        }
    }

    #[test]
    fn caps_come_to_rest_at_the_closed_form() {
        for share in [0.3, 0.6, 0.9, 0.99] {
            let length_mm = share * furthest_mm();
            let (rounds, caps) = settled(length_mm).expect("before x*");
            // M = ln(v first / v last); after k rounds M^k / k! is left.
            let m = (caps[0] / caps[caps.len() - 1]).ln();
            let bound = (1..=ROUNDS).find(|&k| (1..=k).fold(1.0, |left, i| left * m / i as f64) < SETTLED);
            assert!(rounds <= bound.expect("within the rounds") + 2, "{share}: {rounds} for {bound:?}");
            for (i, cap) in caps.iter().enumerate() {
                let x = DS_MM * (i as f64 + 0.5);
                let exact = ((LIMIT - E).powi(2) - 2.0 * E * G * ALPHA * K * x).sqrt() / K;
                assert!((cap / exact - 1.0).abs() < 0.02, "{share} at {x}: {cap} for {exact}");
            }
        }
    }

    /// A cap near nothing that is halved changes the load by as much of the limit as one that is high and loses a little.
    #[test]
    fn a_change_counts_by_the_load_that_it_changes() {
        let (fresh, few) = (posed(2, None), [0.02, 0.01]);
        let with = |feeds: [f64; 2]| {
            let mut problem = fresh.clone();
            problem.nodes.iter_mut().zip(feeds).for_each(|(node, feed)| node.cap.feed_mm_s = feed);
            problem
        };
        let high = fresh.nodes[0].cap.feed_mm_s;
        let change = |from: f64, to: f64| largest_change(&with([from, high]), &with([to, high]), &fresh);
        assert!((change(few[0], few[1]) - change(high, high - 0.01)).abs() < 1e-12);
        // That load, over its limit, is less.
        assert!(K * 0.01 / LIMIT < change(few[0], few[1]) && change(few[0], few[1]) < SETTLED);
    }

    #[test]
    fn beyond_the_furthest_the_tool_is_worn_out_and_before_it_is_not() {
        assert!(settled(0.995 * furthest_mm()).is_ok());
        let at_mm = settled(1.005 * furthest_mm()).expect_err("beyond x*");
        assert!(at_mm > 0.99 * furthest_mm(), "{at_mm} of {}", furthest_mm());
    }

    #[test]
    fn slower_feeds_reach_less_far() {
        // One feed for the whole cut: at best u0 / 2K, which lasts for half of x*.
        let holds = |feed: f64, length_mm: f64| {
            let count = (length_mm / DS_MM) as usize;
            posed(count, Some(&vec![feed; count])).nodes.iter().all(|node| feed <= node.cap.feed_mm_s)
        };
        let best = 0.5 * (LIMIT - E) / K;
        assert!(holds(best, 0.49 * furthest_mm()) && !holds(best, 0.51 * furthest_mm()));
        for feed in [0.1, 0.3, 0.5, 0.8, 1.2, 1.5, 1.9].map(|share| share * best) {
            assert!(!holds(feed, 0.5 * furthest_mm()), "{feed}");
        }
    }
}
