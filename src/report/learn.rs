//! JSON and words of `learn`, `learn-table` and `calibrate`, with the keys of the interface.

use serde_json::{Value as Json, json};

use super::marks::WRITTEN_BY;
use crate::learn::calibrate::Calibration;
use crate::learn::calibrate::plan::{Plan, TestCut};
use crate::learn::evaluate::{Evaluation, OfQuantity};
use crate::learn::report::{Errors, LearnReport, Unnamed, Value};

/// JSON report of a diagnosis.
pub fn learn_json(r: &LearnReport) -> String {
    let alignment = r.alignment.as_ref().map(|a| {
        json!({
            "offset_s": a.offset_s, "stretch": a.stretch, "method": a.method, "uncertainty_s": a.uncertainty_s,
            "pauses": a.pauses,
            "stretches": a.stretches.iter()
                .map(|(time_s, u)| json!({ "time_s": time_s, "uncertainty_s": u })).collect::<Vec<_>>(),
            "outside": { "before": a.outside[0], "held": a.outside[1], "after": a.outside[2] },
        })
    });
    let effects: Vec<Json> = r
        .effects
        .iter()
        .map(|e| {
            json!({
                "name": e.name, "form": "law", "parameters": values(&e.parameters), "p_value": e.p_value,
                "test_rmse_before": e.test_rmse_before, "test_rmse_after": e.test_rmse_after, "evidence": e.evidence,
                "one_of": r.one_of(&e.name).map(|group| &group.names),
            })
        })
        .chain(r.unnamed.iter().filter_map(of_a_family))
        .collect();
    let unexplained = r.unexplained.as_ref().map(|u| {
        json!({
            "test_r2_of_residual_structure": u.test_r2_of_residual_structure, "largest_correlate": u.largest_correlate,
        })
    });
    let report = json!({
        "written_by": WRITTEN_BY,
        "data": {
            "samples": r.samples, "used": r.used, "down_weighted": r.down_weighted,
            "split": { "train": r.train, "test": r.test, "how": r.how },
        },
        "alignment": alignment,
        "base": {
            "parameters": values(&r.base), "condition": finite(r.condition),
            "train": errors(&r.base_train), "test": errors(&r.base_test),
        },
        "effects": effects,
        "unnamed": r.unnamed.iter().filter(|u| u.family.is_none()).map(|u| json!({
            "covariate": u.covariate, "unit": u.unit, "multiplies": u.multiplies, "knots": u.knots, "beside": u.beside,
            "said": u.said, "p_value": u.added.p_value, "effect": u.added.name, "evidence": u.added.evidence,
            "test_rmse_before": u.added.test_rmse_before, "test_rmse_after": u.added.test_rmse_after,
        })).collect::<Vec<_>>(),
        "rejected": r.rejected.iter().map(|x| json!({ "name": x.name, "why": x.why })).collect::<Vec<_>>(),
        "confounded": r.confounded.iter()
            .map(|c| json!({ "names": c.names, "why": c.why, "experiment": c.experiment })).collect::<Vec<_>>(),
        "unexplained": unexplained,
        "final": {
            "parameters": values(&r.final_base), "train": errors(&r.final_train), "test": errors(&r.final_test),
            "noise_floor": r.noise_floor,
            "scatter": r.scatter,
            "left_out": values(&r.left_out),
            "quantities": r.channels.iter().map(|c| json!({
                "name": c.name, "test_rmse_before": c.base_rmse, "test_rmse_after": c.final_rmse,
            })).collect::<Vec<_>>(),
        },
        "transfer": r.transfer.iter().map(|t| json!({
            "kind": t.kind, "samples": t.samples, "rmse_before": t.rmse_before, "rmse_after": t.rmse_after,
        })).collect::<Vec<_>>(),
        "windows": r.windows.iter()
            .map(|w| json!({ "time_s": w.time_s, "cutting": w.cutting, "edge": w.edge })).collect::<Vec<_>>(),
        "wear": r.wear,
        "events": r.events.iter().map(|e| json!({
            "kind": if e.ratio == 0.0 { "hold" } else { "override" }, "covariate": "feed", "time_s": e.time_s,
            "lines": e.lines, "feed_ratio": e.ratio, "said": e.said(),
        })).collect::<Vec<_>>(),
        "variants_tried": r.variants_tried,
        "warnings": r.warnings,
        "supports_model": r.supports_model,
        "verdict": r.verdict,
    });
    text(&report)
}

/// An effect that a curve shows in another form than its law.
fn of_a_family(u: &Unnamed) -> Option<Json> {
    u.family.as_ref().map(|name| {
        json!({
            "name": name, "form": "curve", "said": u.said, "covariate": u.covariate, "unit": u.unit, "knots": u.knots,
            "effect": u.added.name, "parameters": values(&u.added.parameters), "p_value": u.added.p_value,
            "test_rmse_before": u.added.test_rmse_before, "test_rmse_after": u.added.test_rmse_after,
            "evidence": u.added.evidence,
        })
    })
}

/// JSON report of a calibration.
pub fn calibrate_json(c: &Calibration) -> String {
    text(&json!({
        "written_by": WRITTEN_BY,
        "model": c.model,
        "tests": c.tests,
        "parameters": values(&c.parameters),
        "derived": values(&c.derived),
        "tare_w": c.tare,
        "covariance": c.covariance,
        "condition": finite(c.condition),
        "indistinguishable": c.indistinguishable,
        "train": errors(&c.train),
        "leave_one_out_rmse": finite(c.leave_one_out_rmse),
        "leave_set_up_out_rmse": c.leave_set_up_out_rmse,
        "force_uncertainty": c.force_uncertainty,
        "notes": c.notes,
        "doubts": c.doubts,
    }))
}

/// JSON of a model held against data that it has not seen.
pub fn evaluate_json(e: &Evaluation) -> String {
    let of = |q: &OfQuantity| {
        json!({
            "name": q.name, "samples": q.samples, "model": errors(&q.model), "without_effects": errors(&q.without_effects),
            "about_mean_rmse": q.about_mean, "bias": q.bias,
        })
    };
    text(&json!({
        "written_by": WRITTEN_BY,
        "samples": e.samples,
        "alignment": e.tied.map(|(method, uncertainty_s)| json!({ "method": method, "uncertainty_s": uncertainty_s })),
        "effects": e.effects,
        "quantities": e.quantities.iter().map(of).collect::<Vec<_>>(),
        "test": e.quantities.first().map(|q| errors(&q.model)),
    }))
}

/// The same in words.
pub fn evaluate_words(e: &Evaluation) -> String {
    let mut text = match e.tied {
        Some((method, s)) => {
            format!("{} samples, tied to the program by {method} (± {s:.2} s); nothing was fitted\n", e.samples)
        }
        None => format!("{} cuts; nothing was fitted\n", e.samples),
    };
    if !e.effects.is_empty() {
        text += &format!("effects in the model: {}\n", e.effects.join(", "));
    }
    for q in &e.quantities {
        text += &format!(
            "{}: error {:.3} ({:.1} %), mean of reading - prediction {:+.3}\n  without the effects {:.3}; about the mean of \
             the readings {:.3}\n",
            q.name, q.model.rmse, q.model.mape, q.bias, q.without_effects.rmse, q.about_mean
        );
        if q.model.rmse >= q.about_mean {
            text += "  this model says less of these data than their mean does\n";
        }
    }
    text
}

/// JSON of planned test cuts.
pub fn plan_json(plan: &Plan) -> String {
    let cut = |c: &TestCut| json!({ "axial_depth_mm": c.axial_mm, "radial_depth_mm": c.radial_mm, "feed_per_tooth_mm": c.feed_per_tooth_mm });
    text(&json!({
        "written_by": WRITTEN_BY,
        "model": plan.model,
        "cuts": plan.cuts.iter().map(cut).collect::<Vec<_>>(),
        "condition": plan.condition,
        "expected": values(&plan.expected),
        "notes": plan.notes,
    }))
}

/// Planned test cuts in words, and the table to fill in.
pub fn plan_words(plan: &Plan) -> String {
    let mut text = format!(
        "{} test cuts; calibrate their log (calibrate TEST.nc --log LOG.csv --model {}) or this table, filled in:\n\n{}\n",
        plan.cuts.len(),
        plan.model,
        plan.table
    );
    text +=
        &format!("condition of the fit {:.1}; with 3 % noise it will give\n{}", plan.condition, lines(&plan.expected));
    plan.notes.iter().for_each(|note| text += &format!("note: {note}\n"));
    text
}

fn text(report: &Json) -> String {
    serde_json::to_string_pretty(report).expect("plain data") + "\n"
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn errors(e: &Errors) -> Json {
    json!({ "rmse": e.rmse, "mape": e.mape, "r2": e.r2 })
}

fn values(values: &[Value]) -> Vec<Json> {
    let one = |v: &Value| json!({ "name": v.name, "value": v.value, "std_error": finite(v.std_error), "unit": v.unit });
    values.iter().map(one).collect()
}

/// A diagnosis in words.
pub fn learn_words(r: &LearnReport) -> String {
    let mut text = format!("{}\n", r.verdict);
    text += &format!("{} samples, {} used; {}\n", r.samples, r.used, r.how);
    if let Some(a) = &r.alignment {
        text += &format!(
            "tied to the program by {} (± {:.2} s), offset {:.2} s, stretch {:.4}\n",
            a.method, a.uncertainty_s, a.offset_s, a.stretch
        );
        if let Some(([from, to], u)) = a.stretches.iter().max_by(|x, y| x.1.total_cmp(&y.1)) {
            text += &format!("  least certain (± {u:.3} s) from {from:.1} to {to:.1} s\n");
        }
        let [before, held, after] = a.outside;
        text += &format!(
            "  left out: {before} samples before the program begins, {held} while it is held, {after} after it ends\n"
        );
    }
    text += &lines(&r.told());
    for v in &r.left_out {
        text += &format!(
            "  without {}: these cuts do not tell it ({:.5} ± {:.2} {}), and cuts left out are predicted better without\n",
            v.name, v.value, v.std_error, v.unit
        );
    }
    for e in &r.effects {
        let mark = if r.one_of(&e.name).is_some() { "?" } else { "+" };
        text += &format!("{mark} {}: {}\n{}", e.name, e.evidence, lines(&e.parameters));
    }
    for u in &r.unnamed {
        let name =
            u.family.as_ref().map_or("without a name".to_owned(), |name| format!("{name}, in a form of its own"));
        text += &format!("+ {name}: {} ({})\n", u.said, u.added.evidence);
    }
    for c in &r.confounded {
        text += &format!("? one of: {} ({}); to part them: {}\n", c.names.join(", "), c.why, c.experiment);
    }
    for t in &r.transfer {
        text += &format!("  on {} ({} samples): error {:.4} → {:.4}\n", t.kind, t.samples, t.rmse_before, t.rmse_after);
    }
    if let Some(scatter) = r.scatter {
        text += &format!(
            "unexplained of a cut's load on held-out data: {:.1} % (optimize --confidence leaves room for it)\n",
            100.0 * scatter
        );
    }
    r.events.iter().for_each(|event| text += &format!("event: {}\n", event.said()));
    r.wear.iter().chain(&r.warnings).for_each(|note| text += &format!("note: {note}\n"));
    text
}

/// A calibration in words.
pub fn calibrate_words(c: &Calibration) -> String {
    let mut text = format!("{} from {} measurements\n{}{}", c.model, c.tests, lines(&c.parameters), lines(&c.derived));
    if c.condition.is_finite() {
        text += &format!("error {:.4} in sample ({:.2} %); condition {:.1}\n", c.train.rmse, c.train.mape, c.condition);
    }
    if c.leave_one_out_rmse.is_finite() {
        text += &format!("error {:.4} leaving one out\n", c.leave_one_out_rmse);
    }
    if let Some(share) = c.force_uncertainty {
        text += &format!("forces that follow from it are uncertain by {:.0} %\n", 100.0 * share);
    }
    if let Some(rmse) = c.leave_set_up_out_rmse {
        text += &format!("error {rmse:.4} leaving one set-up out\n");
    }
    for group in &c.indistinguishable {
        text += &format!("these tests cannot tell apart: {}\n", group.join(", "));
    }
    c.notes.iter().for_each(|note| text += &format!("note: {note}\n"));
    c.doubts.iter().for_each(|doubt| text += &format!("no model: {doubt}\n"));
    text
}

fn lines(values: &[Value]) -> String {
    values.iter().fold(String::new(), |text, v| {
        if v.std_error.is_finite() {
            text + &format!("    {} = {:.5} ± {:.2} {}\n", v.name, v.value, v.std_error, v.unit)
        } else {
            text + &format!("    {} cannot be told from these data\n", v.name)
        }
    })
}
