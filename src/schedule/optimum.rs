//! The continuous optimum. In: a track. Out: [`Optimum`]: a chain fine enough where stations are coupled, b at its points,
//! the price of each cap, and how it was found.
//!
//! The exact pass is the answer wherever only caps and accelerations bind. Two things need more: speeds that break the jerk limit (legs
//! are cut finer there), and arcs, where the axes couple speed and acceleration. There the convex program is solved in windows. A window
//! ends at rest or at a point where speeds before and behind do not influence each other (`quiet`); a stretch without such a point is cut
//! into overlapping windows, and the answers in the overlap are thrown away. The solver is [`super::interior_point`]; a window that
//! it does not solve goes to clarabel ([`super::convex`]), at one scale and then at another. Every answer is verified by
//! [`super::check`]; a window without an answer that passes keeps the exact speeds, and [`Optimum::how`] says so.

use rayon::prelude::*;

use super::check::{Residuals, jerk_share, residuals};
use super::convex::{REST_FACTOR, Window, WindowAnswer, rest_cap, scales, solve_window};
use super::exact_pass::{Chain, Leg, exact_pass, exact_pass_below, leg_time_s};
use super::interior_point::solve_interior;
use super::track::Track;
use crate::ids::MoveId;

/// Longest window, points.
const WINDOW: usize = 1000;
/// Points of overlap on each side of a cut.
const OVERLAP: usize = 60;
/// Points between a place where speeds are coupled and the end of its window, at least.
const MARGIN: usize = 8;
/// Most pieces that the run-up (or run-down) of a leg is cut into.
const PIECES: usize = 4;
/// Rounds of linearising the jerk for clarabel.
const ROUNDS: usize = 2;
/// Residual of a cap or an acceleration that is accepted, as a share of the largest b of the window.
pub const ACCEPTED: f64 = 1e-6;
/// Jerk above its limit that is accepted, as a share: exceeding it slightly harms nothing, unlike a load.
pub const JERK_ACCEPTED: f64 = 1e-3;
/// Time above that of the exact pass that is accepted where no jerk binds, as a share.
pub const TIME_ACCEPTED: f64 = 1e-6;

/// The continuous optimum.
#[derive(Debug, Clone, Default)]
pub struct Optimum {
    /// The path, cut finer where needed.
    pub chain: Chain,
    /// Tag of each leg ([`Track::tags`]).
    pub tags: Vec<u32>,
    /// Move of each leg.
    pub moves: Vec<MoveId>,
    /// b at every point, mm²/s².
    pub b: Vec<f64>,
    /// Seconds that one unit more of the cap at a point saves, where a window gave it; NaN where the exact pass does.
    pub window_price_s: Vec<f64>,
    /// Windows, those that clarabel answered, and those whose answer was refused.
    pub windows: [usize; 3],
    /// Points where the jerk limit is still broken, of all points.
    pub jerky: usize,
}

impl Optimum {
    /// Time of every leg, s.
    pub fn leg_times(&self) -> Vec<f64> {
        let time = |(i, leg): (usize, &Leg)| time_of(leg, self.b[i], self.b[i + 1], self.is_windowed(i));
        self.chain.legs.iter().enumerate().map(time).collect()
    }
    /// How it was found: one sentence for the report.
    pub fn how(&self) -> String {
        let [windows, by_clarabel, refused] = self.windows;
        let mut text = format!("exact forward-backward pass over {} legs", self.chain.legs.len());
        if windows > 0 {
            text += &format!("; convex program in {windows} windows where speeds are coupled");
        }
        if by_clarabel > 0 {
            text += &format!(", {by_clarabel} of them by the second solver");
        }
        if refused > 0 {
            text += &format!(", {refused} of them refused by the check and left to the exact pass");
        }
        if self.jerky > 0 {
            text += &format!("; jerk above its limit at {} points", self.jerky);
        }
        text
    }
    /// Does a window limit the jerk of this leg, so that b is linear along it?
    pub fn is_windowed(&self, leg: usize) -> bool {
        let inside = !self.window_price_s[leg].is_nan() && !self.window_price_s[leg + 1].is_nan();
        inside && self.chain.legs[leg].jerk_mm_s3 < f64::INFINITY
    }
}

/// Time of a leg, s; `linear`: b is linear along it.
fn time_of(leg: &Leg, b0: f64, b1: f64, linear: bool) -> f64 {
    if !linear || b0 + b1 <= 0.0 {
        leg_time_s(leg, b0, b1)
    } else if b0.min(b1) <= 0.0 {
        REST_FACTOR * leg.ds_mm / b0.max(b1).sqrt()
    } else {
        2.0 * leg.ds_mm / (b0.sqrt() + b1.sqrt())
    }
}

/// The two solvers of a window: the second is used where the checker refuses the answer of the first.
#[derive(Clone, Copy)]
pub struct Solvers {
    /// The first.
    pub first: fn(&Window) -> Option<WindowAnswer>,
    /// The second.
    pub second: fn(&Window, f64) -> Option<WindowAnswer>,
}

/// Fastest speeds along the track. `change_s`: charge on changes of b (0: none).
pub fn optimum(track: Track, change_s: f64) -> Optimum {
    optimum_by(&Solvers { first: solve_interior, second: solve_window }, track, change_s)
}

/// The same by other solvers.
pub fn optimum_by(solvers: &Solvers, track: Track, change_s: f64) -> Optimum {
    let mut b = exact_pass(&track.chain);
    let jerks = track.chain.legs.iter().any(|leg| leg.jerk_mm_s3.is_finite());
    let Track { chain, tags, moves } = if jerks { refined(track, &b) } else { track };
    if jerks {
        b = exact_pass(&chain);
    }
    let caps = chain.point_caps();
    let windows = windows(&chain, &caps, &b);
    let answers: Vec<(Option<WindowAnswer>, bool)> =
        windows.par_iter().map(|range| solved(solvers, &chain, &caps, &b, range, change_s)).collect();
    let by_clarabel = answers.iter().filter(|(answer, first)| answer.is_some() && !first).count();
    let refused = answers.iter().filter(|(answer, _)| answer.is_none()).count();
    let mut window_price_s = vec![f64::NAN; b.len()];
    for (range, (answer, _)) in windows.iter().zip(&answers) {
        let Some(answer) = answer else {
            // The exact speeds stay, without prices.
            window_price_s[range.keep.clone()].fill(0.0);
            continue;
        };
        for point in range.keep.clone() {
            b[point] = answer.b[point - range.first];
            window_price_s[point] = answer.price_s[point - range.first];
        }
    }
    // At the seams between windows accelerations may be exceeded: one more exact pass, below these speeds, removes that.
    let b = exact_pass_below(&chain, b);
    let jerky = (1..b.len().max(1) - 1).filter(|&i| share_at(&chain, &b, i) > 1.0 + JERK_ACCEPTED).count();
    Optimum { chain, tags, moves, b, window_price_s, windows: [windows.len(), by_clarabel, refused], jerky }
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

/// Windows around every point for which the exact pass does not give the optimum.
fn windows(chain: &Chain, caps: &[f64], b: &[f64]) -> Vec<Range> {
    let points = b.len();
    let see = Seen { chain, caps, b };
    let mut out: Vec<Range> = Vec::new();
    let mut i = 0;
    while i < points {
        if !see.coupled(i) {
            i += 1;
            continue;
        }
        let floor = out.last().map_or(0, |range| range.last);
        // The window ends at the second quiet point: all points whose answer is used then have both neighbours in it.
        let (mut first, mut quiet) = (i, 0);
        while first > floor && !see.rest(first) && quiet < 2 {
            first -= 1;
            quiet += usize::from(i - first >= MARGIN && see.quiet(first));
        }
        let (mut last, mut since, mut quiet) = (i + 1, 0, 0);
        while last + 1 < points && !see.rest(last) && quiet < 2 {
            (since, quiet) = if see.coupled(last) { (0, 0) } else { (since + 1, quiet) };
            quiet += usize::from(since >= MARGIN && see.quiet(last));
            last += usize::from(quiet < 2);
        }
        let last = last.min(points - 1);
        let ends = [first + usize::from(!see.rest(first)), last + usize::from(see.rest(last))];
        cut(first, last, ends, &mut out);
        i = last;
    }
    out
}

/// The speeds of the exact pass, and what they tell about one point.
struct Seen<'a> {
    chain: &'a Chain,
    caps: &'a [f64],
    b: &'a [f64],
}

impl Seen<'_> {
    fn rest(&self, i: usize) -> bool {
        self.caps[i] <= 0.0
    }
    fn legs(&self, i: usize) -> &[Leg] {
        &self.chain.legs[i.saturating_sub(1)..(i + 1).min(self.chain.legs.len())]
    }
    /// Does the jerk limit bind here, or does an acceleration along an arc?
    fn coupled(&self, i: usize) -> bool {
        let Self { chain, caps, b } = self;
        let inner = i > 0 && i + 1 < b.len();
        let jerk = inner && share_at(chain, b, i) > 1.0 + JERK_ACCEPTED;
        let from_rest = i > 0 && caps[i - 1] <= 0.0 && b[i] > rest_cap(&chain.legs[i - 1]);
        let to_rest = i + 1 < b.len() && caps[i + 1] <= 0.0 && b[i] > rest_cap(&chain.legs[i]);
        jerk || from_rest || to_rest || (b[i] < caps[i] && self.legs(i).iter().any(|leg| leg.row_count > 0))
    }
    /// Do the speeds on both sides have nothing to do with each other? At rest, along a level cap, and at a cap between
    /// straight legs without a jerk limit.
    fn quiet(&self, i: usize) -> bool {
        let Self { caps, b, .. } = self;
        let inner = i > 0 && i + 1 < b.len();
        let free = |leg: &Leg| leg.row_count == 0 && leg.jerk_mm_s3 == f64::INFINITY;
        let level = || inner && b[i - 1] == b[i] && b[i + 1] == b[i];
        self.rest(i) || (b[i] >= caps[i] && (level() || self.legs(i).iter().all(free)))
    }
}

/// Cuts the points `first..=last` into overlapping windows. Only the answer at `ends[0]..ends[1]` is used: outside, unless the path is at
/// rest there, the exact pass holds.
fn cut(first: usize, last: usize, ends: [usize; 2], out: &mut Vec<Range>) {
    let count = if last - first <= WINDOW { 1 } else { (last - first).div_ceil(WINDOW - 2 * OVERLAP) };
    let size = (last - first).div_ceil(count);
    for k in 0..count {
        let (start, end) = (first + k * size, (first + (k + 1) * size).min(last));
        if start >= end {
            continue;
        }
        let keep = start.max(ends[0])..if end == last { ends[1] } else { end };
        let (before, after) = (start.saturating_sub(OVERLAP).max(first), (end + OVERLAP).min(last));
        out.push(Range { first: before, last: after, keep });
    }
}

/// Solves a window: its answer if it passes the check, and whether the first solver gave it.
fn solved(
    solvers: &Solvers,
    chain: &Chain,
    caps: &[f64],
    exact: &[f64],
    range: &Range,
    change_s: f64,
) -> (Option<WindowAnswer>, bool) {
    let (first, last) = (range.first, range.last);
    // Outside the window the exact speeds hold, so they cap its ends.
    let mut caps: Vec<f64> = caps[first..=last].to_vec();
    (caps[0], caps[last - first]) = (exact[first], exact[last]);
    let exact = &exact[first..=last];
    let part = slice(chain, first, last);
    let window = Window { chain: &part, caps: &caps, reference: exact, first: 0, last: last - first, change_s };
    let own = if change_s > 0.0 { None } else { (solvers.first)(&window) };
    match own.filter(|answer| passes(&window, answer)) {
        Some(answer) => (Some(answer), true),
        None => (rounds(solvers, &window), false),
    }
}

/// Does the answer keep all constraints, and is it no slower than the exact pass where that is the optimum?
fn passes(window: &Window, answer: &WindowAnswer) -> bool {
    let Residuals { bound, jerk } = residuals(window.chain, window.caps, 0, &answer.b);
    let legs = &window.chain.legs;
    let free = window.change_s <= 0.0 && legs.iter().all(|leg| leg.jerk_mm_s3 == f64::INFINITY);
    let time_s = |b: &[f64]| (0..legs.len()).map(|i| leg_time_s(&legs[i], b[i], b[i + 1])).sum::<f64>();
    let slow = free && time_s(&answer.b) > (1.0 + TIME_ACCEPTED) * time_s(window.reference);
    bound <= ACCEPTED && jerk <= JERK_ACCEPTED && !slow
}

/// Solves a window with the second solver, linearising the jerk anew at each answer; the last answer that passes the check.
fn rounds(solvers: &Solvers, window: &Window) -> Option<WindowAnswer> {
    let mut reference = window.reference.to_vec();
    let mut best: Option<WindowAnswer> = None;
    for _ in 0..ROUNDS {
        let linearised = Window { reference: &reference, ..*window };
        let at = |scale: f64| (solvers.second)(&linearised, scale).filter(|answer| passes(window, answer));
        let Some(answer) = scales(&linearised).into_iter().find_map(at) else { break };
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
    let count = |length_mm: f64| ((2.0 * length_mm / blend_mm).ceil() as usize).clamp(1, PIECES);
    let mut out = run_up(up, b0, peak, count(up));
    let middle = leg.ds_mm - up - down;
    if middle > 1e-6 * leg.ds_mm {
        out.push(middle);
    }
    out.extend(run_up(down, b1, peak, count(down)).into_iter().rev());
    out
}

/// A run-up of this length in pieces that take equal times at constant acceleration.
fn run_up(length_mm: f64, b0: f64, peak: f64, count: usize) -> Vec<f64> {
    if length_mm <= 0.0 {
        return Vec::new();
    }
    let (v0, v1) = (b0.sqrt(), peak.sqrt());
    let share = |k: usize| {
        let t = k as f64 / count as f64;
        (v0 * t + 0.5 * (v1 - v0) * t * t) / (0.5 * (v0 + v1))
    };
    (0..count).map(|k| length_mm * (share(k + 1) - share(k))).collect()
}
