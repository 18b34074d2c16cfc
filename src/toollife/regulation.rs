//! The pace of wear with which a tool lasts. In: the trend of its index, its wear law, the length that it still has to cut. Out: feeds relative
//! to those of the plan.
//!
//! Two ways. *By budget*: the pace (f/f₀)^p, as a mean over the length to come, with which the tool reaches the target with the
//! assurance asked for; the program's own feeds then follow from a budget of wear, in least time
//! ([`crate::schedule::budget`]). *By shift* (Ibaraki, Shimizu, Matsubara, section 3.2): the force at the next check point is to
//! lie on the target line, and the whole profile of feeds is shifted by the ratio that brings it there.
//!
//! Both require p > 0. Where p ≤ 0 a slower feed does not spare the tool, so feeds are never lowered. Where p < 0 a faster feed spares it, but
//! would ruin it if the declared p were wrong: feeds rise only if readings show p < 0 with the required assurance, and then as far as the
//! limits allow, which costs no time.

use super::exponent::Estimate;
use super::trend::Trend;
use crate::machine::WearLaw;

/// A line of force against the length cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetLine {
    /// Where regulation begins, m.
    pub from_m: f64,
    /// Force there, N.
    pub from_n: f64,
    /// Where the tool is to be used up, m.
    pub to_m: f64,
    /// Force there, N.
    pub to_n: f64,
}

impl TargetLine {
    /// Force at a length, N; beyond the target that of the target.
    pub fn at(&self, m: f64) -> f64 {
        let span = (self.to_m - self.from_m).max(f64::MIN_POSITIVE);
        self.from_n + (self.to_n - self.from_n) * ((m - self.from_m) / span).clamp(0.0, 1.0)
    }
    /// Ratio of feeds with which the force is on the line at the next check point, `next_m`: there the force at the reference
    /// feed will be `expected_n`, and it changes by `per_ratio_n` times the ratio less one.
    #[cfg(feature = "rooms")]
    pub fn shift(&self, next_m: f64, expected_n: f64, per_ratio_n: f64) -> f64 {
        1.0 + (self.at(next_m) - expected_n) / per_ratio_n
    }
}

/// What regulation does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Regulation {
    /// Feeds so that the mean pace of wear over the rest is this.
    Pace(f64),
    /// Feeds unchanged: a slower feed does not spare this tool (p ≤ 0), and it is not certain that a faster one does.
    AsTheyAre,
    /// Feeds as high as limits allow: by the readings, a faster feed spares this tool.
    Faster,
    /// The probability that the index has reached its end is higher than allowed: no feed helps.
    WornOut,
}

/// Pace of wear with which a tool lasts for `rest_m` more metres with probability `assurance`. `now_m`: what it has cut, at the
/// reference feed. `seen`: what readings say of the power of the feed.
pub fn regulate(
    trend: &Trend,
    law: &WearLaw,
    seen: Option<&Estimate>,
    [now_m, rest_m]: [f64; 2],
    assurance: f64,
) -> Regulation {
    let end_m = trend.worn_out_m(1.0 - assurance, law.end, law.end_scatter);
    let left_m = end_m.map_or(f64::INFINITY, |end_m| end_m - now_m);
    let faster_spares = law.rate.exponent < 0.0 && seen.is_some_and(|seen| 1.0 - seen.spares >= assurance);
    if faster_spares {
        Regulation::Faster
    } else if !law.slower_is_safer() {
        Regulation::AsTheyAre
    } else if left_m <= 0.0 {
        Regulation::WornOut
    } else {
        Regulation::Pace(left_m / rest_m)
    }
}

/// Ratio of feeds with a pace of wear; 1 where the pace does not depend on the feed.
#[cfg(any(test, feature = "rooms"))]
pub fn ratio_of_pace(law: &WearLaw, pace: f64) -> f64 {
    if law.rate.exponent == 0.0 { 1.0 } else { pace.max(0.0).powf(law.rate.exponent.recip()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::WearRate;
    use crate::toollife::trend::{Known, Reading, trend};

    fn law(exponent: f64) -> WearLaw {
        WearLaw { rate: WearRate::along_path(4e-4, 0.1, exponent), end: 400.0, rate_scatter: 0.2, end_scatter: 0.0 }
    }

    fn seen() -> Trend {
        let readings: Vec<Reading> =
            (1..=8).map(|k| 20.0 * f64::from(k)).map(|at_m| Reading { at_m, index: 150.0 + 0.4 * at_m }).collect();
        trend(&readings, &Known { rate: 0.4, rate_deviation: 0.08, noise: 2.0 }).unwrap()
    }

    #[test]
    fn the_pace_uses_up_what_is_left_over_the_rest() {
        // Worn out at 625 m; 160 are cut.
        let Regulation::Pace(pace) = regulate(&seen(), &law(1.0), None, [160.0, 465.0], 0.5) else { panic!() };
        assert!((pace - 1.0).abs() < 1e-4, "{pace}");
        let Regulation::Pace(sure) = regulate(&seen(), &law(1.0), None, [160.0, 465.0], 0.9) else { panic!() };
        assert!(sure < pace, "{sure}");
        let Regulation::Pace(longer) = regulate(&seen(), &law(2.0), None, [160.0, 930.0], 0.5) else { panic!() };
        assert!((longer - 0.5).abs() < 1e-4);
        assert!((ratio_of_pace(&law(2.0), longer) - 0.5f64.sqrt()).abs() < 1e-4);
        assert_eq!(regulate(&seen(), &law(1.0), None, [700.0, 10.0], 0.5), Regulation::WornOut);
    }

    #[test]
    fn where_slower_is_no_safer_nothing_is_slowed_and_what_is_not_sure_is_not_sped_up() {
        let seen = |spares| Estimate { power: -0.8, deviation: 0.3, is_told: true, refutes: false, spares };
        let of = |p: f64, seen: Option<Estimate>| regulate(&self::seen(), &law(p), seen.as_ref(), [160.0, 500.0], 0.9);
        for p in [-1.0, 0.0] {
            assert_eq!([of(p, None), of(p, Some(seen(0.11)))], [Regulation::AsTheyAre; 2]);
        }
        assert_eq!(
            [of(-1.0, Some(seen(0.09))), of(0.0, Some(seen(0.09)))],
            [Regulation::Faster, Regulation::AsTheyAre]
        );
    }

    #[test]
    fn the_line_ends_at_the_target_and_the_shift_meets_it() {
        let line = TargetLine { from_m: 210.0, from_n: 250.0, to_m: 400.0, to_n: 400.0 };
        assert_eq!([line.at(210.0), line.at(305.0), line.at(400.0), line.at(700.0)], [250.0, 325.0, 400.0, 400.0]);
        let ratio = line.shift(305.0, 300.0, 163.2);
        assert!((300.0 + 163.2 * (ratio - 1.0) - 325.0).abs() < 1e-9);
    }
}
