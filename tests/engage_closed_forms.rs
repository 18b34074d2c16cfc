//! Engagement against closed forms: slots, side cuts, corners, circles, balls.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

mod engage_common;
use engage_common::*;
use feedwright::ids::MoveId;
use feedwright::machine::{Profile, Shape};
use feedwright::path::Plane;
use std::f64::consts::PI;

/// Largest and median deviation of the entry and exit angles of `slice 0 mod` stations from (entry, exit).
fn errors(map: &feedwright::engage::EngagementMap, index: u32, entry: f64, exit: f64, skip: f64) -> Vec<f64> {
    let all = stations(map, index);
    let length = all.last().unwrap().to_mm;
    let mut errors = Vec::new();
    let middle = |s: &&feedwright::engage::Station| 0.5 * (s.from_mm + s.to_mm);
    for station in all.iter().filter(|s| middle(s) >= skip && middle(s) <= length - skip) {
        assert!(station.arc_count > 0, "nothing cut at {}", station.from_mm);
        for arc in map.arcs_of(station) {
            errors.push((f64::from(arc.entry_rad) - entry).abs().to_degrees());
            errors.push((f64::from(arc.exit_rad) - exit).abs().to_degrees());
        }
    }
    errors.sort_by(f64::total_cmp);
    errors
}

#[test]
fn a_slot_engages_half_the_circle() {
    let mut path = Path::from([-10.0, 0.0, -3.2]);
    path.line([50.0, 0.0, -3.2]);
    let map = run(&path, &job(vec![flat(10.0)], vec![block([0.0, -20.0, -20.0], [40.0, 20.0, 0.0])]), 0.1, 1.0);
    let inside = errors(&map, 0, 0.0, PI, 20.0);
    assert!(inside.last().unwrap() < &0.01, "{:?}", inside.last());
    let expected = 3.2 * 40.0 * 10.0;
    assert!((map.removed_mm3 / expected - 1.0).abs() < 1e-3, "{}", map.removed_mm3);
    assert!((volume_of(&map, 0) / expected - 1.0).abs() < 3e-3, "{}", volume_of(&map, 0));
}

/// A slot that turns left by a right angle: at the beginning of the second leg all that stands to the right of straight ahead is engaged, at most
/// 1.7° more after a step of 2 µm; s mm further on what is beyond acos(1 − s/R) before that, and a station of a mm has both. So it is at the
/// beginning of the path from the air, and where it leaves the block. A station that is cut in parts has the same ends.
#[test]
fn where_a_path_begins_or_ends_what_is_engaged_there_is_known() {
    let mut path = Path::from([-10.0, 0.0, -3.0]);
    path.line([20.0, 0.0, -3.0]).line([20.0, 60.0, -3.0]);
    let map = run(&path, &job(vec![flat(10.0)], vec![block([0.0, -20.0, -10.0], [40.0, 40.0, 0.0])]), 0.1, 1.0);
    let degrees = |arcs: &[feedwright::engage::EngagedArc]| {
        arcs.first().map(|arc| [arc.entry_rad, arc.exit_rad].map(f32::to_degrees))
    };
    let near = |found: Option<[f32; 2]>, wanted: [f32; 2], by: f32| {
        assert!(found.is_some_and(|found| (0..2).all(|k| (found[k] - wanted[k]).abs() < by)), "{found:?} {wanted:?}");
    };
    let legs = [0, 1].map(|leg| {
        let all: Vec<_> = stations(&map, leg).iter().filter(|station| station.arc_count > 0).collect();
        let [first, between @ .., last] = all.as_slice() else { panic!("{leg}: {}", all.len()) };
        assert!(between.iter().all(|station| station.at_ends == [0; 2]), "{leg}: between its ends");
        [*first, *last]
    });
    let [[entering, stopping], [turning, leaving]] = legs;
    // The slot's end shows half of the rim: what the station has, so nothing is kept for it.
    assert_eq!(degrees(map.arcs_at_ends(stopping)[1]), None);
    near(degrees(map.arcs_of(stopping)), [0.0, 180.0], 0.01);
    near(degrees(map.arcs_at_ends(turning)[0]), [90.0, 180.0], 1.7);
    near(degrees(map.arcs_of(turning)), [90.0 - 0.8f32.acos().to_degrees(), 180.0], 0.1);
    assert_eq!(degrees(map.arcs_at_ends(turning)[1]), None);
    // Within 0.02 mm of where it comes to the block, and of where it leaves it.
    near(degrees(map.arcs_at_ends(entering)[0]), [90.0; 2], (1.0f32 - 0.02 / 5.0).acos().to_degrees());
    let [from, to] = degrees(map.arcs_at_ends(leaving)[1]).unwrap();
    assert!(from < 0.01 && to < 1.7 || from > 178.3, "{from} {to}");
    let parts = map.clone().cut_to(0.3);
    let of = |place: f64| {
        let all = parts.stations_of(MoveId(1));
        parts.arcs_at_ends(&all[(place * (all.len() - 1) as f64) as usize]).map(<[_]>::len)
    };
    assert_eq!(of(0.0), map.arcs_at_ends(turning).map(<[_]>::len));
    assert!(parts.stations_of(MoveId(1)).iter().filter(|part| part.at_ends != [0; 2]).count() <= 2);
}

#[test]
fn side_cuts_at_any_angle_follow_the_radial_depth() {
    for degrees in [0.0f64, 17.0, 45.0, 71.5, 90.0, 200.0] {
        for radial in [0.1, 1.0, 3.0, 4.5] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let at = |u: f64, v: f64| [u * cos - v * sin, u * sin + v * cos, -2.3];
            // The first cut leaves a wall at v = 0; the second takes `radial` of it with its left side.
            let mut path = Path::from(at(-60.0, -3.0));
            path.line(at(60.0, -3.0)).line(at(60.0, -30.0)).line(at(-60.0, -30.0)).line(at(-60.0, -3.0 + radial));
            path.line(at(60.0, -3.0 + radial));
            let job = job(vec![flat(6.0)], vec![block([-25.0, -25.0, -10.0], [25.0, 25.0, 0.0])]);
            let map = run(&path, &job, 0.1, 1.0);
            let exit = (1.0 - radial / 3.0).acos();
            let found = errors(&map, 4, 0.0, exit, 45.0);
            assert!(found.len() >= 2 && found.last().unwrap() < &0.02, "{degrees}° ae {radial}: {:?}", found.last());
        }
    }
}

/// A cone of 45° that comes to the corner of a block along the diagonal, down to d from the corner, engages the edge from the height d to
/// the top of the block. A top of another block, as high as a border of its rings, does not end that.
#[test]
fn what_goes_on_beyond_a_level_is_engaged_there_too() {
    let mill = tool(1, Shape::Chamfer, Profile::cone(10.0, 0.0, 0.5 * PI, 5.0));
    let (deep, at) = (-3.5, -1.7);
    for level in [-1.0, -1.03] {
        let blocks = [0.0, level].map(|top| block([0.0, 0.0, -10.0], [16.0, 16.0, top]));
        let mut path = Path::from([-8.0, -8.0, deep]);
        path.line([at, at, deep]);
        let map = run(&path, &job(vec![mill.clone()], blocks.to_vec()), 0.1, 0.3);
        let last = stations(&map, 0).last().unwrap().to_owned();
        let mut slices: Vec<u32> = map.arcs_of(&last).iter().map(|arc| arc.slice).collect();
        slices.dedup();
        let edge: f64 = slices.iter().map(|slice| map.slices_of(1)[*slice as usize].edge_mm).sum();
        let expected = 2f64.sqrt() * (-deep - 2f64.sqrt() * -at);
        assert!((edge / expected - 1.0).abs() < 0.01, "level {level}: {edge} mm of edge, {expected}");
    }
}

#[test]
fn a_circular_slot_and_its_widening() {
    // A full turn of radius 8 with a 6 mm cutter, then one of radius 9: radial depth 1 on the outside.
    for sense in [1.0, -1.0] {
        let mut path = Path::from([8.0, 0.0, 5.0]);
        path.line([8.0, 0.0, -4.0]).turn([0.0, 0.0], sense * 2.0 * PI, 0.0);
        path.line([9.0, 0.0, -4.0]).turn([0.0, 0.0], sense * 2.0 * PI, 0.0);
        let map = run(&path, &job(vec![flat(6.0)], vec![block([-20.0, -20.0, -10.0], [20.0, 20.0, 0.0])]), 0.1, 1.0);
        // Law of cosines: the wall of radius 11 meets the cutter circle (radius 3 about 9) where
        // cos θ = (11² − 9² − 3²) / (2·9·3), θ from the outward radius.
        let theta = ((121.0f64 - 81.0 - 9.0) / 54.0).acos();
        let (entry, exit) = if sense > 0.0 { (PI - theta, PI) } else { (0.0, theta) };
        let found = errors(&map, 3, entry, exit, 8.0);
        let p99 = found[found.len() * 99 / 100];
        assert!(found.len() >= 2 && p99 < 0.75, "sense {sense}: {found:?}");
        let ring = PI * (12.0f64 * 12.0 - 5.0 * 5.0) * 4.0;
        assert!((map.removed_mm3 / ring - 1.0).abs() < 1e-3, "{} {ring}", map.removed_mm3);
    }
}

#[test]
fn a_ball_slot_removes_its_section() {
    for slope in [0.0f64, 15.0, -15.0, 45.0, -60.0] {
        let (sin, cos) = slope.to_radians().sin_cos();
        let at = |u: f64| [u * cos, 0.0, -2.0 + u * sin];
        let mut path = Path::from(at(-30.0));
        path.line(at(30.0));
        let map = run(&path, &job(vec![ball(6.0)], vec![block([-5.0, -10.0, -60.0], [5.0, 10.0, 0.0])]), 0.1, 0.5);
        let stations: f64 = volume_of(&map, 0);
        assert!((stations / map.removed_mm3 - 1.0).abs() < 0.01, "{slope}: {stations} against {}", map.removed_mm3);
    }
}

#[test]
fn planes_and_helices_are_swept() {
    let mut path = Path::from([0.0, 0.0, 10.0]);
    path.line([5.0, 0.0, 1.0]).turn([0.0, 0.0], 6.0 * PI, -6.0).turn([0.0, 0.0], 2.0 * PI, 0.0);
    let map = run(&path, &job(vec![flat(6.0)], vec![block([-20.0, -20.0, -10.0], [20.0, 20.0, 0.0])]), 0.1, 0.5);
    let hole = PI * (64.0 - 4.0) * 5.0;
    assert!((map.removed_mm3 / hole - 1.0).abs() < 2e-3, "{} {hole}", map.removed_mm3);
    println!("helix {} turn {} removed {}", volume_of(&map, 1), volume_of(&map, 2), map.removed_mm3);
    let sum = volume_of(&map, 1) + volume_of(&map, 2);
    assert!((sum / map.removed_mm3 - 1.0).abs() < 5e-3, "{sum} {}", map.removed_mm3);

    // A quarter turn in ZX, ball: a groove along a curved path.
    let mut path = Path::from([-10.0, 0.0, 0.0]);
    path.arc(Plane::Zx, [10.0, 0.0, 0.0], [0.0, 0.0, 0.0], -PI);
    let ballast = job(vec![ball(6.0)], vec![block([-20.0, -10.0, -20.0], [20.0, 10.0, 0.0])]);
    let map = run(&path, &ballast, 0.1, 0.5);
    let sum = volume_of(&map, 0);
    assert!((sum / map.removed_mm3 - 1.0).abs() < 5e-3, "{sum} {}", map.removed_mm3);
}

#[test]
fn air_is_clear_only_beyond_the_clearance() {
    let mut path = Path::from([-10.0, 0.0, 1.0]);
    path.line([50.0, 0.0, 1.0]).line([50.0, 0.0, 4.0]).line([-10.0, 0.0, 4.0]);
    let mut job = job(vec![flat(10.0)], vec![block([0.0, -20.0, -20.0], [40.0, 20.0, 0.0])]);
    job.stocks[0].uncertainty_mm = 2.0;
    let map = run(&path, &job, 0.2, 1.0);
    let over: Vec<bool> = stations(&map, 0).iter().map(|s| s.flags.clear_air).collect();
    assert!(over.contains(&false) && stations(&map, 0).iter().all(|s| s.arc_count == 0));
    assert!(stations(&map, 2).iter().all(|s| s.flags.clear_air));
    let shut: f64 =
        stations(&map, 0).iter().filter(|s| !s.flags.clear_air).map(feedwright::engage::Station::length_mm).sum();
    assert!((shut - (40.0 + 2.0 * 7.0)).abs() < 3.0, "{shut}");
    assert_eq!(map.removed_mm3, 0.0);
}

/// A fin of 0.04 mm between two slots, thinner than a cell of 0.2 mm: no height around it tells how high it stands, yet a third pass along it
/// meets it over the full depth wherever it meets it.
#[test]
fn a_fin_thinner_than_a_cell_is_met_over_its_whole_height() {
    let depth = 2.8;
    let mut met = 0;
    for offset in [0.0, 0.03, 0.06, 0.09, 0.12, 0.15, 0.18] {
        let at = |x: f64, y: f64| [x, y + offset, -depth];
        let mut path = Path::from(at(-10.0, 0.0));
        path.line(at(50.0, 0.0))
            .line(at(50.0, 10.04))
            .line(at(-10.0, 10.04))
            .line(at(-10.0, 5.02))
            .line(at(30.0, 5.02));
        let map = run(&path, &job(vec![flat(10.0)], vec![block([0.0, -20.0, -20.0], [40.0, 30.0, 0.0])]), 0.2, 1.0);
        for station in stations(&map, 4).iter().filter(|station| station.to_mm > 20.0 && station.arc_count > 0) {
            let deep = station.axial_depth_mm;
            assert!((f64::from(deep) - depth).abs() < 0.02, "{deep} mm at {offset}, {:.2}", station.from_mm);
            met += 1;
        }
    }
    assert!(met > 0);
}

/// A cutter whose tip is below the stock cuts all of the stock and nothing below it: slots and side cuts through a plate of 8 mm, beside a thicker
/// one, and a ramp that leaves it.
#[test]
fn a_cut_through_the_stock_is_met_from_its_bottom_up() {
    let plate = || block([0.0, -20.0, -8.0], [40.0, 20.0, 0.0]);
    let thicker = || block([0.0, 20.0, -12.0], [40.0, 60.0, 0.0]);
    // Where the curved part is below the stock, ball and bull are as wide as the flat one.
    for (tool, below) in [(flat(10.0), 0.0), (ball(10.0), 5.0), (bull(10.0, 2.0), 2.0)] {
        for tip in [0.001, 0.2, 0.3, 0.5, 3.0, 8.0].map(|more| -8.0 - below - more) {
            for (centre, width) in [(0.0, 10.0), (-24.0, 1.0)] {
                let mut path = Path::from([-10.0, centre, tip]);
                path.line([50.0, centre, tip]);
                for stocks in [vec![plate()], vec![plate(), thicker()]] {
                    let map = run(&path, &job(vec![tool.clone()], stocks), 0.1, 1.0);
                    let whole = 40.0 * 8.0 * width;
                    assert!(
                        (volume_of(&map, 0) / whole - 1.0).abs() < 3e-3,
                        "{tip}: {} for {whole}",
                        volume_of(&map, 0)
                    );
                    let middle = stations(&map, 0).iter().find(|s| s.to_mm > 30.0).unwrap();
                    assert!((f64::from(middle.axial_depth_mm) + tip).abs() < 0.01, "{tip}: {}", middle.axial_depth_mm);
                }
            }
        }
    }
    // Astride the two plates: one half of the slot 8 mm deep, the other to 12 mm.
    let mut path = Path::from([-10.0, 20.0, -13.0]);
    path.line([50.0, 20.0, -13.0]);
    let map = run(&path, &job(vec![flat(10.0)], vec![plate(), thicker()]), 0.1, 1.0);
    let whole = 40.0 * 5.0 * (8.0 + 12.0);
    assert!((volume_of(&map, 0) / whole - 1.0).abs() < 3e-3, "{} for {whole}", volume_of(&map, 0));
    // Down through the plate: from 4 mm above its lower face to 4 mm below.
    let mut path = Path::from([0.0, 0.0, -4.0]);
    path.line([40.0, 0.0, -12.0]);
    let map = run(&path, &job(vec![flat(10.0)], vec![block([-20.0, -20.0, -8.0], [60.0, 20.0, 0.0])]), 0.1, 1.0);
    let whole = removed_by_ramp(4.0, 12.0, 8.0);
    assert!((map.removed_mm3 / whole - 1.0).abs() < 0.01, "{} for {whole}", map.removed_mm3);
    // The mill stands in the plate to begin with.
    let begun = PI * 25.0 * 4.0;
    assert!((volume_of(&map, 0) / (whole - begun) - 1.0).abs() < 0.02, "{} for {}", volume_of(&map, 0), whole - begun);
}

/// Volume that a flat mill of 10 mm removes of a plate on a line 40 mm long on which its tip goes down from one depth to another, mm³: over the
/// places of the plate the greatest depth of the tip while the mill is above them, but no more than the plate.
fn removed_by_ramp(from: f64, to: f64, plate: f64) -> f64 {
    let cell = 0.05;
    let depth = |x: f64, y: f64| {
        let half = (25.0 - y * y).max(0.0).sqrt();
        let last = (x + half).min(40.0);
        if last < (x - half).max(0.0) { 0.0 } else { (from + (to - from) * last / 40.0).min(plate) }
    };
    let places = |n: usize, first: f64| (0..n).map(move |k| first + (k as f64 + 0.5) * cell);
    places(1000, -5.0)
        .flat_map(|x| places(200, -5.0).map(move |y| (x, y)))
        .map(|(x, y)| depth(x, y) * cell * cell)
        .sum()
}

/// A wall that is roughed and finished at one depth and then at the next, 0.26 mm apart with cells of 0.4 mm: the second finishing cut takes what it
/// takes at its own depth, wherever the wall lies among the cells.
#[test]
fn a_wall_that_was_finished_above_is_not_cut_there_again() {
    let (length, radius, left, depth) = (60.0, 6.0, 0.26, 4.0);
    let each = length * left * depth;
    for (offset, along_y) in (0..8).map(|k| 0.05 * f64::from(k)).flat_map(|offset| [(offset, false), (offset, true)]) {
        let at = |u: f64, v: f64, z: f64| if along_y { [v + offset, u, z] } else { [u, v + offset, z] };
        let [rough, finish] = [left, 0.0].map(|more| 20.0 + radius + more);
        let mut path = Path::from(at(-10.0, rough, 9.0));
        for z in [-depth, -2.0 * depth] {
            for v in [rough, finish] {
                path.line(at(-10.0, v, 5.0)).line(at(-10.0, v, z)).line(at(70.0, v, z)).line(at(70.0, v, 5.0));
            }
        }
        let block = block([0.0, 0.0, -20.0], [60.0, 60.0, 0.0]);
        let map = run(&path, &job(vec![flat(2.0 * radius)], vec![block]), 0.4, 1.0);
        for index in [6, 14] {
            let found = volume_of(&map, index);
            assert!((found / each - 1.0).abs() < 0.01, "{offset} {along_y}: {found} for {each}");
        }
    }
}

/// The same on a round wall of chords of 0.8 mm, which begin elsewhere at the second depth: the two walls differ by the height of the chords, 2 µm.
#[test]
fn a_wall_of_chords_that_was_finished_above_is_not_cut_there_again() {
    let block = block([-50.0, -50.0, -20.0], [50.0, 50.0, 0.0]);
    let (wall, left, depth, turn) = (40.0, 0.26, 4.0, 2.0);
    let chords = 80;
    for offset in (0..8).map(|k| 0.05 * f64::from(k)) {
        let mut path = Path::from([offset, 0.0, 9.0]);
        let mut finishes = Vec::new();
        for (z, begin) in [(-depth, 0.0), (-2.0 * depth, -0.013)] {
            for more in [left, 0.0] {
                let radius = wall - more - 6.0;
                let at = |k: i32, z: f64| {
                    let (sin, cos) = (begin + turn * f64::from(k) / f64::from(chords)).sin_cos();
                    [offset + radius * cos, radius * sin, z]
                };
                path.line(at(0, 5.0)).line(at(0, z));
                for k in 1..=chords {
                    path.line(at(k, z));
                }
                path.line(at(chords, 5.0));
                if more == 0.0 {
                    finishes.push(path.toolpath.moves.len());
                }
            }
        }
        let map = run(&path, &job(vec![flat(12.0)], vec![block.clone()]), 0.4, 1.0);
        let taken =
            |end: usize| (end - 1 - chords as usize + 10..end - 11).map(|index| volume_of(&map, index as u32)).sum();
        let [first, second]: [f64; 2] = [taken(finishes[0]), taken(finishes[1])];
        assert!((second / first - 1.0).abs() < 0.03, "{offset}: {second} for {first}");
    }
}

/// Levels that each leave 0.05 mm more, or less, than the one below, finished along the whole height or each by itself from below: what the last cut
/// takes is the strip that is left beside it, level by level.
#[test]
fn a_wall_in_steps_is_finished_of_what_each_step_left() {
    let (length, radius, levels, high, step) = (60.0, 5.0, 10, 0.75, 0.05);
    let deep = f64::from(levels) * high;
    for (offset, growing) in (0..8).map(|k| 0.05 * f64::from(k)).flat_map(|offset| [(offset, true), (offset, false)]) {
        let mut path = Path::from([-10.0, offset, 9.0]);
        let mut pass = |v: f64, z: f64| {
            path.line([-10.0, v, 5.0]).line([-10.0, v, z]).line([70.0, v, z]).line([70.0, v, 5.0]);
        };
        // The wall is at y = 20; stock is left on it, most at the bottom where it grows.
        for k in 1..=levels {
            let left = step * f64::from(if growing { k } else { levels + 1 - k });
            pass(20.0 + offset + radius + left, -high * f64::from(k));
        }
        pass(20.0 + offset + radius, -deep);
        let each: f64 = (1..=levels).map(|k| length * high * step * f64::from(k)).sum();
        // Where less is left below, the levels above are cut as deep by those below them.
        let most = length * deep * step;
        let block = block([0.0, 0.0, -20.0], [60.0, 60.0, 0.0]);
        let map = run(&path, &job(vec![flat(2.0 * radius)], vec![block]), 0.4, 1.0);
        let found = volume_of(&map, 4 * levels as u32 + 2);
        let expected = if growing { each } else { most };
        assert!((found / expected - 1.0).abs() < 0.02, "{offset} {growing}: {found} for {expected}");
    }
}

/// A thin rib in the way of a small mill, wherever it lies between places at which the path is looked at, and rows of ribs at their distance of 1 mm:
/// removed is what stands.
#[test]
fn ribs_between_the_places_looked_at_are_met() {
    let block = block([-6.0, -6.0, -5.0], [6.0, 6.0, 0.0]);
    let mill = |number: u32, diameter: f64| tool(number, Shape::Flat, Profile::flat(diameter, 5.0));
    let tools = || vec![flat(6.0), mill(2, 1.0), mill(3, 0.6), mill(4, 2.0)];
    for at in (0..10).map(|k| 0.1 * f64::from(k)) {
        // Two passes leave a rib 0.2 mm wide and 1 mm high; a mill of 1 mm goes 0.2 mm deeper across it, its front over the whole rib.
        let mut path = Path::from([-2.5 + at, -12.0, 5.0]);
        for x in [-2.5 + at, 3.7 + at] {
            path.line([x, -12.0, 5.0]).line([x, -12.0, -1.0]).line([x, 12.0, -1.0]).line([x, 12.0, 5.0]);
        }
        path.set_tool(2);
        path.line([-4.0, 0.0, 5.0]).line([-4.0, 0.0, -1.2]).line([4.0, 0.0, -1.2]);
        let map = run(&path, &job(tools(), vec![block.clone()]), 1.0 / 30.0, 1.0);
        let (found, expected) = (volume_of(&map, 10), 8.0 * 0.2 + 0.2);
        assert!((found / expected - 1.0).abs() < 0.02, "{at}: {found} for {expected}");
    }
    for at in (0..5).map(|k| 0.2 * f64::from(k)) {
        // Slots 0.6 mm wide at a distance of 1 mm; the second pass of a mill of 2 mm across takes 0.4 mm of each rib and of the sides.
        let mut path = Path::from([-5.5 + at, -12.0, 5.0]);
        path.set_tool(3);
        for x in (0..11).map(|k| -5.5 + at + f64::from(k)) {
            path.line([x, -12.0, 5.0]).line([x, -12.0, -1.0]).line([x, 12.0, -1.0]).line([x, 12.0, 5.0]);
        }
        path.set_tool(4);
        for y in [0.0, 0.4] {
            path.line([-9.0, y, 5.0]).line([-9.0, y, -1.0]).line([9.0, y, -1.0]).line([9.0, y, 5.0]);
        }
        let map = run(&path, &job(tools(), vec![block.clone()]), 1.0 / 30.0, 1.0);
        let (found, expected) = (volume_of(&map, 44 + 6), (12.0 - 11.0 * 0.6) * 0.4);
        assert!((found / expected - 1.0).abs() < 0.02, "{at}: {found} for {expected}");
    }
}

/// The same in a round pocket, and with the second depth finished by a smaller cutter.
#[test]
fn a_round_wall_that_was_finished_above_is_not_cut_there_again_by_whichever_cutter() {
    let block = block([-30.0, -30.0, -20.0], [30.0, 30.0, 0.0]);
    let second_tool = tool(2, Shape::Flat, Profile::flat(10.0, 30.0));
    let (wall, left, depth) = (20.0, 0.26, 4.0);
    let ring = PI * (wall * wall - (wall - left) * (wall - left)) * depth;
    for (offset, second) in (0..8).map(|k| 0.05 * f64::from(k)).flat_map(|offset| [(offset, 1), (offset, 2)]) {
        let mut path = Path::from([offset, 0.0, 9.0]);
        for (z, finisher) in [(-depth, 1), (-2.0 * depth, second)] {
            for (number, more) in [(1, left), (finisher, 0.0)] {
                let radius = wall - more - if number == 1 { 6.0 } else { 5.0 };
                path.set_tool(number);
                path.line([offset + radius, 0.0, 5.0]).line([offset + radius, 0.0, z]);
                path.turn([offset, 0.0], 2.0 * PI, 0.0).line([offset + radius, 0.0, 5.0]);
            }
        }
        let map = run(&path, &job(vec![flat(12.0), second_tool.clone()], vec![block.clone()]), 0.4, 1.0);
        for index in [6, 14] {
            let found = volume_of(&map, index);
            assert!((found / ring - 1.0).abs() < 0.05, "{offset} {second}: {found} for {ring}");
        }
    }
}
