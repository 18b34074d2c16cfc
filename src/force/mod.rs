//! Cutting mechanics. One question: what are the loads at this station as functions of feed? In: tool, material, spindle
//! speed, engaged arcs. Out: [`Loads`] at a feed, and [`Cap`]: the largest feed below which a limit is met.
//!
//! [`Cutter`] holds what belongs to a tool at one speed; [`Cutter::line`] gives a station's [`LoadLine`], from which loads
//! at any feed and caps for any limit follow without looking at the engagement again.

mod affine;
pub mod beam;
mod cap;
pub mod check;
pub mod closed;
mod coefficients;
pub mod contact;
pub mod cutter;
mod error;
pub mod fine_rings;
mod helix;
mod kinds;
mod laws;
pub mod line;
pub mod loads;
mod means;
pub mod models;
mod modifiers;
mod rings;
mod scan;
mod summary;
pub mod surface;
mod sweep;
pub mod runout_forces;
mod zone;

pub use cutter::{Cut, Cutter};
pub use error::ForceError;
pub use line::LoadLine;
pub use loads::{Cap, Loads};
#[cfg(feature = "rooms")]
pub use summary::chip_of_paths;
