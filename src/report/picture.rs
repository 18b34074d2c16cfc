//! The picture: feed and one load along the path, before and after, with the limit drawn in. In: a run. Out: a
//! self-contained SVG. The path is cut into as many columns as there are pixels; a column shows the mean as a line and the
//! span from the least to the largest value as a shade.

use maud::{Markup, html};

use super::figures::{Figures, LimitFigure};
use super::number::{clock, short};
use crate::machine::LimitKind;
use crate::outcome::ProgramRun;
use crate::outcome::station_loads::{StationLoads, each_station};
use crate::units::mm_min_from_mm_s;

const WIDTH: f64 = 960.0;
const LEFT: f64 = 74.0;
const RIGHT: f64 = 16.0;
const PANEL: f64 = 190.0;
const TOPS: [f64; 2] = [56.0, 290.0];
const COLUMNS: usize = 870;
const BEFORE: &str = "#9a9a9a";
const AFTER: &str = "#1f5fbf";
const LIMIT: &str = "#c02020";

/// Values along the path, gathered in columns.
struct Curve {
    columns: Vec<Column>,
}

#[derive(Clone, Copy)]
struct Column {
    low: f64,
    high: f64,
    sum: f64,
    weight: f64,
}

impl Curve {
    fn new() -> Self {
        Self { columns: vec![Column { low: f64::INFINITY, high: 0.0, sum: 0.0, weight: 0.0 }; COLUMNS] }
    }
    /// Puts a value on the stretch from `a` to `b` (fractions of the path).
    fn put(&mut self, a: f64, b: f64, value: f64) {
        let column = |t: f64| ((t * COLUMNS as f64) as usize).min(COLUMNS - 1);
        let (first, last) = (column(a), column(b));
        let weight = (b - a).max(1e-12) / (last - first + 1) as f64;
        for c in &mut self.columns[first..=last] {
            c.low = c.low.min(value);
            c.high = c.high.max(value);
            c.sum += value * weight;
            c.weight += weight;
        }
    }
    fn highest(&self) -> f64 {
        self.columns.iter().map(|c| c.high).fold(0.0, f64::max)
    }
    /// A value most of the path stays below, so that a single spike does not flatten the rest.
    fn usual_high(&self) -> f64 {
        let mut highs: Vec<f64> = self.columns.iter().map(|c| c.high).collect();
        highs.sort_by(f64::total_cmp);
        highs[highs.len() * 98 / 100]
    }
}

/// Before and after of one quantity.
struct Panel {
    title: String,
    unit: &'static str,
    before: Curve,
    after: Curve,
    limit: Option<f64>,
}

/// The picture as a file.
pub fn picture(run: &ProgramRun, figures: &Figures, file: &str) -> String {
    drawing(run, figures, file).into_string()
}

/// The picture as a part of a page: every element is closed, so it is XML as well as HTML.
pub(super) fn drawing(run: &ProgramRun, figures: &Figures, file: &str) -> Markup {
    let shown = load_to_show(figures);
    let panels = panels(run, shown);
    html! {
        svg
            xmlns="http://www.w3.org/2000/svg" viewBox={ "0 0 " (WIDTH) " 540" } width=(WIDTH) height="540"
            font-family="Helvetica, Arial, sans-serif" font-size="13"
        {
            "\n" (head(run, file))
            @for (panel, top) in panels.iter().zip(TOPS) { (draw(panel, top, run.written.is_some())) }
            (footer(run))
        }
        "\n"
    }
}

/// The load limit that holds the feed longest, else the first in force.
fn load_to_show(figures: &Figures) -> Option<&LimitFigure> {
    let loads = figures.limits.iter().filter(|figure| figure.before_max.is_some());
    loads.reduce(|best, figure| if figure.active_time_percent > best.active_time_percent { figure } else { best })
}

fn panels(run: &ProgramRun, shown: Option<&LimitFigure>) -> [Panel; 2] {
    let kind = shown.map_or(LimitKind::ForceXy, |figure| figure.kind);
    let limit = shown.and_then(|figure| figure.limit);
    let whole: f64 = run.map.stations.iter().map(crate::engage::Station::length_mm).sum::<f64>().max(1e-9);
    let [mut feed_before, mut feed_after, mut load_before, mut load_after] = std::array::from_fn(|_| Curve::new());
    let mut at = 0.0;
    each_station(run, &mut |found: &StationLoads| {
        let (a, b) = (at / whole, (at + found.station.length_mm()) / whole);
        at += found.station.length_mm();
        feed_before.put(a, b, mm_min_from_mm_s(found.feed_before_mm_s));
        feed_after.put(a, b, mm_min_from_mm_s(found.feed_after_mm_s));
        load_before.put(a, b, load(found.before.bounded_by(kind), kind));
        load_after.put(a, b, load(found.after.bounded_by(kind), kind));
    });
    [
        Panel { title: "commanded feed".into(), unit: "mm/min", before: feed_before, after: feed_after, limit: None },
        Panel {
            title: kind.name().replace('_', " "),
            unit: kind.unit(),
            before: load_before,
            after: load_after,
            limit,
        },
    ]
}

fn load(value: Option<f64>, kind: LimitKind) -> f64 {
    let value = value.unwrap_or(0.0);
    kind.in_report_unit(value)
}

/// The mark, the ground, and the name of the program with its time.
fn head(run: &ProgramRun, file: &str) -> Markup {
    let (before, after) = (run.realised_before.total_s, run.realised_after().total_s);
    let time = match &run.written {
        Some(_) => format!("{} → {}", clock(before), clock(after)),
        None => clock(before),
    };
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
    html! {
        metadata { "w" (super::marks::MARK) " " (env!("CARGO_PKG_VERSION")) } "\n"
        rect width=(WIDTH) height="540" fill="white" {} "\n"
        text x=(LEFT) y="24" font-size="16" fill="#202020" { (name) ": " (time) } "\n"
    }
}

fn draw(panel: &Panel, top: f64, rewritten: bool) -> Markup {
    let usual = panel.before.usual_high().max(panel.after.usual_high()).max(panel.limit.unwrap_or(0.0));
    let all = panel.before.highest().max(panel.after.highest());
    let scale = nice(if all <= 1.3 * usual { all } else { 1.15 * usual }.max(1e-9));
    let y = |value: f64| top + PANEL * (1.0 - (value / scale).min(1.0));
    let right = WIDTH - RIGHT;
    html! {
        (text(LEFT, top - 9.0, "start", "#202020", &format!("{} [{}]", panel.title, panel.unit)))
        @for value in [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| share * scale) {
            @let at = tenths(y(value));
            line x1=(LEFT) x2=(right) y1=(at) y2=(at) stroke="#e4e4e4" {} "\n"
            (text(LEFT - 8.0, y(value) + 4.0, "end", "#505050", &short(value)))
        }
        (curve(&panel.before, BEFORE, &y))
        @if rewritten { (curve(&panel.after, AFTER, &y)) }
        @if let Some(limit) = panel.limit.filter(|limit| *limit <= scale) {
            @let at = tenths(y(limit));
            line x1=(LEFT) x2=(right) y1=(at) y2=(at) stroke=(LIMIT) stroke-width="1.5" stroke-dasharray="7 4" {} "\n"
            (text(right, y(limit) - 5.0, "end", LIMIT, &format!("limit {} {}", short(limit), panel.unit)))
        }
    }
}

/// Shade from least to largest, line through the means.
fn curve(curve: &Curve, colour: &str, y: &dyn Fn(f64) -> f64) -> Markup {
    let x = |index: usize| LEFT + (WIDTH - LEFT - RIGHT) * (index as f64 + 0.5) / COLUMNS as f64;
    let filled: Vec<(usize, &Column)> = curve.columns.iter().enumerate().filter(|(_, c)| c.weight > 0.0).collect();
    let place = |index: usize, value: f64| format!("{:.1},{:.1}", x(index), y(value));
    let highs = filled.iter().map(|(index, column)| place(*index, column.high));
    let lows = filled.iter().rev().map(|(index, column)| place(*index, column.low));
    let shade: Vec<String> = highs.chain(lows).collect();
    let line: Vec<String> = filled.iter().map(|(index, column)| place(*index, column.sum / column.weight)).collect();
    html! {
        @if !filled.is_empty() {
            polygon points=(shade.join(" ")) fill=(colour) fill-opacity="0.22" {} "\n"
            polyline points=(line.join(" ")) fill="none" stroke=(colour) stroke-width="1.3" {} "\n"
        }
    }
}

/// The length of the path, and what the colours stand for.
fn footer(run: &ProgramRun) -> Markup {
    let whole: f64 = run.map.stations.iter().map(crate::engage::Station::length_mm).sum();
    let y = TOPS[1] + PANEL + 22.0;
    let legend: &[(&str, &str)] = if run.written.is_some() {
        &[("as programmed", BEFORE), ("as written", AFTER)]
    } else {
        &[("as programmed", BEFORE)]
    };
    html! {
        (text(LEFT, y, "start", "#505050", "0"))
        (text(WIDTH - RIGHT, y, "end", "#505050", &format!("{} mm along the feed moves", short(whole))))
        @for ((label, colour), x) in legend.iter().zip([330.0, 480.0]) {
            line x1=(x) x2=(x + 26.0) y1=(y - 4.0) y2=(y - 4.0) stroke=(colour) stroke-width="4" {} "\n"
            (text(x + 34.0, y, "start", "#303030", label))
        }
    }
}

fn text(x: f64, y: f64, anchor: &str, colour: &str, content: &str) -> Markup {
    html! { text x=(tenths(x)) y=(tenths(y)) text-anchor=(anchor) fill=(colour) { (content) } "\n" }
}

/// A place of a drawing, to a tenth of a pixel.
fn tenths(value: f64) -> String {
    format!("{value:.1}")
}

/// The next of 1, 2, 2.5, 4, 5, 8 times a power of ten.
fn nice(value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    let steps = [1.0, 1.2, 1.6, 2.0, 2.4, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
    steps.iter().map(|step| step * power).find(|step| *step >= value * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}
