//! Forces of one station under the linear edge model, affine in the feed per tooth f. In: spans of rotation in which the same teeth cut. Out:
//! peaks and means at any f, and the largest f for any limit, in closed form.
//!
//! While the same teeth cut, the force in the plane, seen from the turning tool, is E + f B(θ) with
//! B(θ) = C₀ e^{iθ} + C₁ + C₂ e^{−iθ} (see [`super::rings`]): the edge part stands still and the cutting part runs on an
//! ellipse. A peak is the largest |E + f B| over the spans between entries and exits: at an end of a span or where the
//! derivative Re((E + f B)* B′) vanishes, found by Newton's method inside the few spans that can hold it. At each angle
//! |E + f B| = L is a quadratic in f; the peak is a maximum of convex functions, so the cap is the least root, found
//! from below by solving the quadratic at the angle that is worst at the last feed.

use super::cap::{lower, scaled};
use super::loads::{Cap, Forces};
use super::modifiers::Factors;
use super::rings::{C, Sums};

/// Upper bound of the ratio of a peak of |F|² between points to the highest point: 1 + 5 · (h²/8 · 4) for a distance h of 0.02 rad, which
/// leaves a factor of five in reserve.
const NEARLY: f64 = 1.001;

/// A load that is affine in feed per tooth: `base + slope·f`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Affine {
    pub base: f64,
    pub slope: f64,
}

impl Affine {
    pub(super) fn at(self, f: f64) -> f64 {
        self.base + self.slope * f
    }
    /// The load with its edge part (`base`) and its cutting part (`slope`) multiplied by factors.
    fn under(self, factors: &Factors) -> Self {
        Self { base: self.base * factors.edge_worn(), slope: self.slope * factors.cutting }
    }
    pub(super) fn scaled(self, by: f64) -> Self {
        Self { base: self.base * by, slope: self.slope * by }
    }
    /// Feed per tooth up to which the magnitude stays below `limit`.
    pub(super) fn cap(self, limit: f64) -> Cap {
        if self.base.abs() > limit * (1.0 + 1e-12) {
            return Cap::Unreachable;
        }
        // A slope smaller than the rounding of the edge force counts as 0.
        if self.slope.abs() <= 1e-12 * self.base.abs() {
            return Cap::Free;
        }
        let bound = limit.copysign(self.slope);
        Cap::Feed { feed_mm_s: (bound - self.base) / self.slope, per_unit: self.slope.abs().recip() }
    }
}

/// All forces at one angle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Point {
    /// F_x + i F_y of the edges, and per feed per tooth.
    pub edge: C,
    pub cut: C,
    pub axial: Affine,
    /// N·mm.
    pub torque: Affine,
    /// Are the points before and after it equally far away, with no kink of the forces between them?
    pub is_inner: bool,
}

/// E and B where |F|² is largest between three points, if that is near the middle one: forces are interpolated by parabolas through the
/// points, whose error is of third order in their distance.
fn between(points: &[Point], sizes: [f64; 3], edge: f64) -> Option<(C, C)> {
    let [before, here, after] = points else { return None };
    let (rise, bend) = (0.5 * (sizes[2] - sizes[0]), sizes[0] + sizes[2] - 2.0 * sizes[1]);
    if !here.is_inner || sizes[0] > sizes[1] || sizes[2] > sizes[1] || bend >= 0.0 {
        return None;
    }
    let x = -rise / bend;
    let on_parabola = |a: C, b: C, c: C| b + ((c - a) * 0.5 + (a + c - b * 2.0) * (0.5 * x)) * x;
    let e = on_parabola(before.edge, here.edge, after.edge) * edge;
    Some((e, on_parabola(before.cut, here.cut, after.cut)))
}

/// A stretch of rotation in which the same teeth cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    /// e^{iθ} at its beginning.
    pub start: C,
    /// Its length, rad.
    pub length: f64,
    pub edge: C,
    pub c0: C,
    pub c1: C,
    pub c2: C,
    /// B and B′ at both ends.
    pub ends: [[C; 2]; 2],
    /// Largest torque, N·mm.
    pub torque: Affine,
    /// Axial force where its cutting part is least and where it is largest.
    pub axial: [Affine; 2],
}

impl Span {
    #[inline]
    pub(super) fn new(start: C, end: C, length: f64, sums: &Sums, c: f64, tz: f64) -> Self {
        let (c0, c1, c2) = (sums.c0 * c, sums.c1 * tz, sums.c2 * c);
        let torque = sinusoid(sums.t_c * tz, sums.t_s * c, start, end)[1];
        let axial = sinusoid(sums.z_c * tz, sums.z_s * c, start, end);
        Self {
            start,
            length,
            edge: sums.edge,
            c0,
            c1,
            c2,
            ends: [ellipse(start, c0, c1, c2), ellipse(end, c0, c1, c2)],
            torque: Affine { base: sums.t_e, slope: torque },
            axial: axial.map(|slope| Affine { base: sums.z_e, slope }),
        }
    }
    /// Largest |E + f B|² inside the span, given that its derivative falls from positive to negative across it; also B there.
    fn inner_peak(&self, f: f64, edge: C, slopes: [f64; 2]) -> (f64, C) {
        let (mut lo, mut hi) = (0.0, self.length);
        let mut x = self.length * slopes[0] / (slopes[0] - slopes[1]);
        let mut best = (0.0, C::default());
        for _ in 0..20 {
            let turn = self.start * C::from_polar(1.0, x);
            let [b, slope] = ellipse(turn, self.c0, self.c1, self.c2);
            let w = edge + b * f;
            best = (w.norm_sqr(), b);
            let d = dot(w, slope);
            if d > 0.0 {
                lo = x;
            } else {
                hi = x;
            }
            let bend = f * slope.norm_sqr() - dot(w, b - self.c1);
            let step = if bend < 0.0 { -d / bend } else { 0.5 * (hi - lo) };
            if step.abs() < 1e-9 {
                break;
            }
            x = if (lo..=hi).contains(&(x + step)) { x + step } else { 0.5 * (lo + hi) };
        }
        best
    }
}

/// B and B′ where e^{iθ} = `turn`.
fn ellipse(turn: C, c0: C, c1: C, c2: C) -> [C; 2] {
    let (ahead, behind) = (c0 * turn, c2 * turn.conj());
    let d = ahead - behind;
    [ahead + c1 + behind, C::new(-d.im, d.re)]
}

/// Least and largest of `base + Im(s e^{iθ})` from `from` to `to` (less than half a turn apart).
fn sinusoid(base: f64, s: C, from: C, to: C) -> [f64; 2] {
    let (a, b) = (s * from, s * to);
    let (mut low, mut high) = (a.im.min(b.im), a.im.max(b.im));
    // The derivative is the real part: it changes sign where the sine peaks.
    if a.re > 0.0 && b.re < 0.0 {
        high = s.norm_sqr().sqrt();
    } else if a.re < 0.0 && b.re > 0.0 {
        low = -s.norm_sqr().sqrt();
    }
    [base + low, base + high]
}

fn dot(a: C, b: C) -> f64 {
    a.re * b.re + a.im * b.im
}

/// All forces of one station. Feeds are mm per tooth. Edge forces are multiplied by `factors.edge_worn()`, cutting forces by
/// `factors.cutting`; peaks are taken at the feed plus `factors.peak_feed_mm`.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Spans {
    /// Spans, where the edges are straight.
    pub list: Vec<Span>,
    /// Points, where the edges are helices: close enough together to find every peak.
    pub points: Vec<Point>,
    /// Mean force along x, y, z.
    pub mean: [Affine; 3],
    /// Mean torque, N·mm.
    pub torque: Affine,
    /// Normal force at the moments that leave the wall, times the radial part of the wall's normal.
    pub wall: Vec<Affine>,
    /// Chip thickness per feed per tooth.
    pub chip: f64,
}

impl Spans {
    /// Forces at feed per tooth `f`.
    pub(super) fn forces(&self, f: f64, factors: &Factors) -> Forces {
        let peak = f + factors.peak_feed_mm;
        Forces {
            xy_peak: self.peak_xy(peak * factors.cutting, factors.edge_worn()).0.sqrt(),
            axial_peak: largest(self.axial(), peak, factors),
            torque_peak: largest(self.torques(), peak, factors),
            wall: largest(self.wall.iter().copied(), peak, factors),
            mean: self.mean.map(|component| component.under(factors).at(f)),
            torque: self.torque.under(factors).at(f),
            chip: self.chip * peak,
        }
    }

    fn axial(&self) -> impl Iterator<Item = Affine> {
        self.list.iter().flat_map(|span| span.axial).chain(self.points.iter().map(|point| point.axial))
    }
    fn torques(&self) -> impl Iterator<Item = Affine> {
        self.list.iter().map(|span| span.torque).chain(self.points.iter().map(|point| point.torque))
    }

    /// Cap on the mean force normal to the wall, per tooth.
    pub(super) fn cap_normal_mean(&self, limit_n: f64, factors: &Factors) -> Cap {
        self.mean[1].under(factors).cap(limit_n)
    }
    /// Cap on the mean torque, per tooth.
    pub(super) fn cap_torque(&self, limit_nmm: f64, factors: &Factors) -> Cap {
        self.torque.under(factors).cap(limit_nmm)
    }
    /// Cap on the peak axial force, per tooth.
    pub(super) fn cap_axial(&self, limit_n: f64, factors: &Factors) -> Cap {
        least(self.axial(), limit_n, factors)
    }
    /// Cap on the force at the moments that leave the wall, per tooth.
    pub(super) fn cap_wall(&self, limit_n: f64, factors: &Factors) -> Cap {
        least(self.wall.iter().copied(), limit_n, factors)
    }
    /// Cap on the chip thickness, per tooth.
    pub(super) fn cap_chip(&self, limit_mm: f64, factors: &Factors) -> Cap {
        beyond_peak_feed(Affine { base: 0.0, slope: self.chip }.cap(limit_mm), factors)
    }

    /// Largest |F_xy|² in a revolution at feed per tooth `f` and edge factor `edge`, with E and B at that angle.
    fn peak_xy(&self, f: f64, edge: f64) -> (f64, C, C) {
        let mut best = (0.0, C::default(), C::default());
        let mut sizes = [0.0; 3];
        for (k, point) in self.points.iter().enumerate() {
            let e = point.edge * edge;
            let size = (e + point.cut * f).norm_sqr();
            if size > best.0 {
                best = (size, e, point.cut);
            }
            sizes = [sizes[1], sizes[2], size];
            if k < 2 || sizes[1] * NEARLY < best.0 {
                continue;
            }
            if let Some((e, b)) = between(&self.points[k - 2..=k], sizes, edge) {
                let size = (e + b * f).norm_sqr();
                if size > best.0 {
                    best = (size, e, b);
                }
            }
        }
        for span in &self.list {
            let e = span.edge * edge;
            for [b, _] in span.ends {
                let size = (e + b * f).norm_sqr();
                if size > best.0 {
                    best = (size, e, b);
                }
            }
        }
        for span in &self.list {
            let e = span.edge * edge;
            let w = span.ends.map(|[b, _]| e + b * f);
            let slopes = [dot(w[0], span.ends[0][1]), dot(w[1], span.ends[1][1])];
            if slopes[0] <= 0.0 || slopes[1] >= 0.0 {
                continue;
            }
            // Where the tangents of |w|² at both ends meet: above the peak of a concave arc.
            let reach = 2.0 * f * span.length * slopes[0].min(-slopes[1]);
            if w[0].norm_sqr().max(w[1].norm_sqr()) + reach > best.0 {
                let (size, b) = span.inner_peak(f, e, slopes);
                if size > best.0 {
                    best = (size, e, b);
                }
            }
        }
        best
    }

    /// Cap on the peak |F_xy|, per tooth.
    pub(super) fn cap_xy(&self, limit_n: f64, factors: &Factors) -> Cap {
        let edges = self.list.iter().map(|span| span.edge).chain(self.points.iter().map(|point| point.edge));
        let edge = edges.map(|edge| edge.norm_sqr()).fold(0.0, f64::max).sqrt() * factors.edge_worn();
        if edge > limit_n {
            return Cap::Unreachable;
        }
        let cuts = self.list.iter().flat_map(|span| span.ends).map(|[b, _]| b);
        let cuts = cuts.chain(self.points.iter().map(|point| point.cut));
        let steepest = cuts.map(|b| b.norm_sqr()).fold(0.0, f64::max);
        if steepest <= 0.0 {
            return Cap::Free;
        }
        let mut f = (limit_n - edge) / steepest.sqrt();
        let mut per_unit = 0.0;
        for _ in 0..30 {
            let (_, e, b) = self.peak_xy(f, factors.edge_worn());
            let half = dot(e, b);
            let root = (half * half + b.norm_sqr() * (limit_n * limit_n - e.norm_sqr()).max(0.0)).sqrt();
            let next = (root - half) / b.norm_sqr();
            per_unit = limit_n / root;
            let done = (next - f).abs() <= 1e-12 * next;
            f = next;
            if done {
                break;
            }
        }
        beyond_peak_feed(
            scaled(Cap::Feed { feed_mm_s: f, per_unit }, factors.cutting.recip(), factors.cutting.recip()),
            factors,
        )
    }
}

/// A cap on a peak, which is taken at a feed larger by `factors.peak_feed_mm`.
fn beyond_peak_feed(cap: Cap, factors: &Factors) -> Cap {
    match cap {
        Cap::Feed { feed_mm_s, per_unit } if feed_mm_s > factors.peak_feed_mm => {
            Cap::Feed { feed_mm_s: feed_mm_s - factors.peak_feed_mm, per_unit }
        }
        Cap::Feed { .. } => Cap::Unreachable,
        Cap::Free | Cap::Unreachable => cap,
    }
}

fn largest(candidates: impl Iterator<Item = Affine>, f: f64, factors: &Factors) -> f64 {
    candidates.map(|line| line.under(factors).at(f).abs()).fold(0.0, f64::max)
}

fn least(candidates: impl Iterator<Item = Affine>, limit: f64, factors: &Factors) -> Cap {
    let lowest = candidates.fold(Cap::Free, |least, line| lower(least, line.under(factors).cap(limit)));
    beyond_peak_feed(lowest, factors)
}
