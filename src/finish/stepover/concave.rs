//! Where the surface bends towards the tool, and whether the tool fits there. In: a surface, the tool made ready for
//! it. Out: how many facets lie in hollows, and in how many of them the tool cannot touch the facet's middle.
//!
//! Two facets whose middles are a distance l apart and whose normals open by an angle β bend with the radius l/β; a
//! hollow has one of less than [`GENTLE`] tool radii. The tool touches a middle m with the normal n if, lowered at m +
//! (a/sin θ + r)·n seen from above, it is held no higher than there.

use super::drop::Dropper;
use super::surface::{STEEP, Surface};
use crate::path::Vec3;
use rayon::prelude::*;
use std::collections::HashMap;

/// Hollows of more tool radii than this are as good as flat.
const GENTLE: f64 = 10.0;

/// Facets in hollows, and those of them that the tool does not reach within `tolerance_mm`.
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
