//! Whether a rival takes the place of an effect that was found. In: the model without that effect, its score there.
//! Out: the model with the rival, which has to show all that an added effect has to, and to leave less than the effect
//! on data left out.

use crate::effects::Effect;
use crate::learn::diagnose::criteria::CONFOUNDED_WITHIN;
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::trial::p_value;
use crate::learn::model::cross_validation::held_out_residuals;
use crate::learn::model::fit::Fitted;
use crate::learn::report::Rejected;

impl Diagnosis<'_> {
    /// The best rival of the effect `own` beside the others, where `found` has `own` with the score `same`.
    pub(in crate::learn) fn replacement(
        &mut self,
        without_it: &Fitted,
        found: &Fitted,
        own: &'static Effect,
        same: f64,
    ) -> Option<Fitted> {
        let trials = self.trials(without_it, false).into_iter().filter(|t| t.effect.name != own.name);
        let best =
            trials.max_by(|a, b| a.score.total_cmp(&b.score)).filter(|best| best.score >= same + CONFOUNDED_WITHIN)?;
        let present = self.present(without_it);
        let with_own = held_out_residuals(&self.train, &found.model.effects, self.split);
        let after = self.shown(&present, &best).ok()?;
        if self.drop_of(&with_own, &after) <= 0.0 {
            return None;
        }
        let errors = [without_it, &best.fitted].map(|model| self.judged(&model.model.effects).rmse);
        let text =
            format!("beside the others it explains more than {} (score {:.1} against {same:.1})", own.name, best.score);
        self.evidence.push((best.effect.name, text, p_value(&best), errors));
        self.rejected.retain(|r| r.name != best.effect.name);
        self.rejected.push(Rejected { name: own.name.into(), why: format!("{} explains more", best.effect.name) });
        Some(best.fitted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{State, named};
    use crate::learn::dataset::samples::Data;
    use crate::learn::diagnose::diagnosis::Options;
    use crate::learn::diagnose::made_data::{EACH, begun, fifths, made};
    use crate::learn::model::fit::fit;
    use crate::path::Vec3;

    /// Passes along X, one a block; those for which `hard` is true take the share `excess` more between 30 and 70 mm.
    fn passes(hard: impl Fn(usize) -> bool, excess: f64, noise: f64) -> Data {
        let x_mm = |i: usize| 100.0 * (i % EACH) as f64 / EACH as f64;
        let share = |i: usize| if hard(i / EACH) && (30.0..70.0).contains(&x_mm(i)) { excess } else { 0.0 };
        let state = |i: usize| State {
            time_s: i as f64,
            position: Vec3::new(x_mm(i), 5.0 * (i / EACH) as f64, 0.0),
            ..State::default()
        };
        made(share, noise, state)
    }

    /// The rival that takes the place of an effect which explains nothing.
    fn exchanged(data: &Data, noise: f64) -> Option<Fitted> {
        let split = fifths(data);
        let options = Options { candidates: vec![named("hard-zone").unwrap()], ..Options::default() };
        let plain = fit(data, &[], 0)?;
        begun(data, &split, &options, noise).replacement(&plain, &plain, named("size-effect").unwrap(), 0.0)
    }

    #[test]
    fn a_rival_takes_the_place_only_by_what_it_shows_on_data_left_out() {
        // In several passes beside each other the zone is found by the others when one is left out.
        assert!(exchanged(&passes(|block| (8..16).contains(&block), 0.2, 1.0), 1.0).is_some());
        // In one pass nobody who has not seen it knows of it, however well it is fitted.
        assert!(exchanged(&passes(|block| block == 11, 0.2, 1.0), 1.0).is_none());
    }

    #[test]
    fn what_the_engagement_may_be_off_by_is_no_effect_however_clearly_it_shows() {
        let zone = |excess: f64| exchanged(&passes(|block| (8..16).contains(&block), excess, 0.01), 0.01);
        assert!(zone(0.02).is_some());
        assert!(zone(0.002).is_none());
    }
}
