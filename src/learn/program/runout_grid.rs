//! Grid of runouts at which changes of the loads are computed, with interpolation between them.
//!
//! In: offset of the axis and its direction (phase). Out: interpolation weight of each runout of the grid. A wide grid
//! has all directions, with offsets from 0 on or about an offset found; a narrow one surrounds a known runout closely,
//! so that it does not interpolate across a runout at which a tooth begins to miss the cut.

/// Number of offsets of the axis, and of directions for each.
pub const RUNOUT_GRID: [usize; 2] = [2, 8];

/// For each runout of the grid: changes of the derivatives of the peak force by k_tc, k_rc, k_te, k_re, and relative
/// change of the edge term of the power.
pub type Runouts = [[[f64; 5]; RUNOUT_GRID[1]]; RUNOUT_GRID[0]];

/// A grid of runouts; see the head of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunoutGrid {
    /// Offsets of the axis, mm, rising.
    pub offsets_mm: [f64; RUNOUT_GRID[0]],
    /// Directions, in pitches of the teeth, rising.
    phases: [f64; RUNOUT_GRID[1]],
    /// Number of directions in use.
    pub ways: usize,
    /// Is it interpolated from no runout to the first offset?
    from_none: bool,
    /// Is it the grid about the runout that was found, and no step on the way there?
    is_of_found: bool,
}

/// All directions, pitches.
const ROUND: [f64; RUNOUT_GRID[1]] = [0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875];
/// Offsets about a known one, as factors on it, and directions about a known one, pitches.
const NEAR: [f64; RUNOUT_GRID[0]] = [0.9, 1.1];
const BESIDE: [f64; 2] = [-0.04, 0.04];

impl Default for RunoutGrid {
    fn default() -> Self {
        Self { offsets_mm: [0.006, 0.018], phases: ROUND, ways: ROUND.len(), from_none: true, is_of_found: false }
    }
}

impl RunoutGrid {
    /// A wide grid about a known offset.
    pub fn about_offset(offset_mm: f64) -> Self {
        Self { offsets_mm: NEAR.map(|n| n * offset_mm), from_none: false, ..Self::default() }
    }

    /// A narrow grid about a known runout. `reach` 1: a tenth of the offset and [`BESIDE`] to either side.
    pub fn about([offset_mm, phase]: [f64; 2], reach: f64) -> Self {
        let [one, other] = BESIDE.map(|b| phase + reach * b);
        Self {
            offsets_mm: NEAR.map(|n| (1.0 + reach * (n - 1.0)) * offset_mm),
            phases: [one, other, other, other, other, other, other, other],
            ways: 2,
            from_none: false,
            is_of_found: false,
        }
    }

    /// The same as the grid about the runout that was found.
    pub fn of_found(self) -> Self {
        Self { is_of_found: true, ..self }
    }

    /// Directions, in pitches of the teeth, rising.
    pub fn phases(&self) -> &[f64] {
        &self.phases[..self.ways]
    }

    /// Is it a narrow grid?
    pub fn is_narrow(&self) -> bool {
        self.ways < RUNOUT_GRID[1]
    }

    /// The runout in the middle.
    pub fn middle(&self) -> [f64; 2] {
        let middle = |of: &[f64]| f64::midpoint(of[0], of[of.len() - 1]);
        [middle(&self.offsets_mm), middle(self.phases())]
    }

    /// Phases that the grid about the runout that was found tells, in the turn of this phase: from its middle as far as to the next direction
    /// of the wide grid; `None` for other grids. Where the runout acts most, the forces hardly change with the phase, and one extrapolated
    /// from there would drift to any other.
    pub fn phases_told(&self, phase: f64) -> Option<(f64, f64)> {
        let middle = self.middle()[1];
        let turn = middle + (phase - middle).round();
        let apart = 1.0 / RUNOUT_GRID[1] as f64;
        self.is_of_found.then_some((turn - apart, turn + apart))
    }

    /// Interpolation weight of one of its runouts for another runout.
    pub fn share(&self, offset_mm: f64, phase: f64, offset: usize, way: usize) -> f64 {
        let of_offset = share(offset_mm, &self.offsets_mm, offset, self.from_none);
        if self.is_narrow() {
            let near = phase - (phase - self.middle()[1]).round();
            return if way < self.ways { of_offset * share(near, self.phases(), way, false) } else { 0.0 };
        }
        let round: [f64; RUNOUT_GRID[1] + 1] = std::array::from_fn(|k| ROUND.get(k).copied().unwrap_or(1.0));
        let at = phase.rem_euclid(1.0);
        let again = if way == 0 { share(at, &round, round.len() - 1, false) } else { 0.0 };
        of_offset * (share(at, &round, way, false) + again)
    }
}

/// Interpolation weight of the `k`-th of rising nodes: linear between neighbours, extrapolated beyond the outer ones;
/// below the first from 0 at 0, if `from_zero`.
fn share(value: f64, places: &[f64], k: usize, from_zero: bool) -> f64 {
    if from_zero && value <= places[0] {
        return if k == 0 { value / places[0] } else { 0.0 };
    }
    let low = places.partition_point(|p| *p < value).clamp(1, places.len() - 1) - 1;
    let t = (value - places[low]) / (places[low + 1] - places[low]);
    if k == low {
        1.0 - t
    } else if k == low + 1 {
        t
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_linear_between_places_and_add_up() {
        let places = [1.0, 3.0];
        assert_eq!([0, 1].map(|k| share(0.5, &places, k, true)), [0.5, 0.0]);
        assert_eq!([0, 1].map(|k| share(2.0, &places, k, true)), [0.5, 0.5]);
        assert_eq!([0, 1].map(|k| share(4.0, &places, k, true)), [-0.5, 1.5]);
        let three = [0.0, 0.5, 1.0];
        assert_eq!([0, 1, 2].map(|k| share(0.75, &three, k, false)), [0.0, 0.5, 0.5]);
        assert_eq!([0, 1, 2].map(|k| share(0.0, &three, k, false)), [1.0, 0.0, 0.0]);
    }

    #[test]
    fn the_grid_of_a_runout_that_was_found_tells_the_phases_up_to_the_next_direction_of_the_wide_one() {
        let step = RunoutGrid::about([0.01, 0.5], 1.0);
        assert_eq!(step.phases_told(0.5), None);
        let grid = step.of_found();
        for (phase, middle) in [(0.5, 0.5), (0.6, 0.5), (1.45, 1.5), (-0.6, -0.5)] {
            let (low, high) = grid.phases_told(phase).unwrap();
            assert!((low - middle + 0.125).abs() < 1e-12 && (high - middle - 0.125).abs() < 1e-12, "{phase}");
        }
    }

    #[test]
    fn a_runout_of_a_grid_is_itself_and_ways_go_round() {
        for grid in [RunoutGrid::default(), RunoutGrid::about_offset(0.01), RunoutGrid::about([0.01, 0.97], 0.5)] {
            for (o, offset_mm) in grid.offsets_mm.into_iter().enumerate() {
                for (w, phase) in grid.phases().iter().copied().enumerate() {
                    for turns in [-1.0, 0.0, 1.0] {
                        let share = grid.share(offset_mm, phase + turns, o, w);
                        assert!((share - 1.0).abs() < 1e-9, "{grid:?} {o} {w} {turns}: {share}");
                    }
                }
            }
        }
    }
}
