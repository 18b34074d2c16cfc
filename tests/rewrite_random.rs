//! Small random programs with random schedules: what is written proves, does what was asked, and a second run changes
//! nothing.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/rewriting.rs"]
mod rewriting;

use feedwright::machine::Annotate;
use feedwright::nc::{CommentForm, Dialect, Syntax, TokenKind};
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
    /// `said`: with its G1 even where that is in force.
    Line {
        x: i32,
        y: i32,
        z: Option<i32>,
        feed: Option<u16>,
        said: bool,
    },
    Rapid {
        x: i32,
        y: i32,
    },
    Arc {
        turn: u8,
        clockwise: bool,
        by_radius: bool,
        radius: u16,
        feed: Option<u16>,
    },
    Incremental {
        x: i32,
        y: i32,
        feed: Option<u16>,
    },
    FeedOnly(u16),
    Thread,
    Dwell,
    Tool(u8),
    Coolant,
    Comment,
    Deleted {
        x: i32,
        feed: Option<u16>,
    },
    Cycle {
        feed: u16,
        again: u8,
    },
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
    // Is G1 in force, so that a straight block need not say it?
    let mut straight = false;
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
                let first = if *said || !straight { "G1" } else { "" };
                lines.push(with(first, vec![axes(x, y), z, feed_word(manner, *feed)]));
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
        straight = match block {
            Block::Line { .. } | Block::Incremental { .. } => true,
            Block::FeedOnly(_) | Block::Dwell | Block::Tool(_) | Block::Coolant | Block::Comment => straight,
            Block::Rapid { .. } | Block::Arc { .. } | Block::Thread | Block::Deleted { .. } | Block::Cycle { .. } => {
                false
            }
        };
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

/// Comments of a user in every style: none, both forms, amid the words, nested, never closed, doubled.
const STYLES: [&str; 9] =
    ["", "(rough)", "; rough", "(a (b) c)", "(a) (b)", "(left open", "(a) ; b", "; (a", "(MSG, tool (6 mm) in)"];

fn commented() -> impl Strategy<Value = (Dialect, Vec<(usize, bool, u16)>, u8)> {
    let dialect = (0..Dialect::ALL.len()).prop_map(|index| Dialect::ALL[index]);
    let line = (0..STYLES.len(), any::<bool>(), 20_u16..5000);
    // Mostly files of one or two styles, as people write them.
    let lines = (proptest::collection::vec(0..STYLES.len(), 1..3), proptest::collection::vec(line, 2..9)).prop_map(
        |(styles, lines)| {
            lines.into_iter().map(|(style, amid, feed)| (styles[style % styles.len()], amid, feed)).collect()
        },
    );
    (dialect, lines, 0_u8..3)
}

/// A program in the manner of its dialect, each line with its comment.
fn with_comments(dialect: Dialect, lines: &[(usize, bool, u16)]) -> String {
    let plain = dialect.syntax() == Syntax::Heidenhain;
    let mut text = if plain {
        "0 BEGIN PGM T MM\n1 TOOL CALL 1 Z S3000\n".into()
    } else {
        "G21 G90 G17\nG0 X0. Y0. Z5. S3000 M3\n".to_owned()
    };
    for (index, (style, amid, feed)) in lines.iter().enumerate() {
        let (style, x) = (STYLES[*style], 7 * (index + 1));
        let style = if plain { style.replace(['(', ')'], "") } else { style.to_owned() };
        let inside = *amid && style.ends_with(')') && !style.contains("( ") && dialect.syntax() == Syntax::Rs274;
        text += &match (plain, inside) {
            (true, _) if style.is_empty() => format!("{} L X+{x} Y+0 F{feed}\n", index + 2),
            (true, _) => format!("{} L X+{x} Y+0 F{feed} ; {}\n", index + 2, style.trim_start_matches("; ")),
            (false, true) => format!("G1 {style} X{x}. Y1. F{feed}\n"),
            (false, false) => format!("G1 X{x}. Y1. F{feed} {style}\n"),
        };
    }
    text + &if plain { format!("{} END PGM T MM\n", lines.len() + 2) } else { "M30\n".to_owned() }
}

/// Forms of the user's comments.
fn forms(text: &str, dialect: Dialect) -> Vec<CommentForm> {
    let program = parse(text.as_bytes(), dialect);
    let tokens = program.blocks().flat_map(|block| program.tokens(block).collect::<Vec<_>>());
    let comments = tokens.filter(|token| token.kind == TokenKind::Comment);
    comments.filter_map(|token| CommentForm::of(token.span.of(program.text()))).collect()
}

/// Every comment of ours: what stands before it in its line, and its form.
fn ours(text: &str) -> Vec<(&str, CommentForm)> {
    let marks = ["(FEEDWRIGHT ", "; FEEDWRIGHT ", "(FW F", "; FW F", "(FW WAS ", "; FW WAS "];
    text.lines()
        .flat_map(|line| {
            marks.iter().flat_map(move |mark| {
                line.match_indices(mark).map(move |(at, _)| (&line[..at], CommentForm::of(mark.as_bytes()).unwrap()))
            })
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn our_comments_are_written_as_this_file_writes_its_own((dialect, lines, annotate) in commented()) {
        let text = with_comments(dialect, &lines);
        let mut job = job();
        job.output.annotate = [Annotate::None, Annotate::Changes, Annotate::Full][usize::from(annotate)];
        let program = parse(text.as_bytes(), dialect);
        let path = toolpath(&program, &surroundings(), &job);
        let asked = schedule(&path, |_| vec![0.5], |index, piece| [0.5, 1.5, 1.2][(index + piece) % 3]);
        let written = check(&program, &surroundings(), &asked, &job).unwrap_or_else(|why| panic!("{why}\n{text}"));
        let written = String::from_utf8(written.bytes).unwrap();
        let own = forms(&text, dialect);
        for (before, form) in ours(&written) {
            prop_assert!(form == dialect.safest_comment() || own.contains(&form), "{}\n{}", dialect.name(), written);
            let only_other = !own.is_empty() && !own.contains(&form) && own.iter().all(|own| dialect.has_comment(*own));
            prop_assert!(!only_other, "{}: the file has another form\n{}", dialect.name(), written);
            let semicolon = form == CommentForm::Semicolon;
            prop_assert!(!(semicolon && matches!(dialect, Dialect::Haas | Dialect::Fanuc)), "{}", written);
            let open = before.matches('(').count() > before.matches(')').count();
            prop_assert!(!open && (semicolon || !before.contains(';')), "inside another comment: {}", written);
        }
        if annotate > 0 && lines.iter().all(|(style, ..)| STYLES[*style].is_empty()) {
            prop_assert!(!ours(&written).is_empty(), "{}", written);
        }
    }
}
