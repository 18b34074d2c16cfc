//! Stock and work offsets in one common frame. In: the job, the toolpath. Out: the pieces of stock, the shift of each work
//! offset, the cell that fits.

use super::options::{EngageError, Options};
use crate::ids::MoveId;
use crate::machine::{Box3, Job, Stock, StockShape};
use crate::nc::Toolpath;
use crate::path::Vec3;
use crate::stock::{Blank, Cut, Element, Field, Form, Mesh, Piece, field, read_stl, saved};
use std::path::Path;

/// Bytes a cell of the field takes: height and provenance.
const CELL_BYTES: u64 = 8;
/// Cells an automatic resolution aims not to exceed.
const AUTO_CELLS: f64 = 8e6;

/// Shift of a work offset into the common frame, mm. An offset without an origin counts as that of the first stock.
pub fn shift(job: &Job, path: &Toolpath, wcs: u16) -> Vec3 {
    let origin = |number: u16| job.machine.offsets.iter().find(|(n, _)| *n == number).map(|(_, origin)| *origin);
    origin(wcs).or_else(|| origin(home_offset(job, path))).unwrap_or_else(Vec3::zeros)
}

/// Work offset of the first stock: its own, else the one of the first motion.
fn home_offset(job: &Job, path: &Toolpath) -> u16 {
    let own = job.stocks.first().and_then(|stock| stock.offset);
    own.or_else(|| path.moves.first().map(|motion| motion.wcs)).unwrap_or(54)
}

/// Shift of a piece of stock from its own coordinates into the common frame.
pub fn stock_shift(job: &Job, path: &Toolpath, stock: &Stock) -> Vec3 {
    shift(job, path, stock.offset.unwrap_or_else(|| home_offset(job, path))) + stock.moved_mm
}

/// Reads the pieces of stock, and gives their extents in the common frame.
pub fn sources(
    job: &Job,
    path: &Toolpath,
    options: &Options,
    notes: &mut Vec<String>,
) -> Result<Vec<Source>, EngageError> {
    if job.stocks.is_empty() {
        return Err(EngageError::NoStock);
    }
    job.stocks.iter().map(|stock| source(stock, stock_shift(job, path, stock), options, notes)).collect()
}

/// A piece of stock before the resolution is known.
pub enum Source {
    /// A box or a cylinder.
    Blank(Blank),
    /// What an earlier program left.
    Saved(Box<Piece>),
    /// A mesh and the name of its file.
    Mesh(Mesh, String),
}

impl Source {
    /// What it fits in, in the common frame.
    pub fn extent(&self) -> Box3 {
        match self {
            Source::Blank(blank) => blank.extent(),
            Source::Saved(piece) => piece.field.extent,
            Source::Mesh(mesh, _) => mesh.extent(),
        }
    }
}

fn source(stock: &Stock, by: Vec3, options: &Options, notes: &mut Vec<String>) -> Result<Source, EngageError> {
    let source = match &stock.shape {
        StockShape::Box(extent) => Source::Blank(Blank::Box(*extent).moved(by)),
        StockShape::Cylinder { centre, diameter_mm, z_mm } => {
            Source::Blank(Blank::Cylinder { centre: *centre, radius: 0.5 * diameter_mm, z: *z_mm }.moved(by))
        }
        StockShape::Stl(file) => {
            let (mesh, repaired) = read_stl(&read(file, options)?).map_err(|why| stock_file(file, &why.to_string()))?;
            notes.extend(repaired.into_iter().map(|note| format!("{}: {note}", file.display())));
            Source::Mesh(mesh.shifted(by), file.display().to_string())
        }
        StockShape::Saved(file) => {
            let bytes = read(file, options)?;
            let why = if bytes.starts_with(saved::FAMILY) && !bytes.starts_with(saved::MARK) {
                "another version saved it: run the earlier program again with --save-stock"
            } else {
                "it is no stock saved by this program, or was cut short: save it again, or describe it as a box"
            };
            Source::Saved(Box::new(saved::from_bytes(&bytes, by).ok_or_else(|| stock_file(file, why))?))
        }
    };
    let size = source.extent().max - source.extent().min;
    let solid = (0..3).all(|axis| size[axis] > 0.0 && size[axis].is_finite());
    if solid { Ok(source) } else { Err(EngageError::EmptyStock) }
}

fn read(file: &Path, options: &Options) -> Result<Vec<u8>, EngageError> {
    let load = options.loader.ok_or_else(|| stock_file(file, "nothing here can read files"))?;
    load(file).map_err(|error| stock_file(file, &error.to_string()))
}

fn stock_file(file: &Path, why: &str) -> EngageError {
    EngageError::StockFile { path: file.display().to_string(), why: why.to_owned() }
}

/// The pieces of stock in cells of at most `cell_mm`.
pub fn pieces(sources: Vec<Source>, cell_mm: f64, notes: &mut Vec<String>) -> Result<Vec<Piece>, EngageError> {
    sources
        .into_iter()
        .map(|source| match source {
            Source::Blank(blank) => Ok(Piece::uncut(blank, cell_mm)),
            Source::Saved(piece) => Ok(piece.in_cells(cell_mm)),
            Source::Mesh(mesh, file) => {
                let mut said = Vec::new();
                let field = mesh.field(cell_mm, &mut said);
                notes.extend(said.into_iter().map(|note| format!("{file}: {note}")));
                let field = field.map_err(|why| EngageError::StockFile { path: file, why: why.to_string() })?;
                Ok(Piece::of_relief(mesh.relief(cell_mm), field))
            }
        })
        .collect()
}

/// The cuts of earlier programs as elements before all others.
pub(super) struct Earlier {
    /// The elements.
    pub elements: Vec<Element>,
    /// The outlines of their cutters.
    pub forms: Vec<Form>,
}

impl Earlier {
    /// Collects the earlier cuts of all pieces of stock, with the blanks and fields of these. `cutters`: number of cutters of the program.
    pub fn of(pieces: Vec<Piece>, cutters: usize) -> (Self, Vec<Blank>, Vec<Field>) {
        let mut earlier = Self { elements: Vec::new(), forms: Vec::new() };
        let (mut blanks, mut fields) = (Vec::new(), Vec::new());
        for Piece { blank, mut field, cuts, forms } in pieces {
            let (first, first_form) = (earlier.elements.len() as u32, cutters + earlier.forms.len());
            if first > 0 {
                field.renumber(|id| id + first);
            }
            earlier.elements.extend(cuts.into_iter().map(|Cut { track, form, joined }| {
                let cutter = (first_form + usize::from(form)) as u16;
                Element { track, from_mm: 0.0, move_id: MoveId::BEFORE, cutter, joined }
            }));
            earlier.forms.extend(forms);
            blanks.push(blank);
            fields.push(field);
        }
        (earlier, blanks, fields)
    }
}

/// Cell of the field, mm: as the setup says, else a thirtieth of the smallest tool's diameter (0.05 to 0.5 mm), larger where there would be
/// too many cells.
pub fn cell_mm(job: &Job, options: &Options, sources: &[Source], smallest_diameter: f64) -> Result<f64, EngageError> {
    let extents: Vec<Box3> = sources.iter().map(Source::extent).collect();
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
    // As it will be printed.
    (cell * 1e3).ceil() * 1e-3
}
