//! One window of the convex program. In: a chain whose straight legs are fine enough for b to be linear along each, the
//! range of points, and a reference speed for the convexified jerk. Out: b at the points and the price of each cap.
//!
//! Variables, scaled by S (the largest b in the window): x_i = b_i/S, c_i ≤ √x_i, d_i ≥ 1/(c_i + c_{i+1}) and, with a charge
//! on changes, e_i ≥ |x_{i+1} − x_i|. Time is Σ 2 ds_i/√S · d_i. Rows: x_i ≤ cap_i/S; |x_{i+1} − x_i| ≤ 2 a ds_i/S or the
//! rows of an arc; jerk |a_i − a_{i−1}|·√b_i ≤ J·h_i, a_i = (b_{i+1} − b_i)/2ds_i, h_i half the length of both legs. 1/√b is
//! convex, so its tangent at the reference b̄ lies below it: |a_i − a_{i−1}| ≤ J h_i (3/2 b̄^-1/2 − b/2 b̄^-3/2) is linear
//! and never admits more jerk than is allowed. Next to rest the leg has b ≤ J²/4·(6 ds/J)^(4/3), a start at constant jerk,
//! which takes 3 ds/v instead of 2 ds/v.
//! Points at rest are constants.

use super::cone::{Program, RowId};
use super::exact_pass::{Chain, Leg};

/// Time of a leg that begins or ends at rest at constant jerk, in units of its length over the speed at its other end.
pub const REST_FACTOR: f64 = 3.0;

/// The convex program of one window.
#[derive(Debug, Clone, Copy)]
pub struct Window<'a> {
    /// The path.
    pub chain: &'a Chain,
    /// Highest b at its points.
    pub caps: &'a [f64],
    /// Where the jerk is linearised, b at its points.
    pub reference: &'a [f64],
    /// First point.
    pub first: usize,
    /// Last point.
    pub last: usize,
    /// Charge on changes, s per unit of |Δb| / S.
    pub change_s: f64,
}

/// Answer for one window.
#[derive(Debug, Clone)]
pub struct WindowAnswer {
    /// b at its points.
    pub b: Vec<f64>,
    /// Seconds that one unit (mm²/s²) more of the cap at each point saves.
    pub price_s: Vec<f64>,
}

/// Column of each variable; `None` for constants.
struct Layout {
    x: Vec<Option<usize>>,
    legs: usize,
    points: usize,
}

impl Layout {
    fn new(window: &Window) -> Self {
        let mut points = 0;
        let column = |at: usize| {
            (window.caps[at] > 0.0).then(|| {
                points += 1;
                points - 1
            })
        };
        let x = (window.first..=window.last).map(column).collect();
        Self { x, legs: window.last - window.first, points }
    }
    fn c(&self, point: usize) -> Option<usize> {
        self.x[point].map(|x| x + self.points)
    }
    fn d(&self, leg: usize) -> usize {
        2 * self.points + leg
    }
    fn e(&self, leg: usize) -> usize {
        2 * self.points + self.legs + leg
    }
    /// Σ factor·x over the points given, constants (0) left out.
    fn terms(&self, factors: &[(usize, f64)]) -> Vec<(usize, f64)> {
        factors.iter().filter_map(|(point, factor)| Some((self.x[*point]?, *factor))).collect()
    }
}

/// The two values of S that a window is solved with: the largest cap, and the largest reference b. The second is tried where the first gives
/// no answer, or one that the checker refuses.
pub fn scales(window: &Window) -> [f64; 2] {
    let largest = |values: &[f64]| {
        values[window.first..=window.last].iter().copied().filter(|b| b.is_finite()).fold(0.0, f64::max)
    };
    [largest(window.caps), largest(window.reference)]
}

/// Solves a window with S = `scale`; `None` when the solver gave up.
pub fn solve_window(window: &Window, scale: f64) -> Option<WindowAnswer> {
    if scale <= 0.0 {
        return None;
    }
    let layout = Layout::new(window);
    let charged = window.change_s > 0.0;
    let mut program = Program::new(2 * layout.points + if charged { 2 } else { 1 } * layout.legs);
    let legs = &window.chain.legs[window.first..window.last];
    let mean_mm = legs.iter().map(|leg| leg.ds_mm).sum::<f64>() / legs.len() as f64;
    let unit_s = 2.0 * mean_mm / scale.sqrt();
    let caps = points(&mut program, window, &layout, scale);
    for (i, leg) in legs.iter().enumerate() {
        let still = layout.x[i].is_none() || layout.x[i + 1].is_none();
        let factor = if still && leg.jerk_mm_s3.is_finite() { 0.5 * REST_FACTOR } else { 1.0 };
        time(&mut program, &layout, i, factor * leg.ds_mm / mean_mm);
        accelerate(&mut program, window.chain, leg, &layout, i, scale);
        if charged {
            change(&mut program, &layout, i, window.change_s / unit_s);
        }
    }
    for i in 1..legs.len() {
        jerk(&mut program, window, &layout, i, scale);
    }
    rest(&mut program, legs, &layout, scale);
    let answer = program.solve()?;
    let b = layout.x.iter().map(|x| x.map_or(0.0, |x| answer.x[x].max(0.0) * scale)).collect();
    let price_s = caps.iter().map(|row| row.map_or(0.0, |row| answer.price[row] * unit_s / scale)).collect();
    Some(WindowAnswer { b, price_s })
}

fn points(program: &mut Program, window: &Window, layout: &Layout, scale: f64) -> Vec<RowId> {
    let mut caps = Vec::with_capacity(layout.x.len());
    for (i, x) in layout.x.iter().enumerate() {
        caps.push(x.and_then(|x| program.below(&[(x, 1.0)], window.caps[window.first + i] / scale)));
        if let (Some(x), Some(c)) = (*x, layout.c(i)) {
            program.second_order(&[(1.0, &[(x, 1.0)]), (-1.0, &[(x, 1.0)]), (0.0, &[(c, 2.0)])]);
        }
    }
    caps
}

/// d·(c + c') ≥ 1.
fn time(program: &mut Program, layout: &Layout, i: usize, weight: f64) {
    let d = layout.d(i);
    program.cost(d, weight);
    let ends: Vec<usize> = [layout.c(i), layout.c(i + 1)].into_iter().flatten().collect();
    let with =
        |sign: f64| -> Vec<(usize, f64)> { std::iter::once((d, 1.0)).chain(ends.iter().map(|c| (*c, sign))).collect() };
    program.second_order(&[(0.0, &with(1.0)), (0.0, &with(-1.0)), (2.0, &[])]);
}

fn accelerate(program: &mut Program, chain: &Chain, leg: &Leg, layout: &Layout, i: usize, scale: f64) {
    if leg.row_count == 0 {
        let room = 2.0 * leg.accel_mm_s2 * leg.ds_mm / scale;
        program.below(&layout.terms(&[(i + 1, 1.0), (i, -1.0)]), room);
        program.below(&layout.terms(&[(i + 1, -1.0), (i, 1.0)]), room);
        return;
    }
    for row in chain.rows_of(leg) {
        let size = row.p.abs().max(row.q.abs());
        program.below(&layout.terms(&[(i, row.p / size), (i + 1, row.q / size)]), row.r / (size * scale));
    }
}

fn change(program: &mut Program, layout: &Layout, i: usize, charge: f64) {
    let e = layout.e(i);
    program.cost(e, charge);
    for sign in [1.0, -1.0] {
        let mut terms = layout.terms(&[(i + 1, sign), (i, -sign)]);
        terms.push((e, -1.0));
        program.below(&terms, 0.0);
    }
}

/// Jerk at the point between legs i−1 and i.
fn jerk(program: &mut Program, window: &Window, layout: &Layout, i: usize, scale: f64) {
    let (before, after) = (&window.chain.legs[window.first + i - 1], &window.chain.legs[window.first + i]);
    let limit = before.jerk_mm_s3.min(after.jerk_mm_s3);
    let reference = window.reference[window.first + i];
    if !limit.is_finite() || reference <= 0.0 || layout.x[i].is_none() {
        return;
    }
    let (u, w) = (1.0 / (2.0 * after.ds_mm), 1.0 / (2.0 * before.ds_mm));
    let room = limit * 0.5 * (before.ds_mm + after.ds_mm) / reference.sqrt();
    let bend = 0.5 * room / reference;
    let size = u.max(w);
    for sign in [1.0, -1.0] {
        let middle = (-sign * (u + w) + bend) / size;
        let terms = layout.terms(&[(i + 1, sign * u / size), (i, middle), (i - 1, sign * w / size)]);
        program.below(&terms, 1.5 * room / (size * scale));
    }
}

/// Legs that begin or end at rest.
fn rest(program: &mut Program, legs: &[Leg], layout: &Layout, scale: f64) {
    let last = legs.len() - 1;
    for (still, moving, leg) in [(0, 1, &legs[0]), (last + 1, last, &legs[last])] {
        if layout.x[still].is_none() && leg.jerk_mm_s3.is_finite() {
            program.below(&layout.terms(&[(moving, 1.0)]), rest_cap(leg) / scale);
        }
    }
}

/// Highest b at the far end of a leg that begins at rest, at constant jerk.
pub fn rest_cap(leg: &Leg) -> f64 {
    let jerk = leg.jerk_mm_s3;
    0.25 * jerk * jerk * (6.0 * leg.ds_mm / jerk).powf(4.0 / 3.0)
}
