//! Two algorithms for one problem: the exact pass against the convex program, prices against moving the limit, jerk against
//! its definition, arcs against the closed form.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use feedwright::ids::MoveId;
use feedwright::schedule::check::{jerk_share, residuals};
use feedwright::schedule::convex::{Window, WindowAnswer, scales, solve_window};
use feedwright::schedule::exact_pass::{Chain, Leg, Row, cap_prices, exact_pass, leg_times};
use feedwright::schedule::interior_point::solve_interior;
use feedwright::schedule::optimum::{ACCEPTED, JERK_ACCEPTED, Optimum, Solvers, TIME_ACCEPTED, optimum, optimum_by};
use feedwright::schedule::track::Track;
use proptest::prelude::*;

fn leg(ds_mm: f64, speed: f64, accel_mm_s2: f64, jerk_mm_s3: f64) -> Leg {
    Leg { ds_mm, cap_b: speed * speed, accel_mm_s2, jerk_mm_s3, first_row: 0, row_count: 0 }
}

/// A chain from rest to rest whose legs are linear in b (their law written as rows), from (length, speed, corner) triples.
fn linear_chain(data: &[(f64, f64, f64)]) -> Chain {
    let mut chain = Chain { point_b: vec![0.0], ..Chain::default() };
    for (i, (ds_mm, speed, corner)) in data.iter().enumerate() {
        let mut leg = leg(*ds_mm, *speed, 0.0, f64::INFINITY);
        (leg.first_row, leg.row_count) = (chain.rows.len() as u32, 2);
        let r = 2.0 * 500.0 * ds_mm;
        chain.rows.extend([Row { p: 1.0, q: -1.0, r }, Row { p: -1.0, q: 1.0, r }]);
        chain.legs.push(leg);
        chain.point_b.push(if i + 1 == data.len() { 0.0 } else { corner * corner });
    }
    chain
}

/// A window by clarabel, at the first scale that gives an answer.
fn by_clarabel(window: &Window) -> WindowAnswer {
    scales(window).into_iter().find_map(|scale| solve_window(window, scale)).expect("solved")
}

fn time(chain: &Chain, b: &[f64]) -> f64 {
    leg_times(chain, b).iter().sum()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn the_convex_program_and_the_exact_pass_agree(
        data in prop::collection::vec((0.05f64..3.0, 2.0f64..120.0, 1.0f64..150.0), 3..120)
    ) {
        let chain = linear_chain(&data);
        let caps = chain.point_caps();
        let exact = exact_pass(&chain);
        let window =
            Window { chain: &chain, caps: &caps, reference: &exact, first: 0, last: data.len(), change_s: 0.0 };
        let answer = solve_interior(&window).expect("solved");
        let worst = residuals(&chain, &caps, 0, &answer.b);
        prop_assert!(worst.bound <= ACCEPTED, "{worst:?}");
        let ours = time(&chain, &exact);
        prop_assert!((time(&chain, &answer.b) / ours - 1.0).abs() <= TIME_ACCEPTED, "{ours} {}", time(&chain, &answer.b));
        // clarabel says the same, less exactly near rest, where a residual of b weighs most in time.
        let other = by_clarabel(&window);
        let used: Vec<f64> = other.b.iter().zip(&exact).map(|(convex, exact)| convex.min(*exact)).collect();
        prop_assert!(residuals(&chain, &caps, 0, &other.b).bound <= ACCEPTED);
        prop_assert!((time(&chain, &used) / ours - 1.0).abs() <= 5e-4, "{ours} {}", time(&chain, &used));
    }

    #[test]
    fn two_solvers_agree_where_jerk_binds(
        data in prop::collection::vec((0.2f64..3.0, 5.0f64..120.0, 1.0f64..150.0), 10..100),
        jerk in 4.0f64..5.5
    ) {
        let mut chain = linear_chain(&data);
        for leg in &mut chain.legs { leg.jerk_mm_s3 = 10f64.powf(jerk); }
        let (caps, exact) = (chain.point_caps(), exact_pass(&chain));
        let window = Window { chain: &chain, caps: &caps, reference: &exact, first: 0, last: data.len(), change_s: 0.0 };
        let ours = solve_interior(&window).expect("solved").b;
        let worst = residuals(&chain, &caps, 0, &ours);
        prop_assert!(worst.bound <= ACCEPTED && worst.jerk <= JERK_ACCEPTED, "{worst:?}");
        // With the jerk linearised at our answer, clarabel finds nothing faster: it is a stationary point.
        let theirs = by_clarabel(&Window { reference: &ours, ..window }).b;
        let jerk_time = |b: &[f64]| (0..data.len()).map(|i| {
            let factor = if b[i].min(b[i + 1]) <= 0.0 { 3.0 } else { 2.0 };
            factor * chain.legs[i].ds_mm / (b[i].sqrt() + b[i + 1].sqrt())
        }).sum::<f64>();
        prop_assert!(jerk_time(&ours) <= (1.0 + 1e-5) * jerk_time(&theirs), "{} {}", jerk_time(&ours), jerk_time(&theirs));
    }

    #[test]
    fn prices_are_what_moving_the_cap_saves(
        data in prop::collection::vec((0.05f64..5.0, 2.0f64..120.0, 1.0f64..150.0), 3..40),
        at in 0usize..40
    ) {
        let mut chain = linear_chain(&data);
        // Straight legs: trapezoids inside.
        for leg in &mut chain.legs { (leg.accel_mm_s2, leg.row_count) = (500.0, 0); }
        let at = at % data.len();
        let b = exact_pass(&chain);
        let prices = cap_prices(&chain, &b);
        let alone = |i: usize| chain.point_b[i] > chain.legs[at].cap_b
            && [i.wrapping_sub(1), i].iter().filter(|leg| **leg != at).all(|leg| chain.legs.get(*leg).is_none_or(|leg| leg.cap_b > chain.legs[at].cap_b));
        let mut price = prices.leg_s[at];
        for i in [at, at + 1] { if alone(i) { price += prices.point_s[i]; } }
        let moved = |by: f64| {
            let mut other = chain.clone();
            other.legs[at].cap_b *= 1.0 + by;
            time(&other, &exact_pass(&other))
        };
        let step = 1e-6;
        let (up, down) = (time(&chain, &b) - moved(step), moved(-step) - time(&chain, &b));
        let told = price * chain.legs[at].cap_b * step;
        // At a kink of the optimum the two one-sided slopes differ; the price lies between them.
        let (low, high) = (up.min(down), up.max(down));
        prop_assert!(told >= low - 1e-4 * high.abs() - 1e-12 && told <= high + 1e-4 * high.abs() + 1e-12, "{told} {low} {high}");
    }
}

/// Sixty lines with corners and a jerk limit.
fn jerky_track() -> Track {
    let (accel, jerk) = (500.0, 20000.0);
    let mut chain = Chain { point_b: vec![0.0], ..Chain::default() };
    let mut track = Track::default();
    for i in 0..60 {
        chain.legs.push(leg(3.0 + f64::from(i % 7), 40.0 + 15.0 * f64::from(i % 5), accel, jerk));
        let corner = if i % 9 == 4 { 2.0 } else { 1e3 };
        chain.point_b.push(if i == 59 { 0.0 } else { corner * corner });
        track.tags.push(i as u32);
        track.moves.push(MoveId(i as u32));
    }
    track.chain = chain;
    track
}

#[test]
fn jerk_holds_and_costs_time() {
    let track = jerky_track();
    let exact_s: f64 = time(&track.chain, &exact_pass(&track.chain));
    let answer = optimum(track, 0.0);
    assert!(answer.windows[0] > 0 && answer.windows[1..] == [0, 0], "{:?}", answer.windows);
    let (legs, b) = (&answer.chain.legs, &answer.b);
    let share = |i: usize| jerk_share(&legs[i - 1], &legs[i], [b[i - 1], b[i], b[i + 1]]);
    let worst = (1..legs.len()).filter(|&i| b[i] > 0.0).map(share).fold(0.0, f64::max);
    assert!(worst <= 1.0 + JERK_ACCEPTED, "{worst}");
    let jerk_s: f64 = answer.leg_times().iter().sum();
    assert!(jerk_s > exact_s && jerk_s < 1.3 * exact_s, "{jerk_s} {exact_s}");
}

#[test]
fn a_start_at_constant_jerk_is_met_by_the_grid() {
    // From rest to 20 mm/s and back with a = 1000, J = 20000: each change takes v/a + a/J = 0.07 s over v·0.07/2.
    let track = Track {
        chain: Chain { legs: vec![leg(10.0, 20.0, 1000.0, 20000.0)], point_b: vec![0.0, 0.0], rows: vec![] },
        tags: vec![0],
        moves: vec![MoveId(0)],
    };
    let answer = optimum(track, 0.0);
    let time_s: f64 = answer.leg_times().iter().sum();
    // v/a = 0.02 s is less than a/J = 0.05 s: the top acceleration is √(v J) and a change takes 2 √(v/J).
    let closed = 2.0 * 2.0 * (20.0f64 / 20000.0).sqrt() + (10.0 - 2.0 * 20.0 * (20.0f64 / 20000.0).sqrt()) / 20.0;
    assert!(time_s > closed && time_s < 1.01 * closed, "{time_s} {closed} {answer:?}");
}

#[test]
fn a_charge_on_changes_flattens_the_speed() {
    let data: Vec<(f64, f64, f64)> = (0..40).map(|i| (1.0, if i % 2 == 0 { 60.0 } else { 50.0 }, 1e3)).collect();
    let chain = linear_chain(&data);
    let (caps, exact) = (chain.point_caps(), exact_pass(&chain));
    let solve = |change_s: f64| {
        let window = Window { chain: &chain, caps: &caps, reference: &exact, first: 0, last: 40, change_s };
        by_clarabel(&window).b
    };
    let variation = |b: &[f64]| b.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum::<f64>();
    let (free, charged) = (solve(0.0), solve(1.0));
    assert!(variation(&charged) < 0.9 * variation(&free), "{} {}", variation(&charged), variation(&free));
    // What is saved in changes is paid for in time.
    assert!(time(&chain, &charged) > time(&chain, &free));
    assert!(residuals(&chain, &caps, 0, &charged).bound <= ACCEPTED);
}

/// An answer 1 % above what the accelerations allow.
fn spoilt(answer: WindowAnswer) -> WindowAnswer {
    WindowAnswer { b: answer.b.iter().map(|b| 1.01 * b).collect(), ..answer }
}

#[test]
fn a_window_that_both_solvers_miss_keeps_the_exact_speeds_and_says_so() {
    type First = fn(&Window) -> Option<WindowAnswer>;
    type Second = fn(&Window, f64) -> Option<WindowAnswer>;
    let worse: [(First, Second); 3] = [
        (|_| None, |_, _| None),
        (|window| solve_interior(window).map(spoilt), |window, scale| solve_window(window, scale).map(spoilt)),
        (
            |window| Some(WindowAnswer { b: vec![f64::NAN; window.caps.len()], price_s: vec![] }),
            |window, _| Some(WindowAnswer { b: vec![f64::NAN; window.caps.len()], price_s: vec![] }),
        ),
    ];
    for (first, second) in worse {
        let found: Optimum = optimum_by(&Solvers { first, second }, jerky_track(), 0.0);
        let [windows, _, refused] = found.windows;
        assert!(windows > 0 && refused == windows, "{:?}", found.windows);
        assert_eq!(found.b, exact_pass(&found.chain));
        assert!(
            found.how().contains(&format!("{refused} of them refused by the check and left to the exact pass")),
            "{}",
            found.how()
        );
        assert!(found.jerky > 0 && found.how().contains("jerk above its limit at"), "{}", found.how());
        assert!(found.leg_times().iter().all(|time_s| time_s.is_finite()));
    }
    // The sound solvers say nothing of the kind.
    assert!(!optimum(jerky_track(), 0.0).how().contains("refused"));
}

#[test]
fn a_window_is_asked_again_at_another_scale_before_it_is_given_up() {
    // The first solver gives nothing; the second answers wrongly at the first scale and soundly at the other.
    let second: fn(&Window, f64) -> Option<WindowAnswer> = |window, scale| {
        let answer = solve_window(window, scale)?;
        Some(if scale == scales(window)[0] { spoilt(answer) } else { answer })
    };
    let found = optimum_by(&Solvers { first: |_| None, second }, jerky_track(), 0.0);
    let [windows, by_second, refused] = found.windows;
    assert!(windows > 0 && by_second > 0, "{:?}", found.windows);
    let plain = optimum_by(&Solvers { first: |_| None, second: solve_window }, jerky_track(), 0.0);
    println!("{:?} with the first scale spoilt, {:?} without", found.windows, plain.windows);
    assert!(refused <= plain.windows[2], "{:?} {:?}", found.windows, plain.windows);
    assert!(residuals(&found.chain, &found.chain.point_caps(), 0, &found.b).bound <= ACCEPTED);
}
