//! Gaps of a log. In: rising times, s. Out: their median step, and the stretches without readings.

use crate::learn::regress::statistics::median;

/// Time step, in median steps, beyond which readings are missing. Judgement.
const GAP_STEPS: f64 = 5.0;

/// Median time from sample to sample, s.
pub fn median_step(time: &[f64]) -> f64 {
    let steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    median(&steps)
}

/// Longest time step that is no gap, s.
pub fn longest_step(time_s: &[f64]) -> f64 {
    GAP_STEPS * median_step(time_s)
}

/// Gaps: from, to, s.
pub fn gaps(time_s: &[f64]) -> Vec<[f64; 2]> {
    let most = longest_step(time_s);
    time_s.windows(2).filter(|pair| pair[1] - pair[0] > most).map(|pair| [pair[0], pair[1]]).collect()
}

/// The gaps in words.
pub(in crate::learn) fn in_words(gaps: &[[f64; 2]]) -> Option<String> {
    let length = |gap: &[f64; 2]| gap[1] - gap[0];
    let longest = gaps.iter().max_by(|a, b| length(a).total_cmp(&length(b)))?;
    Some(format!(
        "gaps in the time stamps: {}, together {:.1} s, the longest {:.1} s from {:.1} s on; no values are assumed \
         there",
        gaps.len(),
        gaps.iter().map(length).sum::<f64>(),
        length(longest),
        longest[0]
    ))
}
