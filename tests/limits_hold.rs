//! Limits hold in the written file: generated programs, tools, stocks, limits, units and dialects; the written text judged by a second
//! simulation that shares nothing with the first: its own reader of words, what a rim meets from distances to lines and arcs, teeth one by one.
//! Two thousand programs in the ordinary run; `FEEDWRIGHT_LONG=N` for N of them, `FEEDWRIGHT_SEED=K` to begin at program K.
//!
//! Force of a slice of a tooth (linear-edge model), φ from the normal of the feed: h = f_z sin φ, dF_t = (k_tc h + k_te) dz,
//! dF_r = (k_rc h + k_re) dz where material stands at φ; the load is the largest resultant in the plane within a revolution.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod common {
    pub mod draw;
}

use assert_cmd::cargo::cargo_bin;
use common::draw::Draw;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::fs;
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Programs of the ordinary run: the first so many, and four more. Among the first are four whose path turns into a wall, where a sliver in
/// material at 110° bears more than a wider arc further on (87, 306, 347, 376). One of the four has a fin thinner than a cell and was 2.6 times
/// its limit. In the second two of three straight teeth cut at once at the end of a slot, and one alone bears 6 % more a little further on; in the
/// third this happens with helical ones within the last station before a bend, and was 3.8 % above the limit; in the fourth within the first one
/// after a bend, and was 4.7 % above.
const ORDINARY: usize = 2000;
const MORE: [usize; 4] = [2249, 6202, 16_624, 43_422];
/// What the check of the written file may find above a limit.
const MODEL: f64 = 1.01;
/// The witness: its step along the path, mm, and parts of the leading half of the rim; and where that finds too much, closely.
const COARSE: Grain = Grain { step_mm: 0.25, rim: 180 };
const CLOSE: Grain = Grain { step_mm: 0.02, rim: 720 };
/// Coefficients, N/mm² and N/mm.
const K: [f64; 4] = [820.0, 310.0, 14.0, 11.0];

/// How closely the witness looks.
#[derive(Clone, Copy)]
struct Grain {
    step_mm: f64,
    rim: usize,
}

/// A program, its setup, and what the witness has to know of them.
struct Case {
    dialect: &'static str,
    text: String,
    setup: String,
    unit_mm: f64,
    radius_mm: f64,
    flutes: f64,
    helix: f64,
    rpm: f64,
    limit_n: f64,
    stock_mm: [f64; 2],
    depth_mm: f64,
}

fn case(seed: u64) -> Case {
    let mut draw = Draw(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) + 1);
    draw.share();
    let dialect = draw.of(&["linuxcnc", "fanuc", "haas", "siemens", "grbl", "generic"]);
    let unit_mm = draw.of(&[1.0, 1.0, 25.4]);
    let diameter = draw.of(&[6.0, 8.0, 10.0, 12.0]);
    let (flutes, helix, rpm) = (draw.of(&[2.0, 3.0, 4.0]), draw.of(&[0.0, 30.0, 45.0]), draw.of(&[4000.0, 8000.0]));
    let stock = [draw.between(30.0, 50.0), draw.between(20.0, 30.0)];
    let depth = draw.between(0.5, 3.0);
    let limit = draw.between(60.0, 400.0);
    let feed = draw.between(200.0, 1500.0);
    let number = |mm: f64| format!("{:.4}", mm / unit_mm);
    let f = |mm_min: f64| if unit_mm > 1.0 { format!("{:.1}", mm_min / unit_mm) } else { format!("{mm_min:.0}") };
    let mut text = String::new();
    let inch = match (dialect, unit_mm > 1.0) {
        ("siemens", true) => "G70",
        ("siemens", false) => "G71",
        (_, true) => "G20",
        (_, false) => "G21",
    };
    let tool = if dialect == "grbl" { String::new() } else { "T1 M6\n".to_owned() };
    let _ = write!(text, "{inch} G90 G17 G94\n{tool}S{rpm:.0} M3\nG0 Z{}\n", number(5.0));
    let mut at = [-diameter, draw.between(0.0, stock[1])];
    let _ = writeln!(text, "G0 X{} Y{}\nG1 Z{} F{}", number(at[0]), number(at[1]), number(-depth), f(feed));
    for leg in 0..6 {
        let to =
            [draw.between(-diameter, stock[0] + diameter), draw.between(-0.3 * diameter, stock[1] + 0.3 * diameter)];
        let own = if draw.share() < 0.4 { format!(" F{}", f(feed * draw.between(0.5, 1.5))) } else { String::new() };
        let chord = [to[0] - at[0], to[1] - at[1]];
        if leg % 3 == 2 && chord[0].hypot(chord[1]) > 1.0 {
            // Half a circle over the chord.
            let sense = draw.of(&["G2", "G3"]);
            let [x, y, i, j] = [to[0], to[1], 0.5 * chord[0], 0.5 * chord[1]].map(number);
            let _ = writeln!(text, "{sense} X{x} Y{y} I{i} J{j}{own}");
        } else {
            let _ = writeln!(text, "G1 X{} Y{}{own}", number(to[0]), number(to[1]));
        }
        at = to;
    }
    let _ = write!(text, "G0 Z{}\nM30\n", number(5.0));
    let [k_tc, k_rc, k_te, k_re] = K;
    let setup = format!(
        "units = \"mm\"\nresolution = {CELL_MM}\n[machine]\ndialect = \"{dialect}\"\n[stock]\nbox = {{ min = [0, 0, -10], max = [{}, {}, 0] }}\n\
         [material]\nk_tc = {k_tc}\nk_rc = {k_rc}\nk_ac = 0\nk_te = {k_te}\nk_re = {k_re}\nk_ae = 0\n\
         [[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = {diameter}\nflutes = {flutes}\nhelix = {helix}\nflute_length = 20\noverhang = 30\n\
         [raise]\nplunges = false\nentries = true\nfinishing = true\n[limits]\nforce_xy = {limit}\nfeed_change = {{ min = 0.02, max = {} }}\n",
        stock[0],
        stock[1],
        draw.of(&[1.3, 2.0])
    );
    Case {
        dialect,
        text,
        setup,
        unit_mm,
        radius_mm: 0.5 * diameter,
        flutes,
        helix: f64::to_radians(helix),
        rpm,
        limit_n: limit,
        stock_mm: stock,
        depth_mm: depth,
    }
}

/// A feed move at the depth of the cut, seen from above, mm.
#[derive(Clone, Copy)]
struct Leg {
    path: Path,
    feed_mm_min: f64,
}

#[derive(Clone, Copy)]
enum Path {
    Line { from: [f64; 2], to: [f64; 2] },
    Arc { middle: [f64; 2], radius: f64, from_rad: f64, turn_rad: f64 },
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    f64::hypot(a[0] - b[0], a[1] - b[1])
}

impl Path {
    fn length(&self) -> f64 {
        match self {
            Path::Line { from, to } => distance(*from, *to),
            Path::Arc { radius, turn_rad, .. } => radius * turn_rad.abs(),
        }
    }
    /// Its first part.
    fn until(self, share: f64) -> Self {
        match self {
            Path::Line { from, .. } => Path::Line { from, to: self.at(share) },
            Path::Arc { middle, radius, from_rad, turn_rad } => {
                Path::Arc { middle, radius, from_rad, turn_rad: share * turn_rad }
            }
        }
    }
    fn at(&self, share: f64) -> [f64; 2] {
        match self {
            Path::Line { from, to } => [0, 1].map(|k| from[k] + share * (to[k] - from[k])),
            Path::Arc { middle, radius, from_rad, turn_rad } => {
                let (sin, cos) = (from_rad + share * turn_rad).sin_cos();
                [middle[0] + radius * cos, middle[1] + radius * sin]
            }
        }
    }
    /// Unit vector of the feed.
    fn heading(&self, share: f64) -> [f64; 2] {
        match self {
            Path::Line { from, to } => [0, 1].map(|k| (to[k] - from[k]) / self.length()),
            Path::Arc { from_rad, turn_rad, .. } => {
                let (sin, cos) = (from_rad + share * turn_rad).sin_cos();
                [-sin * turn_rad.signum(), cos * turn_rad.signum()]
            }
        }
    }
    /// How near a point it comes, mm.
    fn distance(&self, p: [f64; 2]) -> f64 {
        match self {
            Path::Line { from, to } => {
                let along = [to[0] - from[0], to[1] - from[1]];
                let square = along[0] * along[0] + along[1] * along[1];
                let share = ((p[0] - from[0]) * along[0] + (p[1] - from[1]) * along[1]) / square.max(1e-18);
                distance(p, self.at(share.clamp(0.0, 1.0)))
            }
            Path::Arc { middle, radius, from_rad, turn_rad } => {
                let angle = (p[1] - middle[1]).atan2(p[0] - middle[0]);
                if ((angle - from_rad) * turn_rad.signum()).rem_euclid(TAU) <= turn_rad.abs() {
                    (distance(p, *middle) - radius).abs()
                } else {
                    distance(p, self.at(0.0)).min(distance(p, self.at(1.0)))
                }
            }
        }
    }
}

/// Follows the words of a written program: absolute lengths, lines, arcs in XY with their centre from where they begin.
fn follow(text: &str, unit_mm: f64) -> Vec<Leg> {
    let (mut at, mut feed, mut code, mut legs) = ([0.0, 0.0, 50.0], 0.0, 0, Vec::new());
    for line in text.lines() {
        let mut plain = String::new();
        let mut depth = 0;
        for c in line.split(';').next().unwrap().chars() {
            depth += i32::from(c == '(') - i32::from(c == ')');
            if depth == 0 && c != ')' && !c.is_whitespace() {
                plain.push(c);
            }
        }
        let (mut to, mut centre, mut moves) = (at, [0.0; 2], false);
        let starts: Vec<usize> =
            plain.char_indices().filter(|(_, c)| c.is_ascii_alphabetic()).map(|(k, _)| k).collect();
        for (k, start) in starts.iter().enumerate() {
            let word = &plain[*start..starts.get(k + 1).copied().unwrap_or(plain.len())];
            let Ok(value) = word[1..].trim_start_matches('=').parse::<f64>() else { continue };
            match &word[..1] {
                "G" if (0.0..=3.0).contains(&value) => code = value as u32,
                "F" => feed = value * unit_mm,
                "X" | "Y" | "Z" => {
                    to[b"XYZ".iter().position(|c| *c == word.as_bytes()[0]).unwrap()] = value * unit_mm;
                    moves = true;
                }
                "I" => centre[0] = value * unit_mm,
                "J" => centre[1] = value * unit_mm,
                _ => {}
            }
        }
        let (begin, end) = ([at[0], at[1]], [to[0], to[1]]);
        if moves && code > 0 && at[2] < -1e-6 && to[2] < -1e-6 && distance(begin, end) > 1e-9 {
            let path = if code == 1 { Path::Line { from: begin, to: end } } else { arc(begin, end, centre, code) };
            legs.push(Leg { path, feed_mm_min: feed });
        }
        at = to;
    }
    legs
}

/// An arc to a point around a centre given from where it begins: G2 clockwise, G3 counter-clockwise.
fn arc(from: [f64; 2], to: [f64; 2], centre: [f64; 2], code: u32) -> Path {
    let middle = [from[0] + centre[0], from[1] + centre[1]];
    let angle = |p: [f64; 2]| (p[1] - middle[1]).atan2(p[0] - middle[0]);
    let left = (angle(to) - angle(from)).rem_euclid(TAU);
    let turn_rad = if code == 3 { left } else { left - TAU };
    Path::Arc { middle, radius: centre[0].hypot(centre[1]), from_rad: angle(from), turn_rad }
}

/// A step of the path: how long it is, mm, and the peak force in the plane at its end, N.
struct Step {
    length_mm: f64,
    peak_n: f64,
}

/// Steps along the written program. What a rim meets is worked out from lines and arcs: a point of it in the block to which no path
/// before came nearer than the radius.
fn witness(case: &Case, text: &str, grain: Grain) -> Vec<Step> {
    let legs = follow(text, case.unit_mm);
    let mut steps = Vec::new();
    for (index, leg) in legs.iter().enumerate() {
        let length = leg.path.length();
        let count = (length / grain.step_mm).ceil().max(1.0) as usize;
        for k in 1..=count {
            let share = k as f64 / count as f64;
            let centre = leg.path.at(share);
            let mut before: Vec<Path> = legs[..index].iter().map(|leg| leg.path).collect();
            before.push(leg.path.until(share));
            before.retain(|path| path.distance(centre) < 2.0 * case.radius_mm);
            let met = rim(case, centre, leg.path.heading(share), &before, grain.rim);
            let tooth = leg.feed_mm_min / (case.rpm * case.flutes);
            steps.push(Step { length_mm: length / count as f64, peak_n: force(case, tooth, &met) });
        }
    }
    steps
}

/// Of each part of the leading half of the rim, φ from 0 to π: which share of it meets material. φ = 0 at the left of the feed seen
/// from above, clockwise: at 90° straight ahead.
fn rim(case: &Case, centre: [f64; 2], heading: [f64; 2], before: &[Path], parts: usize) -> Vec<f64> {
    let meets = |phi: f64| {
        let (sin, cos) = phi.sin_cos();
        let ray = [sin * heading[0] - cos * heading[1], sin * heading[1] + cos * heading[0]];
        let p = [0, 1].map(|k| centre[k] + case.radius_mm * ray[k]);
        (0..2).all(|k| p[k] > 0.0 && p[k] < case.stock_mm[k])
            && before.iter().all(|path| path.distance(p) > case.radius_mm - 1e-7)
    };
    let at = |k: usize| PI * k as f64 / parts as f64;
    let ends: Vec<bool> = (0..=parts).map(|k| meets(at(k))).collect();
    let share = |k: usize| match (ends[k], ends[k + 1]) {
        (true, true) => 1.0,
        (false, false) => 0.0,
        (first, _) => {
            let (mut a, mut b) = (at(k), at(k + 1));
            for _ in 0..20 {
                let middle = 0.5 * (a + b);
                *(if meets(middle) == first { &mut a } else { &mut b }) = middle;
            }
            let reached = (a - at(k)) / (at(k + 1) - at(k));
            if first { reached } else { 1.0 - reached }
        }
    };
    (0..parts).map(share).collect()
}

/// Largest resultant within a revolution, N, teeth one by one. A helical tooth bears the sum over the angles its edge lies at, z = R φ /
/// tan(helix); a straight one is met at one.
fn force(case: &Case, tooth_mm: f64, met: &[f64]) -> f64 {
    let [k_tc, k_rc, k_te, k_re] = K;
    let width = PI / met.len() as f64;
    let per_mm = |phi: f64| {
        let h = tooth_mm * phi.sin();
        let (tangential, radial) = (k_tc * h + k_te, k_rc * h + k_re);
        [-tangential * phi.cos() - radial * phi.sin(), tangential * phi.sin() - radial * phi.cos()]
    };
    let lag = case.depth_mm * case.helix.tan() / case.radius_mm;
    // Sum of the force over the rim up to each part's end, N rad / mm.
    let mut sums = vec![[0.0; 2]];
    for (k, share) in met.iter().enumerate() {
        let [x, y] = per_mm((k as f64 + 0.5) * width);
        let last = sums[k];
        sums.push([last[0] + x * share * width, last[1] + y * share * width]);
    }
    let sum = |phi: f64| -> [f64; 2] {
        let place = (phi.clamp(0.0, PI) / width).min(met.len() as f64);
        let k = (place as usize).min(met.len() - 1);
        let share = place - k as f64;
        [0, 1].map(|axis| sums[k][axis] + share * (sums[k + 1][axis] - sums[k][axis]))
    };
    let tooth = |phi: f64| -> [f64; 2] {
        if lag > 0.0 {
            let (to, from) = (sum(phi), sum(phi - lag));
            return [0, 1].map(|axis| (to[axis] - from[axis]) * case.depth_mm / lag);
        }
        let hit = phi < PI && met[((phi / width) as usize).min(met.len() - 1)] > 0.0;
        if hit { per_mm(phi).map(|force| force * case.depth_mm) } else { [0.0; 2] }
    };
    let turns = (0..2 * met.len()).map(|turn| {
        let teeth = (0..case.flutes as usize)
            .map(|flute| tooth(((turn as f64 + 0.5) * width + TAU * flute as f64 / case.flutes).rem_euclid(TAU)));
        let [x, y] = teeth.fold([0.0; 2], |sum, tooth| [sum[0] + tooth[0], sum[1] + tooth[1]]);
        f64::hypot(x, y)
    });
    turns.fold(0.0, f64::max)
}

/// The largest load that is borne all along some way of so many mm, N.
fn lasting(steps: &[Step], way_mm: f64) -> f64 {
    let mut most: f64 = 0.0;
    for first in 0..steps.len() {
        let (mut length, mut least) = (0.0, f64::INFINITY);
        for step in &steps[first..] {
            (length, least) = (length + step.length_mm, least.min(step.peak_n));
            if length >= way_mm - 1e-9 || least <= most {
                break;
            }
        }
        if length >= way_mm - 1e-9 {
            most = most.max(least);
        }
    }
    most
}

/// Largest load over its limit: by the check of the written file, by the coarse look of the witness at one step, and by its close one
/// where that is above: at one step, and over the way that counts.
struct Ratios {
    check: f64,
    coarse: f64,
    close: Option<[f64; 2]>,
}

/// Does the written file of a case hold its limit? `None`: nothing was written, or it was said that a limit is not met.
fn judged(case: &Case) -> Result<Option<Ratios>, String> {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("p.nc"), &case.text).unwrap();
    fs::write(dir.path().join("s.toml"), &case.setup).unwrap();
    let mut command = Command::new(cargo_bin("feedwright"));
    command.current_dir(dir.path()).args([
        "optimize",
        "p.nc",
        "--setup",
        "s.toml",
        "-o",
        "o.nc",
        "--json",
        "r.json",
        "--threads",
        "1",
    ]);
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    match output.status.code() {
        Some(0) => {}
        Some(1) => return Ok(None),
        code => return Err(format!("{code:?}: {said}\n{}", case.text)),
    }
    let report: serde_json::Value = serde_json::from_slice(&fs::read(dir.path().join("r.json")).unwrap()).unwrap();
    let model = report["check"]["resimulated_worst_ratio"].as_f64().ok_or("no ratio in the report")?;
    let text = fs::read_to_string(dir.path().join("o.nc")).unwrap();
    let over = |newtons: f64| newtons / case.limit_n;
    let coarse = over(lasting(&witness(case, &text, COARSE), 0.0));
    let close = (coarse > FOUND).then(|| {
        let steps = witness(case, &text, CLOSE);
        [0.0, EDGE_MM].map(|way_mm| over(lasting(&steps, way_mm)))
    });
    Ok(Some(Ratios { check: model, coarse, close }))
}

/// A whole number from the environment.
fn number(name: &str) -> Option<usize> {
    std::env::var(name).ok().and_then(|text| text.parse().ok())
}

#[test]
fn no_written_file_exceeds_its_limits() {
    let begin = number("FEEDWRIGHT_SEED").unwrap_or(0);
    let mut seeds: Vec<usize> = (begin..begin + number("FEEDWRIGHT_LONG").unwrap_or(ORDINARY)).collect();
    seeds.extend(MORE);
    seeds.sort_unstable();
    seeds.dedup();
    let count = seeds.len();
    let (next, found, faults) = (AtomicUsize::new(0), Mutex::new(Vec::new()), Mutex::new(Vec::new()));
    let work = || {
        loop {
            let Some(seed) = seeds.get(next.fetch_add(1, Ordering::Relaxed)).copied() else { return };
            let case = case(seed as u64);
            match judged(&case) {
                Ok(Some(ratios)) => {
                    let [once, held] = ratios.close.unwrap_or([ratios.coarse; 2]);
                    if ratios.check > MODEL || held > FOUND {
                        let Ratios { check, coarse, .. } = ratios;
                        faults.lock().unwrap().push(format!(
                            "{seed} ({}): check {check:.3}, witness {coarse:.3}, closely {once:.3}, over {EDGE_MM:.2} mm {held:.3}\n{}",
                            case.dialect, case.text
                        ));
                    }
                    found.lock().unwrap().push((seed, ratios));
                }
                Ok(None) => {}
                Err(why) => faults.lock().unwrap().push(format!("{seed} ({}): {why}", case.dialect)),
            }
        }
    };
    std::thread::scope(|scope| {
        let workers = std::thread::available_parallelism().map_or(1, usize::from).min(8);
        (0..workers).for_each(|_| drop(scope.spawn(work)));
    });
    let (found, faults) = (found.into_inner().unwrap(), faults.into_inner().unwrap());
    let largest = |of: &dyn Fn(&Ratios) -> f64| found.iter().map(|(_, ratios)| of(ratios)).fold(0.0, f64::max);
    println!(
        "{count} programs from {begin}, {} written and said to hold: largest ratio {:.3} by the check; {} looked at closely: {:.3} at one place, {:.3} over {EDGE_MM:.2} mm",
        found.len(),
        largest(&|ratios| ratios.check),
        found.iter().filter(|(_, ratios)| ratios.close.is_some()).count(),
        largest(&|ratios| ratios.close.map_or(ratios.coarse, |close| close[0])),
        largest(&|ratios| ratios.close.map_or(ratios.coarse, |close| close[1])),
    );
    assert!(faults.is_empty(), "{} of {count}:\n{}", faults.len(), faults.join("\n"));
    assert!(found.len() * 3 > count, "only {} of {count} were written", found.len());
}

/// What the witness may find above a limit: the 1 % of the check, and as much again for each of its directions and its steps (against
/// closed forms below: 0.5 %).
const FOUND: f64 = 1.03;

/// Cell of the height field in these setups, mm.
const CELL_MM: f64 = 0.2;
/// How long a load above its limit may last, mm: the diagonal of a cell. A cusp between two cuts that is smaller than a cell is not seen: the
/// grid nominates what may stand.
const EDGE_MM: f64 = CELL_MM * std::f64::consts::SQRT_2;

/// The witness against closed forms: a straight tooth in a slot bears most at φ = 90°, one of two; a helical one that meets all of its edge
/// at 90° ± lag/2 the mean of the sine there.
#[test]
fn the_witness_agrees_with_closed_forms() {
    let mut case = case(0);
    (case.flutes, case.helix, case.depth_mm, case.radius_mm) = (2.0, 0.0, 1.5, 5.0);
    let [k_tc, k_rc, k_te, k_re] = K;
    let slot = vec![1.0; COARSE.rim];
    let expected = f64::hypot(k_tc * 0.08 + k_te, k_rc * 0.08 + k_re) * 1.5;
    let found = force(&case, 0.08, &slot);
    assert!((found / expected - 1.0).abs() < 0.005, "{found} {expected}");
    // Of two helical teeth, half a turn apart, one is out. At the middle of the slot the forces across the feed and along it are
    // ∫ (K_t cos φ + K_r sin φ) and ∫ (K_t sin φ − K_r cos φ) over 90° ± lag/2.
    case.helix = f64::to_radians(45.0);
    let half = 0.5 * case.depth_mm / case.radius_mm;
    let middle = |of: &dyn Fn(f64) -> f64| {
        let count = 2000;
        (0..count).map(|k| of(PI / 2.0 - half + (f64::from(k) + 0.5) * 2.0 * half / f64::from(count))).sum::<f64>()
            * case.depth_mm
            / f64::from(count)
    };
    let at = |phi: f64| [k_tc * 0.08 * phi.sin() + k_te, k_rc * 0.08 * phi.sin() + k_re];
    let x = middle(&|phi| at(phi)[0] * phi.cos() + at(phi)[1] * phi.sin());
    let y = middle(&|phi| at(phi)[0] * phi.sin() - at(phi)[1] * phi.cos());
    let found = force(&case, 0.08, &slot);
    assert!((found / x.hypot(y) - 1.0).abs() < 0.005, "{found} {}", x.hypot(y));
}

/// The rim of a cutter of 5 mm that enters a block from the left, 1 mm deep into it, meets it where cos of the angle to the feed is
/// above 4/5; and behind a path that has passed there it meets nothing.
#[test]
fn the_witness_meets_what_stands() {
    let mut case = case(0);
    (case.radius_mm, case.stock_mm) = (5.0, [40.0, 30.0]);
    let met = rim(&case, [-4.0, 15.0], [1.0, 0.0], &[], 360);
    let angle = met.iter().sum::<f64>() * PI / 360.0;
    assert!((angle - 2.0 * 0.8f64.acos()).abs() < 1e-4, "{angle}");
    let passed = [Path::Line { from: [-4.0, 15.0], to: [20.0, 15.0] }];
    assert_eq!(rim(&case, [-4.0, 15.0], [1.0, 0.0], &passed, 360).iter().sum::<f64>(), 0.0);
    // Beside a path 6 mm off: from the cusp at φ where 5 cos φ = 1 … to the far side.
    let beside = [Path::Line { from: [-20.0, 21.0], to: [60.0, 21.0] }];
    let met = rim(&case, [20.0, 15.0], [1.0, 0.0], &beside, 360);
    let angle = met.iter().sum::<f64>() * PI / 360.0;
    assert!((angle - (PI - 0.2f64.acos())).abs() < 1e-3, "{angle}");
    // A circle about the same middle has cut all within its radius and 5 mm more.
    let round = [Path::Arc { middle: [20.0, 15.0], radius: 2.0, from_rad: 0.0, turn_rad: TAU }];
    assert_eq!(rim(&case, [20.0, 15.0], [1.0, 0.0], &round, 360).iter().sum::<f64>(), 0.0);
}
