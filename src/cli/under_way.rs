//! A file under way: its bytes grow in a temporary file in the target's folder, which is gone on every way out but the last, where
//! it gets the target's name. In: the target. Out: a file that only this process writes.
//!
//! The temporary's name follows from the target's, and the process holds a lock on it (the operating system takes the lock away when
//! a process dies, however it dies). So a second Feedwright on the same output is told from what a dead one left: the first is
//! locked, the other is litter, and whoever next writes into the folder sweeps it. Ctrl-C and SIGTERM remove what is under way.

use fs4::{FileExt, TryLockError};
use sha2::{Digest, Sha256};
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What the names of our temporaries begin with; sixteen hexadecimal digits follow.
const PREFIX: &str = ".feedwright-";

/// How often the place of a temporary is tried for: more than once only where another process sweeps in the same instant.
const TRIES: usize = 16;

/// Exit code after Ctrl-C or SIGTERM: 128 + 2, as shells give it.
const INTERRUPTED: i32 = 130;

/// Temporaries of this process. Whoever holds it is renaming or removing; nobody else does meanwhile.
static LIVE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A file under way.
#[derive(Debug)]
pub struct UnderWay {
    /// The temporary, open for writing and locked.
    pub file: File,
    path: PathBuf,
}

/// Why a file cannot be begun.
#[derive(Debug)]
pub enum Refusal {
    /// Another process is writing the same file.
    Busy,
    /// The folder cannot be written.
    Io(io::Error),
}

impl From<io::Error> for Refusal {
    fn from(error: io::Error) -> Self {
        Refusal::Io(error)
    }
}

/// From now on Ctrl-C, SIGTERM and SIGHUP remove what is under way and end the process.
pub fn clean_up_on_signals() {
    // Without a handler (a second one in the same process) the next run sweeps.
    let _ = ctrlc::set_handler(|| end(INTERRUPTED, || {}));
}

/// Ends the process from another thread: nothing that is under way stays.
pub fn end(code: i32, say: impl FnOnce()) -> ! {
    // Held to the end: nothing gets its name any more.
    let live = live();
    live.iter().for_each(|path| drop(fs::remove_file(path)));
    say();
    std::process::exit(code)
}

fn live() -> MutexGuard<'static, Vec<PathBuf>> {
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

impl UnderWay {
    /// Begins a file that shall be named `target`; sweeps its folder of what dead processes left.
    pub fn begin(folder: &Path, target: &Path) -> Result<Self, Refusal> {
        sweep(folder);
        let path = folder.join(name(target));
        for _ in 0..TRIES {
            match create(&path)? {
                Some(file) => return Ok(Self { file, path }),
                None if is_left(&path) => remove_left(&path),
                None => return Err(Refusal::Busy),
            }
        }
        Err(Refusal::Busy)
    }
}

impl Drop for UnderWay {
    fn drop(&mut self) {
        let mut live = live();
        let Some(place) = live.iter().position(|path| *path == self.path) else { return };
        live.swap_remove(place);
        // Where it cannot be removed the next run sweeps.
        let _ = fs::remove_file(&self.path);
    }
}

/// Gives all files their names, or none: where one cannot be renamed, those of them that are new are removed again. A signal waits
/// until all have their names. The error comes with the place of the file that could not be renamed.
pub fn rename_all(files: Vec<(UnderWay, &Path)>) -> Result<(), (usize, io::Error)> {
    let mut live = live();
    let mut new = Vec::new();
    let mut failed = None;
    for (k, (file, target)) in files.iter().enumerate() {
        let is_new = !target.exists();
        if let Err(error) = fs::rename(&file.path, target) {
            failed = Some((k, error));
            break;
        }
        live.retain(|path| *path != file.path);
        if is_new {
            new.push(*target);
        }
    }
    if failed.is_some() {
        for target in new {
            let _ = fs::remove_file(target);
        }
    }
    drop(live);
    drop(files);
    failed.map_or(Ok(()), Err)
}

/// The temporary's name: a digest, so that it is short and plain whatever the target is named.
fn name(target: &Path) -> String {
    let name = target.file_name().unwrap_or_default();
    let digest = Sha256::digest(name.as_encoded_bytes());
    digest[..8].iter().fold(PREFIX.to_owned(), |text, byte| text + &format!("{byte:02x}"))
}

fn is_ours(name: &str) -> bool {
    let digits = name.strip_prefix(PREFIX);
    digits.is_some_and(|digits| digits.len() == 16 && digits.bytes().all(|byte| byte.is_ascii_hexdigit()))
}

/// A new file, locked; `None` where there is one.
fn create(path: &Path) -> io::Result<Option<File>> {
    let mut live = live();
    let file = match OpenOptions::new().write(true).read(true).create_new(true).open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => return Ok(None),
        Err(error) => return Err(error),
    };
    live.push(path.to_owned());
    match FileExt::try_lock(&file) {
        // Another process swept it between the two steps.
        Err(TryLockError::WouldBlock) => {}
        Ok(()) if !is_at(&file, path) => {}
        // A folder without locks (some network drives) is written all the same.
        Ok(()) | Err(TryLockError::Error(_)) => return Ok(Some(file)),
    }
    live.retain(|other| other != path);
    Ok(None)
}

/// Is this a temporary that no living process holds?
fn is_left(path: &Path) -> bool {
    let is_file = fs::symlink_metadata(path).is_ok_and(|data| data.is_file());
    // What has gone in the meantime is out of the way as well.
    let Ok(file) = File::open(path) else { return !path.exists() };
    is_file && FileExt::try_lock(&file).is_ok()
}

fn remove_left(path: &Path) {
    let Ok(file) = File::open(path) else { return };
    // Locked here, it can be no other's: another process would have to lock it before it counts as its own.
    if FileExt::try_lock(&file).is_ok() && is_at(&file, path) {
        let _ = fs::remove_file(path);
    }
}

/// Removes what dead processes left in a folder. A file that is locked, or that is not named as ours are, stays.
fn sweep(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        if is_ours(&entry.file_name().to_string_lossy()) && is_left(&entry.path()) {
            remove_left(&entry.path());
        }
    }
}

/// Is the open file still the one of that name?
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let (Ok(open), Ok(named)) = (file.metadata(), fs::symlink_metadata(path)) else { return false };
    (open.dev(), open.ino()) == (named.dev(), named.ino())
}

#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.is_file()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("feedwright-under-way-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn a_dropped_file_leaves_nothing_and_a_second_one_is_refused() {
        let folder = folder("drop");
        let target = folder.join("part.fw.nc");
        let first = UnderWay::begin(&folder, &target).unwrap();
        assert!(matches!(UnderWay::begin(&folder, &target), Err(Refusal::Busy)));
        drop(first);
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
        drop(UnderWay::begin(&folder, &target).unwrap());
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn what_a_dead_process_left_is_swept_and_nothing_else() {
        let folder = folder("sweep");
        let foreign = [".feedwright-notes", ".feedwright-0123456789abcdeg", "feedwright-0123456789abcdef"];
        for file in foreign.iter().chain(&[".feedwright-0123456789abcdef"]) {
            fs::write(folder.join(file), "x").unwrap();
        }
        let living = UnderWay::begin(&folder, Path::new("other.nc")).unwrap();
        let own = UnderWay::begin(&folder, Path::new("part.nc")).unwrap();
        assert!(living.path.exists() && own.path.exists());
        assert!(!folder.join(".feedwright-0123456789abcdef").exists());
        assert!(foreign.iter().all(|file| folder.join(file).exists()));
        drop((living, own));
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn where_one_cannot_be_renamed_the_new_ones_go() {
        let folder = folder("rename");
        let targets = [folder.join("a"), folder.join("no-folder/b")];
        let files =
            targets.iter().map(|target| (UnderWay::begin(&folder, target).unwrap(), target.as_path())).collect();
        assert_eq!(rename_all(files).unwrap_err().0, 1);
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
        fs::remove_dir_all(folder).unwrap();
    }
}
