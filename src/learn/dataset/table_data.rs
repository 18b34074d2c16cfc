//! A table of steady cuts as data of a diagnosis. In: a table with a spindle reading, or else mean forces or layers of
//! a ball end. Out: [`Data`].
//!
//! Spindle power of a row: tare·P₀(n)/P₀(n₀) + (k_tc Q + k_te A)·1e-3 W, with removal rate Q, contact rate A and the
//! declared tare P₀(n) at speed n (after Xu, Jerard, Fussell, Eq. 3.7); torque: the same over 2πn; load: the same in
//! percent of an unknown rating. The base model has straight paths; curvature is an effect.

use crate::force::closed::{Rates, SteadyCut, rates};
use crate::learn::dataset::samples::{Data, VariantColumns};
use crate::learn::dataset::steady_table::{SteadyRow, measured_quantity, numbered, row_rates, spindle_base, states};
use crate::learn::dataset::{layers, mean_forces};
use crate::learn::log::columns::{DataError, Frame};
use crate::learn::log::quantity::Quantity;
use crate::learn::log::quantity::{column_factor, tare_factor};
use crate::learn::log::signal::readable;
use crate::learn::program::runout_grid::RunoutGrid;
use crate::learn::program::variant::Variant;
use crate::machine::Spindle;

/// Data of a spindle reading, else of mean forces, else of layers of a ball end. `to_shaft` converts a meter reading to
/// the quantity at the motor shaft; the declared tare of `spindle` gives the dependence of the tare on speed.
pub fn data(
    frame: &Frame,
    table: &[SteadyRow],
    to_shaft: impl Fn(f64) -> f64,
    spindle: Option<&Spindle>,
) -> Result<Data, DataError> {
    let measured = measured_quantity(frame);
    if measured.is_err() && frame.numbers("force_x_n").is_some() && frame.numbers("force_y_n").is_some() {
        return mean_forces::data(frame, table);
    }
    if measured.is_err() && frame.numbers("force_xy_n").is_some() {
        return layers::data(frame, table);
    }
    let (name, quantity, unit) = measured?;
    let reading: Vec<f64> = frame.needed(name)?.into_iter().map(to_shaft).collect();
    readable(name, &reading)?;
    if let Some(i) = table.iter().position(|row| quantity == Quantity::Torque && !row.cut.rps.is_finite()) {
        return Err(DataError::Unfit(format!(
            "row {}: spindle_rpm is missing, and a torque is a power over it",
            i + 1
        )));
    }
    let n = table.len();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| table[*a].order.total_cmp(&table[*b].order));
    let state = states(table, &order);
    // If a speed is missing, the tare cannot depend on it.
    let spindle = spindle.filter(|_| state.iter().all(|of| of.rps.is_finite()));
    let tare: Vec<f64> = state.iter().map(|of| tare_factor(quantity, spindle, of.rps, of.reference_rps)).collect();
    let columns_of = |rates_of: &dyn Fn(&SteadyRow) -> Rates| -> Vec<Vec<f64>> {
        let mut columns = vec![tare.clone(), vec![0.0; n], vec![0.0; n]];
        for (i, row) in table.iter().enumerate() {
            let r = rates_of(row);
            let factor = column_factor(quantity, row.cut.rps);
            columns[1][i] = factor * r.removal_rate_mm3_s;
            columns[2][i] = factor * r.contact_rate_mm2_s;
        }
        columns
    };
    let straight = columns_of(&|row| row_rates(row, true));
    let change = |variant, of: &dyn Fn(&SteadyRow) -> Rates, size: f64| VariantColumns {
        variant,
        size,
        columns: difference(&columns_of(of), &straight, size),
    };
    // With rates given by the table those of another path, diameter or stock cannot be computed.
    let variants = if table.iter().all(|row| row.given.is_none()) {
        vec![
            change(Variant::Curved, &|row| row_rates(row, false), 1.0),
            change(Variant::Diameter, &|row| resized(row, 0.05), 0.05),
            change(Variant::StockTop, &|row| deeper(row, 0.05, 0.0), 0.05),
            change(Variant::StockSide, &|row| deeper(row, 0.0, 0.05), 0.05),
        ]
    } else {
        Vec::new()
    };
    let (block, _) = numbered(table.iter().map(|row| row.group.as_str()));
    let (kind, kind_names) = numbered(table.iter().map(|row| row.kind.as_str()));
    let weight = reading.iter().map(|y| if y.is_finite() { 1.0 } else { 0.0 }).collect();
    let single_group = block.iter().all(|b| *b == 0);
    Ok(Data {
        base: spindle_base(quantity, unit),
        columns: straight,
        reading: reading.iter().map(|y| if y.is_finite() { *y } else { 0.0 }).collect(),
        weight,
        state,
        span_s: vec![0.0; n],
        readings_per_sample: Vec::new(),
        line: Vec::new(),
        load_variance: Vec::new(),
        run: (0..n).collect(),
        channel: vec![0; n],
        block: if single_group { (0..n).collect() } else { block },
        kind,
        kind_names,
        channel_names: vec![name.to_owned()],
        variants,
        runouts: RunoutGrid::default(),
        slower: Vec::new(),
        timed_acceleration: None,
        clock_s: 0.0,
    })
}

fn difference(changed: &[Vec<f64>], plain: &[Vec<f64>], size: f64) -> Vec<Vec<f64>> {
    changed.iter().zip(plain).map(|(c, p)| c.iter().zip(p).map(|(c, p)| (c - p) / size).collect()).collect()
}

/// Rates with a tool of larger diameter on the same path: in a wall half of that adds to the radial depth, in a slot
/// all.
fn resized(row: &SteadyRow, by: f64) -> Rates {
    let slot = row.cut.radial_depth_mm >= 0.999 * row.cut.diameter_mm;
    let more = if slot { by } else { 0.5 * by };
    let cut = SteadyCut {
        diameter_mm: row.cut.diameter_mm + by,
        radial_depth_mm: row.cut.radial_depth_mm + more,
        path_radius_mm: None,
        ..row.cut
    };
    rates(&cut)
}

fn deeper(row: &SteadyRow, top: f64, side: f64) -> Rates {
    let slot = row.cut.radial_depth_mm >= 0.999 * row.cut.diameter_mm;
    let cut = SteadyCut {
        axial_depth_mm: row.cut.axial_depth_mm + top,
        radial_depth_mm: row.cut.radial_depth_mm + if slot { 0.0 } else { side },
        path_radius_mm: None,
        ..row.cut
    };
    rates(&cut)
}
