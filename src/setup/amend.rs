//! Writing limits into an existing setup (`limits --write`). In: its text, limits by tool and operation in its own units. Out: the same text with
//! the limits added; order, comments and spelling of everything else stay. A limit that is there already stays too, with a remark.

use toml_edit::{ArrayOfTables, DocumentMut, InlineTable, Item, Table, TableLike, Value};

/// Limits to put in.
#[derive(Debug, Clone, PartialEq)]
pub struct Amendment {
    /// Tool number.
    pub tool: u32,
    /// First and last line of the operation; `None`: all the tool does.
    pub lines: Option<[u32; 2]>,
    /// Name of the limit, its value as text of a number, and why, one line.
    pub limits: Vec<(String, String, String)>,
    /// Said above the operation.
    pub heading: String,
}

/// The new text, and what was left as it is, one sentence each; an error says why nothing can be put in.
pub fn amend(text: &str, amendments: &[Amendment]) -> Result<(String, Vec<String>), String> {
    let mut document: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| error.to_string())?;
    let for_all: Vec<String> = keys(document.get("limits").and_then(Item::as_table_like));
    let mut left = Vec::new();
    // An operation's limits hold before those of its tool: what a person wrote there stays for operations too.
    let mut given: Vec<(u32, Vec<String>)> = Vec::new();
    for one in amendments.iter().filter(|one| one.lines.is_none()) {
        let table = tool_table(&mut document, one.tool)
            .ok_or_else(|| format!("there is no [[tool]] table with number = {}", one.tool))?;
        let own = keys(table.get("limits").and_then(Item::as_table_like));
        given.push((one.tool, own.into_iter().chain(for_all.iter().cloned()).collect()));
        put(table, one, &for_all, &mut left);
    }
    let operations: Vec<&Amendment> = amendments.iter().filter(|one| one.lines.is_some()).collect();
    if operations.is_empty() {
        return Ok((document.to_string(), left));
    }
    if document.contains_key("operation") {
        left.push(
            "the setup has [[operation]] tables of its own, of which the last that matches holds: none was added"
                .into(),
        );
        return Ok((document.to_string(), left));
    }
    let mut tables = ArrayOfTables::new();
    for one in operations {
        let own = given.iter().find(|(tool, _)| *tool == one.tool).map_or(&for_all, |(_, own)| own);
        if let Some(table) = operation(one, own, tables.is_empty()) {
            tables.push(table);
        }
    }
    if !tables.is_empty() {
        document.insert("operation", Item::ArrayOfTables(tables));
    }
    Ok((document.to_string(), left))
}

fn keys(table: Option<&dyn TableLike>) -> Vec<String> {
    table.into_iter().flat_map(|table| table.iter().map(|(key, _)| key.to_owned())).collect()
}

fn tool_table(document: &mut DocumentMut, number: u32) -> Option<&mut Table> {
    let tools = document.get_mut("tool")?.as_array_of_tables_mut()?;
    tools.iter_mut().find(|tool| tool.get("number").and_then(Item::as_integer) == Some(i64::from(number)))
}

/// Puts limits into a tool's table; what is limited there or for everything stays.
fn put(table: &mut Table, one: &Amendment, for_all: &[String], left: &mut Vec<String>) {
    let own = keys(table.get("limits").and_then(Item::as_table_like));
    let known = |name: &String| own.contains(name) || for_all.contains(name);
    let new: Vec<_> = one.limits.iter().filter(|(name, ..)| !known(name)).collect();
    left.extend(one.limits.iter().filter(|(name, ..)| known(name)).map(|(name, value, _)| {
        let place = if own.contains(name) { format!("T{}", one.tool) } else { "[limits]".to_owned() };
        format!("{name} of {place} stays as it is written; proposed for T{}: {value}", one.tool)
    }));
    if new.is_empty() {
        return;
    }
    if let Some(limits) = table.get_mut("limits").and_then(Item::as_table_like_mut) {
        for (name, value, _) in new {
            limits.insert(name, Item::Value(number(value)));
        }
        if let Some(inline) = table.get_mut("limits").and_then(Item::as_inline_table_mut) {
            inline.fmt();
        }
        return;
    }
    let mut limits = InlineTable::new();
    for (name, value, _) in &new {
        limits.insert(name, number(value));
    }
    table.insert("limits", Item::Value(Value::InlineTable(limits)));
    let why = new.iter().fold(String::new(), |text, (name, _, why)| text + &format!("# {name}: {why}\n"));
    if let Some(mut key) = table.key_mut("limits") {
        key.leaf_decor_mut().set_prefix(why);
    }
}

/// An `[[operation]]` with its match and its limits; `None` where every limit is given already.
fn operation(one: &Amendment, given: &[String], is_first: bool) -> Option<Table> {
    let mut limits = InlineTable::new();
    for (name, value, _) in one.limits.iter().filter(|(name, ..)| !given.contains(name)) {
        limits.insert(name, number(value));
    }
    if limits.is_empty() {
        return None;
    }
    let mut matches = InlineTable::new();
    matches.insert("tool", Value::from(i64::from(one.tool)));
    matches.insert("lines", one.lines.unwrap_or_default().into_iter().map(i64::from).collect());
    let mut table = Table::new();
    table.insert("match", Item::Value(Value::InlineTable(matches)));
    table.insert("limits", Item::Value(Value::InlineTable(limits)));
    let first = if is_first {
        "\n# What each operation of a tool survives as it stands; the lines are those of the program.\n"
    } else {
        "\n"
    };
    table.decor_mut().set_prefix(format!("{first}# {}\n", one.heading));
    Some(table)
}

/// A number as it was written.
fn number(text: &str) -> Value {
    text.parse().unwrap_or_else(|_| Value::from(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(tool: u32, lines: Option<[u32; 2]>) -> Amendment {
        let limits = vec![
            ("force_xy".to_owned(), "328.5".to_owned(), "what it does".to_owned()),
            ("power".to_owned(), "1700".to_owned(), "what the spindle gives".to_owned()),
        ];
        Amendment { tool, lines, limits, heading: format!("T{tool} SLOT") }
    }

    #[test]
    fn what_a_person_wrote_stays_in_its_place() {
        let text = "# my drawer\nunits = \"inch\"\n\n[[tool]]\nnumber = 2 # the good one\ndiameter = 0.5\n\n[[tool]]\nnumber = 3\nlimits = { force_xy = 90 } # tried\n\n[limits]\nfeed = { max = 150 }\n";
        let (new, left) = amend(text, &[one(2, None), one(3, None)]).unwrap();
        let removed: Vec<&str> = text.lines().filter(|line| !new.lines().any(|other| other == *line)).collect();
        assert_eq!(removed, ["limits = { force_xy = 90 } # tried"], "{new}");
        assert!(new.contains("diameter = 0.5\n# force_xy: what it does\n# power: what the spindle gives\nlimits = { force_xy = 328.5, power = 1700 }\n"), "{new}");
        assert!(new.contains("limits = { force_xy = 90, power = 1700 } # tried\n"), "{new}");
        assert_eq!(left.len(), 1, "{left:?}");
        // A second time nothing changes.
        assert_eq!(amend(&new, &[one(2, None), one(3, None)]).unwrap().0, new);
        assert!(amend(text, &[one(7, None)]).is_err());
    }

    #[test]
    fn operations_are_added_only_where_there_are_none() {
        let text = "[[tool]]\nnumber = 2\n\n[limits]\npower = 4000\n";
        let (new, _) = amend(text, &[one(2, Some([10, 40])), one(2, Some([41, 90]))]).unwrap();
        assert!(new.starts_with(text), "{new}");
        assert_eq!(new.matches("[[operation]]").count(), 2);
        assert!(
            new.contains(
                "# T2 SLOT\n[[operation]]\nmatch = { tool = 2, lines = [10, 40] }\nlimits = { force_xy = 328.5 }\n"
            ),
            "{new}"
        );
        // A limit of the tool that a person wrote holds in its operations too.
        let own = "[[tool]]\nnumber = 2\nlimits = { force_xy = 800 }\n";
        let (kept, _) = amend(own, &[one(2, None), one(2, Some([10, 40]))]).unwrap();
        assert_eq!(kept.matches("force_xy").count(), 1, "{kept}");
        let (again, left) = amend(&new, &[one(2, Some([1, 2]))]).unwrap();
        assert_eq!((again, left.len()), (new, 1));
    }
}
