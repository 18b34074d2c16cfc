//! What stands in a page as it is: style, scripts, data. `maud` escapes text and attributes, but a browser reads these
//! three to the end of their element without looking for escapes, so each is encoded in its own language, where it
//! means the same. In: source text or data. Out: the whole element.

use maud::{Markup, PreEscaped, html};
use serde::Serialize;

/// `<style>`. Only `</` can end it; in CSS a slash behind a backslash is that slash.
pub(super) fn style(css: &str) -> Markup {
    html! { style { (PreEscaped(css.replace("</", "<\\/"))) } }
}

/// `<script>`. Only `</script` can end it, and `<!--` with `<script` could hide its end. In a string, where alone
/// they can stand, `\x3C` is `<` (HTML Living Standard, "Restrictions for contents of script elements").
pub(super) fn script(source: &str) -> Markup {
    html! { script { (PreEscaped(encoded_script(source))) } "\n" }
}

fn encoded_script(source: &str) -> String {
    let ends = |rest: &str| {
        let begins = |word: &str| rest.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word));
        ["!--", "script", "/script"].into_iter().any(begins)
    };
    let mut parts = source.split('<');
    let mut encoded = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        encoded += if ends(part) { "\\x3C" } else { "<" };
        encoded += part;
    }
    encoded
}

/// `<script type="application/json">` with an id. JSON has `<` in its strings only, where `\u003c` is the same.
pub(super) fn json(id: &str, data: &impl Serialize) -> Markup {
    let text = serde_json::to_string(data).expect("plain data").replace('<', "\\u003c");
    html! { script type="application/json" id=(id) { (PreEscaped(text)) } "\n" }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ends of elements and what hides them, as a browser looks for them: any case, whatever follows.
    const HOSTILE: &str =
        "a<b </script><script>alert(1)</script> </SCRIPT\t> <!-- <script </style><b> </sTyle/> ]]> & \" '";

    /// The text of an element, if nothing before its own end closes it.
    fn inside<'a>(markup: &'a str, name: &str) -> &'a str {
        let end = format!("</{name}");
        let lower = markup.to_ascii_lowercase();
        assert_eq!(lower.matches(&end).count(), 1, "{markup}");
        let begin = lower.find('>').expect("an open element") + 1;
        &markup[begin..lower.find(&end).expect("its end")]
    }

    #[test]
    fn data_cannot_end_their_element_and_come_back_as_they_were() {
        let text = json("data", &[HOSTILE]).into_string();
        let inner = inside(&text, "script");
        assert!(!inner.contains('<'), "{inner}");
        assert_eq!(serde_json::from_str::<[String; 1]>(inner).expect("JSON"), [HOSTILE]);
        // The id is an attribute as any other.
        assert!(json("\"><b>", &0).into_string().contains("id=\"&quot;&gt;&lt;b&gt;\""));
    }

    #[test]
    fn a_script_cannot_be_ended_or_hidden_by_its_strings() {
        let text = script(&format!("const a = 1<2, b = '{HOSTILE}';")).into_string();
        let inner = inside(&text, "script");
        let lower = inner.to_ascii_lowercase();
        assert!(!lower.contains("<!--") && !lower.contains("<script"), "{inner}");
        // Nothing else is touched, and a string means what it did.
        assert!(inner.starts_with("const a = 1<2, b = 'a<b "), "{inner}");
        assert!(inner.replace("\\x3C", "<").contains(HOSTILE), "{inner}");
    }

    #[test]
    fn a_style_cannot_be_ended_by_its_strings() {
        let text = style(&format!("b::after{{content:'{HOSTILE}'}}i>b{{color:red}}")).into_string();
        let inner = inside(&text, "style");
        assert!(inner.replace("<\\/", "</").contains(HOSTILE) && inner.ends_with("i>b{color:red}"), "{inner}");
    }
}
