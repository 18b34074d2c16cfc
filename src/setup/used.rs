//! A tool as its last program left it. In: `wear = { state = "T1.life.toml" }`, the folder of the setup. Out: the tool with the index
//! that its state tells, and with the law that is known there where the setup gives none.

use super::file::ToolTable;
use super::read::Reader;
use super::tool_state::{ToolState, read_tool_state};
use crate::effects::wear::RATE_SCATTER;
use crate::machine::{Tool, ToolWear, WearRate};
use std::path::Path;

/// Takes the state in, if the table names one.
pub fn take_state(reader: &mut Reader, table: &ToolTable, tool: &mut Tool, dir: &Path) {
    let Some(name) = table.wear.as_ref().and_then(|wear| wear.state.as_ref()) else { return };
    let key = format!("tool[T{}].wear.state", tool.number);
    let read = std::fs::read_to_string(dir.join(name)).map_err(|error| error.to_string());
    match read.and_then(|text| read_tool_state(&text)).and_then(|state| of_this(state, tool)) {
        Err(why) => {
            let help = "name the file that `feedwright toollife` wrote for this tool, or leave it out for a fresh edge";
            reader.complain(&key, format!("{name}: {why}"), help);
        }
        Ok(state) => tool.wear = Some(worn(&state, tool.wear)),
    }
}

fn of_this(state: ToolState, tool: &Tool) -> Result<ToolState, String> {
    let same = (state.diameter_mm - tool.diameter_mm).abs() <= 1e-6 * tool.diameter_mm;
    if state.tool == tool.number && state.flutes == tool.flutes && same {
        return Ok(state);
    }
    let ToolState { tool: number, diameter_mm, flutes, .. } = state;
    Err(format!("it is the state of another tool: T{number} of {diameter_mm} mm with {flutes} teeth"))
}

fn worn(state: &ToolState, said: Option<ToolWear>) -> ToolWear {
    let law = ToolWear {
        rate: Some(WearRate {
            counted: state.counted,
            ..WearRate::along_path(1e-3 * state.rate_per_m, state.feed_per_tooth_mm, state.exponent)
        }),
        end: Some(state.end),
        rate_scatter: RATE_SCATTER,
        end_scatter: 0.0,
        index: None,
    };
    let law = said.filter(|said| said.rate.is_some()).unwrap_or(law);
    ToolWear { index: law.index.or(Some(state.index_behind())), ..law }
}
