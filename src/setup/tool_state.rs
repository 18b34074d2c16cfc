//! The state of a tool between its programs: a file one can read and edit. In: TOML. Out: [`ToolState`], and back. It carries
//! how far the tool is worn, what was read at check points, and the program that was planned last.

use serde::{Deserialize, Serialize};

use crate::machine::wear::{Counted, Lengths};

/// First line of the file, by which it is recognised as ours.
pub const STATE_MARK: &str = "# State of a tool, written by feedwright toollife.";
const HEAD: &str = "\
# One file for one tool in the spindle; a new tool begins a new one (--new-tool). The index of wear is the part of the
# cutting force that does not come from the chip. lengths_m counts a metre cut at feed f as (f / feed_per_tooth)^p metres, for
# p = -1, 0, 1 and 2.
";

/// A tool between its programs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ToolState {
    /// Number of the tool.
    pub tool: u32,
    /// Diameter, mm.
    pub diameter_mm: f64,
    /// Teeth.
    pub flutes: u32,
    /// Force model whose index this is.
    pub model: String,
    /// Unit of the index.
    pub index_unit: String,
    /// Index of a fresh edge.
    pub fresh: f64,
    /// Index at which it is worn out.
    pub end: f64,
    /// Index when the program below begins.
    pub index: f64,
    /// Rise of the index per metre at the reference feed, as known now.
    pub rate_per_m: f64,
    /// The same before any reading, with its standard deviation from tool to tool.
    pub rate_known_per_m: f64,
    /// Standard deviation of that.
    pub rate_deviation_per_m: f64,
    /// Reference feed per tooth, mm.
    pub feed_per_tooth_mm: f64,
    /// What a metre is one of.
    #[serde(default, with = "counted")]
    pub counted: Counted,
    /// Exponent of the feed in use: the declared one, or that of the readings where they refute it.
    pub exponent: f64,
    /// Length cut before the program below, m.
    pub cut_m: f64,
    /// The same at the reference feed, were the exponent -1, 0, 1, 2, m.
    pub lengths_m: [f64; 4],
    /// Length that it shall cut in all, m.
    pub target_m: f64,
    /// Probability with which it shall.
    pub assurance: f64,
    /// The program that was planned last.
    pub program: PlannedProgram,
    /// What was read, in order.
    #[serde(default, rename = "reading")]
    pub readings: Vec<ReadingState>,
}

/// A program that was planned for the tool.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannedProgram {
    /// Its file.
    pub file: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// Length that the tool cuts in it, m.
    pub cut_m: f64,
    /// The same at the reference feed, were the exponent -1, 0, 1, 2, m.
    pub lengths_m: [f64; 4],
    /// Number of the last check point that was read; 0: none.
    pub read: u32,
}

/// A reading.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReadingState {
    /// First digits of the SHA-256 of its program.
    pub program: String,
    /// Number of the check point.
    pub check: u32,
    /// Length cut by then, m.
    pub cut_m: f64,
    /// The same at the reference feed, were the exponent -1, 0, 1, 2, m.
    pub lengths_m: [f64; 4],
    /// What was read, as a load of the tool: N, or W at the motor shaft.
    pub load: f64,
    /// Index that follows.
    pub index: f64,
}

impl ToolState {
    /// Index behind the program, cut to its end.
    pub fn index_behind(&self) -> f64 {
        self.index + self.rate_per_m * Lengths(self.program.lengths_m).at(self.exponent)
    }
    /// Length cut before the program at the reference feed, with the exponent in use, m.
    pub fn wear_m(&self) -> f64 {
        Lengths(self.lengths_m).at(self.exponent)
    }
}

/// `counted` as a word.
mod counted {
    use crate::machine::wear::Counted;
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands over a reference")]
    pub fn serialize<S: Serializer>(counted: &Counted, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(counted.name())
    }
    pub fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<Counted, D::Error> {
        let word = String::deserialize(from)?;
        let known = [Counted::Path, Counted::TeethWay].into_iter().find(|counted| counted.name() == word);
        known.ok_or_else(|| D::Error::custom(format!("counted = \"{word}\" is neither path nor teeth-way")))
    }
}

/// Reads the file. Errors: what is wrong, in the words of the TOML reader.
pub fn read_tool_state(text: &str) -> Result<ToolState, String> {
    toml::from_str(text).map_err(|error| error.to_string())
}

/// Writes it.
pub fn write_tool_state(state: &ToolState) -> String {
    let body = toml::to_string(state).expect("a state is plain data");
    format!("{STATE_MARK}\n{HEAD}\n{body}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_is_read_back_as_it_was_written() {
        let reading = ReadingState {
            program: "ab".into(),
            check: 1,
            cut_m: 13.0,
            lengths_m: [13.5, 13.0, 12.5, 12.1],
            load: 250.5,
            index: 87.3,
        };
        let state = ToolState {
            tool: 3,
            diameter_mm: 6.0,
            flutes: 6,
            model: "response".into(),
            index_unit: "N".into(),
            fresh: 86.8,
            end: 236.8,
            index: 90.0,
            rate_per_m: 2.083,
            rate_known_per_m: 2.0,
            rate_deviation_per_m: 0.4,
            feed_per_tooth_mm: 0.06,
            counted: Counted::TeethWay,
            exponent: 1.0,
            cut_m: 0.0,
            lengths_m: [0.0; 4],
            target_m: 200.0,
            assurance: 0.9,
            program: PlannedProgram {
                file: "a.nc".into(),
                sha256: "abcd".into(),
                cut_m: 37.0,
                lengths_m: [39.0, 37.0, 36.0, 35.5],
                read: 1,
            },
            readings: vec![reading],
        };
        let text = write_tool_state(&state);
        assert!(text.starts_with(STATE_MARK));
        assert_eq!(read_tool_state(&text), Ok(state.clone()));
        // One of before, when every law counted the path.
        let old = text.replace("counted = \"teeth-way\"\n", "");
        assert_eq!(read_tool_state(&old), Ok(ToolState { counted: Counted::Path, ..state }));
        assert!(read_tool_state(&text.replace("teeth-way", "teeth")).is_err());
        assert!(read_tool_state("tool = 1").is_err());
    }
}
