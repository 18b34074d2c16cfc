//! In-process stock as a file. In: the field as a program leaves it. Out: bytes for the next program, and from them its
//! blank; a closed STL mesh for people to look at.
//!
//! Layout, little endian: mark, extent (min, max: six f64), cells along X and Y (u64), heights (f32, row by row), SHA-256.

use super::blank::Relief;
use super::field::Field;
use crate::machine::Box3;
use crate::path::Vec3;
use rayon::prelude::*;
use sha2::{Digest, Sha256};

/// First bytes of a saved stock.
pub const MARK: &[u8; 8] = b"FWSTOCK1";
/// First bytes of a mesh.
pub const MESH_MARK: &[u8] = b"stock left by a program, feedwright";
/// Most cells along and across a mesh that is written: 4 triangles a cell.
const MESH_CELLS: usize = 1000;

/// The field as bytes, shifted by `shift` (from the common frame into the stock's own coordinates).
pub fn to_bytes(field: &Field, shift: Vec3) -> Vec<u8> {
    let mut out = Vec::with_capacity(96 + 4 * field.size[0] * field.size[1]);
    out.extend_from_slice(MARK);
    for corner in [field.extent.min + shift, field.extent.max + shift] {
        corner.iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
    }
    field.size.iter().for_each(|n| out.extend_from_slice(&(*n as u64).to_le_bytes()));
    for height in field.rows() {
        out.extend_from_slice(&((f64::from(height) + shift.z) as f32).to_le_bytes());
    }
    let sum: [u8; 32] = Sha256::digest(&out).into();
    out.extend_from_slice(&sum);
    out
}

/// What was saved as bytes, shifted by `shift`, as a blank; `None` when they are no saved stock, cut short or changed.
pub fn from_bytes(bytes: &[u8], shift: Vec3) -> Option<Relief> {
    let (body, sum) = bytes.split_at_checked(bytes.len().checked_sub(32)?)?;
    let whole: [u8; 32] = Sha256::digest(body).into();
    let rest = body.strip_prefix(MARK)?;
    if whole != sum || rest.len() < 64 {
        return None;
    }
    let (head, heights) = rest.split_at(64);
    let words: Vec<[u8; 8]> = head.chunks_exact(8).filter_map(|word| word.try_into().ok()).collect();
    let number = |k: usize| f64::from_le_bytes(words[k]);
    let [nx, ny] = [6, 7].map(|k| u64::from_le_bytes(words[k]) as usize);
    if nx == 0 || ny == 0 || heights.len() != nx.checked_mul(ny)?.checked_mul(4)? {
        return None;
    }
    let corner = |k: usize| Vec3::new(number(k), number(k + 1), number(k + 2)) + shift;
    let extent = Box3 { min: corner(0), max: corner(3) };
    if !(0..3).all(|k| extent.max[k] > extent.min[k]) {
        return None;
    }
    let height = |h: &[u8]| {
        let height = f32::from_le_bytes([h[0], h[1], h[2], h[3]]);
        (f64::from(height) + shift.z).max(extent.min.z) as f32
    };
    let is_finite = |h: &[u8]| f32::from_le_bytes([h[0], h[1], h[2], h[3]]).is_finite();
    let sound = heights.par_chunks_exact(4).with_min_len(MANY).all(is_finite);
    sound.then(|| {
        let heights = heights.par_chunks_exact(4).with_min_len(MANY).map(height).collect();
        Relief::from_rows(extent, [nx, ny], heights)
    })
}

/// Heights read in one go.
const MANY: usize = 1 << 14;

/// The field as a binary STL mesh, closed, shifted by `shift`: its vertices are cell middles (those at the border moved to
/// the border), every few cells where there are too many.
pub fn to_stl(field: &Field, shift: Vec3) -> Vec<u8> {
    let stride = (field.size[0].max(field.size[1])).div_ceil(MESH_CELLS);
    let [xs, ys] = [0, 1].map(|axis| coordinates(field, axis, stride));
    let heights: Vec<f32> = field.rows().collect();
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
