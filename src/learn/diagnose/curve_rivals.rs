//! What a curve without a name is confounded with. In: a diagnosis and the model at its end. Out: the covariates along
//! which another curve in its place has as low a held-out error.
//!
//! Covariates of a program are correlated: the deeper pass is also later and lower. A curve over any of them then
//! explains the same, and only other cuts can show which one is the cause.

use crate::effects::Covariate;
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::forms::{FORM_ROUNDS, remove};
use crate::learn::model::cross_validation::{held_out_residuals, improvement_by_case, t_statistic};
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::fit;

/// Most covariates that are reported with that of a curve.
const SAID: usize = 2;

impl Diagnosis<'_> {
    /// The covariates along which a curve in the place of the curve `effects[e]` has as low a held-out error: the tool, whose coefficients are
    /// its own, before all others, then lowest first.
    pub(in crate::learn) fn rivals_of_curve(&self, effects: &[FittedEffect], e: usize) -> Vec<Covariate> {
        let Some(without_it) = fit(&self.train, &remove(effects, e), FORM_ROUNDS) else { return Vec::new() };
        let before = held_out_residuals(&self.train, &without_it.model.effects, self.split);
        let found = self.curves_beside(&without_it, &before);
        let Some(own) = found.iter().find(|each| each.effect.name == effects[e].effect.name) else { return Vec::new() };
        let drop = |left: &[f64]| self.drop_of(&before, left);
        let mut rivals: Vec<Covariate> = Vec::new();
        for each in &found {
            let worse = t_statistic(&improvement_by_case(&self.train, &each.fit.left, &own.fit.left));
            let is_as_good =
                self.criteria().leaves_as_much(drop(&each.fit.left) / drop(&own.fit.left).max(1e-12), worse);
            if is_as_good && each.covariate != own.covariate && !rivals.contains(&each.covariate) {
                rivals.push(each.covariate);
            }
        }
        said(rivals)
    }
}

/// Those of the rivals that are reported.
fn said(mut rivals: Vec<Covariate>) -> Vec<Covariate> {
    rivals.sort_by_key(|covariate| *covariate != Covariate::Tool);
    rivals.truncate(SAID);
    rivals
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::learn::dataset::samples::Data;
    use crate::learn::diagnose::diagnosis::Options;
    use crate::learn::diagnose::made_data::{EACH, begun, fifths, made};
    use crate::path::Vec3;

    /// +1 or −1 for each block, alternating every `every` blocks.
    fn by_turns(every: usize) -> impl Fn(usize) -> f64 {
        move |block| if (block / every).is_multiple_of(2) { 1.0 } else { -1.0 }
    }

    /// Covariates reported beside z if the load follows z and each block has a depth.
    fn rivals(depth_mm: impl Fn(usize) -> f64) -> Vec<Covariate> {
        let (along, mut all) = curve(|block| State { axial_depth_mm: 3.0 + depth_mm(block), ..State::default() });
        all.push(along);
        assert!(all.contains(&Covariate::Z));
        all.retain(|covariate| *covariate != Covariate::Z);
        all
    }

    /// The covariate of the curve that is found if the load follows z, and its rivals.
    fn curve(of_block: impl Fn(usize) -> State) -> (Covariate, Vec<Covariate>) {
        let z = by_turns(1);
        let place = |i: usize| Vec3::new((i * 31 % EACH) as f64, 0.0, z(i / EACH));
        let state = |i: usize| State { position: place(i), ..of_block(i / EACH) };
        let data: Data = made(|i| 0.2 * z(i / EACH), 1.0, state);
        let (split, options) = (fifths(&data), Options { candidates: Vec::new(), ..Options::default() });
        let mut diagnosis = begun(&data, &split, &options, 1.0);
        let plain = fit(&data, &[], 0).unwrap();
        let found = diagnosis.with_best_curve(&plain).unwrap();
        let along = found.model.effects[0].effect.covariates[0];
        (along, diagnosis.rivals_of_curve(&found.model.effects, 0))
    }

    #[test]
    fn the_tool_is_said_before_rivals_of_lower_error() {
        use Covariate::{Time, Tool, Y, Z};
        assert_eq!(said(vec![Y, Time, Z, Tool]), [Tool, Y]);
        assert_eq!(said(vec![Y, Time, Z]), [Y, Time]);
    }

    #[test]
    fn what_goes_with_the_covariate_of_a_curve_is_said_beside_it_and_what_does_not_is_not() {
        assert_eq!(rivals(by_turns(1)), [Covariate::AxialDepth]);
        assert!(rivals(by_turns(3)).is_empty());
        // Of three correlated covariates two are reported.
        let z = by_turns(1);
        let all = |block: usize| State {
            axial_depth_mm: 3.0 + z(block),
            radial_depth_mm: 5.0 + z(block),
            rps: 100.0 + z(block),
            ..State::default()
        };
        assert_eq!(curve(all).1.len(), SAID);
        // The depth follows z in all blocks but a few.
        assert!(rivals(|block| if block % 7 == 0 { -z(block) } else { z(block) }).is_empty());
    }
}
