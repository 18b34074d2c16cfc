//! Measured data → residual → named effect → process model.

pub mod align;
pub mod calibrate;
pub mod candidates;
pub mod cells;
pub mod chance;
pub mod columns;
pub mod diagnose;
pub mod fit;
pub mod linear;
pub mod log;
pub mod matching;
pub mod model;
pub mod polynomial;
pub mod report;
pub mod residual;
pub mod samples;
pub mod session;
pub mod split;
pub mod table;
pub mod timeline;
pub mod windows;
