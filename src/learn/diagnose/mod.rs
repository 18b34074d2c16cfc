//! The diagnosis: which named effects the residual of the base model speaks for, which not, and what is left.
//! In: [`crate::learn::dataset::samples::Data`] and a split of it. Out: [`crate::learn::report::LearnReport`].

pub mod answer;
pub mod candidates;
mod contest;
pub mod criteria;
mod curve_rivals;
pub mod curves;
pub mod diagnosis;
pub mod doubts;
pub mod evidence;
pub mod forms;
pub mod free_curve;
pub mod held_out;
mod instants;
#[cfg(test)]
mod made_data;
mod memory;
pub mod over_time;
pub mod residual;
pub mod scatter;
pub mod score_test;
mod search;
mod set_ups;
mod terms;
pub mod trial;
pub mod unnamed;

pub use diagnosis::Options;
pub use search::diagnose;
