//! The third generator of logs (`benches/shop`) against closed forms: what it writes is what its physics say. The files are
//! those of the bench; they use nothing of the crate.

#![allow(dead_code, unused_imports, clippy::unwrap_used)]

#[path = "../benches/shop/causes.rs"]
mod causes;
#[path = "../benches/shop/dice.rs"]
mod dice;
#[path = "../benches/shop/engagement.rs"]
mod engagement;
#[path = "../benches/shop/judge.rs"]
mod judge;
#[path = "../benches/shop/machine.rs"]
mod machine;
#[path = "../benches/shop/physics.rs"]
mod physics;
#[path = "../benches/shop/programs.rs"]
mod programs;
#[path = "../benches/shop/shop_floor.rs"]
mod shop_floor;
#[path = "../benches/shop/tables.rs"]
mod tables;

use std::f64::consts::{PI, TAU};

use causes::{Hidden, Truth};
use engagement::{Grid, RIM, Trail};
use judge::{Answer, judge};
use machine::{Drives, Step, run};
use physics::{Coefficients, Runout, Station, chip_thickness, end_face_power, peak_force, power};
use programs::{Needs, everyday};
use shop_floor::{Machine, misfit_w, simulate};

const K: Coefficients = Coefficients { k_tc: 800.0, k_te: 15.0, k_rc: 300.0, k_re: 12.0 };

/// A 10 mm tool of three teeth at 6000 rev/min and 20 mm/s along x.
fn station() -> Station {
    Station { along: [1.0, 0.0], speed_mm_s: 20.0, rpm: 6000.0, radius_mm: 5.0, flutes: 3, ..Station::default() }
}

/// Cuts along x over the block [0, 60] × [0, 40] × [−20, 0] at this y and 3 mm deep, and returns the rim in its middle.
fn rim_at(y: f64) -> [f64; RIM] {
    let inside = |p: [f64; 2]| (p[0] > 0.0 && p[0] < 60.0 && p[1] > 0.0 && p[1] < 40.0).then_some(0.0);
    let mut grid = Grid::new([-1.0, -1.0], [61.0, 41.0], 0.08, inside);
    let mut sum = [0.0; RIM];
    let mut depth = [0.0; RIM];
    let mut trail = Trail::default();
    let mut x: f64 = -6.0;
    let mut counted = 0.0;
    while x < 50.0 {
        let (from, to) = ([x, y, -3.0], [x + 0.3, y, -3.0]);
        trail.before(&mut grid, from, to, 5.0);
        grid.rim(to, [1.0, 0.0], 5.0, &mut depth);
        trail.after(&mut grid, from, to, 5.0);
        if x > 20.0 {
            sum.iter_mut().zip(depth).for_each(|(sum, depth)| *sum += depth);
            counted += 1.0;
        }
        x += 0.3;
    }
    sum.map(|depth| depth / counted)
}

fn near(value: f64, wanted: f64, share: f64) {
    assert!((value / wanted - 1.0).abs() < share, "{value} for {wanted}");
}

/// Power of cutting over an arc of contact from the side, W: f times the width, which is k_tc·MRR, and the second order
/// of the circle that the tooth before has cut, f²/2 ∫ cos² φ dφ; times the teeth a second, the depth of 3 mm and k_tc.
fn cutting_w(width_mm: f64, arc: f64) -> f64 {
    let feed = 20.0 / 300.0;
    let chip = feed * width_mm + feed * feed / 2.0 * (arc / 2.0 + (2.0 * arc).sin() / 4.0);
    K.k_tc * chip * 3.0 * 300.0 / 1000.0
}

#[test]
fn a_full_slot_takes_k_tc_times_the_removal_rate_and_half_a_turn_of_edge() {
    let [cutting, edge] = power(&station(), &rim_at(20.0), &K, Runout::default(), &[], 1.0);
    near(cutting, K.k_tc * 10.0 * 3.0 * 20.0 / 1000.0, 0.01);
    near(cutting, cutting_w(10.0, PI), 0.002);
    // Each tooth is in contact for half a turn: N a ω R / 2.
    near(edge, K.k_te * 3.0 * 3.0 * 6000.0 / 60.0 * TAU * 5.0 / 2.0 / 1000.0, 0.01);
}

#[test]
fn a_side_cut_takes_its_removal_rate_and_its_arc_of_contact() {
    // 2 mm wide: the arc is arccos(1 − 2·2/10).
    for y in [-3.0, 43.0] {
        let [cutting, edge] = power(&station(), &rim_at(y), &K, Runout::default(), &[], 1.0);
        let arc = (1.0_f64 - 0.4).acos();
        near(cutting, cutting_w(2.0, arc), 0.005);
        near(edge, K.k_te * 3.0 * 3.0 * 6000.0 / 60.0 * 5.0 * arc / 1000.0, 0.01);
    }
}

#[test]
fn up_and_climb_lie_on_their_sides() {
    // The block is left of the feed: the tooth enters at φ = 0 with no chip, up milling.
    let up = rim_at(-3.0);
    assert!(up[..RIM / 4].iter().sum::<f64>() > 10.0 * up[RIM / 2..].iter().sum::<f64>());
    let climb = rim_at(43.0);
    assert!(climb[RIM * 3 / 4..].iter().sum::<f64>() > 10.0 * climb[..RIM / 2].iter().sum::<f64>());
}

#[test]
fn the_chip_is_what_the_tooth_before_has_left() {
    near(chip_thickness(0.1, 5.0, PI / 2.0), 0.1, 1e-9);
    near(chip_thickness(0.1, 5.0, PI / 6.0), 0.05, 0.02);
    // Runout moves chip from tooth to tooth; their sum is that of the feed as long as all of them cut.
    let rim = rim_at(20.0);
    let runout = Runout { offset_mm: 0.004, angle: 0.7 };
    let [even, _] = power(&station(), &rim, &K, Runout::default(), &[], 1.0);
    let [uneven, _] = power(&station(), &rim, &K, runout, &[], 1.0);
    near(uneven, even, 0.02);
}

#[test]
fn going_straight_down_takes_the_removal_rate_and_the_end_edges() {
    let area = PI * 25.0;
    let [cutting, edge] = end_face_power(&station(), area, 2.0, &K);
    near(cutting, K.k_tc * area * 2.0 / 1000.0, 1e-9);
    // Three edges of 5 mm, whose mean speed is ω R / 2.
    near(edge, K.k_te * 3.0 * 5.0 * 6000.0 / 60.0 * TAU * 2.5 / 1000.0, 1e-9);
}

/// A straight way of 100 mm and a way back, at 50 mm/s.
fn there_and_back() -> Vec<Step> {
    let place = |i: usize| [if i <= 200 { 0.5 * i as f64 } else { 200.0 - 0.5 * i as f64 }, 0.0, 0.0];
    (0..400)
        .map(|i| Step {
            from: place(i),
            to: place(i + 1),
            length_mm: 0.5,
            speed_mm_s: 50.0,
            rapid: false,
            wait_s: 0.0,
            rpm: 6000.0,
            tool: 0,
            line: 1,
            pass: 0,
        })
        .collect()
}

#[test]
fn the_machine_starts_stops_and_turns_as_its_acceleration_says() {
    let drives =
        Drives { acceleration_mm_s2: 500.0, corner_tolerance_mm: 0.01, settle_s: 0.0, override_at: None, holds: &[] };
    let ticks = run(&there_and_back(), &drives);
    let last = ticks.last().unwrap();
    // Each way: 100 mm at 50 mm/s, and v/a for getting there and stopping.
    near(last.time_s + last.duration_s, 2.0 * (100.0 / 50.0 + 50.0 / 500.0), 0.002);
    let slow = run(&there_and_back(), &Drives { override_at: Some(&|_| 0.5), ..drives });
    near(slow.last().unwrap().time_s, 2.0 * (100.0 / 25.0 + 25.0 / 500.0), 0.01);
}

#[test]
fn a_plain_machine_reads_what_the_plain_model_says_and_a_hidden_cause_does_not() {
    let job = everyday(3, Needs::Any, false);
    let machine = Machine::new(3);
    let plain = simulate(&job, &machine, &Hidden::default());
    assert!(plain.duration_s > 60.0 && plain.duration_s < 900.0, "{} s", plain.duration_s);
    assert!(misfit_w(&plain, &plain, &machine) < 0.01);
    let proud = Hidden { diameter_mm: -0.4, ..Hidden::default() };
    assert!(misfit_w(&simulate(&job, &machine, &proud), &plain, &machine) > 1.0);
}

#[test]
fn the_judge_tells_right_from_false_and_one_of_several_from_both() {
    let causes = causes::all();
    let cause = |name: &str| causes.iter().find(|cause| cause.name == name).unwrap();
    let answer = |text: &str| Answer::read(&serde_json::from_str(text).unwrap());
    let wear = answer(r#"{"effects": [{"name": "flank-wear"}]}"#);
    assert!(judge(cause("flank-wear"), &wear).right);
    assert!(!judge(cause("plain"), &wear).right);
    assert_eq!(judge(cause("hard-zone"), &wear).false_names, ["flank-wear"]);
    assert!(!judge(cause("wear+proud"), &wear).right);
    let rivals =
        answer(r#"{"effects": [{"name": "flank-wear"}], "confounded": [{"names": ["flank-wear", "tare-warm-up"]}]}"#);
    // Several names are right in their own column alone, and of a plain log false.
    let verdict = judge(cause("tare-warm-up"), &rivals);
    assert!(!verdict.right && verdict.one_of && verdict.among && verdict.false_names.is_empty());
    let verdict = judge(cause("hard-zone"), &rivals);
    assert!(verdict.one_of && !verdict.among && verdict.false_names.is_empty());
    assert_eq!(judge(cause("plain"), &rivals).false_names, ["flank-wear"]);
    let by_tool = answer(
        r#"{"effects": [{"name": "edge-chipping"}],
            "confounded": [{"names": ["edge-chipping", "a load of the cut that differs by tool"]}]}"#,
    );
    assert!(judge(cause("by-tool"), &by_tool).among && !judge(cause("by-tool"), &by_tool).right);
    let carried = answer(r#"{"effects": [], "unnamed": [{"covariate": "predicted power"}]}"#);
    assert!(judge(cause("saturation"), &carried).covariate_right);
    assert!(!judge(cause("gearbox"), &carried).covariate_right);
    let speed = answer(r#"{"effects": [], "unnamed": {"covariate": ["spindle speed", "time"]}}"#);
    assert!(judge(cause("gearbox"), &speed).right);
    let hint = answer(r#"{"effects": [], "unexplained": {"largest_correlate": "time (persists over about 2 s)"}}"#);
    assert!(!judge(cause("coolant-off"), &hint).right);
    assert!(matches!(cause("gearbox").truth, Truth::Unlisted(_)));
}

#[test]
fn the_peak_force_of_a_straight_edge_is_that_of_its_thickest_chip_and_grows_with_runout() {
    // One straight edge in a slot 3 mm deep: at φ the force is dz·sqrt((k_tc h + k_te)² + (k_rc h + k_re)²), largest ahead.
    let at = Station { flutes: 1, speed_mm_s: 20.0 / 3.0, depth_mm: 3.0, ..station() };
    let rim = [3.0; RIM];
    let even = peak_force(&at, &rim, &K, Runout::default(), 0.0);
    let chip = 20.0 / 300.0;
    near(even, 3.0 * (K.k_tc * chip + K.k_te).hypot(K.k_rc * chip + K.k_re), 0.005);
    // Three teeth of which one stands out: it takes more than its share.
    let at = Station { depth_mm: 3.0, ..station() };
    let even = peak_force(&at, &rim, &K, Runout::default(), 30.0);
    let uneven = peak_force(&at, &rim, &K, Runout { offset_mm: 0.01, angle: 0.3 }, 30.0);
    assert!(uneven > 1.02 * even, "{uneven} {even}");
}

#[test]
fn a_table_has_its_cuts_and_what_is_hidden_leaves_the_plain_model() {
    let plain = tables::table("plain", 1.0, 5, 0.03);
    assert_eq!(plain.text.lines().count(), 65);
    near(plain.seen, 1.0, 1e-6);
    assert!(tables::table("flank-wear", 1.0, 5, 0.03).seen > 1.2);
    assert!(tables::table("path-curvature", 1.0, 5, 0.03).seen > 1.2);
}
