//! Expressions of LinuxCNC and Macro B. In: the text of one value and the parameters. Out: its value, or what is wrong
//! with it. Angles are in degrees. Precedence, tightest first: functions and signs, `**`, `* / MOD`, `+ -`, comparisons, `AND OR XOR`.
//!
//! Macro B differs (Fanuc B-64304EN, Custom macro, Arithmetic and logic operation; Haas Mill Operator's Manual, Macros): AND, OR and XOR work on
//! the bits of whole numbers, AND is as tight as `*`, OR and XOR as `+`; FIX drops the fraction and FUP goes away from zero; a variable that
//! was never set is vacant; ROUND in the value of a word rounds to the least increment of its letter, and to a whole number elsewhere.
//!
//! Siemens has comparisons loosest, then OR, XOR, AND (840D sl Programming Manual Job Planning, Priority of the operators). LinuxCNC takes two
//! numbers for equal that differ by less than 1e-4.

use super::parameters::{Language, Parameters, parameter_index};

/// Deepest nesting of brackets that is followed.
const MAX_DEPTH: u32 = 100;

/// What is wrong with an expression.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExprError {
    /// The text does not read as an expression.
    #[error("the expression cannot be read at byte {0}")]
    Syntax(usize),
    /// A name without a value.
    #[error("{0} has no value")]
    Unknown(String),
    /// A parameter that only the control knows.
    #[error("{0} is known to the control alone")]
    NotKnown(String),
    /// Result that is not a number.
    #[error("{0} has no finite result")]
    Undefined(&'static str),
    /// Nested too deep.
    #[error("brackets are nested deeper than 100")]
    TooDeep,
    /// Controls that read this text differ in what it is.
    #[error("{0}")]
    Ambiguous(&'static str),
}

/// An intermediate value of an expression.
///
/// A vacant variable equals only another vacant one in EQ and NE, and counts as 0 everywhere else (Fanuc B-64304EN, Custom macro, Undefined
/// variable).
#[derive(Debug, Clone, Copy)]
struct Operand {
    /// 0 where it is vacant.
    value: f64,
    vacant: bool,
}

impl Operand {
    fn of(value: f64) -> Self {
        Self { value, vacant: false }
    }
    fn or_vacant(self) -> Option<f64> {
        (!self.vacant).then_some(self.value)
    }
}

/// Value of `text`, which must be an expression from its first byte to its last (blanks aside); 0 where it is vacant.
pub fn evaluate(text: &[u8], parameters: &Parameters) -> Result<f64, ExprError> {
    Ok(evaluate_or_vacant(text, parameters)?.unwrap_or(0.0))
}

/// Value of `text`, which must be an expression from its first byte to its last (blanks aside); `None`: it is a vacant variable.
pub fn evaluate_or_vacant(text: &[u8], parameters: &Parameters) -> Result<Option<f64>, ExprError> {
    evaluate_word(text, parameters, 1.0)
}

/// The same of the value of a word, in which ROUND of Macro B rounds to the `increment` of its letter.
pub fn evaluate_word(text: &[u8], parameters: &Parameters, increment: f64) -> Result<Option<f64>, ExprError> {
    let mut reader = Reader { increment, ..Reader::new(text, 0, parameters) };
    let value = reader.binary(0)?;
    reader.blanks();
    if reader.at < text.len() { Err(ExprError::Syntax(reader.at)) } else { Ok(value.or_vacant()) }
}

/// Splits `#lhs = rhs`, and gives what is set and its value; `None`: it becomes vacant (`#1 = #0`).
pub fn assignment(text: &[u8], parameters: &Parameters) -> Result<(Target, Option<f64>), ExprError> {
    let mut reader = Reader::new(text, 1, parameters);
    let target = reader.target()?;
    reader.blanks();
    if reader.peek() != Some(b'=') {
        return Err(ExprError::Syntax(reader.at));
    }
    reader.at += 1;
    let value = reader.binary(0)?;
    reader.blanks();
    if reader.at < text.len() { Err(ExprError::Syntax(reader.at)) } else { Ok((target, value.or_vacant())) }
}

/// What an assignment sets.
#[derive(Debug, Clone, PartialEq)]
pub enum Target {
    /// `#12`
    Number(u32),
    /// `#<name>`
    Name(String),
}

struct Reader<'a> {
    text: &'a [u8],
    at: usize,
    depth: u32,
    parameters: &'a Parameters,
    /// To what ROUND rounds.
    increment: f64,
    /// AND, OR or XOR, and a comparison, stand in the brackets that are being read.
    beside: [bool; 2],
}

const COMPARISONS: &[&str] = &["EQ", "NE", "GT", "GE", "LT", "LE", "==", "<>", ">=", "<=", ">", "<"];
const LOGICAL: &[&str] = &["AND", "XOR", "OR"];
/// Binary operators by precedence, loosest first.
const LEVELS: &[&[&str]] = &[LOGICAL, COMPARISONS, &["+", "-"], &["MOD", "DIV", "*", "/"], &["**"]];
const MACRO_B_LEVELS: &[&[&str]] = &[COMPARISONS, &["+", "-", "XOR", "OR"], &["MOD", "*", "/", "AND"], &["**"]];
const SIEMENS_LEVELS: &[&[&str]] = &[COMPARISONS, &["OR"], &["XOR"], &["AND"], &["+", "-"], &["MOD", "DIV", "*", "/"]];
/// Difference below which LinuxCNC takes two numbers for equal (EQ, NE).
const EQUAL_IN_LINUXCNC: f64 = 1e-4;

impl<'a> Reader<'a> {
    fn new(text: &'a [u8], at: usize, parameters: &'a Parameters) -> Self {
        Self { text, at, depth: 0, parameters, increment: 1.0, beside: [false; 2] }
    }
    fn levels(&self) -> &'static [&'static [&'static str]] {
        match self.parameters.language {
            Language::MacroB => MACRO_B_LEVELS,
            Language::Siemens => SIEMENS_LEVELS,
            Language::LinuxCnc | Language::Heidenhain => LEVELS,
        }
    }
    fn peek(&self) -> Option<u8> {
        self.text.get(self.at).copied()
    }
    fn blanks(&mut self) {
        while matches!(self.peek(), Some(b' ' | b'\t')) {
            self.at += 1;
        }
    }
    fn operator(&mut self, level: usize) -> Option<&'static str> {
        self.blanks();
        let rest = &self.text[self.at..];
        let fits = |op: &&&str| rest.len() >= op.len() && rest[..op.len()].eq_ignore_ascii_case(op.as_bytes());
        let found = self.levels()[level].iter().find(fits)?;
        if *found == "*" && rest.get(1) == Some(&b'*') {
            return None;
        }
        self.at += found.len();
        Some(found)
    }
    fn binary(&mut self, level: usize) -> Result<Operand, ExprError> {
        if level == self.levels().len() {
            return self.unary();
        }
        let mut left = self.binary(level + 1)?;
        while let Some(operator) = self.operator(level) {
            let right = self.binary(level + 1)?;
            let value = match (self.parameters.language, operator) {
                (Language::MacroB, _) => {
                    self.stands_beside(operator)?;
                    apply_macro_b(operator, left, right)?
                }
                (Language::Siemens, _) => {
                    self.stands_beside(operator)?;
                    apply(operator, left, right)?
                }
                (Language::LinuxCnc, "EQ" | "NE") => {
                    let is_equal = (left.value - right.value).abs() < EQUAL_IN_LINUXCNC;
                    f64::from(u8::from(is_equal == (operator == "EQ")))
                }
                _ => apply(operator, left, right)?,
            };
            left = Operand::of(value);
        }
        Ok(left)
    }
    /// Which of a comparison and AND, OR, XOR comes first is written by brackets: by the manuals of Fanuc and Siemens AND comes first, which is
    /// seldom meant.
    fn stands_beside(&mut self, operator: &str) -> Result<(), ExprError> {
        self.beside[0] |= LOGICAL.contains(&operator);
        self.beside[1] |= COMPARISONS.contains(&operator);
        let text = "AND, OR or XOR stands beside a comparison without brackets: which comes first is not known";
        if self.beside == [true; 2] { Err(ExprError::Ambiguous(text)) } else { Ok(()) }
    }
    fn unary(&mut self) -> Result<Operand, ExprError> {
        let mut sign = None;
        loop {
            self.blanks();
            match self.peek() {
                Some(b'-') => sign = Some(-sign.unwrap_or(1.0)),
                Some(b'+') => sign = sign.or(Some(1.0)),
                _ => break,
            }
            self.at += 1;
        }
        let operand = self.primary()?;
        Ok(sign.map_or(operand, |sign: f64| Operand::of(sign * operand.value)))
    }
    fn primary(&mut self) -> Result<Operand, ExprError> {
        match self.peek() {
            Some(b'[' | b'(') => self.brackets(),
            Some(b'#') => {
                self.at += 1;
                let known = self.parameters.unset.borrow().len();
                match self.target()? {
                    Target::Number(index) => {
                        self.parameters.read_by_unknown_number(known);
                        Ok(Operand { vacant: self.parameters.is_vacant(index), value: self.parameters.number(index) })
                    }
                    Target::Name(name) => match self.parameters.name(&name) {
                        Some(value) => Ok(Operand::of(value)),
                        None => Err(ExprError::Unknown(format!("#<{name}>"))),
                    },
                }
            }
            Some(byte) if byte.is_ascii_digit() || byte == b'.' => self.number().map(Operand::of),
            Some(byte) if byte.is_ascii_alphabetic() || byte == b'_' || byte == b'$' => {
                self.function().map(Operand::of)
            }
            _ => Err(ExprError::Syntax(self.at)),
        }
    }
    fn number(&mut self) -> Result<f64, ExprError> {
        let (value, length) = super::number::decimal(&self.text[self.at..]).ok_or(ExprError::Syntax(self.at))?;
        self.at += length;
        Ok(value)
    }
    fn brackets(&mut self) -> Result<Operand, ExprError> {
        let close = if self.peek() == Some(b'(') { b')' } else { b']' };
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(ExprError::TooDeep);
        }
        self.at += 1;
        let outside = std::mem::take(&mut self.beside);
        let value = self.binary(0)?;
        self.beside = outside;
        self.blanks();
        if self.peek() != Some(close) {
            return Err(ExprError::Syntax(self.at));
        }
        self.at += 1;
        self.depth -= 1;
        Ok(value)
    }
    /// What follows a `#`.
    fn target(&mut self) -> Result<Target, ExprError> {
        self.blanks();
        if self.peek() == Some(b'<') {
            let length =
                self.text[self.at..].iter().position(|&byte| byte == b'>').ok_or(ExprError::Syntax(self.at))?;
            let name = String::from_utf8_lossy(&self.text[self.at + 1..self.at + length]).into_owned();
            self.at += length + 1;
            return Ok(Target::Name(name));
        }
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(ExprError::TooDeep);
        }
        let index = self.primary()?.value;
        self.depth -= 1;
        Ok(Target::Number(index.round().clamp(0.0, f64::from(u32::MAX)) as u32))
    }
    fn function(&mut self) -> Result<f64, ExprError> {
        let start = self.at;
        while self.peek().is_some_and(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'$')) {
            self.at += 1;
        }
        let name = String::from_utf8_lossy(&self.text[start..self.at]).to_ascii_uppercase();
        self.blanks();
        if !matches!(self.peek(), Some(b'[' | b'(')) {
            return self.variable(&name);
        }
        if name == "EXISTS" {
            return self.exists();
        }
        let first = self.brackets_or_pair()?;
        let (x, second) = first;
        let value = match (name.as_str(), second) {
            ("ATAN" | "ATAN2", Some(y)) => self.angle(x, y),
            ("ATAN", None) => {
                self.blanks();
                if self.peek() == Some(b'/') {
                    self.at += 1;
                    self.blanks();
                    let y = self.brackets()?.value;
                    self.angle(x, y)
                } else {
                    x.atan().to_degrees()
                }
            }
            ("POT", None) => x * x,
            ("MINVAL", Some(y)) => x.min(y),
            ("MAXVAL", Some(y)) => x.max(y),
            ("ROUND", None) => (x / self.increment).round() * self.increment,
            ("FIX", None) if self.parameters.is_macro_b() => x.trunc(),
            ("FUP", None) if self.parameters.is_macro_b() => x.abs().ceil().copysign(x),
            (function, None) => one_argument(function, x).ok_or_else(|| ExprError::Unknown(name.clone()))?,
            _ => return Err(ExprError::Unknown(name)),
        };
        if value.is_finite() { Ok(value) } else { Err(ExprError::Undefined("a function")) }
    }
    /// Direction of (y, x), degrees: from -180 to 180, in Macro B from 0 to 360 (Fanuc parameter 6004#0 as it is delivered).
    fn angle(&self, x: f64, y: f64) -> f64 {
        let degrees = x.atan2(y).to_degrees();
        if self.parameters.is_macro_b() && degrees < 0.0 { degrees + 360.0 } else { degrees }
    }
    fn brackets_or_pair(&mut self) -> Result<(f64, Option<f64>), ExprError> {
        let open = self.at;
        let close = if self.peek() == Some(b'(') { b')' } else { b']' };
        match self.brackets() {
            Err(ExprError::Syntax(at)) if self.text.get(at) == Some(&b',') => {
                self.depth = self.depth.saturating_sub(1);
                self.at = open + 1;
                let first = self.binary(0)?.value;
                self.blanks();
                self.at += 1;
                let second = self.binary(0)?.value;
                self.blanks();
                if self.peek() != Some(close) {
                    return Err(ExprError::Syntax(self.at));
                }
                self.at += 1;
                Ok((first, Some(second)))
            }
            other => Ok((other?.value, None)),
        }
    }
    fn exists(&mut self) -> Result<f64, ExprError> {
        let rest = &self.text[self.at..];
        let end = rest.iter().position(|&byte| byte == b']').ok_or(ExprError::Syntax(self.at))?;
        let name = String::from_utf8_lossy(&rest[1..end]).into_owned();
        self.at += end + 1;
        let name = name.trim().trim_start_matches("#<").trim_end_matches('>');
        if name.starts_with('_') && self.parameters.name(name).is_none() {
            // Global ones outlast the program.
            return Err(ExprError::NotKnown(format!("#<{name}>")));
        }
        Ok(f64::from(u8::from(self.parameters.name(name).is_some())))
    }
    /// A variable of Siemens (`R12`, a name) or Heidenhain (`Q12`).
    fn variable(&mut self, name: &str) -> Result<f64, ExprError> {
        let first = name.starts_with(['R', 'Q']);
        if let Some(index) = name.get(1..).filter(|_| first).and_then(parameter_index) {
            let value = self.parameters.number(index);
            return if value.is_nan() { Err(ExprError::NotKnown(name.to_owned())) } else { Ok(value) };
        }
        match name {
            "PI" | "$PI" => Ok(std::f64::consts::PI),
            "TRUE" => Ok(1.0),
            "FALSE" => Ok(0.0),
            _ => self.parameters.name(name).ok_or_else(|| ExprError::Unknown(name.to_owned())),
        }
    }
}

fn apply(operator: &'static str, left: Operand, right: Operand) -> Result<f64, ExprError> {
    let truth = |it: bool| f64::from(u8::from(it));
    let (a, b) = (left.value, right.value);
    let near = left.vacant == right.vacant && (a - b).abs() < 1e-12 * a.abs().max(b.abs()).max(1.0);
    let value = match operator {
        "+" => a + b,
        "-" => a - b,
        "*" => a * b,
        "/" => a / b,
        "**" => a.powf(b),
        "MOD" => a.rem_euclid(b.abs()),
        "DIV" => (a / b).trunc(),
        "EQ" | "==" => truth(near),
        "NE" | "<>" => truth(!near),
        "GT" | ">" => truth(a > b),
        "GE" | ">=" => truth(a >= b),
        "LT" | "<" => truth(a < b),
        "LE" | "<=" => truth(a <= b),
        "AND" => truth(a != 0.0 && b != 0.0),
        "OR" => truth(a != 0.0 || b != 0.0),
        _ => truth((a != 0.0) != (b != 0.0)),
    };
    if value.is_finite() { Ok(value) } else { Err(ExprError::Undefined(operator)) }
}

/// What differs in Macro B.
fn apply_macro_b(operator: &'static str, left: Operand, right: Operand) -> Result<f64, ExprError> {
    // Whole numbers of 32 bits.
    let bits = |of: Operand| of.value.round() as i32;
    match operator {
        "AND" => Ok(f64::from(bits(left) & bits(right))),
        "OR" => Ok(f64::from(bits(left) | bits(right))),
        "XOR" => Ok(f64::from(bits(left) ^ bits(right))),
        "MOD" if left.value < 0.0 || right.value < 0.0 => {
            Err(ExprError::Ambiguous("MOD of a negative number is not the same on all controls"))
        }
        _ => apply(operator, left, right),
    }
}

/// The digits of a whole number in one base, read in another: BIN reads decimal digits of four bits each, BCD makes them. `None` where it has
/// none.
fn in_other_base(x: f64, from: u64, to: u64) -> Option<f64> {
    let mut rest = Some(x).filter(|x| x.fract() == 0.0 && (0.0..1e8).contains(x))? as u64;
    let (mut value, mut place) = (0, 1);
    while rest > 0 {
        let digit = rest % from;
        if digit > 9 {
            return None;
        }
        value += digit * place;
        (rest, place) = (rest / from, place * to);
    }
    Some(value as f64)
}

fn one_argument(function: &str, x: f64) -> Option<f64> {
    Some(match function {
        "ABS" => x.abs(),
        "ACOS" => x.acos().to_degrees(),
        "ASIN" => x.asin().to_degrees(),
        "COS" => x.to_radians().cos(),
        "SIN" => x.to_radians().sin(),
        "TAN" => x.to_radians().tan(),
        "EXP" => x.exp(),
        "LN" => x.ln(),
        "SQRT" => x.sqrt(),
        "FIX" => x.floor(),
        "FUP" => x.ceil(),
        "TRUNC" | "INT" => x.trunc(),
        "NOT" => f64::from(u8::from(x == 0.0)),
        "SGN" => x.signum(),
        "NEG" => -x,
        "BIN" => in_other_base(x, 16, 10)?,
        "BCD" => in_other_base(x, 10, 16)?,
        "AC" | "IC" | "DC" | "ACP" | "ACN" => x,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evaluates_as_a_control_does() {
        let mut p = Parameters::default();
        p.numbered.extend([(1, 5.0), (5, 7.0)]);
        p.set_name("Depth", -2.0);
        let cases = [
            ("[1+2*3]", 7.0),
            ("2**3**2", 64.0),
            ("-#1", -5.0),
            ("##1", 7.0),
            ("#[#1]", 7.0),
            ("#<depth>", -2.0),
            ("#< De pth >", -2.0),
            ("SIN[30]", 0.5),
            ("atan[1]/[1]", 45.0),
            ("ATAN[1,1]", 45.0),
            ("FIX[-2.5]", -3.0),
            ("FUP[2.1]", 3.0),
            ("[#1 GT 4 AND #1 LT 6]", 1.0),
            ("10 MOD 4", 2.0),
            ("EXISTS[#<depth>]", 1.0),
            ("EXISTS[#<none>]", 0.0),
        ];
        for (text, value) in cases {
            let got = evaluate(text.as_bytes(), &p).unwrap();
            assert!((got - value).abs() < 1e-12, "{text} = {got}");
        }
        assert_eq!(assignment(b"#<a> = 3-1", &p), Ok((Target::Name("a".into()), Some(2.0))));
        assert_eq!(assignment(b"#[#1+1]=[4]", &p), Ok((Target::Number(6), Some(4.0))));
    }

    #[test]
    fn vacant_is_not_zero_where_macro_b_says_so() {
        let mut p = Parameters::new(Language::MacroB);
        p.numbered.insert(7, 0.0);
        let mut in_linuxcnc = Parameters::default();
        in_linuxcnc.numbered.insert(7, 0.0);
        let holds = |text: &str, p: &Parameters| evaluate(text.as_bytes(), p).unwrap() != 0.0;
        for (text, vacant, linuxcnc) in [
            ("[#7 EQ #0]", false, true),
            ("[#7 NE #0]", true, false),
            ("[#8 EQ #0]", true, true),
            ("[[#8] EQ #0]", true, true),
            ("[#8 EQ 0]", false, true),
            ("[#8 NE 0]", true, false),
            // Everything else takes it as 0: other comparisons, arithmetic, signs.
            ("[#8 GE 0]", true, true),
            ("[#8 LT 0]", false, false),
            ("[#8+0 EQ 0]", true, true),
            ("[-#8 EQ 0]", true, true),
        ] {
            assert_eq!(holds(text, &p), vacant, "{text}");
            assert_eq!(holds(text, &in_linuxcnc), linuxcnc, "{text} in LinuxCNC");
        }
        assert_eq!(evaluate_or_vacant(b"#8", &p), Ok(None));
        assert_eq!(evaluate_or_vacant(b"#7", &p), Ok(Some(0.0)));
        assert_eq!(assignment(b"#1 = #0", &p), Ok((Target::Number(1), None)));
    }

    /// Fanuc B-64304EN, Custom macro, Arithmetic and logic operation; 0b110 = 6.
    #[test]
    fn macro_b_has_bits_and_drops_fractions() {
        let (macro_b, linuxcnc) = (Parameters::new(Language::MacroB), Parameters::default());
        for (text, one, other) in [
            ("1 OR 6", 7.0, 1.0),
            ("7 AND 2", 2.0, 1.0),
            ("5 XOR 1", 4.0, 0.0),
            ("[2 EQ 2] AND [3 GT 1]", 1.0, 1.0),
            ("2 + 4 AND 6", 6.0, 1.0),
            ("FIX[-1.5]", -1.0, -2.0),
            ("FIX[1.5]", 1.0, 1.0),
            ("ATAN[-1]/[-1]", 225.0, -135.0),
            ("FUP[-1.2]", -2.0, -1.0),
            ("FUP[1.2]", 2.0, 2.0),
            ("BCD[12]", 18.0, 18.0),
            ("BIN[18]", 12.0, 12.0),
        ] {
            assert_eq!(evaluate(text.as_bytes(), &macro_b), Ok(one), "{text}");
            assert_eq!(evaluate(text.as_bytes(), &linuxcnc), Ok(other), "{text} in LinuxCNC");
        }
        for text in ["1 EQ 1 AND 2 EQ 2", "3 OR 1 GT 2", "-5 MOD 3"] {
            assert!(matches!(evaluate(text.as_bytes(), &macro_b), Err(ExprError::Ambiguous(_))), "{text}");
            assert!(evaluate(text.as_bytes(), &linuxcnc).is_ok(), "{text}");
        }
        assert_eq!(evaluate_word(b"ROUND[1.23456]", &macro_b, 0.001), Ok(Some(1.235)));
        assert_eq!(evaluate(b"ROUND[1.23456]", &macro_b), Ok(1.0));
        assert_eq!(evaluate(b"BIN[26]", &macro_b), Err(ExprError::Unknown("BIN".into())));
    }

    #[test]
    fn siemens_has_and_before_or() {
        let siemens = Parameters::new(Language::Siemens);
        let value = |text: &str| evaluate(text.as_bytes(), &siemens);
        assert_eq!(value("(1==1) OR (0==1) AND (0==1)"), Ok(1.0));
        assert_eq!(evaluate(b"(1==1) OR (0==1) AND (0==1)", &Parameters::default()), Ok(0.0));
        assert!(matches!(value("1==1 AND 2==2"), Err(ExprError::Ambiguous(_))));
        assert_eq!(value("7 DIV 2 + 1 > 3"), Ok(1.0));
    }

    /// Against rs274 of LinuxCNC 2.9.
    #[test]
    fn linuxcnc_takes_near_numbers_for_equal() {
        for (text, linuxcnc, others) in
            [("1.00009 EQ 1", 1.0, 0.0), ("1.0002 EQ 1", 0.0, 0.0), ("1.00009 NE 1", 0.0, 1.0)]
        {
            assert_eq!(evaluate(text.as_bytes(), &Parameters::default()), Ok(linuxcnc), "{text}");
            assert_eq!(evaluate(text.as_bytes(), &Parameters::new(Language::MacroB)), Ok(others), "{text}");
        }
        assert_eq!(evaluate(b"1.00009 GT 1", &Parameters::default()), Ok(1.0));
    }

    #[test]
    fn says_what_is_wrong() {
        let p = Parameters::default();
        assert_eq!(evaluate(b"[1+", &p), Err(ExprError::Syntax(3)));
        assert_eq!(evaluate(b"1/0", &p), Err(ExprError::Undefined("/")));
        assert_eq!(evaluate(b"SQRT[-1]", &p), Err(ExprError::Undefined("a function")));
        assert_eq!(evaluate(b"#<nothing>", &p), Err(ExprError::Unknown("#<nothing>".into())));
        let deep = [vec![b'['; 10_000], vec![b'1'], vec![b']'; 10_000]].concat();
        assert_eq!(evaluate(&deep, &p), Err(ExprError::TooDeep));
        assert_eq!(evaluate(&[b'#'; 10_000], &p), Err(ExprError::TooDeep));
    }
}
