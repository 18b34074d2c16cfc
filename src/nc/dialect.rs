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
    /// The form of a comment as it stands, its delimiters included.
    pub fn of(comment: &[u8]) -> Option<CommentForm> {
        match comment.first() {
            Some(b'(') => Some(CommentForm::Parentheses),
            Some(b';') => Some(CommentForm::Semicolon),
            _ => None,
        }
    }
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
    /// The form of a comment that every control of the family reads.
    pub fn safest_comment(self) -> CommentForm {
        match self.syntax() {
            Syntax::Rs274 => CommentForm::Parentheses,
            Syntax::Siemens | Syntax::Heidenhain => CommentForm::Semicolon,
        }
    }
    /// May a comment of this form be written for the family? `;` ends the block on Fanuc and Haas controls (it is their sign
    /// for EOB), and plain language has no other form than it.
    pub fn has_comment(self, form: CommentForm) -> bool {
        match self {
            Dialect::Fanuc | Dialect::Haas => form == CommentForm::Parentheses,
            Dialect::Heidenhain => form == CommentForm::Semicolon,
            Dialect::Generic | Dialect::LinuxCnc | Dialect::Grbl | Dialect::Siemens => true,
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
}
