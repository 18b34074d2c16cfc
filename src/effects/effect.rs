//! One effect as data. In: the file of an effect fills an [`Effect`]. Out: calibration, diagnosis, prediction and scheduling read it.

use super::change::Change;
use super::covariate::Covariate;
use super::state::State;
use crate::machine::material::EffectUse;
use crate::machine::wear::WearRate;

/// Where an effect acts, and so which room applies it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acts {
    /// On the geometry of the cut (engage).
    Geometry,
    /// On the coefficients of the load (force).
    Load,
    /// On the motion of the machine (schedule).
    Motion,
    /// On the measuring chain (learn).
    Measuring,
}

impl Acts {
    /// Name in `library effects`.
    pub fn name(self) -> &'static str {
        match self {
            Acts::Geometry => "geometry",
            Acts::Load => "load",
            Acts::Motion => "motion",
            Acts::Measuring => "measuring",
        }
    }
}

/// What the data must contain before an effect is looked for in them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Need {
    /// A covariate whose values span more than this, in the unit of [`State`].
    Range(Covariate, f64),
    /// A covariate whose largest value is at least this many times the smallest value; values below 2 % of the largest do not count.
    Ratio(Covariate, f64),
    /// A covariate that is known at all.
    Known(Covariate),
    /// Readings at places where nothing is cut.
    Tare,
    /// Base coefficients without an edge force.
    NoEdgeCoefficients,
    /// Enough samples to place an instant or a region.
    Samples,
    /// Samples that follow each other in time.
    Series,
}

/// The part of the geometry that an effect changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Geometry {
    /// The top face of the stock.
    StockTop,
    /// The side faces of the stock.
    StockSide,
    /// The diameter of the tool.
    Diameter,
    /// A curved path in place of a straight one.
    Curved,
    /// The axis of the tool, off that of the spindle.
    Runout,
}

/// What a parameter stands for that is searched for in the data and has no fixed start: an instant, a side of a region, a knot; or that is
/// read off them and not fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// An instant, s. The load jumps there and does not vary smoothly with it: it is scanned, not fitted.
    Instant,
    /// Least X of a region, mm.
    XMin,
    /// Greatest X.
    XMax,
    /// Least Y.
    YMin,
    /// Greatest Y.
    YMax,
    /// A knot of a curve over a covariate.
    Knot,
    /// The largest power or relative load that was read, W or the unit of the reading.
    LargestPower,
    /// The largest torque that was read, N·m.
    LargestTorque,
}

/// A parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Name in model files and reports.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Least physical value.
    pub min: f64,
    /// Greatest physical value.
    pub max: f64,
    /// Values at which a search begins.
    pub starts: &'static [f64],
    /// Value at which the parameter changes nothing. Simpler forms of the effect leave it there; so do models that do not give it. `None`:
    /// always fitted.
    pub neutral: Option<f64>,
    /// The instant or place that it stands for, if its start is searched for in the data; `None`: the search begins at `starts`.
    pub place: Option<Place>,
    /// Its meaning, for reports.
    pub meaning: &'static str,
}

impl Parameter {
    /// Is its value found by trying instants one after the other, instead of being fitted?
    pub fn is_scanned(&self) -> bool {
        matches!(self.place, Some(Place::Instant | Place::Knot))
    }

    /// Is it read off the data, so that nothing is fitted?
    pub fn is_read_off(&self) -> bool {
        matches!(self.place, Some(Place::LargestPower | Place::LargestTorque))
    }
}

/// The part of a reading that an effect changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Multiplies {
    /// The part from the cut: cutting and edge terms.
    Load,
    /// The part that the idle spindle takes.
    Tare,
    /// All that the meter shows.
    Reading,
}

/// Whether a reading rises or falls as a covariate grows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// It only rises.
    Up,
    /// It only falls.
    Down,
    /// Any but with its largest value inside the range.
    NoPeak,
    /// It may rise, fall, or both.
    Either,
}

/// See [`Effect::as_worn`].
pub type AsWorn = fn(&[f64], f64) -> Vec<f64>;

/// One named effect: everything that any room needs to know of it stands in its file.
#[derive(Debug)]
pub struct Effect {
    /// Name in reports and model files.
    pub name: &'static str,
    /// One sentence.
    pub meaning: &'static str,
    /// Where it acts.
    pub acts: Acts,
    /// What it depends on.
    pub covariates: &'static [Covariate],
    /// What of a reading it changes.
    pub multiplies: Multiplies,
    /// Covariates that belong to this effect alone: if a residual follows one of them in a way that the law does not fit, it is still
    /// this effect.
    pub family: &'static [Covariate],
    /// Whether the reading rises or falls with these covariates.
    pub way: Way,
    /// Its parameters.
    pub parameters: &'static [Parameter],
    /// Sets of parameters (by index) that are fitted together while the others stay neutral. Empty: every combination of those that have a
    /// neutral value.
    pub forms: &'static [&'static [usize]],
    /// The law: what the effect changes for given parameters and a given cut.
    pub change: fn(&[f64], &State) -> Change,
    /// The wear law of an effect that wears edges, for a wear index that is 1 on a fresh edge. Such an effect reaches predicted loads as wear
    /// of the tool ([`super::wear`]), not through `change`.
    pub wear: Option<fn(&[f64]) -> WearRate>,
    /// The values of the parameters for an edge that is from its first cut on as worn as these values make it after a way, mm.
    pub as_worn: Option<AsWorn>,
    /// The test cut that distinguishes it from other effects, one clause.
    pub separated_by: &'static str,
    /// What the data must contain before it is looked for: all of these.
    pub needs: &'static [Need],
    /// The parts of the geometry that it changes; cuts that none of these changes cannot show it.
    pub geometry: &'static [Geometry],
    /// Why fitted values inside the bounds are still not this effect; `None`: they are. The second argument is the uncertainty of the
    /// times in the log, s.
    pub refused: fn(&[f64], f64) -> Option<String>,
    /// True for an event that does not happen again when the program is run again, such as a chipped edge.
    pub is_accident: bool,
}

/// The values of all fields that the file of an effect does not give.
pub(super) const BARE: Effect = Effect {
    name: "",
    meaning: "",
    acts: Acts::Load,
    covariates: &[],
    multiplies: Multiplies::Load,
    family: &[],
    way: Way::Either,
    parameters: &[],
    forms: &[],
    change: |_, _| Change::default(),
    wear: None,
    as_worn: None,
    separated_by: "",
    needs: &[],
    geometry: &[],
    refused: |_, _| None,
    is_accident: false,
};

impl Effect {
    /// Are these values inside their bounds?
    pub fn is_physical(&self, values: &[f64]) -> bool {
        let inside = |(p, v): (&Parameter, &f64)| v.is_finite() && *v >= p.min && *v <= p.max;
        values.len() == self.parameters.len() && self.parameters.iter().zip(values).all(inside)
    }

    /// Does it have a parameter whose start is searched for in the data?
    pub fn is_looked_for(&self) -> bool {
        self.parameters.iter().any(|p| p.place.is_some() && !p.is_read_off())
    }

    /// Does the reading exceed the load with this effect? Then it acts without a cut as well.
    #[must_use]
    pub fn has_losses(&self) -> bool {
        let start: Vec<f64> = self.parameters.iter().map(|parameter| parameter.starts[0]).collect();
        (self.change)(&start, &State::default()).excess.at_full != 0.0
    }

    /// Does it change this part of a reading, depending on this covariate?
    pub fn knows(&self, covariate: Covariate, part: Multiplies) -> bool {
        self.multiplies == part && self.covariates.contains(&covariate)
    }

    /// Does it change this part of the geometry?
    pub fn changes(&self, geometry: Geometry) -> bool {
        self.geometry.contains(&geometry)
    }

    /// The values of its parameters, in order, from a model; neutral where the model gives none. `None`: a parameter without a neutral
    /// value is missing.
    pub fn values(&self, used: &EffectUse) -> Option<Vec<f64>> {
        let given = |name: &str| used.parameters.iter().find(|(key, _)| key == name).map(|(_, value)| *value);
        self.parameters.iter().map(|p| given(p.name).or(p.neutral)).collect()
    }
}
