//! What the diagnosis answered against what was hidden. In: cases with their reports. Out: the confusion matrix and the
//! rates, as Markdown.
//!
//! A single effect is *right* when exactly its name is given, or, where the margin of the truth is below the threshold,
//! when it stands among the confounded names. *none* is right when nothing is added; an unlisted effect when nothing is
//! added and structure is reported as unexplained. A pair is right when both names are given. Where the program cannot part
//! the truth from its rival, an answer is right that names the truth, alone or among the confounded.

use super::cases::{Case, MEMORY, TWINS, is_twin, rows};
use super::hidden::{LISTED, UNLISTED};
use super::margin::{THRESHOLD_NATS, margin};
use feedwright::learn::report::LearnReport;
use std::fmt::Write;

/// Outcome of one log.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Row.
    pub row: &'static str,
    /// Seed.
    pub seed: u64,
    /// Noise, percent of the mean cutting load.
    pub noise: f64,
    /// Form of the log.
    pub form: String,
    /// Effects named, in the order of the answer.
    pub named: Vec<String>,
    /// Right; see the head of the file.
    pub right: bool,
    /// Names that are not in the truth.
    pub false_names: usize,
    /// Right by `confounded`.
    pub by_confounded: bool,
    /// Names given as confounded with a name of the answer.
    pub confounded: Vec<String>,
    /// Strongest correlate of what was left unexplained.
    pub unexplained: Option<String>,
    /// Held-out error after, over the noise that was put in.
    pub error_ratio: f64,
    /// What went wrong before there was an answer.
    pub failure: Option<String>,
    /// Time of the diagnosis, s.
    pub seconds: f64,
}

impl Outcome {
    /// Judges a report.
    pub fn new(
        case: &Case,
        row: &'static str,
        noise: f64,
        deviation: [f64; 2],
        report: Result<LearnReport, String>,
    ) -> Self {
        let mut outcome = Self {
            row,
            seed: case.seed,
            noise,
            form: format!("{:?}", case.form),
            named: Vec::new(),
            right: false,
            false_names: 0,
            by_confounded: false,
            confounded: Vec::new(),
            unexplained: None,
            error_ratio: f64::NAN,
            failure: None,
            seconds: 0.0,
        };
        match report {
            Ok(report) => outcome.judge(case, deviation, &report),
            Err(why) => outcome.failure = Some(why),
        }
        outcome
    }

    fn judge(&mut self, case: &Case, deviation: [f64; 2], report: &LearnReport) {
        self.named = report.names().into_iter().map(str::to_owned).collect();
        self.confounded = report.confounded.iter().flat_map(|c| c.names.clone()).collect();
        self.unexplained = report.unexplained.as_ref().map(|u| u.largest_correlate.clone());
        self.false_names = self.named.iter().filter(|name| !case.names.contains(&name.as_str())).count();
        let all_named = case.names.iter().all(|name| self.named.iter().any(|n| n == name));
        self.right = match self.row {
            "two" => all_named,
            row if is_twin(row) => {
                let among = case.names.iter().all(|name| self.confounded.iter().any(|n| n == name));
                self.by_confounded = among;
                among || (all_named && self.false_names == 0)
            }
            row if UNLISTED.contains(&row) => self.named.is_empty() && self.unexplained.is_some(),
            _ => all_named && self.false_names == 0,
        };
        if !self.right && case.names.len() == 1 {
            let among = self.confounded.iter().any(|n| *n == case.names[0]);
            self.by_confounded = among && margin(case, self.noise / 100.0).nats < THRESHOLD_NATS;
            self.right = self.by_confounded;
        }
        // The model is fitted to the power at the shaft.
        let [power, force] = deviation;
        self.error_ratio = error_ratio([power * case.part.shop.efficiency, force], report);
    }

    /// Fields parted by tabs.
    pub fn to_line(&self) -> String {
        let text = |t: &Option<String>| t.clone().unwrap_or_default();
        [
            self.row.to_owned(),
            self.seed.to_string(),
            self.noise.to_string(),
            self.form.clone(),
            self.named.join(","),
            self.right.to_string(),
            self.false_names.to_string(),
            self.by_confounded.to_string(),
            self.confounded.join(","),
            text(&self.unexplained),
            self.error_ratio.to_string(),
            text(&self.failure),
            self.seconds.to_string(),
        ]
        .join("\t")
    }

    /// The outcome that a line of [`Outcome::to_line`] holds.
    pub fn from_line(line: &str) -> Option<Self> {
        let f: Vec<&str> = line.split('\t').collect();
        let list = |t: &str| t.split(',').filter(|n| !n.is_empty()).map(str::to_owned).collect();
        let text = |t: &str| (!t.is_empty()).then(|| t.to_owned());
        (f.len() == 13).then_some(())?;
        Some(Self {
            row: rows().into_iter().find(|row| *row == f[0])?,
            seed: f[1].parse().ok()?,
            noise: f[2].parse().ok()?,
            form: f[3].to_owned(),
            named: list(f[4]),
            right: f[5].parse().ok()?,
            false_names: f[6].parse().ok()?,
            by_confounded: f[7].parse().ok()?,
            confounded: list(f[8]),
            unexplained: text(f[9]),
            error_ratio: f[10].parse().ok()?,
            failure: text(f[11]),
            seconds: f[12].parse().ok()?,
        })
    }

    /// One line for the reader.
    pub fn line(&self) -> String {
        let mark = if self.right { "ok " } else { "BAD" };
        format!(
            "{mark} {:18} seed {:4} noise {} % {:16} {:?} confounded {:?} unexplained {:?} error/floor {:.2} {:.1} s {}",
            self.row,
            self.seed,
            self.noise,
            self.form,
            self.named,
            self.confounded,
            self.unexplained,
            self.error_ratio,
            self.seconds,
            self.failure.as_deref().unwrap_or("")
        )
    }
}

/// Held-out error over the noise that was put in; of several channels the larger.
fn error_ratio(deviation: [f64; 2], report: &LearnReport) -> f64 {
    let cells = report.used as f64 / report.channels.len().max(1) as f64;
    let floor = |k: usize| deviation[k] * mean_of(report.samples as f64 / cells);
    report.channels.iter().enumerate().map(|(k, c)| c.final_rmse / floor(k)).fold(f64::NAN, f64::max)
}

/// Standard deviation of the mean of `m` neighbouring readings over that of one, for noise with correlation ρ^k.
fn mean_of(m: f64) -> f64 {
    let m = m.round().max(1.0);
    let shared: f64 = (1..m as usize).map(|k| (1.0 - k as f64 / m) * MEMORY.powi(k as i32)).sum();
    ((1.0 + 2.0 * shared) / m).sqrt()
}

/// Pairs that power cannot part and that no row stands for, with why.
const NOT_GENERATED: &str = "\n\
    Two pairs that power alone cannot part have no row. *Size effect and edge force*: the model of a log always has an edge\n\
    coefficient k_te, and where chips hardly vary the size effect is a larger k_te and a smaller k_tc; the base model takes it,\n\
    nothing is left that a name could be given to (four development seeds with one width and feed: none named, held-out error\n\
    0.98 to 1.02 of the noise), and an edge force beside k_te is no candidate. *Up/down asymmetry and path\n\
    curvature*: the engagement of a log is that of its own arcs, so that path curvature is no candidate; it is one in tables\n\
    that were worked out for straight moves, where the two are reported as confounded (`tests/learn_tables.rs`).\n";

/// The whole page.
pub fn page(outcomes: &[Outcome]) -> String {
    let mut page = String::from(
        "# Confusion matrix of the diagnosis\n\n\
         Regenerate with `cargo bench --bench confusion`. Rows: what was hidden in the log. Columns: in how many logs of the\n\
         row the answer contains the name. *nothing*: no effect named and nothing unexplained; *unexplained*: no effect named,\n\
         structure reported. *error*: held-out error after over the noise put in, median of the right ones. *right* and the targets: see `score.rs`; noise is a share of the mean cutting load.\n",
    );
    page.push_str(NOT_GENERATED);
    let mut seeds: Vec<u64> = outcomes.iter().map(|o| o.seed).collect();
    seeds.sort_unstable();
    seeds.dedup();
    let (first, last) = (seeds.first().copied().unwrap_or(0), seeds.last().copied().unwrap_or(0));
    let mut noises: Vec<f64> = outcomes.iter().map(|o| o.noise).collect();
    noises.sort_by(f64::total_cmp);
    noises.dedup();
    let _ = write!(
        page,
        "\nThis page: {} logs of {} seeds, {first} to {last}, noises {noises:?} %, the {} effects of the list searched, measured \
         on {}; the whole run takes seeds 0 to 19 and noises 1, 3 and 6 %.\n",
        outcomes.len(),
        seeds.len(),
        feedwright::effects::ALL.len(),
        revision()
    );
    for noise in noises {
        let at: Vec<&Outcome> = outcomes.iter().filter(|o| o.noise == noise).collect();
        let _ = write!(page, "\n## Noise {noise} %\n\n{}\n{}", rates(&at), matrix(&at));
    }
    page
}

/// The state of the source that was measured.
fn revision() -> String {
    let git = |arguments: &[&str]| {
        let run = std::process::Command::new("git").args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output();
        run.ok().filter(|o| o.status.success()).map(|o| String::from_utf8_lossy(&o.stdout).trim().to_owned())
    };
    git(&["describe", "--always", "--dirty"]).map_or_else(|| "an unknown commit".into(), |r| format!("commit {r}"))
}

fn percent(of: &[&Outcome], is: impl Fn(&Outcome) -> bool) -> String {
    let count = of.iter().filter(|o| is(o)).count();
    format!("{:.1} % ({count}/{})", 100.0 * count as f64 / of.len().max(1) as f64, of.len())
}

fn rates(at: &[&Outcome]) -> String {
    let select =
        |keep: &dyn Fn(&Outcome) -> bool| -> Vec<&Outcome> { at.iter().filter(|o| keep(o)).copied().collect() };
    let single = select(&|o| LISTED.contains(&o.row));
    let worst = LISTED.iter().map(|row| select(&|o| o.row == *row)).filter(|of| !of.is_empty()).min_by(|a, b| {
        let rate = |of: &Vec<&Outcome>| of.iter().filter(|o| o.right).count() as f64 / of.len() as f64;
        rate(a).total_cmp(&rate(b))
    });
    let two = select(&|o| o.row == "two");
    let found = select(&|o| o.right && !o.named.is_empty());
    let mut ratios: Vec<f64> = found.iter().map(|o| o.error_ratio).filter(|r| r.is_finite()).collect();
    ratios.sort_by(f64::total_cmp);
    let median = ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN);
    let mut lines = vec![
        ("single effects, pooled, right".to_owned(), percent(&single, |o| o.right), "≥ 95 %"),
        ("both of two named".to_owned(), percent(&two, |o| o.right), "≥ 80 %"),
        ("both of two named and no other".to_owned(), percent(&two, |o| o.right && o.false_names == 0), "–"),
        ("none: nothing added".to_owned(), percent(&select(&|o| o.row == "none"), |o| o.right), "≥ 95 %"),
    ];
    if let Some(worst) = worst {
        let name = format!("worst single row: {}", worst[0].row);
        lines.insert(1, (name, percent(&worst, |o| o.right), "≥ 85 %"));
    }
    for row in UNLISTED {
        let of = select(&|o| o.row == row);
        lines.push((format!("{row} (unlisted): unexplained, no false name"), percent(&of, |o| o.right), "≥ 90 %"));
    }
    for (row, truth) in TWINS {
        let of = select(&|o| o.row == row);
        let confounded = of.iter().filter(|o| o.by_confounded).count();
        lines.push((
            format!("{row} (cannot be parted): {truth} named, alone or ({confounded} times) among the confounded"),
            percent(&of, |o| o.right),
            "≥ 85 %",
        ));
    }
    let without = select(&|o| LISTED.contains(&o.row) && o.form == "TimeOnly");
    lines.push(("single effects, logs of time and load only".to_owned(), percent(&without, |o| o.right), "–"));
    lines.push((
        format!("held-out error ≤ 1.15 × noise where found (median {median:.2})"),
        percent(&found, |o| o.error_ratio <= 1.15),
        "all",
    ));
    lines.push(("right by `confounded`".to_owned(), percent(&single, |o| o.by_confounded), "–"));
    lines.push((
        "right, with a rival given as confounded".to_owned(),
        { percent(&select(&|o| LISTED.contains(&o.row) && o.right), |o| !o.confounded.is_empty()) },
        "–",
    ));
    let mut text = String::from("| rate | value | target |\n|---|---|---|\n");
    for (name, value, target) in lines {
        let _ = writeln!(text, "| {name} | {value} | {target} |");
    }
    text
}

fn median_error(of: &[&&Outcome]) -> String {
    let right = of.iter().filter(|o| o.right && o.error_ratio.is_finite());
    let mut ratios: Vec<f64> = right.map(|o| o.error_ratio).collect();
    ratios.sort_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).map_or_else(|| "–".to_owned(), |r| format!("{r:.2}"))
}

fn matrix(at: &[&Outcome]) -> String {
    let mut names: Vec<String> = LISTED.iter().map(|name| (*name).to_owned()).collect();
    for name in at.iter().flat_map(|o| &o.named) {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    let mut text =
        format!("| hidden | logs | right | {} | nothing | unexplained | failed | error |\n", names.join(" | "));
    let _ = writeln!(text, "|---{}", "|---".repeat(names.len() + 6) + "|");
    for row in rows() {
        let of: Vec<&&Outcome> = at.iter().filter(|o| o.row == row).collect();
        if of.is_empty() {
            continue;
        }
        let count = |is: &dyn Fn(&Outcome) -> bool| match of.iter().filter(|o| is(o)).count() {
            0 => "·".to_owned(),
            n => n.to_string(),
        };
        let cells: Vec<String> = names.iter().map(|name| count(&|o| o.named.contains(name))).collect();
        let _ = writeln!(
            text,
            "| {row} | {} | {} | {} | {} | {} | {} | {} |",
            of.len(),
            count(&|o| o.right),
            cells.join(" | "),
            count(&|o| o.failure.is_none() && o.named.is_empty() && o.unexplained.is_none()),
            count(&|o| o.named.is_empty() && o.unexplained.is_some()),
            count(&|o| o.failure.is_some()),
            median_error(&of),
        );
    }
    text
}
