//! Calibration of `linear-edge` from mean forces (Niu, Wang, Zhao, Huang, Eqs 2–3): the factors are those of
//! [`crate::force::closed::mean_force_factors`].

use crate::force::closed::mean_force_factors;
use crate::learn::calibrate::calibration::{CalibrateOptions, Calibration};
use crate::learn::calibrate::regression::{Problem, regression};
use crate::learn::dataset::mean_forces::relative_to;
use crate::learn::dataset::steady_table::SteadyRow;
use crate::learn::log::columns::{DataError, Frame};
use nalgebra::DMatrix;

pub(in crate::learn) fn mean_force(
    frame: &Frame,
    rows: &[SteadyRow],
    options: CalibrateOptions,
) -> Result<Calibration, DataError> {
    let sign = if options.force_on_tool { -1.0 } else { 1.0 };
    let on_workpiece = |name: &str| -> Result<Vec<f64>, DataError> {
        Ok(frame.needed(name)?.into_iter().map(|force| sign * force).collect())
    };
    let (fx, fy) = (on_workpiece("force_x_n")?, on_workpiece("force_y_n")?);
    let used: Vec<usize> = (0..rows.len()).filter(|i| fx[*i].is_finite() && fy[*i].is_finite()).collect();
    // Relative least squares: every component is divided by its measured magnitude, but by no less than a tenth of the
    // resultant.
    let line = |k: usize| {
        let (i, y) = (used[k / 2], k % 2 == 1);
        let measured = if y { fy[i] } else { fx[i] };
        (mean_force_factors(&rows[i].cut, rows[i].is_conventional(), y), measured)
    };
    let scale = |k: usize| 1.0 / relative_to(line(k).1, [fx[used[k / 2]], fy[used[k / 2]]]);
    let problem = Problem {
        names: [("k_tc", "N/mm²"), ("k_rc", "N/mm²"), ("k_te", "N/mm"), ("k_re", "N/mm")]
            .map(|(n, u)| (n.to_owned(), u.to_owned()))
            .to_vec(),
        positive: vec![true; 4],
        x: DMatrix::from_fn(2 * used.len(), 4, |k, j| line(k).0[j] * scale(k)),
        y: (0..2 * used.len()).map(|k| line(k).1 * scale(k)).collect(),
        groups: (0..2 * used.len()).map(|k| k / 2).collect(),
    };
    let mut result = regression("linear-edge", &problem, options.loss)?;
    result.tests = used.len();
    result.notes.push("errors are relative to each measured force; the held-out error leaves whole tests out".into());
    Ok(result)
}
