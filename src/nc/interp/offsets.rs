//! Work offsets and shifts: G54…, G10 L2/L20, G52, G92, and the reference returns G28 and G30. In: the words of a block. Out: another frame or
//! zero for the motions that follow; for G28 and G30, motions.

use super::interpreter::{Family, Interpreter};
use super::words::Words;
use crate::diag::Severity;
use crate::nc::doubt::Doubt;
use crate::nc::toolpath::{ADDITIONAL_OFFSETS, BEFORE_ADDITIONAL_OFFSETS, MoveKind};
use crate::path::{Curve, Vec3};

const AXES: [u8; 3] = *b"XYZ";
/// Largest difference between the origins in program and setup that still counts as equal, mm: the sum of some roundings to 0.001 mm or
/// 0.0001 inch.
pub(super) const AGREES_MM: f64 = 0.005;
/// L of a G10 that sets an origin.
const ORIGINS: [f64; 2] = [2.0, 20.0];
/// L of a G10 that writes lengths, radii and wear. Others write parameters of the control, zeros among them, or the lives of tools.
const TOOL_DATA: [f64; 6] = [0.0, 1.0, 10.0, 11.0, 12.0, 13.0];

impl<F: Family> Interpreter<'_, F> {
    /// G54–G59, G59.1–G59.3 (590 + n), G54.1 P (Fanuc), G154 P (Haas): the machine stays, its coordinates change.
    pub(crate) fn select_wcs(&mut self, code: u16, words: &Words) {
        let wcs = match code {
            540 if words.has(b'P') && self.dialect().counts_increments => additional_offset(words),
            541 | 1540 => additional_offset(words),
            591..=593 => 59 + (code - 590),
            _ => code / 10,
        };
        if wcs != self.modal.wcs {
            self.place.tool += self.env.origin(self.modal.wcs) - self.env.origin(wcs);
            self.modal.wcs = wcs;
            self.reframe();
            self.doubt_of_origin();
        }
    }

    /// The offset in force is one that the program sets otherwise than the setup has it.
    fn doubt_of_origin(&mut self) {
        if self.offsets.unstated.contains(&self.modal.wcs) {
            self.doubt(Doubt::ZeroShift, self.flow.source.program().span(self.block.id));
        }
    }

    /// Before a motion: the only work offset of a program is that of the stock; where a second one lies is known only if the setup
    /// gives the origins of both.
    #[inline]
    pub(crate) fn offset_in_use(&mut self) {
        let wcs = self.modal.wcs;
        let first = *self.offsets.first.get_or_insert(wcs);
        if wcs == self.offsets.last {
            return;
        }
        self.offsets.last = wcs;
        let given = |wcs: u16| self.env.origins.iter().any(|(number, _)| *number == wcs);
        if wcs == first {
            self.settle(Doubt::WorkOffset);
        } else if !given(first) || !given(wcs) {
            self.doubt(Doubt::WorkOffset, self.flow.source.program().span(self.block.id));
        }
    }

    /// The program sets the zero at the tool, whose position is not known. The part is assumed to be where the setup puts it, so the tool
    /// is assumed to be at the programmed position.
    fn stand_at(&mut self, axis_words: [Option<f64>; 3]) {
        let mut at = self.frame.invert(self.place.tool);
        for axis in (0..3).filter(|&axis| self.place.is_open(axis)) {
            at[axis] = axis_words[axis].unwrap_or(at[axis]);
        }
        self.place.tool = self.frame.apply(at);
        let why = if self.place.probed { Doubt::Probe } else { Doubt::ZeroShift };
        self.doubt(why, self.flow.source.program().span(self.block.id));
    }

    /// After a change of the frame: the tool stays, its programmed coordinates change.
    pub(crate) fn reframe(&mut self) {
        let before = self.frame.shift;
        self.frame.refresh(self.modal.wcs);
        self.place.programmed = self.frame.invert(self.place.tool);
        if before != self.frame.shift {
            self.out.shifts.push((self.next_move(), self.frame.shift));
        }
    }

    fn words_mm(&self, words: &Words) -> [Option<f64>; 3] {
        AXES.map(|axis| words.get(axis).map(|value| value * self.modal.unit_mm()))
    }

    /// G10, G52, G92 and its variants.
    pub(crate) fn offset(&mut self, words: &Words, code: u16) {
        let axis_words = self.words_mm(words);
        if words.has_any(b"ABC") && self.rotary.at != [0.0; 3] {
            self.rotary.zero_lost = true;
        }
        match code {
            520 if self.dialect().g52_is_g92 => {
                set(&mut self.frame.g92, axis_words);
                (self.frame.g92_aside, self.frame.g92_said) = (self.frame.g92, true);
            }
            520 => set(&mut self.frame.local, axis_words),
            920 => {
                if (0..3).any(|axis| axis_words[axis].is_some() && self.place.is_open(axis)) {
                    self.stand_at(axis_words);
                }
                let rest = self.frame.invert(self.place.tool);
                for (axis, word) in axis_words.iter().enumerate() {
                    if let Some(value) = word {
                        self.frame.g92[axis] += rest[axis] - value;
                        self.place.known[axis] = true;
                        (self.place.elsewhere[axis], self.place.by_switch[axis]) = (false, false);
                    }
                }
                // It takes the place of the local shift of these axes (Fanuc B-64304EN, Local coordinate system).
                for axis in (0..3).filter(|axis| axis_words[*axis].is_some()) {
                    self.frame.g92[axis] += std::mem::take(&mut self.frame.local[axis]);
                }
                (self.frame.g92_aside, self.frame.g92_said) = (self.frame.g92, true);
            }
            921 => {
                (self.frame.g92, self.frame.g92_aside) = (Vec3::zeros(), Vec3::zeros());
                self.frame.g92_said = true;
            }
            922 => self.frame.g92 = Vec3::zeros(),
            923 => {
                if !self.frame.g92_said {
                    // What an earlier program left there.
                    self.doubt(Doubt::ZeroShift, self.flow.source.program().span(self.block.id));
                }
                self.frame.g92 = self.frame.g92_aside;
            }
            680 if words.has_any(b"IJK") => {
                let place = words.g.first().map_or_else(Default::default, |g| g.1);
                self.lose_frame(place, "a rotation in space (G68 with I, J, K)", "G69 ends it");
            }
            680 => self.rotate(words, axis_words),
            690 => {
                self.frame.rotation = None;
                self.regain_frame();
            }
            510 => self.scale(words, axis_words),
            511 => self.mirror(axis_words, -1.0),
            501 => self.mirror(axis_words, 1.0),
            500 => self.frame.scale = None,
            _ => self.g10(words, axis_words),
        }
        self.reframe();
    }

    /// G68: turns the coordinates about a point of the plane (where the tool is, if none is named).
    fn rotate(&mut self, words: &Words, axis_words: [Option<f64>; 3]) {
        let plane = self.modal.plane;
        let (a, b, _) = plane.axes();
        if words.has_any(b"AB") {
            let place = words.span(b'A').or(words.span(b'B')).unwrap_or_default();
            return self.misread(
                "nc::unknown-word",
                place,
                "A and B of G68 are not followed",
                "name the centre by X and Y",
            );
        }
        let mut centre = self.place.programmed;
        for axis in [a, b] {
            centre[axis] = axis_words[axis].unwrap_or(centre[axis]);
        }
        let degrees = words.get(b'R').unwrap_or(0.0);
        let before = self.frame.rotation.map_or(0.0, |(_, _, angle)| if self.modal.incremental { angle } else { 0.0 });
        self.frame.rotation = Some((plane, centre, before + degrees.to_radians()));
    }

    /// G51: scales about a point, where none is named about the tool, by P (in thousandths on a Fanuc when it has no decimal point) or by I, J, K.
    fn scale(&mut self, words: &Words, axis_words: [Option<f64>; 3]) {
        if self.dialect().g51_has_factors && !words.has_any(b"PIJK") {
            let factors = Vec3::from_fn(|axis, _| words.get(AXES[axis]).filter(|factor| *factor != 0.0).unwrap_or(1.0));
            self.frame.scale = Some((Vec3::zeros(), factors));
            return;
        }
        let none_named = axis_words.iter().all(Option::is_none);
        let omitted = |axis: usize| if none_named { self.place.programmed[axis] } else { 0.0 };
        let centre = Vec3::from_fn(|axis, _| axis_words[axis].unwrap_or(omitted(axis)));
        let factor = |letter: u8| {
            let value = words.get(letter)?;
            let text = words.span(letter).unwrap_or_default().of(self.flow.source.program().text());
            let thousandths = self.dialect().scales_in_thousandths && !text.contains(&b'.');
            Some(if thousandths { value * 1e-3 } else { value }).filter(|value| *value != 0.0)
        };
        let whole = factor(b'P').unwrap_or(1.0);
        let factors = Vec3::from_fn(|axis, _| factor(b"IJK"[axis]).unwrap_or(whole));
        // Whether an axis that is not named has its centre at the zero or at the tool differs from control to control.
        let is_open = |axis: usize| self.place.is_open(axis) || !none_named && self.place.programmed[axis] != 0.0;
        if (0..3).any(|axis| axis_words[axis].is_none() && factors[axis] != 1.0 && is_open(axis)) {
            self.doubt(Doubt::ZeroShift, self.flow.source.program().span(self.block.id));
        }
        self.frame.scale = Some((centre, factors));
    }

    /// G51.1, G50.1: mirrors the named axes about the named point, or stops it.
    fn mirror(&mut self, axis_words: [Option<f64>; 3], sign: f64) {
        let (mut centre, mut factor) = self.frame.scale.unwrap_or((Vec3::zeros(), Vec3::repeat(1.0)));
        for (axis, word) in axis_words.into_iter().enumerate() {
            if let Some(at) = word {
                centre[axis] = at;
                factor[axis] = sign * factor[axis].abs();
            }
        }
        self.frame.scale = Some((centre, factor));
    }

    fn g10(&mut self, words: &Words, axis_words: [Option<f64>; 3]) {
        let place = words.g.first().map_or_else(Default::default, |g| g.1);
        let level = words.get(b'L').unwrap_or(0.0);
        if let (13.0, Some(number), Some(value)) = (level, words.get(b'P'), words.get(b'R')) {
            let (number, value) = (number.max(0.0) as u32, value * self.modal.unit_mm());
            let known = |table: &[(u32, f64)]| table.iter().rfind(|(d, _)| *d == number).map(|(_, wear)| *wear);
            let before = known(&self.compensation.wear_set).or_else(|| known(&self.env.wear_mm)).unwrap_or(0.0);
            self.compensation.wear_set.push((number, if self.modal.incremental { before + value } else { value }));
            return;
        }
        let at_tool = self.dialect().origin_at_tool.unwrap_or(true);
        let written = words.get(b'P').map(|p| p.max(0.0) as u32);
        // Without an L it is an offset of memory A, which holds lengths and radii alike.
        if [1.0, 10.0, 11.0].contains(&level) || (level == 0.0 && words.has(b'R') && !at_tool) {
            self.length_is_written(written);
        }
        // LinuxCNC and its kin have radii in R of any of them, others in L12; memory A has lengths and radii alike.
        let of_radius = if at_tool { [1.0, 10.0, 11.0] } else { [0.0, 1.0, 12.0] };
        if let (true, Some(number), Some(radius)) = (of_radius.contains(&level), written, words.get(b'R')) {
            self.compensation.radius_written.push((number, radius * self.modal.unit_mm()));
        }
        if !TOOL_DATA.contains(&level) && !ORIGINS.contains(&level) {
            self.doubt(Doubt::UnknownCode, place);
        }
        if !ORIGINS.contains(&level) {
            self.say("nc::g10", Severity::Note, place, "this G10 does not move the tool here", "");
            return;
        }
        if let (true, Some(degrees)) = (at_tool, words.get(b'R')) {
            // LinuxCNC: the offset is turned as well.
            let wcs = words.get(b'P').unwrap_or(0.0) as u16;
            let was_turned = !self.offsets.turned.is_empty();
            self.offsets.turned.retain(|number| *number != wcs);
            if degrees != 0.0 {
                self.offsets.turned.push(wcs);
                self.lose_frame(place, "a turned work offset (R of G10)", "R0 of the same offset ends it");
            } else if was_turned && self.offsets.turned.is_empty() {
                self.regain_frame();
            }
        }
        let number = words.get(b'P').unwrap_or(0.0) as u16;
        // L20 sets the zero at the tool in LinuxCNC and its kin, and writes additional offsets elsewhere.
        if words.get(b'L') == Some(20.0) && self.dialect().origin_at_tool.is_none() {
            self.doubt(Doubt::ZeroShift, place);
        }
        let level = if at_tool { level } else { 2.0 };
        let wcs = match number {
            0 => self.modal.wcs,
            _ if words.get(b'L') == Some(20.0) && !at_tool => additional_offset(words),
            _ => 53 + number,
        };
        let known = self.env.origins.iter().any(|(number, _)| *number == wcs);
        if level == 20.0 && (0..3).any(|axis| axis_words[axis].is_some() && self.place.is_open(axis)) {
            self.stand_at(axis_words);
        }
        let mut change = self.frame.change_of(wcs);
        let origin = self.env.origin(wcs);
        for (axis, word) in axis_words.iter().enumerate() {
            let Some(value) = word else { continue };
            change[axis] = if level == 20.0 {
                self.place.tool[axis] - self.frame.g92[axis] - self.frame.local[axis] - value
            } else if self.modal.incremental {
                change[axis] + value
            } else {
                value - origin[axis]
            };
        }
        let agrees = |axis: usize| axis_words[axis].is_none_or(|value| (value - origin[axis]).abs() <= AGREES_MM);
        self.offsets.unstated.retain(|number| *number != wcs);
        if level == 2.0 && !self.modal.incremental && !(known && (0..3).all(agrees)) {
            self.offsets.unstated.push(wcs);
        }
        self.doubt_of_origin();
        self.frame.changed.retain(|(number, _)| *number != wcs);
        self.frame.changed.push((wcs, change));
    }

    /// G28, G30: through a point on the way to the reference point, in the axes that are named (all, if none is).
    pub(crate) fn home(&mut self, words: &Words) {
        let axis_words = self.words_mm(words);
        let turns = words.has_any(b"ABC");
        let named = if turns || axis_words.iter().any(Option::is_some) {
            axis_words.map(|word| word.is_some())
        } else {
            [true; 3]
        };
        if turns {
            self.rotary_home(words);
        }
        if axis_words.iter().any(Option::is_some) {
            let target = self.target(words);
            self.line_to(MoveKind::Rapid, target);
        }
        let mut to = self.place.tool;
        (0..3).filter(|&axis| named[axis]).for_each(|axis| self.place.assumed[axis] = false);
        if self.env.home_mm.is_none() {
            (0..3).filter(|&axis| named[axis]).for_each(|axis| self.place.elsewhere[axis] = true);
        }
        match self.env.home_mm {
            Some(home) => {
                let home = home - self.env.origin(self.modal.wcs);
                (0..3).filter(|&axis| named[axis]).for_each(|axis| to[axis] = home[axis]);
            }
            None if named[2] => to.z = to.z.max(self.env.clear_z_mm),
            None => {}
        }
        self.tool_to(MoveKind::Rapid, Curve::Line { from: self.place.tool, to });
        self.place.programmed = self.frame.invert(self.place.tool);
    }
}

/// G54.1 P, G54 P, G154 P: the additional offset of this number.
fn additional_offset(words: &Words) -> u16 {
    BEFORE_ADDITIONAL_OFFSETS + words.get(b'P').unwrap_or(1.0).clamp(1.0, f64::from(ADDITIONAL_OFFSETS)) as u16
}

fn set(shift: &mut Vec3, axis_words: [Option<f64>; 3]) {
    for (axis, word) in axis_words.into_iter().enumerate() {
        if let Some(value) = word {
            shift[axis] = value;
        }
    }
}
