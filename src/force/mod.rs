//! Cutting mechanics. One question: what are the loads at this station as functions of feed? In: tool, material, spindle
//! speed, engaged arcs. Out: [`Loads`] at a feed, and [`Cap`]: the largest feed below which a limit is met.

pub mod loads;

pub use loads::{Cap, Loads};
