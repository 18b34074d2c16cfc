//! Calibration of `layer` (Nishida, Eq. 1): F/Δz = C₀ + C₁L + C₂t_m + C₃L t_m, L the length of contact in mm and t_m
//! the largest chip in µm, on the layer at height t_z of a ball end. Layers are given, or are the differences of cuts
//! of growing depth.

use crate::force::closed::{SteadyCut, ball_layer};
use crate::learn::calibrate::calibration::{CalibrateOptions, Calibration};
use crate::learn::calibrate::regression::{Problem, solved};
use crate::learn::dataset::steady_table::SteadyRow;
use crate::learn::log::columns::{DataError, Frame};
use nalgebra::DMatrix;

pub(in crate::learn) fn layer(
    frame: &Frame,
    rows: &[SteadyRow],
    options: CalibrateOptions,
) -> Result<Calibration, DataError> {
    let force = frame.needed("force_xy_n")?;
    let layers = if rows.iter().any(|row| row.layer_height_mm.is_some()) {
        given_layers(rows, &force)
    } else {
        layers_by_difference(rows, &force)
    };
    let geometry = |layer: &Layer| {
        let c = &layer.row.cut;
        let fz = c.feed_mm_s / (f64::from(c.flutes) * c.rps);
        let (length, chip) = ball_layer(0.5 * c.diameter_mm, layer.middle_mm, c.radial_depth_mm, fz);
        (length, chip * 1e3)
    };
    let known: Vec<(f64, f64)> = layers.iter().map(geometry).collect();
    let column = |k: usize, j: usize| [1.0, known[k].0, known[k].1, known[k].0 * known[k].1][j];
    let problem = Problem {
        names: [("c0", "N/mm"), ("c1", "N/mm²"), ("c2", "N/(mm·µm)"), ("c3", "N/(mm²·µm)")]
            .map(|(n, u)| (n.to_owned(), u.to_owned()))
            .to_vec(),
        positive: vec![false; 4],
        x: DMatrix::from_fn(layers.len(), 4, column),
        y: layers.iter().map(|layer| layer.force_n / layer.thickness_mm).collect(),
        groups: (0..layers.len()).collect(),
    };
    let mut result = solved("layer", &problem, options.loss)?;
    result.notes.push("force per mm of height of a layer is fitted".into());
    Ok(result)
}

/// Force of one layer of a ball end.
struct Layer<'a> {
    row: &'a SteadyRow,
    middle_mm: f64,
    thickness_mm: f64,
    force_n: f64,
}

/// Rows that are layers themselves: `axial_depth_mm` is their thickness.
fn given_layers<'a>(rows: &'a [SteadyRow], force: &[f64]) -> Vec<Layer<'a>> {
    let layer = |(row, force): (&'a SteadyRow, &f64)| {
        let middle_mm = row.layer_height_mm?;
        force.is_finite().then_some(Layer { row, middle_mm, thickness_mm: row.cut.axial_depth_mm, force_n: *force })
    };
    rows.iter().zip(force).filter_map(layer).collect()
}

/// Cuts of growing depth: a layer's force is that of a cut less that of the next shallower one of the same width and
/// feed. A width that comes at fewer than three depths is no series: grooves that make room for the others look like
/// that.
fn layers_by_difference<'a>(rows: &'a [SteadyRow], force: &[f64]) -> Vec<Layer<'a>> {
    let near = |a: f64, b: f64, share: f64| (a - b).abs() <= share * b.abs();
    let alike = |a: &SteadyCut, b: &SteadyCut| {
        near(a.feed_mm_s, b.feed_mm_s, 0.03)
            && near(a.rps, b.rps, 0.03)
            && near(a.radial_depth_mm, b.radial_depth_mm, 0.03)
    };
    let usable = |i: &usize| force[*i].is_finite() && rows[*i].cut.axial_depth_mm > 1e-6;
    let used: Vec<usize> = (0..rows.len()).filter(usable).collect();
    let depth = |i: usize| rows[i].cut.axial_depth_mm;
    let series = |i: usize| used.iter().filter(|j| alike(&rows[**j].cut, &rows[i].cut)).count() >= 3;
    used.iter()
        .filter(|i| series(**i))
        .filter_map(|&i| {
            let shallower = used.iter().filter(|j| alike(&rows[**j].cut, &rows[i].cut) && depth(**j) < depth(i) - 1e-6);
            let below = shallower.max_by(|a, b| depth(**a).total_cmp(&depth(**b))).copied()?;
            Some(Layer {
                row: &rows[i],
                middle_mm: 0.5 * (depth(i) + depth(below)),
                thickness_mm: depth(i) - depth(below),
                force_n: force[i] - force[below],
            })
        })
        .collect()
}
