//! From a surface to a program. In: the surface, the job, a request. Out: the plan with its program, checked by
//! simulation, and for comparison the best program of constant step-over; or why there is none.

use super::check::{self, Check};
use super::comparison;
use super::drop::{Contact, Dropper};
use super::earlier::Earlier;
use super::layout::{Layout, PassArea};
use super::left::{Left, Places};
use super::passes::{self, Constant, Plan, Requirements, beyond_mm, is_beyond};
use super::path::{self, Drawing, Step};
use super::reach::{Bounds, Place, ToolOnSurface};
use super::shape::Shape;
use super::surface::Surface;
use super::text::{self, Head};
use super::written;
use crate::engage::EngageError;
use crate::force::{Cutter, ForceError};
use crate::machine::limits::FEED_CHANGE_MIN;
use crate::machine::{Box3, Job, StockShape, Tool};
use crate::nc::Dialect;
use crate::path::{Plane, Vec3};
use crate::stock::Piece;

/// What the user requests.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Tool; `None`: the only ball or bull-nose end of the setup.
    pub tool: Option<u32>,
    /// Spindle speed, rev/s; `None`: the setup's.
    pub rps: Option<f64>,
    /// Feed, mm/s; `None`: chosen up to what the setup allows.
    pub feed_mm_s: Option<f64>,
    /// Reference force, N; `None`: the setup's force_xy.
    pub force_n: Option<f64>,
    /// Largest scallop, mm.
    pub scallop_mm: f64,
    /// Thickness of the stock on the surface, mm, unless an earlier program left it.
    pub stock_mm: f64,
    /// Least and largest step-over, mm; `None`: from the tool.
    pub step_over_mm: [Option<f64>; 2],
    /// Layout of the passes.
    pub layout: Layout,
    /// Largest deviation of lines and arcs from the path on the surface, mm.
    pub tolerance_mm: f64,
}

/// Why there is no program.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// One sentence, and the remedy.
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

/// A program with its plan and its simulation.
#[derive(Debug, Clone)]
pub struct Program {
    /// Its passes, with the scallops of the written motions.
    pub plan: Plan,
    /// Its motions.
    pub steps: Vec<Step>,
    /// Its text.
    pub text: String,
    /// Result of its simulation.
    pub check: Check,
    /// What it leaves on the surface.
    pub left: Left,
}

/// A program of constant step-over.
#[derive(Debug, Clone)]
pub struct Rival {
    /// Its step-over.
    pub step: Constant,
    /// Its feed, mm/s.
    pub feed_mm_s: f64,
    /// The program.
    pub program: Program,
}

/// The result.
#[derive(Debug, Clone)]
pub struct Answer {
    /// Tool number.
    pub tool: u32,
    /// Speed, rev/s.
    pub rps: f64,
    /// Reference force, N.
    pub reference_n: f64,
    /// Bounds of step-over and scallop as requested.
    pub bounds: Bounds,
    /// Passes of varying step-over.
    pub varying: Program,
    /// Passes of the largest constant step-over that keeps force and scallop everywhere, at its best feed; measured
    /// from above or along the surface, whichever is faster; `None` if there is none.
    pub constant: Option<Rival>,
    /// Lower bounds of the time, s: of passes with the allowed slope, and of any passes.
    pub least_s: [f64; 2],
    /// Change of the first lower bound, s per N of reference force and s per µm of scallop; negative: a larger limit
    /// saves time.
    pub prices: [f64; 2],
    /// For passes of one height the area that they leave out.
    pub left_out: Option<LeftOut>,
    /// Notes, one sentence each.
    pub notes: Vec<String>,
}

/// Area of a surface that passes of one height leave out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// Slope below which they leave it out, rad.
    pub shallowest_rad: f64,
    /// Machined area, mm².
    pub machined_mm2: f64,
    /// The part of it with less slope, mm².
    pub shallow_mm2: f64,
    /// Area of the steeper part, where the tool reaches it, on which more is left than the scallop limit, mm².
    pub strips_mm2: f64,
}

/// Number of feeds to choose from.
const FEEDS: u32 = 10;
/// Spacing of the columns, mm; at most a sixth of the tool radius.
const COLUMN_MM: f64 = 0.5;
/// Width of the rings for the force, mm along the outline.
const RING_MM: f64 = 0.03;
/// Number of places over the surface for the lower bound of the time.
const PLACES: f64 = 600.0;
/// Clearance of rapids above everything, mm.
const ABOVE_MM: f64 = 5.0;
/// Relative change of a limit for its price.
const PRICE: f64 = 0.05;
/// Range of the ratio of sizes of surface and stock, either way, that suggests inches taken for millimetres (25.4).
const INCHES: [f64; 2] = [12.0, 50.0];

/// Replaces the feeds of a planned program, which is at its highest feed throughout, by those at which it keeps a
/// force, N, in this stock.
pub type Hold<'a> = &'a dyn Fn(&str, &Piece, f64) -> Result<String, Refusal>;

/// Plans the passes, writes the program, sets its feeds and checks it. `left`: the stock that an earlier program left;
/// `None`: stock of the requested thickness.
pub fn run(
    surface: &Surface,
    (job, dialect): (&Job, Dialect),
    ask: &Request,
    left: Option<Piece>,
    hold: Hold,
) -> Result<Answer, Refusal> {
    let tool = tool(job, ask)?;
    let shape = Shape::of(tool).ok_or_else(|| {
        Refusal::new(
            format!("T{} is neither a ball nor a bull-nose end mill", tool.number),
            "give --tool with the number of one, or describe it in the setup: shape = \"ball\" or \"bull\"",
        )
    })?;
    let rps = speed(job, tool, ask)?;
    let reference_n = ask.force_n.or(tool.limits.force_xy_n).or(job.limits.force_xy_n).ok_or_else(|| {
        Refusal::new("there is no reference force", "give --reference-force N, or force_xy in [limits] of the setup")
    })?;
    let feeds_mm_s = feeds(job, tool, rps, ask)?;
    let mut notes = surface.notes.clone();
    size(surface, job)?;
    notes.extend(closed(surface, shape, ask.tolerance_mm)?);
    let turned = surface.clone().turned(-ask.layout.frame_rad());
    let dropper = Dropper::new(&turned, shape);
    let everywhere = Places::new(&turned, &dropper);
    notes.extend(reachable(&everywhere, shape, ask.tolerance_mm)?);
    let bounds = Bounds {
        scallop_mm: ask.scallop_mm,
        least_mm: ask.step_over_mm[0].unwrap_or(0.02 * shape.radius_mm()),
        largest_mm: ask.step_over_mm[1].unwrap_or(shape.radius_mm()),
    };
    if bounds.least_mm > bounds.largest_mm {
        return Err(Refusal::new(
            format!(
                "the least step-over of {:.3} mm is larger than the largest of {:.3} mm",
                bounds.least_mm, bounds.largest_mm
            ),
            "correct --least-step-over and --largest-step-over; the largest is the radius of the tool when absent",
        ));
    }
    let mut below_mm = below_mm(ask)?;
    let material = job.material(tool).ok_or_else(|| {
        Refusal::new("the setup names no material", "give [stock] material, or a [material] table with coefficients")
    })?;
    // A finishing allowance is cut by the corner, and on a vertical wall by the lowest part of the side.
    let mut rings = tool.profile.slices(RING_MM);
    rings.retain(|ring| ring.z_mm < shape.corner_mm + shape.radius_mm());
    let cutter = Cutter::new(tool, material, &job.machine.spindle, &job.process, &rings, rps)?;
    let earlier = left.as_ref().map(|piece| Earlier::new(piece, ask.layout.frame_rad()));
    let most_mm = shape.radius_mm();
    let stock_mm = |contact: &Contact| match &earlier {
        Some(earlier) => earlier.thickness_mm(contact, most_mm),
        None => ask.stock_mm,
    };
    let on_surface = ToolOnSurface {
        dropper: &dropper,
        cutter: &cutter,
        rings: &rings,
        stock_mm: &stock_mm,
        one_height: matches!(ask.layout, Layout::Contour { .. }),
    };
    let column_mm = COLUMN_MM.min(shape.radius_mm() / 6.0);
    let Box3 { min, max } = turned.extent;
    let pass_area = PassArea::new(&ask.layout, &on_surface, [min.x, min.y], [max.x, max.y], column_mm);
    let left_out = left_out(surface, &ask.layout)?;
    let area = turned.machined_mm2();
    let places = pass_area.places((area / PLACES).sqrt());
    let thickest_mm = thickest(&on_surface, &places, most_mm)?;
    let required = Requirements { bounds, reference_n, feeds_mm_s, turn: ask.layout.turn(), constant: None };
    let said = format!(
        "FORCE {reference_n} N, SCALLOP {} MM, {}, LINES AND ARCS WITHIN {} MM",
        ask.scallop_mm,
        if left.is_some() {
            "STOCK AS LEFT BY AN EARLIER PROGRAM".into()
        } else {
            format!("STOCK {} MM", ask.stock_mm)
        },
        ask.tolerance_mm
    );
    let piece = left.unwrap_or_else(|| check::stock(surface, ask.stock_mm));
    let inch = job.machine.unsaid.inch.unwrap_or(job.inch);
    tolerable(ask.tolerance_mm, inch)?;
    let frame_rad = ask.layout.frame_rad();
    let round = |p: Vec3| rotated(rotated(p, frame_rad).map(|mm| text::rounded_mm(mm, inch)), -frame_rad);
    let drawing = Drawing {
        round: &round,
        tolerance_mm: ask.tolerance_mm,
        arcs: arcs(dialect, &ask.layout),
        stock_mm: thickest_mm,
        safe_mm: safe(surface, job, thickest_mm).max(piece.field.extent.max.z + ABOVE_MM),
    };
    let head = |notes: Vec<String>| Head { dialect, inch, tool: tool.number, rps, notes };
    // Passes of one height leave out what is shallower.
    let most_z = if let Layout::Contour { shallowest_rad } = ask.layout { shallowest_rad.cos() } else { 1.0 };
    let draw = |plan: Plan, feed_mm_s: f64, notes: Vec<String>| {
        let mut steps = path::steps(&plan, feed_mm_s, &dropper, &drawing);
        for step in &mut steps {
            step.to = rotated(step.to, frame_rad);
            step.via = step.via.map(|via| rotated(via, frame_rad));
        }
        let text = text::program(&head(notes), &steps);
        let path = check::passes_of(&text, dialect, job, &steps);
        let left = everywhere.left(&path, frame_rad, &stock_mm, [ask.tolerance_mm, most_z, beyond_mm(ask.scallop_mm)]);
        let plan = written::with_scallops(&on_surface, plan, (&path, frame_rad), ask.scallop_mm);
        Drawn { plan, steps, text, left }
    };
    let top = required.feeds_mm_s.last().copied().unwrap_or(1.0);
    let (mut varying, mut rival): (Option<Drawn>, Option<(Constant, f64, Drawn)>) = (None, None);
    for _ in 0..PLANS {
        let lower = Bounds { scallop_mm: ask.scallop_mm - below_mm, ..bounds };
        let required = Requirements { bounds: lower, ..required.clone() };
        let plan = pass_area.plan(&on_surface, &required);
        let over_mm = |drawn: &Drawn| {
            let largest_mm = drawn.plan.largest_scallop_mm();
            if is_beyond(largest_mm, ask.scallop_mm) { largest_mm - ask.scallop_mm } else { 0.0 }
        };
        if !rival.as_ref().is_some_and(|(_, _, drawn)| over_mm(drawn) == 0.0) {
            let note = "CONSTANT STEP-OVER FOR COMPARISON";
            rival = pass_area
                .constant(&on_surface, &required, &plan)
                .map(|(step, feed_mm_s, plan)| (step, feed_mm_s, draw(plan, feed_mm_s, vec![note.into()])));
        }
        if varying.as_ref().is_none_or(|drawn| over_mm(drawn) > 0.0) {
            varying = Some(draw(plan, top, vec![said.clone()]));
        }
        let drawn = varying.iter().chain(rival.iter().map(|(_, _, drawn)| drawn));
        let most_mm = drawn.map(over_mm).fold(0.0, f64::max);
        below_mm += most_mm;
        if most_mm == 0.0 || below_mm >= ask.scallop_mm {
            break;
        }
    }
    let varying = varying.filter(|drawn| drawn.plan.passes.iter().any(|pass| !pass.stretches.is_empty()));
    let varying = varying.ok_or_else(|| {
        Refusal::new(
            "no part of the surface can be machined from above with this tool",
            "check the surface and the tool",
        )
    })?;
    notes.extend(within_reach(&varying.plan, reference_n, &bounds)?);
    // Half the chord that the stock cuts off the tool.
    let reach_mm = (2.0 * shape.radius_mm() * thickest_mm).sqrt();
    // Its feeds are set for the same force and it is simulated alike, so that the two can be compared.
    // Passes are within the tolerance as they are written; the points of leads are rounded too.
    let finished = (surface, shape, ask.tolerance_mm + text::rounding_mm(inch));
    let finish = |Drawn { plan, steps, text, left }: Drawn| -> Result<Program, Refusal> {
        let text = hold(&text, &piece, reference_n)?;
        let check = check::check(&text, dialect, job, &piece, (&steps, reach_mm), reference_n, finished)?;
        Ok(Program { plan, steps, text, check, left })
    };
    let constant = rival
        .map(|(step, feed_mm_s, drawn)| Ok::<_, Refusal>(Rival { step, feed_mm_s, program: finish(drawn)? }))
        .transpose()?;
    let more_force = Requirements { reference_n: (1.0 + PRICE) * reference_n, ..required.clone() };
    let more_scallop =
        Requirements { bounds: Bounds { scallop_mm: (1.0 + PRICE) * bounds.scallop_mm, ..bounds }, ..required.clone() };
    let [least, least_with_force] = pass_area.least_alike_s(&on_surface, &places, [&required, &more_force]);
    let [least_with_scallop] = pass_area.least_alike_s(&on_surface, &places, [&more_scallop]);
    // Passes laid like these are among any passes; these are bounded at fewer places and with fewer headings.
    let least_s = [least, comparison::least_of_any_s(&on_surface, &places, &required).min(least)];
    let prices = [
        (least_with_force - least) / (PRICE * reference_n),
        (least_with_scallop - least) / (PRICE * 1e3 * bounds.scallop_mm),
    ];
    let left_out = left_out.map(|left| LeftOut { strips_mm2: varying.left.beyond_mm2, ..left });
    let varying = finish(varying)?;
    Ok(Answer { tool: tool.number, rps, reference_n, bounds, varying, constant, least_s, prices, left_out, notes })
}

/// Share of the tolerance of lines and arcs by which the scallop limit of the first plan is below the one that is asked for. Passes off the
/// surface by the tolerance leave scallops higher by as much, but few are off by all of it.
const BELOW: f64 = 0.25;
/// Most plans, each for a limit lower by as much as the written passes of the one before exceed the one that is asked for.
const PLANS: u32 = 3;

/// How far the scallop limit of the first plan is below the one that is asked for, mm. An error if that leaves nothing.
fn below_mm(ask: &Request) -> Result<f64, Refusal> {
    let below_mm = BELOW * ask.tolerance_mm;
    if below_mm >= ask.scallop_mm {
        return Err(Refusal::new(
            format!(
                "the scallop limit of {} mm leaves nothing beside lines and arcs within {} mm",
                ask.scallop_mm, ask.tolerance_mm
            ),
            "lower --tolerance, or raise --scallop",
        ));
    }
    Ok(below_mm)
}

/// A place rotated about Z, counter-clockwise.
fn rotated(p: Vec3, angle_rad: f64) -> Vec3 {
    let (sin, cos) = angle_rad.sin_cos();
    Vec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z)
}

/// An error if coordinates are written no finer than the tolerance.
fn tolerable(tolerance_mm: f64, inch: bool) -> Result<(), Refusal> {
    let rounding_mm = text::rounding_mm(inch);
    if tolerance_mm > rounding_mm {
        return Ok(());
    }
    let unit = if inch { "inches" } else { "millimetres" };
    Err(Refusal::new(
        format!(
            "--tolerance {tolerance_mm} mm cannot be held: the coordinates of the program, in {unit}, are rounded by up to \
             {rounding_mm:.4} mm"
        ),
        format!("give --tolerance above {rounding_mm:.4} mm"),
    ))
}

/// A plan with the scallops of the written passes, its motions, their text before the feeds are set, and what they leave on the surface.
struct Drawn {
    plan: Plan,
    steps: Vec<Step>,
    text: String,
    left: Left,
}

/// Area that passes of one height leave out, without strips; an error if that is everything.
fn left_out(surface: &Surface, layout: &Layout) -> Result<Option<LeftOut>, Refusal> {
    let Layout::Contour { shallowest_rad } = *layout else { return Ok(None) };
    let [machined_mm2, shallow_mm2] = surface.shallow_mm2(shallowest_rad);
    if machined_mm2 > 0.0 && shallow_mm2 >= machined_mm2 {
        return Err(Refusal::new(
            format!(
                "the surface is nowhere steeper than {:.1} degrees: too shallow for passes of one height",
                shallowest_rad.to_degrees()
            ),
            "plan parallel passes (--passes parallel), or lower --shallowest",
        ));
    }
    Ok(Some(LeftOut { shallowest_rad, machined_mm2, shallow_mm2, strips_mm2: 0.0 }))
}

/// Time on the passes at the feeds of their spots, s.
pub fn cutting_s(plan: &Plan) -> f64 {
    let time = |two: &[passes::Spot]| {
        (two[1].tip - two[0].tip).norm() * 0.5 * (two[0].feed_mm_s.recip() + two[1].feed_mm_s.recip())
    };
    plan.passes.iter().flat_map(|pass| &pass.stretches).flat_map(|stretch| stretch.windows(2)).map(time).sum()
}

/// A note on gaps of the surface that the tool passes over; an error if it would sink into one.
fn closed(surface: &Surface, shape: Shape, tolerance_mm: f64) -> Result<Option<String>, Refusal> {
    let holes = surface.sinks_into(shape, tolerance_mm);
    if let Some(hole) = holes.first() {
        return Err(Refusal::new(
            format!(
                "the surface has {} holes into which the tool would sink, the largest {:.2} mm wide at X{:.1} Y{:.1}",
                holes.len(),
                hole.width_mm,
                hole.at[0],
                hole.at[1]
            ),
            "close the holes in the CAD system",
        ));
    }
    let gaps = surface.holes.len();
    Ok((gaps > 0).then(|| format!("{gaps} gaps too small for the tool to sink into are passed over")))
}

/// Largest thickness of the stock on the surface, mm; an error if there is no stock, or `most_mm` or more.
fn thickest(on_surface: &ToolOnSurface, places: &[Place], most_mm: f64) -> Result<f64, Refusal> {
    let at = |(p, _): &Place| on_surface.dropper.drop(*p).map_or(0.0, |contact| (on_surface.stock_mm)(&contact));
    let thickest = places.iter().map(at).fold(0.0, f64::max);
    if !places.is_empty() && thickest <= 0.0 {
        return Err(Refusal::new(
            "the stock of the setup stands nowhere above the surface",
            "give the stock that the program before left, or --stock with its thickness",
        ));
    }
    if thickest >= most_mm {
        return Err(Refusal::new(
            format!("the stock of the setup stands {most_mm:.3} mm or more above the surface, the radius of the tool"),
            "rough the part first, or give --stock with the thickness that is left",
        ));
    }
    Ok(thickest)
}

/// A note if the reference force is exceeded at the least step-over in places; an error if that is most of the surface.
fn within_reach(plan: &Plan, reference_n: f64, bounds: &Bounds) -> Result<Option<String>, Refusal> {
    let (share, least_mm) = (100.0 * plan.out_of_reach, bounds.least_mm);
    if plan.out_of_reach > 0.5 {
        return Err(Refusal::new(
            format!(
                "the reference force of {reference_n} N is out of reach: on {share:.0} % of the surface even a \
                 step-over of {least_mm:.3} mm needs more"
            ),
            "raise --reference-force, lower the feed or the stock, or allow a smaller step-over",
        ));
    }
    Ok((plan.out_of_reach > 0.0).then(|| {
        format!(
            "on {share:.1} % of the surface even the least step-over of {least_mm:.3} mm exceeds the reference force"
        )
    }))
}

/// Do the passes lie in planes in which the control has arcs? Straight ones along X or Y lie in a vertical plane, those
/// of one height in a horizontal one.
fn arcs(dialect: Dialect, layout: &Layout) -> bool {
    let Layout::Parallel { direction_rad, turn_rad } = layout else { return text::has_arcs(dialect, Plane::Xy) };
    let (sin, cos) = direction_rad.sin_cos();
    let plane = if sin.abs() < cos.abs() { Plane::Zx } else { Plane::Yz };
    *turn_rad == 0.0 && sin.abs().min(cos.abs()) < 1e-9 && text::has_arcs(dialect, plane)
}

fn tool<'a>(job: &'a Job, ask: &Request) -> Result<&'a Tool, Refusal> {
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

fn speed(job: &Job, tool: &Tool, ask: &Request) -> Result<f64, Refusal> {
    let of_setup = job.machine.unsaid.speeds_rps.iter().find(|(number, _)| *number == tool.number).map(|(_, rps)| *rps);
    ask.rps
        .or(of_setup)
        .ok_or_else(|| Refusal::new("there is no spindle speed", "give --rpm, or rpm in the tool's table of the setup"))
}

/// Feeds to choose from, mm/s: the requested one, or a geometric series up to what the setup allows.
fn feeds(job: &Job, tool: &Tool, rps: f64, ask: &Request) -> Result<Vec<f64>, Refusal> {
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
            "the greatest feed of the tool is not known",
            "give --feed, or in [limits] feed = { max = … } or chip_thickness = { max = … }",
        ));
    };
    let floor = limits.feed_min_mm_s.unwrap_or(0.0);
    let feeds = (0..FEEDS).map(|k| top * FEED_CHANGE_MIN.powf(1.0 - f64::from(k) / f64::from(FEEDS - 1)));
    Ok(feeds.filter(|feed| *feed >= floor).collect())
}

/// An error if the surface and the stock of the setup differ in size like inches and millimetres, or do not overlap.
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
                "the surface is {ratio:.1} times as large as the stock: were its numbers millimetres taken for inches \
                 (25.4)?"
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

/// Share of the machined area that the tool has to reach: with less it is the wrong one. Judgement.
const REACHED: f64 = 0.5;

/// A note on the area that the tool is too large for; an error if that is most of the surface.
fn reachable(places: &Places, shape: Shape, tolerance_mm: f64) -> Result<Option<String>, Refusal> {
    let out = places.out_of_reach(tolerance_mm);
    let (percent, area_mm2, most_mm) = (100.0 * out.share, out.area_mm2, out.most_mm);
    if out.share > 1.0 - REACHED {
        return Err(Refusal::new(
            format!(
                "the tool of {:.3} mm radius is too large for {percent:.0} % of the surface: up to {most_mm:.3} mm of \
                 stock would stay there",
                shape.corner_mm
            ),
            "take a smaller tool",
        ));
    }
    Ok((out.share > 0.0).then(|| {
        format!(
            "the tool is too large for {area_mm2:.1} mm2 ({percent:.1} %) of the surface: up to {most_mm:.3} mm of stock \
             stays there"
        )
    }))
}

/// Safe height of rapids above surface, stock and fixtures, mm.
fn safe(surface: &Surface, job: &Job, stock_mm: f64) -> f64 {
    let tops = job.stocks.iter().map(|stock| match &stock.shape {
        StockShape::Box(extent) => extent.max.z,
        StockShape::Cylinder { z_mm, .. } => z_mm[0].max(z_mm[1]),
        StockShape::Stl(_) | StockShape::Saved(_) => f64::NEG_INFINITY,
    });
    let tops = tops.chain(job.fixtures.iter().map(|fixture| fixture.max.z));
    tops.fold(surface.extent.max.z + stock_mm, f64::max) + ABOVE_MM
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A limit of a quarter of the tolerance leaves no scallop to plan for; a little more leaves that little.
    #[test]
    fn the_first_plan_is_for_a_scallop_lower_by_a_quarter_of_the_tolerance() {
        let ask = |scallop_mm| Request {
            tool: None,
            rps: None,
            feed_mm_s: None,
            force_n: None,
            scallop_mm,
            stock_mm: 0.1,
            step_over_mm: [None; 2],
            layout: Layout::Contour { shallowest_rad: 0.5 },
            tolerance_mm: 0.04,
        };
        let refused = below_mm(&ask(0.01)).unwrap_err().to_string();
        assert!(refused.contains("0.01 mm leaves nothing"), "{refused}");
        assert_eq!(below_mm(&ask(0.0101)), Ok(0.01));
    }
}
