//! A setup to start from. In: a program, its motions, what a tool library and the user say. Out: a setup as TOML text in which every
//! value names its source; what is not known stands there as a comment, `# flutes = unknown`, and is listed.
//!
//! ```text
//! header (which comment is a tool) ─▶ described (figures) ─▶ known ◀─ tool library, the user's own words
//! blank, material                                     └────▶ Draft: text, and what it lacks
//! ```
//!
//! Read: `(T1 D=2 CR=0 - ZMIN=-5.9 - flat end mill)`, `(T2| 1/2 BULL ENDMILL 0.125 RAD|H0)`, `(T0 : 3.175)`, `M6 T7 (TOOL DIA. 3)`,
//! `T9 ;DRILL 10.2MM`, `(TOOL/MILL,10,1,20,0)`, `(STOCK/BLOCK,100,60,20,0,0,20)`, `(MATERIAL - ALUMINUM MM - 6061)`.

mod blank;
mod described;
mod figures;
mod header;
mod known;
mod material;

pub use known::{Known, TOOL_KEYS, ToolKnown};

use crate::nc::{MoveKind, Program, Toolpath};
use described::Told;

/// Facts from which a setup is drafted.
#[derive(Debug, Clone, PartialEq)]
pub struct Facts {
    /// Lengths are inches.
    pub inch: bool,
    /// Name of a material of the library.
    pub material: Option<Known>,
    /// Words of the program about its material that the library has nothing for.
    pub unknown_material: Option<String>,
    /// A line of `[stock]`.
    pub blank: Option<Known>,
    /// The box around the cutting moves, as a line of `[stock]`.
    pub around: String,
    /// A machine of the library.
    pub machine: Option<Known>,
    /// Tools of the feed moves in the order of use.
    pub tools: Vec<ToolKnown>,
}

/// Something without which nothing can be simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct Lacking {
    /// In words: `flutes of T1`.
    pub what: String,
    /// What to do: `count them`.
    pub remedy: String,
    /// What it belongs to.
    pub of: Of,
    /// What the text suggests.
    pub guess: Option<String>,
}

/// What something that is lacking belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Of {
    /// `[stock] material`
    Material,
    /// `[stock] box`
    Blank,
    /// A key of the tool of this number.
    Tool(u32, &'static str),
}

impl Facts {
    /// What the text of a program tells.
    pub fn of_program(program: &Program, path: &Toolpath) -> Self {
        let comments = header::comments(program);
        let mut told: Vec<(Told, u32)> = Vec::new();
        for (comment, (number, text)) in comments.iter().filter_map(|c| Some((c, header::tool_comment(c)?))) {
            let new = described::told(number, &text, path.inch);
            match told.iter_mut().find(|(known, _)| known.number == number) {
                Some(known) if known.0.diameter.is_none() => *known = (new, comment.line),
                Some(_) => {}
                None => told.push((new, comment.line)),
            }
        }
        let tool = |number: u32| {
            let own = |told: &&(Told, u32)| told.0.number == number;
            // A program without a T word has one tool, whatever its comment calls it.
            let only = told.first().filter(|_| number == 0 && told.len() == 1);
            let found = told.iter().find(own).or(only);
            let known = found.map(|(told, line)| told.known(&format!("line {line}"))).unwrap_or_default();
            ToolKnown { number: Some(number), ..known }
        };
        let (material, unknown_material) = material::of_comments(&comments);
        Self {
            inch: path.inch,
            material,
            unknown_material,
            blank: blank::told(program, &comments),
            around: blank::around(path),
            machine: None,
            tools: used(path).into_iter().map(tool).collect(),
        }
    }

    /// Takes the tools of a library that the program calls, by their numbers.
    pub fn take_library(&mut self, library: &[ToolKnown]) {
        for tool in &mut self.tools {
            if let Some(known) = library.iter().find(|known| known.number == tool.number) {
                tool.agree_with(known, self.inch);
            }
        }
    }

    /// Takes a tool as the user describes it, in the words of a comment: `T1 flat D10 3 flutes`. Errors: what does not make sense.
    pub fn take_tool(&mut self, words: &str, source: &str) -> Result<(), String> {
        let capitals = words.to_uppercase();
        let (number, text) = header::numbered(&capitals)
            .ok_or_else(|| format!("\"{words}\" names no tool; begin with its T word: \"T1 flat D10 3 flutes\""))?;
        let known = described::told(number, &text, self.inch).known(source);
        let Some(tool) = self.tools.iter_mut().find(|tool| tool.number == Some(number)) else {
            return Err(format!("the program cuts nothing with T{number}"));
        };
        if known.keys.is_empty() {
            return Err(format!("\"{words}\" tells nothing of the tool; write like \"T{number} flat D10 3 flutes\""));
        }
        tool.overrule_by(&known.confirmed());
        Ok(())
    }

    /// Takes one value of a tool. Errors: it makes no sense for this key.
    pub fn take_key(&mut self, number: u32, key: &'static str, answer: &str, source: &str) -> Result<(), String> {
        let answer = answer.trim().trim_matches('"').to_lowercase();
        let value = match key {
            "shape" => super::tool::is_shape(&answer).then(|| format!("\"{answer}\"")),
            "flutes" => answer.parse::<u32>().ok().filter(|count| (1..=200).contains(count)).map(|c| c.to_string()),
            _ => length(&answer),
        };
        let value = value.ok_or_else(|| format!("\"{answer}\" is no {key}"))?;
        let tool = self.tools.iter_mut().find(|tool| tool.number == Some(number));
        let tool = tool.ok_or_else(|| format!("the program cuts nothing with T{number}"))?;
        tool.overrule_by(&ToolKnown { keys: vec![(key, Known::said(value, source))], ..ToolKnown::default() });
        Ok(())
    }

    /// Takes a material by its name in the library or as people call it. Errors: the library has nothing for it.
    pub fn take_material(&mut self, words: &str, source: &str) -> Result<(), String> {
        let known = material::named(words, source);
        self.material = Some(known.ok_or_else(|| {
            format!("the library has no coefficients for \"{words}\"; see `feedwright library materials`, or write a [material] table")
        })?);
        Ok(())
    }

    /// Takes the blank as two corners `X0 Y0 Z-20 X100 Y60 Z0`, as `around` the cutting moves, or as a line of `[stock]`. Errors: what
    /// cannot be read.
    pub fn take_blank(&mut self, words: &str, source: &str) -> Result<(), String> {
        let line = blank::in_words(words, &self.around)?;
        self.blank = Some(Known::said(line, source));
        Ok(())
    }

    /// Takes a machine of the library. Errors: there is none of this name.
    pub fn take_machine(&mut self, name: &str, source: &str) -> Result<(), String> {
        let machines = super::library::machines();
        let names: Vec<&str> = machines.iter().map(|machine| machine.name.as_str()).collect();
        if !names.contains(&name) {
            return Err(format!("the library has no machine \"{name}\"; there are: {}", names.join(", ")));
        }
        self.machine = Some(Known::said(format!("\"{name}\""), source));
        Ok(())
    }

    /// What is not known and has to be before anything can be simulated.
    pub fn lacking(&self) -> Vec<Lacking> {
        let mut lacking = Vec::new();
        if self.material.is_none() {
            let called = self.unknown_material.as_ref().map(|words| format!(" (\"{words}\" in the program)"));
            lacking.push(Lacking {
                what: format!("material of the stock{}", called.unwrap_or_default()),
                remedy: "a name of `feedwright library materials`, or as you call it: 6061, 4140, 316".into(),
                of: Of::Material,
                guess: None,
            });
        }
        if self.blank.is_none() {
            lacking.push(Lacking {
                what: "box of the stock".into(),
                remedy: format!(
                    "two corners like X0 Y0 Z-20 X100 Y60 Z0; around the cutting moves it is {}",
                    self.around
                ),
                of: Of::Blank,
                guess: None,
            });
        }
        for tool in &self.tools {
            let number = tool.number.unwrap_or(0);
            let open = tool.needed().into_iter().filter(|(key, _)| tool.get(key).is_none_or(|known| known.guessed));
            lacking.extend(open.map(|(key, remedy)| Lacking {
                what: format!("{key} of T{number}"),
                remedy: tool.conflicts.first().filter(|_| key == "diameter").map_or(remedy.into(), Clone::clone),
                of: Of::Tool(number, key),
                guess: tool.get(key).map(|known| known.value.clone()),
            }));
        }
        lacking
    }

    /// The setup as TOML text; it can be used as it is when nothing is [`Self::lacking`].
    pub fn text(&self) -> String {
        let mut text = format!("units = \"{}\"\n", if self.inch { "inch" } else { "mm" });
        text += &line(
            "machine",
            self.machine.as_ref(),
            "a name of `feedwright library machines`; until then times are those of a small-vmc",
        );
        text += "\n[stock]\n";
        text += &line("material", self.material.as_ref(), "a name of `feedwright library materials`");
        text += &match &self.blank {
            Some(known) => format!("{}  # {}\n", known.value, known.source),
            None => format!("# box = unknown: around the cutting moves it is\n# {}\n", self.around),
        };
        for tool in &self.tools {
            text += &tool_text(tool);
        }
        text
    }
}

/// `10`, `10 mm`, `0.5 in`, `0.5"` as TOML.
fn length(text: &str) -> Option<String> {
    let end = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let value = text[..end].parse::<f64>().ok().filter(|value| *value > 0.0)?;
    match text[end..].trim() {
        "" => Some(format!("{value}")),
        "mm" => Some(format!("\"{value} mm\"")),
        "in" | "inch" | "\"" => Some(format!("\"{value} in\"")),
        _ => None,
    }
}

/// A tool as a remark in words describes it; bare lengths are in inches or mm.
pub fn described_tool(number: u32, words: &str, inch: bool, source: &str) -> ToolKnown {
    described::told(number, &words.to_uppercase(), inch).known(source)
}

/// A table `[[tool]]`, what is not known as comments.
fn tool_text(tool: &ToolKnown) -> String {
    let name = if tool.name.is_empty() { String::new() } else { format!("  # {}", tool.name) };
    let mut text = format!("\n[[tool]]{name}\nnumber = {}\n", tool.number.unwrap_or(0));
    let needed = tool.needed();
    for key in TOOL_KEYS {
        let remedy = needed.iter().find(|(name, _)| *name == key).map(|(_, remedy)| *remedy);
        match (tool.get(key), remedy) {
            (None, None) => {}
            (known, remedy) => text += &line(key, known, remedy.unwrap_or_default()),
        }
    }
    for conflict in &tool.conflicts {
        text += &format!("# {conflict}\n");
    }
    if tool.get("overhang").is_none() && tool.needed().iter().any(|(key, _)| *key == "flutes") {
        text += "# overhang = unknown: measure it from the holder before you limit deflection or bending stress\n";
    }
    text
}

/// `key = value  # source`, or what is not known as a comment.
fn line(key: &str, known: Option<&Known>, remedy: &str) -> String {
    match known {
        Some(known) if known.guessed => {
            format!("# {key} = unknown: {} is a guess from {}; {remedy}\n", known.value, known.source)
        }
        Some(known) => format!("{key} = {}  # {}\n", known.value, known.source),
        None => format!("# {key} = unknown: {remedy}\n"),
    }
}

/// Tools of the feed moves in order of use.
fn used(path: &Toolpath) -> Vec<u32> {
    let mut used = Vec::new();
    for motion in path.moves.iter().filter(|motion| motion.kind == MoveKind::Feed) {
        if !used.contains(&motion.tool) {
            used.push(motion.tool);
        }
    }
    used
}

#[cfg(test)]
mod tests;
