//! Laws that are not affine, runout, coefficients by part, effects, and nonsense that is refused.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

mod common {
    pub mod mills;
}

use common::mills::{cutter, mill, named, side_arcs, spindle, try_cutter};
use feedwright::effects::State;
use feedwright::engage::EngagedArc;
use feedwright::force::{Cap, Cut, Cutter, ForceError};
use feedwright::machine::material::{EffectUse, ForceModel, LinearEdge, Material, Process};
use feedwright::machine::{LimitKind, Profile, Runout, Slice, Tool};
use std::f64::consts::{PI, TAU};

const K: LinearEdge = LinearEdge { k_tc: 842.0, k_rc: 300.0, k_ac: 150.0, k_te: 15.0, k_re: 12.0, k_ae: 2.0 };
const RPS: f64 = 40.0;

fn flat(flutes: u32, helix_deg: f64) -> (Tool, Vec<Slice>) {
    let tool = mill(Profile::flat(10.0, 20.0), 10.0, flutes, helix_deg);
    let slices = tool.profile.slices(0.25);
    (tool, slices)
}

fn cut(arcs: &[EngagedArc]) -> Cut<'_> {
    Cut { arcs, ..Cut::default() }
}

#[test]
fn sampling_agrees_with_the_closed_forms() {
    let entry_rad = 1.7;
    for helix_deg in [0.0, 30.0] {
        let (mut tool, slices) = flat(4, helix_deg);
        let arcs = side_arcs(&slices, 6.0, entry_rad, PI);
        let exact = cutter(&tool, &slices, ForceModel::LinearEdge(K), RPS).loads(&cut(&arcs), 12.0);
        tool.runout = Some(Runout { offset_mm: 1e-12, angle_rad: 0.3 });
        let sampled = cutter(&tool, &slices, ForceModel::LinearEdge(K), RPS).loads(&cut(&arcs), 12.0);
        for axis in 0..3 {
            assert!((exact.mean_force_n[axis] - sampled.mean_force_n[axis]).abs() < 1e-5 * exact.force_xy_peak_n);
        }
        assert!((exact.power_w - sampled.power_w).abs() < 1e-4);
        // Samples take the edge on a ring at one angle: of those that cut one may be too many, a ring's lag of the arc.
        let lag_rad = slices[arcs[0].slice as usize].dz_mm() * tool.helix_rad.tan() / tool.radius_mm();
        let ratio = sampled.force_xy_peak_n / exact.force_xy_peak_n;
        assert!(ratio > 0.99 && ratio <= 1.0 + lag_rad / (PI - entry_rad) + 1e-9, "{helix_deg}: {ratio}");
    }
}

#[test]
fn a_tooth_left_idle_by_runout_leaves_its_chip_to_the_other() {
    let (mut tool, slices) = flat(2, 0.0);
    let arcs = side_arcs(&slices, 4.0, 0.0, PI);
    let feed = 2.0 * RPS * 0.02;
    let even = cutter(&tool, &slices, ForceModel::LinearEdge(K), RPS).loads(&cut(&arcs), feed);
    tool.runout = Some(Runout { offset_mm: 0.05, angle_rad: 0.0 });
    let line = cutter(&tool, &slices, ForceModel::LinearEdge(K), RPS).line(&cut(&arcs));
    let one = line.loads(feed);
    assert!((one.chip_thickness_max_mm - 0.04).abs() < 1e-4, "{}", one.chip_thickness_max_mm);
    // Removal, and so cutting torque, stays; only one edge rubs.
    let edge = 2.0 / TAU * K.k_te * 4.0 * PI * 5.0;
    assert!((even.torque_nm * 1e3 - one.torque_nm * 1e3 - 0.5 * edge).abs() < 1e-3 * edge);
    assert!(one.force_xy_peak_n > even.force_xy_peak_n);
    // The largest feed below which every sampled load is within the limit.
    let Cap::Feed { feed_mm_s, .. } = line.cap(LimitKind::ForceXy, 250.0) else { panic!("in reach") };
    for part in 1..=20 {
        assert!(line.loads(feed_mm_s * f64::from(part) / 20.0).force_xy_peak_n <= 250.0 * (1.0 + 1e-9));
    }
    assert!((line.loads(feed_mm_s).force_xy_peak_n / 250.0 - 1.0).abs() < 1e-6);
}

#[test]
fn kienzle_torque_is_the_integral_of_its_power_law() {
    let (tool, slices) = flat(3, 30.0);
    let arcs = side_arcs(&slices, 5.0, 0.0, 1.2);
    let model = named("kienzle", &[("k_c11", 1500.0), ("m_c", 0.25)]);
    let line = cutter(&tool, &slices, model, RPS).line(&cut(&arcs));
    let ft: f64 = 0.08;
    let steps = 200_000;
    let integral: f64 = (0..steps).map(|k| ((f64::from(k) + 0.5) * 1.2 / f64::from(steps)).sin().powf(0.75)).sum();
    let torque = 3.0 / TAU * 5.0 * 5.0 * 1500.0 * ft.powf(0.75) * integral * 1.2 / f64::from(steps);
    let found = line.loads(ft * 3.0 * RPS).torque_nm * 1e3;
    assert!((found / torque - 1.0).abs() < 2e-3, "{found} {torque}");
    let Cap::Feed { feed_mm_s, per_unit } = line.cap(LimitKind::Power, 300.0) else { panic!("in reach") };
    assert!((line.loads(feed_mm_s).power_w - 300.0).abs() < 1e-5 && per_unit > 0.0);
}

#[test]
fn a_response_that_falls_again_is_capped_at_its_first_crossing() {
    let (tool, slices) = flat(2, 30.0);
    let arcs = side_arcs(&slices, 5.0, 0.0, PI / 2.0);
    let model = named("response", &[("b0", 10.0), ("b_l", 0.0), ("b_t", 1000.0), ("b_tt", -1000.0)]);
    let line = cutter(&tool, &slices, model, RPS).line(&cut(&arcs));
    // 10 + 1000 t − 1000 t² = 170 at t = 0.2 and, falling, at 0.8.
    let Cap::Feed { feed_mm_s, .. } = line.cap(LimitKind::ForceXy, 170.0) else { panic!("in reach") };
    assert!((feed_mm_s / (2.0 * RPS) - 0.2).abs() < 1e-6);
    assert_eq!(line.cap(LimitKind::ForceXy, 5.0), Cap::Unreachable);
    assert_eq!(line.cap(LimitKind::ForceXy, 1000.0), Cap::Free);
}

#[test]
fn the_bottom_may_have_its_own_coefficients() {
    let (tool, slices) = flat(3, 30.0);
    let own = [("k_tc", 800.0), ("k_te", 15.0), ("k_rc", 300.0), ("bottom_k_rc", 900.0)];
    let same = [("k_tc", 800.0), ("k_te", 15.0), ("k_rc", 300.0)];
    let all: Vec<EngagedArc> =
        (0..slices.len()).map(|k| EngagedArc { slice: k as u32, entry_rad: 0.0, exit_rad: TAU as f32 }).collect();
    let side = side_arcs(&slices, 5.0, 1.0, PI);
    let loads =
        |name: &str, keys: &[(&str, f64)], cut: &Cut| cutter(&tool, &slices, named(name, keys), RPS).loads(cut, 3.0);
    let plunge = Cut { arcs: &all, tangent_z: -1.0, ..Cut::default() };
    let ratio = loads("linear-edge-by-part", &own, &plunge).force_axial_peak_n
        / loads("linear-edge", &same, &plunge).force_axial_peak_n;
    assert!((ratio - 3.0).abs() < 1e-9, "{ratio}");
    assert_eq!(loads("linear-edge-by-part", &own, &cut(&side)), loads("linear-edge", &same, &cut(&side)));
}

fn with_effect(name: &str, parameters: &[(&str, f64)]) -> Process {
    let parameters = parameters.iter().map(|(key, value)| ((*key).to_owned(), *value)).collect();
    Process { effects: vec![EffectUse { name: name.to_owned(), parameters }], ..Process::default() }
}

/// A meter that reads P (1 + c (P/P₁)^p): what it shows beyond the load counts as load, at every power by its own share.
#[test]
fn an_excess_of_the_drive_acts_by_the_power_of_the_cut() {
    let (tool, slices) = flat(3, 30.0);
    let arcs = side_arcs(&slices, 5.0, 1.9, PI);
    let line = |process: &Process| {
        try_cutter(&tool, &slices, ForceModel::LinearEdge(K), process, RPS).expect("a known effect").line(&cut(&arcs))
    };
    let plain = line(&Process::default());
    let full_w = plain.loads(10.0).power_w;
    let of_power = with_effect("drive-efficiency", &[("excess", 0.3), ("exponent", 2.0), ("full_power", full_w)]);
    let full_nm = full_w / (TAU * RPS);
    let of_torque = with_effect("drive-efficiency", &[("excess", 0.3), ("exponent", 2.0), ("full_torque", full_nm)]);
    for process in [of_power, of_torque] {
        let read = line(&process);
        for feed in [2.0, 10.0, 20.0] {
            let (under, over) = (plain.loads(feed), read.loads(feed));
            let factor = 1.0 + 0.3 * (under.power_w / full_w).powi(2);
            assert!((over.power_w / under.power_w / factor - 1.0).abs() < 1e-12, "{feed}");
            assert!((over.force_xy_peak_n / under.force_xy_peak_n / factor - 1.0).abs() < 1e-12, "{feed}");
            assert_eq!(over.chip_thickness_max_mm, under.chip_thickness_max_mm);
        }
        for kind in [LimitKind::ForceXy, LimitKind::Power, LimitKind::Torque] {
            let limit = read.loads(15.0).bounded_by(kind).expect("a load");
            let Cap::Feed { feed_mm_s, .. } = read.cap(kind, limit) else { panic!("in reach") };
            assert!((feed_mm_s / 15.0 - 1.0).abs() < 1e-6, "{kind:?} {feed_mm_s}");
        }
    }
}

#[test]
fn effects_of_the_process_model_act_on_loads_and_caps() {
    let (tool, slices) = flat(3, 30.0);
    let arcs = side_arcs(&slices, 5.0, 1.9, PI);
    let base = cutter(&tool, &slices, ForceModel::LinearEdge(K), RPS).line(&cut(&arcs));
    let worn =
        with_effect("flank-wear", &[("growth_per_100m", 1.0), ("run_in", 0.0), ("run_in_length", 1.0), ("end", 0.0)]);
    let state = State { worn: 1.0, ..State::default() };
    let cutter = try_cutter(&tool, &slices, ForceModel::LinearEdge(K), &worn, RPS).expect("a known effect");
    let line = cutter.line(&Cut { state, ..cut(&arcs) });
    assert!((line.loads(0.0).torque_nm / base.loads(0.0).torque_nm - 2.0).abs() < 1e-9, "edge forces twice");
    let extra = base.loads(0.0).torque_nm;
    assert!((line.loads(9.0).torque_nm - base.loads(9.0).torque_nm - extra).abs() < 1e-9);
    let caps = [LimitKind::ForceXy, LimitKind::Power, LimitKind::Deflection];
    for kind in caps {
        let limit = 2.0 * line.loads(0.0).bounded_by(kind).expect("a load");
        let Cap::Feed { feed_mm_s, .. } = line.cap(kind, limit) else { panic!("in reach") };
        assert!((line.loads(feed_mm_s).bounded_by(kind).expect("a load") / limit - 1.0).abs() < 1e-9, "{kind:?}");
    }
    // An effect of chip thickness makes loads bend: caps come from the first crossing.
    let thin = with_effect("size-effect", &[("exponent", 0.3)]);
    let sized =
        try_cutter(&tool, &slices, ForceModel::LinearEdge(K), &thin, RPS).expect("a known effect").line(&cut(&arcs));
    let Cap::Feed { feed_mm_s, .. } = sized.cap(LimitKind::ForceXy, 300.0) else { panic!("in reach") };
    assert!((sized.loads(feed_mm_s).force_xy_peak_n / 300.0 - 1.0).abs() < 1e-8);
    assert!(sized.loads(0.5).force_xy_peak_n > base.loads(0.5).force_xy_peak_n);
}

/// Worn to twice the index: `response` gains its b0, which is the index, `layer` what it gives at no chip, the other models their edge
/// terms.
#[test]
fn flank_wear_acts_on_the_edge_force_of_every_model_or_is_refused() {
    let (tool, slices) = flat(2, 30.0);
    let arcs = side_arcs(&slices, 5.0, 0.0, PI / 2.0);
    let worn = with_effect("flank-wear", &[("growth_per_100m", 1.0), ("run_in", 0.0)]);
    let state = State { worn: 1.0, ..State::default() };
    let response = [("b0", 10.0), ("b_l", 2.0), ("b_t", 1000.0), ("b_lt", 30.0)];
    let layer = [("c0", 3.0), ("c1", 0.4), ("c2", 2.0), ("c3", 0.1)];
    let kienzle = [("k_c11", 1500.0), ("m_c", 0.25), ("k_te", 20.0), ("k_re", 10.0)];
    let torque = |line: &feedwright::force::LoadLine, feed: f64| line.loads(feed).torque_nm;
    let lines = |name: &str, keys: &[(&str, f64)]| {
        let new = cutter(&tool, &slices, named(name, keys), RPS).line(&cut(&arcs));
        let old = try_cutter(&tool, &slices, named(name, keys), &worn, RPS).expect("it has an edge force");
        (new, old.line(&Cut { state, ..cut(&arcs) }))
    };
    // Two teeth, each a quarter of a turn in the cut, 5 mm deep on a radius of 5 mm.
    let of_kienzle = 1e-3 * 2.0 * 0.25 * 20.0 * 5.0 * 5.0;
    let b0_alone = cutter(&tool, &slices, named("response", &[("b0", 10.0), ("b_l", 0.0), ("b_t", 0.0)]), RPS);
    let of_response = torque(&b0_alone.line(&cut(&arcs)), 0.0);
    for (name, keys, edge) in [
        ("response", &response[..], Some(of_response)),
        ("layer", &layer[..], None),
        ("kienzle", &kienzle[..], Some(of_kienzle)),
    ] {
        let (new, old) = lines(name, keys);
        let edge = edge.unwrap_or_else(|| torque(&new, 0.0));
        for feed in [0.5, 4.0, 8.0] {
            let more = torque(&old, feed) - torque(&new, feed);
            assert!(edge > 0.0 && (more / edge - 1.0).abs() < 1e-3, "{name} at {feed}: {more} for {edge}");
        }
    }
    let none = [
        ("response", vec![("b0", 0.0), ("b_l", 0.0), ("b_t", 1000.0)]),
        // Negative for short contacts.
        ("response", vec![("b0", -1.0), ("b_l", 2.0), ("b_t", 1000.0)]),
        ("layer", vec![("c0", 3.0), ("c1", -0.4), ("c2", 2.0), ("c3", 0.1)]),
        ("kienzle", vec![("k_c11", 1500.0), ("m_c", 0.25)]),
        ("linear-edge", vec![("k_tc", 800.0), ("k_te", 0.0)]),
        ("polynomial", vec![("a0", 800.0), ("b0", 300.0)]),
    ];
    for (name, keys) in none {
        let error = try_cutter(&tool, &slices, named(name, &keys), &worn, RPS).expect_err(name).to_string();
        assert!(error.contains("flank-wear makes edge forces grow") && error.contains(name), "{error}");
        assert!(try_cutter(&tool, &slices, named(name, &keys), &Process::default(), RPS).is_ok(), "{name}");
    }
}

/// Where the model has no edge coefficients, an edge force of k_e = l·k_c takes the torque that the linear edge model gives;
/// what only the meter reads changes no cut.
#[test]
fn edge_force_is_that_of_the_edge_coefficient_and_meters_change_no_cut() {
    let (tool, slices) = flat(3, 30.0);
    let arcs = side_arcs(&slices, 5.0, 1.9, PI);
    let k = LinearEdge { k_te: 0.0, k_re: 0.0, k_ae: 0.0, ..K };
    let process = with_effect("edge-force", &[("equivalent_chip", 0.02)]);
    let with = try_cutter(&tool, &slices, ForceModel::LinearEdge(k), &process, RPS).expect("a known effect");
    let same = LinearEdge { k_te: 0.02 * k.k_tc, ..k };
    let edge = cutter(&tool, &slices, ForceModel::LinearEdge(same), RPS);
    for feed in [2.0, 10.0, 30.0] {
        let (found, expected) = (with.loads(&cut(&arcs), feed).torque_nm, edge.loads(&cut(&arcs), feed).torque_nm);
        assert!((found / expected - 1.0).abs() < 1e-6, "{found} for {expected} at {feed} mm/s");
    }
    let process = with_effect("axis-power", &[("friction", 0.5), ("acceleration", 0.5)]);
    let meter = try_cutter(&tool, &slices, ForceModel::LinearEdge(K), &process, RPS).expect("a known effect");
    let plain = cutter(&tool, &slices, ForceModel::LinearEdge(K), RPS);
    assert_eq!(meter.loads(&cut(&arcs), 10.0), plain.loads(&cut(&arcs), 10.0));
}

/// A tool that bends: equal teeth bend it alike, so that nothing changes; where runout makes one tooth cut more, bending
/// gives way and evens the teeth out, the more the softer the tool.
#[test]
fn bending_evens_out_runout_and_nothing_else() {
    let (mut tool, slices) = flat(4, 30.0);
    let arcs = side_arcs(&slices, 5.0, 1.9, PI);
    let law = |deflection: f64| {
        let values = [("a1", 12.9), ("a2", 6.7), ("x0", -0.62), ("dx", 0.44), ("k_f", 0.83), ("chip_flow", 0.47)];
        named("sigmoid", &[&values[..], &[("chip_range", 0.06), ("deflection", deflection)]].concat())
    };
    let spread = |tool: &Tool, deflection: f64| {
        let loads = cutter(tool, &slices, law(deflection), RPS).loads(&cut(&arcs), 10.0);
        loads.force_xy_peak_n / loads.force_xy_mean_n
    };
    tool.youngs_modulus_mpa = 600e3;
    assert!((spread(&tool, 1.0) / spread(&tool, 0.0) - 1.0).abs() < 1e-9, "equal teeth");
    tool.runout = Some(Runout { offset_mm: 0.01, angle_rad: 0.3 });
    let rigid = spread(&tool, 0.0);
    let stiff = spread(&tool, 1.0);
    tool.youngs_modulus_mpa = 300e3;
    let soft = spread(&tool, 1.0);
    println!("peak over mean: {rigid:.4} rigid, {stiff:.4} stiff, {soft:.4} soft");
    assert!(soft < stiff && stiff < rigid);
}

fn refused(change: impl Fn(&mut Tool), model: ForceModel, process: &Process, rps: f64) -> String {
    let (mut tool, slices) = flat(3, 30.0);
    change(&mut tool);
    try_cutter(&tool, &slices, model, process, rps).expect_err("nonsense").to_string()
}

#[test]
fn nonsense_is_refused_with_its_key_and_the_sensible_range() {
    let sound = || ForceModel::LinearEdge(K);
    let none = Process::default();
    let cases = [
        (refused(|tool| tool.flutes = 0, sound(), &none, RPS), "flutes = 0"),
        (refused(|tool| tool.helix_rad = PI / 2.0, sound(), &none, RPS), "helix = 90"),
        (refused(|_| {}, ForceModel::LinearEdge(LinearEdge { k_tc: -1.0, ..K }), &none, RPS), "k_tc = -1"),
        (refused(|_| {}, ForceModel::LinearEdge(LinearEdge { k_te: 1e5, ..K }), &none, RPS), "between 0 and 1000"),
        (refused(|_| {}, ForceModel::LinearEdge(LinearEdge { k_rc: f64::NAN, ..K }), &none, RPS), "k_rc"),
        (refused(|_| {}, sound(), &none, 0.0), "spindle stands still"),
        (refused(|_| {}, sound(), &none, 2000.0), "S = 120000"),
        (refused(|_| {}, named("sigmoid", &[("a1", 12.0)]), &none, RPS), "sigmoid needs a2"),
        (refused(|_| {}, named("guess", &[]), &none, RPS), "guess"),
        (refused(|_| {}, named("kienzle", &[("k_c11", 9.0), ("m_c", 0.2), ("mc", 0.2)]), &none, RPS), "mc"),
        (refused(|_| {}, sound(), &with_effect("gremlins", &[]), RPS), "gremlins"),
        (refused(|tool| tool.pitch_rad = vec![1.0; 3], sound(), &none, RPS), "pitch"),
    ];
    for (message, part) in cases {
        assert!(message.contains(part), "{message:?} does not say {part:?}");
    }
    let (tool, slices) = flat(3, 30.0);
    let nothing = Material { name: "x".into(), model: named("guess", &[]), uncertainty: None };
    let error = Cutter::new(&tool, &nothing, &spindle(), &none, &slices, RPS).expect_err("unknown");
    assert_eq!(error, ForceError::UnknownModel { name: "guess".into() });
}
