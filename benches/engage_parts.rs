//! The parts of the engagement stage one by one, with criterion: sweeping a block, nominating for a station, the arcs of a
//! station. `cargo bench --bench engage_parts`.

#![allow(clippy::format_collect, clippy::unwrap_used)]

use criterion::{BatchSize, Criterion};
use feedwright::engage::arcs::arcs_at;
use feedwright::engage::cutter::Cutter;
use feedwright::engage::nominate::{Nominations, Sample, Scratch, nominate};
use feedwright::engage::retraced::Retraced;
use feedwright::engage::scene::Scene;
use feedwright::ids::MoveId;
use feedwright::machine::Box3;
use feedwright::path::Vec3;
use feedwright::stock::{Blank, Element, Field, Track, sweep};
use std::hint::black_box;

#[path = "../tests/engage_common/mod.rs"]
mod engage_common;
use engage_common::{ball, flat};

/// Length of a block and distance of rows, mm.
const STEP: f64 = 0.24;
const ROW: f64 = 0.3;
/// Blocks of a row.
const PER_ROW: usize = 40;

/// Rows of blocks on a wavy surface; the last row ends halfway.
fn rows(depth: f64) -> Vec<Element> {
    let at = |row: usize, k: usize| {
        let (x, y) = (4.0 + STEP * k as f64, 3.0 + ROW * row as f64);
        Vec3::new(x, y, 5.0 - depth + 0.3 * (0.7 * x).sin() * (0.5 * y).cos())
    };
    let element = |row: usize, k: usize| {
        let track = Track::Line { from: at(row, k), to: at(row, k + 1) };
        Element { track, from_mm: 0.0, move_id: MoveId((row * PER_ROW + k) as u32), cutter: 0, joined: k > 0 }
    };
    let whole = (0..20).flat_map(|row| (0..PER_ROW).map(move |k| (row, k)));
    whole.chain((0..PER_ROW / 2).map(|k| (20, k))).map(|(row, k)| element(row, k)).collect()
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    parts(&mut criterion);
    criterion.final_summary();
}

fn parts(criterion: &mut Criterion) {
    for (name, tool, depth) in [("ball of 6 mm", ball(6.0), 0.6), ("flat of 6 mm", flat(6.0), 1.5)] {
        let extent = Box3 { min: Vec3::new(0.0, 0.0, 0.0), max: Vec3::new(18.0, 18.0, 5.0) };
        let cutters = [Cutter::new(&tool, 0.1, 1)];
        let blanks = [Blank::Box(extent)];
        let elements = rows(depth);
        let retraced = Retraced::new(&elements, |_| cutters[0].form.radius, &[extent], 0.1);
        let scene = Scene {
            elements: &elements,
            cutters: &cutters,
            earlier: &[],
            blanks: &blanks,
            fixtures: &[],
            retraced: &retraced,
        };
        let mut tile = Field::new(extent, 0.1, |_, _| 5.0).tiles.swap_remove(0);
        let last = elements.len() as u32 - 1;
        for (index, element) in elements[..last as usize].iter().enumerate() {
            sweep(&mut tile, (&element.track, element.joined), &cutters[0].form, index as u32);
        }
        tile.update_highest();
        let track = elements[last as usize].track;
        let (from, to) = track.ends();
        let along = (to - from) / (to - from).norm();
        let across = along.x.hypot(along.y);
        let sample = Sample {
            element: last,
            along_mm: track.length(),
            s_mm: track.length(),
            tip: to,
            dir: [along.x / across, along.y / across],
            tangent: [across, along.z],
            cutter: 0,
            clearance_mm: 0.5,
            need: feedwright::engage::nominate::Need::Always,
        };
        let (mut work, mut said) = (Scratch::default(), Nominations::default());
        nominate(&tile, 0, &sample, &cutters[0], &mut work, &mut said);
        let (mut room, mut arcs) = (Vec::new(), Vec::new());
        arcs_at(&scene, &sample, (&said.marks, &said.candidates), &mut room, &mut arcs);
        assert!(!arcs.is_empty(), "{name}: nothing is cut");
        criterion.bench_function(&format!("{name}: sweep of one block"), |bench| {
            let swept = |mut tile: feedwright::stock::Tile| {
                sweep(&mut tile, (&track, false), &cutters[0].form, last);
                tile
            };
            bench.iter_batched(|| tile.clone(), swept, BatchSize::LargeInput);
        });
        criterion.bench_function(&format!("{name}: nomination of one station"), |bench| {
            bench.iter(|| {
                let mut said = Nominations::default();
                nominate(black_box(&tile), 0, &sample, &cutters[0], &mut work, &mut said);
                said
            });
        });
        let title = format!("{name}: {} arcs of one station, {} candidates", arcs.len(), said.candidates.len());
        criterion.bench_function(&title, |bench| {
            bench.iter(|| {
                arcs.clear();
                arcs_at(&scene, black_box(&sample), (&said.marks, &said.candidates), &mut room, &mut arcs)
            });
        });
    }
}
