//! Drop-cutter on a free-form patch of 208,000 triangles.
//!
//! ```text
//! cargo bench --bench stepover                        points per second for ball, bull-nose and flat end
//! cargo bench --bench stepover -- FOLDER [WIDE]       a patch of WIDE × 0.65 WIDE fields (400); leaves mesh, places and heights there for tests/bench/compare_opencamlib.py
//! ```

#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../examples/surfaces.rs"]
mod surfaces;

use feedwright::finish::stepover::drop::Dropper;
use feedwright::finish::stepover::shape::Shape;
use feedwright::finish::stepover::surface::Surface;
use std::fmt::Write;
use std::time::Instant;

const SHAPES: [(&str, Shape); 3] = [
    ("ball", Shape { flat_mm: 0.0, corner_mm: 3.0 }),
    ("bull", Shape { flat_mm: 2.0, corner_mm: 1.0 }),
    ("flat", Shape { flat_mm: 3.0, corner_mm: 0.0 }),
];

fn main() {
    let mut words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    let wide: usize = words.iter().find_map(|word| word.parse().ok()).unwrap_or(400);
    words.retain(|word| word.parse::<usize>().is_err());
    let folder = words.first();
    let stl = surfaces::stl(&surfaces::mould([wide, wide * 13 / 20]));
    let begin = Instant::now();
    let surface = Surface::read(&stl, 1.0, 1.4).unwrap();
    println!("read      {} triangles in {:.3} s", surface.triangles.len(), begin.elapsed().as_secs_f64());
    let places: Vec<[f64; 2]> =
        (0..1_000_000).map(|k| [80.0 * f64::from(k % 1000) / 999.0, 60.0 * f64::from(k / 1000) / 999.0]).collect();
    for (name, shape) in SHAPES {
        let begin = Instant::now();
        let dropper = Dropper::new(&surface, shape);
        let built = begin.elapsed().as_secs_f64();
        let begin = Instant::now();
        let found = dropper.drop_all(&places);
        let seconds = begin.elapsed().as_secs_f64();
        let rate = 1e-6 * places.len() as f64 / seconds;
        println!(
            "{name}      made ready in {built:.3} s, {rate:.2} million points/s on {} threads",
            rayon::current_num_threads()
        );
        if let Some(folder) = &folder {
            let (radius, corner, count) = (shape.radius_mm(), shape.corner_mm, places.len());
            let mut csv = format!("x,y,tip_mm\n# {name} {radius} {corner} {seconds} {count}\n");
            for (p, contact) in places.iter().zip(&found) {
                let _ = writeln!(csv, "{},{},{}", p[0], p[1], contact.unwrap().tip_mm);
            }
            std::fs::write(format!("{folder}/{name}.csv"), csv).unwrap();
            std::fs::write(format!("{folder}/mould.stl"), &stl).unwrap();
        }
    }
}
