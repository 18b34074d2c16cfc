//! Spindle speed over the programmed one. In: a log placed in its program. Out: the stretches at another speed, in words.

use crate::learn::align::Aligned;
use crate::learn::log::Log;
use crate::learn::program::timeline::{Activity, Spot, Timeline};
use crate::learn::regress::statistics::median;

/// Least deviation of the speed, and shortest stretch of feed moves, that are reported: spindles keep their speed within 1 %. Judgement.
const OFF: f64 = 0.03;
const LISTED_S: f64 = 4.0;

/// Where the spindle ran at another speed than programmed, in words.
pub fn other_speeds(log: &Log, aligned: &Aligned, timeline: &Timeline) -> Vec<String> {
    let Some(rps) = &log.rps else { return Vec::new() };
    let spot = |i: usize| timeline.at(aligned.program_s[i]).map(|k| &timeline.spots[k]);
    let feeds = |spot: &&Spot| spot.activity == Activity::Feed && spot.rps > 0.0;
    let in_feed: Vec<(usize, &Spot, f64)> = (0..rps.len())
        .filter_map(|i| spot(i).filter(feeds).map(|spot| (i, spot, rps[i] / spot.rps)))
        .filter(|(_, _, ratio)| ratio.is_finite())
        .collect();
    let side = |ratio: f64| [ratio < 1.0 - OFF, ratio > 1.0 + OFF];
    let stretches = in_feed.chunk_by(|a, b| side(a.2) == side(b.2)).filter(|stretch| side(stretch[0].2) != [false; 2]);
    let said = |stretch: &[(usize, &Spot, f64)]| {
        let [first, last] = [stretch[0], stretch[stretch.len() - 1]];
        let [from_s, to_s] = [first, last].map(|(i, ..)| log.time_s[i]);
        let ratio = median(&stretch.iter().map(|(_, _, ratio)| *ratio).collect::<Vec<f64>>());
        (to_s - from_s >= LISTED_S).then(|| {
            format!(
                "from {from_s:.1} s to {to_s:.1} s (lines {} to {}) the spindle ran at {:.0} % of the programmed speed: the loads are compared \
                 at the speed that was measured",
                first.1.line,
                last.1.line,
                100.0 * ratio
            )
        })
    };
    stretches.filter_map(said).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::contact::Engaged;
    use crate::path::Vec3;

    #[test]
    fn a_spindle_that_is_turned_down_is_said_and_one_that_keeps_its_speed_is_not() {
        let spot = Spot {
            start_s: 0.0,
            end_s: 20.0,
            activity: Activity::Feed,
            move_id: None,
            middle_mm: 0.0,
            line: 7,
            block: 6,
            tool: 1,
            coolant: false,
            rps: 100.0,
            from: Vec3::zeros(),
            to: Vec3::new(200.0, 0.0, 0.0),
            direction: Vec3::x(),
            length_mm: 200.0,
            curvature_per_mm: 0.0,
            engaged: Engaged::default(),
        };
        let timeline = Timeline { spots: vec![spot], ..Timeline::default() };
        let time_s: Vec<f64> = (0..200).map(|k| 0.1 * f64::from(k)).collect();
        let aligned = Aligned { program_s: time_s.clone(), ..Aligned::default() };
        let said = |speed: &dyn Fn(f64) -> f64| {
            let rps = Some(time_s.iter().map(|t| 100.0 * speed(*t)).collect());
            other_speeds(&Log { time_s: time_s.clone(), rps, ..Log::default() }, &aligned, &timeline)
        };
        let down = said(&|t| if t < 10.0 { 0.9 } else { 1.0 });
        assert!(down.len() == 1 && down[0].contains("from 0.0 s to 9.9 s") && down[0].contains("90 %"), "{down:?}");
        assert_eq!(said(&|t| if (5.0..7.0).contains(&t) { 0.5 } else { 0.99 }), Vec::<String>::new());
    }
}
