//! Writing the outputs of a command. In: paths and contents. Out: all files, or none. Each file is opened in its target's folder before the long
//! work begins, so that a folder without permission is found early, and all get their names together at the end.
//!
//! An existing file is replaced only if Feedwright wrote it, if it is a copy of an input, or with `--force`; an input never is. A link
//! to a file stays, and the file it points to is replaced; a device or a pipe is written into. An input that was changed while the work
//! went on ends it: the outputs would belong to a text that is no more.

use std::cell::RefCell;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::SystemTime;

use super::error::CliError;
use super::screen;
use super::under_way::{Refusal, UnderWay, rename_all};
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
    /// Certificate of a written program.
    Certificate,
}

/// An output to be.
#[derive(Debug)]
pub struct Output {
    place: Place,
    set: Rc<RefCell<Vec<Ready>>>,
}

/// Where it goes.
#[derive(Debug)]
enum Place {
    Stdout,
    /// A device or a pipe.
    Device(PathBuf),
    /// A file in its folder, not yet under its name.
    File {
        under_way: UnderWay,
        target: PathBuf,
        kind: Kind,
        /// Was there a file of that name?
        replaces: bool,
    },
}

/// What is complete and waits for the rest.
#[derive(Debug)]
struct Ready {
    place: Place,
    /// What goes to standard output or a device.
    bytes: Vec<u8>,
}

/// A file that must stay as it is, and how it was when the work began.
#[derive(Debug)]
struct Input {
    path: PathBuf,
    stamp: Option<(u64, Option<SystemTime>)>,
}

/// Outputs of one command: no two may be the same file, none may be an input.
#[derive(Debug, Default)]
pub struct Outputs {
    taken: Vec<PathBuf>,
    inputs: Vec<Input>,
    force: bool,
    stdout: bool,
    set: Rc<RefCell<Vec<Ready>>>,
}

impl Outputs {
    /// With the inputs that must stay as they are.
    pub fn new(inputs: impl IntoIterator<Item = PathBuf>, force: bool) -> Self {
        let mut outputs = Self { force, ..Self::default() };
        inputs.into_iter().for_each(|path| outputs.keep(&path));
        outputs
    }

    /// Adds a file that must stay as it is.
    pub fn keep(&mut self, path: &Path) {
        let Ok(path) = path.canonicalize() else { return };
        let stamp = stamp(&path);
        self.inputs.push(Input { path, stamp });
    }

    /// Makes ready to write `path`; `-` is standard output.
    pub fn open(&mut self, path: &Path, kind: Kind) -> Result<Output, CliError> {
        if path == Path::new("-") {
            if std::mem::replace(&mut self.stdout, true) {
                return Err(CliError::new("two outputs go to standard output", "give one of them a file"));
            }
            return Ok(self.output(Place::Stdout));
        }
        if path.is_dir() {
            return Err(CliError::new(format!("{} is a folder", path.display()), "give the name of a file in it"));
        }
        let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        if target.is_symlink() {
            return Err(CliError::new(
                format!("{} is a link to a file that does not exist", path.display()),
                "give the name of the file itself",
            ));
        }
        let replaces = target.exists();
        if replaces {
            if !target.is_file() {
                return Ok(self.output(Place::Device(target)));
            }
            self.may_replace(path, &target, kind)?;
        }
        let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let own =
            folder.canonicalize().unwrap_or_else(|_| folder.to_owned()).join(target.file_name().unwrap_or_default());
        if self.taken.contains(&own) {
            return Err(CliError::new(format!("{} is written twice", path.display()), "give each output its own name"));
        }
        let under_way = UnderWay::begin(folder, &target).map_err(|refusal| refused(path, &refusal))?;
        self.taken.push(own);
        Ok(self.output(Place::File { under_way, target, kind, replaces }))
    }

    /// Makes ready to write over a file that was read and comes back with more in it.
    pub fn open_over(&mut self, path: &Path, kind: Kind) -> Result<Output, CliError> {
        let force = std::mem::replace(&mut self.force, true);
        let output = self.open(path, kind);
        self.force = force;
        output
    }

    fn output(&self, place: Place) -> Output {
        Output { place, set: Rc::clone(&self.set) }
    }

    /// Gives everything that was written its name: all or none.
    pub fn commit(self) -> Result<(), CliError> {
        self.unchanged()?;
        let ready = self.set.take();
        let mut files = Vec::new();
        for Ready { place, bytes } in ready {
            match place {
                Place::Stdout => screen::put(&bytes)?,
                Place::Device(path) => put_into(&path, &bytes)?,
                Place::File { under_way, target, kind, replaces } => {
                    if !replaces && target.exists() {
                        self.may_replace(&target, &target, kind)?;
                    }
                    files.push((under_way, target));
                }
            }
        }
        // A reader of a pipe may have kept it waiting.
        self.unchanged()?;
        let (under_way, targets): (Vec<_>, Vec<_>) = files.into_iter().unzip();
        let named = under_way.into_iter().zip(targets.iter().map(PathBuf::as_path)).collect();
        rename_all(named).map_err(|(k, error)| CliError::file("write", &targets[k], &error))
    }

    /// Are the inputs as they were when the work began?
    fn unchanged(&self) -> Result<(), CliError> {
        let changed = self.inputs.iter().find(|input| stamp(&input.path) != input.stamp);
        changed.map_or(Ok(()), |input| {
            Err(CliError::new(
                format!("{} was changed while Feedwright worked on it", input.path.display()),
                "nothing was written; run it again",
            ))
        })
    }

    fn may_replace(&self, path: &Path, target: &Path, kind: Kind) -> Result<(), CliError> {
        if self.inputs.iter().any(|input| input.path == target || same_file(&input.path, target)) {
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
        let inputs = || self.inputs.iter().filter(|input| input.stamp.is_some());
        let copy = || inputs().any(|input| std::fs::read(&input.path).is_ok_and(|known| known == bytes));
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

/// Length and time of the last change; `None` for what is no file (a pipe, a device), which cannot be read twice.
fn stamp(path: &Path) -> Option<(u64, Option<SystemTime>)> {
    let data = path.metadata().ok().filter(std::fs::Metadata::is_file)?;
    Some((data.len(), data.modified().ok()))
}

/// Into a device or a pipe; that nobody reads on is no fault.
fn put_into(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    let written = std::fs::OpenOptions::new().write(true).open(path).and_then(|mut file| file.write_all(bytes));
    match written {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(CliError::file("write", path, &error)),
        _ => Ok(()),
    }
}

fn refused(path: &Path, refusal: &Refusal) -> CliError {
    match refusal {
        Refusal::Busy => CliError::new(
            format!("another Feedwright is writing {}", path.display()),
            "wait until it is done, or give the output another name",
        ),
        Refusal::Io(error) => CliError::file("write", path, error),
    }
}

/// Does a file carry our mark?
fn is_ours(bytes: &[u8], kind: Kind) -> bool {
    // The mark stands at the head of most files, and behind the other keys of a report in JSON.
    let (head, tail) = (&bytes[..bytes.len().min(4096)], &bytes[bytes.len().saturating_sub(4096)..]);
    let holds = |mark: &str| [head, tail].iter().any(|part| memchr::memmem::find(part, mark.as_bytes()).is_some());
    match kind {
        Kind::Program => {
            holds(crate::finish::stepover::text::MARK)
                || holds(crate::finish::semifinish::proof::MARK)
                || crate::rewrite::is_ours(&crate::nc::parse(bytes.to_vec(), None))
        }
        Kind::Json => holds(&format!("\"{}\"", crate::report::WRITTEN_BY)),
        Kind::Csv => holds(crate::report::CSV_HEAD),
        Kind::Markup => holds(crate::report::MARK),
        Kind::ToolState => bytes.starts_with(crate::setup::STATE_MARK.as_bytes()),
        Kind::Checks => bytes.starts_with(crate::report::life::CHECKS_HEAD.as_bytes()),
        Kind::Certificate => bytes.starts_with(crate::certify::text::HEAD.as_bytes()),
        Kind::Cache => bytes.starts_with(crate::engage::cache::FAMILY),
        Kind::Setup => false,
        Kind::Stock => bytes.starts_with(saved::FAMILY) || bytes.starts_with(saved::MESH_MARK),
    }
}

impl Output {
    /// The bytes it shall have; it gets its name with all others, by [`Outputs::commit`].
    pub fn write(self, bytes: &[u8]) -> Result<(), CliError> {
        self.write_with(|out| out.write_all(bytes))
    }

    /// What `fill` writes; it gets its name with all others, by [`Outputs::commit`].
    pub fn write_with(self, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), CliError> {
        let Self { mut place, set } = self;
        let mut bytes = Vec::new();
        match &mut place {
            Place::Stdout => fill(&mut bytes)?,
            Place::Device(path) => fill(&mut bytes).map_err(|error| CliError::file("write", path, &error))?,
            Place::File { under_way, target, .. } => {
                let mut out = io::BufWriter::new(&mut under_way.file);
                let written = fill(&mut out).and_then(|()| out.flush());
                drop(out);
                let written = written.and_then(|()| under_way.file.sync_all());
                written.map_err(|error| CliError::file("write", target, &error))?;
            }
        }
        set.borrow_mut().push(Ready { place, bytes });
        Ok(())
    }

    /// The file that it would replace.
    pub fn existing(&self) -> Option<&Path> {
        match &self.place {
            Place::File { target, replaces: true, .. } => Some(target),
            _ => None,
        }
    }

    /// Is it standard output?
    pub fn is_stdout(&self) -> bool {
        matches!(self.place, Place::Stdout)
    }
}
