//! The clock of a log. In: the time of each row. Out: the rows in order of rising time, with their times from the first one.
//!
//! A few rows may be out of order; a clock that begins again at times it has shown before begins a new record, which goes on after the one
//! before; rows that share a time (whole seconds) are spread evenly to the next one. All of it is said.

use super::error::DataError;
use crate::learn::regress::statistics::median;

/// Fewest rows with a time.
const FEWEST: usize = 20;
/// Steps by which a clock falls back that begins again. Judgement: rows in the wrong order are nearer.
const FALLS: f64 = 5.0;
/// Rows after that by which it is seen whether these times were recorded before.
const AFTER: usize = 3;

/// Rows in order of rising time, and their times, s.
pub fn ordered(time: &[f64], warnings: &mut Vec<String>) -> Result<(Vec<usize>, Vec<f64>), DataError> {
    let mut rows: Vec<usize> = (0..time.len()).filter(|i| time[*i].is_finite()).collect();
    let missing = time.len() - rows.len();
    if missing > 0 && rows.len() >= FEWEST {
        warnings.push(format!("{missing} of {} rows have no time and are left out", time.len()));
    }
    if rows.len() < FEWEST {
        return Err(DataError::Unfit(format!(
            "the log has only {} samples with a time; {FEWEST} are the least",
            rows.len()
        )));
    }
    let mut times: Vec<f64> = rows.iter().map(|i| time[*i]).collect();
    let falls = times.windows(2).filter(|pair| pair[1] < pair[0]).count();
    if falls * 4 > rows.len() {
        return Err(DataError::Unfit(
            "the clock of the log runs backwards: its times fall from row to row (is it the right column? if so, sort the rows by it)"
                .into(),
        ));
    }
    if falls > 0 {
        let records = one_after_the_other(&mut times);
        warnings.extend((!records.is_empty()).then(|| {
            let at: Vec<String> = records.iter().map(|row| (rows[*row] + 1).to_string()).collect();
            format!("the clock begins again at row {}: what follows is taken for a later record", at.join(", "))
        }));
        let left = times.windows(2).filter(|pair| pair[1] < pair[0]).count();
        if left > 0 {
            warnings.push(format!("the clock steps backwards {left} times; the rows were sorted by time"));
        }
        let mut order: Vec<usize> = (0..rows.len()).collect();
        order.sort_by(|a, b| times[*a].total_cmp(&times[*b]));
        (rows, times) = (order.iter().map(|k| rows[*k]).collect(), order.iter().map(|k| times[*k]).collect());
    }
    let stands = || DataError::Unfit("the clock of the log stands still".into());
    if times.chunk_by(|a, b| a == b).count() < FEWEST {
        return Err(stands());
    }
    apart(&mut rows, &mut times, warnings);
    let start = times[0];
    Ok((rows, times.into_iter().map(|time| time - start).collect()))
}

/// Puts records one after the other where the clock begins again at times that it has shown before; where they begin.
fn one_after_the_other(times: &mut [f64]) -> Vec<usize> {
    let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    let step = median(&steps);
    let mut begins = Vec::new();
    for row in 1..times.len() {
        let Some(after) = times.get(row + AFTER).copied() else { break };
        let was_shown = || times[..row].iter().any(|before| (before - after).abs() < 0.75 * step);
        if times[row] < times[row - 1] - FALLS * step && was_shown() {
            let by = times[row - 1] - times[row] + step;
            times[row..].iter_mut().for_each(|time| *time += by);
            begins.push(row);
        }
    }
    begins
}

/// Spreads rows that share a time to the next one if most do; otherwise the first of them is kept.
fn apart(rows: &mut Vec<usize>, times: &mut Vec<f64>, warnings: &mut Vec<String>) {
    let shared: Vec<usize> = times.chunk_by(|a, b| a == b).map(<[f64]>::len).collect();
    let more = times.len() - shared.len();
    let usual = median(&shared.iter().map(|count| *count as f64).collect::<Vec<f64>>());
    if more == 0 {
        return;
    }
    if usual < 2.0 {
        let kept: Vec<usize> = (0..times.len()).filter(|k| *k == 0 || times[*k] != times[k - 1]).collect();
        (*rows, *times) = (kept.iter().map(|k| rows[*k]).collect(), kept.iter().map(|k| times[*k]).collect());
        warnings.push(format!("{more} rows repeat the time of the row before and are left out"));
        return;
    }
    let distinct: Vec<f64> = times.chunk_by(|a, b| a == b).map(|same| same[0]).collect();
    let tick = median(&distinct.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<f64>>());
    let step = tick / usual;
    let mut at = 0;
    for count in shared {
        // The first ones are the end of their tick, the last ones the beginning of theirs.
        let spread = if count as f64 > usual { tick / count as f64 } else { step };
        let late = if at == 0 { (tick - spread * count as f64).max(0.0) } else { 0.0 };
        (0..count).for_each(|k| times[at + k] += late + spread * k as f64);
        at += count;
    }
    warnings.push(format!(
        "{usual:.0} rows share each time of the clock, which counts by {tick} s: they are spread evenly to the next one"
    ));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(times: &[f64]) -> (Vec<usize>, Vec<f64>, Vec<String>) {
        let mut said = Vec::new();
        let (rows, times) = ordered(times, &mut said).unwrap();
        (rows, times, said)
    }

    #[test]
    fn a_clock_that_begins_again_begins_a_later_record() {
        let tenths = |from: u32| (from..from + 60).map(|k| 0.1 * f64::from(k));
        let (rows, times, said) = read(&tenths(0).chain(tenths(0).map(|t| t + 0.03)).collect::<Vec<f64>>());
        assert_eq!(rows, (0..120).collect::<Vec<usize>>());
        assert!(times.windows(2).all(|pair| (pair[1] - pair[0] - 0.1).abs() < 1e-9), "{times:?}");
        assert!(said.len() == 1 && said[0].contains("begins again at row 61"), "{said:?}");
        // A stretch that comes later in the file is no record of its own.
        let (_, times, said) = read(&tenths(0).chain(tenths(120)).chain(tenths(60)).collect::<Vec<f64>>());
        assert!(times.windows(2).all(|pair| (pair[1] - pair[0] - 0.1).abs() < 1e-9), "{times:?}");
        assert!(said[0].contains("were sorted by time"), "{said:?}");
    }

    #[test]
    fn rows_within_a_second_are_spread_over_it() {
        let whole: Vec<f64> = (7..300).map(|k| f64::from(k / 10)).collect();
        let (rows, times, said) = read(&whole);
        assert_eq!(rows.len(), 293);
        assert!(times.iter().enumerate().all(|(k, t)| (t - 0.1 * k as f64).abs() < 1e-9), "{times:?}");
        assert!(said[0].contains("10 rows share each time of the clock, which counts by 1 s"), "{said:?}");
    }
}
