//! The blank as the text of a program tells it. In: comments, `BLK FORM` of plain language, and the motions. Out: a line of `[stock]`
//! with its source, and where nothing is told the box around the cutting moves as an example.

use super::header::Comment;
use super::known::Known;
use crate::nc::{MoveKind, Program, Syntax, TokenKind, Toolpath};
use crate::path::Vec3;
use crate::units::MM_PER_INCH;

/// The blank that the text tells, as a line of `[stock]`.
pub fn told(program: &Program, comments: &[Comment]) -> Option<Known> {
    let said = |(min, max), source: &str| Known::said(box_line(min, max), source);
    let apt = comments.iter().find_map(|c| Some(said(apt_block(&c.text)?, &format!("line {}", c.line))));
    let corners =
        || two_corners(comments).or_else(|| least_and_greatest(comments)).or_else(|| size_and_origin(comments));
    apt.or_else(|| corners().map(|(min, max, line)| said((min, max), &format!("line {line}"))))
        .or_else(|| blank_form(program).map(|corners| said(corners, "BLK FORM")))
        .or_else(|| blank_cylinder(program))
}

/// The box around the cutting moves in the program's unit, as a line of `[stock]`.
pub fn around(path: &Toolpath) -> String {
    let scale = if path.inch { 1.0 / MM_PER_INCH } else { 1.0 };
    let (min, max) = extent(path);
    box_line(min * scale, max * scale)
}

/// The blank in the user's words: two corners, `around` the cutting moves, or a line of `[stock]`. Errors: what cannot be read.
pub fn in_words(words: &str, around: &str) -> Result<String, String> {
    let words = words.trim();
    if words.eq_ignore_ascii_case("around") {
        return Ok(around.to_owned());
    }
    if words.contains('=') && words.parse::<toml::Table>().is_ok() {
        return Ok(words.to_owned());
    }
    match triplets(&words.to_ascii_uppercase())[..] {
        [a, b] if sound(a.inf(&b), a.sup(&b)) => Ok(box_line(a.inf(&b), a.sup(&b))),
        _ => Err(format!(
            "\"{words}\" is no blank; write two corners like \"X0 Y0 Z-20 X100 Y60 Z0\", or \"around\" for the box around the cutting moves: {around}"
        )),
    }
}

/// Words by which a comment speaks of the blank.
const BLANK_WORDS: [&str; 4] = ["STOCK", "BLANK", "MATERIAL", "WORKPIECE"];

fn of_blank(comment: &Comment) -> bool {
    BLANK_WORDS.iter().any(|word| comment.text.contains(word))
}

fn sound(min: Vec3, max: Vec3) -> bool {
    (max - min).iter().all(|side| *side > 0.0)
}

/// `STOCK X0 Y0 Z-20 X100 Y60 Z0`, with or without `=` and a word between.
fn two_corners(comments: &[Comment]) -> Option<(Vec3, Vec3, u32)> {
    comments.iter().filter(|comment| of_blank(comment)).find_map(|comment| {
        let [a, b] = triplets(&comment.text)[..] else { return None };
        sound(a.inf(&b), a.sup(&b)).then_some((a.inf(&b), a.sup(&b), comment.line))
    })
}

/// `STOCK MIN X0 Y0 Z-20` and `STOCK MAX X100 Y60 Z0` in two comments (also LOWER and UPPER, LOW and HIGH).
fn least_and_greatest(comments: &[Comment]) -> Option<(Vec3, Vec3, u32)> {
    let corner = |words: [&str; 2]| {
        let of = |comment: &&Comment| of_blank(comment) && words.iter().any(|word| comment.text.contains(word));
        comments.iter().filter(of).find_map(|comment| match triplets(&comment.text)[..] {
            [corner] => Some((corner, comment.line)),
            _ => None,
        })
    };
    let (min, line) = corner(["MIN", "LOW"])?;
    let (max, _) = corner(["MAX", "UPPER"]).or_else(|| corner(["HIGH", "TOP"]))?;
    sound(min, max).then_some((min, max, line))
}

/// Vectric's header: `MATERIAL SIZE`, `X= 600, Y= 400, Z= 18`, `Z ORIGIN FOR MATERIAL = MATERIAL SURFACE`, `XY ORIGIN FOR MATERIAL =
/// BOTTOM LEFT CORNER`. Without its origin a size says nothing.
fn size_and_origin(comments: &[Comment]) -> Option<(Vec3, Vec3, u32)> {
    let at = comments.iter().position(|comment| comment.text.contains("MATERIAL SIZE"))?;
    let near = &comments[at..comments.len().min(at + 6)];
    let [size] = near.iter().find_map(|c| <[Vec3; 1]>::try_from(triplets(&c.text)).ok())?;
    let origin = |axis: &str| {
        let of = |comment: &&Comment| comment.text.starts_with(axis) && comment.text.contains("ORIGIN");
        comments.iter().find(of).map(|comment| comment.text.as_str())
    };
    let (height, corner) = (origin("Z ORIGIN")?, origin("XY ORIGIN")?);
    let low_z = match () {
        () if height.contains("SURFACE") && height.contains("MATERIAL SURFACE") => -size.z,
        () if height.contains("TABLE") || height.contains("BED") => 0.0,
        () => return None,
    };
    let share = |low: &str, high: &str| match corner {
        text if text.contains(low) => Some(0.0),
        text if text.contains(high) => Some(-1.0),
        text if text.contains("CENT") => Some(-0.5),
        _ => None,
    };
    let min = Vec3::new(share("LEFT", "RIGHT")? * size.x, share("BOTTOM", "TOP")? * size.y, low_z);
    sound(min, min + size).then_some((min, min + size, comments[at].line))
}

/// Points `X… Y… Z…` of a text, each axis once before the next begins.
fn triplets(text: &str) -> Vec<Vec3> {
    let mut points = Vec::new();
    let mut point: [Option<f64>; 3] = [None; 3];
    let bytes = text.as_bytes();
    for (at, byte) in bytes.iter().enumerate() {
        let Some(axis) = b"XYZ".iter().position(|name| name == byte) else { continue };
        if at > 0 && bytes[at - 1].is_ascii_alphabetic() {
            continue;
        }
        let rest = text[at + 1..].trim_start_matches([' ', '=', ':', '+']);
        let end = rest.find(|c: char| !c.is_ascii_digit() && !".-".contains(c)).unwrap_or(rest.len());
        let Ok(value) = rest[..end].trim_end_matches('.').parse::<f64>() else { continue };
        point[axis] = Some(value);
        if let [Some(x), Some(y), Some(z)] = point {
            points.push(Vec3::new(x, y, z));
            point = [None; 3];
        }
    }
    points
}

/// `STOCK/BLOCK,x,y,z,ox,oy,oz`: size, and the program's zero measured from the lowest corner.
fn apt_block(text: &str) -> Option<(Vec3, Vec3)> {
    let list = text.strip_prefix("STOCK/BLOCK")?;
    let n: Vec<f64> = list.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    let [x, y, z, ox, oy, oz] = n[..] else { return None };
    let min = Vec3::new(-ox, -oy, -oz);
    Some((min, min + Vec3::new(x, y, z)))
}

/// `BLK FORM 0.1 Z X+0 Y+0 Z-20` and `BLK FORM 0.2 X+100 Y+60 Z+0` of plain language: lowest and highest corner; `IX` counts
/// from the first (TNC 640, Klartext Programming, Define the blank).
fn blank_form(program: &Program) -> Option<(Vec3, Vec3)> {
    let mut corners: [[Option<f64>; 3]; 2] = [[None; 3]; 2];
    for block in program.blocks().take(200).filter(|_| program.dialect().syntax() == Syntax::Heidenhain) {
        let line = program.line_text(block).to_ascii_uppercase();
        let Some(at) = memchr::memmem::find(&line, b"BLK FORM 0.") else { continue };
        let which = usize::from(line.get(at + 11) == Some(&b'2'));
        for token in program.tokens(block) {
            let TokenKind::Word(letter) = token.kind else { continue };
            if let Some(axis) = b"XYZ".iter().position(|axis| *axis == letter & 0x7f) {
                let from = if letter >= 0x80 { corners[0][axis].unwrap_or(0.0) } else { 0.0 };
                corners[which][axis] = Some(from + token.number);
            }
        }
    }
    let corner = |which: usize| {
        let [Some(x), Some(y), Some(z)] = corners[which] else { return None };
        Some(Vec3::new(x, y, z))
    };
    let (min, max) = (corner(0)?, corner(1)?);
    let sound = (max - min).iter().all(|side| *side > 0.0);
    sound.then_some((min, max))
}

/// `BLK FORM CYLINDER Z R50 L105 DIST+5` of plain language: about the tool axis through the datum, D or R its size, L its length,
/// DIST how far its upper face lies above the datum (TNC 640, Klartext Programming, Cylindrical blank). A bore (RI, DI) is
/// taken as full, which is said.
fn blank_cylinder(program: &Program) -> Option<Known> {
    let blocks = program.blocks().take(200).filter(|_| program.dialect().syntax() == Syntax::Heidenhain);
    let lines = blocks.map(|block| String::from_utf8_lossy(program.line_text(block)).to_ascii_uppercase());
    let form =
        lines.into_iter().find_map(|line| line.split_once("BLK FORM CYLINDER").map(|(_, form)| form.to_owned()))?;
    let words: Vec<&str> = form.split(';').next()?.split_whitespace().collect();
    let number = |name: &str| words.iter().find_map(|word| word.strip_prefix(name)?.parse::<f64>().ok());
    let diameter = number("D").or(number("R").map(|radius| 2.0 * radius)).filter(|size| *size > 0.0)?;
    let length = number("L").filter(|length| *length > 0.0)?;
    let top = number("DIST").unwrap_or(0.0);
    words.contains(&"Z").then_some(())?;
    let bored = number("RI").or(number("DI")).is_some();
    let source = if bored { "BLK FORM; its bore is taken as full" } else { "BLK FORM" };
    let (diameter, low, top) = (short(diameter), short(top - length), short(top));
    let line = format!("cylinder = {{ center = [0, 0], diameter = {diameter}, z = [{low}, {top}] }}");
    Some(Known::said(line, source))
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
