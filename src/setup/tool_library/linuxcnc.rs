//! Tool table of LinuxCNC: a line a tool, `T1 P1 D10 Z-50 ;10 mm flat end mill, 3 flutes`. In: bytes and the unit of the machine. Out:
//! tools; what the table has no word for is taken from the remark.

use super::{Library, length};
use crate::setup::draft::{Known, ToolKnown, described_tool};

/// The tools of a table.
pub fn table(bytes: &[u8], name: &str, inch: bool) -> Library {
    let text = String::from_utf8_lossy(bytes);
    let mut library = Library::default();
    for line in text.lines() {
        let (words, remark) = line.split_once(';').unwrap_or((line, ""));
        let word = |letter: char| {
            let found =
                words.split_whitespace().find_map(|word| word.strip_prefix([letter, letter.to_ascii_lowercase()]));
            found.and_then(|number| number.trim_start_matches('+').parse::<f64>().ok())
        };
        let Some(number) = word('T').filter(|number| *number >= 0.0) else { continue };
        let remark = remark.trim();
        let mut tool = ToolKnown { name: remark.to_owned(), number: Some(number as u32), ..ToolKnown::default() };
        for (key, known) in described_tool(number as u32, remark, inch, name).keys {
            // Sizes of a remark are bare numbers in the machine's unit.
            let value = known.value.parse::<f64>().ok().filter(|_| matches!(key, "diameter" | "corner_radius"));
            let known = Known { value: value.map_or(known.value, |value| length(value, inch)), ..known };
            if !known.guessed {
                tool.set(key, known);
            }
        }
        if let Some(diameter) = word('D').filter(|diameter| *diameter > 0.0) {
            tool.set("diameter", Known::said(length(diameter, inch), name));
        }
        library.tools.push(tool);
    }
    library
}
