//! Measured data → residual → named effect → process model.
//!
//! *Tables of steady cuts*: [`log::columns`] → [`dataset::steady_table`] → [`calibrate::mod::mod`] (coefficients), or → [`dataset::samples::Data`] → [`diagnose`].
//! *Logs*: [`log`] → [`align::mod::mod`], [`align::mod::line`] or [`align::mod::load`] (where in the program each sample belongs, by position, by line
//! number or by load) against [`program::timeline`] (what should happen when, and what is cut) → [`dataset::binning`] (weighted by [`dataset::weights`], in
//! their [`dataset::covariates`], as cut within a piece: `within`) → [`dataset::samples::Data`] → [`diagnose`]. [`session::run`] is the whole way.
//!
//! [`diagnose`] lets the effects of [`crate::effects`] compete: [`diagnose::candidates`] says where each search begins, [`model::fit`] fits
//! it with the base coefficients, [`model::cross_validation`] keeps whole blocks out of the fit, [`diagnose::residual`] says what structure is left.
//! *Around it*: [`calibrate::plan`] writes the test cuts of a calibration with [`calibrate::test_program`], [`dataset::steady_cuts`] makes a table of a program's log,
//! [`calibrate::load_meter`] makes do with a load meter, [`calibrate::sigmoid`] takes one record of instantaneous forces; [`calibrate::experiment`] writes the
//! cut that parts rivals, `grown` simulates stock and tool as they were found, [`log::plausible`] says what no model should
//! rest on, [`diagnose::curves`] what a report draws.
//!
//! [`report`] holds the answer, [`process_model`] makes a process model of it, [`diagnose::over_time`] follows the coefficients over time.

pub mod calibrate;
pub mod diagnose;
pub mod model;
pub mod dataset;
pub mod align;
pub mod program;
pub mod regress;
pub mod fine;
pub mod log;
pub mod process_model;
pub mod report;
pub mod session;
mod settled;
mod turn;
