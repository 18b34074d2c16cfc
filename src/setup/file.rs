//! The setup file as written: one field per key, nothing filled in, nothing converted. In: TOML. Out: these structures,
//! and (through their doc comments) the JSON Schema.

use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;

use super::forms::{Bounds, Curve, MaterialTable, NameOr, OneOrMany, ProfilePoint};
use super::quantity::Quantity;
use crate::machine::LimitKind;

/// Setup file of Feedwright. A bare number is in the unit named at its key; a text may carry its own: "6 hp", "110 lbf".
#[derive(Debug, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields)]
pub struct SetupFile {
    /// Unit of bare lengths, feeds, accelerations and jerks: "mm" (default) or "inch".
    pub units: Option<String>,
    /// Cell of the height field of the stock, length; chosen from tools and stock when absent.
    pub resolution: Option<Quantity>,
    /// The machine: a name from `feedwright library machines`, or a table.
    pub machine: Option<NameOr<MachineTable>>,
    /// Origins of work offsets (G54 …) in one common frame.
    pub offsets: Option<BTreeMap<String, [Quantity; 3]>>,
    /// The workpiece before the program; `[[stock]]` for several.
    pub stock: Option<OneOrMany<StockTable>>,
    /// Keep-out boxes: contact is an error, no air feed inside.
    pub fixture: Option<Vec<FixtureTable>>,
    /// "none": nothing clamps the part beside the blank (it is held from below). Without this and without `[[fixture]]`, air cuts below the
    /// top of the blank and beyond its outline keep their feed.
    pub fixtures: Option<String>,
    /// Cutting coefficients, in place of a library name in `[stock]`.
    pub material: Option<MaterialTable>,
    /// The tools.
    pub tool: Option<Vec<ToolTable>>,
    /// Limits that hold for every tool and operation.
    pub limits: Option<LimitsTable>,
    /// What may run faster than programmed.
    pub raise: Option<RaiseTable>,
    /// Doubts about part and frame that this setup vouches for, by the name the report gives them, like "program-stop":
    /// nothing of the kind changes anything here.
    pub confirm: Option<Vec<String>>,
    /// Special treatment of some moves; the last that matches wins.
    pub operation: Option<Vec<OperationTable>>,
    /// How the program is written.
    pub output: Option<OutputTable>,
    /// What `calibrate` and `learn` found.
    pub process: Option<ProcessTable>,
    /// How the logs of this machine are read.
    pub log: Option<LogTable>,
}

/// How the logs of a machine are read.
#[derive(Debug, Deserialize, JsonSchema, Default, Clone)]
#[serde(deny_unknown_fields)]
pub struct LogTable {
    /// Names of columns, theirs to ours, as `feedwright log` proposes them: `{ "Leistung [kW]" = "spindle_power_kw" }`.
    pub columns: Option<BTreeMap<String, String>>,
}

/// Machine and control.
#[derive(Debug, Deserialize, JsonSchema, Default, Clone)]
#[serde(deny_unknown_fields)]
pub struct MachineTable {
    /// Dialect of the control: fanuc, haas, linuxcnc, grbl, mach3, siemens, heidenhain or generic; found from the text when absent.
    pub dialect: Option<String>,
    /// Unit of a program that has neither G20 nor G21: "mm" or "inch"; inferred from its numbers when absent, and said.
    pub program_unit: Option<String>,
    /// Rapid along the path, mm/min.
    pub rapid: Option<Quantity>,
    /// Path tolerance of the control at block junctions, mm.
    pub corner_tolerance: Option<Quantity>,
    /// Shortest block the control digests, s.
    pub block_time: Option<Quantity>,
    /// Tool change, s.
    pub tool_change_time: Option<Quantity>,
    /// Position of G28 in machine coordinates, mm.
    pub home: Option<[Quantity; 3]>,
    /// What G41/G42 means: control (programmed contour), wear (path already offset) or inverse-wear.
    pub compensation: Option<String>,
    /// Wear offsets of the tool table by D number, as they are added to the radius where the path is already offset, mm:
    /// `{ D1 = -0.02 }`.
    pub wear_offsets: Option<BTreeMap<String, Quantity>>,
    /// Numbers of the tools that the program calls by name: `{ "MILL 10" = 3 }`.
    pub tool_names: Option<BTreeMap<String, u32>>,
    /// Longest line the control reads, bytes.
    pub max_line_length: Option<u32>,
    /// How much text loops and calls may execute beyond one pass before a program counts as endless, MB; 64 if not given.
    pub max_repeated_mb: Option<u32>,
    /// Deepest nesting of calls; 50 if not given.
    pub max_call_depth: Option<u32>,
    /// The linear axes.
    pub axes: Option<AxesTable>,
    /// The spindle.
    pub spindle: Option<SpindleTable>,
}

/// The linear axes.
#[derive(Debug, Deserialize, JsonSchema, Default, Clone)]
#[serde(deny_unknown_fields, expecting = "a table with x, y and z")]
pub struct AxesTable {
    /// X
    pub x: Option<AxisTable>,
    /// Y
    pub y: Option<AxisTable>,
    /// Z
    pub z: Option<AxisTable>,
}

/// One linear axis.
#[derive(Debug, Deserialize, JsonSchema, Default, Clone)]
#[serde(deny_unknown_fields, expecting = "a table like { velocity = 15000, acceleration = 1500, jerk = 20000 }")]
pub struct AxisTable {
    /// Highest velocity, mm/min.
    pub velocity: Option<Quantity>,
    /// Highest acceleration, mm/s².
    pub acceleration: Option<Quantity>,
    /// Highest jerk, mm/s³; absent: does not bind.
    pub jerk: Option<Quantity>,
}

/// The spindle.
#[derive(Debug, Deserialize, JsonSchema, Default, Clone)]
#[serde(deny_unknown_fields, expecting = "a table [machine.spindle]")]
pub struct SpindleTable {
    /// Highest speed, rev/min.
    pub max_rpm: Option<Quantity>,
    /// Power available at the motor shaft, W: one value or points [rev/min, W].
    pub power: Option<Curve>,
    /// Torque available at the tool, N·m: one value or points [rev/min, N·m].
    pub torque: Option<Curve>,
    /// Power at the motor shaft with nothing cut, W: one value or points [rev/min, W].
    pub tare: Option<Curve>,
    /// Motor shaft power over meter reading: one value or points [reading W, ratio].
    pub efficiency: Option<Curve>,
    /// Time to run up, s.
    pub runup_time: Option<Quantity>,
}

/// A piece of stock; exactly one of box, cylinder, stl, saved.
#[derive(Debug, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields)]
pub struct StockTable {
    /// Material by its name in `feedwright library materials`.
    pub material: Option<String>,
    /// An axis-parallel box in work coordinates.
    #[serde(rename = "box")]
    pub block: Option<BoxTable>,
    /// An upright cylinder in work coordinates.
    pub cylinder: Option<CylinderTable>,
    /// A closed triangle mesh (STL file, mm), beside the setup file.
    pub stl: Option<String>,
    /// In-process stock written by an earlier run.
    pub saved: Option<String>,
    /// Work offset it is clamped on, like "G55".
    pub offset: Option<String>,
    /// How far it may stand proud of this shape, mm.
    pub uncertainty: Option<Quantity>,
}

/// An axis-parallel box, mm.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table like { min = [0, 0, -20], max = [100, 60, 0] }")]
pub struct BoxTable {
    /// Lowest corner [x, y, z].
    pub min: [Quantity; 3],
    /// Highest corner [x, y, z].
    pub max: [Quantity; 3],
}

/// An upright cylinder, mm.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderTable {
    /// Centre [x, y].
    #[serde(alias = "centre")]
    pub center: [Quantity; 2],
    /// Diameter.
    pub diameter: Quantity,
    /// Lower and upper face.
    pub z: [Quantity; 2],
}

/// A keep-out box.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FixtureTable {
    /// Its extent in work coordinates.
    #[serde(rename = "box")]
    pub block: BoxTable,
}

/// A tool in its holder.
#[derive(Debug, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields)]
pub struct ToolTable {
    /// Number in the T word; 0 for a program that calls none.
    pub number: Option<u32>,
    /// flat, ball, bull, taper, drill, chamfer, face, high-feed or profile; tap, reamer and probe keep their feeds.
    pub shape: Option<String>,
    /// Widest diameter of the cutting part, mm.
    pub diameter: Option<Quantity>,
    /// Number of teeth.
    pub flutes: Option<u32>,
    /// Speed of the spindle where the program sets no S for this tool (M3 alone, or a router switched by hand), rev/min.
    pub rpm: Option<Quantity>,
    /// Helix angle, deg.
    pub helix: Option<Quantity>,
    /// Angles from each tooth to the next, deg; absent: equal.
    pub pitch: Option<Vec<Quantity>>,
    /// Radial rake angle, deg.
    pub rake: Option<Quantity>,
    /// Corner radius (bull, taper; for a tapered ball: half the tip diameter), mm.
    pub corner_radius: Option<Quantity>,
    /// Radius of the insert corner (face, high-feed), mm.
    pub insert_radius: Option<Quantity>,
    /// Full angle of the point (drill, chamfer), deg.
    pub point_angle: Option<Quantity>,
    /// Diameter of the flat at the tip (chamfer, taper, face, high-feed), mm.
    pub tip_diameter: Option<Quantity>,
    /// Angle of the side to the tool axis (taper), deg.
    pub taper_angle: Option<Quantity>,
    /// Angle of the main edge to the tool axis (face, high-feed): 0 cuts a square shoulder, deg.
    pub lead_angle: Option<Quantity>,
    /// Outline from the axis at the tip outward and up: points [radius, height], or { to, centre } for an arc, mm.
    pub profile: Option<Vec<ProfilePoint>>,
    /// Length of the cutting edges along the axis, mm.
    pub flute_length: Option<Quantity>,
    /// Length out of the holder, mm.
    pub overhang: Option<Quantity>,
    /// Diameter of the shank above the flutes, mm.
    pub shank_diameter: Option<Quantity>,
    /// Offset of the cutter axis.
    pub runout: Option<RunoutTable>,
    /// Tool material: carbide, hss, cobalt, ceramic.
    pub material: Option<String>,
    /// Young's modulus, MPa, in place of that of the tool material.
    pub youngs_modulus: Option<Quantity>,
    /// Radial stiffness of holder and spindle at the collet, N/mm; absent: rigid.
    pub holder_stiffness: Option<Quantity>,
    /// Holder cylinders from the collet face up: [diameter, length], mm.
    pub holder: Option<Vec<[Quantity; 2]>>,
    /// May it plunge without a pilot hole?
    pub centre_cutting: Option<bool>,
    /// Its own cutting coefficients: a library name or a table.
    pub coefficients: Option<NameOr<MaterialTable>>,
    /// Limits that override `[limits]` for this tool.
    pub limits: Option<LimitsTable>,
    /// How it wears over the metres that it cuts.
    pub wear: Option<ToolWearTable>,
}

/// How a tool wears. Its index of wear is the part of the force that does not come from the chip: b0 of the response model
/// (N), k_te of the linear edge model (N/mm); a fresh edge has that of the material. It rises per metre of cut by
/// rate · (feed per tooth / feed_per_tooth)^exponent. Without these three it rises as the process model says (flank-wear).
#[derive(Debug, Deserialize, JsonSchema, Clone)]
#[serde(deny_unknown_fields, expecting = "a table like { rate = 0.3, feed_per_tooth = 0.1, exponent = 1, end = 400 }")]
pub struct ToolWearTable {
    /// Rise of the index per metre of cut at that feed per tooth; absent: that of the process model.
    pub rate: Option<Quantity>,
    /// Feed per tooth at which the rate was seen, mm.
    pub feed_per_tooth: Option<Quantity>,
    /// Power of the feed, from -1 (the way the teeth slide) to 2; above 0 a slower feed spares the edge.
    pub exponent: Option<Quantity>,
    /// Index at which the tool is worn out; needed beside a rate.
    pub end: Option<Quantity>,
    /// Index when the program begins; absent: a fresh edge.
    pub index: Option<Quantity>,
    /// State of the tool that `toollife` wrote, like T1.life.toml, beside the setup: the index behind its last program, and the law as
    /// known there where no rate is given here.
    pub state: Option<String>,
    /// Relative standard deviation of the rate from tool to tool.
    pub rate_scatter: Option<Quantity>,
    /// Standard deviation of the index at the end from tool to tool.
    pub end_scatter: Option<Quantity>,
}

/// Offset of the cutter axis from the spindle axis.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table like { offset = 0.005, angle = 0 }")]
pub struct RunoutTable {
    /// Offset, mm.
    pub offset: Quantity,
    /// Direction from tooth 1, deg.
    pub angle: Option<Quantity>,
}

/// Limits; what is absent does not bind, except feed_change. Each is its largest value alone or a table `{ max = … }`;
/// chip_thickness, feed and feed_change may have a `min` as well.
#[derive(Debug, Deserialize, JsonSchema, Default, Clone)]
#[serde(deny_unknown_fields, expecting = "a table [limits]")]
pub struct LimitsTable {
    /// Peak resultant in the plane normal to the tool axis, N.
    pub force_xy: Option<Bounds>,
    /// Mean force normal to the machined wall, N.
    pub force_normal_mean: Option<Bounds>,
    /// Peak axial force, N.
    pub force_axial: Option<Bounds>,
    /// Power at the motor shaft, tare included, W.
    pub power: Option<Bounds>,
    /// Mean torque at the tool, N·m.
    pub torque: Option<Bounds>,
    /// Deflection at the tool tip, mm.
    pub deflection: Option<Bounds>,
    /// Surface error, mm.
    pub surface_error: Option<Bounds>,
    /// Bending stress of the tool, MPa.
    pub bending_stress: Option<Bounds>,
    /// Smallest and largest chip thickness, mm.
    pub chip_thickness: Option<Bounds>,
    /// Lowest and highest feed in cuts, mm/min.
    pub feed: Option<Bounds>,
    /// Largest feed per tooth, mm.
    pub feed_per_tooth: Option<Bounds>,
    /// Lowest and highest feed relative to the programmed one, in cuts.
    pub feed_change: Option<Bounds>,
    /// Fastest change of the peak resultant in the plane, where the cutter enters, leaves or meets more, N/s.
    pub force_rate: Option<Bounds>,
    /// Budget of wear over the whole program; in `[limits]` only.
    pub wear: Option<WearTable>,
    /// Feed where nothing can be cut, mm/min; in `[limits]` only.
    pub air_feed: Option<Quantity>,
    /// Distance before the grown stock at which the air feed ends, mm; in `[limits]` only.
    pub approach: Option<Quantity>,
}

impl LimitsTable {
    /// What is written of a limit that has only a largest value.
    pub fn largest(&self, kind: LimitKind) -> Option<&Bounds> {
        let written = match kind {
            LimitKind::ForceXy => &self.force_xy,
            LimitKind::ForceNormalMean => &self.force_normal_mean,
            LimitKind::ForceAxial => &self.force_axial,
            LimitKind::Power => &self.power,
            LimitKind::Torque => &self.torque,
            LimitKind::Deflection => &self.deflection,
            LimitKind::SurfaceError => &self.surface_error,
            LimitKind::BendingStress => &self.bending_stress,
            LimitKind::FeedPerTooth => &self.feed_per_tooth,
            LimitKind::ForceRate => &self.force_rate,
            _ => return None,
        };
        written.as_ref()
    }
}

/// What may run faster than programmed where the limits allow it; what is not written is false.
#[derive(Debug, Deserialize, JsonSchema, Default, Clone)]
#[serde(deny_unknown_fields, expecting = "a table like { plunges = false, entries = true }")]
pub struct RaiseTable {
    /// Plunges: the end face cuts straight down. Only under a limit on axial force, power or torque.
    pub plunges: Option<bool>,
    /// Ramps and helices: the end face cuts downwards. Only under a limit on axial force, power or torque.
    pub ramps: Option<bool>,
    /// Lead-in, lead-out and the first engagement of a cut.
    pub entries: Option<bool>,
    /// Finishing passes: they leave the final surface and take an allowance, no more than 0.5 mm or a tenth of the diameter.
    pub finishing: Option<bool>,
    /// Moves under G41 or G42.
    pub compensation: Option<bool>,
    /// Drilling and boring cycles.
    pub cycles: Option<bool>,
}

/// Budget of wear: wear per mm of cut is contact area times feed to a power.
#[derive(Debug, Deserialize, JsonSchema, Default, Clone)]
#[serde(deny_unknown_fields)]
pub struct WearTable {
    /// Power of the feed, between 0 and 2.
    pub exponent: Option<Quantity>,
    /// Most that may be used, as a share of what the program uses as programmed.
    pub most: Option<Quantity>,
}

/// What an operation is recognised by; all that are given must hold.
#[derive(Debug, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields)]
pub struct MatchTable {
    /// Tool number.
    pub tool: Option<u32>,
    /// Text in the last comment before the move, without regard to case.
    pub comment: Option<String>,
    /// First and last physical line, 1-based.
    pub lines: Option<[u32; 2]>,
    /// "final": only moves that leave the finished surface.
    pub surface: Option<String>,
}

/// A ramp of feed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RampTable {
    /// Feed in it, mm/min.
    pub feed: Quantity,
    /// Its length, mm.
    pub distance: Quantity,
}

/// A ramp at changes of direction.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TurnTable {
    /// Changes of direction above this angle, deg.
    #[serde(alias = "deg")]
    pub angle: Quantity,
    /// Feed in it, mm/min.
    pub feed: Quantity,
    /// Its length, mm.
    pub distance: Quantity,
}

/// Special treatment of some moves.
#[derive(Debug, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields)]
pub struct OperationTable {
    /// What it applies to.
    #[serde(rename = "match")]
    pub matches: Option<MatchTable>,
    /// optimise (default), slow-only or keep.
    pub mode: Option<String>,
    /// Ramp where the cutter enters material.
    pub entry: Option<RampTable>,
    /// Ramp where it leaves material.
    pub exit: Option<RampTable>,
    /// Ramp at changes of direction.
    pub direction_change: Option<TurnTable>,
    /// Limits that override those of the setup and of the tool.
    pub limits: Option<LimitsTable>,
    /// What may run faster than programmed here.
    pub raise: Option<RaiseTable>,
    /// Doubts about part and frame that this setup vouches for here.
    pub confirm: Option<Vec<String>>,
}

/// How the program is written.
#[derive(Debug, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields)]
pub struct OutputTable {
    /// Output over input, in blocks and in bytes (default 4). Where it binds, the words that save most come first, and what
    /// the bound costs is said.
    pub max_growth: Option<f64>,
    /// Relative rise of a feed worth an F word (default 0.01).
    pub minimum_change: Option<Quantity>,
    /// Shortest piece a block may be split into, mm.
    pub minimum_length: Option<Quantity>,
    /// May blocks be split? Those of Heidenhain plain language never are: the numbers of its blocks must follow each other.
    pub split: Option<bool>,
    /// none, changes or full.
    pub annotate: Option<String>,
    /// Feeds that are an expression or a variable: keep (default), or replace by numbers where they are always the same.
    pub computed_feeds: Option<String>,
    /// Ranges of lines [first, last] left as they are.
    pub exclude: Option<Vec<[u32; 2]>>,
}

/// What `calibrate` and `learn` found; also the content of a model file.
#[derive(Debug, Deserialize, JsonSchema, Default, Clone)]
#[serde(deny_unknown_fields)]
pub struct ProcessTable {
    /// A model file beside the setup file.
    pub include: Option<String>,
    /// Base model that replaces the material's coefficients.
    pub base: Option<MaterialTable>,
    /// Power at the motor shaft with nothing cut, W, in place of the spindle's.
    pub tare: Option<Quantity>,
    /// Spindle speed that tare belongs to, rev/min: at other speeds it follows the spindle's curve.
    pub tare_speed: Option<Quantity>,
    /// Coefficients of a load in percent or ampere: `evaluate` predicts such readings with them; no feed rests on them.
    pub relative: Option<RelativeTable>,
    /// Effects on top of the base, in the order added.
    pub effect: Option<Vec<EffectTable>>,
    /// Covariance of the base parameters, row by row.
    pub covariance: Option<Vec<Vec<f64>>>,
    /// Names of the parameters its rows belong to.
    pub covariance_of: Option<Vec<String>>,
    /// What stays unexplained of a cut's load, as a share of it: one standard deviation.
    pub scatter: Option<Quantity>,
    /// By the number of the tool: the highest feed per tooth of the cuts that the model rests on.
    pub feed_per_tooth: Option<BTreeMap<String, Quantity>>,
}

/// Coefficients of a load in parts of a rating that is not known.
#[derive(Debug, Deserialize, JsonSchema, Default, Clone)]
#[serde(deny_unknown_fields)]
pub struct RelativeTable {
    /// Unit of the readings, `%` or `A`.
    pub unit: String,
    /// Reading with nothing cut.
    pub tare: f64,
    /// Spindle speed that tare belongs to, rev/min.
    pub tare_speed: Option<Quantity>,
    /// Reading per removal rate, unit/(1000 mm³/s).
    pub k_tc: f64,
    /// Reading per contact rate, unit/(1000 mm²/s).
    pub k_te: f64,
}

/// One named effect.
#[derive(Debug, Deserialize, JsonSchema, Default, Clone)]
#[serde(deny_unknown_fields)]
pub struct EffectTable {
    /// Name, as in `feedwright library effects`.
    pub name: String,
    /// Parameter values by name.
    pub parameters: Option<BTreeMap<String, f64>>,
}
