//! The report of a diagnosis. In: base model and final model. Out: [`LearnReport`] with errors on data that neither was
//! fitted on, the structure left in the residual, and the verdict.

use nalgebra::DMatrix;

use crate::effects::unnamed::{CURVES, knots};
use crate::effects::{Acts, Covariate, Effect, Multiplies, family_of, named};
use crate::learn::dataset::errors::errors;
use crate::learn::dataset::highest_feeds::highest_feeds;
use crate::learn::dataset::samples::{Class, Data};
use crate::learn::diagnose::contest::part_name;
use crate::learn::diagnose::criteria::{bears_name, is_lower, is_no_worse, tells_apart};
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::forms::remove;
use crate::learn::diagnose::residual::{noise_floor, patterns};
use crate::learn::diagnose::scatter::scatter_of_load;
use crate::learn::diagnose::unnamed::is_unnamed;
use crate::learn::diagnose::which_curve::only_grows;
use crate::learn::model::cross_validation::{held_out_residuals, improvement_by_case, t_statistic, without};
use crate::learn::model::design::FittedEffect;
use crate::learn::model::fit::{Certainty, Fitted, certainty, part};
use crate::learn::model::stretch_covariance::covariance_of_stretches;
use crate::learn::report::{Added, ChannelError, Estimate, LearnReport, Transfer, Unexplained, Unnamed};

impl Diagnosis<'_> {
    /// Held-out errors of each measured quantity.
    fn channels(&self, begun: &Diagnosis, fitted: &Fitted) -> Vec<ChannelError> {
        let (base, last) = (begun.judgement_residuals(&[]), self.judgement_residuals(&fitted.model.effects));
        let on =
            |r: &[f64], c: usize| errors(self.data, |i| if self.data.channel[i] == c { r[i] } else { f64::NAN }).rmse;
        let names = self.data.channel_names.iter().enumerate();
        names
            .map(|(c, name)| ChannelError { name: name.clone(), base_rmse: on(&base, c), final_rmse: on(&last, c) })
            .collect()
    }

    /// The report. `begun`, `base`: the data before base terms were left out, and the base model on them; `fitted`: the
    /// final model.
    pub(in crate::learn) fn report(&mut self, begun: &Diagnosis, base: &Fitted, fitted: &Fitted) -> LearnReport {
        let data = self.data;
        let errors_of = |f: &Fitted, d: &Data| errors(d, |i| d.reading[i] - f.predicted[i]);
        let (of_base, sure) = (certainty(&begun.train, base), certainty(&self.train, fitted));
        let (base_test, final_test) = (begun.judgement_errors(&[]), self.judgement_errors(&fitted.model.effects));
        let added = |e: usize| self.added(e, fitted, &sure);
        let (curves, effects): (Vec<usize>, Vec<usize>) =
            (0..fitted.model.effects.len()).partition(|e| is_unnamed(fitted.model.effects[*e].effect));
        let unnamed = curves.into_iter().map(|e| {
            let mut curve = described(data, added(e), &fitted.model.effects, e);
            let has_own_data = self.has_own_data(fitted.model.effects[e].effect);
            let rivals = if has_own_data { Vec::new() } else { self.rivals_of_curve(&fitted.model.effects, e) };
            let others_than = |family: Option<&Effect>| -> Vec<Covariate> {
                let of_family =
                    |covariate: &Covariate| family.is_some_and(|effect| effect.covariates.contains(covariate));
                rivals.iter().copied().filter(|covariate| !of_family(covariate)).collect()
            };
            // Time tells any operation from the others. Where not even that explains as much, it is no mere difference between them.
            let family = curve.family.as_deref().and_then(named);
            let is_shown = others_than(family).is_empty() || self.holds_elsewhere(&fitted.model.effects, e);
            if family.is_some() && !has_own_data && !(is_shown && self.is_clear(fitted, e)) {
                curve.family = None;
            }
            let others = others_than(curve.family.as_deref().and_then(named));
            curve.rivals = others.into_iter().map(|covariate| covariate.name().to_owned()).collect();
            curve
        });
        let unnamed = unnamed.collect();
        let effects = effects.into_iter().map(added).collect();
        let used = data.used().count();
        LearnReport {
            samples: data.len(),
            used,
            train: self.train.used().count(),
            test: if self.split.test.iter().any(|t| *t) { used - self.train.used().count() } else { used },
            how: self.split.how.clone(),
            base: values(data, base, &of_base),
            condition: of_base.condition,
            base_train: errors_of(base, &self.train),
            base_test,
            effects,
            unnamed,
            rejected: std::mem::take(&mut self.rejected),
            final_train: errors_of(fitted, &self.train),
            final_test,
            channels: self.channels(begun, fitted),
            final_base: values(data, fitted, &sure),
            covariance: covariance(data, &covariance_of_stretches(&self.train, fitted)),
            tare_rps: data.state.iter().map(|state| state.reference_rps).find(|rps| rps.is_finite()),
            noise_floor: noise_floor(data, &fitted.residuals(data)),
            scatter: self.scatter(fitted),
            feed_per_tooth_mm: highest_feeds(data),
            transfer: self.transfer(base, fitted),
            variants_tried: self.tried,
            supports_model: tells_apart(sure.condition) && is_no_worse(base_test.rmse, final_test.rmse),
            ..LearnReport::default()
        }
    }

    /// Scatter of the load about the final model, relative; see [`scatter_of_load`].
    fn scatter(&self, fitted: &Fitted) -> Option<f64> {
        let cut = part(self.data, fitted, &[Class::Cutting, Class::Edge]);
        scatter_of_load(self.data, &self.judgement_residuals(&fitted.model.effects), &cut)
    }

    /// Does a curve hold on operations that it was not learned on? If its covariate varies within operations, it must
    /// not raise the error there. If the covariate only differs from one operation to the next, it must lower it:
    /// otherwise the curve may be a proxy for any other difference between operations. Not asked are curves over what only
    /// grows, as every operation has a stretch of that to itself and no other tells of it, and curves of the tare, which
    /// knows nothing of the cut. For both, what else may be so is told by the curves that explain as much.
    fn holds_elsewhere(&self, effects: &[FittedEffect], e: usize) -> bool {
        let own = effects[e].effect;
        if own.multiplies == Multiplies::Tare || own.covariates.iter().all(|covariate| only_grows(*covariate)) {
            return true;
        }
        let varies_between_operations_only = self.varies_between_operations_only(effects[e].effect.covariates);
        self.drop_elsewhere(&remove(effects, e), effects).is_none_or(|drop| {
            if varies_between_operations_only {
                self.criteria().lowers_elsewhere(drop)
            } else {
                !self.criteria().harms_elsewhere(drop)
            }
        })
    }

    /// Does the curve `e` of a model lower the held-out error as clearly as an effect of the list must? However many samples it fits: a free
    /// shape fits something of every misfit.
    fn is_clear(&self, fitted: &Fitted, e: usize) -> bool {
        let effects = &fitted.model.effects;
        let [before, after] =
            [&remove(effects, e), effects].map(|all| held_out_residuals(&self.train, all, self.split));
        let t = t_statistic(&improvement_by_case(&self.train, &before, &after));
        self.criteria().lowers_clearly(self.drop_of(&before, &after), t, 0.0)
    }

    /// The `e`-th effect of the final model with its parameters, evidence and doubts.
    fn added(&self, e: usize, fitted: &Fitted, sure: &Certainty) -> Added {
        let each = &fitted.model.effects[e];
        let found = self.evidence.iter().rev().find(|(name, ..)| *name == each.effect.name);
        let (_, evidence, p_value, errors) =
            found.cloned().unwrap_or((each.effect.name, String::new(), 1.0, [f64::NAN; 2]));
        let first: usize =
            fitted.model.effects[..e].iter().map(|u| u.values.len()).sum::<usize>() + fitted.model.base.len();
        let std_error = |k: usize| sure.std_error(first + k);
        // Knots that a curve does not use are not reported.
        let in_use = |k: usize| !is_unnamed(each.effect) || each.effect.parameters[k].neutral != Some(each.values[k]);
        let value = |k: usize| Estimate {
            name: each.effect.parameters[k].name.into(),
            value: each.values[k],
            std_error: std_error(k),
            unit: each.effect.parameters[k].unit.into(),
        };
        let doubts = (0..each.values.len()).filter(|k| each.free[*k]).filter_map(|k| doubt(each, k, std_error(k)));
        Added {
            name: each.effect.name.into(),
            parameters: (0..each.values.len()).filter(|k| in_use(*k)).map(value).collect(),
            p_value,
            test_rmse_before: errors[0],
            test_rmse_after: errors[1],
            evidence: std::iter::once(evidence).chain(doubts).collect::<Vec<String>>().join("; "),
        }
    }

    /// Errors on kinds of cuts that were not fitted, before and after.
    fn transfer(&self, base: &Fitted, fitted: &Fitted) -> Vec<Transfer> {
        let trained: Vec<usize> = self.train.used().map(|i| self.data.kind[i]).collect();
        let other = |kind: &usize| !trained.contains(kind);
        self.kinds()
            .into_iter()
            .filter(other)
            .map(|kind| {
                let only = self.data.with_weights(without(self.data, |i| self.data.kind[i] != kind));
                Transfer {
                    kind: self.data.kind_names[kind].clone(),
                    samples: only.used().count(),
                    rmse_before: errors(&only, |i| only.reading[i] - base.predicted[i]).rmse,
                    rmse_after: errors(&only, |i| only.reading[i] - fitted.predicted[i]).rmse,
                }
            })
            .collect()
    }
}

fn values(data: &Data, fitted: &Fitted, sure: &Certainty) -> Vec<Estimate> {
    let value = |(b, base): (usize, &crate::learn::dataset::samples::Base)| Estimate {
        name: base.name.clone(),
        value: fitted.model.base[b],
        std_error: sure.std_error(b),
        unit: base.unit.clone(),
    };
    data.base.iter().enumerate().map(value).collect()
}

/// Covariance of the base coefficients, a block of that of all parameters.
fn covariance(data: &Data, of_all: &DMatrix<f64>) -> Vec<Vec<f64>> {
    let p = data.base.len();
    (0..p).map(|a| (0..p).map(|b| of_all[(a, b)]).collect()).collect()
}

/// A doubt about a fitted parameter: it is at its bound, or its standard error is larger than its value.
fn doubt(each: &FittedEffect, k: usize, std_error: f64) -> Option<String> {
    let (parameter, value) = (&each.effect.parameters[k], each.values[k]);
    if parameter.is_scanned() {
        return None;
    }
    let near = |bound: f64| (value - bound).abs() <= 1e-6 * (parameter.max - parameter.min);
    let is_off = |bound: f64| parameter.neutral == Some(bound) || bound == 0.0;
    if [parameter.min, parameter.max].into_iter().any(|bound| near(bound) && !is_off(bound)) {
        return Some(format!("{} is at its bound ({value:.4})", parameter.name));
    }
    let size = (value - parameter.neutral.unwrap_or(0.0)).abs();
    (std_error > size)
        .then(|| format!("{} is not determined ({value:.4} ± {std_error:.4} {})", parameter.name, parameter.unit))
}

/// The curve `effects[e]` as it is reported.
fn described(data: &Data, added: Added, effects: &[FittedEffect], e: usize) -> Unnamed {
    let each = &effects[e];
    let of_curve = CURVES.iter().find(|(_, effect)| effect.name == each.effect.name);
    let (covariate, multiplies) =
        of_curve.map_or((Covariate::Time, Multiplies::Load), |(covariate, effect)| (*covariate, effect.multiplies));
    let (factor, unit) = covariate.shown();
    let knots: Vec<[f64; 2]> = knots(&each.values).into_iter().map(|[at, f]| [at * factor, f]).collect();
    // Without a cut the load is the tare, which grows with the speed: what a drive wastes of its load shows in the tare over the speed too.
    let is_tare_over_speed = multiplies == Multiplies::Tare && covariate == Covariate::SpindleSpeed;
    let knows_it = |other: &Effect| {
        other.knows(covariate, multiplies) || (is_tare_over_speed && other.covariates.contains(&Covariate::Load))
    };
    let beside = effects.iter().find(|other| !is_unnamed(other.effect) && knows_it(other.effect));
    let factors: Vec<f64> = knots.iter().map(|knot| knot[1]).collect();
    let family = family_of(covariate, multiplies).filter(|effect| bears_name(effect.way, &factors));
    let what = match multiplies {
        Multiplies::Load => "the load of the cut",
        Multiplies::Tare => "the tare",
        Multiplies::Reading => "the whole reading",
    };
    Unnamed {
        covariate: covariate.name().to_owned(),
        unit: unit.to_owned(),
        multiplies: part_name(multiplies).to_owned(),
        beside: beside.map(|other| other.effect.name.to_owned()),
        rivals: Vec::new(),
        family: family.filter(|_| beside.is_none()).map(|effect| effect.name.to_owned()),
        sentence: match covariate {
            Covariate::Tool => sentence_of_tools(what, &knots),
            Covariate::Coolant => sentence_of_coolant(what, &knots),
            _ => {
                let line = |x: f64| data.line_at(x).filter(|_| covariate == Covariate::Time);
                let place = |x: f64| line(x).map_or_else(String::new, |line| format!(" (line {line})"));
                sentence(what, covariate.name(), &|x| format!("{}{}", value_with_unit(x, unit), place(x)), &knots)
            }
        },
        knots,
        added,
    }
}

/// A curve over tool numbers in one sentence.
fn sentence_of_tools(what: &str, knots: &[[f64; 2]]) -> String {
    let steps = knots.chunks_exact(2).filter(|pair| pair[0][0] == pair[1][0]);
    let from = |pair: &[[f64; 2]]| {
        let by = more(pair[1][1], pair[0][1]);
        format!("with tool {:.0} {what} is {by} than with the tool before it", pair[0][0].ceil())
    };
    let all: Vec<String> = steps.map(from).collect();
    if all.is_empty() { format!("{what} differs from tool to tool") } else { all.join(", ") }
}

/// A curve over the state of the coolant, off to on, in one sentence.
fn sentence_of_coolant(what: &str, knots: &[[f64; 2]]) -> String {
    let [off, on] = [knots.first(), knots.last()].map(|knot| knot.map_or(1.0, |knot| knot[1]));
    format!("with coolant on {what} is {}", more(on, off))
}

/// How much a factor is more, or less, than another.
fn more(factor: f64, than: f64) -> String {
    let percent = 100.0 * (factor / than - 1.0);
    format!("{:.0} % {}", percent.abs(), if percent < 0.0 { "lower" } else { "higher" })
}

/// A curve in one sentence: a step at a value, a level between two values that stands out from both its sides, or the highest against the
/// lowest.
fn sentence(what: &str, covariate: &str, at: &dyn Fn(f64) -> String, knots: &[[f64; 2]]) -> String {
    let is_step = |k: usize| (knots[k + 1][0] - knots[k][0]).abs() < 1e-9 * knots[k][0].abs().max(1.0);
    let stands_out = |outer: f64, inner: f64, other: f64| (inner - outer) * (inner - other) > 0.0;
    match *knots {
        [a, b] if is_step(0) && a[1] > b[1] => format!("below {covariate} {} {what} is {}", at(a[0]), more(a[1], b[1])),
        [a, b] if is_step(0) => format!("above {covariate} {} {what} is {}", at(b[0]), more(b[1], a[1])),
        [a, b, c, d] if is_step(0) && is_step(2) && stands_out(a[1], f64::midpoint(b[1], c[1]), d[1]) => {
            let (inside, outside) = (f64::midpoint(b[1], c[1]), f64::midpoint(a[1], d[1]));
            format!("between {covariate} {} and {} {what} is {}", at(a[0]), at(d[0]), more(inside, outside))
        }
        _ => {
            let by = |k: &&[f64; 2], other: &&[f64; 2]| k[1].total_cmp(&other[1]);
            let (Some(low), Some(high)) = (knots.iter().min_by(by), knots.iter().max_by(by)) else {
                return format!("{what} follows {covariate}");
            };
            format!(
                "{what} follows {covariate}: {} it is {} than {}",
                stretch(knots, high[1], at),
                more(high[1], low[1]),
                stretch(knots, low[1], at)
            )
        }
    }
}

/// Where a curve has this value: "at" a knot, or "between" the two ends of a level part.
fn stretch(knots: &[[f64; 2]], value: f64, at: impl Fn(f64) -> String) -> String {
    let there: Vec<f64> = knots.iter().filter(|knot| knot[1] == value).map(|knot| knot[0]).collect();
    match *there {
        [from, to] => format!("between {} and {}", at(from), at(to)),
        [only] if only == knots[0][0] && knots.len() > 1 && knots[1][0] == only => format!("below {}", at(only)),
        [only] if knots.len() > 1 && only == knots[knots.len() - 1][0] && knots[knots.len() - 2][0] == only => {
            format!("above {}", at(only))
        }
        _ => there.first().map_or_else(String::new, |only| format!("at {}", at(*only))),
    }
}

/// A value of a covariate as it is said.
fn value_with_unit(x: f64, unit: &str) -> String {
    format!("{} {unit}", rounded(x)).trim_end().to_owned()
}

/// Three significant digits.
fn rounded(x: f64) -> String {
    let digits = if x == 0.0 { 0 } else { (2 - x.abs().log10().floor() as i32).clamp(0, 6) };
    let text = format!("{x:.*}", digits as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// What no named effect explains: the first curve without a name, or the strongest pattern left in the residual.
pub(in crate::learn) fn unexplained(
    data: &Data,
    fitted: &Fitted,
    report: &LearnReport,
    seed: u64,
) -> Option<Unexplained> {
    if let Some(first) = report.nameless().next() {
        let [before, after] = [first.added.test_rmse_before, first.added.test_rmse_after];
        return Some(Unexplained {
            test_r2_of_residual_structure: 1.0 - (after / before.max(1e-300)).powi(2),
            largest_correlate: first.covariate.clone(),
            largest: None,
        });
    }
    let residual = fitted.residuals(data);
    let found = patterns(data, &residual, &fitted.predicted, seed);
    // Persistence from sample to sample shows that the rest is not noise, but not its cause: a covariate is more
    // useful.
    let strongest = found.iter().find(|pattern| !pattern.is_persistence).or(found.first())?;
    let largest = found.iter().find_map(|pattern| pattern.largest.clone()).filter(|_| !strongest.is_persistence);
    Some(Unexplained {
        test_r2_of_residual_structure: strongest.test_r2,
        largest_correlate: strongest.along.clone(),
        largest,
    })
}

/// What a curve is worth where it hardly lowers the error on the data kept for the judgement.
fn of_little_use(curve: &Unnamed) -> String {
    let [before, after] = [curve.added.test_rmse_before, curve.added.test_rmse_after];
    if before.is_nan() || is_lower(before, after) {
        return String::new();
    }
    let percent = 100.0 * (after / before - 1.0);
    let way = if percent > 0.0 { "higher" } else { "lower" };
    format!(" and of little use (held-out error {:.1} % {way} with it)", percent.abs())
}

/// The verdict in one sentence.
pub(in crate::learn) fn verdict(report: &LearnReport) -> String {
    let on_the_load = |name: &&str| named(name).is_none_or(|effect| effect.acts != Acts::Motion);
    let asserted = report.names().into_iter().filter(|name| report.one_of(name).is_none());
    let (names, of_motion): (Vec<&str>, Vec<&str>) = asserted.partition(on_the_load);
    let (before, after) = (report.base_test.rmse, report.final_test.rmse);
    let unit = match report.channels.as_slice() {
        [one] => one.name.rsplit_once('(').map_or("", |(_, unit)| unit.trim_end_matches(')')),
        _ => "",
    };
    let fell = format!("held-out error {} → {}", rounded(before), value_with_unit(after, unit));
    let found = match (names.as_slice(), report.unnamed.as_slice()) {
        ([], _) if !report.confounded.is_empty() => {
            format!("The residual is explained, but by more than one candidate equally well; {fell}")
        }
        ([], []) if !of_motion.is_empty() => "Nothing to add to the load".to_owned(),
        ([], []) => "Nothing to add: no effect of the list explains the residual".to_owned(),
        ([], _) => {
            format!("No effect of the list explains the residual, a curve that belongs to no named effect does; {fell}")
        }
        (some, _) => format!("The residual is explained by {}; {fell}", some.join(" and ")),
    };
    let rivals = report.confounded.iter().map(|c| {
        let safe = named(&c.names[0]).filter(|effect| effect.is_accident);
        let carried = safe.map_or_else(String::new, |effect| {
            format!(
                " (a model file applies {} from the start of the program, which predicts the larger loads)",
                effect.name
            )
        });
        format!(
            "one of: {} - cannot be separated by this log; separated by: {}{carried}",
            c.names.join(", "),
            c.experiment
        )
    });
    let curves = report.unnamed.iter().map(|u| match (&u.family, &u.beside) {
        (Some(name), _) => format!("{name} in a form of its own{}: {}", of_little_use(u), u.sentence),
        (None, Some(name)) => {
            format!("in addition to {name}, whose law does not cover it{}: {}", of_little_use(u), u.in_words())
        }
        (None, None) => format!("without a name{}: {}", of_little_use(u), u.in_words()),
    });
    let is_curve = report.nameless().next().is_some();
    let left = report.unexplained.as_ref().filter(|_| !is_curve).map(|u| {
        format!(
            "{:.0} % of the remaining variance follows {} and is unexplained{}",
            100.0 * u.test_r2_of_residual_structure,
            u.largest_correlate,
            u.largest.as_ref().map_or_else(String::new, |largest| format!("; what remains is {largest}"))
        )
    });
    let motion = report.effects.iter().filter(|e| of_motion.contains(&e.name.as_str())).map(|e| {
        let share = e.parameters.first().map_or(f64::NAN, |p| p.value);
        format!("{}: the machine accelerates at {share:.2} of the declared value", e.name)
    });
    let mut parts: Vec<String> = std::iter::once(found).chain(motion).chain(rivals).chain(curves).chain(left).collect();
    if report.effects.is_empty() && report.unnamed.is_empty() && report.unexplained.is_none() {
        parts[0] =
            format!("Nothing to add: what is left ({}) has no structure beyond noise", value_with_unit(after, unit));
    }
    let adds_nothing = report.effects.is_empty() && report.unnamed.is_empty();
    if !(adds_nothing || is_no_worse(before, after)) {
        parts[0] = format!("Of the data that were fitted alone: {}", parts[0]);
        parts.push("on the data kept for the judgement the error rose, so no model is derived from it".to_owned());
    }
    parts.join("; ") + "."
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::effects::unnamed::{BEYOND, KNOTS};
    use crate::learn::diagnose::diagnosis::Options;
    use crate::learn::diagnose::forms::FORM_ROUNDS;
    use crate::learn::diagnose::made_data::{EACH, begun, fifths, made};
    use crate::learn::model::fit::fit;
    use crate::machine::wear::Lengths;

    #[test]
    fn a_curve_over_the_coolant_says_on_against_off() {
        assert_eq!(
            sentence_of_coolant("the tare", &[[1.0, 1.0], [1.0, 1.5]]),
            "with coolant on the tare is 50 % higher"
        );
        assert_eq!(
            sentence_of_coolant("the load", &[[0.0, 1.0], [1.0, 0.8]]),
            "with coolant on the load is 20 % lower"
        );
    }

    /// A fiftieth is the least that is of use.
    #[test]
    fn a_curve_that_hardly_lowers_the_error_is_said_to_be_of_little_use() {
        let said = |after: f64| {
            let added = Added {
                name: "unnamed-load-z".into(),
                parameters: Vec::new(),
                p_value: 0.0,
                test_rmse_before: 100.0,
                test_rmse_after: after,
                evidence: String::new(),
            };
            of_little_use(&Unnamed {
                covariate: "position z".into(),
                unit: "mm".into(),
                multiplies: "load".into(),
                beside: None,
                rivals: Vec::new(),
                family: None,
                sentence: String::new(),
                knots: Vec::new(),
                added,
            })
        };
        assert_eq!(said(97.9), "");
        assert_eq!(said(98.1), " and of little use (held-out error 1.9 % lower with it)");
        assert_eq!(said(103.0), " and of little use (held-out error 3.0 % higher with it)");
    }

    #[test]
    fn the_verdict_says_where_what_remains_is_largest_and_in_what_unit() {
        let channel = ChannelError { name: "spindle_power_w (W)".into(), base_rmse: 1.0, final_rmse: 1.0 };
        let mut report = LearnReport {
            unexplained: Some(Unexplained {
                test_r2_of_residual_structure: 0.334,
                largest_correlate: "load".into(),
                largest: Some("largest from 3 s to 28 s (lines 15 to 25), 17.8 % above the prediction".into()),
            }),
            channels: vec![channel],
            ..LearnReport::default()
        };
        assert_eq!(
            verdict(&report),
            "Nothing to add: no effect of the list explains the residual; 33 % of the remaining variance follows load and is unexplained; what \
             remains is largest from 3 s to 28 s (lines 15 to 25), 17.8 % above the prediction."
        );
        report.unexplained = None;
        report.final_test.rmse = 15.1607;
        assert_eq!(verdict(&report), "Nothing to add: what is left (15.2 W) has no structure beyond noise.");
    }

    #[test]
    fn a_curve_is_clear_enough_for_a_name_by_what_it_shows_on_data_left_out() {
        // Every other block is cut at a higher speed, with a load larger by `share`.
        let is_fast = |i: usize| (i / EACH).is_multiple_of(2);
        let is_clear = |share: f64| {
            let state = |i: usize| State { rps: if is_fast(i) { 150.0 } else { 90.0 }, ..State::default() };
            let data = made(|i| if is_fast(i) { share } else { 0.0 }, 1.0, state);
            let effect = named("unnamed-load-spindle-speed").unwrap();
            let at = |k: usize| [90.0, 120.0].get(k).copied().unwrap_or(BEYOND);
            let values = (0..KNOTS).map(at).chain(vec![1.0; KNOTS]).chain([1.0]).collect();
            let free = (0..=2 * KNOTS).map(|k| k == KNOTS + 1).collect();
            let (split, options) = (fifths(&data), Options { candidates: Vec::new(), ..Options::default() });
            let fitted = fit(&data, &[FittedEffect { effect, values, free }], FORM_ROUNDS).unwrap();
            begun(&data, &split, &options, 1.0).is_clear(&fitted, 0)
        };
        assert_eq!([0.001, 0.02].map(is_clear), [false, true]);
    }

    /// A curve before it is described.
    fn added(name: &str) -> Added {
        Added {
            name: name.into(),
            parameters: Vec::new(),
            p_value: 0.0,
            test_rmse_before: 2.0,
            test_rmse_after: 1.0,
            evidence: String::new(),
        }
    }

    fn in_mm(x: f64) -> String {
        value_with_unit(x, "mm")
    }

    #[test]
    fn over_time_it_says_the_lines() {
        let state = |i: usize| State { time_s: i as f64, ..State::default() };
        let data = Data { line: (0..400).map(|i| 10 + i / 50).collect(), ..made(|_| 0.0, 1.0, state) };
        let effect = named("unnamed-load-time").unwrap();
        let at = |k: usize| [0.0, 141.0, 203.0].get(k).copied().unwrap_or(BEYOND);
        let factors = [1.0, 0.8, 1.0];
        let values = (0..KNOTS).map(at).chain((0..KNOTS).map(|k| *factors.get(k).unwrap_or(&1.0))).chain([1.0]);
        let each = FittedEffect { effect, values: values.collect(), free: vec![true; 2 * KNOTS + 1] };
        assert_eq!(
            described(&data, added("unnamed-load-time"), &[each], 0).sentence,
            "between time 141 s (line 12) and 203 s (line 14) the load of the cut is 20 % lower"
        );
    }

    #[test]
    fn of_tools_it_says_which_and_of_several_levels_where_the_highest_and_the_lowest_are() {
        let tools = sentence_of_tools("the load of the cut", &[[1.5, 0.8], [1.5, 1.0]]);
        assert_eq!(tools, "with tool 2 the load of the cut is 25 % higher than with the tool before it");
        let levels = [[2.0, 1.0], [2.0, 1.2], [3.0, 1.2], [3.0, 0.9], [5.0, 0.9], [5.0, 0.6]];
        assert_eq!(
            sentence("the load", "axial depth", &in_mm, &levels),
            "the load follows axial depth: between 2 mm and 3 mm it is 100 % higher than above 5 mm"
        );
    }

    #[test]
    fn a_curve_is_one_sentence_with_a_place_and_a_size() {
        let load = |knots: &[[f64; 2]]| sentence("the load of the cut", "position z", &in_mm, knots);
        assert_eq!(load(&[[-4.5, 1.18], [-4.5, 1.0]]), "below position z -4.5 mm the load of the cut is 18 % higher");
        assert_eq!(
            load(&[[141.0, 1.0], [141.0, 0.8], [203.0, 0.8], [203.0, 1.0]]),
            "between position z 141 mm and 203 mm the load of the cut is 20 % lower"
        );
        // Two steps the same way are no level between two values.
        assert_eq!(
            load(&[[141.0, 1.0], [141.0, 1.2], [203.0, 1.2], [203.0, 1.5]]),
            "the load of the cut follows position z: above 203 mm it is 50 % higher than below 141 mm"
        );
        assert_eq!(
            load(&[[100.0, 1.0], [150.0, 1.1], [200.0, 1.3]]),
            "the load of the cut follows position z: at 200 mm it is 30 % higher than at 100 mm"
        );
    }

    #[test]
    fn a_curve_bears_the_name_of_a_family_only_where_it_goes_its_way() {
        let family_beside = |others: &[FittedEffect], name: &str, factors: [f64; 3]| {
            let at = (0..KNOTS).map(|k| if k < 3 { k as f64 } else { BEYOND });
            let factors = (0..KNOTS).map(|k| *factors.get(k).unwrap_or(&1.0));
            let values: Vec<f64> = at.chain(factors).chain([1.0]).collect();
            let each = FittedEffect { effect: named(name).unwrap(), free: vec![true; values.len()], values };
            described(&Data::default(), added(name), &[&[each], others].concat(), 0).family
        };
        let family = |name: &str, factors: [f64; 3]| family_beside(&[], name, factors);
        assert_eq!(family("unnamed-load-sliding-distance", [1.0, 1.1, 1.3]).as_deref(), Some("flank-wear"));
        assert_eq!(family("unnamed-load-sliding-distance", [1.0, 1.3, 1.0]), None);
        assert_eq!(family("unnamed-load-chip-thickness", [1.2, 1.1, 1.0]).as_deref(), Some("size-effect"));
        assert_eq!(family("unnamed-load-chip-thickness", [1.0, 1.3, 1.0]), None);
        assert_eq!(family("unnamed-load-up-share", [1.0, 1.3, 1.0]).as_deref(), Some("up-down-asymmetry"));
        // A drive that wastes more at a higher load does so of the tare too.
        let with = |name: &str| {
            let effect = named(name).unwrap();
            let values: Vec<f64> = effect.parameters.iter().map(|p| p.starts[0]).collect();
            family_beside(&[FittedEffect { effect, free: vec![true; values.len()], values }], TARE, [1.0, 1.1, 1.3])
        };
        assert_eq!(family(TARE, [1.0, 1.1, 1.3]).as_deref(), Some("tare-speed"));
        assert_eq!(["flank-wear", "drive-efficiency"].map(with), [Some("tare-speed".to_owned()), None]);
    }
    const TARE: &str = "unnamed-tare-spindle-speed";

    /// Four operations, each at a speed of its own and with a stretch of the way slid to itself; the load rises from one to the next.
    #[test]
    fn a_curve_of_the_tare_or_of_what_only_grows_need_not_hold_on_operations_left_out_and_others_must() {
        let operation = |i: usize| i / (6 * EACH);
        let state = |i: usize| State {
            rps: 90.0 + 10.0 * operation(i) as f64,
            slid: Lengths([i as f64; 4]),
            axial_depth_mm: 3.0,
            ..State::default()
        };
        let mut data = made(|i| [0.0, 0.3, 0.4, 0.5][operation(i)], 1.0, state);
        data.kind = (0..data.len()).map(operation).collect();
        let (split, options) = (fifths(&data), Options::default());
        let diagnosis = begun(&data, &split, &options, 1.0);
        let holds = |name: &str, at: [f64; 4]| {
            let places = (0..KNOTS).map(|k| *at.get(k).unwrap_or(&BEYOND));
            let values: Vec<f64> = places.chain(vec![1.0; KNOTS]).chain([1.0]).collect();
            let free = (0..values.len()).map(|k| (KNOTS + 1..KNOTS + 4).contains(&k)).collect();
            diagnosis.holds_elsewhere(&[FittedEffect { effect: named(name).unwrap(), values, free }], 0)
        };
        let speeds = [90.0, 100.0, 110.0, 120.0];
        assert!(holds(TARE, speeds) && holds("unnamed-load-sliding-distance", [0.0, 240.0, 480.0, 720.0]));
        assert!(!holds("unnamed-load-spindle-speed", speeds));
    }

    #[test]
    fn a_parameter_on_its_bound_or_smaller_than_its_error_is_said() {
        let wear = named("flank-wear").unwrap();
        let with = |growth: f64| FittedEffect {
            effect: wear,
            values: vec![growth, 0.0, 0.1, 0.0, -1.0, 0.1],
            free: vec![true; 6],
        };
        assert!(doubt(&with(50.0), 0, 0.1).unwrap().contains("is at its bound"));
        assert!(doubt(&with(0.5), 0, 0.6).unwrap().contains("not determined"));
        assert_eq!(doubt(&with(0.5), 0, 0.4), None);
    }
}
