//! Do setup and program belong together? In: toolpath, engagement, job. Out: a diagnostic for each of [`CHECKS`] that fails, before anything is
//! written. Most are warnings. Where nearly nothing of the program touches the stock, no prediction holds: that is an error, no feed is raised
//! and nothing is written.
//!
//! Load limits far above every load are found elsewhere ([`crate::schedule::idle_limits`]).

use crate::diag::{Diagnostic, Severity};
use crate::engage::EngagementMap;
use crate::ids::MoveId;
use crate::machine::material::ForceModel;
use crate::machine::{Job, LimitKind, Material, Shape, StockShape, Tool};
use crate::nc::{Move, MoveKind, Toolpath};
use crate::path::Vec3;
use crate::report::short;
use crate::schedule::{Bound, NotRaised, Problem};
use crate::units::{MM_PER_INCH, rpm_from_rps};

/// What is looked at.
pub struct Simulation<'a> {
    /// What the program does.
    pub toolpath: &'a Toolpath,
    /// What the cutter meets.
    pub map: &'a EngagementMap,
    /// The setup.
    pub job: &'a Job,
}

/// What was found: a sentence, and the line where it shows, if it does on one.
type Finding = (String, Option<u32>);

/// One check.
pub struct Check {
    code: &'static str,
    severity: Severity,
    find: fn(&Simulation) -> Vec<Finding>,
    help: &'static str,
}

/// All of them.
pub const CHECKS: [Check; 8] = [
    Check {
        code: "plausible::units",
        severity: Severity::Warning,
        find: units,
        help: "check `units` in the setup and G20/G21 in the program: one of them is in inches, it seems",
    },
    Check {
        code: "plausible::feed-per-tooth",
        severity: Severity::Warning,
        find: feed_per_tooth,
        help: "check diameter, flutes and units of the tool, and F and S of the program",
    },
    Check {
        code: "plausible::stock-size",
        severity: Severity::Warning,
        find: stock_size,
        help: "check `units` in the setup and the numbers of [stock]",
    },
    Check {
        code: "plausible::coefficient",
        severity: Severity::Warning,
        find: coefficients,
        help: "coefficients are in N/mm² (k_tc) and N/mm (k_te): check their unit, or calibrate",
    },
    Check {
        code: NO_CHIP_TERM,
        severity: Severity::Warning,
        find: no_chip_term,
        help: "nothing is raised: learn or calibrate from cuts at larger feeds per tooth as well",
    },
    Check {
        code: "plausible::limit-below-tare",
        severity: Severity::Warning,
        find: below_tare,
        help: "the limit is power at the motor shaft, tare included: raise it, or correct machine.spindle.tare",
    },
    Check {
        code: "plausible::idle-tool",
        severity: Severity::Warning,
        find: idle_tools,
        help: "check its length offset, its diameter, and whether the stock still is where it works",
    },
    Check {
        code: "engage::misses",
        severity: Severity::Error,
        find: misses,
        help: "check [stock], its offset and its units: are its coordinates those of the program, with Z up?",
    },
];

/// How far a ratio of sizes may be from 25.4, either way, and still count as a mix-up of units: a program reaches 0.7 to 1.5
/// times as far as its stock (lead-ins, a pocket in the middle).
pub const UNIT_SLACK: f64 = 1.5;
/// Feed per tooth over diameter. Tool makers' tables lie between 0.002 and 0.05, high-feed mills reach 0.15; inches taken for
/// millimetres make 25 times as much.
pub const FEED_PER_TOOTH: f64 = 0.25;
/// Volume of stock, mm³: a cubic metre, 2.7 t of aluminium.
pub const STOCK_MM3: f64 = 1e9;
/// Plausible tangential cutting coefficients, N/mm²: from a tenth of the library's softest metal (plastics and wood are above that) to twice its
/// hardest steel. Values above 50,000 are refused by the setup.
pub const K_TC_N_MM2: [f64; 2] = [55.0, 20_000.0];
/// Factor between the coefficients of a tool and of its stock from which on one of them must be wrong.
pub const TIMES: f64 = 10.0;
/// Least share of the feed motion that is in the stock. Real programs have 0.78 to 0.97; with a wrong zero 0.02 has been seen.
pub const MEETS: f64 = 0.02;

const NO_CHIP_TERM: &str = "plausible::no-chip-term";

/// Diagnostics of all checks that fail.
pub fn implausible(seen: &Simulation) -> Vec<Diagnostic> {
    let said = |check: &Check| {
        let one = |(text, line): Finding| {
            let said = Diagnostic::new(check.code, check.severity, text).help(check.help);
            Diagnostic { line, ..said }
        };
        (check.find)(seen).into_iter().map(one).collect::<Vec<_>>()
    };
    CHECKS.iter().flat_map(said).collect()
}

/// Is there a diagnostic after which no feed may be raised: the program hardly touches its stock, or the force does not depend on the feed?
pub fn allow_no_rise(diagnostics: &[Diagnostic]) -> bool {
    diagnostics.iter().any(|said| ["engage::untouched", "engage::misses", NO_CHIP_TERM].contains(&said.code))
}

/// Keeps every feed at or below the programmed one, in air too.
pub fn raise_nothing(problem: &mut Problem) {
    for node in problem.nodes.iter_mut().filter(|node| node.free) {
        node.not_raised = node.not_raised.or(Some(NotRaised::Uncertain));
        if node.cap.feed_mm_s > node.programmed_mm_s {
            node.cap = Bound { feed_mm_s: node.programmed_mm_s, kind: LimitKind::Programmed, per_unit: 0.0 };
        }
        node.floor.feed_mm_s = node.floor.feed_mm_s.min(node.cap.feed_mm_s);
    }
}

fn feeds<'a>(seen: &'a Simulation) -> impl Iterator<Item = (MoveId, &'a Move)> {
    seen.toolpath.iter_moves().filter(|(_, motion)| motion.kind == MoveKind::Feed)
}

/// Length of a move that cuts, mm.
fn cut_mm(seen: &Simulation, id: MoveId) -> f64 {
    let cuts = seen.map.stations_of(id).iter().filter(|station| station.arc_count > 0);
    cuts.map(crate::engage::Station::length_mm).sum()
}

/// Extent of box or cylinder, mm.
fn extent(shape: &StockShape) -> Option<Vec3> {
    match shape {
        StockShape::Box(of) => Some(of.max - of.min),
        StockShape::Cylinder { diameter_mm, z_mm, .. } => {
            Some(Vec3::new(*diameter_mm, *diameter_mm, z_mm[1] - z_mm[0]))
        }
        _ => None,
    }
}

/// Extent of the feed motion, mm.
fn reach(seen: &Simulation) -> Option<Vec3> {
    let ends = feeds(seen).flat_map(|(_, motion)| [motion.curve().from(), motion.curve().to()]);
    let spans = ends.fold(None, |known: Option<(Vec3, Vec3)>, at| {
        Some(known.map_or((at, at), |(low, high)| (low.inf(&at), high.sup(&at))))
    });
    spans.map(|(low, high)| high - low)
}

fn units(seen: &Simulation) -> Vec<Finding> {
    let [stock] = &seen.job.stocks[..] else { return Vec::new() };
    let (Some(stock), Some(reach)) = (extent(&stock.shape), reach(seen)) else { return Vec::new() };
    let ratio = |axis: usize| reach[axis] / stock[axis];
    let times = |axis: usize| (MM_PER_INCH / UNIT_SLACK..=MM_PER_INCH * UNIT_SLACK).contains(&ratio(axis));
    let part = |axis: usize| (1.0 / UNIT_SLACK..=UNIT_SLACK).contains(&(ratio(axis) * MM_PER_INCH));
    // A small feature on a large plate is as small across, but not as shallow.
    let shallow = ratio(2) < 2.0 / MM_PER_INCH;
    let text = if times(0) && times(1) {
        "the program reaches about 25.4 times as far as the stock"
    } else if part(0) && part(1) && shallow {
        "the stock is about 25.4 times as large as the program reaches"
    } else {
        return Vec::new();
    };
    let size = |of: Vec3| format!("{:.1} × {:.1} mm", of.x, of.y);
    vec![(format!("{text}: {} of motion, {} of stock", size(reach), size(stock)), None)]
}

fn feed_per_tooth(seen: &Simulation) -> Vec<Finding> {
    let plain = |tool: &&Tool| matches!(tool.shape, Shape::Flat | Shape::Ball | Shape::Bull | Shape::Drill);
    let mut found: Vec<(u32, Finding)> = Vec::new();
    for (id, motion) in feeds(seen) {
        let Some(tool) = seen.job.tool(motion.tool).filter(plain) else { continue };
        let per_tooth_mm = motion.feed.mm_s / (motion.spin.rps * f64::from(tool.flutes.max(1)));
        let told = found.iter().any(|(number, _)| *number == tool.number);
        let beyond = per_tooth_mm.is_finite() && per_tooth_mm > FEED_PER_TOOTH * tool.diameter_mm;
        if !told && beyond && cut_mm(seen, id) > 0.0 {
            let text = format!(
                "T{} of {} mm cuts with {per_tooth_mm:.3} mm a tooth: that is no milling feed",
                tool.number, tool.diameter_mm
            );
            found.push((tool.number, (text, Some(motion.line))));
        }
    }
    found.into_iter().map(|(_, found)| found).collect()
}

fn stock_size(seen: &Simulation) -> Vec<Finding> {
    let volume_mm3 = seen.map.initial_mm3;
    let text = format!("the stock is {:.1} cubic metres", volume_mm3 / 1e9);
    if volume_mm3 > STOCK_MM3 { vec![(text, None)] } else { Vec::new() }
}

fn k_tc(material: &Material) -> Option<f64> {
    match &material.model {
        ForceModel::LinearEdge(k) => Some(k.k_tc),
        ForceModel::Named { .. } => None,
    }
}

fn coefficients(seen: &Simulation) -> Vec<Finding> {
    let [low, high] = K_TC_N_MM2;
    let mut found = Vec::new();
    let stocks = seen.job.stocks.iter().map(|stock| ("the stock".to_owned(), &stock.material));
    let tools = seen.job.tools.iter();
    let own = tools.filter_map(|tool| Some((format!("T{}", tool.number), tool.coefficients.as_ref()?)));
    for (whose, material) in stocks.chain(own) {
        let Some(k_tc) = k_tc(material).filter(|k_tc| !(low..=high).contains(k_tc)) else { continue };
        found.push((
            format!("k_tc of {whose} is {} N/mm²: what is machined lies between {low:.0} and {high:.0}", short(k_tc)),
            None,
        ));
    }
    let family = seen.job.stocks.first().and_then(|stock| k_tc(&stock.material));
    for tool in &seen.job.tools {
        let (Some(own), Some(family)) = (tool.coefficients.as_ref().and_then(k_tc), family) else { continue };
        if own >= TIMES * family || own <= family / TIMES {
            let text = format!("k_tc of T{} is {own:.0} N/mm², that of the stock {family:.0}", tool.number);
            found.push((text, None));
        }
    }
    found
}

/// A model with edge forces only, as it comes from cuts with chips of a few µm, would allow any feed.
fn no_chip_term(seen: &Simulation) -> Vec<Finding> {
    let none = |model: &ForceModel| matches!(model, ForceModel::LinearEdge(k) if k.k_tc == 0.0);
    let stocks = seen.job.stocks.iter().map(|stock| ("the stock".to_owned(), &stock.material.model));
    let own = seen.job.tools.iter().filter_map(|t| Some((format!("T{}", t.number), &t.coefficients.as_ref()?.model)));
    let found: Vec<(String, &ForceModel)> = match &seen.job.process.base {
        Some(base) => vec![("the model".to_owned(), base)],
        None => stocks.chain(own).collect(),
    };
    let said = |(whose, _): (String, &ForceModel)| {
        (format!("k_tc of {whose} is 0: its force does not grow with the feed"), None)
    };
    found.into_iter().filter(|(_, model)| none(model)).map(said).collect()
}

fn below_tare(seen: &Simulation) -> Vec<Finding> {
    let mut found: Vec<(u32, Finding)> = Vec::new();
    let of_tool = |tool: &Tool| Some((tool.number, seen.job.limits.overridden_by(&tool.limits).power_w?));
    let limits_w: Vec<(u32, f64)> = seen.job.tools.iter().filter_map(of_tool).collect();
    for (id, motion) in feeds(seen) {
        let Some((tool, limit_w)) = limits_w.iter().copied().find(|(number, _)| *number == motion.tool) else {
            continue;
        };
        let tare_w = seen.job.machine.spindle.tare_w.at(motion.spin.rps);
        let told = found.iter().any(|(number, _)| *number == tool);
        if !told && motion.spin.rps > 0.0 && limit_w <= tare_w && cut_mm(seen, id) > 0.0 {
            let text = format!(
                "the power limit of T{tool}, {limit_w:.0} W, is not above the {tare_w:.0} W that the spindle takes in air at {:.0} \
                 rev/min",
                rpm_from_rps(motion.spin.rps)
            );
            found.push((tool, (text, Some(motion.line))));
        }
    }
    found.into_iter().map(|(_, found)| found).collect()
}

fn idle_tools(seen: &Simulation) -> Vec<Finding> {
    let mut tools: Vec<(u32, u32, bool)> = Vec::new();
    for (id, motion) in feeds(seen) {
        if seen.job.tool(motion.tool).is_none_or(Tool::is_frozen) {
            continue;
        }
        let cuts = cut_mm(seen, id) > 0.0;
        match tools.iter_mut().find(|(number, ..)| *number == motion.tool) {
            Some((_, _, known)) => *known |= cuts,
            None => tools.push((motion.tool, motion.line, cuts)),
        }
    }
    // Where nothing cuts at all that is said instead.
    let some_cut = tools.iter().any(|(_, _, cuts)| *cuts);
    let idle = tools.into_iter().filter(|(_, _, cuts)| some_cut && !cuts);
    idle.map(|(number, line, _)| (format!("T{number} moves at feed from here on and never cuts"), Some(line))).collect()
}

fn misses(seen: &Simulation) -> Vec<Finding> {
    let (mut feed_mm, mut met_mm, mut first) = (0.0, 0.0, None);
    for (id, motion) in feeds(seen) {
        if seen.job.tool(motion.tool).is_some_and(Tool::is_frozen) {
            continue;
        }
        feed_mm += motion.curve().length();
        met_mm += cut_mm(seen, id);
        first = first.or(Some(motion.line));
    }
    // A stock that is never touched is said elsewhere.
    if met_mm <= 0.0 || met_mm >= MEETS * feed_mm {
        return Vec::new();
    }
    let share = 100.0 * met_mm / feed_mm;
    vec![(format!("stock and program do not meet: only {share:.1} % of the feed motion cuts"), first)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setup::library;

    #[test]
    fn the_range_of_coefficients_is_that_of_the_library() {
        let k_tc = |entry: library::MaterialEntry| {
            let keys = entry.keys();
            keys.iter().find(|(key, _)| key == "k_tc").and_then(|(_, value)| value.parse::<f64>().ok())
        };
        let all: Vec<f64> = library::materials().into_iter().filter_map(k_tc).collect();
        let (least, most) = all.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), k| (low.min(*k), high.max(*k)));
        let [low, high] = K_TC_N_MM2;
        assert!(all.len() > 10, "{all:?}");
        assert!((10.0..15.0).contains(&(least / low)) && (2.0..3.0).contains(&(high / most)), "{least} {most}");
    }
}
