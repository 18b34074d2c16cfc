//! Set-ups of a table that differ as a whole. In: data, the effects of an answer. Out: by what factor the load of each set-up differs from that
//! of the first, if such factors explain the readings better than the effects.
//!
//! A harder batch, another edge or another clamping loads every cut of a set-up alike; wear grows from cut to cut within it. Both rise from set-up to
//! set-up. They are compared by n ln(S/n) + k ln n, S being the squares of n readings that k parameters leave (Schwarz 1978).

use crate::learn::dataset::samples::{Class, Data};
use crate::learn::diagnose::criteria::{Criteria, is_set_up_apart};
use crate::learn::diagnose::forms::FORM_ROUNDS;
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{fit, part};

/// Rounds in which factors and coefficients are fitted by turns.
const ROUNDS: usize = 30;

/// Number of each set-up and its load over that of the first, where that explains the readings clearly better than the effects.
pub(in crate::learn) fn set_up_factors(data: &Data, effects: &[FittedEffect]) -> Option<Vec<(usize, f64)>> {
    let used: Vec<usize> = data.used().collect();
    let set_ups = data.blocks();
    if set_ups.len() < 2 || set_ups.len() * 2 > used.len() {
        return None;
    }
    let n = used.len() as f64;
    let cost = |squares: f64, parameters: usize| n * (squares / n).ln() + parameters as f64 * n.ln();
    let named = fit(data, effects, FORM_ROUNDS)?;
    let free = effects.iter().map(FittedEffect::free_count).sum();
    let (factors, squares) = fitted_factors(data, &used, set_ups.iter().max()? + 1)?;
    let gain = cost(named.squares, free) - cost(squares, set_ups.len() - 1);
    let first = factors[*set_ups.first()?];
    let over_first: Vec<(usize, f64)> = set_ups.iter().map(|block| (*block, factors[*block] / first)).collect();
    let is_any_apart = over_first.iter().any(|(_, factor)| is_set_up_apart(*factor));
    (is_any_apart && gain > Criteria::default().least_score(false)).then_some(over_first)
}

/// A factor on the load of each set-up, by number, with the squares that are left beside the base coefficients.
fn fitted_factors(data: &Data, used: &[usize], count: usize) -> Option<(Vec<f64>, f64)> {
    let mut factors = vec![1.0; count];
    let mut squares = f64::INFINITY;
    for _ in 0..ROUNDS {
        let mut scaled = data.clone();
        for (base, column) in scaled.base.iter().zip(&mut scaled.columns) {
            if base.class != Class::Tare {
                column.iter_mut().zip(&data.block).for_each(|(x, block)| *x *= factors[*block]);
            }
        }
        let fitted = fit(&scaled, &[], 0)?;
        squares = fitted.squares;
        let load = part(&scaled, &fitted, &[Class::Cutting, Class::Edge]);
        let mut sums = vec![[0.0; 2]; count];
        for &i in used {
            let beside_tare = data.reading[i] - (fitted.predicted[i] - load[i]);
            let [along, whole] = &mut sums[data.block[i]];
            *along += data.weight[i] * load[i] * beside_tare;
            *whole += data.weight[i] * load[i] * load[i];
        }
        for (factor, [along, whole]) in factors.iter_mut().zip(sums) {
            *factor *= if whole > 0.0 { (along / whole).max(0.0) } else { 1.0 };
        }
    }
    Some((factors, squares))
}
