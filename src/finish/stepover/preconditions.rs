//! What must hold before passes are planned, and what is said where it does not. In: the surface, the job, a request. Out: tool, speed, feeds
//! and notes; or a refusal.

use super::layout::Layout;
use super::left::Places;
use super::plan::Plan;
use super::reach::{Bounds, Place, ToolOnSurface};
use super::request::{LeftOut, Refusal, Request};
use super::shape::Shape;
use super::surface::Surface;
use super::text;
use crate::machine::limits::FEED_CHANGE_MIN;
use crate::machine::{Box3, Job, StockShape, Tool};
use crate::path::Vec3;

/// Share of the tolerance of lines and arcs by which the scallop limit of the first plan of passes of one height is below the one that is
/// asked for. Passes off the surface by the tolerance leave scallops higher by as much, but few are off by all of it. Those side by side are
/// laid as they will be written.
const BELOW: f64 = 0.25;

/// Number of feeds to choose from, each 2.8 % above the one before: with ten, 20 % apart, a cylinder at 6 N took 0.6 % longer to cut.
const FEEDS: u32 = 60;
/// The same for passes of one height.
const FEW_FEEDS: u32 = 10;

/// Range of the ratio of sizes of surface and stock, either way, that suggests inches taken for millimetres (25.4).
const INCHES: [f64; 2] = [12.0, 50.0];

/// Share of the machined area that the tool has to reach: with less it is the wrong one. Judgement.
const REACHED: f64 = 0.5;

/// How far the scallop limit of the first plan is below the one that is asked for, mm. An error if that leaves nothing.
pub fn below_mm(ask: &Request) -> Result<f64, Refusal> {
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
    Ok(if matches!(ask.layout, Layout::Contour { .. }) { below_mm } else { 0.0 })
}

/// An error if coordinates are written no finer than the tolerance.
pub fn tolerable(tolerance_mm: f64, inch: bool) -> Result<(), Refusal> {
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

/// Area that passes of one height leave out, without strips; an error if that is everything.
pub fn left_out(surface: &Surface, layout: &Layout) -> Result<Option<LeftOut>, Refusal> {
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

/// A note on gaps of the surface that the tool passes over; an error if it would sink into one.
pub fn closed(surface: &Surface, shape: Shape, tolerance_mm: f64) -> Result<Option<String>, Refusal> {
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
pub fn thickest(on_surface: &ToolOnSurface, places: &[Place], most_mm: f64) -> Result<f64, Refusal> {
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
            "rough the part first, and give what that leaves; --stock says how thick it is on the surface, not beside it",
        ));
    }
    Ok(thickest)
}

/// A note if the reference force is exceeded at the least step-over in places; an error if that is most of the surface.
pub fn within_reach(plan: &Plan, reference_n: f64, bounds: &Bounds) -> Result<Option<String>, Refusal> {
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

/// The tool that is asked for, or the only one of the setup that can do it.
pub fn tool<'a>(job: &'a Job, ask: &Request) -> Result<&'a Tool, Refusal> {
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

/// Its speed, rev/s.
pub fn speed(job: &Job, tool: &Tool, ask: &Request) -> Result<f64, Refusal> {
    let of_setup = job.machine.unsaid.speeds_rps.iter().find(|(number, _)| *number == tool.number).map(|(_, rps)| *rps);
    ask.rps
        .or(of_setup)
        .ok_or_else(|| Refusal::new("there is no spindle speed", "give --rpm, or rpm in the tool's table of the setup"))
}

/// Feeds to choose from, mm/s: a geometric series up to the requested one, or to what the setup allows. For passes of one height the requested
/// one alone: at lower feeds their force is within 10 % of the reference on less of their length (on a dome on less than 95 %).
pub fn feeds(job: &Job, tool: &Tool, rps: f64, ask: &Request) -> Result<Vec<f64>, Refusal> {
    let of_one_height = matches!(ask.layout, Layout::Contour { .. });
    if let Some(feed) = ask.feed_mm_s.filter(|_| of_one_height) {
        return Ok(vec![feed]);
    }
    let limits = job.limits.overridden_by(&tool.limits);
    let per_tooth = rps * f64::from(tool.flutes);
    let tops = [
        limits.feed_max_mm_s,
        limits.chip_thickness_max_mm.map(|h| h * per_tooth),
        limits.feed_per_tooth_max_mm.map(|f| f * per_tooth),
    ];
    let Some(top) = ask.feed_mm_s.or(tops.into_iter().flatten().reduce(f64::min)) else {
        return Err(Refusal::new(
            "the greatest feed of the tool is not known",
            "give --feed, or in [limits] feed = { max = … } or chip_thickness = { max = … }",
        ));
    };
    let floor = limits.feed_min_mm_s.unwrap_or(0.0);
    let count = if of_one_height { FEW_FEEDS } else { FEEDS };
    let feeds = (0..count).map(|k| top * FEED_CHANGE_MIN.powf(1.0 - f64::from(k) / f64::from(count - 1)));
    Ok(feeds.filter(|feed| *feed >= floor.min(top)).collect())
}

/// An error if the surface and the stock of the setup differ in size like inches and millimetres, or do not overlap.
pub fn size(surface: &Surface, job: &Job) -> Result<(), Refusal> {
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

/// A note on the area that the tool is too large for; an error if that is most of the surface.
pub fn reachable(places: &Places, shape: Shape, tolerance_mm: f64) -> Result<Option<String>, Refusal> {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A limit of a quarter of the tolerance leaves no scallop to plan for; a little more leaves that little.
    #[test]
    fn the_first_plan_is_for_a_scallop_lower_by_a_quarter_of_the_tolerance() {
        let ask = |scallop_mm| Request {
            name: String::new(),
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
