//! The exact pass: fastest speeds along a path under caps and accelerations.
//!
//! In: legs (pieces of path) between points; b = v² (mm²/s²) at the points. Out: the pointwise largest b, hence the least
//! time. On a leg without rows the tangential acceleration is at most `accel` either way, |b₁ − b₀| ≤ 2·accel·ds, and
//! inside it the speed runs up to the cap and down again (a trapezoid, in closed form). A leg with rows (an arc, cut fine)
//! has b linear along it and linear inequalities p·b₀ + q·b₁ ≤ r instead: axis accelerations t·a + k·b at both its ends.
//!
//! A backward sweep finds the largest b at each point from which the rest of the path can be done; a forward sweep then
//! takes the largest b that stays below it. Both are exact: the feasible b at a point is an interval that contains 0.

/// A piece of path with one cap and one law of acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    /// Length, mm.
    pub ds_mm: f64,
    /// Highest b inside, mm²/s².
    pub cap_b: f64,
    /// Highest tangential acceleration either way, mm/s² (of legs without rows).
    pub accel_mm_s2: f64,
    /// Highest tangential jerk, mm/s³; infinite where there is no limit.
    pub jerk_mm_s3: f64,
    /// First row.
    pub first_row: u32,
    /// Number of rows; 0: a straight leg.
    pub row_count: u32,
}

/// p·b₀ + q·b₁ ≤ r between the ends of a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Factor of b at the start.
    pub p: f64,
    /// Factor of b at the end.
    pub q: f64,
    /// Right side, positive.
    pub r: f64,
}

/// A whole path.
#[derive(Debug, Clone, Default)]
pub struct Chain {
    /// Legs in order.
    pub legs: Vec<Leg>,
    /// Highest b at the points between them (one more than legs): corners, and 0 at rest.
    pub point_b: Vec<f64>,
    /// Rows of all legs.
    pub rows: Vec<Row>,
}

impl Chain {
    /// Rows of a leg.
    pub fn rows_of(&self, leg: &Leg) -> &[Row] {
        &self.rows[leg.first_row as usize..(leg.first_row + leg.row_count) as usize]
    }
    /// Highest b at every point with the caps of both its legs.
    pub fn point_caps(&self) -> Vec<f64> {
        let mut caps = self.point_b.clone();
        for (i, leg) in self.legs.iter().enumerate() {
            caps[i] = caps[i].min(leg.cap_b);
            caps[i + 1] = caps[i + 1].min(leg.cap_b);
        }
        caps
    }
}

/// Largest b at every point.
pub fn exact_pass(chain: &Chain) -> Vec<f64> {
    exact_pass_below(chain, chain.point_b.clone())
}

/// Largest b at every point under these values at the points in place of the chain's own.
pub fn exact_pass_below(chain: &Chain, mut b: Vec<f64>) -> Vec<f64> {
    backward(chain, &mut b);
    let Some((first, rest)) = b.split_first_mut() else { return b };
    let mut before = *first;
    for (leg, b) in chain.legs.iter().zip(rest) {
        let reach = if leg.row_count == 0 {
            before + 2.0 * leg.accel_mm_s2 * leg.ds_mm
        } else {
            largest_end(chain.rows_of(leg), before)
        };
        before = least(*b, reach);
        *b = before;
    }
    b
}

/// Takes b at the points down to the caps of the legs and to what the rest of the path can be done from.
fn backward(chain: &Chain, b: &mut [f64]) {
    let Some((last, rest)) = b.split_last_mut() else { return };
    let (mut after, mut at) = (*last, last);
    for (leg, b) in chain.legs.iter().zip(rest).rev() {
        let (start, end) = (least(*b, leg.cap_b), least(after, leg.cap_b));
        *at = end;
        after = if leg.row_count == 0 {
            least(start, end + 2.0 * leg.accel_mm_s2 * leg.ds_mm)
        } else {
            largest_start(chain.rows_of(leg), start, end)
        };
        at = b;
    }
    *at = after;
}

/// The lesser of two numbers that are not NaN, in one instruction.
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Time of a leg between two values of b, s.
pub fn leg_time_s(leg: &Leg, b0: f64, b1: f64) -> f64 {
    if leg.ds_mm <= 0.0 {
        return 0.0;
    }
    let (v0, v1) = (b0.sqrt(), b1.sqrt());
    let top = 0.5 * (b0 + b1) + leg.accel_mm_s2 * leg.ds_mm;
    if leg.row_count > 0 || !top.is_finite() {
        return 2.0 * leg.ds_mm / (v0 + v1);
    }
    let peak = top.min(leg.cap_b).max(b0.max(b1));
    let (v, a) = (peak.sqrt(), leg.accel_mm_s2);
    let ramps_mm = (2.0 * peak - b0 - b1) / (2.0 * a);
    (2.0 * v - v0 - v1) / a + (leg.ds_mm - ramps_mm).max(0.0) / v
}

/// Time of every leg, s.
pub fn leg_times(chain: &Chain, b: &[f64]) -> Vec<f64> {
    chain.legs.iter().enumerate().map(|(i, leg)| leg_time_s(leg, b[i], b[i + 1])).collect()
}

/// Time that raising each cap by one unit saves, s per mm²/s².
#[derive(Debug, Clone, Default)]
pub struct CapPrices {
    /// For the cap of each point (the least of its own and those of its two legs).
    pub point_s: Vec<f64>,
    /// For the cap inside each leg.
    #[cfg_attr(not(feature = "rooms"), allow(dead_code, reason = "only a test holds it against differences"))]
    pub leg_s: Vec<f64>,
}

/// Prices of the caps of an exact pass that gave `b`: both sweeps run in reverse, each handing the price of a speed on to
/// whatever held it down. A rest has no price.
pub fn cap_prices(chain: &Chain, b: &[f64]) -> CapPrices {
    let legs = &chain.legs;
    let caps = chain.point_caps();
    let mut reachable = caps.clone();
    backward(chain, &mut reachable);
    let mut gradient = vec![0.0; b.len()];
    let mut leg_s = vec![0.0; legs.len()];
    for (i, leg) in legs.iter().enumerate() {
        let [d0, d1, inside] = time_slopes(leg, b[i], b[i + 1]);
        gradient[i] += d0;
        gradient[i + 1] += d1;
        leg_s[i] = -inside;
    }
    for i in (0..legs.len()).rev() {
        if b[i + 1] < reachable[i + 1] * (1.0 - 1e-12) {
            gradient[i] += gradient[i + 1] * end_slope(chain, &legs[i], b[i]);
            gradient[i + 1] = 0.0;
        }
    }
    let mut point_s = vec![0.0; b.len()];
    for i in 0..b.len() {
        if i < legs.len() && reachable[i] < caps[i] * (1.0 - 1e-12) {
            gradient[i + 1] += gradient[i] * start_slope(chain, &legs[i], caps[i], reachable[i + 1]);
        } else if caps[i] > 0.0 {
            point_s[i] = -gradient[i];
        }
    }
    CapPrices { point_s, leg_s }
}

/// Derivatives of the time of a leg by both its b and by its cap; 0 at rest.
pub fn time_slopes(leg: &Leg, b0: f64, b1: f64) -> [f64; 3] {
    let (v0, v1) = (b0.sqrt(), b1.sqrt());
    let top = 0.5 * (b0 + b1) + leg.accel_mm_s2 * leg.ds_mm;
    if leg.ds_mm <= 0.0 || v0 + v1 + top <= 0.0 {
        return [0.0; 3];
    }
    let of = |v: f64, slope: f64| if v > 0.0 { slope } else { 0.0 };
    if leg.row_count > 0 {
        let common = -leg.ds_mm / (v0 + v1).powi(2);
        return [of(v0, common / v0), of(v1, common / v1), 0.0];
    }
    let (peak, a) = (top.min(leg.cap_b).max(b0.max(b1)), leg.accel_mm_s2);
    let slope = |v: f64| of(v, (1.0 / peak.sqrt() - 1.0 / v) / (2.0 * a));
    let cruise_mm = leg.ds_mm - (2.0 * peak - b0 - b1) / (2.0 * a);
    [slope(v0), slope(v1), if cruise_mm > 0.0 { -0.5 * cruise_mm / peak.powf(1.5) } else { 0.0 }]
}

/// d b₁ / d b₀ where the leg holds b₁ down.
fn end_slope(chain: &Chain, leg: &Leg, b0: f64) -> f64 {
    let bound = |row: &&Row| (row.r - row.p * b0) / row.q;
    let rows = chain.rows_of(leg).iter().filter(|row| row.q > 0.0);
    rows.min_by(|x, y| bound(x).total_cmp(&bound(y))).map_or(1.0, |row| -row.p / row.q)
}

/// d b₀ / d b₁ where the leg holds b₀ down.
fn start_slope(chain: &Chain, leg: &Leg, cap0: f64, b1: f64) -> f64 {
    if leg.row_count == 0 {
        return 1.0;
    }
    let step = 1e-6 * b1.max(1e-6);
    let rows = chain.rows_of(leg);
    (largest_start(rows, cap0, b1 + step) - largest_start(rows, cap0, b1)) / step
}

/// Largest b₁ for a given b₀; b₀ itself when only rounding stands against every b₁.
fn largest_end(rows: &[Row], b0: f64) -> f64 {
    let bound = |row: &Row| (row.r - row.p * b0) / row.q;
    rows.iter().filter(|row| row.q > 0.0).map(bound).fold(f64::INFINITY, f64::min).max(0.0)
}

/// Largest b₀ ≤ `cap0` for which some b₁ in [0, `cap1`] meets the rows: a linear program in two variables, solved by
/// adding one row at a time (when the optimum so far violates the new row, the next one lies on it).
fn largest_start(rows: &[Row], cap0: f64, cap1: f64) -> f64 {
    let (mut b0, mut b1) = (cap0, cap1);
    for (k, row) in rows.iter().enumerate() {
        if row.p * b0 + row.q * b1 <= row.r * (1.0 + 1e-12) {
            continue;
        }
        match best_on_line(row, &rows[..k], cap0, cap1) {
            Some(point) => (b0, b1) = point,
            None => return 0.0,
        }
    }
    b0
}

/// The point of largest b₀ on the line p·b₀ + q·b₁ = r inside the box and the rows before it.
fn best_on_line(line: &Row, rows: &[Row], cap0: f64, cap1: f64) -> Option<(f64, f64)> {
    let norm2 = line.p * line.p + line.q * line.q;
    let (x, y) = (line.p * line.r / norm2, line.q * line.r / norm2);
    let (dx, dy) = if line.q >= 0.0 { (line.q, -line.p) } else { (-line.q, line.p) };
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut keep = |slope: f64, room: f64| {
        if slope > 0.0 {
            high = high.min(room / slope);
        } else if slope < 0.0 {
            low = low.max(room / slope);
        }
    };
    keep(dx, cap0 - x);
    keep(-dx, x);
    keep(dy, cap1 - y);
    keep(-dy, y);
    for row in rows {
        keep(row.p * dx + row.q * dy, row.r - row.p * x - row.q * y);
    }
    (low <= high + 1e-12 * high.abs()).then(|| ((x + high * dx).clamp(0.0, cap0), (y + high * dy).clamp(0.0, cap1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straight(ds_mm: f64, speed_mm_s: f64, accel_mm_s2: f64) -> Leg {
        Leg {
            ds_mm,
            cap_b: speed_mm_s * speed_mm_s,
            accel_mm_s2,
            jerk_mm_s3: f64::INFINITY,
            first_row: 0,
            row_count: 0,
        }
    }

    #[test]
    fn one_line_from_rest_to_rest_is_the_trapezoid() {
        let chain = Chain { legs: vec![straight(100.0, 20.0, 100.0)], point_b: vec![0.0; 2], rows: vec![] };
        let b = exact_pass(&chain);
        let time: f64 = leg_times(&chain, &b).iter().sum();
        assert!((time - (100.0 / 20.0 + 20.0 / 100.0)).abs() < 1e-12);
        let short = Chain { legs: vec![straight(1.0, 1e3, 100.0)], point_b: vec![0.0; 2], rows: vec![] };
        let time: f64 = leg_times(&short, &exact_pass(&short)).iter().sum();
        assert!((time - 2.0 * (1.0f64 / 100.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn cutting_a_line_in_pieces_changes_nothing() {
        let whole = Chain { legs: vec![straight(30.0, 50.0, 200.0)], point_b: vec![0.0; 2], rows: vec![] };
        let legs: Vec<Leg> = (0..7).map(|_| straight(30.0 / 7.0, 50.0, 200.0)).collect();
        let mut point_b = vec![f64::INFINITY; 8];
        (point_b[0], point_b[7]) = (0.0, 0.0);
        let cut = Chain { legs, point_b, rows: vec![] };
        let sum = |chain: &Chain| leg_times(chain, &exact_pass(chain)).iter().sum::<f64>();
        assert!((sum(&whole) - sum(&cut)).abs() < 1e-12);
    }

    #[test]
    fn rows_that_say_the_same_as_a_straight_leg_give_the_same_speeds() {
        let (n, ds, accel) = (40usize, 0.5, 150.0);
        let mut plain =
            Chain { legs: vec![straight(ds, 60.0, accel); n], point_b: vec![f64::INFINITY; n + 1], rows: vec![] };
        (plain.point_b[0], plain.point_b[n], plain.point_b[23]) = (0.0, 0.0, 4.0);
        let mut rowed = plain.clone();
        let r = 2.0 * accel * ds;
        for leg in &mut rowed.legs {
            (leg.first_row, leg.row_count) = (rowed.rows.len() as u32, 2);
            rowed.rows.extend([Row { p: 1.0, q: -1.0, r }, Row { p: -1.0, q: 1.0, r }]);
        }
        for (x, y) in exact_pass(&plain).iter().zip(exact_pass(&rowed)) {
            assert!((x - y).abs() < 1e-9);
        }
    }
}
