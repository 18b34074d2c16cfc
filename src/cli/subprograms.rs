//! Files of subprograms, written again beside the output under their own names. In: the files as rewritten. Out: the same
//! number of files in the output's folder, whether their feeds changed or not, so that the output finds all of them.
//!
//! Where the output lies beside the originals, or goes to standard output, they are left alone and so are their feeds.

use std::path::{Path, PathBuf};

use super::error::CliError;
use super::input::Source;
use super::output::{Kind, Outputs};

/// The folder of the output, if subprograms may be written into it.
pub fn folder(target: &Path, source: &Source) -> Option<PathBuf> {
    let folder = |path: &Path| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        folder.canonicalize().ok()
    };
    let (own, other) = (folder(source.path.as_ref()?)?, folder(target)?);
    (target != Path::new("-") && own != other && other.is_dir()).then_some(other)
}

/// Adds the files to the outputs; those that are there already as they shall be stay. Returns what will be written.
pub fn write(
    files: &[(String, Vec<u8>)],
    folder: &Path,
    source: &Source,
    outputs: &mut Outputs,
) -> Result<Vec<PathBuf>, CliError> {
    let originals = source.path.as_deref().and_then(Path::parent).unwrap_or(Path::new("."));
    for (name, _) in files {
        outputs.keep(&originals.join(name));
    }
    let mut ready = Vec::new();
    for (name, bytes) in files {
        let path = folder.join(name);
        if std::fs::read(&path).is_ok_and(|there| there == *bytes) {
            continue;
        }
        ready.push((outputs.open(&path, Kind::Program)?, bytes, path));
    }
    let mut written = Vec::new();
    for (output, bytes, path) in ready {
        output.write(bytes)?;
        written.push(path);
    }
    Ok(written)
}
