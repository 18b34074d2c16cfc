//! Blocks that send the control back. In: a block, the labels of its text. Out: the earliest block it may go to: CALL LBL … REP, and the jumps of
//! FN 9 to FN 12.

use crate::ids::BlockId;
use crate::nc::interp::labels::Labels;
use crate::nc::program::Program;

/// The earliest block, at most itself, to which a block may send the control back; a label that is computed may be the first one.
pub(super) fn goes_back_to(labels: &Labels, program: &Program, block: BlockId) -> Option<u32> {
    let line = String::from_utf8_lossy(program.line_text(block)).to_ascii_uppercase();
    let line = line.split(';').next().unwrap_or_default();
    let steers = line.contains("GOTO") || line.contains("CALL") && line.contains(" REP");
    let (_, label) = line.split_once("LBL").filter(|_| steers)?;
    let label = label.split_whitespace().next().unwrap_or_default();
    let label = if label.starts_with('"') { label } else { label.trim_start_matches('0') };
    let known = labels.names.iter().find(|(name, _)| name.strip_prefix("LBL ") == Some(label));
    Some(known.map_or(0, |(_, block)| *block))
}
