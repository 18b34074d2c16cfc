//! G and M codes that put something in force: modes, units, offsets, feed, speed, tool. In: the words of a block. Out: changed state.

use super::interpreter::{Family, Interpreter, Setting};
use super::state::{Action, FeedWord, Length, Modal, Motion};
use super::words::Words;
use crate::diag::{Severity, Span};
use crate::ids::BlockId;
use crate::nc::doubt::Doubt;
use crate::nc::toolpath::{Event, FeedMode, Freeze, PathMode};
use crate::path::Plane;
use crate::units::rps_from_rpm;

impl<F: Family> Interpreter<'_, F> {
    /// Executes the words of a block in the order a control does.
    pub(crate) fn execute(&mut self, words: &Words) {
        let mut action = Action::Move;
        let mut stated = false;
        let path_mode = self.modal.path_mode;
        let unit_before = self.modal.unit_mm();
        let before = self.modal;
        for &(code, span) in &words.g {
            self.setting(code, span, words, &mut action, &mut stated);
        }
        if self.block.misread.is_some() {
            self.modal = Modal { wcs: self.modal.wcs, ..before };
            return;
        }
        if words.g.is_empty() && self.sets_the_firmware(words) {
            action = Action::Keep;
        }
        if F::takes_all_words(self, words) {
            return;
        }
        if !matches!(self.modal.motion, Motion::Cycle(_)) {
            self.cycles.modal = None;
        }
        if let Some(value) = words.get(b'F')
            && action != Action::Dwell
        {
            self.feed_word(value, words, unit_before);
        }
        self.speed_and_tool(words);
        self.length_by_word(words);
        if F::calls_after_motions(self) {
            self.block.freeze = self.block.freeze.or(Some(Freeze::Cycle));
        }
        match action {
            Action::Move | Action::Machine => {
                self.motion(words, action == Action::Machine, stated);
            }
            Action::Home => self.home(words),
            Action::Offset(code) => self.offset(words, code),
            Action::Dwell => self.dwell(words),
            Action::Keep => {}
        }
        F::after_motion(self, words, matches!(action, Action::Move | Action::Machine));
        if words.has_g(90) {
            self.modal.path_mode = path_mode;
        }
        if words.has_g(630) && self.modal.motion == Motion::Synchronised {
            self.modal.motion = before.motion;
        }
        if self.corners.next.is_some() {
            self.corners.feed = self.corners.next_feed.or(self.corners.modal_feed);
        }
        self.corners.next_feed = None;
        self.corners.now = self.corners.next.take().or(self.corners.now.take());
        self.stops(words);
        F::after_block(self, words);
    }

    fn setting(&mut self, code: u16, span: Span, words: &Words, action: &mut Action, stated: &mut bool) {
        match F::setting(self, code, span, words) {
            Setting::AsEverywhere => {}
            Setting::Done => return,
            Setting::Machine => return *action = Action::Machine,
        }
        let dialect = self.dialect();
        let modal = &mut self.modal;
        let mut motion = |kind: Motion| {
            modal.motion = kind;
            if !matches!(kind, Motion::Cycle(_)) {
                modal.group_one = kind;
            }
            *stated = true;
        };
        match code {
            0 => motion(Motion::Rapid),
            10 => motion(Motion::Feed),
            20 => motion(Motion::Clockwise),
            30 => motion(Motion::CounterClockwise),
            320 | 330 => motion(Motion::Synchronised),
            331 => motion(Motion::RigidTap),
            630 => self.tapping_mode(words),
            310 | 380..=385 => motion(Motion::Probe),
            730 | 740 | 760 | 810 | 820 | 830 | 840 | 850 | 860 | 870 | 880 | 890 => motion(Motion::Cycle(code)),
            // Rigid tapping, right and left hand, in the format of Fanuc series 10/11.
            842 => motion(Motion::Cycle(840)),
            843 => motion(Motion::Cycle(740)),
            800 => {
                if !*stated {
                    modal.motion = if dialect.no_motion_after_g80 { Motion::None } else { modal.group_one };
                }
            }
            40 if moves_beside_a_dwell(words, dialect.origin_at_tool != Some(true)) => {
                if dialect.origin_at_tool == Some(true) {
                    self.dwell(words);
                } else {
                    self.misread("nc::dwell", span, "a dwell and a motion stand in one block", "write the dwell alone");
                }
            }
            40 => *action = Action::Dwell,
            170 => modal.plane = Plane::Xy,
            180 => modal.plane = Plane::Zx,
            190 => modal.plane = Plane::Yz,
            200 | 210 => modal.inch = code == 200,
            280 | 300 => *action = Action::Home,
            530 => *action = Action::Machine,
            100 | 520 | 920..=923 | 680 | 690 | 510 | 511 | 500 | 501 => *action = Action::Offset(code),
            281 | 301 => {
                // Mach3 goes to its reference switches there.
                if dialect.g51_has_factors {
                    self.place.elsewhere = [true; 3];
                }
                *action = Action::Keep;
            }
            540 | 541 | 550 | 560 | 570 | 580 | 590..=593 | 1540 => self.select_wcs(code, words),
            610 => (modal.path_mode, modal.tapping) = (PathMode::ExactPath, false),
            620 => modal.tapping = false,
            90 | 611 => modal.path_mode = PathMode::ExactStop,
            640 => {
                let tolerance = words.get(b'P').map(|p| p * modal.unit_mm());
                modal.tapping = false;
                modal.path_mode = tolerance.map_or(PathMode::Continuous, PathMode::Tolerance);
            }
            900 | 910 => modal.incremental = code == 910,
            901 | 911 => modal.absolute_centres = code == 901,
            930 => self.feed_mode(FeedMode::InverseTime, words),
            940 => self.feed_mode(FeedMode::PerMinute, words),
            950 => self.feed_mode(FeedMode::PerRev, words),
            400 => self.switch_compensation(0.0, false, words, span),
            410 | 411 => self.switch_compensation(1.0, code == 411, words, span),
            420 | 421 => self.switch_compensation(-1.0, code == 421, words, span),
            150 if !words.has(b'H') => self.modal.polar = None,
            160 if dialect.g51_has_factors => {
                self.misread("nc::polar", span, "G16 about the place of the tool is not followed", "write coordinates");
            }
            160 if !words.has(b'H') => self.modal.polar = self.modal.polar.or(Some((0.0, 0.0))),
            70 => self.refuse_lathe(span, "G7 (diameter mode)"),
            80 if dialect.g8_is_for_lathes => self.refuse_lathe(span, "G8 (radius mode)"),
            50 | 51 if looks_ahead(words) && !dialect.g8_is_for_lathes => {}
            120 | 130 => {
                *action = Action::Keep;
                self.uses_feed();
                self.cuts_unseen();
                let text = "the circular pocket is kept, not simulated";
                self.not_understood("nc::cycle", span, text, "what it cuts is not known to the simulation");
            }
            682..=684 => {
                *action = Action::Keep;
                self.lose_frame(span, "a tilted plane", "G69 ends it");
            }
            121 | 1070 | 1120 => self.lose_frame(span, "cylindrical or polar interpolation", "its own code ends it"),
            1130 if dialect.g110_is_offset && !self.frame.lost => self.doubt(Doubt::WorkOffset, span),
            1100..=1290 if dialect.g110_is_offset && ![1120, 1130].contains(&code) => {
                self.doubt(Doubt::WorkOffset, span);
            }
            131 | 1130 => self.regain_frame(),
            // Tool centre point control, and the offset that turns with the table (Haas G254).
            434 | 435 | 2340 | 2540 => self.doubt(Doubt::TiltedFrame, span),
            430 | 440 | 490 | 2550 => {
                if !self.frame.lost {
                    self.settle(Doubt::TiltedFrame);
                }
                self.length_by_code(code, words);
            }
            960 => self.doubt(Doubt::SurfaceSpeed, span),
            970 => self.spindle_is_known(Doubt::SurfaceSpeed),
            // LinuxCNC: a length of its own, a further one added.
            431 | 432 => self.tool_length.now = Length::Other,
            // With coordinates G11 shifts and turns them, with H G15 and G16 take in an origin (Okuma OSP).
            110 if !words.has_any(b"XYZ") => {}
            80 | 531 | 1030 | 1870 => {}
            980 | 990 => modal.retract_to_r = code == 990,
            _ => {
                let text = String::from_utf8_lossy(span.of(self.flow.source.program().text())).into_owned();
                self.misread("nc::unknown-g", span, format!("{text} is not known here"), "the block is left as it is");
            }
        }
    }

    /// G63 with a motion of its own is one tapping stroke (Siemens); for the others it is a mode until G61, G62 or G64.
    fn tapping_mode(&mut self, words: &Words) {
        self.modal.tapping = self.dialect().g63_is_modal;
        let own = words.g.iter().any(|(code, _)| matches!(code, 0 | 10 | 20 | 30));
        if !own && words.has_any(b"XYZ") {
            self.modal.motion = Motion::Synchronised;
        }
    }

    /// Freezes everything after a word that only lathes have: they read X as a diameter.
    fn refuse_lathe(&mut self, span: Span, what: &str) {
        let text = format!("{what} belongs to a lathe");
        self.say(
            "nc::lathe",
            Severity::Error,
            span,
            text,
            "feeds are kept from here on: this is not a milling program",
        );
        self.block.freeze = Some(Freeze::NotUnderstood);
        self.frame.lost = true;
    }

    /// Ends a frame that could not be followed: the coordinates are known again.
    pub(crate) fn regain_frame(&mut self) {
        self.frame.lost = false;
        self.settle(Doubt::TiltedFrame);
    }

    /// Begins a frame that cannot be followed, because `what` turns or bends the coordinates: all feeds are frozen until it ends.
    pub(crate) fn lose_frame(&mut self, place: Span, what: &str, help: &str) {
        self.frame.lost = true;
        self.doubt(Doubt::TiltedFrame, place);
        let text = format!("{what} is not followed: feeds are kept until it ends");
        self.not_understood("nc::frame", place, text, help);
    }

    /// Another unit of feed: none is in force. Some controls keep the number and read it in the new unit, so without an F in the block the
    /// one before it counts as used.
    pub(crate) fn feed_mode(&mut self, mode: FeedMode, words: &Words) {
        if self.modal.feed_mode != mode {
            if !words.has(b'F') {
                self.uses_feed();
            }
            self.modal.feed_mode = mode;
            self.modal.feed = FeedWord { value: 0.0, word: None, computed: false };
        }
    }

    /// Unit of length of an F word, mm.
    pub(crate) fn feed_unit_mm(&self) -> f64 {
        self.program.dialect().feed_unit_mm(self.modal.inch)
    }

    /// F. LinuxCNC reads it in the unit in force before a G20 or G21 of the same block, the others in the new one.
    pub(crate) fn feed_word(&mut self, value: f64, words: &Words, unit_before: f64) {
        let early = self.dialect().feed_before_unit;
        let unit = match self.modal.feed_mode {
            FeedMode::InverseTime => 1.0,
            _ if early => unit_before,
            _ => self.feed_unit_mm(),
        };
        let computed = words.is_computed(b'F');
        let span = words.span(b'F').unwrap_or_default();
        if value <= 0.0 {
            self.say("nc::feed-not-positive", Severity::Warning, span, "the feed is not positive", "write one above 0");
        }
        let place = self.linked_at().filter(|_| !computed);
        let word = place.map(|(block, byte)| {
            (BlockId(block + self.block.id.0), Span { start: byte + span.start, end: byte + span.end })
        });
        self.modal.feed = FeedWord { value: value.max(0.0) * unit, word, computed: word.is_none() };
    }

    fn speed_and_tool(&mut self, words: &Words) {
        let before = self.modal.spin();
        self.d_alone(words);
        // Behind G4 it is a number of turns to dwell.
        let limits = self.dialect().g92_limits_speed && words.has_g(920);
        if let Some(rpm) = words.get(b'S').filter(|_| !words.has_g(40)) {
            let highest = if limits { &mut self.modal.most_rps } else { &mut self.modal.speed_rps };
            *highest = rps_from_rpm(rpm.abs());
            if self.modal.speed_rps > self.modal.most_rps {
                // Whether the limit holds under G97 too is a setting of the control.
                self.doubt(Doubt::SurfaceSpeed, words.span(b'S').unwrap_or_default());
            }
        }
        if let Some(number) = words.get(b'T') {
            self.modal.next_tool = number.clamp(0.0, f64::from(u32::MAX)) as u32;
            if self.spindle.t_changes_tool {
                self.change_tool();
            }
        }
        for &(code, place) in &words.m {
            if let Some(turning) = self.turning_by(code) {
                if turning < 0 {
                    self.doubt(Doubt::Reversed, place);
                } else {
                    self.spindle_is_known(Doubt::Reversed);
                }
                self.modal.turning = turning;
            }
            self.modal.coolant = self.coolant_by(code).unwrap_or(self.modal.coolant);
            match code {
                610 => self.modal.tool = words.get(b'Q').map_or(self.modal.tool, |q| q.max(0.0) as u32),
                60 => {
                    self.spindle_is_known(Doubt::Reversed);
                    if !words.m.iter().any(|(code, _)| self.turning_by(*code).is_some_and(|turning| turning != 0)) {
                        self.modal.turning = 0;
                    }
                    self.change_tool();
                }
                _ => {}
            }
        }
        self.take_speed_of_setup(words);
        let spin = self.modal.spin();
        if spin != before {
            self.event(Event::Spindle { spin, line: self.line_number() });
        }
    }

    /// How the spindle turns after an M code: 1 clockwise, -1 counter-clockwise, 0 not at all; `None`: as before. M13 and M14 switch the coolant
    /// on as well. After M19 it stands at an angle until it is started again.
    fn turning_by(&self, code: u16) -> Option<i8> {
        match code {
            30 => Some(1),
            40 => Some(-1),
            50 | 190 => Some(0),
            130 if self.dialect().m13_starts_spindle => Some(1),
            140 if self.dialect().m13_starts_spindle => Some(-1),
            _ => None,
        }
    }

    /// Is coolant or mist on after an M code? M7 and M8 switch it on, M9 off (ISO 6983-1), M13 and M14 where they start the spindle; `None`: as
    /// before.
    fn coolant_by(&self, code: u16) -> Option<bool> {
        match code {
            70 | 80 => Some(true),
            90 => Some(false),
            130 | 140 if self.dialect().m13_starts_spindle => Some(true),
            _ => None,
        }
    }

    /// Where the program has set no S so far, takes the spindle speed of the setup for the tool. If nothing in the program starts the
    /// spindle, it counts as started by hand.
    fn take_speed_of_setup(&mut self, words: &Words) {
        self.spindle.speed_said |= words.has(b'S');
        if self.spindle.speed_said || self.env.speeds_rps.is_empty() {
            return;
        }
        let known = self.env.speeds_rps.iter().find(|(tool, _)| *tool == self.modal.tool);
        self.modal.speed_rps = known.map_or(0.0, |(_, speed)| *speed);
        if known.is_some() && self.spindle.by_hand {
            self.modal.turning = 1;
        }
    }

    /// Number of the tool whose name stands in quotes in this place, 0 with a diagnostic where the setup does not tell it;
    /// `None`: there is no name.
    pub(crate) fn tool_by_name(&mut self, place: Span, text: &[u8]) -> Option<f64> {
        let bytes = place.of(text);
        let from = bytes.iter().position(|&byte| byte == b'"')? + 1;
        let length = bytes[from..].iter().position(|&byte| byte == b'"').unwrap_or(bytes.len() - from);
        let name = String::from_utf8_lossy(&bytes[from..from + length]).into_owned();
        let known = self.env.tool_names.iter().find(|(known, _)| known.eq_ignore_ascii_case(&name));
        if known.is_none() {
            let said = format!("the tool {name} has no number here");
            let help = format!("write it under [machine]: tool_names = {{ \"{name}\" = 1 }}");
            self.say("nc::tool-name", Severity::Warning, place, said, &help);
        }
        Some(known.map_or(0.0, |(_, number)| f64::from(*number)))
    }

    fn change_tool(&mut self) {
        self.modal.tool = self.modal.next_tool;
        self.tool_length.comes_in(self.modal.tool);
        self.event(Event::Tool { number: self.modal.tool, line: self.line_number() });
    }

    /// `M92 X100`, `M203 X5000`: steps, speeds, accelerations of a firmware; its words are no positions (marlinfw.org, G-code
    /// index: M92, M201, M203–M206, M211, M566, M665, M666, M851, M906). No control of the other families has these with axis words.
    fn sets_the_firmware(&self, words: &Words) -> bool {
        const SETTINGS: [u16; 12] = [920, 2010, 2030, 2040, 2050, 2060, 2110, 5660, 6650, 6660, 8510, 9060];
        self.dialect().settings_by_m && words.m.iter().any(|m| SETTINGS.contains(&m.0))
    }

    /// The same, and the dialect may be such a firmware.
    fn firmware_speaks(&self, words: &Words) -> bool {
        self.dialect().firmware && self.sets_the_firmware(words)
    }

    fn dwell(&mut self, words: &Words) {
        let long = self.dwell_seconds(words, b'P').or(words.get(b'X')).or(words.get(b'U')).or(words.get(b'F'));
        let rps = self.modal.spin().rps;
        let turns = words.get(b'S').filter(|_| rps > 0.0).map(|turns| turns / rps);
        let seconds = long.or(turns).unwrap_or(0.0).max(0.0);
        self.event(Event::Dwell { seconds, line: self.line_number() });
    }

    /// A dwell word in s: Fanuc and Haas count ms where there is no decimal point.
    pub(crate) fn dwell_seconds(&self, words: &Words, letter: u8) -> Option<f64> {
        let value = words.get(letter)?;
        let counts_ms = self.dialect().counts_increments;
        let text = words.span(letter).unwrap_or_default().of(self.flow.source.program().text());
        Some(if counts_ms && !text.contains(&b'.') { value * 1e-3 } else { value }.max(0.0))
    }

    pub(crate) fn stops(&mut self, words: &Words) {
        for &(code, place) in &words.m {
            let end = matches!(code, 20 | 300);
            if end || matches!(code, 0 | 10 | 600) {
                self.event(Event::Stop { line: self.line_number(), end });
            }
            match code {
                // M1 is no doubt: with its switch off the control passes it, so that nothing in the program can rely on it.
                0 | 600 => self.doubt(Doubt::ProgramStop, place),
                _ if !self.program.dialect().knows_m(code) && !self.firmware_speaks(words) => {
                    self.doubt(Doubt::UnknownCode, place);
                }
                _ => {}
            }
            self.flow.ended |= end;
        }
    }

    /// Why a feed move made now must keep its feed, as far as its F word says.
    pub(crate) fn feed_freeze(&self) -> Option<Freeze> {
        let feed = &self.modal.feed;
        if feed.computed {
            Some(Freeze::Expression)
        } else if feed.word.is_none() || feed.value <= 0.0 {
            Some(Freeze::NoFeed)
        } else {
            None
        }
    }
}

/// Does a block with G4 name a motion? X alone is the time of a Fanuc or Haas.
fn moves_beside_a_dwell(words: &Words, x_is_time: bool) -> bool {
    let stated = words.g.iter().any(|(code, _)| matches!(code, 0 | 10 | 20 | 30));
    words.has_any(b"YZ") || words.has(b'X') && (stated || !x_is_time)
}

/// G5 P10000, G5.1 Q1: the control reads ahead. G5 P10001 L2 runs motions that are stored in variables.
fn looks_ahead(words: &Words) -> bool {
    let value = words.get(b'P').or(words.get(b'Q'));
    !words.has_any(b"XYZL") && value.is_some_and(|value| [0.0, 1.0, 2.0, 3.0, 10000.0].contains(&value))
}
