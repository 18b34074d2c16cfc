//! Geometries that learning tries: what other sides of the stock do not concern is taken over from the declared geometry, and is what a whole
//! simulation of the other stock says.

#![allow(clippy::unwrap_used, clippy::format_collect)]

use feedwright::engage::{Again, EngagementMap, Options, engage, engage_again};
use feedwright::learn::program::simulated::{SimulatedProgram, simulate_declared};
use feedwright::learn::program::timeline::engaged_otherwise;
use feedwright::learn::program::unchanged_moves::unchanged_moves;
use feedwright::machine::Job;

/// Relative accuracy of the engagement over a millimetre of path (`tests/engage_accuracy.rs`).
const ENGAGEMENT_KNOWN_TO: f64 = 0.003;

fn options() -> Options<'static> {
    Options { spacing_mm: 0.5, ..Options::default() }
}

fn job() -> Job {
    let text = "[machine.axes]\nx = { velocity = 6000 }\ny = { velocity = 6000 }\nz = { velocity = 3000 }\n[stock]\n\
                box = { min = [0, 0, -12], max = [60, 40, 0] }\n[material]\nk_tc = 800\nk_te = 15\nk_rc = 300\nk_re = 10\n\
                [[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 8\nflutes = 3\n";
    feedwright::setup::load(text, std::path::Path::new(".")).unwrap().0
}

/// Passes along x at y = 0, 6 … 42, then a round in the middle.
fn program() -> String {
    let pass = |k: i32| format!("G0 X-8 Y{}\nG1 Z-3 F400\nG1 X68 F600\nG0 Z2\n", 6 * k);
    let passes: String = (0..8).map(pass).collect();
    let round = "G0 X20 Y20\nG1 Z-5 F200\nG1 X40 F500\nG2 X20 Y20 I-10 J0\nG0 Z20\nM2\n";
    format!("G21 G90 G17\nT1 M6\nS6000 M3\nG0 Z2\n{passes}{round}")
}

/// The program and its engagement as declared.
fn declared(job: &Job) -> (SimulatedProgram, EngagementMap) {
    let declared = simulate_declared(program().as_bytes(), job, None, None).unwrap();
    let map = engage(declared.toolpath(), job, &options(), &|_| ()).unwrap();
    (declared, map)
}

#[test]
fn moves_away_from_a_side_cut_the_same_and_the_others_are_worked_out() {
    let job = job();
    let (declared, map) = declared(&job);
    let (path, map) = (declared.toolpath(), &map);
    for (face, by_mm) in (0..4).flat_map(|face| [-1.5, -0.5, 0.5, 1.5].map(|by_mm| (face, by_mm))) {
        let mut sides_mm = [0.0; 4];
        sides_mm[face] = by_mm;
        let other = job.with_faces_moved(0.0, sides_mm);
        let of_move = unchanged_moves(path, map, &job, &other).unwrap();
        let share = of_move.iter().flatten().count() as f64 / path.moves.len() as f64;
        // Every pass crosses both sides in x; the first or the last two meet one in y.
        assert!((if face < 2 { 0.2..0.6 } else { 0.7..0.95 }).contains(&share), "{face}: {share}");
        let again = Again { known: map, of_move: &of_move };
        let maps = [
            engage(path, &other, &options(), &|_| ()).unwrap(),
            engage_again(path, &other, &options(), again, &|_| ()).unwrap(),
        ];
        let [whole, in_part] = maps.map(|map| engaged_otherwise(path, &map, &other, declared.timeline(), None, None));
        for (k, (a, b)) in whole.iter().zip(&in_part).enumerate() {
            // Stations of the two lie at other places on a bend.
            let near = |a: f64, b: f64| (a - b).abs() <= ENGAGEMENT_KNOWN_TO * a.max(b);
            let is_same = near(a.section_mm2, b.section_mm2) && near(a.contact_mm2, b.contact_mm2);
            assert!(is_same, "{face} {by_mm} line {}: {a:?} {b:?}", declared.timeline().spots[k].line);
        }
    }
}

#[test]
fn nothing_is_taken_over_where_the_top_or_the_tools_differ() {
    let job = job();
    let (declared, map) = declared(&job);
    let of = |other: &Job| unchanged_moves(declared.toolpath(), &map, &job, other);
    assert!(of(&job.with_stock_grown(0.5, 0.0)).is_none());
    assert!(of(&job.with_mills_wider(-0.2).unwrap()).is_none());
    assert!(of(&job.with_stock_grown(0.0, 0.5)).is_some());
}
