//! The numbers of a tool's description and what each is. In: text in capitals. Out: figures, each with its role and its unit as far as
//! the words around it say.

/// What a number in a description is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Role {
    /// A diameter by its name.
    Diameter,
    /// A corner radius.
    Corner,
    /// An angle, deg.
    Angle,
    Flutes,
    /// A size without a name.
    Size,
    /// A number, a length, a pitch …
    Other,
}

/// A number of a description.
#[derive(Debug, Clone, Copy)]
pub struct Figure {
    pub role: Role,
    pub value: f64,
    /// In mm (true) or inch (false), where that is written.
    pub metric: Option<bool>,
    pub fraction: bool,
    /// Its name is more than a D, which may be the number of an offset.
    pub spelt: bool,
}

/// Words before a number that say what it is.
fn role_before(word: &str) -> Option<Role> {
    match word {
        "D" | "DIA" | "DIAM" | "DIAMETER" | "\u{d8}" => Some(Role::Diameter),
        "CR" | "R" | "RAD" | "RADIUS" => Some(Role::Corner),
        "TAPER" | "ANGLE" | "POINT" | "TIP" => Some(Role::Angle),
        "FLUTES" | "FLUTE" | "FL" | "Z" => Some(Role::Flutes),
        "ID" | "H" | "L" | "T" | "TOOL" | "NO" | "NUMBER" | "LEN" | "LENGTH" | "LOC" | "OAL" | "ZMIN" | "ZMAX"
        | "OFF" | "OFFSET" | "PITCH" | "P" | "X" | "TPI" | "S" | "F" | "SPEED" | "FEED" | "RPM" | "LEAVE" | "TOL"
        | "HOLDER" | "STICKOUT" | "OP" | "JOB" | "POCKET" | "REV" | "LAYER" | "UNC" | "UNF" | "SFM" | "CORNER" => {
            Some(Role::Other)
        }
        _ => None,
    }
}

/// Words behind a number (and its unit) that say what it is.
fn role_after(word: &str) -> Option<Role> {
    match word {
        "DIA" | "DIAM" | "DIAMETER" => Some(Role::Diameter),
        "RAD" | "RADIUS" | "CR" => Some(Role::Corner),
        "DEG" | "DEGREE" | "DEGREES" | "\u{b0}" => Some(Role::Angle),
        "FLUTES" | "FLUTE" | "FLTS" | "FLT" | "FL" => Some(Role::Flutes),
        "TPI" | "LONG" | "LOC" | "OAL" | "PITCH" | "XD" | "RPM" | "DEEP" | "UNC" | "UNF" | "LENGTH" | "REACH"
        | "HOLE" | "HOLES" => Some(Role::Other),
        _ => None,
    }
}

/// The numbers of a description with what they are.
pub fn figures(text: &str) -> Vec<Figure> {
    let chars: Vec<char> = text.chars().collect();
    let mut found = Vec::new();
    let (mut at, mut label, mut hash) = (0, String::new(), false);
    while at < chars.len() {
        let c = chars[at];
        let digit = |at: usize| chars.get(at).is_some_and(char::is_ascii_digit);
        if c.is_alphabetic() {
            label.clear();
            while let Some(c) = chars.get(at).filter(|c| c.is_alphabetic()) {
                label.push(*c);
                at += 1;
            }
            hash = false;
        } else if digit(at) || c == '.' && digit(at + 1) {
            let (value, fraction, end) = size(&chars, at);
            let (metric, after) = unit(&chars, end);
            let (word, _) = word_at(&chars, after);
            let degrees = chars.get(end) == Some(&'\u{b0}');
            let thread = label == "M" && chars.get(end) == Some(&'X')
                || fraction && chars.get(end) == Some(&'-') && digit(end + 1);
            let role = if hash || thread {
                Role::Other
            } else if degrees {
                Role::Angle
            } else {
                // Flutes and angles are named behind the number, the rest before it or, where nothing stands there, behind it.
                let before = role_before(&label).filter(|_| !(label == "TOOL" && (fraction || metric.is_some())));
                match role_after(&word) {
                    Some(role @ (Role::Flutes | Role::Angle)) => role,
                    after => before.or(after).unwrap_or(Role::Size),
                }
            };
            found.push(Figure { role, value, metric, fraction, spelt: label != "D" });
            if thread {
                // The pitch or the threads an inch behind a thread's name.
                let (_, _, next) = size(&chars, end + 1);
                at = next.max(end + 1);
            } else {
                at = end;
            }
            (label, hash) = (String::new(), false);
        } else {
            hash = c == '#';
            if matches!(c, ',' | ';' | '|' | '{' | '(') {
                label.clear();
            }
            at += 1;
        }
    }
    found
}

/// `3/4`, `1-1/2`, `10.2`, `.5` at a place: value, whether it is a fraction, and where it ends.
fn size(chars: &[char], at: usize) -> (f64, bool, usize) {
    let digits = |from: usize| from + chars[from.min(chars.len())..].iter().take_while(|c| c.is_ascii_digit()).count();
    let whole = |from: usize, to: usize| chars[from..to].iter().collect::<String>().parse::<f64>().unwrap_or(0.0);
    let over = digits(at);
    let fraction = |from: usize, end: usize| {
        let under = digits(end + 1);
        let is = end > from && chars.get(end) == Some(&'/') && under > end + 1 && whole(end + 1, under) > 0.0;
        is.then(|| (whole(from, end) / whole(end + 1, under), under))
    };
    if let Some((value, end)) = fraction(at, over) {
        return (value, true, end);
    }
    if chars.get(over) == Some(&'-')
        && let Some((part, end)) = fraction(over + 1, digits(over + 1))
    {
        return (whole(at, over) + part, true, end);
    }
    let end = if chars.get(over) == Some(&'.') { digits(over + 1) } else { over };
    (whole(at, end), false, end)
}

/// The unit behind a number, and where what follows it begins.
fn unit(chars: &[char], at: usize) -> (Option<bool>, usize) {
    let (word, end) = word_at(chars, at);
    match word.as_str() {
        "MM" => (Some(true), end),
        "IN" | "INCH" | "INCHES" => (Some(false), end),
        _ if chars.get(at) == Some(&'"') => (Some(false), at + 1),
        _ => (None, at),
    }
}

/// The word behind blanks and one hyphen, and its end.
fn word_at(chars: &[char], at: usize) -> (String, usize) {
    let begin = at + chars[at.min(chars.len())..].iter().take_while(|c| matches!(c, ' ' | '-')).count();
    let word: String = chars[begin.min(chars.len())..].iter().take_while(|c| c.is_alphabetic()).collect();
    let end = begin + word.chars().count();
    (word, end)
}
