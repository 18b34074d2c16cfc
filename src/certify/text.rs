//! Reading the text of a certificate, which `job/certificate_text.rs` writes. In: lines of words. Out: [`Certificate`]. Every number is the
//! shortest decimal that reads back as the same double. The last line is the SHA-256 of all before it.
//!
//! ```text
//! feedwright certificate 1
//! program SHA-256 of the written program          setup SHA-256 of what the setup says
//! confidence 0.95                                  stock UNCERTAINTY_MM …
//! limit TOOL KIND VALUE                            (N, W, N·mm, mm, MPa)
//! ellipsoid TOOL REV/S RADIUS MEAN×7 SHAPE×49      (k_tc … k_ae, tare; r² times the covariance)
//! part TOOL SEGMENT FROM TO                        (rings, numbered in this order)
//! move INDEX LINE TOOL REV/S FEED_MM_S
//! station FROM TO DEPTH×2 TORQUE×4 CHIP×2 ENTRY EXIT RINGS … (arcs: mm, N·mm per coefficient, 1, rad)
//! sealed SHA-256
//! ```

use sha2::{Digest, Sha256};

use super::cutter::Part;
use super::interval::Interval;
use super::place::Arc;

/// The first line.
pub const HEAD: &str = "feedwright certificate 1";

/// What a certificate says.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Certificate {
    /// The lines that follow from program, setup and confidence: the checker has the same of its own.
    pub given: Vec<String>,
    /// Confidence at which the coefficients lie in their ellipsoids.
    pub confidence: f64,
    /// Rings of each tool.
    pub parts: Vec<(u32, Vec<Part>)>,
    /// Feed moves.
    pub moves: Vec<MovePart>,
}

impl Certificate {
    /// Rings of a tool.
    pub fn parts_of(&self, number: u32) -> &[Part] {
        self.parts.iter().find(|(tool, _)| *tool == number).map_or(&[], |(_, parts)| parts)
    }
}

/// A feed move.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MovePart {
    /// Its place among the moves of the program.
    pub index: usize,
    /// Physical line.
    pub line: u32,
    /// Tool.
    pub tool: u32,
    /// Speed, rev/s.
    pub rps: f64,
    /// Feed, mm/s.
    pub feed_mm_s: f64,
    /// Its stations, from its beginning to its end.
    pub stations: Vec<Station>,
}

/// A piece of a move.
#[derive(Debug, Clone, PartialEq)]
pub struct Station {
    /// From where to where, mm along the move.
    pub over_mm: [f64; 2],
    /// Heights above the tip between which it may be engaged, mm; mean torque per k_te, and per k_tc and feed per tooth; largest chip
    /// thickness over feed per tooth.
    pub enclosures: [Interval; 4],
    /// What may be engaged.
    pub arcs: Vec<Arc>,
}

/// SHA-256 in hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
}

/// Reads a certificate; what is wrong with it, with the line of its own text.
pub fn read(text: &str) -> Result<Certificate, String> {
    let body = text.strip_suffix('\n').and_then(|text| text.rfind('\n')).map(|at| text.split_at(at + 1));
    let Some((body, seal)) = body.filter(|(body, _)| body.starts_with(HEAD)) else {
        return Err("this is no certificate of this version of Feedwright".to_owned());
    };
    if seal != format!("sealed {}\n", sha256(body.as_bytes())) {
        return Err("the certificate was altered: its text does not fit its seal".to_owned());
    }
    let mut found = Certificate::default();
    for (number, line) in body.lines().enumerate().skip(1) {
        let mut words = Words { line, rest: line.split(' '), number: number + 1 };
        take(&mut found, &mut words)?;
        words.end()?;
    }
    let stated = found.given.iter().find_map(|line| line.strip_prefix("confidence ")?.parse().ok());
    found.confidence = stated.ok_or("the certificate states no confidence")?;
    Ok(found)
}

fn take(found: &mut Certificate, words: &mut Words) -> Result<(), String> {
    match words.word()? {
        "program" | "setup" | "confidence" | "stock" | "limit" | "ellipsoid" => {
            found.given.push(words.line.to_owned());
            words.rest.by_ref().for_each(drop);
        }
        "part" => {
            let tool = words.whole()?;
            let part = Part { segment: words.whole::<usize>()?, from: words.number()?, to: words.number()? };
            match found.parts.iter_mut().find(|(number, _)| *number == tool) {
                Some((_, parts)) => parts.push(part),
                None => found.parts.push((tool, vec![part])),
            }
        }
        "move" => found.moves.push(MovePart {
            index: words.whole()?,
            line: words.whole()?,
            tool: words.whole()?,
            rps: words.number()?,
            feed_mm_s: words.number()?,
            stations: Vec::new(),
        }),
        "station" => {
            let over_mm = [words.number()?, words.number()?];
            let enclosures = [words.interval()?, words.interval()?, words.interval()?, words.interval()?];
            let mut arcs = Vec::new();
            while words.more() {
                arcs.push(Arc { ring: words.whole()?, entry: words.number()?, exit: words.number()? });
            }
            let station = Station { over_mm, enclosures, arcs };
            found.moves.last_mut().ok_or_else(|| words.wrong())?.stations.push(station);
        }
        _ => return Err(words.wrong()),
    }
    Ok(())
}

/// The words of a line.
struct Words<'a> {
    line: &'a str,
    rest: std::str::Split<'a, char>,
    number: usize,
}

impl<'a> Words<'a> {
    fn wrong(&self) -> String {
        let shown: String = self.line.chars().take(60).collect();
        format!("line {} of the certificate cannot be read: {shown:?}", self.number)
    }
    fn word(&mut self) -> Result<&'a str, String> {
        self.rest.next().ok_or_else(|| self.wrong())
    }
    fn number(&mut self) -> Result<f64, String> {
        let word = self.word()?;
        word.parse::<f64>().ok().filter(|number| number.is_finite()).ok_or_else(|| self.wrong())
    }
    fn whole<T: std::str::FromStr>(&mut self) -> Result<T, String> {
        let word = self.word()?;
        word.parse::<T>().map_err(|_| self.wrong())
    }
    fn interval(&mut self) -> Result<Interval, String> {
        let (lo, hi) = (self.number()?, self.number()?);
        if lo <= hi { Ok(Interval { lo, hi }) } else { Err(self.wrong()) }
    }
    fn more(&self) -> bool {
        self.rest.clone().next().is_some()
    }
    fn end(&self) -> Result<(), String> {
        if self.more() { Err(self.wrong()) } else { Ok(()) }
    }
}
