//! Every threshold by which learning decides: what counts as an effect, what as unexplained, what forbids a model file.
//!
//! Units stand in the names or the comments; shares have none. *Judgement* marks what no paper gives: those were set so
//! that the logs of `benches/confusion` (hidden effects, development seeds) are answered rightly, and are held by its
//! matrix and the tests of learn.

use crate::effects::Way;

/// The thresholds of a diagnosis as data, so that the answers can be had with each of them halved and doubled
/// (`benches/thresholds.rs`).
macro_rules! thresholds {
    ($($(#[$doc:meta])* $name:ident = $value:literal;)*) => {
        /// By what a diagnosis decides.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Criteria {
            $($(#[$doc])* pub $name: f64,)*
        }

        impl Default for Criteria {
            fn default() -> Self {
                Self { $($name: $value,)* }
            }
        }

        #[cfg(feature = "rooms")]
        impl Criteria {
            /// What each is called.
            pub const NAMES: &'static [&'static str] = &[$(stringify!($name),)*];

            /// The same with one of them so many times as large.
            #[must_use]
            pub fn times(mut self, name: &str, factor: f64) -> Self {
                match name {
                    $(stringify!($name) => self.$name *= factor,)*
                    _ => {}
                }
                self
            }
        }
    };
}

thresholds! {
    /// Least score of an effect in a log: twice the log-likelihood ratio less the charge k ln n of the Bayesian information
    /// criterion (Schwarz 1978). Kass and Raftery (1995) call 6 … 10 "strong"; where an instant or a place is searched for,
    /// its middle is asked for.
    least_score_of_log = 8.0;
    /// The same for tables, where nothing is searched for: the middle of "positive", 2 … 6.
    least_score_of_table = 4.0;
    /// Rivals whose gain (twice the log-likelihood) is this close to that of the best explain the data equally well,
    /// whatever their parameters are charged: below "strong" on the scale of Kass and Raftery.
    confounded_within = 6.0;
    /// The same on data left out: least share of the drop of the best. Judgement.
    as_good = 0.85;
    /// And most standard errors behind it. Judgement.
    as_good_t = 1.0;
    /// How much more another form of an effect must score: "positive" on that scale.
    form_margin = 2.0;
    /// Least relative drop of the held-out error worth an effect. Judgement.
    least_drop = 0.005;
    /// Standard errors over the blocks by which an effect must lower the held-out error: the usual one-standard-error rule
    /// (Breiman and others 1984).
    least_t = 1.0;
    /// Standard errors by which an effect beside others must lower the held-out error: one-sided 5 % of the normal distribution, as
    /// the search has already taken the best once.
    least_t_beside = 1.645;
    /// Standard errors of a curve without a name: some forty curves of seven shapes are looked at, of which one is two
    /// standard errors off by chance only now and then. Judgement.
    curve_t = 2.0;
    /// Least relative drop of the held-out error worth such a curve. Judgement.
    curve_drop = 0.01;
    /// Least share of what the base model leaves beyond the noise that one effect must take away. Judgement.
    least_share = 0.08;
    /// The same of what the effects before it leave: a small effect beside a large one. Judgement.
    least_rest = 0.3;
    /// Least excess of the base model over the noise that shares of it refer to, as a share of its squares. Judgement.
    least_excess = 0.02;
    /// Share of the squares to which the noise is known: a rest smaller than that is no rest to be explained. Judgement.
    noise_known_to = 0.1;
    /// What the engagement of a cut is known to, relative: removal rates over a millimetre of path
    /// (`tests/engage_accuracy.rs`). In a long log everything is significant, the steps of the engagement itself among it,
    /// and some effect always follows those a little.
    engagement_known_to = 0.003;
    /// Least share of the excess that a pair of effects must take away which neither shows alone. Judgement.
    pair_explains = 0.7;
    /// Least error over the noise that makes pairs worth trying. Judgement.
    pair_needed = 1.3;
    /// Most share that a pair may leave of what the base model leaves beyond the noise: two effects together follow nearly
    /// any structure, but not to the end. Judgement.
    most_left = 0.07;
    /// The squares of a noise with memory over those that neighbouring readings show. Judgement.
    noise_with_memory = 2.0;
    /// How much worse another kind of cut may be predicted, as a share of the error. Judgement.
    harm = 0.02;
    /// And by how many standard errors, before an effect is refused for it. Judgement.
    harm_t = 1.0;
    /// Most range of a covariate within an operation, over its range in the log, at which it changes between operations
    /// only. A spindle keeps its speed to some percent under load (slip of an induction motor, some 3 %).
    steady_within = 0.05;
}

/// Share of the residual's variance that a pattern predicts on blocks it was not learned on, from which what is left is
/// called structure; twice as much in tables, whose blocks are few. Judgement.
const STRUCTURE: f64 = 0.15;
/// An acceleration that the times of the blocks show counts below this share of the declared one, and with so many
/// nats. Judgement.
const SLOWER_THAN: f64 = 0.6;
const SLOWER_NATS: f64 = 30.0;

/// Fewest samples that place an instant or a region. Judgement.
pub(in crate::learn) const PLACED_BY: usize = 40;

impl Criteria {
    /// Does an effect pay for its parameters?
    pub(in crate::learn) fn least_score(&self, is_log: bool) -> f64 {
        if is_log { self.least_score_of_log } else { self.least_score_of_table }
    }

    /// Does it take away enough: of what the base model leaves beyond the noise, or of what the effects before it leave?
    pub(in crate::learn) fn takes_enough(&self, share: f64, of_rest: f64) -> bool {
        share >= self.least_share || of_rest >= self.least_rest
    }

    /// Is the held-out error lower, by its size and by the scatter of the blocks?
    pub(in crate::learn) fn lowers_held_out(&self, drop: f64, t: f64) -> bool {
        drop >= self.least_drop && t >= self.least_t
    }

    /// The same of an effect beside those that were found before it.
    pub(in crate::learn) fn lowers_held_out_beside(&self, drop: f64, t: f64) -> bool {
        drop >= self.least_drop && t >= self.least_t_beside
    }

    /// Does a rival leave as little on data left out as the best? `share`: of its drop; `t`: of what the best leaves less.
    pub(in crate::learn) fn leaves_as_much(&self, share: f64, t: f64) -> bool {
        share >= self.as_good && t < self.as_good_t
    }

    /// Does one take nearly all of what another takes, by their drops of the held-out error?
    pub(in crate::learn) fn takes_as_much(&self, share: f64) -> bool {
        share >= self.as_good
    }

    /// Does a residual follow a curve over a covariate?
    pub(in crate::learn) fn follows_a_curve(&self, drop: f64, t: f64) -> bool {
        drop >= self.curve_drop && t >= self.curve_t
    }

    /// Do two effects explain together enough of what neither shows alone?
    pub(in crate::learn) fn pair_explains(&self, share: f64, t: f64) -> bool {
        share >= self.pair_explains && t >= self.least_t
    }

    /// Is there so much beyond the noise that pairs are worth trying?
    pub(in crate::learn) fn pairs_are_worth_it(&self, error: f64, noise: f64) -> bool {
        error >= self.pair_needed * noise
    }

    /// Is more than a small share left of what lies beyond any noise?
    pub(in crate::learn) fn leaves_much(&self, beyond_before: f64, beyond_after: f64) -> bool {
        beyond_after > self.most_left * beyond_before
    }

    /// Does an effect make a kind of cut worse that it was not fitted on? `ratio`: its error with over without; `t`: of the
    /// improvement.
    pub(in crate::learn) fn harms(&self, ratio: f64, t: f64) -> bool {
        ratio > 1.0 + self.harm && t < -self.harm_t
    }

    /// Does an effect raise the error over operations that were left out in turn? `drop`: by how much it falls.
    pub(in crate::learn) fn harms_elsewhere(&self, drop: f64) -> bool {
        drop < -self.harm
    }

    /// Does it lower that error, so that a curve earns the name of a family?
    pub(in crate::learn) fn lowers_elsewhere(&self, drop: f64) -> bool {
        drop >= self.least_drop
    }

    /// Is a covariate the same all through an operation? `within`: its range there; `all`: its range over the log.
    pub(in crate::learn) fn is_steady_within(&self, within: f64, all: f64) -> bool {
        within <= self.steady_within * all
    }

    /// Does a pattern without a name explain clearly more than a named effect? `t`: mean improvement over its standard
    /// error, block by block; no less than a named effect has to show.
    pub(in crate::learn) fn is_clearly_better(&self, t: f64) -> bool {
        t > self.least_t
    }
}

/// Is a pattern of the residual called structure?
pub(in crate::learn) fn is_structure(test_r2: f64, is_log: bool) -> bool {
    test_r2 > if is_log { STRUCTURE } else { 2.0 * STRUCTURE }
}

/// Most that a curve may go back of what it goes forward, and still go one way. Judgement.
const GOES_BACK: f64 = 0.25;

/// Does a curve through these values go this way?
pub(in crate::learn) fn goes(way: Way, values: &[f64]) -> bool {
    let rises = |sign: f64| values.windows(2).map(|pair| (sign * (pair[1] - pair[0])).max(0.0)).sum::<f64>();
    let (up, down) = (rises(1.0), rises(-1.0));
    match way {
        Way::Up => down <= GOES_BACK * up,
        Way::Down => up <= GOES_BACK * down,
        Way::NoPeak => {
            let [least, most] = range(values);
            let ends = values.first().copied().unwrap_or(0.0).max(values.last().copied().unwrap_or(0.0));
            most - ends <= GOES_BACK * (most - least)
        }
        Way::Either => true,
    }
}

/// Least and greatest of some values.
fn range(values: &[f64]) -> [f64; 2] {
    values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(*v), b.max(*v)])
}

/// Most times that a load turns back along a quantity of the cut: one peak or one trough, as at a resonance or an optimum speed.
/// Judgement.
pub(in crate::learn) const MOST_TURNS: usize = 1;

/// The same along a place: a layer, or a zone, between two others. Judgement.
pub(in crate::learn) const MOST_TURNS_OF_A_PLACE: usize = 2;

/// Least share of Σ w l² in a part of a curve whose height counts for its way. Judgement.
pub(in crate::learn) const LEAST_WEIGHT: f64 = 0.02;

/// How often a curve through these values turns back, by more than [`GOES_BACK`] of its range.
pub(in crate::learn) fn turns(values: &[f64]) -> usize {
    let [lowest, highest] = range(values);
    let least = GOES_BACK * (highest - lowest);
    let (mut turns, mut way, mut farthest) = (0, 0.0, values.first().copied().unwrap_or(0.0));
    for value in values {
        let by = value - farthest;
        if by * way >= 0.0 && way != 0.0 {
            farthest = *value;
        } else if by.abs() > least {
            turns += usize::from(way != 0.0);
            (way, farthest) = (by.signum(), *value);
        }
    }
    turns
}

/// Do the times of the blocks show a slower machine?
pub(in crate::learn) fn is_slower(factor: f64, nats: f64) -> bool {
    factor < SLOWER_THAN && nats > SLOWER_NATS
}

/// Least rise of a factor over a log that is worth a word, and over its standard error: of a jump, whose instant is
/// searched for among the windows, and of a steady rise. Judgement.
const LEAST_CHANGE: f64 = 0.05;
const JUMP_STANDS_OUT: f64 = 6.0;
const RISE_STANDS_OUT: f64 = 4.0;

/// Do the coefficients jump within a log?
pub(in crate::learn) fn is_jump(by: f64, error: f64) -> bool {
    by > LEAST_CHANGE && by > JUMP_STANDS_OUT * error
}

/// Do they rise steadily over a log?
pub(in crate::learn) fn is_rise(by: f64, error: f64) -> bool {
    by > LEAST_CHANGE && by > RISE_STANDS_OUT * error
}

/// Share of the samples that may be misplaced before the log is that of another program: a load is never followed
/// exactly. Judgement.
const MISFIT: f64 = 0.3;
const MISFIT_OF_LOAD: f64 = 0.6;
/// Least share of the program that a log must cover to support a model, and below which it is said. Judgement.
const COVERED: f64 = 0.3;
const COVERED_UNSAID: f64 = 0.9;
/// Most share of the samples in feed moves at which the tool may stand. Judgement.
const STANDING: f64 = 0.5;
/// Time of the log over that of the program, beyond which the unit of the clock is wrong rather than the machine slow.
const STRETCH: [f64; 2] = [0.1, 10.0];
/// Measured loads or coefficients over declared ones, beyond which units are wrong rather than the material: inches for
/// mm, kN for N and kW for W differ by 25 and more; pounds for newtons (4.4) pass.
const OVER_DECLARED: [f64; 2] = [0.05, 20.0];
/// Tangential cutting coefficients of materials that are milled, wood to superalloys, N/mm².
const MATERIALS_N_MM2: [f64; 2] = [20.0, 20_000.0];
/// Share of the variance below which a model explains next to nothing: of a log or table, and of a calibration.
/// Judgement.
const NEXT_TO_NOTHING: f64 = 0.2;
const NEXT_TO_NOTHING_OF_CALIBRATION: f64 = 0.3;
/// Condition number of the base fit from which its coefficients are not told apart: half the digits of a double.
const INDISTINCT: f64 = 1e6;
/// Error with the effects over that without, on data kept for the judgement, beyond which they support no model.
const WORSE: f64 = 1.001;
/// Standard errors below zero from which a coefficient is negative and not merely uncertain.
const NEGATIVE: f64 = 2.0;

/// Do so many samples not fit that it is the log of another program?
pub(in crate::learn) fn is_of_another_program(misfit: f64, by_load: bool) -> bool {
    misfit > if by_load { MISFIT_OF_LOAD } else { MISFIT }
}

/// Does a log cover too little of its program for a model?
pub(in crate::learn) fn covers_too_little(share: f64) -> bool {
    share < COVERED
}

/// Does the tool stand for so much of the feed moves that its positions are not those of the program? An operator who
/// holds it for as long as the program runs is none that coefficients should come from.
pub(in crate::learn) fn stands_too_long(share: f64) -> bool {
    share > STANDING
}

/// Is it worth a word that a log does not cover all of its program?
pub(in crate::learn) fn covers_in_part(share: f64) -> bool {
    share < COVERED_UNSAID
}

/// Is the time of a log over that of its program one that machines have?
pub(in crate::learn) fn is_stretch_of_a_machine(stretch: f64) -> bool {
    (STRETCH[0]..=STRETCH[1]).contains(&stretch)
}

/// Is a measured load or coefficient over the declared one that of a material, and not of a wrong unit?
pub(in crate::learn) fn is_ratio_of_materials(ratio: f64) -> bool {
    (OVER_DECLARED[0]..=OVER_DECLARED[1]).contains(&ratio)
}

/// Is it the tangential cutting coefficient of a material, N/mm²?
pub(in crate::learn) fn is_of_a_material(k_tc_n_mm2: f64) -> bool {
    (MATERIALS_N_MM2[0]..=MATERIALS_N_MM2[1]).contains(&k_tc_n_mm2)
}

/// Does a model explain next to nothing of a log or a table?
pub(in crate::learn) fn explains_next_to_nothing(r2: f64) -> bool {
    r2 < NEXT_TO_NOTHING
}

/// The same of a calibration.
pub(in crate::learn) fn is_no_calibration(r2: f64) -> bool {
    r2.is_nan() || r2 < NEXT_TO_NOTHING_OF_CALIBRATION
}

/// Are the base coefficients told apart?
pub(in crate::learn) fn tells_apart(condition: f64) -> bool {
    condition < INDISTINCT
}

/// Is the error on the data kept for the judgement no larger with the effects than without? By more than a tenth of a
/// percent: the judgement has its own noise.
pub(in crate::learn) fn is_no_worse(before: f64, after: f64) -> bool {
    after <= before * WORSE
}

/// Is a coefficient negative beyond its error?
pub(in crate::learn) fn is_negative(value: f64, std_error: f64) -> bool {
    value < -NEGATIVE * std_error
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is let through, and beside it what is stopped.
    #[test]
    fn an_effect_is_named_on_one_side_of_every_threshold_and_not_on_the_other() {
        let c = Criteria::default();
        assert_eq!([true, false].map(|is_log| c.least_score(is_log)), [8.0, 4.0]);
        assert!(c.takes_enough(0.081, 0.0) && c.takes_enough(0.0, 0.31) && !c.takes_enough(0.079, 0.29));
        assert!(c.lowers_held_out(0.006, 1.1) && !c.lowers_held_out(0.004, 9.0) && !c.lowers_held_out(0.5, 0.9));
        assert!(c.leaves_as_much(0.86, 0.9) && !c.leaves_as_much(0.84, 0.0) && !c.leaves_as_much(1.0, 1.1));
        assert!(c.takes_as_much(0.86) && !c.takes_as_much(0.84));
        assert!(c.follows_a_curve(0.011, 2.1) && !c.follows_a_curve(0.009, 9.0) && !c.follows_a_curve(0.5, 1.9));
        assert!(c.pair_explains(0.71, 1.1) && !c.pair_explains(0.69, 9.0) && !c.pair_explains(0.9, 0.9));
        assert!(c.pairs_are_worth_it(1.31, 1.0) && !c.pairs_are_worth_it(1.29, 1.0));
        assert!(c.leaves_much(1.0, 0.08) && !c.leaves_much(1.0, 0.06));
        assert!(c.harms(1.03, -1.1) && !c.harms(1.01, -9.0) && !c.harms(1.5, -0.9));
        assert!(c.lowers_elsewhere(0.006) && !c.lowers_elsewhere(0.004));
        assert!(c.lowers_held_out_beside(0.006, 1.7) && !c.lowers_held_out_beside(0.006, 1.6));
        assert!(c.is_steady_within(0.04, 1.0) && !c.is_steady_within(0.06, 1.0));
        assert!(c.harms_elsewhere(-0.03) && !c.harms_elsewhere(-0.01));
        assert!(c.is_clearly_better(1.1) && !c.is_clearly_better(0.9));
        assert!(is_slower(0.59, 31.0) && !is_slower(0.61, 99.0) && !is_slower(0.1, 29.0));
    }

    #[test]
    fn each_threshold_is_changed_by_its_name_and_no_other() {
        let usual = Criteria::default();
        let halved: Vec<Criteria> = Criteria::NAMES.iter().map(|name| usual.times(name, 0.5)).collect();
        let mut together = usual;
        for (name, one) in Criteria::NAMES.iter().zip(&halved) {
            assert!(*one != usual && one.times(name, 2.0) == usual, "{name}");
            together = together.times(name, 0.5);
        }
        assert!((together.least_t - 0.5).abs() < 1e-12 && (together.steady_within - 0.025).abs() < 1e-12);
        assert_eq!(usual.times("gremlins", 9.0), usual);
    }

    #[test]
    fn a_curve_goes_one_way_though_it_goes_back_a_little() {
        assert!(goes(Way::Up, &[1.0, 1.2, 1.16, 1.3]) && !goes(Way::Up, &[1.0, 1.2, 1.1, 1.2]));
        assert!(goes(Way::Down, &[1.3, 1.0]) && !goes(Way::Down, &[1.0, 1.3, 1.0]) && !goes(Way::Up, &[1.0, 1.3, 1.0]));
        assert!(goes(Way::Either, &[1.0, 1.3, 1.0]));
        assert!(
            goes(Way::NoPeak, &[1.3, 1.0, 1.2])
                && goes(Way::NoPeak, &[1.0, 1.3])
                && goes(Way::NoPeak, &[1.0, 1.3, 1.28])
        );
        assert!(!goes(Way::NoPeak, &[1.0, 1.3, 1.0]));
    }

    #[test]
    fn a_curve_turns_back_where_it_goes_back_by_more_than_a_quarter_of_its_range() {
        assert_eq!(turns(&[1.0, 1.1, 1.3]), 0);
        assert_eq!(turns(&[1.0, 1.3, 1.0]), 1);
        assert_eq!(turns(&[1.0, 1.3, 1.24, 1.3]), 0);
        assert_eq!([turns(&[1.0, 1.3, 1.0, 1.06]), turns(&[1.0, 1.3, 1.0, 1.1])], [1, 2]);
    }

    #[test]
    fn a_change_within_a_log_is_said_when_it_is_large_and_clear() {
        assert!(is_jump(0.07, 0.01) && !is_jump(0.04, 0.001) && !is_jump(0.07, 0.012));
        assert!(is_rise(0.07, 0.012) && !is_rise(0.04, 0.001) && !is_rise(0.07, 0.02));
    }

    #[test]
    fn structure_in_a_table_must_be_twice_as_clear_as_in_a_log() {
        assert!(is_structure(0.16, true) && !is_structure(0.14, true));
        assert!(is_structure(0.31, false) && !is_structure(0.29, false));
    }

    #[test]
    fn wrong_units_and_wrong_programs_support_no_model_and_odd_materials_do() {
        // Superalloy for declared aluminium; kN for N; W for kW.
        assert!(is_ratio_of_materials(5.0) && !is_ratio_of_materials(1e-3) && !is_ratio_of_materials(25.4));
        assert!(is_of_a_material(25.0) && is_of_a_material(9000.0) && !is_of_a_material(0.8) && !is_of_a_material(8e5));
        // A machine at a tenth of its feed; a clock in ms or min for s.
        assert!(
            is_stretch_of_a_machine(9.5) && !is_stretch_of_a_machine(1000.0) && !is_stretch_of_a_machine(1.0 / 60.0)
        );
        assert!(!is_of_another_program(0.29, false) && is_of_another_program(0.31, false));
        assert!(!is_of_another_program(0.59, true) && is_of_another_program(0.61, true));
        assert!(covers_too_little(0.29) && !covers_too_little(0.31));
        assert!(stands_too_long(0.51) && !stands_too_long(0.49));
        assert!(covers_in_part(0.89) && !covers_in_part(0.91));
        assert!(explains_next_to_nothing(0.19) && !explains_next_to_nothing(0.21));
        assert!(is_no_calibration(0.29) && is_no_calibration(f64::NAN) && !is_no_calibration(0.31));
        assert!(is_no_worse(1.0, 1.0009) && !is_no_worse(1.0, 1.002));
        assert!(tells_apart(9e5) && !tells_apart(1.1e6));
        assert!(is_negative(-2.1, 1.0) && !is_negative(-1.9, 1.0));
    }
}
