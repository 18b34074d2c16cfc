//! The material as the text of a program or a user names it. In: words like `MATERIAL - ALUMINUM MM - 6061`, `4140 prehard`. Out: a
//! name of the library. What has no entry there (wood, plastics) is not known, whatever is near it.

use super::super::library;
use super::header::Comment;
use super::known::Known;

/// What the comments say of the material: a name of the library, or words that the library has nothing for.
pub fn of_comments(comments: &[Comment]) -> (Option<Known>, Option<String>) {
    let mut unknown = None;
    for comment in comments {
        let Some(words) = after_the_word(&comment.text) else { continue };
        if let Some(known) = named(words, &format!("line {}", comment.line)) {
            return (Some(known), None);
        }
        unknown = unknown.or_else(|| Some(words.to_owned()).filter(|words| words.contains(char::is_alphabetic)));
    }
    (None, unknown)
}

/// `MATERIAL: …`, `MATERIAL - …`, `STOCK MATERIAL = …`, `WORKPIECE MATERIAL …`.
fn after_the_word(text: &str) -> Option<&str> {
    let rest =
        ["STOCK ", "WORKPIECE ", ""].iter().find_map(|before| text.strip_prefix(before)?.strip_prefix("MATERIAL"))?;
    let other = ["SIZE", "SURFACE", "THICK", "HEIGHT", "WIDTH"].iter().any(|word| rest.contains(word));
    let rest = rest.trim_start_matches([' ', ':', '-', '=', '/']);
    (!other && !rest.is_empty()).then_some(rest)
}

/// The entry of the library that people mean: by its own name, else by one of the names they use. A grade (6061) says more than the
/// name of a kind (aluminium), a longer name more than a shorter one.
pub fn named(words: &str, source: &str) -> Option<Known> {
    let lower = words.trim().to_lowercase();
    let entries = library::materials();
    let said = |name: &str, why: String| Some(Known::said(format!("\"{name}\""), &why));
    if let Some(entry) = entries.iter().find(|entry| entry.name == lower) {
        return said(&entry.name, source.to_owned());
    }
    let text = spaced(&lower);
    let known = entries.iter().flat_map(|entry| entry.names.iter().map(move |name| (name, entry)));
    let (called, entry) = known
        .filter(|(name, _)| text.contains(&spaced(name)))
        .max_by_key(|(name, _)| (name.contains(|c: char| c.is_ascii_digit()), name.len()))?;
    said(&entry.name, format!("{source}: {called}"))
}

/// Words and numbers apart by one blank, with one at each end: ` ti 6 al 4 v `, so that `304` is not found in `1304`.
fn spaced(text: &str) -> String {
    let words: Vec<&str> = text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    format!(" {} ", words.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_people_use_are_found_and_none_is_made_up() {
        let entry = |words: &str| named(words, "").map(|known| known.value.trim_matches('"').to_owned());
        for (words, expected) in [
            ("6061", "aluminium-6061-t6"),
            ("ALUMINUM MM - 6061", "aluminium-6061-t6"),
            ("AL 7075-T6", "aluminium"),
            ("1018 cold rolled", "steel"),
            ("AISI 4140", "steel"),
            ("304 stainless", "stainless"),
            ("316L", "stainless"),
            ("D2 tool steel", "iso-p-high-alloy"),
            ("P20", "iso-p-high-alloy"),
            ("Ti-6Al-4V", "titanium"),
            ("cast iron GG25", "cast-iron"),
            ("brass", "iso-n-brass"),
            ("steel-45", "steel-45"),
        ] {
            assert_eq!(entry(words).as_deref(), Some(expected), "{words}");
        }
        for words in ["MDF", "plywood", "Delrin", "HDPE", "oak", "1304", "kryptonite", ""] {
            assert_eq!(entry(words), None, "{words}");
        }
    }
}
