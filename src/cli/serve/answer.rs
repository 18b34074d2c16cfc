//! What is asked for and what is answered. In: an admitted request. Out:
//!
//! ```text
//! GET  /                    the folder
//! GET  /program/NAME?…      the report of a program, under the limits of the query
//! GET  /written/NAME?…      the program with its new feeds, to be saved
//! GET  /setup/NAME?…        the setup with the limits of the query, to be saved
//! POST /drop/NAME           takes a program; answers with the way to its page
//! ```

use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use super::address::encoded;
use super::folder::{Folder, MOST_DROPPED};
use super::guard::Asked;
use super::http::Answer;
use super::kept::StoredSimulations;
use crate::cli::error::CliError;
use crate::cli::input::{self, Setup, Source};
use crate::cli::options::Global;
use crate::cli::screen::Screen;
use crate::cli::start::own_loads;
use crate::cli::work::{Done, execute};
use crate::job::{self, Task, Wanted};
use crate::machine::LimitKind;
use crate::report::served::{Field, Form, folder_page, refusal_page};
use crate::report::{self, Relief, sha256};
use crate::setup::change::{self, Change};

/// Limits that the form always has, because they are the ones most thought of; others where the setup has them.
const USUAL: [LimitKind; 9] = [
    LimitKind::ForceXy,
    LimitKind::ForceAxial,
    LimitKind::Power,
    LimitKind::Torque,
    LimitKind::Deflection,
    LimitKind::ChipThickness,
    LimitKind::FeedPerTooth,
    LimitKind::FeedChange,
    LimitKind::Feed,
];

/// The folder, and what is kept of its programs.
pub struct Served {
    folder: Folder,
    kept: Mutex<StoredSimulations>,
    global: Global,
    screen: Screen,
}

/// A program with its setup, as chosen.
struct Chosen {
    source: Source,
    /// Name of the setup's file; `None`: the comments of the program.
    setup: Option<String>,
    /// The setup with the limits of the query.
    text: String,
    fields: Vec<Field>,
    inch: bool,
}

/// A program with its new feeds.
struct NewFeeds {
    done: Done,
    stock: Vec<Relief>,
    said: String,
}

impl Asked {
    /// Does it bring a program?
    pub fn is_drop(&self) -> bool {
        self.parts.first().is_some_and(|part| part == "drop")
    }

    fn value(&self, key: &str) -> Option<&str> {
        self.query.iter().rev().find(|(known, _)| known == key).map(|(_, value)| value.as_str())
    }

    /// The query without what only one address needs, as a part of another.
    fn query_text(&self) -> String {
        let pair = |(key, value): &(String, String)| format!("{}={}", encoded(key), encoded(value));
        self.query.iter().filter(|(key, _)| key != "sha256").map(pair).collect::<Vec<_>>().join("&")
    }
}

impl Served {
    /// A folder, with the options of the command.
    pub fn new(folder: Folder, global: Global, screen: Screen) -> Self {
        Self { folder, kept: Mutex::default(), global, screen: screen.quietly() }
    }

    /// The answer to a request.
    pub fn answer(&self, method: &str, asked: &Asked, body: Vec<u8>) -> Answer {
        let parts: Vec<&str> = asked.parts.iter().map(String::as_str).collect();
        match (method, &parts[..]) {
            ("GET", [""]) => self.list(),
            ("GET", ["program", name]) => self.program(name, asked),
            ("GET", ["written", name]) => self.written(name, asked),
            ("GET", ["setup", name]) => self.setup(name, asked),
            ("POST", ["drop", name]) => self.drop(name, body),
            _ => Answer::text(404, "there is nothing here\n"),
        }
    }

    fn list(&self) -> Answer {
        let link = |name: &String| (name.clone(), format!("program/{}", encoded(name)));
        let [programs, dropped] = self.folder.programs().map(|names| names.iter().map(link).collect::<Vec<_>>());
        let name = self.folder.shown();
        Answer::page(200, folder_page(&name, &programs, &dropped, MOST_DROPPED))
    }

    fn drop(&self, name: &str, bytes: Vec<u8>) -> Answer {
        let source = Source { name: name.to_owned(), path: None, bytes };
        let kept = input::check(&source).and_then(|()| self.folder.keep(name, source.bytes));
        match kept {
            Ok(name) => Answer::text(200, format!("program/{}", encoded(&name))),
            Err(error) => Answer::text(400, sentences(&error).join("; ")),
        }
    }

    fn program(&self, name: &str, asked: &Asked) -> Answer {
        let chosen = match self.source(name).map(|source| self.chosen(source, asked)) {
            None => return Answer::text(404, "there is no such program in the folder\n"),
            Some(Ok(chosen)) => chosen,
            Some(Err(error)) => {
                let shown = Form { setups: self.folder.setups(), ..Form::default() };
                return Answer::page(422, refusal_page(name, &sentences(&error), &shown));
            }
        };
        let mut shown = Form {
            setups: self.folder.setups(),
            setup: chosen.setup.clone(),
            inch: chosen.inch,
            fields: chosen.fields.clone(),
            ..Form::default()
        };
        match self.found(chosen) {
            Err(error) => Answer::page(422, refusal_page(name, &sentences(&error), &shown)),
            Ok(found) => {
                let figures = report::figures(&found.done.run);
                shown.said.clone_from(&found.said);
                let query = asked.query_text();
                let hash = found.done.run.written.as_ref().map(|written| sha256(&written.bytes)).unwrap_or_default();
                if figures.verdict.held_back().is_empty() {
                    let to = format!("../written/{}?{query}&sha256={hash}", encoded(name));
                    shown.save.push(("save the program".into(), to));
                }
                shown.save.push(("save the setup".into(), format!("../setup/{}?{query}", encoded(name))));
                Answer::page(200, page(&found, &figures, name, &shown))
            }
        }
    }

    fn written(&self, name: &str, asked: &Asked) -> Answer {
        let Some(source) = self.source(name) else { return Answer::text(404, "there is no such program\n") };
        let found = match self.chosen(source, asked).and_then(|chosen| self.found(chosen)) {
            Ok(found) => found,
            Err(error) => return Answer::text(422, sentences(&error).join("; ")),
        };
        let held = !report::figures(&found.done.run).verdict.held_back().is_empty();
        let bytes = found.done.run.written.filter(|_| !held).map(|written| written.bytes).unwrap_or_default();
        if held || asked.value("sha256") != Some(&sha256(&bytes)) {
            return Answer::text(409, "program or setup changed since the page was made: look at it again\n");
        }
        let (stem, ending) = name.rsplit_once('.').map_or((name, ""), |(stem, ending)| (stem, ending));
        let name = if ending.is_empty() { format!("{stem}.fw") } else { format!("{stem}.fw.{ending}") };
        Answer::file(&name, bytes)
    }

    fn setup(&self, name: &str, asked: &Asked) -> Answer {
        let Some(source) = self.source(name) else { return Answer::text(404, "there is no such program\n") };
        let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
        match self.chosen(source, asked) {
            Ok(chosen) => Answer::file(&format!("{stem}.setup.toml"), chosen.text.into_bytes()),
            Err(error) => Answer::text(422, sentences(&error).join("; ")),
        }
    }

    /// A program by its name: a file of the folder, or one that was dropped.
    fn source(&self, name: &str) -> Option<Source> {
        // A dropped program finds the setups and subprograms of the folder as if it lay there.
        let dropped = self.folder.dropped_program(name).map(|bytes| (self.folder.path().join(name), bytes.to_vec()));
        let of_folder = || {
            let path = self.folder.file(name)?;
            let bytes = input::file(&path).ok()?;
            Some((path, bytes))
        };
        let (path, bytes) = dropped.or_else(of_folder)?;
        Some(Source { name: name.to_owned(), path: Some(path), bytes })
    }

    /// The setup of a program and its limits, as the query says.
    fn chosen(&self, source: Source, asked: &Asked) -> Result<Chosen, CliError> {
        input::check(&source)?;
        let named = asked.value("setup").map(ToOwned::to_owned);
        let beside = || Some(input::beside(&source)?.file_name()?.to_str()?.to_owned());
        let setup = named.or_else(beside).filter(|name| !name.is_empty());
        let text = match &setup {
            None => input::comments_text(&source, &self.global)?,
            Some(name) => {
                let path = self.folder.file(name).filter(|_| self.folder.setups().contains(name));
                let none = || CliError::new(format!("there is no setup {name} in the folder"), "choose another");
                input::text(&path.ok_or_else(none)?)?
            }
        };
        let fields = fields(&text, asked)?;
        let changes: Vec<Change> = fields.iter().filter(|field| field.value != field.written).map(change_of).collect();
        let text = change::changed(&text, &changes).map_err(|error| CliError::new(error, "correct the setup"))?;
        let inch = text.parse::<toml::Table>().is_ok_and(|table| table.get("units") == Some(&"inch".into()));
        Ok(Chosen { source, setup, text, fields, inch })
    }

    /// The feeds of a program; simulated only where nothing is known of it.
    fn found(&self, chosen: Chosen) -> Result<NewFeeds, CliError> {
        let Chosen { source, setup, text, .. } = chosen;
        let place = self.folder.path().join(setup.as_deref().unwrap_or("setup from comments"));
        let mut read = input::read(text, &place)?;
        if setup.is_none() {
            read = input::told_by_comments(read);
        }
        let Setup { job, assumptions, .. } = input::with_options(read, &self.global)?;
        let program = input::parse(&source, &self.global, Some(&job))?;
        let wanted = Wanted { reference: own_loads(&job), ..Wanted::default() };
        let task = Task { program, job, assumptions, wanted };
        // One at a time: each takes all cores.
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let begun = Instant::now();
        let (done, stock, recalled) =
            kept.with(|keep| execute(source, task, job::optimize, &self.global, self.screen, keep));
        let done = done?;
        let differences = done.run.written.iter().flat_map(|written| &written.check.differences);
        let differences: Vec<&str> = differences.map(String::as_str).collect();
        if !differences.is_empty() {
            return Err(CliError::new(
                format!("the rewritten program would not be the same but for its feeds: {}", differences.join("; ")),
                "leave the block out with [output] exclude, and please report it",
            ));
        }
        let how = if recalled { "its engagement was known" } else { "simulated" };
        Ok(NewFeeds { done, stock, said: format!("{:.2} s, {how}", begun.elapsed().as_secs_f64()) })
    }
}

fn page(found: &NewFeeds, figures: &report::Figures, name: &str, form: &Form) -> String {
    let run = &found.done.run;
    let sections = job::sections(&run.program, &run.toolpath, &run.map);
    let shown = report::Shown { run, figures, file: name, sections: &sections, stock: &found.stock, form: Some(form) };
    report::html(&shown)
}

/// The limits of a setup as fields, with the values of the query.
fn fields(text: &str, asked: &Asked) -> Result<Vec<Field>, CliError> {
    let written = change::written(text).map_err(|error| CliError::new(error, "correct the setup"))?;
    let mut fields = Vec::new();
    for place in written {
        let before = place.tool.map_or_else(String::new, |number| format!("T{number}."));
        for kind in LimitKind::ALL {
            let known = place.values.iter().find(|(known, _)| *known == kind).map(|(_, value)| value.clone());
            if known.is_none() && (place.tool.is_some() || !USUAL.contains(&kind)) {
                continue;
            }
            let (key, written) = (format!("{before}{}", kind.name()), known.unwrap_or_default());
            let value = asked.value(&key).map_or_else(|| written.clone(), |value| value.trim().to_owned());
            fields.push(Field { key, kind, tool: place.tool, written, value });
        }
    }
    Ok(fields)
}

fn change_of(field: &Field) -> Change {
    Change { tool: field.tool, kind: field.kind, value: field.value.clone() }
}

/// An error in sentences.
fn sentences(error: &CliError) -> Vec<String> {
    match error {
        CliError::Message { text, help } | CliError::Unmet { text, help } => vec![text.clone(), help.clone()],
        CliError::Drawn { file, diagnostics, .. } => {
            let one = |found: &crate::diag::Diagnostic| {
                let line = found.line.map_or_else(String::new, |line| format!(", line {line}"));
                format!("{file}{line}: {}; {}", found.text, found.help)
            };
            diagnostics.iter().map(one).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(query: &str) -> Asked {
        let (parts, query) = super::super::address::read(&format!("/program/a.nc?{query}")).unwrap();
        Asked { parts, query }
    }

    #[test]
    fn the_form_has_the_usual_limits_and_what_the_setup_has() {
        let text = "[[tool]]\nnumber = 3\nlimits = { force_xy = 90 }\n[limits]\nforce_xy = 500\nsurface_error = 0.02\n";
        let found = fields(text, &asked("T3.force_xy=80&power=3+kW&force_xy=500")).unwrap();
        let changes: Vec<(&str, &str)> =
            found.iter().filter(|f| f.value != f.written).map(|f| (f.key.as_str(), f.value.as_str())).collect();
        assert_eq!(changes, [("power", "3 kW"), ("T3.force_xy", "80")]);
        assert_eq!(found.len(), USUAL.len() + 2);
        assert_eq!(asked("a=b+c&sha256=1").query_text(), "a=b%20c");
    }
}
