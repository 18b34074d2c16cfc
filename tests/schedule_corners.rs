//! Corner speeds where lines and arcs meet, against closed forms: with a kink the arc that stays within the path tolerance, at a
//! tangent the curvature of what meets there.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use feedwright::machine::{Axis, Machine};
use feedwright::nc::{Environment, MoveKind, interpret, parse};
use feedwright::path::Vec3;
use feedwright::schedule::FeedPiece;
use feedwright::schedule::exact_pass::exact_pass;
use feedwright::schedule::track::{Track, track};

const ACCELERATION: f64 = 500.0;
const TOLERANCE_MM: f64 = 0.01;

fn machine() -> Machine {
    let text = std::fs::read_to_string("programs/pocket.setup.toml").unwrap();
    let (job, _) = feedwright::setup::load(&text, std::path::Path::new("programs")).unwrap();
    let axis = Axis { velocity_mm_s: 1e4, acceleration_mm_s2: ACCELERATION, jerk_mm_s3: None };
    Machine { axes: [axis; 3], block_time_s: 0.0, corner_tolerance_mm: TOLERANCE_MM, ..job.machine }
}

/// The legs of a program at a feed that never binds.
fn legs(lines: &str) -> Track {
    let text = format!("G21 G17 G90 G64\nS1000 M3\nG1 X0 Y0 F60000\n{lines}\nM2\n");
    let toolpath = interpret(&parse(text.into_bytes(), None), &Environment::default());
    assert!(toolpath.diagnostics.is_empty(), "{:?}", toolpath.diagnostics);
    assert!(toolpath.moves.iter().all(|motion| motion.kind == MoveKind::Feed));
    track(&toolpath, &machine(), &mut |id, pieces| {
        let to_mm = toolpath.moves[id.ix()].curve().length();
        pieces.push(FeedPiece::commanded(id, [0.0, to_mm], 1e3));
    })
}

/// The point between the last two moves.
fn junction(track: &Track) -> usize {
    track.moves.iter().position(|id| id == track.moves.last().unwrap()).unwrap()
}

/// An arc from `at` that begins in the direction `start_deg` and turns by `turn_deg` (counter-clockwise positive): its block, and
/// where it ends.
fn arc(at: [f64; 2], radius: f64, start_deg: f64, turn_deg: f64) -> (String, [f64; 2]) {
    let side = turn_deg.signum();
    let (sin, cos) = start_deg.to_radians().sin_cos();
    let centre = [at[0] - side * radius * sin, at[1] + side * radius * cos];
    let (sin, cos) = (start_deg + turn_deg).to_radians().sin_cos();
    let end = [centre[0] + side * radius * sin, centre[1] - side * radius * cos];
    let code = if side > 0.0 { "G3" } else { "G2" };
    let [i, j] = [centre[0] - at[0], centre[1] - at[1]];
    (format!("{code} X{:.7} Y{:.7} I{i:.7} J{j:.7}\n", end[0], end[1]), end)
}

fn line(at: [f64; 2], length: f64, angle_deg: f64) -> (String, [f64; 2]) {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    let end = [at[0] + length * cos, at[1] + length * sin];
    (format!("G1 X{:.7} Y{:.7}\n", end[0], end[1]), end)
}

/// v² on the arc that rounds a corner from one direction into another: R = δ cos(φ/2) / (1 − cos(φ/2)), of both sides at most half.
fn rounded(from_deg: f64, to_deg: f64, shorter_mm: f64) -> f64 {
    let half = 0.5 * (to_deg - from_deg).abs().to_radians();
    let direction = |angle: f64| Vec3::new(angle.to_radians().cos(), angle.to_radians().sin(), 0.0);
    let change = (direction(to_deg) - direction(from_deg)).normalize();
    let acceleration = ACCELERATION / change.x.abs().max(change.y.abs());
    let radius = TOLERANCE_MM * half.cos() / (1.0 - half.cos());
    acceleration * radius.min(0.5 * shorter_mm / half.tan())
}

fn same(found: f64, wanted: f64, what: &str) {
    println!("{what}: {found} {wanted}");
    assert!((found / wanted - 1.0).abs() < 1e-4, "{what}: {found}, closed form {wanted}");
}

#[test]
fn a_line_and_an_arc_with_a_kink_meet_within_the_path_tolerance() {
    for kink_deg in [-60.0, -20.0, 5.0, 30.0, 90.0] {
        let (first, at) = line([0.0, 0.0], 30.0, 0.0);
        let (second, _) = arc(at, 10.0, kink_deg, 60.0);
        let track = legs(&(first + &second));
        same(track.chain.point_b[junction(&track)], rounded(0.0, kink_deg, 10.0), &format!("line-arc {kink_deg}"));
        // The other way round.
        let (first, at) = arc([0.0, 0.0], 10.0, 0.0, 60.0);
        let (second, _) = line(at, 30.0, 60.0 + kink_deg);
        let track = legs(&(first + &second));
        same(
            track.chain.point_b[junction(&track)],
            rounded(60.0, 60.0 + kink_deg, 10.0),
            &format!("arc-line {kink_deg}"),
        );
    }
}

#[test]
fn two_arcs_with_a_kink_meet_within_the_path_tolerance() {
    for (kink_deg, turn_deg) in [(-45.0, 70.0), (10.0, -70.0), (25.0, 70.0), (90.0, -40.0)] {
        let (first, at) = arc([0.0, 0.0], 10.0, 0.0, 60.0);
        let (second, _) = arc(at, 4.0, 60.0 + kink_deg, turn_deg);
        let track = legs(&(first + &second));
        same(
            track.chain.point_b[junction(&track)],
            rounded(60.0, 60.0 + kink_deg, 4.0 * 40f64.to_radians()),
            &format!("arc-arc {kink_deg}"),
        );
    }
    // Short arcs: half of the shorter one is what the corner may take.
    let (first, at) = arc([0.0, 0.0], 10.0, 0.0, 60.0);
    let (second, _) = arc(at, 1.0, 65.0, 0.2f64.to_degrees());
    let track = legs(&(first + &second));
    let shorter = rounded(60.0, 65.0, 0.2);
    assert!(shorter < rounded(60.0, 65.0, 10.0));
    same(track.chain.point_b[junction(&track)], shorter, "short arc");
}

#[test]
fn at_a_tangent_the_curvature_is_what_bounds_the_speed() {
    // Tangent along an axis: the other axis turns the path, b / R ≤ a.
    let (first, at) = line([0.0, 0.0], 30.0, 0.0);
    for (what, second, radius) in
        [("line-arc", arc(at, 10.0, 0.0, 90.0), 10.0), ("line-arc back", arc(at, 6.0, 0.0, -90.0), 6.0)]
    {
        let track = legs(&(first.clone() + &second.0));
        let point = junction(&track);
        assert!(track.chain.point_b[point].is_infinite(), "{what}: a corner where there is none");
        same(exact_pass(&track.chain)[point], ACCELERATION * radius, what);
    }
    // An S of two arcs and a bend that tightens: the smaller radius.
    let (start, at) = line([0.0, 0.0], 20.0, 0.0);
    let (first, at) = arc(at, 10.0, 0.0, 90.0);
    for (what, turn_deg) in [("S", -90.0), ("tightening", 90.0)] {
        let (second, _) = arc(at, 4.0, 90.0, turn_deg);
        let track = legs(&(start.clone() + &first + &second));
        let point = junction(&track);
        assert!(track.chain.point_b[point].is_infinite(), "{what}: a corner where there is none");
        same(exact_pass(&track.chain)[point], ACCELERATION * 4.0, what);
    }
}
