//! Whole programs: volumes against an independent figure, and what the simulation says about them.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

mod engage_common;
use engage_common::*;
use feedwright::machine::Stock;
use std::path::Path;

fn program(name: &str) -> engage_common::Path {
    plain_program(&std::fs::read_to_string(Path::new("../shared/programs").join(name)).unwrap())
}

fn wood(min: [f64; 3], max: [f64; 3]) -> Vec<Stock> {
    vec![block(min, max)]
}

/// An independent brute-force height map at 0.1 mm leaves 39,734 mm³.
#[test]
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn the_bear_leaves_what_brute_force_leaves() {
    let path = program("camotics_bear.nc");
    let job = job(vec![ball(3.175)], wood([0.0, 0.0, -20.0], [80.0, 80.0, 0.0]));
    let begin = std::time::Instant::now();
    let map = run(&path, &job, 0.1, 1.0);
    println!(
        "bear: {:?}, left {:.1}, stations {}, arcs {}",
        begin.elapsed(),
        map.remaining_mm3,
        map.stations.len(),
        map.arcs.len()
    );
    assert!((map.remaining_mm3 - 39_734.0).abs() < 25.0, "{}", map.remaining_mm3);
    let sum: f64 = map.stations.iter().map(|s| f64::from(s.removal_area_mm2) * s.length_mm()).sum();
    assert!((sum / map.removed_mm3 - 1.0).abs() < 0.003, "stations {sum:.1}, cells {:.1}", map.removed_mm3);
}

#[test]
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn the_tiger_is_simulated() {
    let path = program("camotics_tiger.nc");
    let job = job(vec![flat(2.5)], wood([-2.0, -1.0, -32.0], [92.0, 89.0, 0.0]));
    let begin = std::time::Instant::now();
    let map = run(&path, &job, 0.1, 1.0);
    println!(
        "tiger: {:?}, moves {}, left {:.1}, stations {}, arcs {}",
        begin.elapsed(),
        path.toolpath.moves.len(),
        map.remaining_mm3,
        map.stations.len(),
        map.arcs.len()
    );
    let sum: f64 = map.stations.iter().map(|s| f64::from(s.removal_area_mm2) * s.length_mm()).sum();
    assert!((sum / map.removed_mm3 - 1.0).abs() < 0.005, "stations {sum:.1}, cells {:.1}", map.removed_mm3);
}
