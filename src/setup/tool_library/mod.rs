//! Tool libraries of other software. In: bytes of a file. Out: tools as far as the file describes them, every length with its unit, and a list of
//! what was left out. No value is guessed.

mod freecad;
mod fusion;
mod linuxcnc;

use super::draft::TOOL_KEYS;
use super::draft::ToolKnown;

/// What was read of a library.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Library {
    /// Its tools, in its order.
    pub tools: Vec<ToolKnown>,
    /// What was left out, and why.
    pub notes: Vec<String>,
}

/// Why a library cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{text}")]
pub struct Unreadable {
    /// What is wrong.
    pub text: String,
    /// What to do.
    pub help: String,
}

impl Unreadable {
    fn new(text: impl Into<String>, help: impl Into<String>) -> Self {
        Self { text: text.into(), help: help.into() }
    }
}

/// Reads a library by the ending of its name: Fusion `.json` and `.tools`, FreeCAD `.fctb` and `.fctl`, LinuxCNC `.tbl`. `beside`
/// reads a file that the library refers to, by its name alone. `inch`: the unit of a file that does not say its own.
///
/// # Errors
/// Another kind of file, or one that does not hold what its name promises.
pub fn read(
    name: &str,
    bytes: &[u8],
    inch: bool,
    beside: &dyn Fn(&str) -> Option<Vec<u8>>,
) -> Result<Library, Unreadable> {
    let ending = name.rsplit('.').next().unwrap_or_default().to_lowercase();
    let library = match ending.as_str() {
        "json" => fusion::from_json(bytes, name),
        "tools" => fusion::from_zip(bytes, name),
        "fctb" => freecad::bit(bytes, name),
        "fctl" => freecad::library(bytes, name, beside),
        "tbl" => Ok(linuxcnc::table(bytes, name, inch)),
        _ => Err(Unreadable::new(
            format!("{name}: tool libraries of this kind are not read"),
            "give a Fusion .json or .tools, a FreeCAD .fctb or .fctl, or a LinuxCNC .tbl",
        )),
    }?;
    if library.tools.is_empty() {
        return Err(Unreadable::new(
            [&[format!("{name} holds no tool")], library.notes.as_slice()].concat().join("; "),
            "export the library with its milling tools",
        ));
    }
    Ok(library)
}

/// The tools as `[[tool]]` tables; one without a number gets a line to fill in.
pub fn tables(tools: &[ToolKnown]) -> String {
    let table = |tool: &ToolKnown| {
        let number = tool.number.map_or("# number = unknown: its T word".to_owned(), |n| format!("number = {n}"));
        let keys = TOOL_KEYS.iter().filter_map(|key| Some(format!("{key} = {}", tool.get(key)?.value)));
        let needed = tool.needed().into_iter().filter(|(key, _)| tool.get(key).is_none());
        let open = needed.map(|(key, remedy)| format!("# {key} = unknown: {remedy}"));
        let head = format!("[[tool]]  # {}", tool.name.replace(['\n', '\r'], " "));
        let lines: Vec<String> = [head, number].into_iter().chain(keys).chain(open).collect();
        lines.join("\n") + "\n"
    };
    tools.iter().map(table).collect::<Vec<_>>().join("\n")
}

/// A length as a setup of either unit takes it.
fn length(value: f64, inch: bool) -> String {
    format!("\"{} {}\"", (value * 1e6).round() / 1e6, if inch { "in" } else { "mm" })
}
