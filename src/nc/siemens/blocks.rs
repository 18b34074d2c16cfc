//! Blocks of Siemens 840D that are more than ISO words. In: a block. Out: names, assignments and settings put in force, the rest as words.
//! Calls, frames, jumps and structures are in the files beside this one.

use super::calls::repeats;
use super::frames::ENDS_LOST_FRAME;
use super::state::Siemens;
use super::structures::structure_word;
use super::ways::RUNS_ANYTHING;
use crate::diag::Span;
use crate::ids::{BlockId, MoveId};
use crate::nc::doubt::Doubt;
use crate::nc::interp::interpreter::Interpreter;
use crate::nc::interp::interpreter::Setting;
use crate::nc::interp::state::After;
use crate::nc::interp::state::ArcFeed;
use crate::nc::interp::state::Corner;
use crate::nc::interp::state::Length;
use crate::nc::interp::state::Motion;
use crate::nc::interp::values::left_of;
use crate::nc::interp::words::{Code, Words};
use crate::nc::token::{Token, TokenKind};
use crate::nc::toolpath::{FeedMode, Freeze, PathMode};
use crate::units::mm_s_from_mm_min;

/// Names that change nothing the toolpath shows.
const WITHOUT_EFFECT: [&str; 26] = [
    "SOFT",
    "BRISK",
    "DRIVE",
    "FFWON",
    "FFWOF",
    "COMPOF",
    "COMPON",
    "COMPCAD",
    "CFC",
    "CFTCP",
    "CFIN",
    "DIAMOF",
    "NORM",
    "STOPRE",
    "WORKPIECE",
    "FGROUP",
    "DISPLOF",
    "SAVE",
    "UPATH",
    "KONT",
    "KONTC",
    "KONTT",
    "SETINT",
    "FIFOCTRL",
    "STARTFIFO",
    // The feed is constant along the path, as everywhere; FLIN and FCUB are not known.
    "FNORM",
];

/// What can be set without an effect on path or feed: how corners and splines are smoothed, accelerations, limits of the
/// spindle speed.
const SETTINGS_WITHOUT_EFFECT: [&str; 11] =
    ["ADIS", "ADISPOS", "CTOL", "OTOL", "ATOL", "ACC", "ACCLIMA", "VELOLIMA", "JERKLIMA", "LIMS", "FGREF"];

/// Names that belong to the motion of their block or change the frame.
const SETTINGS: [&str; 13] = [
    "CIP", "CT", "SUPA", "TRAORI", "TRAFOOF", "TRANS", "ATRANS", "ROT", "AROT", "SCALE", "ASCALE", "MIRROR", "AMIRROR",
];

impl Interpreter<'_, Siemens> {
    /// Names, calls, labels and assignments of a block.
    pub(crate) fn siemens(&mut self, block: BlockId, words: &mut Words) -> After {
        let source = self.flow.source.clone();
        let text = source.program().text();
        let skip = |kind| matches!(kind, TokenKind::Blank | TokenKind::LineEnd | TokenKind::Comment | TokenKind::Label);
        let tokens: Vec<Token> = source.program().tokens(block).filter(|token| !skip(token.kind)).collect();
        let start = tokens.iter().position(|token| token.kind != TokenKind::Word(b'N')).unwrap_or(0);
        if tokens.first().is_some_and(|token| token.kind == TokenKind::Percent) {
            self.next_program(block, tokens[0].span.of(text));
            return After::Done;
        }
        if let Some(word) = structure_word(&tokens[start..], text) {
            self.structure(&word, block, &tokens[start..], text, words);
            return After::Done;
        }
        let mut modal = false;
        let mut curve = None;
        for (index, token) in tokens.iter().enumerate() {
            let bytes = token.span.of(text);
            match token.kind {
                TokenKind::Assignment => self.siemens_assignment(*token, bytes, words),
                TokenKind::Call => {
                    let (name, arguments) = self.call_parts(token.span, bytes);
                    match name.as_str() {
                        "IF" => {
                            self.siemens_jump(&tokens[index..], text);
                            return After::Done;
                        }
                        "CASE" => {
                            self.siemens_case(&tokens[index..], text);
                            return After::Done;
                        }
                        _ => self.siemens_call(&name, arguments, modal, token.span, words),
                    }
                }
                TokenKind::Name => {
                    let name = String::from_utf8_lossy(bytes).to_ascii_uppercase();
                    match name.as_str() {
                        "MCALL" => {
                            modal = true;
                            self.family.modal_call = None;
                        }
                        "IF" | "GOTOF" | "GOTOB" | "GOTO" | "GOTOC" | "GOTOS" => {
                            self.siemens_jump(&tokens[index..], text);
                            return After::Done;
                        }
                        "CIP" | "CT" => curve = Some((name, token.span)),
                        "CASE" => {
                            self.siemens_case(&tokens[index..], text);
                            return After::Done;
                        }
                        "REPEAT" | "REPEATB" => {
                            self.repeat_section(&tokens[index..], text, words);
                            return After::Done;
                        }
                        "EXTERN" => return After::Done,
                        "PROC" => {
                            self.procedure(&tokens[index..], text);
                            return After::Done;
                        }
                        "DEF" => {
                            self.define(&tokens[index..], text, words);
                            return After::Done;
                        }
                        "SUPA" => words.g.push((530, token.span)),
                        "TRAORI" => self.lose_frame(token.span, "TRAORI", ENDS_LOST_FRAME),
                        "TRAFOOF" => self.regain_frame(),
                        _ if self.frame_word(&name, token.span, &tokens[index..], text, words) => {
                            words.settle();
                            return After::Words;
                        }
                        "RET" => self.siemens_return(),
                        "CFC" => self.modal.arc_feed = ArcFeed::Contour,
                        "CFTCP" => self.modal.arc_feed = ArcFeed::Centre,
                        "CFIN" => self.modal.arc_feed = ArcFeed::Inside,
                        _ if WITHOUT_EFFECT.contains(&name.as_str()) => {}
                        _ if modal => self.siemens_call(&name, Vec::new(), true, token.span, words),
                        _ if self.call_siemens(&name, repeats(words), Vec::new()) => words.called.push(token.span),
                        _ => {
                            self.doubt(Doubt::MissingProgram, token.span);
                            // CALL BLOCK A TO B runs a section of this program again, CALL "NAME" what the variable says.
                            if RUNS_ANYTHING.contains(&name.as_str()) {
                                self.doubt_since(Doubt::MissingProgram, MoveId(0), token.span);
                            }
                            let said = format!("{name} is not known here");
                            self.not_understood("nc::not-understood", token.span, said, "");
                        }
                    }
                }
                _ => {}
            }
        }
        let through = std::mem::take(&mut self.family.through);
        match curve {
            Some((word, place)) if word == "CT" => self.tangential_arc(words, place),
            Some((_, place)) => self.arc_through(words, through, place),
            None => {}
        }
        if let (Some(number), Some(place)) = (words.get(b'L'), words.span(b'L')) {
            let name = format!("L{number}");
            if modal {
                self.siemens_call(&name, Vec::new(), true, place, words);
            } else if self.call_siemens(&name, repeats(words), Vec::new()) {
                words.called.push(place);
            } else {
                self.no_routine(place, &name);
            }
        }
        // In a subprogram M2 and M30 return as M17 does.
        let ends = |(code, _): &Code| matches!(code, 20 | 300);
        if words.has_m(170) || self.in_subprogram() && words.m.iter().any(ends) {
            self.siemens_return();
            words.m.retain(|code| !ends(code));
        }
        // The spindle becomes an axis.
        if words.has_m(700) {
            self.turn(0);
        }
        After::Words
    }

    fn siemens_return(&mut self) {
        if self.in_subprogram() {
            self.return_from_call();
        } else {
            self.flow.ended = true;
        }
    }

    /// `%_N_NAME_SPF` behind the text of a program ends that.
    fn next_program(&mut self, block: BlockId, line: &[u8]) {
        if archived(line).is_none() || block.0 == 0 {
            return;
        }
        if self.in_subprogram() {
            self.return_from_call();
        } else {
            self.flow.ended |= self.flow.began;
        }
    }

    /// `DEF REAL A, B=5`: names without a value begin at zero.
    fn define(&mut self, tokens: &[Token], text: &[u8], words: &mut Words) {
        let is_whole = tokens.get(1).is_some_and(|token| token.span.of(text).eq_ignore_ascii_case(b"INT"));
        for token in tokens.iter().skip(2) {
            self.type_variable(&left_of(token.span.of(text)), is_whole);
            match token.kind {
                TokenKind::Name => {
                    let name = String::from_utf8_lossy(token.span.of(text)).to_ascii_uppercase();
                    self.parameters.set_name(&name, 0.0);
                    self.family.defined.insert(name);
                }
                TokenKind::Assignment if !token.span.of(text).contains(&b'"') => {
                    self.family.defined.insert(left_of(token.span.of(text)));
                    self.siemens_assignment(*token, token.span.of(text), words);
                }
                _ => {}
            }
        }
    }

    /// Notes whether a variable of the present program holds whole numbers.
    pub(super) fn type_variable(&mut self, name: &str, is_whole: bool) {
        let key = (self.parameters.depth, name.to_owned());
        if is_whole {
            self.family.whole.insert(key);
        } else {
            self.family.whole.remove(&key);
        }
    }

    pub(crate) fn siemens_assignment(&mut self, token: Token, bytes: &[u8], words: &mut Words) {
        let Some(equals) = bytes.iter().position(|&byte| byte == b'=') else { return };
        let name = left_of(bytes);
        let value = match self.evaluate(token.span, angle_of(&name, &bytes[equals + 1..]), 0) {
            Ok(value) => value,
            Err(error) => return self.bad_expression(token.span, &error),
        };
        words.results.push((token.span, value));
        let number = name[1..].parse::<u32>().ok();
        match (name.as_str(), number) {
            ("CR", _) => words.put(b'R', value, token.span, true),
            ("TURN", _) => words.put(b'P', value + 1.0, token.span, true),
            ("RND", _) => self.corner_after(Corner::Round(value * self.modal.unit_mm()), token.span),
            ("CHF", _) => self.corner_after(Corner::Chamfer(value * self.modal.unit_mm()), token.span),
            ("CHR", _) => self.corner_after(Corner::Legs(value * self.modal.unit_mm()), token.span),
            ("I1" | "J1" | "K1", _) => {
                let way = bytes[equals + 1..].trim_ascii_start().to_ascii_uppercase();
                let modal = words.has_g(910) || self.modal.incremental && !words.has_g(900);
                let by_steps = way.starts_with(b"IC(") || modal && !way.starts_with(b"AC(");
                let point = Some((value * self.modal.unit_mm(), by_steps));
                self.family.through[usize::from(name.as_bytes()[0] - b'I')] = point;
            }
            ("RNDM", _) if value == 0.0 => {}
            ("RNDM", _) => {
                // Rounds every corner from here on.
                self.doubt(Doubt::UnknownCode, token.span);
                let text = "RNDM is not followed: corners are read as sharp";
                self.not_understood("nc::not-understood", token.span, text, "");
            }
            ("FRC", _) if self.modal.feed_mode == FeedMode::PerMinute => {
                self.corners.next_feed = Some(mm_s_from_mm_min(value * self.feed_unit_mm()));
            }
            ("FRCM", _) if self.modal.feed_mode == FeedMode::PerMinute => {
                let feed = mm_s_from_mm_min(value * self.feed_unit_mm());
                self.corners.modal_feed = (value != 0.0).then_some(feed);
            }
            ("FB", _) if self.modal.feed_mode != FeedMode::InverseTime => {
                self.block.own_feed = Some(value * self.feed_unit_mm());
                self.block.freeze.get_or_insert(Freeze::OwnFeed);
            }
            ("AR" | "AP" | "RP" | "ANG", _) => {
                self.doubt(Doubt::UnknownCode, token.span);
                let text = format!("{name} is not followed: the block is read without it");
                self.not_understood("nc::not-understood", token.span, text, "");
            }
            (_, Some(1)) if name.starts_with('S') => words.put(b'S', value, token.span, true),
            (_, Some(1)) if name.starts_with('M') => words.put(b'M', value, token.span, true),
            _ if self.is_variable_here(&name) => self.set_variable(&name, value),
            _ => self.control_setting(&name, value, token.span),
        }
    }

    /// A name that the program has defined, an R parameter, or by its underscore a variable of the user.
    fn is_variable_here(&self, name: &str) -> bool {
        let base = name.split('[').next().unwrap_or_default();
        let defined = || self.family.defined.iter().any(|known| known.split('[').next() == Some(base));
        let parameter = base.strip_prefix('R').is_some_and(|number| number.bytes().all(|byte| byte.is_ascii_digit()));
        parameter || base.starts_with('_') || defined()
    }

    /// An assignment to something of the control: a probing move, an axis by its full name, a setting; what is not known may be anything.
    fn control_setting(&mut self, name: &str, value: f64, place: Span) {
        let base = name.split('[').next().unwrap_or_default();
        let digits = base.get(1..).is_some_and(|rest| rest.bytes().all(|byte| byte.is_ascii_digit()));
        match (base, base.as_bytes().first()) {
            ("MEAS" | "MEAW" | "MEASA" | "MEAWA" | "MEAC", _) => {
                self.block.freeze = Some(Freeze::Probe);
                self.place.probed = true;
                self.doubt(Doubt::Probe, place);
            }
            ("TOFFL" | "TOFF" | "TOFFR" | "TCARR" | "DL", _) => self.tool_length.now = Length::Other,
            // The spindle stands at an angle until it is started again.
            ("SPOS" | "SPOSA", _) => self.turn(0),
            _ if SETTINGS_WITHOUT_EFFECT.contains(&base) => {}
            (_, Some(b'A' | b'B' | b'C')) if digits => {
                if value != 0.0 || self.rotary.zero_lost {
                    self.rotary.zero_lost = true;
                    self.doubt(Doubt::RotaryAxis, place);
                }
            }
            // Other spindles, their M and H functions.
            (_, Some(b'S' | b'M' | b'H')) if digits => {}
            _ => {
                self.doubt(Doubt::UnknownCode, place);
                let text = format!("{name} is not known here");
                self.not_understood("nc::not-understood", place, text, "its block is kept as it is");
            }
        }
    }

    /// Sets `R12` or a variable by its name.
    pub(crate) fn set_variable(&mut self, name: &str, value: f64) {
        let key = (self.parameters.depth, name.to_owned());
        let value = if self.family.whole.contains(&key) { value.round() } else { value };
        match name.strip_prefix('R').and_then(|number| number.parse().ok()) {
            Some(index) => {
                self.parameters.numbered.insert(index, value);
            }
            None => self.parameters.set_name(name, value),
        }
    }

    /// G codes that mean something else on this control.
    pub(super) fn siemens_setting(&mut self, code: u16, words: &Words) -> Setting {
        match code {
            600 => self.modal.path_mode = PathMode::ExactStop,
            6410..=6450 => self.modal.path_mode = PathMode::Continuous,
            700 | 710 | 7000 | 7100 => {
                self.modal.inch = code == 700 || code == 7000;
                // G70 and G71 leave F in the basic unit of the control, which is program_unit of the setup.
                if self.modal.inch != self.env.inch && code < 1000 {
                    self.doubt(Doubt::Unit, words.g.first().map_or_else(Span::default, |g| g.1));
                }
            }
            580 | 590 if shifts_frame(words) => {}
            5000 | 5050..=5990 => self.select_wcs(code, words),
            3310 | 3320 => self.modal.motion = Motion::Synchronised,
            4500 | 4510 | 6010..=6030 | 9010 | 9020 => {}
            1530 => return Setting::Machine,
            _ => return Setting::AsEverywhere,
        }
        Setting::Done
    }
}

/// Is it G58 or G59 with axis words and without a motion? That shifts the programmable frame by axis (Programming Manual Fundamentals, G58, G59).
pub(super) fn shifts_frame(words: &Words) -> bool {
    let moves = [0, 10, 20, 30].iter().any(|code| words.has_g(*code));
    (words.has_g(580) || words.has_g(590)) && words.has_any(b"XYZ") && !moves
}

/// Does a name of this control put something in force, and neither call nor jump?
pub fn is_setting(name: &[u8]) -> bool {
    let name = String::from_utf8_lossy(name).to_ascii_uppercase();
    WITHOUT_EFFECT.contains(&name.as_str()) || SETTINGS.contains(&name.as_str())
}

/// Does this assignment set an R parameter?
pub(super) fn is_variable(assignment: &[u8]) -> bool {
    let name = left_of(assignment);
    name.strip_prefix('R').is_some_and(|number| !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()))
}

/// Name of the program that `%_N_NAME_MPF` or `%_N_NAME_SPF` begins, lower case.
pub(super) fn archived(line: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(line).trim().to_ascii_lowercase();
    let name = text.strip_prefix("%_n_")?;
    Some(name.strip_suffix("_mpf").or(name.strip_suffix("_spf")).unwrap_or(name).to_owned())
}

/// The angle of `SPOS=DC(90)` without the way to it; of other names the text as it stands.
fn angle_of<'a>(name: &str, text: &'a [u8]) -> &'a [u8] {
    let ways = [&b"DC("[..], b"AC(", b"IC(", b"ACP(", b"ACN("];
    let way = ways.iter().find(|way| text.trim_ascii_start().to_ascii_uppercase().starts_with(way));
    match way {
        Some(way) if name.starts_with("SPOS") => &text.trim_ascii_start()[way.len() - 1..],
        _ => text,
    }
}
