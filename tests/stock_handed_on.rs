//! Stock handed from program to program: the second one meets what it would have met as a part of the first, station by
//! station and bit by bit but for a few beside walls that no cell shows any more; in other cells within what is promised of cells; a program run again meets nothing; as a mesh it
//! has its volume.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod engage_common;
use engage_common::*;
use feedwright::engage::{EngagementMap, Options, engage, engage_and_keep};
use feedwright::ids::MoveId;
use feedwright::machine::{Job, Stock, StockShape};
use feedwright::path::{Plane, Vec3};
use feedwright::stock::{Piece, read_stl, saved};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Runs a program on stock from these bytes.
fn goes_on(path: &Path, job: &Job, bytes: &[u8], cell_mm: f64) -> (EngagementMap, Vec<Piece>) {
    let load = |_: &std::path::Path| Ok(bytes.to_vec());
    let mut next = job.clone();
    next.stocks[0].shape = StockShape::Saved("op10.stock".into());
    let options = Options { cell_mm: Some(cell_mm), loader: Some(&load), ..Options::default() };
    engage_and_keep(&path.toolpath, &next, &options, &|_| {}).unwrap()
}

fn begins(path: &Path, job: &Job, cell_mm: f64) -> (EngagementMap, Vec<Piece>) {
    let options = Options { cell_mm: Some(cell_mm), ..Options::default() };
    engage_and_keep(&path.toolpath, job, &options, &|_| {}).unwrap()
}

/// One program after the other: the moves of all of them.
fn one_after_the_other(programs: &[&Path]) -> Path {
    let mut all = Path::default();
    for program in programs {
        all.toolpath.moves.extend(program.toolpath.moves.iter().cloned());
    }
    all
}

/// Three tools, three programs: a pocket with round corners roughed out, ball rows over its floor, its walls and floor
/// finished by 0.2 mm with a smaller tool.
fn programs() -> [Path; 3] {
    let mut rough = Path::from([-30.0, -12.0, 5.0]);
    for z in [-2.0, -4.0] {
        rough.rapid([-12.0, -12.0, 5.0]).line([-12.0, -12.0, z]).line([12.0, -12.0, z]);
        rough.arc(Plane::Xy, [14.0, -10.0, z], [12.0, -10.0, z], FRAC_PI_2).line([14.0, 8.0, z]);
        rough.line([-12.0, 10.0, z]).turn([-12.0, 4.0], TAU, 0.0).line([-12.0, -12.0, z]).line([10.0, 6.0, z]);
    }
    let mut rows = Path::from([-14.0, -9.0, 5.0]).with_tool(2);
    for row in 0..7 {
        let y = -9.0 + 2.5 * f64::from(row);
        rows.rapid([-13.0, y, 5.0]).line([-13.0, y, -4.2]).line([0.0, y + 1.0, -4.6]).line([12.0, y, -4.0]);
    }
    let mut finish = Path::from([-12.0, -12.2, 5.0]).with_tool(3);
    finish.line([-12.0, -12.2, -4.3]).line([12.0, -12.2, -4.3]);
    finish.arc(Plane::Xy, [14.2, -10.0, -4.3], [12.0, -10.0, -4.3], FRAC_PI_2).line([14.2, 7.9, -4.4]);
    finish.line([-11.7, 10.2, -4.4]).line([-5.0, -7.0, -4.5]).line([7.0, 3.0, -5.0]);
    [rough, rows, finish]
}

fn shop() -> Job {
    let of = |number: u32, tool: feedwright::machine::Tool| feedwright::machine::Tool { number, ..tool };
    job(
        vec![of(1, bull(10.0, 1.0)), of(2, ball(6.0)), of(3, flat(6.0))],
        vec![block([-25.0, -22.0, -15.0], [24.0, 21.0, 0.0])],
    )
}

#[test]
fn three_programs_meet_what_one_program_of_all_their_moves_meets() {
    let (programs, job) = (programs(), shop());
    for cell in [0.1, 0.2] {
        let all = one_after_the_other(&programs.each_ref());
        let (whole, _) = begins(&all, &job, cell);
        let (mut map, mut pieces) = begins(&programs[0], &job, cell);
        let (mut first, mut compared, mut same) = (programs[0].toolpath.moves.len(), 0, 0);
        for program in &programs[1..] {
            let bytes = saved::to_bytes(&pieces[0], Vec3::zeros());
            (map, pieces) = goes_on(program, &job, &bytes, cell);
            for index in 0..program.toolpath.moves.len() {
                let [all, exact] = same_stations((&map, index), (&whole, first + index));
                (compared, same) = (compared + all, same + exact);
            }
            first += program.toolpath.moves.len();
        }
        assert!(compared > 300 && 50 * (compared - same) <= compared, "{same} of {compared}");
        // A sweep looks only as far as something stands, which is known per batch: cells may differ by a rounding.
        assert!((map.remaining_mm3 / whole.remaining_mm3 - 1.0).abs() < 1e-9);
        println!(
            "cell {cell}: {same} of {compared} stations agree bit for bit, {} cuts handed on",
            pieces[0].cuts.len()
        );
    }
}

/// Asserts that a move has the same stations in two maps, to 1e-4 of their areas; how many, and how many of them bit for bit.
fn same_stations((a, i): (&EngagementMap, usize), (b, j): (&EngagementMap, usize)) -> [usize; 2] {
    let [ours, theirs] = [(a, i), (b, j)].map(|(map, index)| map.stations_of(MoveId(index as u32)));
    assert_eq!(ours.len(), theirs.len(), "move {j}");
    let mut exact = 0;
    for (one, other) in ours.iter().zip(theirs) {
        let of = |s: &feedwright::engage::Station| {
            (s.from_mm.to_bits(), s.to_mm.to_bits(), s.axial_depth_mm.to_bits(), s.flags.clear_air)
        };
        assert_eq!(of(one), of(other), "move {j} at {:.3} mm", other.from_mm);
        // Rings cut in two are numbered as they come: their sizes count, not their numbers.
        let arcs = |map: &EngagementMap, station| {
            let slice = |of: u32| map.slices.iter().find_map(|(_, slices)| slices.get(of as usize)).map(|s| s.z_mm);
            let arc = |arc: &feedwright::engage::EngagedArc| {
                (slice(arc.slice).is_some(), arc.entry_rad.to_bits(), arc.exit_rad.to_bits())
            };
            map.arcs_of(station).iter().map(arc).collect::<Vec<_>>()
        };
        let [area, other_area] = [one, other].map(|station| station.removal_area_mm2);
        assert!((area - other_area).abs() <= 1e-4 * other_area, "move {j}: {area} for {other_area} mm²");
        exact += usize::from(area.to_bits() == other_area.to_bits() && arcs(a, one) == arcs(b, other));
    }
    [ours.len(), exact]
}

#[test]
fn a_program_run_again_cuts_nothing() {
    let (programs, job) = (programs(), shop());
    let all = one_after_the_other(&programs.each_ref());
    for cell in [0.1, 0.2] {
        let (first, pieces) = begins(&all, &job, cell);
        let (again, _) = goes_on(&all, &job, &saved::to_bytes(&pieces[0], Vec3::zeros()), cell);
        let volume = |map| (0..all.toolpath.moves.len()).map(|k| volume_of(map, k as u32)).sum::<f64>();
        let most = |map: &EngagementMap| map.stations.iter().map(|s| s.removal_area_mm2).fold(0.0, f32::max);
        let [one, two] = [&first, &again].map(|map| (volume(map), most(map)));
        println!(
            "cell {cell}: {:.1} mm³, at most {:.2} mm²; again {:.5} mm³, at most {:.4} mm²",
            one.0, one.1, two.0, two.1
        );
        assert!(again.removed_mm3.abs() <= 1e-9 * one.0 && two.0 <= 1e-4 * one.0 && two.1 <= 0.01 * one.1);
    }
}

#[test]
fn other_cells_and_another_place_change_little() {
    let ([rough, _, finish], job) = (programs(), shop());
    let (_, pieces) = begins(&rough, &job, 0.2);
    let bytes = saved::to_bytes(&pieces[0], Vec3::zeros());
    let (fine, _) = begins(&one_after_the_other(&[&rough, &finish]), &job, 0.1);
    let first = rough.toolpath.moves.len();
    // Cut anew in finer cells.
    let (map, _) = goes_on(&finish, &job, &bytes, 0.1);
    close(&map, &fine, first, finish.toolpath.moves.len(), "cells of half the size");
    // Another origin: the stock's own coordinates stay, the program's move.
    let by = Vec3::new(100.0, -50.0, 12.5);
    let bytes = saved::to_bytes(&pieces[0], by);
    let moved = Job { stocks: vec![Stock { moved_mm: -by, ..job.stocks[0].clone() }], ..job };
    let (map, _) = goes_on(&finish, &moved, &bytes, 0.1);
    close(&map, &fine, first, finish.toolpath.moves.len(), "another origin");
}

/// Asserts that moves remove per millimetre what those from `first` on of the other map do.
fn close(map: &EngagementMap, whole: &EngagementMap, first: usize, moves: usize, what: &str) {
    let volumes = |k: usize| [volume_of(map, k as u32), volume_of(whole, (first + k) as u32)];
    let all: f64 = (0..moves).map(|k| volumes(k)[1]).sum();
    for k in 0..moves {
        let [ours, theirs] = volumes(k);
        println!("{what}: move {k}: {ours:.4} mm³, {theirs:.4} mm³ as one program");
        assert!((ours - theirs).abs() <= 1e-3 * all, "{what}: move {k}: {ours} {theirs}");
    }
}

#[test]
fn a_slot_is_gone_on_with_and_its_mesh_is_closed() {
    let slot = |z: f64| {
        let mut path = Path::from([-10.0, 0.0, z]);
        path.line([50.0, 0.0, z]);
        path
    };
    let job = job(vec![flat(10.0)], vec![block([0.0, -20.0, -20.0], [40.0, 20.0, 0.0])]);
    let (first, pieces) = begins(&slot(-2.0), &job, 0.2);
    let (second, _) = goes_on(&slot(-3.0), &job, &saved::to_bytes(&pieces[0], Vec3::zeros()), 0.2);
    assert!((second.initial_mm3 - first.remaining_mm3).abs() < 1e-6 * first.initial_mm3);
    assert!((second.removed_mm3 / 400.0 - 1.0).abs() < 3e-3, "{}", second.removed_mm3);
    println!("the second slot removes {:.3} mm³ by its stations, 400 in truth", volume_of(&second, 0));
    assert!((volume_of(&second, 0) / 400.0 - 1.0).abs() < 1e-3, "{}", volume_of(&second, 0));
    let (mesh, notes) = read_stl(&saved::to_stl(&pieces[0].field, Vec3::zeros())).unwrap();
    assert!((mesh.volume() / first.remaining_mm3 - 1.0).abs() < 2e-3 && notes.is_empty(), "{notes:?}");
}

#[test]
fn two_pieces_of_stock_keep_their_pasts_apart() {
    let side_by_side =
        vec![block([-20.0, -10.0, -10.0], [0.0, 10.0, 0.0]), block([5.0, -10.0, -10.0], [25.0, 10.0, 0.0])];
    let job = job(vec![flat(6.0)], side_by_side);
    let pass = |y: f64, z: f64| {
        let mut path = Path::from([-30.0, y, z]);
        path.line([35.0, y + 1.0, z]);
        path
    };
    let (_, pieces) = begins(&pass(0.0, -3.0), &job, 0.2);
    let files: Vec<Vec<u8>> = pieces.iter().map(|piece| saved::to_bytes(piece, Vec3::zeros())).collect();
    let load = |name: &std::path::Path| Ok(files[usize::from(name.ends_with("b.stock"))].clone());
    let mut next = job.clone();
    for (stock, name) in next.stocks.iter_mut().zip(["a.stock", "b.stock"]) {
        stock.shape = StockShape::Saved(name.into());
    }
    let options = Options { cell_mm: Some(0.2), loader: Some(&load), ..Options::default() };
    let second = pass(1.5, -4.0);
    let map = engage(&second.toolpath, &next, &options, &|_| {}).unwrap();
    let (whole, _) = begins(&one_after_the_other(&[&pass(0.0, -3.0), &second]), &job, 0.2);
    assert!(same_stations((&map, 0), (&whole, 1))[1] > 4);
}
