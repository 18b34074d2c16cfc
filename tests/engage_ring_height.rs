//! What the height of the rings loses: the largest force of each move on the rings that `optimize` uses, over that on rings a sixteenth as
//! high. A ring has the arc of its middle, so where the arcs change from ring to ring a peak is too high or too low. Counted are moves with at least
//! half of the program's largest force, at places 0.3 mm apart.

#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::format_collect)]

mod common {
    pub mod certified;
    pub mod everyday;
}

use common::certified::{Case, by_hand, read};
use common::everyday;
use feedwright::engage::{Options, engage};
use feedwright::force::{Cut, Cutter};
use feedwright::machine::Job;
use feedwright::nc::Toolpath;
use std::fs;
use std::path::Path;

/// Largest error of the force of a move, either way: 4.7 % was seen on the saddle.
const MOST: f64 = 0.05;
/// The same of nine moves in ten: 2.8 % was seen on the raster.
const MOSTLY: f64 = 0.03;

/// Programs with curved and flat cutters whose arcs change from ring to ring.
fn four() -> Vec<Case> {
    let mut cases: Vec<Case> = by_hand().into_iter().filter(|case| case.name == "raster").collect();
    let [program, setup] =
        [".nc", ".setup.toml"].map(|end| fs::read_to_string(format!("programs/saddle{end}")).unwrap());
    cases.push(Case { name: "saddle".to_owned(), program, setup });
    let everyday = everyday::all();
    for name in ["waterline finishing, mm", "pocket in circles, mm"] {
        let known = everyday.iter().find(|known| known.name == name).unwrap();
        cases.push(Case { name: name.to_owned(), program: known.text.clone(), setup: known.setup.clone() });
    }
    cases
}

/// The largest force of each move, N.
fn peaks(toolpath: &Toolpath, job: &Job, ring_parts: u32) -> Vec<f64> {
    let map = engage(toolpath, job, &Options { spacing_mm: 0.3, ring_parts, ..Options::default() }, &|_| ()).unwrap();
    let mut cutters: Vec<(u32, f64, Cutter)> = Vec::new();
    let mut peaks = vec![0.0f64; toolpath.moves.len()];
    for station in map.stations.iter().filter(|station| station.arc_count > 0) {
        let motion = &toolpath.moves[station.move_id.ix()];
        let (number, rps) = (motion.tool, motion.spin.rps);
        let known = cutters.iter().position(|(of, at, _)| *of == number && *at == rps).unwrap_or_else(|| {
            let (tool, slices) = (job.tool(number).unwrap(), map.slices_of(number));
            let material = &job.stocks[0].material;
            let cutter = Cutter::new(tool, material, &job.machine.spindle, &job.process, slices, rps).unwrap();
            cutters.push((number, rps, cutter));
            cutters.len() - 1
        });
        let tangent_z = motion.curve().tangent(0.5 * (station.from_mm + station.to_mm)).z;
        let cut = Cut { arcs: map.arcs_of(station), tangent_z, ..Cut::default() };
        let force = cutters[known].2.loads(&cut, motion.feed.mm_s).force_xy_peak_n;
        peaks[station.move_id.ix()] = peaks[station.move_id.ix()].max(force);
    }
    peaks
}

#[test]
fn the_usual_rings_lose_little() {
    for case in four() {
        let (job, _) = feedwright::setup::load(&case.setup, Path::new(".")).unwrap();
        let toolpath = read(case.program.as_bytes(), &job);
        let [usual, fine] = [1, 16].map(|parts| peaks(&toolpath, &job, parts));
        let largest = fine.iter().copied().fold(0.0, f64::max);
        let counted = usual.iter().zip(&fine).filter(|(_, fine)| **fine > 0.5 * largest);
        let mut errors: Vec<f64> = counted.map(|(usual, fine)| usual / fine - 1.0).collect();
        errors.sort_by(f64::total_cmp);
        let at = |share: f64| 100.0 * errors[((errors.len() - 1) as f64 * share) as usize];
        println!(
            "{:<24}{:>5} moves: force on the usual rings {:+.2} to {:+.2} % of that on fine ones, nine in ten {:+.2} to {:+.2} %",
            case.name,
            errors.len(),
            at(0.0),
            at(1.0),
            at(0.05),
            at(0.95)
        );
        assert!(errors.iter().all(|error| error.abs() < MOST), "{}", case.name);
        assert!(at(0.05).abs().max(at(0.95).abs()) < 100.0 * MOSTLY, "{}", case.name);
    }
}
