//! What a certificate proves holds: twenty programs (those of `programs/`, by hand, everyday ones; six dialects, mm and inch, several tools,
//! stock that is known and that is not), each with coefficients drawn from the ellipsoid, a stock within its uncertainty, a place on the path
//! and an override. Loads come from the simulation and the force model, which the checker does not use. A draw counts with its largest load over
//! the path. 20,000 draws in the ordinary run (without the two that take most of the time), `FEEDWRIGHT_LONG=1000000` for as many over all.
//!
//! Each program is simulated with a few drawn stocks (two in the ordinary run); coefficients and override are drawn for each load anew. Of the places of a stock
//! those are asked whose load is within a twentieth of the largest of its kind for any of eight draws, forty at most. Half of the simulations look at
//! the places that the certificate rests on; the others at places between them, on rings a quarter as high. No load may be above its limit at either.
//!
//! A station has all that is engaged anywhere on it, so stations at places between are short ([`SPACINGS_MM`]): one that reaches from a station of the
//! certificate into the next would have more than any place of it. An edge winds through a ring and does not enter it as a whole, so for the loads
//! each ring is cut into more of the same arc ([`WOUND`]), but on a cylindrical side, where the force model winds it.

#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::format_collect)]

mod common {
    pub mod certified;
    pub mod draw;
    pub mod everyday;
}

use common::certified::{Case, Written, by_hand};
use common::draw::Draw;
use common::everyday;
use feedwright::engage::{self, EngagedArc, EngagementMap, Station};
use feedwright::force::{Cut, Cutter};
use feedwright::job::{CLOSE_MM, RING_PARTS};
use feedwright::machine::material::{ForceModel, Process};
use feedwright::machine::{Job, LimitKind, Material, Profile, Segment, Slice};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::fs;

/// Draws of the ordinary run.
const ORDINARY: usize = 20_000;
/// Left to the long run: they take as much time as all others, the saddle by its 3,000 blocks, the other by its many low rings.
const LONG_ALONE: [&str; 2] = ["saddle", "waterline finishing, mm"];
/// Spacings of the simulations by turns, mm: that of the certificate, and two between.
const SPACINGS_MM: [f64; 4] = [CLOSE_MM, 0.05, CLOSE_MM, 0.03];
/// Parts into which the simulations cut each ring, each with arcs of its own: those of the certificate, and finer ones between its places.
const PARTS: [u32; 2] = [RING_PARTS, 4 * RING_PARTS];
/// Rings into which one of those is cut for the loads, by the same arcs.
const WOUND: [usize; 2] = [16, 4];
/// Stocks that a program is cut from: what stands for a number, see [`Cutting::of`]. Of a stock that is known the others would be the same again.
const FEW_STOCKS: [usize; 2] = [0, 1];
const ALL_STOCKS: [usize; 6] = [0, 1, 2, 3, 4, 5];
/// Places of a simulation that are asked, at most.
const MOST: usize = 40;
/// Quantiles of χ² at 95 % for 1 and 3 directions, from tables.
const CHI_SQUARED: [f64; 2] = [3.841, 7.815];

/// A setup of others, with what is not known of stock and coefficients, and as this control.
fn unsure(setup: &str, dialect: &str, stock_mm: f64, share: f64) -> String {
    let spoken = setup.lines().map(|line| match line.split(' ').next() {
        Some("dialect") => format!("dialect = \"{dialect}\"\n"),
        Some("uncertainty") => String::new(),
        Some("[stock]") => format!("[stock]\nuncertainty = {stock_mm}\n"),
        Some("[material]") => format!("[material]\nuncertainty = {share}\n"),
        _ => format!("{line}\n"),
    });
    spoken.collect()
}

fn of_project(name: &str, dialect: &str, stock_mm: f64, share: f64) -> Case {
    let [program, setup] =
        [".nc", ".setup.toml"].map(|end| fs::read_to_string(format!("programs/{name}{end}")).unwrap());
    // No certificate speaks about blocks under the block-delete switch.
    let program = program.lines().filter(|line| !line.starts_with('/')).map(|line| format!("{line}\n")).collect();
    Case { name: name.to_owned(), program, setup: unsure(&setup, dialect, stock_mm, share) }
}

/// The everyday programs of these names, each on a control, with a stock and a share of the coefficients that are not sure.
const EVERYDAY: [(&str, &str, f64, f64, &str); 12] = [
    ("contour loops, mm", "linuxcnc", 0.0, 0.1, "force_xy = 250"),
    ("slots from the air, inch", "fanuc", 0.3, 0.1, "force_xy = 400\npower = 900"),
    ("facing in zigzag, mm", "haas", 0.5, 0.05, "force_xy = 500\npower = 1500"),
    ("pocket in a spiral, inch", "fanuc", 0.0, 0.2, "force_xy = 300"),
    ("pocket in circles, mm", "generic", 0.2, 0.1, "force_xy = 300\ntorque = 1.2"),
    ("pocket in zigzag, mm", "haas", 0.0, 0.15, "deflection = 0.03"),
    ("trochoidal slot, mm", "linuxcnc", 0.4, 0.1, "force_xy = 250\nbending_stress = 180"),
    ("ramps to depth, mm", "linuxcnc", 0.2, 0.1, "force_xy = 350\nforce_axial = 250"),
    ("helical bores, inch", "fanuc", 0.0, 0.1, "force_xy = 300\nforce_axial = 300"),
    ("waterline finishing, mm", "haas", 0.1, 0.1, "force_xy = 200\nchip_thickness = { max = 0.05 }"),
    ("contour with arcs, mm", "linuxcnc", 0.3, 0.1, "force_xy = 250\nfeed_per_tooth = 0.15"),
    ("many tools, mm", "linuxcnc", 0.0, 0.1, "force_xy = 300\nforce_axial = 500\npower = 1500"),
];

fn twenty() -> Vec<Case> {
    let mut cases = by_hand();
    cases.push(of_project("pocket", "linuxcnc", 0.3, 0.1));
    // Deflection is not provable with a drill: an edge that cuts while the other does not bends it at any feed.
    let bracket = of_project("bracket", "fanuc", 0.01, 0.1);
    cases.push(Case { setup: bracket.setup.replace("\ndeflection = 0.003", ""), ..bracket });
    cases.push(of_project("saddle", "fanuc", 0.0, 0.1));
    cases.push(siemens());
    let known = everyday::all();
    for (name, dialect, stock_mm, share, limits) in EVERYDAY {
        let own = known.iter().find(|own| own.name == name).unwrap();
        let setup = own.setup.split("[limits]").next().unwrap();
        let setup = format!(
            "{setup}[raise]\nplunges = true\nramps = true\nentries = true\nfinishing = true\n[limits]\n{limits}\nfeed_change = {{ min = 0.02, max = 2 }}\n"
        );
        cases.push(Case {
            name: name.to_owned(),
            program: own.text.clone(),
            setup: unsure(&setup, dialect, stock_mm, share),
        });
    }
    cases
}

/// The first by hand as Siemens writes it.
fn siemens() -> Case {
    let Case { program, setup, .. } = by_hand().swap_remove(0);
    let program = program.replace("G21 G90", "G71 G90").replace("X36 Y9 I6 J0", "X36 Y9 CR=6");
    Case { name: "slots, siemens".to_owned(), program, setup: setup.replace("generic", "siemens") }
}

/// Coefficients of the ellipsoid, half of them on its rim.
fn drawn(job: &Job, draw: &mut Draw) -> (Material, Process) {
    let mut material = job.stocks[0].material.clone();
    let mut process = job.process.clone();
    let depth = if draw.share() < 0.5 { 1.0 } else { draw.share() };
    if process.covariance_of.is_empty() {
        let ForceModel::LinearEdge(k) = &mut material.model else { unreachable!() };
        let sense = if draw.share() < 0.7 { 1.0 } else { -1.0 };
        let by = 1.0 + sense * depth * CHI_SQUARED[0].sqrt() * material.uncertainty.unwrap();
        for k in [&mut k.k_tc, &mut k.k_rc, &mut k.k_ac, &mut k.k_te, &mut k.k_re, &mut k.k_ae] {
            *k *= by;
        }
        return (material, process);
    }
    // A direction of three: k_tc, k_te by their covariance, and the scatter.
    let mut on_ball: Vec<f64> = (0..3).map(|_| draw.between(-1.0, 1.0)).collect();
    let norm = on_ball.iter().map(|x| x * x).sum::<f64>().sqrt();
    for x in &mut on_ball {
        *x *= depth * CHI_SQUARED[1].sqrt() / norm;
    }
    let [[a, b], [_, c]] = [0, 1].map(|i| [0, 1].map(|k| process.covariance[i][k]));
    let lower = [a.sqrt(), b / a.sqrt(), (c - b * b / a).sqrt()];
    let moved = [lower[0] * on_ball[0], lower[1] * on_ball[0] + lower[2] * on_ball[1]];
    let by = 1.0 + process.scatter.unwrap() * on_ball[2];
    let Some(ForceModel::LinearEdge(k)) = &mut process.base else { unreachable!() };
    let [cut, edge] = [(k.k_tc + moved[0]) / k.k_tc * by, (k.k_te + moved[1]) / k.k_te * by];
    for k in [&mut k.k_tc, &mut k.k_rc, &mut k.k_ac] {
        *k *= cut;
    }
    for k in [&mut k.k_te, &mut k.k_re, &mut k.k_ae] {
        *k *= edge;
    }
    (material, process)
}

/// A program cut from a drawn stock.
struct Cutting<'a> {
    written: &'a Written,
    /// Whether it looks between the places that the certificate rests on.
    between: bool,
    map: EngagementMap,
    spacing_mm: f64,
    /// Stations that are asked, with their arcs on `slices`.
    asked: Vec<(usize, Vec<EngagedArc>)>,
    /// The rings of each tool.
    slices: Vec<(u32, Vec<Slice>)>,
}

/// A ring cut into so many of the same length, from below. One of a cylindrical side is whole, and one of a flat bottom, along which an edge has
/// one height.
fn parts(profile: &Profile, ring: &Slice, wound: usize) -> impl Iterator<Item = Slice> {
    let wound = if ring.normal_z == 0.0 || ring.normal_r == 0.0 { 1 } else { wound };
    let outline = &profile.segments[usize::from(ring.segment)];
    let middle = match outline {
        Segment::Line { from, to } => {
            let [[r, z], along] = [[ring.radius_mm, ring.z_mm], *to].map(|[r, z]| [r - from[0], z - from[1]]);
            (r * along[0] + z * along[1]) / (along[0] * along[0] + along[1] * along[1])
        }
        Segment::Arc { centre, from_rad, to_rad, .. } => {
            ((ring.z_mm - centre[1]).atan2(ring.radius_mm - centre[0]) - from_rad) / (to_rad - from_rad)
        }
    };
    let (edge_mm, whole) = (ring.edge_mm / wound as f64, outline.length());
    let own = *ring;
    let outline = *outline;
    (0..wound).map(move |k| {
        let off = (k as f64 + 0.5 - 0.5 * wound as f64) * edge_mm / whole;
        let ([radius_mm, z_mm], [normal_r, normal_z]) = outline.at(middle + off);
        Slice { z_mm, radius_mm, edge_mm, normal_r, normal_z, ..own }
    })
}

/// A tool at a speed, rev/s, with its limits.
type At = (u32, f64, Cutter, Vec<(LimitKind, f64)>);

/// A load above its limit, or near it.
#[derive(Clone)]
struct Found {
    ratio: f64,
    kind: LimitKind,
    station: usize,
}

impl<'a> Cutting<'a> {
    /// With every face of the stock within its uncertainty: two at its largest, one as declared.
    fn of(written: &'a Written, number: usize, draw: &mut Draw) -> Self {
        let most = written.job.stocks[0].uncertainty_mm;
        let mut face = || match number {
            0 | 1 => most,
            2 => 0.0,
            _ => draw.between(-most, most),
        };
        let job = written.job.with_faces_moved(face(), [(); 4].map(|()| face()));
        let spacing_mm = SPACINGS_MM[number % 4];
        let ring_parts = PARTS[number % 2];
        let options = engage::Options { spacing_mm, ring_parts, ..engage::Options::default() };
        let map = engage::engage(&written.toolpath, &job, &options, &|_| ()).unwrap();
        let slices = map.slices.clone();
        let mut own = Self { written, between: number % 2 == 1, map, spacing_mm, asked: Vec::new(), slices };
        let cuts = (0..own.map.stations.len()).filter(|k| own.map.stations[*k].arc_count > 0);
        own.asked = cuts.map(|k| (k, own.map.arcs_of(&own.map.stations[k]).to_vec())).collect();
        let coefficients: Vec<_> = (0..8).map(|_| drawn(&written.job, draw)).collect();
        let tried: Vec<Vec<Found>> = coefficients.par_iter().map(|these| own.loads(these, 1.0)).collect();
        let mut asked: Vec<(f64, usize)> = Vec::new();
        for found in &tried {
            for kind in LimitKind::ALL {
                let of_kind = || found.iter().filter(|of| of.kind == kind);
                let largest = of_kind().map(|of| of.ratio).fold(0.0, f64::max);
                asked.extend(of_kind().map(|of| (of.ratio / largest, of.station)).filter(|(part, _)| *part >= 0.95));
            }
        }
        asked.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut known = HashSet::new();
        let chosen: Vec<usize> =
            asked.into_iter().map(|(_, station)| station).filter(|k| known.insert(*k)).take(MOST).collect();
        own.slices.iter_mut().for_each(|(_, slices)| slices.clear());
        let mut entered = HashMap::new();
        own.asked = chosen.into_iter().map(|k| (k, own.wound(k, WOUND[number % 2], &mut entered))).collect();
        own
    }

    /// The arcs of a station on rings cut into so many, which are entered among the slices: by tool and ring, where its first part is.
    fn wound(&mut self, k: usize, wound: usize, entered: &mut HashMap<(u32, u32), usize>) -> Vec<EngagedArc> {
        let station = &self.map.stations[k];
        let number = self.written.toolpath.moves[station.move_id.ix()].tool;
        let profile = &self.written.job.tool(number).unwrap().profile;
        let known = self.map.slices_of(number);
        let slices = &mut self.slices.iter_mut().find(|(of, _)| *of == number).unwrap().1;
        let mut arcs = Vec::new();
        for arc in self.map.arcs_of(station) {
            let parts: Vec<Slice> = parts(profile, &known[arc.slice as usize], wound).collect();
            let first = *entered.entry((number, arc.slice)).or_insert(slices.len());
            if first == slices.len() {
                slices.extend(&parts);
            }
            arcs.extend((first..first + parts.len()).map(|slice| EngagedArc { slice: slice as u32, ..*arc }));
        }
        arcs
    }

    /// Loads over their limits at all places that are asked.
    fn loads(&self, (material, process): &(Material, Process), factor: f64) -> Vec<Found> {
        let job = &self.written.job;
        let mut cutters: Vec<At> = Vec::new();
        let mut found = Vec::new();
        for (k, arcs) in &self.asked {
            let station: &Station = &self.map.stations[*k];
            let motion = &self.written.toolpath.moves[station.move_id.ix()];
            let (number, rps) = (motion.tool, motion.spin.rps);
            let known = cutters.iter().position(|(of, at, ..)| *of == number && *at == rps);
            let known = known.unwrap_or_else(|| {
                let tool = job.tool(number).unwrap();
                let slices = &self.slices.iter().find(|(of, _)| *of == number).unwrap().1;
                let spindle = &job.machine.spindle;
                let cutter = Cutter::new(tool, material, spindle, process, slices, rps).unwrap();
                let mut limits = job.limits.overridden_by(&tool.limits).loads();
                limits.extend(spindle.power_w.iter().map(|curve| (LimitKind::Power, curve.at(rps))));
                cutters.push((number, rps, cutter, limits));
                cutters.len() - 1
            });
            let (_, _, cutter, limits) = &cutters[known];
            let tangent_z = motion.curve().tangent(0.5 * (station.from_mm + station.to_mm)).z;
            let cut = Cut { arcs, tangent_z, ..Cut::default() };
            let loads = cutter.loads(&cut, factor * motion.feed.mm_s);
            found.extend(limits.iter().map(|(kind, limit)| {
                let ratio = loads.bounded_by(*kind).unwrap() / limit;
                Found { ratio, kind: *kind, station: *k }
            }));
        }
        found
    }

    /// The largest load over its limit of one draw.
    fn draw(&self, draw: &mut Draw) -> Option<Found> {
        let coefficients = drawn(&self.written.job, draw);
        let factor = if draw.share() < 0.7 { 1.0 } else { draw.share() };
        self.loads(&coefficients, factor).into_iter().max_by(|a, b| a.ratio.total_cmp(&b.ratio))
    }

    fn place(&self, found: &Found) -> String {
        let station = &self.map.stations[found.station];
        let line = self.written.toolpath.moves[station.move_id.ix()].line;
        let (name, [from, to]) = (found.kind.name(), [station.from_mm, station.to_mm]);
        format!("{name} {:.4}, line {line}, {from:.2} to {to:.2} mm, every {} mm", found.ratio, self.spacing_mm)
    }
}

/// What came of a program.
struct Row {
    name: String,
    draws: usize,
    /// The largest load over its limit with its place, and how many are above: where the certificate looked, and between.
    largest: [(f64, String); 2],
    above: [usize; 2],
    slower: f64,
}

fn row(number: usize, case: &Case, draws: usize, thorough: bool) -> Row {
    let written = Written::of(case);
    let mut draw = Draw(0x5EED_u64.wrapping_mul(number as u64 + 1));
    draw.share();
    let unsure = written.job.stocks[0].uncertainty_mm > 0.0;
    let stocks = if thorough && unsure { &ALL_STOCKS[..] } else { &FEW_STOCKS };
    let cuttings: Vec<Cutting> = stocks.iter().map(|k| Cutting::of(&written, *k, &mut draw)).collect();
    let each = |k: usize| {
        let mut draw = Draw(((number * draws + k) as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        draw.share();
        let cutting = &cuttings[k % cuttings.len()];
        cutting.draw(&mut draw).map(|found| (k % cuttings.len(), found))
    };
    let found: Vec<(usize, Found)> = (0..draws).into_par_iter().filter_map(each).collect();
    let looked = |k: usize| cuttings[k].between;
    let of = |between: bool| found.iter().filter(move |(k, _)| looked(*k) == between);
    let largest = [false, true].map(|between| {
        let largest = of(between).max_by(|a, b| a.1.ratio.total_cmp(&b.1.ratio));
        largest.map_or_else(Default::default, |(k, found)| (found.ratio, cuttings[*k].place(found)))
    });
    let above = [false, true].map(|between| of(between).filter(|(_, found)| found.ratio > 1.0).count());
    let [certified, plain] = written.seconds;
    Row { name: case.name.clone(), draws: found.len(), largest, above, slower: 100.0 * (certified / plain - 1.0) }
}

#[test]
fn no_draw_exceeds_a_limit_that_was_proven() {
    let count: usize = std::env::var("FEEDWRIGHT_LONG").ok().and_then(|text| text.parse().ok()).unwrap_or(ORDINARY);
    let only = std::env::var("FEEDWRIGHT_ONLY").unwrap_or_default();
    let mut cases = twenty();
    cases.retain(|case| count > ORDINARY || !LONG_ALONE.contains(&case.name.as_str()));
    let asked: Vec<(usize, &Case)> = cases.iter().enumerate().filter(|(_, case)| case.name.contains(&only)).collect();
    let row = |(number, case): &(usize, &Case)| row(*number, case, count / cases.len(), count > ORDINARY);
    let rows: Vec<Row> = asked.par_iter().with_max_len(1).map(row).collect();
    for row in &rows {
        let [(own, _), (between, place)] = &row.largest;
        println!(
            "{:<26}{:>7} draws, {} above, largest {own:.4}; between {} above, largest {between:.4} ({place}); {:+.1} % time",
            row.name, row.draws, row.above[0], row.above[1], row.slower
        );
    }
    let mut slower: Vec<f64> = rows.iter().map(|row| row.slower).collect();
    slower.sort_by(f64::total_cmp);
    let draws: usize = rows.iter().map(|row| row.draws).sum();
    let above = [0, 1].map(|k| rows.iter().map(|row| row.above[k]).sum::<usize>());
    let largest = [0, 1].map(|k| rows.iter().map(|row| row.largest[k].0).fold(0.0, f64::max));
    println!(
        "{draws} draws over {} programs: {} above a limit where the certificate looked (largest {:.4}), {} between (largest {:.4}); slower than with --confidence alone by {:.1} % (median), {:.1} % at most",
        rows.len(),
        above[0],
        largest[0],
        above[1],
        largest[1],
        slower[slower.len() / 2],
        slower[slower.len() - 1]
    );
    assert_eq!(above, [0; 2]);
    for row in &rows {
        assert!(row.largest[0].0 > 0.7, "{}: no draw came near a limit", row.name);
    }
}
