//! From a surface to a program. In: the surface, the job, a request. Out: the plan with its program, checked by
//! simulation, and for comparison the best program of constant step-over; or why there is none.

use super::around::{Around, Met};
use super::check::{self, Check};
use super::comparison;
use super::drop::{Contact, Dropper};
use super::earlier::Earlier;
use super::layout::{Layout, PassArea};
use super::left::{Left, Places};
use super::lowered::Lowered;
use super::passes::{Constant, Requirements};
use super::path::{self, Drawing, Step};
use super::plan::{Plan, Spot, beyond_mm, is_beyond};
use super::preconditions;
use super::reach::{Bounds, ToolOnSurface};
pub use super::request::{LeftOut, Refusal, Request};
use super::shape::Shape;
use super::surface::Surface;
use super::text::{self, Head};
use super::written;
use crate::force::Cutter;
use crate::machine::{Box3, Job, StockShape};
use crate::nc::Dialect;
use crate::path::{Plane, Vec3};
use crate::stock::Piece;

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
/// Replaces the feeds of a planned program, which is at its highest feed throughout, by those at which it keeps a
/// force, N, in this stock.
pub type Hold<'a> = &'a dyn Fn(&str, &Piece, f64) -> Result<String, Refusal>;

/// Plans the passes, writes the program, sets its feeds and checks it. `left`: the stock that an earlier program left;
/// `None`: stock of the requested thickness. `around`: the stock of the setup, of which what stands beside the surface counts then.
pub fn run(
    surface: &Surface,
    (job, dialect): (&Job, Dialect),
    ask: &Request,
    (left, around): (Option<Piece>, Option<Around>),
    hold: Hold,
) -> Result<Answer, Refusal> {
    let tool = preconditions::tool(job, ask)?;
    let shape = Shape::of(tool).ok_or_else(|| {
        Refusal::new(
            format!("T{} is neither a ball nor a bull-nose end mill", tool.number),
            "give --tool with the number of one, or describe it in the setup: shape = \"ball\" or \"bull\"",
        )
    })?;
    let rps = preconditions::speed(job, tool, ask)?;
    let reference_n = ask.force_n.or(tool.limits.force_xy_n).or(job.limits.force_xy_n).ok_or_else(|| {
        Refusal::new("there is no reference force", "give --reference-force N, or force_xy in [limits] of the setup")
    })?;
    let feeds_mm_s = preconditions::feeds(job, tool, rps, ask)?;
    let mut notes = surface.notes.clone();
    preconditions::size(surface, job)?;
    notes.extend(preconditions::closed(surface, shape, ask.tolerance_mm)?);
    let turned = surface.clone().turned(-ask.layout.frame_rad());
    let dropper = Dropper::new(&turned, shape);
    let everywhere = Places::new(&turned, &dropper);
    notes.extend(preconditions::reachable(&everywhere, shape, ask.tolerance_mm)?);
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
    let below_mm = preconditions::below_mm(ask)?;
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
    let left_out = preconditions::left_out(surface, &ask.layout)?;
    let area = turned.machined_mm2();
    let apart_mm = (area / PLACES).sqrt();
    let places = pass_area.places(apart_mm);
    let thickest_mm = preconditions::thickest(&on_surface, &places, most_mm)?;
    let lowered = Lowered::nowhere(shape.radius_mm());
    let required = Requirements { bounds, lowered, reference_n, feeds_mm_s, turn: ask.layout.turn(), constant: None };
    let around = around.filter(|_| left.is_none());
    let top_mm = around.as_ref().map_or(f64::NEG_INFINITY, |around| around.piece.field.extent.max.z);
    let piece = left.unwrap_or_else(|| check::stock(surface, ask.stock_mm));
    let inch = job.machine.unsaid.inch.unwrap_or(job.inch);
    let said = text::made_for(ask, reference_n, earlier.is_some(), inch);
    preconditions::tolerable(ask.tolerance_mm, inch)?;
    let frame_rad = ask.layout.frame_rad();
    let round = |p: Vec3| rotated(rotated(p, frame_rad).map(|mm| text::rounded_mm(mm, inch)), -frame_rad);
    let drawing = Drawing {
        round: &round,
        tolerance_mm: ask.tolerance_mm,
        arcs: arcs(dialect, &ask.layout),
        stock_mm: thickest_mm,
        safe_mm: safe(surface, job, thickest_mm).max(piece.field.extent.max.z.max(top_mm) + ABOVE_MM),
    };
    if matches!(dialect, Dialect::Fanuc | Dialect::Haas) {
        let number = text::program_number(&ask.name).unwrap_or(text::UNNAMED);
        notes.push(format!(
            "the program is O{number:04}: the only number in the name of its file if it is below 8000, else O0001"
        ));
    }
    let head = |notes: Vec<String>| Head { name: ask.name.clone(), dialect, inch, tool: tool.number, rps, notes };
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
    let beyond_by = |largest_mm: f64| {
        if is_beyond(largest_mm, ask.scallop_mm) { largest_mm - ask.scallop_mm } else { 0.0 }
    };
    let over_mm = |drawn: &Drawn| beyond_by(drawn.plan.largest_scallop_mm());
    // Between the places of the plan, and along ends askew to the passes, those side by side may leave more than at them.
    let above = |drawn: &Drawn| {
        let spots = drawn.plan.passes.iter().flat_map(|pass| pass.stretches.iter().flatten());
        let spots = spots.map(|spot| (spot.at, spot.scallop_mm)).filter(|(_, mm)| is_beyond(*mm, ask.scallop_mm));
        let between = drawn.left.above.iter().copied().filter(|_| matches!(ask.layout, Layout::Parallel { .. }));
        spots.chain(between).collect::<Vec<_>>()
    };
    let most_mm = |above: &[([f64; 2], f64)]| above.iter().map(|(_, mm)| *mm).fold(0.0, f64::max);
    let mut varying: Option<(f64, Drawn)> = None;
    let mut everywhere_mm: Option<Vec<[f64; 2]>> = None;
    let mut lower =
        Requirements { bounds: Bounds { scallop_mm: ask.scallop_mm - below_mm, ..bounds }, ..required.clone() };
    for _ in 0..PLANS {
        let plan = pass_area.plan(&on_surface, &lower, &drawing);
        everywhere_mm.get_or_insert_with(|| plan.everywhere_mm.clone());
        let drawn = draw(plan, top, said.clone());
        let above = above(&drawn);
        if varying.as_ref().is_none_or(|(best_mm, _)| most_mm(&above) < *best_mm) {
            varying = Some((most_mm(&above), drawn));
        }
        if !lower.lowered.lower(&above, ask.scallop_mm) {
            break;
        }
    }
    let (mut rival, mut everywhere_mm): (Option<(Constant, f64, Drawn)>, _) = (None, everywhere_mm.unwrap_or_default());
    for _ in 0..PLANS {
        let note = vec!["CONSTANT STEP-OVER FOR COMPARISON".into()];
        rival = pass_area
            .constant(&on_surface, &required, &everywhere_mm)
            .map(|(step, feed_mm_s, plan)| (step, feed_mm_s, draw(plan, feed_mm_s, note)));
        let over_mm = rival.as_ref().map_or(0.0, |(_, _, drawn)| over_mm(drawn));
        if over_mm == 0.0 {
            break;
        }
        // The scallop grows with the square of the step-over.
        let narrower = (1.0 + over_mm / ask.scallop_mm).sqrt().recip();
        everywhere_mm.iter_mut().flatten().for_each(|step_mm| *step_mm *= narrower);
    }
    let varying =
        varying.map(|(_, drawn)| drawn).filter(|drawn| drawn.plan.passes.iter().any(|pass| !pass.stretches.is_empty()));
    let varying = varying.ok_or_else(|| {
        Refusal::new(
            "no part of the surface can be machined from above with this tool",
            "check the surface and the tool",
        )
    })?;
    notes.extend(preconditions::within_reach(&varying.plan, reference_n, &bounds)?);
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
    let [least, least_with_force] = pass_area.least_alike_s(&on_surface, (&places, apart_mm), [&required, &more_force]);
    let [least_with_scallop] = pass_area.least_alike_s(&on_surface, (&places, apart_mm), [&more_scallop]);
    // Passes laid like these are among any passes; these are bounded at fewer places and with fewer headings.
    let least_s = [least, comparison::least_of_any_s(&on_surface, &places, &required).min(least)];
    let prices = [
        (least_with_force - least) / (PRICE * reference_n),
        (least_with_scallop - least) / (PRICE * 1e3 * bounds.scallop_mm),
    ];
    let left_out = left_out.map(|left| LeftOut { strips_mm2: varying.left.beyond_mm2, ..left });
    let mut varying = finish(varying)?;
    if let Some(around) = around
        && let Some(beside) = around.beside(surface, ask.stock_mm)
    {
        let largest_n = varying.check.largest_n.0.max(varying.check.links_n.0).max(reference_n);
        let met = Met::by(&varying.text, dialect, job, &beside)?.said(check::HELD * largest_n);
        if around.is_left {
            varying.check.events.extend(met);
        } else {
            notes.extend(met.map(|met| format!("{met}: {CLEAR_IT}")));
        }
    }
    Ok(Answer { tool: tool.number, rps, reference_n, bounds, varying, constant, least_s, prices, left_out, notes })
}

/// What to do about raw stock beside the surface.
const CLEAR_IT: &str =
    "clear it first, and give what then is left as [stock] saved = …, or mesh and stock of the whole part";

/// Most plans, each for a limit lower where the written passes of the one before exceed the one that is asked for, by as much; of these the
/// one that exceeds it least is written. And most plans of a constant step-over.
const PLANS: u32 = 3;

/// A place rotated about Z, counter-clockwise.
fn rotated(p: Vec3, angle_rad: f64) -> Vec3 {
    let (sin, cos) = angle_rad.sin_cos();
    Vec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z)
}

/// A plan with the scallops of the written passes, its motions, their text before the feeds are set, and what they leave on the surface.
struct Drawn {
    plan: Plan,
    steps: Vec<Step>,
    text: String,
    left: Left,
}

/// Time on the passes at the feeds of their spots, s.
pub fn cutting_s(plan: &Plan) -> f64 {
    let time =
        |two: &[Spot]| (two[1].tip - two[0].tip).norm() * 0.5 * (two[0].feed_mm_s.recip() + two[1].feed_mm_s.recip());
    plan.passes.iter().flat_map(|pass| &pass.stretches).flat_map(|stretch| stretch.windows(2)).map(time).sum()
}

/// Do the passes lie in planes in which the control has arcs? Straight ones along X or Y lie in a vertical plane, those
/// of one height in a horizontal one.
fn arcs(dialect: Dialect, layout: &Layout) -> bool {
    let Layout::Parallel { direction_rad, turn_rad } = layout else { return text::has_arcs(dialect, Plane::Xy) };
    let (sin, cos) = direction_rad.sin_cos();
    let plane = if sin.abs() < cos.abs() { Plane::Zx } else { Plane::Yz };
    *turn_rad == 0.0 && sin.abs().min(cos.abs()) < 1e-9 && text::has_arcs(dialect, plane)
}

/// Safe height of rapids above surface and fixtures, and stock whose shape the setup itself gives, mm.
fn safe(surface: &Surface, job: &Job, stock_mm: f64) -> f64 {
    let tops = job.stocks.iter().map(|stock| match &stock.shape {
        StockShape::Box(extent) => extent.max.z,
        StockShape::Cylinder { z_mm, .. } => z_mm[0].max(z_mm[1]),
        // Of stock from a file the top comes with it.
        StockShape::Stl(_) | StockShape::Saved(_) => f64::NEG_INFINITY,
    });
    let tops = tops.chain(job.fixtures.iter().map(|fixture| fixture.max.z));
    tops.fold(surface.extent.max.z + stock_mm, f64::max) + ABOVE_MM
}
