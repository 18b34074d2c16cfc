//! Feedwright: an off-line feedrate optimiser for NC milling programs.
//!
//! What other programs use of it is what stands here, and nothing else: [`parse`], [`simulate`], [`optimise`], [`verify`],
//! [`calibrate`], [`learn()`]. `examples/` has a short program for each.
//!
//! ```no_run
//! let setup = feedwright::Setup::from_toml(&std::fs::read_to_string("part.setup.toml")?, ".")?;
//! let program = feedwright::parse(std::fs::read("part.nc")?, Some(&setup))?;
//! let found = feedwright::optimise(&program, &setup)?;
//! println!("{}", found.prediction.summary("part.nc"));
//! if let Some(text) = found.program {
//!     std::fs::write("part.fw.nc", text)?;
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The rooms below stand in the order of their dependence. They are public and hidden because the tests, benches and fuzz targets of
//! this package, which are crates of their own, look into them; they change without notice.
#![doc = include_str!("architecture.md")]
// The rooms are hidden: their comments are read in the source, where private items stand beside them.
#![allow(rustdoc::private_intra_doc_links)]

#[doc(hidden)]
pub mod units;
#[doc(hidden)]
pub mod numeric;
#[doc(hidden)]
pub mod ids;
#[doc(hidden)]
pub mod diag;
#[doc(hidden)]
pub mod bytes;
#[doc(hidden)]
pub mod path;
#[doc(hidden)]
pub mod machine;
#[doc(hidden)]
pub mod effects;
#[doc(hidden)]
pub mod nc;
#[doc(hidden)]
pub mod stock;
#[doc(hidden)]
pub mod engage;
#[doc(hidden)]
pub mod force;
#[doc(hidden)]
pub mod schedule;
#[doc(hidden)]
pub mod rewrite;
#[doc(hidden)]
pub mod certify;
#[doc(hidden)]
pub mod learn;
#[doc(hidden)]
pub mod finish;
#[doc(hidden)]
pub mod toollife;
#[doc(hidden)]
pub mod setup;
#[doc(hidden)]
pub mod outcome;
#[doc(hidden)]
pub mod report;
#[doc(hidden)]
pub mod job;
mod api;

pub use api::*;

#[doc(hidden)]
pub mod cli;
