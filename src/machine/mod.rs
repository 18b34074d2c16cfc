//! Machine, tools, material, limits, stock and fixtures as validated plain data in mm, s, N, W, rad, rev/s. In: filled by [`crate::setup`] from
//! the setup file. Out: a [`Job`]: everything that later stages know beside the program.

pub mod curve;
pub mod limits;
pub mod material;
mod otherwise;
pub mod profile;
pub mod tool;
pub mod wear;

pub use curve::Table;
pub use limits::{LimitKind, Limits};
pub use material::Material;
pub use profile::{Profile, Segment, Slice};
pub use tool::{Runout, Shape, Tool};
pub use wear::{ToolWear, Wear, WearLaw, WearRate, fresh_index};

/// No part of a mill or its work is farther from a zero point than this, mm. The longest gantry mills travel some tens of metres, so a larger
/// number is a typing error or a wrong unit. Our judgement.
pub const MOST_MM: f64 = 1e5;

/// Text that loops and calls may execute beyond one pass, unless the setup says otherwise, bytes. 64 MB are 1.2 million blocks of 24 bytes, 1.5 s
/// of reading; `optimize` and the proof read a program five times, and an endless one is to be refused within 20 s on a busy machine.
pub const MAX_REPEATED_BYTES: u64 = 64 << 20;
/// Nesting of calls unless the setup says otherwise; controls allow 4 to 16.
pub const MAX_CALL_DEPTH: usize = 50;

use crate::path::Vec3;

/// What G41/G42 means on this machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compensation {
    /// The control offsets the programmed contour by the tool radius.
    Control,
    /// The path is already offset; the control adds the (small) wear value.
    Wear,
    /// As `Wear`, with the sign of the wear value reversed.
    InverseWear,
}

/// One linear axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Highest velocity, mm/s.
    pub velocity_mm_s: f64,
    /// Highest acceleration, mm/s².
    pub acceleration_mm_s2: f64,
    /// Highest jerk, mm/s³; `None` does not bind.
    pub jerk_mm_s3: Option<f64>,
}

/// Spindle: what it can give and what it takes.
#[derive(Debug, Clone, PartialEq)]
pub struct Spindle {
    /// Highest speed, rev/s.
    pub max_rps: f64,
    /// Power available at the motor shaft, W, against rev/s; `None` does not bind.
    pub power_w: Option<Table>,
    /// Torque available at the tool, N·mm, against rev/s; `None` does not bind.
    pub torque_nmm: Option<Table>,
    /// Power at the motor shaft with nothing cut, W, against rev/s.
    pub tare_w: Table,
    /// Motor shaft power / meter reading, against the reading in W.
    pub efficiency: Table,
    /// Time to run up, s.
    pub runup_time_s: f64,
}

impl Spindle {
    /// Declared tare at a speed over that at the reference; 1 where no tare is declared, 0 with the spindle at rest (below a fiftieth
    /// of the reference).
    pub fn tare_shape(&self, rps: f64, reference_rps: f64) -> f64 {
        let reference_w = self.tare_w.at(reference_rps);
        if rps < 0.02 * reference_rps {
            0.0
        } else if reference_w > 0.0 {
            self.tare_w.at(rps) / reference_w
        } else {
            1.0
        }
    }

    /// Reading of the power meter, W, at which the motor shaft has this power: m · efficiency(m) = `shaft_w`.
    pub fn meter_w(&self, shaft_w: f64) -> f64 {
        // Powers of a shaft rise with the reading, so repeated substitution settles.
        (0..METER_ROUNDS).fold(shaft_w, |reading_w, _| shaft_w / self.efficiency.at(reading_w))
    }
}

/// Rounds in which a reading is found from the power at the shaft; a curve that falls by a tenth from one reading to the next divides the error
/// by ten in each.
const METER_ROUNDS: usize = 20;

/// The machine and its control.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// Name of the dialect, when the setup gives one.
    pub dialect: Option<String>,
    /// Rapid speed along the path, mm/s.
    pub rapid_mm_s: f64,
    /// Path tolerance of the control at block junctions, mm.
    pub corner_tolerance_mm: f64,
    /// Shortest block the control digests, s.
    pub block_time_s: f64,
    /// Tool change, s.
    pub tool_change_time_s: f64,
    /// G28 position, mm, machine coordinates; `None`: a retract to nowhere near the stock.
    pub home_mm: Option<Vec3>,
    /// What G41/G42 means; `None`: not said.
    pub compensation: Option<Compensation>,
    /// Wear offsets by D number, mm, added to the radius.
    pub wear_mm: Vec<(u32, f64)>,
    /// Numbers of tools that are called by name.
    pub tool_names: Vec<(String, u32)>,
    /// Longest line the control reads, bytes.
    pub max_line_length: Option<usize>,
    /// How much loops and calls may execute beyond one pass through the text before a program counts as endless, bytes of text.
    pub max_repeated_bytes: u64,
    /// Deepest nesting of calls.
    pub max_call_depth: usize,
    /// X, Y, Z.
    pub axes: [Axis; 3],
    /// Spindle.
    pub spindle: Spindle,
    /// Origins of work offsets (54 for G54 …), mm, in one common frame.
    pub offsets: Vec<(u16, Vec3)>,
    /// What programs may leave to the control.
    pub unsaid: Unsaid,
}

/// What a program may leave to the control, as the setup tells it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Unsaid {
    /// Is a program without G20 and G21 in inches? `None`: not told.
    pub inch: Option<bool>,
    /// Speed of the spindle with a tool for which the program sets no S, rev/s.
    pub speeds_rps: Vec<(u32, f64)>,
}

/// Axis-parallel box, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Box3 {
    /// Lowest corner.
    pub min: Vec3,
    /// Highest corner.
    pub max: Vec3,
}

impl Box3 {
    /// The box grown by `by_mm` on every side.
    pub fn grown(&self, by_mm: f64) -> Self {
        let by = Vec3::repeat(by_mm);
        Self { min: self.min - by, max: self.max + by }
    }
}

/// Shape of the blank.
#[derive(Debug, Clone, PartialEq)]
pub enum StockShape {
    /// A box.
    Box(Box3),
    /// An upright cylinder.
    Cylinder {
        /// Centre in XY, mm.
        centre: [f64; 2],
        /// Diameter, mm.
        diameter_mm: f64,
        /// Lower and upper face, mm.
        z_mm: [f64; 2],
    },
    /// A closed triangle mesh in a file.
    Stl(std::path::PathBuf),
    /// In-process stock written by an earlier run.
    Saved(std::path::PathBuf),
}

/// One piece of stock.
#[derive(Debug, Clone, PartialEq)]
pub struct Stock {
    /// Its shape, in the coordinates of its work offset.
    pub shape: StockShape,
    /// Work offset it is clamped on (54 for G54 …); `None`: the one the program uses.
    pub offset: Option<u16>,
    /// How far it lies from where its shape and its offset put it, mm.
    pub moved_mm: Vec3,
    /// What it is made of.
    pub material: Material,
    /// It may stand proud of its shape by this much, mm.
    pub uncertainty_mm: f64,
}

/// Air feed, where nothing can be cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirFeed {
    /// Feed, mm/s.
    pub feed_mm_s: f64,
    /// Distance before the grown stock at which it ends, mm.
    pub approach_mm: f64,
}

/// How a selection of moves is treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mode {
    /// Feeds may go up and down.
    #[default]
    Optimise,
    /// Feeds may only go down.
    SlowOnly,
    /// Feeds stay as they are.
    Keep,
}

/// A ramp of feed at an entry, an exit or a change of direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp {
    /// Feed in it, mm/s.
    pub feed_mm_s: f64,
    /// Its length, mm.
    pub distance_mm: f64,
}

/// What may run faster than programmed where the limits allow it. `None`: inherited from the surrounding table of the setup, by default false.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Raise {
    /// The end face cuts straight down.
    pub plunges: Option<bool>,
    /// The end face cuts downwards along a ramp or a helix.
    pub ramps: Option<bool>,
    /// Lead-in, lead-out, first engagement of a cut.
    pub entries: Option<bool>,
    /// Finishing passes: they leave the final surface and take an allowance, no more than 0.5 mm or a tenth of the diameter.
    pub finishing: Option<bool>,
    /// Moves under G41 or G42.
    pub compensation: Option<bool>,
    /// Drilling and boring cycles.
    pub cycles: Option<bool>,
}

impl Raise {
    /// Everything may be raised.
    #[cfg(feature = "rooms")]
    pub const ALL: Raise = Raise {
        plunges: Some(true),
        ramps: Some(true),
        entries: Some(true),
        finishing: Some(true),
        compensation: Some(true),
        cycles: Some(true),
    };

    /// These, with those that `over` gives put in their place.
    #[must_use]
    pub fn overridden_by(self, over: Raise) -> Raise {
        Raise {
            plunges: over.plunges.or(self.plunges),
            ramps: over.ramps.or(self.ramps),
            entries: over.entries.or(self.entries),
            finishing: over.finishing.or(self.finishing),
            compensation: over.compensation.or(self.compensation),
            cycles: over.cycles.or(self.cycles),
        }
    }
}

/// What an operation is recognised by; all that are given must hold.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Match {
    /// Tool number.
    pub tool: Option<u32>,
    /// Text in the last comment before the move, compared without case.
    pub comment: Option<String>,
    /// First and last physical line.
    pub lines: Option<(u32, u32)>,
    /// Only moves that leave the finished surface.
    pub final_surface: bool,
}

/// One `[[operation]]` of the setup.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Operation {
    /// What it applies to.
    pub matches: Match,
    /// How the feeds are treated.
    pub mode: Mode,
    /// Ramp where the cutter enters material.
    pub entry: Option<Ramp>,
    /// Ramp where it leaves material.
    pub exit: Option<Ramp>,
    /// Ramp at changes of direction above the angle in rad.
    pub direction_change: Option<(f64, Ramp)>,
    /// Limits that replace those of the setup and of the tool.
    pub limits: Limits,
    /// What may be raised here.
    pub raise: Raise,
    /// Doubts that the setup vouches for here, by name.
    pub confirmed: Vec<&'static str>,
}

/// How the output is written.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputRules {
    /// Relative feed change worth an F word.
    pub minimum_change: f64,
    /// Output over input, in blocks and in bytes; `None`: the default, which leaves short programs more.
    pub max_growth: Option<f64>,
    /// Shortest piece a block may be split into, mm.
    pub minimum_length_mm: f64,
    /// May blocks be split at all?
    pub split: bool,
    /// How much is annotated.
    pub annotate: Annotate,
    /// Is the file marked as one whose feeds were changed, with the feeds that it had? Not where Feedwright planned it itself.
    pub marked: bool,
    /// Are feeds that are an expression or a variable replaced by numbers? Else they are kept.
    pub replace_computed_feeds: bool,
    /// Line ranges (first, last; 1-based) that keep their feeds. They are simulated and checked like all others: a load above its limit there is
    /// a fault in the verdict.
    pub exclude: Vec<(u32, u32)>,
}

/// Amount of annotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Annotate {
    /// Nothing is written but feeds.
    None,
    /// A comment where the feed changes.
    Changes,
    /// A comment on every block that cuts.
    Full,
}

/// A budget of wear over the whole program: wear per mm of cut is contact area times feed to a power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WearBudget {
    /// The power, between 0 and 2.
    pub exponent: f64,
    /// Most that may be used, as a share of what the program uses as programmed.
    pub most: f64,
}

/// The most that a program may use of the life of a tool whose law of wear is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LifeShare {
    /// The tool; `None`: every tool with a law.
    pub tool: Option<u32>,
    /// Share of the life from a fresh edge to the end of its index.
    pub share: f64,
}

/// Kind of a cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CutKind {
    /// The end face cuts downwards: a plunge, a ramp, a helix.
    Down,
    /// Takes an allowance and leaves the finished surface.
    Finishing,
    /// Any other.
    Roughing,
}

impl CutKind {
    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            CutKind::Down => "downwards",
            CutKind::Finishing => "finishing",
            CutKind::Roughing => "roughing",
        }
    }
}

/// What a move cuts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Kind.
    pub kind: CutKind,
    /// Largest axial depth from the rapid before it to the next one, mm; 0 in air.
    pub depth_mm: f64,
}

/// The cuts of one operation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scope {
    /// Tool number.
    pub tool: u32,
    /// First and last physical line.
    pub lines: (u32, u32),
    /// Kind of the cuts; `None`: any.
    pub kind: Option<CutKind>,
    /// Least and largest axial depth of the cuts, mm.
    pub depths_mm: [f64; 2],
}

/// Depths below this are compared as this, mm: the tool skims.
const SKIM_MM: f64 = 0.01;

impl Scope {
    /// Distance of a cut from this operation: whether the kind differs, and the logarithm of the ratio of its depth to the nearest depth here.
    /// `None` for another tool and other lines.
    pub fn distance(&self, tool: u32, line: u32, cut: Cut) -> Option<(bool, f64)> {
        let within = self.tool == tool && (self.lines.0..=self.lines.1).contains(&line);
        let [depth, least, largest] = [cut.depth_mm, self.depths_mm[0], self.depths_mm[1]].map(|d| d.max(SKIM_MM));
        let apart = (depth / depth.clamp(least, largest)).ln().abs();
        within.then_some((self.kind.is_some_and(|kind| kind != cut.kind), apart))
    }
}

/// Limits that come from the program itself (`--reference`), for one of its operations: the loads at the programmed feeds.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// Its cuts.
    pub scope: Scope,
    /// The limits; those of the setup stay where they are lower.
    pub limits: Limits,
}

/// Everything the core needs to know besides the program.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// Names of columns in the logs of the machine, theirs to ours.
    pub log_columns: Vec<(String, String)>,
    /// The machine.
    pub machine: Machine,
    /// The tools, by number.
    pub tools: Vec<Tool>,
    /// The pieces of stock.
    pub stocks: Vec<Stock>,
    /// Keep-out boxes.
    pub fixtures: Vec<Box3>,
    /// The setup says what clamps the part: by its keep-out boxes, or that nothing does beside the blank. Else air feed ends at the
    /// outline of the blank.
    pub fixtures_are_known: bool,
    /// Limits that hold everywhere.
    pub limits: Limits,
    /// What may be raised.
    pub raise: Raise,
    /// Doubts about part and frame that the setup vouches for, by name.
    pub confirmed: Vec<&'static str>,
    /// Air feed.
    pub air_feed: Option<AirFeed>,
    /// Budget of wear.
    pub wear: Option<WearBudget>,
    /// Shares of the lives of tools that the program may use; the last that speaks of a tool holds.
    pub life: Vec<LifeShare>,
    /// Confidence at which load limits hold against what is uncertain in the process model; `None`: at its best values.
    pub confidence: Option<f64>,
    /// Operations; the last that matches wins.
    pub operations: Vec<Operation>,
    /// Limits from the program itself, by operation.
    pub references: Vec<Reference>,
    /// Output settings.
    pub output: OutputRules,
    /// Whether bare lengths of the setup are inches: what is proposed for it is written in its units.
    pub inch: bool,
    /// Cell of the height field, mm; `None`: chosen from tools and stock.
    pub cell_mm: Option<f64>,
    /// Process model: the effects that act on top of the base coefficients, from `[process]` or `--model`.
    pub process: material::Process,
}

impl Job {
    /// The tool with this number.
    pub fn tool(&self, number: u32) -> Option<&Tool> {
        self.tools.iter().find(|tool| tool.number == number)
    }
    /// Coefficients that hold for this tool: its own, else those of the first stock.
    pub fn material(&self, tool: &Tool) -> Option<&Material> {
        self.tool_material(tool.number)
    }
    /// Index of wear of a fresh edge of this tool, and its unit; `None` where its force model has none.
    pub fn fresh_index(&self, tool: &Tool) -> Option<(f64, &'static str)> {
        let own = self.process.base.as_ref().or_else(|| self.material(tool).map(|material| &material.model));
        own.and_then(fresh_index)
    }
    fn tool_material(&self, number: u32) -> Option<&Material> {
        let own = self.tool(number).and_then(|tool| tool.coefficients.as_ref());
        own.or_else(|| self.stocks.first().map(|stock| &stock.material))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_meter_reads_what_the_drive_loses_beside_the_power_at_the_shaft() {
        let spindle = |points: Vec<[f64; 2]>| Spindle {
            max_rps: 200.0,
            power_w: None,
            torque_nmm: None,
            tare_w: Table::constant(0.0),
            efficiency: Table::new(points).unwrap(),
            runup_time_s: 1.0,
        };
        assert_eq!(spindle(vec![[0.0, 1.0]]).meter_w(800.0), 800.0);
        assert_eq!(spindle(vec![[0.0, 0.8]]).meter_w(800.0), 1000.0);
        // 0.75 of a reading of 1500 W.
        let light = spindle(vec![[0.0, 0.6], [2000.0, 0.8]]);
        assert!((light.meter_w(0.75 * 1500.0) - 1500.0).abs() < 1e-6);
    }

    /// Distance in depth of a cut from an operation whose cuts have these depths, mm.
    fn apart(depths_mm: [f64; 2], depth_mm: f64) -> Option<f64> {
        let scope = Scope { tool: 1, lines: (1, 9), kind: None, depths_mm };
        scope.distance(1, 5, Cut { kind: CutKind::Roughing, depth_mm }).map(|(_, apart)| apart)
    }

    /// A tool that skims has no depth to speak of: a micrometre and nine are the same, ten and eleven are not.
    #[test]
    fn depths_are_told_apart_only_above_a_skim() {
        let is = |found: Option<f64>, ratio: f64| found.is_some_and(|found| (found - ratio.ln()).abs() < 1e-12);
        assert!(is(apart([0.001, 0.002], 0.0099), 1.0) && is(apart([0.0099, 0.0099], 0.001), 1.0));
        assert!(is(apart([0.001, 0.002], 0.0101), 1.01) && is(apart([0.0101, 0.0101], 0.001), 1.01));
        // In air the depth is 0, and no logarithm runs away.
        assert!(is(apart([3.0, 4.0], 0.0), 300.0) && is(apart([0.0, 0.0], 3.0), 300.0));
    }
}
