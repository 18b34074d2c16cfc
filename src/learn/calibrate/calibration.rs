//! What a calibration asks and answers: plain data.

use crate::learn::regress::linear::Loss;
use crate::learn::report::{Errors, Estimate};

/// What a calibration answers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Calibration {
    /// Model.
    pub model: String,
    /// Tests used.
    pub tests: usize,
    /// Parameters with standard errors.
    pub parameters: Vec<Estimate>,
    /// What follows from them, or was found beside them, and is no parameter of the force model.
    pub derived: Vec<Estimate>,
    /// Tare, W, where the model has one.
    pub tare: Option<f64>,
    /// Covariance of the parameters.
    pub covariance: Vec<Vec<f64>>,
    /// Condition number of the scaled columns.
    pub condition: f64,
    /// Groups of parameters the tests cannot tell apart.
    pub indistinguishable: Vec<Vec<String>>,
    /// Errors in sample.
    pub train: Errors,
    /// Root mean square error of tests that the fit has not seen.
    pub leave_one_out_rmse: f64,
    /// The same leaving whole set-ups out; `None` with a single one.
    pub leave_set_up_out_rmse: Option<f64>,
    /// Relative standard uncertainty of forces that follow from it.
    pub force_uncertainty: Option<f64>,
    /// What was noticed.
    pub notes: Vec<String>,
    /// Why no model file should rest on it; empty: nothing speaks against one.
    pub doubts: Vec<String>,
}

/// How a calibration is run.
#[derive(Debug, Clone, Copy, Default)]
pub struct CalibrateOptions {
    /// Tare, W, when it is known.
    pub known_tare_w: Option<f64>,
    /// Treatment of outliers.
    pub loss: Loss,
    /// k_tc that the setup declares, where it has one, N/mm².
    pub declared_k_tc: Option<f64>,
}
