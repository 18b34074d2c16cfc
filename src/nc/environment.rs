//! What an interpreter must know besides the program. In: a job. Out: [`Environment`]: offsets, tools, reference point, switches, subprogram
//! files, and how much may be executed.

use crate::machine::{Compensation, Job, MAX_CALL_DEPTH, MAX_REPEATED_BYTES, StockShape};
use crate::path::Vec3;

/// Reads the text of a subprogram by its name; `None`: there is none.
pub type Loader<'a> = &'a (dyn Fn(&str) -> Option<Vec<u8>> + Sync);

/// Surroundings of a program.
#[derive(Clone)]
pub struct Environment<'a> {
    /// Origins of work offsets (54 for G54 …), mm, machine coordinates; one that is missing is at zero.
    pub origins: Vec<(u16, Vec3)>,
    /// Reference point (G28), mm, machine coordinates; `None`: a retract to [`Environment::clear_z_mm`].
    pub home_mm: Option<Vec3>,
    /// Where the tool is at first, mm, work coordinates; `None`: nowhere near the stock, at [`Environment::clear_z_mm`].
    pub start_mm: Option<Vec3>,
    /// A height above everything that the tool could touch, mm.
    pub clear_z_mm: f64,
    /// Diameter of each tool, mm, by its number; used for a D word that names it.
    pub diameters_mm: Vec<(u32, f64)>,
    /// Wear of each offset, mm, by its D number: added to the radius where the path is already offset.
    pub wear_mm: Vec<(u32, f64)>,
    /// Numbers of the tools that are called by name.
    pub tool_names: Vec<(String, u32)>,
    /// The tool in the spindle before any is called: the only one of the setup.
    pub only_tool: Option<u32>,
    /// Speed of the spindle, rev/s, with each tool for which the program sets no S.
    pub speeds_rps: Vec<(u32, f64)>,
    /// What G41/G42 means; `None`: not said.
    pub compensation: Option<Compensation>,
    /// Names of the doubts that the setup confirms to be harmless: in the whole program, and in single operations.
    pub confirmed: [Vec<&'static str>; 2],
    /// Is every block-delete switch on?
    pub block_delete: bool,
    /// The block-delete switches that are on, by the bits of their numbers (1 to 9), where they are not all.
    pub switches_on: u16,
    /// Is the unit inch before the first G20/G21?
    pub inch: bool,
    /// Subprograms in other files.
    pub load: Loader<'a>,
    /// How much loops and calls may execute beyond one pass through the text before the program counts as endless: bytes of text, plus 32
    /// for each block.
    pub max_repeated_bytes: u64,
    /// Deepest nesting of calls.
    pub max_depth: usize,
}

fn no_files(_: &str) -> Option<Vec<u8>> {
    None
}

impl Default for Environment<'_> {
    /// A control just switched on: every offset, home and position at zero, metric, no files.
    fn default() -> Self {
        Self {
            origins: Vec::new(),
            home_mm: Some(Vec3::zeros()),
            start_mm: Some(Vec3::zeros()),
            clear_z_mm: 0.0,
            diameters_mm: Vec::new(),
            wear_mm: Vec::new(),
            tool_names: Vec::new(),
            only_tool: None,
            speeds_rps: Vec::new(),
            compensation: None,
            confirmed: [Vec::new(), Vec::new()],
            block_delete: false,
            switches_on: 0,
            inch: false,
            load: &no_files,
            max_repeated_bytes: MAX_REPEATED_BYTES,
            max_depth: MAX_CALL_DEPTH,
        }
    }
}

impl Environment<'_> {
    /// The environment that a setup describes. The tool starts at the reference point or, if none is given, well above the stock.
    pub fn from_job(job: &Job) -> Environment<'static> {
        let tops = job.stocks.iter().map(|stock| top(&stock.shape));
        let clear_z_mm = tops.chain(job.fixtures.iter().map(|fixture| fixture.max.z)).fold(0.0, f64::max) + 100.0;
        Environment {
            origins: job.machine.offsets.clone(),
            home_mm: job.machine.home_mm,
            start_mm: None,
            clear_z_mm,
            diameters_mm: job.tools.iter().map(|tool| (tool.number, tool.diameter_mm)).collect(),
            wear_mm: job.machine.wear_mm.clone(),
            tool_names: job.machine.tool_names.clone(),
            only_tool: if let [only] = job.tools.as_slice() { Some(only.number) } else { None },
            speeds_rps: job.machine.unsaid.speeds_rps.clone(),
            inch: job.machine.unsaid.inch.unwrap_or(false),
            compensation: job.machine.compensation,
            confirmed: [
                job.confirmed.clone(),
                job.operations.iter().flat_map(|operation| operation.confirmed.iter().copied()).collect(),
            ],
            max_repeated_bytes: job.machine.max_repeated_bytes,
            max_depth: job.machine.max_call_depth,
            ..Environment::default()
        }
    }

    /// Origin of a work offset, mm.
    pub fn origin(&self, wcs: u16) -> Vec3 {
        self.origins.iter().find(|(number, _)| *number == wcs).map_or_else(Vec3::zeros, |(_, origin)| *origin)
    }
    /// Diameter of a tool, mm.
    pub fn diameter_mm(&self, number: u32) -> Option<f64> {
        self.diameters_mm.iter().find(|(tool, _)| *tool == number).map(|(_, diameter)| *diameter)
    }
}

/// Upper face of a blank, mm; 0 for shapes that are in a file.
fn top(shape: &StockShape) -> f64 {
    match shape {
        StockShape::Box(bounds) => bounds.max.z,
        StockShape::Cylinder { z_mm, .. } => z_mm[0].max(z_mm[1]),
        StockShape::Stl(_) | StockShape::Saved(_) => 0.0,
    }
}
