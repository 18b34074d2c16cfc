//! The continuous optimum. In: a track. Out: [`Optimum`]: a chain fine enough where stations are coupled, b at its points,
//! the price of each cap, and how it was found.
//!
//! The exact pass answers wherever only caps and accelerations bind. Where its speeds would break the jerk limit, legs are
//! cut finer and the convex program of [`super::convex`] is solved in windows: they end at rest or at points where the exact
//! speeds are quiet; a stretch without such a point is cut into windows that overlap, and the overlap is thrown away. Every
//! answer passes [`super::check`]; what does not keeps the exact speeds, and the answer says so.

use rayon::prelude::*;

use super::check::{Residuals, jerk_share, residuals};
use super::convex::{REST_FACTOR, Window, WindowAnswer, rest_cap, solve_window};
use super::pass::{Chain, Leg, exact_pass, leg_time_s};
use super::track::Track;
use crate::ids::MoveId;

/// Longest window, points.
const WINDOW: usize = 500;
/// Points of overlap on each side of a cut.
const OVERLAP: usize = 60;
/// Points kept between a broken jerk limit and the end of its window.
const MARGIN: usize = 8;
/// Most pieces that the run-up (or run-down) of a leg is cut into.
const PIECES: usize = 4;
/// Rounds of linearising the jerk.
const ROUNDS: usize = 2;
/// Residual of a cap or an acceleration that is accepted, as a share of the largest b of the window.
pub const ACCEPTED: f64 = 1e-6;
/// Jerk above its limit that is accepted, as a share: it is a comfort, not a load.
pub const JERK_ACCEPTED: f64 = 1e-3;

/// The continuous optimum.
#[derive(Debug, Clone, Default)]
pub struct Optimum {
    /// The path, cut finer where needed.
    pub chain: Chain,
    /// Tag of the span of each leg.
    pub tags: Vec<u32>,
    /// Move of each leg.
    pub moves: Vec<MoveId>,
    /// b at every point, mm²/s².
    pub b: Vec<f64>,
    /// Seconds that one unit more of the cap at a point saves, where a window gave it; NaN where the exact pass did.
    pub window_price_s: Vec<f64>,
    /// Windows solved, and windows whose answer was refused.
    pub windows: (usize, usize),
    /// Points where the jerk limit is still broken, of all points.
    pub jerky: usize,
}

impl Optimum {
    /// Time of every leg, s.
    pub fn leg_times(&self) -> Vec<f64> {
        let time = |(i, leg): (usize, &Leg)| {
            let (b0, b1) = (self.b[i], self.b[i + 1]);
            // Inside a window b is linear along a leg.
            if self.window_price_s[i].is_nan() || self.window_price_s[i + 1].is_nan() || b0 + b1 <= 0.0 {
                leg_time_s(leg, b0, b1)
            } else if b0.min(b1) <= 0.0 && leg.jerk_mm_s3.is_finite() {
                REST_FACTOR * leg.ds_mm / b0.max(b1).sqrt()
            } else {
                2.0 * leg.ds_mm / (b0.sqrt() + b1.sqrt())
            }
        };
        self.chain.legs.iter().enumerate().map(time).collect()
    }
}

/// Fastest speeds along the track. `change_s`: charge on changes of b (0: none).
pub fn optimum(track: Track, change_s: f64) -> Optimum {
    let b = exact_pass(&track.chain);
    let coupled = track.chain.legs.iter().any(|leg| leg.jerk_mm_s3.is_finite());
    let Track { chain, tags, moves } = if coupled { refined(track, &b) } else { track };
    let mut b = exact_pass(&chain);
    let caps = chain.point_caps();
    let windows = if coupled { windows(&chain, &caps, &b) } else { Vec::new() };
    let answers: Vec<Option<WindowAnswer>> =
        windows.par_iter().map(|range| rounds(&chain, &caps, &b, range, change_s)).collect();
    let refused = answers.iter().filter(|answer| answer.is_none()).count();
    let mut window_price_s = vec![f64::NAN; b.len()];
    for (range, answer) in windows.iter().zip(&answers) {
        let Some(answer) = answer else { continue };
        for point in range.keep.clone() {
            b[point] = b[point].min(answer.b[point - range.first]);
            window_price_s[point] = answer.price_s[point - range.first];
        }
    }
    let b = clipped(&chain, b);
    let jerky = (1..b.len().max(1) - 1).filter(|&i| share_at(&chain, &b, i) > 1.0 + JERK_ACCEPTED).count();
    Optimum { chain, tags, moves, b, window_price_s, windows: (windows.len(), refused), jerky }
}

/// What the seams of windows left above the accelerations is taken away.
fn clipped(chain: &Chain, b: Vec<f64>) -> Vec<f64> {
    let held = Chain { legs: chain.legs.clone(), point_b: b, rows: chain.rows.clone() };
    exact_pass(&held)
}

/// Points of a window, and those of its answer that are kept.
struct Range {
    first: usize,
    last: usize,
    keep: std::ops::Range<usize>,
}

fn share_at(chain: &Chain, b: &[f64], i: usize) -> f64 {
    if b[i] <= 0.0 { 0.0 } else { jerk_share(&chain.legs[i - 1], &chain.legs[i], [b[i - 1], b[i], b[i + 1]]) }
}

/// Windows around every point where the exact speeds break the jerk limit.
fn windows(chain: &Chain, caps: &[f64], b: &[f64]) -> Vec<Range> {
    let points = b.len();
    let broken = |i: usize| {
        let inner = i > 0 && i + 1 < points && share_at(chain, b, i) > 1.0 + JERK_ACCEPTED;
        let from_rest = i > 0 && caps[i - 1] <= 0.0 && b[i] > rest_cap(&chain.legs[i - 1]);
        let to_rest = i + 1 < points && caps[i + 1] <= 0.0 && b[i] > rest_cap(&chain.legs[i]);
        inner || from_rest || to_rest
    };
    let rest = |i: usize| caps[i] <= 0.0;
    let quiet =
        |i: usize| rest(i) || (b[i] >= caps[i] && i > 0 && i + 1 < points && b[i - 1] == b[i] && b[i + 1] == b[i]);
    let mut out: Vec<Range> = Vec::new();
    let mut i = 0;
    while i < points {
        if !broken(i) {
            i += 1;
            continue;
        }
        let floor = out.last().map_or(0, |range| range.last);
        let mut first = i;
        while first > floor && !rest(first) && (i - first < MARGIN || !quiet(first)) {
            first -= 1;
        }
        let (mut last, mut since) = (i + 1, 0);
        while last + 1 < points && !rest(last) && (since < MARGIN || !quiet(last)) {
            since = if broken(last) { 0 } else { since + 1 };
            last += 1;
        }
        cut(first, last.min(points - 1), &mut out);
        i = last;
    }
    out
}

/// Cuts a stretch into windows that overlap.
fn cut(first: usize, last: usize, out: &mut Vec<Range>) {
    let count = (last - first).div_ceil(WINDOW - 2 * OVERLAP).max(1);
    let count = if last - first <= WINDOW { 1 } else { count };
    let size = (last - first).div_ceil(count);
    for k in 0..count {
        let (start, end) = (first + k * size, (first + (k + 1) * size).min(last));
        if start >= end {
            continue;
        }
        let keep_end = if end == last { end + 1 } else { end };
        let (before, after) = (start.saturating_sub(OVERLAP).max(first), (end + OVERLAP).min(last));
        out.push(Range { first: before, last: after, keep: start..keep_end });
    }
}

/// Solves a window, linearising the jerk anew at each answer; the last answer that passes the check.
fn rounds(chain: &Chain, caps: &[f64], exact: &[f64], range: &Range, change_s: f64) -> Option<WindowAnswer> {
    let (first, last) = (range.first, range.last);
    // Outside the window the exact speeds hold: they bound its ends.
    let mut caps: Vec<f64> = caps[first..=last].to_vec();
    (caps[0], caps[last - first]) = (exact[first], exact[last]);
    let mut reference = exact[first..=last].to_vec();
    let mut best: Option<WindowAnswer> = None;
    let part = slice(chain, first, last);
    for _ in 0..ROUNDS {
        let window =
            Window { chain: &part, caps: &caps, reference: &reference, first: 0, last: last - first, change_s };
        let Some(answer) = solve_window(&window) else { break };
        let Residuals { bound, jerk } = residuals(&part, &caps, 0, &answer.b);
        if bound > ACCEPTED || jerk > JERK_ACCEPTED {
            break;
        }
        let moved = (0..reference.len()).map(|i| (answer.b[i] - reference[i]).abs()).fold(0.0, f64::max);
        reference.clone_from(&answer.b);
        let done = moved <= 0.05 * reference.iter().copied().fold(0.0, f64::max);
        best = Some(answer);
        if done {
            break;
        }
    }
    best
}

/// The legs between two points as a chain of their own.
fn slice(chain: &Chain, first: usize, last: usize) -> Chain {
    let mut part = Chain { legs: chain.legs[first..last].to_vec(), ..Chain::default() };
    part.point_b = chain.point_b[first..=last].to_vec();
    for leg in &mut part.legs {
        let rows = chain.rows_of(leg);
        leg.first_row = part.rows.len() as u32;
        part.rows.extend_from_slice(rows);
    }
    part
}

/// Cuts the straight legs on which the exact speeds change: the run-up and the run-down into pieces, the rest in one.
fn refined(track: Track, b: &[f64]) -> Track {
    let mut out = Track { chain: Chain { rows: track.chain.rows, ..Chain::default() }, ..Track::default() };
    out.chain.point_b.push(track.chain.point_b[0]);
    for (i, leg) in track.chain.legs.iter().enumerate() {
        let pieces = pieces(leg, b[i], b[i + 1]);
        let count = pieces.len();
        for (k, ds_mm) in pieces.into_iter().enumerate() {
            out.chain.legs.push(Leg { ds_mm, ..*leg });
            out.chain.point_b.push(if k + 1 == count { track.chain.point_b[i + 1] } else { f64::INFINITY });
            out.tags.push(track.tags[i]);
            out.moves.push(track.moves[i]);
        }
    }
    out
}

/// Lengths of the pieces of a leg.
fn pieces(leg: &Leg, b0: f64, b1: f64) -> Vec<f64> {
    let a = leg.accel_mm_s2;
    let peak = (0.5 * (b0 + b1) + a * leg.ds_mm).min(leg.cap_b);
    // The jerk-limited change of speed takes longer than the exact one by v·a/J.
    let blend_mm = peak.sqrt() * a / leg.jerk_mm_s3;
    let steady = peak <= 0.0 || (peak - b0).max(peak - b1) <= 1e-9 * peak;
    // A leg that is short against that distance, between legs that are as short, is fine as it is.
    let short = leg.ds_mm < blend_mm && b0 > 0.0 && b1 > 0.0;
    if leg.row_count > 0 || !leg.jerk_mm_s3.is_finite() || steady || short {
        return vec![leg.ds_mm];
    }
    let room = |b: f64| if b < peak { (peak - b) / (2.0 * a) + blend_mm } else { 0.0 };
    let (mut up, mut down) = (room(b0), room(b1));
    if up + down > leg.ds_mm {
        let share = leg.ds_mm / (up + down);
        (up, down) = (up * share, down * share);
    }
    let count =
        |length: f64| if length > 0.0 { ((2.0 * length / blend_mm).ceil() as usize).clamp(1, PIECES) } else { 0 };
    let mut out = vec![up / count(up).max(1) as f64; count(up)];
    let middle = leg.ds_mm - up - down;
    if middle > 1e-6 * leg.ds_mm {
        out.push(middle);
    }
    out.extend(vec![down / count(down).max(1) as f64; count(down)]);
    out
}
