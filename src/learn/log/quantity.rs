//! The measured quantities of logs and tables, and their scale in the base model.

use std::f64::consts::TAU;

use crate::machine::Spindle;
use crate::units::watts_from_n_mm_s;

/// Columns of measured quantities; forces are on the workpiece, in machine axes.
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

/// Those of the spindle with their kind and unit; the first one present is used.
pub const OF_SPINDLE: [(&str, Quantity, &str); 4] = [
    ("spindle_power_w", Quantity::Power, "W"),
    ("spindle_torque_nm", Quantity::Torque, "N·m"),
    ("spindle_load_percent", Quantity::Relative, "%"),
    ("spindle_current_a", Quantity::Relative, "A"),
];

/// Kind of a spindle reading, which decides the scale of the base columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// W.
    Power,
    /// N·m.
    Torque,
    /// Percent of an unknown rating, or amperes.
    Relative,
}

/// Reading at speed n for a tare of 1 W at the reference speed n₀: P₀(n)/P₀(n₀) with the declared tare P₀, 1 without
/// one; for a torque that power over 2πn, or over 2πn₀ without a declared tare.
pub fn tare_factor(quantity: Quantity, spindle: Option<&Spindle>, rps: f64, reference_rps: f64) -> f64 {
    let declared = spindle.filter(|spindle| spindle.tare_w.at(reference_rps) > 0.0);
    let shape = spindle.map_or(1.0, |spindle| spindle.tare_shape(rps, reference_rps));
    match quantity {
        Quantity::Power | Quantity::Relative => shape,
        Quantity::Torque => shape / (TAU * if declared.is_some() { rps } else { reference_rps }.max(1e-9)),
    }
}

/// Reading for 1 mm³/s times 1 N/mm² (or 1 mm²/s times 1 N/mm), which is 1 N·mm/s = 1 mW; for a torque that power over
/// 2πn. Coefficients of a relative load are per 1000 mm³/s or mm²/s.
pub fn column_factor(quantity: Quantity, rps: f64) -> f64 {
    match quantity {
        Quantity::Power | Quantity::Relative => watts_from_n_mm_s(1.0),
        Quantity::Torque => watts_from_n_mm_s(1.0) / (TAU * rps.max(1e-9)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Table;

    #[test]
    fn a_tare_goes_with_the_speed_as_declared_and_in_torque_over_the_speed() {
        let of = |tare_w: Table| Spindle {
            max_rps: 200.0,
            power_w: None,
            torque_nmm: None,
            tare_w,
            efficiency: Table::constant(1.0),
            runup_time_s: 0.0,
        };
        let rising = of(Table::new(vec![[0.0, 0.0], [100.0, 400.0]]).unwrap());
        assert_eq!(tare_factor(Quantity::Power, Some(&rising), 50.0, 25.0), 2.0);
        assert_eq!(tare_factor(Quantity::Power, Some(&rising), 0.4, 25.0), 0.0, "at rest");
        let torque = |spindle, rps| tare_factor(Quantity::Torque, spindle, rps, 25.0) * TAU * 25.0;
        assert!((torque(Some(&rising), 50.0) - 1.0).abs() < 1e-12, "twice the power at twice the speed");
        let level = of(Table::constant(400.0));
        assert!((torque(Some(&level), 50.0) - 0.5).abs() < 1e-12);
        for undeclared in [None, Some(&of(Table::constant(0.0)))] {
            assert!((torque(undeclared, 50.0) - 1.0).abs() < 1e-12);
            assert_eq!(tare_factor(Quantity::Power, undeclared, 50.0, 25.0), 1.0);
        }
    }
}
