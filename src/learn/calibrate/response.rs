//! Calibration of `response` (Kakino, Ibaraki): F = b₀ + b_l L + b_t t_m on the whole depth, L the length of contact
//! and t_m the largest chip, mm.

use crate::force::closed::immersion_rad;
use crate::learn::calibrate::calibration::{CalibrateOptions, Calibration};
use crate::learn::calibrate::regression::{Problem, groups, solved};
use crate::learn::dataset::steady_table::SteadyRow;
use crate::learn::log::columns::{DataError, Frame};
use nalgebra::DMatrix;

pub(in crate::learn) fn response(
    frame: &Frame,
    rows: &[SteadyRow],
    options: CalibrateOptions,
) -> Result<Calibration, DataError> {
    let force = frame.needed("force_xy_n")?;
    let used: Vec<usize> = (0..rows.len()).filter(|i| force[*i].is_finite()).collect();
    let geometry = |i: usize| {
        let c = &rows[i].cut;
        let r = 0.5 * c.diameter_mm;
        let theta = immersion_rad(r, c.radial_depth_mm, c.path_radius_mm);
        let fz = c.feed_mm_s / (f64::from(c.flutes) * c.rps);
        (r * theta, fz * if theta > 0.5 * std::f64::consts::PI { 1.0 } else { theta.sin() })
    };
    let problem = Problem {
        names: [("b0", "N"), ("b_l", "N/mm"), ("b_t", "N/mm")].map(|(n, u)| (n.to_owned(), u.to_owned())).to_vec(),
        positive: vec![false; 3],
        x: DMatrix::from_fn(used.len(), 3, |k, j| [1.0, geometry(used[k]).0, geometry(used[k]).1][j]),
        y: used.iter().map(|i| force[*i]).collect(),
        groups: groups(rows, &used),
    };
    solved("response", &problem, options.loss)
}
