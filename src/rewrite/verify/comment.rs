//! Comments that the proof accepts as Feedwright's own. In: a comment with its delimiters. Out: whether it has exactly this grammar. All other
//! comments are the user's and must stay. This is independent of the code that writes them (`rewrite/mark.rs`): a comment that the two
//! read differently is a difference.
//!
//! ```text
//! FEEDWRIGHT <version> FEEDS ONLY [<sum: eight hexadecimal digits>]
//! FW F<number> [WAS <number>] [<LIMIT>] [<count>PCT] [T<count>] [KEPT]
//! FW WAS <number>[X<count>] …
//! FW CHECK <count> CYCLE <count>
//! ```
//!
//! WAS, LIMIT, KEPT and X of a note may be in small letters, and PCT may be `%`.

use crate::machine::LimitKind;

use super::exact::Exact;

/// Is the comment one of the grammar above?
pub fn is_ours(comment: &[u8]) -> bool {
    let Some(inside) = std::str::from_utf8(comment).ok().and_then(inside) else { return false };
    let words: Vec<&str> = inside.split(' ').collect();
    match &words[..] {
        ["FEEDWRIGHT", version, "FEEDS", "ONLY", sum @ ..] => {
            is_version(version) && (sum.is_empty() || sum.len() == 1 && is_sum(sum[0]))
        }
        ["FW", "WAS", runs @ ..] => !runs.is_empty() && runs.iter().all(|run| is_run(run)),
        ["FW", "CHECK", number, "CYCLE", cycle] => is_count(number) && is_count(cycle),
        ["FW", note @ ..] => is_note(note),
        _ => false,
    }
}

fn inside(comment: &str) -> Option<&str> {
    match comment.strip_prefix('(') {
        Some(rest) => rest.strip_suffix(')'),
        None => comment.strip_prefix("; ").map(str::trim_end),
    }
}

fn is_note(words: &[&str]) -> bool {
    let mut rest = words.iter().copied().peekable();
    let feed = rest.next().and_then(|word| word.strip_prefix('F')).is_some_and(is_number);
    if rest.next_if(|word| either_case(word, "WAS")).is_some() && !rest.next().is_some_and(is_number) {
        return false;
    }
    rest.next_if(|word| LimitKind::ALL.iter().any(|kind| either_case(word, &kind.name().to_ascii_uppercase())));
    rest.next_if(|word| word.strip_suffix("PCT").or(word.strip_suffix('%')).is_some_and(is_count));
    rest.next_if(|word| word.strip_prefix('T').is_some_and(is_count));
    rest.next_if(|word| either_case(word, "KEPT"));
    feed && rest.next().is_none()
}

/// The word as a whole in capitals or in small letters.
fn either_case(word: &str, capitals: &str) -> bool {
    [capitals, &capitals.to_ascii_lowercase()].contains(&word)
}

fn is_number(word: &str) -> bool {
    Exact::read(word.as_bytes()).is_some()
}

/// A whole number as it is printed: no sign, no zero before it.
fn is_count(word: &str) -> bool {
    word.parse::<u32>().is_ok_and(|count| count.to_string() == word)
}

fn is_run(word: &str) -> bool {
    match word.split_once(['X', 'x']) {
        Some((number, count)) => is_number(number) && is_count(count) && count != "0" && count != "1",
        None => is_number(word),
    }
}

fn is_version(word: &str) -> bool {
    !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.')
}

fn is_sum(word: &str) -> bool {
    word.len() == 8 && word.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'A'..=b'F'))
}

#[cfg(test)]
mod tests {
    use super::is_ours;

    /// Each word of the grammar, and the same with one thing wrong.
    #[test]
    fn only_the_grammar_is_ours() {
        for (text, ours) in [
            ("(FEEDWRIGHT 0.1 FEEDS ONLY)", true),
            ("(FEEDWRIGHT 0.1.0 FEEDS ONLY 000003F2)", true),
            ("(FEEDWRIGHT 0.1 FEEDS ONLY 3F2)", false),
            ("(FEEDWRIGHT 0.1 FEEDS ONLY 000003f2)", false),
            ("(FEEDWRIGHT FEEDS ONLY)", false),
            ("(FW F600)", true),
            ("; FW F600 was .5 power 98% T3 kept ", true),
            ("; FW F600 was .5 power 98PCT T3 kept ", true),
            ("(FW F600 WAS .5 FORCE_XY 98PCT T3 KEPT)", true),
            ("(FW F600 Was .5)", false),
            ("(FW F600 98pct)", false),
            ("(FW F600 T3 98%)", false),
            ("(FW F600 098%)", false),
            ("(FW F600 was)", false),
            ("(FW  F600)", false),
            ("(fw F600)", false),
            ("(FW F600 kept) G1", false),
            ("(FW F6e2)", false),
            ("(FW WAS 600X12 .5)", true),
            ("(FW WAS 600x12 .5)", true),
            ("(FW WAS 600x1)", false),
            ("(FW WAS)", false),
            ("(FW CHECK 1 CYCLE 2)", true),
            ("(FW CHECK 1 CYCLE 02)", false),
        ] {
            assert_eq!(is_ours(text.as_bytes()), ours, "{text}");
        }
    }
}
