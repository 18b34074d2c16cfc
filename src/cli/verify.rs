//! `verify`: the proof that only feeds differ.

use std::path::Path;

use serde::Serialize;

use super::Outcome;
use super::args::{Global, Verify};
use super::error::CliError;
use super::input;
use super::output::{Kind, Outputs};
use super::screen::Screen;
use super::work;
use crate::nc::{self, Environment};
use crate::rewrite::{self, Proof};

#[derive(Serialize)]
struct Report<'a> {
    written_by: &'static str,
    original: &'a str,
    rewritten: &'a str,
    identical: bool,
    motions: usize,
    feeds_changed: usize,
    blocks_added: usize,
    blocks_split: usize,
    unrolled: bool,
    differences: Vec<DifferencePart<'a>>,
}

#[derive(Serialize)]
struct DifferencePart<'a> {
    /// The subprogram that the lines belong to.
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<&'a str>,
    original_line: Option<u32>,
    rewritten_line: Option<u32>,
    text: &'a str,
}

/// Compares two programs.
pub fn verify(command: &Verify, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let original = input::program(&command.original)?;
    let rewritten = input::program(&command.rewritten)?;
    let setup = input::setup_if_any(command.setup.as_deref(), &original, global)?;
    let paths = [&original, &rewritten].map(|source| source.path.clone());
    let mut outputs = Outputs::new(paths.into_iter().flatten().chain(command.setup.clone()), global.force);
    let json = command.json.as_deref().map(|path| outputs.open(path, Kind::Json)).transpose()?;
    let job = setup.as_ref().map(|setup| &setup.job);
    let before = input::parse(&original, global, job);
    let after = nc::parse(rewritten.bytes.clone(), Some(before.dialect()));
    let folder = |source: Option<&Path>| source.and_then(Path::parent).map(Path::to_owned);
    let [own, other] = [original.path.as_deref(), rewritten.path.as_deref()].map(folder);
    let load = |name: &str| work::subprogram(own.as_deref(), name);
    // A file that is not beside the rewritten program is the original's for the control too.
    let load_other = |name: &str| work::subprogram(other.as_deref(), name).or_else(|| load(name));
    let environment = Environment { load: &load, ..job.map(Environment::from_job).unwrap_or_default() };
    let (before, _) = nc::linked(&before, &environment);
    let (after, _) = nc::linked(&after, &Environment { load: &load_other, ..environment.clone() });
    let proof = rewrite::verify(&before, &after, &environment);
    let text = words(&proof);
    if let Some(output) = json {
        let to_stdout = output.is_stdout();
        let report = report(&proof, &original.name, &rewritten.name);
        output.write((serde_json::to_string_pretty(&report).expect("plain data") + "\n").as_bytes())?;
        if to_stdout {
            screen.say(&text);
            return Ok(outcome(&proof));
        }
    }
    screen.show(&text)?;
    Ok(outcome(&proof))
}

fn outcome(proof: &Proof) -> Outcome {
    if proof.holds() { Outcome::Done } else { Outcome::Unmet }
}

fn words(proof: &Proof) -> String {
    if proof.holds() {
        let unrolled = if proof.unrolled { "unrolled, motions the same; " } else { "" };
        return format!(
            "{unrolled}only feeds differ: {} motions compared, {} run at another feed, {} blocks split, {} lines added\n",
            proof.motions, proof.feeds_changed, proof.blocks_split, proof.blocks_added
        );
    }
    let mut text = String::from("more than feeds differ:\n");
    for difference in &proof.differences {
        let line = |line: Option<u32>| line.map_or_else(|| "-".to_owned(), |line| line.to_string());
        let (original, rewritten) = (line(difference.original_line), line(difference.rewritten_line));
        let file = difference.file.as_ref().map_or_else(String::new, |file| format!("{file}, "));
        text += &format!("  {file}line {original} → line {rewritten}: {}\n", difference.text);
    }
    text
}

fn report<'a>(proof: &'a Proof, original: &'a str, rewritten: &'a str) -> Report<'a> {
    let part = |difference: &'a rewrite::Difference| DifferencePart {
        file: difference.file.as_deref(),
        original_line: difference.original_line,
        rewritten_line: difference.rewritten_line,
        text: &difference.text,
    };
    Report {
        written_by: crate::report::WRITTEN_BY,
        original,
        rewritten,
        identical: proof.holds(),
        motions: proof.motions,
        feeds_changed: proof.feeds_changed,
        blocks_added: proof.blocks_added,
        blocks_split: proof.blocks_split,
        unrolled: proof.unrolled,
        differences: proof.differences.iter().map(part).collect(),
    }
}
