//! Outcomes kept on disk while a run goes on, one line each, so that a run that was stopped goes on where it was. In and
//! out: a file named by the bytes of the benchmark itself: another build begins anew.

use super::score::Outcome;
use sha2::{Digest, Sha256};
use std::io::Write;
use std::path::PathBuf;
use std::sync::Mutex;

/// The file of this build, and what it held.
pub struct Kept {
    file: Mutex<std::fs::File>,
    outcomes: Vec<Outcome>,
}

impl Kept {
    /// Opens the file of this build.
    pub fn open() -> Self {
        let own = std::env::current_exe().and_then(std::fs::read).expect("the benchmark reads itself");
        let name: String = Sha256::digest(own).iter().take(8).map(|b| format!("{b:02x}")).collect();
        let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("confusion-{name}.tsv"));
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        let file =
            std::fs::OpenOptions::new().create(true).append(true).open(path).expect("the file of outcomes opens");
        Self { file: Mutex::new(file), outcomes: text.lines().filter_map(Outcome::from_line).collect() }
    }

    /// Outcome of a case that was judged before.
    pub fn known(&self, row: &str, seed: u64, noise: f64) -> Option<Outcome> {
        self.outcomes.iter().find(|o| o.row == row && o.seed == seed && o.noise == noise).cloned()
    }

    /// Adds one.
    pub fn keep(&self, outcome: &Outcome) {
        let mut file = self.file.lock().expect("nobody panicked while writing");
        writeln!(file, "{}", outcome.to_line()).expect("an outcome is written");
    }
}
