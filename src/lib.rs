//! Feedwright: an off-line feedrate optimiser for NC milling programs.
//!
//! The public interface is this page and nothing else: [`parse`], [`simulate`], [`optimise`], [`verify`],
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
//! The modules below ("rooms") are private and stand in the order of their dependence. Tests and benches of this package, which are crates of
//! their own, reach them through the feature `rooms`, which its own development dependencies turn on.
#![doc = include_str!("architecture.md")]
// The rooms are hidden: their comments are read in the source, where private items stand beside them.
#![allow(rustdoc::private_intra_doc_links)]

#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod units;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod numeric;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod ids;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod diag;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod bytes;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod path;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod machine;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod effects;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod nc;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod stock;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod engage;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod force;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod schedule;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod rewrite;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod certify;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod learn;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod finish;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod toollife;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod setup;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod outcome;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod report;
#[cfg(feature = "rooms")]
#[doc(hidden)]
pub mod job;

#[cfg(not(feature = "rooms"))]
mod units;
#[cfg(not(feature = "rooms"))]
mod numeric;
#[cfg(not(feature = "rooms"))]
mod ids;
#[cfg(not(feature = "rooms"))]
mod diag;
#[cfg(not(feature = "rooms"))]
mod bytes;
#[cfg(not(feature = "rooms"))]
mod path;
#[cfg(not(feature = "rooms"))]
mod machine;
#[cfg(not(feature = "rooms"))]
mod effects;
#[cfg(not(feature = "rooms"))]
mod nc;
#[cfg(not(feature = "rooms"))]
mod stock;
#[cfg(not(feature = "rooms"))]
mod engage;
#[cfg(not(feature = "rooms"))]
mod force;
#[cfg(not(feature = "rooms"))]
mod schedule;
#[cfg(not(feature = "rooms"))]
mod rewrite;
#[cfg(not(feature = "rooms"))]
mod certify;
#[cfg(not(feature = "rooms"))]
mod learn;
#[cfg(not(feature = "rooms"))]
mod finish;
#[cfg(not(feature = "rooms"))]
mod toollife;
#[cfg(not(feature = "rooms"))]
mod setup;
#[cfg(not(feature = "rooms"))]
mod outcome;
#[cfg(not(feature = "rooms"))]
mod report;
#[cfg(not(feature = "rooms"))]
mod job;
mod api;

pub use api::*;

#[doc(hidden)]
pub mod cli;
