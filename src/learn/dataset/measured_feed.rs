//! Realised feed over the predicted one: override, slow corners, stops. In: a log placed in its program. Out: a ratio
//! for every sample; `None` if the log does not show the feed.
//!
//! If the log is aligned by positions, the ratio at a sample is Δp/Δt over [`SPAN_S`] about it (longer where the clock of the log is not
//! even), with p the predicted
//! program time at the position of the tool and t the log time. Otherwise it is the logged feed over the predicted
//! speed; if a control logs the commanded feed instead of the realised one (it does not fall in corners), over the
//! highest predicted speed of the move.

use crate::learn::align::{Aligned, Method};
use crate::learn::log::Log;
use crate::learn::program::timeline::{Activity, Spot, Timeline};
use crate::learn::regress::statistics::{median, scale_of};
use crate::learn::report::FeedEvent;

/// Time over which positions are differentiated, s: a few samples at the 10 … 50 Hz of controls, and shorter than most
/// blocks.
const SPAN_S: f64 = 0.3;
/// The same, in deviations of the time stamps of a clock that is not even: the feed then scatters by a thirtieth. Judgement.
const SPAN_JITTERS: f64 = 30.0;
/// Largest ratio: overrides end at 150 or 200 %.
const MOST: f64 = 2.5;
/// Share of the predicted feed below which the tool stands still. Judgement.
const STANDS: f64 = 0.05;
/// Predicted speed over the highest of its move below which a place counts as a corner. Judgement.
const CORNER: f64 = 0.7;
/// Median ratio of logged feed to predicted speed in corners above which the control logs the commanded feed.
/// Judgement.
const COMMANDED_OVER: f64 = 1.25;
/// Shortest stop and shortest stretch at another feed that are reported, s, and the least deviation of that feed.
/// Judgement.
const LISTED_S: [f64; 2] = [1.0, 4.0];
const LISTED_OFF: f64 = 0.05;

/// The ratios of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredFeed {
    /// Feed over the predicted one, sample by sample; 1 outside feed moves.
    pub ratio: Vec<f64>,
}

/// The feed of every sample over the predicted one; `None` if the log does not show it.
pub fn measured_feed(log: &Log, aligned: &Aligned, timeline: &Timeline) -> Option<MeasuredFeed> {
    let in_feed: Vec<Option<usize>> = aligned.program_s.iter().map(|t| feed_spot(timeline, *t)).collect();
    let ratio = match (&log.feed_mm_s, aligned.method) {
        (_, Method::Position) => by_way(log, aligned, &in_feed),
        (Some(feed), _) => by_column(feed, timeline, &in_feed)?,
        (None, _) => aligned.feed_ratio.clone()?,
    };
    Some(MeasuredFeed { ratio })
}

/// Spot of a feed move at a predicted time.
fn feed_spot(timeline: &Timeline, time_s: f64) -> Option<usize> {
    timeline.at(time_s).filter(|k| timeline.spots[*k].activity == Activity::Feed)
}

fn by_way(log: &Log, aligned: &Aligned, in_feed: &[Option<usize>]) -> Vec<f64> {
    let (t, p) = (&log.time_s, &aligned.program_s);
    let span_s = SPAN_S.max(SPAN_JITTERS * jitter_s(t, p, in_feed));
    let reach = |i: usize, step: isize| {
        let mut k = i;
        while let Some(next) = k.checked_add_signed(step).filter(|n| *n < t.len() && in_feed[*n].is_some()) {
            k = next;
            if (t[k] - t[i]).abs() >= 0.5 * span_s {
                break;
            }
        }
        k
    };
    let ratio = |i: usize| {
        let (from, to) = (reach(i, -1), reach(i, 1));
        if in_feed[i].is_none() || from == to { 1.0 } else { (p[to] - p[from]) / (t[to] - t[from]) }
    };
    (0..t.len()).map(|i| ratio(i).clamp(0.0, MOST)).collect()
}

/// Standard deviation of the steps of the clock against those of the places, s.
fn jitter_s(time_s: &[f64], program_s: &[f64], in_feed: &[Option<usize>]) -> f64 {
    let both = |k: &usize| in_feed[*k].is_some() && in_feed[k + 1].is_some();
    let off = |k: usize| (program_s[k + 1] - program_s[k]) - (time_s[k + 1] - time_s[k]);
    let steps: Vec<f64> = (0..time_s.len().saturating_sub(1)).filter(both).map(off).collect();
    let middle = median(&steps);
    scale_of(&steps.iter().map(|step| step - middle).collect::<Vec<f64>>())
}

fn by_column(feed: &[f64], timeline: &Timeline, in_feed: &[Option<usize>]) -> Option<Vec<f64>> {
    let spots = &timeline.spots;
    let of_move = |of: &[Spot]| vec![of.iter().map(Spot::speed_mm_s).fold(0.0, f64::max); of.len()];
    let fastest: Vec<f64> = spots.chunk_by(|a, b| a.move_id == b.move_id).flat_map(of_move).collect();
    let known = |i: &usize| feed[*i].is_finite() && in_feed[*i].is_some();
    let over = |i: usize, k: usize| feed[i] / spots[k].speed_mm_s().max(1e-9);
    let samples: Vec<(usize, usize)> = (0..feed.len()).filter(known).filter_map(|i| Some((i, in_feed[i]?))).collect();
    if samples.is_empty() {
        return None;
    }
    let corners = samples.iter().filter(|(_, k)| spots[*k].speed_mm_s() < CORNER * fastest[*k]);
    let is_commanded = median(&corners.map(|(i, k)| over(*i, *k)).collect::<Vec<f64>>()) > COMMANDED_OVER;
    let mut ratio = vec![1.0; feed.len()];
    for (i, k) in samples {
        let own = if is_commanded { feed[i] / fastest[k].max(1e-9) } else { over(i, k) };
        ratio[i] = own.clamp(0.0, MOST);
    }
    Some(ratio)
}

impl MeasuredFeed {
    /// Does the tool stand still at this sample, although the program feeds?
    pub fn stands(&self, i: usize) -> bool {
        self.ratio[i] < STANDS
    }

    /// Share of the samples in feed moves at which the tool stands still.
    pub fn standing(&self, aligned: &Aligned, timeline: &Timeline) -> f64 {
        let feeds = |i: &usize| feed_spot(timeline, aligned.program_s[*i]).is_some();
        let samples: Vec<usize> = (0..self.ratio.len()).filter(feeds).collect();
        samples.iter().filter(|i| self.stands(**i)).count() as f64 / samples.len().max(1) as f64
    }

    /// Stops and stretches at another feed, in order.
    pub fn events(&self, log: &Log, aligned: &Aligned, timeline: &Timeline) -> Vec<FeedEvent> {
        let place = |i: usize| feed_spot(timeline, aligned.program_s[i]);
        let kind = |i: usize| [self.stands(i), self.ratio[i] <= 1.0 - LISTED_OFF, self.ratio[i] >= 1.0 + LISTED_OFF];
        let cut: Vec<usize> = (0..log.time_s.len()).filter(|i| place(*i).is_some()).collect();
        let mut events = Vec::new();
        for stretch in cut.chunk_by(|a, b| kind(*a) == kind(*b)) {
            let (first, last) = (stretch[0], stretch[stretch.len() - 1]);
            let ratio = median(&stretch.iter().map(|i| self.ratio[*i]).collect::<Vec<f64>>());
            let is_stand = ratio < STANDS;
            // Rapids and tool changes between two feed moves do not count.
            let in_feed = stretch.windows(2).filter(|pair| pair[1] == pair[0] + 1);
            let lasts_s: f64 = in_feed.map(|pair| log.time_s[pair[1]] - log.time_s[pair[0]]).sum();
            if lasts_s < LISTED_S[usize::from(!is_stand)] || (ratio - 1.0).abs() < LISTED_OFF {
                continue;
            }
            let line = |i: usize| place(i).map_or(0, |k| timeline.spots[k].line);
            events.push(FeedEvent {
                time_s: [log.time_s[first], log.time_s[last]],
                lines: [line(first), line(last)],
                ratio: if is_stand { 0.0 } else { ratio },
                elsewhere: false,
            });
        }
        events
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::Vec3;

    /// Ten seconds along X at 10 mm/s, with a corner at half speed in each second move.
    fn straight() -> Timeline {
        let spot = |k: usize| Spot {
            start_s: 0.1 * k as f64,
            end_s: 0.1 * (k + 1) as f64,
            activity: Activity::Feed,
            move_id: Some(crate::ids::MoveId((k / 10) as u32)),
            middle_mm: 0.5,
            line: 1 + (k / 10) as u32,
            block: 0,
            tool: 1,
            coolant: false,
            rps: 100.0,
            from: Vec3::new(k as f64, 0.0, 0.0),
            to: Vec3::new((k + 1) as f64, 0.0, 0.0),
            direction: Vec3::new(1.0, 0.0, 0.0),
            length_mm: if k % 10 == 9 { 0.5 } else { 1.0 },
            curvature_per_mm: 0.0,
            engaged: crate::force::contact::Engaged::default(),
        };
        Timeline { spots: (0..100).map(spot).collect(), runouts: Vec::new() }
    }

    /// A log of that program at 20 Hz, at `ratio(t)` of its feed.
    fn logged(ratio: impl Fn(f64) -> f64, feed: Option<f64>) -> (Log, Aligned) {
        let (mut p, mut t) = (vec![0.0], vec![0.0]);
        while p[p.len() - 1] < 9.9 {
            let now = t[t.len() - 1];
            p.push(p[p.len() - 1] + 0.05 * ratio(now));
            t.push(now + 0.05);
        }
        let feed_mm_s = feed.map(|f| t.iter().map(|now| f * ratio(*now)).collect());
        let log = Log { time_s: t, feed_mm_s, ..Log::default() };
        let method = if feed.is_some() { Method::Line } else { Method::Position };
        (log, Aligned { program_s: p, method, ..Aligned::default() })
    }

    #[test]
    fn an_override_is_the_ratio_of_the_times_and_is_listed() {
        let program = straight();
        let (log, aligned) = logged(|t| if (2.0..9.0).contains(&t) { 0.8 } else { 1.0 }, None);
        let found = measured_feed(&log, &aligned, &program).unwrap();
        assert!((found.ratio[10] - 1.0).abs() < 1e-9 && (found.ratio[100] - 0.8).abs() < 1e-9);
        let events = found.events(&log, &aligned, &program);
        assert_eq!(events.len(), 1, "{events:?}");
        assert!((events[0].ratio - 0.8).abs() < 0.01 && (events[0].time_s[0] - 2.0).abs() < 0.3);
        assert!(events[0].in_words().contains("80 % of the predicted feed"), "{}", events[0].in_words());
    }

    #[test]
    fn a_clock_that_is_not_even_does_not_scatter_the_feed() {
        let program = straight();
        let (mut log, aligned) = logged(|t| if t < 5.0 { 1.0 } else { 0.7 }, None);
        let uneven = |k: usize| 0.02 * (((k * 7919) % 101) as f64 / 50.0 - 1.0);
        log.time_s.iter_mut().enumerate().for_each(|(k, time)| *time += uneven(k));
        let found = measured_feed(&log, &aligned, &program).unwrap();
        let off = |i: usize| found.ratio[i] - if log.time_s[i] < 5.0 { 1.0 } else { 0.7 };
        let inner = (10..log.time_s.len() - 10).filter(|i| (log.time_s[*i] - 5.0).abs() > 0.5);
        let worst = inner.map(|i| off(i).abs()).fold(0.0, f64::max);
        assert!(worst < 0.1, "{worst}");
    }

    #[test]
    fn a_stop_is_a_stand_and_a_short_one_or_a_small_change_is_nothing() {
        let program = straight();
        let (log, aligned) = logged(|t| if (4.0..7.0).contains(&t) { 0.0 } else { 1.0 }, None);
        let found = measured_feed(&log, &aligned, &program).unwrap();
        assert!(found.stands(110) && !found.stands(20));
        assert_eq!(found.events(&log, &aligned, &program)[0].ratio, 0.0);
        for quiet in [|_: f64| 0.97, |t: f64| if (4.0..4.6).contains(&t) { 0.0 } else { 1.0 }] {
            let (log, aligned) = logged(quiet, None);
            let found = measured_feed(&log, &aligned, &program).unwrap();
            assert_eq!(found.events(&log, &aligned, &program), []);
        }
    }

    #[test]
    fn the_time_of_a_tool_change_is_none_at_another_feed() {
        let mut program = straight();
        program.spots[30..70].iter_mut().for_each(|spot| spot.activity = Activity::ToolChange);
        // A tenth too fast for half a second before the change and after it.
        let beside = |t: f64| (2.5..3.0).contains(&t) || (7.0..7.5).contains(&t);
        let (log, aligned) = logged(|t| if beside(t) { 1.1 } else { 1.0 }, None);
        let found = measured_feed(&log, &aligned, &program).unwrap();
        assert!(found.ratio.iter().any(|r| *r > 1.09));
        assert_eq!(found.events(&log, &aligned, &program), []);
        // An override that continues after a rapid is one event.
        program.spots[30..34].iter_mut().for_each(|spot| spot.activity = Activity::Rapid);
        program.spots[34..70].iter_mut().for_each(|spot| spot.activity = Activity::Feed);
        let (log, aligned) = logged(|t| if (1.0..7.0).contains(&t) { 1.1 } else { 1.0 }, None);
        let found = measured_feed(&log, &aligned, &program).unwrap();
        assert_eq!(found.events(&log, &aligned, &program).len(), 1);
    }

    #[test]
    fn a_logged_feed_that_does_not_fall_in_corners_is_the_one_the_control_was_told() {
        let program = straight();
        let (log, aligned) = logged(|_| 0.8, Some(10.0));
        let told = measured_feed(&log, &aligned, &program).unwrap();
        assert!(told.ratio[1..190].iter().all(|r| (r - 0.8).abs() < 1e-9));
        // The same machine with the realised feed logged: half in the corners.
        let running = |p: f64| if ((p * 10.0) as usize) % 10 == 9 { 4.0 } else { 8.0 };
        let feed = aligned.program_s.iter().map(|p| running(*p)).collect();
        let log = Log { feed_mm_s: Some(feed), ..log };
        let run = measured_feed(&log, &aligned, &program).unwrap();
        assert!(run.ratio[5..20].iter().all(|r| (r - 0.8).abs() < 1e-9), "{:?}", &run.ratio[..30]);
        assert_eq!(measured_feed(&Log { feed_mm_s: None, ..log }, &aligned, &program), None);
    }
}
