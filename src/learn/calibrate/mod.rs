//! Cutting coefficients from steady cuts, from one record of forces, or from a load meter read by eye; and programs of
//! test cuts. In: a table, a record, readings, a job. Out: [`Calibration`], or an NC program.
//!
//! One file for each model: [`power`] (and `kienzle`), [`linear_edge`], [`layer`], [`response`], [`polynomial`],
//! [`sigmoid`]; all but the last are linear ([`regression`]). [`load_meter`] needs only two readings of each tool.
//! [`plan`] (for layers of a ball end with `layer_design`) and [`experiment`] choose test cuts, which [`test_program`]
//! writes.

pub mod calibration;
pub mod regression;
pub mod power;
pub mod linear_edge;
pub mod layer;
pub mod response;
pub mod polynomial;
pub mod sigmoid;
pub mod load_meter;
pub mod test_program;
mod layer_design;
pub mod plan;
pub mod experiment;

use crate::learn::dataset::steady_table::SteadyRow;
use crate::learn::diagnose::criteria::{is_no_calibration, is_no_force_of_these_cuts};
use crate::learn::diagnose::doubts::of_coefficients;
use crate::learn::log::columns::{DataError, Frame};
use crate::learn::log::quantity::OF_SPINDLE;
use crate::learn::log::signal::readable;
pub use calibration::{CalibrateOptions, Calibration};

/// Fits `model` to a table. `to_shaft` converts a meter reading to power at the motor shaft.
pub fn calibrate(
    frame: &Frame,
    rows: &[SteadyRow],
    model: &str,
    options: CalibrateOptions,
    to_shaft: impl Fn(f64) -> f64,
) -> Result<Calibration, DataError> {
    // These columns must not be constant.
    for name in OF_SPINDLE.map(|(name, ..)| name).into_iter().chain(["force_xy_n"]) {
        frame.numbers(name).map_or(Ok(()), |values| readable(name, &values))?;
    }
    let mut result = fitted(frame, rows, model, options, to_shaft)?;
    result.doubts = of_coefficients(&result.parameters, options.declared_k_tc);
    let judged = matches!(model, "power" | "kienzle" | "layer" | "response") && frame.numbers("force_x_n").is_none();
    if judged && is_no_calibration(result.train.r2) {
        result.doubts.push("the cuts explain next to nothing of what was measured: are columns swapped?".into());
    }
    if frame.numbers("force_x_n").is_some() && model == "linear-edge" && is_no_force_of_these_cuts(result.train.rmse) {
        result.doubts.push(format!(
            "the forces are not those of these cuts ({:.0} % off): force_x_n is along the feed and force_y_n into the wall, on the workpiece; \
             for forces on the tool give --force-on tool",
            100.0 * result.train.rmse
        ));
    }
    if result.tests <= result.parameters.len() && model != "polynomial" && frame.numbers("force_x_n").is_none() {
        result.doubts.push(format!(
            "{} measurements for {} coefficients leave no residual to judge them by",
            result.tests,
            result.parameters.len()
        ));
    }
    Ok(result)
}

fn fitted(
    frame: &Frame,
    rows: &[SteadyRow],
    model: &str,
    options: CalibrateOptions,
    to_shaft: impl Fn(f64) -> f64,
) -> Result<Calibration, DataError> {
    match model {
        "linear-edge" if frame.numbers("force_x_n").is_some() => linear_edge::mean_force(frame, rows, options),
        "power" | "linear-edge" => power::power(frame, rows, options, &to_shaft, None),
        "kienzle" => power::kienzle(frame, rows, options, &to_shaft),
        "layer" => layer::layer(frame, rows, options),
        "response" => response::response(frame, rows, options),
        "polynomial" => polynomial::calibrate(frame, rows),
        other => Err(DataError::Unfit(format!(
            "the model {other} cannot be calibrated from a table; those that can: power, linear-edge, kienzle, layer, \
             response, polynomial"
        ))),
    }
}
