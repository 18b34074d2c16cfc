//! When a load was read, in a log by position. In: the alignment of the positions, the data that it gives. Out: the alignment at the times at
//! which the loads were read.
//!
//! A meter gives the mean of its last interval, a control the position at the end of it or at the beginning of the next: readings and
//! positions of one row then belong to times that differ by up to one interval Δ. Where loads change within Δ, at every entry, the residual
//! of that looks like an effect of the process. The time is taken at which the plain model fits best: a parabola through the residuals at −Δ/2, 0
//! and Δ/2, once where the load rises and once where it falls. A skew moves both alike; what is higher after an entry, or held back at a
//! corner, does not. Beyond Δ it is no skew but a lag, which has an effect of its own.

use crate::learn::align::{Aligned, Method};
use crate::learn::dataset::samples::Data;
use crate::learn::log::Log;
use crate::learn::log::gaps::{longest_step, median_step};
use crate::learn::model::fit::fit;

/// Least gain in log-likelihood of another time, nats. Judgement, as for a slower machine.
const GAIN_NATS: f64 = 10.0;
/// Largest skew, in intervals.
const MOST: f64 = 0.9;
/// Least ratio of the skews where the load rises and where it falls. Judgement.
const ALIKE: f64 = 0.2;
/// Less than this share of an interval is no skew, but what interpolation leaves.
const LEAST: f64 = 0.05;

/// The alignment at the times of the readings, with its data; `bin` makes the data of an alignment.
pub fn at_readings(log: &Log, aligned: Aligned, bin: &impl Fn(&Aligned) -> (Data, usize)) -> (Aligned, (Data, usize)) {
    let own = bin(&aligned);
    if aligned.method != Method::Position {
        return (aligned, own);
    }
    let interval_s = median_step(&log.time_s);
    let tried = |by_s: f64| {
        let moved = moved(log, &aligned, by_s);
        let data = bin(&moved);
        (moved, data)
    };
    let half_s = 0.5 * interval_s;
    let Some(found_s) = [-half_s, 0.0, half_s]
        .map(|by_s| if by_s == 0.0 { misfit(&own.0) } else { misfit(&tried(by_s).1.0) })
        .into_iter()
        .collect::<Option<Vec<Misfit>>>()
        .and_then(|misfits| agreed(&misfits))
        .map(|place| place * half_s)
        .filter(|by_s| (LEAST * interval_s..=MOST * interval_s).contains(&by_s.abs()))
    else {
        return (aligned, own);
    };
    let (moved, data) = tried(found_s);
    let cells = own.0.used().count() as f64;
    let gain = misfit(&own.0).zip(misfit(&data.0)).map(|(before, after)| 0.5 * cells * (before.all / after.all).ln());
    if gain.is_some_and(|nats| nats > GAIN_NATS) { (moved, data) } else { (aligned, own) }
}

/// Weighted squares of the residual of the plain model.
struct Misfit {
    /// Mean over all cells.
    all: f64,
    /// Sums over the cells in which the predicted load rises, and in which it falls.
    changing: [f64; 2],
}

fn misfit(data: &Data) -> Option<Misfit> {
    let fitted = fit(data, &[], 0)?;
    let residual = fitted.residuals(data);
    let (mut squares, mut weights, mut changing) = (0.0, 0.0, [0.0; 2]);
    for i in data.used() {
        let square = data.weight[i] * residual[i].powi(2);
        squares += square;
        weights += data.weight[i];
        let beside = [i.checked_sub(1), Some(i + 1)].map(|k| k.and_then(|k| fitted.predicted.get(k)));
        if let [Some(before), Some(after)] = beside {
            changing[usize::from(after < before)] += square;
        }
    }
    (weights > 0.0 && squares > 0.0).then(|| Misfit { all: squares / weights, changing })
}

/// Where the misfit is lowest, in the unit of the places −1, 0 and 1 it is given at, if rising and falling loads agree.
fn agreed(misfits: &[Misfit]) -> Option<f64> {
    let place = |side: usize| lowest(&misfits.iter().map(|misfit| misfit.changing[side]).collect::<Vec<f64>>());
    let [rising, falling] = [place(0)?, place(1)?];
    let (less, more) = (rising.abs().min(falling.abs()), rising.abs().max(falling.abs()));
    (rising * falling > 0.0 && less >= ALIKE * more).then_some(0.5 * (rising + falling))
}

/// Where a parabola through values at −1, 0 and 1 is lowest; `None` where it has no minimum.
fn lowest(values: &[f64]) -> Option<f64> {
    let [before, at, after] = values else { return None };
    let bend = before - 2.0 * at + after;
    (bend > 0.0).then(|| 0.5 * (before - after) / bend)
}

/// The readings as if each belonged to a time later by so much; across a gap they stay where they are.
fn moved(log: &Log, aligned: &Aligned, by_s: f64) -> Aligned {
    let longest_s = longest_step(&log.time_s);
    let placed = |i: usize| {
        let own = aligned.program_s[i];
        let other = if by_s > 0.0 { Some(i + 1).filter(|k| *k < log.time_s.len()) } else { i.checked_sub(1) };
        let Some(k) = other else { return own };
        let (step_s, along_s) = (log.time_s[k] - log.time_s[i], aligned.program_s[k] - own);
        let usual = step_s.abs() > 0.0 && step_s.abs() <= longest_s && along_s.is_finite();
        if usual { own + along_s * (by_s / step_s).clamp(0.0, 1.0) } else { own }
    };
    let program_s = (0..aligned.program_s.len()).map(placed).collect();
    Aligned { program_s, read_later_s: by_s, ..aligned.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_move_between_their_neighbours() {
        let log = Log { time_s: vec![0.0, 0.1, 0.2, 0.3], ..Log::default() };
        let aligned = Aligned { program_s: vec![5.0, 5.1, 5.3, f64::NAN], ..Aligned::default() };
        let earlier = moved(&log, &aligned, -0.05).program_s;
        assert!((earlier[0] - 5.0).abs() < 1e-9 && (earlier[1] - 5.05).abs() < 1e-9 && (earlier[2] - 5.2).abs() < 1e-9);
        let later = moved(&log, &aligned, 0.05).program_s;
        assert!((later[0] - 5.05).abs() < 1e-9 && (later[2] - 5.3).abs() < 1e-9 && later[3].is_nan());
    }

    #[test]
    fn a_skew_moves_rising_and_falling_loads_alike() {
        let at = |rising: f64, falling: f64| {
            let square = |x: f64, at: f64| 2.0 + (x - at).powi(2);
            let misfit = |x: f64| Misfit { all: 1.0, changing: [square(x, rising), square(x, falling)] };
            agreed(&[-1.0, 0.0, 1.0].map(misfit))
        };
        assert!((at(-0.6, -0.4).unwrap() + 0.5).abs() < 1e-12);
        // A load that is higher after an entry.
        assert_eq!([at(-0.6, 0.0), at(-0.6, 0.6), at(-0.6, -0.1)], [None; 3]);
    }

    #[test]
    fn the_lowest_place_of_a_parabola_is_found_and_a_hill_has_none() {
        let square = |x: f64| 2.0 + (x - 0.3).powi(2);
        let found = lowest(&[square(-1.0), square(0.0), square(1.0)]).unwrap();
        assert!((found - 0.3).abs() < 1e-12);
        assert_eq!(lowest(&[1.0, 2.0, 1.0]), None);
    }
}
