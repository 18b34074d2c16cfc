//! What a plan of varying step-over found, as JSON and as text on the screen. In: an [`Answer`]. Out: text.

use super::marks::WRITTEN_BY;
use super::number::{clock, short};
use crate::finish::stepover::Answer;
use crate::finish::stepover::job::{LeftOut, Program, cutting_s};
use crate::finish::stepover::passes::{Constant, Pass, Spot, StepLimit};
use crate::units::{mm_min_from_mm_s, rpm_from_rps};
use serde::Serialize;
use std::fmt::Write;

#[derive(Serialize)]
struct Report {
    written_by: &'static str,
    tool: u32,
    spindle_rpm: f64,
    reference_n: f64,
    scallop_limit_mm: f64,
    step_over_bounds_mm: [f64; 2],
    varying: Side,
    constant: Option<ConstantSide>,
    /// Time against constant step-over, %.
    saved_percent: Option<f64>,
    price: Price,
    /// Of passes of one height alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    left_out: Option<Left>,
    passes: Vec<PassRow>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct Price {
    s_per_n: f64,
    s_per_um: f64,
}

/// What passes of one height leave out.
#[derive(Serialize)]
struct Left {
    shallower_than_deg: f64,
    shallow_mm2: f64,
    shallow_percent: f64,
    strips_mm2: f64,
}

#[derive(Serialize)]
struct ConstantSide {
    step_over_mm: f64,
    /// "seen from above", "along the surface" or "downwards".
    measured: &'static str,
    feed_mm_min: f64,
    #[serde(flatten)]
    side: Side,
}

#[derive(Serialize)]
struct Side {
    passes: usize,
    motions: usize,
    time_s: f64,
    cutting_s: f64,
    scallop_max_mm: f64,
    /// Share of the path on which it is beyond its limit, %.
    scallop_beyond_percent: f64,
    predicted: Predicted,
    /// Left out for constant step-over: it is not run.
    #[serde(skip_serializing_if = "Option::is_none")]
    simulated: Option<Simulated>,
}

#[derive(Serialize)]
struct Predicted {
    force_max_n: f64,
    least: Option<Least>,
    /// Share of the path that each bound holds.
    bound_by_percent: Vec<(&'static str, f64)>,
}

/// Least times, and how far above each the time on the passes and that of the whole program lie.
#[derive(Serialize)]
struct Least {
    laid_alike_s: f64,
    any_passes_s: f64,
    cutting_above_percent: [f64; 2],
    program_above_percent: [f64; 2],
}

#[derive(Serialize)]
struct Simulated {
    force_max_n: f64,
    force_max_line: u32,
    force_p99_n: f64,
    links_force_max_n: f64,
    contact_mm: f64,
    force_bound_mm: f64,
    within_10_percent: f64,
    mean_ratio: f64,
    events: Vec<String>,
}

#[derive(Serialize)]
struct PassRow {
    pass: usize,
    /// Height of the tip where it is one throughout.
    #[serde(skip_serializing_if = "Option::is_none")]
    z_mm: Option<f64>,
    feed_mm_min: [f64; 2],
    length_mm: f64,
    step_over_mm: [f64; 2],
    force_n: [f64; 2],
    scallop_mm: [f64; 2],
    simulated_force_max_n: f64,
}

fn name(limit: StepLimit) -> &'static str {
    match limit {
        StepLimit::Force => "force",
        StepLimit::Scallop => "scallop",
        StepLimit::Largest => "largest step-over",
        StepLimit::Least => "least step-over",
        StepLimit::Neighbours => "rest of the pass",
        StepLimit::Edge => "edge",
    }
}

/// A constant step-over, mm, and how it is measured.
fn measured(step: Constant) -> (f64, &'static str) {
    match step {
        Constant::Above(step) => (step, "seen from above"),
        Constant::Along(step) => (step, "along the surface"),
        Constant::Down(step) => (step, "downwards"),
    }
}

fn spots(passes: &[Pass]) -> impl Iterator<Item = &Spot> {
    passes.iter().flat_map(|pass| pass.stretches.iter().flatten())
}

fn largest(passes: &[Pass], of: impl Fn(&Spot) -> f64) -> f64 {
    spots(passes).map(of).fold(0.0, f64::max)
}

/// Ratio of a scallop to its limit from which the limit counts as broken: the step-over is found to a thousandth of its range, the scallop
/// of a ball grows with its square.
const SCALLOP_SLACK: f64 = 1.02;

/// Is a scallop beyond its limit?
fn is_beyond(scallop_mm: f64, limit_mm: f64) -> bool {
    scallop_mm > SCALLOP_SLACK * limit_mm
}

fn side(program: &Program, scallop_limit_mm: f64, least_s: Option<[f64; 2]>) -> Side {
    let (plan, check) = (&program.plan, &program.check);
    let beyond = |spot: &&Spot| is_beyond(spot.scallop_mm, scallop_limit_mm);
    let all = spots(&plan.passes).count().max(1) as f64;
    let share = |limit: StepLimit| 100.0 * spots(&plan.passes).filter(|spot| spot.limit == limit).count() as f64 / all;
    let limits = [
        StepLimit::Force,
        StepLimit::Scallop,
        StepLimit::Largest,
        StepLimit::Least,
        StepLimit::Neighbours,
        StepLimit::Edge,
    ];
    let cutting = cutting_s(plan);
    Side {
        passes: plan.passes.iter().filter(|pass| !pass.stretches.is_empty()).count(),
        motions: program.steps.len(),
        time_s: check.time_s,
        cutting_s: cutting,
        scallop_max_mm: largest(&plan.passes, |spot| spot.scallop_mm),
        scallop_beyond_percent: 100.0 * spots(&plan.passes).filter(beyond).count() as f64 / all,
        predicted: Predicted {
            force_max_n: largest(&plan.passes, |spot| spot.force_n),
            least: least_s.map(|[along_s, any_s]| {
                let above = |time_s: f64, least_s: f64| 100.0 * (time_s / least_s.max(1e-9) - 1.0);
                Least {
                    laid_alike_s: along_s,
                    any_passes_s: any_s,
                    cutting_above_percent: [above(cutting, along_s), above(cutting, any_s)],
                    program_above_percent: [above(check.time_s, along_s), above(check.time_s, any_s)],
                }
            }),
            bound_by_percent: limits.into_iter().map(|limit| (name(limit), share(limit))).collect(),
        },
        simulated: least_s.map(|_| Simulated {
            force_max_n: check.largest_n.0,
            force_max_line: check.largest_n.1,
            force_p99_n: check.p99_n,
            links_force_max_n: check.links_n.0,
            contact_mm: check.contact_mm,
            force_bound_mm: check.bound_mm,
            within_10_percent: 100.0 * check.within_10_percent,
            mean_ratio: check.mean_ratio,
            events: check.events.clone(),
        }),
    }
}

fn row(number: usize, pass: &Pass, simulated: [f64; 2]) -> PassRow {
    let range = |of: &dyn Fn(&Spot) -> f64| {
        let values = pass.stretches.iter().flatten().map(of);
        values.fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], x| [low.min(x), high.max(x)])
    };
    let length = |stretch: &Vec<Spot>| stretch.windows(2).map(|two| (two[1].tip - two[0].tip).norm()).sum::<f64>();
    PassRow {
        pass: number + 1,
        z_mm: pass.level_mm,
        feed_mm_min: range(&|spot| mm_min_from_mm_s(spot.feed_mm_s)),
        length_mm: pass.stretches.iter().map(length).sum(),
        step_over_mm: range(&|spot| spot.step_mm),
        force_n: range(&|spot| spot.force_n),
        scallop_mm: range(&|spot| spot.scallop_mm),
        simulated_force_max_n: simulated[1],
    }
}

fn left(left: &LeftOut) -> Left {
    Left {
        shallower_than_deg: left.shallowest_rad.to_degrees(),
        shallow_mm2: left.shallow_mm2,
        shallow_percent: 100.0 * left.shallow_mm2 / left.machined_mm2.max(f64::MIN_POSITIVE),
        strips_mm2: left.strips_mm2,
    }
}

/// Time that is saved against constant step-over, %.
fn saved(answer: &Answer) -> Option<f64> {
    let rival = answer.constant.as_ref()?;
    Some(100.0 * (1.0 - answer.varying.check.time_s / rival.program.check.time_s))
}

/// The report as JSON.
pub fn stepover_json(answer: &Answer) -> String {
    let varying = &answer.varying;
    let simulated = |k: usize| varying.check.by_pass.get(k).copied().unwrap_or_default();
    let passes = varying.plan.passes.iter().enumerate().filter(|(_, pass)| !pass.stretches.is_empty());
    let constant = answer.constant.as_ref().map(|rival| {
        let (step_over_mm, measured) = measured(rival.step);
        let feed_mm_min = mm_min_from_mm_s(rival.feed_mm_s);
        ConstantSide { step_over_mm, measured, feed_mm_min, side: side(&rival.program, answer.bounds.scallop_mm, None) }
    });
    let report = Report {
        written_by: WRITTEN_BY,
        tool: answer.tool,
        spindle_rpm: rpm_from_rps(answer.rps),
        reference_n: answer.reference_n,
        scallop_limit_mm: answer.bounds.scallop_mm,
        step_over_bounds_mm: [answer.bounds.least_mm, answer.bounds.largest_mm],
        varying: side(varying, answer.bounds.scallop_mm, Some(answer.least_s)),
        constant,
        saved_percent: saved(answer),
        price: Price { s_per_n: answer.prices[0], s_per_um: answer.prices[1] },
        left_out: answer.left_out.as_ref().map(left),
        passes: passes.map(|(k, pass)| row(k, pass, simulated(k))).collect(),
        notes: answer.notes.clone(),
    };
    serde_json::to_string_pretty(&report).map_or_else(|_| String::new(), |text| text + "\n")
}

/// Where the scallop limit does not hold.
fn beyond_words(whole: &Side) -> String {
    if whole.scallop_beyond_percent > 0.0 {
        format!(", beyond its limit on {:.1} % of the way: look at the page (--report)", whole.scallop_beyond_percent)
    } else {
        String::new()
    }
}

/// The report on the screen.
pub fn stepover_words(answer: &Answer) -> String {
    let whole = side(&answer.varying, answer.bounds.scallop_mm, Some(answer.least_s));
    let mut text = String::new();
    for note in &answer.notes {
        let _ = writeln!(text, "note      {note}");
    }
    let _ = writeln!(
        text,
        "passes    {}, {} of cutting at the feeds, {} in all",
        whole.passes,
        clock(whole.cutting_s),
        clock(whole.time_s)
    );
    if let Some(least) = &whole.predicted.least {
        let _ = writeln!(
            text,
            "least     {} for any passes laid like these (cutting is {:.1} % above it, the program {:.1} %), {} for any at all",
            clock(least.laid_alike_s),
            least.cutting_above_percent[0],
            least.program_above_percent[0],
            clock(least.any_passes_s)
        );
    }
    let by: Vec<String> = whole
        .predicted
        .bound_by_percent
        .iter()
        .filter(|(_, percent)| *percent > 0.05)
        .map(|(name, percent)| format!("{name} {percent:.1} %"))
        .collect();
    let _ = writeln!(text, "bounds    {}", by.join(", "));
    if let Some(simulated) = &whole.simulated {
        let _ = writeln!(
            text,
            "simulated {} N at most on passes (line {}), 99 % of them below {} N, on leads and links {} N; reference {} N",
            short(simulated.force_max_n),
            simulated.force_max_line,
            short(simulated.force_p99_n),
            short(simulated.links_force_max_n),
            short(answer.reference_n)
        );
        if simulated.force_bound_mm > 0.0 {
            let _ = writeln!(
                text,
                "          where the force bounds the step-over: mean {:.1} % of the reference, within 10 % of it on {:.1} % of {} mm",
                100.0 * simulated.mean_ratio,
                simulated.within_10_percent,
                short(simulated.force_bound_mm)
            );
        }
    }
    let _ = writeln!(text, "scallop   {:.4} mm at most{}", whole.scallop_max_mm, beyond_words(&whole));
    if let Some(Left { shallower_than_deg, shallow_mm2, shallow_percent, strips_mm2 }) =
        answer.left_out.as_ref().map(left)
    {
        let _ = writeln!(
            text,
            "left out  {shallow_mm2:.1} mm2 ({shallow_percent:.1} %) of the surface, shallower than {shallower_than_deg:.1} degrees: add \
             parallel passes there; and {strips_mm2:.1} mm2 of strips at its ends, narrower than a step"
        );
    }
    if let (Some(rival), Some(percent)) = (&answer.constant, saved(answer)) {
        let (step_mm, measured) = measured(rival.step);
        let _ = writeln!(
            text,
            "constant  {step_mm:.3} mm {measured} keeps force and scallop everywhere: {}, {} passes; varying takes {:.1} % {}",
            clock(rival.program.check.time_s),
            rival.program.plan.passes.iter().filter(|pass| !pass.stretches.is_empty()).count(),
            percent.abs(),
            if percent < 0.0 { "more" } else { "less" }
        );
    }
    let _ = writeln!(text, "prices    {:+.2} s per N, {:+.2} s per um of scallop", answer.prices[0], answer.prices[1]);
    for event in answer.varying.check.events.iter().take(5) {
        let _ = writeln!(text, "event     {event}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scallop_is_beyond_its_limit_from_a_fiftieth_above_it() {
        assert!(!is_beyond(0.0101, 0.01) && is_beyond(0.0103, 0.01));
    }
}
