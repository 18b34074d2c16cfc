//! What the served page has besides the report: the list of a folder with a place to drop programs, the form of limits above a report,
//! and why there is none. In: names, limits, sentences. Out: markup.

use std::fmt::Write;

use super::html::{escaped, page, page_with};
use super::words;
use crate::machine::LimitKind;
use crate::units::Dimension;

/// Takes what is dropped on the page of the folder.
const DROP: &str = include_str!("page/drop.js");

/// A link: what it says, where it leads.
pub type Link = (String, String);

/// The page of a folder: its programs, those that were dropped, and the place to drop one.
pub fn folder_page(folder: &str, programs: &[Link], dropped: &[Link], most_bytes: usize) -> String {
    let mut body = String::from("<h2>Programs</h2>\n");
    body += &links(programs, "There is no program in this folder.");
    if !dropped.is_empty() {
        body += "<h2>Dropped here</h2>\n<p>In memory only, until feedwright ends.</p>\n";
        body += &links(dropped, "");
    }
    let _ = write!(
        body,
        "<div id=\"drop\" data-most=\"{most_bytes}\"><label>Drop an NC program here, or choose one: <input type=\"file\" id=\"choose\"></label>\n\
         <p id=\"said\" role=\"status\"></p></div>\n"
    );
    page_with(&format!("Feedwright: {folder}"), &body, &format!("<script>\n'use strict';\n{DROP}</script>\n"))
}

fn links(links: &[Link], none: &str) -> String {
    if links.is_empty() {
        return format!("<p>{none}</p>\n");
    }
    let one = |text: String, (name, to): &Link| {
        text + &format!("<li><a href=\"{}\">{}</a></li>\n", escaped(to), escaped(name))
    };
    format!("<ul class=\"programs\">{}</ul>\n", links.iter().fold(String::new(), one))
}

/// A program whose report cannot be made: why, and the form to put it right.
pub fn refusal_page(name: &str, sentences: &[String], form: &str) -> String {
    let said = sentences.iter().fold(String::new(), |text, one| text + &format!("<p>{}</p>\n", escaped(one)));
    page(name, &format!("{form}<div class=\"verdict bad\"><b>No feeds</b>\n{said}</div>\n"))
}

/// One limit of the form.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Its name in the form.
    pub key: String,
    /// The limit.
    pub kind: LimitKind,
    /// The tool it holds for; `None`: all.
    pub tool: Option<u32>,
    /// As written in the setup; empty: none.
    pub written: String,
    /// As it is now.
    pub value: String,
}

/// What the form above a report shows.
#[derive(Debug, Default)]
pub struct Form {
    /// Setups to choose from, and the one in use; `None`: what the comments of the program tell.
    pub setups: Vec<String>,
    /// The one in use.
    pub setup: Option<String>,
    /// Is the setup in inches?
    pub inch: bool,
    /// The limits.
    pub fields: Vec<Field>,
    /// How long the feeds took, and whether anything was simulated.
    pub said: String,
    /// What can be saved.
    pub save: Vec<Link>,
}

/// The form as markup. Its values go into the address: what was tried can be gone back to.
pub fn form(form: &Form) -> String {
    let mut text = String::from("<form class=\"limits screen\" method=\"get\">\n<p><a href=\"../\">all programs</a>");
    let chosen = |name: &str| if form.setup.as_deref() == Some(name) { " selected" } else { "" };
    text += " <label>setup <select name=\"setup\"><option value=\"\">from the comments of the program</option>";
    for name in &form.setups {
        let _ = write!(text, "<option value=\"{0}\"{1}>{0}</option>", escaped(name), chosen(name));
    }
    text += "</select></label></p>\n<div class=\"fields\">\n";
    for field in &form.fields {
        let tool = field.tool.map_or_else(String::new, |number| format!("T{number}: "));
        let changed = if field.value == field.written { "" } else { " class=\"changed\"" };
        let _ = writeln!(
            text,
            "<label{changed}><span>{tool}{}, {}</span> <input name=\"{}\" value=\"{}\" size=\"9\" autocomplete=\"off\"></label>",
            name(field.kind),
            unit(field.kind, form.inch),
            escaped(&field.key),
            escaped(&field.value)
        );
    }
    let _ = write!(
        text,
        "</div>\n<p><button>feeds with these limits</button> <span id=\"took\">{}</span>",
        escaped(&form.said)
    );
    for (name, to) in &form.save {
        let _ = write!(text, " <a href=\"{}\">{}</a>", escaped(to), escaped(name));
    }
    text + "</p>\n</form>\n"
}

/// What a limit is called in the form.
fn name(kind: LimitKind) -> &'static str {
    match kind {
        LimitKind::Feed => "feed",
        LimitKind::FeedChange => "a feed rises at most",
        kind => words::plain(kind),
    }
}

/// The unit of a bare number in the setup.
fn unit(kind: LimitKind, inch: bool) -> &'static str {
    match kind.row().dimension {
        dimension @ (Dimension::Length | Dimension::Feed) => dimension.bare(inch),
        Dimension::Ratio => "times",
        dimension => dimension.report_unit(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_of_a_name_or_value_becomes_markup() {
        let bad = "\"><script>alert(1)</script>";
        let field = |value: &str| Field {
            key: "force_xy".into(),
            kind: LimitKind::ForceXy,
            tool: Some(3),
            written: "500".into(),
            value: value.into(),
        };
        let shown = Form {
            setups: vec![bad.into()],
            fields: vec![field(bad), field("500")],
            save: vec![(bad.into(), bad.into())],
            ..Form::default()
        };
        let link = [(bad.to_owned(), bad.to_owned())];
        for text in [form(&shown), folder_page(bad, &link, &link, 9), refusal_page(bad, &[bad.into()], "")] {
            assert!(!text.contains("<script>alert"), "{text}");
        }
        let text = form(&shown);
        assert_eq!(text.matches("class=\"changed\"").count(), 1);
        assert!(text.contains("T3: cutting force, N"), "{text}");
        assert_eq!((unit(LimitKind::Feed, true), unit(LimitKind::Deflection, false)), ("in/min", "mm"));
    }
}
