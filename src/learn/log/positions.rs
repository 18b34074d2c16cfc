//! Positions between those that were recorded. In: a position for each reading, NaN where the cell is empty, and the times. Out: a position
//! for each reading, and in words what was wrong.
//!
//! A control that is asked less often than the meter gives the same position for several readings. Taken as they stand, such positions are
//! a tool that stands and leaps. So of equal positions that are followed by another only the first is kept, unless they last longer than most
//! do (then the tool stands), and what lies between two is taken as evenly moved through.

use crate::learn::regress::statistics::median;

/// Longest series of equal positions over the median one in which the tool still moves. Judgement.
const STANDS: f64 = 2.0;

/// The positions of every reading, and what was wrong with them.
pub fn of_every_reading(mut axes: [Vec<f64>; 3], time_s: &[f64]) -> ([Vec<f64>; 3], Vec<String>) {
    let mut said = Vec::new();
    let count = |axes: &[Vec<f64>; 3]| (0..time_s.len()).filter(|i| axes.iter().any(|a| !a[*i].is_finite())).count();
    let empty = count(&axes);
    if empty > 0 {
        said.push(format!(
            "{empty} of {} positions are empty: the tool is taken to move evenly between the others",
            time_s.len()
        ));
    }
    axes = axes.map(|axis| between(axis, time_s));
    let series = series(&axes);
    let lengths: Vec<f64> = series.iter().map(|series| series.len() as f64).collect();
    let usual = if lengths.is_empty() { 1.0 } else { median(&lengths) };
    if usual >= 2.0 {
        for repeated in &series {
            let long = repeated.len() as f64 > STANDS * usual;
            let kept = if long { repeated.len() - usual as usize } else { 0 };
            let first = repeated.start + 1 + kept.min(repeated.len() - 1);
            for axis in &mut axes {
                axis[first..repeated.end].fill(f64::NAN);
            }
        }
        axes = axes.map(|axis| between(axis, time_s));
        said.push(format!(
            "positions stay the same for {usual:.0} readings at a time: the tool is taken to move evenly between them"
        ));
    }
    (axes, said)
}

/// Series of equal positions, but the last one.
fn series(axes: &[Vec<f64>; 3]) -> Vec<std::ops::Range<usize>> {
    let count = axes[0].len();
    let begins: Vec<usize> = (0..count).filter(|&i| i == 0 || axes.iter().any(|axis| axis[i] != axis[i - 1])).collect();
    begins.windows(2).map(|pair| pair[0]..pair[1]).collect()
}

/// Values in place of the missing ones: linear between the known, at the ends the nearest.
fn between(mut values: Vec<f64>, time_s: &[f64]) -> Vec<f64> {
    let known: Vec<usize> = (0..values.len()).filter(|i| values[*i].is_finite()).collect();
    let (Some(first), Some(last)) = (known.first().copied(), known.last().copied()) else { return values };
    let [begin, end] = [first, last].map(|i| values[i]);
    values[..first].fill(begin);
    values[last..].fill(end);
    for pair in known.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        for i in from + 1..to {
            let share = (time_s[i] - time_s[from]) / (time_s[to] - time_s[from]).max(1e-12);
            values[i] = values[from] + share * (values[to] - values[from]);
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tool that moves for 6 s at 10 mm/s, stands for 4 s, and moves on, read 10 times a second.
    fn moves() -> (Vec<f64>, Vec<f64>) {
        let time_s: Vec<f64> = (0..160).map(|k| 0.1 * f64::from(k)).collect();
        let x = time_s.iter().map(|t| if *t < 6.0 { 10.0 * t } else { 60.0 + 10.0 * (t - 10.0).max(0.0) }).collect();
        (x, time_s)
    }

    fn read(x: Vec<f64>, time_s: &[f64]) -> (Vec<f64>, Vec<String>) {
        let zeros = vec![0.0; x.len()];
        let ([x, ..], said) = of_every_reading([x, zeros.clone(), zeros], time_s);
        (x, said)
    }

    #[test]
    fn positions_of_every_reading_stay_as_they_are() {
        let (x, time_s) = moves();
        assert_eq!(read(x.clone(), &time_s), (x, Vec::new()));
    }

    #[test]
    fn empty_positions_lie_between_the_others() {
        let (x, time_s) = moves();
        let holed = x.iter().enumerate().map(|(k, x)| if k % 7 == 3 { f64::NAN } else { *x }).collect();
        let (found, said) = read(holed, &time_s);
        assert!(found.iter().zip(&x).all(|(a, b)| (a - b).abs() < 0.51), "{found:?}");
        assert!(said[0].starts_with("23 of 160 positions are empty"), "{said:?}");
    }

    #[test]
    fn positions_that_are_asked_for_less_often_move_evenly_and_a_tool_that_stands_stands() {
        let (x, time_s) = moves();
        let stale = (0..x.len()).map(|k| x[k - k % 5]).collect();
        let (found, said) = read(stale, &time_s);
        let off = |k: &usize| (found[*k] - x[*k]).abs();
        assert!((0..155).filter(|k| !(55..65).contains(k)).all(|k| off(&k) < 1e-9), "{found:?}");
        assert!((60..95).all(|k| found[k] == 60.0) && (60..105).all(|k| off(&k) < 5.1));
        assert!(said[0].starts_with("positions stay the same for 5 readings"), "{said:?}");
    }
}
