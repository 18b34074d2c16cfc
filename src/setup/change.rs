//! Limits of a setup for the form of the served page. In: the text of a setup, and new values by place. Out: the values in it now, and the same
//! text with the new values; everything else stays as it was written.

use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

use crate::machine::LimitKind;

/// Limits written in one place of a setup.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    /// Number of the tool whose limits they are; `None`: those of `[limits]`.
    pub tool: Option<u32>,
    /// Each limit with its largest value, spelled as in the setup: "500", "110 lbf".
    pub values: Vec<(LimitKind, String)>,
}

/// A new largest value of a limit; empty: none.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Number of the tool whose limit it is; `None`: that of `[limits]`.
    pub tool: Option<u32>,
    /// The limit.
    pub kind: LimitKind,
    /// A number in the unit of the setup, or a number with its own unit.
    pub value: String,
}

/// What a setup limits: `[limits]` first, also where it is not there, then every tool that has limits of its own.
pub fn written(text: &str) -> Result<Vec<Written>, String> {
    let document = parsed(text)?;
    let mut all = vec![Written { tool: None, values: values(document.get("limits")) }];
    let tools = document.get("tool").and_then(Item::as_array_of_tables).into_iter().flatten();
    for tool in tools {
        let number = tool.get("number").and_then(Item::as_integer).and_then(|number| u32::try_from(number).ok());
        if let (Some(number), Some(limits)) = (number, tool.get("limits")) {
            all.push(Written { tool: Some(number), values: values(Some(limits)) });
        }
    }
    Ok(all)
}

/// The text with the changes; an error says why one cannot be made.
pub fn changed(text: &str, changes: &[Change]) -> Result<String, String> {
    let mut document = parsed(text)?;
    for change in changes {
        let table = place(&mut document, change.tool)?;
        put(table, change.kind.name(), change.value.trim());
    }
    Ok(document.to_string())
}

fn parsed(text: &str) -> Result<DocumentMut, String> {
    text.parse().map_err(|error: toml_edit::TomlError| error.to_string())
}

fn values(limits: Option<&Item>) -> Vec<(LimitKind, String)> {
    let Some(table) = limits.and_then(Item::as_table_like) else { return Vec::new() };
    let value = |kind: &LimitKind| Some((*kind, spelled(table.get(kind.name())?)?));
    LimitKind::ALL.iter().filter(|kind| kind.row().field.is_some()).filter_map(value).collect()
}

/// The largest value that an item gives: itself, or its `max`.
fn spelled(item: &Item) -> Option<String> {
    if let Some(bounds) = item.as_table_like() {
        return spelled(bounds.get("max")?);
    }
    match item.as_value()? {
        Value::String(text) => Some(text.value().clone()),
        number @ (Value::Integer(_) | Value::Float(_)) => {
            // Without the comment behind it.
            let mut number = number.clone();
            number.decor_mut().clear();
            Some(number.to_string())
        }
        _ => None,
    }
}

/// The table of limits of a place; made where there is none.
fn place(document: &mut DocumentMut, tool: Option<u32>) -> Result<&mut dyn TableLike, String> {
    let (owner, name) = match tool {
        None => (document.as_table_mut(), "[limits]".to_owned()),
        Some(number) => {
            let tools = document.get_mut("tool").and_then(Item::as_array_of_tables_mut);
            let is_it = |tool: &&mut Table| tool.get("number").and_then(Item::as_integer) == Some(number.into());
            let table = tools.and_then(|tools| tools.iter_mut().find(is_it));
            (table.ok_or_else(|| format!("the setup has no [[tool]] with number = {number}"))?, format!("T{number}"))
        }
    };
    let limits = owner.entry("limits").or_insert_with(|| Item::Table(Table::new()));
    limits.as_table_like_mut().ok_or_else(|| format!("the limits of {name} are no table"))
}

/// Puts the largest value of a limit in, beside its smallest where it has one.
fn put(table: &mut dyn TableLike, name: &str, value: &str) {
    if let Some(bounds) = table.get_mut(name).and_then(Item::as_table_like_mut) {
        replace(bounds, "max", value);
    } else {
        replace(table, name, value);
    }
}

fn replace(table: &mut dyn TableLike, key: &str, text: &str) {
    if text.is_empty() {
        table.remove(key);
        return;
    }
    let mut value = match text.parse::<f64>() {
        // Spelled as it was typed: 0.030 stays 0.030.
        Ok(_) => text.parse().unwrap_or_else(|_| Value::from(text)),
        Err(_) => Value::from(text),
    };
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) => {
            *value.decor_mut() = old.decor().clone();
            *old = value;
        }
        None => drop(table.insert(key, Item::Value(value))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETUP: &str = "# drawer\n[[tool]]\nnumber = 2\nlimits = { force_xy = 90 } # tried\n\n[limits]\nforce_xy = 500  # N\npower = \"6 hp\"\nfeed = { min = 100, max = 6000 }\nair_feed = 9000\n";

    fn change(tool: Option<u32>, kind: LimitKind, value: &str) -> Change {
        Change { tool, kind, value: value.into() }
    }

    #[test]
    fn what_is_written_is_found_as_it_is_spelled() {
        let found = written(SETUP).unwrap();
        let value = |kind, text: &str| (kind, text.to_owned());
        let own = [value(LimitKind::ForceXy, "500"), value(LimitKind::Power, "6 hp"), value(LimitKind::Feed, "6000")];
        assert_eq!(found[0], Written { tool: None, values: own.to_vec() });
        assert_eq!(found[1], Written { tool: Some(2), values: vec![value(LimitKind::ForceXy, "90")] });
        assert_eq!(written("").unwrap(), [Written { tool: None, values: vec![] }]);
        assert!(written("[limits").is_err());
    }

    #[test]
    fn a_change_is_made_in_its_place_and_nothing_else() {
        let new = changed(
            SETUP,
            &[
                change(None, LimitKind::ForceXy, "320.0"),
                change(None, LimitKind::Power, ""),
                change(None, LimitKind::Feed, "5000"),
                change(Some(2), LimitKind::Deflection, "0.5 thou"),
            ],
        )
        .unwrap();
        let wanted = SETUP
            .replace("force_xy = 500", "force_xy = 320.0")
            .replace("power = \"6 hp\"\n", "")
            .replace("6000", "5000")
            .replace("= 90 }", "= 90 , deflection = \"0.5 thou\" }");
        assert_eq!(new.replace(' ', ""), wanted.replace(' ', ""));
        assert!(new.contains("320.0  # N"), "{new}");
        assert!(changed("", &[change(None, LimitKind::Torque, "3")]).unwrap().contains("[limits]\ntorque = 3"));
    }

    #[test]
    fn what_is_typed_stays_one_value() {
        let new = changed("", &[change(None, LimitKind::Power, "1\n[machine]\nhome = 2")]).unwrap();
        assert_eq!(written(&new).unwrap()[0].values, [(LimitKind::Power, "1\n[machine]\nhome = 2".to_owned())]);
        assert!(changed(SETUP, &[change(Some(9), LimitKind::Power, "1")]).is_err());
        assert!(changed("limits = 3", &[change(None, LimitKind::Power, "1")]).is_err());
    }
}
