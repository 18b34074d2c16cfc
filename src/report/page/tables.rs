//! The tables of the page, and its first screen. In: a run with its figures. Out: markup that works without a script.

use maud::{Markup, html};

use super::listing::Listing;
use super::operations::Operation;
use crate::diag;
use crate::machine::LimitKind;
use crate::outcome::ProgramRun;
use crate::outcome::over_limits::LIMIT_TOLERANCE;
use crate::report::bounds::Share;
use crate::report::figures::{Figures, LimitFigure, ToolFigure};
use crate::report::html::{folded, marked, table};
use crate::report::number::{clock, short};
use crate::report::verdict::{Fault, Outcome};
use crate::report::words::plain;

/// Lines of a fault that are listed.
const LINES: usize = 200;

/// Verdict, what to check, time: what is seen first.
pub fn first(run: &ProgramRun, figures: &Figures, listing: &Listing, checks: &[String]) -> Markup {
    html! {
        (verdict(run, figures))
        div class="first" {
            div {
                h2 { "Check before running it" }
                ol id="checks" { "\n" @for check in checks { li { (check) } "\n" } }
            }
            div { h2 { "Time" } (times(run, listing)) }
        }
        "\n"
        (faults(figures))
    }
}

/// Every table behind the views.
pub fn all(run: &ProgramRun, figures: &Figures, operations: &[Operation]) -> Markup {
    html! {
        (by_operation(run, operations))
        (by_cause(run))
        (limits(figures))
        (bounds(figures))
        (tools(figures))
        (checked(run, figures))
        (places(run))
    }
}

/// The headline.
fn verdict(run: &ProgramRun, figures: &Figures) -> Markup {
    let verdict = &figures.verdict;
    let class = if verdict.outcome == Outcome::Done { "good" } else { "bad" };
    let stamp = super::checks::stamp(run, figures);
    html! { div class={ "verdict " (class) } { b { (stamp) } "\n" p class=(class) { (verdict.headline) } } "\n" }
}

/// Every fault with its lines.
fn faults(figures: &Figures) -> Markup {
    let row = |fault: &Fault| {
        let lines: Vec<String> = fault.lines.iter().take(LINES).map(ToString::to_string).collect();
        let more = if fault.lines.len() > LINES { ", …" } else { "" };
        vec![fault.text.clone(), format!("{}{more}", lines.join(", "))]
    };
    let rows: Vec<Vec<String>> = figures.verdict.faults.iter().map(row).collect();
    table("Faults", &["what", "lines"], &rows)
}

/// Time before and after as bars, and how much of the program was changed.
fn times(run: &ProgramRun, listing: &Listing) -> Markup {
    let (before, after) = (run.realised_before.total_s, run.realised_after().total_s);
    if run.written.is_none() {
        return html! { p { (clock(before)) " as programmed." } "\n" };
    }
    let longest = before.max(after).max(f64::MIN_POSITIVE);
    let bar = |name: &str, class: &str, seconds: f64| {
        let width = format!("width:{:.1}%", 100.0 * seconds / longest);
        html! { span { (name) } i class=(class) style=(width) {} span { (clock(seconds)) } }
    };
    let percent = 100.0 * (after / before.max(f64::MIN_POSITIVE) - 1.0).abs();
    let change = format!("{percent:.1} % {}", if after <= before { "shorter" } else { "longer" });
    html! {
        div class="times" { (bar("before", "was", before)) (bar("after", "is", after)) }
        p { (change) ". " (listing.changed) " of " (listing.lines) " lines changed." } "\n"
    }
}

fn by_operation(run: &ProgramRun, operations: &[Operation]) -> Markup {
    let row = |operation: &Operation| {
        let [before, after] = operation.time_s;
        let mut cells = vec![operation.name.clone(), clock(before)];
        if run.written.is_some() {
            cells.extend([clock(after), saved(before, after)]);
        }
        cells
    };
    let rows: Vec<Vec<String>> = operations.iter().map(row).collect();
    table(
        "Time by operation (its moves)",
        &["operation", "before", "after", "change"][..if run.written.is_some() { 4 } else { 2 }],
        &rows,
    )
}

fn saved(before: f64, after: f64) -> String {
    let percent = if before > 0.0 { 100.0 * (after / before - 1.0) } else { 0.0 };
    format!("{:+.1} %", crate::report::number::unsigned_zero(percent, 1))
}

/// Time by cause; a cause is named once, whichever side has it.
fn by_cause(run: &ProgramRun) -> Markup {
    let (before, after) = (&run.realised_before.by_cause, &run.realised_after().by_cause);
    let mut names: Vec<&str> = before.iter().chain(after).filter(|(_, s)| *s > 0.0).map(|(name, _)| *name).collect();
    let mut seen = Vec::new();
    names.retain(|name| {
        !seen.contains(name) && {
            seen.push(*name);
            true
        }
    });
    let of = |side: &[(&'static str, f64)], name: &str| {
        side.iter().find(|(known, _)| *known == name).map_or(0.0, |(_, s)| *s)
    };
    let row = |name: &&str| {
        let mut cells = vec![(*name).to_owned(), clock(of(before, name))];
        if run.written.is_some() {
            cells.push(clock(of(after, name)));
        }
        cells
    };
    let rows: Vec<Vec<String>> = names.iter().map(row).collect();
    table("Time by cause", &["cause", "before", "after"][..if run.written.is_some() { 3 } else { 2 }], &rows)
}

/// What reading the written file back gave.
fn checked(run: &ProgramRun, figures: &Figures) -> Markup {
    let Some(written) = &run.written else { return html! {} };
    let differ = if written.check.identical { "only feeds differ" } else { "more than feeds differs" };
    html! { p { "Read back: " (differ) "; " (figures.verdict.largest()) "." } "\n" }
}

fn limits(figures: &Figures) -> Markup {
    let number = |value: Option<f64>| value.map_or_else(String::new, short);
    let percent = |ratio: Option<f64>| ratio.map_or_else(String::new, |ratio| format!("{:.1} %", 100.0 * ratio));
    let row = |figure: &LimitFigure| {
        let of_spindle = if figure.of_spindle { " of the spindle" } else { "" };
        vec![
            format!("{}{of_spindle}", plain(figure.kind)),
            figure.tool.map_or_else(String::new, |tool| format!("T{tool}")),
            format!("{} {}", number(figure.limit), figure.kind.unit()),
            number(figure.before_max),
            percent(figure.ratios[0]),
            number(figure.after_max),
            percent(figure.ratios[1]),
            figure.at.map_or_else(String::new, |place| {
                place.line.to_string() + &place.fixed.map_or_else(String::new, |apart| format!(" {}", apart.name()))
            }),
            number(figure.after_p99),
            format!("{:.1} %", figure.active_time_percent),
            figure.shadow_price.map_or_else(String::new, |price| format!("{price:+.3}")),
        ]
    };
    let head = [
        "limit",
        "tool",
        "value",
        "largest before",
        "of the limit",
        "largest after",
        "of the limit",
        "line",
        "99 % below",
        "binds",
        "s per unit",
    ];
    let beyond = |row: usize, column: usize| match column {
        4 => figures.limits[row].ratios[0].is_some_and(|ratio| ratio > LIMIT_TOLERANCE),
        6 => figures.limits[row].ratios[1].is_some_and(|ratio| ratio > LIMIT_TOLERANCE),
        _ => false,
    };
    let rows: Vec<Vec<String>> = figures.limits.iter().map(row).collect();
    marked("Limits (every cut counted: frozen, kept and infeasible blocks too)", &head, &rows, &beyond)
}

fn bounds(figures: &Figures) -> Markup {
    let row = |share: &Share| {
        let reason = share.reason.clone().unwrap_or_default();
        let kind = LimitKind::ALL.into_iter().find(|kind| kind.name() == share.name);
        vec![kind.map_or(share.name, plain).to_owned(), format!("{:.1} %", share.percent), reason]
    };
    let rows: Vec<_> = figures.bounds.iter().map(row).collect();
    table("What bounds the feed", &["limit", "of the cutting time", "why"], &rows)
}

fn tools(figures: &Figures) -> Markup {
    let row = |tool: &ToolFigure| {
        vec![
            format!("T{}", tool.number),
            format!("{} W", short(tool.power_max_w)),
            format!("{} N", short(tool.force_peak_n)),
            clock(tool.cut_time_s),
            format!("{} mm", short(tool.cut_length_mm)),
        ]
    };
    let rows: Vec<_> = figures.tools.iter().map(row).collect();
    table("Tools", &["tool", "largest power", "largest force", "cutting time", "cutting length"], &rows)
}

fn places(run: &ProgramRun) -> Markup {
    let infeasible: Vec<Vec<String>> = run
        .infeasible()
        .into_iter()
        .map(|place| vec![place.line.to_string(), plain(place.limit).into(), format!("{} mm", short(place.length_mm))])
        .collect();
    let frozen: Vec<Vec<String>> = run.frozen().into_iter().map(|(line, why)| vec![line.to_string(), why]).collect();
    let warnings: Vec<Vec<String>> = diag::kinds(&run.diagnostics)
        .iter()
        .map(|kind| {
            let line = kind.first.line.map_or_else(String::new, |line| line.to_string());
            vec![line, kind.first.code.into(), kind.text()]
        })
        .collect();
    let assumptions: Vec<Vec<String>> =
        run.assumptions.iter().map(|a| vec![a.key.clone(), a.value.clone(), a.source.clone()]).collect();
    html! {
        (folded("Limits that cannot be met", &["line", "limit", "length"], &infeasible))
        (folded("Blocks that keep their feed", &["line", "why"], &frozen))
        (folded("Warnings", &["line", "code", "what"], &warnings))
        (folded("Assumptions", &["key", "value", "source"], &assumptions))
    }
}
