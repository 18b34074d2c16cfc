//! `[limits]`, `[raise]`, `confirm`, `[[operation]]`, `[output]`. In: these tables of the setup. Out: the same as types of [`crate::machine`].

use super::file::{LimitsTable, OperationTable, OutputTable, RaiseTable, RampTable, WearTable};
use super::forms::Bounds;
use super::quantity::Quantity;
use super::read::{Reader, Sense};
use crate::machine::limits::{FEED_CHANGE_MAX, FEED_CHANGE_MIN};
use crate::machine::material::Process;
use crate::machine::{
    AirFeed, Annotate, LimitKind, Limits, Match, Mode, Operation, OutputRules, Raise, Ramp, WearBudget,
};
use crate::nc::Doubt;
use crate::units::Dimension;

/// Limits of a tool or an operation: no defaults, no air feed.
pub fn limits(reader: &mut Reader, key: &str, table: &LimitsTable) -> Limits {
    let written = [
        ("air_feed", table.air_feed.is_some()),
        ("approach", table.approach.is_some()),
        ("wear", table.wear.is_some()),
    ];
    for (name, written) in written {
        if written {
            reader.complain(&format!("{key}.{name}"), "holds for the whole program", "write it in [limits]");
        }
    }
    plain(reader, key, table)
}

/// `[limits]`: with the default of the lowest change of feed, and the air feed.
pub fn global(reader: &mut Reader, table: &LimitsTable) -> (Limits, Option<AirFeed>) {
    let mut limits = plain(reader, "limits", table);
    limits.feed_change_min = limits.feed_change_min.or_else(|| {
        reader.assume("limits.feed_change.min", FEED_CHANGE_MIN.to_string(), "default");
        Some(FEED_CHANGE_MIN)
    });
    let air_feed = reader.optional("limits.air_feed", table.air_feed.as_ref(), Dimension::Feed, Sense::Positive);
    let air_feed = air_feed.map(|feed_mm_s| AirFeed {
        feed_mm_s,
        approach_mm: reader.or("limits.approach", table.approach.as_ref(), Dimension::Length, Sense::NotNegative, 2.0),
    });
    (limits, air_feed)
}

/// Default of `feed_change.max`, and why it is that: it hangs on whether coefficients were measured.
pub fn feed_change_max(process: &Process) -> (f64, &'static str) {
    let [of_a_library, measured] = FEED_CHANGE_MAX;
    if process.is_measured() {
        return (measured, "default with measured coefficients (calibrate, learn)");
    }
    (of_a_library, "default until coefficients are measured (calibrate, learn): then 2")
}

/// `[limits] wear`.
pub fn wear(reader: &mut Reader, table: Option<&LimitsTable>) -> Option<WearBudget> {
    let WearTable { exponent, most } = table?.wear.as_ref()?;
    let power = Sense::Within(0.0, 2.0, "wear rises with the feed, but slower than its square: 1 to 1.5 is usual");
    Some(WearBudget {
        exponent: reader.or("limits.wear.exponent", exponent.as_ref(), Dimension::Ratio, power, 1.0),
        most: reader.or("limits.wear.most", most.as_ref(), Dimension::Ratio, Sense::Positive, 1.0),
    })
}

fn plain(reader: &mut Reader, key: &str, table: &LimitsTable) -> Limits {
    let mut limits = Limits::default();
    for kind in LimitKind::ALL {
        let (name, dimension) = (kind.name(), kind.row().dimension);
        limits.set(kind, largest(reader, &format!("{key}.{name}"), table.largest(kind), dimension));
    }
    let mut two = |name: &str, table: &Option<Bounds>, dimension| {
        range(reader, &format!("{key}.{name}"), table.as_ref(), dimension)
    };
    (limits.chip_thickness_min_mm, limits.chip_thickness_max_mm) =
        two("chip_thickness", &table.chip_thickness, Dimension::Length);
    (limits.feed_min_mm_s, limits.feed_max_mm_s) = two("feed", &table.feed, Dimension::Feed);
    (limits.feed_change_min, limits.feed_change_max) = two("feed_change", &table.feed_change, Dimension::Ratio);
    limits
}

/// The largest value of a limit that has no smallest.
fn largest(reader: &mut Reader, key: &str, written: Option<&Bounds>, dimension: Dimension) -> Option<f64> {
    let bounds = written?;
    if bounds.min.is_some() {
        reader.complain(
            &format!("{key}.min"),
            "a load has no smallest value",
            "write the largest alone, or { max = … }",
        );
    } else if bounds.max.is_none() {
        reader.complain(key, "is an empty table", "write the largest value alone, or { max = … }");
    }
    reader.optional(key, bounds.max.as_ref(), dimension, Sense::Positive)
}

fn range(reader: &mut Reader, key: &str, table: Option<&Bounds>, dimension: Dimension) -> (Option<f64>, Option<f64>) {
    let Some(table) = table else { return (None, None) };
    let low = reader.optional(&format!("{key}.min"), table.min.as_ref(), dimension, Sense::Positive);
    let high = reader.optional(&format!("{key}.max"), table.max.as_ref(), dimension, Sense::Positive);
    if let (Some(low), Some(high)) = (low, high)
        && low > high
    {
        reader.complain(key, "its minimum is above its maximum", "swap them");
    }
    (low, high)
}

/// `[[operation]]`.
pub fn operation(reader: &mut Reader, table: &OperationTable, position: usize) -> Operation {
    let key = format!("operation[{}]", position + 1);
    let known = [
        ("optimise", Mode::Optimise),
        ("optimize", Mode::Optimise),
        ("slow-only", Mode::SlowOnly),
        ("keep", Mode::Keep),
    ];
    let mode = table.mode.as_deref().and_then(|word| reader.choice(&format!("{key}.mode"), word, &known));
    let mut ramp_at = |name: &str, written: &Option<RampTable>| {
        written.as_ref().map(|w| ramp(reader, &format!("{key}.{name}"), &w.feed, &w.distance))
    };
    let (entry, exit) = (ramp_at("entry", &table.entry), ramp_at("exit", &table.exit));
    let turn = table.direction_change.as_ref().map(|written| {
        let at = format!("{key}.direction_change");
        let angle = reader.value(&format!("{at}.angle"), &written.angle, Dimension::Angle, Sense::Positive);
        (angle, ramp(reader, &at, &written.feed, &written.distance))
    });
    Operation {
        matches: selection(reader, &key, table),
        mode: mode.unwrap_or_default(),
        entry,
        exit,
        direction_change: turn,
        limits: table.limits.as_ref().map(|l| limits(reader, &format!("{key}.limits"), l)).unwrap_or_default(),
        raise: raise(table.raise.as_ref()),
        confirmed: confirmed(reader, &format!("{key}.confirm"), table.confirm.as_deref()),
    }
}

/// `[raise]`, of the setup or of an operation.
pub fn raise(table: Option<&RaiseTable>) -> Raise {
    let Some(RaiseTable { plunges, ramps, entries, finishing, compensation, cycles }) = table.cloned() else {
        return Raise::default();
    };
    Raise { plunges, ramps, entries, finishing, compensation, cycles }
}

/// `confirm = […]`, of the setup or of an operation: names of doubts.
pub fn confirmed(reader: &mut Reader, key: &str, names: Option<&[String]>) -> Vec<&'static str> {
    let mut one = |name: &String| {
        let found = Doubt::ALL.into_iter().map(Doubt::name).find(|known| known == name);
        if found.is_none() {
            let known = Doubt::ALL.map(Doubt::name).join(", ");
            reader.complain(
                key,
                format!("\"{name}\" is nothing that can be confirmed"),
                format!("known here: {known}"),
            );
        }
        found
    };
    names.unwrap_or_default().iter().filter_map(&mut one).collect()
}

fn ramp(reader: &mut Reader, key: &str, feed: &Quantity, distance: &Quantity) -> Ramp {
    Ramp {
        feed_mm_s: reader.value(&format!("{key}.feed"), feed, Dimension::Feed, Sense::Positive),
        distance_mm: reader.value(&format!("{key}.distance"), distance, Dimension::Length, Sense::Positive),
    }
}

fn selection(reader: &mut Reader, key: &str, table: &OperationTable) -> Match {
    let Some(matches) = &table.matches else {
        reader.missing(
            &format!("{key}.match"),
            "say what it applies to: match = { tool = 3 }, { comment = \"FINISH\" } or { lines = [120, 180] }",
        );
        return Match::default();
    };
    let surface = matches.surface.as_deref();
    let final_surface =
        surface.and_then(|word| reader.choice(&format!("{key}.match.surface"), word, &[("final", true)]));
    Match {
        tool: matches.tool,
        comment: matches.comment.clone(),
        lines: matches.lines.map(|lines| line_range(reader, &format!("{key}.match.lines"), lines)),
        final_surface: final_surface.unwrap_or(false),
    }
}

fn line_range(reader: &mut Reader, key: &str, [first, last]: [u32; 2]) -> (u32, u32) {
    if first == 0 || last < first {
        reader.complain(
            key,
            format!("[{first}, {last}] is no range of lines"),
            "lines count from 1, first before last",
        );
    }
    (first, last)
}

/// `[output]`.
pub fn output(reader: &mut Reader, table: &OutputTable) -> OutputRules {
    let known = [("none", Annotate::None), ("changes", Annotate::Changes), ("full", Annotate::Full)];
    let annotate = table.annotate.as_deref().and_then(|word| reader.choice("output.annotate", word, &known));
    if table.annotate.is_none() {
        reader.assume("output.annotate", "changes", "default");
    }
    if table.split.is_none() {
        reader.assume("output.split", "true", "default");
    }
    let ways = [("keep", false), ("replace", true)];
    let computed = table.computed_feeds.as_deref().and_then(|word| reader.choice("output.computed_feeds", word, &ways));
    let exclude = table.exclude.clone().unwrap_or_default();
    if table.max_growth.is_none() {
        reader.assume("output.max_growth", "4", "default; a short program may have 63,000 bytes all the same");
    }
    if let Some(growth) = table.max_growth.filter(|growth| !(1.0..=1e6).contains(growth)) {
        reader.complain("output.max_growth", format!("{growth} is no growth"), "it is output over input: 4 is usual");
    }
    OutputRules {
        max_growth: table.max_growth,
        minimum_change: reader.or(
            "output.minimum_change",
            table.minimum_change.as_ref(),
            Dimension::Ratio,
            Sense::Within(-1e-12, 1.0, "it is a share of the feed: 0.01 is usual"),
            0.01,
        ),
        minimum_length_mm: reader.or(
            "output.minimum_length",
            table.minimum_length.as_ref(),
            Dimension::Length,
            Sense::NotNegative,
            0.5,
        ),
        split: table.split.unwrap_or(true),
        annotate: annotate.unwrap_or(Annotate::Changes),
        marked: true,
        replace_computed_feeds: computed.unwrap_or(false),
        exclude: exclude.into_iter().map(|lines| line_range(reader, "output.exclude", lines)).collect(),
    }
}
