//! The diagnosis: which named effects explain the residual of the base model, which do not, and what stays unexplained.
//! In: [`crate::learn::dataset::samples::Data`] and a split of it. Out: [`crate::learn::report::LearnReport`].

mod accidents;
pub mod answer;
pub mod candidates;
pub(in crate::learn) mod ceiling;
mod contest;
mod contradicted;
pub mod criteria;
mod curve_rivals;
pub mod diagnosis;
pub mod doubts;
pub mod evidence;
pub mod forms;
pub mod free_curve;
pub mod held_out;
mod idle;
mod in_doubt;
#[cfg(test)]
mod made_data;
mod one_cause;
mod outlying;
pub mod over_time;
mod pairs;
pub mod plotted;
mod pruning;
pub mod residual;
pub mod scatter;
pub mod score_test;
mod search;
pub(in crate::learn) mod set_up_factors;
mod set_ups;
pub mod trial;
mod trial_cache;
mod undetermined_terms;
pub mod unnamed;
mod which_curve;
mod ways;
mod worst_stretch;

pub use diagnosis::Options;
pub use search::diagnose;
