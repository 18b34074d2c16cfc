//! Alignment of a log with its program. In: log, timeline. Out: for every sample the predicted program time at which
//! the machine is at the same place, NaN outside the program.
//!
//! By position: the tool is followed along the path, never backwards, to the nearest point within the distance that it
//! can have moved; of several equally near points the first, after a gap the one that fits the elapsed time. Samples at
//! which the tool stands still are spread over the dwells and tool changes at that place. By line: see [`line`]; by
//! load: see [`load`].

pub mod drift;
pub mod frame;
pub mod holds;
pub mod line;
pub mod load;
pub mod matching;
pub mod measured_load;
pub mod one_run;
pub mod predicted_load;

use crate::learn::log::Log;
use crate::learn::log::gaps::{longest_step, median_step};
use crate::learn::program::timeline::{Activity, Spot, Timeline};
use crate::path::Vec3;
use std::ops::Range;

/// What a log is aligned by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Positions of the axes.
    #[default]
    Position,
    /// Line numbers of the control.
    Line,
    /// The measured load alone.
    Load,
}

impl Method {
    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Method::Position => "position",
            Method::Line => "line",
            Method::Load => "load",
        }
    }
}

/// The alignment of a log.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Aligned {
    /// Predicted program time of each sample, s; NaN outside.
    pub program_s: Vec<f64>,
    /// Does each sample belong to the program: on the path ahead, on a line ahead, or within it by its load?
    pub placed: Vec<bool>,
    /// What it was aligned by.
    pub method: Method,
    /// Standard uncertainty of the program time of each sample, s.
    pub sample_uncertainty_s: Vec<f64>,
    /// Median of these over the samples in the program, s.
    pub uncertainty_s: f64,
    /// Share of the samples off the path or on no line of the program; by load, 1 − correlation of measured and fitted
    /// load.
    pub misfit: f64,
    /// Pauses: (time in the log, length), s.
    pub pauses: Vec<(f64, f64)>,
    /// Holds in which the load of the cut is gone: (from, to) in the log, s; found within runs of a line or by the load.
    pub holds: Vec<(f64, f64)>,
    /// Feed over the predicted one of each sample, where the lengths of the runs of lines show it.
    pub feed_ratio: Option<Vec<f64>>,
    /// How much later than its position each reading was taken, s.
    pub read_later_s: f64,
    /// Acceleration over the declared one that the times show, and its gain in log-likelihood, nats.
    pub acceleration: Option<(f64, f64)>,
}

impl Aligned {
    /// Stretches of [`ELSEWHERE_S`] and more that are not placed, with placed samples before and after: from … to (exclusive).
    pub fn elsewhere(&self, log: &Log) -> Vec<Range<usize>> {
        let mut at = 0;
        let stretches = self.placed.chunk_by(|a, b| a == b).map(|same| {
            at += same.len();
            (same[0], at - same.len()..at)
        });
        let lasts_s = |stretch: &Range<usize>| log.time_s[stretch.end] - log.time_s[stretch.start];
        let within =
            stretches.filter(|(placed, stretch)| !placed && stretch.start > 0 && stretch.end < self.placed.len());
        let long = within.map(|(_, stretch)| stretch).filter(|stretch| lasts_s(stretch) >= ELSEWHERE_S);
        if self.method == Method::Load { Vec::new() } else { long.collect() }
    }
}

/// Shortest stretch elsewhere than in the program that is left out and reported, s. Judgement: retracts to a place that the program does
/// not tell are shorter.
const ELSEWHERE_S: f64 = 4.0;
/// Distance at which a position counts as off the path, mm. Judgement.
const OFF_PATH_MM: f64 = 1.0;
/// Length of the path from its beginning in which a log begins, mm, and the share of samples off the path above which it may begin
/// elsewhere. Judgement.
const BEGINNING_MM: f64 = 500.0;
const LOST: f64 = 0.05;
/// Penalty that decides between equally near points, mm: per mm that the tool would have moved; after a gap, per second
/// that it would be early or late.
const AHEAD: f64 = 1e-4;
const EARLY_OR_LATE_MM_S: f64 = 1e-3;

/// Follows the tool along the path. If it is soon lost, the log begins elsewhere: in the middle of the program, or where the last run ended.
pub fn by_position(log: &Log, timeline: &Timeline) -> Option<Aligned> {
    let axes = log.position_mm.as_ref()?;
    let points: Vec<Vec3> = (0..log.time_s.len()).map(|i| Vec3::new(axes[0][i], axes[1][i], axes[2][i])).collect();
    let moved = moves(&points);
    let follow = |reach_mm: f64| followed(log, timeline, &points, &moved, reach_mm);
    let mut best = follow(BEGINNING_MM);
    if best.misfit() > LOST {
        for reach_mm in [f64::INFINITY, 0.0] {
            let other = follow(reach_mm);
            best = if other.misfit() < best.misfit() { other } else { best };
        }
    }
    let misfit = best.misfit();
    let Followed { mut program_s, placed } = best;
    spread_standing(&mut program_s, log, timeline);
    leave_ends(&mut program_s, &moved, timeline);
    let rate_s = median_step(&log.time_s);
    let mut aligned = Aligned {
        program_s,
        placed,
        method: Method::Position,
        sample_uncertainty_s: vec![0.1 * rate_s; points.len()],
        uncertainty_s: 0.1 * rate_s,
        misfit,
        pauses: Vec::new(),
        holds: Vec::new(),
        feed_ratio: None,
        read_later_s: 0.0,
        acceleration: None,
    };
    let begin = [&moved, &aligned.placed].map(|of| of.iter().position(|is| *is).unwrap_or(0));
    if begin[0] < begin[1] {
        // If the second moved, the first does too.
        let first = if begin[0] == 1 { 0 } else { begin[0] };
        aligned.program_s[first..begin[1]].fill(f64::NAN);
    }
    for stretch in aligned.elsewhere(log) {
        let is_wait = waiting_after(timeline, aligned.program_s[stretch.start]) > aligned.program_s[stretch.start];
        if is_wait {
            aligned.placed[stretch].fill(true);
        } else {
            aligned.program_s[stretch].fill(f64::NAN);
        }
    }
    Some(aligned)
}

/// The tool followed along the path: the program time of each sample, and whether it is on the path.
struct Followed {
    program_s: Vec<f64>,
    placed: Vec<bool>,
}

impl Followed {
    /// Share of the samples off the path.
    fn misfit(&self) -> f64 {
        self.placed.iter().filter(|on| !**on).count() as f64 / self.placed.len().max(1) as f64
    }
}

/// Follows the tool from a place within `first_reach_mm` of the path's beginning.
fn followed(log: &Log, timeline: &Timeline, points: &[Vec3], moved: &[bool], first_reach_mm: f64) -> Followed {
    let spots = &timeline.spots;
    let fastest = spots.iter().map(Spot::speed_mm_s).filter(|v| v.is_finite()).fold(1.0, f64::max);
    let (mut spot, mut share, mut reach) = (0, 0.0, first_reach_mm);
    let mut found_all = Followed { program_s: Vec::with_capacity(points.len()), placed: Vec::new() };
    let longest_s = longest_step(&log.time_s);
    for (i, p) in points.iter().enumerate() {
        let step_s = if i == 0 { 0.0 } else { log.time_s[i] - log.time_s[i - 1] };
        let most = if i == 0 { first_reach_mm } else { 1.5 * fastest * step_s + 1.0 };
        reach = f64::max(reach, most);
        let expected_s = found_all.program_s.last().filter(|_| step_s > longest_s).map(|before| before + step_s);
        let found = nearest(spots, (spot, share), reach, p, expected_s);
        let is_on = found.distance < OFF_PATH_MM;
        if is_on {
            (spot, share, reach) = (found.spot, found.share, most);
        } else if moved[i] {
            reach *= 1.2;
        }
        found_all.placed.push(is_on);
        found_all.program_s.push(spots[spot].start_s + share * (spots[spot].end_s - spots[spot].start_s));
    }
    found_all
}

struct NearestPlace {
    spot: usize,
    share: f64,
    distance: f64,
}

/// Nearest point of the path from a place (spot and share of it) on; `expected_s`: program time expected after a gap.
fn nearest(spots: &[Spot], (spot, share): (usize, f64), reach: f64, p: &Vec3, expected_s: Option<f64>) -> NearestPlace {
    let mut best = NearestPlace { spot, share, distance: f64::INFINITY };
    let (mut cost, mut ahead) = (f64::INFINITY, -share * spots[spot].length_mm);
    for (k, each) in spots.iter().enumerate().skip(spot) {
        if ahead > reach {
            break;
        }
        let along = each.to - each.from;
        let squared = along.norm_squared();
        let least = if k == spot { share } else { 0.0 };
        let t = if squared > 0.0 { ((p - each.from).dot(&along) / squared).clamp(least, 1.0) } else { 1.0 };
        let distance = (p - each.from - along * t).norm();
        let aside = match expected_s {
            Some(s) => EARLY_OR_LATE_MM_S * (each.start_s + t * (each.end_s - each.start_s) - s),
            None => AHEAD * (ahead + t * each.length_mm),
        };
        let total = distance.powi(2) + aside.powi(2);
        if total < cost - 1e-12 {
            cost = total;
            best = NearestPlace { spot: k, share: t, distance };
        }
        ahead += each.length_mm;
    }
    best
}

/// Samples before the first motion are counted back from it over the waits of the program there: what stands longer was logged before them,
/// and is outside. The number of these samples.
fn count_back_first(program_s: &mut [f64], log: &Log, timeline: &Timeline) -> usize {
    let Some(first) = program_s.first().copied() else { return 0 };
    let standing = program_s.iter().take_while(|at_s| *at_s - first < 1e-6).count();
    let end_s = waiting_after(timeline, first);
    let begin_s = waiting_before(timeline, end_s);
    if begin_s < end_s {
        let last = log.time_s[standing - 1];
        let back_s = |time: &f64| Some(end_s - 1e-6 - (last - time)).filter(|at_s| *at_s >= begin_s);
        let placed = log.time_s[..standing].iter().map(|time| back_s(time).unwrap_or(f64::NAN));
        program_s.iter_mut().zip(placed).for_each(|(slot, at_s)| *slot = at_s);
    }
    standing
}

/// Spreads samples at which the tool stands still over the waiting of the program there.
fn spread_standing(program_s: &mut [f64], log: &Log, timeline: &Timeline) {
    let n = program_s.len();
    let mut i = count_back_first(program_s, log, timeline);
    while i < n {
        let mut j = i;
        while j + 1 < n && program_s[j + 1] - program_s[i] < 1e-6 {
            j += 1;
        }
        let waits = waiting_after(timeline, program_s[i]);
        if j > i && waits > program_s[i] {
            let (from, to) = (log.time_s[i], log.time_s[j]);
            let begin = program_s[i];
            // The log runs at the program's pace until the wait is over; the rest of the samples stay at its end.
            for (slot, time) in program_s[i..=j].iter_mut().zip(&log.time_s[i..=j]) {
                let t = time - from;
                *slot = begin + (t * ((waits - begin) / (to - from).max(1e-9)).max(1.0)).min(waits - begin - 1e-6);
            }
        }
        i = j + 1;
    }
}

/// End of the dwells, tool changes and run-ups that begin at a program time; the time itself if there are none.
fn waiting_after(timeline: &Timeline, time_s: f64) -> f64 {
    let Some(mut k) = timeline.at(time_s) else { return time_s };
    if timeline.spots[k].end_s <= time_s + 1e-6 {
        k += 1;
    } else if !is_wait(timeline.spots[k].activity) {
        return time_s;
    }
    while k < timeline.spots.len() && is_wait(timeline.spots[k].activity) {
        k += 1;
    }
    if k == 0 { time_s } else { timeline.spots[k - 1].end_s.max(time_s) }
}

/// Beginning of the dwells, tool changes and run-ups that end at a program time; the time itself if there are none.
fn waiting_before(timeline: &Timeline, time_s: f64) -> f64 {
    let Some(last) = timeline.at(time_s).map(|k| k + 1) else { return time_s };
    let waits = timeline.spots[..last].iter().rev().take_while(|spot| is_wait(spot.activity));
    waits.last().map_or(time_s, |first| first.start_s)
}

fn is_wait(activity: Activity) -> bool {
    matches!(activity, Activity::Dwell | Activity::ToolChange | Activity::RunUp)
}

fn moves(points: &[Vec3]) -> Vec<bool> {
    (0..points.len()).map(|i| i > 0 && (points[i] - points[i - 1]).norm() > 1e-4).collect()
}

/// Places samples before the first motion and after the last outside, unless the program waits there.
fn leave_ends(program_s: &mut [f64], moved: &[bool], timeline: &Timeline) {
    let n = program_s.len();
    let first = moved.iter().position(|m| *m).unwrap_or(n);
    let last = moved.iter().rposition(|m| *m).unwrap_or(0);
    let end = timeline.total_s();
    for (i, time) in program_s.iter_mut().enumerate() {
        let at_end = i > last + 1 && *time >= end - 1e-3;
        let at_start = i + 1 < first && *time <= 1e-3;
        if at_end || at_start {
            *time = f64::NAN;
        }
    }
}

/// Median uncertainty of the samples in the program, s: a few samples far from all observations (with little weight) do
/// not count.
pub(in crate::learn) fn median_uncertainty(program_s: &[f64], sample_uncertainty_s: &[f64]) -> f64 {
    let mut placed: Vec<f64> =
        program_s.iter().zip(sample_uncertainty_s).filter(|(t, _)| t.is_finite()).map(|(_, s)| *s).collect();
    if placed.is_empty() {
        return f64::INFINITY;
    }
    let middle = placed.len() / 2;
    *placed.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Log time over program time from the first placed sample to the last.
pub fn stretch(aligned: &Aligned, log: &Log) -> f64 {
    let mut pairs = log.time_s.iter().zip(&aligned.program_s).filter(|(_, p)| p.is_finite()).map(|(t, p)| (*t, *p));
    let first = pairs.next().unwrap_or_default();
    let last = pairs.next_back().unwrap_or(first);
    (last.0 - first.0) / (last.1 - first.1).max(1e-9)
}
