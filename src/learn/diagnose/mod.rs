//! The diagnosis: which named effects the residual of the base model speaks for, which not, and what is left.
//! In: [`crate::learn::dataset::samples::Data`] and a split of it. Out: [`crate::learn::report::LearnReport`].

pub mod answer;
pub mod candidates;
pub mod curves;
pub mod forms;
pub mod held_out;
pub mod over_time;
pub mod replacement;
pub mod residual;
mod search;
pub mod trial;
pub mod unnamed;

pub use search::{Options, diagnose};
