//! `init`: a setup to start from. In: a program, a tool library, the user's words. Out: `PROGRAM.setup.toml` in which every value names
//! its source and what is not known stays unknown. On a terminal it asks for what is missing.

use clap::Args;
use std::io::{BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

use super::error::CliError;
use super::input::{self, Source};
use super::options::Global;
use super::output::{Kind, Outputs};
use super::screen::Screen;
use super::tools;
use crate::report::Outcome;
use crate::setup::{Facts, Lacking, Of};

/// What the program's text does not tell, said by the user.
#[derive(Debug, Args)]
pub struct Told {
    /// Tool library: Fusion .json or .tools, FreeCAD .fctb or .fctl, LinuxCNC .tbl.
    #[arg(long, value_name = "LIB")]
    pub tools: Option<PathBuf>,
    /// A tool in words, over comment and library: "T1 flat D10 3 flutes".
    #[arg(long, value_name = "WORDS")]
    pub tool: Vec<String>,
    /// The blank: "X0 Y0 Z-20 X100 Y60 Z0", "around" for the box around the cutting moves, or a line of [stock].
    #[arg(long, value_name = "CORNERS", allow_hyphen_values = true)]
    pub stock: Option<String>,
    /// The material: a name of the library, or as people call it: 6061, 4140, 316.
    #[arg(long, value_name = "NAME")]
    pub material: Option<String>,
    /// The machine: a name of `feedwright library machines`.
    #[arg(long, value_name = "NAME")]
    pub machine: Option<String>,
}

/// `init`.
#[derive(Debug, Args)]
pub struct Init {
    /// NC program; - is standard input.
    pub program: PathBuf,
    /// What its text does not tell.
    #[command(flatten)]
    pub told: Told,
    /// Where the setup goes; without it PROGRAM.setup.toml beside the program; - is standard output.
    #[arg(short, long, value_name = "S.toml")]
    pub output: Option<PathBuf>,
}

/// Writes the setup; the outcome says whether it can be used as it is.
pub fn init(command: &Init, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let source = input::program(&command.program)?;
    let place = match (&command.output, &source.path) {
        (Some(path), _) => path.clone(),
        (None, Some(path)) => target(path),
        (None, None) => PathBuf::from("-"),
    };
    let mut outputs = Outputs::new(source.path.clone(), global.force);
    let output = outputs.open(&place, Kind::Setup)?;
    let facts = known(&source, &command.told, global, screen)?;
    let to_stdout = output.is_stdout();
    output.write(facts.text().as_bytes())?;
    outputs.commit()?;
    let lacking = facts.lacking();
    if !to_stdout {
        screen.say(&format!("written   {}", place.display()));
    }
    if lacking.is_empty() {
        return Ok(Outcome::Done);
    }
    screen.say(&format!("still unknown, each marked in the setup:\n{}", listed(&lacking)));
    Ok(Outcome::Unmet)
}

/// What text, library and user say, and on a terminal what the user answers.
pub fn known(source: &Source, told: &Told, global: &Global, screen: Screen) -> Result<Facts, CliError> {
    let mut facts = input::facts(source, global)?;
    take(&mut facts, told, screen)?;
    let terminal = std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
    if terminal && source.path.is_some() && !global.quiet {
        ask(&mut facts, &mut std::io::stdin().lock(), &mut std::io::stderr().lock())?;
    }
    Ok(facts)
}

fn take(facts: &mut Facts, told: &Told, screen: Screen) -> Result<(), CliError> {
    let wrong = |option: &str| {
        let option = option.to_owned();
        move |why: String| CliError::new(format!("{option}: {why}"), "correct the option, or leave it out")
    };
    if let Some(path) = &told.tools {
        let library = tools::library(path, facts.inch)?;
        library.notes.iter().for_each(|note| screen.say(note));
        facts.take_library(&library.tools);
    }
    for words in &told.tool {
        facts.take_tool(words, "--tool").map_err(wrong("--tool"))?;
    }
    if let Some(words) = &told.material {
        facts.take_material(words, "--material").map_err(wrong("--material"))?;
    }
    if let Some(words) = &told.stock {
        facts.take_blank(words, "--stock").map_err(wrong("--stock"))?;
    }
    if let Some(name) = &told.machine {
        facts.take_machine(name, "--machine").map_err(wrong("--machine"))?;
    }
    Ok(())
}

/// Asks for what is lacking, one thing at a time, again where an answer makes no sense. An empty answer confirms a guess, else it
/// leaves the thing unknown.
fn ask(facts: &mut Facts, answers: &mut dyn BufRead, screen: &mut dyn Write) -> std::io::Result<()> {
    let mut left: Vec<String> = Vec::new();
    while let Some(next) = facts.lacking().into_iter().find(|lacking| !left.contains(&lacking.what)) {
        let guess = next.guess.as_ref().map(|guess| format!(" [{guess}]")).unwrap_or_default();
        write!(screen, "{} ({}){guess}: ", next.what, next.remedy)?;
        screen.flush()?;
        let mut answer = String::new();
        if answers.read_line(&mut answer)? == 0 {
            writeln!(screen)?;
            return Ok(());
        }
        let answer = match (answer.trim(), &next.guess) {
            ("", Some(guess)) => guess.clone(),
            ("", None) => {
                left.push(next.what);
                continue;
            }
            (answer, _) => answer.to_owned(),
        };
        if let Err(why) = answered(facts, &next, &answer) {
            writeln!(screen, "{why}")?;
        }
    }
    Ok(())
}

fn answered(facts: &mut Facts, asked: &Lacking, answer: &str) -> Result<(), String> {
    match asked.of {
        Of::Material => facts.take_material(answer, "answered"),
        Of::Blank => facts.take_blank(answer, "answered"),
        Of::Tool(number, key) => facts.take_key(number, key, answer, "answered"),
    }
}

/// What is lacking, a line each.
pub fn listed(lacking: &[Lacking]) -> String {
    lacking.iter().map(|lacking| format!("  {}: {}", lacking.what, lacking.remedy)).collect::<Vec<_>>().join("\n")
}

/// The options that say what is lacking, as one would type them.
pub fn options(lacking: &[Lacking]) -> String {
    let mut options: Vec<String> = Vec::new();
    for one in lacking {
        let option = match one.of {
            Of::Material => "--material 6061".to_owned(),
            Of::Blank => "--stock \"X0 Y0 Z-20 X100 Y60 Z0\"".to_owned(),
            Of::Tool(number, _) => format!("--tool \"T{number} flat D10 3 flutes\""),
        };
        if !options.contains(&option) {
            options.push(option);
        }
    }
    options.join(" ")
}

/// The setup that a program without one gets.
pub fn target(program: &Path) -> PathBuf {
    program.with_extension("setup.toml")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dialogue_asks_again_confirms_guesses_and_ends_where_the_answers_end() {
        let text = "( T1 : 6.0 )\nT1 M6\nG1 X10 Z-1 F500\nX50\n";
        let facts = || {
            let program = crate::nc::parse(text.into(), None);
            Facts::of_program(&program, &crate::nc::interpret(&program, &crate::nc::Environment::default()))
        };
        let mut full = facts();
        let mut screen = Vec::new();
        let answers = "cheese\n7075\naround\n\nmany\n\nnone\n3\n";
        ask(&mut full, &mut answers.as_bytes(), &mut screen).unwrap();
        let said = String::from_utf8(screen).unwrap();
        assert!(said.contains("no coefficients for \"cheese\""), "{said}");
        assert!(said.contains("[6]") && said.contains("\"many\" is no diameter"), "{said}");
        assert!(full.lacking().is_empty() && full.text().contains("diameter = 6  # answered"), "{}", full.text());
        let mut cut = facts();
        ask(&mut cut, &mut "7075\n".as_bytes(), &mut Vec::new()).unwrap();
        assert!(cut.lacking().len() >= 3 && cut.material.is_some());
    }
}
