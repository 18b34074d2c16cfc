//! Measured data → residual → named effect → process model.
//!
//! Rooms in the order of their dependence; each uses only those above it (checked by `tests/tidy.rs`):
//!
//! | room | holds |
//! |---|---|
//! | [`report`] | the result of a diagnosis as plain data |
//! | [`regress`] | least squares, medians, random numbers |
//! | [`log`] | files of measured data: columns, a log over time, gaps, resultants of force components |
//! | [`program`] | the program over time with its engagement, as declared and with other geometries |
//! | [`align`] | where in the program each sample of a log belongs: by position, by line number, by load |
//! | [`dataset`] | one row per sample: reading, weight, covariates, columns of the coefficients; from logs and tables |
//! | [`model`] | base coefficients and effects fitted together, and their held-out errors |
//! | [`diagnose`] | which effects explain the residual; what no effect explains |
//! | [`reading_time`] | how much later or earlier than its position each load was read |
//! | [`runout`] | the runout that a log of peak forces shows |
//! | [`calibrate`] | coefficients from steady cuts, a record of forces or a load meter; test cuts |
//! | [`process_model`] | the process model that a diagnosis or a calibration supports |
//! | [`machine_times`] | how the machine moves, from a log without a load |
//! | [`session`] | the whole way from a log to its report |
//! | [`table`] | the same from a table of steady cuts |
//! | [`evaluate`] | errors of a model on data that it was not fitted to |

pub mod report;
pub mod regress;
pub mod log;
pub mod program;
pub mod align;
pub mod dataset;
pub mod model;
pub mod diagnose;
pub mod reading_time;
pub mod runout;
pub mod calibrate;
pub mod process_model;
pub mod machine_times;
pub mod session;
pub mod table;
pub mod evaluate;
