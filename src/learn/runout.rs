//! Runout from the peak forces of a log. In: the effects found, with coefficients; a function that computes the data
//! for any runout. Out: data whose forces are linearised about the runout of least squares.
//!
//! Which tooth causes the peak force depends on the direction of the runout. The squares therefore have several local
//! minima over that direction, and a force is not linear between two runouts of a grid. First the minima are located at
//! the offset that was found, in all directions; then each of the best is refined by damped Gauss–Newton steps, with
//! the forces computed again at every step in a narrower grid. Each measured quantity is weighted by its residual
//! variance in the best fit so far.

use crate::effects::Geometry;
use crate::learn::dataset::samples::Data;
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{Fitted, fit};
use crate::learn::model::whitening::weighed_by;
use crate::learn::program::runout_grid::RunoutGrid;
use crate::machine::material::LinearEdge;
use rayon::prelude::*;

/// Start directions over one pitch of the teeth.
const WAYS: usize = 16;
/// Most iterations of a fit.
const ROUNDS: usize = 12;
/// Local minima that are refined, and their least distance, pitches.
const FOLLOWED: usize = 3;
const APART: f64 = 0.08;
/// Most steps for each of them, and for the best.
const STEPS: [usize; 2] = [1, 4];
/// Factor on the reach of the grid from step to step, and on a step that failed.
const NARROWER: f64 = 0.5;

/// A runout with its data.
struct Place {
    data: Data,
    /// The fit with this runout fixed.
    fitted: Fitted,
    /// Reach of the grid of `data`; see [`RunoutGrid::about`].
    reach: f64,
}

/// The search.
struct Search<'a, F> {
    /// The data with the forces linearised about the runouts of a grid, at these coefficients.
    about: &'a F,
    /// Index of the runout among the effects.
    own: usize,
    /// Weighted data, and their best fit.
    weights: (Data, Fitted),
}

/// The data linearised about the runout of least squares; `effects` contains the runout found so far.
pub(in crate::learn) fn data_about_best_runout<F>(
    effects: &[FittedEffect],
    coefficients: LinearEdge,
    about: &F,
) -> Option<Data>
where
    F: Fn(RunoutGrid, LinearEdge) -> Data + Sync,
{
    let own = effects.iter().position(|each| each.effect.changes(Geometry::Runout))?;
    let wide = about(RunoutGrid::about_offset(effects[own].values[0]), coefficients);
    let begun = fit(&wide, effects, ROUNDS)?;
    let round = |wide: &Data| -> Vec<Fitted> {
        let from = |way: usize| {
            let mut begin = begun.model.effects.clone();
            begin[own].values = vec![effects[own].values[0], way as f64 / WAYS as f64];
            fit(wide, &begin, ROUNDS)
        };
        let mut found: Vec<Fitted> = (0..WAYS).into_par_iter().filter_map(from).collect();
        found.sort_by(|a, b| a.squares.total_cmp(&b.squares));
        found
    };
    let first = round(&weighed_by(&wide, &begun)).into_iter().next()?;
    let wide = weighed_by(&wide, &first);
    let search = Search { about, own, weights: (wide, first) };
    let valleys = search.distinct(round(&search.weights.0));
    let followed = valleys.par_iter().filter_map(|valley| search.followed(search.place(valley, 1.0)?, STEPS[0]));
    let deepest = followed.collect::<Vec<Place>>().into_iter().min_by(|a, b| a.squares().total_cmp(&b.squares()))?;
    search.followed(deepest, STEPS[1]).map(|place| Data { runouts: place.data.runouts.of_found(), ..place.data })
}

impl Place {
    fn squares(&self) -> f64 {
        self.fitted.squares
    }
}

impl<F: Fn(RunoutGrid, LinearEdge) -> Data + Sync> Search<'_, F> {
    fn runout(&self, fitted: &Fitted) -> [f64; 2] {
        [0, 1].map(|k| fitted.model.effects[self.own].values[k])
    }

    /// The best of these fits (sorted by their squares) whose directions differ by at least [`APART`].
    fn distinct(&self, fits: Vec<Fitted>) -> Vec<Fitted> {
        let mut kept: Vec<Fitted> = Vec::new();
        for each in fits {
            let off = |other: &Fitted| self.runout(&each)[1] - self.runout(other)[1];
            if kept.len() < FOLLOWED && kept.iter().all(|other| (off(other) - off(other).round()).abs() >= APART) {
                kept.push(each);
            }
        }
        kept
    }

    /// The effects with this runout, fitted (`free`) or fixed.
    fn with_runout(&self, effects: &[FittedEffect], runout: [f64; 2], free: bool) -> Vec<FittedEffect> {
        let mut all = effects.to_vec();
        all[self.own] = FittedEffect { values: runout.to_vec(), free: vec![free; 2], ..all[self.own].clone() };
        all
    }

    /// The data linearised about the runout of a fit.
    fn place(&self, at: &Fitted, reach: f64) -> Option<Place> {
        let runout = self.runout(at);
        let coefficients = coefficients(&self.weights.0, at);
        let taken = (self.about)(RunoutGrid::about(runout, reach), coefficients);
        let data = self.weighed(taken);
        let fitted = fit(&data, &self.with_runout(&at.model.effects, runout, false), ROUNDS)?;
        Some(Place { data, fitted, reach })
    }

    /// Damped Gauss–Newton steps to lower squares, at most `steps`.
    fn followed(&self, from: Place, steps: usize) -> Option<Place> {
        let mut at = from;
        let mut share = 1.0;
        for _ in 0..steps {
            let here = self.runout(&at.fitted);
            let mut next = fit(&at.data, &self.with_runout(&at.fitted.model.effects, here, true), ROUNDS)?;
            let there = self.runout(&next);
            let part = [0, 1].map(|k| here[k] + share * (there[k] - here[k]));
            next.model.effects = self.with_runout(&next.model.effects, part, true);
            let tried = self.place(&next, NARROWER * at.reach)?;
            if tried.squares() < at.squares() {
                (at, share) = (tried, 1.0);
            } else {
                share *= NARROWER;
            }
        }
        Some(at)
    }

    /// The data with the weights of the search, so that squares are comparable.
    fn weighed(&self, data: Data) -> Data {
        Data { weight: self.weights.0.weight.clone(), ..data }
    }
}

/// Fitted coefficients in the plane.
fn coefficients(data: &Data, fitted: &Fitted) -> LinearEdge {
    let value = |name: &str| data.base.iter().position(|b| b.name == name).map_or(0.0, |b| fitted.model.base[b]);
    let [k_tc, k_rc, k_te, k_re] = ["k_tc", "k_rc", "k_te", "k_re"].map(value);
    LinearEdge { k_tc, k_rc, k_te, k_re, ..LinearEdge::default() }
}
