//! What a run found, as other people and programs read it: JSON with the keys of the interface, CSV, tables on the screen,
//! an SVG picture. In: a [`ProgramRun`](crate::outcome::ProgramRun). Out: text.

mod answers;
mod blocks;
pub mod bounds;
mod figures;
mod embedded;
mod html;
mod json;
pub mod learn;
pub mod learn_json;
mod learn_page;
mod log;
mod marks;
mod number;
pub mod life;
mod page;
mod picture;
mod provenance;
pub mod served;
mod sign_off;
mod stepover;
mod stepover_page;
mod summary;
mod semifinish;
mod surface;
mod table;
pub mod verdict;
pub mod words;

pub use figures::{Figures, LimitFigure, figures};
pub use json::{Extras, json, json_schema};
pub use learn_page::learn_html;
pub use log::{log_columns, log_json, log_text};
pub use marks::{CSV_HEAD, MARK, WRITTEN_BY};
pub use number::{clock, short, unsigned_zero};
pub use page::relief::Relief;
pub use page::{Shown, html};
pub use picture::picture;
pub use provenance::{Provenance, provenance, sha256};
pub use semifinish::{SemifinishReport, Semifinished, semifinish_report};
pub use sign_off::sign_off;
pub use stepover::{stepover_json, stepover_words};
pub use stepover_page::stepover_html;
pub use summary::summary;
pub use surface::surface;
pub use table::csv;
pub use verdict::{HeldBack, Outcome, Verdict};
