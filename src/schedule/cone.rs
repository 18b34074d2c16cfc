//! The interface to the cone solver clarabel, used nowhere else. In: sparse rows. Out: an answer that the solver calls solved, or `None`.
//!
//! min ½ xᵀP x + qᵀx subject to A x + s = b, s in a product of cones. Rows are collected by kind: equalities, inequalities
//! `row·x ≤ rhs` (an infinite right side leaves the row out, NaN refuses the whole problem), and second-order cones.
//! Callers bring their problem scaled to O(1); nothing is printed.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use nalgebra::{DMatrix, DVector};

/// A sparse row: (column, factor).
pub type Terms<'a> = &'a [(usize, f64)];

/// A problem being collected.
#[derive(Debug, Clone, Default)]
pub struct Program {
    columns: usize,
    cost: Vec<f64>,
    quadratic: Vec<f64>,
    equal: Rows,
    below: Rows,
    cones: Rows,
    cone_sizes: Vec<usize>,
    refused: bool,
}

#[derive(Debug, Clone, Default)]
struct Rows {
    row: Vec<usize>,
    column: Vec<usize>,
    value: Vec<f64>,
    rhs: Vec<f64>,
}

/// Accepted answer.
#[derive(Debug, Clone)]
pub struct Answer {
    /// Variables.
    pub x: Vec<f64>,
    /// Multipliers of the inequalities, in the order in which they were added (0 for rows left out).
    pub price: Vec<f64>,
}

/// Handle of an inequality; `None` when its right side was infinite.
pub type RowId = Option<usize>;

impl Program {
    /// A problem in `columns` variables without cost.
    pub fn new(columns: usize) -> Self {
        Self { columns, cost: vec![0.0; columns], quadratic: vec![0.0; columns], ..Self::default() }
    }
    /// Adds to the linear cost of a variable.
    pub fn cost(&mut self, column: usize, by: f64) {
        self.refused |= !by.is_finite();
        self.cost[column] += by;
    }
    /// Adds ½·by·x² to the cost.
    pub fn quadratic(&mut self, column: usize, by: f64) {
        self.refused |= !by.is_finite();
        self.quadratic[column] += by;
    }
    /// terms·x = rhs.
    pub fn equal(&mut self, terms: Terms, rhs: f64) {
        self.refused |= self.equal.push(terms, rhs);
    }
    /// terms·x ≤ rhs.
    pub fn below(&mut self, terms: Terms, rhs: f64) -> RowId {
        if rhs == f64::INFINITY {
            return None;
        }
        self.refused |= self.below.push(terms, rhs);
        Some(self.below.rhs.len() - 1)
    }
    /// ‖(e₁, …)‖ ≤ e₀ where each e is a constant plus terms·x.
    pub fn second_order(&mut self, entries: &[(f64, Terms)]) {
        for (constant, terms) in entries {
            self.refused |= self.cones.push_negated(terms, *constant);
        }
        self.cone_sizes.push(entries.len());
    }
    /// Solves; `None` when data were not finite or the solver gave up.
    pub fn solve(&self) -> Option<Answer> {
        if self.refused {
            return None;
        }
        let (a, b, cones) = self.assemble();
        let p = diagonal(&self.quadratic);
        let mut solver = DefaultSolver::new(&p, &self.cost, &a, &b, &cones, settings()).ok()?;
        solver.solve();
        let answer = &solver.solution;
        let solved = matches!(answer.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
        let finite = answer.x.iter().all(|value| value.is_finite());
        let first = self.equal.rhs.len();
        (solved && finite)
            .then(|| Answer { x: answer.x.clone(), price: answer.z[first..first + self.below.rhs.len()].to_vec() })
    }

    fn assemble(&self) -> (CscMatrix<f64>, Vec<f64>, Vec<SupportedConeT<f64>>) {
        let (mut row, mut column, mut value, mut rhs) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for part in [&self.equal, &self.below, &self.cones] {
            row.extend(part.row.iter().map(|index| index + rhs.len()));
            column.extend(&part.column);
            value.extend(&part.value);
            rhs.extend(&part.rhs);
        }
        let mut cones = Vec::with_capacity(self.cone_sizes.len() + 2);
        if !self.equal.rhs.is_empty() {
            cones.push(SupportedConeT::ZeroConeT(self.equal.rhs.len()));
        }
        if !self.below.rhs.is_empty() {
            cones.push(SupportedConeT::NonnegativeConeT(self.below.rhs.len()));
        }
        cones.extend(self.cone_sizes.iter().map(|size| SupportedConeT::SecondOrderConeT(*size)));
        (CscMatrix::new_from_triplets(rhs.len(), self.columns, row, column, value), rhs, cones)
    }
}

impl Rows {
    /// True when something was not finite.
    fn push(&mut self, terms: Terms, rhs: f64) -> bool {
        self.add(terms, rhs, 1.0)
    }
    /// s = constant + terms·x, that is −terms·x + s = constant.
    fn push_negated(&mut self, terms: Terms, constant: f64) -> bool {
        self.add(terms, constant, -1.0)
    }
    fn add(&mut self, terms: Terms, rhs: f64, sign: f64) -> bool {
        let index = self.rhs.len();
        for (column, factor) in terms {
            self.row.push(index);
            self.column.push(*column);
            self.value.push(sign * factor);
        }
        self.rhs.push(rhs);
        !rhs.is_finite() || terms.iter().any(|(_, factor)| !factor.is_finite())
    }
}

fn diagonal(values: &[f64]) -> CscMatrix<f64> {
    let at: Vec<usize> = (0..values.len()).filter(|&i| values[i] != 0.0).collect();
    let nonzero = at.iter().map(|&i| values[i]).collect();
    CscMatrix::new_from_triplets(values.len(), values.len(), at.clone(), at, nonzero)
}

fn settings() -> DefaultSettings<f64> {
    DefaultSettings {
        verbose: false,
        max_iter: 100,
        tol_gap_abs: 1e-8,
        tol_gap_rel: 1e-8,
        tol_feas: 1e-9,
        presolve_enable: false,
        max_threads: 1,
        ..DefaultSettings::default()
    }
}

/// The x that minimises ‖A x − b‖² with `lo` ≤ x ≤ `hi` (infinite bounds allowed); `None` when data are not finite, sizes do
/// not fit or bounds cross. The columns are scaled, A is reduced to its triangle, and the bounds that clarabel finds active
/// are then fixed and the rest solved again exactly.
pub fn bounded_least_squares(a: &DMatrix<f64>, b: &DVector<f64>, lo: &[f64], hi: &[f64]) -> Option<Vec<f64>> {
    let n = a.ncols();
    let sizes = a.nrows() == b.len() && lo.len() == n && hi.len() == n && n > 0 && a.nrows() > 0;
    let finite = a.iter().chain(b.iter()).all(|value| value.is_finite());
    if !sizes || !finite || lo.iter().zip(hi).any(|(lo, hi)| lo.is_nan() || hi.is_nan() || lo > hi) {
        return None;
    }
    let scale: Vec<f64> = a.column_iter().map(|column| column.norm().max(f64::MIN_POSITIVE)).collect();
    let size = b.norm().max(f64::MIN_POSITIVE);
    let mut scaled = a.clone();
    for (mut column, scale) in scaled.column_iter_mut().zip(&scale) {
        column /= *scale;
    }
    let target = b / size;
    let to_unit = |bound: &[f64]| -> Vec<f64> { bound.iter().zip(&scale).map(|(x, s)| x * s / size).collect() };
    let (lo, hi) = (to_unit(lo), to_unit(hi));
    let x = polished(&scaled, &target, &interior(&scaled, &target, &lo, &hi)?, &lo, &hi);
    Some(x.iter().zip(&scale).map(|(x, scale)| x * size / scale).collect())
}

fn interior(a: &DMatrix<f64>, b: &DVector<f64>, lo: &[f64], hi: &[f64]) -> Option<Vec<f64>> {
    let n = a.ncols();
    let qr = a.clone().qr();
    let (r, c) = (qr.r(), qr.q().transpose() * b);
    let mut program = Program::new(n + r.nrows());
    for i in 0..r.nrows() {
        let mut terms: Vec<(usize, f64)> = (0..n).map(|j| (j, r[(i, j)])).collect();
        terms.push((n + i, -1.0));
        program.equal(&terms, c[i]);
        program.quadratic(n + i, 1.0);
    }
    for j in 0..n {
        program.below(&[(j, 1.0)], hi[j]);
        program.below(&[(j, -1.0)], -lo[j]);
    }
    let mut x = program.solve()?.x;
    x.truncate(n);
    Some(x)
}

/// Fixes what lies on its bound and solves for the rest; keeps the first answer where that leaves the bounds.
fn polished(a: &DMatrix<f64>, b: &DVector<f64>, x: &[f64], lo: &[f64], hi: &[f64]) -> Vec<f64> {
    let clipped: Vec<f64> = (0..x.len()).map(|j| x[j].clamp(lo[j], hi[j])).collect();
    let on = |j: usize| x[j] - lo[j] < 1e-6 || hi[j] - x[j] < 1e-6;
    let mut fixed = clipped.clone();
    let free: Vec<usize> = (0..x.len()).filter(|&j| !on(j)).collect();
    for j in (0..x.len()).filter(|&j| on(j)) {
        fixed[j] = if x[j] - lo[j] < hi[j] - x[j] { lo[j] } else { hi[j] };
    }
    let rest = (0..x.len()).filter(|&j| on(j)).fold(b.clone(), |rest, j| rest - a.column(j) * fixed[j]);
    let solved = (!free.is_empty()).then(|| a.select_columns(&free).svd(true, true).solve(&rest, 1e-12));
    if let Some(Ok(values)) = solved {
        for (j, value) in free.iter().zip(values.iter()) {
            fixed[*j] = *value;
        }
    }
    let error = |x: &[f64]| (a * DVector::from_column_slice(x) - b).norm();
    let inside = (0..x.len()).all(|j| fixed[j] >= lo[j] && fixed[j] <= hi[j]);
    if inside && error(&fixed) <= error(&clipped) { fixed } else { clipped }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounded_fit_is_the_plain_fit_or_sits_on_the_bound() {
        let a = DMatrix::from_fn(20, 2, |i, j| if j == 0 { 1.0 } else { 1e4 * i as f64 });
        let b = DVector::from_fn(20, |i, _| 3.0 - 2e-4 * 1e4 * i as f64);
        let free = bounded_least_squares(&a, &b, &[f64::NEG_INFINITY; 2], &[f64::INFINITY; 2]).unwrap();
        assert!((free[0] - 3.0).abs() < 1e-9 && (free[1] + 2e-4).abs() < 1e-13);
        // Slope held at 0: the constant is the mean.
        let held = bounded_least_squares(&a, &b, &[0.0, 0.0], &[f64::INFINITY; 2]).unwrap();
        let mean = b.iter().sum::<f64>() / 20.0;
        assert!(held[1] == 0.0 && (held[0] - mean.max(0.0)).abs() < 1e-9, "{held:?} {mean}");
        assert!(bounded_least_squares(&a, &b, &[f64::NAN, 0.0], &[1.0, 1.0]).is_none());
        assert!(bounded_least_squares(&a, &(b * f64::NAN), &[0.0; 2], &[1.0; 2]).is_none());
    }

    #[test]
    fn second_order_cone_and_prices() {
        // max x + y within the unit circle and x ≤ 0.6: y = 0.8, price of the row 1 − 0.6/0.8.
        let mut program = Program::new(2);
        program.cost(0, -1.0);
        program.cost(1, -1.0);
        program.second_order(&[(1.0, &[]), (0.0, &[(0, 1.0)]), (0.0, &[(1, 1.0)])]);
        assert_eq!(program.below(&[(1, 1.0)], f64::INFINITY), None);
        let row = program.below(&[(0, 1.0)], 0.6).unwrap();
        let answer = program.solve().unwrap();
        assert!((answer.x[1] - 0.8).abs() < 1e-7 && (answer.price[row] - 0.25).abs() < 1e-5, "{answer:?}");
        program.below(&[(0, f64::NAN)], 1.0);
        assert!(program.solve().is_none());
    }
}
