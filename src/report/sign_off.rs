//! One page to print, sign and file with a program. In: a run with its figures and its provenance. Out: self-contained HTML.

use maud::{Markup, html};

use super::embedded::json;
use super::figures::{Figures, LimitFigure};
use super::html::{page, table};
use super::number::{clock, short};
use super::page::checks::{checks, stamp};
use super::provenance::Provenance;
use super::verdict::Outcome;
use super::words::plain;
use crate::outcome::ProgramRun;
use crate::units::MM_PER_INCH;

/// Rows of the lists: with them the page is one sheet.
const ROWS: usize = 12;

/// The page; `written` says whether the program was.
pub fn sign_off(run: &ProgramRun, figures: &Figures, from: &Provenance, file: &str, is_written: bool) -> String {
    let class = if figures.verdict.outcome == Outcome::Done && is_written { "good" } else { "bad" };
    let refused = if is_written { "" } else { "The program was not written. " };
    let body = html! {
        div class="sheet" {
            div class={ "verdict " (class) } {
                b { (refused) (stamp(run, figures)) }
                p class=(class) { (figures.verdict.headline) }
            }
            "\n"
            (files(run, from))
            (found(run, figures, from))
            div class="pair" {
                div { (limits(figures)) }
                div { (listed("Values assumed", &["key", "value", "source"], assumptions(run))) }
            }
            (listed("Lines that keep their feed", &["lines", "how many", "why"], kept(run)))
            (todo(run, figures, from))
            (signatures())
            (json("provenance", from))
        }
        "\n"
    };
    page(&format!("{file}: sign-off"), &body)
}

fn files(run: &ProgramRun, from: &Provenance) -> Markup {
    let row = |name: &str, hash: Option<&String>| vec![name.to_owned(), hash.cloned().unwrap_or_else(|| "none".into())];
    let rows = [
        row("original", Some(&from.original_sha256)),
        row("setup", from.setup_sha256.as_ref()),
        vec!["options".into(), if from.options.is_empty() { "none".into() } else { from.options.join(" ") }],
        row("program as written", from.output_sha256.as_ref()),
        vec!["made by".into(), format!("feedwright {}", from.version)],
        vec!["control".into(), run.program.dialect().name().into()],
    ];
    table("Files (SHA-256)", &["", ""], &rows)
}

fn found(run: &ProgramRun, figures: &Figures, from: &Provenance) -> Markup {
    let (before, after) = (run.realised_before.total_s, run.realised_after().total_s);
    let check = run.written.as_ref().map(|written| &written.check);
    let rise = from.largest_rise.map_or_else(
        || "none".to_owned(),
        |rise| {
            let (line, percent) = (rise.line, 100.0 * (rise.ratio() - 1.0));
            let (factor, unit) = if run.toolpath.inch { (1.0 / MM_PER_INCH, "in/min") } else { (1.0, "mm/min") };
            let [before, after] = [rise.feed_before, rise.feed_after].map(|feed| short(factor * feed));
            format!("line {line}: {before} → {after} {unit} ({percent:+.0} %)")
        },
    );
    let stress = match (run.answers.stress.is_empty(), from.stress_worst_ratio) {
        (true, _) => "not asked for".to_owned(),
        (false, Some(worst)) => format!("{worst:.3} of its limit"),
        (false, None) => "a variation cannot be simulated".to_owned(),
    };
    let identical = check.map_or("not rewritten", |check| if check.identical { "yes" } else { "NO" });
    let rows = [
        vec!["time".into(), format!("{} → {}", clock(before), clock(after))],
        vec!["only feeds differ".into(), identical.into()],
        vec!["largest load of the written file".into(), figures.verdict.largest()],
        vec!["largest rise of a feed in a cut".into(), rise],
        vec!["largest load when the world is not as assumed".into(), stress],
    ];
    table("Found", &["", ""], &rows)
}

/// The load limits in force with the largest load under each.
fn limits(figures: &Figures) -> Markup {
    let mut rows: Vec<&LimitFigure> = figures.limits.iter().filter(|figure| figure.before_max.is_some()).collect();
    rows.sort_by(|a, b| b.ratios[1].unwrap_or(0.0).total_cmp(&a.ratios[1].unwrap_or(0.0)));
    let row = |figure: &&LimitFigure| {
        let number = |value: Option<f64>| value.map_or_else(String::new, short);
        vec![
            format!("{}{}", plain(figure.kind), if figure.of_spindle { ", all there is" } else { "" }),
            figure.tool.map_or_else(String::new, |tool| format!("T{tool}")),
            format!("{} {}", number(figure.limit), figure.kind.unit()),
            number(figure.after_max),
            figure.ratios[1].map_or_else(String::new, |ratio| format!("{:.1} %", 100.0 * ratio)),
            figure.at.map_or_else(String::new, |place| place.line.to_string()),
        ]
    };
    listed("Limits", &["load", "tool", "limit", "largest", "of it", "line"], rows.iter().map(row).collect())
}

fn assumptions(run: &ProgramRun) -> Vec<Vec<String>> {
    run.assumptions.iter().map(|a| vec![a.key.clone(), a.value.clone(), a.source.clone()]).collect()
}

/// Lines by reason, the most frequent first.
fn kept(run: &ProgramRun) -> Vec<Vec<String>> {
    let mut reasons: Vec<(String, Vec<u32>)> = Vec::new();
    for (line, why) in run.frozen() {
        match reasons.iter_mut().find(|(known, _)| *known == why) {
            Some((_, lines)) => lines.push(line),
            None => reasons.push((why, vec![line])),
        }
    }
    reasons.sort_by_key(|(_, lines)| std::cmp::Reverse(lines.len()));
    let row = |(why, lines): (String, Vec<u32>)| {
        let shown: Vec<String> = lines.iter().take(ROWS).map(ToString::to_string).collect();
        let more = if lines.len() > ROWS { ", …" } else { "" };
        vec![format!("{}{more}", shown.join(", ")), lines.len().to_string(), why]
    };
    reasons.into_iter().map(row).collect()
}

/// A table of no more than [`ROWS`] rows; how many there are is said.
fn listed(title: &str, head: &[&str], mut rows: Vec<Vec<String>>) -> Markup {
    let all = rows.len();
    rows.truncate(ROWS);
    html! { (table(title, head, &rows)) @if all > ROWS { p { (all - ROWS) " more in the report." } "\n" } }
}

fn todo(run: &ProgramRun, figures: &Figures, from: &Provenance) -> Markup {
    let things = checks(run, figures, from.largest_rise.as_ref());
    html! {
        h2 { "Checked at the machine" }
        ul style="list-style:none;padding:0" { "\n" @for thing in things { li { "☐ " (thing) } "\n" } }
        "\n"
    }
}

fn signatures() -> Markup {
    html! {
        table {
            tr { th class="l" { "released by" } th { "date" } th { "first part by" } th { "date" } }
            tr { @for _ in 0..4 { td style="width:16em;height:3em" {} } }
        }
        "\n"
    }
}
