//! Things that must not happen are reported, and only then.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

mod engage_common;
use engage_common::*;
use feedwright::engage::{EngagementMap, EventKind, Station};
use feedwright::ids::MoveId;
use feedwright::machine::{Box3, Job, Profile, Segment, Shape};
use feedwright::path::Vec3;

fn kinds(map: &EngagementMap, index: u32) -> Vec<EventKind> {
    map.events.iter().filter(|event| event.move_id == MoveId(index)).map(|event| event.kind).collect()
}

fn block_job(tool: feedwright::machine::Tool) -> Job {
    job(vec![tool], vec![block([0.0, -20.0, -40.0], [40.0, 20.0, 0.0])])
}

#[test]
fn a_rapid_through_stock_is_named_and_one_above_it_is_not() {
    let mut path = Path::from([-10.0, 0.0, 5.0]);
    path.rapid([50.0, 0.0, 5.0]).rapid([50.0, 0.0, -1.0]).rapid([20.0, 0.0, -1.0]);
    let map = run(&path, &block_job(flat(10.0)), 0.2, 1.0);
    assert_eq!(kinds(&map, 0), []);
    assert_eq!(kinds(&map, 2), [EventKind::CutAtRapid]);
    assert_eq!(map.events.len(), 1);
    assert!(map.stations.is_empty());
}

#[test]
fn shank_and_holder_meet_stock_only_where_they_do() {
    let mut tool = flat(10.0);
    tool.profile = Profile::flat(10.0, 8.0);
    tool.flute_length_mm = 8.0;
    tool.overhang_mm = 15.0;
    tool.holder = vec![(30.0, 20.0)];
    let mut path = Path::from([-30.0, 0.0, -7.0]);
    path.line([60.0, 0.0, -7.0]);
    assert_eq!(run(&path, &block_job(tool.clone()), 0.2, 1.0).events, []);
    let mut path = Path::from([-30.0, 0.0, -10.0]);
    path.line([60.0, 0.0, -10.0]);
    assert_eq!(kinds(&run(&path, &block_job(tool.clone()), 0.2, 1.0), 0), [EventKind::ShankContact]);
    // Along the side of the block, 16 mm deep: nothing of cutter or shank is in it, the holder (15 mm radius) is.
    let mut path = Path::from([-30.0, 30.0, -16.0]);
    path.line([60.0, 30.0, -16.0]);
    let map = run(&path, &block_job(tool.clone()), 0.2, 1.0);
    assert_eq!(kinds(&map, 0), [EventKind::HolderContact]);
    assert_eq!(map.removed_mm3, 0.0);
    let mut path = Path::from([-30.0, 36.0, -16.0]);
    path.line([60.0, 36.0, -16.0]);
    assert_eq!(run(&path, &block_job(tool), 0.2, 1.0).events, []);
}

#[test]
fn fixtures_are_kept_out_of_for_feeds_and_rapids() {
    let mut job = block_job(flat(10.0));
    job.fixtures = vec![Box3 { min: Vec3::new(-30.0, -20.0, -40.0), max: Vec3::new(-10.0, 20.0, 5.0) }];
    let mut path = Path::from([-20.0, 40.0, 4.0]);
    path.line([-20.0, 24.0, 4.0]).line([-20.0, 40.0, 4.0]).rapid([-4.0, 40.0, 4.0]).rapid([-4.0, 0.0, 4.0]);
    path.rapid([-4.0, 0.0, 6.0]).rapid([-20.0, 0.0, 6.0]);
    let map = run(&path, &job, 0.2, 1.0);
    assert_eq!(kinds(&map, 0), [EventKind::FixtureContact]);
    assert_eq!(kinds(&map, 3), []);
    assert_eq!(kinds(&map, 5), []);
    assert!(stations(&map, 0).iter().all(|station| !station.flags.clear_air || station.to_mm <= 15.0));
}

#[test]
fn plunging_without_a_cutting_centre_and_cutting_without_turning() {
    let mut tool = flat(10.0);
    tool.centre_cutting = false;
    let mut path = Path::from([20.0, 0.0, 2.0]);
    path.line([20.0, 0.0, -3.0]).line([30.0, 0.0, -3.0]);
    path.toolpath.moves[1].spin.rps = 0.0;
    let map = run(&path, &block_job(tool.clone()), 0.2, 1.0);
    assert_eq!(kinds(&map, 0), [EventKind::PlungeNotCentreCutting]);
    assert_eq!(kinds(&map, 1), [EventKind::SpindleStopped]);
    // A ramp at 5° is no plunge.
    let mut path = Path::from([-12.0, 0.0, 2.0]);
    path.line([45.0, 0.0, -3.0]);
    assert_eq!(run(&path, &block_job(tool), 0.2, 1.0).events, []);
}

#[test]
fn a_t_slot_under_standing_stock_is_uncertain_and_takes_nothing_away() {
    let line = |from: [f64; 2], to: [f64; 2]| Segment::Line { from, to };
    let outline = vec![
        line([0.0, 0.0], [8.0, 0.0]),
        line([8.0, 0.0], [8.0, 4.0]),
        line([8.0, 4.0], [3.0, 4.0]),
        line([3.0, 4.0], [3.0, 30.0]),
    ];
    let cutter = tool(2, Shape::Profile, Profile { segments: outline });
    let mut path = Path::from([-20.0, 0.0, -12.0]);
    path.line([60.0, 0.0, -12.0]);
    path.set_tool(2);
    path.line([60.0, 0.0, -12.5]).line([-20.0, 0.0, -12.5]);
    let job = job(vec![flat(8.0), cutter], vec![block([0.0, -20.0, -40.0], [40.0, 20.0, 0.0])]);
    let map = run(&path, &job, 0.2, 1.0);
    assert!(kinds(&map, 2).contains(&EventKind::Undercut), "{:?}", map.events);
    assert!(stations(&map, 2).iter().any(|station| station.flags.uncertain && station.arc_count > 0));
    let slot = 40.0 * 8.0 * 12.5;
    assert!((map.removed_mm3 / slot - 1.0).abs() < 5e-3, "{} {slot}", map.removed_mm3);
}

#[test]
fn the_last_pass_leaves_the_finished_surface() {
    let mut path = Path::from([-20.0, 0.0, -1.0]);
    path.line([60.0, 0.0, -1.0]).line([60.0, 0.0, -2.0]).line([-20.0, 0.0, -2.0]);
    let map = run(&path, &block_job(flat(10.0)), 0.2, 1.0);
    let left = |index: u32| stations(&map, index).iter().any(|station| station.flags.final_surface);
    assert!(!left(0) && left(2));
}

/// Less than half a cell along a wall lowers no cell and is a cut all the same. Heights that fall without a cut that takes it are said.
#[test]
fn cuts_and_cells_are_compared() {
    let mut path = Path::from([-10.0, -24.9, -10.0]);
    path.line([50.0, -24.9, -10.0]);
    let plate = job(vec![flat(10.0)], vec![block([0.0, -20.0, -40.0], [40.0, 20.0, 0.0])]);
    let thin = run(&path, &plate, 0.4, 1.0);
    assert_eq!(thin.removed_mm3, 0.0);
    assert!(!thin.touches_nothing() && thin.misses_cuts().is_none());
    let mut path = Path::from([-10.0, -26.0, -10.0]);
    path.line([50.0, -26.0, -10.0]);
    assert!(run(&path, &plate, 0.4, 1.0).touches_nothing());
    let mut path = Path::from([-10.0, 0.0, -3.0]);
    path.line([50.0, 0.0, -3.0]);
    let mut slot = run(&path, &plate, 0.4, 1.0);
    assert!(slot.misses_cuts().is_none());
    let met = volume_of(&slot, 0);
    // By a cell at either side of a slot of 10 mm, 3 mm deep.
    let by_cells = 2.0 * slot.cell_mm * 3.0 * 40.0;
    slot.removed_mm3 = 2.0 * (met + 0.8 * by_cells);
    assert!(slot.misses_cuts().is_none());
    slot.removed_mm3 = 2.0 * (met + 1.2 * by_cells);
    assert_eq!(slot.misses_cuts(), Some(met));
    // A strip of a quarter of a cell that holds a row of middles lowers four times what it takes.
    let mut path = Path::from([-10.0, -24.75, -10.0]);
    path.line([50.0, -24.75, -10.0]);
    let strip = run(&path, &plate, 1.0 / 3.0, 1.0);
    let taken = volume_of(&strip, 0);
    assert!((taken / 100.0 - 1.0).abs() < 0.01 && strip.misses_cuts().is_none(), "{taken} of {}", strip.removed_mm3);
}

/// Cut through a plate of 5 mm: the pass along a wall leaves that, one from which everything about it is gone later leaves nothing.
#[test]
fn a_pass_through_the_stock_leaves_the_wall_beside_it() {
    let plate = || job(vec![flat(10.0)], vec![block([0.0, -20.0, -5.0], [40.0, 20.0, 0.0])]);
    let left = |map: &EngagementMap, index: u32| stations(map, index).iter().any(|station| station.flags.final_surface);
    let mut path = Path::from([-20.0, 0.0, -5.5]);
    path.line([60.0, 0.0, -5.5]);
    assert!(left(&run(&path, &plate(), 0.2, 1.0), 0));
    // Cuts off all that is on one side, then what is left on the other.
    let mut path = Path::from([-20.0, -16.0, -5.5]);
    for y in [-16.0, -8.0, 0.0, 8.0, 16.0] {
        path.line([-20.0, y, -5.5]).line([60.0, y, -5.5]).line([60.0, y, 5.0]).line([-20.0, y, 5.0]);
    }
    let map = run(&path, &plate(), 0.2, 1.0);
    assert!((0..20).all(|index| !left(&map, index)));
}

#[test]
fn two_parts_on_two_offsets_are_cut_each_in_its_place() {
    let mut job = job(
        vec![flat(10.0)],
        vec![block([0.0, -20.0, -20.0], [40.0, 20.0, 0.0]), block([0.0, -20.0, -20.0], [40.0, 20.0, 0.0])],
    );
    job.stocks[0].offset = Some(54);
    job.stocks[1].offset = Some(55);
    job.machine.offsets = vec![(54, Vec3::zeros()), (55, Vec3::new(200.0, 0.0, 7.0))];
    let mut path = Path::from([-20.0, 0.0, -2.0]);
    path.line([60.0, 0.0, -2.0]).line([-20.0, 0.0, -3.0]);
    path.toolpath.moves[1].wcs = 55;
    let map = run(&path, &job, 0.1, 0.2);
    // 2 mm deep in the first part; in the second a ramp, 2.5 mm deep on average under the axis, and lower under the leading
    // edge: by the mean half chord, π/4 · 5 mm, times the slope of 1/80.
    let ramp = 400.0 * (2.5 + 0.25 * std::f64::consts::PI * 5.0 / 80.0);
    assert!((volume_of(&map, 0) / 800.0 - 1.0).abs() < 0.01, "{}", volume_of(&map, 0));
    assert!((volume_of(&map, 1) / ramp - 1.0).abs() < 3e-3, "{}", volume_of(&map, 1));
    assert!((map.removed_mm3 / (800.0 + ramp) - 1.0).abs() < 1e-3, "{}", map.removed_mm3);
    assert!((map.initial_mm3 - 2.0 * 40.0 * 40.0 * 20.0).abs() < 1e-3);
}

#[test]
fn a_shank_as_wide_as_the_cutter_rubs_along_a_wall_deeper_than_the_flutes() {
    // A slot in steps of 4 mm down to 12 mm with 8 mm of flutes: its walls stand along the shank from the third step on.
    let slot = |relief: f64, given: bool| {
        let mut tool = flat(10.0);
        tool.profile = Profile::flat(10.0, 8.0);
        tool.flute_length_mm = 8.0;
        tool.flute_length_given = given;
        tool.overhang_mm = 25.0;
        tool.shank_diameter_mm = 10.0 - relief;
        let mut path = Path::from([-20.0, 0.0, 5.0]);
        for step in 1..=3 {
            let z = -4.0 * f64::from(step);
            path.line([-20.0, 0.0, z]).line([60.0, 0.0, z]).line([60.0, 0.0, 5.0]).line([-20.0, 0.0, 5.0]);
        }
        run(&path, &block_job(tool), 0.2, 1.0)
    };
    let map = slot(0.0, true);
    assert_eq!(kinds(&map, 5), [], "{:?}", map.events);
    assert_eq!(kinds(&map, 9), [EventKind::ShankContact]);
    assert!(map.events[0].detail.contains("4.00 mm"), "{:?}", map.events);
    assert_eq!(slot(0.1, true).events, []);
    assert_eq!(slot(0.0, false).events, []);
    // A step-over wider by 0.05 mm at every depth leaves the wall beside the shank, not on it.
    let mut tool = flat(10.0);
    tool.profile = Profile::flat(10.0, 8.0);
    (tool.flute_length_mm, tool.overhang_mm) = (8.0, 25.0);
    let mut path = Path::from([-20.0, 25.0, 5.0]);
    for (step, y) in [(1, 20.0), (2, 20.05), (3, 20.1)] {
        let z = -4.0 * f64::from(step);
        path.line([-20.0, y, z]).line([60.0, y, z]).line([60.0, 30.0, 5.0]).line([-20.0, 30.0, 5.0]);
    }
    assert_eq!(run(&path, &block_job(tool), 0.2, 1.0).events, []);
}

/// A tool ends a cut, or none does; another comes down at feed from beyond its clearance, 20 mm beside it, and goes on in the
/// same direction into the block in `steps`, moves 4 and up.
fn after_another_tool(first: Option<&feedwright::machine::Tool>, steps: usize) -> EngagementMap {
    let second = feedwright::machine::Tool { number: 2, ..flat(10.0) };
    let mut path = Path::from([10.0, 0.0, 5.0]);
    match first {
        Some(_) => path.line([10.0, 0.0, -6.0]),
        None => path.rapid([10.0, 0.0, 6.0]),
    };
    path.rapid([10.0, 0.0, 30.0]).set_tool(2);
    path.rapid([30.0, 0.0, 30.0]).line([30.0, 0.0, 10.0]);
    for k in 1..=steps {
        path.line([30.0, 0.0, 10.0 - 14.0 * k as f64 / steps as f64]);
    }
    let tools = first.cloned().into_iter().chain([second]).collect();
    run(&path, &job(tools, vec![block([0.0, -20.0, -40.0], [40.0, 20.0, 0.0])]), 0.2, 1.0)
}

#[test]
fn a_cut_takes_nothing_over_from_the_tool_before_it() {
    // A drill has more rings than the mill, a smaller mill fewer; both are engaged otherwise.
    let drill = tool(1, Shape::Drill, Profile::cone(12.0, 0.0, 2.0, 30.0));
    for first in [drill, ball(16.0), flat(16.0), flat(3.0)] {
        // One block, and a chain of short ones whose ends lie between those that are worked out.
        for steps in [1, 70] {
            let (after, alone) = (after_another_tool(Some(&first), steps), after_another_tool(None, steps));
            for k in 4..4 + steps as u32 {
                let found = |map: &EngagementMap| {
                    let of = |s: &Station| (s.to_mm, s.removal_area_mm2, s.axial_depth_mm, map.arcs_of(s).to_vec());
                    stations(map, k).iter().map(of).collect::<Vec<_>>()
                };
                assert_eq!(found(&after), found(&alone), "move {k} of {steps} after {:?}", first.shape);
            }
            assert!(volume_of(&after, 3 + steps as u32) > 0.0);
        }
    }
}

/// A hole with one tool, then another tool near the zero point: what the grid marked for the first says nothing of the second. Its arcs
/// are those that it has without the hole, which is elsewhere, and lie on rings of its own.
#[test]
fn marks_of_one_tool_are_not_read_with_the_rings_of_the_next() {
    let setup = "units = \"mm\"\nresolution = 0.2\n[stock]\nbox = { min = [-10, -10, -10], max = [40, 40, 0] }\n[material]\nk_tc = 800\nk_te = 12\n";
    let tool = |number: u32, shape: &str, diameter: f64| {
        format!("[[tool]]\nnumber = {number}\nshape = \"{shape}\"\ndiameter = {diameter}\nflutes = 2\n")
    };
    let hole = "T1 M6\nS3000 M3\nG0 X30 Y30 Z5\nG98 G81 X30 Y30 Z-3 R2 F100\nG80\n";
    let pairs = [("drill", 3.0, "ball", 12.0), ("ball", 12.0, "flat", 2.0), ("flat", 16.0, "drill", 3.0)];
    for (first, wide, second, narrow) in pairs {
        let setup = setup.to_owned() + &tool(1, first, wide) + &tool(4, second, narrow);
        let (job, _) = feedwright::setup::load(&setup, std::path::Path::new(".")).unwrap();
        let [with, without] = [hole, ""].map(|hole| {
            let text =
                format!("G21 G90 G94\n{hole}T4 M6\nS3000 M3\nG0 X1.3 Y1.9\nG1 Z0. F40.\nZ-1\nX5 Y3 F100\nG0 Z9\nM30\n");
            let program = feedwright::nc::parse(text.into_bytes(), None);
            let path = feedwright::nc::interpret(&program, &feedwright::nc::Environment::from_job(&job));
            let map =
                feedwright::engage::engage(&path, &job, &feedwright::engage::Options::default(), &|_| ()).unwrap();
            let of_second = |station: &&Station| path.moves[station.move_id.ix()].tool == 4;
            let rings = map.slices_of(4).len();
            let seen = map.stations.iter().filter(of_second).flat_map(|station| map.arcs_of(station)).map(|arc| {
                assert!((arc.slice as usize) < rings, "{first} then {second}");
                (arc.slice, arc.entry_rad, arc.exit_rad)
            });
            seen.collect::<Vec<_>>()
        });
        assert_eq!(with, without, "{first} then {second}");
        assert!(!with.is_empty());
    }
}
