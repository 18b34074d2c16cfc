//! What a limit is worth: one that never acts raises nothing and is said first, the change of feed hangs on whether
//! coefficients were measured, and what roughing survives says nothing about finishing.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use feedwright::diag::Severity;
use feedwright::engage::{self, EngagementMap, engage};
use feedwright::job::{Keep, Task, Wanted, Watch, optimize, sections, simulate};
use feedwright::machine::{CutKind, Job, LimitKind};
use feedwright::nc::{self, Environment, Program, Toolpath};
use feedwright::outcome::ProgramRun;
use feedwright::schedule::cutters::Cutters;
use feedwright::schedule::idle_limits::{ACTS_FROM, idle};
use feedwright::schedule::operations::segments;
use feedwright::schedule::rules::rules;
use feedwright::schedule::{NotRaised, as_programmed, problem};
use feedwright::setup::{self, Assumption};
use std::path::Path;

const SETUP: &str = r#"
resolution = 0.25
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
"#;
const BASE: &str = "[process.base]\nk_tc = 800\nk_te = 14\n";

/// A slot to 4 mm, and two passes beside each other that take 0.2 mm off its walls and 0.1 mm off its floor.
const PROGRAM: &str = "(part)\nG21 G90 G17\nT1 M6\nS8000 M3\n(ROUGH SLOT)\nG0 X-10 Y10 Z2\nG1 Z-4 F600\nX50\nG0 Z2\n\
    (FINISH SLOT)\nG0 X-10 Y9.8\nG1 Z-4.1\nX50\nG0 Z2\nG0 X-10 Y10.2\nG1 Z-4.1\nX50\nG0 Z2\nM30\n";

fn load(rest: &str) -> (Job, Vec<Assumption>) {
    setup::load(&format!("{SETUP}{rest}"), Path::new(".")).unwrap()
}

fn simulated(job: &Job) -> (Program, Toolpath, EngagementMap) {
    let program = nc::parse(PROGRAM.into(), None);
    let toolpath = nc::interpret(&program, &Environment::from_job(job));
    let map = engage(&toolpath, job, &engage::Options::default(), &|_| {}).unwrap();
    (program, toolpath, map)
}

fn run(rest: &str, wanted: Wanted, whole: bool) -> ProgramRun {
    let (job, assumptions) = load(rest);
    let watch = Watch {
        progress: &|_, _| (),
        clock: &|| 0.0,
        subprograms: &|_| None,
        engage: engage::Options::default(),
        keep: Keep::default(),
    };
    let task = Task { program: nc::parse(PROGRAM.into(), None), job, assumptions, wanted };
    if whole { optimize(task, &watch).unwrap() } else { simulate(task, &watch).unwrap() }
}

/// One plunge comes near the axial limit; the slots behind it have no axial force, or one that grows with the feed.
#[test]
fn a_limit_on_a_load_that_is_none_here_raises_nothing() {
    let program = "G21 G90 G17\nT1 M6\nS8000 M3\nG0 X10 Y10 Z2\nG1 Z-4 F200\nX30 F600\nG0 Z2\nM30\n";
    let rises = |axial: &str| {
        let rest = format!("[process.base]\nk_tc = 800\nk_te = 14\n{axial}\n[limits]\nforce_axial = 400\n");
        let job = setup::load(&format!("{SETUP}{rest}"), Path::new(".")).unwrap().0;
        let toolpath = nc::interpret(&nc::parse(program.into(), None), &Environment::from_job(&job));
        let map = engage(&toolpath, &job, &engage::Options::default(), &|_| {}).unwrap();
        let problem = problem(&toolpath, &map, &job);
        let slot: Vec<_> =
            problem.nodes.iter().filter(|node| toolpath.moves[node.move_id.ix()].line == 6 && node.cutting).collect();
        assert!(!slot.is_empty());
        slot.iter().any(|node| node.not_raised.is_none() && node.cap.feed_mm_s > node.programmed_mm_s)
    };
    assert!(!rises("k_ac = 0\nk_ae = 0") && rises("k_ac = 150\nk_ae = 2"));
}

/// A drill, a boring bar and a tap.
const HOLES: &str = "[[tool]]\nnumber = 2\nshape = \"drill\"\ndiameter = 6.8\noverhang = 60\n[[tool]]\nnumber = 3\nshape = \"flat\"\ndiameter = 7.2\nflutes = 1\noverhang = 20\n\
    [[tool]]\nnumber = 4\nshape = \"tap\"\ndiameter = 8\noverhang = 60\n";

fn of_holes(rest: &str, cycles: &str) -> (Toolpath, EngagementMap, Job) {
    let program =
        format!("G21 G90 G17\nT2 M6\nS3000 M3\nG0 X20 Y10 Z10\nG98 G81 Z-8 R2 F300\nG80\n{cycles}\nG80\nG0 Z50\nM30\n");
    let setup = format!("{SETUP}{HOLES}{rest}").replace("linuxcnc", "fanuc");
    let job = setup::load(&setup, Path::new(".")).unwrap().0;
    let toolpath = nc::interpret(&nc::parse(program.into(), Some(nc::Dialect::Fanuc)), &Environment::from_job(&job));
    let map = engage(&toolpath, &job, &engage::Options::default(), &|_| {}).unwrap();
    (toolpath, map, job)
}

/// It is turned so that its one edge looks away from the wall, and goes out beside the axis. A rapid aside with the spindle turning is none of that.
#[test]
fn a_boring_bar_that_steps_off_the_wall_is_no_collision() {
    let events = |cycles: &str| of_holes("", cycles).1.events.len();
    assert_eq!(events("T3 M6\nS1200 M3\nG0 X20 Y10 Z10\nG98 G76 Z-6 R2 Q0.3 F80"), 0);
    assert_eq!(events("T3 M6\nS1200 M3\nG0 X20 Y10 Z10\nG1 Z-6 F80\nG0 X20.3"), 1);
}

/// A tap advances by its pitch; what bounds the feed per tooth of a mill says nothing about it.
#[test]
fn a_tap_has_no_feed_per_tooth() {
    let kinds = |tool: u32| -> Vec<LimitKind> {
        let (toolpath, map, job) =
            of_holes("[limits]\nforce_axial = 900\nfeed_per_tooth = 0.15\n", "T4 M6\nS500 M3\nG84 Z-6 R2 F625");
        let rules = rules(&toolpath, &map, &job);
        let of = toolpath.iter_moves().find(|(_, motion)| motion.tool == tool && motion.cycle).unwrap().0;
        rules.of(of).loads.iter().map(|(kind, _)| *kind).collect()
    };
    assert_eq!(kinds(2), [LimitKind::ForceAxial, LimitKind::FeedPerTooth]);
    assert_eq!(kinds(4), [LimitKind::ForceAxial]);
}

#[test]
fn the_change_of_feed_hangs_on_measured_coefficients() {
    let most = |rest: &str| {
        let (job, assumptions) = load(rest);
        let told: Vec<Assumption> =
            assumptions.into_iter().filter(|assumed| assumed.key == "limits.feed_change.max").collect();
        (job.limits.feed_change_max, told.len())
    };
    // A material written out by hand is not known to be measured.
    assert_eq!(most(""), (Some(1.3), 1));
    assert_eq!(most(BASE), (Some(2.0), 1));
    // Effects alone carry no coefficients.
    let effect = "[[process.effect]]\nname = \"flank-wear\"\nparameters = { growth = 0.1 }\n";
    assert_eq!(most(effect), (Some(1.3), 1));
    assert_eq!(most("[limits]\nfeed_change = { max = 1.7 }\n"), (Some(1.7), 0));
    // A model of the command line.
    let (mut job, mut assumptions) = load("");
    let model = setup::load_model("[base]\nk_tc = 800\nk_te = 14\n").unwrap();
    setup::take_model(&mut job, &mut assumptions, model.clone());
    assert_eq!(job.limits.feed_change_max, Some(2.0));
    assert!(assumptions.iter().any(|assumed| assumed.key == "limits.feed_change.max" && assumed.value == "2"));
    let (mut job, mut assumptions) = load("[limits]\nfeed_change = { max = 1.7 }\n");
    setup::take_model(&mut job, &mut assumptions, model);
    assert_eq!(job.limits.feed_change_max, Some(1.7), "what is written stays");
}

#[test]
fn a_limit_that_never_acts_raises_nothing_and_is_said_first() {
    let (job, _) = load("[limits]\nforce_xy = 1e6\n");
    let (_, toolpath, map) = simulated(&job);
    let cutters = Cutters::new(&toolpath, &map, &job, &as_programmed(&toolpath));
    let never = idle(&toolpath, &map, &rules(&toolpath, &map, &job), &cutters);
    let [largest] = never.into_iter().flatten().collect::<Vec<_>>()[..] else { panic!("one rule") };
    assert_eq!(largest.kind, LimitKind::ForceXy);
    let raise = "[raise]\nentries = true\nfinishing = true\n";
    let risen = |limits: &str| {
        let run = run(&format!("[limits]\n{limits}\n{raise}"), Wanted::default(), false);
        let cutting = run.problem.nodes.iter().filter(|node| node.cutting);
        let higher = cutting.clone().filter(|node| node.cap.feed_mm_s > 1.001 * node.programmed_mm_s).count();
        assert!(higher > 0 || cutting.clone().all(|node| node.not_raised == Some(NotRaised::NoLoadLimit)));
        let first = run.diagnostics.first().map(|said| said.code.to_string());
        (higher, first.as_deref() == Some("schedule::limit-never-acts"))
    };
    // On both sides of the share of the limit that some load must reach.
    let at = |share: f64| format!("force_xy = {}", largest.load / share);
    assert!(risen(&at(1.02 * ACTS_FROM)).0 > 0 && !risen(&at(1.02 * ACTS_FROM)).1);
    assert_eq!(risen(&at(0.98 * ACTS_FROM)), (0, true));
    // Beside a limit that acts one that never does is no matter.
    assert!(risen(&format!("{}\nforce_axial = 1e6", at(0.5))).0 > 0);
}

/// A drill presses nothing aside: that a force across it is limited is no slip of the pen, as it is where a mill never comes near.
#[test]
fn a_limit_on_a_load_that_a_drill_does_not_have_is_no_alarm() {
    let said = |shape: &str, text: &str| {
        let (mut job, assumptions) = load("[limits]\nforce_xy = 1e6\n");
        let drill = setup::load(&SETUP.replace("\"flat\"", shape), Path::new(".")).unwrap().0;
        job.tools = drill.tools;
        let watch = Watch {
            progress: &|_, _| (),
            clock: &|| 0.0,
            subprograms: &|_| None,
            engage: engage::Options::default(),
            keep: Keep::default(),
        };
        let task = Task { program: nc::parse(text.into(), None), job, assumptions, wanted: Wanted::default() };
        let run = simulate(task, &watch).unwrap();
        let said = run.diagnostics.iter().find(|said| said.code == "schedule::limit-never-acts").unwrap();
        (said.severity, said.text.contains("no such load"))
    };
    let holes = "G21 G90 G17\nT1 M6\nS3000 M3\nG0 X10 Y10 Z2\nG81 Z-6 R1 F200\nX20\nG80\nM30\n";
    assert_eq!(said("\"drill\"", holes), (Severity::Note, true));
    assert_eq!(said("\"flat\"", PROGRAM), (Severity::Warning, false));
}

#[test]
fn the_summary_says_when_the_change_of_feed_is_what_binds() {
    let said = |rest: &str| {
        let run = run(rest, Wanted::default(), true);
        run.diagnostics.iter().any(|said| said.code == "schedule::feed-change")
    };
    let raise = "[raise]\nentries = true\nfinishing = true\n";
    assert!(said(&format!("[limits]\nforce_xy = 600\n{raise}")));
    assert!(!said(&format!("[limits]\nforce_xy = 100\n{raise}")), "the force binds");
}

#[test]
fn sections_begin_with_the_comments_between_cuts() {
    let (job, _) = load("");
    let (program, toolpath, map) = simulated(&job);
    let found = segments(&sections(&program, &toolpath, &map), &toolpath, &map, &job);
    let told: Vec<(&str, (u32, u32), Option<CutKind>)> =
        found.iter().map(|segment| (segment.name.as_str(), segment.scope.lines, segment.scope.kind)).collect();
    let [roughing, finishing] = [CutKind::Roughing, CutKind::Finishing].map(Some);
    assert_eq!(told, [("ROUGH SLOT", (1, 9), roughing), ("FINISH SLOT", (10, u32::MAX), finishing)]);
}

/// One tool, no comment: depth and the way of the end face part what a comment does not.
#[test]
fn depth_and_plunges_part_operations() {
    let (job, _) = load("");
    let told = |text: &str| -> Vec<(CutKind, f64)> {
        let program = nc::parse(text.into(), None);
        let toolpath = nc::interpret(&program, &Environment::from_job(&job));
        let map = engage(&toolpath, &job, &engage::Options::default(), &|_| {}).unwrap();
        let found = segments(&sections(&program, &toolpath, &map), &toolpath, &map, &job);
        found.iter().map(|s| (s.scope.kind.unwrap(), (10.0 * s.scope.depths_mm[1]).round() / 10.0)).collect()
    };
    let head = "G21 G90 G17\nT1 M6\nS8000 M3\n";
    let slot = |y: f64, z: f64| format!("G0 X-10 Y{y} Z2\nG1 Z{z} F600\nX50\nG0 Z2\n");
    let (shallow, deep) = ((CutKind::Roughing, 1.5), (CutKind::Roughing, 4.0));
    assert_eq!(told(&format!("{head}{}{}M30\n", slot(4.0, -4.0), slot(14.0, -1.5))), [deep, shallow]);
    // Within twice the depth it is one operation.
    assert_eq!(told(&format!("{head}{}{}M30\n", slot(4.0, -4.0), slot(14.0, -2.1))), [deep]);
    let plunge = "G0 X20 Y10 Z2\nG1 Z-4 F200\nX30 F600\nG0 Z2\nM30\n";
    assert_eq!(told(&format!("{head}{plunge}")), [(CutKind::Down, 4.0), deep]);
}

#[test]
fn roughing_lends_nothing_to_finishing() {
    let reference = |text: &str| {
        let (job, _) = load("[raise]\nfinishing = true\nentries = true\n");
        let program = nc::parse(text.into(), None);
        let toolpath = nc::interpret(&program, &Environment::from_job(&job));
        let map = engage(&toolpath, &job, &engage::Options::default(), &|_| {}).unwrap();
        let wanted = Wanted { reference: Some(100.0), ..Wanted::default() };
        let held = run("[raise]\nfinishing = true\nentries = true\n", wanted, false).job;
        let rules = rules(&toolpath, &map, &held);
        let limit = |line: u32| {
            let (id, _) = toolpath.iter_moves().find(|(_, motion)| motion.line == line).unwrap();
            rules.of(id).limits.force_xy_n.unwrap()
        };
        (limit(8), limit(13))
    };
    let (rough_n, finish_n) = reference(PROGRAM);
    assert!(finish_n < 0.5 * rough_n, "{finish_n} N against {rough_n} N");
}
