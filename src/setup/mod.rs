//! The setup file: machine, tools, stock, material, limits. In: TOML text and the folder it lies in. Out: a validated
//! [`Job`] in internal units, with every default that is in force listed as an [`Assumption`].
//!
//! ```text
//! text ─serde─▶ file::SetupFile (as written) ─read::Reader─▶ Job + assumptions, or diagnostics with their place
//! ```

pub mod amend;
pub mod change;
mod draft;
mod error;
mod file;
mod forms;
pub mod library;
mod limits;
mod machine;
mod material;
mod outline;
mod process;
mod quantity;
mod read;
mod stock;
mod tool;
pub mod tool_library;
mod tool_state;
mod used;

pub use draft::{Facts, Lacking, Of};
pub use error::SetupError;
pub use process::{load as load_model, write as write_model};
pub use read::{Assumption, LEARNED};

use crate::machine::material::Process;
use crate::machine::{Box3, Job};
use file::{MachineTable, SetupFile};
use forms::NameOr;
use read::Reader;
use std::path::Path;
pub use tool_state::{PlannedProgram, ReadingState, STATE_MARK, ToolState, read_tool_state, write_tool_state};

/// Key of the default that hangs on the process model.
const FEED_CHANGE: &str = "limits.feed_change.max";

/// The job a setup file describes. Errors: every value that makes no sense, with its place and a remedy.
pub fn load(text: &str, dir: &Path) -> Result<(Job, Vec<Assumption>), SetupError> {
    loaded(text, dir, false)
}

/// The same for a table of steady cuts, which brings its own geometry: `[stock]` may be absent, and tools where it names them.
pub fn load_for_table(text: &str, dir: &Path) -> Result<Job, SetupError> {
    loaded(text, dir, true).map(|(job, _)| job)
}

fn loaded(text: &str, dir: &Path, is_for_table: bool) -> Result<(Job, Vec<Assumption>), SetupError> {
    let file: SetupFile = toml::from_str(text).map_err(|error| error::from_toml(&error, text))?;
    let mut reader = Reader::new(text, file.units.as_deref() == Some("inch"));
    let known = [("mm", ()), ("inch", ())];
    match &file.units {
        Some(word) => drop(reader.choice("units", word, &known)),
        None => reader.assume("units", "mm", "default"),
    }
    let mut job = job(&mut reader, &file, dir, is_for_table)?;
    if job.limits.feed_change_max.is_none() {
        let (most, why) = limits::feed_change_max(&job.process);
        reader.assume(FEED_CHANGE, most.to_string(), why);
        job.limits.feed_change_max = Some(most);
    }
    worn(&mut reader, &job);
    if reader.wrong.is_empty() { Ok((job, reader.assumptions)) } else { Err(SetupError::Values(reader.wrong)) }
}

/// Laws of wear that do not fit the force model of their tool.
fn worn(reader: &mut Reader, job: &Job) {
    for tool in &job.tools {
        let Some(wear) = tool.wear else { continue };
        let key = |what: &str| format!("tool[T{}].wear{what}", tool.number);
        let Some((fresh, unit)) = job.fresh_index(tool) else {
            let text = "the force model of this tool has no index of wear: no force that does not come from the chip";
            reader.complain(&key(""), text, "give k_te of the linear edge model, b0 of response, or c0 of layer");
            continue;
        };
        if let Some(end) = wear.end.filter(|end| *end <= fresh) {
            let text = format!("{end} {unit} is not above the {fresh} {unit} of a fresh edge");
            reader.complain(&key(".end"), text, "the index rises from that of a fresh edge to its end");
        }
        if wear.index.is_some_and(|index| index < fresh) {
            let text = format!("an edge cannot be sharper than a fresh one, whose index is {fresh} {unit}");
            reader.complain(&key(".index"), text, "give the index it has now, or leave it out for a fresh edge");
        }
    }
}

/// Puts another process model into a job, as `--model` does, with the default that hangs on it.
pub fn take_model(job: &mut Job, assumptions: &mut [Assumption], process: Process) {
    job.process = process;
    if let Some(assumed) = assumptions.iter_mut().find(|assumed| assumed.key == FEED_CHANGE) {
        let (most, why) = limits::feed_change_max(&job.process);
        (assumed.value, assumed.source) = (most.to_string(), why.into());
        job.limits.feed_change_max = Some(most);
    }
}

/// JSON Schema of the setup file.
pub fn schema() -> String {
    let schema = schemars::schema_for!(SetupFile);
    serde_json::to_string_pretty(&schema).expect("a schema is plain data") + "\n"
}

fn job(reader: &mut Reader, file: &SetupFile, dir: &Path, is_for_table: bool) -> Result<Job, SetupError> {
    let tools = tools(reader, file, dir, is_for_table);
    let (limits, air_feed) = limits::global(reader, &file.limits.clone().unwrap_or_default());
    let operations = file.operation.iter().flatten().enumerate();
    let operations = operations.map(|(index, table)| limits::operation(reader, table, index)).collect();
    let machine_table = machine_table(reader, file.machine.as_ref());
    let process = match &file.process {
        Some(table) => process::process(reader, table, dir)?,
        None => Process::default(),
    };
    let mut machine = machine::machine(reader, &machine_table, file.offsets.as_ref());
    machine.unsaid.speeds_rps = speeds(reader, file.tool.as_deref().unwrap_or(&[]));
    let log = file.log.as_ref().and_then(|log| log.columns.clone()).unwrap_or_default();
    Ok(Job {
        log_columns: log.into_iter().collect(),
        machine,
        stocks: stock::stocks(reader, file, &tools, dir, is_for_table),
        fixtures: fixtures(reader, file),
        fixtures_are_known: fixtures_are_known(reader, file),
        tools,
        limits,
        raise: limits::raise(file.raise.as_ref()),
        confirmed: limits::confirmed(reader, "confirm", file.confirm.as_deref()),
        air_feed,
        wear: limits::wear(reader, file.limits.as_ref()),
        life: Vec::new(),
        confidence: None,
        operations,
        references: Vec::new(),
        output: limits::output(reader, file.output.as_ref().unwrap_or(&file::OutputTable::default())),
        inch: file.units.as_deref() == Some("inch"),
        cell_mm: reader.optional(
            "resolution",
            file.resolution.as_ref(),
            crate::units::Dimension::Length,
            read::Sense::Positive,
        ),
        process,
    })
}

/// Speeds of tools for which the program sets none.
fn speeds(reader: &mut Reader, tables: &[file::ToolTable]) -> Vec<(u32, f64)> {
    let told = tables.iter().filter_map(|table| Some((table.number?, table.rpm.as_ref()?)));
    told.map(|(number, rpm)| {
        let key = format!("tool[T{number}].rpm");
        (number, reader.value(&key, rpm, crate::units::Dimension::Speed, read::Sense::Positive))
    })
    .collect()
}

fn tools(reader: &mut Reader, file: &SetupFile, dir: &Path, is_for_table: bool) -> Vec<crate::machine::Tool> {
    let tables = file.tool.as_deref().unwrap_or(&[]);
    if tables.is_empty() && !is_for_table {
        reader.missing("tool", "write one [[tool]] per T word of the program: number, shape, diameter, flutes");
    }
    let mut tools: Vec<crate::machine::Tool> = Vec::new();
    for (index, table) in tables.iter().enumerate() {
        let Some(mut tool) = tool::tool(reader, table, index) else { continue };
        used::take_state(reader, table, &mut tool, dir);
        if tools.iter().any(|other| other.number == tool.number) {
            reader.complain(
                &format!("tool[{}].number", index + 1),
                format!("tool {} is there twice", tool.number),
                "give each tool one table",
            );
        }
        tools.push(tool);
    }
    tools
}

fn machine_table(reader: &mut Reader, written: Option<&NameOr<MachineTable>>) -> MachineTable {
    match written {
        Some(NameOr::Table(table)) => (**table).clone(),
        Some(NameOr::Name(name)) => {
            let entries = library::machines();
            if let Some(entry) = entries.iter().find(|entry| entry.name == *name) {
                reader.assume("machine", &entry.meaning, "library");
                return entry.machine.clone();
            }
            let known: Vec<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
            let help = error::suggest(name, &known);
            reader.complain("machine", format!("the library has no machine \"{name}\""), help);
            MachineTable::default()
        }
        None => {
            reader.assume("machine", "a small vertical machining centre", "default");
            MachineTable::default()
        }
    }
}

/// Keep-out boxes, or `fixtures = "none"`.
fn fixtures_are_known(reader: &mut Reader, file: &SetupFile) -> bool {
    let boxes = file.fixture.as_ref().is_some_and(|tables| !tables.is_empty());
    let none = file.fixtures.as_deref() == Some("none");
    if file.fixtures.is_some() && !none {
        reader.complain("fixtures", "can only be \"none\"", "give the clamps as [[fixture]] boxes");
    } else if none && boxes {
        reader.complain("fixtures", "is \"none\", but there are [[fixture]] boxes", "leave one of them out");
    }
    boxes || none
}

fn fixtures(reader: &mut Reader, file: &SetupFile) -> Vec<Box3> {
    let tables = file.fixture.iter().flatten().enumerate();
    tables.map(|(index, table)| stock::box3(reader, &format!("fixture[{}].box", index + 1), &table.block)).collect()
}
