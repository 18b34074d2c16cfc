//! What a run found, as other people and programs read it: JSON with the keys of the interface, CSV, tables on the screen,
//! an SVG picture. In: a [`Run`]. Out: text.

pub mod answers;
mod blocks;
pub mod bounds;
mod figures;
mod html;
mod json;
pub mod learn;
mod learn_page;
mod log;
pub mod life;
pub mod over;
mod page;
mod picture;
mod provenance;
pub mod run;
mod sign_off;
mod stations;
mod stepover;
mod stepover_page;
mod summary;
mod semifinish;
mod surface;
mod table;
pub mod verdict;
pub mod words;

pub use answers::Answers;
pub use figures::{Figures, figures, in_report_unit};
pub use json::{Extras, json};
pub use learn_page::learn_html;
pub use log::{log_columns, log_json, log_text};
pub use over::MET;
pub use page::relief::Relief;
pub use page::{Shown, html};
pub use picture::picture;
pub use provenance::{Provenance, provenance};
pub use run::{Check, Infeasible, Run, Switched, Written};
pub use semifinish::{SemifinishReport, Semifinished, semifinish_report};
pub use sign_off::sign_off;
pub use stations::{StationLoads, each_station};
pub use stepover::{stepover_json, stepover_words};
pub use stepover_page::stepover_html;
pub use summary::{short, summary};
pub use surface::surface;
pub use table::csv;
pub use verdict::{HeldBack, Outcome, Verdict};

/// Value of the JSON key `written_by`.
pub const WRITTEN_BY: &str = concat!("feedwright ", env!("CARGO_PKG_VERSION"));
/// Stands in the head of every SVG, HTML and TOML file that is written.
pub const MARK: &str = "ritten by feedwright";
/// The first columns of the CSV table.
pub const CSV_HEAD: &str = "line,motion,s_mm,time_before_s,time_after_s,x_mm,y_mm,z_mm,feed_before_mm_min";

/// A value to be written with this many decimals: what rounds to zero is 0, without a sign.
pub fn unsigned_zero(value: f64, decimals: i32) -> f64 {
    if value.abs() <= 0.5 * 10f64.powi(-decimals) { 0.0 } else { value }
}

/// Time above that of the continuous optimum, %.
fn loss_percent(written: &Written) -> f64 {
    let best = written.schedule.continuous_s;
    if best > 0.0 { 100.0 * (written.realised_after.total_s / best - 1.0) } else { 0.0 }
}
