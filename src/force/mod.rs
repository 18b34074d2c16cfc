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
pub mod fine_rings;
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
pub mod turn;
mod zone;

pub use cutter::{Cut, Cutter};
pub use line::LoadLine;
pub use loads::{Cap, Loads};
pub use summary::chip_of_paths;

/// Why there are no loads.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ForceError {
    /// A key of the setup, or a word of the program, has a value that no tool or material has.
    #[error("{key} = {value} is out of range: sensible values lie between {low} and {high}")]
    OutOfRange {
        /// Key of the setup file, or word of the program.
        key: String,
        /// Its value, in the unit of the setup file.
        value: f64,
        /// Lowest sensible value.
        low: f64,
        /// Highest sensible value.
        high: f64,
    },
    /// The spindle stands still.
    #[error("the spindle stands still while the tool cuts: give a speed (S) and start it (M3) before this block")]
    SpindleStopped,
    /// A parameter that the model does not have.
    #[error("{key} is no parameter of the force model {model}: `feedwright library models` lists them")]
    UnknownParameter {
        /// Its key.
        key: String,
        /// Name of the model.
        model: &'static str,
    },
    /// A parameter without which the model says nothing.
    #[error("{model} needs {key}: `feedwright library models` and `library effects` say what it is")]
    MissingParameter {
        /// Its key.
        key: &'static str,
        /// Name of the model or effect.
        model: &'static str,
    },
    /// No such effect.
    #[error("unknown effect {name:?}: `feedwright library effects` lists those there are")]
    UnknownEffect {
        /// Its name.
        name: String,
    },
    /// An effect that multiplies edge forces, under a model that has none.
    #[error(
        "{effect} makes edge forces grow, and here the force model {model} has none that could: give its edge terms, or take linear-edge"
    )]
    NoEdgeForce {
        /// Name of the effect.
        effect: &'static str,
        /// Name of the model.
        model: String,
    },
    /// No such force model.
    #[error("unknown force model {name:?}: `feedwright library models` lists those there are")]
    UnknownModel {
        /// Its name.
        name: String,
    },
}
