//! What is decided on everyday programs at default settings: how near the written feeds come to the continuous optimum, that
//! every load limit holds, and that a second run leaves the program as it is.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/everyday.rs"]
mod everyday;

use std::path::Path;

use everyday::Everyday;
use feedwright::engage;
use feedwright::job::{JobError, Keep, SPACING_MM, Task, Wanted, Watch, optimize, simulate};
use feedwright::nc::{self, Dialect, MoveKind};
use feedwright::outcome::LIMIT_TOLERANCE;
use feedwright::outcome::ProgramRun;
use feedwright::report::figures;
use feedwright::setup;

fn run(text: &[u8], setup_text: &str) -> ProgramRun {
    made(text, setup_text, optimize, Keep::default())
}

/// Simulated at the spacing of the check.
fn simulated(text: &[u8], setup_text: &str) -> ProgramRun {
    let ProgramRun { toolpath, job, .. } = made(text, setup_text, simulate, Keep::default());
    let options = engage::Options { spacing_mm: SPACING_MM[1], ..engage::Options::default() };
    let map = engage::engage(&toolpath, &job, &options, &|_| ()).unwrap();
    let recall = |_: &_| Some(map.clone());
    made(text, setup_text, simulate, Keep { recall: Some(&recall), ..Keep::default() })
}

fn made(
    text: &[u8],
    setup_text: &str,
    how: fn(Task, &Watch) -> Result<ProgramRun, JobError>,
    keep: Keep,
) -> ProgramRun {
    let (job, assumptions) = setup::load(setup_text, Path::new(".")).unwrap();
    let dialect = job.machine.dialect.as_deref().and_then(Dialect::from_name);
    let watch = Watch {
        progress: &|_, _| (),
        clock: &|| 0.0,
        subprograms: &|_| None,
        engage: engage::Options::default(),
        keep,
    };
    let program = nc::parse(text.to_vec(), dialect);
    how(Task { program, job, assumptions, wanted: Wanted::default() }, &watch).unwrap()
}

/// What came of one program.
struct Row {
    name: String,
    loss_percent: f64,
    worst: f64,
    identical: bool,
    /// F words of the output, and how many of them a second run changes or adds.
    words: usize,
    again: usize,
}

fn row(program: &Everyday) -> Row {
    let first = run(program.text.as_bytes(), &program.setup);
    let written = first.written.as_ref().unwrap();
    if let Ok(folder) = std::env::var("EVERYDAY_FOLDER") {
        // To look at one of them: the program, its setup, what was written and what a second run makes of that.
        let name = program.name.replace([' ', ','], "_");
        let put = |end: &str, bytes: &[u8]| std::fs::write(format!("{folder}/{name}{end}"), bytes).unwrap();
        put(".nc", program.text.as_bytes());
        put(".setup.toml", program.setup.as_bytes());
        put(".1.nc", &written.bytes);
        put(".2.nc", &run(&written.bytes, &program.setup).written.unwrap().bytes);
    }
    let second = run(&written.bytes, &program.setup);
    let stats = second.written.as_ref().unwrap().stats;
    let loss_percent = 100.0 * (written.realised_after.total_s / written.schedule.continuous_s - 1.0);
    let row = Row {
        name: program.name.clone(),
        loss_percent,
        worst: written.check.over.free_ratio,
        identical: written.check.identical,
        words: written.stats.f_words_after,
        again: stats.f_words_changed + stats.f_words_inserted + stats.blocks_added,
    };
    println!(
        "{:<34}{:>8.1} →{:>7.1} s, continuous{:>7.1} s{:>7.2} %{:>8.4}{:>5} blocks +{:<4}{:>5} → {} words, again {} ({} {} {})",
        row.name,
        first.realised_before.total_s,
        written.realised_after.total_s,
        written.schedule.continuous_s,
        row.loss_percent,
        row.worst,
        first.program.own_len(),
        written.stats.blocks_added,
        written.stats.f_words_before,
        row.words,
        row.again,
        stats.f_words_changed,
        stats.f_words_inserted,
        stats.blocks_added,
    );
    row
}

#[test]
fn everyday_programs_get_what_their_limits_allow() {
    let only = std::env::var("EVERYDAY").unwrap_or_default();
    let rows: Vec<Row> = everyday::all().iter().filter(|program| program.name.contains(&only)).map(row).collect();
    let mut losses: Vec<f64> = rows.iter().map(|row| row.loss_percent).collect();
    losses.sort_by(f64::total_cmp);
    println!("{} programs, median loss {:.2} %", rows.len(), losses[losses.len() / 2]);
    for row in &rows {
        assert!(row.identical, "{}", row.name);
        assert!(row.worst <= LIMIT_TOLERANCE, "{}: {}", row.name, row.worst);
        assert!(row.loss_percent <= 2.0, "{}: {:.2} %", row.name, row.loss_percent);
        assert!(100 * row.again < row.words.max(1), "{}: {} of {}", row.name, row.again, row.words);
    }
    assert!(rows.len() >= 30 && losses[losses.len() / 2] <= 1.0);
}

/// The programs that come with the project, at default settings. In `saddle.nc` whole numbers stand without a point beside others that
/// have one; its lines of 60 mm can be cut all the same.
#[test]
fn the_programs_of_the_project_lose_little_over_the_continuous_optimum() {
    for name in ["bracket", "island", "pocket", "saddle"] {
        let read = |end: &str| std::fs::read(format!("programs/{name}{end}")).unwrap();
        let setup = String::from_utf8(read(".setup.toml")).unwrap();
        let written = run(&read(".nc"), &setup).written.unwrap();
        let loss_percent = 100.0 * (written.realised_after.total_s / written.schedule.continuous_s - 1.0);
        println!("{name}: {loss_percent:.2} %, {:.4}", written.check.over.free_ratio);
        assert!(loss_percent <= 2.0, "{name}: {loss_percent:.2} %");
        assert!(written.check.identical && written.check.over.free_ratio <= LIMIT_TOLERANCE, "{name}");
    }
}

/// In inches on a Fanuc, one F without a decimal point and the next one with it: both blocks are cut in pieces as if all had points.
#[test]
fn feeds_with_and_without_a_point_are_both_cut_in_pieces() {
    let text = |feed: &str| {
        format!(
            "%\nO71\nG20 G17 G90 G94\nG54\nT1 M6\nS8000 M3\nG0 X-2.4 Y-.8\nZ-.16\nG1 X2.4 {feed}\nG0 Y0\nG1 X-2.4 F35.5\nG0 Z2.\n\
             M30\n%\n"
        )
    };
    let setup = std::fs::read_to_string("programs/pocket.setup.toml").unwrap();
    let setup = setup.replace("linuxcnc", "fanuc");
    let [mixed, pointed] = ["F40", "F40."].map(|feed| run(text(feed).as_bytes(), &setup));
    assert!(mixed.toolpath.moves.iter().all(|motion| motion.freeze.is_none()), "the proof refuses nothing");
    let [mixed, pointed] = [mixed, pointed].map(|run| run.written.unwrap().realised_after.total_s);
    assert!((mixed / pointed - 1.0).abs() < 0.01, "{mixed} {pointed}");
}

/// The check simulates again only what was cut in pieces or comes near a limit. What it says of all the file is what a simulation
/// of the whole written file at the same spacing finds, within 1 %; and both kinds of blocks are there.
#[test]
fn the_check_says_what_a_simulation_of_the_whole_written_file_finds() {
    let (mut in_part, mut near) = (0, 0);
    for program in everyday::all().iter().step_by(4) {
        let written = run(program.text.as_bytes(), &program.setup).written.unwrap();
        let whole = simulated(&written.bytes, &program.setup);
        let feed_moves = whole.toolpath.moves.iter().filter(|motion| motion.kind == MoveKind::Feed).count();
        let found = [written.check.over.ratio(), figures(&whole).verdict.over.ratio()];
        println!("{:<34}{:.4?}, {} of {feed_moves} again", program.name, found, written.check.simulated_again);
        assert!((found[0] / found[1] - 1.0).abs() < 0.01, "{}: {found:?}", program.name);
        in_part += usize::from(written.check.simulated_again < feed_moves);
        near += usize::from(written.check.simulated_again > 0);
    }
    assert!(in_part > 3 && near > 3, "{in_part} {near}");
}

/// A whole block is simulated again where its load, and as much more as it differs from those beside it, comes to 0.8 of its limit:
/// where a cut begins or ends from 0.4 on, in the middle of a steady one only from 0.8 on. Slots in one block and in twenty, their
/// feeds kept, under a limit of so many times what they carry.
#[test]
fn a_whole_block_is_simulated_again_near_its_limit_or_where_its_load_changes() {
    let checked = |blocks: i32, limit: f64| {
        let ends = (1..=blocks).map(|k| format!("X{} ", -10 + 100 * k / blocks));
        let cut: Vec<String> = ends.map(|end| format!("G1 {end}F600\n")).collect();
        let text = format!("G21 G90 G17\nT1 M6\nS8000 M3\nG0 X-10 Y20 Z2\nZ-3\n{}G0 Z2\nM30\n", cut.concat());
        let setup = format!(
            "[machine]\ndialect = \"linuxcnc\"\n[stock]\nmaterial = \"aluminium-6061-t6\"\nbox = {{ min = [0, 0, -10], max = [80, 40, 0] }}\n\
             [[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 8\nflutes = 2\n\
             [limits]\nforce_xy = {limit}\nfeed_change = {{ min = 1.0, max = 1.0 }}\n[output]\nsplit = false\n"
        );
        run(text.as_bytes(), &setup).written.unwrap().check
    };
    let carries = 1000.0 * checked(1, 1000.0).over.ratio();
    assert!(carries > 10.0, "{carries}");
    let again = |blocks: i32, times: f64| checked(blocks, times * carries).simulated_again;
    // 1 / 0.4 and 1 / 0.8 of what they carry.
    assert_eq!([2.55, 2.45].map(|times| again(1, times)), [0, 1]);
    assert_eq!(again(20, 2.55), 0);
    println!("{:?}", [2.45, 1.27, 1.23].map(|times| again(20, times)));
    let [ends, steady] = [again(20, 1.27), again(20, 1.23)];
    assert!(again(20, 2.45) > 0 && ends <= 4 && steady >= 14, "{ends} {steady}");
    let [little, much] = [2.55, 1.23].map(|times| times * checked(20, times * carries).over.ratio());
    assert!((little - much).abs() < 1e-3, "{little} {much}");
}

fn with(program: &(String, String), more: &str) -> ProgramRun {
    run(program.0.as_bytes(), &format!("{}{more}", program.1))
}

fn after_s(run: &ProgramRun) -> f64 {
    run.written.as_ref().unwrap().realised_after.total_s
}

/// Where `max_growth` binds, the most valuable words come first: a tighter bound costs more, what it costs is said, and a new
/// block saves more than one does where all have room. A side that is raised takes two of them, as its entry keeps the feed
/// of the program; the long sides come first.
#[test]
fn a_bound_on_growth_costs_seconds_and_never_everything() {
    let program = everyday::loops(false, [150.0, 66.0], 1.2, 15.0);
    let free = with(&program, "[output]\nmax_growth = 1e6\n");
    let costs = |run: &ProgramRun| run.written.as_ref().unwrap().schedule.bound_costs_s;
    assert_eq!(costs(&free), 0.0);
    let saves_s = |run: &ProgramRun| {
        let blocks = run.written.as_ref().unwrap().stats.blocks_added;
        (run.realised_before.total_s - after_s(run)) / blocks as f64
    };
    let mut last_s = after_s(&free);
    for growth in [2.2, 1.8, 1.4] {
        let run = with(&program, &format!("[output]\nmax_growth = {growth}\n"));
        let written = run.written.as_ref().unwrap();
        let [blocks, bytes] = [run.program.len() as f64, run.program.text().len() as f64];
        assert!((blocks + written.stats.blocks_added as f64) / blocks <= growth, "{growth}: blocks");
        assert!(written.bytes.len() as f64 / bytes <= growth, "{growth}: {} of {bytes} bytes", written.bytes.len());
        assert!(after_s(&run) >= last_s - 0.01, "{growth}: {} {last_s}", after_s(&run));
        assert!(
            (after_s(&run) - after_s(&free) - costs(&run)).abs() < 0.02 * after_s(&free),
            "{growth}: {}",
            costs(&run)
        );
        let said = feedwright::report::summary(&run, &figures(&run), "part.nc");
        assert_eq!(said.contains("output.max_growth is used up"), costs(&run) > 0.0, "{said}");
        assert!(saves_s(&run) > 1.5 * saves_s(&free), "{growth}: {} {}", saves_s(&run), saves_s(&free));
        last_s = after_s(&run);
    }
}

/// The bound that the setup does not give leaves a program of five blocks what it is worth; one that is written down holds.
#[test]
fn a_short_program_may_grow_beyond_four_times_its_bytes() {
    let program = everyday::short(false, 30.0);
    let growth = |run: &ProgramRun| run.written.as_ref().unwrap().bytes.len() as f64 / run.program.text().len() as f64;
    let (free, bound) = (with(&program, ""), with(&program, "[output]\nmax_growth = 4\n"));
    assert!(growth(&free) > 4.0 && growth(&bound) <= 4.0, "{} {}", growth(&free), growth(&bound));
    assert!(free.written.as_ref().unwrap().schedule.bound_costs_s == 0.0 && after_s(&free) < after_s(&bound));
}

/// A block that has no feed at all (no length, in inverse time) is named, and costs no other block its feed.
#[test]
fn a_block_without_a_feed_is_named_and_harms_no_other() {
    let (_, setup) = everyday::short(true, 0.0);
    let text = "%\nG20 G17 G90 G94\nT1 M6\nS8000 M3\nG0 X-0.5 Y0.1\nG0 Z-0.2\nG1 X2. F20.\nG93\nG1 X2. Y0.1 F5.\nG94\nG1 X8.5 F20.\nG0 Z1.\nM30\n%\n";
    let found = run(text.as_bytes(), &setup);
    let written = found.written.as_ref().unwrap();
    let kept: Vec<(u32, &str)> = written.kept.iter().map(|(block, why)| (block.0 + 1, why.as_str())).collect();
    assert_eq!(kept, [(9, "no feed above zero is in force in it")]);
    assert!(
        after_s(&found) < 0.6 * found.realised_before.total_s,
        "{} {}",
        after_s(&found),
        found.realised_before.total_s
    );
}
