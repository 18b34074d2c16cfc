//! Small random programs with random schedules: what is written proves, does what was asked, and a second run changes
//! nothing.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/rewriting.rs"]
mod rewriting;

use feedwright::machine::Annotate;
use feedwright::nc::Dialect;
use proptest::prelude::*;
use rewriting::{check, job, parse, schedule, surroundings, toolpath};

/// How a program is written.
#[derive(Debug, Clone, Copy)]
struct Manner {
    spaced: bool,
    numbered: bool,
    crlf: bool,
    point: bool,
    inch: bool,
    annotate: u8,
}

/// One block, before it is put into a manner of writing.
#[derive(Debug, Clone)]
enum Block {
    Line { x: i32, y: i32, z: Option<i32>, feed: Option<u16>, said: bool },
    Rapid { x: i32, y: i32 },
    Arc { turn: u8, clockwise: bool, by_radius: bool, radius: u16, feed: Option<u16> },
    Incremental { x: i32, y: i32, feed: Option<u16> },
    FeedOnly(u16),
    Thread,
    Dwell,
    Tool(u8),
    Coolant,
    Comment,
    Deleted { x: i32, feed: Option<u16> },
    Cycle { feed: u16, again: u8 },
}

fn block() -> impl Strategy<Value = Block> {
    let feed = || proptest::option::weighted(0.3, 20_u16..5000);
    let at = || -60_000_i32..60_000;
    prop_oneof![
        6 => (at(), at(), proptest::option::weighted(0.2, at()), feed(), any::<bool>())
            .prop_map(|(x, y, z, feed, said)| Block::Line { x, y, z, feed, said }),
        1 => (at(), at()).prop_map(|(x, y)| Block::Rapid { x, y }),
        3 => (0_u8..8, any::<bool>(), any::<bool>(), 500_u16..30_000, feed())
            .prop_map(|(turn, clockwise, by_radius, radius, feed)| Block::Arc { turn, clockwise, by_radius, radius, feed }),
        2 => (at(), at(), feed()).prop_map(|(x, y, feed)| Block::Incremental { x, y, feed }),
        1 => (20_u16..5000).prop_map(Block::FeedOnly),
        1 => Just(Block::Thread),
        1 => Just(Block::Dwell),
        1 => (1_u8..4).prop_map(Block::Tool),
        1 => Just(Block::Coolant),
        1 => Just(Block::Comment),
        1 => (at(), feed()).prop_map(|(x, feed)| Block::Deleted { x, feed }),
        1 => (20_u16..500, 0_u8..3).prop_map(|(feed, again)| Block::Cycle { feed, again }),
    ]
}

fn manner() -> impl Strategy<Value = Manner> {
    (any::<bool>(), any::<bool>(), any::<bool>(), any::<bool>(), any::<bool>(), 0_u8..3).prop_map(
        |(spaced, numbered, crlf, point, inch, annotate)| Manner { spaced, numbered, crlf, point, inch, annotate },
    )
}

/// Thousandths as a number.
fn number(thousandths: i32) -> String {
    format!("{:.3}", f64::from(thousandths) / 1000.0)
}

fn words(manner: Manner, words: &[String]) -> String {
    words.join(if manner.spaced { " " } else { "" })
}

fn feed_word(manner: Manner, feed: Option<u16>) -> Vec<String> {
    feed.map(|feed| format!("F{feed}{}", if manner.point { "." } else { "" })).into_iter().collect()
}

/// Writes the program; positions are tracked so that arcs close.
fn write(blocks: &[Block], manner: Manner) -> String {
    let mut lines = vec![words(manner, &[if manner.inch { "G20" } else { "G21" }.into(), "G90".into(), "G17".into()])];
    let (mut x, mut y) = (0, 0);
    lines.push(words(manner, &["G0".into(), "X0.".into(), "Y0.".into(), "Z5.".into(), "S3000".into(), "M3".into()]));
    for block in blocks {
        let axes = |x: i32, y: i32| vec![format!("X{}", number(x)), format!("Y{}", number(y))];
        let with = |first: &str, rest: Vec<Vec<String>>| {
            let mut all = if first.is_empty() { Vec::new() } else { vec![first.to_owned()] };
            all.extend(rest.into_iter().flatten());
            words(manner, &all)
        };
        match block {
            Block::Line { x: to_x, y: to_y, z, feed, said } => {
                (x, y) = (*to_x, *to_y);
                let z = z.map(|z| format!("Z{}", number(z))).into_iter().collect();
                let _ = said;
                lines.push(with("G1", vec![axes(x, y), z, feed_word(manner, *feed)]));
            }
            Block::Rapid { x: to_x, y: to_y } => {
                (x, y) = (*to_x, *to_y);
                lines.push(with("G0", vec![axes(x, y)]));
            }
            Block::Arc { turn, clockwise, by_radius, radius, feed } => {
                let r = f64::from(*radius);
                let angle = std::f64::consts::FRAC_PI_4 * (f64::from(*turn) + 1.0);
                let sense = if *clockwise { -1.0 } else { 1.0 };
                let end = |axis: f64| (axis * r).round() as i32;
                let (cx, cy) = (x - i32::from(*radius), y);
                let to = (cx + end(angle.cos()), cy + (sense * (angle.sin() * r).round()) as i32);
                let form = if *by_radius && angle < 2.9 {
                    vec![format!("R{}", number(i32::from(*radius)))]
                } else {
                    vec![format!("I{}", number(cx - x)), "J0.".to_owned()]
                };
                (x, y) = to;
                lines
                    .push(with(if *clockwise { "G2" } else { "G3" }, vec![axes(x, y), form, feed_word(manner, *feed)]));
            }
            Block::Incremental { x: by_x, y: by_y, feed } => {
                (x, y) = (x + by_x, y + by_y);
                lines.push("G91".to_owned());
                lines.push(with("G1", vec![axes(*by_x, *by_y), feed_word(manner, *feed)]));
                lines.push("G90".to_owned());
            }
            Block::FeedOnly(feed) => lines.push(with("", vec![feed_word(manner, Some(*feed))])),
            Block::Thread => lines.extend([with("G33", vec![vec!["Z1.".into(), "K1.".into()]])]),
            Block::Dwell => lines.push(with("G4", vec![vec!["P0.5".into()]])),
            Block::Tool(tool) => {
                lines.push(with(&format!("T{tool}"), vec![vec!["M6".into()], vec!["S3000".into(), "M3".into()]]));
            }
            Block::Coolant => lines.push("M8".to_owned()),
            Block::Comment => lines.push("(a remark)".to_owned()),
            Block::Deleted { x: to, feed } => {
                x = *to;
                lines.push(format!(
                    "/{}",
                    with("G1", vec![vec![format!("X{}", number(*to))], feed_word(manner, *feed)])
                ));
                lines.push(with("G0", vec![axes(x, y)]));
            }
            Block::Cycle { feed, again } => {
                lines.push(with(
                    "G81",
                    vec![axes(x, y), vec!["Z-3.".into(), "R2.".into()], feed_word(manner, Some(*feed))],
                ));
                for step in 1..=i32::from(*again) {
                    lines.push(with("", vec![axes(x + 1000 * step, y)]));
                }
                lines.push("G80".to_owned());
                lines.push(with("G0", vec![axes(x, y)]));
            }
        }
    }
    lines.push("M30".to_owned());
    let numbered = |(index, line): (usize, &String)| {
        if manner.numbered && !line.starts_with(['(', '/']) {
            words(manner, &[format!("N{}", (index + 1) * 5), line.clone()])
        } else {
            line.clone()
        }
    };
    let end = if manner.crlf { "\r\n" } else { "\n" };
    lines.iter().enumerate().map(numbered).map(|line| line + end).collect()
}

fn mixed(seed: u64, a: usize, b: usize) -> f64 {
    let mut z = seed ^ (a as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (b as u64).wrapping_mul(0xD134_2543_DE82_EF95);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_programs_are_rewritten_provably(
        blocks in proptest::collection::vec(block(), 1..25),
        manner in manner(),
        dialect in prop_oneof![Just(Dialect::Generic), Just(Dialect::LinuxCnc), Just(Dialect::Fanuc), Just(Dialect::Grbl)],
        seed in any::<u64>(),
    ) {
        let text = write(&blocks, manner);
        let program = parse(text.as_bytes(), dialect);
        let mut job = job();
        job.output.annotate = [Annotate::None, Annotate::Changes, Annotate::Full][usize::from(manner.annotate)];
        let toolpath = toolpath(&program, &surroundings(), &job);
        let cuts = |index: usize| {
            let pieces = (mixed(seed, index, 100) * 4.0) as usize;
            (1..pieces).map(|k| k as f64 / pieces as f64).collect::<Vec<_>>()
        };
        let factor = |index: usize, piece: usize| [0.3, 0.7, 1.0, 1.0, 1.6][(mixed(seed, index, piece) * 5.0) as usize];
        let asked = schedule(&toolpath, cuts, factor);
        if let Err(why) = check(&program, &surroundings(), &asked, &job) {
            return Err(TestCaseError::fail(format!("{why}\nfrom\n{text}")));
        }
    }
}
