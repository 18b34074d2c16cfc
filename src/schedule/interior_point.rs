//! The convex program of one window, solved by an interior point method made for it. In: a [`Window`]. Out: b at its points
//! and the price of each cap.
//!
//! Variables y_i = b_i / B_i, B the exact speeds, so that they are of order 1 everywhere. Minimised: the time, convex in b: of a
//! leg with b linear along it w/(√b₀ + √b₁), of a straight leg without jerk limit its trapezoid. Rows over at most three
//! neighbours: caps, y ≥ 0, accelerations or the rows of an arc, the start from rest at constant jerk, and the jerk:
//! ±A·b ≤ J h b_i^-1/2 with A·b = a_i − a_{i−1}. Its right side is convex in b, so the tangent at the present b lies below it
//! and never admits more jerk than is allowed; the tangent is drawn anew at every step. Newton steps on ∇T + Gᵀz = 0,
//! s z = μ, s = r − G y > 0 (Mehrotra's predictor and corrector) have a matrix of five diagonals, H + Gᵀ(z/s)G, so the work is
//! linear in the points. A step is shortened until the barrier function T − μ Σ ln s falls (Armijo). All b on the way are
//! feasible; the multipliers at the end are those of the true jerk rows.

use super::convex::{REST_FACTOR, Window, WindowAnswer, rest_cap};
use super::exact_pass::{Leg, leg_time_s, time_slopes};
use super::five_diagonals::Band;

/// Most Newton steps.
const STEPS: usize = 100;
/// Share of the time by which the answer may miss the optimum.
const GAP: f64 = 1e-8;
/// Share of the way to the nearest bound that a step goes.
const REACH: f64 = 0.995;
/// Factor by which a product s·z may differ from μ after a step.
const KEEP: f64 = 1e3;
/// Fall of the barrier function that is asked for, as a share of what its slope promises.
const ARMIJO: f64 = 1e-4;

/// Solves a window; `None` when the steps do not converge.
pub fn solve_interior(window: &Window) -> Option<WindowAnswer> {
    let mut state = State::new(window)?;
    for _ in 0..STEPS {
        if state.is_done() {
            return Some(state.answer());
        }
        state.step()?;
    }
    None
}

/// A row g·(y_{i−1}, y_i, y_{i+1}) ≤ r with its slack, its multiplier and their steps.
#[derive(Debug, Clone, Copy)]
struct Row {
    at: u32,
    g: [f64; 3],
    /// Right side; of a jerk row its factor of y_i^-1/2.
    r: f64,
    /// Factor of the middle point without the tangent; `None` in rows that are linear.
    middle: Option<f64>,
    s: f64,
    z: f64,
    ds: f64,
    dz: f64,
}

/// Law of time of a leg.
enum Law<'a> {
    /// weight / (v₀ + v₁).
    Linear(f64),
    /// Trapezoid of speed.
    Straight(&'a Leg),
}

struct State<'a> {
    /// b = unit·y at each point; 0 at rest.
    unit: Vec<f64>,
    /// y, padded.
    y: Vec<f64>,
    laws: Vec<Law<'a>>,
    rows: Vec<Row>,
    /// Row of the cap of each point.
    caps: Vec<Option<usize>>,
    time_s: f64,
    gradient: Vec<f64>,
    matrix: Band,
    /// Right sides, then the step of y.
    step: Vec<f64>,
}

impl<'a> State<'a> {
    fn new(window: &Window<'a>) -> Option<Self> {
        let legs = &window.chain.legs[window.first..window.last];
        let caps = &window.caps[window.first..=window.last];
        let reference = &window.reference[window.first..=window.last];
        let n = caps.len();
        let unit: Vec<f64> = caps.iter().zip(reference).map(|(cap, b)| if *cap > 0.0 { *b } else { 0.0 }).collect();
        let mut state = Self {
            y: vec![0.0; n + 2],
            laws: legs.iter().enumerate().map(|(i, leg)| law(leg, unit[i] <= 0.0 || unit[i + 1] <= 0.0)).collect(),
            rows: Vec::with_capacity(6 * n),
            caps: vec![None; n],
            time_s: 0.0,
            gradient: vec![0.0; n + 2],
            matrix: Band::zeros(n),
            step: vec![0.0; n + 2],
            unit,
        };
        for i in 0..n {
            state.point(i, caps[i]);
            if i + 1 < n {
                state.leg(i, &legs[i], window);
            }
            if i > 0 && i + 1 < n {
                state.jerk(i, &legs[i - 1], &legs[i]);
            }
        }
        state.start_at_rest(1, 0, legs.first()?);
        state.start_at_rest(n - 2, n - 1, legs.last()?);
        state.start()?;
        Some(state)
    }

    fn row(&mut self, at: usize, g: [f64; 3], r: f64, middle: Option<f64>) {
        let size = g[0].abs().max(g[1].abs()).max(g[2].abs());
        if size > 0.0 && r < f64::INFINITY {
            let (g, r, middle) = (g.map(|g| g / size), r / size, middle.map(|middle| middle / size));
            self.rows.push(Row { at: at as u32, g, r, middle, s: 0.0, z: 0.0, ds: 0.0, dz: 0.0 });
        }
    }

    fn point(&mut self, i: usize, cap: f64) {
        let unit = self.unit[i];
        if unit > 0.0 {
            self.caps[i] = (cap < f64::INFINITY).then_some(self.rows.len());
            self.row(i, [0.0, 1.0, 0.0], cap / unit, None);
            self.row(i, [0.0, -1.0, 0.0], 0.0, None);
        }
    }

    fn leg(&mut self, i: usize, leg: &Leg, window: &Window) {
        let (u0, u1) = (self.unit[i], self.unit[i + 1]);
        if leg.row_count == 0 {
            let room = 2.0 * leg.accel_mm_s2 * leg.ds_mm;
            self.row(i, [0.0, -u0, u1], room, None);
            self.row(i, [0.0, u0, -u1], room, None);
        }
        for row in window.chain.rows_of(leg) {
            self.row(i, [0.0, row.p * u0, row.q * u1], row.r, None);
        }
    }

    fn jerk(&mut self, i: usize, before: &Leg, after: &Leg) {
        let limit = before.jerk_mm_s3.min(after.jerk_mm_s3);
        let unit = self.unit[i];
        if limit == f64::INFINITY || unit <= 0.0 {
            return;
        }
        let (u, w) = (1.0 / (2.0 * after.ds_mm), 1.0 / (2.0 * before.ds_mm));
        let r = limit * 0.5 * (before.ds_mm + after.ds_mm) / unit.sqrt();
        for sign in [1.0, -1.0] {
            let middle = -sign * (u + w) * unit;
            self.row(i, [sign * w * self.unit[i - 1], middle, sign * u * self.unit[i + 1]], r, Some(middle));
        }
    }

    fn start_at_rest(&mut self, moving: usize, still: usize, leg: &Leg) {
        if self.unit[still] <= 0.0 && self.unit[moving] > 0.0 && leg.jerk_mm_s3 < f64::INFINITY {
            self.row(moving, [0.0, 1.0, 0.0], rest_cap(leg) / self.unit[moving], None);
        }
    }

    /// A feasible start: the exact speeds times one factor; θ on b takes θ off accelerations and θ^3/2 off the jerk.
    fn start(&mut self) -> Option<()> {
        for (y, unit) in self.y[1..].iter_mut().zip(&self.unit) {
            *y = if *unit > 0.0 { 1.0 } else { 0.0 };
        }
        let mut factor: f64 = 0.9;
        for row in &self.rows {
            let load = row.load(&self.y) / row.r;
            if load > 0.0 && load < f64::INFINITY {
                factor = factor.min(0.8 * if row.middle.is_none() { 1.0 / load } else { load.powf(-2.0 / 3.0) });
            }
        }
        for y in &mut self.y {
            *y *= factor;
        }
        self.renew();
        self.slopes();
        let mu = 0.1 * self.time_s / self.rows.len() as f64;
        for row in &mut self.rows {
            row.z = mu / row.s;
        }
        self.rows.iter().all(|row| row.s > 0.0).then_some(())
    }

    /// Slacks and tangents at y.
    fn renew(&mut self) {
        let y = &self.y;
        for row in &mut self.rows {
            row.renew(y);
        }
    }

    /// Time, its gradient, and its second derivatives in the matrix.
    fn slopes(&mut self) {
        self.gradient.fill(0.0);
        self.matrix.clear();
        self.time_s = 0.0;
        for (i, law) in self.laws.iter().enumerate() {
            let (u0, u1) = (self.unit[i], self.unit[i + 1]);
            let [time, d0, d1, d00, d01, d11] = law.slopes(u0 * self.y[i + 1], u1 * self.y[i + 2]);
            self.time_s += time;
            self.gradient[i + 1] += d0 * u0;
            self.gradient[i + 2] += d1 * u1;
            self.matrix.diagonal[i + 1] += d00 * u0 * u0;
            self.matrix.diagonal[i + 2] += d11 * u1 * u1;
            self.matrix.next[i + 1] += d01 * u0 * u1;
        }
        for (diagonal, unit) in self.matrix.diagonal[1..].iter_mut().zip(&self.unit) {
            if *unit <= 0.0 {
                *diagonal = 1.0;
            }
        }
    }

    fn is_done(&self) -> bool {
        if self.complementarity() > GAP * self.time_s {
            return false;
        }
        let mut rest = self.gradient.clone();
        for row in &self.rows {
            row.spread(row.z, &mut rest);
        }
        let rest: f64 = rest.iter().zip(&self.y).map(|(rest, y)| (rest * y).abs()).sum();
        rest <= 100.0 * GAP * self.time_s
    }

    fn complementarity(&self) -> f64 {
        self.rows.iter().map(|row| row.s * row.z).sum()
    }

    fn step(&mut self) -> Option<()> {
        for row in &self.rows {
            self.matrix.add(row.at as usize, &row.g, row.z / row.s);
        }
        self.matrix.factor()?;
        let mu = self.predict();
        for row in &mut self.rows {
            row.dz = (mu - row.ds * row.dz) / row.s;
        }
        let (mut primal, mut dual) = self.directions();
        if self.slope(mu) >= 0.0 || !self.advance(&mut primal, mu, 3) {
            for row in &mut self.rows {
                row.dz = mu / row.s;
            }
            (primal, dual) = self.directions();
            if !self.advance(&mut primal, mu, 30) {
                return None;
            }
        }
        for row in &mut self.rows {
            let near = mu / row.s;
            row.z = (row.z + dual * row.dz).clamp(near / KEEP, near * KEEP);
        }
        self.slopes();
        Some(())
    }

    /// The step towards μ = 0, left in `ds` and `dz`; returns the μ to aim at.
    fn predict(&mut self) -> f64 {
        for row in &mut self.rows {
            row.dz = 0.0;
        }
        let (primal, dual) = self.directions();
        let ahead = |row: &Row| (row.s + primal * row.ds) * (row.z + dual * row.dz);
        let after: f64 = self.rows.iter().map(ahead).sum();
        let now = self.complementarity();
        now / self.rows.len() as f64 * (after / now).powi(3).clamp(1e-6, 1.0)
    }

    /// Step of y for right sides s z = s·dz (given in `dz`), the steps of s and z that follow, and how far they may go.
    fn directions(&mut self) -> (f64, f64) {
        for (step, gradient) in self.step.iter_mut().zip(&self.gradient) {
            *step = -gradient;
        }
        for row in &self.rows {
            row.spread(-row.dz, &mut self.step);
        }
        self.matrix.solve(&mut self.step);
        let (mut primal, mut dual) = (1.0 / REACH, 1.0 / REACH);
        for row in &mut self.rows {
            row.ds = -row.dot(&self.step);
            row.dz -= row.z + row.z / row.s * row.ds;
            if row.ds < 0.0 {
                primal = f64::min(primal, -row.s / row.ds);
            }
            if row.dz < 0.0 {
                dual = f64::min(dual, -row.z / row.dz);
            }
        }
        (REACH * primal, REACH * dual)
    }

    /// Moves y along the step, halved until the barrier function falls; false, and y as before, when it does not.
    fn advance(&mut self, primal: &mut f64, mu: f64, halvings: usize) -> bool {
        let (merit, slope, old) = (self.merit(mu), self.slope(mu), self.y.clone());
        for _ in 0..halvings {
            for ((y, old), step) in self.y.iter_mut().zip(&old).zip(&self.step) {
                *y = old + *primal * step;
            }
            self.renew();
            if self.merit(mu) <= merit + ARMIJO * *primal * slope + 1e-13 * merit.abs() {
                return true;
            }
            *primal *= 0.5;
        }
        self.y = old;
        self.renew();
        false
    }

    /// T − μ Σ ln s.
    fn merit(&self, mu: f64) -> f64 {
        if self.rows.iter().any(|row| row.s.is_nan() || row.s <= 0.0) {
            return f64::INFINITY;
        }
        let logs: f64 = self.rows.chunks(4).map(|four| four.iter().map(|row| row.s).product::<f64>().ln()).sum();
        let b = |i: usize| self.unit[i] * self.y[i + 1];
        self.laws.iter().enumerate().map(|(i, law)| law.time_s(b(i), b(i + 1))).sum::<f64>() - mu * logs
    }

    /// Its derivative along the step.
    fn slope(&self, mu: f64) -> f64 {
        let of_time: f64 = self.gradient.iter().zip(&self.step).map(|(gradient, step)| gradient * step).sum();
        of_time - self.rows.iter().map(|row| mu / row.s * row.ds).sum::<f64>()
    }

    fn answer(&self) -> WindowAnswer {
        let b = self.unit.iter().zip(&self.y[1..]).map(|(unit, y)| unit * y).collect();
        let price = |(row, unit): (&Option<usize>, &f64)| row.map_or(0.0, |row| self.rows[row].z / unit);
        WindowAnswer { b, price_s: self.caps.iter().zip(&self.unit).map(price).collect() }
    }
}

fn law(leg: &Leg, still: bool) -> Law<'_> {
    if leg.jerk_mm_s3 < f64::INFINITY {
        Law::Linear(if still { REST_FACTOR } else { 2.0 } * leg.ds_mm)
    } else if leg.row_count > 0 {
        Law::Linear(2.0 * leg.ds_mm)
    } else {
        Law::Straight(leg)
    }
}

impl Law<'_> {
    fn time_s(&self, b0: f64, b1: f64) -> f64 {
        match self {
            Law::Linear(weight) if b0 + b1 > 0.0 => weight / (b0.sqrt() + b1.sqrt()),
            Law::Linear(_) => 0.0,
            Law::Straight(leg) => leg_time_s(leg, b0, b1),
        }
    }

    /// Time and its derivatives by b₀, b₁, b₀b₀, b₀b₁, b₁b₁; those at rest are 0.
    fn slopes(&self, b0: f64, b1: f64) -> [f64; 6] {
        match self {
            Law::Linear(weight) => {
                let (v0, v1) = (b0.sqrt(), b1.sqrt());
                if v0 + v1 <= 0.0 {
                    return [0.0; 6];
                }
                let time = weight / (v0 + v1);
                let (first, second) = (-time / (v0 + v1), 2.0 * time / (v0 + v1).powi(2));
                // dv/db = 1/2v, d²v/db² = −1/4v³.
                let [d0, d1] = [v0, v1].map(|v| if v > 0.0 { 0.5 / v } else { 0.0 });
                let bend = |d: f64| second * d * d - 2.0 * first * d * d * d;
                [time, first * d0, first * d1, bend(d0), second * d0 * d1, bend(d1)]
            }
            Law::Straight(leg) => {
                let [d0, d1, _] = time_slopes(leg, b0, b1);
                let a = leg.accel_mm_s2;
                let top = 0.5 * (b0 + b1) + a * leg.ds_mm;
                // The peak moves with both ends while it is below the cap.
                let shared = if top < leg.cap_b { 0.125 * top.powf(-1.5) / a } else { 0.0 };
                let own = |b: f64| if b > 0.0 { 0.25 * b.powf(-1.5) / a - shared } else { 0.0 };
                let both = if b0 > 0.0 && b1 > 0.0 { -shared } else { 0.0 };
                [leg_time_s(leg, b0, b1), d0, d1, own(b0), both, own(b1)]
            }
        }
    }
}

impl Row {
    /// g·y, of a jerk row without its tangent.
    fn load(&self, y: &[f64]) -> f64 {
        let at = self.at as usize;
        self.g[0] * y[at] + self.middle.unwrap_or(self.g[1]) * y[at + 1] + self.g[2] * y[at + 2]
    }
    fn dot(&self, d: &[f64]) -> f64 {
        let at = self.at as usize;
        self.g[0] * d[at] + self.g[1] * d[at + 1] + self.g[2] * d[at + 2]
    }
    /// Adds Gᵀ·by.
    fn spread(&self, by: f64, onto: &mut [f64]) {
        let at = self.at as usize;
        for k in 0..3 {
            onto[at + k] += self.g[k] * by;
        }
    }
    /// Slack and tangent at y.
    fn renew(&mut self, y: &[f64]) {
        let Some(middle) = self.middle else {
            self.s = self.r - self.dot(y);
            return;
        };
        let at = y[self.at as usize + 1];
        let right = self.r / at.sqrt();
        self.s = right - self.load(y);
        self.g[1] = middle + 0.5 * right / at;
    }
}
