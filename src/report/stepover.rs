//! What a plan of varying step-over found, as JSON and as text on the screen. In: an [`Answer`]. Out: text.

use super::marks::WRITTEN_BY;
use super::number::{clock, short};
use crate::finish::stepover::Answer;
use crate::finish::stepover::check::HELD;
use crate::finish::stepover::job::{LeftOut, Program, Rival, cutting_s};
use crate::finish::stepover::left::Left;
use crate::finish::stepover::passes::Constant;
use crate::finish::stepover::plan::{Pass, Plan, Spot, StepLimit, is_beyond};
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
    left_out: Option<LeftOutRow>,
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
struct LeftOutRow {
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
    simulated: Simulated,
    /// What it leaves on the surface where the tool reaches it; of passes of one height, where it is steep enough.
    left: LeftOnSurface,
    /// What it does not hold of force and scallop, and what it leaves out, one sentence each.
    unmet: Vec<String>,
}

/// What passes leave on the surface, measured on the surface.
#[derive(Serialize)]
struct LeftOnSurface {
    reached_mm2: f64,
    /// Area with more than the scallop limit.
    beyond_mm2: f64,
    beyond_percent: f64,
    /// Area that no pass cuts.
    uncut_mm2: f64,
    height_max_mm: f64,
    height_max_at_mm: [f64; 3],
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
    links_force_max_line: u32,
    /// Length on which the force is above the reference by more than 1 %, leads and links included, mm.
    force_beyond_mm: f64,
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

/// What a program does not hold of the reference force and the scallop limit, one sentence each. Feeds have been lowered as far as they may.
fn unmet(program: &Program, answer: &Answer) -> Vec<String> {
    let (plan, check, limit_mm) = (&program.plan, &program.check, answer.bounds.scallop_mm);
    let mut unmet = Vec::new();
    let (force_n, line) = if check.links_n.0 > check.largest_n.0 { check.links_n } else { check.largest_n };
    if force_n > HELD * answer.reference_n {
        unmet.push(format!(
            "the reference of {} N is not held: {} N at most (line {line}), above it on {:.1} mm; feeds are not lowered further for it",
            short(answer.reference_n),
            short(force_n),
            check.beyond_mm
        ));
    }
    let scallop_mm = largest(&plan.passes, |spot| spot.scallop_mm);
    if is_beyond(scallop_mm, limit_mm) {
        unmet.push(format!(
            "the scallop limit of {limit_mm} mm is not held: {scallop_mm:.4} mm at most, beyond it on {:.1} % of the way",
            beyond_percent(plan, limit_mm)
        ));
    }
    let left = &program.left;
    if left.beyond_mm2 > 0.0 {
        unmet.push(format!(
            "more than the scallop limit of {limit_mm} mm stays on {:.2} mm2 of the surface that the tool reaches, {:.4} mm at most at \
             {}; no pass cuts {:.2} mm2 of it",
            left.beyond_mm2,
            left.most_mm,
            place_words(left.at.into()),
            left.uncut_mm2
        ));
    }
    unmet
}

/// What the program that is written does not hold or not reach, one sentence each.
pub fn stepover_unmet(answer: &Answer) -> Vec<String> {
    let shallow = answer.left_out.as_ref().filter(|left| left.shallow_mm2 > 0.0).map(|left| {
        let row = left_out(left);
        format!(
            "{:.1} mm2 ({:.1} %) of the surface, shallower than {:.1} degrees, stay as they are: no pass of one height is planned there; add \
             parallel passes, or lower --shallowest",
            row.shallow_mm2, row.shallow_percent, row.shallower_than_deg
        )
    });
    unmet(&answer.varying, answer).into_iter().chain(shallow).collect()
}

/// Share of the path on which the scallop is beyond its limit, %.
fn beyond_percent(plan: &Plan, limit_mm: f64) -> f64 {
    let beyond = spots(&plan.passes).filter(|spot| is_beyond(spot.scallop_mm, limit_mm)).count();
    100.0 * beyond as f64 / spots(&plan.passes).count().max(1) as f64
}

fn side(program: &Program, answer: &Answer, least_s: Option<[f64; 2]>) -> Side {
    let (plan, check) = (&program.plan, &program.check);
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
        scallop_beyond_percent: beyond_percent(plan, answer.bounds.scallop_mm),
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
        left: left_on_surface(&program.left),
        unmet: unmet(program, answer),
        simulated: Simulated {
            force_max_n: check.largest_n.0,
            force_max_line: check.largest_n.1,
            force_p99_n: check.p99_n,
            links_force_max_n: check.links_n.0,
            links_force_max_line: check.links_n.1,
            force_beyond_mm: check.beyond_mm,
            contact_mm: check.contact_mm,
            force_bound_mm: check.bound_mm,
            within_10_percent: 100.0 * check.within_10_percent,
            mean_ratio: check.mean_ratio,
            events: check.events.clone(),
        },
    }
}

/// The program that is written.
fn varying_side(answer: &Answer) -> Side {
    Side { unmet: stepover_unmet(answer), ..side(&answer.varying, answer, Some(answer.least_s)) }
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

fn left_on_surface(left: &Left) -> LeftOnSurface {
    LeftOnSurface {
        reached_mm2: left.reached_mm2,
        beyond_mm2: left.beyond_mm2,
        beyond_percent: 100.0 * left.beyond_mm2 / left.reached_mm2.max(f64::MIN_POSITIVE),
        uncut_mm2: left.uncut_mm2,
        height_max_mm: left.most_mm,
        height_max_at_mm: left.at.into(),
    }
}

fn left_out(left: &LeftOut) -> LeftOutRow {
    LeftOutRow {
        shallower_than_deg: left.shallowest_rad.to_degrees(),
        shallow_mm2: left.shallow_mm2,
        shallow_percent: 100.0 * left.shallow_mm2 / left.machined_mm2.max(f64::MIN_POSITIVE),
        strips_mm2: left.strips_mm2,
    }
}

/// Time that is saved against constant step-over, %; `None` where it is bought with a larger force or scallop: beyond the limit, and beyond
/// that of the constant step-over.
fn saved(answer: &Answer) -> Option<f64> {
    let (varying, rival) = (&answer.varying, &answer.constant.as_ref()?.program);
    let no_worse = |of: &dyn Fn(&Program) -> f64, limit: f64| of(varying) <= limit.max(of(rival));
    let sound = varying.check.events.is_empty()
        && no_worse(&largest_n, HELD * answer.reference_n)
        && !is_beyond(varying.plan.largest_scallop_mm(), answer.bounds.scallop_mm.max(rival.plan.largest_scallop_mm()));
    sound.then_some(100.0 * (1.0 - varying.check.time_s / rival.check.time_s))
}

/// Largest force on passes, leads and links, N.
fn largest_n(program: &Program) -> f64 {
    program.check.largest_n.0.max(program.check.links_n.0)
}

/// The report as JSON.
pub fn stepover_json(answer: &Answer) -> String {
    let varying = &answer.varying;
    let simulated = |k: usize| varying.check.by_pass.get(k).copied().unwrap_or_default();
    let passes = varying.plan.passes.iter().enumerate().filter(|(_, pass)| !pass.stretches.is_empty());
    let constant = answer.constant.as_ref().map(|rival| {
        let (step_over_mm, measured) = measured(rival.step);
        let feed_mm_min = mm_min_from_mm_s(rival.feed_mm_s);
        ConstantSide { step_over_mm, measured, feed_mm_min, side: side(&rival.program, answer, None) }
    });
    let report = Report {
        written_by: WRITTEN_BY,
        tool: answer.tool,
        spindle_rpm: rpm_from_rps(answer.rps),
        reference_n: answer.reference_n,
        scallop_limit_mm: answer.bounds.scallop_mm,
        step_over_bounds_mm: [answer.bounds.least_mm, answer.bounds.largest_mm],
        varying: varying_side(answer),
        constant,
        saved_percent: saved(answer),
        price: Price { s_per_n: answer.prices[0], s_per_um: answer.prices[1] },
        left_out: answer.left_out.as_ref().map(left_out),
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

/// The line on constant step-over. A saving is said only where both programs hold their limits.
fn constant_words(rival: &Rival, answer: &Answer) -> String {
    let (step_mm, measured) = measured(rival.step);
    let passes = rival.program.plan.passes.iter().filter(|pass| !pass.stretches.is_empty()).count();
    let comparison = match saved(answer) {
        Some(percent) if percent < 0.0 => format!("varying takes {:.1} % more", -percent),
        Some(percent) => format!("varying takes {percent:.1} % less"),
        None => "not compared, as varying passes exceed force or scallop where these do not".into(),
    };
    let holds = if unmet(&rival.program, answer).is_empty() { "" } else { " (exceeds force or scallop too)" };
    format!(
        "constant  {step_mm:.3} mm {measured}{holds}: {}, {passes} passes; {comparison}\n",
        clock(rival.program.check.time_s)
    )
}

fn place_words([x, y, z]: [f64; 3]) -> String {
    format!("X{x:.1} Y{y:.1} Z{z:.1}")
}

/// The report on the screen.
pub fn stepover_words(answer: &Answer) -> String {
    let whole = varying_side(answer);
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
    let simulated = &whole.simulated;
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
    let _ = writeln!(text, "scallop   {:.4} mm at most{}", whole.scallop_max_mm, beyond_words(&whole));
    let left = &whole.left;
    if left.beyond_mm2 > 0.0 {
        let _ = writeln!(
            text,
            "left      more than that limit on {:.2} mm2 ({:.2} %) of the surface, {:.4} mm at most at {}; {:.2} mm2 of it are not cut",
            left.beyond_mm2,
            left.beyond_percent,
            left.height_max_mm,
            place_words(left.height_max_at_mm),
            left.uncut_mm2
        );
    }
    let left_out = answer.left_out.as_ref().map(left_out).filter(|row| row.shallow_mm2 > 0.0);
    if let Some(LeftOutRow { shallower_than_deg, shallow_mm2, shallow_percent, .. }) = left_out {
        let _ = writeln!(
            text,
            "left out  {shallow_mm2:.1} mm2 ({shallow_percent:.1} %) of the surface, shallower than {shallower_than_deg:.1} degrees"
        );
    }
    if let Some(rival) = &answer.constant {
        text += &constant_words(rival, answer);
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
    fn a_scallop_is_beyond_its_limit_from_a_hundredth_above_it() {
        assert!(!is_beyond(0.010_099, 0.01) && is_beyond(0.010_101, 0.01));
    }
}
