//! JSON of `learn`, `learn-table`, `calibrate` and `evaluate`, with the keys of the interface. In: what they found. Out: text, the keys of
//! each object in alphabetical order.

use serde::Serialize;

use super::marks::WRITTEN_BY;
use crate::learn::calibrate::Calibration;
use crate::learn::calibrate::plan::{Plan, TestCut};
use crate::learn::evaluate::{Evaluation, OfQuantity};
use crate::learn::report::{
    Added, Alignment, Confounded, Errors, FeedEvent, LearnReport, Rejected, Transfer, Unexplained, Unnamed, Value,
    Window,
};

/// JSON report of a diagnosis.
pub fn learn_json(report: &LearnReport) -> String {
    text(&LearnPart::of(report))
}

/// JSON report of a calibration.
pub fn calibrate_json(calibration: &Calibration) -> String {
    text(&CalibrationPart::of(calibration))
}

/// JSON of a model held against data that it has not seen.
pub fn evaluate_json(evaluation: &Evaluation) -> String {
    text(&EvaluationPart::of(evaluation))
}

/// JSON of planned test cuts.
pub fn plan_json(plan: &Plan) -> String {
    text(&PlanPart {
        written_by: WRITTEN_BY,
        model: plan.model,
        cuts: plan.cuts.iter().map(TestCutPart::of).collect(),
        condition: plan.condition,
        expected: estimates(&plan.expected),
        notes: &plan.notes,
    })
}

/// By way of a value, which sorts the keys: so they stood from the first version on, and scripts compare whole files.
fn text(part: &impl Serialize) -> String {
    let sorted = serde_json::to_value(part).expect("plain data");
    serde_json::to_string_pretty(&sorted).expect("plain data") + "\n"
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// A coefficient; without a standard error where the data cannot tell it.
#[derive(Serialize)]
struct EstimatePart<'a> {
    name: &'a str,
    value: f64,
    std_error: Option<f64>,
    unit: &'a str,
}

impl<'a> EstimatePart<'a> {
    fn of(v: &'a Value) -> Self {
        Self { name: &v.name, value: v.value, std_error: finite(v.std_error), unit: &v.unit }
    }
}

fn estimates(values: &[Value]) -> Vec<EstimatePart<'_>> {
    values.iter().map(EstimatePart::of).collect()
}

#[derive(Serialize)]
struct ErrorsPart {
    rmse: f64,
    mape: f64,
    r2: f64,
}

impl ErrorsPart {
    fn of(errors: &Errors) -> Self {
        Self { rmse: errors.rmse, mape: errors.mape, r2: errors.r2 }
    }
}

#[derive(Serialize)]
struct LearnPart<'a> {
    written_by: &'static str,
    data: DataPart<'a>,
    alignment: Option<AlignmentPart<'a>>,
    base: BasePart<'a>,
    effects: Vec<EffectPart<'a>>,
    unnamed: Vec<CurvePart<'a>>,
    rejected: Vec<RejectedPart<'a>>,
    confounded: Vec<ConfoundedPart<'a>>,
    unexplained: Option<UnexplainedPart<'a>>,
    r#final: FinalPart<'a>,
    transfer: Vec<TransferPart<'a>>,
    windows: Vec<WindowPart>,
    wear: Option<&'a str>,
    events: Vec<EventPart>,
    variants_tried: usize,
    warnings: &'a [String],
    supports_model: bool,
    verdict: &'a str,
}

impl<'a> LearnPart<'a> {
    fn of(r: &'a LearnReport) -> Self {
        let laws = r.effects.iter().map(|added| EffectPart::law(added, r));
        let curves = r.unnamed.iter().filter_map(EffectPart::curve);
        Self {
            written_by: WRITTEN_BY,
            data: DataPart::of(r),
            alignment: r.alignment.as_ref().map(AlignmentPart::of),
            base: BasePart::of(r),
            effects: laws.chain(curves).collect(),
            unnamed: r.unnamed.iter().filter(|u| u.family.is_none()).map(CurvePart::of).collect(),
            rejected: r.rejected.iter().map(RejectedPart::of).collect(),
            confounded: r.confounded.iter().map(ConfoundedPart::of).collect(),
            unexplained: r.unexplained.as_ref().map(UnexplainedPart::of),
            r#final: FinalPart::of(r),
            transfer: r.transfer.iter().map(TransferPart::of).collect(),
            windows: r.windows.iter().map(WindowPart::of).collect(),
            wear: r.wear.as_deref(),
            events: r.events.iter().map(EventPart::of).collect(),
            variants_tried: r.variants_tried,
            warnings: &r.warnings,
            supports_model: r.supports_model,
            verdict: &r.verdict,
        }
    }
}

#[derive(Serialize)]
struct DataPart<'a> {
    samples: usize,
    used: usize,
    down_weighted: usize,
    split: SplitPart<'a>,
}

#[derive(Serialize)]
struct SplitPart<'a> {
    train: usize,
    test: usize,
    how: &'a str,
}

impl<'a> DataPart<'a> {
    fn of(r: &'a LearnReport) -> Self {
        let split = SplitPart { train: r.train, test: r.test, how: &r.how };
        Self { samples: r.samples, used: r.used, down_weighted: r.down_weighted, split }
    }
}

#[derive(Serialize)]
struct AlignmentPart<'a> {
    offset_s: f64,
    stretch: f64,
    method: &'a str,
    uncertainty_s: f64,
    pauses: &'a [(f64, f64)],
    stretches: Vec<StretchPart>,
    outside: OutsidePart,
}

#[derive(Serialize)]
struct StretchPart {
    time_s: [f64; 2],
    uncertainty_s: f64,
}

/// Samples that belong to no place of the program.
#[derive(Serialize)]
struct OutsidePart {
    before: usize,
    held: usize,
    after: usize,
}

impl<'a> AlignmentPart<'a> {
    fn of(a: &'a Alignment) -> Self {
        let [before, held, after] = a.outside;
        let stretch =
            |(time_s, uncertainty_s): &([f64; 2], f64)| StretchPart { time_s: *time_s, uncertainty_s: *uncertainty_s };
        Self {
            offset_s: a.offset_s,
            stretch: a.stretch,
            method: &a.method,
            uncertainty_s: a.uncertainty_s,
            pauses: &a.pauses,
            stretches: a.stretches.iter().map(stretch).collect(),
            outside: OutsidePart { before, held, after },
        }
    }
}

#[derive(Serialize)]
struct BasePart<'a> {
    parameters: Vec<EstimatePart<'a>>,
    condition: Option<f64>,
    train: ErrorsPart,
    test: ErrorsPart,
}

impl<'a> BasePart<'a> {
    fn of(r: &'a LearnReport) -> Self {
        Self {
            parameters: estimates(&r.base),
            condition: finite(r.condition),
            train: ErrorsPart::of(&r.base_train),
            test: ErrorsPart::of(&r.base_test),
        }
    }
}

/// An effect with a name: by its law, or by a curve that shows it in another form.
#[derive(Serialize)]
#[serde(tag = "form", rename_all = "lowercase")]
enum EffectPart<'a> {
    Law {
        name: &'a str,
        parameters: Vec<EstimatePart<'a>>,
        p_value: f64,
        test_rmse_before: f64,
        test_rmse_after: f64,
        evidence: &'a str,
        one_of: Option<&'a [String]>,
    },
    Curve {
        name: &'a str,
        parameters: Vec<EstimatePart<'a>>,
        said: &'a str,
        covariate: &'a str,
        unit: &'a str,
        knots: &'a [[f64; 2]],
        effect: &'a str,
        p_value: f64,
        test_rmse_before: f64,
        test_rmse_after: f64,
        evidence: &'a str,
    },
}

impl<'a> EffectPart<'a> {
    fn law(added: &'a Added, r: &'a LearnReport) -> Self {
        EffectPart::Law {
            name: &added.name,
            parameters: estimates(&added.parameters),
            p_value: added.p_value,
            test_rmse_before: added.test_rmse_before,
            test_rmse_after: added.test_rmse_after,
            evidence: &added.evidence,
            one_of: r.one_of(&added.name).map(|group| &group.names[..]),
        }
    }

    /// Nothing of a curve that bears no name.
    fn curve(u: &'a Unnamed) -> Option<Self> {
        u.family.as_ref().map(|name| EffectPart::Curve {
            name,
            parameters: estimates(&u.added.parameters),
            said: &u.said,
            covariate: &u.covariate,
            unit: &u.unit,
            knots: &u.knots,
            effect: &u.added.name,
            p_value: u.added.p_value,
            test_rmse_before: u.added.test_rmse_before,
            test_rmse_after: u.added.test_rmse_after,
            evidence: &u.added.evidence,
        })
    }
}

/// A curve that bears no name.
#[derive(Serialize)]
struct CurvePart<'a> {
    covariate: &'a str,
    unit: &'a str,
    multiplies: &'a str,
    knots: &'a [[f64; 2]],
    beside: Option<&'a str>,
    rivals: &'a [String],
    said: &'a str,
    p_value: f64,
    effect: &'a str,
    evidence: &'a str,
    test_rmse_before: f64,
    test_rmse_after: f64,
}

impl<'a> CurvePart<'a> {
    fn of(u: &'a Unnamed) -> Self {
        Self {
            covariate: &u.covariate,
            unit: &u.unit,
            multiplies: &u.multiplies,
            knots: &u.knots,
            beside: u.beside.as_deref(),
            rivals: &u.rivals,
            said: &u.said,
            p_value: u.added.p_value,
            effect: &u.added.name,
            evidence: &u.added.evidence,
            test_rmse_before: u.added.test_rmse_before,
            test_rmse_after: u.added.test_rmse_after,
        }
    }
}

#[derive(Serialize)]
struct RejectedPart<'a> {
    name: &'a str,
    why: &'a str,
}

impl<'a> RejectedPart<'a> {
    fn of(rejected: &'a Rejected) -> Self {
        Self { name: &rejected.name, why: &rejected.why }
    }
}

#[derive(Serialize)]
struct ConfoundedPart<'a> {
    names: &'a [String],
    why: &'a str,
    experiment: &'a str,
}

impl<'a> ConfoundedPart<'a> {
    fn of(group: &'a Confounded) -> Self {
        Self { names: &group.names, why: &group.why, experiment: &group.experiment }
    }
}

#[derive(Serialize)]
struct UnexplainedPart<'a> {
    test_r2_of_residual_structure: f64,
    largest_correlate: &'a str,
}

impl<'a> UnexplainedPart<'a> {
    fn of(u: &'a Unexplained) -> Self {
        Self { test_r2_of_residual_structure: u.test_r2_of_residual_structure, largest_correlate: &u.largest_correlate }
    }
}

/// The final model.
#[derive(Serialize)]
struct FinalPart<'a> {
    parameters: Vec<EstimatePart<'a>>,
    train: ErrorsPart,
    test: ErrorsPart,
    noise_floor: Option<f64>,
    scatter: Option<f64>,
    left_out: Vec<EstimatePart<'a>>,
    quantities: Vec<ChannelPart<'a>>,
}

#[derive(Serialize)]
struct ChannelPart<'a> {
    name: &'a str,
    test_rmse_before: f64,
    test_rmse_after: f64,
}

impl<'a> FinalPart<'a> {
    fn of(r: &'a LearnReport) -> Self {
        let quantities = r.channels.iter().map(|channel| ChannelPart {
            name: &channel.name,
            test_rmse_before: channel.base_rmse,
            test_rmse_after: channel.final_rmse,
        });
        Self {
            parameters: estimates(&r.final_base),
            train: ErrorsPart::of(&r.final_train),
            test: ErrorsPart::of(&r.final_test),
            noise_floor: r.noise_floor,
            scatter: r.scatter,
            left_out: estimates(&r.left_out),
            quantities: quantities.collect(),
        }
    }
}

#[derive(Serialize)]
struct TransferPart<'a> {
    kind: &'a str,
    samples: usize,
    rmse_before: f64,
    rmse_after: f64,
}

impl<'a> TransferPart<'a> {
    fn of(t: &'a Transfer) -> Self {
        Self { kind: &t.kind, samples: t.samples, rmse_before: t.rmse_before, rmse_after: t.rmse_after }
    }
}

#[derive(Serialize)]
struct WindowPart {
    time_s: [f64; 2],
    cutting: [f64; 2],
    edge: [f64; 2],
}

impl WindowPart {
    fn of(w: &Window) -> Self {
        Self { time_s: w.time_s, cutting: w.cutting, edge: w.edge }
    }
}

/// Where the machine stood, or ran at another feed than predicted.
#[derive(Serialize)]
struct EventPart {
    kind: &'static str,
    covariate: &'static str,
    time_s: [f64; 2],
    lines: [u32; 2],
    feed_ratio: f64,
    said: String,
}

impl EventPart {
    fn of(event: &FeedEvent) -> Self {
        Self {
            kind: if event.ratio == 0.0 { "hold" } else { "override" },
            covariate: "feed",
            time_s: event.time_s,
            lines: event.lines,
            feed_ratio: event.ratio,
            said: event.said(),
        }
    }
}

#[derive(Serialize)]
struct CalibrationPart<'a> {
    written_by: &'static str,
    model: &'a str,
    tests: usize,
    parameters: Vec<EstimatePart<'a>>,
    derived: Vec<EstimatePart<'a>>,
    tare_w: Option<f64>,
    covariance: &'a [Vec<f64>],
    condition: Option<f64>,
    indistinguishable: &'a [Vec<String>],
    train: ErrorsPart,
    leave_one_out_rmse: Option<f64>,
    leave_set_up_out_rmse: Option<f64>,
    force_uncertainty: Option<f64>,
    notes: &'a [String],
    doubts: &'a [String],
}

impl<'a> CalibrationPart<'a> {
    fn of(c: &'a Calibration) -> Self {
        Self {
            written_by: WRITTEN_BY,
            model: &c.model,
            tests: c.tests,
            parameters: estimates(&c.parameters),
            derived: estimates(&c.derived),
            tare_w: c.tare,
            covariance: &c.covariance,
            condition: finite(c.condition),
            indistinguishable: &c.indistinguishable,
            train: ErrorsPart::of(&c.train),
            leave_one_out_rmse: finite(c.leave_one_out_rmse),
            leave_set_up_out_rmse: c.leave_set_up_out_rmse,
            force_uncertainty: c.force_uncertainty,
            notes: &c.notes,
            doubts: &c.doubts,
        }
    }
}

#[derive(Serialize)]
struct EvaluationPart<'a> {
    written_by: &'static str,
    samples: usize,
    alignment: Option<TiedPart>,
    effects: &'a [String],
    quantities: Vec<QuantityPart<'a>>,
    /// Of the first quantity.
    test: Option<ErrorsPart>,
}

/// How the log was tied to the program.
#[derive(Serialize)]
struct TiedPart {
    method: &'static str,
    uncertainty_s: f64,
}

#[derive(Serialize)]
struct QuantityPart<'a> {
    name: &'a str,
    samples: usize,
    model: ErrorsPart,
    without_effects: ErrorsPart,
    about_mean_rmse: f64,
    bias: f64,
}

impl<'a> EvaluationPart<'a> {
    fn of(e: &'a Evaluation) -> Self {
        Self {
            written_by: WRITTEN_BY,
            samples: e.samples,
            alignment: e.tied.map(|(method, uncertainty_s)| TiedPart { method, uncertainty_s }),
            effects: &e.effects,
            quantities: e.quantities.iter().map(QuantityPart::of).collect(),
            test: e.quantities.first().map(|quantity| ErrorsPart::of(&quantity.model)),
        }
    }
}

impl<'a> QuantityPart<'a> {
    fn of(q: &'a OfQuantity) -> Self {
        Self {
            name: &q.name,
            samples: q.samples,
            model: ErrorsPart::of(&q.model),
            without_effects: ErrorsPart::of(&q.without_effects),
            about_mean_rmse: q.about_mean,
            bias: q.bias,
        }
    }
}

#[derive(Serialize)]
struct PlanPart<'a> {
    written_by: &'static str,
    model: &'static str,
    cuts: Vec<TestCutPart>,
    condition: f64,
    expected: Vec<EstimatePart<'a>>,
    notes: &'a [String],
}

#[derive(Serialize)]
#[allow(clippy::struct_field_names)] // keys of the interface, each with its unit
struct TestCutPart {
    axial_depth_mm: f64,
    radial_depth_mm: f64,
    feed_per_tooth_mm: f64,
}

impl TestCutPart {
    fn of(cut: &TestCut) -> Self {
        Self { axial_depth_mm: cut.axial_mm, radial_depth_mm: cut.radial_mm, feed_per_tooth_mm: cut.feed_per_tooth_mm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value as Json, json};

    fn keys(text: &str, at: &str) -> Vec<String> {
        let json: Json = serde_json::from_str(text).unwrap();
        json.pointer(at).unwrap().as_object().unwrap().keys().cloned().collect()
    }

    fn added(name: &str) -> Added {
        let of = |name: &str, std_error: f64| Value { name: name.into(), value: 0.25, std_error, unit: "-".into() };
        Added {
            name: name.into(),
            parameters: vec![of("a", 0.5), of("b", f64::INFINITY)],
            p_value: 0.001,
            test_rmse_before: 3.0,
            test_rmse_after: 2.0,
            evidence: "e".into(),
        }
    }

    fn curve(family: Option<&str>) -> Unnamed {
        Unnamed {
            added: added("curve-speed"),
            covariate: "speed".into(),
            unit: "m/min".into(),
            multiplies: "load".into(),
            knots: vec![[1.0, 0.5], [2.0, 1.5]],
            beside: None,
            rivals: vec!["time".into()],
            family: family.map(str::to_owned),
            said: "s".into(),
        }
    }

    /// The keys that other programs hold on to, for each of the two forms of an effect, with what cannot be told as null.
    #[test]
    fn the_report_has_the_keys_of_the_interface() {
        let group =
            Confounded { names: vec!["wear".into(), "warm-up".into()], why: "w".into(), experiment: "x".into() };
        let report = LearnReport {
            alignment: Some(Alignment {
                stretches: vec![([0.0, 9.0], 0.1)],
                pauses: vec![(1.0, 2.0)],
                ..Alignment::default()
            }),
            effects: vec![added("wear"), added("runout")],
            unnamed: vec![curve(Some("size")), curve(None)],
            confounded: vec![group],
            condition: f64::NAN,
            events: vec![FeedEvent { time_s: [1.0, 2.0], lines: [3, 4], ratio: 0.0 }],
            ..LearnReport::default()
        };
        let text = learn_json(&report);
        let top = [
            "alignment",
            "base",
            "confounded",
            "data",
            "effects",
            "events",
            "final",
            "rejected",
            "supports_model",
            "transfer",
            "unexplained",
            "unnamed",
            "variants_tried",
            "verdict",
            "warnings",
            "wear",
            "windows",
            "written_by",
        ];
        assert_eq!(keys(&text, ""), top);
        let law =
            ["evidence", "form", "name", "one_of", "p_value", "parameters", "test_rmse_after", "test_rmse_before"];
        assert_eq!(keys(&text, "/effects/0"), law);
        let form = [
            "covariate",
            "effect",
            "evidence",
            "form",
            "knots",
            "name",
            "p_value",
            "parameters",
            "said",
            "test_rmse_after",
            "test_rmse_before",
            "unit",
        ];
        assert_eq!(keys(&text, "/effects/2"), form);
        let nameless = [
            "beside",
            "covariate",
            "effect",
            "evidence",
            "knots",
            "multiplies",
            "p_value",
            "rivals",
            "said",
            "test_rmse_after",
            "test_rmse_before",
            "unit",
        ];
        assert_eq!(keys(&text, "/unnamed/0"), nameless);
        let json: Json = serde_json::from_str(&text).unwrap();
        let at = |pointer: &str| json.pointer(pointer).unwrap().clone();
        assert_eq!(at("/effects/0/one_of"), json!(["wear", "warm-up"]));
        assert_eq!(
            [at("/effects/1/one_of"), at("/base/condition"), at("/unexplained")],
            [Json::Null, Json::Null, Json::Null]
        );
        assert_eq!(
            at("/effects/0/parameters/1"),
            json!({ "name": "b", "value": 0.25, "std_error": null, "unit": "-" })
        );
        assert_eq!([at("/effects/0/form"), at("/effects/2/form"), at("/events/0/kind")], ["law", "curve", "hold"]);
        assert_eq!(at("/alignment/stretches/0"), json!({ "time_s": [0.0, 9.0], "uncertainty_s": 0.1 }));
        assert_eq!(at("/unnamed").as_array().unwrap().len(), 1);
    }
}
