//! Whole-program benchmarks of the engagement stage: moves/s, stations/s, swept cells/s, engaged slices a station, peak
//! memory. `cargo bench --bench engage -- [finishing|roughing|scaling|handed|bear] [blocks]`.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "../tests/engage_common/mod.rs"]
mod engage_common;
use engage_common::{Path, ball, block, flat, job, plain_program};
use feedwright::engage::cache::{from_bytes, key, to_bytes};
use feedwright::engage::{EngagementMap, Options, engage, engage_and_keep};
use feedwright::machine::{Box3, Job, StockShape};
use feedwright::path::Vec3;
use feedwright::stock::{Field, Piece, Relief, saved};
use std::time::Instant;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    let wanted = |name: &str| words.is_empty() || words.iter().any(|word| word == name);
    let blocks = words.iter().find_map(|word| word.parse::<usize>().ok());
    if wanted("roughing") {
        roughing(blocks.unwrap_or(20_000));
    }
    if wanted("finishing") {
        finishing(blocks.unwrap_or(1_000_000));
    }
    if wanted("scaling") {
        for blocks in [10_000, 30_000, 100_000] {
            finishing(blocks);
        }
    }
    if wanted("handed") {
        handed_on(blocks.unwrap_or(100_000));
    }
    if wanted("bear") {
        bear();
    }
}

/// A 6 mm ball on a wavy surface, 0.24 mm blocks, rows 0.25 mm apart, 0.3 mm of stock over it, 0.1 mm cells, stock of
/// 300 × 200 mm: heights over a grid, read from a file.
fn finishing(blocks: usize) {
    let per_row = 1250;
    let rows = blocks.div_ceil(per_row);
    let step = 0.24;
    let pitch = (200.0 / rows as f64).min(0.3);
    let surface = |x: f64, y: f64| -8.0 + 3.0 * (x * 0.05).sin() * (y * 0.04).cos();
    let mut path = Path::from([0.0, 0.0, 5.0]);
    let mut made = 0;
    for row in 0..rows {
        let y = row as f64 * pitch;
        for k in 0..=per_row {
            if made >= blocks {
                break;
            }
            let x = if row % 2 == 0 { k as f64 * step } else { (per_row - k) as f64 * step };
            path.line([x, y, surface(x, y)]);
            made += 1;
        }
    }
    let extent = Box3 { min: Vec3::new(0.0, 0.0, -20.0), max: Vec3::new(300.0, 200.0, -4.0) };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("roughed.stock");
    let left = Field::new(extent, 0.1, |x, y| surface(x, y) + 0.3);
    std::fs::write(&file, saved::to_bytes(&Piece::of_relief(Relief::new(&left), left), Vec3::zeros())).unwrap();
    let mut job = job(vec![ball(6.0)], vec![block([0.0; 3], [1.0; 3])]);
    job.stocks[0].shape = StockShape::Saved(file);
    let load = |path: &std::path::Path| std::fs::read(path);
    let options = Options { cell_mm: Some(0.1), loader: Some(&load), ..Options::default() };
    measure(&format!("finishing {blocks} blocks"), &path, &job, &options);
}

/// The wavy surface finished in the stock of 300 × 200 mm that a program before left, by its cuts: the same ball in rows
/// 1 mm apart and 0.3 mm above.
fn handed_on(blocks: usize) {
    let step = 0.24;
    let surface = |x: f64, y: f64| -8.0 + 3.0 * (x * 0.05).sin() * (y * 0.04).cos();
    let rows = |pitch: f64, above: f64, most: usize| {
        let mut path = Path::from([0.0, 0.0, 5.0]);
        let place = |k: usize| (k / 1250, if (k / 1250).is_multiple_of(2) { k % 1250 } else { 1249 - k % 1250 });
        for (row, column) in (0..most).map(place) {
            let (x, y) = (column as f64 * step, row as f64 * pitch);
            if y <= 200.0 {
                path.line([x, y, surface(x, y) + above]);
            }
        }
        path
    };
    let mut job = job(vec![ball(6.0)], vec![block([0.0, 0.0, -20.0], [300.0, 200.0, -4.0])]);
    let options = Options { cell_mm: Some(0.1), ..Options::default() };
    let (_, pieces) = engage_and_keep(&rows(1.0, 0.3, 250_000).toolpath, &job, &options, &|_| {}).unwrap();
    let begin = Instant::now();
    let bytes = saved::to_bytes(&pieces[0], Vec3::zeros());
    println!(
        "stock: {} cuts, {:.1} MiB, {:.3} s to bytes",
        pieces[0].cuts.len(),
        bytes.len() as f64 / 1048576.0,
        begin.elapsed().as_secs_f64()
    );
    job.stocks[0].shape = StockShape::Saved("before.stock".into());
    let load = |_: &std::path::Path| Ok(bytes.clone());
    let options = Options { loader: Some(&load), ..options };
    measure(&format!("finishing {blocks} blocks of what a program left"), &rows(0.25, 0.0, blocks), &job, &options);
}

/// Square spirals of a 10 mm flat mill in layers of 2 mm, 150 × 100 × 50 mm.
fn roughing(blocks: usize) {
    let mut path = Path::from([0.0, 0.0, 10.0]);
    let mut made = 0;
    'layers: for layer in 1..=25 {
        let z = -2.0 * layer as f64;
        // Over the part to where the next layer begins: a line at feed would cut a ramp through what stands.
        path.rapid([150.0, 96.0, 5.0]).rapid([0.0, 0.0, 5.0]);
        // Serpentine rows cut into blocks of a few millimetres, with arcs at their ends.
        for row in 0..25 {
            let y = 4.0 * row as f64;
            let (from, to) = if row % 2 == 0 { (0.0, 150.0) } else { (150.0, 0.0) };
            path.line([from, y, z]);
            let count = blocks / 25 / 25;
            for k in 1..=count {
                path.line([from + (to - from) * k as f64 / count as f64, y, z]);
                made += 1;
                if made >= blocks {
                    break 'layers;
                }
            }
        }
    }
    let job = job(vec![flat(10.0)], vec![block([0.0, 0.0, -50.0], [150.0, 100.0, 0.0])]);
    let options = Options { cell_mm: Some(0.2), ..Options::default() };
    measure(&format!("roughing {blocks} blocks"), &path, &job, &options);
}

fn bear() {
    let Ok(text) = std::fs::read_to_string("../shared/programs/camotics_bear.nc") else {
        println!("bear: skipped, ../shared is not present");
        return;
    };
    let job = job(vec![ball(3.175)], vec![block([0.0, 0.0, -20.0], [80.0, 80.0, 0.0])]);
    for cell in [0.1, 0.2] {
        measure("bear", &plain_program(&text), &job, &Options { cell_mm: Some(cell), ..Options::default() });
    }
}

fn measure(name: &str, path: &Path, job: &Job, options: &Options) {
    let (begin, cpu) = (Instant::now(), cpu_s());
    let map = engage(&path.toolpath, job, options, &|_| {}).unwrap();
    let cell = map.cell_mm;
    let seconds = begin.elapsed().as_secs_f64();
    let cpu = cpu_s() - cpu;
    let moves = path.toolpath.moves.len() as f64;
    println!(
        "{name}, cell {cell}: {seconds:.2} s wall, {cpu:.2} s of processor, {:.0} moves/s, {:.0} stations/s, {:.1} M swept cells/s, {:.1} arcs a cutting station, peak {:.0} MiB, removed {:.1} mm³",
        moves / seconds,
        map.stations.len() as f64 / seconds,
        swept_cells(path, job, cell) / seconds / 1e6,
        arcs_per_station(&map),
        peak_mib(),
        map.removed_mm3
    );
    let begin = Instant::now();
    let mark = key(&path.toolpath, job, options);
    let bytes = to_bytes(&map, &mark);
    let (written, begin) = (begin.elapsed().as_secs_f64(), Instant::now());
    drop(map);
    let again = key(&path.toolpath, job, options);
    let back = from_bytes(&bytes, &again).unwrap();
    let seconds = begin.elapsed().as_secs_f64();
    println!(
        "    as a cache: {:.1} MiB, key and bytes {written:.3} s, key and back {seconds:.3} s, {} stations",
        bytes.len() as f64 / (1 << 20) as f64,
        back.stations.len()
    );
}

/// Cells under the cutter, summed over the moves.
fn swept_cells(path: &Path, job: &Job, cell: f64) -> f64 {
    let diameter = job.tools[0].diameter_mm;
    let disc = 0.25 * std::f64::consts::PI * diameter * diameter;
    path.toolpath.moves.iter().map(|motion| (disc + diameter * motion.curve().length()) / (cell * cell)).sum()
}

fn arcs_per_station(map: &EngagementMap) -> f64 {
    let cutting = map.stations.iter().filter(|station| station.arc_count > 0).count().max(1);
    map.arcs.len() as f64 / cutting as f64
}

/// Processor time used so far, s (Linux; 0 elsewhere).
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<f64> =
        stat.rsplit(')').next().unwrap_or("").split_whitespace().filter_map(|f| f.parse().ok()).collect();
    // After the name: state, then eleven numbers, then user and system time in hundredths of a second.
    fields.get(10..12).map_or(0.0, |times| (times[0] + times[1]) / 100.0)
}

/// Largest resident set so far, MiB (Linux; 0 elsewhere).
fn peak_mib() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or("0 kB");
    line.trim().trim_end_matches(" kB").trim().parse::<f64>().unwrap_or(0.0) / 1024.0
}
