//! Load effects of the process model at one station. In: the state of the cut, the effects with their parameters. Out: factors on cutting
//! forces, edge forces and tare, and the chip thickness added for the most loaded tooth. Effects on geometry, motion and the measuring chain are
//! applied elsewhere.
//!
//! A factor on the tare that depends on something only a cut has (path since entry, a depth) cannot come from the idle spindle. The power above
//! the tare then comes from the cut, and counts as torque on the tool, although a part of it may be an error of the meter.

use super::error::ForceError;
use crate::effects::{Acts, Effect, Excess, State, named};
use crate::machine::material::Process;

/// Factors at one feed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Factors {
    pub cutting: f64,
    /// On edge forces, from effects without wear.
    pub edge: f64,
    /// Rise of the wear index over that of a fresh edge.
    pub worn: f64,
    pub tare: f64,
    /// Power that the cut takes beside its forces, as a share of the tare.
    pub made_by_cut: f64,
    /// Added to the feed per tooth where a peak is asked for, mm.
    pub peak_feed_mm: f64,
}

impl Default for Factors {
    fn default() -> Self {
        Self { cutting: 1.0, edge: 1.0, worn: 0.0, tare: 1.0, made_by_cut: 0.0, peak_feed_mm: 0.0 }
    }
}

impl Factors {
    /// Factor on the edge forces, wear included.
    pub(super) fn edge_worn(&self) -> f64 {
        self.edge * (1.0 + self.worn)
    }
}

/// The effects of a process model with their parameter values. Wear of edges is not among them: it comes with the state.
#[derive(Debug, Clone, Default)]
pub(super) struct Effects(Vec<(&'static Effect, Vec<f64>)>);

impl PartialEq for Effects {
    fn eq(&self, other: &Self) -> bool {
        let named =
            |effects: &Self| effects.0.iter().map(|(effect, values)| (effect.name, values.clone())).collect::<Vec<_>>();
        named(self) == named(other)
    }
}

impl Effects {
    /// The effects of a process model, checked against the list; and the name of the effect by which edges wear, which is an error in a model
    /// without an edge force.
    pub(super) fn of(process: &Process) -> Result<(Self, Option<&'static str>), ForceError> {
        let (mut effects, mut wearing) = (Vec::new(), None);
        for used in &process.effects {
            let unknown = || ForceError::UnknownEffect { name: used.name.clone() };
            let effect = named(&used.name).ok_or_else(unknown)?;
            let mut values = Vec::new();
            for parameter in effect.parameters {
                let found = used.parameters.iter().find(|(name, _)| name == parameter.name).map(|(_, value)| *value);
                let missing = ForceError::MissingParameter { key: parameter.name, model: effect.name };
                let value = found.or(parameter.neutral).ok_or(missing)?;
                super::error::range(parameter.name, value, parameter.min, parameter.max)?;
                values.push(value);
            }
            if effect.wear.is_some() {
                wearing = Some(effect.name);
            } else {
                effects.push((effect, values));
            }
        }
        Ok((Self(effects), wearing))
    }

    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// What the meter showed beyond the load.
    pub(super) fn excess(&self) -> Excess {
        let of = |(effect, values): &(&'static Effect, Vec<f64>)| (effect.change)(values, &State::default()).excess;
        self.0.iter().map(of).find(|excess| excess.at_full != 0.0).unwrap_or_default()
    }

    /// The effects at a station, as functions of feed; `chip_per_feed` is the mean chip thickness per feed per tooth, as those of the sectors
    /// of `state` are.
    pub(super) fn at(&self, state: &State, chip_per_feed: f64) -> Modifiers {
        if self.0.is_empty() {
            return Modifiers::Constant(Factors { worn: worn(state), ..Factors::default() });
        }
        let moving = Moving { effects: self.clone(), state: *state, chip_per_feed };
        let (thin, thick) = (moving.at(0.01), moving.at(0.3));
        if thin == thick { Modifiers::Constant(thin) } else { Modifiers::Moving(Box::new(moving)) }
    }
}

/// Factors as a function of feed.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Modifiers {
    Constant(Factors),
    Moving(Box<Moving>),
}

/// Effects of which at least one depends on feed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Moving {
    effects: Effects,
    state: State,
    chip_per_feed: f64,
}

impl Modifiers {
    /// The factors when they do not depend on feed.
    pub(super) fn constant(&self) -> Option<Factors> {
        match self {
            Modifiers::Constant(factors) => Some(*factors),
            Modifiers::Moving(_) => None,
        }
    }
    /// At a feed per tooth.
    pub(super) fn at(&self, f: f64) -> Factors {
        match self {
            Modifiers::Constant(factors) => *factors,
            Modifiers::Moving(moving) => moving.at(f),
        }
    }
}

impl Moving {
    fn at(&self, f: f64) -> Factors {
        let mut state = State { feed_per_tooth_mm: f, chip_thickness_mm: self.chip_per_feed * f, ..self.state };
        state.sectors.iter_mut().for_each(|sector| sector.chip_thickness_mm *= f);
        let mut factors = Factors { worn: worn(&state), ..Factors::default() };
        for (effect, values) in self.effects.0.iter().filter(|(effect, _)| effect.acts == Acts::Load) {
            let change = (effect.change)(values, &state);
            factors.cutting *= known(change.cutting);
            factors.edge *= known(change.edge);
            let tare = known(change.tare);
            if tare > 1.0 && effect.covariates.iter().any(|covariate| covariate.is_of_cut()) {
                factors.made_by_cut += tare - 1.0;
            } else {
                factors.tare *= tare;
            }
            factors.peak_feed_mm += if change.peak_chip_mm.is_finite() { change.peak_chip_mm } else { 0.0 };
        }
        factors
    }
}

/// Wear by the law of the tool; 0 without a law.
fn worn(state: &State) -> f64 {
    if state.worn.is_finite() { state.worn } else { 0.0 }
}

/// A factor, or 1 where it depends on something that is not known here.
fn known(factor: f64) -> f64 {
    if factor.is_finite() { factor } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Sector;
    use crate::machine::material::EffectUse;

    /// Factors where a curve of the tare over a covariate stands at 1.4, and then at 0.8.
    fn with_tare_over(covariate: &str, state: &State) -> Factors {
        let parameters = [("at_1", 1.0), ("at_2", 2.0), ("factor_1", 1.4), ("factor_2", 0.8)];
        let parameters = parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        let effects = vec![EffectUse { name: format!("unnamed-tare-{covariate}"), parameters }];
        let (effects, _) = Effects::of(&Process { effects, ..Process::default() }).expect("of the list");
        effects.at(state, 0.5).at(0.1)
    }

    #[test]
    fn a_law_of_the_chip_is_the_mean_over_the_arc_at_every_feed() {
        let parameters = vec![("exponent".to_owned(), 0.3)];
        let effects = vec![EffectUse { name: "size-effect".into(), parameters }];
        let (effects, _) = Effects::of(&Process { effects, ..Process::default() }).expect("of the list");
        let mut state = State::default();
        for (sector, chip) in state.sectors.iter_mut().zip([0.2, 0.8]) {
            *sector = Sector { share: [chip, 0.5], chip_thickness_mm: chip, ..Sector::default() };
        }
        for feed in [0.02, 0.2] {
            let expected: f64 = [0.2_f64, 0.8].map(|chip| chip * (chip * feed / 0.05).powf(-0.3)).iter().sum();
            assert!((effects.at(&state, 0.5).at(feed).cutting - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn what_a_meter_reads_more_in_the_course_of_a_cut_is_made_by_the_cut() {
        let at = |depth: f64| State { axial_depth_mm: depth, rps: depth, ..State::default() };
        let of_cut = with_tare_over("axial-depth", &at(1.0));
        assert!((of_cut.made_by_cut - 0.4).abs() < 1e-12 && of_cut.tare == 1.0, "{of_cut:?}");
        // A speed of the spindle is there without a cut.
        let of_spindle = with_tare_over("spindle-speed", &at(1.0));
        assert!(of_spindle.made_by_cut == 0.0 && (of_spindle.tare - 1.4).abs() < 1e-12, "{of_spindle:?}");
        // What it reads less takes nothing off the tool.
        let less = with_tare_over("axial-depth", &at(2.0));
        assert!(less.made_by_cut == 0.0 && (less.tare - 0.8).abs() < 1e-12, "{less:?}");
    }
}
