//! A log as it was read, as text and as JSON. In: [`LogOverview`]. Out: what `log` shows.

use crate::learn::log::Kind;
use crate::learn::log::overview::{ColumnOverview, LogOverview};
use serde_json::json;

/// A mapping as a line of the `[log]` table of a setup.
pub fn log_columns(mapping: &[(String, String)]) -> String {
    let pair = |(theirs, ours): &(String, String)| format!("{} = \"{ours}\"", toml::Value::from(theirs.as_str()));
    format!("columns = {{ {} }}", mapping.iter().map(pair).collect::<Vec<_>>().join(", "))
}

/// For the terminal.
pub fn log_text(seen: &LogOverview, name: &str) -> String {
    let kind = match (seen.kind, &seen.layout) {
        (Kind::Shdr, _) => "MTConnect adapter output, a row where something changes".to_owned(),
        (Kind::Streams, _) => "MTConnect streams, a row where something changes".to_owned(),
        (Kind::Table, None) => "table".to_owned(),
        (Kind::Table, Some(layout)) => {
            let mut words = vec![format!("table with {}", layout.separator.name())];
            words.extend(layout.decimal_comma.then(|| "decimal comma".to_owned()));
            words.extend(
                (layout.preamble > 0 && layout.has_header)
                    .then(|| format!("{} lines before its header", layout.preamble)),
            );
            words.extend(layout.has_units.then(|| "a row of units".to_owned()));
            words.extend(
                (!layout.has_header).then(|| "no header: columns count from 1, --columns names them".to_owned()),
            );
            words.join(", ")
        }
    };
    let mut text = format!("{name}: {} rows; {kind}\n", seen.rows);
    if let Some([length, step]) = seen.clock_s {
        let rate = if seen.kind.is_on_change() { String::new() } else { format!(", {:.4} Hz", 1.0 / step) };
        text += &format!("clock     {length:.1} s, readings {step:.4} s apart{rate}\n");
    }
    let width = seen.columns.iter().map(|column| column.name.chars().count()).max().unwrap_or(0).clamp(6, 40);
    text += &format!("\n{:<width$}  {:<24}  {:>12}  {:>12}  missing\n", "column", "read as", "least", "greatest");
    for column in &seen.columns {
        text += &column_line(column, width);
    }
    for gap in &seen.gaps_s {
        text += &format!("gap       {:.1} to {:.1} s: nothing was recorded there\n", gap[0], gap[1]);
    }
    for event in &seen.events {
        text += &format!("event     {:.1} to {:.1} s: {}\n", event.time_s[0], event.time_s[1], event.what);
    }
    for warning in &seen.warnings {
        text += &format!("odd       {warning}\n");
    }
    let proposed = seen.proposed();
    if !proposed.is_empty() {
        let pairs: Vec<String> = proposed.iter().map(|(theirs, ours)| format!("{theirs}={ours}")).collect();
        text += &format!(
            "\nproposed  --columns \"{}\"\n          or in the setup, as --write does: [log] {}\n",
            pairs.join(","),
            log_columns(&proposed)
        );
    }
    if let Some(why) = &seen.unusable {
        text += &format!("\nnot usable by learn: {why}\n");
    }
    text
}

fn column_line(column: &ColumnOverview, width: usize) -> String {
    let read = match (column.read_as, &column.proposed) {
        (Some(read), _) => read.to_owned(),
        (None, Some(proposed)) => format!("not used; {proposed}?"),
        (None, None) => "not used".to_owned(),
    };
    let name: String = column.name.chars().take(width).collect();
    let cell = |value: f64| {
        if value.abs() < 1e6 {
            format!("{value:.6}").trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            format!("{value:.6e}")
        }
    };
    let (least, most) = match column.range {
        Some([least, most]) if least == most => (cell(least), "constant".to_owned()),
        Some([least, most]) => (cell(least), cell(most)),
        None => ("text".to_owned(), String::new()),
    };
    format!("{name:<width$}  {read:<24}  {least:>12}  {most:>12}  {:>5.1} %\n", column.missing_percent)
}

/// For programs.
pub fn log_json(seen: &LogOverview, name: &str) -> String {
    let column = |column: &ColumnOverview| {
        json!({
            "name": column.name,
            "read_as": column.read_as,
            "proposed": column.proposed,
            "least": column.range.map(|range| range[0]),
            "greatest": column.range.map(|range| range[1]),
            "missing_percent": column.missing_percent,
        })
    };
    let value = json!({
        "written_by": super::marks::WRITTEN_BY,
        "file": name,
        "kind": match seen.kind { Kind::Table => "table", Kind::Shdr => "shdr", Kind::Streams => "mtconnect-streams" },
        "layout": seen.layout.as_ref().map(|layout| json!({
            "separator": layout.separator.name(),
            "decimal_comma": layout.decimal_comma,
            "preamble_rows": layout.preamble,
            "header": layout.has_header,
            "units_row": layout.has_units,
        })),
        "rows": seen.rows,
        "length_s": seen.clock_s.map(|clock| clock[0]),
        "step_s": seen.clock_s.map(|clock| clock[1]),
        "columns": seen.columns.iter().map(column).collect::<Vec<_>>(),
        "gaps": seen.gaps_s.iter().map(|gap| json!({"from_s": gap[0], "to_s": gap[1]})).collect::<Vec<_>>(),
        "events": seen.events.iter().map(|event| json!({"from_s": event.time_s[0], "to_s": event.time_s[1], "what": event.what})).collect::<Vec<_>>(),
        "warnings": seen.warnings,
        "proposed": seen.proposed().into_iter().collect::<std::collections::BTreeMap<_, _>>(),
        "usable": seen.unusable.is_none(),
        "unusable": seen.unusable,
    });
    serde_json::to_string_pretty(&value).expect("plain data") + "\n"
}
