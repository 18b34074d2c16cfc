//! Comments that a control acts on: LinuxCNC's messages and logs, which grblHAL has too. In: a comment and the parameters as
//! they are. Out: whether something is said by it, and its text with values where the control would put them in.
//!
//! `(DEBUG, …)`, `(PRINT, …)` and `(LOG, …)` show `#5` and `#<name>` by their values, `(MSG, …)` shows its text as it stands
//! (LinuxCNC documentation, G-code overview: Messages, Parameters in comments).

use crate::nc::dialect::Dialect;
use crate::nc::expr;
use crate::nc::parameters::Parameters;

/// Beginnings of comments that show values.
const VALUED: [&str; 3] = ["DEBUG,", "PRINT,", "LOG,"];
/// Beginnings of the other comments that the control acts on.
const SAID: [&str; 6] = ["MSG,", "LOGOPEN,", "LOGAPPEND,", "LOGCLOSE", "PROBEOPEN", "PROBECLOSE"];
/// Decimals of a value where no format stands before it.
const DECIMALS: usize = 6;

/// Does the control act on this comment (with its delimiters)?
pub fn acts(dialect: Dialect, comment: &[u8]) -> bool {
    begins(dialect, comment, &VALUED) || begins(dialect, comment, &SAID)
}

/// The comment with values in place of parameters; `None`: it stays as it is. An error where one of them was never set.
pub(super) fn with_values(dialect: Dialect, comment: &[u8], parameters: &Parameters) -> Result<Option<Vec<u8>>, ()> {
    if !begins(dialect, comment, &VALUED) || !comment.contains(&b'#') {
        return Ok(None);
    }
    let (mut out, mut at, mut decimals) = (Vec::new(), 0, DECIMALS);
    while at < comment.len() {
        let rest = &comment[at..];
        let (format, name) = (format_length(rest), reference_length(rest));
        let length = format.max(name).max(1);
        if format > 0 {
            decimals = decimals_of(&rest[1..format]);
        }
        if name > 0 {
            parameters.take_unset();
            let value = expr::evaluate(&rest[..name], parameters).map_err(|_| ())?;
            if !parameters.take_unset().is_empty() {
                return Err(());
            }
            out.extend_from_slice(format!("{value:.decimals$}").as_bytes());
        } else {
            out.extend_from_slice(&rest[..length]);
        }
        at += length;
    }
    Ok(Some(out))
}

fn begins(dialect: Dialect, comment: &[u8], words: &[&str]) -> bool {
    let inner = comment.strip_prefix(b"(").unwrap_or_default().trim_ascii_start();
    let is = |word: &&str| inner.get(..word.len()).is_some_and(|own| own.eq_ignore_ascii_case(word.as_bytes()));
    dialect.properties().active_comments && words.iter().any(is)
}

/// Length of `#5` or `#<name>` at the start; 0: there is none.
fn reference_length(rest: &[u8]) -> usize {
    match rest {
        [b'#', b'<', name @ ..] => name.iter().position(|byte| *byte == b'>').map_or(0, |end| end + 3),
        [b'#', digits @ ..] => {
            let count = digits.iter().take_while(|byte| byte.is_ascii_digit()).count();
            if count > 0 { count + 1 } else { 0 }
        }
        _ => 0,
    }
}

/// Length of `%d`, `%f`, `%.3f` at the start; 0: there is none.
fn format_length(rest: &[u8]) -> usize {
    match rest {
        [b'%', b'd' | b'f', ..] => 2,
        [b'%', b'.', b'0'..=b'9', b'f', ..] => 4,
        _ => 0,
    }
}

fn decimals_of(format: &[u8]) -> usize {
    match format {
        [b'd', ..] => 0,
        [b'.', digit, ..] => usize::from(digit - b'0'),
        _ => DECIMALS,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stand_as_the_control_would_show_them() {
        let mut parameters = Parameters::default();
        parameters.numbered.insert(1, 5.0);
        parameters.set_name("_z1", 2.5);
        let with = |text: &str| with_values(Dialect::LinuxCnc, text.as_bytes(), &parameters);
        let some = |text: &str| Ok(Some(text.as_bytes().to_vec()));
        assert_eq!(with("(DEBUG, value #1 and #<_z1>#1.)"), some("(DEBUG, value 5.000000 and 2.5000005.000000.)"));
        assert_eq!(with("(print,%d #1 %.3f #1)"), some("(print,%d 5 %.3f 5.000)"));
        assert_eq!(with("(MSG, pass #1)"), Ok(None), "rs274 shows its text as it stands");
        assert_eq!(with("(DEBUG, #2)"), Err(()));
        assert_eq!(with("(DEBUG, part #)"), some("(DEBUG, part #)"));
        assert_eq!(with_values(Dialect::Fanuc, b"(PRINT, #1)", &parameters), Ok(None));
        assert!(acts(Dialect::LinuxCnc, b"(msg,hello)") && !acts(Dialect::LinuxCnc, b"(debugging)"));
    }
}
