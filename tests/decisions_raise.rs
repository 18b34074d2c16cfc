//! What may run faster than programmed: by default no plunge, ramp, entry, cycle, compensated move, and nothing that leaves
//! the final surface; each only where `[raise]` allows it by name. Each reason is tried on both sides of its definition.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use feedwright::engage::{self, engage};
use feedwright::machine::Job;
use feedwright::nc::{Doubt, Environment, Toolpath, interpret, parse};
use feedwright::schedule::{Node, NotRaised, problem};
use std::path::Path;

/// A block of 40 × 20 × 10 mm and a mill of 6 mm; the force limit is one that its cuts come near.
const SETUP: &str = r#"
resolution = 0.25
fixtures = "none"
[machine]
dialect = "linuxcnc"
[stock]
box = { min = [0, 0, -10], max = [40, 20, 0] }
uncertainty = 0
[material]
k_tc = 800
k_te = 14
[[tool]]
number = 1
shape = "flat"
diameter = 6
flutes = 3
overhang = 30
[[tool]]
number = 2
shape = "drill"
diameter = 4
flutes = 2
point_angle = 118
overhang = 30
"#;

/// A node with the line it stands on, and the place and the direction of the tool in its middle.
struct Place {
    line: u32,
    at: [f64; 3],
    node: Node,
}

impl Place {
    /// May the feed rise here? Rapids have none.
    fn rises(&self) -> bool {
        let programmed_mm_s = self.node.programmed_mm_s;
        programmed_mm_s > 0.0 && self.node.cap.feed_mm_s > programmed_mm_s * 1.01
    }
}

fn toolpath(program: &str, job: &Job) -> Toolpath {
    let text = format!("G21 G90 G17\nT1 M6\nS8000 M3\n{program}M30\n");
    interpret(&parse(text.into(), None), &Environment::from_job(job))
}

/// Every node that cuts. The lines of the program count from 4; `rest` is the rest of the setup.
fn cuts(program: &str, rest: &str) -> Vec<Place> {
    cuts_of(program, rest, |_| {})
}

fn cuts_of(program: &str, rest: &str, change: impl Fn(&mut Toolpath)) -> Vec<Place> {
    places(program, rest, change).into_iter().filter(|place| place.node.cutting).collect()
}

fn places(program: &str, rest: &str, change: impl Fn(&mut Toolpath)) -> Vec<Place> {
    places_by(&format!("{SETUP}{rest}"), program, change)
}

fn places_by(setup: &str, program: &str, change: impl Fn(&mut Toolpath)) -> Vec<Place> {
    let (job, _) = feedwright::setup::load(setup, Path::new(".")).unwrap();
    let mut toolpath = toolpath(program, &job);
    change(&mut toolpath);
    let map = engage(&toolpath, &job, &engage::Options::default(), &|_| {}).unwrap();
    let problem = problem(&toolpath, &map, &job);
    let place = |node: &Node| {
        let motion = &toolpath.moves[node.move_id.ix()];
        let at = motion.curve().point(0.5 * (node.from_mm + node.to_mm));
        Place { line: motion.line, at: [at.x, at.y, at.z], node: *node }
    };
    problem.nodes.iter().map(place).collect()
}

const FORCE: &str = "[limits]\nforce_xy = 200\nfeed_change = { max = 2.0 }\n";

/// The limit with other loads, and `[raise]`.
fn with(limits: &str, raise: &str) -> String {
    format!("[limits]\n{limits}\nfeed_change = {{ max = 2.0 }}\n[raise]\n{raise}\n")
}

/// A slot to 1 mm, and over it one to 2 mm, which leaves the final surface: lines 6 and 10.
const SLOTS: &str = "G0 X-10 Y10 Z2\nG1 Z-1 F900\nX50\nG0 Z2\nX-10\nG1 Z-2 F900\nX50\nG0 Z2\n";

/// A slot to 1.6 mm, and over it the last 0.4 mm, which leave the final surface: lines 6 and 10.
const FINISHED: &str = "G0 X-10 Y10 Z2\nG1 Z-1.6 F900\nX50\nG0 Z2\nX-10\nG1 Z-2 F900\nX50\nG0 Z2\n";

#[test]
fn a_last_pass_that_takes_more_than_an_allowance_is_roughing() {
    // The second slot of 1 mm leaves the final surface, but is as thick as the one before it.
    let inside = |place: &&Place| place.line == 10 && (3.0..37.0).contains(&place.at[0]);
    let plain = cuts(SLOTS, FORCE);
    assert!(plain.iter().filter(inside).count() > 0 && plain.iter().filter(inside).all(Place::rises));
    // On either side of the allowance of a 6 mm mill, 0.5 mm: floors and walls alike.
    for (last_mm, rises) in [(0.45, false), (0.55, true)] {
        let floor = FINISHED.replace("Z-1.6", &format!("Z-{}", 2.0 - last_mm));
        assert!(cuts(&floor, FORCE).iter().filter(inside).all(|place| place.rises() == rises), "floor {last_mm}");
        let wall = format!("G0 X-10 Y0 Z2\nG1 Z-4 F900\nX50\nG0 Z2\nX-10 Y{last_mm}\nG1 Z-4 F900\nX50\nG0 Z2\n");
        assert!(cuts(&wall, FORCE).iter().filter(inside).all(|place| place.rises() == rises), "wall {last_mm}");
    }
}

#[test]
fn a_finishing_pass_rises_only_where_the_setup_says_so() {
    let on = |places: &[Place], line: u32| -> Vec<bool> {
        places.iter().filter(|p| p.line == line && (3.0..37.0).contains(&p.at[0])).map(Place::rises).collect()
    };
    let plain = cuts(FINISHED, FORCE);
    assert!(on(&plain, 6).len() > 3 || on(&plain, 6) == [true], "the first slot is cut");
    assert!(on(&plain, 6).iter().all(|rises| *rises), "the first slot leaves nothing of the final surface");
    assert!(on(&plain, 10).iter().all(|rises| !*rises), "the second one does");
    let inside = |place: &&Place| place.line == 10 && (0.0..40.0).contains(&place.at[0]);
    let mut kept = plain.iter().filter(inside).map(|place| place.node.not_raised);
    assert!(kept.all(|kept| kept == Some(NotRaised::Finishing)));
    let allowed = cuts(FINISHED, &with("force_xy = 200", "finishing = true"));
    assert!(on(&allowed, 10).iter().all(|rises| *rises));
    // One operation of it alone.
    let near = FORCE.replace("200", "60");
    let operation = format!("{near}[[operation]]\nmatch = {{ lines = [10, 10] }}\nraise = {{ finishing = true }}\n");
    assert!(on(&cuts(FINISHED, &operation), 10).iter().all(|rises| *rises));
    let elsewhere = operation.replace("[10, 10]", "[6, 6]");
    assert!(on(&cuts(FINISHED, &elsewhere), 10).iter().all(|rises| !*rises));
}

#[test]
fn it_is_still_lowered_where_a_limit_asks() {
    let plain = cuts(FINISHED, "[limits]\nforce_xy = 10\n");
    let slower = plain.iter().filter(|place| place.line == 10 && place.node.not_raised == Some(NotRaised::Finishing));
    assert!(slower.filter(|place| place.node.cap.feed_mm_s < 0.9 * place.node.programmed_mm_s).count() > 0);
}

#[test]
fn an_entry_and_an_exit_last_a_radius_of_the_tool() {
    // First contact where the front of the tool meets the block, at X-3; last contact where its middle leaves it, at X40.
    let first = |raise: &str| -> Vec<Place> {
        let all = cuts(SLOTS, &with("force_xy = 200", raise));
        all.into_iter().filter(|place| place.line == 6).collect()
    };
    let plain = first("");
    let inside = |x: f64| (-2.9..=-0.1).contains(&x) || (37.4..=39.9).contains(&x);
    let outside = |x: f64| (0.2..=36.9).contains(&x);
    assert!(plain.iter().any(|place| inside(place.at[0])) && plain.iter().any(|place| outside(place.at[0])));
    for place in &plain {
        assert!(!inside(place.at[0]) || place.node.not_raised == Some(NotRaised::Entry), "{:?}", place.at);
        assert!(!inside(place.at[0]) || !place.rises(), "{:?}", place.at);
        assert!(!outside(place.at[0]) || place.rises(), "{:?} {:?}", place.at, place.node.not_raised);
    }
    assert!(first("entries = true").iter().all(|place| place.node.not_raised.is_none()));
}

#[test]
fn a_lead_in_arc_is_an_entry_to_its_end_and_a_longer_arc_is_a_contour() {
    // A quarter turn of 15 mm from outside into a groove along X, cut twice so that the first leaves no final surface; then
    // the same first contact on three quarters of a turn.
    let twice = |arc: &str| {
        let pass = |z: i32| format!("G0 X5 Y-9 Z2\nG1 Z{z} F900\n{arc}\nG1 X38\nG0 Z5\n");
        pass(-1) + &pass(-2)
    };
    let quarter = cuts(&twice("G2 X20 Y6 I15 J0"), FORCE);
    let on = |places: &[Place]| -> Vec<Option<NotRaised>> {
        places.iter().filter(|place| place.line == 6).map(|place| place.node.not_raised).collect()
    };
    assert!(
        !on(&quarter).is_empty() && on(&quarter).iter().all(|kept| *kept == Some(NotRaised::Entry)),
        "{:?}",
        on(&quarter)
    );
    let long = cuts(&twice("G2 X20 Y6 I7.5 J7.5 "), FORCE);
    assert!(on(&long).contains(&Some(NotRaised::Entry)), "{:?}", on(&long));
    let far = "G0 X10 Y-4 Z2\nG1 Z-1 F900\nG3 X10 Y-4 I0 J10\nG0 Z5\n".to_owned()
        + "G0 X10 Y-4 Z2\nG1 Z-2 F900\nG3 X10 Y-4 I0 J10\nG0 Z5\n";
    let whole_turn = cuts(&far, FORCE);
    assert!(
        on(&whole_turn).contains(&None) && on(&whole_turn).contains(&Some(NotRaised::Entry)),
        "{:?}",
        on(&whole_turn)
    );
}

#[test]
fn a_plunge_goes_down_faster_than_aside_and_a_ramp_goes_down_at_all() {
    // From inside a hole that is cut first: straight down, at 50° and at 40° below the level, 0.01 mm and 0.001 mm in all.
    let hole = "G0 X10 Y10 Z2\nG1 Z-2 F300\n";
    let kept = |aside: f64, down: f64| -> Vec<Option<NotRaised>> {
        let deeper = format!("{hole}X{} Z{}\nG0 Z2\nG0 X10 Y10\nG1 Z-6\nX30\nG0 Z5\n", 10.0 + aside, -2.0 - down);
        let all = cuts(&deeper, &with("force_xy = 200\nforce_axial = 200", "entries = true"));
        all.iter().filter(|place| place.line == 6).map(|place| place.node.not_raised).collect()
    };
    let all_are = |found: &[Option<NotRaised>], why: Option<NotRaised>| {
        !found.is_empty() && found.iter().all(|kept| *kept == why)
    };
    assert!(all_are(&kept(0.0, 2.0), Some(NotRaised::Plunge)));
    assert!(all_are(&kept(1.0, 1.19), Some(NotRaised::Plunge)), "50°");
    assert!(all_are(&kept(1.19, 1.0), Some(NotRaised::Ramp)), "40°");
    assert!(all_are(&kept(10.0, 0.01), Some(NotRaised::Ramp)), "{:?}", kept(10.0, 0.01));
    assert!(all_are(&kept(10.0, 0.001), None), "{:?}", kept(10.0, 0.001));
}

#[test]
fn a_descent_or_a_retract_in_air_is_none_of_these() {
    let program = "G0 X-10 Y10 Z5\nG1 Z-2 F900\nZ5\nX-20 Z4\nG0 Z10\n";
    let all = places(program, &(FORCE.to_owned() + "air_feed = 3000\napproach = 1\n"), |_| {});
    let fed: Vec<&Place> = all.iter().filter(|place| (5..=7).contains(&place.line)).collect();
    assert!(
        fed.iter().all(|place| place.node.not_raised.is_none() || place.node.not_raised == Some(NotRaised::Unsound))
    );
    // The same with a cut in the program, without which nothing of it is believed.
    let all = places(&(program.to_owned() + SLOTS), &(FORCE.to_owned() + "air_feed = 3000\napproach = 1\n"), |_| {});
    let mut fed = all.iter().filter(|place| (5..=7).contains(&place.line));
    assert!(fed.all(|place| place.node.not_raised.is_none() && place.rises()));
}

/// Below the top of the blank and beyond its outline a clamp may stand: no air feed there until the setup says what clamps the part.
#[test]
fn air_beside_the_blank_waits_for_a_word_about_clamps() {
    // Line 5 goes down beside the blank; 6 runs beside it, below its top; 7 above it; 19 within what 10 to 15 have cut.
    let pocket = "G0 Z5\nX8 Y6\nG1 Z-2 F300\nX32 F900\nY10\nX8\nY14\nX32\nG0 Z5\nX28 Y10\nG1 Z-1 F900\nX12\nG0 Z5\n";
    let program = "G0 X-10 Y10 Z5\nG1 Z-2 F900\nX-20\nX-30 Z2\n".to_owned() + pocket;
    let after = |said: &str| {
        let setup = if said == "none" { SETUP.to_owned() } else { SETUP.replace("fixtures = \"none\"\n", said) };
        places_by(&(setup + FORCE + "air_feed = 3000\napproach = 0\n"), &program, |_| {})
    };
    let of = |all: &[Place], line: u32| -> Vec<(Option<NotRaised>, bool)> {
        let found = all.iter().filter(|place| place.line == line && !place.node.cutting);
        found.map(|place| (place.node.not_raised, place.rises())).collect()
    };
    let silent = after("");
    assert!(
        !of(&silent, 6).is_empty() && of(&silent, 6).iter().all(|found| *found == (Some(NotRaised::Fixtures), false))
    );
    assert!(of(&silent, 5).contains(&(Some(NotRaised::Fixtures), false)), "{:?}", of(&silent, 5));
    for said in ["none", "fixture = [{ box = { min = [90, 90, -20], max = [99, 99, 5] } }]\n"] {
        let known = after(said);
        for line in [5, 6, 7] {
            assert!(of(&known, line).contains(&(None, true)), "{said}, line {line}: {:?}", of(&known, line));
        }
        assert!(known.iter().all(|place| place.node.not_raised != Some(NotRaised::Fixtures)));
    }
    assert!(of(&silent, 19).contains(&(None, true)), "within the outline: {:?}", of(&silent, 19));
    let wrong = feedwright::setup::load(&SETUP.replace("\"none\"", "\"vice\""), Path::new(".")).unwrap_err();
    assert!(format!("{wrong:?}").contains("[[fixture]]"), "{wrong:?}");
}

#[test]
fn plunges_and_ramps_that_may_rise_need_a_limit_that_answers_to_their_load() {
    // A hole, a ramp from it, and both again deeper, so that neither leaves the final surface.
    let program = "G0 X10 Y10 Z2\nG1 Z-2 F100\nX20 Z-3\nG0 Z2\nG0 X10\nG1 Z-6\nX20\nG0 Z5\n";
    let rising = |limits: &str, raise: &str, line: u32| {
        let all = cuts(program, &with(limits, &format!("entries = true\n{raise}")));
        let on: Vec<bool> = all.iter().filter(|place| place.line == line).map(Place::rises).collect();
        assert!(!on.is_empty());
        on.iter().all(|rises| *rises)
    };
    for (line, name) in [(5, "plunges = true"), (6, "ramps = true")] {
        assert!(!rising("force_xy = 100\nforce_axial = 150", "", line), "{name}");
        assert!(rising("force_xy = 200\nforce_axial = 150", name, line), "{name}");
        assert!(!rising("force_xy = 200", name, line), "{name} without a limit on what the end face meets");
        assert!(rising("torque = 1.5", name, line), "{name}");
    }
    assert!(!rising("force_axial = 150", "ramps = true", 5), "the other one's name");
}

#[test]
fn a_drilling_cycle_rises_only_by_its_own_name() {
    let program = "T2 M6\nS3000 M3\nG0 X10 Y10 Z5\nG81 X10 Y10 Z-5 R2 F100\nX20\nG80\nG0 Z10\n\
        T1 M6\nS8000 M3\nG0 X-10 Y10 Z2\nG1 Z-8 F100\nX50\nG0 Z5\n";
    let drilled = |raise: &str| -> Vec<(Option<NotRaised>, bool)> {
        let all = cuts(program, &with("force_axial = 80", raise));
        let on = all.iter().filter(|place| (7..=8).contains(&place.line));
        on.map(|place| (place.node.not_raised, place.rises())).collect()
    };
    let plain = drilled("plunges = true\nentries = true\nfinishing = true");
    assert!(!plain.is_empty() && plain.iter().all(|found| *found == (Some(NotRaised::Cycle), false)), "{plain:?}");
    let allowed = drilled("cycles = true\nentries = true\nfinishing = true");
    assert!(allowed.iter().all(|found| *found == (None, true)), "{allowed:?}");
}

#[test]
fn moves_under_radius_compensation_rise_only_where_the_setup_says_so() {
    let pass = |z: i32| format!("G0 X-20 Y-10 Z2\nG1 Z{z} F900\nG41.1 D6\nG1 X-12 Y7\nX52\nG40\nG0 Z5\n");
    let twice = pass(-1) + &pass(-2);
    let under = |raise: &str| -> Vec<(Option<NotRaised>, bool)> {
        let all = cuts(&twice, &with("force_xy = 200", raise));
        let on = all.iter().filter(|place| place.line == 8 && (4.0..36.0).contains(&place.at[0]));
        on.map(|place| (place.node.not_raised, place.rises())).collect()
    };
    assert!(!under("").is_empty() && under("").iter().all(|found| *found == (Some(NotRaised::Compensation), false)));
    assert!(under("compensation = true").iter().all(|found| *found == (None, true)));
    // The same path without G41 rises.
    let free = cuts(&twice.replace("G41.1 D6\n", "(none)\n").replace("Y7", "Y10").replace("G40\n", "(none)\n"), FORCE);
    assert!(free.iter().filter(|p| p.line == 8 && (4.0..36.0).contains(&p.at[0])).all(Place::rises));
}

#[test]
fn what_is_in_doubt_never_rises_until_the_setup_confirms_it() {
    let rest = FORCE.to_owned() + "air_feed = 3000\napproach = 1\n";
    let doubted = |rest: &str| -> Vec<bool> {
        let all = places(SLOTS, rest, |toolpath| {
            let doubt = Doubt::ProgramStop;
            let doubted = feedwright::nc::Doubted {
                from: feedwright::ids::MoveId(0),
                until: None,
                doubt,
                line: 1,
                unread: Vec::new(),
            };
            toolpath.doubts.push(doubted);
        });
        all.iter().filter(|place| (5..=6).contains(&place.line)).map(Place::rises).collect()
    };
    assert!(doubted(&rest).iter().all(|rises| !*rises), "neither in air nor in the cut");
    for confirmed in ["[machine]", "[[operation]]\nmatch = { tool = 1 }\nconfirm = [\"program-stop\"]\n"] {
        let rest = if confirmed.starts_with("[[") { format!("{rest}{confirmed}") } else { rest.clone() };
        let top = if confirmed.starts_with("[[") { String::new() } else { "confirm = [\"program-stop\"]\n".to_owned() };
        let (job, _) = feedwright::setup::load(&format!("{top}{SETUP}{rest}"), Path::new(".")).unwrap();
        assert_eq!(job.confirmed.len() + job.operations.iter().map(|of| of.confirmed.len()).sum::<usize>(), 1);
    }
    let operation = "[[operation]]\nmatch = { tool = 1 }\nconfirm = [\"program-stop\"]\n";
    assert!(doubted(&format!("{rest}{operation}")).iter().any(|rises| *rises));
    let other = operation.replace("program-stop", "zero-shift");
    assert!(doubted(&format!("{rest}{other}")).iter().all(|rises| !*rises), "another doubt is confirmed");
}

/// Air right beside a cut rises with it where entries may rise and clamps are known, in a block that cannot be split: there it would hold all of it.
#[test]
fn air_right_beside_a_cut_follows_it_where_entries_may_rise() {
    // The far half of the second pass lies over a slot, so that it cuts 1 mm there and 3 mm in the near half: far from the near end feeds may rise more.
    let program = "G0 X24 Y10 Z2\nG1 Z-2 F900\nX44\nG0 Z2\nX-4\nG1 Z-3 F900\nX44\nG0 Z2\n";
    let all = |raise: &str, split: bool, clamps: &str| -> Vec<Place> {
        let limits = with("force_xy = 155\nforce_axial = 155", &format!("finishing = true\n{raise}"));
        let setup = SETUP.replace("fixtures = \"none\"", clamps);
        let found = places_by(&format!("{setup}{limits}[output]\nsplit = {split}\n"), program, |_| {});
        found.into_iter().filter(|place| place.line == 10).collect()
    };
    let none = "fixtures = \"none\"";
    let pass = all("entries = true", false, none);
    let cuts: Vec<&Place> = pass.iter().filter(|place| place.node.cutting).collect();
    let air = |pass: &[Place]| -> Vec<(f64, f64)> {
        let air = pass.iter().filter(|place| !place.node.cutting);
        air.map(|place| (place.at[0], place.node.cap.feed_mm_s / place.node.programmed_mm_s)).collect()
    };
    let ratio = |place: &Place| place.node.cap.feed_mm_s / place.node.programmed_mm_s;
    let [first, last] = [ratio(cuts[0]), ratio(cuts[cuts.len() - 1])];
    assert!(first > 1.05 && last > 1.2 * first, "{first} {last}");
    for (x, rises) in air(&pass) {
        let beside = if x < 20.0 { first } else { last };
        assert!(rises > 1.05 && rises <= 1.001 * beside, "X{x}: {rises}, the cut beside it {beside}");
    }
    let refusals = [("entries = false", false, none), ("entries = true", true, none), ("entries = true", false, "")];
    for (raise, split, clamps) in refusals {
        let pass = all(raise, split, clamps);
        assert!(
            !air(&pass).is_empty() && air(&pass).iter().all(|(_, rises)| *rises <= 1.0),
            "{raise} {split} {clamps}"
        );
    }
}

#[test]
fn a_doubt_by_a_name_that_is_none_is_refused_with_the_names() {
    let error =
        feedwright::setup::load(&format!("confirm = [\"program-stops\"]\n{SETUP}"), Path::new(".")).unwrap_err();
    let said = format!("{:?}", error.diagnostics());
    assert!(Doubt::ALL.iter().all(|doubt| said.contains(doubt.name())), "{said}");
}

#[test]
fn nothing_is_raised_in_a_simulation_that_cannot_be_right() {
    let rest = with("force_xy = 200\nair_feed = 3000\napproach = 1", "entries = true\nfinishing = true");
    let risen = |program: &str, rest: &str| places(program, rest, |_| {}).iter().filter(|p| p.rises()).count();
    assert!(risen(SLOTS, &rest) > 0);
    // The zero lies elsewhere: the stock is never touched.
    assert_eq!(risen(&SLOTS.replace("Y10", "Y300"), &rest), 0);
    // The spindle stands still in the second slot: not even the first one is raised.
    assert_eq!(risen(&SLOTS.replace("X-10\nG1 Z-2", "X-10\nM5\nG1 Z-2"), &rest), 0);
    // A tool whose force model has no sense at this speed has no loads.
    let slow = SLOTS.replacen("G0 X-10", "S0 M3\nG0 X-10", 1);
    assert_eq!(risen(&slow, &rest), 0);
}
