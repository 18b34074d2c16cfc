//! Writing files so that no half-written one can exist: the temporary file is made in the target's folder before the long
//! work begins (so that a folder that cannot be written is found out early) and renamed over the target at the end.
//!
//! An existing file is replaced only if Feedwright wrote it, if it is a copy of an input, or with `--force`; an input never is.

use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

use super::error::CliError;
use super::screen;
use crate::stock::saved;

/// Kinds of file, each with its own mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// NC program.
    Program,
    /// JSON report.
    Json,
    /// CSV table.
    Csv,
    /// SVG picture, HTML report.
    Markup,
    /// Simulated engagement.
    Cache,
    /// Stock, for the next program or as a mesh.
    Stock,
    /// Setup that people go on writing in: never replaced unasked.
    Setup,
    /// State of a tool.
    ToolState,
    /// Table of check points.
    Checks,
}

/// A file to be.
#[derive(Debug)]
pub enum Output {
    /// Standard output.
    Stdout,
    /// Written at once at the end: a device or a pipe.
    Device(PathBuf),
    /// A file in its folder, not yet under its name.
    File {
        /// The temporary file.
        temporary: Box<NamedTempFile>,
        /// Its name at the end.
        target: PathBuf,
    },
}

/// Outputs of one command: no two may be the same file, none may be an input.
#[derive(Debug, Default)]
pub struct Outputs {
    taken: Vec<PathBuf>,
    inputs: Vec<PathBuf>,
    force: bool,
    stdout: bool,
}

impl Outputs {
    /// With the inputs that must stay as they are.
    pub fn new(inputs: impl IntoIterator<Item = PathBuf>, force: bool) -> Self {
        let inputs = inputs.into_iter().filter_map(|path| path.canonicalize().ok()).collect();
        Self { inputs, force, ..Self::default() }
    }

    /// Adds a file that must stay as it is.
    pub fn keep(&mut self, path: &Path) {
        self.inputs.extend(path.canonicalize());
    }

    /// Makes ready to write `path`; `-` is standard output.
    pub fn open(&mut self, path: &Path, kind: Kind) -> Result<Output, CliError> {
        if path == Path::new("-") {
            if std::mem::replace(&mut self.stdout, true) {
                return Err(CliError::new("two outputs go to standard output", "give one of them a file"));
            }
            return Ok(Output::Stdout);
        }
        if path.is_dir() {
            return Err(CliError::new(format!("{} is a folder", path.display()), "give the name of a file in it"));
        }
        let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        if target.exists() {
            if !target.is_file() {
                return Ok(Output::Device(target));
            }
            self.may_replace(path, &target, kind)?;
        }
        let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let temporary = temporary(folder).map_err(|error| CliError::file("write", path, &error))?;
        let own =
            folder.canonicalize().unwrap_or_else(|_| folder.to_owned()).join(target.file_name().unwrap_or_default());
        if self.taken.contains(&own) {
            return Err(CliError::new(format!("{} is written twice", path.display()), "give each output its own name"));
        }
        self.taken.push(own);
        Ok(Output::File { temporary: Box::new(temporary), target })
    }

    fn may_replace(&self, path: &Path, target: &Path, kind: Kind) -> Result<(), CliError> {
        if self.inputs.iter().any(|input| input == target || same_file(input, target)) {
            return Err(CliError::new(
                format!("{} is an input and is never overwritten", path.display()),
                "give the output another name with -o",
            ));
        }
        let read_only = target.metadata().is_ok_and(|data| data.permissions().readonly());
        if read_only {
            return Err(CliError::new(
                format!("{} is write-protected", path.display()),
                "give the output another name",
            ));
        }
        let bytes = std::fs::read(target).map_err(|error| CliError::file("read", path, &error))?;
        // A copy of an input, as a program is that was written without a change, holds nothing that could be lost.
        let copy = || self.inputs.iter().any(|input| std::fs::read(input).is_ok_and(|known| known == bytes));
        if self.force || bytes.is_empty() || is_ours(&bytes, kind) || copy() {
            return Ok(());
        }
        Err(CliError::new(
            format!("{} exists and was not written by Feedwright", path.display()),
            "give the output another name, or replace it with --force",
        ))
    }
}

#[cfg(unix)]
fn same_file(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let (Ok(a), Ok(b)) = (a.metadata(), b.metadata()) else { return false };
    a.dev() == b.dev() && a.ino() == b.ino()
}

#[cfg(not(unix))]
fn same_file(_: &Path, _: &Path) -> bool {
    false
}

#[cfg(unix)]
fn temporary(folder: &Path) -> std::io::Result<NamedTempFile> {
    use std::os::unix::fs::PermissionsExt;
    // The usual permissions of a new file; the process's umask takes its part.
    tempfile::Builder::new()
        .prefix(".feedwright-")
        .permissions(std::fs::Permissions::from_mode(0o666))
        .tempfile_in(folder)
}

#[cfg(not(unix))]
fn temporary(folder: &Path) -> std::io::Result<NamedTempFile> {
    tempfile::Builder::new().prefix(".feedwright-").tempfile_in(folder)
}

/// Does a file carry our mark?
fn is_ours(bytes: &[u8], kind: Kind) -> bool {
    // The mark stands at the head of most files, and behind the other keys of a report in JSON.
    let (head, tail) = (&bytes[..bytes.len().min(4096)], &bytes[bytes.len().saturating_sub(4096)..]);
    let holds = |mark: &str| [head, tail].iter().any(|part| memchr::memmem::find(part, mark.as_bytes()).is_some());
    match kind {
        Kind::Program => {
            holds(crate::finish::stepover::text::MARK)
                || crate::rewrite::is_ours(&crate::nc::parse(bytes.to_vec(), None))
        }
        Kind::Json => holds(&format!("\"{}\"", crate::report::WRITTEN_BY)),
        Kind::Csv => holds(crate::report::CSV_HEAD),
        Kind::Markup => holds(crate::report::MARK),
        Kind::ToolState => bytes.starts_with(crate::setup::STATE_MARK.as_bytes()),
        Kind::Checks => bytes.starts_with(crate::report::life::CHECKS_HEAD.as_bytes()),
        Kind::Cache => bytes.starts_with(crate::engage::cache::FAMILY),
        Kind::Setup => false,
        Kind::Stock => bytes.starts_with(saved::FAMILY) || bytes.starts_with(saved::MESH_MARK),
    }
}

impl Output {
    /// Puts the bytes there, all or none.
    pub fn write(self, bytes: &[u8]) -> Result<(), CliError> {
        match self {
            Output::Stdout => screen::put(bytes),
            other => other.write_with(|out| out.write_all(bytes)),
        }
    }

    /// Puts there what `fill` writes, all or none.
    pub fn write_with(self, fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<(), CliError> {
        match self {
            Output::Stdout => {
                let mut out = std::io::BufWriter::new(std::io::stdout().lock());
                fill(&mut out)?;
                Ok(out.flush()?)
            }
            Output::Device(path) => {
                let mut bytes = Vec::new();
                let written = fill(&mut bytes).and_then(|()| std::fs::write(&path, bytes));
                written.map_err(|error| CliError::file("write", &path, &error))
            }
            Output::File { mut temporary, target } => {
                let mut out = std::io::BufWriter::new(temporary.as_file_mut());
                let written = fill(&mut out).and_then(|()| out.flush());
                drop(out);
                let written = written.and_then(|()| temporary.as_file().sync_all());
                written.map_err(|error| CliError::file("write", &target, &error))?;
                temporary.persist(&target).map_err(|error| CliError::file("write", &target, &error.error))?;
                Ok(())
            }
        }
    }

    /// Is it standard output?
    pub fn is_stdout(&self) -> bool {
        matches!(self, Output::Stdout)
    }
}
