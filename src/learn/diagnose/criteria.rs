//! Every threshold by which learning decides: what counts as an effect, what as unexplained, what forbids a model file.
//!
//! Units stand in the names or the comments; shares have none. *Judgement* marks what no paper gives: those were set so
//! that the logs of `benches/confusion` (hidden effects, development seeds) are answered rightly, and are held by its
//! matrix and the tests of learn.

use crate::effects::Way;

/// Least score of an effect in a log: twice the log-likelihood ratio less the charge k ln n of the Bayesian information
/// criterion (Schwarz 1978). Kass and Raftery (1995) call 6 … 10 "strong"; where an instant or a place is searched for,
/// its middle is asked for.
const LEAST_SCORE_OF_LOG: f64 = 8.0;
/// The same for tables, where nothing is searched for: the middle of "positive", 2 … 6.
const LEAST_SCORE_OF_TABLE: f64 = 4.0;
/// Rivals whose gain (twice the log-likelihood) is this close to that of the best explain the data equally well,
/// whatever their parameters are charged: below "strong" on the scale of Kass and Raftery.
pub(in crate::learn) const CONFOUNDED_WITHIN: f64 = 6.0;
/// The same on data left out: least share of the drop of the best, and most standard errors behind it. Judgement.
const AS_GOOD: f64 = 0.85;
const AS_GOOD_T: f64 = 1.0;
/// How much more another form of an effect must score: "positive" on that scale.
pub(in crate::learn) const FORM_MARGIN: f64 = 2.0;
/// Least relative drop of the held-out error worth an effect. Judgement.
const LEAST_DROP: f64 = 0.005;
/// Standard errors over the blocks by which an effect must lower the held-out error: the usual one-standard-error rule
/// (Breiman and others 1984).
const LEAST_T: f64 = 1.0;
/// The same of a curve without a name, and its least drop: some forty curves of seven shapes are looked at, of which one
/// is two standard errors off by chance only now and then. Judgement.
const CURVE_T: f64 = 2.0;
const CURVE_DROP: f64 = 0.01;
/// Least share of what the base model leaves beyond the noise that one effect must take away. Judgement.
const LEAST_SHARE: f64 = 0.08;
/// The same of what the effects before it leave: a small effect beside a large one. Judgement.
const LEAST_REST: f64 = 0.3;
/// Least excess of the base model over the noise that shares of it refer to, as a share of its squares. Judgement.
pub(in crate::learn) const LEAST_EXCESS: f64 = 0.02;
/// Share of the squares to which the noise is known: a rest smaller than that is no rest to be explained. Judgement.
pub(in crate::learn) const NOISE_KNOWN_TO: f64 = 0.1;
/// What the engagement of a cut is known to, relative: removal rates over a millimetre of path
/// (`tests/engage_accuracy.rs`). In a long log everything is significant, the steps of the engagement itself among it,
/// and some effect always follows those a little.
pub(in crate::learn) const ENGAGEMENT_KNOWN_TO: f64 = 0.003;
/// Least share of the excess that a pair of effects must take away which neither shows alone. Judgement.
const PAIR_EXPLAINS: f64 = 0.7;
/// Least error over the noise that makes pairs worth trying. Judgement.
const PAIR_NEEDED: f64 = 1.3;
/// Most share that a pair may leave of what the base model leaves beyond the noise, and the squares of a noise with
/// memory over those that neighbouring readings show: two effects together follow nearly any structure, but not to the
/// end. Judgement.
const MOST_LEFT: f64 = 0.07;
pub(in crate::learn) const NOISE_WITH_MEMORY: f64 = 2.0;
/// Share of the residual's variance that a pattern predicts on blocks it was not learned on, from which what is left is
/// called structure; twice as much in tables, whose blocks are few. Judgement.
const STRUCTURE: f64 = 0.15;
/// How much worse another kind of cut may be predicted, as a ratio of errors, and by how many standard errors, before an
/// effect is refused for it. Judgement.
const HARM: f64 = 1.02;
const HARM_T: f64 = 1.0;
/// Most range of a covariate within an operation, over its range in the log, at which it changes between operations only.
const STEADY_WITHIN: f64 = 0.05;
/// Standard errors by which an effect beside others must lower the held-out error: one-sided 5 % of the normal distribution, as the
/// search has already taken the best once.
const LEAST_T_BESIDE: f64 = 1.645;
/// An acceleration that the times of the blocks show counts below this share of the declared one, and with so many
/// nats. Judgement.
const SLOWER_THAN: f64 = 0.6;
const SLOWER_NATS: f64 = 30.0;

/// Fewest samples that place an instant or a region. Judgement.
pub(in crate::learn) const PLACED_BY: usize = 40;

/// Does an effect pay for its parameters?
pub(in crate::learn) fn least_score(is_log: bool) -> f64 {
    if is_log { LEAST_SCORE_OF_LOG } else { LEAST_SCORE_OF_TABLE }
}

/// Does it take away enough: of what the base model leaves beyond the noise, or of what the effects before it leave?
pub(in crate::learn) fn takes_enough(share: f64, of_rest: f64) -> bool {
    share >= LEAST_SHARE || of_rest >= LEAST_REST
}

/// Is the held-out error lower, by its size and by the scatter of the blocks?
pub(in crate::learn) fn lowers_held_out(drop: f64, t: f64) -> bool {
    drop >= LEAST_DROP && t >= LEAST_T
}

/// The same of an effect beside those that were found before it.
pub(in crate::learn) fn lowers_held_out_beside(drop: f64, t: f64) -> bool {
    drop >= LEAST_DROP && t >= LEAST_T_BESIDE
}

/// Does a rival leave as little on data left out as the best? `share`: of its drop; `t`: of what the best leaves less.
pub(in crate::learn) fn leaves_as_much(share: f64, t: f64) -> bool {
    share >= AS_GOOD && t < AS_GOOD_T
}

/// Does one take nearly all of what another takes, by their drops of the held-out error?
pub(in crate::learn) fn takes_as_much(share: f64) -> bool {
    share >= AS_GOOD
}

/// Does a residual follow a curve over a covariate?
pub(in crate::learn) fn follows_a_curve(drop: f64, t: f64) -> bool {
    drop >= CURVE_DROP && t >= CURVE_T
}

/// Do two effects explain together enough of what neither shows alone?
pub(in crate::learn) fn pair_explains(share: f64, t: f64) -> bool {
    share >= PAIR_EXPLAINS && t >= LEAST_T
}

/// Is there so much beyond the noise that pairs are worth trying?
pub(in crate::learn) fn pairs_are_worth_it(error: f64, noise: f64) -> bool {
    error >= PAIR_NEEDED * noise
}

/// Is more than a small share left of what lies beyond any noise?
pub(in crate::learn) fn leaves_much(beyond_before: f64, beyond_after: f64) -> bool {
    beyond_after > MOST_LEFT * beyond_before
}

/// Is a pattern of the residual called structure?
pub(in crate::learn) fn is_structure(test_r2: f64, is_log: bool) -> bool {
    test_r2 > if is_log { STRUCTURE } else { 2.0 * STRUCTURE }
}

/// Does an effect make a kind of cut worse that it was not fitted on? `ratio`: its error with over without; `t`: of the
/// improvement.
pub(in crate::learn) fn harms(ratio: f64, t: f64) -> bool {
    ratio > HARM && t < -HARM_T
}

/// Does an effect raise the error over operations that were left out in turn? `drop`: by how much it falls.
pub(in crate::learn) fn harms_elsewhere(drop: f64) -> bool {
    drop < 1.0 - HARM
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
        Way::Either => true,
    }
}

/// Does it lower that error, so that a curve earns the name of a family?
pub(in crate::learn) fn lowers_elsewhere(drop: f64) -> bool {
    drop >= LEAST_DROP
}

/// Is a covariate the same all through an operation? `within`: its range there; `all`: its range over the log. A spindle keeps its speed
/// to some percent under load (slip of an induction motor, some 3 %).
pub(in crate::learn) fn is_steady_within(within: f64, all: f64) -> bool {
    within <= STEADY_WITHIN * all
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

/// Does a pattern without a name explain clearly more than a named effect? `t`: mean improvement over its standard
/// error, block by block; no less than a named effect has to show.
pub(in crate::learn) fn is_clearly_better(t: f64) -> bool {
    t > LEAST_T
}

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
        assert_eq!([true, false].map(least_score), [8.0, 4.0]);
        assert!(takes_enough(0.081, 0.0) && takes_enough(0.0, 0.31) && !takes_enough(0.079, 0.29));
        assert!(lowers_held_out(0.006, 1.1) && !lowers_held_out(0.004, 9.0) && !lowers_held_out(0.5, 0.9));
        assert!(leaves_as_much(0.86, 0.9) && !leaves_as_much(0.84, 0.0) && !leaves_as_much(1.0, 1.1));
        assert!(takes_as_much(0.86) && !takes_as_much(0.84));
        assert!(follows_a_curve(0.011, 2.1) && !follows_a_curve(0.009, 9.0) && !follows_a_curve(0.5, 1.9));
        assert!(pair_explains(0.71, 1.1) && !pair_explains(0.69, 9.0) && !pair_explains(0.9, 0.9));
        assert!(pairs_are_worth_it(1.31, 1.0) && !pairs_are_worth_it(1.29, 1.0));
        assert!(leaves_much(1.0, 0.08) && !leaves_much(1.0, 0.06));
        assert!(harms(1.03, -1.1) && !harms(1.01, -9.0) && !harms(1.5, -0.9));
        assert!(lowers_elsewhere(0.006) && !lowers_elsewhere(0.004));
        assert!(lowers_held_out_beside(0.006, 1.7) && !lowers_held_out_beside(0.006, 1.6));
        assert!(is_steady_within(0.04, 1.0) && !is_steady_within(0.06, 1.0));
        assert!(harms_elsewhere(-0.03) && !harms_elsewhere(-0.01));
        assert!(is_slower(0.59, 31.0) && !is_slower(0.61, 99.0) && !is_slower(0.1, 29.0));
    }

    #[test]
    fn a_curve_goes_one_way_though_it_goes_back_a_little() {
        assert!(goes(Way::Up, &[1.0, 1.2, 1.16, 1.3]) && !goes(Way::Up, &[1.0, 1.2, 1.1, 1.2]));
        assert!(goes(Way::Down, &[1.3, 1.0]) && !goes(Way::Down, &[1.0, 1.3, 1.0]) && !goes(Way::Up, &[1.0, 1.3, 1.0]));
        assert!(goes(Way::Either, &[1.0, 1.3, 1.0]));
    }

    #[test]
    fn a_change_within_a_log_is_said_when_it_is_large_and_clear() {
        assert!(is_jump(0.07, 0.01) && !is_jump(0.04, 0.001) && !is_jump(0.07, 0.012));
        assert!(is_rise(0.07, 0.012) && !is_rise(0.04, 0.001) && !is_rise(0.07, 0.02));
        assert!(is_clearly_better(1.1) && !is_clearly_better(0.9));
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
