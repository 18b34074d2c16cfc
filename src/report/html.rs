//! What every HTML report is made of: the shell with its style, and tables. In: markup and cells. Out: text that needs no other file.

use std::fmt::Write;

const STYLE: &str = include_str!("page/page.css");

/// One HTML file with a title.
pub(super) fn page(title: &str, body: &str) -> String {
    page_with(title, body, "")
}

/// The same with scripts behind the body.
pub(super) fn page_with(title: &str, body: &str, scripts: &str) -> String {
    let name = escaped(title);
    format!(
        "<!doctype html>\n<!-- w{} {} -->\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><title>{name}</title><style>{STYLE}</style></head><body>\n<h1>{name}</h1>\n{body}{scripts}</body></html>\n",
        super::marks::MARK,
        env!("CARGO_PKG_VERSION")
    )
}

/// Text as HTML shows it.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A table with a head.
pub(super) fn table(title: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    marked(title, head, rows, &|_, _| false)
}

/// A table whose last column is words.
pub(super) fn words(title: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    table(title, head, rows).replacen("<table>", "<table class=\"words\">", 1)
}

/// A table with a head, some of its cells marked as bad.
pub(super) fn marked(
    title: &str,
    head: &[&str],
    rows: &[Vec<String>],
    is_bad: &dyn Fn(usize, usize) -> bool,
) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let mut text = format!("<h2>{title}</h2>\n<div class=\"scroll\"><table><tr>");
    for (index, name) in head.iter().enumerate() {
        let _ = write!(text, "<th{}>{name}</th>", if index == 0 { " class=\"l\"" } else { "" });
    }
    text += "</tr>\n";
    for (line, row) in rows.iter().enumerate() {
        text += "<tr>";
        for (index, cell) in row.iter().enumerate() {
            let class = match index {
                0 => " class=\"l\"",
                _ if is_bad(line, index) => " class=\"bad\"",
                _ => "",
            };
            let _ = write!(text, "<td{class}>{}</td>", escaped(cell));
        }
        text += "</tr>\n";
    }
    text + "</table></div>\n"
}

/// A table that opens on demand.
pub(super) fn folded(title: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let inner = words(title, head, rows);
    format!("<details><summary>{title}: {}</summary>{inner}</details>\n", rows.len())
}
