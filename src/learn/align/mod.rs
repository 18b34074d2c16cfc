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
pub mod predicted_load;

use crate::learn::log::Log;
use crate::learn::log::gaps::{longest_step, median_step};
use crate::learn::program::timeline::{Activity, Spot, Timeline};
use crate::path::Vec3;

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

/// Distance at which a position counts as off the path, mm. Judgement.
const OFF_PATH_MM: f64 = 1.0;
/// Penalty that decides between equally near points, mm: per mm that the tool would have moved; after a gap, per second
/// that it would be early or late.
const AHEAD: f64 = 1e-4;
const EARLY_OR_LATE_MM_S: f64 = 1e-3;

/// Follows the tool along the path.
pub fn by_position(log: &Log, timeline: &Timeline) -> Option<Aligned> {
    let axes = log.position_mm.as_ref()?;
    let points: Vec<Vec3> = (0..log.time_s.len()).map(|i| Vec3::new(axes[0][i], axes[1][i], axes[2][i])).collect();
    let spots = &timeline.spots;
    let fastest = spots.iter().map(Spot::speed_mm_s).filter(|v| v.is_finite()).fold(1.0, f64::max);
    let (mut spot, mut share, mut reach, mut off) = (0, 0.0, f64::INFINITY, 0);
    let mut program_s: Vec<f64> = Vec::with_capacity(points.len());
    let longest_s = longest_step(&log.time_s);
    for (i, p) in points.iter().enumerate() {
        let step_s = if i == 0 { 0.0 } else { log.time_s[i] - log.time_s[i - 1] };
        let most = if i == 0 { 500.0 } else { 1.5 * fastest * step_s + 1.0 };
        reach = if reach.is_finite() { f64::max(reach, most) } else { most };
        let expected_s = program_s.last().filter(|_| step_s > longest_s).map(|before| before + step_s);
        let found = nearest(spots, (spot, share), reach, p, expected_s);
        if found.distance < OFF_PATH_MM {
            (spot, share, reach) = (found.spot, found.share, most);
        } else {
            off += 1;
            reach *= 1.2;
        }
        program_s.push(spots[spot].start_s + share * (spots[spot].end_s - spots[spot].start_s));
    }
    spread_standing(&mut program_s, log, timeline);
    let moved = moves(&points);
    leave_ends(&mut program_s, &moved, timeline);
    let rate_s = median_step(&log.time_s);
    Some(Aligned {
        program_s,
        method: Method::Position,
        sample_uncertainty_s: vec![0.1 * rate_s; points.len()],
        uncertainty_s: 0.1 * rate_s,
        misfit: off as f64 / points.len().max(1) as f64,
        pauses: Vec::new(),
        holds: Vec::new(),
        feed_ratio: None,
        read_later_s: 0.0,
        acceleration: None,
    })
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
