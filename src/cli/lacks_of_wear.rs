//! The error of a command that asks for the life of a tool of which the law of wear is not known as a whole. In: the tool, what is known of
//! its wear. Out: what is missing, and the key that gives it.

use super::error::CliError;
use crate::machine::Wear;
use crate::report;

/// What is missing of the law by which `of` wears, where `known` is what there is of it.
pub fn lacks_of_wear(of: &str, known: Option<Wear>) -> CliError {
    match known {
        Some(wear) => CliError::new(
            format!("it is known how fast {of} wears, and nothing says when it is worn out"),
            format!(
                "write under its [[tool]]: wear = {{ end = … }}, the index at which you change it; {} is fresh",
                report::short(wear.fresh)
            ),
        ),
        None => CliError::new(
            format!(
                "nothing says how fast {of} wears: neither its wear = {{ … }} in the setup nor the process model gives a rate"
            ),
            "write it under its [[tool]]: wear = { rate = 0.3, feed_per_tooth = 0.1, exponent = 1, end = 400 }",
        ),
    }
}
