//! Dialects of NC text: how they are recognised and how they write comments and numbers.

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

/// Which lexer reads it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Syntax {
    /// Letters and numbers, `( )` and `;` comments, `#` parameters.
    Rs274,
    /// Names with `=`, arguments in parentheses, `;` comments.
    Siemens,
    /// Plain language.
    Heidenhain,
}

impl Dialect {
    /// Every dialect.
    pub const ALL: [Dialect; 7] = [
        Dialect::Generic,
        Dialect::Fanuc,
        Dialect::Haas,
        Dialect::LinuxCnc,
        Dialect::Grbl,
        Dialect::Siemens,
        Dialect::Heidenhain,
    ];

    /// Name in the setup file and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Dialect::Generic => "generic",
            Dialect::Fanuc => "fanuc",
            Dialect::Haas => "haas",
            Dialect::LinuxCnc => "linuxcnc",
            Dialect::Grbl => "grbl",
            Dialect::Siemens => "siemens",
            Dialect::Heidenhain => "heidenhain",
        }
    }
    /// The dialect of this name; `mach3` reads as GRBL.
    pub fn from_name(name: &str) -> Option<Dialect> {
        let name = name.to_ascii_lowercase();
        let name = if name == "mach3" { "grbl" } else { &name };
        Dialect::ALL.into_iter().find(|dialect| dialect.name() == name)
    }
    /// Which lexer reads it.
    pub fn syntax(self) -> Syntax {
        match self {
            Dialect::Siemens => Syntax::Siemens,
            Dialect::Heidenhain => Syntax::Heidenhain,
            _ => Syntax::Rs274,
        }
    }
    /// `text` as a comment that can end a line. Parentheses in it are replaced, so that it cannot end early.
    pub fn comment(self, text: &str) -> String {
        match self.syntax() {
            Syntax::Rs274 => format!("({})", text.replace('(', "[").replace(')', "]")),
            Syntax::Siemens | Syntax::Heidenhain => format!("; {text}"),
        }
    }
    /// Longest line the control reads, bytes without a line end of one byte, when nothing else is said. LinuxCNC 2.9 refuses
    /// a line of 254 bytes with its end ("Command too long").
    pub fn max_line_length(self) -> usize {
        match self {
            Dialect::Grbl => 80,
            Dialect::LinuxCnc => 252,
            Dialect::Heidenhain => 128,
            Dialect::Siemens => 512,
            Dialect::Generic | Dialect::Fanuc | Dialect::Haas => 256,
        }
    }
    /// Digits after the point in a coordinate (mm, inch): the increment of the control.
    pub fn coordinate_digits(self, inch: bool) -> usize {
        3 + usize::from(inch)
    }
    /// Digits after the point that an F word per minute may carry when the program shows none.
    pub fn feed_digits(self, inch: bool) -> usize {
        match self {
            Dialect::LinuxCnc | Dialect::Grbl | Dialect::Generic if inch => 2,
            Dialect::LinuxCnc | Dialect::Grbl | Dialect::Generic => 1,
            _ if inch => 1,
            _ => 0,
        }
    }
    /// Must an F word carry a decimal point? (Older Fanuc reads a number without one in increments.)
    pub fn feed_needs_point(self, inch: bool) -> bool {
        matches!(self, Dialect::Fanuc | Dialect::Haas) && inch
    }
    /// Does a T word alone bring the tool into the spindle? (`program_has_m6`: is there an M6 anywhere?)
    pub fn t_changes_tool(self, program_has_m6: bool) -> bool {
        !program_has_m6 && !matches!(self, Dialect::LinuxCnc | Dialect::Fanuc | Dialect::Haas)
    }

    /// Recognises the dialect from the first 64 KiB of a program.
    pub fn detect(text: &[u8]) -> Dialect {
        let head = &text[..text.len().min(1 << 16)];
        let mut votes = [0_u32; 7];
        for line in head.split(|&byte| byte == b'\n') {
            vote(line, &mut votes);
        }
        let best =
            Dialect::ALL.into_iter().max_by_key(|&dialect| (votes[dialect as usize], dialect == Dialect::Generic));
        best.unwrap_or(Dialect::Generic)
    }
}

fn vote(line: &[u8], votes: &mut [u32; 7]) {
    let text = String::from_utf8_lossy(&line[..line.len().min(200)]).to_ascii_uppercase();
    let text = text.trim();
    let bare = text.trim_start_matches(|c: char| c.is_ascii_digit()).trim_start();
    let mut add = |dialect: Dialect, weight: u32| votes[dialect as usize] += weight;
    if bare.starts_with("BEGIN PGM") || bare.starts_with("TOOL CALL") || bare.starts_with("CYCL DEF") {
        add(Dialect::Heidenhain, 100);
    }
    if bare.starts_with("L X") || bare.starts_with("L Z") || bare.starts_with("CC X") {
        add(Dialect::Heidenhain, 5);
    }
    if text.starts_with("%_N_") || text.starts_with(";$PATH") || text.starts_with("DEF REAL") {
        add(Dialect::Siemens, 100);
    }
    let siemens =
        ["CR=", "CYCLE8", "MCALL", "GOTOF", "GOTOB", "X=", "Z=", "MSG(\"", "TRANS X", "=AC(", "SUPA", "CFTCP"];
    if siemens.iter().any(|mark| text.contains(mark)) && !text.starts_with('(') && !text.contains('#') {
        add(Dialect::Siemens, 10);
    }
    if text.starts_with(";(") || text.contains("#<") || text.contains("G64P") || text.contains("G64 P") {
        add(Dialect::LinuxCnc, 3);
    }
    if o_word(text) {
        add(Dialect::LinuxCnc, 10);
    }
    if text.contains("HAAS") {
        add(Dialect::Haas, 20);
    }
    if ["GRBL", "MACH3", "MACH 3"].iter().any(|name| text.contains(name)) {
        add(Dialect::Grbl, 20);
    }
    if text.contains("USING FUSION 360 FOR PERSONAL") || text.contains("G91.1") {
        add(Dialect::Grbl, 1);
    }
    if text.contains("FANUC") {
        add(Dialect::Fanuc, 20);
    }
    let numbered = |rest: &str| rest.len() >= 4 && rest.bytes().take(4).all(|byte| byte.is_ascii_digit());
    if text.strip_prefix('O').or(text.strip_prefix(':')).is_some_and(numbered) && !o_word(text) {
        add(Dialect::Fanuc, 5);
    }
    if text.contains("GOTO") && text.contains('[') && text.contains('#') {
        add(Dialect::Fanuc, 10);
    }
}

/// `O100 sub`, `o<name> call`: LinuxCNC's flow control.
fn o_word(text: &str) -> bool {
    let Some(rest) = text.strip_prefix('O') else { return false };
    let rest = rest.trim_start_matches(|c: char| c.is_ascii_digit() || c == '<' || c == '>' || c == '_').trim_start();
    let rest = rest.split_once('>').map_or(rest, |(_, after)| after.trim_start());
    ["SUB", "CALL", "WHILE", "REPEAT", "IF", "DO", "ENDSUB", "ENDWHILE", "ENDIF"]
        .iter()
        .any(|word| rest.starts_with(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recognises_each_dialect() {
        let samples: [(&[u8], Dialect); 7] = [
            (b"G21\nG0X0\n", Dialect::Generic),
            (b"%\nO1001\nG20\n", Dialect::Fanuc),
            (b"(HAAS VF2)\nG0X0\n", Dialect::Haas),
            (b"o100 sub\no100 endsub\n", Dialect::LinuxCnc),
            (b"(Mach3)\nG0X0\n", Dialect::Grbl),
            (b"%_N_TEST_MPF\nG0 X=R1\n", Dialect::Siemens),
            (b"0 BEGIN PGM T MM\n1 L X+0\n", Dialect::Heidenhain),
        ];
        for (text, dialect) in samples {
            assert_eq!(Dialect::detect(text), dialect, "{}", String::from_utf8_lossy(text));
        }
    }
}
