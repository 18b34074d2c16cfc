//! Entry and exit angles, removal rates and volumes against closed forms: every kind of cutter, cells of 0.1 and 0.2 mm,
//! straight at arbitrary angles to the grid and along arcs both ways. Promised at 0.1 mm: angles to 0.01° (median), 0.75°
//! (99 %) and 3° (worst); removal over any millimetre of path to 0.3 %.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

mod engage_common;
use engage_common::oracle::*;
use engage_common::*;
use feedwright::engage::{EngagementMap, Station};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const MILLS: [Mill; 6] =
    [Mill::Flat(3.0), Mill::Flat(5.0), Mill::Flat(10.0), Mill::Ball(3.0), Mill::Ball(5.0), Mill::Bull(5.0, 2.0)];
const CELLS: [f64; 2] = [0.1, 0.2];

/// What was found wrong, over many cuts.
#[derive(Default)]
struct Found {
    angles: Vec<f64>,
    rates: Vec<(f64, String)>,
}

impl Found {
    fn angles_of(
        &mut self,
        map: &EngagementMap,
        stations: &[Station],
        [from, to]: [f64; 2],
        at: &impl Fn(f64) -> ([f64; 3], [f64; 3]),
        uncut: &impl Fn(f64, f64, f64) -> bool,
        what: &str,
    ) {
        let stations = inside(stations, from, to);
        assert!(!stations.is_empty(), "{what}: no station");
        for station in stations {
            assert!(station.arc_count > 0, "{what}: nothing cut at {}", station.from_mm);
            let new = deviations(map, 1, station, [from, to], at, uncut);
            if let Some(bad) = new.iter().find(|e| **e > 1.0) {
                println!("{what}: {bad:.2}° at {:.3}", station.from_mm);
            }
            self.angles.extend(new);
        }
    }
    fn check(mut self, name: &str) {
        let [median, p99, worst] = if self.angles.is_empty() { [0.0; 3] } else { quantiles(&mut self.angles) };
        println!("{name}: {} angles, median {median:.5}°, 99 % {p99:.4}°, worst {worst:.3}°", self.angles.len());
        self.rates.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (rate, what) in self.rates.iter().take(4) {
            println!("    {what}: removal over 1 mm off by {:.3} %", 100.0 * rate);
        }
        assert!(median <= 0.01 && p99 <= 0.75 && worst <= 3.0, "{name}: {median} {p99} {worst}");
        if let Some((rate, what)) = self.rates.first() {
            assert!(*rate <= 3e-3, "{name}: {what}: removal over 1 mm off by {:.3} %", 100.0 * rate);
        }
    }
}

fn inside(stations: &[Station], from: f64, to: f64) -> &[Station] {
    let first = stations.partition_point(|s| s.to_mm <= from + 1e-9);
    let last = stations.partition_point(|s| s.from_mm < to - 1e-9);
    &stations[first..last]
}

/// Second pass at a radial depth beside a first one, straight.
fn beside_a_wall(mill: Mill, cell: f64, degrees: f64, radial: f64, found: &mut Found) {
    let r = mill.radius();
    let at = |u: f64, v: f64| turned(degrees, u, v, -2.3);
    let mut path = Path::from(at(-45.0, 0.0));
    path.line(at(45.0, 0.0))
        .line(at(45.0, -45.0))
        .line(at(-45.0, -45.0))
        .line(at(-45.0, radial))
        .line(at(45.0, radial));
    let half = 2.7 * r + 4.0;
    let job = job(vec![mill.tool()], vec![block([-half, -half, -10.0], [half, half, 0.0])]);
    let map = run(&path, &job, cell, 0.7);
    let what = format!("{mill:?} cell {cell} {degrees}° radial {radial}");
    let wall = Way::Segment(xy(at(-45.0, 0.0)), xy(at(45.0, 0.0)), -2.3);
    let uncut = |x: f64, y: f64, z: f64| z < 0.0 && x.abs().max(y.abs()) < half && z < left_by(mill, &wall, [x, y]);
    let place = |s: f64| (at(s - 45.0, radial), turned(degrees, 1.0, 0.0, 0.0));
    let range = [45.0 - 2.0, 45.0 + 2.0];
    found.angles_of(&map, stations(&map, 4), range, &place, &uncut, &what);
    let depth = |w: f64| (mill.lowest((w + radial).abs()) - 2.3).min(0.0) - (mill.lowest(w.abs()) - 2.3).min(0.0);
    let section = integral(-r, r, |w| depth(w).max(0.0));
    found.rates.push((worst_rate(stations(&map, 4), range, section), what));
}

#[test]
fn straight_cuts_at_any_angle() {
    for cell in CELLS {
        let mut found = Found::default();
        for (k, mill) in MILLS.into_iter().enumerate() {
            for (j, degrees) in [0.0, 17.0, 45.0, 71.5, 90.0, 133.3, 200.0, 301.7].into_iter().enumerate() {
                let r = mill.radius();
                beside_a_wall(mill, cell, degrees, [0.1, 0.3 * r, r, 1.7 * r][(j + k) % 4], &mut found);
            }
        }
        found.check(&format!("straight, cell {cell}"));
    }
}

#[test]
fn tapered_and_chamfering_cutters() {
    let mills = [Mill::Taper(3.0, 1.0, 0.17), Mill::Taper(2.0, 0.5, 0.35), Mill::Chamfer(4.0, 0.5, FRAC_PI_2 / 2.0)];
    for cell in CELLS {
        let mut found = Found::default();
        for (k, mill) in mills.into_iter().enumerate() {
            for (j, degrees) in [0.0, 17.0, 45.0, 133.3, 301.7].into_iter().enumerate() {
                beside_a_wall(mill, cell, degrees, [0.1, 0.4, 0.9, 1.6][(j + k) % 4], &mut found);
            }
        }
        found.check(&format!("tapers and chamfers, cell {cell}"));
    }
}

/// A second turn at a radial depth outside or inside a first one.
fn around(mill: Mill, cell: f64, sense: f64, radial: f64, found: &mut Found) {
    let r = mill.radius();
    let first = 1.6 * r + 1.0 - radial.min(0.0);
    let second = first + radial;
    let z = -2.3;
    let mut path = Path::from([first, 0.0, 5.0]);
    path.line([first, 0.0, z]).turn([0.0; 2], sense * TAU, 0.0).line([second, 0.0, z]).turn([0.0; 2], sense * TAU, 0.0);
    let reach = second.max(first) + r + 2.0;
    let job = job(vec![mill.tool()], vec![block([-reach, -reach, -10.0], [reach, reach, 0.0])]);
    let map = run(&path, &job, cell, 0.7);
    let what = format!("{mill:?} cell {cell} sense {sense} radial {radial}");
    let wall = Way::Arc([0.0; 2], first, 0.0, TAU, z);
    let uncut = |x: f64, y: f64, z: f64| z < 0.0 && z < left_by(mill, &wall, [x, y]);
    let place = |s: f64| {
        let (sin, cos) = (sense * s / second).sin_cos();
        ([second * cos, second * sin, z], [-sense * sin, sense * cos, 0.0])
    };
    let range = [FRAC_PI_2 * second, 1.5 * PI * second];
    found.angles_of(&map, stations(&map, 3), range, &place, &uncut, &what);
    let depth = |w: f64| (mill.lowest((w + radial).abs()) + z).min(0.0) - (mill.lowest(w.abs()) + z).min(0.0);
    let section = integral(-r, r, |w| depth(w).max(0.0) * (1.0 + w / second));
    found.rates.push((worst_rate(stations(&map, 3), range, section), what));
}

#[test]
fn arcs_both_ways_outside_and_inside() {
    for cell in CELLS {
        let mut found = Found::default();
        for (k, mill) in MILLS.into_iter().enumerate() {
            let r = mill.radius();
            for (j, (sense, side)) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)].into_iter().enumerate() {
                around(mill, cell, sense, side * [0.1, 0.25 * r, 0.6 * r][(j + k) % 3], &mut found);
            }
        }
        found.check(&format!("arcs, cell {cell}"));
    }
}

#[test]
fn a_corner_follows_the_exact_law() {
    // A first pass goes along x and turns up along y at x = 0; the second runs `radial` outside it.
    let mut found = Found::default();
    for (mill, degrees, radial) in
        [(Mill::Flat(3.0), 0.0, 1.0), (Mill::Flat(5.0), 33.0, 0.5), (Mill::Ball(3.0), 12.0, 0.8)]
    {
        let at = |u: f64, v: f64| turned(degrees, u, v, -3.0);
        let mut path = Path::from(at(-40.0, 0.0));
        path.line(at(0.0, 0.0))
            .line(at(0.0, 40.0))
            .line(at(-40.0, 40.0))
            .line(at(-40.0, -radial))
            .line(at(radial, -radial));
        let job = job(vec![mill.tool()], vec![block([-16.0, -16.0, -10.0], [16.0, 16.0, 0.0])]);
        let map = run(&path, &job, 0.1, 0.1);
        let ways = [
            Way::Segment(xy(at(-40.0, 0.0)), xy(at(0.0, 0.0)), -3.0),
            Way::Segment(xy(at(0.0, 0.0)), xy(at(0.0, 40.0)), -3.0),
        ];
        let uncut = |x: f64, y: f64, z: f64| z < 0.0 && ways.iter().all(|way| z < left_by(mill, way, [x, y]));
        let place = |s: f64| (at(s - 40.0, -radial), turned(degrees, 1.0, 0.0, 0.0));
        let near = [35.0, 40.0 + radial - 0.2];
        found.angles_of(&map, stations(&map, 4), near, &place, &uncut, &format!("{mill:?} {degrees}°"));
    }
    found.check("corner");
}

#[test]
fn a_circle_smaller_than_the_cutter_overlaps_itself() {
    // The ray from the centre at half the turned angle plus a half turn bounds what the start of the arc has not reached.
    let (mut found, radius, z) = (Found::default(), 2.0, -3.0);
    for sense in [1.0, -1.0] {
        let mill = Mill::Flat(5.0);
        let mut path = Path::from([radius, 0.0, 5.0]);
        path.line([radius, 0.0, z]).turn([0.0; 2], sense * 3.0 * PI, 0.0);
        let job = job(vec![mill.tool()], vec![block([-16.0, -16.0, -10.0], [16.0, 16.0, 0.0])]);
        let map = run(&path, &job, 0.1, 0.1);
        let turn = stations(&map, 1);
        for station in inside(turn, 0.3 * radius, 1.7 * PI * radius) {
            let law = |s: f64| {
                // In the frame of the turn: the cutter at angle θ, the ray at π + θ/2.
                let theta = s / radius;
                let ray = PI + 0.5 * theta;
                let along = radius * (ray - theta).cos();
                let reach = along + (along * along + 25.0 - radius * radius).sqrt();
                let (x, y) = (reach * ray.cos() - radius * theta.cos(), reach * ray.sin() - radius * theta.sin());
                let beta = y.atan2(x) - (theta + FRAC_PI_2);
                let phi = FRAC_PI_2 - (beta - TAU * (beta / TAU).round());
                [phi.max(0.0), PI]
            };
            for arc in map.arcs_of(station) {
                let [open, wall] = law(station.from_mm);
                let (entry, exit) = if sense > 0.0 { (open, wall) } else { (PI - wall, PI - open) };
                found.angles.push((f64::from(arc.entry_rad) - entry).abs().to_degrees());
                found.angles.push((f64::from(arc.exit_rad) - exit).abs().to_degrees());
            }
        }
        let again = removed_between(turn, TAU * radius, 3.0 * PI * radius);
        assert!(again.abs() < 1e-9, "the second time round removes {again}");
        let ring = PI * ((radius + 5.0) * (radius + 5.0) - 25.0) * 3.0;
        let sum = removed_between(turn, 0.0, TAU * radius);
        println!("sense {sense}: {sum:.2} of {ring:.2} mm³");
        assert!((sum / ring - 1.0).abs() < 3e-3, "{sum} {ring}");
    }
    found.check("overlapping arc");
}

#[test]
fn chains_of_short_moves_cut_like_one_move() {
    let mut found = Found::default();
    for (mill, degrees) in [(Mill::Flat(3.0), 17.0), (Mill::Ball(3.0), 71.5), (Mill::Bull(5.0, 2.0), 0.0)] {
        for radial in [0.1, 1.0] {
            let at = |u: f64, v: f64| turned(degrees, u, v, -1.5);
            let mut path = Path::from(at(-20.0, 0.0));
            path.line(at(20.0, 0.0)).line(at(20.0, -30.0)).line(at(-20.0, -30.0)).line(at(-20.0, radial));
            let before = path.toolpath.moves.len() as u32;
            for k in 1..=800 {
                path.line(at(-20.0 + 0.05 * f64::from(k), radial));
            }
            let job = job(vec![mill.tool()], vec![block([-9.0, -9.0, -10.0], [9.0, 9.0, 0.0])]);
            let map = run(&path, &job, 0.1, 1.0);
            let wall = Way::Segment(xy(at(-20.0, 0.0)), xy(at(20.0, 0.0)), -1.5);
            let uncut = |x: f64, y: f64, z: f64| z < 0.0 && z < left_by(mill, &wall, [x, y]);
            let what = format!("{mill:?} {degrees}° radial {radial}");
            let mut sum = 0.0;
            for k in 380..420 {
                let place = |s: f64| (at(-20.0 + 0.05 * f64::from(k) + s, radial), turned(degrees, 1.0, 0.0, 0.0));
                found.angles_of(&map, stations(&map, before + k), [0.0, 0.05], &place, &uncut, &what);
                sum += volume_of(&map, before + k);
            }
            let r = mill.radius();
            let depth =
                |w: f64| (mill.lowest((w + radial).abs()) - 1.5).min(0.0) - (mill.lowest(w.abs()) - 1.5).min(0.0);
            let section = integral(-r, r, |w| depth(w).max(0.0));
            found.rates.push(((sum / (2.0 * section) - 1.0).abs(), what));
        }
    }
    found.check("chains of 0.05 mm");
}

#[test]
fn a_ball_on_slopes_from_0_to_75_degrees() {
    let mut found = Found::default();
    let mill = Mill::Ball(3.0);
    for (k, slope) in [0.0f64, 15.0, 30.0, 45.0, 60.0, 75.0].into_iter().enumerate() {
        for sense in [1.0, -1.0] {
            let heading = 23.0 * k as f64;
            let (rise, across) = (sense * slope.to_radians().sin(), slope.to_radians().cos());
            let tangent = turned(heading, across, 0.0, rise);
            let at = |s: f64, v: f64| turned(heading, s * across, v, -14.0 + s * rise);
            // The groove of a first pass, then one 1.2 mm beside it, in a block that leaves 3 mm around it to cut.
            let mut path = Path::from(at(-30.0, 0.0));
            path.line(at(30.0, 0.0)).rapid([0.0, 0.0, 60.0]).rapid(at(-30.0, 1.2)).line(at(30.0, 1.2));
            let job = job(vec![mill.tool()], vec![block([-7.0, -7.0, -40.0], [7.0, 7.0, 2.0])]);
            let map = run(&path, &job, 0.1, 0.5);
            let groove = Way::Slope(at(0.0, 0.0), tangent);
            let uncut = |x: f64, y: f64, z: f64| {
                z < 2.0 && x.abs() < 7.0 && y.abs() < 7.0 && z < left_by(mill, &groove, [x, y])
            };
            let place = |s: f64| (at(s - 30.0, 1.2), tangent);
            found.angles_of(&map, stations(&map, 3), [28.0, 32.0], &place, &uncut, &format!("slope {}", sense * slope));
        }
    }
    found.check("ball on slopes");
}

#[test]
fn a_finishing_pass_over_the_scallops_of_an_earlier_one() {
    // Rows of a ball of 10 mm, 2 mm apart, then a row of a ball of 6 mm lower down, along and across them.
    let mut found = Found::default();
    let mut lacking = Vec::new();
    let (rough, fine) = (Mill::Ball(5.0), Mill::Ball(3.0));
    for degrees in [0.0, 40.0, 90.0] {
        let mut path = Path::from([-20.0, -8.0, -1.0]);
        let mut ways = Vec::new();
        for row in 0..=8 {
            let y = -8.0 + 2.0 * f64::from(row);
            let (from, to) = if row % 2 == 0 { (-20.0, 20.0) } else { (20.0, -20.0) };
            path.line([from, y, -1.0]).line([to, y, -1.0]);
            ways.push(Way::Segment([from, y], [to, y], -1.0));
        }
        let at = |s: f64| turned(degrees, s, 0.37, -1.15);
        path.rapid([0.0, 0.0, 40.0]);
        let mut tool = fine.tool();
        tool.number = 2;
        path.set_tool(2);
        path.rapid(at(-20.0)).line(at(20.0));
        let index = path.toolpath.moves.len() as u32 - 1;
        let job = job(vec![rough.tool(), tool], vec![block([-9.0, -9.0, -10.0], [9.0, 9.0, 0.0])]);
        let map = run(&path, &job, 0.1, 0.2);
        let uncut = |x: f64, y: f64, z: f64| z < 0.0 && ways.iter().all(|way| z < left_by(rough, way, [x, y]));
        let place = |s: f64| (at(s - 20.0), turned(degrees, 1.0, 0.0, 0.0));
        // What is met changes along the path, and the arcs of a station are those of all its places.
        for station in inside(stations(&map, index), 16.0, 24.0) {
            lacking.push(missing(&map, 2, station, &place, &uncut));
        }
        let section = |s: f64| {
            integral(-3.0, 3.0, |w| {
                let p = turned(degrees, s, 0.37 + w, 0.0);
                let before = ways.iter().map(|way| left_by(rough, way, xy(p))).fold(0.0, f64::min);
                (before - (fine.lowest(w.abs()) - 1.15)).max(0.0)
            })
        };
        // Whole periods of the scallops: what the cutter takes ahead of its axis it does not find there later.
        let length = if degrees == 40.0 { 2.0 * 2.0 / 40f64.to_radians().sin() } else { 8.0 };
        let step = length / 80.0;
        let volume = (0..80).map(|k| section(-4.0 + step * (f64::from(k) + 0.5))).sum::<f64>() * step;
        let rate = removed_between(stations(&map, index), 16.0, 16.0 + length) / volume - 1.0;
        found.rates.push((rate.abs(), format!("scallops at {degrees}°")));
    }
    let [_, p99, worst] = quantiles(&mut lacking);
    println!("over scallops: {} stations lack of their contact 99 % {p99:.5}, worst {worst:.5}", lacking.len());
    assert!(p99 <= 0.01 && worst <= 0.02, "{p99} {worst}");
    found.check("over scallops");
}
