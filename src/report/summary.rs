//! The summary on the screen. In: a run with its figures. Out: text of at most 100 columns and, without further options, [`LINES`] lines:
//! verdict, time before and after, loads nearest to their limits, binding limits, changes, feeds that were kept. Page and JSON report have
//! everything.

use super::answers::{answers_text, surface_text};
use super::bounds;
use super::figures::{Figures, LimitFigure};
use super::number::{clock, length, short};
use super::words::plain;
use crate::diag::{self, Severity};
use crate::machine::LimitKind;
use crate::outcome::{ProgramRun, Written};
use crate::setup::LEARNED;
use crate::units::MM_PER_INCH;

/// Lines of the summary: what a screen beside a machine shows at a glance.
const LINES: usize = 20;
/// Widest line of the summary.
const COLUMNS: usize = 100;
/// Faults after the first that are named.
const MORE_FAULTS: usize = 1;
/// Loads that are listed.
const LOADS: usize = 4;
/// Reasons that are listed for what holds the feeds.
const HOLDERS: usize = 4;

/// The summary as text.
pub fn summary(run: &ProgramRun, figures: &Figures, file: &str) -> String {
    let mut text = String::new();
    text += &verdict(figures);
    text += &head(run, file);
    // Where something is wrong, that has the room.
    let is_fine = figures.verdict.faults.is_empty();
    let (rewritten, inch) = (run.written.is_some(), run.toolpath.inch);
    text += &times(run, is_fine);
    text += &answers_text(&run.answers, rewritten);
    if is_fine {
        text += &run
            .answers
            .final_surface
            .as_ref()
            .map_or_else(String::new, |surface| surface_text(surface, rewritten, inch));
    }
    let mut rest = String::new();
    if is_fine {
        rest += &bounds(figures);
    }
    rest += &output(run, figures);
    rest += &apart(run, figures);
    let rest = fitted(&rest);
    let rows = LINES.saturating_sub(text.lines().count() + rest.lines().count() + 2).clamp(1, LOADS);
    fitted(&text) + &loads(run, figures, rows) + &rest
}

/// The headline, and the faults behind it.
fn verdict(figures: &Figures) -> String {
    let mut text = folded("", &figures.verdict.headline);
    let more = figures.verdict.faults.get(1..).unwrap_or_default();
    for fault in &more[..more.len().min(MORE_FAULTS)] {
        text += &folded("", &fault.text);
    }
    if more.len() > MORE_FAULTS {
        text += &format!("and {} more, on the page (--report)\n", more.len() - MORE_FAULTS);
    }
    text
}

/// Lines that are too wide folded, behind their label where they have one.
fn fitted(text: &str) -> String {
    let mut fitted = String::new();
    for line in text.lines() {
        let label = if line.get(9..10) == Some(" ") { &line[..10] } else { "" };
        match line.chars().count() {
            0..=COLUMNS => fitted += &format!("{line}\n"),
            _ => fitted += &folded(label, &line[label.len()..]),
        }
    }
    fitted
}

/// A sentence behind a label, folded at 100 columns; further lines begin under the sentence, or a little to the right where there
/// is no label.
fn folded(label: &str, sentence: &str) -> String {
    let indent = " ".repeat(label.chars().count().max(2));
    let mut text = label.to_owned();
    let mut width = label.chars().count();
    for (index, word) in sentence.split(' ').enumerate() {
        let wide = word.chars().count();
        if index > 0 && width + 1 + wide > COLUMNS {
            text += &format!("\n{indent}");
            width = indent.len();
        } else if index > 0 {
            text += " ";
            width += 1;
        }
        text += word;
        width += wide;
    }
    text + "\n"
}

fn head(run: &ProgramRun, file: &str) -> String {
    let unit = if run.toolpath.inch { "inch" } else { "mm" };
    format!("{file}: {} lines, {}, {unit}\n", run.program.own_len(), run.program.dialect().name())
}

fn times(run: &ProgramRun, with_causes: bool) -> String {
    let (before, after) = (run.realised_before.total_s, run.realised_after().total_s);
    let mut text = match &run.written {
        Some(_) => format!(
            "time      {} → {}   {} by {:.1} %\n",
            clock(before),
            clock(after),
            if after <= before { "shorter" } else { "longer" },
            100.0 * (after / before.max(f64::MIN_POSITIVE) - 1.0).abs()
        ),
        None => format!("time      {}\n", clock(before)),
    };
    if !with_causes {
        return text;
    }
    let causes = &run.realised_after().by_cause;
    let whole = after.max(f64::MIN_POSITIVE);
    let shares: Vec<String> = causes
        .iter()
        .filter(|(_, seconds)| *seconds > 0.0005 * whole)
        .map(|(name, seconds)| format!("{name} {}", clock(*seconds)))
        .collect();
    text += &wrapped("          ", &shares);
    text
}

/// Items joined by commas, folded at 96 columns.
fn wrapped(indent: &str, items: &[String]) -> String {
    let mut text = String::new();
    let mut line = String::new();
    for item in items {
        if !line.is_empty() && indent.chars().count() + line.chars().count() + item.chars().count() + 2 > 96 {
            text += &format!("{indent}{line},\n");
            line.clear();
        }
        if !line.is_empty() {
            line += ", ";
        }
        line += item;
    }
    if line.is_empty() { text } else { text + &format!("{indent}{line}\n") }
}

/// The loads nearest to their limits, one row for each load of each tool.
fn loads(run: &ProgramRun, figures: &Figures, most: usize) -> String {
    let rewritten = run.written.is_some();
    let share = |figure: &LimitFigure| figure.ratios[usize::from(rewritten)].unwrap_or(0.0);
    let mut rows: Vec<&LimitFigure> = figures.limits.iter().filter(|figure| figure.before_max.is_some()).collect();
    if rows.is_empty() {
        return "no load limit is in force: feeds in cuts are never raised\n".into();
    }
    rows.sort_by(|a, b| share(b).total_cmp(&share(a)));
    let side = if rewritten { ["before", "after"] } else { ["", "load"] };
    let mut text = format!(
        "{:<28}{:>5}{:>14}{:>12}{:>12}{:>10}{:>8}\n",
        "nearest to their limits", "tool", "limit", side[0], side[1], "of it", "line"
    );
    let shown = rows.len().min(most);
    rows[..shown].iter().for_each(|figure| text += &load_row(figure, run));
    if rows.len() > shown {
        text += &format!(
            "          {} more rows, all below {:.0} % of their limits\n",
            rows.len() - shown,
            (100.0 * share(rows[shown])).ceil()
        );
    }
    text
}

fn load_row(figure: &LimitFigure, run: &ProgramRun) -> String {
    let rewritten = run.written.is_some();
    let (factor, unit) = shown_unit(figure.kind, run.toolpath.inch);
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| short(factor * value));
    let (value, ratio) =
        if rewritten { (figure.after_max, figure.ratios[1]) } else { (figure.before_max, figure.ratios[0]) };
    let tool = figure.tool.map_or(String::new(), |tool| format!("T{tool}"));
    let of_it = ratio.map_or_else(String::new, |ratio| format!("{:.0} %", 100.0 * ratio));
    let line = figure.at.map_or_else(String::new, |place| place.line.to_string());
    let name =
        if figure.of_spindle { format!("{}, all there is", plain(figure.kind)) } else { plain(figure.kind).to_owned() };
    let mut row = format!(
        "{name:<28}{tool:>5}{:>14}{:>12}{:>12}{of_it:>10}{line:>8}",
        format!("{} {unit}", number(figure.limit)),
        if rewritten { number(figure.before_max) } else { String::new() },
        number(value)
    );
    row.truncate(row.trim_end().len());
    row + "\n"
}

/// Lengths in the unit of the program; the factor from the unit of the report.
fn shown_unit(kind: LimitKind, inch: bool) -> (f64, &'static str) {
    match kind.unit() {
        "mm" if inch => (1.0 / MM_PER_INCH, "in"),
        "mm/min" if inch => (1.0 / MM_PER_INCH, "in/min"),
        unit => (1.0, unit),
    }
}

fn bounds(figures: &Figures) -> String {
    let shares: Vec<_> =
        figures.bounds.iter().zip(bounds::whole(&figures.bounds)).filter(|(_, percent)| *percent > 0).collect();
    if shares.is_empty() {
        return String::new();
    }
    let named =
        |share: &bounds::Share| match (LimitKind::ALL.iter().find(|kind| kind.name() == share.name), &share.reason) {
            (_, Some(why)) => format!("kept, {why}"),
            (Some(kind), None) => plain(*kind).to_owned(),
            (None, None) => share.name.to_owned(),
        };
    let mut items: Vec<String> =
        shares.iter().take(HOLDERS).map(|(share, percent)| format!("{percent} % {}", named(share))).collect();
    let rest: u32 = shares.iter().skip(HOLDERS).map(|(_, percent)| percent).sum();
    if rest > 0 {
        items.push(format!("{rest} % other"));
    }
    folded("held by   ", &items.join("; "))
}

fn output(run: &ProgramRun, figures: &Figures) -> String {
    let Some(written) = &run.written else { return String::new() };
    let stats = &written.stats;
    let check = &written.check;
    let text = format!(
        "changed   {} F words, {} put in, {} lines added{}\nchecked   {}; read back and simulated again{}\n",
        stats.f_words_changed,
        stats.f_words_inserted,
        stats.blocks_added,
        bound(written),
        if check.identical { "only feeds differ" } else { "MORE THAN FEEDS DIFFERS" },
        check.force_rate_ratio.map_or(String::new(), |ratio| format!(", force rises at {ratio:.3} of its limit"))
    );
    // Without a fault the headline has said it.
    if figures.verdict.faults.is_empty() { text } else { text + &folded("          ", &figures.verdict.largest()) }
}

/// What the bound on growth costs, where it binds.
fn bound(written: &Written) -> String {
    let costs_s = written.schedule.bound_costs_s;
    if written.schedule.lambda_s > 0.0 {
        format!("; output.max_growth is used up, which costs {costs_s:.1} s")
    } else {
        String::new()
    }
}

/// One line for each reason why blocks keep their feed.
fn kept_feeds(frozen: &[(u32, String)]) -> String {
    let mut reasons: Vec<(&str, Vec<u32>)> = Vec::new();
    for (line, why) in frozen {
        match reasons.iter_mut().find(|(known, _)| known == why) {
            Some((_, lines)) => lines.push(*line),
            None => reasons.push((why, vec![*line])),
        }
    }
    reasons.sort_by_key(|(_, lines)| std::cmp::Reverse(lines.len()));
    let Some((why, lines)) = reasons.first() else { return String::new() };
    let all = frozen.len();
    let s = if all == 1 { " keeps its" } else { "s keep their" };
    let more = match reasons.len() {
        1 => String::new(),
        count => format!("; {} more reasons on the page", count - 1),
    };
    folded("kept      ", &format!("{all} line{s} feed; {} of them, {}: {why}{more}", lines.len(), some_lines(lines)))
}

fn apart(run: &ProgramRun, figures: &Figures) -> String {
    let mut text = String::new();
    let infeasible = run.infeasible();
    if !infeasible.is_empty() {
        let length: f64 = infeasible.iter().map(|place| place.length_mm).sum();
        let lines: Vec<u32> = infeasible.iter().map(|place| place.line).collect();
        text += &format!(
            "too heavy {} at the lowest feed allowed, {} ({:.1} % of the cuts), {}\n",
            if infeasible.len() == 1 { "1 place".to_owned() } else { format!("{} places", infeasible.len()) },
            self::length(length, run.toolpath.inch),
            100.0 * run.infeasible_share(),
            some_lines(&lines)
        );
    }
    let frozen = run.frozen();
    text += &kept_feeds(&frozen);
    if let Some((line, what)) = figures.overbent(run).first() {
        text += &folded("", &format!("line {line}: {what}"));
    }
    let kinds = diag::kinds(&run.diagnostics);
    let warnings: Vec<_> = kinds.iter().filter(|kind| kind.first.severity >= Severity::Warning).collect();
    let places: u32 = warnings.iter().map(|kind| kind.places).sum();
    if places as usize > warnings.len() {
        text += &format!("warnings  {} kinds, in {places} places\n", warnings.len());
    } else if places > 0 {
        text += &format!("warnings  {places}\n");
    }
    for learned in run.assumptions.iter().filter(|assumed| assumed.source == LEARNED) {
        text += &folded("learned   ", &format!("{}: {}", learned.key.trim_start_matches("process."), learned.value));
    }
    if !run.assumptions.is_empty() {
        text += &format!(
            "assumed   {} values that the setup does not give; the page lists them (--report)\n",
            run.assumptions.len()
        );
    }
    text
}

fn some_lines(lines: &[u32]) -> String {
    let mut shown: Vec<String> = Vec::new();
    for line in lines {
        if shown.last() != Some(&line.to_string()) {
            shown.push(line.to_string());
        }
    }
    let more = if shown.len() > 4 { " …" } else { "" };
    let word = if shown.len() == 1 { "line" } else { "lines" };
    format!("{word} {}{more}", shown[..shown.len().min(4)].join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        assert_eq!([short(1234.56), short(0.030), short(12.0), short(0.0)], ["1235", "0.03", "12", "0"]);
        let two = folded("a ", &["word"; 25].join(" "));
        assert!(two.lines().all(|line| line.chars().count() <= COLUMNS) && two.lines().count() == 2, "{two}");
        assert!(two.ends_with("\n  word word word word word word\n"), "{two}");
        assert_eq!([clock(12.34), clock(406.7), clock(7384.0)], ["12.3 s", "6:47 min", "2:03:04 h"]);
    }
}
