//! Measured data → residual → named effect → process model.
//!
//! Rooms in the order of their dependence; each uses only those above it, and `tests/tidy.rs` watches that:
//!
//! | room | holds |
//! |---|---|
//! | [`report`] | the answer of a diagnosis as plain data |
//! | [`regress`] | least squares, medians, random numbers: numbers without a meaning of their own |
//! | [`log`] | files of measured data: columns, a log over time, gaps, resultants of force components |
//! | [`program`] | what the machine should be doing when, what is cut there, and what would be under another geometry |
//! | [`align`] | where in the program each sample of a log belongs: by position, by line number, by load |
//! | [`dataset`] | one row a sample: reading, weight, covariates, the columns that coefficients multiply; from logs and tables |
//! | [`model`] | base coefficients and effects fitted together, and judged on blocks left out of the fit |
//! | [`diagnose`] | which effects the residual speaks for; what no effect explains |
//! | [`runout`] | the runout that a log of peak forces shows, followed to its valley |
//! | [`calibrate`] | coefficients from steady cuts, a record of forces or a load meter; the test cuts that would give them |
//! | [`process_model`] | the process model that a diagnosis or a calibration supports |
//! | [`machine_times`] | how the machine moves, from a log without a load |
//! | [`session`] | the whole way from a log to its report |
//! | [`evaluate`] | a model held against data that it has not seen |

pub mod report;
pub mod regress;
pub mod log;
pub mod program;
pub mod align;
pub mod dataset;
pub mod model;
pub mod diagnose;
pub mod runout;
pub mod calibrate;
pub mod process_model;
pub mod machine_times;
pub mod session;
pub mod evaluate;
