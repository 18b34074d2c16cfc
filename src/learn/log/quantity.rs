//! The quantities that logs and tables measure: the one list of their columns.

use std::f64::consts::TAU;

use crate::units::watts_from_n_mm_s;

/// Measured quantities that are understood, as columns; forces are on the workpiece, in machine axes.
pub const MEASURED: [&str; 8] = [
    "spindle_power_w",
    "spindle_torque_nm",
    "spindle_current_a",
    "spindle_load_percent",
    "force_xy_n",
    "force_x_n",
    "force_y_n",
    "force_z_n",
];

/// Those of the spindle with their kind and unit; the first that is there is used.
pub const OF_SPINDLE: [(&str, Quantity, &str); 4] = [
    ("spindle_power_w", Quantity::Power, "W"),
    ("spindle_torque_nm", Quantity::Torque, "N·m"),
    ("spindle_load_percent", Quantity::Relative, "%"),
    ("spindle_current_a", Quantity::Relative, "A"),
];

/// What a spindle reading is, and so how base columns are scaled for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// W.
    Power,
    /// N·m.
    Torque,
    /// Percent of an unknown rating, or amperes.
    Relative,
}

/// What mm³/s times N/mm² (or mm²/s times N/mm) is in this quantity: 1 N·mm/s is 1 mW; a torque is a power over 2πn. A
/// relative load has coefficients per thousand of the rate.
pub fn column_factor(quantity: Quantity, rps: f64) -> f64 {
    match quantity {
        Quantity::Power | Quantity::Relative => watts_from_n_mm_s(1.0),
        Quantity::Torque => watts_from_n_mm_s(1.0) / (TAU * rps.max(1e-9)),
    }
}
