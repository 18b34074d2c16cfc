//! Measured data → residual → named effect → process model.

pub mod candidates;
pub mod chance;
pub mod columns;
pub mod diagnose;
pub mod fit;
pub mod linear;
pub mod report;
pub mod residual;
pub mod samples;
pub mod split;
pub mod table;
