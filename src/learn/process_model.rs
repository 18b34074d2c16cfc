//! The process model of a diagnosis or a calibration. In: report or calibration, job. Out: [`Process`], and comment
//! lines on its origin.
//!
//! Radial and axial coefficients that were not measured keep the ratio to the tangential ones that the setup declares,
//! or else the ratios of Xu, Jerard and Fussell ([`SHARES`]).

use crate::effects::unnamed::FACTOR;
use crate::effects::{Acts, Covariate, Effect, Place, named};
use crate::learn::calibrate::Calibration;
use crate::learn::dataset::layers::TERMS;
use crate::learn::program::declared::of_job;
use crate::learn::report::{Added, Estimate, LearnReport};
use crate::machine::Job;
use crate::machine::material::{EffectUse, ForceModel, LinearEdge, Process, RelativeLoad, SHARES};

/// Model of a log or table; `None` if the data do not support one.
pub fn of_report(report: &LearnReport, job: &Job) -> Option<Process> {
    if !report.supports_model {
        return None;
    }
    let value = |name: &str| report.final_base.iter().find(|v| v.name == name).map(|v| v.value);
    let is_relative = |v: &Estimate| matches!(v.name.as_str(), "k_tc" | "k_te") && !v.unit.starts_with("N/");
    let relative = report.final_base.iter().any(is_relative);
    let declared = of_job(job);
    let base = match (value("k_tc"), value("k_te")) {
        (Some(k_tc), Some(k_te)) if !relative => {
            Some(ForceModel::LinearEdge(scaled(k_tc, k_te, declared, value("k_rc"), value("k_re"))))
        }
        _ => layers(report),
    };
    let names = || report.final_base.iter().map(|v| v.name.clone()).collect();
    Some(Process {
        tare_w: value("tare").filter(|_| !relative),
        tare_rps: report.tare_rps.filter(|_| !relative),
        relative: relative.then(|| of_relative(report)),
        effects: effects(report, &job.process),
        covariance: base.as_ref().map_or_else(Vec::new, |_| report.covariance.clone()),
        covariance_of: base.as_ref().map_or_else(Vec::new, |_| names()),
        base,
        scatter: report.scatter,
        feed_per_tooth_mm: report.feed_per_tooth_mm.clone(),
    })
}

/// Coefficients of a load in percent or ampere; a term that the data do not tell is none.
fn of_relative(report: &LearnReport) -> RelativeLoad {
    let of = |name: &str| report.final_base.iter().find(|v| v.name == name);
    let value = |name: &str| of(name).map_or(0.0, |v| v.value);
    let unit = of("k_tc").or(of("k_te")).map_or("", |v| v.unit.split('/').next().unwrap_or(""));
    let (tare, k_tc, k_te) = (value("tare"), value("k_tc"), value("k_te"));
    RelativeLoad { unit: unit.to_owned(), tare, tare_rps: report.tare_rps, k_tc, k_te }
}

/// The layer model of a ball end. If its force depends on the cutting speed v of the layer by (v/1 m/s)^p, without a bend, the model
/// file needs the same power of the tool's own cutting speed, which the effect holds, times (r/R)^p with r the radius
/// of the layer.
fn layers(report: &LearnReport) -> Option<ForceModel> {
    let own = report.final_base.iter().filter(|v| TERMS.iter().any(|(name, _)| *name == v.name));
    let mut parameters: Vec<(String, f64)> = own.map(|v| (v.name.clone(), v.value)).collect();
    let is_bent = |added: &Added| added.parameters.iter().any(|p| p.name == "bend" && p.value != 0.0);
    let follows_speed = |added: &&Added| {
        named(&added.name).is_some_and(|e| e.covariates.contains(&Covariate::CuttingSpeed)) && !is_bent(added)
    };
    let by_speed = report.effects.iter().find(follows_speed);
    if let Some((exponent, from)) = by_speed.and_then(|added| added.parameters.first()).zip(report.least_radius) {
        parameters.push(("radius_exponent".to_owned(), exponent.value));
        parameters.push(("radius_from".to_owned(), from));
    }
    (!parameters.is_empty()).then(|| ForceModel::Named { name: "layer".to_owned(), parameters })
}

/// Effects on geometry and motion of the model that learning began with, then the effects of the report.
fn effects(report: &LearnReport, begun_from: &Process) -> Vec<EffectUse> {
    let found = report.effects.iter().chain(report.unnamed.iter().map(|u| &u.added));
    let found: Vec<EffectUse> = found.map(|added| in_use(added, report)).collect();
    let is_of_the_job = |used: &&EffectUse| {
        let acts = named(&used.name).map(|effect| effect.acts);
        matches!(acts, Some(Acts::Geometry | Acts::Motion)) && found.iter().all(|new| new.name != used.name)
    };
    begun_from.effects.iter().filter(is_of_the_job).cloned().chain(found.clone()).collect()
}

/// An effect for a model file. An accident that is confounded with a permanent effect acts from the beginning of the
/// program: until test cuts have separated the two, the larger load is assumed.
fn in_use(added: &Added, report: &LearnReport) -> EffectUse {
    let effect = named(&added.name);
    let is_in_doubt = effect.is_some_and(|e| e.is_accident)
        && report.confounded.iter().any(|rivals| rivals.names.contains(&added.name));
    let value = |p: &Estimate| {
        let parameter = effect.and_then(|e| e.parameters.iter().find(|own| own.name == p.name));
        let is_instant = parameter.is_some_and(|own| own.place == Some(Place::Instant));
        (p.name.clone(), if is_in_doubt && is_instant { 0.0 } else { p.value })
    };
    let used = EffectUse { name: added.name.clone(), parameters: added.parameters.iter().map(value).collect() };
    match (effect, report.counted_way_mm) {
        (Some(effect), Some(way_mm)) => as_at_the_end(effect, used, way_mm),
        _ => used,
    }
}

/// An effect of the way of an edge whose length is not known: as at the end of the table, the largest that was seen, from the first cut on.
fn as_at_the_end(effect: &Effect, used: EffectUse, way_mm: f64) -> EffectUse {
    let is_of_the_way = |covariate| matches!(covariate, &Covariate::Sliding | &Covariate::Volume);
    if let Some((as_worn, values)) = effect.as_worn.zip(effect.values(&used)) {
        let names = effect.parameters.iter().map(|p| p.name.to_owned());
        return EffectUse { parameters: names.zip(as_worn(&values, way_mm)).collect(), ..used };
    }
    if !effect.family.is_empty() || !effect.covariates.iter().any(is_of_the_way) {
        return used;
    }
    let factors = || used.parameters.iter().filter(|(name, _)| name.starts_with(FACTOR)).map(|(_, value)| *value);
    let largest = factors().fold(f64::NEG_INFINITY, f64::max);
    let flat = |(name, value): &(String, f64)| (name.clone(), if name.starts_with(FACTOR) { largest } else { *value });
    EffectUse { name: used.name.clone(), parameters: used.parameters.iter().map(flat).collect() }
}

fn scaled(k_tc: f64, k_te: f64, declared: Option<LinearEdge>, k_rc: Option<f64>, k_re: Option<f64>) -> LinearEdge {
    let ratio = |of: fn(&LinearEdge) -> f64, to: fn(&LinearEdge) -> f64, other: f64| {
        declared.filter(|k| to(k) > 0.0 && of(k) != 0.0).map_or(other, |k| of(&k) / to(&k))
    };
    LinearEdge {
        k_tc,
        k_te,
        k_rc: k_rc.unwrap_or(k_tc * ratio(|k| k.k_rc, |k| k.k_tc, SHARES.radial_cutting)),
        k_re: k_re.unwrap_or(k_te * ratio(|k| k.k_re, |k| k.k_te, SHARES.radial_edge)),
        k_ac: k_tc * ratio(|k| k.k_ac, |k| k.k_tc, SHARES.axial_cutting),
        k_ae: k_te * ratio(|k| k.k_ae, |k| k.k_te, SHARES.axial_edge),
    }
}

/// Model of a calibration; `None` if there are doubts, or its parameters cannot be separated or are relative.
pub fn of_calibration(result: &Calibration) -> Option<Process> {
    if !result.doubts.is_empty()
        || !result.indistinguishable.is_empty()
        || result.parameters.iter().any(|p| p.unit.contains("per 1000"))
    {
        return None;
    }
    let value = |name: &str| result.parameters.iter().find(|p| p.name == name).map(|p| p.value);
    let base = match (result.model.as_str(), value("k_tc"), value("k_te")) {
        ("power" | "linear-edge", Some(k_tc), Some(k_te)) => {
            ForceModel::LinearEdge(scaled(k_tc, k_te, None, value("k_rc"), value("k_re")))
        }
        (name, ..) => {
            let own = result.parameters.iter().filter(|p| p.name != "tare");
            ForceModel::Named { name: name.to_owned(), parameters: own.map(|p| (p.name.clone(), p.value)).collect() }
        }
    };
    Some(Process {
        base: Some(base),
        tare_w: result.tare,
        tare_rps: result.tare_rps.filter(|_| result.tare.is_some()),
        relative: None,
        effects: Vec::new(),
        covariance: result.covariance.clone(),
        covariance_of: result.parameters.iter().map(|p| p.name.clone()).collect(),
        scatter: None,
        feed_per_tooth_mm: Vec::new(),
    })
}

/// Comment lines of a model file on the data it was fitted to.
pub fn provenance(report: &LearnReport) -> String {
    let line = |v: &Estimate| format!("#   {} = {:.5} ± {:.2} {}\n", v.name, v.value, v.std_error, v.unit);
    let mut text = format!(
        "# samples: {} read, {} used; split: {}\n# held-out error: {:.4} before, {:.4} after\n# {}\n",
        report.samples, report.used, report.how, report.base_test.rmse, report.final_test.rmse, report.verdict
    );
    report.determined_base().iter().for_each(|v| text += &line(v));
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::report::Confounded;

    /// A report that names edge chipping at 100 s.
    fn chipped(rivals: &[&str]) -> LearnReport {
        let value =
            |name: &str, value: f64| Estimate { name: name.into(), value, std_error: 0.01, unit: String::new() };
        let added = Added {
            name: "edge-chipping".into(),
            parameters: vec![value("jump_cutting", 0.2), value("jump_edge", 0.1), value("time", 100.0)],
            p_value: 0.0,
            test_rmse_before: 1.0,
            test_rmse_after: 0.5,
            evidence: String::new(),
        };
        let confounded = Confounded {
            names: rivals.iter().map(|name| (*name).to_owned()).collect(),
            why: String::new(),
            experiment: String::new(),
        };
        LearnReport { effects: vec![added], confounded: vec![confounded], ..LearnReport::default() }
    }

    #[test]
    fn chipping_that_may_be_a_hard_zone_loads_the_tool_from_the_beginning() {
        let time_of = |report: &LearnReport| effects(report, &Process::default())[0].parameters[2].1;
        assert_eq!(time_of(&chipped(&["edge-chipping", "hard-zone"])), 0.0);
        assert_eq!(time_of(&chipped(&["flank-wear", "hard-zone"])), 100.0);
    }
}
