//! Logs that know neither where the tool is nor when the program began: the mapping that was put in against the one found.
//!
//! A generated part is cut by a machine that begins late, whose logger's clock runs 1.5 % fast, that is held once in the
//! air for 8 s, and whose operator turns the feed down to 80 % for a fifth of the program. Every reading knows the step and
//! the way along it; the place of that in the predicted program is where it should be tied.

#![allow(clippy::format_collect, clippy::unwrap_used)]

mod common {
    pub mod follow;
}
#[path = "../benches/confusion/generator.rs"]
mod generator;

use feedwright::learn::align::Aligned;
use feedwright::learn::calibrate::plan::{Kind, plan};
use feedwright::learn::dataset::binning::channels;
use feedwright::learn::log::read_log;
use feedwright::learn::program::simulated::{SimulatedProgram, simulate};
use feedwright::learn::session::{LogOptions, aligned, dataset_of, learn};
use feedwright::machine::Job;
use generator::cases::Case;
use generator::motion::Moment;
use generator::physics::{Channel, Coefficients, Milling};
use generator::programs::Part;
use generator::rng::Rng;
use generator::writer::Action;
use std::fmt::Write;

const BEFORE_S: f64 = 7.3;
const STRETCH: f64 = 1.015;
const HELD_S: f64 = 8.0;
const OVERRIDE: f64 = 0.8;
const RATE_HZ: f64 = 10.0;

/// The log, and the moment that every row of it belongs to; `None` outside the program and while it is held.
struct Told {
    text: String,
    moments: Vec<Option<Moment>>,
}

fn told(seed: u64, lines: bool) -> (Part, Told) {
    let part = Part::new(seed);
    let mut machine = Part::new(seed);
    let count = machine.steps.len();
    for step in &mut machine.steps[count * 2 / 5..count * 3 / 5] {
        if let Action::Move { feed_mm_s: Some(feed), .. } = &mut step.action {
            *feed *= OVERRIDE;
        }
    }
    let mut rng = Rng::new(seed, 9);
    let truth = Coefficients::draw(&part, &mut rng);
    let milling = Milling::new(&machine, &truth, &[], Channel::Power);
    let times: Vec<f64> = (0..(milling.end_s() * RATE_HZ) as usize).map(|k| k as f64 / RATE_HZ).collect();
    let readings = milling.read(&times);
    let mean =
        readings.iter().map(|r| r.cutting).sum::<f64>() / readings.iter().filter(|r| r.cutting > 0.0).count() as f64;
    // Held where nothing is cut, past three quarters.
    let held = (readings.len() * 3 / 4..readings.len())
        .find(|&k| readings[k].cutting == 0.0 && readings[k].moment.rps > 0.0 && readings[k].moment.runup.is_none())
        .unwrap();
    let mut out =
        Told { text: format!("time_s,{}spindle_power_w\n", if lines { "line," } else { "" }), moments: Vec::new() };
    let mut row = |t: f64, moment: Option<Moment>, line: usize, value: f64| {
        let value = (value + 0.03 * mean * rng.normal()).max(0.0);
        let place = if lines { format!("{line},") } else { String::new() };
        writeln!(out.text, "{:.3},{place}{value:.1}", STRETCH * t).unwrap();
        out.moments.push(moment);
    };
    let line = |k: usize| part.steps[readings[k].moment.step].line;
    for k in 0..(BEFORE_S * RATE_HZ) as usize {
        row(k as f64 / RATE_HZ, None, 1, 0.0);
    }
    for (k, reading) in readings.iter().enumerate() {
        let late = if k > held { HELD_S } else { 0.0 };
        // Where nothing is cut, the load alone tells of no place: a hold may begin there as well as later.
        let moment = (lines || reading.cutting > 0.0).then_some(reading.moment);
        row(BEFORE_S + times[k] + late, moment, line(k), reading.value);
        if k == held {
            for j in 1..(HELD_S * RATE_HZ) as usize {
                row(BEFORE_S + times[k] + j as f64 / RATE_HZ, None, line(k), reading.value);
            }
        }
    }
    (part, out)
}

fn job_of(part: &Part) -> Job {
    feedwright::setup::load(&part.setup, std::path::Path::new(".")).unwrap().0
}

/// Predicted time of the program at a place of a step that moves.
fn expected_s(prepared: &SimulatedProgram, part: &Part, moment: &Moment) -> Option<f64> {
    let line = part.steps[moment.step].line;
    let mut way = 0.0;
    for spot in prepared.timeline().spots.iter().filter(|s| s.line as usize == line && s.length_mm > 0.0) {
        if moment.s_mm <= way + spot.length_mm {
            return Some(spot.start_s + (moment.s_mm - way) / spot.length_mm * (spot.end_s - spot.start_s));
        }
        way += spot.length_mm;
    }
    None
}

/// Errors of the samples in cuts, s, sorted by size.
fn errors(prepared: &SimulatedProgram, part: &Part, told: &Told, found: &Aligned) -> Vec<f64> {
    let feeds = |m: &Moment| matches!(part.steps[m.step].action, Action::Move { feed_mm_s: Some(_), .. });
    let error = |(moment, at): (&Option<Moment>, &f64)| {
        let moment = moment.as_ref().filter(|m| feeds(m))?;
        Some((at - expected_s(prepared, part, moment)?).abs())
    };
    let mut all: Vec<f64> = told.moments.iter().zip(&found.program_s).filter_map(error).collect();
    all.sort_by(f64::total_cmp);
    assert!(all.iter().all(|e| e.is_finite()) && all.len() > 1000, "{} samples in cuts", all.len());
    all
}

/// Ties the log of a part; gives the errors and the alignment.
fn tied(seed: u64, lines: bool) -> (Vec<f64>, Aligned) {
    let (part, told) = told(seed, lines);
    let job = job_of(&part);
    let prepared = simulate(part.program.as_bytes(), &job, false).unwrap();
    let log = read_log(told.text.as_bytes(), &[]).unwrap();
    let found = aligned(&prepared, &job, &log, &channels(&log)).unwrap();
    let errors = errors(&prepared, &part, &told, &found);
    let at = |share: f64| errors[(errors.len() as f64 * share) as usize];
    eprintln!(
        "{seed} {}: u {:.3} s, errors {:.3} {:.3} {:.3}",
        found.method.name(),
        found.uncertainty_s,
        at(0.5),
        at(0.68),
        at(0.95)
    );
    (errors, found)
}

#[test]
fn by_load_alone_a_log_with_offset_stretch_pause_and_override_is_tied_to_its_program() {
    let (errors, found) = tied(1003, false);
    assert_eq!(found.method.name(), "load");
    // Half of the errors within the standard uncertainty that is stated. The feed override sets in and ends within a window
    // of 3 s, which the drift follows only slowly: that is not in it.
    let at = |share: f64| errors[(errors.len() as f64 * share) as usize];
    let u = found.uncertainty_s;
    assert!(at(0.5) < 0.05 && at(0.95) < 0.2, "{} {}", at(0.5), at(0.95));
    assert!(u < 0.05 && at(0.5) < u && at(0.68) < 2.5 * u, "{u} {} {}", at(0.5), at(0.68));
    let long: Vec<&(f64, f64)> = found.pauses.iter().filter(|p| p.1 > 4.0).collect();
    assert_eq!(long.len(), 1, "{:?}", found.pauses);
    assert!((long[0].1 - STRETCH * HELD_S).abs() < 0.5, "{long:?}");
    // The hold is one of the feed; the override, under which the cut goes on, is none.
    let [(from_s, to_s)] = found.holds[..] else { panic!("{:?}", found.holds) };
    assert!((to_s - from_s - STRETCH * HELD_S).abs() < 0.5, "{from_s} to {to_s}");
}

/// A log with something hidden in it, tied by its load.
struct Hidden {
    case: Case,
    told: Told,
    prepared: SimulatedProgram,
    found: Aligned,
}

fn hidden(row: &'static str, seed: u64) -> Hidden {
    let case = Case::new(row, seed);
    let (text, _) = case.log(0.03);
    let (_, _, readings) = case.readings(&mut Rng::new(seed, 3));
    let moments = readings.iter().map(|r| (r.moment.rps > 0.0).then_some(r.moment)).collect();
    let job = job_of(&case.part);
    let prepared = simulate(case.part.program.as_bytes(), &job, false).unwrap();
    let log = read_log(text.as_bytes(), &[]).unwrap();
    let found = aligned(&prepared, &job, &log, &channels(&log)).unwrap();
    Hidden { case, told: Told { text, moments }, prepared, found }
}

#[test]
fn by_load_the_uncertainty_that_is_stated_holds_whatever_is_hidden_in_the_log() {
    let cases = [
        ("none", 1004),
        ("none", 1034),
        ("entry", 1004),
        ("entry", 1009),
        ("stock-proud", 1014),
        ("stock-proud", 1034),
        ("sensor-lag", 1014),
    ];
    let mut all: Vec<f64> = Vec::new();
    let share = |of: &[f64], by: f64| of.iter().filter(|e| **e <= by).count() as f64 / of.len() as f64;
    for (row, seed) in cases {
        let Hidden { case, told, prepared, found } = hidden(row, seed);
        assert_eq!(found.method.name(), "load");
        // In units of what is stated for each sample.
        let feeds = |m: &Moment| matches!(case.part.steps[m.step].action, Action::Move { feed_mm_s: Some(_), .. });
        let of_stated = |(moment, k): (&Option<Moment>, usize)| {
            let at = expected_s(&prepared, &case.part, moment.as_ref().filter(|m| feeds(m))?)?;
            Some((found.program_s[k] - at).abs() / found.sample_uncertainty_s[k])
        };
        let stated: Vec<f64> = told.moments.iter().zip(0..).filter_map(of_stated).collect();
        let within = [1.25, 3.0].map(|by| share(&stated, by));
        assert!(within[0] > 0.68 && within[1] > 0.95, "{row} {seed}: {within:?}");
        all.extend(stated);
        // On the whole that of the typical sample; what lies far from all that is observed states more, as asked above.
        let (u, errors) = (found.uncertainty_s, errors(&prepared, &case.part, &told, &found));
        assert!(u < 0.03 && share(&errors, 1.5 * u) > 0.68, "{row} {seed}: {u} {}", share(&errors, 1.5 * u));
    }
    // Errors belong together over stretches of a log, of which one log has few: closer over all of them.
    assert!(share(&all, 2.25) > 0.95, "{}", share(&all, 2.25));
}

/// What is hidden in these once seemed a program that stood, or another machine: the first seconds of the cuts were lost.
#[test]
fn by_load_what_is_hidden_in_a_log_is_no_pause() {
    for (row, seed) in [("tare-warm-up", 1004), ("tare-warm-up", 1019), ("stock-proud", 1004), ("corner-feed", 1029)] {
        let Hidden { case, told, prepared, found } = hidden(row, seed);
        assert!(found.pauses.is_empty(), "{row} {seed}: {:?}", found.pauses);
        let errors = errors(&prepared, &case.part, &told, &found);
        let at = |share: f64| errors[(errors.len() as f64 * share) as usize];
        assert!(at(0.5) < 0.05 && at(0.95) < 0.2, "{row} {seed}: {} {}", at(0.5), at(0.95));
        // Not the first seconds either, which the first match may lay elsewhere.
        assert!(at(0.999) < 0.5, "{row} {seed}: {}", at(0.999));
    }
}

#[test]
fn by_line_numbers_the_same_log_is_tied_within_what_is_stated() {
    let (errors, found) = tied(1003, true);
    assert_eq!(found.method.name(), "line");
    let u = found.uncertainty_s;
    let within = |by: f64| errors.iter().filter(|e| **e <= by).count() as f64 / errors.len() as f64;
    assert!(u < 0.2 && within(u) > 0.6 && within(3.0 * u) > 0.95, "{u} {} {}", within(u), within(3.0 * u));
}

#[test]
fn wherever_a_load_is_predicted_the_cut_that_carries_it_is_described() {
    let job = common::follow::job();
    let plan = plan(Kind::Power, &job).unwrap();
    // So many readings that several share a cell, whose middle may lie in air where one of them is in the cut.
    let text = common::follow::log(&common::follow::follow(&plan.program, 5.0), "spindle_power_w", |s| {
        format!("{:.1}", 300.0 + s.cut.map_or(0.0, |(axial, radial)| 30.0 * axial * radial))
    });
    let prepared = simulate(plan.program.as_bytes(), &job, false).unwrap();
    let (heads, rows) = text.split_once('\n').unwrap();
    let often = |line: &str| {
        let (time_s, rest) = line.split_once(',').unwrap();
        let time_s: f64 = time_s.parse().unwrap();
        (0..5).map(|k| format!("{:.4},{rest}\n", time_s + 0.004 * f64::from(k))).collect::<String>()
    };
    let log = read_log(format!("{heads}\n{}", rows.lines().map(often).collect::<String>()).as_bytes(), &[]).unwrap();
    let channels = channels(&log);
    let tied = aligned(&prepared, &job, &log, &channels).unwrap();
    let (data, ..) = dataset_of(&prepared, &job, &log, &channels, tied);
    let k_tc = data.base.iter().position(|base| base.name == "k_tc").unwrap();
    let loaded: Vec<usize> = (0..data.len()).filter(|i| data.columns[k_tc][*i] > 1e-9).collect();
    let described = loaded.iter().filter(|i| {
        let state = &data.state[**i];
        let of_cut = [state.cutting_speed_mm_s, state.feed_per_tooth_mm, state.axial_depth_mm, state.radial_depth_mm];
        of_cut.iter().all(|value| *value > 0.0)
    });
    assert!(loaded.len() > 100);
    assert_eq!(described.count(), loaded.len());
}

#[test]
fn the_report_says_the_offset_and_the_stretch() {
    let (part, told) = told(1003, false);
    let job = job_of(&part);
    let prepared = simulate(part.program.as_bytes(), &job, false).unwrap();
    let log = read_log(told.text.as_bytes(), &[]).unwrap();
    let report = learn(&prepared, &job, &log, &channels(&log), &LogOptions::default()).unwrap();
    let alignment = report.alignment.unwrap();
    assert!((alignment.offset_s - STRETCH * BEFORE_S).abs() < 0.5, "{alignment:?}");
    // The whole log over the whole program: the clock, the hold and the override together.
    let total_s = prepared.timeline().total_s();
    let logged_s = log.time_s.last().unwrap() - STRETCH * BEFORE_S;
    assert!((alignment.stretch - logged_s / total_s).abs() < 0.01, "{alignment:?} {}", logged_s / total_s);
}

#[test]
fn a_log_that_begins_in_the_middle_of_the_program_is_said_to() {
    let (part, told) = told(1003, false);
    let job = job_of(&part);
    let prepared = simulate(part.program.as_bytes(), &job, false).unwrap();
    let said = |text: &str| -> Vec<String> {
        let log = read_log(text.as_bytes(), &[]).unwrap();
        let report = learn(&prepared, &job, &log, &channels(&log), &LogOptions::default()).unwrap();
        report.warnings.into_iter().filter(|w| w.contains("no sample belongs to the")).collect()
    };
    assert_eq!(said(&told.text), [""; 0]);
    let lines: Vec<&str> = told.text.lines().collect();
    let from = told.moments.iter().position(|m| m.as_ref().is_some_and(|m| m.step * 20 > part.steps.len())).unwrap();
    let rest = lines[0].to_owned() + "\n" + &lines[from + 1..].join("\n") + "\n";
    let begins_s = told.moments[from..].iter().flatten().find_map(|m| expected_s(&prepared, &part, m)).unwrap();
    let moves = prepared.timeline().spots.iter().filter(|s| s.length_mm > 0.0 && s.start_s < begins_s);
    let moving_s: f64 = moves.map(|s| s.end_s.min(begins_s) - s.start_s).sum();
    let said = said(&rest);
    let seconds: f64 = said[0].split_whitespace().find_map(|word| word.parse().ok()).unwrap();
    assert!(
        said.len() == 1 && said[0].contains("the first ") && (seconds - moving_s).abs() < 0.5,
        "{moving_s} {said:?}"
    );
}

/// Where readings are missing, and over which share of the log: in cuts, about cuts, and where the feed is turned down.
const MISSING: [(f64, f64); 4] = [(0.15, 0.005), (0.3, 0.07), (0.5, 0.02), (0.65, 0.05)];

/// Keeps the header and the rows outside the gaps; which rows these are.
fn with_gaps(text: &str) -> (String, Vec<usize>) {
    let lines: Vec<&str> = text.lines().collect();
    let rows = lines.len() - 1;
    let share = |k: &usize| *k as f64 / rows as f64;
    let missing = |k: &usize| MISSING.iter().any(|(from, length)| (*from..from + length).contains(&share(k)));
    let kept: Vec<usize> = (0..rows).filter(|k| !missing(k)).collect();
    let text = lines[0].to_owned() + "\n" + &kept.iter().map(|k| format!("{}\n", lines[k + 1])).collect::<String>();
    (text, kept)
}

#[test]
fn gaps_are_counted_and_do_not_shift_what_is_left() {
    for lines in [false, true] {
        let (part, whole) = told(1003, lines);
        let (text, kept) = with_gaps(&whole.text);
        let told = Told { text, moments: kept.iter().map(|k| whole.moments[*k]).collect() };
        let job = job_of(&part);
        let prepared = simulate(part.program.as_bytes(), &job, false).unwrap();
        let log = read_log(told.text.as_bytes(), &[]).unwrap();
        assert!(log.warnings.iter().any(|w| w.starts_with("gaps in the time stamps: 4, ")), "{:?}", log.warnings);
        let found = aligned(&prepared, &job, &log, &channels(&log)).unwrap();
        let errors = errors(&prepared, &part, &told, &found);
        let at = |share: f64| errors[(errors.len() as f64 * share) as usize];
        eprintln!(
            "{}: {:.3} {:.3} {:.3} s, u {:.3} s",
            found.method.name(),
            at(0.5),
            at(0.95),
            at(0.999),
            found.uncertainty_s
        );
        let within = |by: f64| errors.iter().filter(|e| **e <= by).count() as f64 / errors.len() as f64;
        if lines {
            let u = found.uncertainty_s;
            assert!(u < 0.2 && within(u) > 0.6 && within(3.0 * u) > 0.95, "{u} {} {}", within(u), within(3.0 * u));
        } else {
            // As for the log without gaps, and the program was held once.
            assert!(at(0.5) < 0.05 && at(0.95) < 0.2, "{} {}", at(0.5), at(0.95));
            let long: Vec<&(f64, f64)> = found.pauses.iter().filter(|p| p.1 > 4.0).collect();
            assert_eq!(long.len(), 1, "{:?}", found.pauses);
            let report = learn(&prepared, &job, &log, &channels(&log), &LogOptions::default()).unwrap();
            assert!(report.warnings.iter().any(|w| log.warnings.contains(w)), "{:?}", report.warnings);
        }
    }
}

#[test]
fn by_position_gaps_do_not_shift_what_is_left() {
    let job = common::follow::job();
    let plan = plan(Kind::Power, &job).unwrap();
    let text = common::follow::log(&common::follow::follow(&plan.program, 5.0), "spindle_power_w", |s| {
        format!("{:.1}", 300.0 + s.cut.map_or(0.0, |(axial, radial)| 30.0 * axial * radial))
    });
    let prepared = simulate(plan.program.as_bytes(), &job, false).unwrap();
    let place = |text: &str| {
        let log = read_log(text.as_bytes(), &[]).unwrap();
        let found = aligned(&prepared, &job, &log, &channels(&log)).unwrap();
        assert_eq!(found.method.name(), "position");
        (found.program_s, log.warnings)
    };
    let (gappy, kept) = with_gaps(&text);
    let ((whole, none), (rest, said)) = (place(&text), place(&gappy));
    assert!(none.is_empty(), "{none:?}");
    assert!(said.len() == 1 && said[0].starts_with("gaps in the time stamps: 4, "), "{said:?}");
    let moved = kept.iter().zip(&rest).map(|(k, t)| (whole[*k] - t).abs()).filter(|d| d.is_finite());
    let (count, largest) = moved.fold((0, 0.0f64), |(n, most), d| (n + 1, most.max(d)));
    eprintln!("{count} of {} placed, at most {largest:.4} s off", rest.len());
    assert!(count > 9 * rest.len() / 10 && largest < 0.02, "{count} {largest}");
}

/// Somebody starts the recording, and later the program: a log of an idle machine is none of its tool change.
#[test]
fn what_stands_before_the_program_can_have_begun_is_outside() {
    let job = common::follow::job();
    let plan = plan(Kind::Power, &job).unwrap();
    let text = common::follow::log(&common::follow::follow(&plan.program, 5.0), "spindle_power_w", |_| "300.0".into());
    let prepared = simulate(plan.program.as_bytes(), &job, false).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    let time = |line: &str| -> f64 { cells(line)[0].parse().unwrap() };
    let moving = (2..lines.len()).find(|k| cells(lines[*k])[1..4] != cells(lines[1])[1..4]).unwrap();
    let begins_s = time(lines[moving]);
    let step_s = time(lines[2]) - time(lines[1]);
    let before = (1..=(30.0 / step_s) as usize).rev().map(|k| {
        let at_s = format!("{:.3}", time(lines[1]) - k as f64 * step_s);
        std::iter::once(at_s).chain(cells(lines[1]).into_iter().skip(1)).collect::<Vec<_>>().join(",")
    });
    let all: Vec<String> = before.chain(lines[1..].iter().map(|line| (*line).to_owned())).collect();
    let log = read_log((lines[0].to_owned() + "\n" + &all.join("\n") + "\n").as_bytes(), &[]).unwrap();
    let found = aligned(&prepared, &job, &log, &channels(&log)).unwrap();
    let first_motion = prepared.timeline().spots.iter().find(|spot| spot.length_mm > 0.0).unwrap();
    // The times of the log begin at 0 in what was read.
    let standing = all.len() - lines.len() + moving;
    let motion_s = log.time_s[standing];
    assert!(first_motion.start_s > 1.0 && begins_s > 0.0, "the program waits at first");
    for (at_s, program_s) in log.time_s.iter().zip(&found.program_s).take(standing) {
        let before_s = motion_s - at_s;
        if before_s > first_motion.start_s + 0.2 {
            assert!(program_s.is_nan(), "{before_s} s before the motion: {program_s}");
        } else if before_s > 0.2 && before_s < first_motion.start_s - 0.2 {
            let expected_s = first_motion.start_s - before_s;
            assert!((program_s - expected_s).abs() < 0.1, "{before_s} s before the motion: {program_s}");
        }
    }
}
