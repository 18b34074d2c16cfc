//! Every limit of the setup through the command: it is met in the simulation of the written file and is what binds; minima that
//! give way are said with both numbers; feeds in air, ramps, uncertain places and a control's block time.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/slot.rs"]
mod slot;

use feedwright::engage::{self, engage};
use feedwright::force::{Cap, Cut};
use feedwright::ids::MoveId;
use feedwright::machine::{Job, LimitKind, Operation, Ramp};
use feedwright::nc::{Environment, Toolpath, interpret, parse};
use feedwright::schedule::cutters::Cutters;
use feedwright::schedule::optimum::optimum;
use feedwright::schedule::solve::node_track;
use feedwright::schedule::{FeedPiece, Node, Options, Problem, problem, solve};
use serde_json::Value;
use slot::{SETUP, bench, limit, number, optimized, warnings};
use std::path::Path;
use tempfile::TempDir;

/// A slot, then half-immersed passes with an arc between them; it comes from air and goes back to it.
const PROGRAM: &str = "%\nG21 G90\nT1 M6\nS8000 M3\nG0 X-30 Y5 Z2\nG1 Z-2 F900\nG1 X50\nG1 Y8\nX-10\nY11\nX50\nG3 X50 Y17 I0 J3\nG1 X-30\nG0 Z10\nM30\n%\n";

/// Loads stay below a limit of 600 N at every feed allowed here, and above the quarter of it from which a limit counts.
fn run(limits: &str) -> (TempDir, Value) {
    let dir = bench(PROGRAM, &format!("{SETUP}{limits}"));
    let report = optimized(dir.path(), &[]);
    (dir, report)
}

/// More than any load here, in every unit; as a length 10 m, the largest that a setup takes being 100 m.
const WIDE: f64 = 1e4;

#[test]
fn every_load_limit_is_met_and_is_what_binds() {
    let wide = "force_xy = 600";
    let free = number(&run(wide).1["time"], "realised_after_s");
    for (name, written) in [
        ("force_xy", "force_xy = {}"),
        ("force_normal_mean", "force_normal_mean = {}"),
        ("force_axial", "force_axial = {}"),
        ("power", "power = {}"),
        ("torque", "torque = {}"),
        ("deflection", "deflection = {}"),
        ("surface_error", "surface_error = {}"),
        ("bending_stress", "bending_stress = {}"),
        ("chip_thickness", "chip_thickness = { max = {} }"),
        ("feed_per_tooth", "feed_per_tooth = { max = {} }"),
    ] {
        let with = |most: f64| run(&written.replace("{}", &format!("{most:.9}"))).1;
        let as_programmed = number(limit(&with(WIDE), name), "before_max");
        let most = 0.9 * as_programmed;
        let held = with(most);
        let after = number(limit(&held, name), "after_max");
        println!("{name}: {as_programmed} -> {after}, limit {most}");
        assert!(after > 0.9 * most && after <= 1.01 * most, "{name}: {as_programmed} -> {after}, limit {most}");
        assert!(number(limit(&held, name), "active_time_percent") > 0.0, "{name}");
        assert!(number(&held["check"], "resimulated_worst_ratio") <= 1.01, "{name}");
        assert!(number(&held["time"], "realised_after_s") > free, "{name}");
    }
}

#[test]
fn a_minimum_that_gives_way_to_a_load_limit_is_said_with_both_numbers() {
    let said = |report: &Value| warnings(report, "schedule::minimum");
    // A chip of 0.045 mm asks for 3 · 8000 · 0.045 = 1080 mm/min and more, the force in the slot allows less.
    let least = "chip_thickness = { min = 0.045 }";
    let (_, free) = run(&format!("force_xy = 600\n{least}"));
    assert!(said(&free).is_empty(), "{:?}", said(&free));
    let peak = number(limit(&free, "force_xy"), "before_max");
    // Nor does a chip of 0.1 mm come about where feeds may hardly change, on all of the cuts.
    let (_, kept) = run("force_xy = 600\nchip_thickness = { min = 0.1 }\nfeed_change = { max = 1.1 }");
    let texts = said(&kept);
    assert!(texts.len() == 1 && texts[0].contains("the feed is not raised to that"), "{texts:?}");
    let (_, held) = run(&format!("force_xy = {}\n{least}", 0.8 * peak));
    let texts = said(&held);
    assert_eq!(texts.len(), 1, "{texts:?}");
    let numbers: Vec<f64> =
        texts[0].split_whitespace().filter_map(|word| word.trim_end_matches(':').parse().ok()).collect();
    assert!(texts[0].starts_with("chip_thickness_min asks for") && texts[0].contains("force_xy allows"), "{texts:?}");
    assert!(numbers[0] >= 1079.0 && numbers[1] < numbers[0], "{texts:?}");
    assert!(number(&held["check"], "resimulated_worst_ratio") <= 1.01);
}

/// The force in the slot is linear in the feed. 72 mm/min are 0.003 mm per tooth, below which an edge rubs.
#[test]
fn a_limit_that_leaves_an_edge_rubbing_is_told() {
    let peak = number(limit(&run("force_xy = 600").1, "force_xy"), "before_max");
    let held_at = |most: f64| run(&format!("force_xy = {most}\nfeed_change = {{ min = 0.01 }}"));
    let feed = |(dir, _): &(TempDir, Value)| feeds_in_cut(dir.path()).into_iter().fold(f64::INFINITY, f64::min);
    let [upper, lower] = [0.8, 0.7].map(|share| feed(&held_at(share * peak)));
    let slope = 0.1 * peak / (upper - lower);
    for (slowed, rubs) in [(60.0, 1), (80.0, 0)] {
        let held = held_at(0.7 * peak - slope * (lower - slowed));
        let least = feed(&held);
        assert!((least - slowed).abs() < 8.0, "{slowed}: {least}");
        let said = warnings(&held.1, "schedule::rubbing");
        assert_eq!(said.len(), rubs, "{least} mm/min: {said:?}");
    }
}

/// Feeds of the stations that cut, mm/min.
fn feeds_in_cut(dir: &Path) -> Vec<f64> {
    rows(dir).iter().filter(|row| row.removal_mm2 > 0.01).map(|row| row.feed_after).collect()
}

#[test]
fn a_cut_that_shares_its_word_with_air_keeps_its_minimum() {
    // Each pass begins in air, where the feed stays at the 900 of the program; the cut asks for more.
    for least in ["feed = { min = 1500 }", "chip_thickness = { min = 0.06 }"] {
        let (dir, report) = run(&format!("force_xy = 600\nfeed_change = {{ max = 10 }}\n{least}"));
        let feeds = feeds_in_cut(dir.path());
        // A straight slot and half-immersed passes: chips of 0.06 mm at 3 · 8000 · 0.06 = 1440 mm/min and more.
        assert!(feeds.len() > 20 && feeds.iter().all(|feed| *feed >= 1440.0 * 0.999), "{least}: {feeds:?}");
        assert!(rows(dir.path()).iter().any(|row| row.feed_after == 900.0), "nothing in air is left");
        assert!(warnings(&report, "schedule::minimum").is_empty(), "{report}");
    }
}

#[test]
fn a_large_minimum_change_keeps_no_feed_below_a_minimum() {
    let with = |least: &str| {
        run(&format!("force_xy = 600\nfeed = {{ {least}max = 1700 }}\n[output]\nminimum_change = 0.9\n")).0
    };
    // From 900 to 1700 is a rise of less than 90 %, so it is not made; a minimum of 1500 asks for it all the same.
    assert!(feeds_in_cut(with("").path()).iter().all(|feed| *feed == 900.0));
    let feeds = feeds_in_cut(with("min = 1500, ").path());
    assert!(feeds.len() > 20 && feeds.iter().all(|feed| *feed >= 1500.0), "{feeds:?}");
}

#[test]
fn a_minimum_gives_way_to_a_load_limit_only_where_that_is_lower() {
    // The slot is held below the minimum by its force, the passes at half immersion are not.
    let least = "chip_thickness = { min = 0.03 }\nfeed_change = { max = 10 }";
    let peak = number(limit(&run(&format!("force_xy = 600\n{least}")).1, "force_xy"), "before_max");
    let (dir, report) = run(&format!("force_xy = {}\n{least}", 0.75 * peak));
    let feeds = feeds_in_cut(dir.path());
    let (low, high): (Vec<f64>, Vec<f64>) = feeds.iter().partition(|feed| **feed < 720.0 * 0.995);
    assert!(low.len() > 10 && high.len() > 5, "{feeds:?}");
    assert_eq!(warnings(&report, "schedule::minimum").len(), 1, "{:?}", warnings(&report, "schedule::minimum"));
    assert!(number(&report["check"], "resimulated_worst_ratio") <= 1.01);
}

#[test]
fn a_minimum_that_the_rest_of_its_block_does_not_allow_is_said_with_both_numbers() {
    let (_, report) = run("force_xy = 600\nfeed = { min = 1500 }\n[output]\nsplit = false\n");
    let said = warnings(&report, "schedule::minimum");
    assert!(said.len() == 1 && said[0].starts_with("feed_min asks for 1500 mm/min"), "{said:?}");
    assert!(said[0].contains("programmed allows only 900"), "{said:?}");
}

#[test]
fn a_program_of_few_blocks_is_split_too() {
    // 16 blocks; at half of them the feeds would stay 8 % behind the continuous optimum.
    let (_, report) = run("force_xy = 130");
    assert!(number(&report["output"], "loss_vs_continuous_percent") <= 1.0, "{}", report["output"]);
    assert!(number(&report["output"], "blocks_added") > 8.0, "{}", report["output"]);
}

#[test]
fn what_waits_for_a_word_about_clamps_is_said_with_its_seconds() {
    // 12 mm at 300 mm/min beside the blank, whatever else stands in the air.
    let program = "G21 G90 G17\nT1 M6\nS8000 M3\nG0 X-20 Y10 Z2\nG1 Z-2 F300\nX-8\nX48 F600\nG0 Z5\nM30\n";
    let said = |setup: &str| {
        let dir = bench(program, &(setup.to_owned() + "force_xy = 600\nair_feed = 4000\n"));
        let out = slot::feedwright(dir.path(), &["optimize", "part.nc"]);
        String::from_utf8_lossy(&out.stderr).into_owned()
    };
    let silent = said(&SETUP.replace("fixtures = \"none\"\n", ""));
    let at = silent.find(" s in the air beside the blank").unwrap_or_else(|| panic!("{silent}"));
    let seconds: f64 = silent[..at].rsplit(' ').next().unwrap().parse().unwrap();
    assert!((2.4..5.0).contains(&seconds), "{silent}");
    assert!(!said(SETUP).contains("beside the blank"));
}

/// A row of the table of stations.
struct Row {
    x_mm: f64,
    feed_after: f64,
    removal_mm2: f64,
}

fn rows(dir: &Path) -> Vec<Row> {
    let mut reader = csv::Reader::from_path(dir.join("r.csv")).unwrap();
    let at = |name: &str| reader.headers().unwrap().iter().position(|header| header == name).unwrap();
    let [x, feed, removal] = ["x_mm", "feed_after_mm_min", "removal_area_mm2"].map(at);
    let row = |record: csv::StringRecord| {
        let number = |column: usize| record[column].parse::<f64>().unwrap_or(0.0);
        Row { x_mm: number(x), feed_after: number(feed), removal_mm2: number(removal) }
    };
    reader.records().map(|record| row(record.unwrap())).collect()
}

#[test]
fn air_feed_ends_before_the_approach_to_the_grown_stock() {
    let (dir, report) = run("force_xy = 600\nfeed_change = { max = 1 }\nair_feed = 4000\napproach = 3");
    let all = rows(dir.path());
    let fast: Vec<&Row> = all.iter().filter(|row| row.feed_after > 900.0).collect();
    assert!(!fast.is_empty() && fast.iter().all(|row| row.feed_after <= 4000.0 && row.removal_mm2 <= 0.0));
    // Radius 3, uncertainty 0.4, approach 3 mm on either side of 0 to 40.
    assert!(fast.iter().all(|row| row.x_mm < -6.4 + 0.5 || row.x_mm > 46.4 - 0.5));
    assert!(number(&report["time"], "realised_after_s") < number(&report["time"], "realised_before_s"));
}

/// Each at its own speed: feed per tooth as a limit tells which speed a cutter has. Counted in 16 bits the last would have that of the first.
#[test]
fn more_than_65536_spindle_speeds_have_a_cutter_each() {
    let (job, _) = feedwright::setup::load(&format!("{SETUP}force_xy = 80\n"), Path::new(".")).unwrap();
    let moves = 65_540;
    let rpm = |k: usize| 1000.0 + 0.1 * k as f64;
    let blocks: String = (0..moves).map(|k| format!("S{:.1} G1 X{}\n", rpm(k), k % 2)).collect();
    let program = format!("%\nG21 G90\nT1 M6\nM3 S900\nG0 X0 Y0 Z9\nF900\n{blocks}M30\n%\n");
    let toolpath = interpret(&parse(program.into(), None), &Environment::from_job(&job));
    let map = engage(&toolpath, &job, &engage::Options::default(), &|_| {}).unwrap();
    let cutters = Cutters::new(&toolpath, &map, &job, &[]);
    let last = toolpath.moves.len() - 1;
    for k in [0, 1, moves - 1] {
        let cutter = cutters.of(MoveId((last - (moves - 1 - k)) as u32)).unwrap();
        let line = cutter.line(&Cut::default());
        let Cap::Feed { feed_mm_s, .. } = line.cap(LimitKind::FeedPerTooth, 0.1) else { panic!("no cap") };
        let teeth = job.tools[0].flutes as f64;
        assert!((feed_mm_s - 0.1 * teeth * rpm(k) / 60.0).abs() < 1e-6, "{k}: {feed_mm_s}");
    }
}

struct Part {
    job: Job,
    toolpath: Toolpath,
    map: engage::EngagementMap,
}

fn part() -> Part {
    let (job, _) = feedwright::setup::load(&format!("{SETUP}force_xy = 80\n"), Path::new(".")).unwrap();
    let toolpath = interpret(&parse(PROGRAM.into(), None), &Environment::from_job(&job));
    let map = engage(&toolpath, &job, &engage::Options::default(), &|_| {}).unwrap();
    Part { job, toolpath, map }
}

impl Part {
    fn problem(&self) -> Problem {
        problem(&self.toolpath, &self.map, &self.job)
    }
}

#[test]
fn an_exit_ramp_covers_its_distance_before_every_exit() {
    let mut part = part();
    let exit = Ramp { feed_mm_s: 0.9, distance_mm: 2.0 };
    part.job.operations.push(Operation { exit: Some(exit), ..Operation::default() });
    let problem = part.problem();
    let exits: Vec<&[Node]> = problem.nodes.windows(2).filter(|pair| pair[0].cutting && !pair[1].cutting).collect();
    assert!(exits.len() >= 3 && exits.iter().all(|pair| pair[0].cap.feed_mm_s <= exit.feed_mm_s));
    assert!(
        (ramped_mm(&problem) - 2.0 * exits.len() as f64).abs() < 0.1 * exits.len() as f64,
        "{}",
        ramped_mm(&problem)
    );
}

fn ramped_mm(problem: &Problem) -> f64 {
    problem.nodes.iter().filter(|node| node.cap.kind == LimitKind::Ramp).map(Node::length_mm).sum()
}

#[test]
fn a_ramp_at_sharp_corners_lies_on_both_sides() {
    let mut part = part();
    let ramp = Ramp { feed_mm_s: 0.9, distance_mm: 1.0 };
    part.job.operations.push(Operation { direction_change: Some((1.0, ramp)), ..Operation::default() });
    // Right angles after the plunge and after X50, Y8, X-10, Y11; the arc begins and ends along its neighbours.
    assert!((ramped_mm(&part.problem()) - 5.0 * 2.0).abs() < 1e-6, "{}", ramped_mm(&part.problem()));
    part.job.operations[0].direction_change = Some((2.0, ramp));
    assert!(ramped_mm(&part.problem()) < 1e-9);
}

#[test]
fn where_the_engagement_is_uncertain_no_feed_rises_and_no_block_is_cut() {
    let mut part = part();
    part.job.limits.force_xy_n = Some(130.0);
    let sure = solve(&part.problem(), &part.toolpath, &part.job, &Options::of(&part.toolpath));
    for station in &mut part.map.stations {
        station.flags.uncertain = true;
    }
    let unsure = solve(&part.problem(), &part.toolpath, &part.job, &Options::of(&part.toolpath));
    let risen = |schedule: &feedwright::schedule::Schedule| {
        let over = |piece: &FeedPiece| part.toolpath.moves[piece.move_id.ix()].feed.mm_s;
        schedule.pieces.iter().filter(|piece| piece.feed_mm_s > over(piece)).count()
    };
    let cut = |schedule: &feedwright::schedule::Schedule| {
        schedule.pieces.windows(2).filter(|pair| pair[0].move_id == pair[1].move_id).count()
    };
    assert!(risen(&sure) > 0 && cut(&sure) > 0);
    assert_eq!((risen(&unsure), cut(&unsure)), (0, 0));
}

#[test]
fn no_block_is_cut_into_pieces_shorter_than_the_block_time() {
    let mut part = part();
    part.job.limits.force_xy_n = Some(130.0);
    let shortest_s = |part: &Part| {
        let schedule = solve(&part.problem(), &part.toolpath, &part.job, &Options::of(&part.toolpath));
        let pieces = schedule.pieces.windows(2).filter(|pair| pair[0].move_id == pair[1].move_id).flatten();
        let time_s = |piece: &FeedPiece| (piece.to_mm - piece.from_mm) / piece.feed_mm_s;
        pieces.map(time_s).fold(f64::INFINITY, f64::min)
    };
    assert!(shortest_s(&part) < 0.3, "{}", shortest_s(&part));
    part.job.machine.block_time_s = 0.3;
    let shortest = shortest_s(&part);
    assert!(shortest >= 0.3 - 1e-9 && shortest.is_finite(), "{shortest}");
}

#[test]
fn a_move_takes_no_less_than_the_block_time() {
    let mut part = part();
    let free_s: f64 = optimum(node_track(&part.problem(), &part.toolpath, &part.job), 0.0).leg_times().iter().sum();
    part.job.machine.block_time_s = 3.0;
    let found = optimum(node_track(&part.problem(), &part.toolpath, &part.job), 0.0);
    let times = found.leg_times();
    let feeds = part.toolpath.iter_moves().filter(|(_, motion)| motion.kind == feedwright::nc::MoveKind::Feed);
    for (id, motion) in feeds {
        let taken: f64 = times.iter().zip(&found.moves).filter(|(_, of)| **of == id).map(|(time_s, _)| time_s).sum();
        assert!(taken >= 3.0 - 1e-9, "line {}: {taken} s", motion.line);
    }
    assert!(times.iter().sum::<f64>() > free_s);
}

/// Short lines of a spiral in inches, every seventh an arc about its middle. Nothing of it may stay because "the schedule says
/// nothing": every motion has what bounds it, what is kept has its reason, and the limit holds.
#[test]
fn an_inch_spiral_with_arcs_among_short_lines_is_scheduled_block_by_block() {
    use std::fmt::Write;
    let [cx, cy] = [0.787, 0.394];
    let mut program = String::from("%\nG20 G90 G17\nT1 M6\nS8000 M3\nG0 X0.787 Y0.394 Z0.1\nG1 Z-0.04 F4\nF20\n");
    let (mut at, mut angle) = ([cx, cy], 0.0_f64);
    for k in 0..1200 {
        let radius = 0.02 + 0.3 * f64::from(k) / 1200.0;
        angle += 0.02 / radius;
        let place = |r: f64| [cx + r * angle.cos(), cy + r * angle.sin()].map(|v| (v * 1e4).round() / 1e4);
        let [i, j] = [cx - at[0], cy - at[1]];
        if k % 7 == 6 {
            at = place(i.hypot(j));
            let _ = writeln!(program, "G3 X{:.4} Y{:.4} I{i:.4} J{j:.4}", at[0], at[1]);
        } else {
            at = place(radius);
            let _ = writeln!(program, "G1 X{:.4} Y{:.4}", at[0], at[1]);
        }
    }
    program += "G0 Z0.1\nM30\n%\n";
    let with = |most: f64| {
        let dir = bench(&program, &format!("{SETUP}force_xy = {most:.6}"));
        optimized(dir.path(), &[])
    };
    // Half of the force is that of the edges, which no feed takes away.
    let most = 0.8 * number(limit(&with(WIDE), "force_xy"), "before_max");
    let held = with(most);
    let after = number(limit(&held, "force_xy"), "after_max");
    assert!(after > 0.9 * most && after <= 1.01 * most, "{after} for {most}");
    assert!(held["frozen"].as_array().unwrap().is_empty(), "{}", held["frozen"]);
    let blocks = held["blocks"].as_array().unwrap();
    assert!(blocks.len() > 1200 && blocks.iter().all(|block| block["active_limit"].is_string()));
    let unexplained = |bound: &&Value| bound["name"] == "kept as programmed" && !bound["reason"].is_string();
    assert!(!held["bounds"].as_array().unwrap().iter().any(|bound| unexplained(&bound)), "{}", held["bounds"]);
}

/// A block in a loop has one feed for all its passes and cannot be split. Up to the first contact's last millimetre of engagement and from
/// the lead-out on, two blocks of this contour keep their feed; so they keep it to their ends, and that is what holds most of the cut.
#[test]
fn blocks_that_cannot_be_split_are_held_by_their_lowest_place() {
    let program = "%\nO20\nG21 G90 G17 G40 G94\nT1 M6\nS6000 M3\nG54 G0 X-10 Y-10 Z5\n#1=-3\nWHILE [#1 GE -9] DO1\nG0 X-10 Y-10\nG1 Z#1 F200\nG1 X2 F900\nY48\nG2 X6 Y52 R4\nG1 X66\nG2 X70 Y48 R4\nG1 Y-10\nG0 Z5\n#1=#1-3\nEND1\nM30\n%\n";
    let setup = "[machine]\ndialect = \"fanuc\"\n[[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 10\nflutes = 3\nflute_length = 30\noverhang = 40\n[stock]\nmaterial = \"aluminium-6061-t6\"\nbox = { min = [0, 0, -20], max = [72, 54, 0] }\n[limits]\nforce_xy = 1000\nfeed_change = 1.3\n";
    let held = optimized(bench(program, setup).path(), &[]);
    // The first block cuts from y −4 or so, where the circle of radius 5 beside x = 2 meets the corner at the origin, the last to there.
    let straight_mm = 48.0 + (25.0_f64 - 4.0).sqrt();
    let kept_s = 2.0 * straight_mm / 900.0;
    let raised_s = (60.0 + 2.0 * 4.0 * std::f64::consts::FRAC_PI_2) / 1170.0;
    let expected = 100.0 * kept_s / (kept_s + raised_s);
    let share = |name: &str| -> f64 {
        let bounds = held["bounds"].as_array().unwrap().iter();
        bounds.filter(|bound| bound["name"] == name).map(|bound| number(bound, "percent")).sum()
    };
    let (kept, raised) = (share("kept as programmed"), share("feed_change"));
    assert!(
        (kept - expected).abs() < 2.0 && (raised - (100.0 - expected)).abs() < 2.0,
        "{kept} for {expected}, {raised}"
    );
}
