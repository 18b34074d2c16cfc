//! Sparse least squares under bounds. In: a [`Problem`]. Out: x.
//!
//! minimise ½ |A x − b|² + ½ Σ m_k x_k²  under  l ≤ x ≤ u  and  |x_j − x_i − c_p| ≤ r_p for pairs p = (i, j).
//!
//! With D the differences of the pairs and G = [I; D] the constraints are l ≤ G x ≤ u. Solved by the alternating
//! direction method of multipliers (OSQP: Stellato and others 2020, Algorithm 1, without scaling, since all unknowns
//! are millimetres of stock): x from (AᵀA + M + σ I + ρ GᵀG) x = σ x_prev + Aᵀb + Gᵀ(ρ z − y) by preconditioned
//! conjugate gradients, z by clipping, y the multipliers. Sums run in the order of rows, so the result does not depend
//! on the number of threads.

use rayon::prelude::*;

use super::sparse::{RUN, Sparse};

/// Most steps of the method, and of conjugate gradients within each.
const STEPS: usize = 150;
const INNER: usize = 40;
/// Relative residual at which conjugate gradients stop.
const INNER_TOLERANCE: f64 = 1e-6;
/// Over-relaxation α, and σ (both as in OSQP).
const RELAXED: f64 = 1.6;
const SIGMA: f64 = 1e-6;
/// Tolerance of the constraints, and of the change of x, mm.
const STILL_MM: f64 = 1e-6;

/// A difference of two unknowns that is bounded: |x[j] − x[i] − c| ≤ r.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// i and j.
    pub of: [u32; 2],
    /// c.
    pub centre: f64,
    /// r.
    pub reach: f64,
}

/// The problem.
#[derive(Debug, Clone, Default)]
pub struct Problem {
    /// Rows of A: unknown and coefficient, and one past the last of each row.
    pub entries: Vec<(u32, f64)>,
    /// End of each row in `entries`.
    pub ends: Vec<u32>,
    /// b.
    pub wanted: Vec<f64>,
    /// m.
    pub ridge: Vec<f64>,
    /// l and u.
    pub bounds: Vec<[f64; 2]>,
    /// Bounded differences.
    pub pairs: Vec<Pair>,
}

impl Problem {
    /// Appends a row.
    pub fn push(&mut self, row: impl Iterator<Item = (u32, f64)>, wanted: f64) {
        self.entries.extend(row);
        self.ends.push(self.entries.len() as u32);
        self.wanted.push(wanted);
    }

    fn rows(&self) -> impl Iterator<Item = (&[(u32, f64)], f64)> {
        let mut from = 0;
        self.ends.iter().zip(&self.wanted).map(move |(end, wanted)| {
            let row = &self.entries[from..*end as usize];
            from = *end as usize;
            (row, *wanted)
        })
    }

    /// The solution x: within its bounds exactly, with differences within theirs as far as the bounds permit.
    pub fn solve(&self) -> Vec<f64> {
        let n = self.bounds.len();
        let normal = Normal::new(self);
        let rho = normal.rho;
        let mut at: Vec<f64> = self.bounds.iter().map(|[low, high]| 0.0_f64.clamp(*low, *high)).collect();
        let mut z = self.constrained(&at);
        let mut y = vec![0.0; z.len()];
        let target = self.target();
        for _ in 0..STEPS {
            let pull: Vec<f64> = z.iter().zip(&y).map(|(z, y)| rho * z - y).collect();
            let back = self.transposed(&pull);
            let right: Vec<f64> = (0..n).map(|k| SIGMA * at[k] + target[k] + back[k]).collect();
            let next = normal.conjugate_gradients(&right, &at);
            let image = self.constrained(&next);
            let (mut apart, mut moved) = (0.0_f64, 0.0_f64);
            for (c, held) in z.iter_mut().enumerate() {
                let relaxed = RELAXED * image[c] + (1.0 - RELAXED) * *held;
                let [low, high] = self.limits(c);
                let clipped = (relaxed + y[c] / rho).clamp(low, high);
                y[c] += rho * (relaxed - clipped);
                apart = apart.max((image[c] - clipped).abs());
                *held = clipped;
            }
            for (held, next) in at.iter_mut().zip(&next) {
                moved = moved.max((next - *held).abs());
                *held = RELAXED * next + (1.0 - RELAXED) * *held;
            }
            if apart < STILL_MM && moved < STILL_MM {
                break;
            }
        }
        self.within(at)
    }

    /// Clips to the bounds, and corrects differences beyond theirs, sweeping forwards and backwards.
    fn within(&self, mut x: Vec<f64>) -> Vec<f64> {
        for _ in 0..3 {
            self.clip(&mut x);
            for pair in self.pairs.iter().chain(self.pairs.iter().rev()) {
                let [i, j] = pair.of.map(|k| k as usize);
                let over = x[j] - x[i] - pair.centre;
                let excess = over - over.clamp(-pair.reach, pair.reach);
                (x[i], x[j]) = (x[i] + 0.5 * excess, x[j] - 0.5 * excess);
            }
        }
        self.clip(&mut x);
        x
    }

    fn clip(&self, x: &mut [f64]) {
        x.iter_mut().zip(&self.bounds).for_each(|(x, [low, high])| *x = x.clamp(*low, *high));
    }

    fn limits(&self, constraint: usize) -> [f64; 2] {
        match constraint.checked_sub(self.bounds.len()) {
            None => self.bounds[constraint],
            Some(pair) => [-1.0, 1.0].map(|side| self.pairs[pair].centre + side * self.pairs[pair].reach),
        }
    }

    /// G x.
    fn constrained(&self, x: &[f64]) -> Vec<f64> {
        let differences = self.pairs.iter().map(|pair| x[pair.of[1] as usize] - x[pair.of[0] as usize]);
        x.iter().copied().chain(differences).collect()
    }

    /// Gᵀ v.
    fn transposed(&self, v: &[f64]) -> Vec<f64> {
        let mut out = v[..self.bounds.len()].to_vec();
        for (pair, v) in self.pairs.iter().zip(&v[self.bounds.len()..]) {
            out[pair.of[0] as usize] -= v;
            out[pair.of[1] as usize] += v;
        }
        out
    }

    /// Aᵀ b.
    fn target(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.bounds.len()];
        for (row, wanted) in self.rows() {
            for (k, a) in row {
                out[*k as usize] += a * wanted;
            }
        }
        out
    }
}

/// AᵀA + M + σ I + ρ GᵀG, the matrix of each step.
struct Normal {
    /// The rows of A, and those of D times √ρ.
    rows: Sparse,
    /// M + σ + ρ.
    ridge: Vec<f64>,
    /// Diagonal of the whole.
    diagonal: Vec<f64>,
    /// Weight of the constraints: mean of the diagonal of AᵀA + M.
    rho: f64,
}

impl Normal {
    fn new(problem: &Problem) -> Self {
        let n = problem.bounds.len();
        let mut sum: f64 = problem.ridge.iter().sum();
        problem.entries.iter().for_each(|(_, a)| sum += a * a);
        let rho = (sum / n.max(1) as f64).max(1e-9);
        let differences: Vec<[(u32, f64); 2]> =
            problem.pairs.iter().map(|pair| [(pair.of[0], -rho.sqrt()), (pair.of[1], rho.sqrt())]).collect();
        let rows = problem.rows().map(|(row, _)| row).chain(differences.iter().map(<[_; 2]>::as_slice));
        let rows = Sparse::new(rows, n);
        let ridge: Vec<f64> = problem.ridge.iter().map(|m| m + SIGMA + rho).collect();
        let diagonal = rows.squares().iter().zip(&ridge).map(|(square, ridge)| square + ridge).collect();
        Self { rows, ridge, diagonal, rho }
    }

    /// Its product with x; `image`: memory for A x.
    fn times(&self, x: &[f64], image: &mut Vec<f64>, out: &mut Vec<f64>) {
        self.rows.times(x, image);
        self.rows.transposed_times(image, out);
        let each = (out.par_iter_mut(), x, &self.ridge).into_par_iter().with_min_len(RUN);
        each.for_each(|(out, x, ridge)| *out += ridge * x);
    }

    fn conjugate_gradients(&self, right: &[f64], start: &[f64]) -> Vec<f64> {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (mut of_rows, mut image) = (Vec::new(), Vec::new());
        let mut x = start.to_vec();
        self.times(&x, &mut of_rows, &mut image);
        let mut rest: Vec<f64> = right.iter().zip(&image).map(|(b, a)| b - a).collect();
        let scaled = |rest: &[f64]| rest.iter().zip(&self.diagonal).map(|(r, d)| r / d).collect::<Vec<f64>>();
        let mut z = scaled(&rest);
        let mut along = z.clone();
        let mut square = dot(&rest, &z);
        let enough = INNER_TOLERANCE * INNER_TOLERANCE * dot(right, &scaled(right)).max(f64::MIN_POSITIVE);
        for _ in 0..INNER {
            if square <= enough {
                break;
            }
            self.times(&along, &mut of_rows, &mut image);
            let step = square / dot(&along, &image);
            let each = (&mut x, &mut rest, &mut z, &along, &image, &self.diagonal).into_par_iter().with_min_len(RUN);
            each.for_each(|(x, rest, z, along, image, diagonal)| {
                *x += step * along;
                *rest -= step * image;
                *z = *rest / diagonal;
            });
            let next = dot(&rest, &z);
            let keep = next / square;
            (&mut along, &z).into_par_iter().with_min_len(RUN).for_each(|(a, z)| *a = z + keep * *a);
            square = next;
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Target: a step from 0 to 1 at the middle; x may change by 0.1 from one to the next, and not exceed 0.75.
    fn step(n: u32) -> Problem {
        let mut problem = Problem { ridge: vec![0.0; n as usize], ..Problem::default() };
        for k in 0..n {
            problem.push(std::iter::once((k, 1.0)), if 2 * k < n { 0.0 } else { 1.0 });
        }
        problem.bounds = vec![[-1.0, 0.75]; n as usize];
        problem.pairs = (1..n).map(|k| Pair { of: [k - 1, k], centre: 0.0, reach: 0.1 }).collect();
        problem
    }

    #[test]
    fn bounds_and_differences_hold_and_nothing_else_binds() {
        let problem = step(40);
        let x = problem.solve();
        assert!(x.iter().all(|x| *x <= 0.75));
        // The differences keep their limit to the tolerance of the method.
        let steepest = x.windows(2).map(|two| (two[1] - two[0]).abs()).fold(0.0, f64::max);
        assert!(steepest <= 0.1 + STILL_MM, "{steepest}: {x:?}");
        // Far from the step the values equal the rows before it and the bound after it.
        assert!(x[..14].iter().all(|x| x.abs() < 1e-4), "{x:?}");
        assert!(x[26..].iter().all(|x| (x - 0.75).abs() < 1e-4));
        // The ramp is optimal: shifted by one index either way its cost is higher.
        let cost = |shift: i32| -> f64 {
            let at = |k: i32| x[k.clamp(0, 39) as usize];
            (0..40).map(|k| (at(k + shift) - if k < 20 { 0.0 } else { 1.0 }).powi(2)).sum()
        };
        assert!(cost(0) <= cost(1) && cost(0) <= cost(-1));
    }

    #[test]
    fn without_bounds_it_is_the_normal_equations() {
        // Two unknowns, three rows: (1,1)→3, (1,−1)→1, (2,0)→4.4; AᵀA = diag(6, 2), Aᵀb = (12.8, 2).
        let mut problem = Problem { ridge: vec![0.0; 2], bounds: vec![[-9.0, 9.0]; 2], ..Problem::default() };
        for (row, wanted) in [([1.0, 1.0], 3.0), ([1.0, -1.0], 1.0), ([2.0, 0.0], 4.4)] {
            problem.push(row.into_iter().enumerate().map(|(k, a)| (k as u32, a)), wanted);
        }
        let x = problem.solve();
        assert!((x[0] - 12.8 / 6.0).abs() < 1e-5 && (x[1] - 1.0).abs() < 1e-5, "{x:?}");
    }
}
