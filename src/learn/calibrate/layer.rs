//! Calibration of `layer` (Nishida, Eq. 1) from layers of a ball end ([`crate::learn::dataset::layers`]).

use crate::learn::calibrate::calibration::{CalibrateOptions, Calibration};
use crate::learn::calibrate::regression::{Problem, regression};
use crate::learn::dataset::layers::{Layer, TERMS, layers};
use crate::learn::dataset::steady_table::SteadyRow;
use crate::learn::log::columns::{DataError, Frame};
use nalgebra::DMatrix;

pub(in crate::learn) fn layer(
    frame: &Frame,
    rows: &[SteadyRow],
    options: CalibrateOptions,
) -> Result<Calibration, DataError> {
    let force = frame.needed("force_xy_n")?;
    let layers = layers(rows, &force);
    let terms: Vec<[f64; 4]> = layers.iter().map(Layer::terms).collect();
    let problem = Problem {
        names: TERMS.map(|(n, u)| (n.to_owned(), u.to_owned())).to_vec(),
        positive: vec![false; 4],
        x: DMatrix::from_fn(layers.len(), 4, |k, j| terms[k][j]),
        y: layers.iter().map(|layer| layer.force_n / layer.thickness_mm).collect(),
        groups: (0..layers.len()).collect(),
    };
    let mut result = regression("layer", &problem, options.loss)?;
    result.notes.push("force per mm of height of a layer is fitted".into());
    Ok(result)
}
