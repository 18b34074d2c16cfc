//! The report as one HTML file that needs nothing else: the picture, then the tables.

use std::fmt::Write;

use super::figures::Figures;
use super::over::MET;
use super::picture::picture;
use super::run::Run;
use super::summary::{clock, short};
use super::verdict::Outcome;
use crate::diag;

const STYLE: &str = "body{font:15px/1.45 Helvetica,Arial,sans-serif;color:#202020;max-width:1000px;margin:24px auto;padding:0 16px}\
h1{font-size:22px}h2{font-size:17px;margin-top:28px}table{border-collapse:collapse}\
td,th{padding:3px 12px;text-align:right;border-bottom:1px solid #e0e0e0}\
td.l,th.l{text-align:left}td.bad,p.bad{color:#c02020;font-weight:bold}p.good{color:#207020}svg{max-width:100%;height:auto}\
details{margin-top:10px}summary{cursor:pointer}";

/// Lines of a fault that are listed.
const LINES: usize = 200;

/// The report as text.
pub fn html(run: &Run, figures: &Figures, file: &str) -> String {
    let body = [
        verdict(figures),
        times(run, figures),
        picture(run, figures, file),
        limits(figures),
        bounds(figures),
        tools(figures),
        places(run),
    ];
    page(file, &body.concat())
}

/// One HTML file with a title.
pub(super) fn page(title: &str, body: &str) -> String {
    let name = escaped(title);
    format!(
        "<!doctype html>\n<!-- w{} {} -->\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{name}</title><style>{STYLE}</style></head><body>\n<h1>{name}</h1>\n{body}</body></html>\n",
        super::MARK,
        env!("CARGO_PKG_VERSION")
    )
}

/// Text as HTML shows it.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// The headline, and every fault.
fn verdict(figures: &Figures) -> String {
    let verdict = &figures.verdict;
    let class = if verdict.outcome == Outcome::Done { "good" } else { "bad" };
    let row = |fault: &super::verdict::Fault| {
        let lines: Vec<String> = fault.lines.iter().take(LINES).map(ToString::to_string).collect();
        let more = if fault.lines.len() > LINES { ", …" } else { "" };
        vec![fault.kind.name().to_owned(), fault.text.clone(), format!("{}{more}", lines.join(", "))]
    };
    let faults: Vec<Vec<String>> = verdict.faults.iter().map(row).collect();
    format!("<p class=\"{class}\">{}</p>\n", escaped(&verdict.headline))
        + &table("Faults", &["what", "", "lines"], &faults)
}

fn times(run: &Run, figures: &Figures) -> String {
    let (before, after) = (run.realised_before.total_s, run.realised_after().total_s);
    let Some(written) = &run.written else { return format!("<p>Time as programmed: {}.</p>\n", clock(before)) };
    let check = &written.check;
    format!(
        "<p>Time {} → {} ({:+.1} %). {}; loads of the written file, read back: {}.</p>\n",
        clock(before),
        clock(after),
        100.0 * (after / before.max(f64::MIN_POSITIVE) - 1.0),
        if check.identical { "Only feeds differ" } else { "More than feeds differ" },
        escaped(&figures.verdict.largest())
    )
}

/// A table with a head.
pub(super) fn table(title: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    marked(title, head, rows, &|_, _| false)
}

/// A table with a head, some of its cells marked as bad.
fn marked(title: &str, head: &[&str], rows: &[Vec<String>], is_bad: &dyn Fn(usize, usize) -> bool) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let mut text = format!("<h2>{title}</h2>\n<table><tr>");
    for (index, name) in head.iter().enumerate() {
        let _ = write!(text, "<th{}>{name}</th>", if index == 0 { " class=\"l\"" } else { "" });
    }
    text += "</tr>\n";
    for (line, row) in rows.iter().enumerate() {
        text += "<tr>";
        for (index, cell) in row.iter().enumerate() {
            let class = match index {
                0 => " class=\"l\"",
                _ if is_bad(line, index) => " class=\"bad\"",
                _ => "",
            };
            let _ = write!(text, "<td{class}>{}</td>", escaped(cell));
        }
        text += "</tr>\n";
    }
    text + "</table>\n"
}

fn limits(figures: &Figures) -> String {
    let number = |value: Option<f64>| value.map_or_else(String::new, short);
    let percent = |ratio: Option<f64>| ratio.map_or_else(String::new, |ratio| format!("{:.1} %", 100.0 * ratio));
    let row = |figure: &super::figures::LimitFigure| {
        let of_spindle = if figure.of_spindle { " of the spindle" } else { "" };
        vec![
            format!("{}{of_spindle}", figure.kind.name()),
            figure.tool.map_or_else(String::new, |tool| format!("T{tool}")),
            format!("{} {}", number(figure.limit), figure.kind.unit()),
            number(figure.before_max),
            percent(figure.ratios[0]),
            number(figure.after_max),
            percent(figure.ratios[1]),
            figure.at.map_or_else(String::new, |place| {
                place.line.to_string() + &place.apart.map_or_else(String::new, |apart| format!(" {}", apart.name()))
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
        4 => figures.limits[row].ratios[0].is_some_and(|ratio| ratio > MET),
        6 => figures.limits[row].ratios[1].is_some_and(|ratio| ratio > MET),
        _ => false,
    };
    let rows: Vec<Vec<String>> = figures.limits.iter().map(row).collect();
    marked("Limits (every cut counted: frozen, kept and infeasible blocks too)", &head, &rows, &beyond)
}

fn bounds(figures: &Figures) -> String {
    let row = |share: &super::bounds::Share| {
        let reason = share.reason.unwrap_or_default().to_owned();
        vec![share.name.to_owned(), format!("{:.1} %", share.percent), reason]
    };
    let rows: Vec<_> = figures.bounds.iter().map(row).collect();
    table("What bounds the feed", &["limit", "of the cutting time", "why"], &rows)
}

fn tools(figures: &Figures) -> String {
    let row = |tool: &super::figures::ToolFigure| {
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

fn places(run: &Run) -> String {
    let infeasible: Vec<Vec<String>> = run
        .infeasible()
        .into_iter()
        .map(|place| vec![place.line.to_string(), place.limit.name().into(), format!("{} mm", short(place.length_mm))])
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
    folded("Limits that cannot be met", &["line", "limit", "length"], &infeasible)
        + &folded("Blocks that keep their feed", &["line", "why"], &frozen)
        + &folded("Warnings", &["line", "code", "what"], &warnings)
        + &folded("Assumptions", &["key", "value", "source"], &assumptions)
}

/// A table that opens on demand.
pub(super) fn folded(title: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let inner = table(title, head, rows);
    format!("<details><summary>{title}: {}</summary>{inner}</details>\n", rows.len())
}
