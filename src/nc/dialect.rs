//! Dialects of NC text. In: a name of the setup or the command line, or what [`super::recognise`] found. Out: a row of [`TABLE`]: how the
//! dialect writes comments and numbers, and which of several meanings a word has on its controls. What a whole family of dialects reads
//! differently is in the folder of the family.
//!
//! The M codes listed here neither move the part nor change a frame. All others may be macros of the machine builder or of the shop (Fanuc
//! parameters 6071 to 6089 and LinuxCNC's M100 to M199 call programs). Sources: Haas Mill Operator's Manual, list of M-codes; LinuxCNC 2.9,
//! "M-Codes"; Siemens 840D Programming Guide Fundamentals, predefined M functions; HEIDENHAIN TNC 640 Klartext manual, overview of
//! miscellaneous functions.

use super::parameters::{LASTING_Q, LOCAL_Q, Language};
use crate::units::MM_PER_INCH;
use std::ops::RangeInclusive;

/// A family of controls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Dialect {
    /// ISO 6983 with nothing special.
    Generic,
    /// Fanuc and its relatives.
    Fanuc,
    /// Haas.
    Haas,
    /// LinuxCNC.
    LinuxCnc,
    /// GRBL, Mach3 and other hobby controls.
    Grbl,
    /// Siemens 840D.
    Siemens,
    /// Heidenhain plain language.
    Heidenhain,
}

/// A family of dialects: decides which lexer reads the lines and which folder reads the blocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Syntax {
    /// Letters and numbers, `( )` and `;` comments, `#` parameters.
    Rs274,
    /// Names with `=`, arguments in parentheses, `;` comments.
    Siemens,
    /// Plain language.
    Heidenhain,
}

/// How a comment is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommentForm {
    /// `( … )`
    Parentheses,
    /// `; …` to the end of the line.
    Semicolon,
}

impl CommentForm {
    /// `text` in this form. Parentheses in it are replaced, so that it neither ends early nor holds another comment.
    pub fn write(self, text: &str) -> String {
        let text = text.replace('(', "[").replace(')', "]");
        match self {
            CommentForm::Parentheses => format!("({text})"),
            CommentForm::Semicolon => format!("; {text}"),
        }
    }
    /// The form of a comment that is given with its delimiters; `None`: it is not a comment.
    pub fn of(comment: &[u8]) -> Option<CommentForm> {
        match comment.first() {
            Some(b'(') => Some(CommentForm::Parentheses),
            Some(b';') => Some(CommentForm::Semicolon),
            _ => None,
        }
    }
}

/// The properties in which dialects differ.
#[derive(Debug, Clone)]
pub(crate) struct Properties {
    dialect: Dialect,
    /// Name in the setup file and on the command line.
    name: &'static str,
    /// Family it belongs to.
    syntax: Syntax,
    /// Forms of comments that may be written for it, the one that every control of the family reads first.
    comments: &'static [CommentForm],
    /// Longest line the control reads, bytes without a line end of one byte, when nothing else is said.
    max_line_length: usize,
    /// No control of the family reads longer lines, whatever the setup says.
    pub(crate) refuses_longer_lines: bool,
    /// Millimetres in the unit of length of F in a program in inches.
    pub(crate) feed_inch_mm: f64,
    /// Digits after the point that an F word per minute may carry when the program shows none: mm, inch.
    feed_digits: [usize; 2],
    /// Digits that a number may have in all; `None`: as many as it has decimals.
    number_digits: Option<usize>,
    /// Decimals that a number may have.
    decimals: usize,
    /// Older controls of the family read a number without a point in increments, and dwells in ms.
    pub(crate) counts_increments: bool,
    /// Blocks are numbered without a gap: no line can be put in, none can be cut in pieces.
    pub(crate) counts_blocks: bool,
    /// A T word alone brings the tool in, where the program has no M6.
    t_changes_tool: bool,
    /// M codes of its own that leave part and frame alone.
    m_codes: &'static [RangeInclusive<u16>],
    /// Numbered variables from here on outlast the program or belong to the control, so that setting one has an effect outside.
    pub(crate) lasting_variables_from: u32,
    /// Macro B: a variable that was never set is vacant, not 0; those from [`PERMANENT`] on outlast the program.
    pub(crate) macro_b: bool,
    /// The control acts on comments that begin with MSG, PRINT, LOG …
    pub(crate) active_comments: bool,
    /// A line that begins with `$` is a command to the control.
    pub(crate) dollar_commands: bool,
    /// M92, M203 … with axis words set a firmware, and are no positions; other families have these codes for something else.
    pub(crate) settings_by_m: bool,
    /// It may be the firmware of a printer or router: M92, M203 … set that firmware.
    pub(crate) firmware: bool,
    /// M13 and M14 start the spindle clockwise and counter-clockwise, with coolant; on a Haas M13 belongs to the brake of a rotary axis.
    pub(crate) m13_starts_spindle: bool,
    /// `,R` and `,C` round or chamfer a corner.
    pub(crate) corner_words: bool,
    /// F is taken in before G20 and G21 of its block.
    pub(crate) feed_before_unit: bool,
    /// Cycles return to R (G99) at switch-on.
    pub(crate) retract_to_r: bool,
    /// No motion is in force after G80; elsewhere that of group 1 is again.
    pub(crate) no_motion_after_g80: bool,
    /// G76 is the threading cycle.
    pub(crate) g76_cuts_threads: bool,
    /// K of a cycle says how often it is repeated.
    pub(crate) k_repeats: bool,
    /// Depth and R plane of a cycle stay where they were when G90 changes to G91; elsewhere they are then counted as steps.
    pub(crate) cycles_keep_levels: bool,
    /// R of a cycle may be left out: the plane is then the level the cycle began at.
    pub(crate) r_plane_optional: bool,
    /// F of a compensated arc holds along the contour at switch-on, and not along the path of the tool.
    pub(crate) arcs_feed_along_contour: bool,
    /// G84 and G89 come out at feed as far as the cycle returns, others go on at rapid from R; G87 steps aside before it stops
    /// the spindle.
    pub(crate) cycles_out_at_feed: bool,
    /// P of G51 counts thousandths where it has no point.
    pub(crate) scales_in_thousandths: bool,
    /// G63 is a mode until G61, G62 or G64; else it is one tapping stroke.
    pub(crate) g63_is_modal: bool,
    /// G8 sets the radius mode of a lathe; elsewhere G5 and G8 with P or Q read ahead.
    pub(crate) g8_is_for_lathes: bool,
    /// G41 and G42 always mean that the control offsets the contour, by the tool that D names.
    pub(crate) always_offsets: bool,
    /// D beside G41 names a tool; else an edge or an offset of the tool in the spindle.
    pub(crate) d_names_tool: bool,
    /// Blocks are jumped to by their N numbers, or by labels that stand in them.
    pub(crate) jumps_to_numbers: bool,
    /// G10 L20 sets the zero at the tool; false: it writes an additional work offset; `None`: which is not known.
    pub(crate) origin_at_tool: Option<bool>,
    /// S beside G92 is the highest speed of the spindle, not its speed.
    pub(crate) g92_limits_speed: bool,
    /// G110 to G129 are additional work offsets.
    pub(crate) g110_is_offset: bool,
    /// M99 P of a subprogram goes on there, in the subprogram; elsewhere it returns to that block of the caller.
    pub(crate) m99_stays_within: bool,
    /// Numbered variables that are local to a call with arguments.
    pub(crate) locals: RangeInclusive<u32>,
    /// G52 and G92 set one and the same shift.
    pub(crate) g52_is_g92: bool,
    /// X, Y and Z of G51 are factors, and G16 has its pole where the tool stands.
    pub(crate) g51_has_factors: bool,
    /// G53 under G91 is left out.
    pub(crate) g53_needs_g90: bool,
    /// G93: F of an arc is the speed over its radius, not over its length.
    pub(crate) arcs_by_radius: bool,
    /// The entry of radius compensation ends square to the element after it; else to its own end.
    pub(crate) entry_square_to_next: bool,
}

/// Macro B's variables from here to #999 outlast the program; those from #1000 on are the control's own: #3000 is an alarm, #3006
/// a stop (Fanuc B-64304EN, Custom macro, Types of variables, System variables).
pub(crate) const PERMANENT: u32 = 500;
/// M0–M9; spindle with coolant, orientation, ends; calls and returns. Not M10 and M11, which clamp and unclamp by ISO 6983: whether that is an
/// axis, a slide or the part depends on the machine.
const M_EVERYWHERE: &[RangeInclusive<u16>] = &[0..=9, 13..=14, 19..=19, 30..=30, 48..=49, 60..=60, 97..=99];
/// Rigid tapping, gears, call of a file (Fanuc B-64304EN, Auxiliary function); all others are the builder's.
const M_FANUC: &[RangeInclusive<u16>] = &[29..=29, 40..=45, 198..=198];
/// Brakes of the rotary axes, chip conveyor, coolant, gears, air blast, door, graphics, through-spindle coolant, rigid tapping, mist,
/// call (Haas Mill Operator's Manual, M-codes).
const M_HAAS: &[RangeInclusive<u16>] = &[
    10..=13,
    29..=29,
    31..=31,
    33..=35,
    40..=45,
    73..=74,
    80..=81,
    83..=84,
    88..=89,
    135..=135,
    138..=139,
    158..=159,
    198..=198,
];
/// Overrides, tool number, digital and analog outputs, wait for an input, saving the state.
const M_LINUXCNC: &[RangeInclusive<u16>] = &[50..=53, 61..=68, 70..=70];
/// End of a subprogram, gear steps.
const M_SIEMENS: &[RangeInclusive<u16>] = &[17..=17, 40..=45, 70..=70];
/// Machine coordinates, contour behaviour, feed at arcs, tool tip, retract.
const M_HEIDENHAIN: &[RangeInclusive<u16>] =
    &[90..=92, 101..=103, 107..=118, 120..=120, 124..=124, 126..=129, 136..=138, 140..=141, 145..=145, 148..=149];

/// ISO 6983 with nothing special; the other rows say where they differ from it.
const GENERIC: Properties = Properties {
    dialect: Dialect::Generic,
    name: "generic",
    syntax: Syntax::Rs274,
    comments: &[CommentForm::Parentheses, CommentForm::Semicolon],
    max_line_length: 256,
    refuses_longer_lines: false,
    feed_inch_mm: MM_PER_INCH,
    feed_digits: [1, 2],
    number_digits: None,
    decimals: 9,
    counts_increments: false,
    counts_blocks: false,
    t_changes_tool: true,
    m_codes: M_FANUC,
    lasting_variables_from: PERMANENT,
    macro_b: true,
    active_comments: true,
    dollar_commands: false,
    settings_by_m: true,
    firmware: true,
    m13_starts_spindle: true,
    corner_words: true,
    feed_before_unit: false,
    retract_to_r: false,
    no_motion_after_g80: false,
    g76_cuts_threads: false,
    k_repeats: true,
    cycles_keep_levels: false,
    r_plane_optional: false,
    arcs_feed_along_contour: false,
    cycles_out_at_feed: true,
    scales_in_thousandths: false,
    g63_is_modal: true,
    g8_is_for_lathes: false,
    always_offsets: false,
    d_names_tool: true,
    origin_at_tool: None,
    jumps_to_numbers: true,
    // Fanuc B-64304EN, Custom macro, Variables: #1 to #33.
    locals: 1..=33,
    g92_limits_speed: true,
    g110_is_offset: false,
    m99_stays_within: false,
    g52_is_g92: false,
    g51_has_factors: false,
    arcs_by_radius: false,
    g53_needs_g90: false,
    entry_square_to_next: false,
};

/// `;` ends the block there (it is the sign for EOB).
const FANUC: Properties = Properties {
    dialect: Dialect::Fanuc,
    name: "fanuc",
    comments: &[CommentForm::Parentheses],
    feed_digits: [0, 1],
    number_digits: Some(8),
    counts_increments: true,
    t_changes_tool: false,
    active_comments: false,
    firmware: false,
    cycles_keep_levels: true,
    cycles_out_at_feed: false,
    scales_in_thousandths: true,
    // Fanuc B-64304EN, G10 L20 Pn: G54.1 Pn; Haas Mill Operator's Manual: G154 Pn.
    origin_at_tool: Some(false),
    // Fanuc B-62764EN, Inverse time feed: FRN = speed / radius.
    arcs_by_radius: true,
    g53_needs_g90: true,
    entry_square_to_next: true,
    ..GENERIC
};

/// Dialects in the order of [`Dialect::ALL`].
const TABLE: &[Properties] = &[
    GENERIC,
    FANUC,
    // R left out: Haas Mill Operator's Manual, G81. Only L repeats: I, J and K of G73 and G83 are pecks.
    Properties {
        dialect: Dialect::Haas,
        name: "haas",
        m_codes: M_HAAS,
        m13_starts_spindle: false,
        k_repeats: false,
        r_plane_optional: true,
        scales_in_thousandths: false,
        // Haas Mill Operator's Manual: G110 is G154 P1; M99 P.
        g110_is_offset: true,
        arcs_by_radius: false,
        g53_needs_g90: false,
        m99_stays_within: true,
        ..FANUC
    },
    // LinuxCNC 2.9 refuses a line of 254 bytes with its end ("Command too long").
    Properties {
        dialect: Dialect::LinuxCnc,
        name: "linuxcnc",
        origin_at_tool: Some(true),
        jumps_to_numbers: false,
        max_line_length: 252,
        refuses_longer_lines: true,
        t_changes_tool: false,
        m_codes: M_LINUXCNC,
        // LinuxCNC documentation, Parameters: #31 to #5000 are free, what a probe found begins at #5061.
        lasting_variables_from: 5061,
        macro_b: false,
        firmware: false,
        corner_words: false,
        feed_before_unit: true,
        retract_to_r: true,
        no_motion_after_g80: true,
        g92_limits_speed: false,
        locals: 1..=30,
        // LinuxCNC documentation, G92 and G52 interaction: they share the offset registers.
        g52_is_g92: true,
        g76_cuts_threads: true,
        k_repeats: false,
        g8_is_for_lathes: true,
        always_offsets: true,
        ..GENERIC
    },
    Properties {
        dialect: Dialect::Grbl,
        name: "grbl",
        origin_at_tool: Some(true),
        jumps_to_numbers: false,
        max_line_length: 80,
        m_codes: M_LINUXCNC,
        lasting_variables_from: 1000,
        macro_b: false,
        g92_limits_speed: false,
        locals: 1..=30,
        // Mach3 G-code manual, G51 and G16; grblHAL, issue 27.
        g51_has_factors: true,
        dollar_commands: true,
        corner_words: false,
        k_repeats: false,
        ..GENERIC
    },
    Properties {
        // CFC is in force at switch-on: SINUMERIK ONE, NC programming, G group 16.
        dialect: Dialect::Siemens,
        name: "siemens",
        arcs_feed_along_contour: true,
        syntax: Syntax::Siemens,
        comments: &[CommentForm::Semicolon, CommentForm::Parentheses],
        max_line_length: 512,
        feed_digits: [0, 1],
        m_codes: M_SIEMENS,
        lasting_variables_from: u32::MAX,
        macro_b: false,
        active_comments: false,
        settings_by_m: false,
        firmware: false,
        corner_words: false,
        cycles_out_at_feed: false,
        g63_is_modal: false,
        d_names_tool: false,
        entry_square_to_next: true,
        ..GENERIC
    },
    // Plain language has no other comment than `;`.
    Properties {
        dialect: Dialect::Heidenhain,
        name: "heidenhain",
        jumps_to_numbers: false,
        syntax: Syntax::Heidenhain,
        comments: &[CommentForm::Semicolon],
        max_line_length: 128,
        // F is in tenths of an inch per minute. The posts that CAM systems publish for these controls write ten times the inches, in cycles as well.
        feed_inch_mm: 0.1 * MM_PER_INCH,
        feed_digits: [0, 1],
        decimals: 5,
        counts_blocks: true,
        // QL is local to a program (TNC 640, Klartext Programming, Q parameters).
        locals: LOCAL_Q..=LASTING_Q - 1,
        m_codes: M_HEIDENHAIN,
        lasting_variables_from: u32::MAX,
        macro_b: false,
        active_comments: false,
        settings_by_m: false,
        firmware: false,
        corner_words: false,
        cycles_out_at_feed: false,
        entry_square_to_next: true,
        ..GENERIC
    },
];

impl Dialect {
    /// Every dialect.
    pub const ALL: [Dialect; TABLE.len()] = {
        let mut all = [Dialect::Generic; TABLE.len()];
        let mut at = 0;
        while at < TABLE.len() {
            all[at] = TABLE[at].dialect;
            at += 1;
        }
        all
    };

    /// What a setup and the command line may call a dialect: their own names, and `mach3`, which reads as GRBL.
    pub const NAMES: [&str; TABLE.len() + 1] = {
        let mut names = ["mach3"; TABLE.len() + 1];
        let mut at = 0;
        while at < TABLE.len() {
            names[at] = TABLE[at].name;
            at += 1;
        }
        names
    };

    /// Its row of the table.
    #[inline]
    pub(crate) fn properties(self) -> &'static Properties {
        &TABLE[self as usize]
    }
    /// Name in the setup file and on the command line.
    pub fn name(self) -> &'static str {
        self.properties().name
    }
    /// The dialect of this name; `mach3` reads as GRBL.
    pub fn from_name(name: &str) -> Option<Dialect> {
        let name = name.to_ascii_lowercase();
        let name = if name == "mach3" { "grbl" } else { &name };
        Dialect::ALL.into_iter().find(|dialect| dialect.name() == name)
    }
    /// Which family it belongs to.
    #[inline]
    pub fn syntax(self) -> Syntax {
        self.properties().syntax
    }
    /// How it reads expressions.
    pub(crate) fn language(self) -> Language {
        match (self.syntax(), self.properties().macro_b) {
            (Syntax::Siemens, _) => Language::Siemens,
            (Syntax::Heidenhain, _) => Language::Heidenhain,
            (Syntax::Rs274, true) => Language::MacroB,
            (Syntax::Rs274, false) => Language::LinuxCnc,
        }
    }
    /// The form of a comment that every control of the family reads.
    pub fn safest_comment(self) -> CommentForm {
        self.properties().comments[0]
    }
    /// May a comment of this form be written for the family?
    pub fn has_comment(self, form: CommentForm) -> bool {
        self.properties().comments.contains(&form)
    }
    /// Longest line the control reads, bytes without a line end of one byte, when nothing else is said.
    pub fn max_line_length(self) -> usize {
        self.properties().max_line_length
    }
    /// Longest line that may be written, bytes without a line end of one byte: what the setup says, but never more than the
    /// control is known to read.
    pub fn line_length(self, setup: Option<usize>) -> usize {
        let own = self.max_line_length();
        let most = setup.unwrap_or(own);
        if self.properties().refuses_longer_lines { most.min(own) } else { most }
    }
    /// Digits after the point in a coordinate (mm, inch): the increment of the control.
    pub fn coordinate_digits(self, inch: bool) -> usize {
        3 + usize::from(inch)
    }
    /// Millimetres in the unit of length of an F word per minute: that of the coordinates, but for plain language in inches a tenth of it.
    pub fn feed_unit_mm(self, inch: bool) -> f64 {
        if inch { self.properties().feed_inch_mm } else { 1.0 }
    }
    /// Digits after the point that an F word per minute may carry when the program shows none.
    pub fn feed_digits(self, inch: bool) -> usize {
        self.properties().feed_digits[usize::from(inch)]
    }
    /// May an F word without a decimal point count increments? (A Fanuc by its parameters, a Haas by setting 77.)
    pub fn counts_feeds(self, inch: bool) -> bool {
        self.properties().counts_increments && inch
    }
    /// Digits after the point of a number that has so many before it, where only the control sets an end to them.
    pub(crate) fn decimals(self, before_point: usize) -> usize {
        let Properties { number_digits, decimals, .. } = self.properties();
        number_digits.map_or(*decimals, |all| all.saturating_sub(before_point))
    }
    /// Does a T word alone bring the tool into the spindle? (`program_has_m6`: is there an M6 anywhere?)
    pub fn t_changes_tool(self, program_has_m6: bool) -> bool {
        !program_has_m6 && self.properties().t_changes_tool
    }
    /// Does this M code (times ten) leave part and frame alone on these controls? M0 and M60 are events of their own.
    pub(crate) fn knows_m(self, code: u16) -> bool {
        let listed = |codes: &[RangeInclusive<u16>]| codes.iter().any(|range| range.contains(&(code / 10)));
        code.is_multiple_of(10) && (listed(M_EVERYWHERE) || listed(self.properties().m_codes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_stands_where_its_dialect_looks_for_it() {
        for (index, row) in TABLE.iter().enumerate() {
            assert_eq!(row.dialect as usize, index, "{}", row.name);
            assert_eq!(Dialect::from_name(row.name), Some(row.dialect));
            assert_eq!(TABLE.iter().filter(|other| other.name == row.name).count(), 1, "{}", row.name);
        }
    }

    #[test]
    fn user_macros_and_pallets_are_not_known() {
        for (dialect, known, unknown) in [
            (Dialect::LinuxCnc, 640, 1010),
            (Dialect::Haas, 880, 500),
            (Dialect::Haas, 110, 550),
            (Dialect::Fanuc, 290, 770),
            (Dialect::Fanuc, 420, 880),
            (Dialect::Generic, 80, 110),
            (Dialect::Siemens, 410, 210),
            (Dialect::Heidenhain, 1400, 500),
        ] {
            assert!(dialect.knows_m(known) && !dialect.knows_m(unknown), "{dialect:?}");
            assert!(Dialect::ALL.into_iter().all(|dialect| dialect.knows_m(60)), "M6");
        }
        assert!(!Dialect::Generic.knows_m(61), "M6.1");
    }
}
