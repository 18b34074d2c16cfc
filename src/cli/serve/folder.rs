//! The folder that is served: its programs and setups, and programs that were dropped on the page. In: names. Out: bytes of files of
//! that folder, and of no other. Nothing is written into it: what is dropped stays in memory and is gone with the process.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::cli::batch::is_program;
use crate::cli::error::CliError;

/// Largest program that can be dropped, bytes: a million blocks have some 40 MB.
pub const MOST_DROPPED: usize = 64 << 20;
/// All dropped programs together, bytes.
const MOST_TOGETHER: usize = 4 * MOST_DROPPED;
/// Ending of setups.
const SETUP: &str = ".setup.toml";

/// A program that was dropped.
type Dropped = (String, Arc<Vec<u8>>);

/// The folder.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    dropped: Mutex<Vec<Dropped>>,
}

impl Folder {
    /// A folder that is there.
    pub fn open(path: &Path) -> Result<Self, CliError> {
        let path = path.canonicalize().map_err(|error| CliError::file("read", path, &error))?;
        if !path.is_dir() {
            return Err(CliError::new(
                format!("{} is not a folder", path.display()),
                "give the folder of the programs",
            ));
        }
        Ok(Self { path, dropped: Mutex::default() })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The same for people.
    pub fn shown(&self) -> String {
        as_people_write_it(&self.path.display().to_string())
    }

    fn dropped(&self) -> MutexGuard<'_, Vec<Dropped>> {
        self.dropped.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A file of the folder itself: no folder, nothing that a link or a name leads to elsewhere.
    pub fn file(&self, name: &str) -> Option<PathBuf> {
        let path = is_plain(name).then(|| self.path.join(name))?.canonicalize().ok()?;
        (path.parent() == Some(&self.path) && path.is_file()).then_some(path)
    }

    /// Names of the files that `wanted` takes, in order.
    fn names(&self, wanted: impl Fn(&str) -> bool) -> Vec<String> {
        let entries = std::fs::read_dir(&self.path).into_iter().flatten().flatten();
        let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
        let mut names: Vec<String> = names.filter(|name| wanted(name) && self.file(name).is_some()).collect();
        names.sort();
        names
    }

    /// Programs: those of the folder that Feedwright did not write, then those that were dropped.
    pub fn programs(&self) -> [Vec<String>; 2] {
        let is_own = |name: &str| name.contains(".fw.");
        [
            self.names(|name| is_program(Path::new(name)) && !is_own(name)),
            self.dropped().iter().map(|(name, _)| name.clone()).collect(),
        ]
    }

    /// Setups.
    pub fn setups(&self) -> Vec<String> {
        self.names(|name| name.ends_with(SETUP))
    }

    /// Bytes of a program that was dropped.
    pub fn dropped_program(&self, name: &str) -> Option<Arc<Vec<u8>>> {
        self.dropped().iter().find(|(known, _)| known == name).map(|(_, bytes)| Arc::clone(bytes))
    }

    /// Keeps a program that was dropped; returns its name. Where there is one of that name already, in the folder or dropped before,
    /// it gets a number: `part-2.nc`.
    pub fn keep(&self, name: &str, bytes: Vec<u8>) -> Result<String, CliError> {
        if !is_plain(name) || !is_program(Path::new(name)) {
            return Err(CliError::new(format!("{name} is no name of a program"), "drop one NC program, like part.nc"));
        }
        let mut dropped = self.dropped();
        let together: usize = dropped.iter().map(|(_, known)| known.len()).sum();
        if together + bytes.len() > MOST_TOGETHER {
            return Err(CliError::new(
                format!("more than {} MiB of programs were dropped", MOST_TOGETHER >> 20),
                "put the program into the folder, or start feedwright serve anew",
            ));
        }
        let is_free = |name: &String| !dropped.iter().any(|(known, _)| known == name) && !self.path.join(name).exists();
        let name = names(name).find(is_free).unwrap_or_else(|| name.to_owned());
        dropped.push((name.clone(), Arc::new(bytes)));
        Ok(name)
    }
}

/// `part.nc`, `part-2.nc`, `part-3.nc` and so on.
fn names(name: &str) -> impl Iterator<Item = String> {
    let (stem, ending) = name.rsplit_once('.').map_or((name, String::new()), |(stem, end)| (stem, format!(".{end}")));
    std::iter::once(name.to_owned()).chain((2..).map(move |k| format!("{stem}-{k}{ending}")))
}

/// A name of a file, and no way to another folder, a device or a hidden file, on any system.
fn is_plain(name: &str) -> bool {
    let bad = |c: char| c.is_control() || "/\\:*?\"<>|".contains(c);
    (1..=200).contains(&name.len()) && !name.starts_with('.') && !name.ends_with(['.', ' ']) && !name.contains(bad)
}

/// A path without what Windows puts before one that was resolved: `\\?\C:\parts`, `\\?\UNC\server\parts`.
fn as_people_write_it(path: &str) -> String {
    match (path.strip_prefix(r"\\?\UNC\"), path.strip_prefix(r"\\?\")) {
        (Some(share), _) => format!(r"\\{share}"),
        (None, Some(local)) => local.to_owned(),
        (None, None) => path.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resolved_paths_are_shown_as_people_write_them() {
        for (resolved, shown) in [
            (r"\\?\C:\my parts", r"C:\my parts"),
            (r"\\?\UNC\shop\parts", r"\\shop\parts"),
            (r"\\shop\parts", r"\\shop\parts"),
            ("/home/parts", "/home/parts"),
        ] {
            assert_eq!(as_people_write_it(resolved), shown);
        }
    }
    use std::fs;

    #[test]
    fn only_files_of_the_folder_are_found() {
        let dir = tempfile::tempdir().unwrap();
        let inner = dir.path().join("jobs");
        fs::create_dir_all(inner.join("deep")).unwrap();
        for file in ["secret.nc", "jobs/part.nc", "jobs/part.setup.toml", "jobs/.hidden", "jobs/deep/other.nc"] {
            fs::write(dir.path().join(file), "G0 X1\n").unwrap();
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink(dir.path().join("secret.nc"), inner.join("link.nc")).unwrap();
        let folder = Folder::open(&inner).unwrap();
        assert_eq!(folder.programs()[0], ["part.nc"]);
        assert_eq!(folder.setups(), ["part.setup.toml"]);
        assert!(folder.file("part.nc").is_some());
        for name in [
            "../secret.nc",
            "..",
            ".",
            "",
            "deep",
            "deep/other.nc",
            ".hidden",
            "link.nc",
            "none.nc",
            "/etc/passwd",
            "..\\secret.nc",
        ] {
            assert_eq!(folder.file(name), None, "{name}");
        }
    }

    #[test]
    fn what_is_dropped_overwrites_nothing_and_touches_no_disk() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("part.nc"), "G0 X1\n").unwrap();
        let folder = Folder::open(dir.path()).unwrap();
        assert_eq!(folder.keep("part.nc", b"G0 X2\n".to_vec()).unwrap(), "part-2.nc");
        assert_eq!(folder.keep("part.nc", b"G0 X3\n".to_vec()).unwrap(), "part-3.nc");
        assert_eq!(folder.keep("new", b"G0 X4\n".to_vec()).unwrap(), "new");
        assert_eq!(folder.keep("new", b"G0 X5\n".to_vec()).unwrap(), "new-2");
        assert_eq!(**folder.dropped_program("new").unwrap(), *b"G0 X4\n");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
        assert_eq!(fs::read(dir.path().join("part.nc")).unwrap(), b"G0 X1\n");
        for name in ["", "a/b.nc", "..", ".nc", "a\n.nc", "part.setup.toml", "C:x.nc"] {
            assert!(folder.keep(name, Vec::new()).is_err(), "{name:?}");
        }
    }

    #[test]
    fn what_can_be_dropped_has_a_bound() {
        let dir = tempfile::tempdir().unwrap();
        let folder = Folder::open(dir.path()).unwrap();
        for k in 0..4 {
            folder.keep(&format!("{k}.nc"), vec![b' '; MOST_DROPPED]).unwrap();
        }
        assert!(folder.keep("one.nc", vec![b' ']).is_err());
        assert!(folder.keep("none.nc", vec![]).is_ok());
    }
}
