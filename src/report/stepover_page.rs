//! The picture of a step-over plan: the surface seen from above, coloured by force and by scallop, as one HTML file. In: an
//! [`Answer`]. Out: text. Cells of the picture show the largest value of the passes within them.

use maud::{Markup, html};

use super::html::page;
use super::number::short;
use super::stepover::stepover_words;
use crate::finish::stepover::Answer;
use crate::finish::stepover::plan::Spot;

/// Cells along the longer side.
const CELLS: f64 = 120.0;
/// Side of the longer side on the screen, px.
const SIDE_PX: f64 = 460.0;

/// The page.
pub fn stepover_html(answer: &Answer, title: &str) -> String {
    let force = panel(answer, "force, N", answer.reference_n, |spot| spot.force_n);
    let scallop = panel(answer, "scallop, µm", 1e3 * answer.bounds.scallop_mm, |spot| 1e3 * spot.scallop_mm);
    page(title, &html! { p { (force) " " (scallop) } "\n" pre { (stepover_words(answer)) } "\n" })
}

/// The surface with a value; white is none, blue half the limit or less, green the limit, red a tenth above it.
fn panel(answer: &Answer, name: &str, limit: f64, of: impl Fn(&Spot) -> f64) -> Markup {
    let spots = || answer.varying.plan.passes.iter().flat_map(|pass| pass.stretches.iter().flatten());
    let start = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let bounds = spots().fold(start, |(low, high), spot| {
        ([0, 1].map(|k| low[k].min(spot.at[k])), [0, 1].map(|k| high[k].max(spot.at[k])))
    });
    let size = [0, 1].map(|k| (bounds.1[k] - bounds.0[k]).max(1e-6));
    let cell = size[0].max(size[1]) / CELLS;
    let count = size.map(|side| (side / cell).ceil() as usize + 1);
    let mut values = vec![f64::NAN; count[0] * count[1]];
    for spot in spots() {
        let [i, j] = [0, 1].map(|k| ((spot.at[k] - bounds.0[k]) / cell) as usize);
        let value = &mut values[j * count[0] + i];
        *value = value.max(of(spot));
    }
    let px = SIDE_PX / CELLS;
    let [width, height] = count.map(|n| n as f64 * px);
    let says = format!("{name}; limit {}: blue half of it, green at it, red above", short(limit));
    let whole = |length: f64| format!("{length:.0}");
    let cells = values.iter().enumerate().filter(|(_, value)| value.is_finite()).map(|(k, value)| {
        let (x, y) = ((k % count[0]) as f64 * px, 20.0 + height - ((k / count[0]) as f64 + 1.0) * px);
        let [x, y, side] = [format!("{x:.1}"), format!("{y:.1}"), format!("{px:.2}")];
        html! { rect x=(x) y=(y) width=(side) height=(side) fill=(colour(value / limit)) {} }
    });
    html! {
        svg width=(whole(width)) height=(whole(height + 20.0)) font-family="Helvetica,Arial,sans-serif" font-size="13" {
            text x="0" y="14" { (says) }
            @for cell in cells { (cell) }
        }
    }
}

/// Colour of a share of the limit: hue from blue (240) at half of it to green (120) at it, red (0) a tenth above.
fn colour(share: f64) -> String {
    let hue = if share <= 1.0 {
        240.0 - 240.0 * (share - 0.5).clamp(0.0, 0.5)
    } else {
        120.0 - 1200.0 * (share - 1.0).min(0.1)
    };
    format!("hsl({hue:.0},75%,50%)")
}
