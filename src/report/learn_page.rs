//! The report of `learn` as one HTML file: the verdict, measured against predicted before and after, the residual along the
//! covariates, and the tables. In: a [`LearnReport`] and what there is to show of it. Out: text that needs nothing else.

use maud::{Markup, html};

use super::html::{folded, key, page, table, words};
use super::learn::learn_words;
use super::number::short;
use crate::learn::diagnose::plotted::{CovariateCurve, Curves, Trace};
use crate::learn::report::{Estimate, LearnReport};

/// Colours of the style, which are others in the dark.
const MEASURED: &str = "var(--before)";
const BEFORE: &str = "var(--limit)";
const AFTER: &str = "var(--after)";
const LINE: &str = "var(--line)";
const WIDTH: f64 = 960.0;
/// Residuals that are drawn, and how they stand.
const PANELS: usize = 6;
const COLUMNS: usize = 3;

/// The page.
pub fn learn_html(report: &LearnReport, shown: &Curves, file: &str) -> String {
    let body = html! {
        div class="verdict" { p { (report.verdict) } } "\n"
        (ladder(report))
        (alignment(report))
        @if !shown.traces.is_empty() { h2 { "Measured and predicted" } "\n" }
        @for trace in &shown.traces { (picture(trace)) }
        @if !shown.along.is_empty() {
            h2 { "Mean residual along what was cut (the most telling first)" } "\n"
            p { (key(BEFORE, "before")) " " (key(AFTER, "after")) } "\n"
            (residuals(&shown.along))
        }
        (tables(report))
        details { summary { "In words" } pre { (learn_words(report)) } } "\n"
    };
    page(file, &body)
}

/// A frame with linear axes: from values to places.
struct Frame {
    x: [f64; 4],
    y: [f64; 4],
}

impl Frame {
    /// Values from `x0` to `x1` and `y0` to `y1` in the box `left, top, width, height`.
    fn new([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], [left, top, width, height]: [f64; 4]) -> Self {
        Self { x: [x0, x1.max(x0 + 1e-12), left, width], y: [y0, y1.max(y0 + 1e-12), top, height] }
    }
    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let ([x0, x1, left, width], [y0, y1, top, height]) = (self.x, self.y);
        (left + width * (x - x0) / (x1 - x0), top + height * (1.0 - (y - y0) / (y1 - y0)))
    }
    fn line(&self, points: impl Iterator<Item = (f64, f64)>, colour: &str) -> Markup {
        let places: Vec<String> = points.map(|(x, y)| self.at(x, y)).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        html! {
            polyline points=(places.join(" ")) fill="none" style={ "stroke:" (colour) } stroke-width="1.3" {} "\n"
        }
    }
    fn axes(&self, unit: &str) -> Markup {
        let ([x0, x1, left, width], [y0, y1, top, height]) = (self.x, self.y);
        let text = |x: f64, y: f64, anchor: &str, content: &str| {
            html! { text x=(tenths(x)) y=(tenths(y)) text-anchor=(anchor) { (content) } "\n" }
        };
        let [x, y, w, h] = [left, top, width, height].map(tenths);
        html! {
            rect x=(x) y=(y) width=(w) height=(h) fill="none" style={ "stroke:" (LINE) } {} "\n"
            (text(left - 4.0, top + 10.0, "end", &short(y1)))
            (text(left - 4.0, top + height, "end", &short(y0)))
            (text(left, top + height + 14.0, "start", &short(x0)))
            (text(left + width, top + height + 14.0, "end", &short(x1)))
            // Below the numbers: a long name would run into them.
            (text(left + 0.5 * width, top + height + 28.0, "middle", unit))
        }
    }
}

/// A place of a drawing, to a tenth of a pixel.
fn tenths(value: f64) -> String {
    format!("{value:.1}")
}

fn span(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.filter(|v| v.is_finite()).fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(v), hi.max(v)])
}

fn drawing(height: f64, inside: &Markup) -> Markup {
    let box_px = format!("0 0 {WIDTH} {height}");
    html! {
        div class="scroll" {
            svg
                xmlns="http://www.w3.org/2000/svg" class="own wide" viewBox=(box_px)
                font-family="Helvetica,Arial,sans-serif" font-size="12"
            { "\n" (inside) }
        }
        "\n"
    }
}

/// Measured and predicted over time.
fn picture(trace: &Trace) -> Markup {
    let all = [&trace.measured, &trace.before, &trace.after];
    let [lo, hi] = span(all.iter().flat_map(|v| v.iter().copied()));
    let frame = Frame::new(span(trace.time_s.iter().copied()), [lo.min(0.0), hi], [70.0, 24.0, 870.0, 230.0]);
    let names = [measured(&trace.name), "predicted before".to_owned(), "predicted after".to_owned()];
    let curves = all.into_iter().zip([MEASURED, BEFORE, AFTER]).zip(names.iter().zip(["70", "330", "520"]));
    drawing(
        296.0,
        &html! {
            (frame.axes("s"))
            @for ((values, colour), (name, x)) in curves {
                text x=(x) y="16" style={ "fill:" (colour) } { (name) } "\n"
                (frame.line(thinned(&trace.time_s, values).into_iter(), colour))
            }
        },
    )
}

/// A measured quantity in words: "spindle_power_w (W)" is "measured spindle power (W)".
fn measured(name: &str) -> String {
    let (key, unit) = name.split_once(' ').unwrap_or((name, ""));
    let words = key.rsplit_once('_').map_or(key, |(words, _)| words).replace('_', " ");
    format!("measured {words} {unit}").trim_end().to_owned()
}

/// Means over as many columns as can be told apart.
fn thinned(time: &[f64], values: &[f64]) -> Vec<(f64, f64)> {
    let size = time.len().div_ceil(900).max(1);
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    time.chunks(size).zip(values.chunks(size)).map(|(t, v)| (mean(t), mean(v))).collect()
}

fn residuals(along: &[CovariateCurve]) -> Markup {
    let shown = &along[..along.len().min(PANELS)];
    let rows = shown.len().div_ceil(COLUMNS);
    let (width, height) = (WIDTH / COLUMNS as f64, 204.0);
    let panel = |(k, each): (usize, &CovariateCurve)| {
        let (left, top) = (width * (k % COLUMNS) as f64 + 60.0, height * (k / COLUMNS) as f64 + 10.0);
        let y = span(each.bins.iter().flat_map(|b| [b[1], b[2], 0.0]));
        let frame = Frame::new(span(each.bins.iter().map(|b| b[0])), y, [left, top, width - 76.0, 145.0]);
        let ends = [frame.x[0], frame.x[1]];
        html! {
            (frame.axes(&each.name))
            (frame.line(ends.iter().map(|x| (*x, 0.0)), LINE))
            (frame.line(each.bins.iter().map(|b| (b[0], b[1])), BEFORE))
            (frame.line(each.bins.iter().map(|b| (b[0], b[2])), AFTER))
        }
    };
    drawing(height * rows as f64 + 10.0, &html! { @for panel in shown.iter().enumerate().map(panel) { (panel) } })
}

/// Effect by effect, how the error fell: on the data that were fitted once, on data held out at every rung.
fn ladder(report: &LearnReport) -> Markup {
    let number = |v: f64| if v.is_finite() { short(v) } else { String::new() };
    let mut rows = vec![vec![
        "base model".to_owned(),
        String::new(),
        number(report.base_test.rmse),
        String::new(),
        format!("{} on fitted data", number(report.base_train.rmse)),
    ]];
    let rungs = report.effects.iter().chain(report.unnamed.iter().map(|unnamed| &unnamed.added));
    rows.extend(rungs.map(|effect| {
        vec![
            format!("+ {}", effect.name),
            number(effect.test_rmse_before),
            number(effect.test_rmse_after),
            number(effect.p_value),
            effect.evidence.clone(),
        ]
    }));
    rows.push(vec![
        "final model".to_owned(),
        number(report.base_test.rmse),
        number(report.final_test.rmse),
        String::new(),
        format!("{} on fitted data", number(report.final_train.rmse)),
    ]);
    words("Effect by effect: error on data held out", &["model", "before", "after", "chance without it", "why"], &rows)
}

/// How the log was tied to the program.
fn alignment(report: &LearnReport) -> Markup {
    let Some(found) = &report.alignment else { return html! {} };
    let [before, held, after] = found.outside;
    let mut rows = vec![
        vec!["tied by".to_owned(), found.method.clone()],
        vec!["the program begins in the log at".to_owned(), format!("{:.3} s", found.offset_s)],
        vec!["log seconds for a predicted second".to_owned(), format!("{:.5}", found.stretch)],
        vec!["uncertainty of a sample's place".to_owned(), format!("{:.3} s", found.uncertainty_s)],
        vec!["samples before, held, after".to_owned(), format!("{before}, {held}, {after}")],
    ];
    rows.extend(report.events.iter().map(|event| vec!["event".to_owned(), event.in_words()]));
    rows.extend(report.ceilings.iter().map(|ceiling| vec!["event".to_owned(), ceiling.in_words()]));
    rows.extend(report.outlying.iter().map(|cut| vec!["event".to_owned(), cut.in_words()]));
    words("Alignment", &["", ""], &rows)
}

fn tables(report: &LearnReport) -> Markup {
    let number = |v: f64| if v.is_finite() { short(v) } else { String::new() };
    let values = |values: &[Estimate]| -> Vec<Vec<String>> {
        values.iter().map(|v| vec![v.name.clone(), number(v.value), number(v.std_error), v.unit.clone()]).collect()
    };
    let head = ["", "value", "standard error", "unit"];
    let errors = |name: &str, e: &crate::learn::report::Errors| {
        // Without a load, errors are those of times, which have no r².
        let share = |v: f64, text: String| if v.is_finite() { text } else { String::new() };
        vec![
            name.to_owned(),
            number(e.rmse),
            share(e.mape, format!("{:.2} %", e.mape)),
            share(e.r2, format!("{:.3}", e.r2)),
        ]
    };
    let fitted = table(
        "Errors",
        &["", "root mean square", "relative", "r²"],
        &[
            errors("base model, fitted data", &report.base_train),
            errors("base model, held out", &report.base_test),
            errors("with effects, fitted data", &report.final_train),
            errors("with effects, held out", &report.final_test),
        ],
    );
    let confounded: Vec<Vec<String>> =
        report.confounded.iter().map(|c| vec![c.names.join(" or "), c.why.clone(), c.experiment.clone()]).collect();
    let rejected: Vec<Vec<String>> = report.rejected.iter().map(|r| vec![r.name.clone(), r.why.clone()]).collect();
    let warnings: Vec<Vec<String>> = report.warnings.iter().map(|w| vec![w.clone()]).collect();
    html! {
        (fitted)
        (table("Coefficients", &head, &values(&report.final_base)))
        @for effect in &report.effects {
            (table(&format!("Effect: {}", effect.name), &head, &values(&effect.parameters)))
            p { (effect.evidence) } "\n"
        }
        (words("Cannot be told apart", &["effects", "why", "what would separate them"], &confounded))
        (folded("Looked at and not added", &["effect", "why"], &rejected))
        (folded("Notes", &["what"], &warnings))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_told_apart_in_words_and_colours() {
        let trace = Trace {
            name: "spindle_power_w (W)".into(),
            time_s: vec![0.0, 1.0],
            measured: vec![1.0, 2.0],
            before: vec![1.0, 1.5],
            after: vec![1.0, 1.9],
        };
        let svg = picture(&trace).into_string();
        assert!(svg.contains(">measured spindle power (W)</text>"), "{svg}");
        // Each name in the colour of its curve: the style of the page has the last word on attributes.
        for colour in [MEASURED, BEFORE, AFTER] {
            assert_eq!(svg.matches(&format!("style=\"fill:{colour}\"")).count(), 1, "{svg}");
            assert_eq!(svg.matches(&format!("style=\"stroke:{colour}\"")).count(), 1, "{svg}");
        }
        assert_eq!(measured("force_x_n (N)"), "measured force x (N)");
    }
}
