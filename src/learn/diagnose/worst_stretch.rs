//! Where a residual that persists is largest. In: samples in order, their residuals and predictions. Out: the stretch of time in which
//! the mean of the residual stands out most, and by how much the load is above or below the prediction there.
//!
//! Of all windows of w, 2w, 4w … samples, w the number over which the residual persists, and then with its ends moved one after
//! the other, the one with the largest
//!
//! ```text
//! z² = (Σ r √g)² / n
//! ```
//!
//! over its n samples with the residual r about its mean and the weight g: the scan statistic of a change of the mean.

use crate::learn::dataset::samples::Data;

/// A stretch of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// When it begins and ends, s.
    pub between_s: [f64; 2],
    /// First and last line of the program there, where they are known.
    pub lines: Option<[u32; 2]>,
    /// Sum of the readings over that of the predictions there, less 1.
    pub above: f64,
}

/// The stretch; `None` without samples, or where the time is not known. `shortest`: least number of samples.
pub fn worst_stretch(data: &Data, residual: &[f64], predicted: &[f64], shortest: usize) -> Option<Stretch> {
    let used: Vec<usize> = data.used().filter(|i| data.state[*i].time_s.is_finite()).collect();
    let weight: f64 = used.iter().map(|i| data.weight[*i]).sum();
    let mean = used.iter().map(|i| data.weight[*i] * residual[*i]).sum::<f64>() / weight;
    let mut sums = vec![0.0];
    for i in &used {
        sums.push(sums[sums.len() - 1] + data.weight[*i].sqrt() * (residual[*i] - mean));
    }
    let width = shortest.max(1);
    let windows =
        std::iter::successors(Some(width), |width| Some(2 * width)).take_while(|width| 2 * width <= used.len());
    let windows = windows.flat_map(|width| (0..=used.len() - width).map(move |from| [from, from + width]));
    let stands_out = |[from, to]: &[usize; 2]| (sums[*to] - sums[*from]).powi(2) / (to - from) as f64;
    let most = |a: &[usize; 2], b: &[usize; 2]| stands_out(a).total_cmp(&stands_out(b));
    let [from, _] = windows.max_by(most)?;
    let [from, to] = (from + width..=used.len()).map(|to| [from, to]).max_by(most)?;
    let [from, to] = (0..=to - width).map(|from| [from, to]).max_by(most).unwrap_or([from, to]);
    let there = &used[from..to];
    let sum = |of: &[f64]| there.iter().map(|i| of[*i]).sum::<f64>();
    let ends = [from, to - 1].map(|k| used[k]);
    let lines = Some(ends).filter(|_| !data.line.is_empty()).map(|ends| ends.map(|i| data.line[i]));
    Some(Stretch { between_s: ends.map(|i| data.state[i].time_s), lines, above: sum(residual) / sum(predicted) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::learn::diagnose::made_data::made;

    /// 12 % more from 300 s to 359 s, in noise of 3 %: found within a few seconds and half a percent.
    #[test]
    fn a_stretch_with_more_load_is_found() {
        let mut data = made(
            |i| if (300..360).contains(&i) { 0.12 } else { 0.0 },
            3.0,
            |i| State { time_s: i as f64, ..State::default() },
        );
        data.line = (0..data.len()).map(|i| i as u32 / 10).collect();
        let predicted = data.columns[0].clone();
        let residual: Vec<f64> = data.reading.iter().zip(&predicted).map(|(reading, p)| reading - p).collect();
        let found = worst_stretch(&data, &residual, &predicted, 10).unwrap();
        assert!((found.between_s[0] - 300.0).abs() < 5.0 && (found.between_s[1] - 359.0).abs() < 5.0, "{found:?}");
        assert!((found.above - 0.12).abs() < 0.005, "{found:?}");
        let [first, last] = found.lines.unwrap();
        assert!((29..=30).contains(&first) && (35..=36).contains(&last), "{found:?}");
        assert_eq!(worst_stretch(&data, &residual, &predicted, data.len()), None);
    }
}
