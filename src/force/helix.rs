//! Forces over one period of rotation with helical edges. In: the pieces of rings that cut. Out: [`Point`]s, close enough together that every
//! peak lies between two of them or at one.
//!
//! A ring of height dz holds an edge that lags by δ = dz tan β / R from its bottom to its top. Taken at one angle, all
//! of it would enter a cut at once, and the peak of a cut only a few δ wide would be a ring's share too high. Spread
//! evenly over δ, a ring in the arc [a, b] carries
//!
//! F(θ) = (1/δ) ∫ w(φ) dφ = (W(φ₊) − W(φ₋)) / δ,  φ± = θ − s ± δ/2, each kept within [a, b],
//!
//! w being the force of the ring's edge at the immersion φ and W its integral. With w as in [`super::rings`], W = i q_e
//! e^{−iφ} + f q_c (c n_r (−iφ/2 − e^{−2iφ}/4) + i t_z n_z e^{−iφ}), so all forces between two places where an end of
//! an edge meets an end of an arc are
//!
//! E = E₀ + E₁ e^{−iθ},  B = B₀ + B₁ θ + B₂ e^{−iθ} + B₃ e^{−2iθ},
//!
//! linear in the feed per tooth f. Rings that follow each other on the side with the same arc are one longer edge. The
//! mean over a turn is that of the rings, as ∫ F dθ = ∫ w dφ.

use super::affine::{Affine, Point, Spans};
use super::means::Means;
use super::rings::{C, Ring, Rings};
use super::sweep::on_wall;
use super::zone::{Piece, floor};

/// Largest distance h between points where anything cuts, rad. A torque or axial force that varies as a sine is between two points at most
/// h²/8 (0.005 %) above them; for the force in the plane the peak between points is worked out.
pub(super) const STEP_RAD: f64 = 0.02;
/// A stretch of rotation longer than this has a point inside, rad.
const SHORT_RAD: f64 = 0.005;
/// Angles arrive rounded to f32: places closer together are one.
const SAME_RAD: f64 = 2e-6;
/// Least lag for which the edge of a ring is spread over its lag, rad. An arc of 0.1 rad, as in cuts of 0.1 mm, is 1000 times as wide, so
/// treating a smaller lag as one angle makes the peak at most 0.1 % too high.
const LEAST_LAG_RAD: f64 = 1e-4;
/// Radial part of the normal from which a ring is part of a cylindrical side.
const SIDE: f64 = 0.999;

/// Is there a ring of a cylindrical side whose edge lags along it? Only there is spreading needed: on other outlines the arcs of neighbouring
/// rings differ, which spreads their entries and exits anyway.
pub(super) fn is_spread(rings: &Rings, pieces: &[Piece]) -> bool {
    let lags = |ring: &Ring| ring.n_r > SIDE && ring.lag_width_rad > LEAST_LAG_RAD;
    pieces.iter().any(|piece| lags(&rings.list[piece.slice]))
}

/// One period of rotation.
pub(super) fn turn(rings: &Rings, pieces: &[Piece], [c, tz]: [f64; 2], mean: &Means) -> Spans {
    let mut now = (Series::default(), 0);
    let mut kinks = Vec::with_capacity(8 * rings.teeth.groups() * pieces.len().min(16));
    for run in runs(rings, pieces) {
        let terms = Terms::of(rings, &run, [c, tz]);
        for group in 0..rings.teeth.groups() {
            place(rings, &run, &terms, group, &mut now, &mut kinks);
        }
    }
    let mut order: Vec<(f64, u32)> = kinks.iter().enumerate().map(|(k, kink)| (kink.theta, k as u32)).collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let (points, wall) = walk(order.iter().map(|(_, k)| &kinks[*k as usize]), now, rings.teeth.period_rad);
    Spans { points, wall, ..mean.spans() }
}

/// Rings with one arc whose edges follow each other without a gap.
struct Run {
    piece: Piece,
    /// First and last ring.
    rings: [usize; 2],
}

fn runs(rings: &Rings, pieces: &[Piece]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for piece in pieces {
        let follows = |run: &&mut Run| {
            let (below, here) = (&rings.list[run.rings[1]], &rings.list[piece.slice]);
            run.rings[1] + 1 == piece.slice && run.piece.angle == piece.angle && below.continues_in(here)
        };
        match runs.last_mut().filter(follows) {
            Some(run) => run.rings[1] = piece.slice,
            None => runs.push(Run { piece: *piece, rings: [piece.slice; 2] }),
        }
    }
    runs
}

/// The contribution of a run while it cuts, per rad of lag.
struct Terms {
    /// −t + i p of an edge without feed, and per feed per tooth along sin φ and along the axis.
    edge: C,
    across: C,
    along: C,
    axial: [f64; 3],
    torque: [f64; 3],
    n_r: f64,
    /// Lag of the edge's first end and of its last, rad; 0 between them: it is straight.
    lags: [f64; 2],
    /// The rings there, and what turns the middle of each to its end.
    ends: [(usize, C); 2],
}

impl Terms {
    fn of(rings: &Rings, run: &Run, [c, tz]: [f64; 2]) -> Self {
        let [mut first, mut last] = run.rings;
        if rings.list[last].lag_rad < rings.list[first].lag_rad {
            (first, last) = (last, first);
        }
        let ring = &rings.list[first];
        let width = ring.lag_width_rad;
        let spread = width > LEAST_LAG_RAD;
        let (per_rad, half) =
            if spread { (width.recip(), C::from_polar(1.0, 0.5 * width)) } else { (1.0, C::new(1.0, 0.0)) };
        let shaft =
            |edge: f64, cutting: f64| [edge, cutting * ring.n_r * c, cutting * ring.n_z * tz].map(|v| v * per_rad);
        let reach = if spread { 0.5 * width } else { 0.0 };
        Self {
            edge: ring.q_e * per_rad,
            across: ring.q_c * (ring.n_r * c * per_rad),
            along: ring.q_c * (ring.n_z * tz * per_rad),
            axial: shaft(ring.axial_e, ring.axial_c),
            torque: shaft(ring.tangential_e * ring.radius_mm, ring.tangential_c * ring.radius_mm),
            n_r: ring.n_r,
            lags: [ring.lag_rad - reach, rings.list[last].lag_rad + reach],
            ends: [(first, half.conj()), (last, half)],
        }
    }
    fn is_straight(&self) -> bool {
        self.lags[0] == self.lags[1]
    }
}

/// The forces between two kinks, as coefficients; see the head of the file.
#[derive(Debug, Clone, Copy, Default)]
struct Series {
    e: [C; 2],
    b: [C; 4],
    axial: Shaft,
    torque: Shaft,
}

/// base₀ + base₁ θ + f (slope₀ + slope₁ θ + Im(sine e^{iθ})).
#[derive(Debug, Clone, Copy, Default)]
struct Shaft {
    base: [f64; 2],
    slope: [f64; 2],
    sine: C,
}

impl Shaft {
    /// ∫ of edge + f (across sin φ + along) from the immersion whose cosine is given, at θ = `theta`.
    fn integral([edge, across, along]: [f64; 3], share: f64, theta: f64, turn: C, cos: f64) -> Self {
        let (across, along) = (across * share, along * share);
        Self {
            base: [-edge * theta, edge],
            slope: [across * cos - along * theta, along],
            sine: turn.conj() * C::new(0.0, -across),
        }
    }
    /// The same where it is taken at one angle.
    fn straight([edge, across, along]: [f64; 3], share: f64, turn: C) -> Self {
        Self { base: [edge, 0.0], slope: [along * share, 0.0], sine: turn.conj() * (across * share) }
    }
    fn add(&mut self, other: &Self, by: f64) {
        for k in 0..2 {
            self.base[k] += by * other.base[k];
            self.slope[k] += by * other.slope[k];
        }
        self.sine += other.sine * by;
    }
    fn at(&self, theta: f64, turn: C) -> Affine {
        Affine {
            base: self.base[0] + self.base[1] * theta,
            slope: self.slope[0] + self.slope[1] * theta + (self.sine * turn).im,
        }
    }
}

impl Series {
    /// W(φ) − W(φ_k) of an end of an edge whose immersion is θ − s, e^{is} = `turn`; at θ = `theta` it is φ_k, e^{iφ_k}
    /// = `place`.
    fn integral(terms: &Terms, share: f64, theta: f64, turn: C, place: C) -> Self {
        let (i, back) = (C::new(0.0, 1.0), place.conj());
        let (edge, across, along) = (terms.edge * i, terms.across * share, terms.along * share * i);
        Self {
            e: [-edge * back, edge * turn],
            b: [
                across * (C::new(0.0, 0.5 * theta) + back * back * 0.25) - along * back,
                across * C::new(0.0, -0.5),
                along * turn,
                across * turn * turn * -0.25,
            ],
            axial: Shaft::integral(terms.axial, share, theta, turn, place.re),
            torque: Shaft::integral(terms.torque, share, theta, turn, place.re),
        }
    }
    /// An edge that is straight, and cuts.
    fn straight(terms: &Terms, share: f64, turn: C) -> Self {
        let half = terms.across * share * C::new(0.0, -0.5);
        Self {
            e: [C::default(), terms.edge * turn],
            b: [half, C::default(), terms.along * share * turn, -half * turn * turn],
            axial: Shaft::straight(terms.axial, share, turn),
            torque: Shaft::straight(terms.torque, share, turn),
        }
    }
    fn add(&mut self, other: &Self, by: f64) {
        for k in 0..2 {
            self.e[k] += other.e[k] * by;
        }
        for k in 0..4 {
            self.b[k] += other.b[k] * by;
        }
        self.axial.add(&other.axial, by);
        self.torque.add(&other.torque, by);
    }
    fn at(&self, theta: f64, turn: C) -> Point {
        let back = turn.conj();
        Point {
            edge: self.e[0] + self.e[1] * back,
            cut: self.b[0] + self.b[1] * theta + back * (self.b[2] + back * self.b[3]),
            axial: self.axial.at(theta, turn),
            torque: self.torque.at(theta, turn),
            is_inner: false,
        }
    }
}

/// An end of an edge meets an end of an arc.
struct Kink {
    theta: f64,
    turn: C,
    change: Series,
    /// Sign of the change.
    by: f64,
    /// By how many the edges that cut grow.
    cutting: i32,
    /// Does the force jump?
    jumps: bool,
    /// Radial part of the normal, where the edge leaves the wall.
    wall: Option<f64>,
    enters: bool,
}

/// Kinks of the teeth of a group within one period; `now` becomes what is in the cut at its beginning.
fn place(rings: &Rings, run: &Run, terms: &Terms, group: usize, now: &mut (Series, i32), kinks: &mut Vec<Kink>) {
    let (piece, period) = (&run.piece, rings.teeth.period_rad);
    // Which end of the edge meets which end of the arc, and the sign of its change: the first end comes in, and so on.
    let meets: &[(usize, usize, f64)] = if terms.is_straight() {
        &[(0, 0, 1.0), (0, 1, -1.0)]
    } else {
        &[(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)]
    };
    let at = |(end, side, _): (usize, usize, f64)| piece.angle[side] + terms.lags[end] - rings.teeth.lead_rad[group];
    let kink = |meet: (usize, usize, f64), step: i32| {
        let (end, side, by) = meet;
        let tooth = rings.teeth.index(group, step);
        let (ring, half) = terms.ends[end];
        let (place, theta) = (C::new(piece.cos[side], piece.sin[side]), at(meet) - f64::from(step) * period);
        let turn = rings.teeth_of[ring][tooth].turn * half;
        let share = rings.teeth.share[group];
        let straight = terms.is_straight();
        let change = if straight {
            Series::straight(terms, share, turn)
        } else {
            Series::integral(terms, share, theta, turn, place)
        };
        let last = side == 1 && (straight || end == 1);
        Kink {
            theta,
            turn: place * turn,
            change,
            by,
            cutting: if side == 0 && end == 0 { 1 } else { -i32::from(last) },
            jumps: straight,
            wall: on_wall(piece.angle[side], side).then_some(terms.n_r),
            enters: side == 0,
        }
    };
    let steps = |meet: (usize, usize, f64)| floor(at(meet) / period) as i32;
    for &meet in meets {
        let mut kink = kink(meet, steps(meet));
        kink.theta = kink.theta.max(0.0);
        kinks.push(kink);
    }
    let (first, last) = (steps(meets[0]), steps(meets[meets.len() - 1]));
    for step in first + 1..=last {
        for &meet in meets.iter().filter(|meet| steps(**meet) < step) {
            let before = kink(meet, step);
            now.0.add(&before.change, before.by);
        }
        now.1 += 1;
    }
}

/// From kink to kink.
fn walk<'a>(
    kinks: impl Iterator<Item = &'a Kink>,
    (mut now, mut cutting): (Series, i32),
    period: f64,
) -> (Vec<Point>, Vec<Affine>) {
    let (mut points, mut wall) = (Vec::new(), Vec::new());
    let (mut at, mut turn) = (0.0, C::new(1.0, 0.0));
    let mut jumped = true;
    let end = (period, C::from_polar(1.0, period));
    for kink in kinks.map(Some).chain([None]) {
        let (theta, there) = kink.map_or(end, |kink| (kink.theta, kink.turn));
        if theta - at > SAME_RAD {
            if cutting > 0 {
                let fewest = if theta - at > SHORT_RAD { 2.0 } else { 1.0 };
                let parts = ((theta - at) / STEP_RAD).ceil().max(fewest);
                let step = (theta - at) / parts;
                let advance = C::from_polar(1.0, step);
                if jumped {
                    points.push(now.at(at, turn));
                }
                for part in 1..parts as u32 {
                    turn *= advance;
                    points.push(Point { is_inner: true, ..now.at(at + f64::from(part) * step, turn) });
                }
                points.push(now.at(theta, there));
            }
            (at, turn, jumped) = (theta, there, cutting == 0);
        }
        let Some(kink) = kink else { break };
        if let Some(n_r) = kink.wall {
            let mut leaving = now;
            if kink.enters {
                leaving.add(&kink.change, kink.by);
            }
            let point = leaving.at(kink.theta, kink.turn);
            wall.push(Affine { base: point.edge.im, slope: point.cut.im }.scaled(n_r));
        }
        now.add(&kink.change, kink.by);
        cutting += kink.cutting;
        jumped |= kink.jumps;
    }
    (points, wall)
}
