//! Where a block may send the control. In: a block, the labels of its text. Out: its ways: CALL LBL, CALL PGM, and the jumps of FN 9 to FN 12.

use crate::ids::BlockId;
use crate::nc::interp::labels::{Labels, Way};
use crate::nc::program::Program;

/// Where a block may send the control; a label that is computed may be any of them.
pub(super) fn ways(labels: &Labels, program: &Program, block: BlockId) -> Vec<Way> {
    let line = String::from_utf8_lossy(program.line_text(block)).to_ascii_uppercase();
    let line = line.split(';').next().unwrap_or_default();
    if !line.contains("GOTO") && !line.contains("CALL") {
        return Vec::new();
    }
    if let Some((_, label)) = line.split_once("LBL") {
        let label = label.split_whitespace().next().unwrap_or_default();
        let label = if label.starts_with('"') { label } else { label.trim_start_matches('0') };
        let known = labels.names.iter().find(|(name, _)| name.strip_prefix("LBL ") == Some(label));
        // The control goes on behind the label.
        let all = || labels.names.iter().map(|(_, block)| Way::Block(block + 1)).collect();
        return known.map_or_else(all, |(_, block)| vec![Way::Block(block + 1)]);
    }
    if line.contains("PGM") { vec![Way::AnyRoutine] } else { Vec::new() }
}
