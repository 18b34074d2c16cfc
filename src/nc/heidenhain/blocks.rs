//! Heidenhain plain language. In: a block. Out: words of ISO 6983, which the interpreter then executes.
//!
//! An arc about a pole lies in the plane of the axes that `CC` names (`CC X… Z…` : ZX), others in that across the tool axis;
//! the reference axes of its angles are those of ISO (TNC 640, Klartext Programming: Polar coordinates, Setting the pole).
//! `L` is G0 (FMAX) or G1, `CC` keeps a centre for `C` and a pole for `LP`, `CP`; `CR` is an arc with R, `CT` one that is
//! tangential; `RND`, `CHF` work the corner between their neighbours; `R0 RL RR` are G40 G41 G42, an `I` before an axis
//! makes it incremental; M91 and M92 are G53. Words without a meaning here get a diagnostic.

use super::state::Heidenhain;
use crate::diag::Span;
use crate::ids::BlockId;
use crate::nc::doubt::Doubt;
use crate::nc::expr::Target;
use crate::nc::interp::interpreter::Interpreter;
use crate::nc::interp::messages::is_not_finite;
use crate::nc::interp::state::After;
use crate::nc::interp::state::ArcFeed;
use crate::nc::interp::state::Corner;
use crate::nc::interp::state::FeedWord;
use crate::nc::interp::words::Words;
use crate::nc::parameters::parameter_index;
use crate::nc::token::{Token, TokenKind};
use crate::nc::toolpath::{Event, FeedMode, MoveKind};
use crate::path::{Plane, Vec3};
use crate::units::mm_s_from_mm_min;

/// Frames that are not followed, by what puts them in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LostFrame {
    /// PLANE … to PLANE RESET.
    Plane,
    /// Cycle 19.
    Cycle19,
    /// M128, FUNCTION TCPM.
    TipFollowed,
    /// TOOL CALL with X or Y.
    ToolAxis,
    /// Cycle 247 with another number.
    Preset,
}

impl Interpreter<'_, Heidenhain> {
    /// Puts a block into ISO words.
    pub(crate) fn heidenhain(&mut self, block: BlockId, words: &mut Words) -> After {
        let source = self.flow.source.clone();
        let text = source.program().text();
        let skip =
            |kind| matches!(kind, TokenKind::Blank | TokenKind::LineEnd | TokenKind::Comment | TokenKind::Delete);
        let mut tokens: Vec<Token> = source.program().tokens(block).filter(|token| !skip(token.kind)).collect();
        if tokens.first().is_some_and(|token| token.kind == TokenKind::Word(b'N')) {
            tokens.remove(0);
        }
        let names: Vec<String> = tokens
            .iter()
            .filter(|token| token.kind == TokenKind::Name)
            .map(|token| String::from_utf8_lossy(token.span.of(text)).to_ascii_uppercase())
            .collect();
        let mut names: Vec<&str> = names.iter().map(String::as_str).collect();
        for (apart, whole) in [(["F", "MAX"], "FMAX"), (["F", "AUTO"], "FAUTO")] {
            if let Some(at) = names.windows(2).position(|pair| pair == apart) {
                names.splice(at..at + 2, [whole]);
            }
        }
        let place = tokens.first().map_or_else(|| source.program().span(block), |token| token.span);
        if names.first() == Some(&"FN") && self.q_jump(source.program().line_text(block), place) {
            return After::Done;
        }
        if names.contains(&"SYSREAD") {
            // The feed in force is among what it can read (ID20 NR8).
            self.uses_feed();
        }
        self.feed_of_its_own(words);
        let read_by_control = names.iter().any(|name| matches!(*name, "SYSREAD" | "TABREAD"));
        for token in tokens.iter().filter(|token| token.kind == TokenKind::Assignment) {
            self.q_assignment(*token, text, read_by_control);
        }
        for token in tokens.iter_mut().filter(|token| token.kind == TokenKind::Expression) {
            self.insert_parameter(token, text);
        }
        self.modal.plane = self.family.tool_plane;
        // A T is a tolerance (M112, M124, cycle 32); tools come by TOOL CALL.
        words.remove(b'T');
        self.feed_per_turn(words);
        self.feed_on_arcs(words);
        let first_number = tokens.iter().find(|t| t.kind == TokenKind::Expression).map(|t| t.number);
        self.named_feed(&names, place);
        self.unread_numbers(&names, &tokens, text);
        match names.as_slice() {
            ["BEGIN", "PGM", ..] => {
                self.modal.inch = names.last() == Some(&"INCH");
                words.clear();
            }
            ["END", "PGM", ..] => {
                words.clear();
                if self.flow.source_id == 0 {
                    self.flow.ended = true;
                } else {
                    self.return_from_call();
                }
            }
            ["L", ..] => self.straight(&names, words, place),
            ["LP" | "CP", ..] => self.polar_motion(&names, &tokens, text, words, place),
            ["CC", ..] => self.pole(words),
            ["C" | "CR", ..] => self.circle(&names, words, place),
            ["CT", ..] => {
                self.radius_side(&names, words, place);
                self.tangential_arc(words, place);
            }
            ["RND" | "CHF", ..] => self.corner_block(names[0], words, first_number, place),
            ["APPR", ..] => self.approach(&names, &tokens, text, words, place),
            ["DEP", ..] => self.departure(&names, &tokens, text, words, place),
            ["TOOL", "CALL", ..] => {
                let named = tokens.iter().find(|token| token.span.of(text).first() == Some(&b'"'));
                let named = named.and_then(|token| self.tool_by_name(token.span, text));
                tool_call(words, named.or(number_after(&tokens, text, "CALL")), place);
                let allowance_mm = |name: &str| number_after(&tokens, text, name).unwrap_or(0.0) * self.modal.unit_mm();
                (self.compensation.oversize_mm, self.frame.longer_mm) = (allowance_mm("DR"), allowance_mm("DL"));
                self.reframe();
                self.tool_axis(&names, place);
                self.active_radius(words.get(b'T').map(|number| number as u32));
                if let Some(value) = words.get(b'F') {
                    let value = value.max(0.0) * self.feed_unit_mm();
                    self.family.tool_feed = FeedWord { value, word: None, computed: true };
                }
            }
            ["CALL", "LBL", ..] => self.call_label(&tokens, text, place),
            ["CALL", "PGM", ..] => {
                words.clear();
                self.call_file(source.program().line_text(block), place);
            }
            ["LBL"] if tokens.iter().any(|t| t.span.of(text) == b"0") => self.return_from_call(),
            ["STOP", ..] => {
                self.event(Event::Stop { line: self.line_number(), end: false });
                self.doubt(Doubt::ProgramStop, place);
            }
            ["CYCL", "DEF", ..] => {
                self.define_cycle(block, &tokens, text, words, place);
                words.clear();
            }
            ["CYCL", "CALL", "POS" | "PAT", ..] => {
                words.clear();
                self.cuts_unseen();
                self.misread(
                    "nc::cycle",
                    place,
                    "a cycle called at other positions is kept, not simulated",
                    "call it by M99",
                );
            }
            ["CYCL", "CALL", ..] => self.call_cycle(place),
            ["PLANE", ..] => {
                let angles = ["SPA", "SPB", "SPC"].map(|name| number_after(&tokens, text, name));
                let level = names.get(1) == Some(&"SPATIAL") && angles == [Some(0.0); 3];
                self.set_lost_frame(LostFrame::Plane, !level && names.get(1) != Some(&"RESET"), place);
                words.clear();
            }
            ["FUNCTION", "TCPM", ..] => {
                self.set_lost_frame(LostFrame::TipFollowed, true, place);
                words.clear();
            }
            ["FUNCTION", "RESET", "TCPM", ..] => {
                self.set_lost_frame(LostFrame::TipFollowed, false, place);
                words.clear();
            }
            ["FN", ..] if !first_number.is_some_and(only_parameters) => {
                let what = "this FN may set more than parameters; the block is kept";
                self.misread("nc::not-understood", place, what, "");
                words.clear();
            }
            ["LBL" | "BLK" | "CYCL" | "FN", ..] | ["TOOL", "DEF", ..] => words.clear(),
            [] | ["MB", ..] => {}
            [first, ..] => {
                let what = format!("{first} is not followed; the block is kept");
                self.misread("nc::not-understood", place, what, "");
                words.clear();
            }
        }
        if words.has_m(1280) || words.has_m(1290) {
            self.set_lost_frame(LostFrame::TipFollowed, words.has_m(1280), place);
        }
        if words.has_m(910) || words.has_m(920) {
            words.g.push((530, place));
        }
        if words.has_m(1400) {
            self.retract(number_after(&tokens, text, "MB"));
        }
        if words.has_m(990) {
            words.m.retain(|m| m.0 != 990);
            self.family.call_after = true;
        }
        After::Words
    }

    /// M136: F is per turn of the spindle, M137: per minute again. Both act from the beginning of their block on.
    fn feed_per_turn(&mut self, words: &Words) {
        if words.has_m(1360) {
            self.feed_mode(FeedMode::PerRev, words);
        } else if words.has_m(1370) {
            self.feed_mode(FeedMode::PerMinute, words);
        }
    }

    /// M109 keeps F along the contour on arcs, M110 inside of them alone, M111 on the path of the tool centre again. All act from the beginning of
    /// their block on.
    fn feed_on_arcs(&mut self, words: &Words) {
        for (code, arc_feed) in [(1090, ArcFeed::Contour), (1100, ArcFeed::Inside), (1110, ArcFeed::Centre)] {
            if words.has_m(code) {
                self.modal.arc_feed = arc_feed;
            }
        }
    }

    /// M103 F20: at 20 % of the feed down along the tool axis; M140 MB 30 F750: at this feed out along it. Neither F is the feed of the block.
    fn feed_of_its_own(&mut self, words: &mut Words) {
        let of = |code: u16| words.m.iter().find(|(known, _)| *known == code).map(|(_, place)| (code, *place));
        let Some((code, place)) = of(1030).or_else(|| of(1400)) else { return };
        let Some(own) = words.span(b'F').filter(|f| place.start < f.start) else { return };
        if words.repeated.is_none() {
            words.remove(b'F');
        }
        // A second F, to restate the one in force, has no place beside it.
        self.uses_feed();
        let text = if code == 1030 { "the factor of M103 is not followed" } else { "the feed of M140 is not followed" };
        self.not_understood("nc::not-understood", own, text, "its block is kept as it is");
    }

    /// `Q1 = +3 * Q2`; of what is read from the control (FN 18, FN 28) only the control knows the value.
    fn q_assignment(&mut self, token: Token, text: &[u8], of_control: bool) {
        let bytes = token.span.of(text);
        let Some(equals) = bytes.iter().position(|&byte| byte == b'=') else { return };
        let index = parameter_index(String::from_utf8_lossy(&bytes[1..equals]).trim()).unwrap_or(0);
        let known = if of_control { Some(f64::NAN) } else { self.feed_by_name(&bytes[equals + 1..]) };
        if let Some(feed) = known {
            self.block.assignments.push((Target::Number(index), Some(feed)));
            return self.apply_assignments();
        }
        match self.evaluate(token.span, &formula(&bytes[equals + 1..]), 0) {
            Ok(value) => {
                self.block.assignments.push((Target::Number(index), Some(value)));
                self.preset(index, value, token.span);
            }
            Err(error) => {
                // What it is now is not known, least of all what it was before.
                self.block.assignments.push((Target::Number(index), Some(f64::NAN)));
                self.bad_expression(token.span, &error);
            }
        }
        self.apply_assignments();
    }

    /// `Q206=AUTO`: the feed of the tool call, in units of the program; NaN where it is not known, and for FMAX, FU, FZ.
    fn feed_by_name(&self, value: &[u8]) -> Option<f64> {
        let name = value.trim_ascii().to_ascii_uppercase();
        let known = self.family.tool_feed.value / self.feed_unit_mm();
        match name.as_slice() {
            b"AUTO" | b"FAUTO" => Some(if known > 0.0 { known } else { f64::NAN }),
            b"MAX" | b"FMAX" | b"FU" | b"FZ" => Some(f64::NAN),
            _ => None,
        }
    }

    /// Q100 to Q199 are the control's own (TNC 640, Klartext Programming, Preassigned Q parameters): not known until the program
    /// sets them.
    pub(crate) fn reserve_parameters(&mut self) {
        self.parameters.numbered.extend((100..=199).map(|index| (index, f64::NAN)));
    }

    /// Q108 is the radius of the tool in the spindle, its allowances included.
    fn active_radius(&mut self, tool: Option<u32>) {
        let Some(tool) = tool else { return };
        let radius_mm = self.env.diameter_mm(tool).map(|diameter| 0.5 * diameter + self.compensation.oversize_mm);
        let value = radius_mm.map_or(f64::NAN, |radius| radius / self.modal.unit_mm());
        self.parameters.numbered.insert(108, value);
    }

    /// `TOOL CALL 1 Z`: the plane across the axis of the tool. A tool that does not stand along Z is not simulated.
    fn tool_axis(&mut self, names: &[&str], place: Span) {
        let along = names.iter().skip(2).find_map(|name| match *name {
            "Z" => Some(Plane::Xy),
            "Y" => Some(Plane::Zx),
            "X" => Some(Plane::Yz),
            _ => None,
        });
        if let Some(plane) = along {
            self.family.tool_plane = plane;
            self.set_lost_frame(LostFrame::ToolAxis, plane != Plane::Xy, place);
        }
    }

    /// Cycle 247 takes a preset of the control's table: the first one is where the setup puts the part, another one is elsewhere. One that comes
    /// after a cut is another than the one before, whose number only the control knows.
    pub(super) fn preset(&mut self, index: u32, value: f64, place: Span) {
        if index != 339 || self.family.cycle_number != 247 {
            return;
        }
        let unknown = self.out.moves.iter().any(|motion| motion.kind == MoveKind::Feed);
        let first = *self.family.first_preset.get_or_insert(if unknown { f64::NAN } else { value });
        self.set_lost_frame(LostFrame::Preset, value != first, place);
    }

    /// Puts a frame in force that is not followed, or ends it; feeds are kept while any is.
    pub(crate) fn set_lost_frame(&mut self, tilt: LostFrame, on: bool, place: Span) {
        let bit = 1 << tilt as u8;
        let before = self.family.lost_frames;
        self.family.lost_frames = if on { before | bit } else { before & !bit };
        if on && before & bit == 0 {
            let (what, help) = match tilt {
                LostFrame::Plane => ("a tilted plane (PLANE)", "PLANE RESET ends it"),
                LostFrame::Cycle19 => ("a tilted plane (cycle 19)", "cycle 19 with angles of 0 ends it"),
                LostFrame::TipFollowed => ("the tool tip followed under rotation (M128, TCPM)", "M129 ends it"),
                LostFrame::ToolAxis => ("a tool along another axis than Z", "a TOOL CALL with Z ends it"),
                LostFrame::Preset => ("another preset (cycle 247)", "the first preset ends it"),
            };
            if tilt == LostFrame::Preset {
                self.doubt(Doubt::WorkOffset, place);
            }
            self.lose_frame(place, what, help);
        } else if before != 0 && self.family.lost_frames == 0 {
            self.settle(Doubt::WorkOffset);
            self.regain_frame();
        }
    }

    /// FAUTO is the feed of the tool call; FU and FZ (per revolution, per tooth) and FT (time) are kept as they are.
    fn named_feed(&mut self, names: &[&str], place: Span) {
        if names.contains(&"FAUTO") {
            self.modal.feed = self.family.tool_feed;
        } else if let Some(name) = names.iter().find(|name| matches!(**name, "FU" | "FZ" | "FT" | "FMAXT")) {
            (self.modal.feed.word, self.modal.feed.computed) = (None, true);
            self.not_understood(
                "nc::feed",
                place,
                format!("{name} is not followed"),
                "its feed is kept up to the next F",
            );
        }
    }

    /// Names in a motion that stand where a number belongs: an F without one, an axis at `NAN`.
    fn unread_numbers(&mut self, names: &[&str], tokens: &[Token], text: &[u8]) {
        const FEEDS: [&[u8]; 6] = [b"FMAX", b"FAUTO", b"FU", b"FZ", b"FT", b"FMAXT"];
        let moves = ["L", "LP", "CP", "C", "CR", "CT", "RND", "CHF", "APPR", "DEP"];
        if !names.first().is_some_and(|first| moves.contains(first)) {
            return;
        }
        for (at, token) in tokens.iter().enumerate().filter(|(_, token)| token.kind == TokenKind::Name) {
            let name = token.span.of(text).to_ascii_uppercase();
            let next = tokens.get(at + 1);
            let valued = name == b"F"
                && next.is_some_and(|next| {
                    let bytes = next.span.of(text);
                    next.kind == TokenKind::Expression
                        || [&b"MAX"[..], b"AUTO"].iter().any(|n| n.eq_ignore_ascii_case(bytes))
                });
            let feed = name.starts_with(b"F") && !valued && !FEEDS.contains(&name.as_slice());
            if feed {
                (self.modal.feed.word, self.modal.feed.computed) = (None, true);
            }
            if feed || is_not_finite(&name) {
                let text = "a number is missing that can be read";
                self.not_understood(
                    "nc::not-understood",
                    token.span,
                    text,
                    "write a plain decimal number, such as F600",
                );
            }
        }
    }

    /// M140 MB: along the tool axis by this much, else as far as there is room.
    fn retract(&mut self, by: Option<f64>) {
        let mut target = self.place.programmed;
        let (_, _, n) = self.modal.plane.axes();
        let home = self.env.home_mm.map(|home| home - self.env.origin(self.modal.wcs));
        let free = self.frame.invert(home.unwrap_or(Vec3::repeat(self.env.clear_z_mm)))[n];
        target[n] = by.map_or(target[n].max(free), |by| target[n] + by * self.modal.unit_mm());
        self.line_to(MoveKind::Rapid, target);
    }

    /// `+Q5` in place of a number gets its value.
    fn insert_parameter(&mut self, token: &mut Token, text: &[u8]) {
        let bytes = token.span.of(text);
        if memchr::memchr2(b'Q', b'q', bytes).is_some() && !bytes.starts_with(b"\"") {
            match self.evaluate(token.span, bytes, 0) {
                Ok(value) => token.number = value,
                Err(error) => self.bad_expression(token.span, &error),
            }
        }
    }

    fn straight(&mut self, names: &[&str], words: &mut Words, place: Span) {
        self.radius_side(names, words, place);
        if words.has_any(b"XYZABC") {
            words.g.push((if names.contains(&"FMAX") { 0 } else { 10 }, place));
        }
    }

    /// `R0`, `RL`, `RR`; R0 reads as a word, the others as names.
    pub(crate) fn radius_side(&mut self, names: &[&str], words: &mut Words, place: Span) {
        let side = if names.contains(&"RL") {
            410
        } else if names.contains(&"RR") {
            420
        } else if words.get(b'R') == Some(0.0) {
            words.remove(b'R');
            400
        } else {
            return;
        };
        if side != self.family.compensation_side {
            self.family.compensation_side = side;
            words.g.push((side, place));
        }
    }

    fn pole(&mut self, words: &mut Words) {
        let unit = self.modal.unit_mm();
        if !words.has_any(b"XYZ") {
            self.family.pole = self.place.programmed;
        }
        self.family.pole_plane = match [b'X', b'Y', b'Z'].map(|letter| words.has(letter)) {
            [true, true, _] => Plane::Xy,
            [true, _, true] => Plane::Zx,
            [_, true, true] => Plane::Yz,
            [false, false, false] => self.family.tool_plane,
            _ => self.family.pole_plane,
        };
        for (axis, letter) in b"XYZ".iter().enumerate() {
            if let Some(value) = words.get(*letter) {
                let from = if words.is_incremental(*letter) { self.place.programmed[axis] } else { 0.0 };
                self.family.pole[axis] = from + value * unit;
            }
        }
        words.clear();
    }

    /// `C … DR±` about the pole, `CR … R DR±` by radius.
    fn circle(&mut self, names: &[&str], words: &mut Words, place: Span) {
        let turn = if names.contains(&"DR+") { 30 } else { 20 };
        if names[0] == "C" {
            self.radius_side(names, words, place);
            self.modal.plane = self.family.pole_plane;
            return self.put_centre(words, self.family.pole, turn == 30, place);
        }
        words.g.push((turn, place));
    }

    /// `LP PR+30 PA+45`: to a point in polar coordinates about the pole; `CP PA+90 DR+` (IPA: by an angle): about it.
    fn polar_motion(&mut self, names: &[&str], tokens: &[Token], text: &[u8], words: &mut Words, place: Span) {
        let after = |name: &str| number_after(tokens, text, name);
        self.radius_side(names, words, place);
        self.modal.plane = self.family.pole_plane;
        let (a, b, _) = self.modal.plane.axes();
        let (u, v) = (self.place.programmed[a] - self.family.pole[a], self.place.programmed[b] - self.family.pole[b]);
        let unit = self.modal.unit_mm();
        let start = v.atan2(u).to_degrees();
        let stated = ["PR", "PA", "IPR", "IPA"].iter().filter(|name| names.contains(*name));
        let readable = stated.clone().all(|name| after(name).is_some());
        let radius = after("PR").map_or(u.hypot(v) + after("IPR").unwrap_or(0.0) * unit, |radius| radius * unit);
        let angle = after("PA").unwrap_or(start + after("IPA").unwrap_or(0.0));
        if !readable || stated.count() == 0 {
            self.not_understood("nc::not-understood", place, "these polar coordinates are not followed", "");
            return words.clear();
        }
        for (axis, at) in [(a, radius * angle.to_radians().cos()), (b, radius * angle.to_radians().sin())] {
            words.put(b"XYZ"[axis], (self.family.pole[axis] + at) / unit, place, true);
            words.force(b"XYZ"[axis], false);
        }
        if names[0] == "LP" {
            return words.g.push((if names.contains(&"FMAX") { 0 } else { 10 }, place));
        }
        let turns = (after("IPA").unwrap_or(0.0).abs() / 360.0 - 1e-9).floor().max(0.0) + 1.0;
        words.put(b'P', turns, place, true);
        self.put_centre(words, self.family.pole, names.contains(&"DR+"), place);
    }

    /// `RND R5`, `CHF 2`: between the block before and the one after.
    fn corner_block(&mut self, word: &str, words: &mut Words, number: Option<f64>, place: Span) {
        let unit = self.modal.unit_mm();
        let size = words.get(b'R').or(number).filter(|size| *size > 0.0);
        self.corners.feed = words.get(b'F').map(|feed| mm_s_from_mm_min(feed * self.feed_unit_mm()));
        words.clear();
        match size {
            Some(radius) if word == "RND" => self.corners.now = Some((Corner::Round(radius * unit), place)),
            Some(leg) => self.corners.now = Some((Corner::Legs(leg * unit), place)),
            None => self.not_understood("nc::corner", place, "the corner has no size", ""),
        }
    }
}

/// The number behind a name: 15 of LEN15.
pub(crate) fn number_after(tokens: &[Token], text: &[u8], name: &str) -> Option<f64> {
    let at = tokens.iter().position(|token| token.span.of(text).eq_ignore_ascii_case(name.as_bytes()))?;
    tokens.get(at + 1).filter(|token| token.kind == TokenKind::Expression).map(|token| token.number)
}

/// A formula of plain language with its own words in place: `DIV` divides, and a function has its next operand alone: `COS 60 * 4` is
/// `COS(60) * 4` (TNC 640, Klartext Programming, Rules for formulas).
fn formula(text: &[u8]) -> Vec<u8> {
    let text = String::from_utf8_lossy(text).to_ascii_uppercase().replace(" DIV ", " / ");
    with_brackets(&text).into_bytes()
}

/// Functions of plain language that may stand before an operand without brackets.
const FUNCTIONS: [&str; 11] = ["SQRT", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "LN", "EXP", "INT", "ABS"];

fn with_brackets(text: &str) -> String {
    let letters = |text: &str| text.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (mut out, mut rest) = (String::new(), text);
    while let Some(next) = rest.chars().next() {
        let word = letters(rest);
        let behind = rest[word..].trim_start();
        if word > 0 && FUNCTIONS.contains(&&rest[..word]) && !behind.starts_with(['(', '[']) {
            let length = operand(behind);
            out += &format!("{}({})", &rest[..word], with_brackets(&behind[..length]));
            rest = &behind[length..];
        } else {
            let length = word.max(next.len_utf8());
            out += &rest[..length];
            rest = &rest[length..];
        }
    }
    out
}

/// Length of the operand that a text begins with: a sign, then a function with its operand, brackets, or a number or Q parameter.
fn operand(text: &str) -> usize {
    let sign = text.len() - text.trim_start_matches(['+', '-', ' ']).len();
    let rest = &text[sign..];
    let word = rest.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(rest.len());
    if FUNCTIONS.contains(&&rest[..word]) {
        let blank = rest[word..].len() - rest[word..].trim_start().len();
        return sign + word + blank + operand(rest[word..].trim_start());
    }
    let mut depth = 0;
    let mut ends = |c: char| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        depth < 0 || depth == 0 && !(c.is_ascii_alphanumeric() || matches!(c, '.' | ')'))
    };
    sign + rest.find(&mut ends).unwrap_or(rest.len())
}

/// Does an FN calculate, jump, print, wait, or read and write tables alone? FN 17 writes into the control, 19 and 29 hand values to the
/// machine, 25 sets the datum (TNC 640, Klartext Programming, Programming Q parameters).
fn only_parameters(number: f64) -> bool {
    matches!(number as u32, 0..=16 | 18 | 20 | 23..=24 | 26..=28 | 37..=38) && number.fract() == 0.0
}

fn tool_call(words: &mut Words, number: Option<f64>, place: Span) {
    words.remove(b'R');
    if let Some(number) = number {
        words.put(b'T', number, place, false);
    }
}
