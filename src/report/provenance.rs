//! What a written program came from and what was found of it, short enough to be filed. In: a run, the setup it was made with. Out:
//! [`Provenance`], part of the JSON report and of the sign-off page.

use schemars::JsonSchema;
use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::outcome::ProgramRun;
use crate::outcome::station_loads::Feeds;
use crate::units::mm_min_from_mm_s;

/// Where a program comes from.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Provenance {
    /// Version that wrote it.
    pub version: &'static str,
    /// SHA-256 of the original, in hexadecimal.
    pub original_sha256: String,
    /// SHA-256 of the setup file; `None` where there was none.
    pub setup_sha256: Option<String>,
    /// Options of the command line that decide feeds, in a fixed order; a model by its SHA-256.
    pub options: Vec<String>,
    /// SHA-256 of the written program; `None` for a simulation.
    pub output_sha256: Option<String>,
    /// The largest rise of a feed in a cut; `None` where none rises.
    pub largest_rise: Option<Rise>,
    /// Largest load over its limit under the variations of `--stress`; `None` where they were not asked for, or one of them cannot
    /// be simulated.
    pub stress_worst_ratio: Option<f64>,
}

/// A feed that rises.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Rise {
    /// Line of the original.
    pub line: u32,
    /// Feed as programmed, mm/min.
    pub feed_before: f64,
    /// Feed as written, mm/min.
    pub feed_after: f64,
}

impl Rise {
    /// After over before.
    pub fn ratio(&self) -> f64 {
        self.feed_after / self.feed_before
    }
}

/// Of a run with the bytes of its setup and the options that it was asked with.
pub fn provenance(run: &ProgramRun, setup: Option<&[u8]>, options: Vec<String>) -> Provenance {
    let stress = &run.answers.stress;
    let worst = stress.iter().map(|case| case.worst_ratio).try_fold(0.0, |worst: f64, case| case.map(|c| worst.max(c)));
    Provenance {
        version: env!("CARGO_PKG_VERSION"),
        original_sha256: sha256(run.program.own_text()),
        setup_sha256: setup.map(sha256),
        options,
        output_sha256: run.written.as_ref().map(|written| sha256(&written.bytes)),
        largest_rise: largest_rise(run),
        stress_worst_ratio: worst.filter(|_| !stress.is_empty()),
    }
}

/// SHA-256 in hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
}

/// The largest rise of a commanded feed where material is cut; the first of several that are alike.
pub fn largest_rise(run: &ProgramRun) -> Option<Rise> {
    let moves = run.toolpath.moves.len();
    let [before, after] = [Feeds::new(&run.before, moves), Feeds::new(run.after(), moves)];
    let mut found: Option<Rise> = None;
    for station in run.map.stations.iter().filter(|station| station.arc_count > 0) {
        let [feed_before, feed_after] = [before.highest(station), after.highest(station)].map(mm_min_from_mm_s);
        let rise = Rise { line: run.toolpath.moves[station.move_id.ix()].line, feed_before, feed_after };
        let more = rise.ratio() > found.map_or(1.0, |known| known.ratio()) * (1.0 + 1e-9);
        if feed_before > 0.0 && more {
            found = Some(rise);
        }
    }
    found
}
