//! Options and result of a calibration: plain data.

use crate::learn::regress::linear::Loss;
use crate::learn::report::{Errors, Estimate};
use crate::machine::Spindle;

/// Result of a calibration.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Calibration {
    /// Model.
    pub model: String,
    /// Tests used.
    pub tests: usize,
    /// Parameters with standard errors.
    pub parameters: Vec<Estimate>,
    /// Quantities that follow from the parameters or were found with them, such as runout.
    pub derived: Vec<Estimate>,
    /// Tare, W, if the model has one.
    pub tare: Option<f64>,
    /// Spindle speed at which the fitted tare holds, rev/s; at others it follows the declared one.
    pub tare_rps: Option<f64>,
    /// Covariance of the parameters.
    pub covariance: Vec<Vec<f64>>,
    /// Condition number of the scaled columns.
    pub condition: f64,
    /// Groups of parameters that the tests cannot separate.
    pub indistinguishable: Vec<Vec<String>>,
    /// Errors on the tests fitted.
    pub train: Errors,
    /// Root mean square error, leaving out one test at a time.
    pub leave_one_out_rmse: f64,
    /// The same leaving out one set-up at a time; `None` with a single one.
    pub leave_set_up_out_rmse: Option<f64>,
    /// Relative standard uncertainty of predicted forces.
    pub force_uncertainty: Option<f64>,
    /// Remarks for the user.
    pub notes: Vec<String>,
    /// Reasons against writing a model file; empty: none.
    pub doubts: Vec<String>,
}

/// How a calibration is run.
#[derive(Debug, Clone, Copy, Default)]
pub struct CalibrateOptions<'a> {
    /// Tare, W, if it is known.
    pub known_tare_w: Option<f64>,
    /// The spindle, whose declared tare gives the ratio of tares at two speeds.
    pub spindle: Option<&'a Spindle>,
    /// Treatment of outliers.
    pub loss: Loss,
    /// k_tc that the setup declares, N/mm².
    pub declared_k_tc: Option<f64>,
    /// Measured forces act on the tool, not on the workpiece.
    pub force_on_tool: bool,
}
