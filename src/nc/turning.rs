//! Recognises programs for lathes. In: a program. Out: the signs of a lathe found in its code (comments do not count), and whether their
//! total weight makes it a turning program.
//!
//! A lathe reads X as a diameter and F as mm per revolution. Taken for milling, `F0.4` would be 0.4 mm/min, and a feed "raised" from it
//! would be thousands of times too fast, so such a program must not be rewritten. A single sign also occurs in milling programs (G95 before
//! tapping, T0101 on a router, a slot along X); two signs that lathes write and mills do not, never do.
//!
//! Sources. \[F\] Fanuc Series 0i-TD, Connection and User's Manual for lathe systems, B-64304EN-1: G code list (G code system A),
//! canned cycles G70–G76, G96 and G50 S, T function. \[H\] Haas Lathe Operator's Manual 96-8900: G50, G71–G76, G96, G99, Txxyy.
//! \[O\] Okuma OSP-P200L Programming Manual: G50 S, G95 at switch-on, six-digit T. \[S\] Siemens 840D sl Programming Manual
//! Fundamentals: DIAMON, G95, G96 with LIMS; Turning cycles: CYCLE93–CYCLE98, CYCLE952. \[L\] LinuxCNC, G codes: G7, G8, G33, G76, G96.
//! \[T\] Heidenhain TNC 640, Turning: FUNCTION MODE TURN. \[V\] Sandvik Coromant, Metalcutting Technical Guide, chapter A: f_n of
//! turning 0.05–0.9 mm/rev.

use super::dialect::{Dialect, Syntax};
use super::program::Program;
use super::token::{Token, TokenKind};
use crate::units::MM_PER_INCH;

/// A sign that the program is for a lathe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// X is a diameter: DIAMON, DIAM90 \[S\], G7 \[L\], FUNCTION MODE TURN \[T\].
    Diameter,
    /// A cycle that only lathes have: G70–G73 with P and Q, G71 U R, threading G76 P Q or G76 K \[F, H, L\], CYCLE93–98 and 952 \[S\].
    Cycle,
    /// The limit of a constant surface speed: G50 S \[F, H, O\], LIMS= \[S\].
    SpeedLimit,
    /// Constant surface speed: G96 with S \[F, H, O, S, L\]. A milling control may have it, few programs use it.
    SurfaceSpeed,
    /// Increments U and W beside X and Z \[F, H\]; on other machines they are further axes.
    Increments,
    /// A thread cut in passes: G32, or G92 with X and F \[F, H\].
    Thread,
    /// Feed per revolution that no cycle explains: G99 without drilling cycles \[F, H\].
    PerRevolution,
    /// Every F is the feed per revolution of a turning tool (below [`LARGEST_TURNING_FEED_MM`] \[V\]), and G94 or G93 nowhere.
    TinyFeeds,
    /// The program moves X and Z, and no other axis but C.
    OnlyXAndZ,
    /// G95 \[S, L\]; a mill writes it before tapping and drilling.
    G95,
    /// A T word that also names the offset: T0101, T010101 \[F, H, O\]; some routers write T0101 too.
    ToolWithOffset,
    /// A tool changed by M6, or its length taken in by G43: lathes index a turret with T alone \[F\].
    ToolChange,
}

/// Feeds per revolution of turning stay below this, mm \[V\]; no mill runs at less than this per minute.
const LARGEST_TURNING_FEED_MM: f64 = 1.0;
/// Weight at which a program is one for a lathe: two signs that milling programs do not have together.
const REFUSED_AT: i32 = 4;
/// Blocks looked at: the signs stand at the head of a program and at each of its tools.
const MOST_BLOCKS: usize = 100_000;

impl Sign {
    /// Every sign.
    pub const ALL: [Sign; 12] = [
        Sign::Diameter,
        Sign::Cycle,
        Sign::SpeedLimit,
        Sign::SurfaceSpeed,
        Sign::Increments,
        Sign::Thread,
        Sign::PerRevolution,
        Sign::TinyFeeds,
        Sign::OnlyXAndZ,
        Sign::G95,
        Sign::ToolWithOffset,
        Sign::ToolChange,
    ];

    /// What it weighs: 4 decides alone, 3 with anything else, 2 with another of its kind.
    pub fn weight(self) -> i32 {
        match self {
            Sign::Diameter => 4,
            Sign::Cycle | Sign::SpeedLimit | Sign::SurfaceSpeed => 3,
            Sign::Increments | Sign::Thread | Sign::PerRevolution | Sign::TinyFeeds | Sign::OnlyXAndZ => 2,
            Sign::G95 | Sign::ToolWithOffset => 1,
            Sign::ToolChange => -2,
        }
    }

    /// As a clause for the message.
    pub fn words(self) -> &'static str {
        match self {
            Sign::Diameter => "X is a diameter",
            Sign::Cycle => "it has cycles of a lathe",
            Sign::SpeedLimit => "it limits the speed for a constant surface speed",
            Sign::SurfaceSpeed => "it keeps the surface speed constant (G96)",
            Sign::Increments => "U and W are increments of X and Z",
            Sign::Thread => "it cuts threads in passes",
            Sign::PerRevolution => "G99 sets feeds per revolution",
            Sign::TinyFeeds => "every F is a feed per revolution",
            Sign::OnlyXAndZ => "only X and Z move",
            Sign::G95 => "G95 sets feeds per revolution",
            Sign::ToolWithOffset => "T words name an offset",
            Sign::ToolChange => "tools are changed by M6 or measured by G43",
        }
    }
}

/// What the code of a program showed so far.
#[derive(Default)]
struct Seen {
    signs: Vec<Sign>,
    x: bool,
    z: bool,
    /// Y, A, B or V: what a lathe does not move by these letters.
    other_axis: bool,
    increments: bool,
    g99: bool,
    drilling: bool,
    per_minute: bool,
    inch: bool,
    /// Largest F, and whether there is one.
    largest_feed: Option<f64>,
}

/// The plain words of a block; G and M codes times ten.
struct Block {
    words: Vec<(u8, f64)>,
}

impl Block {
    fn value(&self, letter: u8) -> Option<f64> {
        self.words.iter().find(|word| word.0 == letter).map(|word| word.1)
    }
    fn has(&self, letters: &[u8]) -> bool {
        letters.iter().all(|letter| self.value(*letter).is_some())
    }
    fn any(&self, letters: &[u8]) -> bool {
        letters.iter().any(|letter| self.value(*letter).is_some())
    }
    fn code(&self, letter: u8, codes: &[u32]) -> bool {
        self.words.iter().any(|word| word.0 == letter && codes.iter().any(|code| f64::from(*code) == word.1))
    }
    fn g(&self, codes: &[u32]) -> bool {
        self.code(b'G', codes)
    }
}

/// The signs of a lathe in a program, each once, in the order of [`Sign::ALL`].
pub fn signs(program: &Program) -> Vec<Sign> {
    let mut seen = Seen::default();
    for block in program.blocks().take(program.own_len().min(MOST_BLOCKS)) {
        let mut words = Vec::new();
        for token in program.tokens(block) {
            match token.kind {
                TokenKind::Word(letter) => {
                    if letter == b'T' && names_offset(token.span.of(program.text())) {
                        seen.sign(Sign::ToolWithOffset);
                    }
                    words.push((letter & 0x7f, token.number));
                }
                TokenKind::Computed(letter) => words.push(((letter & 0x7f).to_ascii_uppercase(), f64::NAN)),
                _ => seen.name(token, program),
            }
        }
        seen.block(&Block { words }, program.dialect());
    }
    seen.whole();
    Sign::ALL.into_iter().filter(|sign| seen.signs.contains(sign)).collect()
}

/// Why the program is one for a lathe, as a sentence; `None`: nothing says so, or too little.
pub fn refusal(program: &Program) -> Option<String> {
    let signs = signs(program);
    if signs.iter().map(|sign| sign.weight()).sum::<i32>() < REFUSED_AT {
        return None;
    }
    let words: Vec<&str> = signs.iter().filter(|sign| sign.weight() > 0).map(|sign| sign.words()).collect();
    Some(format!("this is a turning program: {}", words.join(", ")))
}

impl Seen {
    fn sign(&mut self, sign: Sign) {
        if !self.signs.contains(&sign) {
            self.signs.push(sign);
        }
    }

    /// Words that are not a letter with a number.
    fn name(&mut self, token: Token, program: &Program) {
        let text = token.span.of(program.text());
        let is = |names: &[&str]| names.iter().any(|name| text.eq_ignore_ascii_case(name.as_bytes()));
        let begins = |name: &str| text.len() >= name.len() && text[..name.len()].eq_ignore_ascii_case(name.as_bytes());
        match program.dialect().syntax() {
            Syntax::Siemens if is(&["DIAMON", "DIAM90"]) => self.sign(Sign::Diameter),
            Syntax::Siemens if begins("LIMS") && token.kind == TokenKind::Assignment => self.sign(Sign::SpeedLimit),
            Syntax::Siemens if token.kind == TokenKind::Call => {
                let name = text.split(|byte| *byte == b'(').next().unwrap_or_default().to_ascii_uppercase();
                let lathe = [93, 94, 95, 96, 97, 98, 930, 940, 950, 951, 952];
                if lathe.iter().any(|number| name == format!("CYCLE{number}").as_bytes()) {
                    self.sign(Sign::Cycle);
                }
            }
            Syntax::Heidenhain if is(&["TURN"]) => {
                let line = program.line_text(program.block_at(token.span.start)).to_ascii_uppercase();
                if memchr::memmem::find(&line, b"FUNCTION MODE TURN").is_some() {
                    self.sign(Sign::Diameter);
                }
            }
            _ => {}
        }
    }

    fn block(&mut self, block: &Block, dialect: Dialect) {
        let macro_or_setting = block.g(&[4, 10, 65, 66, 68]) || block.any(b"O");
        if dialect.syntax() == Syntax::Heidenhain {
            return;
        }
        if block.g(&[7]) && dialect == Dialect::LinuxCnc {
            self.sign(Sign::Diameter);
        }
        if block.g(&[50]) && block.has(b"S") && !block.any(b"XYZP") {
            self.sign(Sign::SpeedLimit);
        }
        if block.g(&[96, 961, 962]) && block.has(b"S") {
            self.sign(Sign::SurfaceSpeed);
        }
        if lathe_cycle(block) && dialect.syntax() == Syntax::Rs274 {
            self.sign(Sign::Cycle);
        }
        if block.g(&[32]) && block.has(b"F") || block.g(&[92]) && block.has(b"XF") {
            self.sign(Sign::Thread);
        }
        if block.g(&[95]) {
            self.sign(Sign::G95);
        }
        if block.code(b'M', &[6]) || block.g(&[43]) {
            self.sign(Sign::ToolChange);
        }
        self.g99 |= block.g(&[99]);
        self.drilling |= block.g(&[73, 74, 76, 81, 82, 83, 84, 85, 86, 87, 88, 89]);
        self.per_minute |= block.g(&[93, 94]);
        self.inch |= block.g(&[20, 70, 700]) && !lathe_cycle(block);
        if macro_or_setting {
            return;
        }
        (self.x, self.z) = (self.x || block.any(b"X"), self.z || block.any(b"Z"));
        self.other_axis |= block.any(b"YABV");
        self.increments |= block.any(b"UW") && !block.any(b"YV") && !lathe_cycle(block);
        for (_, feed) in block.words.iter().filter(|word| word.0 == b'F' && word.1 > 0.0) {
            self.largest_feed = Some(self.largest_feed.map_or(*feed, |largest| largest.max(*feed)));
        }
    }

    /// What only the whole program shows.
    fn whole(&mut self) {
        if self.increments && !self.other_axis {
            self.sign(Sign::Increments);
        }
        if self.g99 && !self.drilling {
            self.sign(Sign::PerRevolution);
        }
        if (self.x || self.increments) && self.z && !self.other_axis {
            self.sign(Sign::OnlyXAndZ);
        }
        let per_revolution = self.signs.contains(&Sign::G95) || self.signs.contains(&Sign::PerRevolution);
        let unit_mm = if self.inch { MM_PER_INCH } else { 1.0 };
        let tiny = self.largest_feed.is_some_and(|feed| feed * unit_mm < LARGEST_TURNING_FEED_MM);
        if tiny && !self.per_minute && !per_revolution {
            self.sign(Sign::TinyFeeds);
        }
    }
}

/// Roughing and finishing cycles name blocks by P and Q (`G71 P100 Q200 U0.5 W0.1`); their first line has U and R
/// (`G71 U2. R0.5`). A mill's G73 and G76 go to an R plane and a Z; its G70 and G71 stand alone.
fn lathe_cycle(block: &Block) -> bool {
    let contour = block.g(&[70, 71, 72, 73]) && block.has(b"PQ") && !block.has(b"ZR");
    let cut = block.g(&[71, 72, 73]) && block.has(b"R") && block.any(b"UW");
    let thread = block.g(&[76]) && (block.has(b"K") || block.has(b"PQ") && !block.has(b"ZR"));
    contour || cut || thread
}

/// `T0101`, `T1212`, `T010203`: tool and offset in one number, written with its zeros.
fn names_offset(word: &[u8]) -> bool {
    let digits = &word[1..];
    let padded = matches!(digits.len(), 4 | 6) && digits[0] == b'0' && !digits.ends_with(b"00");
    let doubled = digits.len() == 4 && digits[..2] == digits[2..];
    digits.iter().all(u8::is_ascii_digit) && (padded || doubled)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, dialect: Option<Dialect>) -> Program {
        crate::nc::parse(text.as_bytes().to_vec(), dialect)
    }

    /// Each style is refused, and each of its signs is needed to tell it apart.
    #[test]
    fn turning_programs_are_recognised_in_every_style() {
        let styles: [(&str, Option<Dialect>, &str); 9] = [
            (
                "Fanuc roughing",
                None,
                "%\nO0101\nG50 S2500\nT0101\nG96 S180 M3\nG0 X52. Z2.\nG71 U2. R0.5\nG71 P10 Q20 U0.4 W0.1 F0.25\nN10 G0 X20.\nG1 Z-15. F0.15\nN20 X50.\nG70 P10 Q20\nM30\n%\n",
            ),
            (
                "Haas facing",
                Some(Dialect::Haas),
                "%\nO00012\nG28\nT202\nG97 S900 M03\nG99\nG00 X2.1 Z0.1\nG01 X-0.06 F0.008\nG00 Z1.\nM30\n%\n",
            ),
            (
                "Haas thread",
                Some(Dialect::Haas),
                "%\nO00014\nT0303\nG97 S600 M03\nG0 X1.1 Z0.3\nG76 X0.88 Z-1. K0.061 D0.012 F0.0833\nM30\n%\n",
            ),
            ("Fanuc with increments", None, "O7\nT0404\nG97 S700 M3\nG0 X40. Z1.\nG1 W-21. F0.2\nU2.\nG0 Z1.\nM30\n"),
            (
                "Okuma, nothing but feeds",
                None,
                "G00 X800 Z700\nG97 S300 M03\nG01 Z552 F0.4\nG01 X160\nG00 X800 Z700\nM02\n",
            ),
            ("Okuma with G50", None, "G13 G140\nG50 S1800\nG96 S150 M3\nX90 Z553\nG01 Z500 F0.35\nM02\n"),
            (
                "Siemens",
                Some(Dialect::Siemens),
                "N10 G18 G90 G95\nN20 T1 D1\nN30 G96 S200 LIMS=3000 M4\nN40 G0 X62 Z2\nN50 G1 Z-40 F0.3\nM30\n",
            ),
            ("Siemens diameters", Some(Dialect::Siemens), "DIAMON\nT1 D1\nG0 X62 Z2\nG1 Z-40 F0.3\nM30\n"),
            ("LinuxCNC", Some(Dialect::LinuxCnc), "G18 G21 G95\nG96 D2000 S150 M3\nG0 X20 Z1\nG1 Z-5 F0.1\nM2\n"),
        ];
        for (name, dialect, text) in styles {
            let program = read(text, dialect);
            let refused = refusal(&program);
            println!("{name}: {refused:?}");
            assert!(refused.is_some(), "{name}: {:?}", signs(&program));
        }
    }

    #[test]
    fn milling_programs_that_look_alike_are_not() {
        let mills: [(&str, Option<Dialect>, &str); 12] = [
            (
                "G95 for tapping",
                None,
                "G21 G90\nT3 M6\nG43 H3 Z50.\nS300 M3\nG95 G84 X10. Y10. Z-12. R3. F1.25\nG94 G80\nM30\n",
            ),
            ("T0101 on a router", None, "G21\nT0101\nS18000 M3\nG0 X0 Y0\nG1 Z-3 F600\nX100\nM30\n"),
            ("T0101 and a slot", None, "G21\nT0101\nS18000 M3\nG0 X0 Z5\nG1 Z-3 F600\nX100 F1800\nG0 Z5\nM30\n"),
            (
                "fine boring",
                None,
                "T5 M6\nG43 H5 Z20.\nS800 M3\nG98 G76 X10. Y20. Z-15. R2. Q0.2 P100 F40.\nX30.\nG80\nM30\n",
            ),
            ("fine boring in one row", None, "S800 M3\nG99 G76 X10. Z-15. R2. Q0.2 P100 F40.\nX30.\nG80\nM30\n"),
            ("a slot along X", None, "G90 G21\nM3 S8000\nG0 X-10. Z2.\nG1 Z-1. F200.\nX60. F400.\nG0 Z50.\nM30\n"),
            (
                "a slot in feed per revolution",
                None,
                "G90 G21 G95\nT1 M6\nM3 S8000\nG0 X-10. Z2.\nG1 Z-1. F0.05\nX60. F0.1\nG0 Z50.\nM30\n",
            ),
            ("inch, slow, without Y", None, "G20\nM3 S8000\nG0 X-1. Z.1\nG1 Z-.05 F.5\nX2.\nM30\n"),
            ("units by G71", None, "G71 G90\nM3 S8000\nG0 X0 Y0\nG1 Z-1 F200\nX50\nM30\n"),
            ("foam cutter", None, "G21\nG1 X10 Y5 U10 W5 F200\nX20 Y6 U20 W6\nM2\n"),
            ("wrapped on A", None, "G21 G93\nG0 X0 Z5\nG1 Z-1 A10 F0.5\nA20 F0.4\nM2\n"),
            (
                "Siemens mill",
                Some(Dialect::Siemens),
                "G17 G90 G95\nT=\"MILL_10\"\nM6\nS3000 M3\nG0 X0 Y0 Z5\nG1 Z-2 F0.1\nX40 F0.2\nCYCLE84(5,0,2,-12,,0,5,,1.25,0,300,300)\nM30\n",
            ),
        ];
        for (name, dialect, text) in mills {
            let program = read(text, dialect);
            assert_eq!(refusal(&program), None, "{name}: {:?}", signs(&program));
        }
    }

    /// Each sign on both sides of what it asks for.
    #[test]
    fn each_sign_has_its_two_sides() {
        let has = |text: &str, dialect, sign| signs(&read(text, Some(dialect))).contains(&sign);
        let pairs: [(Sign, Dialect, &str, &str); 12] = [
            (Sign::Diameter, Dialect::LinuxCnc, "G7", "G17"),
            (Sign::Cycle, Dialect::Fanuc, "G73 P1 Q2 U1. W1.", "G73 X1. Z-3. R1. Q2. P100"),
            (Sign::SpeedLimit, Dialect::Fanuc, "G50 S2000", "G50\nS2000"),
            (Sign::SurfaceSpeed, Dialect::Fanuc, "G96 S200", "G97 S200"),
            (Sign::Increments, Dialect::Fanuc, "G1 U2. W-3.", "G1 X2. Y1. U2."),
            (Sign::Thread, Dialect::Fanuc, "G92 X20. Z-9. F1.5", "G92 X0 Y0 Z0"),
            (Sign::PerRevolution, Dialect::Fanuc, "G99\nG1 X1.", "G99 G81 X1. Z-2. R1."),
            (Sign::TinyFeeds, Dialect::Fanuc, "G1 X1. F0.9", "G1 X1. F1."),
            (Sign::OnlyXAndZ, Dialect::Fanuc, "G1 X1. Z1.", "G1 X1. Z1. Y0."),
            (Sign::G95, Dialect::Fanuc, "G95", "G94"),
            (Sign::ToolWithOffset, Dialect::Fanuc, "T0101", "T1000"),
            (Sign::ToolChange, Dialect::Fanuc, "T1 M06", "T1 M16"),
        ];
        for (sign, dialect, yes, no) in pairs {
            assert!(has(yes, dialect, sign), "{sign:?} in {yes}");
            assert!(!has(no, dialect, sign), "{sign:?} in {no}");
            assert!(!has(&format!("({})\n", yes.replace('\n', " ")), dialect, sign), "a comment says nothing");
        }
        assert!(has("G20\nG1 X1. F0.03", Dialect::Fanuc, Sign::TinyFeeds), "0.76 mm/rev");
        assert!(!has("G20\nG1 X1. F0.04", Dialect::Fanuc, Sign::TinyFeeds), "1.02 mm");
        assert!(!has("G94\nG1 X1. F0.4", Dialect::Fanuc, Sign::TinyFeeds), "said to be per minute");
    }
}
