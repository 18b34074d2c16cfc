//! Files of a simulation beside the reports: the engagement map (`--cache`) and the stock that the program leaves (`--save-stock`). In: the
//! options. Out: the hooks that the pipeline calls, and the files at the end.
//!
//! The cache lies next to the program, `part.nc` → `part.fwcache`. One that is stale or damaged is said and replaced.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use super::error::CliError;
use super::input::Source;
use super::output::{Kind, Output, Outputs};
use super::screen::Screen;
use super::work::Work;
use crate::engage::EngagementMap;
use crate::engage::cache::{Key, Unusable, from_bytes, to_bytes};
use crate::job::Keep;
use crate::path::Vec3;
use crate::report::Relief;
use crate::stock::{Piece, saved};

/// Files to be, and what the pipeline has handed over for them.
pub struct StoredFiles {
    cache: Option<PathBuf>,
    stock: Option<Stock>,
    /// The page shows the stock; a simulation that is not made again leaves none, and the page says so.
    shows: bool,
    bytes: RefCell<Option<Vec<u8>>>,
    pieces: RefCell<Vec<(Piece, Vec3)>>,
    screen: Screen,
}

/// Where the stock goes.
struct Stock {
    path: PathBuf,
    mesh: bool,
    output: Output,
}

impl StoredFiles {
    /// From the options; the stock's file is made ready at once.
    pub fn open(command: &Work, source: &Source, outputs: &mut Outputs, screen: Screen) -> Result<Self, CliError> {
        let cache = match (&source.path, command.cache) {
            (_, false) => None,
            (Some(path), true) => Some(path.with_extension("fwcache")),
            (None, true) => {
                return Err(CliError::new(
                    "--cache has no place to go: the program comes from standard input",
                    "give the program as a file, or leave --cache out",
                ));
            }
        };
        let stock = command.save_stock.as_deref().map(|path| stock(path, outputs)).transpose()?;
        let shows = command.report.is_some();
        Ok(Self { cache, stock, shows, bytes: RefCell::default(), pieces: RefCell::default(), screen })
    }

    /// Runs `work` with the hooks.
    pub fn with<T>(&self, work: impl FnOnce(Keep) -> T) -> T {
        let recall = |key: &Key| self.recall(key);
        let remember = |key: &Key, map: &EngagementMap| {
            self.bytes.replace(Some(to_bytes(map, key)));
        };
        let stock = |pieces: Vec<(Piece, Vec3)>| {
            self.pieces.replace(pieces);
        };
        let cached = self.cache.is_some();
        work(Keep {
            recall: if cached { Some(&recall) } else { None },
            remember: if cached { Some(&remember) } else { None },
            stock: if self.stock.is_some() || self.shows { Some(&stock) } else { None },
        })
    }

    fn recall(&self, key: &Key) -> Option<EngagementMap> {
        // A simulation that is not made again leaves no stock.
        let path = self.cache.as_ref().filter(|_| self.stock.is_none())?;
        let bytes = std::fs::read(path).ok()?;
        let found = from_bytes(&bytes, key);
        let name = path.display();
        self.screen.say(&match &found {
            Ok(_) => format!("cache     {name}: nothing was simulated again"),
            Err(Unusable::Stale) => {
                format!("cache     {name} was made for other moves, tools, stock or resolution: simulated anew")
            }
            Err(Unusable::Damaged) => format!("cache     {name} is damaged or of another version: simulated anew"),
        });
        found.ok()
    }

    /// The stock as a page shows it.
    pub fn reliefs(&self) -> Vec<Relief> {
        self.pieces.borrow().iter().map(|(piece, _)| Relief::of(&piece.field)).collect()
    }

    /// Adds what was handed over to the outputs.
    pub fn write(self, outputs: &mut Outputs) -> Result<(), CliError> {
        if let (Some(path), Some(bytes)) = (&self.cache, self.bytes.take()) {
            outputs.open(path, Kind::Cache)?.write(&bytes)?;
        }
        let Some(Stock { path, mesh, output }) = self.stock else { return Ok(()) };
        let pieces = self.pieces.take();
        let bytes = |(piece, shift): &(Piece, Vec3)| {
            if mesh { saved::to_stl(&piece.field, *shift) } else { saved::to_bytes(piece, *shift) }
        };
        let mut output = Some(output);
        for (k, piece) in pieces.iter().enumerate() {
            let name = if k == 0 { path.clone() } else { numbered(&path, k + 1) };
            let output = match output.take() {
                Some(output) => output,
                None => outputs.open(&name, Kind::Stock)?,
            };
            output.write(&bytes(piece))?;
            self.screen.say(&format!("stock     {} as the program leaves it", name.display()));
        }
        Ok(())
    }
}

fn stock(path: &Path, outputs: &mut Outputs) -> Result<Stock, CliError> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let mesh = match ending.as_str() {
        "stl" => true,
        "stock" => false,
        _ => {
            return Err(CliError::new(
                format!("{}: the stock is written as .stock or as .stl", path.display()),
                "end the name with .stock for the next program, with .stl for other software",
            ));
        }
    };
    Ok(Stock { path: path.to_owned(), mesh, output: outputs.open(path, Kind::Stock)? })
}

/// `op10.stock` → `op10-2.stock` for the second piece of stock.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-{number}.{ending}"))
}
