//! The first lines of the page. In: a run with its figures. Out: the verdict in a few words, and three things to check before the program runs:
//! faults, the largest rise of a feed or the load nearest to its limit, and whether stock and tools are those of the setup.

use crate::outcome::ProgramRun;
use crate::report::figures::Figures;
use crate::report::number::short;
use crate::report::provenance::Rise;
use crate::report::verdict::Outcome;
use crate::report::words::plain;
use crate::units::MM_PER_INCH;

/// How many things.
const THINGS: usize = 3;

/// The verdict in a few words.
pub fn stamp(run: &ProgramRun, figures: &Figures) -> &'static str {
    let verdict = &figures.verdict;
    match verdict.outcome {
        _ if !verdict.held_back().is_empty() => "Do not run it.",
        Outcome::Unmet => "Not before this is looked at.",
        Outcome::Done if verdict.over.largest().is_none() => "No load was judged: the setup gives no limit.",
        Outcome::Done if run.written.is_none() => "As programmed:",
        Outcome::Done => "Within its limits.",
    }
}

/// Three sentences.
pub fn checks(run: &ProgramRun, figures: &Figures, rise: Option<&Rise>) -> Vec<String> {
    let faults = figures.verdict.faults.iter().map(|fault| format!("Put this right: {}.", fault.text));
    let mut found: Vec<String> = faults.take(THINGS - 1).collect();
    found.extend(rise.map(|rise| rising(run, rise)));
    found.extend(nearest(figures));
    found.truncate(THINGS - 1);
    found.push(set_up(run));
    if found.len() < THINGS {
        found.push(
            "Watch the first cut of each tool with a hand on the feed override: no load was held against a limit."
                .into(),
        );
    }
    found
}

fn rising(run: &ProgramRun, rise: &Rise) -> String {
    let (factor, unit) = if run.toolpath.inch { (1.0 / MM_PER_INCH, "in/min") } else { (1.0, "mm/min") };
    let [before, after] = [rise.feed_before, rise.feed_after].map(|feed| short(factor * feed));
    format!(
        "Line {} rises most, from {before} to {after} {unit} ({:+.0} %): be at the feed override when it comes.",
        rise.line,
        100.0 * (rise.ratio() - 1.0)
    )
}

fn nearest(figures: &Figures) -> Option<String> {
    let worst = figures.verdict.over.largest()?;
    let (kind, place) = (worst.limit.kind, worst.place);
    Some(format!(
        "Line {} comes nearest to a limit: {} of T{} is {:.0} % of it. Listen there.",
        place.line,
        plain(kind),
        place.tool,
        100.0 * worst.ratio()
    ))
}

/// What was simulated must be what is clamped.
fn set_up(run: &ProgramRun) -> String {
    let mut tools: Vec<u32> =
        run.map.stations.iter().map(|station| run.toolpath.moves[station.move_id.ix()].tool).collect();
    tools.sort_unstable();
    tools.dedup();
    let (factor, unit) = if run.toolpath.inch { (1.0 / MM_PER_INCH, "in") } else { (1.0, "mm") };
    let words: Vec<String> = tools
        .iter()
        .filter_map(|number| run.job.tool(*number))
        .map(|tool| {
            format!(
                "T{} {} {unit} with {} teeth, {} {unit} out of its holder",
                tool.number,
                short(factor * tool.diameter_mm),
                tool.flutes,
                short(factor * tool.overhang_mm)
            )
        })
        .collect();
    let named = words.iter().take(3).cloned().collect::<Vec<_>>().join("; ");
    let more = if words.len() > 3 { "; and the others of the table" } else { "" };
    let guessed = run.assumptions.len();
    let assumed = if guessed > 0 { format!(" {guessed} values were assumed: see Assumptions.") } else { String::new() };
    format!("Stock and zero point as in the setup, and these tools: {named}{more}.{assumed}")
}
