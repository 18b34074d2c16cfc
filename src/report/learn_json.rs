//! JSON of `learn` and `learn-table`, with the keys of the interface. In: what a diagnosis found. Out: text.

use serde::Serialize;

use super::json_parts::{ErrorsPart, EstimatePart, estimates, finite, text};
use super::marks::WRITTEN_BY;
use crate::learn::report::{
    Added, Alignment, Ceiling, Confounded, FeedEvent, LearnReport, Outlying, Rejected, Transfer, Unexplained, Unnamed,
    Window,
};

/// JSON report of a diagnosis.
pub fn learn_json(report: &LearnReport) -> String {
    text(&LearnPart::of(report))
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
            events: r
                .events
                .iter()
                .map(EventPart::of)
                .chain(r.ceilings.iter().map(EventPart::of_ceiling))
                .chain(r.outlying.iter().map(EventPart::of_outlying))
                .collect(),
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
            said: &u.sentence,
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
            said: &u.sentence,
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
    #[serde(skip_serializing_if = "Option::is_none")]
    time_s: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lines: Option<[u32; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    feed_ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reading: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    samples: Option<usize>,
    said: String,
}

impl EventPart {
    fn of(event: &FeedEvent) -> Self {
        Self {
            kind: match event {
                FeedEvent { elsewhere: true, .. } => "elsewhere",
                FeedEvent { ratio: 0.0, .. } => "hold",
                FeedEvent { .. } => "override",
            },
            covariate: if event.elsewhere { "place" } else { "feed" },
            time_s: Some(event.time_s),
            lines: Some(event.lines),
            feed_ratio: Some(event.ratio),
            reading: None,
            samples: None,
            said: event.in_words(),
        }
    }

    fn of_ceiling(ceiling: &Ceiling) -> Self {
        Self {
            kind: "saturation",
            covariate: "load",
            time_s: None,
            lines: None,
            feed_ratio: None,
            reading: Some(ceiling.reading),
            samples: Some(ceiling.samples),
            said: ceiling.in_words(),
        }
    }

    fn of_outlying(outlying: &Outlying) -> Self {
        Self {
            kind: "outlying",
            covariate: if outlying.is_largest { "load" } else { "row" },
            time_s: None,
            lines: None,
            feed_ratio: None,
            reading: Some(outlying.reading),
            samples: Some(1),
            said: outlying.in_words(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::report::Estimate;
    use serde_json::{Value as Json, json};

    fn keys(text: &str, at: &str) -> Vec<String> {
        let json: Json = serde_json::from_str(text).unwrap();
        json.pointer(at).unwrap().as_object().unwrap().keys().cloned().collect()
    }

    fn added(name: &str) -> Added {
        let of = |name: &str, std_error: f64| Estimate { name: name.into(), value: 0.25, std_error, unit: "-".into() };
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
            sentence: "s".into(),
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
            events: [false, true]
                .map(|elsewhere| FeedEvent { time_s: [1.0, 2.0], lines: [3, 4], ratio: 0.0, elsewhere })
                .to_vec(),
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
        let event = |k: usize| ["kind", "covariate"].map(|key| at(&format!("/events/{k}/{key}")));
        assert_eq!([event(0), event(1)], [["hold", "feed"], ["elsewhere", "place"]]);
        assert_eq!(at("/alignment/stretches/0"), json!({ "time_s": [0.0, 9.0], "uncertainty_s": 0.1 }));
        assert_eq!(at("/unnamed").as_array().unwrap().len(), 1);
    }
}
