//! Tools, stock and material as far as the comments of a program tell them. In: the program and its motions. Out: a setup as
//! TOML text, either complete enough to run or to be finished by the user: what is missing is marked and listed.
//!
//! Recognised: `(T1 D=2 CR=0 - ZMIN=-5.9 - flat end mill)`, `(T2| 1/2 BULL ENDMILL 0.125 RAD|H0)`, `(T0 : 3.175)`,
//! `M6 T7 (TOOL DIA. 3)`, `T9 ;DRILL 10.2MM`, `(TOOL/MILL,10,1,20,0)`, `(STOCK/BLOCK,100,60,20,0,0,20)`,
//! `(MATERIAL: 6061)`.

use crate::nc::{MoveKind, Program, Syntax, TokenKind, Toolpath};
use crate::path::Vec3;
use crate::units::MM_PER_INCH;

/// In an inch program a bare number from here on is no diameter, inch: end mills and drills end at 3 in. (Machinery's Handbook,
/// 31st ed., tables of end mills and of straight-shank drills), and whether it is in mm is not guessed.
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
    /// What is concluded rather than said.
    guessed: Vec<&'static str>,
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
    text += &stock(program, &comments, path, &mut missing);
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

/// Words by which a comment describes a tool.
const TOOL_WORDS: [&str; 28] = [
    "MILL",
    "DRILL",
    "TAP ",
    "REAM",
    "PROBE",
    "CHAMFER",
    "CUTTER",
    "DIA",
    "BALL",
    "BULL",
    "FLAT",
    "SPOT",
    "V-BIT",
    "VBIT",
    "ENGRAV",
    "CORE",
    "COUNTERSINK",
    "BORING",
    "FLUTE",
    "BOHRER",
    "FRAESER",
    "FR\u{c4}SER",
    "FR\u{e4}SER",
    "FR\u{c3}",
    "KUGEL",
    "SENKER",
    "NOSE",
    " EM",
];

/// Tool number and description, when a comment describes a tool.
fn tool_comment(comment: &Comment) -> Option<(u32, String)> {
    let text = comment.text.as_str();
    let described = TOOL_WORDS.iter().any(|word| text.contains(word));
    if let Some((number, rest)) = numbered(text) {
        let bare = rest.trim_start_matches([' ', ':', '=', '|', '-']).parse::<f64>().is_ok();
        if described || bare || rest.trim_start().starts_with("D=") {
            return Some((number, rest.trim_start().trim_start_matches(['|', ':', '-', ',', ' ']).to_owned()));
        }
    }
    let named = text.starts_with("TOOL:") || text.starts_with("TOOL DIA") || text.starts_with("TOOL/");
    (described && (named || comment.same_line)).then(|| comment.tool.map(|number| (number, text.to_owned())))?
}

/// `T1 …`, `TOOL #1 …`, `TOOL 1: …`, `TOOL NUMBER: 1 …`, or `… TOOL - 1 DIA. OFF. …`: the number, and what describes the tool.
fn numbered(text: &str) -> Option<(u32, String)> {
    for name in ["TOOL NUMBER", "TOOL NO", "TOOL", "NO", "T"] {
        let Some(rest) = text.strip_prefix(name) else { continue };
        let rest = rest.trim_start_matches([' ', ':', '#', '-', '.', '=']);
        if let (Some(number), rest) = split_number(rest)
            && !rest.starts_with(['.', '/', 'M'])
        {
            return Some((number, rest.to_owned()));
        }
    }
    let at = text.find("TOOL - ")?;
    let (number, _) = split_number(text[at + 7..].trim_start());
    number.map(|number| (number, text.to_owned()))
}

fn split_number(text: &str) -> (Option<u32>, &str) {
    let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    (text[..end].parse().ok(), &text[end..])
}

/// What a number in a description is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Role {
    /// A diameter by its name.
    Diameter,
    /// A corner radius.
    Corner,
    /// An angle, deg.
    Angle,
    Flutes,
    /// A size without a name.
    Size,
    /// A number, a length, a pitch …
    Other,
}

/// A number of a description.
#[derive(Debug, Clone, Copy)]
struct Figure {
    role: Role,
    value: f64,
    /// In mm (true) or inch (false), where that is written.
    metric: Option<bool>,
    fraction: bool,
    /// Its name is more than a D, which may be the number of an offset.
    spelt: bool,
}

/// Words before a number that say what it is.
fn role_before(word: &str) -> Option<Role> {
    match word {
        "D" | "DIA" | "DIAM" | "DIAMETER" | "\u{d8}" => Some(Role::Diameter),
        "CR" | "R" | "RAD" | "RADIUS" => Some(Role::Corner),
        "TAPER" | "ANGLE" | "POINT" | "TIP" => Some(Role::Angle),
        "FLUTES" | "FLUTE" | "FL" | "Z" => Some(Role::Flutes),
        "ID" | "H" | "L" | "T" | "TOOL" | "NO" | "NUMBER" | "LEN" | "LENGTH" | "LOC" | "OAL" | "ZMIN" | "ZMAX"
        | "OFF" | "OFFSET" | "PITCH" | "P" | "X" | "TPI" | "S" | "F" | "SPEED" | "FEED" | "RPM" | "LEAVE" | "TOL"
        | "HOLDER" | "STICKOUT" | "OP" | "JOB" | "POCKET" | "REV" | "LAYER" | "UNC" | "UNF" | "SFM" | "CORNER" => {
            Some(Role::Other)
        }
        _ => None,
    }
}

/// Words behind a number (and its unit) that say what it is.
fn role_after(word: &str) -> Option<Role> {
    match word {
        "DIA" | "DIAM" | "DIAMETER" => Some(Role::Diameter),
        "RAD" | "RADIUS" | "CR" => Some(Role::Corner),
        "DEG" | "DEGREE" | "DEGREES" | "\u{b0}" => Some(Role::Angle),
        "FLUTES" | "FLUTE" | "FLTS" | "FLT" | "FL" => Some(Role::Flutes),
        "TPI" | "LONG" | "LOC" | "OAL" | "PITCH" | "XD" | "RPM" | "DEEP" | "UNC" | "UNF" | "LENGTH" | "REACH"
        | "HOLE" | "HOLES" => Some(Role::Other),
        _ => None,
    }
}

/// The numbers of a description with what they are.
fn figures(text: &str) -> Vec<Figure> {
    let chars: Vec<char> = text.chars().collect();
    let mut found = Vec::new();
    let (mut at, mut label, mut hash) = (0, String::new(), false);
    while at < chars.len() {
        let c = chars[at];
        let digit = |at: usize| chars.get(at).is_some_and(char::is_ascii_digit);
        if c.is_alphabetic() {
            label.clear();
            while let Some(c) = chars.get(at).filter(|c| c.is_alphabetic()) {
                label.push(*c);
                at += 1;
            }
            hash = false;
        } else if digit(at) || c == '.' && digit(at + 1) {
            let (value, fraction, end) = size(&chars, at);
            let (metric, after) = unit(&chars, end);
            let (word, _) = word_at(&chars, after);
            let degrees = chars.get(end) == Some(&'\u{b0}');
            let thread = label == "M" && chars.get(end) == Some(&'X')
                || fraction && chars.get(end) == Some(&'-') && digit(end + 1);
            let role = if hash || thread {
                Role::Other
            } else if degrees {
                Role::Angle
            } else {
                // Flutes and angles are named behind the number, the rest before it or, where nothing stands there, behind it.
                let before = role_before(&label).filter(|_| !(label == "TOOL" && (fraction || metric.is_some())));
                match role_after(&word) {
                    Some(role @ (Role::Flutes | Role::Angle)) => role,
                    after => before.or(after).unwrap_or(Role::Size),
                }
            };
            found.push(Figure { role, value, metric, fraction, spelt: label != "D" });
            if thread {
                // The pitch or the threads an inch behind a thread's name.
                let (_, _, next) = size(&chars, end + 1);
                at = next.max(end + 1);
            } else {
                at = end;
            }
            (label, hash) = (String::new(), false);
        } else {
            hash = c == '#';
            if matches!(c, ',' | ';' | '|' | '{' | '(') {
                label.clear();
            }
            at += 1;
        }
    }
    found
}

/// `3/4`, `1-1/2`, `10.2`, `.5` at a place: value, whether it is a fraction, and where it ends.
fn size(chars: &[char], at: usize) -> (f64, bool, usize) {
    let digits = |from: usize| from + chars[from.min(chars.len())..].iter().take_while(|c| c.is_ascii_digit()).count();
    let whole = |from: usize, to: usize| chars[from..to].iter().collect::<String>().parse::<f64>().unwrap_or(0.0);
    let over = digits(at);
    let fraction = |from: usize, end: usize| {
        let under = digits(end + 1);
        let is = end > from && chars.get(end) == Some(&'/') && under > end + 1 && whole(end + 1, under) > 0.0;
        is.then(|| (whole(from, end) / whole(end + 1, under), under))
    };
    if let Some((value, end)) = fraction(at, over) {
        return (value, true, end);
    }
    if chars.get(over) == Some(&'-')
        && let Some((part, end)) = fraction(over + 1, digits(over + 1))
    {
        return (whole(at, over) + part, true, end);
    }
    let end = if chars.get(over) == Some(&'.') { digits(over + 1) } else { over };
    (whole(at, end), false, end)
}

/// The unit behind a number, and where what follows it begins.
fn unit(chars: &[char], at: usize) -> (Option<bool>, usize) {
    let (word, end) = word_at(chars, at);
    match word.as_str() {
        "MM" => (Some(true), end),
        "IN" | "INCH" | "INCHES" => (Some(false), end),
        _ if chars.get(at) == Some(&'"') => (Some(false), at + 1),
        _ => (None, at),
    }
}

/// The word behind blanks and one hyphen, and its end.
fn word_at(chars: &[char], at: usize) -> (String, usize) {
    let begin = at + chars[at.min(chars.len())..].iter().take_while(|c| matches!(c, ' ' | '-')).count();
    let word: String = chars[begin.min(chars.len())..].iter().take_while(|c| c.is_alphabetic()).collect();
    let end = begin + word.chars().count();
    (word, end)
}

/// The sizes of a tool in the program's unit. A number that says its unit is converted; a fraction is in inches, as no metric
/// tool is sold by one. Nothing else is guessed: a bare number is in the program's unit, and one that no inch tool has is none.
fn told(number: u32, text: &str, inch: bool) -> Told {
    let mut told = Told { number, comment: text.trim().to_owned(), ..Told::default() };
    let mut figures = figures(text);
    if let Some(list) = text.strip_prefix("TOOL/MILL") {
        let sizes: Vec<f64> = list.split(',').filter_map(|part| part.trim().parse().ok()).collect();
        told.diameter = sizes.first().copied();
        told.corner = sizes.get(1).copied();
        figures.clear();
    }
    let thread_mill = text.contains("THREAD");
    let diameters = || figures.iter().filter(|figure| figure.role == Role::Diameter);
    let named = diameters().find(|figure| figure.spelt).or(diameters().next());
    let sized = || {
        let sizes = || figures.iter().filter(|figure| figure.role == Role::Size && !thread_mill);
        sizes().find(|figure| figure.metric.is_some() || figure.fraction).or(sizes().next())
    };
    // `DIA-0.5000 1/2 ENDMILL`: the fraction says that the number is in inches.
    let in_inches = |figure: &Figure| figures.iter().any(|other| other.fraction && other.value == figure.value);
    let metric = |figure: &Figure| figure.metric.or((figure.fraction || in_inches(figure)).then_some(false));
    let length = |figure: &Figure| match (metric(figure), inch) {
        (Some(true), true) => Some(figure.value / MM_PER_INCH),
        (Some(false), false) => Some(figure.value * MM_PER_INCH),
        (None, true) if figure.value >= LARGEST_INCH => None,
        _ => Some(figure.value),
    };
    if let Some(figure) = named.or_else(sized) {
        told.diameter = length(figure).filter(|diameter| *diameter > 0.0);
        if figure.role == Role::Size && metric(figure).is_none() {
            told.guessed.push("diameter");
        }
    }
    let first = |role| figures.iter().find(move |figure| figure.role == role);
    told.corner = told.corner.or(first(Role::Corner).and_then(length));
    told.point_deg = first(Role::Angle).map(|figure| figure.value).filter(|angle| (0.0..180.0).contains(angle));
    told.flutes = first(Role::Flutes).map(|figure| figure.value as u32).filter(|count| (1..100).contains(count));
    told.shape = shape(text, &told);
    if told.shape.is_some() && !TOOL_WORDS.iter().any(|word| text.contains(word)) && !text.starts_with("TOOL/") {
        told.guessed.push("shape");
    }
    told
}

fn shape(text: &str, told: &Told) -> Option<&'static str> {
    const WORDS: [(&str, &str); 31] = [
        ("PROBE", "probe"),
        ("REAM", "reamer"),
        ("SPOT", "chamfer"),
        ("CHAMFER", "chamfer"),
        ("COUNTERSINK", "chamfer"),
        ("SENKER", "chamfer"),
        ("V-BIT", "chamfer"),
        ("VBIT", "chamfer"),
        ("ENGRAV", "chamfer"),
        ("SLOT DRILL", "flat"),
        ("CENTER DRILL", "drill"),
        ("DRILL", "drill"),
        ("BOHRER", "drill"),
        ("TAPPING", "tap"),
        ("RIGHT HAND TAP", "tap"),
        (" TAP ", "tap"),
        ("TAP ", "tap"),
        ("BALL", "ball"),
        ("KUGEL", "ball"),
        ("BULL", "bull"),
        ("FACE MILL", "face"),
        ("FACEMILL", "face"),
        ("SHELL MILL", "face"),
        ("FLAT", "flat"),
        ("END MILL", "flat"),
        ("ENDMILL", "flat"),
        ("FRAESER", "flat"),
        ("FR\u{c4}SER", "flat"),
        ("FR\u{e4}SER", "flat"),
        ("FR\u{c3}", "flat"),
        (" EM", "flat"),
    ];
    if text.contains("THREAD") && text.contains("MILL") {
        return None;
    }
    let by_word =
        WORDS.iter().find(|(word, _)| text.contains(word) || text.ends_with(word.trim_end())).map(|(_, shape)| *shape);
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
            Some(value) if told.guessed.contains(&key) => format!("{key} = {value}  # <- guessed from the comment\n"),
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
            // A chamfer mill is described by the angle of its side (TAPER=45DEG), a spot drill and a V-bit by that of their point.
            let side = told.shape == Some("chamfer") && told.comment.contains("TAPER") && angle <= 60.0;
            let full = if side { 2.0 * angle } else { angle };
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

fn stock(program: &Program, comments: &[Comment], path: &Toolpath, missing: &mut Vec<String>) -> String {
    let told = comments.iter().find_map(|comment| apt_block(&comment.text));
    if let Some((min, max)) = told.or_else(|| blank_form(program)) {
        return box_line(min, max) + "\n";
    }
    if let Some(line) = blank_cylinder(program) {
        return line;
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
fn blank_cylinder(program: &Program) -> Option<String> {
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
    let bored = if number("RI").or(number("DI")).is_some() { "  # <- guess: its bore is taken as full" } else { "" };
    let (diameter, low, top) = (rounded(diameter), rounded(top - length), rounded(top));
    Some(format!("cylinder = {{ center = [0, 0], diameter = {diameter}, z = [{low}, {top}] }}{bored}\n"))
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
        // Whether 6 is in mm is not guessed: the diameter is asked for.
        assert_eq!(of("(T5|   6. FLAT ENDMILL|H0)", true).diameter, None);
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

    /// A line of a header; is the program in inches; number, shape and diameter that it tells.
    type Header = (&'static str, bool, u32, Option<&'static str>, Option<f64>);

    /// Lines in the styles of many posts, with the right answer; `None`: the line does not tell it.
    const HEADERS: [Header; 52] = [
        // Fusion 360, HSMWorks
        ("(T1 D=8. CR=0. - ZMIN=-4.5 - FLAT END MILL)", false, 1, Some("flat"), Some(8.0)),
        ("(T5  D=6. CR=3. - ZMIN=-3.1 - BALL END MILL)", false, 5, Some("ball"), Some(6.0)),
        ("(T6 D=12. CR=1.5 - ZMIN=-9. - BULLNOSE END MILL)", false, 6, Some("bull"), Some(12.0)),
        ("(T9 D=8.5 CR=0. TAPER=118DEG - ZMIN=-21. - DRILL)", false, 9, Some("drill"), Some(8.5)),
        ("(T12 D=10. CR=0. TAPER=45DEG - ZMIN=-1. - CHAMFER MILL)", false, 12, Some("chamfer"), Some(10.0)),
        ("(T14 D=6. CR=0. TAPER=90DEG - ZMIN=-2. - SPOT DRILL)", false, 14, Some("chamfer"), Some(6.0)),
        ("(T2 D=0.375 CR=0. - ZMIN=-0.5 - FLAT END MILL)", true, 2, Some("flat"), Some(0.375)),
        ("(T7 D=63. CR=0. - ZMIN=-1. - FACE MILL)", false, 7, Some("face"), Some(63.0)),
        ("(T8 D=5. CR=0. - ZMIN=-14. - RIGHT HAND TAP)", false, 8, Some("tap"), Some(5.0)),
        // Mastercam
        ("(T1| 3/8 FLAT ENDMILL|H1)", true, 1, Some("flat"), Some(0.375)),
        ("( T4 | 10. FLAT ENDMILL | H4 | D4 | TOOL DIA. - 10. )", false, 4, Some("flat"), Some(10.0)),
        ("(1/2 FLAT ENDMILL TOOL - 3 DIA. OFF. - 43 LEN. - 3 DIA. - .5)", true, 3, Some("flat"), Some(0.5)),
        ("(T2| 1/2 BULL ENDMILL 0.06 RAD|H2)", true, 2, Some("bull"), Some(0.5)),
        ("(T11|NO. 7 DRILL|H11)", true, 11, Some("drill"), None),
        ("(T13| 1/4-20 TAPRH|H13)", true, 13, None, None),
        // SolidCAM, BobCAD, SurfCAM
        ("(TOOL NUMBER: 4 - DIAMETER: 12.0 - END MILL)", false, 4, Some("flat"), Some(12.0)),
        ("(T3 END MILL D16 R0)", false, 3, Some("flat"), Some(16.0)),
        ("(TOOL #2 0.2500 1/4 DRILL)", true, 2, Some("drill"), Some(0.25)),
        ("(TOOL #1 0.5 ENDMILL ROUGH)", true, 1, Some("flat"), Some(0.5)),
        ("(T02 ID=002 DIA-0.5000 1/2 ENDMILL)", true, 2, Some("flat"), Some(0.5)),
        ("(T13 ID=013 3MM DRILL)", true, 13, Some("drill"), Some(3.0 / 25.4)),
        ("(T13 ID=013 3MM DRILL)", false, 13, Some("drill"), Some(3.0)),
        ("(T02 ID=002 DIA-0.5000 1/2 ENDMILL)", false, 2, Some("flat"), Some(12.7)),
        // VCarve, Aspire
        ("(TOOL 1: END MILL {6 MM})", false, 1, Some("flat"), Some(6.0)),
        ("(TOOL 2: BALL NOSE {3.175 MM})", false, 2, Some("ball"), Some(3.175)),
        ("(TOOL 3: V-BIT {60 DEG 12.7 MM})", false, 3, Some("chamfer"), Some(12.7)),
        ("(TOOL 1: END MILL {1/4 INCH})", true, 1, Some("flat"), Some(0.25)),
        ("(T3 V-BIT 90 DEG 1/2\")", true, 3, Some("chamfer"), Some(0.5)),
        // FreeCAD, CamBam, Estlcam, MeshCAM, Carveco
        ("(TOOL 5: 5MM ENDMILL)", false, 5, Some("flat"), Some(5.0)),
        ("(T1 - 6MM ENDMILL 2 FLUTES)", false, 1, Some("flat"), Some(6.0)),
        ("( T0 : 3.175 )", false, 0, Some("flat"), Some(3.175)),
        ("( T2 : 6.0 )", false, 2, Some("flat"), Some(6.0)),
        ("(T2 = BOHRER 3.0MM)", false, 2, Some("drill"), Some(3.0)),
        ("(T1 = FRAESER 6MM)", false, 1, Some("flat"), Some(6.0)),
        ("(NO. 1: FR\u{c4}SER 3MM)", false, 1, Some("flat"), Some(3.0)),
        ("(TOOL #1: 1/8 BALL MILL)", true, 1, Some("ball"), Some(0.125)),
        ("(TOOL NUMBER:1, END MILL 6 MM)", false, 1, Some("flat"), Some(6.0)),
        ("(T1 END MILL 3.0 MM)", true, 1, Some("flat"), Some(3.0 / 25.4)),
        // NX, hyperMILL, PowerMill
        ("(T1 : D10R0 FLAT)", false, 1, Some("flat"), Some(10.0)),
        ("(TOOL 12: BALL D6 R3)", false, 12, Some("ball"), Some(6.0)),
        ("(T4 D=20 R=2 BULL NOSE MILL)", false, 4, Some("bull"), Some(20.0)),
        ("(T5 DIA 8.0 DRILL POINT 140)", false, 5, Some("drill"), Some(8.0)),
        ("(T7 = 16MM DIA CARBIDE END MILL, 4 FL)", false, 7, Some("flat"), Some(16.0)),
        // by hand
        ("(T1 10 MM CARBIDE END MILL, 3 FLUTES)", false, 1, Some("flat"), Some(10.0)),
        ("(T2 2\" FACE MILL)", true, 2, Some("face"), Some(2.0)),
        ("(T3 .250 DIA 4 FLUTE ENDMILL 1.0 LOC)", true, 3, Some("flat"), Some(0.25)),
        ("(T4 90 DEG SPOT DRILL 10MM)", false, 4, Some("chamfer"), Some(10.0)),
        ("(T6 M6X1.0 TAP )", false, 6, Some("tap"), None),
        ("(T8 THREAD MILL D9.9 PITCH 1.5)", false, 8, None, Some(9.9)),
        ("(T8 THREADMILL M10 X 1.5)", false, 8, None, None),
        ("(T5| 6. FLAT ENDMILL|H5)", true, 5, Some("flat"), None),
        ("(T10 SLOT DRILL 6MM 2 FLUTE 13 LONG)", false, 10, Some("flat"), Some(6.0)),
    ];

    /// At least 90 % of what the lines tell is read, and nothing wrong: what is not read is asked for.
    #[test]
    fn headers_of_many_posts_are_read() {
        let (mut told_so, mut read) = (0, 0);
        let mut wrong = Vec::new();
        for (line, inch, number, shape, diameter) in HEADERS {
            let comment = Comment { text: inner(line), tool: None, same_line: false };
            let found = tool_comment(&comment).map(|(number, text)| told(number, &text, inch)).unwrap_or_default();
            told_so += usize::from(shape.is_some()) + usize::from(diameter.is_some());
            let same = |a: f64| diameter.is_some_and(|b| (a - b).abs() < 1e-4);
            read += usize::from(found.shape.is_some() && found.shape == shape);
            read += usize::from(found.diameter.is_some_and(same));
            let other = found.shape.is_some_and(|own| Some(own) != shape)
                || found.diameter.is_some_and(|own| !same(own))
                || found != Told::default() && found.number != number;
            if other {
                wrong.push(format!("{line}: {found:?}"));
            }
            println!("{} {line}: {:?} {:?}", if inch { "inch" } else { "mm  " }, found.shape, found.diameter);
        }
        println!("{read} of {told_so} read");
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        assert!(read * 10 >= told_so * 9, "{read} of {told_so}");
    }

    #[test]
    fn points_flutes_and_guesses_are_told_apart() {
        let point = |line: &str| {
            let text = format!("{line}\nT1 M6\nG1 X10 Z-1 F500\n");
            let program = crate::nc::parse(text.into(), None);
            let path = crate::nc::interpret(&program, &crate::nc::Environment::default());
            sketch(&program, &path, &["aluminium-6061-t6"]).text
        };
        assert!(point("(T1 D=6. CR=0. TAPER=90DEG - ZMIN=-2. - SPOT DRILL)").contains("point_angle = 90\n"));
        assert!(point("(T1 D=10. CR=0. TAPER=45DEG - ZMIN=-1. - CHAMFER MILL)").contains("point_angle = 90\n"));
        assert!(point("(T1 D=8. CR=0. TAPER=118DEG - ZMIN=-1. - DRILL)").contains("point_angle = 118\n"));
        assert!(point("( T1 : 6.0 )").contains("diameter = 6  # <- guessed"));
        assert!(!point("(T1 10 MM CARBIDE END MILL, 3 FLUTES)").contains("diameter = 10  # <- guessed"));
        assert_eq!(of("(T1 10 MM CARBIDE END MILL, 3 FLUTES)", false).flutes, Some(3));
    }

    #[test]
    fn the_blank_of_plain_language_is_the_stock() {
        let text = "0 BEGIN PGM T MM\n1 BLK FORM 0.1 Z X-10 Y+0 Z-20\n2 BLK FORM 0.2 IX+100 Y+60 Z+0\n3 TOOL CALL 1 Z S3000\n\
            4 L X+5 R0 F500\n5 END PGM T MM\n";
        let program = crate::nc::parse(text.into(), None);
        let path = crate::nc::interpret(&program, &crate::nc::Environment::default());
        let text = sketch(&program, &path, &["aluminium-6061-t6"]).text;
        assert!(text.contains("box = { min = [-10, 0, -20], max = [90, 60, 0] }\n"), "{text}");
    }

    #[test]
    fn the_round_blank_of_plain_language_is_the_stock() {
        for (form, expected) in [
            ("BLK FORM CYLINDER Z R50 L105 DIST+5", "diameter = 100, z = [-100, 5] }\n"),
            ("BLK FORM CYLINDER Z D80 L30", "diameter = 80, z = [-30, 0] }\n"),
            ("BLK FORM CYLINDER Z D80 L30 DI20 ; RING", "z = [-30, 0] }  # <- guess: its bore is taken as full\n"),
            ("BLK FORM CYLINDER X D80 L30", "# <- guessed from the feed moves"),
            ("BLK FORM CYLINDER Z D80", "# <- guessed from the feed moves"),
        ] {
            let text = format!("0 BEGIN PGM T MM\n1 {form}\n2 TOOL CALL 1 Z S3000\n3 L X+5 R0 F500\n4 END PGM T MM\n");
            let program = crate::nc::parse(text.into(), None);
            let path = crate::nc::interpret(&program, &crate::nc::Environment::default());
            let text = sketch(&program, &path, &["aluminium-6061-t6"]).text;
            assert!(text.contains(expected), "{form}: {text}");
        }
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
