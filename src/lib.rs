//! Feedwright: an off-line feedrate optimiser for NC milling programs. Rooms stand in the order of their dependence.
#![doc = include_str!("architecture.md")]

pub mod units;
pub mod ids;
pub mod diag;
pub mod bytes;
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
pub mod finish;
pub mod toollife;
pub mod setup;
pub mod report;
pub mod job;
pub mod cli;
