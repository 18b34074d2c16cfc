//! The model of the control against closed forms: trapezoids, exact stops, block rate, look-ahead, and the time between motions.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use feedwright::machine::{Axis, Machine};
use feedwright::nc::{Environment, Toolpath, interpret, parse};
use feedwright::schedule::FeedPiece;
use feedwright::schedule::control::{Control, plan};
use feedwright::schedule::exact_pass::{exact_pass, leg_times};
use feedwright::schedule::{as_programmed, realise};

const ACCELERATION: f64 = 500.0;
/// What a stop may lose in the servo period, s.
const SERVO_S: f64 = 0.001;

fn machine() -> Machine {
    let text = std::fs::read_to_string("programs/pocket.setup.toml").unwrap();
    let (job, _) = feedwright::setup::load(&text, std::path::Path::new("programs")).unwrap();
    let axis = Axis { velocity_mm_s: 1e3, acceleration_mm_s2: ACCELERATION, jerk_mm_s3: None };
    let mut machine =
        Machine { dialect: None, axes: [axis; 3], block_time_s: 0.0, corner_tolerance_mm: 0.01, ..job.machine };
    machine.tool_change_time_s = 7.0;
    machine.spindle.runup_time_s = 1.5;
    machine.rapid_mm_s = 200.0;
    machine
}

fn toolpath(lines: &str) -> Toolpath {
    interpret(&parse(format!("G21 G17 G90\n{lines}\nM2\n").into_bytes(), None), &Environment::default())
}

fn seconds(lines: &str, machine: &Machine) -> f64 {
    let path = toolpath(lines);
    realise(&path, &as_programmed(&path), machine).by_cause.iter().find(|(name, _)| *name == "feed").unwrap().1
}

/// A line from rest to rest.
fn trapezoid(length_mm: f64, feed_mm_s: f64) -> f64 {
    let run_up_mm = feed_mm_s * feed_mm_s / ACCELERATION;
    if length_mm >= run_up_mm {
        length_mm / feed_mm_s + feed_mm_s / ACCELERATION
    } else {
        2.0 * (length_mm / ACCELERATION).sqrt()
    }
}

#[test]
fn a_line_from_rest_to_rest_is_a_trapezoid_or_a_triangle() {
    for (length, feed) in [(50.0, 40.0), (2.0, 40.0), (0.5, 100.0)] {
        let found = seconds(&format!("G1 X{length} F{}", 60.0 * feed), &machine());
        assert!(
            (found - trapezoid(length, feed)).abs() <= SERVO_S,
            "{length} {feed}: {found} {}",
            trapezoid(length, feed)
        );
    }
}

/// Against LinuxCNC: 40 blocks of a zigzag under G61 took 123, 256 and 134 ms each (1, 5 and 2 mm at F600, F1500 and F3000,
/// 500 mm/s², of which a kink leaves 0.9).
#[test]
fn what_lies_between_two_stops_takes_whole_periods() {
    let machine = Machine { dialect: Some("linuxcnc".to_owned()), ..machine() };
    for (length, feed, each_s) in [(1.0, 600.0, 0.123), (5.0, 1500.0, 0.256), (2.0, 3000.0, 0.134)] {
        let at = |k: i32| format!("G1 X{} Y{} F{feed}\n", length * f64::from((k + 1) / 2), length * f64::from(k / 2));
        let zigzag = |count: i32| seconds(&format!("G61\n{}", (1..=count).map(at).collect::<String>()), &machine);
        let each = (zigzag(30) - zigzag(10)) / 20.0;
        assert!((each - each_s).abs() < 1e-6, "{length} mm at F{feed}: {each}");
    }
}

/// LinuxCNC keeps the last move before a stop ready for a parabolic blend, with half of the acceleration: `G0 Z0.6` of 25.5 mm
/// before an M9 took 0.638 s under G64 at 500 mm/s² and 0.451 s under G61.
#[test]
fn the_last_move_before_a_stop_is_slow_where_corners_are_rounded() {
    let linuxcnc = Machine { dialect: Some("linuxcnc".to_owned()), ..machine() };
    let retract = |mode: &str, machine: &Machine| {
        let path = toolpath(&format!("{mode}\nG0 Z25.451\nM5\nG4 P1"));
        realise(&path, &as_programmed(&path), machine).by_cause.iter().find(|(name, _)| *name == "rapid").unwrap().1
    };
    assert!((retract("G64 P0.01", &linuxcnc) - 0.638).abs() < 0.002, "{}", retract("G64 P0.01", &linuxcnc));
    assert!((retract("G61", &linuxcnc) - 0.451).abs() < 0.002, "{}", retract("G61", &linuxcnc));
    assert!((retract("G64 P0.01", &machine()) - 0.451).abs() < 0.002, "{}", retract("G64 P0.01", &machine()));
}

#[test]
fn an_exact_stop_ends_every_block_at_rest() {
    let lines = "G1 X20 F2400\nX40\nX45\nY30";
    let stops = seconds(&format!("G61.1\n{lines}"), &machine());
    let alone: f64 = [20.0, 20.0, 5.0, 30.0].iter().map(|length| trapezoid(*length, 40.0)).sum();
    assert!((stops - alone).abs() <= 4.0 * SERVO_S, "{stops} {alone}");
    // Run through, the straight blocks are one, and only the corner slows.
    let through = seconds(&format!("G64\n{lines}"), &machine());
    assert!(
        through > trapezoid(75.0, 40.0) && through < trapezoid(45.0, 40.0) + trapezoid(30.0, 40.0) + SERVO_S,
        "{through}"
    );
}

#[test]
fn no_block_is_digested_faster_than_the_block_time() {
    let lines: String = (1..=200).map(|i| format!("G1 X{:.2} F6000\n", 0.05 * f64::from(i))).collect();
    let free = seconds(&format!("G64\n{lines}"), &machine());
    let slow = seconds(&format!("G64\n{lines}"), &Machine { block_time_s: 0.01, ..machine() });
    assert!((free - trapezoid(10.0, 100.0)).abs() < 0.05, "{free}");
    // 200 blocks of 0.05 mm in 0.01 s each: 5 mm/s.
    assert!((slow - 2.0).abs() < 0.02 + 2.0 * SERVO_S, "{slow}");
}

#[test]
fn a_control_that_looks_ahead_few_blocks_must_be_able_to_stop_at_their_end() {
    let lines: String = (1..=400).map(|i| format!("G1 X{:.2} F6000\n", 0.1 * f64::from(i))).collect();
    let path = toolpath(&format!("G64\n{lines}"));
    let machine = machine();
    let time = |look_ahead: Option<usize>| {
        let control = Control { look_ahead, ..Control::of(&machine) };
        let plan = plan(&path, &machine, &control, &mut |id, orders| {
            let motion = &path.moves[id.ix()];
            orders.push(FeedPiece::commanded(id, [0.0, motion.curve().length()], motion.feed.mm_s));
        });
        leg_times(&plan.chain, &exact_pass(&plan.chain)).iter().sum::<f64>()
    };
    assert!((time(None) - trapezoid(40.0, 100.0)).abs() < 0.01, "{}", time(None));
    // Ten blocks are 1 mm: v² = 2 · 500 · 1, 31.6 mm/s; its own block may come on top.
    let ten = time(Some(10));
    let (fast, slow) = ((2.0 * ACCELERATION * 1.1f64).sqrt(), (2.0 * ACCELERATION * 0.8f64).sqrt());
    assert!(ten > 40.0 / fast && ten < 40.0 / slow + slow / ACCELERATION, "{ten} {fast} {slow}");
    assert!(time(Some(40)) < ten && time(Some(40)) > time(None));
}

#[test]
fn dwells_tool_changes_and_run_ups_are_counted_once_each() {
    let path = toolpath(
        "T1 M6\nS5000 M3\nG0 X10\nG1 X20 F600\nG4 P2\nT2 M6\nS8000 M3\nG1 X30\nS8000\nG1 X40\nT2 M6\nG1 X50\nG4 P0.5",
    );
    let found = realise(&path, &as_programmed(&path), &machine());
    let of = |name: &str| found.by_cause.iter().find(|(known, _)| *known == name).unwrap().1;
    let same = |found: f64, wanted: f64| assert!((found - wanted).abs() < 1e-9, "{found} {wanted}");
    same(of("dwell"), 2.5);
    same(of("tool change"), 2.0 * 7.0);
    same(of("spindle run-up"), 2.0 * 1.5);
    same(found.total_s, found.by_cause.iter().map(|(_, seconds)| seconds).sum());
    let moved: f64 = found.move_s.iter().sum();
    same(moved, of("feed") + of("rapid"));
}
