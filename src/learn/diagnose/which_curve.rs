//! Which curve without a name is added. In: a diagnosis, a model, the curves that its held-out residuals follow ([`super::unnamed`]). Out: the
//! model with one of them.
//!
//! Of curves that take nearly as much of the error a quantity of the process comes before a place, a place before what only grows while the program
//! runs, and the simpler one before the other.

use crate::effects::{Covariate, Effect, Multiplies};
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::trial::Trial;
use crate::learn::diagnose::unnamed::ResidualCurve;
use crate::learn::model::cross_validation::{certainty_of_gain, held_out_residuals, improvement_by_case, t_statistic};
use crate::learn::model::fit::Fitted;

/// Best curves that are fitted with the model and judged on held-out data before one is chosen.
const JUDGED: usize = 4;

/// What a curve is chosen by.
struct Merit<'a> {
    /// [`rank_of_curve`].
    rank: usize,
    /// Number of knots.
    parts: usize,
    /// Is its covariate the number of the tool? Then it is no law, only a difference between tools.
    is_of_tools: bool,
    /// Held-out residuals.
    left: &'a [f64],
}

impl<'a> Merit<'a> {
    fn of(found: &ResidualCurve, left: &'a [f64]) -> Self {
        Self {
            rank: rank_of_curve(found.effect, found.covariate),
            parts: found.fit.curve.knots.len(),
            is_of_tools: found.covariate == Covariate::Tool,
            left,
        }
    }
}

/// Least rank of covariates that only grow while the program runs.
pub(in crate::learn) const LAST_RANK: usize = 2;

/// Preference among covariates that a residual follows equally well: first quantities of the process (0), then position
/// and path speed (1; a cut depends on path speed only through chip thickness), then whatever only grows while the
/// program runs (2). Of that the volume comes last (3): edges wear by the way they slide, machines warm up with time.
pub(in crate::learn) fn rank(covariate: Covariate) -> usize {
    match covariate {
        Covariate::X | Covariate::Y | Covariate::PathSpeed => 1,
        Covariate::Sliding | Covariate::Time => LAST_RANK,
        Covariate::Volume => LAST_RANK + 1,
        _ => 0,
    }
}

/// Does it only grow while the program runs?
pub(in crate::learn) fn only_grows(covariate: Covariate) -> bool {
    rank(covariate) >= LAST_RANK
}

/// The same for a curve. The tare of a spindle hardly depends on height or direction of the tool: there rank 1 at best.
fn rank_of_curve(effect: &Effect, covariate: Covariate) -> usize {
    let is_place = matches!(covariate, Covariate::Z | Covariate::Heading | Covariate::Slope);
    rank(covariate).max(usize::from(is_place && effect.multiplies == Multiplies::Tare))
}

impl Diagnosis<'_> {
    /// The model with the best curve added; `None` if no curve is significant.
    pub(in crate::learn) fn with_best_curve(&mut self, present: &Fitted) -> Option<Fitted> {
        let before = held_out_residuals(&self.train, &present.model.effects, self.split);
        let clear = |found: &ResidualCurve| {
            let t = certainty_of_gain(&self.train, &before, &found.fit.left);
            self.criteria().follows_a_curve(self.drop_of(&before, &found.fit.left), t)
        };
        let mut found = self.curves_beside(present, &before);
        found.retain(clear);
        self.tried += found.len();
        let (trial, after) = self.best_curve(present, &before, &found)?;
        let share = self.share_of_excess(&before, &after, &before, self.criteria().least_excess);
        let text = format!(
            "no effect of the list explains it; the curve removes {:.0} % of what is left beyond the noise",
            100.0 * share.min(1.0)
        );
        let errors =
            [self.judgement_errors(&present.model.effects), self.judgement_errors(&trial.fitted.model.effects)];
        let p = self.p_of_the_search(&trial);
        self.evidence.push((trial.effect.name, text, p, errors.map(|e| e.rmse)));
        Some(trial.fitted)
    }

    /// The best of `found` (least squares first) fitted together with the model, and the held-out residuals of that.
    fn best_curve(&self, present: &Fitted, before: &[f64], found: &[ResidualCurve]) -> Option<(Trial, Vec<f64>)> {
        let alone: Vec<Merit> = found.iter().map(|each| Merit::of(each, &each.fit.left)).collect();
        let mut order: Vec<usize> = (1..found.len()).collect();
        order.sort_by_cached_key(|k| self.preference(before, &alone[0], &alone[*k]));
        let chosen = (0..found.len().min(1)).chain(order).take(JUDGED).map(|k| &found[k]);
        let mut judged: Vec<(&ResidualCurve, (Trial, Vec<f64>))> =
            chosen.filter_map(|each| Some((each, self.judged_curve(present, before, each)?))).collect();
        judged.sort_by(|(_, a), (_, b)| self.drop_of(before, &b.1).total_cmp(&self.drop_of(before, &a.1)));
        let together: Vec<_> = judged.iter().map(|(each, (_, left))| (*each, left.as_slice())).collect();
        let best = self.preferred(before, &together)?;
        Some(judged.swap_remove(best).1)
    }

    /// Which of these curves, each with its held-out residuals, least error first.
    pub(in crate::learn) fn preferred(&self, before: &[f64], curves: &[(&ResidualCurve, &[f64])]) -> Option<usize> {
        let merits: Vec<Merit> = curves.iter().map(|(each, left)| Merit::of(each, left)).collect();
        (0..merits.len()).min_by_key(|k| self.preference(before, &merits[0], &merits[*k]))
    }

    /// Sort key of a curve, `least` being the one of least held-out error: (rank, number of knots, not of tools) if
    /// `least` is not clearly better, or is only little better with more knots; otherwise last. Of `least` over something
    /// that only grows with the program see [`Self::is_clearly_late`].
    fn preference(&self, before: &[f64], least: &Merit, each: &Merit) -> (usize, usize, bool) {
        let share = self.drop_of(before, each.left) / self.drop_of(before, least.left).max(1e-12);
        let is_simpler = each.parts < least.parts && self.criteria().takes_as_much(share);
        let is_behind = if least.rank >= LAST_RANK && each.rank < LAST_RANK {
            self.is_clearly_late(before, each.left, least.left)
        } else {
            let t = t_statistic(&improvement_by_case(&self.train, each.left, least.left));
            self.criteria().lowers_held_out(self.drop_of(each.left, least.left), t)
        };
        if is_simpler || !is_behind { (each.rank, each.parts, !each.is_of_tools) } else { (usize::MAX, 0, true) }
    }

    /// Does something that only grows while the program runs explain more than a cause in the process? It must lower the
    /// held-out error by the margin of a curve of its own, and the cause in the process may not take nearly as much.
    /// `before`: held-out residuals without either, `process` and `late`: with each.
    pub(in crate::learn) fn is_clearly_late(&self, before: &[f64], process: &[f64], late: &[f64]) -> bool {
        let certainty = certainty_of_gain(&self.train, process, late);
        let share = self.drop_of(before, process) / self.drop_of(before, late).max(1e-12);
        self.criteria().follows_a_curve(self.drop_of(process, late), certainty) && !self.criteria().takes_as_much(share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::learn::diagnose::diagnosis::Options;
    use crate::learn::diagnose::made_data::{EACH, begun, fifths, made};
    use crate::learn::model::fit::fit;
    use crate::machine::wear::Lengths;

    /// Names of the curves found if the load of block b is larger by `share(b)`.
    fn found(share: impl Fn(usize) -> f64, state: impl Fn(usize) -> State) -> Vec<&'static str> {
        let data = made(|i| share(i / EACH), 1.0, state);
        let (split, options) = (fifths(&data), Options { candidates: Vec::new(), ..Options::default() });
        let mut diagnosis = begun(&data, &split, &options, 1.0);
        let plain = fit(&data, &[], 0).unwrap();
        let found = diagnosis.with_best_curve(&plain);
        found.iter().flat_map(|found| &found.model.effects).map(|each| each.effect.name).collect()
    }

    /// State of sample i: time and sliding distance grow together.
    fn worn(i: usize) -> State {
        State { time_s: i as f64, slid: Lengths::at_reference(i as f64), ..State::default() }
    }

    #[test]
    fn what_comes_and_goes_while_the_log_runs_is_said_of_the_time() {
        let window = |block: usize| if (9..15).contains(&block) { 0.2 } else { 0.0 };
        assert_eq!(found(window, worn), ["unnamed-load-time"]);
        assert_eq!(found(|_| 0.0, worn), [""; 0]);
    }

    #[test]
    fn of_curves_that_take_nearly_as_much_the_simpler_one_is_said_and_time_comes_last() {
        let data = made(|_| 0.0, 1.0, worn);
        let (split, options) = (fifths(&data), Options { candidates: Vec::new(), ..Options::default() });
        let diagnosis = begun(&data, &split, &options, 1.0);
        let wobble = |i: usize| ((i * 7919) % 101) as f64 / 50.0 - 1.0;
        let left = |off: f64| (0..data.len()).map(|i| off + wobble(i)).collect::<Vec<f64>>();
        let [before, least, more, much] = [10.0, 1.0, 1.5, 4.0].map(left);
        let key = |of: (usize, usize, &[f64]), than: (usize, usize, &[f64])| {
            let merit = |(rank, parts, left)| Merit { rank, parts, is_of_tools: false, left };
            let (rank, parts, _) = diagnosis.preference(&before, &merit(than), &merit(of));
            (rank, parts)
        };
        assert_eq!(key((0, 2, &more), (0, 6, &least)), (0, 2));
        assert_eq!(key((0, 6, &more), (0, 6, &least)), (usize::MAX, 0));
        assert_eq!(key((0, 2, &much), (0, 6, &least)), (usize::MAX, 0));
        // Half a percent less error, however significant, does not put time before a quantity of the process.
        let nearly = left(1.004);
        assert_eq!(key((0, 6, &nearly), (LAST_RANK, 2, &least)), (0, 6));
        // Nor does half as much error again, where a quantity of the process takes nearly all that time takes.
        assert_eq!(key((0, 6, &more), (LAST_RANK, 2, &least)), (0, 6));
        assert_eq!(key((0, 6, &much), (LAST_RANK, 2, &least)), (usize::MAX, 0));
        assert_eq!(key((0, 6, &nearly), (0, 2, &least)), (0, 6));
        assert_eq!(key((0, 6, &left(1.02)), (0, 2, &least)), (usize::MAX, 0));
        // Of two curves that fit these data equally, the difference between tools comes first.
        let same = |is_of_tools| Merit { rank: 0, parts: 2, is_of_tools, left: &least };
        assert!(
            diagnosis.preference(&before, &same(false), &same(true))
                < diagnosis.preference(&before, &same(true), &same(false))
        );
        let [z, time] = ["unnamed-tare-z", "unnamed-load-time"].map(|name| crate::effects::named(name).unwrap());
        assert!(rank_of_curve(z, Covariate::Z) == 1 && rank_of_curve(time, Covariate::Time) == LAST_RANK);
    }

    #[test]
    fn time_is_the_last_that_a_residual_may_follow() {
        assert!(rank(Covariate::Z) < rank(Covariate::X) && rank(Covariate::Y) < rank(Covariate::Time));
        assert!(rank(Covariate::Sliding) < rank(Covariate::Volume));
        assert!(only_grows(Covariate::Time) && only_grows(Covariate::Volume) && !only_grows(Covariate::Y));
    }
}
