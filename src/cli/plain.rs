//! Making a program plain before the work on it: unrolled (`--expand`), or with numbers in place of computed feeds
//! (`[output] computed_feeds`). In: the source as read, its setup. Out: the source with other bytes, proved to do the same.

use std::path::Path;

use super::error::CliError;
use super::input::{self, Source};
use super::options::Global;
use super::screen::Screen;
use super::work;
use crate::nc::{self, Environment};
use crate::rewrite;

/// The source as it is worked on.
pub fn plain(
    source: Source,
    setup: Option<&Path>,
    expand: bool,
    global: &Global,
    screen: Screen,
) -> Result<Source, CliError> {
    let job = input::setup(setup, &source, global)?.job;
    let program = input::parse(&source, global, Some(&job))?;
    let folder = source.path.as_deref().and_then(Path::parent).map(Path::to_owned);
    let load = |name: &str| work::subprogram(folder.as_deref(), name);
    let environment = Environment { load: &load, ..Environment::from_job(&job) };
    let environment = nc::unit::with_its_unit(&program, environment, Some(&job));
    if !nc::has_flow_control(&program, &environment) {
        return Ok(source);
    }
    let bytes = if expand {
        let expanded = nc::unroll(&program, &environment);
        if !expanded.obstacles.is_empty() {
            return Err(CliError::Drawn { file: source.name, text: source.bytes, diagnostics: expanded.obstacles });
        }
        expanded.text
    } else if job.output.replace_computed_feeds {
        nc::plain_feeds(&program, &environment, &job.output.exclude)
    } else {
        return Ok(source);
    };
    let made = nc::parse(bytes.clone(), Some(program.dialect()));
    let proof = rewrite::verify(&program, &made, &environment);
    if let Some(difference) = proof.differences.first() {
        return Err(CliError::new(
            format!("made plain, {} would not be the same program: {difference}", source.name),
            "nothing was written; leave --expand and computed_feeds out, and please report it",
        ));
    }
    if expand {
        let (before, after) = (program.len(), made.len());
        screen.say(&format!(
            "unrolled  {before} lines into {after}; lines named below are those of the unrolled program"
        ));
    }
    Ok(Source { bytes, ..source })
}
