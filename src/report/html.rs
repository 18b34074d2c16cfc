//! What every HTML report is made of: the shell with its style, and tables. In: markup and cells. Out: text that needs
//! no other file.
//!
//! Text becomes markup by `maud` alone, which escapes whatever is not written as markup in the source; style, scripts
//! and data are encoded in `embedded.rs`.

use maud::{DOCTYPE, Markup, html};

use super::embedded::style;

const STYLE: &str = include_str!("page/page.css");

/// One HTML file with a title.
pub(super) fn page(title: &str, body: &Markup) -> String {
    page_with(title, body, &html! {})
}

/// The same with scripts behind the body.
pub(super) fn page_with(title: &str, body: &Markup, scripts: &Markup) -> String {
    let file = html! {
        (DOCTYPE) "\n"
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="generator" content={ "w" (super::marks::MARK) " " (env!("CARGO_PKG_VERSION")) };
                meta name="viewport" content="width=device-width,initial-scale=1";
                title { (title) }
                (style(STYLE))
            }
            body { "\n" h1 { (title) } "\n" (body) (scripts) }
        }
        "\n"
    };
    file.into_string()
}

/// What a colour of a drawing stands for.
pub(super) fn key(colour: &str, name: &str) -> Markup {
    html! { span class="key" { i style={ "background:" (colour) } {} (name) } }
}

/// A table with a head; nothing where there are no rows.
pub(super) fn table(title: &str, head: &[&str], rows: &[Vec<String>]) -> Markup {
    any_table(title, head, rows, None, &|_, _| false)
}

/// A table whose last column is words.
pub(super) fn words(title: &str, head: &[&str], rows: &[Vec<String>]) -> Markup {
    any_table(title, head, rows, Some("words"), &|_, _| false)
}

/// A table with a head, some of its cells marked as bad.
pub(super) fn marked(
    title: &str,
    head: &[&str],
    rows: &[Vec<String>],
    is_bad: &dyn Fn(usize, usize) -> bool,
) -> Markup {
    any_table(title, head, rows, None, is_bad)
}

/// A table that opens on demand.
pub(super) fn folded(title: &str, head: &[&str], rows: &[Vec<String>]) -> Markup {
    html! {
        @if !rows.is_empty() {
            details { summary { (title) ": " (rows.len()) } (words(title, head, rows)) } "\n"
        }
    }
}

fn any_table(
    title: &str,
    head: &[&str],
    rows: &[Vec<String>],
    class: Option<&str>,
    is_bad: &dyn Fn(usize, usize) -> bool,
) -> Markup {
    let left = |column: usize| (column == 0).then_some("l");
    let of_cell = |row: usize, column: usize| left(column).or_else(|| is_bad(row, column).then_some("bad"));
    html! {
        @if !rows.is_empty() {
            h2 { (title) } "\n"
            div class="scroll" {
                table class=[class] {
                    tr { @for (column, name) in head.iter().enumerate() { th class=[left(column)] { (name) } } } "\n"
                    @for (line, row) in rows.iter().enumerate() {
                        tr {
                            @for (column, cell) in row.iter().enumerate() {
                                td class=[of_cell(line, column)] { (cell) }
                            }
                        }
                        "\n"
                    }
                }
            }
            "\n"
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn titles_heads_and_cells_are_text() {
        let bad = "\"><script>alert(1)</script>&";
        let rows = [vec![bad.to_owned(), bad.to_owned()]];
        let body = html! {
            (marked(bad, &[bad, bad], &rows, &|_, _| true))
            (words(bad, &[bad], &rows))
            (folded(bad, &[bad], &rows))
        };
        let text = page(bad, &body);
        assert!(!text.contains("<script") && !text.contains(bad), "{text}");
        assert_eq!(text.matches("&quot;&gt;&lt;script&gt;alert(1)&lt;/script&gt;&amp;").count(), 16, "{text}");
        assert_eq!(text.matches("<td class=\"bad\">").count(), 1, "the first column is the name of the row");
        assert_eq!(text.matches("<table class=\"words\">").count(), 2);
        assert!(text.starts_with("<!DOCTYPE html>\n") && text.ends_with("</body></html>\n"));
    }

    #[test]
    fn a_table_without_rows_is_not_shown() {
        let shown = [table("a", &["b"], &[]), words("a", &["b"], &[]), folded("a", &["b"], &[])];
        assert_eq!(shown.map(Markup::into_string), ["", "", ""]);
    }
}
