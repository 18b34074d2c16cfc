//! Concave places of a surface, and whether the tool fits into them. In: a surface, its drop-cutter. Out: number of
//! facets in concave places, and of those whose centroid the tool cannot touch.
//!
//! Two neighbouring facets with centroids l apart and an angle β between their normals have the radius of curvature
//! l/β; concave places with less than [`GENTLE`] tool radii count. The tool touches a centroid m with normal n if,
//! dropped at the horizontal position of m + (a/sin θ + r)·n (θ: slope), it rests no higher than on m.

use super::drop::Dropper;
use super::surface::{STEEP, Surface};
use crate::path::Vec3;
use rayon::prelude::*;
use std::collections::HashMap;

/// Concave radius, in tool radii, above which a place counts as flat. Judgement.
const GENTLE: f64 = 10.0;

/// Number of facets in concave places, and of those that the tool does not reach within `tolerance_mm`.
pub fn concave_facets(surface: &Surface, dropper: &Dropper, tolerance_mm: f64) -> (usize, usize) {
    let shape = dropper.shape();
    let middle = |k: u32| surface.triangles[k as usize].iter().sum::<Vec3>() / 3.0;
    let normal = |k: u32| {
        let [a, b, c] = surface.triangles[k as usize];
        (b - a).cross(&(c - a)).normalize()
    };
    let machined = |k: &u32| surface.marks[*k as usize] & STEEP == 0;
    let mut hollow: Vec<u32> = Vec::new();
    for (a, b) in neighbours(surface) {
        if !(machined(&a) && machined(&b)) {
            continue;
        }
        let apart = middle(b) - middle(a);
        let angle = normal(a).cross(&normal(b)).norm();
        let opens = apart.dot(&normal(a)) > 0.0 && apart.dot(&normal(b)) < 0.0;
        if opens && apart.norm() < angle * GENTLE * shape.radius_mm() {
            hollow.extend([a, b]);
        }
    }
    hollow.sort_unstable();
    hollow.dedup();
    let touches = |k: &u32| {
        let (m, n) = (middle(*k), normal(*k));
        let level = n.xy().norm();
        let out = if level > 1e-9 { shape.flat_mm / level + shape.corner_mm } else { 0.0 };
        let tip = m.z - shape.corner_mm * (1.0 - n.z);
        dropper.drop([m.x + out * n.x, m.y + out * n.y]).is_none_or(|contact| contact.tip_mm <= tip + tolerance_mm)
    };
    let reached = hollow.par_iter().filter(|k| touches(k)).count();
    (hollow.len(), hollow.len() - reached)
}

/// Triangles that share an edge.
fn neighbours(surface: &Surface) -> Vec<(u32, u32)> {
    let key = |p: &Vec3| [p.x, p.y, p.z].map(|x| (x + 0.0).to_bits());
    let mut open: HashMap<([u64; 3], [u64; 3]), u32> = HashMap::with_capacity(2 * surface.triangles.len());
    let mut pairs = Vec::new();
    for (index, triangle) in surface.triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (key(&triangle[k]), key(&triangle[(k + 1) % 3]));
            let edge = if a < b { (a, b) } else { (b, a) };
            match open.remove(&edge) {
                Some(other) => pairs.push((other, index as u32)),
                None => {
                    open.insert(edge, index as u32);
                }
            }
        }
    }
    pairs
}
