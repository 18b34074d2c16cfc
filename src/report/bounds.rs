//! What bounds the feed. In: cutting time of the written program by what bounds it. Out: shares of it that add to 100 %, with
//! "kept as programmed" under its own name, once for each reason.

use crate::machine::LimitKind;
use crate::outcome::Written;

/// Name under which feeds stand that are not raised whatever the limits allow.
pub const KEPT: &str = "kept as programmed";

/// One thing that bounds the feed.
#[derive(Debug, Clone, PartialEq)]
pub struct Share {
    /// Name of the limit, or [`KEPT`].
    pub name: &'static str,
    /// Why the feed is kept; `None`: a limit, or nothing allows more.
    pub reason: Option<String>,
    /// Share of the cutting time, %.
    pub percent: f64,
}

/// Shares of the cutting time, the largest first.
pub fn shares(written: &Written) -> Vec<Share> {
    let schedule = &written.schedule;
    let whole_s: f64 = schedule.active_s.iter().map(|(_, seconds)| seconds).sum();
    let share = |name, reason, seconds: f64| Share { name, reason, percent: 100.0 * seconds / whole_s };
    let mut found = Vec::new();
    for &(kind, seconds) in &schedule.active_s {
        if kind != LimitKind::Programmed {
            found.push(share(kind.name(), None, seconds));
            continue;
        }
        let mut rest_s = seconds;
        for &(kept, not_raised_s) in &schedule.not_raised_s {
            add(&mut found, share(KEPT, Some(kept.in_words()), not_raised_s));
            rest_s -= not_raised_s;
        }
        if rest_s > 1e-9 * whole_s {
            found.push(share(KEPT, None, rest_s));
        }
    }
    found.sort_by(|a, b| b.percent.total_cmp(&a.percent));
    found
}

/// Two reasons may read the same.
fn add(found: &mut Vec<Share>, share: Share) {
    match found.iter_mut().find(|known| (known.name, &known.reason) == (share.name, &share.reason)) {
        Some(known) => known.percent += share.percent,
        None => found.push(share),
    }
}

/// Whole percents that add to 100 (largest remainders), of shares that do.
pub fn whole(shares: &[Share]) -> Vec<u32> {
    let mut whole: Vec<u32> = shares.iter().map(|share| share.percent as u32).collect();
    let missing = 100_u32.saturating_sub(whole.iter().sum()) as usize;
    let mut order: Vec<usize> = (0..shares.len()).collect();
    let rest = |i: &usize| shares[*i].percent.fract();
    order.sort_by(|a, b| rest(b).total_cmp(&rest(a)));
    for &index in order.iter().take(missing) {
        whole[index] += 1;
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nc::Freeze;
    use crate::outcome::Check;
    use crate::rewrite::Stats;
    use crate::schedule::problem::{Kept, KeptPlace};
    use crate::schedule::{NotRaised, Realised, Schedule};

    fn written(active_s: Vec<(LimitKind, f64)>, not_raised_s: Vec<(Kept, f64)>) -> Written {
        Written {
            bytes: Vec::new(),
            files: Vec::new(),
            after: Vec::new(),
            realised_after: Realised::default(),
            schedule: Schedule { active_s, not_raised_s, ..Schedule::default() },
            stats: Stats::default(),
            kept: Vec::new(),
            check: Check::default(),
        }
    }

    #[test]
    fn shares_add_to_one_hundred_with_what_is_kept_by_reason() {
        let active = vec![(LimitKind::ForceXy, 5.0), (LimitKind::Programmed, 4.0), (LimitKind::Jerk, 3.0)];
        let here = |why| Kept { why, place: KeptPlace::Here };
        let kept = vec![(here(NotRaised::Plunge), 1.0), (here(NotRaised::Frozen(Freeze::Tool)), 2.0)];
        let found = shares(&written(active, kept));
        assert!((found.iter().map(|share| share.percent).sum::<f64>() - 100.0).abs() < 1e-9);
        assert_eq!(whole(&found).iter().sum::<u32>(), 100, "{found:?}");
        let names: Vec<_> = found.iter().map(|share| (share.name, share.reason.is_some())).collect();
        assert_eq!(names[..3], [("force_xy", false), ("jerk", false), (KEPT, true)]);
        assert!(found.contains(&Share { name: KEPT, reason: None, percent: 100.0 / 12.0 }), "{found:?}");
        assert!(shares(&written(Vec::new(), Vec::new())).is_empty());
    }

    #[test]
    fn a_feed_kept_for_another_place_is_said_as_such() {
        let at = |place| (Kept { why: NotRaised::Entry, place }, 1.0);
        let kept = vec![at(KeptPlace::Here), at(KeptPlace::SameFeed), at(KeptPlace::AnotherRun)];
        let found = shares(&written(vec![(LimitKind::Programmed, 3.0)], kept));
        let reasons: Vec<String> = found.into_iter().filter_map(|share| share.reason).collect();
        assert!(reasons[0].starts_with("lead-in"));
        assert!(reasons[1].starts_with("for another place with the same F word: lead-in"));
        assert!(reasons[2].contains("runs of the same line") && reasons[2].contains("--expand"));
    }
}
