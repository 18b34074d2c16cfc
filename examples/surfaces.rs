//! Writes the meshes that step-over planning is tried on, as binary STL:
//!
//! ```text
//! cargo run --release --example surfaces -- mould mould.stl
//! ```
//!
//! `mould`: a free-form patch of 80 × 60 mm, 208,000 triangles; slopes to 50°, concave radii from 9 mm. `cylinder`: a quarter
//! of a concave cylinder of 40 mm radius, 60 mm long, from level to 80°. `petal`: a tapered petal-shaped boss and pocket in
//! one: a wall of 30° to the axis whose outline runs round at 20 mm ± 4 mm with six lobes; corners from 8 mm radius, concave and
//! convex.

#![allow(dead_code, clippy::unwrap_used, clippy::print_stdout)]

use std::f64::consts::TAU;

/// Corners of triangles over a grid of two parameters.
pub fn sheet(cells: [usize; 2], at: impl Fn(f64, f64) -> [f64; 3]) -> Vec<[[f64; 3]; 3]> {
    let at = |i: usize, j: usize| at(i as f64 / cells[0] as f64, j as f64 / cells[1] as f64);
    let cell = |k: usize| {
        let (i, j) = (k % cells[0], k / cells[0]);
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    (0..cells[0] * cells[1]).flat_map(cell).collect()
}

/// Height of the free-form patch, mm.
pub fn mould_height(x: f64, y: f64) -> f64 {
    7.0 * (x / 11.0).sin() * (y / 14.0).cos() + 0.004 * (x - 40.0).powi(2) - 0.006 * (y - 30.0).powi(2)
}

/// The free-form patch.
pub fn mould(cells: [usize; 2]) -> Vec<[[f64; 3]; 3]> {
    sheet(cells, |u, v| [80.0 * u, 60.0 * v, mould_height(80.0 * u, 60.0 * v)])
}

/// A concave quarter cylinder along X whose axis lies at Z 0.
pub fn cylinder(cells: [usize; 2], radius: f64) -> Vec<[[f64; 3]; 3]> {
    sheet(cells, |u, v| {
        let slope = (80.0 * v).to_radians();
        [60.0 * u, radius * slope.sin(), -radius * slope.cos()]
    })
}

/// A ring about a boss with six lobes: its wall leans by 30° and runs into a floor.
pub fn petal(cells: [usize; 2]) -> Vec<[[f64; 3]; 3]> {
    sheet(cells, |u, v| {
        let angle = -TAU * u;
        let outline = 20.0 + 4.0 * (6.0 * angle).cos();
        let down = 14.0 * v;
        let radius = outline + down * 30f64.to_radians().tan();
        [radius * angle.cos(), radius * angle.sin(), -down]
    })
}

/// Binary STL.
pub fn stl(triangles: &[[[f64; 3]; 3]]) -> Vec<u8> {
    let mut out = b"surface made by an example of feedwright".to_vec();
    out.resize(80, b' ');
    out.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        out.extend([0u8; 12]);
        out.extend(triangle.iter().flatten().flat_map(|x| (*x as f32).to_le_bytes()));
        out.extend([0u8; 2]);
    }
    out
}

/// A surface by its name.
pub fn named(name: &str) -> Option<Vec<[[f64; 3]; 3]>> {
    match name {
        "mould" => Some(mould([400, 260])),
        "cylinder" => Some(cylinder([60, 400], 40.0)),
        "petal" => Some(petal([900, 100])),
        _ => None,
    }
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [name, path] = words.as_slice() else { panic!("give mould, cylinder or petal, and a file") };
    let triangles = named(name).expect("mould, cylinder or petal");
    std::fs::write(path, stl(&triangles)).unwrap();
    println!("{path}: {} triangles", triangles.len());
}
