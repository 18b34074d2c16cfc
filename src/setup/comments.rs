//! Tools, stock and material as far as the comments of a program tell them. In: the program and its motions. Out: a setup as
//! TOML text, either complete enough to run or to be finished by the user: what is missing is marked and listed.
//!
//! Recognised: `(T1 D=2 CR=0 - ZMIN=-5.9 - flat end mill)`, `(T2| 1/2 BULL ENDMILL 0.125 RAD|H0)`, `(T0 : 3.175)`,
//! `M6 T7 (TOOL DIA. 3)`, `T9 ;DRILL 10.2MM`, `(TOOL/MILL,10,1,20,0)`, `(STOCK/BLOCK,100,60,20,0,0,20)`,
//! `(MATERIAL: 6061)`.

use crate::nc::{MoveKind, Program, TokenKind, Toolpath};
use crate::path::Vec3;
use crate::units::MM_PER_INCH;

/// In an inch program a larger diameter without a unit is taken for millimetres, inch.
const LARGEST_INCH: f64 = 4.0;

/// A setup to start from.
#[derive(Debug, Clone, PartialEq)]
pub struct Sketch {
    /// TOML text.
    pub text: String,
    /// What the user must fill in; empty: the text is complete.
    pub missing: Vec<String>,
}

/// A tool as a comment describes it, lengths in the program's unit.
#[derive(Debug, Clone, PartialEq, Default)]
struct Told {
    number: u32,
    shape: Option<&'static str>,
    diameter: Option<f64>,
    corner: Option<f64>,
    point_deg: Option<f64>,
    flutes: Option<u32>,
    comment: String,
}

/// What the comments of a program tell. `materials`: names of the library.
pub fn sketch(program: &Program, path: &Toolpath, materials: &[&str]) -> Sketch {
    let comments = comments(program);
    let mut tools: Vec<Told> = Vec::new();
    for (number, comment) in comments.iter().filter_map(tool_comment) {
        let told = told(number, &comment, path.inch);
        match tools.iter_mut().find(|known| known.number == number) {
            Some(known) if known.diameter.is_none() => *known = told,
            Some(_) => {}
            None => tools.push(told),
        }
    }
    let mut missing = Vec::new();
    let mut text = format!("units = \"{}\"\n\n[stock]\n", if path.inch { "inch" } else { "mm" });
    text += &material(&comments, materials, &mut missing);
    text += &stock(&comments, path, &mut missing);
    for number in used(path) {
        let own = tools.iter().find(|told| told.number == number || number == 0 && tools.len() == 1);
        text += &tool(number, own, &mut missing);
    }
    Sketch { text, missing }
}

struct Comment {
    text: String,
    /// T word in force where it stands.
    tool: Option<u32>,
    /// The T word stands on the same line.
    same_line: bool,
}

fn comments(program: &Program) -> Vec<Comment> {
    let mut found = Vec::new();
    let mut tool = None;
    for block in program.blocks() {
        let mut same_line = false;
        for token in program.tokens(block) {
            match token.kind {
                TokenKind::Word(b'T') if token.number >= 0.0 => {
                    tool = Some(token.number as u32);
                    same_line = true;
                }
                TokenKind::Comment => {
                    let bytes = token.span.of(program.text());
                    let text: String = bytes.iter().map(|byte| (*byte as char).to_ascii_uppercase()).collect();
                    found.push(Comment { text: inner(&text), tool, same_line });
                }
                _ => {}
            }
        }
    }
    found
}

fn inner(comment: &str) -> String {
    let text = comment.trim_start_matches([';', '(']);
    text.strip_suffix(')').unwrap_or(text).trim().to_owned()
}

/// Tool number and description, when a comment describes a tool.
fn tool_comment(comment: &Comment) -> Option<(u32, String)> {
    let text = comment.text.as_str();
    let (name, rest) = split_number(text.strip_prefix('T').unwrap_or(""));
    if let Some(number) = name
        && rest.trim_start().starts_with(['|', ':', '-', 'D', '='])
    {
        return Some((number, rest.trim_start().trim_start_matches(['|', ':', '-']).to_owned()));
    }
    let describes =
        ["MILL", "DRILL", "TAP ", "REAM", "PROBE", "CHAMFER", "CUTTER", "DIA"].iter().any(|word| text.contains(word));
    let named = text.starts_with("TOOL:") || text.starts_with("TOOL DIA") || text.starts_with("TOOL/");
    (describes && (named || comment.same_line)).then(|| comment.tool.map(|number| (number, text.to_owned())))?
}

fn split_number(text: &str) -> (Option<u32>, &str) {
    let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    (text[..end].parse().ok(), &text[end..])
}

fn told(number: u32, text: &str, inch: bool) -> Told {
    let mut told = Told { number, comment: text.trim().to_owned(), flutes: flutes(text), ..Told::default() };
    if let Some(list) = text.strip_prefix("TOOL/MILL") {
        let sizes: Vec<f64> = list.split(',').filter_map(|part| part.trim().parse().ok()).collect();
        told.diameter = sizes.first().copied();
        told.corner = sizes.get(1).copied();
    } else {
        told.diameter = after(text, &["D=", "DIA.", "DIAMETER", "DIA"]).or_else(|| first_size(text, inch));
        told.corner = after(text, &["CR="]).or_else(|| before(text, " RAD"));
    }
    told.point_deg = after(text, &["TAPER="]);
    told.shape = shape(text, &told);
    told
}

fn flutes(text: &str) -> Option<u32> {
    let words: Vec<&str> = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '.' && c != '/').collect();
    let names = ["FLUTES", "FLUTE", "FLTS", "FL"];
    words.iter().enumerate().find_map(|(at, word)| {
        let joined = names.iter().find_map(|name| word.strip_suffix(name)?.parse().ok());
        let apart = || names.contains(word).then(|| words.get(at.checked_sub(1)?)?.parse().ok()).flatten();
        joined.or_else(apart).filter(|count| (1..100).contains(count))
    })
}

fn shape(text: &str, told: &Told) -> Option<&'static str> {
    const WORDS: [(&str, &str); 17] = [
        ("PROBE", "probe"),
        ("REAM", "reamer"),
        ("SPOT", "chamfer"),
        ("CHAMFER", "chamfer"),
        ("CENTER DRILL", "drill"),
        ("DRILL", "drill"),
        ("TAPPING", "tap"),
        ("RIGHT HAND TAP", "tap"),
        ("TAP ", "tap"),
        ("BALL", "ball"),
        ("BULL", "bull"),
        ("FACE MILL", "face"),
        ("FACEMILL", "face"),
        ("FLAT", "flat"),
        ("END MILL", "flat"),
        ("ENDMILL", "flat"),
        (" EM", "flat"),
    ];
    let by_word =
        WORDS.iter().find(|(word, _)| text.contains(word) || text.ends_with(word.trim())).map(|(_, shape)| *shape);
    let by_corner = match (told.corner, told.diameter) {
        (Some(corner), Some(diameter)) if corner > 0.0 && (corner - 0.5 * diameter).abs() < 1e-6 => Some("ball"),
        (Some(corner), Some(_)) if corner > 0.0 => Some("bull"),
        (Some(_), Some(_)) | (None, _) if text.contains("MILL") => Some("flat"),
        (None, Some(_)) if by_word.is_none() && text.len() < 12 => Some("flat"),
        _ => None,
    };
    match by_word {
        Some("flat") => by_corner.or(by_word),
        other => other.or(by_corner),
    }
}

/// The number that follows one of some words.
fn after(text: &str, words: &[&str]) -> Option<f64> {
    words.iter().find_map(|word| {
        let rest = &text[text.find(word)? + word.len()..];
        number(rest.trim_start_matches([' ', ':', '=', '.']))
    })
}

/// The number that stands right before a word.
fn before(text: &str, word: &str) -> Option<f64> {
    let head = text[..text.find(word)?].trim_end();
    let begin = head.rfind(|c: char| !(c.is_ascii_digit() || c == '.')).map_or(0, |at| at + 1);
    head[begin..].parse().ok()
}

fn number(text: &str) -> Option<f64> {
    let end = text.find(|c: char| !(c.is_ascii_digit() || ".-+".contains(c))).unwrap_or(text.len());
    text[..end].parse().ok()
}

/// First size in a description: `3/4`, `6MM`, `10.2 MM`, `6.`, in the program's unit.
fn first_size(text: &str, inch: bool) -> Option<f64> {
    let begin = text.find(|c: char| c.is_ascii_digit() || c == '.')?;
    let rest = &text[begin..];
    let end = rest.find(|c: char| !(c.is_ascii_digit() || ".-/".contains(c))).unwrap_or(rest.len());
    let (size, unit) = rest.split_at(end);
    let value = match size.split_once('/') {
        Some((over, under)) => {
            let (whole, over) = over.split_once('-').unwrap_or(("0", over));
            whole.parse::<f64>().ok()? + over.parse::<f64>().ok()? / under.parse::<f64>().ok()?
        }
        None => size.parse().ok()?,
    };
    let unit = unit.trim_start();
    let millimetres = unit.starts_with("MM") || inch && value >= LARGEST_INCH;
    let inches = unit.starts_with("IN") || unit.starts_with('"') || size.contains('/');
    Some(match (inch, millimetres, inches) {
        (true, true, _) => value / MM_PER_INCH,
        (false, false, true) => value * MM_PER_INCH,
        _ => value,
    })
}

/// Tools of the feed moves in order of use.
fn used(path: &Toolpath) -> Vec<u32> {
    let mut used = Vec::new();
    for motion in path.moves.iter().filter(|motion| motion.kind == MoveKind::Feed) {
        if !used.contains(&motion.tool) {
            used.push(motion.tool);
        }
    }
    used
}

fn tool(number: u32, told: Option<&Told>, missing: &mut Vec<String>) -> String {
    let nothing = Told::default();
    let told = told.unwrap_or(&nothing);
    let mut text = String::from("\n[[tool]]");
    if !told.comment.is_empty() {
        text += &format!("  # {}", told.comment);
    }
    text += &format!("\nnumber = {number}\n");
    let mut line = |key: &str, value: Option<String>, example: &str, what: &str| {
        if value.is_none() {
            missing.push(format!("{key} of T{number}"));
        }
        match value {
            Some(value) => format!("{key} = {value}\n"),
            None => format!("{key} = {example}  # <- {what}\n"),
        }
    };
    text += &line(
        "shape",
        told.shape.map(|shape| format!("\"{shape}\"")),
        "\"flat\"",
        "flat, ball, bull, drill, chamfer …",
    );
    text += &line("diameter", told.diameter.map(rounded), "10", "measure it");
    let cuts = !matches!(told.shape, Some("tap" | "reamer" | "probe" | "drill"));
    if cuts {
        text += &line("flutes", told.flutes.map(|count| count.to_string()), "4", "count them");
    }
    match (told.shape, told.corner, told.point_deg) {
        (Some("bull"), corner, _) => text += &line("corner_radius", corner.map(rounded), "1", "see the catalogue"),
        (Some("drill" | "chamfer"), _, Some(angle)) => {
            let full = if told.shape == Some("chamfer") { 2.0 * angle } else { angle };
            text += &format!("point_angle = {}\n", rounded(full));
        }
        _ => {}
    }
    text
}

fn rounded(value: f64) -> String {
    format!("{}", (value * 1e5).round() / 1e5)
}

fn material(comments: &[Comment], materials: &[&str], missing: &mut Vec<String>) -> String {
    let told = comments.iter().find(|comment| comment.text.starts_with("MATERIAL"));
    let squeezed = told.map(|comment| comment.text.to_lowercase());
    let known = squeezed.as_ref().and_then(|text| {
        let holds = |part: &&str| part.len() > 2 && part.chars().any(|c| c.is_ascii_digit()) && text.contains(*part);
        materials.iter().find(|name| text.contains(**name) || name.split('-').any(|part| holds(&part)))
    });
    if let Some(name) = known {
        return format!("material = \"{name}\"\n");
    }
    missing.push("material of the stock".into());
    let example = materials.first().copied().unwrap_or("aluminium-6061-t6");
    format!("material = \"{example}\"  # <- a name of `feedwright library materials`\n")
}

fn stock(comments: &[Comment], path: &Toolpath, missing: &mut Vec<String>) -> String {
    if let Some((min, max)) = comments.iter().find_map(|comment| apt_block(&comment.text)) {
        return box_line(min, max) + "\n";
    }
    missing.push("box of the stock".into());
    let scale = if path.inch { 1.0 / MM_PER_INCH } else { 1.0 };
    let (min, max) = extent(path);
    box_line(min * scale, max * scale) + "  # <- guessed from the feed moves\n"
}

/// `STOCK/BLOCK,x,y,z,ox,oy,oz`: size, and the program's zero measured from the lowest corner.
fn apt_block(text: &str) -> Option<(Vec3, Vec3)> {
    let list = text.strip_prefix("STOCK/BLOCK")?;
    let n: Vec<f64> = list.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    let [x, y, z, ox, oy, oz] = n[..] else { return None };
    let min = Vec3::new(-ox, -oy, -oz);
    Some((min, min + Vec3::new(x, y, z)))
}

/// Smallest box around the feed moves, from its lowest point to the higher of zero and where most of it ends, mm.
fn extent(path: &Toolpath) -> (Vec3, Vec3) {
    let (mut min, mut max) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    for motion in path.moves.iter().filter(|motion| motion.kind == MoveKind::Feed) {
        let (low, high) = motion.curve().bounds();
        min = min.inf(&low);
        max = max.sup(&high);
    }
    if !min.x.is_finite() {
        return (Vec3::new(0.0, 0.0, -10.0), Vec3::new(100.0, 100.0, 0.0));
    }
    max.z = if min.z < 0.0 { 0.0 } else { max.z };
    let thin = (max - min).map(|side| if side < 1.0 { 1.0 } else { 0.0 });
    (min - thin, max)
}

fn box_line(min: Vec3, max: Vec3) -> String {
    let point = |p: Vec3| format!("[{}, {}, {}]", short(p.x), short(p.y), short(p.z));
    format!("box = {{ min = {}, max = {} }}", point(min), point(max))
}

fn short(value: f64) -> String {
    format!("{}", (value * 1e3).round() / 1e3 + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str, inch: bool) -> Told {
        let comment = Comment { text: inner(text), tool: Some(9), same_line: true };
        let (number, description) = tool_comment(&comment).unwrap();
        told(number, &description, inch)
    }

    #[test]
    fn tool_comments_of_many_posts_are_read() {
        let close = |told: &Told, shape, d: f64| {
            assert_eq!(told.shape, Some(shape), "{told:?}");
            assert!((told.diameter.unwrap() - d).abs() < 1e-4, "{told:?}");
        };
        close(&of("(T1 D=2 CR=0 - ZMIN=-5.9 - FLAT END MILL)", false), "flat", 2.0);
        close(&of("(T3 D=0.125 CR=0.0625 - ZMIN=-0.54 - BALL END MILL)", true), "ball", 0.125);
        close(&of("(T1| 3/4 FLAT ENDMILL|H0|XY STOCK TO LEAVE - .005)", true), "flat", 0.75);
        let bull = of("(T2| 1/2 BULL ENDMILL 0.125 RAD|H0)", true);
        close(&bull, "bull", 0.5);
        assert_eq!(bull.corner, Some(0.125));
        close(&of("(T5|   6. FLAT ENDMILL|H0)", true), "flat", 6.0 / 25.4);
        close(&of("(T21| 1/8 SPOTDRILL|H0)", true), "chamfer", 0.125);
        close(&of("( T0 : 3.175 )", false), "flat", 3.175);
        close(&of(";DRILL 10.2MM", false), "drill", 10.2);
        close(&of("(TOOL DIA. 3)", false), "flat", 3.0);
        close(&of("(TOOL: 1/4 IN CARBIDE END MILL)", false), "flat", 6.35);
        close(&of("(T3|6MM EM|H0)", true), "flat", 6.0 / 25.4);
        assert_eq!(of("(T4 D=10 CR=0 - 3 FLUTE FLAT END MILL)", false).flutes, Some(3));
        assert_eq!(of("(T4 D=10 CR=0 - 3 FLUTE FLAT END MILL)", false).number, 4);
        assert_eq!(of("(T4 D=10 - 4FL ENDMILL)", false).flutes, Some(4));
        assert_eq!(of("(T1| 3/4 FLAT ENDMILL|H0)", true).flutes, None);
    }

    #[test]
    fn other_comments_are_not_tools() {
        for text in ["(POCKET: LAYER 6)", "(MILLING AN ENCLOSED POCKET)", "(T)", "(TOP OF STOCK AT Z=2)"] {
            let comment = Comment { text: inner(text), tool: Some(1), same_line: false };
            assert!(tool_comment(&comment).is_none(), "{text}");
        }
    }

    #[test]
    fn complete_comments_make_a_setup_that_loads() {
        let text = "(STOCK/BLOCK,100,60,20,0,0,20)\n(MATERIAL: AL 6061-T6)\n(T1 D=10 CR=0 - 4 FLUTES FLAT END MILL)\nT1 M6\nG1 X10 Z-1 F500\n";
        let program = crate::nc::parse(text.into(), None);
        let path = crate::nc::interpret(&program, &crate::nc::Environment::default());
        let sketch = sketch(&program, &path, &["aluminium-6061-t6"]);
        assert_eq!(sketch.missing, Vec::<String>::new());
        assert!(sketch.text.contains("max = [100, 60, 0]"), "{}", sketch.text);
    }
}
