//! Recognises the control that a program is written for. In: its bytes. Out: the dialect it is read in, the control it was recognised as,
//! and, where the text is not certain, which others it could be.
//!
//! Only code counts, comments do not. Each sign of the table counts once, with a weight for every control whose manual has it: 3 for grammar
//! that no other family reads, 2 for a word of one family, 1 for a habit. A control is recognised from a total of [`RECOGNISED_AT`] on, so a
//! single odd word is not enough; where its lead over another control is below [`LEAD`], a diagnostic says so.

use std::collections::BTreeSet;

use super::dialect::{Dialect, Syntax};

/// Whose words a text is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Control {
    /// One of the dialects read here.
    Family(Dialect),
    /// Okuma OSP.
    Okuma,
    /// Fadal, format 1 and 2.
    Fadal,
    /// Mazak EIA/ISO.
    Mazak,
    /// WinCNC.
    WinCnc,
    /// Marlin, a printer's firmware that also drives routers.
    Marlin,
}

/// What was recognised.
#[derive(Debug, Clone, PartialEq)]
pub struct Recognised {
    /// Whose words they are.
    pub control: Control,
    /// What else they could be, the likeliest first; empty: there is no doubt.
    pub others: Vec<Dialect>,
    /// The signs that spoke for it.
    pub signs: Vec<&'static str>,
    /// The manuals of that control that have these signs, each once.
    pub sources: Vec<&'static str>,
}

impl Recognised {
    /// Why it was recognised: `G15 H, G56 H: see Okuma OSP-P200M Programming Manual`.
    pub fn why(&self) -> String {
        let signs = self.signs.join(", ");
        if self.sources.is_empty() { signs } else { format!("{signs}: see {}", self.sources.join("; ")) }
    }
}

/// Weight from which a control counts as recognised: one word of grammar of its own, or two of its words.
const RECOGNISED_AT: u32 = 3;
/// Lead over another reading from which there is no doubt: one word of the other family may be an oddity of the post.
const LEAD: u32 = 2;
/// Bytes looked at.
const HEAD_BYTES: usize = 1 << 16;

impl Control {
    /// The dialect it is read in.
    pub fn dialect(self) -> Dialect {
        match self {
            Control::Family(dialect) => dialect,
            Control::Marlin => Dialect::Grbl,
            Control::Okuma | Control::Fadal | Control::Mazak | Control::WinCnc => Dialect::Fanuc,
        }
    }
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Control::Family(dialect) => dialect.name(),
            Control::Okuma => "Okuma OSP",
            Control::Fadal => "Fadal",
            Control::Mazak => "Mazak EIA",
            Control::WinCnc => "WinCNC",
            Control::Marlin => "Marlin",
        }
    }
    /// Why it is not read, where its words mean other things than in every dialect that is.
    pub fn refusal(self) -> Option<&'static str> {
        match self {
            Control::Okuma => {
                Some("G15 H selects its work offset, G56 H takes in its tool length, G71 sets a return level")
            }
            Control::Fadal => Some(
                "E names its work offset, H alone takes in its tool length, and its subprograms stand before the program, which begins behind their M30",
            ),
            Control::WinCnc => {
                Some("it has a feed for each axis (F10 XY, F30 Z), and its L words change what G codes mean")
            }
            Control::Family(_) | Control::Mazak | Control::Marlin => None,
        }
    }
}

/// A line of code without its comments, in capitals.
struct Code {
    text: String,
    /// The same without the number of the block.
    bare: String,
    /// Letters with a number right behind them.
    words: Vec<(u8, String)>,
    /// Identifiers of several letters, digits included.
    names: Vec<String>,
}

impl Code {
    fn value(&self, letter: u8, text: &str) -> bool {
        let number = |text: &str| text.parse::<f64>().ok();
        self.words.iter().any(|word| word.0 == letter && number(&word.1) == number(text))
    }
    fn g(&self, codes: &[&str]) -> bool {
        codes.iter().any(|code| self.value(b'G', code))
    }
    fn m(&self, codes: &[&str]) -> bool {
        codes.iter().any(|code| self.value(b'M', code))
    }
    fn has(&self, letter: u8) -> bool {
        self.words.iter().any(|word| word.0 == letter)
    }
    fn name(&self, names: &[&str]) -> bool {
        self.names.iter().any(|own| names.contains(&own.as_str()))
    }
    fn begins(&self, marks: &[&str]) -> bool {
        marks.iter().any(|mark| self.bare.starts_with(mark))
    }
    fn contains(&self, marks: &[&str]) -> bool {
        marks.iter().any(|mark| self.text.contains(mark))
    }
    /// The first identifier and whether an opening parenthesis stands behind it.
    fn call(&self, beginnings: &[&str]) -> bool {
        let name: String = self.bare.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
        beginnings.iter().any(|mark| name.starts_with(mark)) && self.bare[name.len()..].trim_start().starts_with('(')
    }
}

/// A sign: what it is, whose it is and how much it weighs, where that is written, and how it looks.
struct Sign {
    what: &'static str,
    speaks_for: &'static [(Control, u32)],
    /// Manual or documentation that has it.
    source: &'static str,
    found: fn(&Code) -> bool,
}

const GENERIC: Control = Control::Family(Dialect::Generic);
const FANUC: Control = Control::Family(Dialect::Fanuc);
const HAAS: Control = Control::Family(Dialect::Haas);
const LINUXCNC: Control = Control::Family(Dialect::LinuxCnc);
const GRBL: Control = Control::Family(Dialect::Grbl);
const SIEMENS: Control = Control::Family(Dialect::Siemens);
const HEIDENHAIN: Control = Control::Family(Dialect::Heidenhain);

const SIEMENS_BOOK: &str = "Siemens 840D sl/828D, Programming Manual Fundamentals and Job Planning";
const HEIDENHAIN_BOOK: &str = "Heidenhain TNC 640, Klartext Programming";
const FANUC_BOOK: &str = "Fanuc 0i-MD, User's Manual for machining centers, B-64304EN-2";
const HAAS_BOOK: &str = "Haas Mill Operator's Manual 96-8000, G and M codes";
const LINUXCNC_BOOK: &str = "LinuxCNC documentation, G-Code Reference and O Codes";
const OKUMA_BOOK: &str = "Okuma OSP-P200M Programming Manual";
const FADAL_BOOK: &str = "Fadal User Manual, Fixed Subroutines, Subroutines, Macros";
const MAZAK_BOOK: &str = "Mazak Mazatrol Matrix, Programming Manual EIA/ISO";
const WINCNC_BOOK: &str = "WinCNC User Guide, G and L codes";
const MARLIN_BOOK: &str = "marlinfw.org, G-code index";

macro_rules! sign {
    ($what:literal, [$(($whose:expr, $weight:literal)),+], $source:expr, $found:expr) => {
        Sign { what: $what, speaks_for: &[$(($whose, $weight)),+], source: $source, found: $found }
    };
}

const SIGNS: &[Sign] = &[
    sign!("BEGIN PGM", [(HEIDENHAIN, 3)], HEIDENHAIN_BOOK, |c| c.begins(&["BEGIN PGM", "END PGM"])),
    sign!("TOOL CALL", [(HEIDENHAIN, 3)], HEIDENHAIN_BOOK, |c| c.begins(&["TOOL CALL", "TOOL DEF"])),
    sign!("CYCL DEF", [(HEIDENHAIN, 3)], HEIDENHAIN_BOOK, |c| c.begins(&["CYCL DEF", "CYCL CALL", "BLK FORM"])),
    sign!("L X+", [(HEIDENHAIN, 2)], HEIDENHAIN_BOOK, |c| {
        c.begins(&["L X", "L Y", "L Z", "L IX", "L IY", "L IZ", "CC X", "CC Y", "CC IX", "LP PR", "CP IPA", "CP PA"])
    }),
    sign!("FMAX", [(HEIDENHAIN, 2)], HEIDENHAIN_BOOK, |c| c.name(&["FMAX", "FAUTO"])),
    sign!("LBL", [(HEIDENHAIN, 2)], HEIDENHAIN_BOOK, |c| c.begins(&["LBL ", "CALL LBL", "FN 0", "FN0", "FN 9"])),
    sign!("%_N_ or DEF", [(SIEMENS, 3)], SIEMENS_BOOK, |c| {
        c.begins(&["%_N_", "DEF REAL", "DEF INT", "DEF BOOL", "DEF STRING", "DEF AXIS", "PROC "])
    }),
    sign!("a cycle with arguments", [(SIEMENS, 3)], SIEMENS_BOOK, |c| {
        c.call(&["CYCLE", "POCKET", "SLOT", "HOLES", "LONGHOLE", "WORKPIECE", "MCALL", "GROUP_BEGIN"])
            || c.begins(&["MCALL"])
    }),
    sign!("MSG(", [(SIEMENS, 2)], SIEMENS_BOOK, |c| c.call(&["MSG", "EXTCALL", "STOPRE", "SETAL"])),
    sign!("GOTOF", [(SIEMENS, 2)], SIEMENS_BOOK, |c| c.name(&["GOTOF", "GOTOB", "GOTOC"])),
    sign!("CR=", [(SIEMENS, 2)], SIEMENS_BOOK, |c| c.contains(&["CR=", "TURN=", "SPOS=", "RND=", "RNDM=", "CHF="])),
    sign!("=AC(", [(SIEMENS, 2)], SIEMENS_BOOK, |c| c.contains(&["=AC(", "=IC(", "=DC("])),
    sign!("an axis with =", [(SIEMENS, 1), (Control::Okuma, 1)], SIEMENS_BOOK, |c| {
        c.contains(&["X=", "Y=", "Z=", "A3=", "B3=", "C3="]) && !c.contains(&["#"])
    }),
    sign!("R1=", [(SIEMENS, 2)], SIEMENS_BOOK, |c| {
        c.bare.strip_prefix('R').is_some_and(|rest| {
            let rest = rest.trim_start_matches(|digit: char| digit.is_ascii_digit());
            rest.len() + 1 < c.bare.len() && rest.trim_start().starts_with('=')
        })
    }),
    sign!("T=\"name\"", [(SIEMENS, 2)], SIEMENS_BOOK, |c| c.contains(&["T=\"", "T = \"", "T1=\""])),
    sign!("SUPA", [(SIEMENS, 2)], SIEMENS_BOOK, |c| c.name(&["SUPA", "CFTCP", "CFC", "CFIN", "D0SUPA"])),
    sign!("TRAORI", [(SIEMENS, 2)], SIEMENS_BOOK, |c| {
        c.name(&[
            "TRAORI", "TRAFOOF", "ORIAXES", "ORIWKS", "SOFT", "BRISK", "FFWON", "FFWOF", "COMPCAD", "COMPOF", "STOPRE",
        ])
    }),
    sign!("ROT or TRANS", [(SIEMENS, 2)], SIEMENS_BOOK, |c| {
        let first = c.names.first().filter(|name| c.bare.starts_with(name.as_str()));
        first.is_some_and(|name| {
            ["ROT", "AROT", "TRANS", "ATRANS", "AMIRROR", "MIRROR", "ASCALE"].contains(&name.as_str())
        })
    }),
    sign!("G710", [(SIEMENS, 2)], SIEMENS_BOOK, |c| {
        c.g(&["500", "505", "601", "602", "641", "642", "645", "700", "710", "153"])
    }),
    sign!("O-word flow", [(LINUXCNC, 3)], LINUXCNC_BOOK, |c| o_word(&c.text)),
    sign!("#<name>", [(LINUXCNC, 3)], LINUXCNC_BOOK, |c| c.contains(&["#<"])),
    sign!("G64 P", [(LINUXCNC, 3)], LINUXCNC_BOOK, |c| c.g(&["64"]) && c.has(b'P')),
    sign!("G33.1 or G10 L11", [(LINUXCNC, 2)], LINUXCNC_BOOK, |c| {
        c.g(&["33.1", "43.2", "5.2", "5.3"])
            || c.m(&["61", "62", "63", "64", "65", "66"]) && (c.has(b'Q') || c.has(b'P'))
    }),
    sign!("$ command", [(GRBL, 3)], "GRBL 1.1 documentation, Commands", |c| {
        c.text.strip_prefix('$').is_some_and(|rest| rest.len() < 12 && !rest.contains('%'))
    }),
    sign!("O1234", [(FANUC, 2), (HAAS, 1), (Control::Mazak, 1)], FANUC_BOOK, |c| program_number(&c.text) == 4),
    sign!("O12345", [(HAAS, 2), (FANUC, 1)], HAAS_BOOK, |c| program_number(&c.text) == 5),
    sign!("Macro B", [(FANUC, 3), (HAAS, 2)], FANUC_BOOK, |c| {
        c.contains(&["#"]) && (c.contains(&["GOTO", "WHILE["]) || c.name(&["WHILE", "DPRNT"])) && !o_word(&c.text)
    }),
    sign!("G5.1 Q1", [(FANUC, 2)], FANUC_BOOK, |c| c.g(&["5.1"]) && c.has(b'Q') || c.g(&["8"]) && c.has(b'P')),
    sign!("G187, G154, G103", [(HAAS, 2)], HAAS_BOOK, |c| {
        c.g(&["187"]) || c.g(&["154", "103"]) && c.has(b'P') || c.g(&["254", "255", "47"])
    }),
    sign!("M97 P", [(HAAS, 2)], HAAS_BOOK, |c| c.m(&["97"]) && c.has(b'P')),
    sign!("G12, G13, G150", [(HAAS, 2)], HAAS_BOOK, |c| c.g(&["12", "13", "150"]) && (c.has(b'I') || c.has(b'P'))),
    sign!("M88, M89", [(HAAS, 1)], HAAS_BOOK, |c| c.m(&["88", "89"])),
    sign!("G15 H", [(Control::Okuma, 2)], OKUMA_BOOK, |c| c.g(&["15"]) && c.has(b'H')),
    sign!("G56 H", [(Control::Okuma, 2)], OKUMA_BOOK, |c| c.g(&["56"]) && c.has(b'H')),
    sign!("CALL O", [(Control::Okuma, 3)], OKUMA_BOOK, |c| c.begins(&["CALL O", "MODIN ", "MODOUT", "RTS"])),
    sign!("VC1=", [(Control::Okuma, 2)], OKUMA_BOOK, |c| c.contains(&["VC1", "VC2", "VZOF", "VTOF", "NOEX"])),
    sign!("NCYL or M53", [(Control::Okuma, 2)], OKUMA_BOOK, |c| {
        c.name(&["NCYL"]) || c.g(&["71"]) && c.has(b'Z') && !c.has(b'X')
    }),
    sign!("$NAME.MIN%", [(Control::Okuma, 3)], OKUMA_BOOK, |c| c.text.starts_with('$') && c.contains(&[".MIN"])),
    sign!("# macro word", [(Control::Fadal, 3)], FADAL_BOOK, |c| {
        c.bare.strip_prefix('#').is_some_and(|rest| {
            ["CLEAR", "GOTO", "PRINT", "IF ", "R1", "V1", "SPRINT", "DIR", ":"]
                .iter()
                .any(|word| rest.trim_start().starts_with(word))
        })
    }),
    sign!("L subprogram", [(Control::Fadal, 2)], FADAL_BOOK, |c| {
        let digits = c.bare.strip_prefix('L').unwrap_or_default();
        c.words.len() <= 2 && digits.len() >= 3 && digits.bytes().all(|byte| byte.is_ascii_digit())
    }),
    sign!("M17 ends a subprogram", [(Control::Fadal, 1), (SIEMENS, 1)], FADAL_BOOK, |c| c.m(&["17"])
        && c.words.len() <= 2),
    sign!("S M3 E1 X Y", [(Control::Fadal, 3)], FADAL_BOOK, |c| {
        c.has(b'E') && c.has(b'X') && c.has(b'S') && c.m(&["3", "4"])
    }),
    sign!("E1 with X and Y", [(Control::Fadal, 2)], FADAL_BOOK, |c| {
        c.has(b'E') && c.has(b'X') && c.has(b'Y') && (c.g(&["0"]) || c.has(b'S'))
    }),
    sign!("T1 T2 M6", [(Control::Mazak, 2)], MAZAK_BOOK, |c| {
        c.m(&["6"]) && c.words.iter().filter(|word| word.0 == b'T').count() == 2
    }),
    sign!("G53.5, G5 P2", [(Control::Mazak, 2)], MAZAK_BOOK, |c| {
        c.g(&["53.5", "49.1", "54.4"])
            || c.g(&["5"]) && c.words.len() == 2 && (c.value(b'P', "2") || c.value(b'P', "0"))
    }),
    sign!("G61.1", [(Control::Mazak, 1), (LINUXCNC, 1)], MAZAK_BOOK, |c| c.g(&["61.1"])),
    sign!("F10 XY", [(Control::WinCnc, 3)], WINCNC_BOOK, |c| {
        let rest = c.bare.strip_prefix('F').unwrap_or_default();
        let axes = rest.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.').trim();
        axes.len() < rest.len() && !axes.is_empty() && axes.chars().all(|c| "XYZW".contains(c))
    }),
    sign!("L91, G53 L20", [(Control::WinCnc, 2)], WINCNC_BOOK, |c| {
        c.words.len() <= 5 && (c.begins(&["L91", "L92", "L90", "L210", "L212"]) || c.g(&["53"]) && c.value(b'L', "20"))
    }),
    sign!("M11C1", [(Control::WinCnc, 2)], WINCNC_BOOK, |c| c.m(&["11", "12", "13"])
        && c.has(b'C')
        && c.words.len() == 2),
    sign!("M104 S, M140 S", [(Control::Marlin, 3)], MARLIN_BOOK, |c| c.m(&["104", "109", "140", "190"]) && c.has(b'S')),
    sign!("M203 X, M92 X", [(Control::Marlin, 2)], MARLIN_BOOK, |c| {
        c.m(&["92", "201", "203", "205", "566"]) && c.words.iter().any(|word| b"XYZE".contains(&word.0))
    }),
    sign!("M204 S, M211 S", [(Control::Marlin, 2)], MARLIN_BOOK, |c| {
        c.m(&["204", "211", "420"]) && c.words.iter().any(|word| b"PRTS".contains(&word.0))
    }),
    sign!("M82, M84, M117, M400", [(Control::Marlin, 1)], MARLIN_BOOK, |c| {
        c.m(&["82", "83", "84", "117", "400", "106", "107"])
    }),
    sign!("G29", [(Control::Marlin, 1)], MARLIN_BOOK, |c| c.g(&["29"])),
];

/// The control that a text is recognised as although the setup names another dialect, if that control is one that cannot be read and the
/// dialect has none of those words. Siemens and plain language share some of these words; for them the named dialect counts.
pub fn foreign(text: &[u8], named: Dialect) -> Option<Recognised> {
    let found = recognise(text);
    (named.syntax() == Syntax::Rs274 && found.control.refusal().is_some()).then_some(found)
}

/// Recognises the control from the head of a program.
pub fn recognise(text: &[u8]) -> Recognised {
    let mut seen = vec![false; SIGNS.len()];
    for line in text[..text.len().min(HEAD_BYTES)].split(|&byte| byte == b'\n') {
        let code = code(line);
        if code.text.is_empty() {
            continue;
        }
        for (seen, sign) in seen.iter_mut().zip(SIGNS).filter(|(seen, _)| !**seen) {
            *seen = (sign.found)(&code);
        }
    }
    let found: Vec<&Sign> = SIGNS.iter().zip(seen).filter(|(_, seen)| *seen).map(|(sign, _)| sign).collect();
    weigh(&found)
}

fn weigh(found: &[&'static Sign]) -> Recognised {
    let mut scores: Vec<(Control, u32)> = Vec::new();
    for (whose, weight) in found.iter().flat_map(|sign| sign.speaks_for) {
        match scores.iter_mut().find(|score| score.0 == *whose) {
            Some(score) => score.1 += weight,
            None => scores.push((*whose, *weight)),
        }
    }
    scores.sort_by_key(|score| std::cmp::Reverse(score.1));
    let Some(&(best, most)) = scores.first() else {
        return Recognised { control: GENERIC, others: Vec::new(), signs: Vec::new(), sources: Vec::new() };
    };
    let near = |score: &&(Control, u32)| score.0 != best && score.1 + LEAD > most && !alike(best, score.0);
    let mut others: Vec<Dialect> = scores.iter().filter(near).map(|score| score.0.dialect()).collect();
    let plain = matches!(best, FANUC | HAAS) && most >= 2;
    let control = if most >= RECOGNISED_AT || plain { best } else { GENERIC };
    if control == GENERIC && !alike(best, GENERIC) {
        others.insert(0, best.dialect());
    }
    others.dedup();
    let own = |sign: &&&Sign| sign.speaks_for.iter().any(|(whose, _)| *whose == best);
    // The manual of a sign is that of the control it speaks for first.
    let first = |sign: &&&Sign| sign.speaks_for.first().is_some_and(|(whose, _)| *whose == best);
    let mut sources: Vec<&'static str> = found.iter().filter(first).map(|sign| sign.source).collect();
    let mut seen = BTreeSet::new();
    sources.retain(|source| seen.insert(*source));
    Recognised { control, others, signs: found.iter().filter(own).map(|sign| sign.what).collect(), sources }
}

/// Read alike as far as these signs go: ISO text of Fanuc's kin, or the same dialect.
fn alike(one: Control, other: Control) -> bool {
    let kin = |control| matches!(control, FANUC | HAAS | GENERIC | GRBL | Control::Mazak);
    one.dialect() == other.dialect() && one.refusal() == other.refusal() || kin(one) && kin(other)
}

/// A line without comments and strings, in capitals. A parenthesis right behind a name of several letters holds arguments.
fn code(line: &[u8]) -> Code {
    let mut text = String::new();
    let mut at = 0;
    while at < line.len() {
        match line[at] {
            b';' => break,
            b'(' if !behind_name(&text) => at += closing(&line[at..]),
            b'"' => {
                text.push('"');
                at += line[at + 1..].iter().position(|byte| *byte == b'"').map_or(line.len() - at, |end| end + 1);
                text.push('"');
            }
            byte if byte.is_ascii() && !byte.is_ascii_control() || byte == b'\t' => {
                text.push(char::from(byte).to_ascii_uppercase());
            }
            _ => {}
        }
        at += 1;
    }
    let text = text.trim().to_owned();
    if text.starts_with('*') || text.starts_with('%') && !text.starts_with("%_N_") {
        // A comment of plain language, the ends of a tape, a remark of Planet CNC.
        return Code { text: String::new(), bare: String::new(), words: Vec::new(), names: Vec::new() };
    }
    let number = text.strip_prefix('N').filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit())).unwrap_or(&text);
    let bare = number.trim_start_matches(|c: char| c.is_ascii_digit()).trim_start().to_owned();
    let (words, names) = split(&text);
    Code { text, bare, words, names }
}

fn behind_name(text: &str) -> bool {
    let name: String = text.chars().rev().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
    let name: Vec<char> = name.chars().rev().collect();
    matches!(name[..], [first, second, ..] if first.is_ascii_alphabetic() && (second.is_ascii_alphabetic() || second == '_'))
        || text.ends_with("=AC")
}

/// Bytes up to the parenthesis that closes the first one.
fn closing(rest: &[u8]) -> usize {
    let mut depth = 0_u32;
    for (at, byte) in rest.iter().enumerate() {
        match byte {
            b'(' => depth += 1,
            b')' if depth == 1 => return at,
            b')' => depth -= 1,
            _ => {}
        }
    }
    rest.len()
}

/// Words of one letter with their numbers, and names of several letters.
fn split(text: &str) -> (Vec<(u8, String)>, Vec<String>) {
    let (mut words, mut names) = (Vec::new(), Vec::new());
    let bytes = text.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        if !bytes[at].is_ascii_alphabetic() {
            at += 1;
            continue;
        }
        let letters = bytes[at..].iter().take_while(|byte| byte.is_ascii_alphabetic()).count();
        if letters > 1 {
            let length = bytes[at..].iter().take_while(|byte| byte.is_ascii_alphanumeric() || **byte == b'_').count();
            names.push(text[at..at + length].to_owned());
            at += length;
            continue;
        }
        let blank = bytes[at + 1..].iter().take_while(|byte| **byte == b' ').count();
        let from = at + 1 + blank;
        let number = bytes[from..].iter().take_while(|byte| byte.is_ascii_digit() || b"+-.".contains(byte)).count();
        if number > 0 {
            words.push((bytes[at], text[from..from + number].to_owned()));
        }
        at = from + number;
    }
    (words, names)
}

/// Digits of `O1234` or `:1234` at the head of a line; 0: there is none.
fn program_number(text: &str) -> usize {
    let rest = text.strip_prefix('O').or(text.strip_prefix(':')).unwrap_or_default();
    if o_word(text) { 0 } else { rest.bytes().take_while(u8::is_ascii_digit).count() }
}

/// `O100 SUB`, `O<NAME> CALL`: flow control of LinuxCNC.
fn o_word(text: &str) -> bool {
    let Some(rest) = text.strip_prefix('O') else { return false };
    let rest = match rest.strip_prefix('<') {
        Some(name) => name.split_once('>').map_or("", |(_, after)| after),
        None => rest.trim_start_matches(|c: char| c.is_ascii_digit()),
    };
    let keywords = ["SUB", "CALL", "WHILE", "REPEAT", "IF", "DO", "ENDSUB", "ENDWHILE", "ENDIF", "ENDREPEAT", "RETURN"];
    rest.len() < text.len() && keywords.iter().any(|word| rest.trim_start().starts_with(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Recognised {
        recognise(text.as_bytes())
    }

    #[test]
    fn every_sign_has_a_source_and_a_weight() {
        for sign in SIGNS {
            assert!(
                !sign.source.is_empty() && sign.speaks_for.iter().all(|(_, weight)| (1..=3).contains(weight)),
                "{}",
                sign.what
            );
        }
    }

    #[test]
    fn each_control_is_recognised_as_such() {
        let texts: [(&str, Control); 17] = [
            ("N1 O0001\nN2 M6 T1\nN3 G0 G90 S5000 M3 E1 X1. Y2.\nN4 H1 Z.1 M8\nN5 G1 Z-.1 F8.\n", Control::Fadal),
            ("%\nO1001\nG20\nG0 X0 Y0\n", FANUC),
            ("%\nO00101 (PART)\nG187 P2\nG0 G54 X0 Y0\n", HAAS),
            ("o100 sub\no100 endsub\n", LINUXCNC),
            ("G21\n#<depth> = 2\nG64 P0.01\n", LINUXCNC),
            ("$H\nG21\nG0 X1\n", GRBL),
            ("%_N_TEST_MPF\nG0 X=R1\n", SIEMENS),
            (
                "N10 G17 G90 G710\nN20 T=\"FRAESER_10_V\"\nN30 M6\nN40 CYCLE832(0.01,1,1)\nN50 TRAORI\nN60 G0 X10 Y0\n",
                SIEMENS,
            ),
            ("N10 G54 G64\nN20 T=\"BOHRER_8\" D1\nN30 ROT Z30\nN40 G1 X20 F400\n", SIEMENS),
            ("0 BEGIN PGM T MM\n1 L X+0\n", HEIDENHAIN),
            ("1 L X+10 Y+5 R0 FMAX\n2 CC X+0 Y+0\n3 L Z-2 F200\n", HEIDENHAIN),
            ("O100\nG15 H1\nG56 H1\nG0 X10 Y20\n", Control::Okuma),
            ("#CLEAR\nL100\nG91 X1.\nM17\nM30\nG0 X0 Y0\n", Control::Fadal),
            ("O2001\nT01 T02 M06\nG05 P2\nG0 X0 Y0\n", Control::Mazak),
            ("G90\nF10 XY\nF30 Z\nG1 X5 Y5\n", Control::WinCnc),
            ("M92 X100 Y100\nM203 X5000 Y5000\nM204 P500\nG1 X10 F300\n", Control::Marlin),
            ("G21\nG0 X0 Y0\nG1 X10 F100\n", GENERIC),
        ];
        for (text, control) in texts {
            let found = of(text);
            assert_eq!(found.control, control, "{text}: {found:?}");
            assert_eq!(found.others, [], "{text}: {found:?}");
        }
    }

    #[test]
    fn the_reason_names_signs_and_their_manuals() {
        assert_eq!(of("O100\nG15 H1\nG56 H1\nG0 X10 Y20\n").why(), format!("G15 H, G56 H: see {OKUMA_BOOK}"));
        let both = of("o100 sub\no100 endsub\n#<a>=1\nG61.1\n");
        assert_eq!(both.signs, ["O-word flow", "#<name>", "G61.1"]);
        assert_eq!(both.sources, [LINUXCNC_BOOK], "each manual once, and none of another control");
    }

    #[test]
    fn comments_never_speak() {
        let code = "G21\nG0 X0 Y0\nG1 X10 F100\n";
        for comment in [
            "HAAS VF2",
            "MACH3",
            "GRBL",
            "FANUC 0M",
            "Z=0.45+0.0722",
            "CYCLE81 X=5 CR=3",
            "BEGIN PGM T MM",
            "o100 sub",
            "#<name>",
            "G64 P0.1",
            "M104 S200",
            "F10 XY",
            "%_N_T_MPF",
        ] {
            for text in
                [format!("({comment})\n{code}"), format!("; {comment}\n{code}"), format!("G17 ({comment})\n{code}")]
            {
                assert_eq!(of(&text), of(code), "{text}");
            }
        }
    }

    #[test]
    fn one_odd_word_decides_nothing_and_is_said() {
        let odd = of("G21\nG0 X=5 Y0\nG1 X10 F100\n");
        assert_eq!((odd.control, odd.others.first()), (GENERIC, Some(&Dialect::Siemens)), "{odd:?}");
        let mixed = of("%\nO1234\nG0 X0\nCYCLE800(1,2)\n");
        assert!(!mixed.others.is_empty(), "{mixed:?}");
        assert_eq!(of("%\nO1234\nG0 X0\n").others, []);
    }
}
