//! Blanks and work offsets in one common frame. In: the job, the toolpath. Out: one [`Blank`] per piece of stock, the shift
//! of each work offset, the cell that fits.

use super::options::{EngageError, Options};
use crate::machine::{Box3, Job, StockShape};
use crate::nc::Toolpath;
use crate::path::Vec3;
use crate::stock::{Blank, field};

/// Bytes a cell of the field takes: height and provenance.
const CELL_BYTES: u64 = 8;
/// Cells an automatic resolution aims not to exceed.
const AUTO_CELLS: f64 = 8e6;

/// Shift of a work offset into the common frame. An origin that is missing is taken as that of the first stock.
pub fn shift(job: &Job, path: &Toolpath, wcs: u16) -> Vec3 {
    let origin = |number: u16| job.machine.offsets.iter().find(|(n, _)| *n == number).map(|(_, origin)| *origin);
    origin(wcs).or_else(|| origin(home_offset(job, path))).unwrap_or_else(Vec3::zeros)
}

/// Work offset of the first stock: its own, else the one of the first motion.
fn home_offset(job: &Job, path: &Toolpath) -> u16 {
    let own = job.stocks.first().and_then(|stock| stock.offset);
    own.or_else(|| path.moves.first().map(|motion| motion.wcs)).unwrap_or(54)
}

/// The blanks in the common frame.
pub fn blanks(job: &Job, path: &Toolpath, _options: &Options) -> Result<Vec<Blank>, EngageError> {
    if job.stocks.is_empty() {
        return Err(EngageError::NoStock);
    }
    job.stocks
        .iter()
        .map(|stock| {
            let by = shift(job, path, stock.offset.unwrap_or_else(|| home_offset(job, path)));
            let blank = match &stock.shape {
                StockShape::Box(extent) => Blank::Box(Box3 { min: extent.min + by, max: extent.max + by }),
                StockShape::Cylinder { centre, diameter_mm, z_mm } => Blank::Cylinder {
                    centre: [centre[0] + by.x, centre[1] + by.y],
                    radius: 0.5 * diameter_mm,
                    z: [z_mm[0] + by.z, z_mm[1] + by.z],
                },
                StockShape::Stl(path) | StockShape::Saved(path) => {
                    return Err(EngageError::StockFile {
                        path: path.display().to_string(),
                        why: "stock from files is not read yet: describe it as a box".into(),
                    });
                }
            };
            let size = blank.extent().max - blank.extent().min;
            let solid = (0..3).all(|axis| size[axis] > 0.0 && size[axis].is_finite());
            solid.then_some(blank).ok_or(EngageError::EmptyStock)
        })
        .collect()
}

/// Cell of the field: as asked for, else a thirtieth of the smallest tool (0.05 to 0.5 mm) within a bounded number of
/// cells.
pub fn cell_mm(job: &Job, options: &Options, blanks: &[Blank], smallest_diameter: f64) -> Result<f64, EngageError> {
    let extents: Vec<Box3> = blanks.iter().map(Blank::extent).collect();
    let area: f64 = extents.iter().map(|e| (e.max.x - e.min.x) * (e.max.y - e.min.y)).sum();
    let automatic = || (smallest_diameter / 30.0).clamp(0.05, 0.5).max((area / AUTO_CELLS).sqrt());
    let cell = options.cell_mm.or(job.cell_mm).unwrap_or_else(automatic);
    if !(cell.is_finite() && cell > 0.0) {
        return Err(EngageError::BadCell(cell));
    }
    if let Some(allowed) = options.max_memory_bytes {
        let needed = memory_bytes(&extents, cell);
        if needed > allowed as f64 {
            let mib = |bytes: f64| (bytes / (1024.0 * 1024.0)).ceil() as u64;
            return Err(EngageError::Memory {
                cell_mm: cell,
                needed_mib: mib(needed),
                allowed_mib: mib(allowed as f64),
                fits_mm: fitting_cell(&extents, cell, allowed as f64),
            });
        }
    }
    Ok(cell)
}

fn memory_bytes(extents: &[Box3], cell_mm: f64) -> f64 {
    let count = |extent: &Box3| {
        let [nx, ny] = field::cells(extent, cell_mm);
        nx as f64 * ny as f64
    };
    extents.iter().map(count).sum::<f64>() * CELL_BYTES as f64 * 1.03
}

/// Smallest cell (to a hundredth of itself) that fits.
fn fitting_cell(extents: &[Box3], too_small: f64, allowed: f64) -> f64 {
    let mut cell = too_small;
    while memory_bytes(extents, cell) > allowed && cell < 1e6 {
        cell *= 1.01;
    }
    cell
}
