//! The schedule on whole programs: what is promised about caps, modes, F words, prices and threads.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use feedwright::engage::{self, EngagementMap, engage};
use feedwright::machine::{Job, LimitKind, Limits, Mode, Operation, Raise, Ramp};
use feedwright::nc::{Environment, Freeze, MoveKind, Toolpath, interpret, parse};
use feedwright::schedule::cycle_time::{fits, saved_percent};
use feedwright::schedule::feed_segments::SLACK;
use feedwright::schedule::operations::segments;
use feedwright::schedule::optimum::optimum;
use feedwright::schedule::prices::{Prices, prices};
use feedwright::schedule::reference::{distributions, limited_to_itself};
use feedwright::schedule::solve::node_track;
use feedwright::schedule::stress::{cases, with_coefficients};
use feedwright::schedule::{Options, Problem, Schedule, as_programmed, problem, realise, solve};

struct Part {
    job: Job,
    toolpath: Toolpath,
    map: EngagementMap,
}

fn part(program: &str) -> Part {
    let path = Path::new(program);
    let setup = path.with_extension("setup.toml");
    let (mut job, _) = feedwright::setup::load(&fs::read_to_string(setup).unwrap(), Path::new("programs")).unwrap();
    // These tests are about caps and feeds wherever a feed may rise; a cycle has one F for its air and its cut.
    job.raise = Raise { cycles: Some(false), ..Raise::ALL };
    let toolpath = interpret(&parse(fs::read(path).unwrap(), None), &Environment::from_job(&job));
    let map = engage(&toolpath, &job, &engage::Options::default(), &|_| {}).unwrap();
    Part { job, toolpath, map }
}

/// One force limit for every tool.
fn limit_force(job: &mut Job, force_xy_n: f64) {
    job.limits.force_xy_n = Some(force_xy_n);
    for tool in &mut job.tools {
        tool.limits.force_xy_n = None;
    }
}

fn pocket() -> Part {
    part("programs/pocket.nc")
}

fn solved(part: &Part) -> (Problem, Schedule) {
    let problem = problem(&part.toolpath, &part.map, &part.job);
    let schedule = solve(&problem, &part.toolpath, &part.job, &Options::of(&part.toolpath));
    (problem, schedule)
}

/// Total time of the continuous optimum, s.
fn optimum_s(part: &Part) -> f64 {
    let problem = problem(&part.toolpath, &part.map, &part.job);
    optimum(node_track(&problem, &part.toolpath, &part.job), 0.0).leg_times().iter().sum()
}

#[test]
fn pieces_tile_the_moves_and_stay_below_every_cap() {
    for name in ["programs/pocket.nc", "programs/bracket.nc"] {
        let part = part(name);
        let (problem, schedule) = solved(&part);
        let mut at = schedule.pieces.iter().peekable();
        for (id, motion) in part.toolpath.iter_moves().filter(|(_, motion)| motion.kind == MoveKind::Feed) {
            let mut reached = 0.0;
            while let Some(piece) = at.next_if(|piece| piece.move_id == id) {
                assert!((piece.from_mm - reached).abs() < 1e-9, "{name} line {}", motion.line);
                reached = piece.to_mm;
                for node in problem.nodes_of(id) {
                    let overlap = node.to_mm.min(piece.to_mm) - node.from_mm.max(piece.from_mm);
                    let allowed = if node.free { node.cap.feed_mm_s } else { node.programmed_mm_s };
                    // An F of the text that is near enough stays.
                    let most = if piece.feed_mm_s == node.programmed_mm_s { 1.0 + SLACK } else { 1.0 + 1e-9 };
                    assert!(overlap < 1e-6 || piece.feed_mm_s <= allowed * most, "{name} line {}", motion.line);
                }
            }
            assert!((reached - motion.curve().length()).abs() < 1e-6, "{name} line {}", motion.line);
        }
        assert!(at.next().is_none());
        let after_s = realise(&part.toolpath, &schedule.pieces, &part.job.machine).total_s;
        let loss = after_s / schedule.continuous_s - 1.0;
        let feed_moves = part.toolpath.moves.iter().filter(|motion| motion.kind == MoveKind::Feed).count();
        let blocks = f64::from(part.toolpath.moves.last().unwrap().block.0 + 1);
        let growth = 1.0 + (schedule.pieces.len() - feed_moves) as f64 / blocks;
        println!("{name}: loss {:.2} %, growth {growth:.2}", 100.0 * loss);
        // No bound was asked for: what is written is worth its price, and that is little.
        assert!(growth <= 4.0, "{name}: growth {growth}");
        assert!(loss <= 0.01, "{name}: loss {loss}");
    }
}

#[test]
fn the_same_answer_on_any_number_of_threads() {
    let part = pocket();
    let answer = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| solved(&part).1.pieces)
    };
    let one = answer(1);
    assert_eq!(one, answer(2));
    assert_eq!(one, answer(7));
}

#[test]
fn shadow_prices_are_what_moving_the_limit_saves() {
    // Lines only; and arcs, where the axes couple speed and acceleration.
    shadow_prices(part("programs/pocket.nc"), 60.0, 0.05);
    shadow_prices(part("programs/bracket.nc"), 150.0, 0.05);
}

#[test]
fn shadow_prices_of_other_limits_are_what_one_percent_of_them_saves() {
    // Below the median of what the program meets; per unit of the report: N·m are 1000 N·mm.
    type Set = fn(&mut Limits, f64);
    let limits: [(LimitKind, Set, f64, f64); 6] = [
        (LimitKind::Power, |limits, most| limits.power_w = Some(most), 1100.0, 1.0),
        (LimitKind::Torque, |limits, most| limits.torque_nmm = Some(most), 800.0, 1000.0),
        (LimitKind::Deflection, |limits, most| limits.deflection_mm = Some(most), 0.018, 1.0),
        (LimitKind::BendingStress, |limits, most| limits.bending_stress_mpa = Some(most), 100.0, 1.0),
        (LimitKind::ChipThickness, |limits, most| limits.chip_thickness_max_mm = Some(most), 0.03, 1.0),
        (LimitKind::FeedPerTooth, |limits, most| limits.feed_per_tooth_max_mm = Some(most), 0.03, 1.0),
    ];
    let base = pocket();
    for (kind, set, most, unit) in limits {
        let mut part = Part { job: base.job.clone(), toolpath: base.toolpath.clone(), map: base.map.clone() };
        for axis in &mut part.job.machine.axes {
            axis.jerk_mm_s3 = None;
        }
        part.job.limits = Limits { feed_change_max: Some(1e3), ..Limits::default() };
        for tool in &mut part.job.tools {
            tool.limits = Limits::default();
        }
        part.job.machine.spindle.power_w = None;
        part.job.machine.spindle.torque_nmm = None;
        let mut at = |factor: f64| {
            set(&mut part.job.limits, most * factor);
            let problem = problem(&part.toolpath, &part.map, &part.job);
            let found = optimum(node_track(&problem, &part.toolpath, &part.job), 0.0);
            let leg_s = found.leg_times();
            let told = price_of(&prices(&problem, &part.toolpath, &found), kind);
            (leg_s.iter().sum::<f64>(), told)
        };
        let slope = (at(1.005).0 - at(0.995).0) / (0.01 * most / unit);
        let told = at(1.0).1;
        println!("{kind:?}: told {told} s per unit, found {slope}, {} s", at(1.0).0);
        assert!(told < 0.0 && (told / slope - 1.0).abs() < 0.01, "{kind:?}: told {told} s per unit, found {slope}");
    }
}

/// What one more unit of a limit saves, of all tools together, s.
fn price_of(prices: &Prices, kind: LimitKind) -> f64 {
    prices.shadow.iter().filter(|price| price.kind == kind).map(|price| price.per_unit_s).sum()
}

fn shadow_prices(mut part: Part, force_n: f64, same: f64) {
    for axis in &mut part.job.machine.axes {
        axis.jerk_mm_s3 = None;
    }
    // A low force limit, so that it binds along much of the path; nothing else moves with it.
    limit_force(&mut part.job, force_n);
    part.job.limits.feed_change_max = Some(1e3);
    let problem = problem(&part.toolpath, &part.map, &part.job);
    let found = optimum(node_track(&problem, &part.toolpath, &part.job), 0.0);
    assert_eq!(found.windows[1..], [0, 0]);
    let told = price_of(&prices(&problem, &part.toolpath, &found), LimitKind::ForceXy);
    let mut moved = |factor: f64| {
        limit_force(&mut part.job, force_n * factor);
        optimum_s(&part)
    };
    let slope = (moved(1.005) - moved(0.995)) / (0.01 * force_n);
    // The same with the caps moved along their own derivative: what is left of the difference is theirs.
    let caps_moved = |by: f64| -> f64 {
        let mut other = problem.clone();
        for node in other.nodes.iter_mut().filter(|node| node.cap.kind == LimitKind::ForceXy) {
            node.cap.feed_mm_s += by * node.cap.per_unit;
        }
        optimum(node_track(&other, &part.toolpath, &part.job), 0.0).leg_times().iter().sum()
    };
    let along = (caps_moved(0.01) - caps_moved(-0.01)) / 0.02;
    println!("{} windows, told {told} s/N, caps {along} s/N, limit {slope} s/N", found.windows[0]);
    assert!((told / along - 1.0).abs() < 1e-3, "told {told} s/N, caps {along} s/N");
    assert!((told / slope - 1.0).abs() < same, "told {told} s/N, found {slope} s/N");
}

#[test]
fn modes_freezes_and_excluded_lines_keep_the_feed() {
    let base = pocket();
    let keep = |job: Job, freeze: Option<Freeze>| {
        let mut part = Part { job, toolpath: base.toolpath.clone(), map: base.map.clone() };
        for motion in &mut part.toolpath.moves {
            motion.freeze = motion.freeze.or(freeze);
        }
        let (_, schedule) = solved(&part);
        let programmed = |piece: &feedwright::schedule::FeedPiece| part.toolpath.moves[piece.move_id.ix()].feed.mm_s;
        assert!(schedule.pieces.iter().all(|piece| piece.feed_mm_s == programmed(piece)));
    };
    let with = |mode: Mode| {
        let mut job = base.job.clone();
        job.operations.push(Operation { mode, ..Operation::default() });
        job
    };
    keep(with(Mode::Keep), None);
    keep(base.job.clone(), Some(Freeze::Probe));
    let mut excluded = base.job.clone();
    excluded.output.exclude.push((1, u32::MAX));
    keep(excluded, None);
    let slow = Part { job: with(Mode::SlowOnly), toolpath: base.toolpath.clone(), map: base.map.clone() };
    let (_, schedule) = solved(&slow);
    let raised =
        |piece: &&feedwright::schedule::FeedPiece| piece.feed_mm_s > slow.toolpath.moves[piece.move_id.ix()].feed.mm_s;
    assert_eq!(schedule.pieces.iter().filter(raised).count(), 0);
}

#[test]
fn without_a_load_limit_no_feed_rises_in_a_cut() {
    let mut part = pocket();
    part.job.limits = Limits::default();
    for tool in &mut part.job.tools {
        tool.limits = Limits::default();
    }
    let (problem, _) = solved(&part);
    assert!(problem.nodes.iter().filter(|node| node.cutting).all(|node| node.cap.feed_mm_s <= node.programmed_mm_s));
}

#[test]
fn a_limit_that_cannot_be_met_runs_at_the_lowest_feed_and_is_marked() {
    let mut part = pocket();
    limit_force(&mut part.job, 0.01);
    let (problem, _) = solved(&part);
    let cutting: Vec<_> = problem.nodes.iter().filter(|node| node.cutting && node.free).collect();
    assert!(!cutting.is_empty());
    // A plunge has no force in the plane to speak of; everything else exceeds a hundredth of a newton by its edges alone.
    let level =
        |node: &&&feedwright::schedule::Node| part.toolpath.moves[node.move_id.ix()].curve().tangent(0.0).z == 0.0;
    for node in cutting.iter().filter(level) {
        assert_eq!(node.infeasible, Some(LimitKind::ForceXy), "line {}", part.toolpath.moves[node.move_id.ix()].line);
        assert!((node.cap.feed_mm_s - node.floor.feed_mm_s).abs() < 1e-12 && node.cap.feed_mm_s > 0.0);
    }
}

#[test]
fn an_entry_ramp_covers_its_distance_after_every_entry() {
    let mut part = pocket();
    let ramp = Ramp { feed_mm_s: 0.9, distance_mm: 2.0 };
    part.job.operations.push(Operation { entry: Some(ramp), ..Operation::default() });
    let (problem, _) = solved(&part);
    let ramped: f64 = problem
        .nodes
        .iter()
        .filter(|node| node.cap.kind == LimitKind::Ramp)
        .map(feedwright::schedule::Node::length_mm)
        .sum();
    assert!(ramped > 0.0);
    for pair in problem.nodes.windows(2).filter(|pair| pair[1].cutting && !pair[0].cutting && pair[1].free) {
        assert!(pair[1].cap.feed_mm_s <= ramp.feed_mm_s);
    }
}

#[test]
fn a_program_held_to_its_own_loads_is_never_slowed_and_a_common_error_cancels() {
    let part = pocket();
    let held = |job: &Job| {
        let operations = segments(&[], &part.toolpath, &part.map, &part.job);
        let found = distributions(&operations, &part.toolpath, &part.map, job);
        let own = limited_to_itself(job, &operations, &found, 100.0);
        problem(&part.toolpath, &part.map, &own)
    };
    let mut free = part.job.clone();
    free.limits = Limits::default();
    free.machine.spindle.power_w = None;
    free.machine.spindle.torque_nmm = None;
    let first = held(&free);
    let cutting = |problem: &Problem| problem.nodes.iter().filter(|node| node.cutting).copied().collect::<Vec<_>>();
    assert!(cutting(&first).iter().all(|node| node.cap.feed_mm_s >= node.programmed_mm_s * (1.0 - 1e-6)));
    // Forces and deflection scale with the coefficients; the tare in the power does not, so it is left out here.
    let mut free_of_tare = free.clone();
    free_of_tare.machine.spindle.tare_w = feedwright::machine::Table::constant(0.0);
    let (plain, stiff) = (held(&free_of_tare), held(&with_coefficients(&free_of_tare, 1.3)));
    for (a, b) in cutting(&plain).iter().zip(cutting(&stiff)) {
        assert!((a.cap.feed_mm_s / b.cap.feed_mm_s - 1.0).abs() < 1e-6);
    }
    assert_eq!(cases(&part.job).len(), 11);
}

#[test]
fn one_measured_time_finds_the_acceleration_and_leaves_an_interval() {
    let part = pocket();
    let before = as_programmed(&part.toolpath);
    let (_, schedule) = solved(&part);
    let mut real = part.job.machine.clone();
    for axis in &mut real.axes {
        axis.acceleration_mm_s2 *= 0.4;
    }
    let measured_s = realise(&part.toolpath, &before, &real).total_s;
    let found = fits(&part.toolpath, &before, &part.job.machine, measured_s);
    let same = found.iter().find(|fit| fit.corner_tolerance_mm == real.corner_tolerance_mm).expect("a fit");
    assert!((same.acceleration - 0.4).abs() < 1e-3, "{}", same.acceleration);
    let (low, high) = saved_percent(&part.toolpath, &schedule.pieces, &found).expect("fits");
    let truth = 100.0 * (1.0 - realise(&part.toolpath, &schedule.pieces, &real).total_s / measured_s);
    assert!(low <= truth + 1e-6 && truth <= high + 1e-6, "{low} {truth} {high}");
}
