//! Feedwright: an off-line feedrate optimiser for NC milling programs.
//!
//! bytes → [`nc`] → moves → [`stock`]/[`engage`] → loads as functions of feed ([`force`]) → [`schedule`] → edits
//! ([`rewrite`]) → bytes. A room may use only rooms declared above it in this file; `tests/tidy.rs` enforces the order.

pub mod units;
pub mod ids;
pub mod diag;
pub mod path;
pub mod machine;
pub mod effects;
pub mod nc;
pub mod stock;
pub mod engage;
pub mod force;
pub mod schedule;
pub mod rewrite;
pub mod learn;
pub mod setup;
pub mod report;
pub mod job;
pub mod cli;
