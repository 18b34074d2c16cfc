//! The output of `learn`, `learn-table`, `calibrate` and `evaluate` on the screen. In: their results. Out: text.

use crate::learn::calibrate::Calibration;
use crate::learn::calibrate::plan::Plan;
use crate::learn::evaluate::Evaluation;
use crate::learn::report::{Estimate, LearnReport};

/// A model held against data that it has not seen, in words.
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
            "{}: error {:.3} ({:.1} %), half of the cuts within {:.1} %, mean of reading - prediction {:+.3}\n  without the \
             effects {:.3}; about the mean of the readings {:.3}\n",
            q.name, q.model.rmse, q.model.mape, q.median_of_cuts, q.bias, q.without_effects.rmse, q.about_mean
        );
        if q.model.rmse >= q.about_mean {
            text += "  this model says less of these data than their mean does\n";
        }
    }
    e.warnings.iter().for_each(|note| text += &format!("note: {note}\n"));
    text
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

/// A diagnosis in words.
pub fn learn_words(r: &LearnReport) -> String {
    let mut text = format!("{}\n", r.verdict);
    text += &format!("{} samples, {} used; {}\n", r.samples, r.used, r.how);
    if let Some(a) = &r.alignment {
        text += &format!(
            "tied to the program by {} (± {:.2} s), offset {:.2} s, stretch {:.4}\n",
            a.method, a.uncertainty_s, a.offset_s, a.stretch
        );
        if a.read_later_s != 0.0 {
            let when = if a.read_later_s > 0.0 { "later" } else { "earlier" };
            text += &format!("  loads are read {:.3} s {when} than the positions beside them\n", a.read_later_s.abs());
        }
        if let Some(([from, to], u)) = a.stretches.iter().max_by(|x, y| x.1.total_cmp(&y.1)) {
            text += &format!("  least certain (± {u:.3} s) from {from:.1} to {to:.1} s\n");
        }
        let [before, held, after] = a.outside;
        text += &format!(
            "  left out: {before} samples before the program begins, {held} while it is held, {after} after it ends\n"
        );
    }
    text += &lines(&r.determined_base());
    for v in &r.left_out {
        text += &format!(
            "  without {}: these cuts do not tell it ({} {}), and cuts left out are predicted better without\n",
            v.name,
            with_error(v),
            v.unit
        );
    }
    for e in &r.effects {
        let mark = if r.one_of(&e.name).is_some() { "?" } else { "+" };
        text += &format!("{mark} {}: {}\n{}", e.name, e.evidence, lines(&e.parameters));
    }
    for u in &r.unnamed {
        let name =
            u.family.as_ref().map_or("without a name".to_owned(), |name| format!("{name}, in a form of its own"));
        text += &format!("+ {name}: {} ({})\n", u.in_words(), u.added.evidence);
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
    r.events.iter().for_each(|event| text += &format!("event: {}\n", event.in_words()));
    r.ceilings.iter().for_each(|ceiling| text += &format!("event: {}\n", ceiling.in_words()));
    r.outlying.iter().for_each(|cut| text += &format!("event: {}\n", cut.in_words()));
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

/// The values, one in a line. Those that were held at 0 say nothing and are not said.
fn lines(values: &[Estimate]) -> String {
    let said = values.iter().filter(|v| v.value != 0.0 || v.std_error != 0.0);
    said.fold(String::new(), |text, v| {
        if v.std_error.is_finite() {
            text + &format!("    {} = {} {}\n", v.name, with_error(v), v.unit)
        } else {
            text + &format!("    {} cannot be told from these data\n", v.name)
        }
    })
}

/// A value with its standard error, which has two significant digits, and the value as many decimals; held values have four digits.
fn with_error(v: &Estimate) -> String {
    let decimals = |of: f64, digits: i32| (digits - 1 - of.abs().log10().floor() as i32).clamp(0, 9) as usize;
    if v.std_error > 0.0 {
        let decimals = decimals(v.std_error, 2);
        format!("{:.decimals$} ± {:.decimals$}", v.value, v.std_error)
    } else {
        format!("{:.*}", if v.value == 0.0 { 0 } else { decimals(v.value, 4) }, v.value)
    }
}
