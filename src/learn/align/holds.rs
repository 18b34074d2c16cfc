//! Holds of a program (feed hold, operator) in a log aligned by its load. In: the match. Out: a running time that
//! excludes the holds, on which the drift is smooth; pauses for the report.

use crate::learn::align::drift::{Drift, interpolated};
use crate::learn::align::matching::Match;

/// Shortest hold, s. Judgement.
const HOLD_S: f64 = 1.5;
/// Time before and after a hold at which the drift corrects its length, s. Judgement.
const ABOUT_HOLD_S: f64 = 8.0;

/// Stretches of the log in which the program stood: (from, to), s.
pub(in crate::learn) struct Holds(pub(in crate::learn) Vec<(f64, f64)>);

impl Holds {
    pub(in crate::learn) fn new(found: &Match) -> Self {
        let at = |i: usize| i as f64 * found.step_s;
        let mut all = Vec::new();
        let mut from = 0;
        for i in 1..=found.program_s.len() {
            let stands = found.program_s.get(i).is_some_and(|p| *p == found.program_s[from]);
            if !stands {
                // In a gap a hold cannot be distinguished from a slow run; the drift follows both.
                let seen = found.known[from + 1..i].iter().filter(|known| **known).count();
                if at(seen) >= HOLD_S && found.program_s[from].is_finite() {
                    all.push((at(from), at(i - 1)));
                }
                from = i;
            }
        }
        Self(all)
    }

    /// Log time less the holds before it, s.
    pub(in crate::learn) fn running_s(&self, log_s: f64) -> f64 {
        log_s - self.0.iter().map(|(from, to)| (log_s.min(*to) - from).max(0.0)).sum::<f64>()
    }

    /// The time of the log at a running time.
    pub(in crate::learn) fn log_s(&self, running_s: f64) -> f64 {
        self.0.iter().fold(running_s, |log_s, (from, to)| if *from < log_s { log_s + to - from } else { log_s })
    }

    /// Is a time of the log within a hold?
    pub(in crate::learn) fn holds(&self, log_s: f64) -> bool {
        self.0.iter().any(|(from, to)| (*from..*to).contains(&log_s))
    }

    /// Pauses (time in the log, length), s: the holds, their length corrected by the drift about them, and pauses of
    /// the drift elsewhere.
    pub(in crate::learn) fn pauses(&self, walk: &Drift) -> Vec<(f64, f64)> {
        let begins: Vec<f64> = self.0.iter().map(|(from, _)| self.running_s(*from)).collect();
        let near = |running_s: f64| begins.iter().any(|b| (b - running_s).abs() < ABOUT_HOLD_S);
        let beside = walk.pauses.iter().filter(|p| p.1 > 0.0).map(|(t, s)| (walk.log_s(*t), *s));
        let beside = beside.filter(|(t, _)| !near(*t)).map(|(t, s)| {
            let held: f64 = self.0.iter().zip(&begins).filter(|(_, b)| **b < t).map(|((from, to), _)| to - from).sum();
            (t + held, s)
        });
        let within = |(hold, _): &(&(f64, f64), &f64)| hold.0 > 0.0;
        let about = |((from, to), begin): (&(f64, f64), &f64)| {
            let places = walk.program_s(&[begin - ABOUT_HOLD_S, begin + ABOUT_HOLD_S]);
            let [before, after] = [0, 1].map(|k| interpolated(&walk.at_s, &walk.drift_s, places[k]));
            (*from, to - from + after - before)
        };
        let mut all: Vec<(f64, f64)> = self.0.iter().zip(&begins).filter(within).map(about).chain(beside).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all
    }
}
