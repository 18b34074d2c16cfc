//! Rate of change of force in the written file. In: force and commanded feed at every station of its path, in order. Out: the largest ratio of
//! the rate to its limit, and the stations that exceed it.
//!
//! Between two stations whose middles lie a span apart, the force changes by |F₂ − F₁| in the time that the commanded feeds take from one middle
//! to the other. The span is the spacing for which the caps were made. A finer one would not distinguish a step of the engagement from a ramp
//! better, it would only make the step steeper.

/// A station of the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Peak force in the plane, N.
    pub force_n: f64,
    /// Length, mm.
    pub length_mm: f64,
    /// Commanded feed, mm/s.
    pub feed_mm_s: f64,
    /// Highest rate allowed, N/s.
    pub limit_n_s: Option<f64>,
    /// Does the path go on here from the station before, in feed?
    pub joined: bool,
}

/// Largest rate over its limit; `None` where none is limited. `broken` hears both ends of every span whose ratio is above `met`,
/// and the ratio.
pub fn worst(steps: &[Step], span_mm: f64, met: f64, broken: &mut dyn FnMut(usize, usize, f64)) -> Option<f64> {
    let mut worst: Option<f64> = None;
    for (i, from) in steps.iter().enumerate() {
        let (mut way_mm, mut time_s) = (0.0, 0.0);
        for j in i + 1..steps.len() {
            let to = &steps[j];
            if !to.joined || to.feed_mm_s <= 0.0 || from.feed_mm_s <= 0.0 {
                break;
            }
            let before = &steps[j - 1];
            way_mm += 0.5 * (before.length_mm + to.length_mm);
            time_s += 0.5 * (before.length_mm / before.feed_mm_s + to.length_mm / to.feed_mm_s);
            if way_mm < span_mm {
                continue;
            }
            if let Some(limit_n_s) = to.limit_n_s {
                let ratio = (to.force_n - from.force_n).abs() / time_s / limit_n_s;
                worst = Some(worst.map_or(ratio, |worst| worst.max(ratio)));
                if ratio > met {
                    broken(i, j, ratio);
                }
            }
            break;
        }
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(force_n: f64, feed_mm_s: f64) -> Step {
        Step { force_n, length_mm: 0.5, feed_mm_s, limit_n_s: Some(1000.0), joined: true }
    }

    #[test]
    fn a_step_of_force_over_one_millimetre() {
        // 0 → 80 N over 1 mm at 10 mm/s: 800 N/s; where the feed halves inside, 80 N in 0.125 s.
        let mut found = Vec::new();
        let level = [step(0.0, 10.0), step(0.0, 10.0), step(80.0, 10.0), step(80.0, 10.0)];
        let ratio = worst(&level, 1.0, 0.7, &mut |i, j, ratio| found.push((i, j, ratio))).unwrap();
        assert!((ratio - 0.8).abs() < 1e-12 && found.len() == 2 && found[0].0 == 0 && found[0].1 == 2, "{found:?}");
        let slower = [step(0.0, 10.0), step(0.0, 10.0), step(80.0, 5.0)];
        assert!((worst(&slower, 1.0, 1.0, &mut |_, _, _| ()).unwrap() - 0.64).abs() < 1e-12);
        let apart = [step(0.0, 10.0), Step { joined: false, ..step(0.0, 10.0) }, step(80.0, 10.0)];
        assert_eq!(worst(&apart, 1.0, 1.0, &mut |_, _, _| ()), None);
    }
}
