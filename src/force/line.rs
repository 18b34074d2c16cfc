//! All loads of one station as functions of feed, for models whose forces are affine in feed.
//!
//! While the same teeth cut, the force in the plane, seen from the turning tool, is E + f B(θ) with
//! B(θ) = C₀ e^{iθ} + C₁ + C₂ e^{−iθ} (see [`super::rings`]): the edge part stands still and the cutting part runs on an
//! ellipse. A peak is the largest |E + f B| over the spans between entries and exits: at an end of a span or where the
//! derivative Re((E + f B)* B′) vanishes, found by Newton's method inside the few spans that can hold it. At each angle
//! |E + f B| = L is a quadratic in f; the peak is a maximum of convex functions, so the cap is the least root, found
//! from below by solving the quadratic at the angle that is worst at the last feed.

use super::loads::{Cap, Loads};
use super::rings::{C, Sums};
use crate::machine::LimitKind;
use crate::units::{n_mm_s_from_watts, nm_from_nmm, watts_from_n_mm_s};
use std::f64::consts::TAU;

/// A feed per tooth, mm, beyond any: a cap above it only shows forces that cancel but for rounding.
const BEYOND_MM: f64 = 1e4;

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
    pub(super) fn scaled(self, by: f64) -> Self {
        Self { base: self.base * by, slope: self.slope * by }
    }
    /// Feed per tooth up to which the magnitude stays below `limit`.
    fn cap(self, limit: f64) -> Cap {
        if self.base.abs() > limit * (1.0 + 1e-12) {
            return Cap::Unreachable;
        }
        // A slope lost in the rounding of the edge force is none.
        if self.slope.abs() <= 1e-12 * self.base.abs() {
            return Cap::Free;
        }
        let bound = limit.copysign(self.slope);
        Cap::Feed { feed_mm_s: (bound - self.base) / self.slope, per_unit: self.slope.abs().recip() }
    }
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
    fn inner_peak(&self, f: f64, slopes: [f64; 2]) -> (f64, C) {
        let (mut lo, mut hi) = (0.0, self.length);
        let mut x = self.length * slopes[0] / (slopes[0] - slopes[1]);
        let mut best = (0.0, C::default());
        for _ in 0..20 {
            let turn = self.start * C::from_polar(1.0, x);
            let [b, slope] = ellipse(turn, self.c0, self.c1, self.c2);
            let w = self.edge + b * f;
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
        high = s.norm();
    } else if a.re < 0.0 && b.re > 0.0 {
        low = -s.norm();
    }
    [base + low, base + high]
}

fn dot(a: C, b: C) -> f64 {
    a.re * b.re + a.im * b.im
}

/// Everything at one station; see the head of the file. Feeds inside are mm per tooth.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LoadLine {
    pub(super) spans: Vec<Span>,
    /// Mean force along x, y, z.
    pub(super) mean: [Affine; 3],
    /// Mean torque, N·mm.
    pub(super) torque: Affine,
    /// Normal force at the moments that leave the wall, times the radial part of the wall's normal.
    pub(super) wall: Vec<Affine>,
    /// Chip thickness per feed per tooth.
    pub(super) chip: f64,
    /// Revolutions per second.
    pub(super) rps: f64,
    /// Feed per tooth / feed, s.
    pub(super) per_feed: f64,
    /// Tare, W.
    pub(super) tare_w: f64,
    /// Tip deflection and bending stress per N.
    pub(super) compliance: [f64; 2],
    /// Volume removed per mm of path, mm², as the engaged arcs say.
    pub removal_area_mm2: f64,
    /// Area swept over material by all edges in one revolution, mm².
    pub contact_mm2_per_rev: f64,
}

impl LoadLine {
    /// Loads at a feed.
    pub fn loads(&self, feed_mm_s: f64) -> Loads {
        let f = feed_mm_s * self.per_feed;
        let peak = self.peak_xy(f).0.sqrt();
        let mean = self.mean.map(|component| component.at(f));
        Loads {
            force_xy_peak_n: peak,
            force_xy_mean_n: mean[0].hypot(mean[1]),
            force_normal_mean_n: mean[1].abs(),
            force_axial_peak_n: largest(self.spans.iter().flat_map(|span| span.axial), f),
            torque_nm: nm_from_nmm(self.torque.at(f)),
            torque_peak_nm: nm_from_nmm(largest(self.spans.iter().map(|span| span.torque), f)),
            power_w: self.tare_w + watts_from_n_mm_s(TAU * self.rps * self.torque.at(f)),
            deflection_mm: self.compliance[0] * peak,
            surface_error_mm: self.compliance[0] * largest(self.wall.iter().copied(), f),
            bending_stress_mpa: self.compliance[1] * peak,
            chip_thickness_max_mm: self.chip * f,
            feed_per_tooth_mm: f,
            mean_force_n: mean,
        }
    }

    /// Largest feed below which a load stays within `limit`, in the unit of [`crate::machine::Limits`]; kinds that are no
    /// loads are free.
    pub fn cap(&self, kind: LimitKind, limit: f64) -> Cap {
        let per_tooth = match kind {
            LimitKind::ForceXy => self.cap_xy(limit, 1.0),
            LimitKind::ForceNormalMean => self.mean[1].cap(limit),
            LimitKind::ForceAxial => least(self.spans.iter().flat_map(|span| span.axial), limit),
            LimitKind::Power => self.cap_power(limit),
            LimitKind::Torque => self.torque.cap(limit),
            LimitKind::Deflection => self.cap_xy(limit, self.compliance[0]),
            LimitKind::SurfaceError => {
                scaled(least(self.wall.iter().copied(), limit / self.compliance[0]), 1.0, self.compliance[0].recip())
            }
            LimitKind::BendingStress => self.cap_xy(limit, self.compliance[1]),
            LimitKind::ChipThickness => Affine { base: 0.0, slope: self.chip }.cap(limit),
            LimitKind::FeedPerTooth => Affine { base: 0.0, slope: 1.0 }.cap(limit),
            _ => Cap::Free,
        };
        match per_tooth {
            Cap::Feed { feed_mm_s, .. } if feed_mm_s > BEYOND_MM => Cap::Free,
            cap => scaled(cap, 1.0 / self.per_feed, 1.0 / self.per_feed),
        }
    }

    /// Largest |F_xy|² in a revolution at feed per tooth `f`, with E and B at that angle.
    fn peak_xy(&self, f: f64) -> (f64, C, C) {
        let mut best = (0.0, C::default(), C::default());
        for span in &self.spans {
            for [b, _] in span.ends {
                let size = (span.edge + b * f).norm_sqr();
                if size > best.0 {
                    best = (size, span.edge, b);
                }
            }
        }
        for span in &self.spans {
            let w = span.ends.map(|[b, _]| span.edge + b * f);
            let slopes = [dot(w[0], span.ends[0][1]), dot(w[1], span.ends[1][1])];
            if slopes[0] <= 0.0 || slopes[1] >= 0.0 {
                continue;
            }
            // Where the tangents of |w|² at both ends meet: above the peak of a concave arc.
            let reach = 2.0 * f * span.length * slopes[0].min(-slopes[1]);
            if w[0].norm_sqr().max(w[1].norm_sqr()) + reach > best.0 {
                let (size, b) = span.inner_peak(f, slopes);
                if size > best.0 {
                    best = (size, span.edge, b);
                }
            }
        }
        best
    }

    /// Cap on factor·|F_xy| ≤ limit, per tooth.
    fn cap_xy(&self, limit: f64, factor: f64) -> Cap {
        let limit_n = limit / factor;
        let edge = self.spans.iter().map(|span| span.edge.norm_sqr()).fold(0.0, f64::max).sqrt();
        if edge > limit_n {
            return Cap::Unreachable;
        }
        let steepest = self.spans.iter().flat_map(|span| span.ends).map(|[b, _]| b.norm_sqr()).fold(0.0, f64::max);
        if steepest <= 0.0 {
            return Cap::Free;
        }
        let mut f = (limit_n - edge) / steepest.sqrt();
        let mut per_unit = 0.0;
        for _ in 0..30 {
            let (_, e, b) = self.peak_xy(f);
            let half = dot(e, b);
            let root = (half * half + b.norm_sqr() * (limit_n * limit_n - e.norm_sqr()).max(0.0)).sqrt();
            let next = (root - half) / b.norm_sqr();
            per_unit = limit_n / (root * factor);
            let done = (next - f).abs() <= 1e-12 * next;
            f = next;
            if done {
                break;
            }
        }
        Cap::Feed { feed_mm_s: f, per_unit }
    }

    fn cap_power(&self, limit_w: f64) -> Cap {
        if limit_w < self.tare_w {
            return Cap::Unreachable;
        }
        let torque_nmm = n_mm_s_from_watts(limit_w - self.tare_w) / (TAU * self.rps);
        scaled(self.torque.cap(torque_nmm), 1.0, n_mm_s_from_watts(1.0) / (TAU * self.rps))
    }
}

fn largest(candidates: impl Iterator<Item = Affine>, f: f64) -> f64 {
    candidates.map(|line| line.at(f).abs()).fold(0.0, f64::max)
}

fn least(candidates: impl Iterator<Item = Affine>, limit: f64) -> Cap {
    let mut least = Cap::Free;
    for line in candidates {
        least = lower(least, line.cap(limit));
    }
    least
}

fn lower(a: Cap, b: Cap) -> Cap {
    match (a, b) {
        (Cap::Unreachable, _) | (_, Cap::Unreachable) => Cap::Unreachable,
        (Cap::Free, other) | (other, Cap::Free) => other,
        (Cap::Feed { feed_mm_s: x, .. }, Cap::Feed { feed_mm_s: y, .. }) => {
            if x <= y {
                a
            } else {
                b
            }
        }
    }
}

/// A cap whose feed is multiplied by `feed` and whose limit is divided by `limit`.
fn scaled(cap: Cap, feed: f64, limit: f64) -> Cap {
    match cap {
        Cap::Feed { feed_mm_s, per_unit } => Cap::Feed { feed_mm_s: feed_mm_s * feed, per_unit: per_unit * limit },
        other => other,
    }
}
