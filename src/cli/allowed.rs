//! Highest feeds that a setup allows without regard to loads, for `verify --setup`, which does not simulate. In: the setup, motions that run
//! faster than before. Out: those that run too fast.
//!
//! A motion may run at `feed_change.max` times its programmed feed or at the air feed, whichever is more, but not above `feed.max` nor
//! faster than the axes together. Where tools or operations have bounds of their own, the widest of all counts, because which of them applies
//! where is not known without simulation.

use crate::machine::{Job, Limits};
use crate::rewrite::verify::Rise;

/// Relative rounding of a feed: an F word is rounded down, its product with a ratio is not.
const ROUNDED: f64 = 1e-6;

/// The first motion that runs faster than the setup allows: its place among the rises, and the bound in mm/s.
pub fn beyond(job: &Job, rises: &[Rise]) -> Option<(usize, f64)> {
    let bound = |rise: &Rise| most_mm_s(job, rise.feeds_mm_s[0]);
    let over = |(_, rise): &(usize, &Rise)| rise.feeds_mm_s[1] > bound(rise) * (1.0 + ROUNDED);
    rises.iter().enumerate().find(over).map(|(place, rise)| (place, bound(rise)))
}

fn most_mm_s(job: &Job, programmed_mm_s: f64) -> f64 {
    let widest = |of: fn(&Limits) -> Option<f64>| {
        let tools = job.tools.iter().map(|tool| &tool.limits);
        let own = tools.chain(job.operations.iter().map(|operation| &operation.limits)).filter_map(of);
        of(&job.limits).map(|common| own.fold(common, f64::max))
    };
    let change = widest(|limits| limits.feed_change_max).unwrap_or(f64::INFINITY);
    let air = job.air_feed.map_or(0.0, |air| air.feed_mm_s);
    let most = widest(|limits| limits.feed_max_mm_s).unwrap_or(f64::INFINITY);
    let axes = job.machine.axes.iter().map(|axis| axis.velocity_mm_s).fold(0.0, f64::hypot);
    (change * programmed_mm_s).max(air).min(most).min(axes).max(programmed_mm_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rise(was: f64, is: f64) -> Rise {
        Rise { ratio: is / was, feeds_mm_s: [was, is], lines: [1, 1] }
    }

    fn job(limits: &str) -> Job {
        let text = format!(
            "[machine.axes]\nx = {{ velocity = 6000 }}\ny = {{ velocity = 6000 }}\nz = {{ velocity = 3000 }}\n[stock]\nbox = {{ min = [0, 0, -5], max = [9, 9, 0] }}\n\
             [material]\nk_tc = 800\nk_te = 15\nk_rc = 300\nk_re = 10\n[[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 6\nflutes = 3\n[limits]\n{limits}\n"
        );
        crate::setup::load(&text, std::path::Path::new(".")).unwrap().0
    }

    /// Feeds of the setups in mm/min, of the rises in mm/s.
    #[test]
    fn each_bound_holds_on_both_sides() {
        let change = job("feed_change = { max = 1.5 }");
        assert_eq!(beyond(&change, &[rise(10.0, 15.0), rise(20.0, 29.9)]), None);
        assert_eq!(beyond(&change, &[rise(10.0, 15.0), rise(20.0, 30.1)]), Some((1, 30.0)));
        let most = job("feed_change = { max = 1.5 }\nfeed = { max = 1200 }");
        assert_eq!(beyond(&most, &[rise(15.0, 20.0)]), None);
        assert_eq!(beyond(&most, &[rise(15.0, 20.1)]), Some((0, 20.0)));
        let air = job("feed_change = { max = 1.5 }\nair_feed = 6000\n");
        assert_eq!(beyond(&air, &[rise(15.0, 100.0)]), None);
        assert!(beyond(&air, &[rise(15.0, 101.0)]).is_some());
        // √(100² + 100² + 50²) mm/s is as fast as the axes go together.
        let fast = job("feed_change = { max = 100 }");
        assert_eq!(beyond(&fast, &[rise(15.0, 149.9)]), None);
        assert!(beyond(&fast, &[rise(15.0, 150.1)]).is_some());
    }
}
