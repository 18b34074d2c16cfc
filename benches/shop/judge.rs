//! What a binary answered to a log, against the truth.
//!
//! A name is *asserted* where it stands in no group of `confounded`; the others are answers "one of: …", which are counted in
//! a column of their own, and so is how often the truth is among them. A false name is one that is asserted; of a plain log
//! every answer is false that is not tolerated.
//!
//! In: the report of `feedwright learn --json`. Read are `effects[].name`, `confounded[].names`, `base.test.rmse`,
//! `final.test.rmse`, and for causes that no list has **`unnamed.covariate`** (or `unnamed[].covariate`): a string or a list
//! of strings, the covariates that carry what is left. Also `events[].kind` and `events[].covariate` (an override, a feed
//! hold that was found and taken out). Where a build has no `unnamed`, the hint `unexplained.largest_correlate` stands in.

use serde_json::Value;

use super::causes::{Cause, Truth};

/// What a binary said of one log.
#[derive(Clone, Debug, Default)]
pub struct Answer {
    /// Effects it added.
    pub names: Vec<String>,
    /// Groups of effects that it cannot part.
    pub confounded: Vec<Vec<String>>,
    /// What carries that which has no name, as it was worded.
    pub covariates: Vec<String>,
    /// Covariates that it says may carry it as well.
    pub rivals: Vec<String>,
    /// Held-out error before and after, by its own claim, W.
    pub before: Option<f64>,
    pub after: Option<f64>,
    /// Why there is no answer.
    pub failure: Option<String>,
}

/// Whether an answer is right.
#[derive(Clone, Debug, Default)]
pub struct Verdict {
    pub right: bool,
    pub silent: bool,
    pub false_names: Vec<String>,
    /// For causes without a name.
    pub covariate_right: bool,
    /// The same, or the covariate is among those that are said to carry it as well.
    pub covariate_among: bool,
    /// Says "one of", and whether what was hidden is said by that or by a name.
    pub one_of: bool,
    pub among: bool,
}

/// All strings below a value.
fn strings(value: &Value) -> Vec<String> {
    match value {
        Value::String(text) => vec![text.clone()],
        Value::Array(list) => list.iter().flat_map(strings).collect(),
        _ => Vec::new(),
    }
}

/// The strings under `key` of an object, or of each object of a list.
fn under(value: &Value, key: &str) -> Vec<String> {
    match value {
        Value::Array(list) => list.iter().flat_map(|item| under(item, key)).collect(),
        Value::Object(map) => map.get(key).map(strings).unwrap_or_default(),
        _ => Vec::new(),
    }
}

impl Answer {
    /// Reads a report.
    pub fn read(report: &Value) -> Self {
        let confounded = report["confounded"].as_array().into_iter().flatten().map(|group| strings(&group["names"]));
        let mut covariates = under(&report["unnamed"], "covariate");
        covariates.extend(under(&report["events"], "kind"));
        covariates.extend(under(&report["events"], "covariate"));
        if covariates.is_empty() {
            covariates = under(&report["unexplained"], "largest_correlate");
            // "time (persists over about 2 s)" says that the rest is no noise, and of any cause: it names no covariate.
            covariates.retain(|hint| !hint.contains("persists"));
        }
        Self {
            names: under(&report["effects"], "name"),
            confounded: confounded.collect(),
            covariates,
            rivals: under(&report["unnamed"], "rivals"),
            before: report["base"]["test"]["rmse"].as_f64(),
            after: report["final"]["test"]["rmse"].as_f64(),
            failure: None,
        }
    }

    /// Groups of which one is in the model.
    fn groups(&self) -> impl Iterator<Item = &Vec<String>> {
        self.confounded.iter().filter(|group| group.iter().any(|name| self.names.contains(name)))
    }

    /// Whether an effect was named alone.
    fn asserts(&self, name: &str) -> bool {
        let is_in_doubt = self.groups().any(|group| group.iter().any(|other| other == name));
        self.names.iter().any(|other| other == name) && !is_in_doubt
    }

    /// Whether it was named, alone or as one of several.
    fn voices(&self, name: &str) -> bool {
        self.asserts(name) || self.groups().any(|group| group.iter().any(|other| other == name))
    }

    /// Names that are asserted and for which nothing was hidden.
    fn false_names(&self, hidden: &[&str], tolerated: &[&str]) -> Vec<String> {
        let true_name = |name: &str| hidden.contains(&name) || tolerated.contains(&name);
        self.names.iter().filter(|name| !true_name(name) && self.asserts(name)).cloned().collect()
    }
}

/// The covariates that a wording speaks of.
pub fn covariates_of(wording: &str) -> Vec<&'static str> {
    let text = wording.to_lowercase().replace(['_', '-', '/'], " ");
    let words: Vec<&str> = text.split(|c: char| !c.is_alphanumeric()).collect();
    let has = |list: &[&str]| list.iter().any(|word| words.contains(word));
    let begins = |stem: &str| words.iter().any(|word| word.starts_with(stem));
    let table = [
        ("time", has(&["time", "period", "periodic"])),
        ("feed", has(&["feed", "override", "hold", "pause"]) && !has(&["direction", "tooth"])),
        ("power", has(&["power", "load", "torque"]) || begins("saturat")),
        ("speed", (begins("spindle") && has(&["speed"])) || has(&["rpm"]) || text.contains("cutting speed")),
        ("z", has(&["z", "height", "layer"])),
        ("depth", begins("depth") || begins("deep")),
        ("immersion", begins("immers") || begins("engage") || has(&["contact", "radial", "width", "slot"])),
        ("sliding", begins("slid") || has(&["wear"])),
        ("tool", has(&["tool"])),
        ("group", has(&["group", "order"]) || text.contains("set up")),
        ("direction", begins("direction")),
        ("pass", begins("pass")),
        ("line", has(&["line", "lines", "block", "blocks"])),
        ("acceleration", begins("accel") || begins("decel") || begins("brak")),
        ("chip", begins("chip")),
    ];
    table.into_iter().filter(|(_, said)| *said).map(|(name, _)| name).collect()
}

/// Judges an answer.
pub fn judge(cause: &Cause, answer: &Answer) -> Verdict {
    let hidden: &[&str] = if let Truth::Named(names) = cause.truth { names } else { &[] };
    let allowed = [cause.tolerated, cause.equivalent].concat();
    let mut false_names = answer.false_names(hidden, &allowed);
    let silent = answer.names.is_empty();
    let one_of = answer.groups().next().is_some();
    if matches!(cause.truth, Truth::Plain) {
        false_names = answer.names.iter().filter(|name| !allowed.contains(&name.as_str())).cloned().collect();
    }
    let carried = |wanted: &[&str]| {
        cause.equivalent.iter().any(|name| answer.asserts(name))
            || answer.covariates.iter().flat_map(|wording| covariates_of(wording)).any(|said| wanted.contains(&said))
    };
    let goes_with = |wanted: &[&str]| {
        answer.rivals.iter().flat_map(|wording| covariates_of(wording)).any(|said| wanted.contains(&said))
    };
    let covariate_among = matches!(cause.truth, Truth::Unlisted(wanted) if carried(wanted) || goes_with(wanted));
    let (right, covariate_right) = match cause.truth {
        Truth::Plain => (false_names.is_empty(), false),
        Truth::Named(names) => (names.iter().all(|name| answer.asserts(name)), false),
        Truth::Unlisted(wanted) => (false_names.is_empty() && carried(wanted), carried(wanted)),
    };
    let among = one_of
        && match cause.truth {
            Truth::Plain => false,
            Truth::Named(names) => names.iter().all(|name| answer.voices(name)),
            Truth::Unlisted(wanted) => {
                let said = answer.groups().flatten().flat_map(|wording| covariates_of(wording));
                carried(wanted)
                    || cause.equivalent.iter().any(|name| answer.voices(name))
                    || said.into_iter().any(|covariate| wanted.contains(&covariate))
            }
        };
    let right = right && answer.failure.is_none();
    Verdict { right, silent, false_names, covariate_right, covariate_among, one_of, among }
}
