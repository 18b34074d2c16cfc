//! The report of a run as one HTML file that needs nothing else. In: a run, its figures, the sections of its text, the stock it
//! leaves. Out: text: what a person needs first, then the views, then the tables.
//!
//! Verdict and tables are markup that works without a script; the views are drawn by the scripts beside this file from one
//! block of JSON, which no text of a program can end (`embedded.rs`).

pub mod checks;
mod digits;
mod listing;
mod operations;
pub mod relief;
mod samples;
mod tables;
mod views;

use maud::{Markup, html as markup};
use serde::Serialize;

use super::embedded::{json, script};
use super::figures::Figures;
use super::html::page_with;
use super::picture::drawing;
use super::provenance::largest_rise;
use super::served::{Form, form};
use crate::outcome::ProgramRun;
use crate::schedule::operations::Section;
use crate::units::MM_PER_INCH;
use digits::digits;
use listing::{Row, listing};
use operations::{Operation, Operations};
use relief::Relief;
use samples::{Columns, Frame, Load, Points, path};
use views::views;

/// The scripts, in the order in which they use each other.
const SCRIPTS: [&str; 8] = [
    include_str!("colours.js"),
    include_str!("data.js"),
    include_str!("state.js"),
    include_str!("above.js"),
    include_str!("curves.js"),
    include_str!("space.js"),
    include_str!("listing.js"),
    include_str!("main.js"),
];

/// What the page is made of.
#[derive(Debug, Clone, Copy)]
pub struct Shown<'a> {
    /// The run.
    pub run: &'a ProgramRun,
    /// Its figures.
    pub figures: &'a Figures,
    /// Name of the program.
    pub file: &'a str,
    /// Where its text begins another operation.
    pub sections: &'a [Section],
    /// The stock it leaves, in the common frame; empty where that is not known.
    pub stock: &'a [Relief],
    /// The form of limits above all else, on a page that is served.
    pub form: Option<&'a Form>,
}

#[derive(Serialize)]
struct Data<'a> {
    rewritten: bool,
    unit_length: &'static str,
    unit_feed: &'static str,
    operations: &'a [Operation],
    tools: Vec<ToolPart>,
    stock: Vec<Relief>,
    r#box: BoxPart,
    reasons: Vec<String>,
    loads: Vec<Load>,
    samples: Columns,
    points: Points,
    listing: Vec<Row>,
}

#[derive(Serialize)]
struct ToolPart {
    number: u32,
    diameter: f64,
    length: f64,
}

#[derive(Serialize)]
struct BoxPart {
    min: [f64; 3],
    max: [f64; 3],
}

/// The page as text.
pub fn html(shown: &Shown) -> String {
    let Shown { run, figures, file, sections, stock, form: limits } = *shown;
    let inch = run.toolpath.inch;
    let factor = if inch { 1.0 / MM_PER_INCH } else { 1.0 };
    let operations = Operations::new(run, sections);
    let path = path(run, &operations, factor);
    let listing = listing(run, path.columns.lines());
    let origin = Frame::new(run).origin;
    let stock: Vec<Relief> = stock.iter().map(|relief| relief.seen_from(origin, factor)).collect();
    let first = tables::first(run, figures, &listing, &checks::checks(run, figures, largest_rise(run).as_ref()));
    let body = markup! {
        @if let Some(limits) = limits { (form(limits)) }
        (first)
        div class="without-script scroll" { (drawing(run, figures, file)) } "\n"
        (views())
        (tables::all(run, figures, &operations.all))
    };
    let data = Data {
        rewritten: run.written.is_some(),
        unit_length: if inch { "in" } else { "mm" },
        unit_feed: if inch { "in/min" } else { "mm/min" },
        operations: &operations.all,
        tools: tools(run, factor),
        r#box: outer(path.bounds, &stock),
        stock,
        reasons: path.reasons,
        loads: path.loads,
        samples: path.columns,
        points: path.points,
        listing: listing.rows,
    };
    page_with(file, &body, &scripts(&data))
}

/// The data and the scripts as markup.
fn scripts(data: &Data) -> Markup {
    markup! { (json("data", data)) (script(&format!("\n'use strict';\n{}", SCRIPTS.concat()))) }
}

fn tools(run: &ProgramRun, factor: f64) -> Vec<ToolPart> {
    let part = |tool: &crate::machine::Tool| ToolPart {
        number: tool.number,
        diameter: digits(factor * tool.diameter_mm),
        length: digits(factor * tool.flute_length_mm),
    };
    run.job.tools.iter().map(part).collect()
}

/// The box of the feed moves and of the stock.
fn outer([mut min, mut max]: [[f64; 3]; 2], stock: &[Relief]) -> BoxPart {
    for piece in stock {
        for k in 0..3 {
            min[k] = min[k].min(piece.min[k]);
            max[k] = max[k].max(piece.max[k]);
        }
    }
    BoxPart { min, max }
}
