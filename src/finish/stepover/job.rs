//! From a surface to a program. In: the surface, the job, what is asked. Out: the plan with its program, checked by simulation, and the
//! best program of constant step-over beside it; or why there is none.

use super::check::{self, Check};
use super::drop::{Contact, Dropper};
use super::passes::{self, Columns, Plan, Wish};
use super::path::{self, Drawing, Step};
use super::reach::{Bounds, Terrain};
use super::shape::Shape;
use super::surface::Surface;
use super::text::{self, Head};
use crate::engage::EngageError;
use crate::force::{Cutter, ForceError};
use crate::machine::limits::FEED_CHANGE_MIN;
use crate::machine::{Box3, Job, StockShape, Tool};
use crate::nc::Dialect;
use crate::path::Vec3;
use crate::stock::Piece;

/// What is asked.
#[derive(Debug, Clone, PartialEq)]
pub struct Ask {
    /// Tool; `None`: the only ball or bull-nose end of the setup.
    pub tool: Option<u32>,
    /// Spindle speed, rev/s; `None`: the setup's.
    pub rps: Option<f64>,
    /// Highest feed, mm/s; `None`: what the setup allows.
    pub feed_mm_s: Option<f64>,
    /// Reference force, N; `None`: the setup's force_xy.
    pub force_n: Option<f64>,
    /// Largest scallop, mm.
    pub scallop_mm: f64,
    /// Thickness of the stock on the surface, mm.
    pub stock_mm: f64,
    /// Least and largest step-over, mm; `None`: from the tool.
    pub step_over_mm: [Option<f64>; 2],
    /// Direction of the passes from +X, rad.
    pub direction_rad: f64,
    /// Steepest that a pass may turn away from it, rad.
    pub turn_rad: f64,
    /// How far lines may lie from the path on the surface, mm.
    pub tolerance_mm: f64,
}

/// Why there is no program.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// One sentence, and what to do.
    #[error("{why}")]
    Plain {
        /// What is wrong.
        why: String,
        /// The remedy.
        help: String,
    },
}

impl Refusal {
    fn new(why: impl Into<String>, help: impl Into<String>) -> Self {
        Refusal::Plain { why: why.into(), help: help.into() }
    }
}

impl From<ForceError> for Refusal {
    fn from(error: ForceError) -> Self {
        Refusal::new(error.to_string(), "correct the tool, the material or the speed in the setup")
    }
}

impl From<EngageError> for Refusal {
    fn from(error: EngageError) -> Self {
        Refusal::new(error.to_string(), "the written program could not be simulated, so it is not written")
    }
}

/// A program with what it is predicted and found to do.
#[derive(Debug, Clone)]
pub struct Program {
    /// Its passes.
    pub plan: Plan,
    /// Its motions.
    pub steps: Vec<Step>,
    /// Its text.
    pub text: String,
    /// What its simulation gave.
    pub check: Check,
}

/// Everything that was found.
#[derive(Debug, Clone)]
pub struct Answer {
    /// Tool number.
    pub tool: u32,
    /// Speed, rev/s.
    pub rps: f64,
    /// Reference force, N.
    pub reference_n: f64,
    /// Bounds in force.
    pub bounds: Bounds,
    /// Passes of varying step-over.
    pub varying: Program,
    /// Step-over, mm, feed, mm/s, and passes of the largest constant step-over that keeps force and scallop everywhere, at its best
    /// feed; `None` where there is none.
    pub constant: Option<([f64; 2], Program)>,
    /// Seconds of the least time by one more newton of reference force, and by one more µm of scallop; negative: more would save.
    pub prices: [f64; 2],
    /// What is worth knowing, one sentence each.
    pub notes: Vec<String>,
}

/// Feeds that are tried: from the lowest that is not refused as too low up to the largest, so many.
const FEEDS: u32 = 10;
/// Distance of the columns, mm; a sixth of the tool's radius where that is less.
const COLUMN_MM: f64 = 0.5;
/// Rings that the force is worked out for, mm along the outline.
const RING_MM: f64 = 0.03;
/// Columns that stand this many times as far apart are enough for prices.
const COARSE: f64 = 4.0;
/// Change of a limit by which its price is measured.
const PRICE: f64 = 0.05;
/// Sizes that differ by this much, or that much less, suggest inches taken as millimetres (25.4).
const INCHES: [f64; 2] = [12.0, 50.0];

/// Gives a planned program, which is at its highest feed throughout, the feeds at which it keeps to a force, N, in this stock.
pub type Hold<'a> = &'a dyn Fn(&str, &Piece, f64) -> Result<String, Refusal>;

/// Plans, writes, has the feeds found and checks.
pub fn run(surface: &Surface, job: &Job, dialect: Dialect, ask: &Ask, hold: Hold) -> Result<Answer, Refusal> {
    let tool = tool(job, ask)?;
    let shape = Shape::of(tool).ok_or_else(|| {
        Refusal::new(
            format!("T{} is neither a ball nor a bull-nose end mill", tool.number),
            "give --tool with the number of one, or describe it in the setup: shape = \"ball\" or \"bull\"",
        )
    })?;
    let rps = speed(job, tool, ask)?;
    let reference_n = ask.force_n.or(tool.limits.force_xy_n).or(job.limits.force_xy_n).ok_or_else(|| {
        Refusal::new("there is no reference force", "give --force N, or force_xy in [limits] of the setup")
    })?;
    let feeds_mm_s = feeds(job, tool, rps, ask)?;
    let mut notes = surface.notes.clone();
    size(surface, job)?;
    let holes = surface.holes(shape, ask.tolerance_mm);
    if let Some(hole) = holes.first() {
        return Err(Refusal::new(
            format!(
                "the surface has {} holes into which the tool would sink, the largest {:.2} mm wide at X{:.1} Y{:.1}",
                holes.len(),
                hole.width_mm(),
                hole.low.x,
                hole.low.y
            ),
            "close the holes in the CAD system",
        ));
    }
    if surface.outlines.len() > 1 {
        notes.push(format!("{} gaps too small for the tool to sink into are passed over", surface.outlines.len() - 1));
    }
    let turned = surface.clone().turned(-ask.direction_rad);
    let dropper = Dropper::new(&turned, shape);
    if let Some(note) = reachable(&turned, &dropper, ask.tolerance_mm)? {
        notes.push(note);
    }
    let bounds = Bounds {
        scallop_mm: ask.scallop_mm,
        least_mm: ask.step_over_mm[0].unwrap_or(0.02 * shape.radius_mm()),
        largest_mm: ask.step_over_mm[1].unwrap_or(shape.radius_mm()),
    };
    let material = job.material(tool).ok_or_else(|| {
        Refusal::new("the setup names no material", "give [stock] material, or a [material] table with coefficients")
    })?;
    // Stock as thin as a finishing allowance is met by the corner, and by the lowest part of the side on an upright wall.
    let mut rings = tool.profile.slices(RING_MM);
    rings.retain(|ring| ring.z_mm < shape.corner_mm + shape.radius_mm());
    let cutter = Cutter::new(tool, material, &job.machine.spindle, &job.process, &rings, rps)?;
    let stock_mm = ask.stock_mm;
    let terrain = Terrain { dropper: &dropper, cutter: &cutter, rings: &rings, stock_mm: &|_: &Contact| stock_mm };
    let column_mm = COLUMN_MM.min(shape.radius_mm() / 6.0);
    let Box3 { min, max } = turned.extent;
    let columns = Columns::new(&terrain, [min.x, min.y], [max.x, max.y], column_mm, 0.5 * column_mm);
    let wish = Wish { bounds, reference_n, feeds_mm_s, turn: ask.turn_rad.tan(), constant_mm: None };
    let plan = passes::plan(&terrain, &columns, &wish);
    if plan.passes.iter().all(|pass| pass.stretches.is_empty()) {
        return Err(Refusal::new(
            "no part of the surface can be machined from above with this tool",
            "check the surface and the tool",
        ));
    }
    if plan.out_of_reach > 0.5 {
        return Err(Refusal::new(
            format!(
                "the reference force of {reference_n} N is out of reach: on {:.0} % of the surface even a step-over of {:.3} mm takes more",
                100.0 * plan.out_of_reach,
                bounds.least_mm
            ),
            "raise --force, lower the feed or the stock, or allow a smaller step-over",
        ));
    }
    if plan.out_of_reach > 0.0 {
        notes.push(format!(
            "on {:.1} % of the surface even the least step-over of {:.3} mm exceeds the reference force",
            100.0 * plan.out_of_reach,
            bounds.least_mm
        ));
    }
    let piece = check::stock(surface, stock_mm);
    let drawing = Drawing { tolerance_mm: ask.tolerance_mm, stock_mm, safe_mm: safe(surface, job, stock_mm) };
    let head = |notes: Vec<String>| Head {
        dialect,
        inch: job.machine.unsaid.inch.unwrap_or(job.inch),
        tool: tool.number,
        rps,
        notes,
    };
    let make = |plan: Plan, feed_mm_s: f64, notes: Vec<String>| -> Result<Program, Refusal> {
        let mut steps = path::steps(&plan, feed_mm_s, &dropper, &drawing);
        let (sin, cos) = ask.direction_rad.sin_cos();
        for step in &mut steps {
            (step.to.x, step.to.y) = (cos * step.to.x - sin * step.to.y, sin * step.to.x + cos * step.to.y);
        }
        let text = hold(&text::program(&head(notes), &steps), &piece, reference_n)?;
        let check = check::check(&text, dialect, job, &piece, &steps, reference_n)?;
        Ok(Program { plan, steps, text, check })
    };
    let said = format!(
        "FORCE {reference_n} N, SCALLOP {} MM, STOCK {stock_mm} MM, LINES WITHIN {} MM",
        ask.scallop_mm, ask.tolerance_mm
    );
    let constant = constant(&terrain, &columns, &wish, &plan)
        .map(|(said, plan)| {
            Ok::<_, Refusal>((said, make(plan, said[1], vec!["CONSTANT STEP-OVER FOR COMPARISON".into()])?))
        })
        .transpose()?;
    let coarse = Columns::new(&terrain, [min.x, min.y], [max.x, max.y], COARSE * column_mm, column_mm);
    // The least time, which a whole number of passes does not round.
    let cutting = |wish: &Wish| passes::plan(&terrain, &coarse, wish).bound_s;
    let now = cutting(&wish);
    let more_force = Wish { reference_n: (1.0 + PRICE) * reference_n, ..wish.clone() };
    let more_scallop =
        Wish { bounds: Bounds { scallop_mm: (1.0 + PRICE) * bounds.scallop_mm, ..bounds }, ..wish.clone() };
    let prices = [
        (cutting(&more_force) - now) / (PRICE * reference_n),
        (cutting(&more_scallop) - now) / (PRICE * 1e3 * bounds.scallop_mm),
    ];
    let top = wish.feeds_mm_s.last().copied().unwrap_or(1.0);
    let varying = make(plan, top, vec![said])?;
    Ok(Answer { tool: tool.number, rps, reference_n, bounds, varying, constant, prices, notes })
}

/// Time on the passes at the feeds of their spots, s.
pub fn cutting_s(plan: &Plan) -> f64 {
    let time = |two: &[passes::Spot]| {
        (two[1].tip - two[0].tip).norm() * 0.5 * (two[0].feed_mm_s.recip() + two[1].feed_mm_s.recip())
    };
    plan.passes.iter().flat_map(|pass| &pass.stretches).flat_map(|stretch| stretch.windows(2)).map(time).sum()
}

/// The best plan of one step-over and one feed that keep force and scallop wherever the varying plan looked.
fn constant(terrain: &Terrain, columns: &Columns, wish: &Wish, varying: &Plan) -> Option<([f64; 2], Plan)> {
    let rate = |k: &usize| wish.feeds_mm_s[*k] * varying.everywhere_mm[*k];
    let best = (0..wish.feeds_mm_s.len())
        .filter(|k| varying.everywhere_mm[*k].is_finite())
        .reduce(|a, b| if rate(&b) > rate(&a) { b } else { a })?;
    let step = varying.everywhere_mm[best];
    let feed = wish.feeds_mm_s[best];
    let wish = Wish { feeds_mm_s: vec![feed], turn: 0.0, constant_mm: Some(step), ..wish.clone() };
    Some(([step, feed], passes::plan(terrain, columns, &wish)))
}

fn tool<'a>(job: &'a Job, ask: &Ask) -> Result<&'a Tool, Refusal> {
    if let Some(number) = ask.tool {
        let help = "give --tool with a number of the setup";
        return job.tool(number).ok_or_else(|| Refusal::new(format!("the setup has no tool {number}"), help));
    }
    let fit: Vec<&Tool> = job.tools.iter().filter(|tool| Shape::of(tool).is_some()).collect();
    match fit.as_slice() {
        [only] => Ok(only),
        [] => Err(Refusal::new(
            "the setup has no ball or bull-nose end mill",
            "describe one: shape = \"ball\" or \"bull\"",
        )),
        several => {
            let numbers: Vec<String> = several.iter().map(|tool| format!("T{}", tool.number)).collect();
            Err(Refusal::new(
                format!("the setup has several ball or bull-nose end mills: {}", numbers.join(", ")),
                "say which with --tool",
            ))
        }
    }
}

fn speed(job: &Job, tool: &Tool, ask: &Ask) -> Result<f64, Refusal> {
    let of_setup = job.machine.unsaid.speeds_rps.iter().find(|(number, _)| *number == tool.number).map(|(_, rps)| *rps);
    ask.rps
        .or(of_setup)
        .ok_or_else(|| Refusal::new("there is no spindle speed", "give --rpm, or rpm in the tool's table of the setup"))
}

/// Feeds to choose from: the one that is asked for, or those up to what the setup allows.
fn feeds(job: &Job, tool: &Tool, rps: f64, ask: &Ask) -> Result<Vec<f64>, Refusal> {
    if let Some(feed) = ask.feed_mm_s {
        return Ok(vec![feed]);
    }
    let limits = job.limits.overridden_by(&tool.limits);
    let per_tooth = rps * f64::from(tool.flutes);
    let tops = [
        limits.feed_max_mm_s,
        limits.chip_thickness_max_mm.map(|h| h * per_tooth),
        limits.feed_per_tooth_max_mm.map(|f| f * per_tooth),
    ];
    let Some(top) = tops.into_iter().flatten().reduce(f64::min) else {
        return Err(Refusal::new(
            "nothing says how fast the tool may feed",
            "give --feed, or in [limits] feed = { max = … } or chip_thickness = { max = … }",
        ));
    };
    let floor = limits.feed_min_mm_s.unwrap_or(0.0);
    let feeds = (0..FEEDS).map(|k| top * FEED_CHANGE_MIN.powf(1.0 - f64::from(k) / f64::from(FEEDS - 1)));
    Ok(feeds.filter(|feed| *feed >= floor).collect())
}

/// Is the surface as large as the stock of the setup?
fn size(surface: &Surface, job: &Job) -> Result<(), Refusal> {
    let extent = match job.stocks.first().map(|stock| &stock.shape) {
        Some(StockShape::Box(extent)) => *extent,
        Some(StockShape::Cylinder { centre, diameter_mm, z_mm }) => {
            let [low, high] = [-0.5, 0.5].map(|side| side * diameter_mm);
            Box3 {
                min: Vec3::new(centre[0] + low, centre[1] + low, z_mm[0]),
                max: Vec3::new(centre[0] + high, centre[1] + high, z_mm[1]),
            }
        }
        _ => return Ok(()),
    };
    let across = |extent: &Box3| (extent.max - extent.min).xy().norm();
    let ratio = across(&surface.extent) / across(&extent).max(1e-9);
    let [low, high] = INCHES;
    let help = "give --unit inch or --unit mm with the unit of the mesh, or correct [stock] of the setup";
    if (low..high).contains(&ratio) {
        return Err(Refusal::new(
            format!(
                "the surface is {ratio:.1} times as large as the stock: were its numbers millimetres taken for inches (25.4)?"
            ),
            help,
        ));
    }
    if (low..high).contains(&ratio.recip()) {
        return Err(Refusal::new(
            format!("the stock is {:.1} times as large as the surface: is the mesh in inches (25.4)?", ratio.recip()),
            help,
        ));
    }
    let apart =
        (0..2).any(|axis| surface.extent.min[axis] > extent.max[axis] || surface.extent.max[axis] < extent.min[axis]);
    if apart {
        return Err(Refusal::new(
            "the surface lies beside the stock of the setup",
            "move the mesh to the work zero in the CAD system, or correct [stock]",
        ));
    }
    Ok(())
}

/// Can the tool touch where the surface bends towards it? A note where it cannot everywhere; a refusal where it can nowhere.
fn reachable(surface: &Surface, dropper: &Dropper, tolerance_mm: f64) -> Result<Option<String>, Refusal> {
    let (hollow, out) = super::hollow::hollow(surface, dropper, tolerance_mm);
    if hollow > 0 && out == hollow {
        return Err(Refusal::new(
            format!(
                "the tool of {:.3} mm radius is larger than every concave radius of the surface",
                dropper.shape().corner_mm
            ),
            "take a smaller tool",
        ));
    }
    let share = 100.0 * out as f64 / hollow.max(1) as f64;
    Ok((out > 0).then(|| {
        format!("the tool is too large for {share:.1} % of the concave places of the surface: stock stays there")
    }))
}

/// Height above surface, stock and fixtures at which rapids go.
fn safe(surface: &Surface, job: &Job, stock_mm: f64) -> f64 {
    let tops = job.stocks.iter().map(|stock| match &stock.shape {
        StockShape::Box(extent) => extent.max.z,
        StockShape::Cylinder { z_mm, .. } => z_mm[0].max(z_mm[1]),
        StockShape::Stl(_) | StockShape::Saved(_) => f64::NEG_INFINITY,
    });
    let tops = tops.chain(job.fixtures.iter().map(|fixture| fixture.max.z));
    tops.fold(surface.extent.max.z + stock_mm, f64::max) + 5.0
}
