//! What the load effects of the process model do at one station: factors on cutting forces, edge forces and tare, and what
//! the most loaded tooth cuts more. Effects on geometry, motion and the measuring chain are applied elsewhere.

use super::error::ForceError;
use crate::effects::{Acts, Effect, State, named};
use crate::machine::material::Process;

/// Factors at one feed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Factors {
    pub cutting: f64,
    /// On edge forces, by effects alone.
    pub edge: f64,
    /// Rise of the wear index over that of a fresh edge.
    pub worn: f64,
    pub tare: f64,
    /// Added to the feed per tooth where a peak is asked for, mm.
    pub peak_feed_mm: f64,
}

impl Default for Factors {
    fn default() -> Self {
        Self { cutting: 1.0, edge: 1.0, worn: 0.0, tare: 1.0, peak_feed_mm: 0.0 }
    }
}

impl Factors {
    /// On the edge forces of a law along the edge, wear included.
    pub(super) fn edge_worn(&self) -> f64 {
        self.edge * (1.0 + self.worn)
    }
}

/// The effects of a process model with their parameter values, but for the wear of edges: that comes with the state.
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
    /// Those of a process model, checked against the list, and the one by which edges wear: it has nothing to act on where there
    /// is no edge force.
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

    /// At a station whose state has no feed in it yet; `chip_per_feed` is the mean chip thickness per feed per tooth.
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
        let state = State { feed_per_tooth_mm: f, chip_thickness_mm: self.chip_per_feed * f, ..self.state };
        let mut factors = Factors { worn: worn(&state), ..Factors::default() };
        for (effect, values) in self.effects.0.iter().filter(|(effect, _)| effect.acts == Acts::Load) {
            let change = (effect.change)(values, &state);
            factors.cutting *= known(change.cutting);
            factors.edge *= known(change.edge);
            factors.tare *= known(change.tare);
            factors.peak_feed_mm += if change.peak_chip_mm.is_finite() { change.peak_chip_mm } else { 0.0 };
        }
        factors
    }
}

/// Wear by the law of the tool; none where it has no law.
fn worn(state: &State) -> f64 {
    if state.worn.is_finite() { state.worn } else { 0.0 }
}

/// A factor that rests on something unknown here is left out.
fn known(factor: f64) -> f64 {
    if factor.is_finite() { factor } else { 1.0 }
}
