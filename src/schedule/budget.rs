//! A budget of wear over the whole program. In: a problem, a rate per length that rises with the feed, and the most that may
//! be used. Out: the problem with caps that keep the budget, and the price of one more unit.
//!
//! Time and wear of a piece of length ds at speed v are ds/v and c·v^p·ds (0 < p ≤ 2; c belongs to the piece). With one price
//! λ (s per unit) for the whole program, ds/v + λ c v^p ds falls up to v* = (1/(λ c p))^(1/(p+1)) and rises beyond: v* is a
//! cap, and λ is found by bisection. The budget is checked with every feed at its cap; where the control does not reach the cap,
//! the tool wears less, so the budget still holds. Run-ups are not traded against wear: λ comes from the caps alone.
//!
//! Where p ≤ 0 a slower feed never wears a tool less: the caps give the least wear possible, and a budget that is exceeded at the
//! caps cannot be kept at all. Nodes whose feed may not change wear the tool as at their programmed feeds.
//!
//! There is no budget of energy, because none could bind: the tare and the edges take a power that does not grow with the
//! feed, chips a power at most proportional to it, so the energy P/v of a millimetre of path never rises with v. The fastest
//! feeds within the caps use the least energy already.

use super::problem::{Bound, Problem};
use crate::machine::LimitKind;
use crate::numeric::bisect;

/// A budget.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// Exponent p of the speed.
    pub exponent: f64,
    /// Most that may be used in all cuts together.
    pub most: f64,
}

/// Outcome of [`apply`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BudgetOutcome {
    /// The caps alone keep the budget.
    Slack {
        /// What is used.
        used: f64,
    },
    /// Caps were lowered.
    Bound {
        /// What is used.
        used: f64,
        /// Seconds that one more unit would save.
        price_s: f64,
    },
    /// No feeds keep the budget. The caps are at the floors, or unchanged where slower feeds do not wear less.
    Impossible {
        /// What is used at the least.
        used: f64,
    },
}

/// Lowers the caps of the cutting nodes so that Σ c·v^p·ds ≤ `budget.most`. `rate[i]` is c of node i.
pub fn apply(problem: &mut Problem, rate: &[f64], budget: &Budget) -> BudgetOutcome {
    let used_at = |price_s: f64| -> f64 {
        let of = |(i, c): (usize, &f64)| {
            let node = &problem.nodes[i];
            if node.cutting && *c > 0.0 {
                c * speed(problem, i, *c, price_s, budget).powf(budget.exponent) * node.length_mm()
            } else {
                0.0
            }
        };
        rate.iter().enumerate().map(of).sum()
    };
    let free = used_at(0.0);
    if free <= budget.most {
        return BudgetOutcome::Slack { used: free };
    }
    if budget.exponent <= 0.0 {
        return BudgetOutcome::Impossible { used: free };
    }
    let lowest = used_at(f64::INFINITY);
    let price_s = if lowest > budget.most { f64::INFINITY } else { price_of(&used_at, budget.most) };
    let used = used_at(price_s);
    for (i, c) in rate.iter().enumerate() {
        let node = problem.nodes[i];
        if node.cutting && node.free && *c > 0.0 {
            let feed_mm_s = speed(problem, i, *c, price_s, budget);
            if feed_mm_s < node.cap.feed_mm_s {
                problem.nodes[i].cap = Bound { feed_mm_s, kind: LimitKind::Budget, per_unit: 0.0 };
            }
        }
    }
    if lowest > budget.most { BudgetOutcome::Impossible { used } } else { BudgetOutcome::Bound { used, price_s } }
}

/// How much longer the program would take with `budget` than with the caps of `kept`, every node at its cap, s. `fresh` is the problem
/// before any budget lowered its caps. `None` where no feeds keep the budget.
pub fn extra_s(fresh: &Problem, kept: &Problem, rate: &[f64], budget: &Budget) -> Option<f64> {
    let mut tighter = fresh.clone();
    let most_s = |problem: &Problem| -> f64 {
        let cuts = problem.nodes.iter().filter(|node| node.cutting && node.free);
        cuts.map(|node| node.length_mm() / node.cap.feed_mm_s).sum()
    };
    let possible = !matches!(apply(&mut tighter, rate, budget), BudgetOutcome::Impossible { .. });
    possible.then(|| most_s(&tighter) - most_s(kept))
}

/// Feed of a node at price λ, mm/s: v* between its floor and its cap; the programmed feed where it may not change.
fn speed(problem: &Problem, i: usize, c: f64, price_s: f64, budget: &Budget) -> f64 {
    let node = &problem.nodes[i];
    if !node.free {
        return node.programmed_mm_s;
    }
    if budget.exponent <= 0.0 {
        return node.cap.feed_mm_s;
    }
    let wanted = (1.0 / (price_s * c * budget.exponent)).powf(1.0 / (budget.exponent + 1.0));
    wanted.max(node.floor.feed_mm_s).min(node.cap.feed_mm_s)
}

/// The lowest price at which no more than `most` is used.
fn price_of(used_at: &dyn Fn(f64) -> f64, most: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1e-9);
    while used_at(high) > most && high < 1e300 {
        (low, high) = (high, high * 10.0);
    }
    bisect(|price| used_at(price) > most, low, high, 100)[1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::MoveId;
    use crate::schedule::problem::Node;

    #[test]
    fn a_bound_budget_is_used_up_and_its_price_is_the_slope() {
        let bound = |feed_mm_s| Bound { feed_mm_s, kind: LimitKind::Power, per_unit: 0.0 };
        let node = |i: u32, cap: f64| Node { move_id: MoveId(i), ..Node::between(bound(1.0), bound(cap)) };
        let fresh = Problem { nodes: vec![node(0, 50.0), node(1, 20.0), node(2, 80.0)], ..Problem::default() };
        let rate = [1e-3, 2e-3, 5e-4];
        let solve = |most: f64| {
            let mut problem = fresh.clone();
            let kept = apply(&mut problem, &rate, &Budget { exponent: 1.5, most });
            (problem.nodes.iter().map(|node| 10.0 / node.cap.feed_mm_s).sum::<f64>(), kept)
        };
        assert!(matches!(solve(1e9).1, BudgetOutcome::Slack { .. }));
        let (time, BudgetOutcome::Bound { used, price_s }) = solve(4.0) else { panic!("binds") };
        assert!((used - 4.0).abs() < 1e-9);
        let slope = (solve(3.999).0 - solve(4.001).0) / 0.002;
        assert!((slope / price_s - 1.0).abs() < 1e-3, "{time} {slope} {price_s}");
        assert!(matches!(solve(1e-9).1, BudgetOutcome::Impossible { .. }));
        // A tenth more life, which is a budget a tenth smaller, costs what the two answers differ in.
        let mut kept = fresh.clone();
        apply(&mut kept, &rate, &Budget { exponent: 1.5, most: 4.0 });
        let costs_s = extra_s(&fresh, &kept, &rate, &Budget { exponent: 1.5, most: 4.0 / 1.1 });
        assert!((costs_s.unwrap() - (solve(4.0 / 1.1).0 - time)).abs() < 1e-9);
        assert_eq!(extra_s(&fresh, &kept, &rate, &Budget { exponent: 1.5, most: 1e-9 }), None);
    }

    #[test]
    fn where_slower_is_no_safer_no_feed_is_lowered() {
        let bound = |feed_mm_s| Bound { feed_mm_s, kind: LimitKind::Power, per_unit: 0.0 };
        let node = Node::between(bound(1.0), bound(50.0));
        for exponent in [-1.0, 0.0] {
            let used = 10.0 * 50f64.powf(exponent);
            for (most, possible) in [(1.01 * used, true), (0.99 * used, false)] {
                let mut problem = Problem { nodes: vec![node], ..Problem::default() };
                let kept = apply(&mut problem, &[1.0], &Budget { exponent, most });
                assert_eq!(matches!(kept, BudgetOutcome::Slack { .. }), possible, "{exponent} {kept:?}");
                assert_eq!(problem.nodes[0].cap.feed_mm_s, 50.0);
            }
        }
        // Its own feed, where that may not change.
        let mut problem = Problem { nodes: vec![Node { free: false, ..node }], ..Problem::default() };
        let kept = apply(&mut problem, &[1.0], &Budget { exponent: 1.0, most: 200.0 });
        assert_eq!(kept, BudgetOutcome::Slack { used: 100.0 });
    }
}
