//! Coefficients over time (after Xu, Jerard and Fussell 2007): in windows of the log, factors on the cutting and edge
//! terms of the base model, with standard errors. A slow rise of the edge factor indicates wear, a jump of the cutting
//! factor chipping.

use std::collections::BTreeMap;

use crate::effects;
use crate::learn::dataset::samples::{Class, Data};
use crate::learn::diagnose::criteria::{is_jump, is_rise};
use crate::learn::diagnose::which_curve::only_grows;
use crate::learn::model::fit::Fitted;
use crate::learn::regress::linear::least_squares;
use crate::learn::report::{LearnReport, Window};
use nalgebra::DMatrix;

/// Windows over the log.
const WINDOWS: usize = 8;

/// Factors in each window of the cuts of the tool that has most of them: from tool to tool they differ without any wear. Windows in which cutting
/// and edge terms cannot be separated are left out.
pub fn windows(data: &Data, base: &Fitted) -> Vec<Window> {
    let cuts = || data.used().filter(|i| part(data, base, *i, Class::Cutting) > 0.0);
    let tool = |i: usize| data.state[i].tool.to_bits();
    let mut counts: BTreeMap<u64, usize> = BTreeMap::new();
    cuts().for_each(|i| *counts.entry(tool(i)).or_default() += 1);
    let most = counts.into_iter().max_by_key(|(_, count)| *count).map(|(tool, _)| tool);
    let cutting: Vec<usize> = cuts().filter(|i| Some(tool(*i)) == most).collect();
    let size = cutting.len() / WINDOWS;
    if size < 20 {
        return Vec::new();
    }
    cutting.chunks(size).filter(|c| c.len() == size).filter_map(|members| window(data, base, members)).collect()
}

fn part(data: &Data, base: &Fitted, i: usize, class: Class) -> f64 {
    let of = |b: usize| if data.base[b].class == class { base.model.base[b] * data.columns[b][i] } else { 0.0 };
    (0..data.base.len()).map(of).sum()
}

fn window(data: &Data, base: &Fitted, members: &[usize]) -> Option<Window> {
    let x = DMatrix::from_fn(members.len(), 2, |k, j| part(data, base, members[k], [Class::Cutting, Class::Edge][j]));
    let y: Vec<f64> = members.iter().map(|&i| data.reading[i] - part(data, base, i, Class::Tare)).collect();
    let weights: Vec<f64> = members.iter().map(|&i| data.weight[i]).collect();
    let fit = least_squares(&x, &y, &weights)?;
    let time = |i: usize| data.state[i].time_s;
    fit.std_errors.iter().all(|e| e.is_finite()).then(|| Window {
        time_s: [time(members[0]), time(*members.last().unwrap_or(&0))],
        cutting: [fit.coefficients[0], fit.std_errors[0]],
        edge: [fit.coefficients[1], fit.std_errors[1]],
    })
}

/// One sentence on the edge, if the windows show a lasting jump of the cutting factor (chipping) or a slow rise of the
/// edge factor (wear, with the time until it has doubled) that exceeds their scatter.
pub fn in_words(windows: &[Window]) -> Option<String> {
    let (first, last) = (windows.first()?, windows.last()?);
    let length_s = last.time_s[1] - first.time_s[0];
    let jump = jump(windows).filter(|j| is_jump(j.by, j.error));
    let rise = rise(windows).filter(|r| is_rise(r.by * length_s, r.error * length_s));
    // The more significant one: wear also raises the cutting factor a little, and a chipped edge the edge factor.
    match (jump, rise) {
        (Some(j), Some(r)) if r.by / r.error > j.by / j.error => Some(worn(&r, length_s)),
        (Some(j), _) => Some(format!(
            "the cutting coefficients jump by {:.0} % at {:.0} s and stay: look for a chipped edge",
            100.0 * j.by,
            j.at
        )),
        (None, Some(r)) => Some(worn(&r, length_s)),
        (None, None) => None,
    }
}

/// May what the windows show be the edge? They hold the base model against stretches of time, in which anything else that was found shows
/// as well: so where nothing was, or something that grows as an edge wears. What stops at a ceiling is none of it.
pub fn may_be_the_edge(report: &LearnReport) -> bool {
    let grows =
        |name: &&str| effects::named(name).is_some_and(|effect| effect.covariates.iter().any(|of| only_grows(*of)));
    let nothing = report.names().is_empty() && report.unnamed.is_empty() && report.confounded.is_empty();
    report.ceilings.is_empty() && (nothing || report.names().iter().any(grows))
}

/// A change of a factor with its standard error.
struct Changed {
    /// Of a jump: its size. Of a rise: change per second.
    by: f64,
    error: f64,
    /// Of a jump: its time, s. Of a rise: the factor at the beginning.
    at: f64,
}

fn worn(rise: &Changed, length_s: f64) -> String {
    let end = rise.at + rise.by * length_s;
    let left_min = (2.0 * rise.at - end) / rise.by / 60.0;
    let twice = if left_min > 0.0 {
        format!("at this rate they are twice those of the sharp edge in {left_min:.1} min of this program")
    } else {
        "they are more than twice those of the sharp edge".to_owned()
    };
    format!(
        "the edge coefficients rise by {:.0} % over {:.1} min (wear); {twice}",
        100.0 * rise.by * length_s / rise.at,
        length_s / 60.0,
    )
}

/// The step of the cutting factor with the least scatter about the means before and after it.
fn jump(windows: &[Window]) -> Option<Changed> {
    let values: Vec<f64> = windows.iter().map(|w| w.cutting[0]).collect();
    let n = values.len();
    let split = |k: usize| {
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let (before, after) = (mean(&values[..k]), mean(&values[k..]));
        let scatter = |part: &[f64], mean: f64| part.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        let squares = scatter(&values[..k], before) + scatter(&values[k..], after);
        let own = windows.iter().map(|w| w.cutting[1].powi(2)).sum::<f64>() / n as f64;
        let variance = (squares / (n - 2) as f64).max(own);
        let error = (variance * (1.0 / k as f64 + 1.0 / (n - k) as f64)).sqrt();
        (squares, Changed { by: after - before, error, at: windows[k].time_s[0] })
    };
    let splits = if n < 5 { 0..0 } else { 2..n - 1 };
    splits.map(split).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, changed)| changed)
}

/// Straight line through the edge factors over time, weighted by their standard errors.
fn rise(windows: &[Window]) -> Option<Changed> {
    if windows.len() < 4 {
        return None;
    }
    let begin = windows[0].time_s[0];
    let middle = |w: &Window| f64::midpoint(w.time_s[0], w.time_s[1]) - begin;
    let x = DMatrix::from_fn(windows.len(), 2, |k, j| if j == 0 { 1.0 } else { middle(&windows[k]) });
    let y: Vec<f64> = windows.iter().map(|w| w.edge[0]).collect();
    let weights: Vec<f64> = windows.iter().map(|w| 1.0 / w.edge[1].powi(2).max(1e-12)).collect();
    let fit = least_squares(&x, &y, &weights)?;
    Some(Changed { by: fit.coefficients[1], error: fit.std_errors[1].max(1e-12), at: fit.coefficients[0].max(1e-3) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::report::{Added, Ceiling};

    fn windows(cutting: impl Fn(f64) -> f64, edge: impl Fn(f64) -> f64) -> Vec<Window> {
        let wobble = |k: usize| 0.01 * (((k * 37) % 11) as f64 / 5.0 - 1.0);
        (0..8)
            .map(|k| {
                let t = 60.0 * k as f64;
                Window {
                    time_s: [t, t + 60.0],
                    cutting: [cutting(t + 30.0) + wobble(k), 0.01],
                    edge: [edge(t + 30.0) + wobble(k + 3), 0.02],
                }
            })
            .collect()
    }

    #[test]
    fn a_slow_rise_is_wear_and_says_how_long_the_edge_lasts() {
        // Factor 1 + t/1000 s: it has doubled at 1000 s, that is 520 s after the end of the log.
        let said = in_words(&windows(|_| 1.0, |t| 1.0 + t / 1000.0)).unwrap();
        assert!(said.contains("wear"), "{said}");
        let minutes: f64 = said.split(" min of this").next().unwrap().rsplit(' ').next().unwrap().parse().unwrap();
        assert!((minutes - 520.0 / 60.0).abs() < 0.8, "{said}");
    }

    #[test]
    fn a_jump_that_stays_is_a_chipped_edge() {
        let said = in_words(&windows(|t| if t > 240.0 { 1.2 } else { 1.0 }, |_| 1.0)).unwrap();
        assert!(said.contains("chipped") && said.contains("20 % at 240 s"), "{said}");
    }

    #[test]
    fn what_the_windows_show_may_be_the_edge_where_nothing_else_was_found_or_wear() {
        let with = |name: &str| LearnReport {
            effects: vec![Added {
                name: name.to_owned(),
                parameters: Vec::new(),
                p_value: 0.0,
                test_rmse_before: 2.0,
                test_rmse_after: 1.0,
                evidence: String::new(),
            }],
            ..LearnReport::default()
        };
        assert!(may_be_the_edge(&LearnReport::default()));
        assert!(may_be_the_edge(&with("flank-wear")) && may_be_the_edge(&with("edge-chipping")));
        assert!(!may_be_the_edge(&with("up-down-asymmetry")) && !may_be_the_edge(&with("sensor-lag")));
        let ceiling = Ceiling { name: "spindle_power_w".to_owned(), reading: 700.0, samples: 9 };
        assert!(!may_be_the_edge(&LearnReport { ceilings: vec![ceiling], ..LearnReport::default() }));
    }

    #[test]
    fn scatter_and_a_single_window_that_is_off_say_nothing() {
        assert_eq!(in_words(&windows(|_| 1.0, |_| 1.0)), None);
        assert_eq!(in_words(&windows(|t| if (200.0..220.0).contains(&t) { 1.6 } else { 1.0 }, |_| 1.0)), None);
    }
}
