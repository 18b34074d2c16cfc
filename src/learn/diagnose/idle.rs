//! Effects on the tare, from the readings without a cut. In: a diagnosis and its base model. Out: the model with the effects on the tare
//! that those readings show by themselves.
//!
//! In the whole log a change of the tare is small beside the load, and what the model of the load lacks hides it or passes for it. Where
//! nothing is cut, the reading is the tare. So the effects on the tare are looked for there first, by the same tests, and a curve of
//! the tare where their laws leave something. Those that have no rival there stay in the model, as they are, while the others are looked
//! for. The losses of a drive are a rival: what the spindle takes without a cut grows with its speed, and they with that. Where they are found
//! later, the effects on the tare are asked again ([`Diagnosis::is_settled`]).

use crate::effects::{Effect, Multiplies, State};
use crate::learn::dataset::samples::{Class, Data};
use crate::learn::diagnose::criteria::PLACED_BY;
use crate::learn::diagnose::diagnosis::{Diagnosis, Options};
use crate::learn::diagnose::forms::FORM_ROUNDS;
use crate::learn::diagnose::free_curve::along_all;
use crate::learn::diagnose::residual::{noise_floor, noise_with_memory};
use crate::learn::diagnose::trial_cache::TrialCache;
use crate::learn::diagnose::unnamed::is_unnamed;
use crate::learn::model::cross_validation::{held_out_residuals, improvement_by_case, t_statistic, without};
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{Fitted, fit};

/// Samples next to a cut that are left out: their place is known to about a sample, and a meter follows with a delay.
const BESIDE_A_CUT: usize = 3;

/// An effect that the readings without a cut show.
struct Shown {
    each: FittedEffect,
    /// In words.
    evidence: String,
    p_value: f64,
}

impl Diagnosis<'_> {
    /// The model with the effects on the tare that the readings without a cut show.
    pub(in crate::learn) fn with_tare_of_idle_readings(&mut self, begin: Fitted) -> Fitted {
        let Some((effects, tried)) = idle_readings(self.data).and_then(|idle| self.effects_of_tare(&idle)) else {
            return begin;
        };
        self.tried += tried;
        let mut model = begin;
        for Shown { each, evidence, p_value } in effects {
            let all: Vec<FittedEffect> = model.model.effects.iter().cloned().chain([each.held()]).collect();
            let Some(fitted) = fit(&self.train, &all, FORM_ROUNDS) else { continue };
            let errors = [&model, &fitted].map(|fitted| self.judgement_errors(&fitted.model.effects).rmse);
            self.evidence.push((each.effect.name, evidence, p_value, errors));
            self.shown_by_idle.push(each);
            model = fitted;
        }
        model
    }

    /// The model at the end of the search with the parameters of these effects fitted to all readings.
    pub(in crate::learn) fn released(&self, found: Fitted) -> Fitted {
        if self.shown_by_idle.is_empty() {
            return found;
        }
        let free = |each: &FittedEffect| {
            let own = self.shown_by_idle.iter().find(|own| own.effect.name == each.effect.name);
            FittedEffect { free: own.map_or_else(|| each.free.clone(), |own| own.free.clone()), ..each.clone() }
        };
        let effects: Vec<FittedEffect> = found.model.effects.iter().map(free).collect();
        fit(&self.train, &effects, FORM_ROUNDS).unwrap_or(found)
    }

    /// By how many standard errors `left` is worse than `other` where nothing is cut; 0 in a table and without such readings.
    pub(in crate::learn) fn worse_without_a_cut(&self, left: &[f64], other: &[f64]) -> f64 {
        let Some(idle) = idle_readings(self.data) else { return 0.0 };
        let known = idle.with_weights(without(&idle, |i| self.split.test[i]));
        t_statistic(&improvement_by_case(&known, left, other))
    }

    /// The effects that the readings without a cut show and for which they have no rival; and the number of models fitted.
    fn effects_of_tare(&self, idle: &Data) -> Option<(Vec<Shown>, usize)> {
        let acts = |each: &&Effect| each.multiplies == Multiplies::Tare || each.has_losses();
        let candidates = self.options.candidates.iter().copied().filter(acts).collect();
        let options = Options { candidates, known: Vec::new(), ..self.options.clone() };
        let train = idle.with_weights(without(idle, |i| self.split.test[i]));
        if train.used().count() < PLACED_BY {
            return None;
        }
        let base = fit(&train, &[], 0)?;
        let residuals = base.residuals(idle);
        let mut search = Diagnosis {
            data: idle,
            split: self.split,
            options: &options,
            tried: 0,
            rejected: Vec::new(),
            evidence: Vec::new(),
            pair: Vec::new(),
            shown_by_idle: Vec::new(),
            base_residual: held_out_residuals(&train, &[], self.split),
            floor: noise_floor(&train, &residuals).unwrap_or(0.0),
            noise: noise_with_memory(&train, &residuals).unwrap_or(0.0),
            cache: TrialCache::default(),
            along: along_all(idle),
            train,
        };
        let (found, in_doubt) = search.names_alone(&base);
        let found = search.with_best_curve(&found).unwrap_or(found);
        let refuted = search.refuted(&found);
        let effects = &found.model.effects;
        let is_sure = |e: &usize| {
            let name = effects[*e].effect.name;
            if effects[*e].effect.has_losses() {
                return false;
            }
            if is_unnamed(effects[*e].effect) {
                return search.rivals_of_curve(effects, *e).is_empty();
            }
            !refuted.contains(&name) && !in_doubt.iter().any(|names| names == name)
        };
        let with_evidence = |each: &FittedEffect| {
            let of = search.evidence.iter().rev().find(|(name, ..)| *name == each.effect.name)?;
            let evidence = format!("the readings without a cut show it: {}", of.1);
            Some(Shown { each: each.clone(), evidence, p_value: of.2 })
        };
        let sure = (0..effects.len()).filter(is_sure).filter_map(|e| with_evidence(&effects[e])).collect();
        Some((sure, search.tried))
    }
}

/// The readings of a log without a cut: weight only where neither the sample nor one beside it has a load, and base coefficients of the
/// tare alone; `None` for a table or without a tare.
fn idle_readings(data: &Data) -> Option<Data> {
    let of_tare: Vec<usize> = (0..data.base.len()).filter(|b| data.base[*b].class == Class::Tare).collect();
    if of_tare.is_empty() || !data.is_series() {
        return None;
    }
    let sum = |i: usize, tare: bool| -> f64 {
        let of = (0..data.base.len()).filter(|b| of_tare.contains(b) == tare);
        of.map(|b| data.columns[b][i].abs()).sum()
    };
    let cuts: Vec<bool> = (0..data.len()).map(|i| sum(i, false) > 0.0).collect();
    let is_idle = |i: usize| {
        let beside = i.saturating_sub(BESIDE_A_CUT)..(i + BESIDE_A_CUT + 1).min(data.len());
        sum(i, true) > 0.0 && !beside.into_iter().any(|j| data.run[j] == data.run[i] && cuts[j])
    };
    Some(Data {
        base: of_tare.iter().map(|b| data.base[*b].clone()).collect(),
        columns: of_tare.iter().map(|b| data.columns[*b].clone()).collect(),
        weight: (0..data.len()).map(|i| if is_idle(i) { data.weight[i] } else { 0.0 }).collect(),
        // The load predicted for them is the declared tare, which follows the speed.
        state: data.state.iter().map(|state| State { load: f64::NAN, ..*state }).collect(),
        variants: Vec::new(),
        slower: Vec::new(),
        timed_acceleration: None,
        ..data.clone()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Covariate;
    use crate::learn::dataset::samples::{Base, UNBOUNDED};
    use crate::learn::diagnose::made_data::{EACH, begun, fifths, made};

    /// Samples at the beginning of each block in which nothing is cut.
    const IDLE: usize = 15;

    /// A log whose blocks turn slowly and fast in turn. The tare is 50 times `tare` of that and declared as 50, the load 100 to 160 and in
    /// three blocks of six a third higher, which no model here knows.
    fn log(tare: impl Fn(bool) -> f64) -> Data {
        log_with_declared(|_| 50.0, |is_fast| 50.0 * tare(is_fast))
    }

    /// The same with these tares.
    fn log_with_declared(declared: impl Fn(bool) -> f64, tare: impl Fn(bool) -> f64) -> Data {
        let is_fast = |i: usize| (i / EACH).is_multiple_of(2);
        let state = |i: usize| State {
            rps: if is_fast(i) { 150.0 } else { 90.0 },
            reference_rps: 90.0,
            time_s: i as f64,
            ..State::default()
        };
        let data = made(|_| 0.0, 1.0, state);
        let n = data.len();
        let cut = |i: usize| if i % EACH < IDLE { 0.0 } else { data.columns[0][i] };
        let hidden = |i: usize| if (i / EACH / 3).is_multiple_of(2) { 1.0 / 3.0 } else { 0.0 };
        let noise = |i: usize| data.reading[i] - data.columns[0][i];
        let base =
            |name: &str, class| Base { name: name.into(), unit: String::new(), class, prior: None, bounds: UNBOUNDED };
        Data {
            base: vec![base("tare", Class::Tare), base("k_tc", Class::Cutting)],
            columns: vec![(0..n).map(|i| declared(is_fast(i))).collect(), (0..n).map(cut).collect()],
            reading: (0..n).map(|i| tare(is_fast(i)) + cut(i) * (1.0 + hidden(i)) + noise(i)).collect(),
            ..data
        }
    }

    /// The model with what the readings without a cut show, and with that released.
    fn found(data: &Data) -> [Fitted; 2] {
        let (split, options) = (fifths(data), Options::default());
        let mut diagnosis = begun(data, &split, &options, 1.0);
        let shown = diagnosis.with_tare_of_idle_readings(fit(data, &[], 0).unwrap());
        [shown.clone(), diagnosis.released(shown)]
    }

    #[test]
    fn a_tare_that_follows_the_speed_is_seen_where_nothing_is_cut() {
        let [shown, released] = found(&log(|is_fast| if is_fast { 1.2 } else { 1.0 }));
        let [each] = &shown.model.effects[..] else { panic!("{:?}", shown.model.effects) };
        assert_eq!(
            (each.effect.multiplies, each.effect.covariates),
            (Multiplies::Tare, &[Covariate::SpindleSpeed][..])
        );
        assert!(each.free.iter().all(|free| !free) && released.model.effects[0].free.contains(&true));
    }

    #[test]
    fn a_steady_tare_has_no_effect_whatever_the_load_does() {
        assert!(found(&log(|_| 1.0))[0].model.effects.is_empty());
    }

    #[test]
    fn a_tare_that_rises_as_losses_of_the_drive_would_make_it_is_left_to_all_readings() {
        let declared = |is_fast: bool| if is_fast { 80.0 } else { 50.0 };
        let log = log_with_declared(declared, |is_fast| declared(is_fast) * if is_fast { 1.2 } else { 1.1 });
        assert!(found(&log)[0].model.effects.is_empty());
        // Losses do not fall as the load rises.
        let log = log_with_declared(declared, |is_fast| declared(is_fast) * if is_fast { 1.0 } else { 1.2 });
        assert_eq!(found(&log)[0].model.effects.len(), 1);
    }

    #[test]
    fn a_rival_is_worse_without_a_cut_only_by_what_it_says_of_those_readings() {
        let data = log(|_| 1.0);
        let (split, options) = (fifths(&data), Options::default());
        let diagnosis = begun(&data, &split, &options, 1.0);
        let is_cut = |i: usize| i % EACH >= IDLE;
        let noise = |i: usize| ((i * 7919) % 101) as f64 / 50.0 - 1.0;
        let left = |of_cut: f64, of_idle: f64| -> Vec<f64> {
            (0..data.len()).map(|i| noise(i) + if is_cut(i) { of_cut } else { of_idle }).collect()
        };
        assert!(diagnosis.worse_without_a_cut(&left(0.0, 3.0), &left(0.0, 0.0)) > 5.0);
        assert_eq!(diagnosis.worse_without_a_cut(&left(3.0, 0.0), &left(0.0, 0.0)), 0.0);
        assert!(diagnosis.worse_without_a_cut(&left(0.0, 0.0), &left(0.0, 3.0)) < -5.0);
        // In a table nothing tells which readings lie beside a cut.
        let table = Data { run: (0..data.len()).collect(), ..data.clone() };
        assert_eq!(begun(&table, &split, &options, 1.0).worse_without_a_cut(&left(0.0, 3.0), &left(0.0, 0.0)), 0.0);
    }

    #[test]
    fn readings_beside_a_cut_are_left_out() {
        let data = log(|_| 1.0);
        let idle = idle_readings(&data).unwrap();
        let used: Vec<usize> = idle.used().filter(|i| i / EACH == 1).map(|i| i % EACH).collect();
        assert_eq!(used, (BESIDE_A_CUT..IDLE - BESIDE_A_CUT).collect::<Vec<usize>>());
        assert!(idle_readings(&Data { run: (0..data.len()).collect(), ..data }).is_none());
    }
}
