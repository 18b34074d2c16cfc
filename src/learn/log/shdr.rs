//! MTConnect adapter output (SHDR): lines `timestamp|item|value|item|value…`. In: bytes. Out: columns, one row per time
//! stamp.

use super::columns::{DataError, Frame};
use super::layout::number;
use super::on_change::Changes;
use super::stamps::stamp_s;

/// Lines from which a file is known: the first may be torn.
const LOOKED_AT: usize = 10;

/// Is a file adapter output?
pub fn is_shdr(bytes: &[u8]) -> bool {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(4096)]);
    let is_one = |line: &str| {
        let mut fields = line.split('|').map(str::trim);
        let (stamp, item, value) = (fields.next(), fields.next(), fields.next());
        let is_name = item.is_some_and(|item| !item.is_empty() && number(item, false).is_none());
        value.is_some() && is_name && stamp.and_then(stamp_s).is_some()
    };
    head.lines().take(LOOKED_AT).any(is_one)
}

/// Adapter output as columns, one row per stamp, values held until they change.
pub fn shdr(bytes: &[u8], mapping: &[(String, String)]) -> Result<Frame, DataError> {
    let text = String::from_utf8_lossy(bytes);
    let mut changes = Changes::default();
    let mut torn = 0;
    for line in text.lines().map(str::trim) {
        // Incomplete lines are skipped: the rest of a broken line may look like a time stamp.
        let is_whole = line.split('|').count() >= 3;
        torn += usize::from(!is_whole && !line.is_empty() && !line.starts_with('*'));
        let mut fields = line.split('|').take_while(|_| is_whole);
        let Some(stamp) = fields.next().and_then(stamp_s) else { continue };
        changes.stamp(stamp);
        while let (Some(item), Some(value)) = (fields.next(), fields.next()) {
            let Some(value) = number(value.trim(), false) else { continue };
            changes.note(stamp, &[item.trim()], value, 1.0, mapping);
        }
    }
    let mut frame = changes.held()?;
    if torn > 0 {
        frame.warnings.push(format!("lines that are no `stamp|item|value` and are left out: {torn}"));
    }
    Ok(frame)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::log::read_log;

    #[test]
    fn a_table_with_bars_is_no_adapter_output() {
        assert!(is_shdr(b"* a remark\n2017-02-02T19:03:08Z|Sload|3\n") && is_shdr(b"75\n12.5|Sload|3|Xabs|1.5\n"));
        assert!(!is_shdr(b"time_s|x_mm|power\n0.1|2|3\n") && !is_shdr(b"0.1|2|3\n0.2|2|3\n"));
    }

    #[test]
    fn adapter_lines_hold_their_values() {
        let text = "2017-02-02T19:03:08.5Z|Block_Number|3|Spindle_power|10\n2017-02-02T19:03:09.0Z|Spindle_power|12\n";
        let frame = shdr(text.as_bytes(), &[]).unwrap();
        assert_eq!(frame.numbers("block").unwrap(), [3.0, 3.0]);
        assert_eq!(frame.numbers("spindle_power_w").unwrap(), [10.0, 12.0]);
        let time = frame.numbers("time_s").unwrap();
        assert!((time[1] - time[0] - 0.5).abs() < 1e-6);
        // The rest of a broken line is not read as a time stamp of the year 1970.
        let torn = shdr(text.replace("10\n", "10\n20175\n").as_bytes(), &[]).unwrap();
        assert_eq!(torn.numbers("time_s"), frame.numbers("time_s"));
        assert!(torn.warnings[0].ends_with("left out: 1"), "{:?}", torn.warnings);
        // Nothing changes for a while: no gap.
        let second = |k: u32| if k > 9 { 90 + k } else { k };
        let lines: Vec<String> = (0..30).map(|k| format!("{}|Spindle_power|{k}", second(k))).collect();
        let log = read_log(lines.join("\n").as_bytes(), &[]).unwrap();
        assert!(log.on_change && log.warnings.is_empty());
    }
}
