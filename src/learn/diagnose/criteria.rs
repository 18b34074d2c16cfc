//! Every threshold by which learning decides: what counts as an effect, what as unexplained, what forbids a model file.
//!
//! Units stand in the names or the comments; shares have none. *Judgement* marks a value that no paper gives: it was
//! set on logs with hidden effects (development seeds of `benches/confusion`) so that these are named correctly; the
//! confusion matrix of that benchmark and the tests of learn check it.

use crate::effects::Way;

/// The thresholds of a diagnosis as data, so that `benches/thresholds.rs` can run the diagnosis with each of them
/// halved and doubled.
macro_rules! thresholds {
    ($($(#[$doc:meta])* $name:ident = $value:literal;)*) => {
        /// The thresholds of a diagnosis.
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
            /// Names of the thresholds.
            pub const NAMES: &'static [&'static str] = &[$(stringify!($name),)*];

            /// The same with the named threshold multiplied by `factor`.
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
    /// Least score of an effect in a log. Score: twice the log-likelihood ratio less the charge k ln n of the Bayesian
    /// information criterion (Schwarz 1978). Kass and Raftery (1995) call 6 … 10 "strong"; the middle of that is
    /// required, because an instant or a place is searched for among many.
    least_score_of_log = 8.0;
    /// The same for tables, where nothing is searched for: the middle of "positive", 2 … 6.
    least_score_of_table = 4.0;
    /// Rivals whose gain (twice the log-likelihood ratio, without the charge for parameters) is within this of the best
    /// explain the data equally well: below "strong" on the scale of Kass and Raftery.
    confounded_within = 6.0;
    /// A rival explains as much on held-out data: least ratio of its drop of the held-out error to that of the best.
    /// Judgement.
    as_good = 0.85;
    /// The same: most standard errors by which its held-out error may lie above that of the best. Judgement.
    as_good_t = 1.0;
    /// Least difference of score for which another form of an effect is preferred: "positive" of Kass and Raftery.
    form_margin = 2.0;
    /// Least relative drop of the held-out error for an effect. Judgement.
    least_drop = 0.005;
    /// Standard errors over the blocks by which an effect must lower the held-out error: the usual one-standard-error
    /// rule (Breiman and others 1984).
    least_t = 1.0;
    /// Standard errors by which an effect added to others must lower the held-out error: one-sided 5 % of the normal distribution. More than
    /// `least_t`, because the search has already chosen the best of many. A rival whose error on the readings without a cut is higher by so much is
    /// no rival.
    least_t_beside = 1.645;
    /// Least product of the relative drop of the held-out error and its certainty in standard errors for an effect of the
    /// list: a fifth with 1.5 standard errors, a tenth with three. The smaller the drop, the more of the many effects
    /// that are tried reach it by chance or in the place of a cause that is not in the list. Judgement, on 220 logs of the
    /// generator that knows nothing of the effects (development seeds 12 to 15): of nine effects seen with less, eight
    /// were wrong.
    least_clear = 0.3;
    /// Score from which an effect need not be so clear: what shows in few passes (a face that stands askew) lowers the error of the whole
    /// little, and few passes are few cases. Ten times what Kass and Raftery call "very strong". Judgement.
    decisive_score = 100.0;
    /// Largest probability that the search finds such a gain by chance (p value times the number of models tried) at which an effect is
    /// named beside others: the usual 5 %. The first is judged by what was left out alone: after the many models that are tried
    /// no p value of a table of few cuts is small.
    by_chance = 0.05;
    /// Standard errors by which a curve without a name must lower the held-out error. Some forty curves of seven shapes
    /// are compared; two standard errors by chance are rare even so. Judgement.
    curve_t = 2.0;
    /// Least relative drop of the held-out error for such a curve. Judgement.
    curve_drop = 0.01;
    /// Least share of the base model's excess (held-out squares beyond those of the noise) that an effect must remove.
    /// Judgement.
    least_share = 0.08;
    /// Or least share of the excess that the effects before it leave: admits a small effect beside a large one.
    /// Judgement.
    least_rest = 0.3;
    /// Least excess by which such a share is divided, as a share of the base model's squares. Judgement.
    least_excess = 0.02;
    /// Accuracy of the noise, as a share of the squares: a smaller excess is taken for noise. Judgement.
    noise_known_to = 0.1;
    /// Relative accuracy of the removal rate over a millimetre of path (`tests/engage_accuracy.rs`). In a long log the
    /// errors of the engagement itself become significant, and some effect always correlates with them a little.
    engagement_known_to = 0.003;
    /// Least share of the excess that a pair of effects must remove together when neither is found alone. Judgement.
    pair_explains = 0.7;
    /// Least ratio of the held-out error to the noise at which pairs are tried. Judgement.
    pair_needed = 1.3;
    /// Largest share of the base model's excess that a pair may leave: two wrong effects together fit nearly any
    /// structure, but not completely. Judgement.
    most_left = 0.07;
    /// Variance of an autocorrelated noise over that computed from differences of neighbouring readings. Judgement.
    noise_with_memory = 2.0;
    /// Relative rise of the error on another kind of cut above which an effect is refused. Judgement.
    harm = 0.02;
    /// Standard errors which that rise must reach as well. Judgement.
    harm_t = 1.0;
    /// Largest ratio of a covariate's range within an operation to its range in the log at which it counts as changing
    /// between operations only. A spindle keeps its speed under load to about 3 % (slip of an induction motor).
    steady_within = 0.05;
}

/// Share of the residual's variance that a pattern must predict on blocks it was not learned on to be called structure;
/// twice as much in tables, whose blocks are few. Judgement.
const STRUCTURE: f64 = 0.15;
/// The block times show a slower machine if the fitted acceleration is below this share of the declared one and its
/// log-likelihood is higher by at least SLOWER_NATS. Judgement.
const SLOWER_THAN: f64 = 0.6;
const SLOWER_NATS: f64 = 30.0;

/// Scatters of the rest by which a cut of a table is missed by the model of the others where it is outlying. Among 100 cuts with the scatter of
/// a normal distribution one in 5 million tables has such a cut.
const OUTLYING: f64 = 6.0;
/// Largest share of the cuts of a table that may be outlying, and fewest cuts of a table in which they are sought: with fewer a single cut
/// decides a coefficient, and no other one can contradict it. Judgement.
const MOST_OUTLYING: f64 = 0.05;
const FEWEST_TO_CONTRADICT: usize = 20;

/// Fewest cuts of a table beyond the parameters of a model: of ν the scatter is known to 1/√(2ν), of five to a third. Judgement, on 108 tables of 6 to
/// 24 cuts without any effect: with none asked for 44 of them had a name.
const FEWEST_LEFT: usize = 5;

/// Ratio of loads from which two set-ups differ for a reason worth looking for: the accuracy of a power meter on a spindle. Judgement.
const SET_UPS_APART: f64 = 1.03;

/// Fewest samples at a ceiling of a reading, and largest share of all: the others have to tell the base coefficients. Judgement, like the
/// three that follow.
const FEWEST_AT_CEILING: usize = 4;
const MOST_AT_CEILING: f64 = 0.75;
/// Largest scatter of the readings about the ceiling, over that of the other samples about the base model.
const CEILING_SCATTER: f64 = 1.5;
/// Least mean excess of the predicted loads over the ceiling, over the scatter of the others.
const BEYOND_CEILING: f64 = 1.0;
/// Largest slope of the readings at the ceiling over the load predicted for them: 0 is a ceiling, 1 is none.
const CEILING_SLOPE: f64 = 0.3;

/// Fewest samples from which an instant or a region is located. Judgement.
pub(in crate::learn) const PLACED_BY: usize = 40;

/// The worst of n + 1 equal stretches of a log is a given one by chance in 1 of n + 1 cases: 5 % for n = 19.
const FEWEST_IN_A_RANK: usize = 19;

impl Criteria {
    /// Least score of an effect: its gain must exceed the charge for its parameters by so much.
    pub(in crate::learn) fn least_score(&self, is_log: bool) -> f64 {
        if is_log { self.least_score_of_log } else { self.least_score_of_table }
    }

    /// Does an effect remove enough? `share`: of the base model's excess over the noise; `of_rest`: of what the effects
    /// before it leave.
    pub(in crate::learn) fn takes_enough(&self, share: f64, of_rest: f64) -> bool {
        share >= self.least_share || of_rest >= self.least_rest
    }

    /// Is the held-out error lower? `drop`: relative; `t`: mean improvement over its standard error between blocks.
    pub(in crate::learn) fn lowers_held_out(&self, drop: f64, t: f64) -> bool {
        drop >= self.least_drop && t >= self.least_t
    }

    /// The same for an effect of the list, whose drop must be the clearer the smaller it is, unless its score is decisive.
    pub(in crate::learn) fn lowers_clearly(&self, drop: f64, t: f64, score: f64) -> bool {
        self.lowers_held_out(drop, t) && (drop * t >= self.least_clear || score >= self.decisive_score)
    }

    /// The same for an effect added to those found before it.
    pub(in crate::learn) fn lowers_held_out_beside(&self, drop: f64, t: f64) -> bool {
        drop >= self.least_drop && t >= self.least_t_beside
    }

    /// Is a rival's held-out error as low as the best one's? `share`: its drop over that of the best; `t`: by how many
    /// standard errors the best is lower.
    pub(in crate::learn) fn leaves_as_much(&self, share: f64, t: f64) -> bool {
        share >= self.as_good && t < self.as_good_t
    }

    /// Is a held-out error on part of the data larger beyond doubt? `t`: by how many standard errors.
    pub(in crate::learn) fn is_surely_worse(&self, t: f64) -> bool {
        t >= self.least_t_beside
    }

    /// Does one lower the held-out error nearly as much as another? `share`: its drop over the other's.
    pub(in crate::learn) fn takes_as_much(&self, share: f64) -> bool {
        share >= self.as_good
    }

    /// Does a residual follow a curve over a covariate? Arguments as for [`Self::lowers_held_out`].
    pub(in crate::learn) fn follows_a_curve(&self, drop: f64, t: f64) -> bool {
        drop >= self.curve_drop && t >= self.curve_t
    }

    /// Do two effects together remove enough? `share`: of the base model's excess over the noise.
    pub(in crate::learn) fn pair_explains(&self, share: f64, t: f64) -> bool {
        share >= self.pair_explains && t >= self.least_t
    }

    /// Is the held-out error so far above the noise that pairs are tried?
    pub(in crate::learn) fn pairs_are_worth_it(&self, error: f64, noise: f64) -> bool {
        error >= self.pair_needed * noise
    }

    /// Is more than a small share of the excess left? Arguments: squares beyond the noise, before and after.
    pub(in crate::learn) fn leaves_much(&self, beyond_before: f64, beyond_after: f64) -> bool {
        beyond_after > self.most_left * beyond_before
    }

    /// Does an effect raise the error on a kind of cut that it was not fitted on? `ratio`: error with the effect over
    /// error without; `t`: mean improvement over its standard error, negative where the error rises.
    pub(in crate::learn) fn harms(&self, ratio: f64, t: f64) -> bool {
        ratio > 1.0 + self.harm && t < -self.harm_t
    }

    /// Does an effect raise the error when each operation is left out in turn? `drop`: relative fall of that error.
    pub(in crate::learn) fn harms_elsewhere(&self, drop: f64) -> bool {
        drop < -self.harm
    }

    /// Does it lower that error? Required for a curve to be reported under the name of an effect.
    pub(in crate::learn) fn lowers_elsewhere(&self, drop: f64) -> bool {
        drop >= self.least_drop
    }

    /// Is a covariate constant within an operation? `within`: its range there; `all`: its range over the log.
    pub(in crate::learn) fn is_steady_within(&self, within: f64, all: f64) -> bool {
        within <= self.steady_within * all
    }

    /// May the search have found this gain by chance?
    pub(in crate::learn) fn may_be_chance(&self, p_value: f64) -> bool {
        p_value > self.by_chance
    }

    /// Does a rival explain clearly more? `t`: mean improvement over its standard error between blocks; the threshold
    /// is that of a named effect.
    pub(in crate::learn) fn is_clearly_better(&self, t: f64) -> bool {
        t > self.least_t
    }
}

/// Is a pattern of the residual structure? `test_r2`: share of the variance predicted on blocks it was not learned on.
pub(in crate::learn) fn is_structure(test_r2: f64, is_log: bool) -> bool {
    test_r2 > if is_log { STRUCTURE } else { 2.0 * STRUCTURE }
}

/// Largest fall of a curve, as a share of its rise, at which it still counts as rising; likewise for falling curves.
/// Judgement.
const GOES_BACK: f64 = 0.25;

/// Least difference between the factors of a curve that bears the name of an effect: coefficients of one material scatter by as much
/// from bar to bar. Judgement; a smaller curve is reported without a name.
const LEAST_NAMED: f64 = 0.04;

/// Is a curve with these factors large enough to bear the name of an effect, and does it go its way?
pub(in crate::learn) fn bears_name(way: Way, factors: &[f64]) -> bool {
    let [least, most] = range(factors);
    most - least >= LEAST_NAMED && has_way(way, factors)
}

/// Does a curve through these values rise, fall or have no peak, as `way` requires?
pub(in crate::learn) fn has_way(way: Way, values: &[f64]) -> bool {
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

/// Most turning points of a load over a quantity of the cut: one peak or one trough, as at a resonance or an optimum
/// speed. Judgement.
pub(in crate::learn) const MOST_TURNS: usize = 1;

/// The same along a position: a layer or zone between two others. Judgement.
pub(in crate::learn) const MOST_TURNS_OF_A_PLACE: usize = 2;

/// Parts of a curve with less than this share of Σ w l² (weight w, load l) are ignored when its turning points are
/// counted. Judgement.
pub(in crate::learn) const LEAST_WEIGHT: f64 = 0.02;

/// How often a curve through these values reverses by more than [`GOES_BACK`] of its range.
pub(in crate::learn) fn turning_points(values: &[f64]) -> usize {
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

/// Do the block times show a slower machine? `factor`: fitted over declared acceleration; `nats`: gain in
/// log-likelihood.
pub(in crate::learn) fn is_slower(factor: f64, nats: f64) -> bool {
    factor < SLOWER_THAN && nats > SLOWER_NATS
}

/// Least rise of a factor on a base coefficient over a log that is reported, and least ratio to its standard error: for
/// a jump (more, because its instant is searched for among the windows) and for a steady rise. Judgement.
const LEAST_CHANGE: f64 = 0.05;
const JUMP_STANDS_OUT: f64 = 6.0;
const RISE_STANDS_OUT: f64 = 4.0;

/// Does a coefficient jump within a log? `by`: rise of its factor; `error`: its standard error.
pub(in crate::learn) fn is_jump(by: f64, error: f64) -> bool {
    by > LEAST_CHANGE && by > JUMP_STANDS_OUT * error
}

/// Does it rise steadily over a log? Arguments as for [`is_jump`].
pub(in crate::learn) fn is_rise(by: f64, error: f64) -> bool {
    by > LEAST_CHANGE && by > RISE_STANDS_OUT * error
}

/// Share of samples that do not fit the program above which the log is taken for that of another one; larger where the
/// log was aligned by its load, which a prediction never matches exactly. Judgement.
const MISFIT: f64 = 0.3;
const MISFIT_OF_LOAD: f64 = 0.6;
/// Least share of the program that a log must cover to support a model; below the second, the share is reported.
/// Judgement.
const COVERED: f64 = 0.3;
const COVERED_UNSAID: f64 = 0.9;
/// Largest share of the samples in feed moves at which the tool may stand still. Judgement.
const STANDING: f64 = 0.5;
/// Range of the ratio of log time to program time outside which the unit of the clock is wrong rather than the machine
/// slow.
const STRETCH: [f64; 2] = [0.1, 10.0];
/// Range of the ratio of measured to declared loads or coefficients outside which units are wrong rather than the
/// material: inches for mm, kN for N and kW for W give factors of 25 and more; pounds for newtons (4.4) are not
/// detected.
const OVER_DECLARED: [f64; 2] = [0.05, 20.0];
/// Tangential cutting coefficients of materials that are milled, wood to superalloys, N/mm².
const MATERIALS_N_MM2: [f64; 2] = [20.0, 20_000.0];
/// R² below which a model explains next to nothing: of a log or table, and of a calibration. Judgement.
const NEXT_TO_NOTHING: f64 = 0.2;
const NEXT_TO_NOTHING_OF_CALIBRATION: f64 = 0.3;
/// Error of mean forces, relative to each, from which they are not those of the cuts of their table: axes or signs are others. Judgement: the
/// published tables have 0.12 to 0.2, forces with one axis turned round 0.8.
const OF_OTHER_AXES: f64 = 0.5;
/// Condition number of the base fit from which its coefficients cannot be separated. Judgement.
const INDISTINCT: f64 = 1e6;
/// Ratio of the error with the effects to that without, on the data kept for the judgement, above which no model is
/// written.
const WORSE: f64 = 1.001;
/// The same ratio for one effect beside the others, above which it is not asserted alone. Judgement: 0.97 or less for every
/// effect that was there on the development seeds 12 to 15, unless the block times showed it; above 0.985 for five that
/// were not.
const GAINS: f64 = 0.98;
/// Standard errors by which an effect must fall short of its whole size there to be refuted: 95 % two-sided.
const SHORT_OF_WHOLE: f64 = 2.0;
/// Standard errors below zero from which a coefficient is negative and not merely uncertain.
const NEGATIVE: f64 = 2.0;

/// Most cuts of a table of so many that may be outlying.
pub(in crate::learn) fn most_outlying(cuts: usize) -> usize {
    if cuts < FEWEST_TO_CONTRADICT { 0 } else { (MOST_OUTLYING * cuts as f64) as usize }
}

/// Is a cut outlying that is missed by so many scatters of the others?
pub(in crate::learn) fn is_outlying(scatters: f64) -> bool {
    scatters >= OUTLYING
}

/// Do so many cuts of a table tell the scatter beside a model of so many parameters?
pub(in crate::learn) fn knows_scatter(cuts: usize, parameters: usize) -> bool {
    cuts >= parameters + FEWEST_LEFT
}

/// Is a set-up whose cuts take so many times the load of the first another cut than that?
pub(in crate::learn) fn is_set_up_apart(factor: f64) -> bool {
    factor.max(1.0 / factor) >= SET_UPS_APART
}

/// Can so many of the samples of a quantity be at its ceiling?
pub(in crate::learn) fn can_be_at_a_ceiling(samples: usize, all: usize) -> bool {
    samples >= FEWEST_AT_CEILING && samples as f64 <= MOST_AT_CEILING * all as f64
}

/// Do samples lie on a ceiling? `scatter`: of their readings about it; `beyond`: mean excess of their predicted loads over it; `others`:
/// scatter of the other samples; `slope`: of their readings over the predicted loads.
pub(in crate::learn) fn is_ceiling(scatter: f64, beyond: f64, others: f64, slope: f64) -> bool {
    scatter <= CEILING_SCATTER * others && beyond >= BEYOND_CEILING * others && slope <= CEILING_SLOPE
}

/// Is it the log of another program? `misfit`: share of samples that do not fit; `by_load`: aligned by the load.
pub(in crate::learn) fn is_of_another_program(misfit: f64, by_load: bool) -> bool {
    misfit > if by_load { MISFIT_OF_LOAD } else { MISFIT }
}

/// Does a log cover too little of its program for a model?
pub(in crate::learn) fn covers_too_little(share: f64) -> bool {
    share < COVERED
}

/// Does the tool stand still in too large a share of the feed-move samples for the positions to be those of the
/// program? A run that the operator held for so long is not used for coefficients either.
pub(in crate::learn) fn stands_too_long(share: f64) -> bool {
    share > STANDING
}

/// Does a log leave out so much of its program that this is reported?
pub(in crate::learn) fn covers_in_part(share: f64) -> bool {
    share < COVERED_UNSAID
}

/// Is this ratio of logged time to program time possible for a machine?
pub(in crate::learn) fn is_stretch_of_a_machine(stretch: f64) -> bool {
    (STRETCH[0]..=STRETCH[1]).contains(&stretch)
}

/// Can the ratio of a measured load or coefficient to the declared one come from the material rather than a wrong unit?
pub(in crate::learn) fn is_ratio_of_materials(ratio: f64) -> bool {
    (OVER_DECLARED[0]..=OVER_DECLARED[1]).contains(&ratio)
}

/// Is it the tangential cutting coefficient of a material, N/mm²?
pub(in crate::learn) fn is_of_a_material(k_tc_n_mm2: f64) -> bool {
    (MATERIALS_N_MM2[0]..=MATERIALS_N_MM2[1]).contains(&k_tc_n_mm2)
}

/// Does a model explain next to nothing of a log or table?
pub(in crate::learn) fn explains_next_to_nothing(r2: f64) -> bool {
    r2 < NEXT_TO_NOTHING
}

/// The same for a calibration.
pub(in crate::learn) fn is_no_calibration(r2: f64) -> bool {
    r2.is_nan() || r2 < NEXT_TO_NOTHING_OF_CALIBRATION
}

/// Are mean forces with this error, relative to each, none of the cuts of their table?
pub(in crate::learn) fn is_no_force_of_these_cuts(error: f64) -> bool {
    error.is_nan() || error > OF_OTHER_AXES
}

/// Can the base coefficients be separated?
pub(in crate::learn) fn tells_apart(condition: f64) -> bool {
    condition < INDISTINCT
}

/// Does a coefficient that was above zero all but vanish? One percent is a bound of zero, reached to within the accuracy of the fit.
pub(in crate::learn) fn is_taken_away(before: f64, after: f64) -> bool {
    before > 0.0 && after < 0.01 * before
}

/// Is the error on the data kept for the judgement no larger with the effects than without? A tenth of a percent is
/// allowed for noise.
pub(in crate::learn) fn is_no_worse(before: f64, after: f64) -> bool {
    after <= before * WORSE
}

/// Does one effect lower the error on the data kept for the judgement enough to be asserted alone?
pub(in crate::learn) fn is_lower(before: f64, after: f64) -> bool {
    after <= before * GAINS
}

/// Does less than the whole of an effect show in data, by more than their scatter? `share`: what shows of it.
pub(in crate::learn) fn is_less_than_whole(share: f64, std_error: f64) -> bool {
    share + SHORT_OF_WHOLE * std_error < 1.0
}

/// Are there so many other stretches that to be the worst of them all is no chance (5 %)?
pub(in crate::learn) fn tells_a_rank(others: usize) -> bool {
    others >= FEWEST_IN_A_RANK
}

/// Is a coefficient negative by more than its uncertainty?
pub(in crate::learn) fn is_negative(value: f64, std_error: f64) -> bool {
    value < -NEGATIVE * std_error
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For every threshold a value that passes and one that does not.
    #[test]
    fn an_effect_is_named_on_one_side_of_every_threshold_and_not_on_the_other() {
        let c = Criteria::default();
        assert_eq!([true, false].map(|is_log| c.least_score(is_log)), [8.0, 4.0]);
        assert!(c.takes_enough(0.081, 0.0) && c.takes_enough(0.0, 0.31) && !c.takes_enough(0.079, 0.29));
        assert!(c.lowers_held_out(0.006, 1.1) && !c.lowers_held_out(0.004, 9.0) && !c.lowers_held_out(0.5, 0.9));
        assert!(
            c.lowers_clearly(0.11, 2.8, 9.0) && !c.lowers_clearly(0.1, 2.9, 99.0) && c.lowers_clearly(0.1, 2.9, 101.0)
        );
        assert!(!c.lowers_clearly(0.5, 0.9, 999.0));
        assert!(c.leaves_as_much(0.86, 0.9) && !c.leaves_as_much(0.84, 0.0) && !c.leaves_as_much(1.0, 1.1));
        assert!(c.is_surely_worse(1.7) && !c.is_surely_worse(1.6));
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
        assert!(c.may_be_chance(0.051) && !c.may_be_chance(0.049));
        assert!(is_slower(0.59, 31.0) && !is_slower(0.61, 99.0) && !is_slower(0.1, 29.0));
    }

    #[test]
    fn set_ups_are_apart_from_a_thirtieth_on_to_either_side() {
        assert!(is_set_up_apart(1.031) && is_set_up_apart(0.969) && !is_set_up_apart(1.029) && !is_set_up_apart(0.972));
    }

    #[test]
    fn a_cut_is_outlying_on_one_side_of_every_threshold_and_not_on_the_other() {
        assert!(is_outlying(6.1) && !is_outlying(5.9));
        assert_eq!([19, 20, 39, 40].map(most_outlying), [0, 1, 1, 2]);
    }

    #[test]
    fn a_ceiling_is_one_on_one_side_of_every_threshold_and_none_on_the_other() {
        assert!(can_be_at_a_ceiling(4, 8) && !can_be_at_a_ceiling(3, 8) && !can_be_at_a_ceiling(4, 5));
        assert!(is_ceiling(1.4, 1.1, 1.0, 0.29));
        assert!(
            !is_ceiling(1.6, 1.1, 1.0, 0.29) && !is_ceiling(1.4, 0.9, 1.0, 0.29) && !is_ceiling(1.4, 1.1, 1.0, 0.31)
        );
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
        assert!(has_way(Way::Up, &[1.0, 1.2, 1.16, 1.3]) && !has_way(Way::Up, &[1.0, 1.2, 1.1, 1.2]));
        assert!(
            has_way(Way::Down, &[1.3, 1.0])
                && !has_way(Way::Down, &[1.0, 1.3, 1.0])
                && !has_way(Way::Up, &[1.0, 1.3, 1.0])
        );
        assert!(has_way(Way::Either, &[1.0, 1.3, 1.0]));
        assert!(bears_name(Way::Up, &[1.0, 1.05]) && !bears_name(Way::Up, &[1.0, 1.03]));
        assert!(!bears_name(Way::Up, &[1.05, 1.0]));
        assert!(
            has_way(Way::NoPeak, &[1.3, 1.0, 1.2])
                && has_way(Way::NoPeak, &[1.0, 1.3])
                && has_way(Way::NoPeak, &[1.0, 1.3, 1.28])
        );
        assert!(!has_way(Way::NoPeak, &[1.0, 1.3, 1.0]));
    }

    #[test]
    fn a_curve_turns_back_where_it_goes_back_by_more_than_a_quarter_of_its_range() {
        assert_eq!(turning_points(&[1.0, 1.1, 1.3]), 0);
        assert_eq!(turning_points(&[1.0, 1.3, 1.0]), 1);
        assert_eq!(turning_points(&[1.0, 1.3, 1.24, 1.3]), 0);
        assert_eq!([turning_points(&[1.0, 1.3, 1.0, 1.06]), turning_points(&[1.0, 1.3, 1.0, 1.1])], [1, 2]);
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
        assert!(is_taken_away(20.0, 0.1) && !is_taken_away(20.0, 0.3) && !is_taken_away(0.0, 0.0));
        assert!(is_no_worse(1.0, 1.0009) && !is_no_worse(1.0, 1.002));
        assert!(is_lower(1.0, 0.979) && !is_lower(1.0, 0.981));
        assert!(is_less_than_whole(0.5, 0.24) && !is_less_than_whole(0.5, 0.26) && !is_less_than_whole(f64::NAN, 0.0));
        assert!(tells_a_rank(19) && !tells_a_rank(18));
        assert!(tells_apart(9e5) && !tells_apart(1.1e6));
        assert!(is_negative(-2.1, 1.0) && !is_negative(-1.9, 1.0));
    }
}
