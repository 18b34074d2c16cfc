//! Lines on the screen for the options of a run (`--reference`, `--stress`, `--cycle-time` …). In: [`Answers`]. Out: text.

use super::number::{clock, length, short, unsigned_zero};
use crate::outcome::answers::{Answers, Cycle, Moved, Reference, Stressed, Surface, Wear};

/// Lines for the screen; `rewritten`: there is a time saved to speak of.
pub fn answers_text(answers: &Answers, rewritten: bool) -> String {
    let mut text = String::new();
    match &answers.cycle {
        Some(cycle) => text += &cycle_text(cycle),
        None if rewritten => text += "saving    unconfirmed: no cycle time or log of this machine was given\n",
        None => {}
    }
    if let Some(reference) = &answers.reference {
        text += &reference_text(reference);
    }
    text.extend(answers.wear.iter().map(wear_text));
    if !answers.stress.is_empty() {
        text += "stress    the written program, largest load over its limit (99 % of the length below)\n";
    }
    for case in &answers.stress {
        text += &case_text(case);
    }
    text
}

fn reference_text(reference: &Reference) -> String {
    let each = |moved: &Moved| {
        format!(
            "          coefficients {:+.0} %: feeds {:+.1} % on average, {:+.1} % at most\n",
            100.0 * (moved.factor - 1.0),
            unsigned_zero(moved.mean_percent, 1),
            unsigned_zero(moved.largest_percent, 1)
        )
    };
    let lines: String = reference.coefficients.iter().map(each).collect();
    format!("reference loads that {} % of each tool's own cut length stays below\n{lines}", short(reference.percentile))
}

fn case_text(stressed: &Stressed) -> String {
    match (stressed.worst_ratio, stressed.p99_ratio) {
        (Some(worst), Some(p99)) => format!("          {:<34}{worst:>8.3}  ({p99:.3})\n", stressed.case),
        _ => format!("          {:<34} cannot be simulated\n", stressed.case),
    }
}

fn cycle_text(cycle: &Cycle) -> String {
    let measured = clock(cycle.measured_s);
    let Some([low, high]) = cycle.acceleration else {
        return format!("saving    unconfirmed: no acceleration explains the {measured} measured\n");
    };
    let saved = cycle
        .saved_percent
        .map_or(String::new(), |[least, most]| format!("; with them {} … {} % are saved", short(least), short(most)));
    format!(
        "cycle     {measured} measured: accelerations {} … {} of the setup's, by corner tolerance{saved}\n",
        short(low),
        short(high)
    )
}

/// A line for the screen; the length in the unit of the program.
pub fn surface_text(surface: &Surface, rewritten: bool, inch: bool) -> String {
    let [before, after] = surface.mark_max_mm.map(|mm| short(1e3 * mm));
    let marks = if rewritten { format!("{before} → {after}") } else { before };
    let [before, after] = surface.commanded_s.map(clock);
    let time = if rewritten { format!("{before} → {after}") } else { before };
    let length = length(surface.length_mm, inch);
    format!("surface   {length} of cuts make the finished surface, {time}; feed marks up to {marks} µm\n")
}

fn wear_text(wear: &Wear) -> String {
    let of = if wear.of_life { "its life" } else { "the program's as programmed" };
    let Some(most) = wear.most else { return format!("wear T{}   {} of {of}\n", wear.tool, short(wear.used)) };
    let rest = match wear.longer_life_costs_s {
        _ if wear.impossible && wear.slower_is_no_safer => {
            "no feeds keep it: slower ones do not spare this tool; change it earlier".to_owned()
        }
        _ if wear.impossible => "not even the lowest feeds keep it".to_owned(),
        Some(costs_s) => {
            let saves = short(wear.percent_saves_s);
            format!("10 % more life costs {} s, one percent more wear saves {saves} s", short(costs_s))
        }
        None => {
            format!("no feeds give 10 % more life; one percent more wear saves {} s", short(wear.percent_saves_s))
        }
    };
    format!("wear T{}   {} of {of}, {} allowed; {rest}\n", wear.tool, short(wear.used), short(most))
}
