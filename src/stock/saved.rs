//! Stock between two programs as a file. In: a piece of stock as a program leaves it. Out: bytes for the next program, and from them the same
//! piece; also a closed STL mesh for people to look at.
//!
//! Layout, little endian: mark; the blank (kind, numbers; the grid, if it is heights over a grid); the outlines of the cutters; the cuts whose
//! surfaces are left (outline, joined, kind, numbers); if there are any, the field: cells along X and Y, heights (f32) and cuts that last
//! lowered them (u32), row by row; SHA-256.

use super::blank::{Blank, Relief};
use super::element::Track;
use super::field::{Field, UNTOUCHED};
use super::form::Form;
use super::piece::{Cut, Piece};
use crate::bytes::{Reader, count, numbers, seal, unsealed};
use crate::machine::{Box3, Profile, Segment};
use crate::path::Vec3;

/// First bytes of a saved stock.
pub const MARK: &[u8; 8] = b"FWSTOCK2";
/// First bytes of a saved stock of any version.
pub const FAMILY: &[u8] = b"FWSTOCK";
/// First bytes of a mesh.
pub const MESH_MARK: &[u8] = b"stock left by a program, feedwright";
/// Most cells along and across a mesh that is written: 4 triangles a cell.
const MESH_CELLS: usize = 1000;

/// The piece as bytes, shifted by `shift` (from the common frame into the stock's own coordinates).
pub fn to_bytes(piece: &Piece, shift: Vec3) -> Vec<u8> {
    let field = &piece.field;
    let mut out = Vec::with_capacity(256 + 56 * piece.cuts.len() + 8 * field.size[0] * field.size[1]);
    out.extend_from_slice(MARK);
    put_blank(&mut out, &piece.blank.clone().moved(shift));
    count(&mut out, piece.forms.len());
    for form in &piece.forms {
        count(&mut out, form.profile.segments.len());
        form.profile.segments.iter().for_each(|segment| put_segment(&mut out, segment));
    }
    count(&mut out, piece.cuts.len());
    for cut in &piece.cuts {
        out.extend_from_slice(&cut.form.to_le_bytes());
        out.push(u8::from(cut.joined));
        put_track(&mut out, &cut.track.moved(shift));
    }
    if !piece.cuts.is_empty() {
        field.size.iter().for_each(|n| count(&mut out, *n));
        let moved = |height: f32| (f64::from(height) + shift.z) as f32;
        field.by_row(|tile| &tile.heights).iter().for_each(|height| out.extend(moved(*height).to_le_bytes()));
        field.by_row(|tile| &tile.ids).iter().for_each(|id| out.extend(id.to_le_bytes()));
    }
    seal(&mut out);
    out
}

fn put_blank(out: &mut Vec<u8>, blank: &Blank) {
    let corners = |of: &Box3| [of.min.x, of.min.y, of.min.z, of.max.x, of.max.y, of.max.z];
    match blank {
        Blank::Box(extent) => {
            out.push(0);
            numbers(out, &corners(extent));
        }
        Blank::Cylinder { centre, radius, z } => {
            out.push(1);
            numbers(out, &[centre[0], centre[1], *radius, z[0], z[1]]);
        }
        Blank::Heights(relief) => {
            out.push(if relief.has_walls() { 3 } else { 2 });
            numbers(out, &corners(&relief.extent));
            relief.size.iter().for_each(|n| count(out, *n));
            relief.heights.iter().for_each(|height| out.extend(height.to_le_bytes()));
        }
    }
}

fn put_segment(out: &mut Vec<u8>, segment: &Segment) {
    match segment {
        Segment::Line { from, to } => {
            out.push(0);
            numbers(out, &[from[0], from[1], to[0], to[1]]);
        }
        Segment::Arc { centre, radius, from_rad, to_rad } => {
            out.push(1);
            numbers(out, &[centre[0], centre[1], *radius, *from_rad, *to_rad]);
        }
    }
}

fn put_track(out: &mut Vec<u8>, track: &Track) {
    match track {
        Track::Line { from, to } => {
            out.push(0);
            numbers(out, &[from.x, from.y, from.z, to.x, to.y, to.z]);
        }
        Track::Arc { centre, z, radius, start, sweep } => {
            out.push(1);
            numbers(out, &[centre[0], centre[1], *z, radius[0], radius[1], *start, *sweep]);
        }
    }
}

/// The piece saved in these bytes, shifted by `shift`; `None` if they are not saved stock, are incomplete or were changed.
pub fn from_bytes(bytes: &[u8], shift: Vec3) -> Option<Piece> {
    let mut reader = unsealed(bytes, MARK)?;
    let blank = blank(&mut reader)?.moved(shift);
    let extent = blank.extent();
    let solid = (0..3).all(|k| extent.max[k] > extent.min[k]);
    let forms: Vec<Form> = reader.list(|r| Some(Form::new(&Profile { segments: r.list(segment)? })))?;
    let cuts = reader.list(|r| Some(Cut { form: r.u16()?, joined: r.u8()? != 0, track: track(r)?.moved(shift) }))?;
    let known = cuts.iter().all(|cut| usize::from(cut.form) < forms.len());
    if !(solid && known) {
        return None;
    }
    if cuts.is_empty() {
        let field = match &blank {
            Blank::Heights(relief) => blank.field(relief.cell[0].max(relief.cell[1])),
            _ => blank.field(f64::INFINITY),
        };
        return Some(Piece { blank, field, cuts, forms });
    }
    let size = [reader.u64()?, reader.u64()?];
    let heights = heights(&mut reader, size)?;
    let ids: Vec<u32> = four_by_four(reader.take(4 * heights.len())?, u32::from_le_bytes).collect();
    let known = |id: &u32| *id == UNTOUCHED || (*id as usize) < cuts.len();
    let at = |i: usize, j: usize| (f64::from(heights[j * size[0] + i]) + shift.z, ids[j * size[0] + i]);
    ids.iter().all(known).then(|| Piece { field: Field::from_cells(extent, size, at), blank, cuts, forms })
}

fn blank(reader: &mut Reader) -> Option<Blank> {
    let extent = |r: &mut Reader| {
        let [a, b, c, d, e, f] = r.f64s()?;
        Some(Box3 { min: Vec3::new(a, b, c), max: Vec3::new(d, e, f) })
    };
    match reader.u8()? {
        0 => Some(Blank::Box(extent(reader)?)),
        1 => {
            let [x, y, radius, low, high] = reader.f64s()?;
            Some(Blank::Cylinder { centre: [x, y], radius, z: [low, high] })
        }
        kind @ (2 | 3) => {
            let extent = extent(reader)?;
            let size = [reader.u64()?, reader.u64()?];
            let relief = Relief::from_rows(extent, size, heights(reader, size)?);
            Some(Blank::Heights(Box::new(if kind == 3 { relief.with_walls() } else { relief })))
        }
        _ => None,
    }
}

/// The heights of `size` cells, finite.
fn heights(reader: &mut Reader, size: [usize; 2]) -> Option<Vec<f32>> {
    let bytes = reader.take(size[0].checked_mul(size[1])?.checked_mul(4)?)?;
    let heights: Vec<f32> = four_by_four(bytes, f32::from_le_bytes).collect();
    (!heights.is_empty() && heights.iter().all(|height| height.is_finite())).then_some(heights)
}

fn four_by_four<T>(bytes: &[u8], number: impl Fn([u8; 4]) -> T) -> impl Iterator<Item = T> {
    bytes.chunks_exact(4).map(move |b| number([b[0], b[1], b[2], b[3]]))
}

fn segment(reader: &mut Reader) -> Option<Segment> {
    if reader.u8()? == 0 {
        let [r0, z0, r1, z1] = reader.f64s()?;
        return Some(Segment::Line { from: [r0, z0], to: [r1, z1] });
    }
    let [r, z, radius, from_rad, to_rad] = reader.f64s()?;
    Some(Segment::Arc { centre: [r, z], radius, from_rad, to_rad })
}

fn track(reader: &mut Reader) -> Option<Track> {
    if reader.u8()? == 0 {
        let [x, y, z, u, v, w] = reader.f64s()?;
        return Some(Track::Line { from: Vec3::new(x, y, z), to: Vec3::new(u, v, w) });
    }
    let [x, y, z, r0, r1, start, sweep] = reader.f64s()?;
    Some(Track::Arc { centre: [x, y], z, radius: [r0, r1], start, sweep })
}

/// The field as a binary STL mesh, closed, shifted by `shift`: its vertices are cell middles (those at the border moved to
/// the border), every few cells where there are too many.
pub fn to_stl(field: &Field, shift: Vec3) -> Vec<u8> {
    let stride = (field.size[0].max(field.size[1])).div_ceil(MESH_CELLS);
    let [xs, ys] = [0, 1].map(|axis| coordinates(field, axis, stride));
    let heights: Vec<f32> = field.by_row(|tile| &tile.heights);
    let top = |i: usize, j: usize| {
        let ((x, column), (y, row)) = (xs[i], ys[j]);
        Vec3::new(x, y, f64::from(heights[row * field.size[0] + column])) + shift
    };
    let bottom = |i: usize, j: usize| Vec3::new(xs[i].0, ys[j].0, field.extent.min.z) + shift;
    let (nx, ny) = (xs.len(), ys.len());
    let mut triangles: Vec<[Vec3; 3]> = Vec::with_capacity(4 * nx * ny + 4 * (nx + ny));
    let mut quad = |a: Vec3, b: Vec3, c: Vec3, d: Vec3| triangles.extend([[a, b, c], [a, c, d]]);
    for j in 0..ny - 1 {
        for i in 0..nx - 1 {
            quad(top(i, j), top(i + 1, j), top(i + 1, j + 1), top(i, j + 1));
            quad(bottom(i, j), bottom(i, j + 1), bottom(i + 1, j + 1), bottom(i + 1, j));
        }
        quad(bottom(0, j), top(0, j), top(0, j + 1), bottom(0, j + 1));
        quad(bottom(nx - 1, j), bottom(nx - 1, j + 1), top(nx - 1, j + 1), top(nx - 1, j));
    }
    for i in 0..nx - 1 {
        quad(bottom(i, 0), bottom(i + 1, 0), top(i + 1, 0), top(i, 0));
        quad(bottom(i, ny - 1), top(i, ny - 1), top(i + 1, ny - 1), bottom(i + 1, ny - 1));
    }
    binary_stl(&triangles)
}

/// Coordinates of the mesh along an axis, each with its cell; at least two.
fn coordinates(field: &Field, axis: usize, stride: usize) -> Vec<(f64, usize)> {
    let n = field.size[axis];
    let mut list: Vec<(f64, usize)> =
        (0..n).step_by(stride).map(|k| (field.extent.min[axis] + (k as f64 + 0.5) * field.cell[axis], k)).collect();
    list[0].0 = field.extent.min[axis];
    if list.len() > 1 {
        list.pop();
    }
    list.push((field.extent.max[axis], n - 1));
    list
}

fn binary_stl(triangles: &[[Vec3; 3]]) -> Vec<u8> {
    let mut out = vec![0u8; 80];
    out[..MESH_MARK.len()].copy_from_slice(MESH_MARK);
    out.reserve(4 + 50 * triangles.len());
    out.extend_from_slice(&(triangles.len() as u32).to_le_bytes());
    for [a, b, c] in triangles {
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(Vec3::zeros);
        for p in [&normal, a, b, c] {
            p.iter().for_each(|x| out.extend_from_slice(&(*x as f32).to_le_bytes()));
        }
        out.extend_from_slice(&[0, 0]);
    }
    out
}
