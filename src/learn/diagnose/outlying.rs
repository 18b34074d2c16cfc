//! Single cuts of a table that the others do not predict: a slip of the pen, a reading at the end of the meter's range. In: [`Data`], the
//! effects of a model. Out: such samples, and what leaving them out costs as an explanation.
//!
//! One cut far off bends every coefficient, and effects are then found that explain it alone. A sample is outlying if the model fitted
//! without it misses it by many times the scatter of the rest; the worst is taken out first, then the next is sought. Leaving out k of n
//! samples explains with 3 k ln n what effects explain with p ln n for p parameters: each sample has a value of its own and is chosen among
//! n (Bayesian information criterion, Schwarz 1978). The cheaper explanation is kept.

use crate::learn::dataset::samples::{Class, Data};
use crate::learn::diagnose::criteria::{is_outlying, most_outlying};
use crate::learn::diagnose::forms::FORM_ROUNDS;
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{Fitted, fit, part};
use crate::learn::report::Outlying;
use rayon::prelude::*;

/// The samples that a model with these effects does not predict, the worst first.
pub(in crate::learn) fn outlying(data: &Data, effects: &[FittedEffect]) -> Vec<Outlying> {
    let mut found = Vec::new();
    let mut rest = data.clone();
    for _ in 0..most_outlying(data.used().count()) {
        let Some((worst, i)) = worst(&rest, effects) else { break };
        rest.weight[i] = 0.0;
        found.push(worst);
    }
    found
}

/// The data without the outlying samples.
pub(in crate::learn) fn without(data: &Data, outlying: &[Outlying]) -> Data {
    let mut rest = data.clone();
    for each in outlying {
        rest.weight[each.row - 1] = 0.0;
    }
    rest
}

/// n ln(S/n) for the squares that effects leave of the samples kept, with the charges for parameters and for samples left out; n counts
/// all samples of `data`. Infinite where there is no fit.
pub(in crate::learn) fn cost(data: &Data, effects: &[FittedEffect], outlying: &[Outlying]) -> f64 {
    let Some(fitted) = fit(&without(data, outlying), effects, FORM_ROUNDS) else { return f64::INFINITY };
    let n = data.used().count() as f64;
    let parameters: usize = effects.iter().map(FittedEffect::free_count).sum();
    let charged = parameters as f64 + 3.0 * outlying.len() as f64;
    n * (fitted.squares / n).max(f64::MIN_POSITIVE).ln() + charged * n.ln()
}

/// The sample that is missed most by the model of all others, if it is outlying.
fn worst(data: &Data, effects: &[FittedEffect]) -> Option<(Outlying, usize)> {
    let used: Vec<usize> = data.used().collect();
    let missed = |&i: &usize| {
        let mut others = data.clone();
        others.weight[i] = 0.0;
        let fitted = fit(&others, effects, FORM_ROUNDS)?;
        let free = used
            .len()
            .checked_sub(1 + data.base.len() + effects.iter().map(FittedEffect::free_count).sum::<usize>())?;
        let scatter = (fitted.squares / free.max(1) as f64).sqrt();
        let off = (data.reading[i] - fitted.predicted[i]) * data.weight[i].sqrt();
        Some((off.abs() / scatter, i, fitted))
    };
    let all: Vec<(f64, usize, Fitted)> = used.par_iter().filter_map(missed).collect();
    let (off, i, fitted) = all.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let load = part(data, &fitted, &[Class::Cutting, Class::Edge]);
    let is_largest = used.iter().all(|k| load[*k] <= load[i]);
    let said = Outlying { row: i + 1, reading: data.reading[i], predicted: fitted.predicted[i], is_largest };
    is_outlying(off).then_some((said, i))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::learn::diagnose::made_data::made;

    fn table(change: impl Fn(usize, f64) -> f64) -> Vec<usize> {
        let mut data = made(|_| 0.0, 0.0, |i| State { time_s: i as f64, ..State::default() });
        let noise = |i: usize| 2.0 * (((i * 7919) % 101) as f64 / 50.0 - 1.0);
        data.reading.iter_mut().enumerate().for_each(|(i, y)| *y = change(i, *y) + noise(i));
        outlying(&data, &[]).iter().map(|each| each.row - 1).collect()
    }

    #[test]
    fn readings_far_off_are_found_and_no_others() {
        assert!(table(|_, y| y).is_empty());
        assert_eq!(table(|i, y| if i == 7 { y + 30.0 } else { y }), [7]);
        let mut two = table(|i, y| if i == 7 || i == 20 { y - 30.0 } else { y });
        two.sort_unstable();
        assert_eq!(two, [7, 20]);
        // Within the noise.
        assert!(table(|i, y| if i == 7 { y + 2.0 } else { y }).is_empty());
    }
}
