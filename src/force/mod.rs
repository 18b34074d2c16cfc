//! Cutting mechanics: loads at a station as functions of feed. In: tool, material, spindle speed, engaged arcs. Out: [`Loads`] at a feed, and
//! [`Cap`], the largest feed at which a limit is met.
//!
//! [`Cutter`] is a tool at one speed. [`Cutter::line`] makes a station's [`LoadLine`], which gives loads at any feed and caps for any limit
//! without using the engagement again.
//!
//! | what | files |
//! |---|---|
//! | the tool at one speed, a station's loads and caps | [`cutter`], [`line`], [`loads`], `cap` |
//! | force models and their coefficients | [`models`], `laws`, `coefficients`, `kinds`, [`check`], `error` |
//! | the cutter as rings, the arcs of a ring that cut | `rings`, [`fine_rings`], `zone` |
//! | forces over a revolution: linear model, in closed form | `affine`, `sweep`, `helix`, `means`, `beside` |
//! | the same for other laws, runout, deflection: sampled | `scan`, [`runout_forces`] |
//! | models of the resultant alone | `summary` |
//! | deflection, stress, the machined wall | [`beam`], [`surface`] |
//! | effects and wear | `modifiers` |
//! | without simulation: steady cuts, engagement summarised for effects | [`closed`], [`contact`] |

mod affine;
pub mod beam;
mod beside;
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
