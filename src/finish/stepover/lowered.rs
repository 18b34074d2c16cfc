//! Where the scallop limit of a plan is lower. In: places where an earlier plan, as it was written, left more than the limit, and how much. Out:
//! the share of the limit at any place.
//!
//! Between the places of a plan, and where passes end askew to a rim, more may be left than at the places. There, and within one to two
//! radii of the tool of it, the next plan has a lower limit; elsewhere passes stay as far apart as the limit allows.

use std::collections::BTreeMap;

/// Least share of the limit. What is left between passes grows with the square of their distance: these are half as far apart, and what stays
/// there then, as at the foot of a wall, is not due to it.
const LEAST: f64 = 0.25;

/// Shares of the scallop limit, in square cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Lowered {
    cell_mm: f64,
    shares: BTreeMap<[i64; 2], f64>,
}

impl Lowered {
    /// The whole limit everywhere; `radius_mm`: of the tool.
    pub fn nowhere(radius_mm: f64) -> Self {
        Self { cell_mm: radius_mm, shares: BTreeMap::new() }
    }

    fn cell(&self, at: [f64; 2]) -> [i64; 2] {
        at.map(|mm| (mm / self.cell_mm).floor() as i64)
    }

    /// Share of the limit at a place in the plane: the least of its cell and the eight around it.
    pub fn share(&self, at: [f64; 2]) -> f64 {
        let [i, j] = self.cell(at);
        let around = (i - 1..=i + 1).flat_map(|i| (j - 1..=j + 1).map(move |j| [i, j]));
        around.filter_map(|cell| self.shares.get(&cell)).copied().fold(1.0, f64::min)
    }

    /// Lower at each of the places, by as much as is left there above the limit, mm. Is it lower anywhere now?
    pub fn lower(&mut self, places: &[([f64; 2], f64)], limit_mm: f64) -> bool {
        let before = self.clone();
        for (at, left_mm) in places {
            let share = (before.share(*at) * limit_mm / left_mm).max(LEAST);
            let cell = self.cell(*at);
            let lowest = self.shares.entry(cell).or_insert(1.0);
            *lowest = lowest.min(share);
        }
        *self != before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_is_lower_about_the_places_alone_and_never_below_a_quarter() {
        let mut lowered = Lowered::nowhere(3.0);
        assert!(lowered.lower(&[([10.0, -1.0], 0.0125)], 0.01));
        let shares = [[10.0, -1.0], [13.0, -4.0], [16.1, -1.0], [10.0, 3.1]].map(|at| lowered.share(at));
        assert!(
            shares.iter().zip([0.8, 0.8, 1.0, 1.0]).all(|(found, share)| (found - share).abs() < 1e-12),
            "{shares:?}"
        );
        assert!(lowered.lower(&[([10.0, -1.0], 0.0125)], 0.01));
        assert!((lowered.share([10.0, -1.0]) - 0.64).abs() < 1e-12);
        assert!(lowered.lower(&[([10.0, -1.0], 1.0)], 0.01) && lowered.share([10.0, -1.0]) == LEAST);
        assert!(!lowered.lower(&[([10.0, -1.0], 1.0)], 0.01), "no plan more is of use");
    }
}
