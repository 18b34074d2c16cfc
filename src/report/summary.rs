//! The summary on the screen, at most 100 columns wide: time before and after, the worst ratio to each limit before and
//! after, what bounds the feed and at what price, what was left alone, what was assumed.

use super::bounds;
use super::figures::{Figures, LimitFigure};
use super::run::{Run, Written};
use crate::diag::{self, Severity};

/// Widest line of the summary.
const COLUMNS: usize = 100;

/// The summary as text.
pub fn summary(run: &Run, figures: &Figures, file: &str) -> String {
    let mut text = String::new();
    text += &verdict(figures);
    text += &head(run, file);
    text += &times(run);
    text += &run.answers.text(run.written.is_some());
    text += &loads(run, figures);
    text += &bounds(figures);
    text += &output(run, figures);
    text += &apart(run, figures);
    fitted(&text)
}

/// The headline, and the faults behind it.
fn verdict(figures: &Figures) -> String {
    let mut text = folded("", &figures.verdict.headline);
    for fault in figures.verdict.faults.iter().skip(1) {
        text += &folded("", &fault.text);
    }
    text
}

/// Lines that are too wide folded, behind their label where they have one.
fn fitted(text: &str) -> String {
    let mut fitted = String::new();
    for line in text.lines() {
        let label = if line.get(9..10) == Some(" ") { &line[..10] } else { "" };
        match line.chars().count() {
            0..=COLUMNS => fitted += &format!("{line}\n"),
            _ => fitted += &folded(label, &line[label.len()..]),
        }
    }
    fitted
}

/// A sentence behind a label, folded at 100 columns; further lines begin under the sentence, or a little to the right where there
/// is no label.
fn folded(label: &str, sentence: &str) -> String {
    let indent = " ".repeat(label.chars().count().max(2));
    let mut text = label.to_owned();
    let mut width = label.chars().count();
    for (index, word) in sentence.split(' ').enumerate() {
        let wide = word.chars().count();
        if index > 0 && width + 1 + wide > COLUMNS {
            text += &format!("\n{indent}");
            width = indent.len();
        } else if index > 0 {
            text += " ";
            width += 1;
        }
        text += word;
        width += wide;
    }
    text + "\n"
}

fn head(run: &Run, file: &str) -> String {
    format!(
        "{file}: {} blocks, {} motions, {}, {}; stock {:.0} mm³ removed of {:.0}, cell {:.3} mm\n",
        run.program.own_len(),
        run.toolpath.moves.len(),
        run.program.dialect().name(),
        if run.toolpath.inch { "inch" } else { "mm" },
        run.map.removed_mm3,
        run.map.initial_mm3,
        run.map.cell_mm
    )
}

fn times(run: &Run) -> String {
    let (before, after) = (run.realised_before.total_s, run.realised_after().total_s);
    let mut text = match &run.written {
        Some(_) => format!(
            "time      {} → {}   {} by {:.1} %\n",
            clock(before),
            clock(after),
            if after <= before { "shorter" } else { "longer" },
            100.0 * (after / before.max(f64::MIN_POSITIVE) - 1.0).abs()
        ),
        None => format!("time      {}\n", clock(before)),
    };
    let causes = &run.realised_after().by_cause;
    let whole = after.max(f64::MIN_POSITIVE);
    let shares: Vec<String> = causes
        .iter()
        .filter(|(_, seconds)| *seconds > 0.0005 * whole)
        .map(|(name, seconds)| format!("{name} {}", clock(*seconds)))
        .collect();
    text += &wrapped("          ", &shares);
    text
}

/// Seconds as people read them.
pub fn clock(seconds: f64) -> String {
    if seconds < 60.0 {
        return format!("{seconds:.1} s");
    }
    let whole = seconds.round() as u64;
    let (hours, minutes, rest) = (whole / 3600, whole / 60 % 60, whole % 60);
    if hours > 0 { format!("{hours}:{minutes:02}:{rest:02} h") } else { format!("{minutes}:{rest:02} min") }
}

/// Items joined by commas, folded at 96 columns.
fn wrapped(indent: &str, items: &[String]) -> String {
    let mut text = String::new();
    let mut line = String::new();
    for item in items {
        if !line.is_empty() && indent.chars().count() + line.chars().count() + item.chars().count() + 2 > 96 {
            text += &format!("{indent}{line},\n");
            line.clear();
        }
        if !line.is_empty() {
            line += ", ";
        }
        line += item;
    }
    if line.is_empty() { text } else { text + &format!("{indent}{line}\n") }
}

fn loads(run: &Run, figures: &Figures) -> String {
    let rows: Vec<&LimitFigure> = figures.limits.iter().filter(|figure| figure.before_max.is_some()).collect();
    if rows.is_empty() {
        return "no load limit is in force: feeds in cuts are never raised\n".into();
    }
    let mut text = format!(
        "\n{:<20}{:>5}{:>14}{:>12}{:>12}{:>9}{:>9}{:>8}\n",
        "largest load", "tool", "limit", "before", "after", "before", "after", "line"
    );
    for figure in rows {
        text += &load_row(figure, run.written.is_some());
    }
    text
}

fn load_row(figure: &LimitFigure, rewritten: bool) -> String {
    let limit = figure.limit.unwrap_or(f64::NAN);
    let (before, after) = (figure.before_max.unwrap_or(0.0), figure.after_max.unwrap_or(0.0));
    let tool = figure.tool.map_or(String::new(), |tool| format!("T{tool}"));
    let percent = |ratio: Option<f64>| ratio.map_or_else(String::new, |ratio| format!("{:.0} %", 100.0 * ratio));
    let line = figure.at.map_or_else(String::new, |place| place.line.to_string());
    let apart = figure.at.and_then(|place| place.apart).map_or("", super::over::Apart::name);
    let unit = figure.kind.unit();
    let mut row = format!(
        "{:<20}{tool:>5}{:>14}{:>12}{:>12}{:>9}{:>9}{line:>8} {apart}",
        if figure.of_spindle { format!("{} of spindle", figure.kind.name()) } else { figure.kind.name().to_owned() },
        format!("{} {unit}", short(limit)),
        short(before),
        if rewritten { short(after) } else { String::new() },
        percent(figure.ratios[0]),
        if rewritten { percent(figure.ratios[1]) } else { String::new() }
    );
    row.truncate(row.trim_end().len());
    row + "\n"
}

/// Four significant digits.
pub fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value:.0}");
    }
    if value.abs() < 5e-7 {
        return "0".to_owned();
    }
    let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

fn bounds(figures: &Figures) -> String {
    if figures.bounds.is_empty() {
        return String::new();
    }
    let mut text = String::from("\nwhat bounds the feed, of the cutting time\n");
    for (share, percent) in
        figures.bounds.iter().zip(bounds::whole(&figures.bounds)).filter(|(_, percent)| *percent > 0)
    {
        let reason = share.reason.map_or_else(String::new, |why| format!(": {why}"));
        text += &folded(&format!("{percent:>8} %  "), &format!("{}{reason}", share.name));
    }
    text + &prices(figures)
}

fn prices(figures: &Figures) -> String {
    let mut seen: Vec<&'static str> = Vec::new();
    let mut items = Vec::new();
    for figure in &figures.limits {
        let (Some(price), Some(limit)) = (figure.shadow_price, figure.limit) else { continue };
        if seen.contains(&figure.kind.name()) || price.abs() * limit.abs() < 0.5 {
            continue;
        }
        seen.push(figure.kind.name());
        let percent = 0.01 * limit;
        let unit = if figure.kind.unit() == "-" { String::new() } else { format!(" {}", figure.kind.unit()) };
        items.push(format!("{} +{}{unit}: {:+.2} s", figure.kind.name(), short(percent), price * percent));
    }
    if items.is_empty() {
        String::new()
    } else {
        format!("one percent more of a limit\n{}", wrapped("          ", &items))
    }
}

fn output(run: &Run, figures: &Figures) -> String {
    let Some(written) = &run.written else { return String::new() };
    let stats = &written.stats;
    let check = &written.check;
    format!(
        "\noutput    {} F words ({} before), {} changed, {} inserted, {} blocks added; {}{}\nchecked   {}; read back; {} motions cut in pieces or near a limit simulated again at {} mm{}{}\n{}",
        stats.f_words_after,
        stats.f_words_before,
        stats.f_words_changed,
        stats.f_words_inserted,
        stats.blocks_added,
        loss(written),
        bound(written),
        if check.identical { "only feeds differ" } else { "MORE THAN FEEDS DIFFERS" },
        check.simulated_again,
        short(check.spacing_mm),
        check.force_rate_ratio.map_or(String::new(), |ratio| format!(", rate of force {ratio:.3}")),
        if check.rounds > 0 { format!(" (caps tightened {} times)", check.rounds) } else { String::new() },
        folded("          ", &figures.verdict.largest())
    )
}

/// What the bound on growth costs, where it binds.
fn bound(written: &Written) -> String {
    let costs_s = written.schedule.bound_costs_s;
    if written.schedule.lambda_s > 0.0 {
        format!("\n          output.max_growth is used up: it costs {costs_s:.1} s")
    } else {
        String::new()
    }
}

/// One line for each reason why blocks keep their feed.
fn kept_feeds(frozen: &[(u32, String)]) -> String {
    let mut reasons: Vec<(&str, Vec<u32>)> = Vec::new();
    for (line, why) in frozen {
        match reasons.iter_mut().find(|(known, _)| known == why) {
            Some((_, lines)) => lines.push(*line),
            None => reasons.push((why, vec![*line])),
        }
    }
    let row = |(index, (why, lines)): (usize, &(&str, Vec<u32>))| {
        let head = if index == 0 { "frozen" } else { "" };
        let (count, s) = (lines.len(), if lines.len() == 1 { " keeps its" } else { "s keep their" });
        format!("{head:<10}{count} block{s} feed, {}: {why}\n", some_lines(lines))
    };
    reasons.iter().enumerate().map(row).collect()
}

fn loss(written: &Written) -> String {
    loss_words(super::loss_percent(written))
}

/// Rounding may leave a time a hair below the bound: that is nothing, not minus nothing.
fn loss_words(percent: f64) -> String {
    format!("{:.1} % over the continuous optimum", (10.0 * percent).round() / 10.0 + 0.0)
}

fn apart(run: &Run, figures: &Figures) -> String {
    let mut text = String::new();
    let infeasible = run.infeasible();
    if !infeasible.is_empty() {
        let length: f64 = infeasible.iter().map(|place| place.length_mm).sum();
        let lines: Vec<u32> = infeasible.iter().map(|place| place.line).collect();
        text += &format!(
            "infeasible {} places, {} mm ({:.1} % of the cutting length), {}: lowest feed allowed\n",
            infeasible.len(),
            short(length),
            100.0 * run.infeasible_share(),
            some_lines(&lines)
        );
    }
    let frozen = run.frozen();
    text += &kept_feeds(&frozen);
    for (line, what) in figures.overbent(run) {
        text += &format!("line {line}: {what}\n");
    }
    let kinds = diag::kinds(&run.diagnostics);
    let warnings: Vec<_> = kinds.iter().filter(|kind| kind.first.severity >= Severity::Warning).collect();
    let places: u32 = warnings.iter().map(|kind| kind.places).sum();
    if places as usize > warnings.len() {
        text += &format!("warnings  {} kinds, {places} places\n", warnings.len());
    } else if places > 0 {
        text += &format!("warnings  {places}\n");
    }
    if !run.assumptions.is_empty() {
        text += &format!(
            "assumed   {} values that the setup does not give; the report lists them\n",
            run.assumptions.len()
        );
    }
    text
}

fn some_lines(lines: &[u32]) -> String {
    let mut shown: Vec<String> = Vec::new();
    for line in lines {
        if shown.last() != Some(&line.to_string()) {
            shown.push(line.to_string());
        }
    }
    let more = if shown.len() > 4 { " …" } else { "" };
    let word = if shown.len() == 1 { "line" } else { "lines" };
    format!("{word} {}{more}", shown[..shown.len().min(4)].join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loss_that_rounds_to_nothing_has_no_sign() {
        let words = |percent| loss_words(percent).split(" %").next().unwrap_or_default().to_owned();
        assert_eq!([-0.04, 0.04, 0.06, -0.06].map(words), ["0.0", "0.0", "0.1", "-0.1"]);
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!([short(1234.56), short(0.030), short(12.0), short(0.0)], ["1235", "0.03", "12", "0"]);
        let two = folded("a ", &["word"; 25].join(" "));
        assert!(two.lines().all(|line| line.chars().count() <= COLUMNS) && two.lines().count() == 2, "{two}");
        assert!(two.ends_with("\n  word word word word word word\n"), "{two}");
        assert_eq!([clock(12.34), clock(406.7), clock(7384.0)], ["12.3 s", "6:47 min", "2:03:04 h"]);
    }
}
