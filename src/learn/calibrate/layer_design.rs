//! Design of the test cuts of a ball end for the layer model. In: radius of the ball, declared coefficients, largest
//! force, width of the block. Out: steps of depth, two widths, and two feeds at each.
//!
//! The columns of the fit are 1, L, t_m and L t_m (length of contact, largest chip). With the same feeds at every width
//! L and t_m grow together and the columns are nearly collinear; a narrow cut at high feeds and a wide one at low feeds
//! separate them. Among the candidates below the design of smallest worst-case error is chosen (minimax): the largest,
//! over the coefficients, of standard error times root mean square of the column, over the mean force of a layer, with
//! readings that scatter by [`NOISE`] of their value. The force of a layer is the difference of two readings and has
//! the variance of both; the fit weights all layers equally.

use crate::force::closed::ball_layer;
use crate::machine::material::LinearEdge;
use nalgebra::{Matrix4, Vector4};

/// Relative noise of readings that the expected errors of every plan assume.
pub(super) const NOISE: f64 = 0.03;

/// Candidate widths and feeds per tooth, in radii of the ball. Widths up to half a radius are finishing and light
/// roughing cuts; below a fiftieth, runout and setting errors are as large as the width. Feeds from the least that
/// forms a chip to the highest for coated carbide. Judgement.
const WIDTHS: [f64; 6] = [0.02, 0.05, 0.1, 0.2, 0.3, 0.5];
const FEEDS: [f64; 5] = [0.0025, 0.005, 0.01, 0.02, 0.03];
/// Number of steps of depth, and their size in radii: both end at the equator, where walls are cut. Few steps give
/// large differences, many resolve the outline.
const LADDERS: [(u32, f64); 2] = [(10, 0.1), (5, 0.2)];

/// Two widths with two feeds at each, in steps of depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Design {
    /// Number of steps, and depth of each, mm.
    pub steps: (u32, f64),
    /// Widths, mm.
    pub widths_mm: [f64; 2],
    /// Feeds per tooth at each, mm.
    pub feeds_mm: [[f64; 2]; 2],
}

/// Limits of the test cuts.
#[derive(Debug, Clone, Copy)]
pub struct Allowed {
    /// Largest force, N.
    pub force_n: f64,
    /// Width of the block, mm.
    pub width_mm: f64,
}

/// The design of smallest worst-case error, and that error; `None` if no design is within the limits.
pub fn best(ball_mm: f64, k: &LinearEdge, allowed: Allowed) -> Option<(Design, f64)> {
    let pairs = |n: usize| (0..n).flat_map(move |a| (a + 1..n).map(move |b| [a, b]));
    let mut found: Option<(Design, f64)> = None;
    for (steps, part) in LADDERS {
        let series: Vec<Vec<Option<Series>>> = WIDTHS
            .iter()
            .map(|width| {
                let of = |feed: &f64| Series::of(ball_mm, k, (steps, part * ball_mm), width * ball_mm, feed * ball_mm);
                FEEDS.iter().map(|feed| Some(of(feed)).filter(|series| series.largest_n <= allowed.force_n)).collect()
            })
            .collect();
        for widths in pairs(WIDTHS.len()) {
            let [thin, wide] = widths.map(|w| WIDTHS[w] * ball_mm);
            if ball_mm + f64::from(steps) * (thin + wide) > allowed.width_mm {
                continue;
            }
            for (low, high) in pairs(FEEDS.len()).flat_map(|low| pairs(FEEDS.len()).map(move |high| (low, high))) {
                let of = [(0, low[0]), (0, low[1]), (1, high[0]), (1, high[1])];
                let chosen: Option<Vec<&Series>> = of.iter().map(|(w, f)| series[widths[*w]][*f].as_ref()).collect();
                let Some(error) = chosen.and_then(|chosen| largest_error(&chosen)) else { continue };
                if found.is_none_or(|(_, least)| error < least) {
                    let feeds_mm = [low, high].map(|pair| pair.map(|f| FEEDS[f] * ball_mm));
                    found = Some((Design { steps: (steps, part * ball_mm), widths_mm: [thin, wide], feeds_mm }, error));
                }
            }
        }
    }
    found
}

/// Layers of one width and feed.
struct Series {
    /// Terms, force per mm of height, and the variance of that from the noise of the readings.
    layers: Vec<(Vector4<f64>, f64, f64)>,
    largest_n: f64,
}

impl Series {
    fn of(ball_mm: f64, k: &LinearEdge, (steps, dz): (u32, f64), width_mm: f64, feed_mm: f64) -> Self {
        let at = |height: f64| ball_layer(ball_mm, height, width_mm, feed_mm);
        let (mut reading, mut layers) = (0.0, Vec::new());
        for step in 0..steps {
            let (length, chip) = at((f64::from(step) + 0.5) * dz);
            let per_mm = k.k_tc * chip + k.k_te;
            let next: f64 = reading + per_mm * dz;
            if step > 0 {
                let variance = (NOISE / dz).powi(2) * (reading * reading + next * next);
                let chip_um = 1e3 * chip;
                layers.push((Vector4::new(1.0, length, chip_um, length * chip_um), per_mm, variance));
            }
            reading = next;
        }
        Self { layers, largest_n: reading }
    }
}

/// Worst-case expected error; `None` if the columns are collinear.
fn largest_error(chosen: &[&Series]) -> Option<f64> {
    let layers = || chosen.iter().flat_map(|series| &series.layers);
    let count = layers().count() as f64;
    let mean_n = layers().map(|(_, force, _)| force).sum::<f64>() / count;
    let squares: Vector4<f64> = layers().map(|(terms, ..)| terms.component_mul(terms)).sum();
    let size = squares.map(f64::sqrt);
    let scaled = |terms: &Vector4<f64>| terms.component_div(&size);
    let gram: Matrix4<f64> = layers().map(|(terms, ..)| scaled(terms) * scaled(terms).transpose()).sum();
    let inverse = gram.try_inverse()?;
    let spread: Matrix4<f64> =
        layers().map(|(terms, _, variance)| scaled(terms) * scaled(terms).transpose() * *variance).sum();
    let covariance = inverse * spread * inverse;
    // Standard error times root mean square of the column, as a share of the force.
    let worst = (0..4).map(|j| covariance[(j, j)].max(0.0).sqrt()).fold(0.0, f64::max);
    Some(worst / count.sqrt() / mean_n)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BALL_MM: f64 = 4.0;

    fn edge() -> LinearEdge {
        LinearEdge { k_tc: 842.0, k_te: 15.2, ..LinearEdge::default() }
    }

    /// Compared with a design of equal feeds: ten steps, widths 0.05 and 0.1 R, feeds 0.01 and 0.02 R at both.
    #[test]
    fn no_other_design_of_the_candidates_is_better_and_the_old_one_is_four_times_worse() {
        let k = edge();
        let free = Allowed { force_n: f64::INFINITY, width_mm: 70.0 };
        let (design, error) = best(BALL_MM, &k, free).expect("a design");
        let old: Vec<Series> = [(0.05, 0.01), (0.05, 0.02), (0.1, 0.01), (0.1, 0.02)]
            .map(|(width, feed)| Series::of(BALL_MM, &k, (10, 0.4), width * BALL_MM, feed * BALL_MM))
            .into();
        let before = largest_error(&old.iter().collect::<Vec<_>>()).expect("an error");
        assert!(error < 0.25 * before, "{design:?}: {error}, before {before}");
        // The narrow cut has the high feeds, the wide one the low.
        assert!(design.feeds_mm[0][1] > 2.0 * design.feeds_mm[1][1], "{design:?}");
    }

    #[test]
    fn what_the_shop_cannot_cut_is_not_proposed() {
        let k = edge();
        let wide = Allowed { force_n: f64::INFINITY, width_mm: 70.0 };
        let (free, error) = best(BALL_MM, &k, wide).expect("a design");
        let use_mm = BALL_MM + f64::from(free.steps.0) * free.widths_mm.iter().sum::<f64>();
        let (narrow, worse) = best(BALL_MM, &k, Allowed { width_mm: use_mm - 0.01, ..wide }).expect("a design");
        assert!(narrow != free && worse >= error, "{narrow:?}");
        let largest = |design: &Design| {
            let of = |w: usize, f: usize| {
                Series::of(BALL_MM, &k, design.steps, design.widths_mm[w], design.feeds_mm[w][f]).largest_n
            };
            of(0, 1).max(of(1, 1))
        };
        let force_n = largest(&free) - 0.01;
        let (gentle, worse) = best(BALL_MM, &k, Allowed { force_n, ..wide }).expect("a design");
        assert!(largest(&gentle) <= force_n && worse >= error);
        assert_eq!(best(BALL_MM, &k, Allowed { force_n: 1.0, ..wide }), None);
    }
}
