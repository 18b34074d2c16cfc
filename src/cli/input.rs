//! Reading what a command works on. In: paths. Out: bytes, refused with a clear message where they cannot be a program.

use std::io::Read;
use std::path::{Path, PathBuf};

use super::error::CliError;
use super::options::Global;
use crate::machine::Job;
use crate::nc::{self, Dialect, Program};
use crate::setup::{self, Assumption, Facts};

/// A program with its name.
#[derive(Debug)]
pub struct Source {
    /// Name to show.
    pub name: String,
    /// Where it lies; `None`: standard input.
    pub path: Option<PathBuf>,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

/// Reads a program; `-` is standard input.
pub fn program(path: &Path) -> Result<Source, CliError> {
    let source = if path == Path::new("-") {
        let mut bytes = Vec::new();
        std::io::stdin().read_to_end(&mut bytes).map_err(|error| CliError::file("read", path, &error))?;
        Source { name: "standard input".into(), path: None, bytes }
    } else {
        Source { name: path.display().to_string(), path: Some(path.to_owned()), bytes: file(path)? }
    };
    check(&source)?;
    Ok(source)
}

/// Reads a file, a pipe or a device; a file that changes meanwhile is refused.
pub fn file(path: &Path) -> Result<Vec<u8>, CliError> {
    if path.is_dir() {
        return Err(CliError::new(format!("{} is a folder", path.display()), "give one file"));
    }
    let stamp =
        || path.metadata().ok().filter(std::fs::Metadata::is_file).map(|data| (data.len(), data.modified().ok()));
    let before = stamp();
    let bytes = std::fs::read(path).map_err(|error| CliError::file("read", path, &error))?;
    let whole = before.is_none_or(|(length, _)| length == bytes.len() as u64);
    if whole && before == stamp() {
        return Ok(bytes);
    }
    Err(CliError::new(
        format!("{} was changed while it was read", path.display()),
        "wait until whoever writes it is done, then run it again",
    ))
}

/// Reads a text file.
pub fn text(path: &Path) -> Result<String, CliError> {
    let bytes = file(path)?;
    String::from_utf8(bytes).map_err(|_| {
        CliError::new(format!("{} is not UTF-8 text", path.display()), "setup and model files are TOML in UTF-8")
    })
}

/// Refuses what cannot be a program.
pub fn check(source: &Source) -> Result<(), CliError> {
    let Source { name, bytes, .. } = source;
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(CliError::new(format!("{name} is empty"), "give an NC program with at least one motion"));
    }
    if let Some(what) = other_kind(bytes) {
        return Err(CliError::new(
            format!("{name} is {what}, not an NC program"),
            "give the program that the machine runs",
        ));
    }
    if bytes.len() > nc::MAX_TEXT {
        return Err(CliError::new(format!("{name} is larger than 4 GiB"), "split the program"));
    }
    if memchr::memchr(b'\r', bytes).is_some() && memchr::memchr(b'\n', bytes).is_none() {
        return Err(CliError::new(
            format!("{name} has lines that end in CR alone: it would be one long line for most controls"),
            "convert its line ends to LF or CR LF",
        ));
    }
    if looks_binary(bytes) {
        return Err(CliError::new(
            format!("{name} is not a text file"),
            "give an NC program as plain text (ASCII, Latin-1 or UTF-8, not UTF-16)",
        ));
    }
    Ok(())
}

/// Text that people give in place of a program: a mesh, a report, a setup.
fn other_kind(bytes: &[u8]) -> Option<&'static str> {
    let head = &bytes[..bytes.len().min(1 << 16)];
    let text = head.trim_ascii_start();
    let holds = |part: &str| memchr::memmem::find(head, part.as_bytes()).is_some();
    let begins = |part: &str| text.starts_with(part.as_bytes());
    let line = |wanted: &[u8]| head.split(|byte| *byte == b'\n').any(|line| line.trim_ascii() == wanted);
    match () {
        () if begins("solid") && (holds("facet") || holds("endsolid")) => Some("a mesh (STL)"),
        () if begins("{") && holds("\":") => Some("JSON"),
        () if begins("<") && (holds("<html") || holds("<svg") || holds("<?xml")) => Some("a page or XML"),
        () if line(b"[stock]") || line(b"[[tool]]") => Some("a setup file"),
        () => None,
    }
}

/// Control characters are rare in a program, though a tape may begin with NUL.
fn looks_binary(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(1 << 16)];
    let nul = memchr::memchr_iter(0, head).count();
    let strange = |byte: &&u8| matches!(byte, 1..=8 | 14..=25 | 27..=31 | 127);
    let control = head.iter().filter(strange).count();
    nul * 5 > head.len() || control * 100 > head.len()
}

/// Takes the program apart; the dialect is that of the command line, else of the setup, else recognised. A program that is
/// not for a mill, or whose words mean other things than those of every dialect read here, is refused.
pub fn parse(source: &Source, global: &Global, job: Option<&Job>) -> Result<Program, CliError> {
    let named = global.dialect.as_deref().or_else(|| job.and_then(|job| job.machine.dialect.as_deref()));
    let program = nc::parse(source.bytes.clone(), named.and_then(Dialect::from_name));
    match nc::refusal(&program, global.mill) {
        Some(why) => Err(CliError::new(format!("{}: {}", source.name, why.text), why.help)),
        None => Ok(program),
    }
}

/// A setup with what it assumes.
pub struct Setup {
    /// The job.
    pub job: Job,
    /// Defaults in force.
    pub assumptions: Vec<Assumption>,
    /// The file it comes from.
    pub path: Option<PathBuf>,
}

/// The setup of a program: as given, else `PROGRAM.setup.toml` beside it.
pub fn setup(given: Option<&Path>, source: &Source, global: &Global) -> Result<Setup, CliError> {
    let found = given.map(Path::to_owned).or_else(|| beside(source));
    let setup = match found {
        Some(path) => load(&path)?,
        None => from_comments(source, global)?,
    };
    with_options(setup, global)
}

/// A setup under the options that every command has.
pub fn with_options(mut setup: Setup, global: &Global) -> Result<Setup, CliError> {
    if let Some(model) = &global.model {
        let text = text(model)?;
        let process = setup::load_model(&text).map_err(|error| drawn(model, text, &error))?;
        setup::take_model(&mut setup.job, &mut setup.assumptions, process);
    }
    if let Some(cell_mm) = global.resolution {
        if !(cell_mm > 0.0 && cell_mm.is_finite()) {
            return Err(CliError::new(
                format!("--resolution {cell_mm} makes no sense"),
                "give a positive number of mm",
            ));
        }
        setup.job.cell_mm = Some(cell_mm);
    }
    if let Some(name) = &global.dialect {
        setup.job.machine.dialect = Some(name.clone());
    }
    if global.strict && !setup.assumptions.is_empty() {
        return Err(strict(&setup));
    }
    Ok(setup)
}

/// The setup of a command that can do without.
pub fn setup_if_any(given: Option<&Path>, source: &Source, global: &Global) -> Result<Option<Setup>, CliError> {
    if given.is_none() && beside(source).is_none() {
        return Ok(None);
    }
    setup(given, source, global).map(Some)
}

fn load(path: &Path) -> Result<Setup, CliError> {
    read(text(path)?, path)
}

/// The setup of a text that stands, or might stand, in a file.
pub fn read(text: String, path: &Path) -> Result<Setup, CliError> {
    let dir = path.parent().unwrap_or(Path::new("."));
    match setup::load(&text, dir) {
        Ok((job, assumptions)) => Ok(Setup { job, assumptions, path: Some(path.to_owned()) }),
        Err(error) => Err(drawn(path, text, &error)),
    }
}

fn drawn(path: &Path, text: String, error: &setup::SetupError) -> CliError {
    CliError::Drawn { file: path.display().to_string(), text: text.into_bytes(), diagnostics: error.diagnostics() }
}

/// `part.setup.toml` beside `part.nc`, and beside `part.fw.nc` and `part.life.nc` too.
pub fn beside(source: &Source) -> Option<PathBuf> {
    let path = source.path.as_ref()?;
    let stem = path.file_stem()?.to_str()?;
    let life = stem.split_once(".life").map(|(plain, _)| plain);
    let names = [Some(stem), stem.strip_suffix(".fw"), life];
    names
        .into_iter()
        .flatten()
        .map(|stem| path.with_file_name(format!("{stem}.setup.toml")))
        .find(|path| path.is_file())
}

/// What the text of a program tells of its setup.
pub fn facts(source: &Source, global: &Global) -> Result<Facts, CliError> {
    let program = parse(source, global, None)?;
    let path = nc::interpret(&program, &nc::unit::with_its_unit(&program, nc::Environment::default(), None));
    if path.moves.iter().all(|motion| motion.kind != nc::MoveKind::Feed) {
        return Err(CliError::new(
            format!("{}: no tool moves at a feed in it", source.name),
            "give an NC program; if it is one, name its --dialect",
        ));
    }
    Ok(Facts::of_program(&program, &path))
}

/// Tool and stock comments of the program, where they suffice; else what a setup lacks.
fn from_comments(source: &Source, global: &Global) -> Result<Setup, CliError> {
    let read = read(comments_text(source, global)?, Path::new("setup from comments"))?;
    Ok(told_by_comments(read))
}

/// A setup that the comments of a program told, and says so.
pub fn told_by_comments(mut setup: Setup) -> Setup {
    let told = Assumption {
        key: "tool, stock".into(),
        value: "as the comments of the program tell".into(),
        source: "no setup file".into(),
    };
    setup.assumptions.insert(0, told);
    Setup { path: None, ..setup }
}

/// The text of a setup that tool and stock comments of the program tell, where they suffice; else what a setup lacks.
pub fn comments_text(source: &Source, global: &Global) -> Result<String, CliError> {
    let facts = facts(source, global)?;
    let lacking = facts.lacking();
    let text = facts.text();
    if lacking.is_empty() {
        return Ok(text);
    }
    let (name, place) = match &source.path {
        Some(path) => (path.display().to_string(), path.with_extension("setup.toml").display().to_string()),
        None => ("PROGRAM".into(), "a file and name it with --setup".into()),
    };
    let lacks: Vec<&str> = lacking.iter().map(|lacking| lacking.what.as_str()).collect();
    Err(CliError::new(
        format!("there is no setup for {}, and its comments do not tell: {}", source.name, lacks.join(", ")),
        format!(
            "`feedwright init {name}` writes this to {place}; fill in what is unknown:\n\n{text}\n[limits]\nforce_xy = 300  # N, and others: see `feedwright schema`"
        ),
    ))
}

fn strict(setup: &Setup) -> CliError {
    let file = setup.path.as_ref().map_or_else(|| "the setup".to_owned(), |path| path.display().to_string());
    let list: Vec<_> = setup.assumptions.iter().map(|a| format!("  {} = {} ({})", a.key, a.value, a.source)).collect();
    CliError::new(
        format!("{file} leaves {} values to defaults:\n{}", list.len(), list.join("\n")),
        "write them down, or leave --strict out",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_are_text_even_with_a_leader_of_nul() {
        let mut tape = vec![0; 20];
        tape.extend_from_slice(&b"%\nO1 (\xe4\xf6\xfc)\nG0 X1\n".repeat(20));
        assert!(!looks_binary(&tape));
        assert!(looks_binary(b"\x7fELF\x02\x01\x01\0\0\0\0\0\0\0\0\0\x03\0>\0\x01\0\0\0"));
        assert!(looks_binary(b"G\x000\0 \0X\x001\0"));
        assert!(!looks_binary(b"G0 X1"));
    }

    #[test]
    fn what_is_no_program_is_told_by_its_text() {
        for (text, what) in [
            ("solid part\nfacet normal 0 0 1\n", Some("a mesh (STL)")),
            ("{\"data\": []}", Some("JSON")),
            ("<!doctype html>\n<html>", Some("a page or XML")),
            ("units = \"mm\"\n[stock]\n", Some("a setup file")),
            ("%\nO1\n(SOLID CARBIDE)\nG0 X1\n", None),
            ("solid state\nG1 X1", None),
        ] {
            assert_eq!(other_kind(text.as_bytes()), what, "{text}");
        }
    }
}
