//! Layers of a ball end with their forces. In: rows of a table, the resultant force in the plane of the tool. Out: the
//! layers, as given or as differences of cuts of increasing depth; [`Data`] with the terms of Nishida, Eq. 1, F/Δz = C₀
//! + C₁L + C₂t_m + C₃L t_m, with length of contact L, mm, and largest chip thickness t_m, µm.

use crate::effects::AlongEdge;
use crate::force::closed::{SteadyCut, ball_layer};
use crate::learn::dataset::samples::{Base, Class, Data, UNBOUNDED};
use crate::learn::dataset::steady_table::{SteadyRow, states};
use crate::learn::log::columns::{DataError, Frame};
use crate::learn::program::runout_grid::RunoutGrid;
use std::f64::consts::TAU;

/// The terms of Eq. 1 and their units.
pub const TERMS: [(&str, &str); 4] = [("c0", "N/mm"), ("c1", "N/mm²"), ("c2", "N/(mm·µm)"), ("c3", "N/(mm²·µm)")];

/// Layers of a table.
pub fn layers<'a>(rows: &'a [SteadyRow], force_n: &[f64]) -> Vec<Layer<'a>> {
    if rows.iter().any(|row| row.layer_height_mm.is_some()) {
        given_layers(rows, force_n)
    } else {
        layers_by_difference(rows, force_n)
    }
}

impl Layer<'_> {
    /// 1, L, t_m and L t_m.
    pub fn terms(&self) -> [f64; 4] {
        let c = &self.row.cut;
        let fz = c.feed_mm_s / (f64::from(c.flutes) * c.rps);
        let (length, chip) = ball_layer(0.5 * c.diameter_mm, self.middle_mm, c.radial_depth_mm, fz);
        let chip_um = chip * 1e3;
        [1.0, length, chip_um, length * chip_um]
    }

    /// Radius of the ball at the middle of the layer, mm.
    pub fn radius_mm(&self) -> f64 {
        let ball = 0.5 * self.row.cut.diameter_mm;
        (ball * ball - (ball - self.middle_mm).max(0.0).powi(2)).max(0.0).sqrt()
    }
}

/// Least radius of a layer over that of its ball; `None`: no layers are given.
pub fn least_radius(rows: &[SteadyRow]) -> Option<f64> {
    let given: Vec<Layer> = given_layers(rows, &vec![1.0; rows.len()]);
    given.iter().map(|layer| 2.0 * layer.radius_mm() / layer.row.cut.diameter_mm).min_by(f64::total_cmp)
}

/// Data of a table of layers; the cutting speed is that of the layer.
pub fn data(frame: &Frame, table: &[SteadyRow]) -> Result<Data, DataError> {
    let force = frame.needed("force_xy_n")?;
    let layers = layers(table, &force);
    let n = layers.len();
    let terms: Vec<[f64; 4]> = layers.iter().map(Layer::terms).collect();
    let base = |(k, (name, unit)): (usize, (&str, &str))| Base {
        name: name.into(),
        unit: unit.into(),
        // Terms without chip thickness belong to the edge.
        class: if k < 2 { Class::Edge } else { Class::Cutting },
        prior: None,
        bounds: UNBOUNDED,
    };
    let rows: Vec<SteadyRow> = layers.iter().map(|layer| layer.row.clone()).collect();
    let mut state = states(&rows, &(0..n).collect::<Vec<_>>());
    for ((state, layer), terms) in state.iter_mut().zip(&layers).zip(&terms) {
        state.cutting_speed_mm_s = TAU * layer.radius_mm() * layer.row.cut.rps;
        let half_mm = 0.5 * layer.thickness_mm;
        state.along_edge = AlongEdge::even([layer.middle_mm - half_mm, layer.middle_mm + half_mm]);
        state.chip_thickness_mm = terms[2] / 1e3;
    }
    Ok(Data {
        base: TERMS.into_iter().enumerate().map(base).collect(),
        columns: (0..4).map(|k| terms.iter().map(|row| row[k]).collect()).collect(),
        reading: layers.iter().map(|layer| layer.force_n / layer.thickness_mm).collect(),
        weight: vec![1.0; n],
        state,
        span_s: vec![0.0; n],
        readings_per_sample: Vec::new(),
        line: Vec::new(),
        load_variance: Vec::new(),
        run: (0..n).collect(),
        channel: vec![0; n],
        block: (0..n).collect(),
        kind: vec![0; n],
        kind_names: vec![String::new()],
        channel_names: vec!["force_xy_n per mm of a layer's height".into()],
        variants: Vec::new(),
        runouts: RunoutGrid::default(),
        slower: Vec::new(),
        timed_acceleration: None,
        clock_s: 0.0,
    })
}

/// Force of one layer of a ball end.
pub struct Layer<'a> {
    /// Its cut.
    pub row: &'a SteadyRow,
    /// Height of its middle above the tip, mm.
    pub middle_mm: f64,
    /// Thickness, mm.
    pub thickness_mm: f64,
    /// Resultant in the tool's plane, N.
    pub force_n: f64,
}

/// Rows that are layers themselves: `axial_depth_mm` is their thickness.
fn given_layers<'a>(rows: &'a [SteadyRow], force: &[f64]) -> Vec<Layer<'a>> {
    let layer = |(row, force): (&'a SteadyRow, &f64)| {
        let middle_mm = row.layer_height_mm?;
        force.is_finite().then_some(Layer { row, middle_mm, thickness_mm: row.cut.axial_depth_mm, force_n: *force })
    };
    rows.iter().zip(force).filter_map(layer).collect()
}

/// Cuts of increasing depth: the force of a layer is that of a cut less that of the next shallower one of the same
/// width and feed. Widths with fewer than three depths are skipped: these are the grooves that make room for the test
/// cuts.
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
