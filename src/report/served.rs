//! What the served page has besides the report: the list of a folder with a place to drop programs, the form of limits above a report,
//! and why there is none. In: names, limits, sentences. Out: markup.

use maud::{Markup, html};

use super::embedded::script;
use super::html::{page, page_with};
use super::words;
use crate::machine::LimitKind;
use crate::units::Dimension;

/// Takes what is dropped on the page of the folder.
const DROP: &str = include_str!("page/drop.js");

/// A link: what it says, where it leads.
pub type Link = (String, String);

/// The page of a folder: its programs, those that were dropped, and the place to drop one.
pub fn folder_page(folder: &str, programs: &[Link], dropped: &[Link], most_bytes: usize) -> String {
    let body = html! {
        h2 { "Programs" } "\n"
        (links(programs, "There is no program in this folder."))
        @if !dropped.is_empty() {
            h2 { "Dropped here" } "\n"
            p { "In memory only, until feedwright ends." } "\n"
            (links(dropped, ""))
        }
        div id="drop" data-most=(most_bytes) {
            label { "Drop an NC program here, or choose one: " input type="file" id="choose"; }
            p id="said" role="status" {}
        }
        "\n"
    };
    page_with(&format!("Feedwright: {folder}"), &body, &script(&format!("\n'use strict';\n{DROP}")))
}

fn links(links: &[Link], none: &str) -> Markup {
    html! {
        @if links.is_empty() {
            p { (none) } "\n"
        } @else {
            ul class="programs" { @for (name, to) in links { li { a href=(to) { (name) } } "\n" } } "\n"
        }
    }
}

/// A program whose report cannot be made: why, and the form to put it right.
pub fn refusal_page(name: &str, sentences: &[String], shown: &Form) -> String {
    let body = html! {
        (form(shown))
        div class="verdict bad" { b { "No feeds" } "\n" @for sentence in sentences { p { (sentence) } "\n" } } "\n"
    };
    page(name, &body)
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
pub(super) fn form(form: &Form) -> Markup {
    html! {
        form class="limits screen" method="get" {
            p {
                a href="../" { "all programs" } " "
                label {
                    "setup "
                    select name="setup" {
                        option value="" { "from the comments of the program" }
                        @for name in &form.setups {
                            option value=(name) selected[form.setup.as_ref() == Some(name)] { (name) }
                        }
                    }
                }
            }
            div class="fields" { "\n" @for field in &form.fields { (input(field, form.inch)) "\n" } }
            p {
                button { "feeds with these limits" } " " span id="took" { (form.said) }
                @for (name, to) in &form.save { " " a href=(to) { (name) } }
            }
        }
        "\n"
    }
}

/// One limit with its value; one that was changed is marked.
fn input(field: &Field, inch: bool) -> Markup {
    let class = (field.value != field.written).then_some("changed");
    html! {
        label class=[class] {
            span {
                @if let Some(number) = field.tool { "T" (number) ": " }
                (name(field.kind)) ", " (unit(field.kind, inch))
            }
            " " input name=(field.key) value=(field.value) size="9" autocomplete="off";
        }
    }
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
        for text in [folder_page(bad, &link, &link, 9), refusal_page(bad, &[bad.into()], &shown)] {
            assert!(!text.contains("<script>alert") && !text.contains(bad), "{text}");
        }
        let text = form(&shown).into_string();
        assert_eq!(text.matches("class=\"changed\"").count(), 1);
        assert!(text.contains("T3: cutting force, N"), "{text}");
        assert_eq!((unit(LimitKind::Feed, true), unit(LimitKind::Deflection, false)), ("in/min", "mm"));
    }
}
