//! Tables of mean forces as data of a diagnosis. Every cut gives two samples, F_x along the feed and F_y into the wall,
//! with the columns of k_tc, k_rc, k_te, k_re ([`crate::force::closed::mean_force_factors`]; Niu, Wang, Zhao, Huang,
//! Eqs 2–3). Readings and columns are divided by the magnitude of the reading, but no less than a tenth of the
//! resultant, so that errors are relative as in the calibration.

use crate::force::closed::mean_force_factors;
use crate::learn::dataset::samples::{Base, Class, Data, UNBOUNDED};
use crate::learn::dataset::steady_table::{SteadyRow, needs_geometry, numbered, states};
use crate::learn::log::columns::{DataError, Frame};
use crate::learn::log::signal::readable;
use crate::learn::program::runout_grid::RunoutGrid;

/// Data of a table of mean forces.
pub fn data(frame: &Frame, table: &[SteadyRow]) -> Result<Data, DataError> {
    let forces = [frame.needed("force_x_n")?, frame.needed("force_y_n")?];
    table.iter().enumerate().try_for_each(|(i, row)| needs_geometry(row, i, frame))?;
    readable("force_x_n", &forces[0])?;
    readable("force_y_n", &forces[1])?;
    let samples: Vec<(usize, usize)> = (0..table.len()).flat_map(|i| [(i, 0), (i, 1)]).collect();
    let base = |name: &str, unit: &str, class| Base {
        name: name.into(),
        unit: unit.into(),
        class,
        prior: None,
        bounds: UNBOUNDED,
    };
    let force: Vec<f64> = samples.iter().map(|(i, axis)| forces[*axis][*i]).collect();
    let known = |y: &f64| y.is_finite() && *y != 0.0;
    let relative = |((i, axis), y): (&(usize, usize), &f64)| {
        let size = if known(y) { relative_to(*y, [forces[0][*i], forces[1][*i]]) } else { 1.0 };
        mean_force_factors(&table[*i].cut, table[*i].is_conventional(), *axis == 1).map(|column| column / size)
    };
    let reading = samples
        .iter()
        .zip(&force)
        .map(|((i, _), y)| if known(y) { y / relative_to(*y, [forces[0][*i], forces[1][*i]]) } else { 0.0 });
    let reading: Vec<f64> = reading.collect();
    let columns: Vec<[f64; 4]> = samples.iter().zip(&force).map(relative).collect();
    let (group, _) = numbered(table.iter().map(|row| row.group.as_str()));
    let (kind, kind_names) = numbered(table.iter().map(|row| row.kind.as_str()));
    let single_group = group.iter().all(|g| *g == 0);
    let mut order: Vec<usize> = (0..table.len()).collect();
    order.sort_by(|a, b| table[*a].order.total_cmp(&table[*b].order));
    let state = states(table, &order);
    Ok(Data {
        base: vec![
            base("k_tc", "N/mm²", Class::Cutting),
            base("k_rc", "N/mm²", Class::Cutting),
            base("k_te", "N/mm", Class::Edge),
            base("k_re", "N/mm", Class::Edge),
        ],
        columns: (0..4).map(|b| columns.iter().map(|c| c[b]).collect()).collect(),
        weight: force.iter().map(|y| if known(y) { 1.0 } else { 0.0 }).collect(),
        reading,
        state: samples.iter().map(|(i, _)| state[*i]).collect(),
        span_s: vec![0.0; samples.len()],
        readings_per_sample: Vec::new(),
        line: Vec::new(),
        load_variance: Vec::new(),
        run: (0..samples.len()).collect(),
        channel: vec![0; samples.len()],
        block: samples.iter().map(|(i, _)| if single_group { *i } else { group[*i] }).collect(),
        kind: samples.iter().map(|(i, _)| kind[*i]).collect(),
        kind_names,
        channel_names: vec!["mean force, relative".into()],
        variants: Vec::new(),
        runouts: RunoutGrid::default(),
        slower: Vec::new(),
        timed_acceleration: None,
        clock_s: 0.0,
    })
}

/// Scale of the relative error of a force component, N: its magnitude, but no less than a tenth of the resultant.
pub fn relative_to(component_n: f64, forces_n: [f64; 2]) -> f64 {
    component_n.abs().max(0.1 * forces_n[0].hypot(forces_n[1])).max(1e-6)
}
