//! What is known of a job before there is a setup, and from where. In: facts of the program's comments, of a tool library, of the user.
//! Out: one list of tools, the later source over the earlier; where two disagree on a size nothing is known of it.

use crate::units::MM_PER_INCH;

/// A value as TOML writes it, and where it is from.
#[derive(Debug, Clone, PartialEq)]
pub struct Known {
    /// TOML: `10`, `"flat"`, `[[32, 40]]`.
    pub value: String,
    /// Where it is from: `line 3`, `tools.json`, `--tool`.
    pub source: String,
    /// Concluded rather than said: nothing runs on it until it is confirmed.
    pub guessed: bool,
}

impl Known {
    /// A value that its source says.
    pub fn said(value: impl Into<String>, source: &str) -> Self {
        Self { value: value.into(), source: source.into(), guessed: false }
    }
}

/// Keys of `[[tool]]` in the order in which a draft writes them.
pub const TOOL_KEYS: [&str; 13] = [
    "shape",
    "diameter",
    "flutes",
    "corner_radius",
    "point_angle",
    "taper_angle",
    "tip_diameter",
    "helix",
    "flute_length",
    "overhang",
    "shank_diameter",
    "material",
    "holder",
];

/// Two sizes that differ by more than this share are two sizes: above what a tool wears or is ground down by, below the step from one
/// size of a catalogue to the next (5 % and more in Machinery's Handbook, 31st ed., table of end mills).
const SAME_SIZE: f64 = 0.02;

/// A tool as far as it is known.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ToolKnown {
    /// Its T word; `None` in a library that numbers nothing.
    pub number: Option<u32>,
    /// How people call it.
    pub name: String,
    /// Keys of `[[tool]]` with their values.
    pub keys: Vec<(&'static str, Known)>,
    /// What two sources tell differently.
    pub conflicts: Vec<String>,
}

impl ToolKnown {
    /// What is known of a key.
    pub fn get(&self, key: &str) -> Option<&Known> {
        self.keys.iter().find(|(name, _)| *name == key).map(|(_, known)| known)
    }

    /// Puts a value in, over the one that is there.
    pub fn set(&mut self, key: &'static str, known: Known) {
        self.keys.retain(|(name, _)| *name != key);
        self.keys.push((key, known));
    }

    /// Its shape without quotes.
    pub fn shape(&self) -> Option<&str> {
        self.get("shape").map(|known| known.value.trim_matches('"'))
    }

    /// Takes what another source says of the same tool. Where it contradicts a diameter that was said, neither counts.
    /// `inch`: what a bare length is in.
    pub fn agree_with(&mut self, other: &ToolKnown, inch: bool) {
        let both = self.get("diameter").filter(|own| !own.guessed).zip(other.get("diameter"));
        let clash = both.filter(|(own, new)| differ(&own.value, &new.value, inch)).map(|(own, new)| {
            format!("{} says a diameter of {}, {} says {}", own.source, own.value, new.source, new.value)
        });
        if let Some(clash) = clash {
            self.conflicts.push(clash);
            self.keys.retain(|(key, _)| *key != "diameter");
            return;
        }
        self.overrule_by(other);
    }

    /// Takes what the user says over all else.
    pub fn overrule_by(&mut self, other: &ToolKnown) {
        for (key, known) in &other.keys {
            self.set(key, known.clone());
        }
        if other.get("diameter").is_some() {
            self.conflicts.clear();
        }
        if self.name.is_empty() {
            self.name.clone_from(&other.name);
        }
    }

    /// With every guess taken as said: the user says it.
    pub fn confirmed(mut self) -> Self {
        self.keys.iter_mut().for_each(|(_, known)| known.guessed = false);
        self
    }

    /// Keys that must be there before the tool can be simulated, each with what to do.
    pub fn needed(&self) -> Vec<(&'static str, &'static str)> {
        let mut needed = vec![("shape", "flat, ball, bull, taper, drill, chamfer, face …"), ("diameter", "measure it")];
        if !matches!(self.shape(), Some("tap" | "reamer" | "probe" | "drill")) {
            needed.push(("flutes", "count them"));
        }
        if self.shape() == Some("bull") {
            needed.push(("corner_radius", "see the catalogue"));
        }
        needed
    }
}

/// Do two lengths written in TOML, bare or with their unit, differ?
fn differ(a: &str, b: &str, inch: bool) -> bool {
    let length_mm = |text: &str| {
        let mut words = text.trim_matches('"').split_whitespace();
        let value: f64 = words.next()?.parse().ok()?;
        let inch = words.next().map_or(inch, |unit| unit == "in");
        Some(if inch { value * MM_PER_INCH } else { value })
    };
    length_mm(a).zip(length_mm(b)).is_some_and(|(a, b)| (a - b).abs() > SAME_SIZE * a.abs().max(b.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tool(diameter: &str, source: &str) -> ToolKnown {
        let keys = vec![("diameter", Known::said(diameter, source))];
        ToolKnown { number: Some(1), keys, ..ToolKnown::default() }
    }

    #[test]
    fn two_sources_that_disagree_tell_nothing_until_the_user_does() {
        let mut own = tool("10", "line 3");
        own.agree_with(&tool("9.9", "tools.json"), false);
        assert_eq!(own.get("diameter").unwrap().source, "tools.json");
        own.agree_with(&tool("9.6", "other.json"), false);
        assert!(own.get("diameter").is_none() && own.conflicts.len() == 1);
        own.overrule_by(&tool("10", "--tool"));
        assert!(own.get("diameter").is_some() && own.conflicts.is_empty());
        let mut inch = tool("0.25", "line 3");
        inch.agree_with(&tool("\"6.35 mm\"", "tools.json"), true);
        assert!(inch.conflicts.is_empty());
    }
}
