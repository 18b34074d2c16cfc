//! Start values of a fit: the forms of an effect and values of its parameters. In: effect. Out: [`FittedEffect`]s.

use crate::effects::Effect;
use crate::learn::model::design::FittedEffect;

/// Forms of the effect with these start values: those that the effect declares, or every set of its optional parameters
/// (those with a neutral value) held at neutral. If an instant or region is searched for, optional parameters that
/// start at neutral stay there.
pub fn forms(effect: &'static Effect, values: &[f64]) -> Vec<FittedEffect> {
    let stays = |k: usize| effect.is_looked_for() && effect.parameters[k].neutral == Some(values[k]);
    let optional: Vec<usize> =
        (0..values.len()).filter(|k| effect.parameters[*k].neutral.is_some() && !stays(*k)).collect();
    if !effect.forms.is_empty() {
        return effect.forms.iter().map(|free| fitted_in(effect, values, free)).collect();
    }
    let form = |pinned: usize| {
        let chosen = |k: usize| optional.iter().position(|o| *o == k).is_some_and(|bit| pinned >> bit & 1 == 1);
        let is_pinned = |k: usize| stays(k) || chosen(k);
        let value = |k: usize| effect.parameters[k].neutral.filter(|_| is_pinned(k)).unwrap_or(values[k]);
        FittedEffect {
            effect,
            values: (0..values.len()).map(value).collect(),
            free: (0..values.len()).map(|k| !is_pinned(k)).collect(),
        }
    };
    let strong = |u: &FittedEffect| {
        u.free.is_empty() || (0..u.free.len()).any(|k| u.free[k] && !effect.parameters[k].is_scanned())
    };
    (0..1usize << optional.len()).map(form).filter(strong).collect()
}

/// The effect with these parameters fitted and the other optional ones at neutral; those that are read off the data keep their value.
fn fitted_in(effect: &'static Effect, values: &[f64], fitted: &[usize]) -> FittedEffect {
    let is_read_off = |k: usize| effect.parameters[k].is_read_off();
    let neutral = |k: usize| effect.parameters[k].neutral.filter(|_| !fitted.contains(&k) && !is_read_off(k));
    FittedEffect {
        effect,
        values: (0..values.len()).map(|k| neutral(k).unwrap_or(values[k])).collect(),
        free: (0..values.len()).map(|k| neutral(k).is_none() && !is_read_off(k)).collect(),
    }
}

/// Every combination of the start values of an effect's parameters.
pub fn start_values(effect: &Effect) -> Vec<Vec<f64>> {
    let mut all = vec![Vec::new()];
    for parameter in effect.parameters {
        all = all
            .iter()
            .flat_map(|head: &Vec<f64>| {
                parameter.starts.iter().map(|start| head.iter().copied().chain([*start]).collect::<Vec<f64>>())
            })
            .collect();
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::named;

    #[test]
    fn declared_forms_are_fitted_as_declared_and_the_others_in_every_set() {
        let proud = named("stock-proud").unwrap();
        let all = forms(proud, &[0.0; 9]);
        let free: Vec<Vec<usize>> = all.iter().map(|each| (0..9).filter(|k| each.free[*k]).collect()).collect();
        assert!(free.contains(&vec![2]) && free.contains(&vec![2, 3, 4, 5]) && !free.contains(&vec![2, 3]));
        let drive = named("drive-efficiency").unwrap();
        let read_off = forms(drive, &[0.05, 1.2, 400.0, 0.0]);
        let said: Vec<_> = read_off.iter().map(|each| (each.values.clone(), each.free.clone())).collect();
        let [one, both] = &said[..] else { panic!("{said:?}") };
        assert_eq!(*one, (vec![0.05, 1.0, 400.0, 0.0], vec![true, false, false, false]));
        assert_eq!(*both, (vec![0.05, 1.2, 400.0, 0.0], vec![true, true, false, false]));
    }
}
