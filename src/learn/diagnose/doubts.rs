//! Reasons against using a fit as a model. In: an aligned log with its report, or the parameters of a fit and the
//! coefficients that the setup declares. Out: one clause for each doubt, with the likely cause.

use crate::learn::align::{Aligned, Method, stretch};
use crate::learn::dataset::measured_feed::measured_feed;
use crate::learn::dataset::samples::{Base, Class, Data, UNBOUNDED};
use crate::learn::diagnose::criteria::{
    covers_too_little, explains_next_to_nothing, is_negative, is_of_a_material, is_of_another_program,
    is_ratio_of_materials, is_stretch_of_a_machine, stands_too_long,
};
use crate::learn::log::Log;
use crate::learn::model::design::{FittedEffect, in_model};
use crate::learn::model::fit::{certainty, fit};
use crate::learn::program::timeline::Timeline;
use crate::learn::report::{Estimate, LearnReport};

/// Steps by which effects follow coefficients without priors. Judgement: they were fitted before.
const UNAIDED_STEPS: usize = 20;
/// Time in motion at either end of the program without a sample, above which it is reported, s. Judgement.
const UNSEEN_S: f64 = 1.0;

/// Doubts about a log that was aligned with its program.
pub fn of_log(report: &LearnReport, aligned: &Aligned, timeline: &Timeline, log: &Log, data: &Data) -> Vec<String> {
    let mut doubts = Vec::new();
    for (name, values) in &log.measured {
        let missing = values.iter().filter(|v| !v.is_finite()).count();
        if missing * 2 > values.len() {
            doubts.push(format!("{} % of {name} are missing", 100 * missing / values.len()));
        }
    }
    if is_of_another_program(aligned.misfit, aligned.method == Method::Load) {
        doubts.push(format!(
            "{:.0} % of the log do not fit this program: is it the log of another one?",
            100.0 * aligned.misfit
        ));
    }
    if let Some(higher_mm) = log.higher_mm {
        doubts.push(format!(
            "the positions lie {higher_mm:+.3} mm in Z beside the path, where X and Y agree: how deep these cuts are is not known (is it the log of \
             another program? If its zero was another one, take {higher_mm:+.3} off its Z)"
        ));
    }
    let standing = measured_feed(log, aligned, timeline).map_or(0.0, |feed| feed.standing(aligned, timeline));
    if stands_too_long(standing) {
        doubts.push(format!(
            "the tool stands still in {:.0} % of the feed-move samples: are the units of the positions right?",
            100.0 * standing
        ));
    }
    let covered = covered(aligned, timeline);
    if covers_too_little(covered) {
        doubts.push(format!("the log covers only {:.0} % of the program", 100.0 * covered));
    }
    let stretch = stretch(aligned, log);
    if !is_stretch_of_a_machine(stretch) {
        doubts.push(format!("the log lasts {stretch:.3} times as long as the program: is the unit of its time right?"));
    }
    let declared = data.base.iter().find(|b| b.name == "k_tc").and_then(|b| b.prior).map(|(value, _)| value);
    let found: Vec<FittedEffect> = report.effects.iter().filter_map(in_model).collect();
    // A unit is wrong with and without the effects; a coefficient that an effect puts right is none.
    let [plain, final_fit] = [&[][..], &found].map(|effects| of_coefficients(&unaided(data, effects), declared));
    doubts.extend(if final_fit.is_empty() { final_fit } else { plain });
    if let Some(ratio) = over_declared(data).filter(|ratio| !is_ratio_of_materials(*ratio)) {
        doubts.push(format!(
            "the forces would be {ratio:.4} times the declared ones: are the units right, or columns swapped?"
        ));
    }
    if explains_next_to_nothing(report.base_train.r2) && report.effects.is_empty() {
        doubts.push("the predicted load explains next to nothing of the measured one".into());
    }
    doubts
}

/// Doubts about a table of steady cuts.
pub fn of_table(report: &LearnReport, data: &Data, declared_k_tc: Option<f64>) -> Vec<String> {
    let is_determined = |value: &&Estimate| report.left_out.iter().all(|left| left.name != value.name);
    let told: Vec<Estimate> = report.base.iter().filter(is_determined).cloned().collect();
    let mut doubts = of_coefficients(&told, declared_k_tc);
    let alone = unaided(data, &[]);
    doubts.extend(negative(if alone.is_empty() { &report.base } else { &alone }));
    // Relative forces are all ±1: their R² has no meaning.
    let spread = data.variants.is_empty() && data.base.iter().any(|b| b.name == "k_rc");
    if explains_next_to_nothing(report.base_train.r2) && report.effects.is_empty() && !spread {
        doubts.push("the cuts explain next to nothing of what was measured: are columns swapped?".into());
    }
    if report.train <= report.base.len() + 1 {
        doubts.push(format!("{} cuts are too few for {} coefficients", report.train, report.base.len()));
    }
    doubts
}

/// Doubts about a tangential cutting coefficient.
pub fn of_coefficients(parameters: &[Estimate], declared: Option<f64>) -> Vec<String> {
    let Some(k_tc) = parameters.iter().find(|p| (p.name == "k_tc" || p.name == "k_c11") && p.unit == "N/mm²") else {
        return Vec::new();
    };
    let ask = "are the units right, or columns swapped?";
    match declared.filter(|k| *k > 0.0).map(|k| k_tc.value / k) {
        Some(ratio) if !is_ratio_of_materials(ratio) => {
            vec![format!("{} would be {ratio:.3} times the declared one: {ask}", k_tc.name)]
        }
        None if !is_of_a_material(k_tc.value) => {
            vec![format!("{} = {:.3} N/mm² is that of no material: {ask}", k_tc.name, k_tc.value)]
        }
        _ => Vec::new(),
    }
}

/// Doubts about tangential coefficients that are negative by more than their uncertainty.
fn negative(parameters: &[Estimate]) -> Vec<String> {
    let below = |p: &&Estimate| {
        matches!(p.name.as_str(), "k_tc" | "k_te") && p.unit.starts_with("N/") && is_negative(p.value, p.std_error)
    };
    let said = |p: &Estimate| {
        format!(
            "{} = {:.2} ± {:.2} {} is negative, which no cutting coefficient is: are columns swapped?",
            p.name, p.value, p.std_error, p.unit
        )
    };
    parameters.iter().filter(below).map(said).collect()
}

/// Base coefficients of a spindle reading fitted without priors and bounds, so that neither what the setup declares nor what is possible
/// hides a wrong unit or a wrong column. Forces cannot be fitted without them: none are returned.
fn unaided(data: &Data, effects: &[FittedEffect]) -> Vec<Estimate> {
    if !data.base.iter().any(|b| b.class == Class::Tare) {
        return Vec::new();
    }
    let base = data.base.iter().cloned().map(|b| Base { prior: None, bounds: UNBOUNDED, ..b }).collect();
    let alone = Data { base, ..data.clone() };
    let Some(fitted) = fit(&alone, effects, UNAIDED_STEPS) else { return Vec::new() };
    let sure = certainty(&alone, &fitted);
    let value = |b: usize| Estimate {
        name: data.base[b].name.clone(),
        value: fitted.model.base[b],
        std_error: sure.std_error(b),
        unit: data.base[b].unit.clone(),
    };
    (0..data.base.len()).map(value).collect()
}

/// Measured forces over those from the declared coefficients, by least squares; `None` if no forces are measured or no
/// coefficients declared.
fn over_declared(data: &Data) -> Option<f64> {
    if data.base.iter().any(|b| b.class == Class::Tare) {
        return None;
    }
    let declared: Vec<f64> = data.base.iter().map(|b| b.prior.map_or(0.0, |(value, _)| value)).collect();
    let predicted = |i: usize| declared.iter().zip(&data.columns).map(|(k, column)| k * column[i]).sum::<f64>();
    let (mut both, mut square) = (0.0, 0.0);
    for i in data.used() {
        both += data.weight[i] * data.reading[i] * predicted(i);
        square += data.weight[i] * predicted(i).powi(2);
    }
    (square > 0.0).then(|| both / square)
}

/// Share of the program's time between the first and the last sample that were placed in it.
pub fn covered(aligned: &Aligned, timeline: &Timeline) -> f64 {
    let placed = aligned.program_s.iter().copied().filter(|t| t.is_finite());
    let (first, last) = placed.fold((f64::INFINITY, 0.0), |(lo, hi), t| (f64::min(lo, t), f64::max(hi, t)));
    ((last - first) / timeline.total_s().max(1e-9)).max(0.0)
}

/// A clause for the beginning and for the end of the program, if the machine moves there for longer than [`UNSEEN_S`]
/// without a sample.
pub fn unseen_ends(aligned: &Aligned, timeline: &Timeline) -> Vec<String> {
    let placed = aligned.program_s.iter().copied().filter(|t| t.is_finite());
    let (first, last) = placed.fold((f64::INFINITY, 0.0), |(lo, hi), t| (f64::min(lo, t), f64::max(hi, t)));
    let moving = |from: f64, to: f64| -> f64 {
        let moves = timeline.spots.iter().filter(|s| s.move_id.is_some());
        moves.map(|s| (s.end_s.min(to) - s.start_s.max(from)).max(0.0)).sum()
    };
    let ends = [("first", moving(0.0, first)), ("last", moving(last, f64::INFINITY))];
    let said = |(end, moving_s): (&str, f64)| {
        format!(
            "no sample belongs to the {end} {moving_s:.1} s in which the program moves: does the log hold all of it?"
        )
    };
    ends.into_iter().filter(|(_, moving_s)| *moving_s > UNSEEN_S).map(said).collect()
}
