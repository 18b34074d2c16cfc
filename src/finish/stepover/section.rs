//! Engagement of a finishing pass at one place, in the plane perpendicular to its feed. In: the tool on the surface,
//! the pass before it, the stock. Out: engaged arcs of the tool's rings, and the scallop left between the two passes.
//!
//! Axes in that plane: e₁ level, to the left of the feed; e₂ = t × e₁. The surface there is a circle of curvature κ
//! (positive concave, seen from the tool) through the point of contact c with the normal n; a point q lies above it by
//!
//! s(q) = (2 n·v − κ v²) / (1 + √(1 − 2κ n·v + κ² v²)), v = q − c.
//!
//! Stock is where s < d, the thickness along the normal left by the operation before, and where the neighbouring pass
//! did not cut. A tool with corner radius r about a bottom flat of radius a is a ball moved over a level disc. Seen
//! along a feed that rises by the angle τ the disc is an ellipse of half axes a along e₁ and b = a |sin τ| along e₂,
//! and the ball a circle. The pass leaves the parallel curve at distance r of that ellipse, open upwards (the shank
//! continues): for a ball the circle itself, for a level feed the circle widened by the flat. A point of a ring of
//! radius ρ at height z with immersion angle φ lies at ρ(cos φ e₁ + sin φ f) + z k from the tip, with f the level
//! direction of the feed; it is projected along the feed, which is exact for straight passes. Level passes may be
//! curved: with κ_t the curvature of their path, positive with its centre on the right, a point u to the left of the
//! tip and v ahead of it is as far from that centre as a point to the left by
//!
//! u' = (2 u + κ_t (u² + v²)) / (1 + √(1 + 2 κ_t u + κ_t² (u² + v²))),
//!
//! which is exact for a surface of revolution about the centre.

use super::shape::Shape;
use crate::engage::EngagedArc;
use crate::machine::Slice;
use crate::numeric::{SignChange, bisect, middle};
use crate::path::Vec3;
use std::f64::consts::{PI, TAU};

/// Number of angles on a ring at which stock is tested; between two that differ the border is found by regula falsi.
const LOOKS: usize = 17;
/// The border of the stock on a ring is known when it lies between two angles as close as this, rad: ten nanometres on a radius of 1 mm.
const BORDER_RAD: f64 = 1e-5;
/// It is known, too, where the ring is as close as this to the surface of the stock, mm.
const BORDER_MM: f64 = 1e-7;
/// Most steps of regula falsi, which needs five or six; as many halvings would leave less than 1e-9 rad.
const BORDER_STEPS: usize = 30;
/// Bisections of the component of the normal on the curve that a pass leaves: 1 to 1e-9.
const LOWER_HALVINGS: u32 = 30;

/// Surface and stock at the contact point.
#[derive(Debug, Clone, Copy)]
pub struct Ground {
    /// Point of contact, mm.
    pub contact: Vec3,
    /// Unit normal there, into the tool.
    pub normal: Vec3,
    /// Curvature of the surface across the feed, 1/mm; positive: concave.
    pub curvature_per_mm: f64,
    /// Thickness of the stock along the normal, mm.
    pub stock_mm: f64,
    /// Curvature of a level path, 1/mm; positive: centre on the right; 0 for a straight one.
    pub turn_per_mm: f64,
}

/// What lies beside this pass.
#[derive(Debug, Clone, Copy)]
pub enum Beside {
    /// A pass with its tip here.
    Pass(Vec3),
    /// The stock ends at this point; there is none on the side away from the tool.
    Edge(Vec3),
}

/// The plane perpendicular to the feed, with the tool in it.
#[derive(Debug, Clone, Copy)]
pub struct Section {
    shape: Shape,
    tip: Vec3,
    tangent: Vec3,
    across: [Vec3; 2],
    contact: [f64; 2],
    normal: [f64; 2],
    curvature: f64,
    stock_mm: f64,
    turn: f64,
    /// Half axis b of the bottom flat seen along the feed, mm.
    flat_rise_mm: f64,
    beside: Near,
}

#[derive(Debug, Clone, Copy)]
enum Near {
    /// Centre of the ball, or of the flat at the height of the corner's centre, of the neighbouring pass.
    Pass([f64; 2]),
    /// Where the stock ends, and the side (±1) without stock.
    Edge(f64, f64),
}

impl Section {
    /// The section at a tip under a feed in the unit direction `tangent`, which is not upright.
    pub fn new(shape: Shape, tip: Vec3, tangent: Vec3, ground: &Ground, beside: Beside) -> Self {
        let e1 = Vec3::new(-tangent.y, tangent.x, 0.0).normalize();
        let across = [e1, tangent.cross(&e1)];
        let flat = |p: &Vec3| across.map(|e| p.dot(&e));
        let normal = flat(&ground.normal);
        let length = normal[0].hypot(normal[1]);
        let ball = |tip: &Vec3| flat(&(tip + shape.corner_mm * Vec3::z()));
        let near = match beside {
            Beside::Pass(tip) => Near::Pass(ball(&tip)),
            Beside::Edge(at) => {
                let at = flat(&at)[0];
                Near::Edge(at, (at - flat(&tip)[0]).signum())
            }
        };
        Self {
            shape,
            tip,
            tangent,
            across,
            contact: flat(&ground.contact),
            normal: normal.map(|n| n / length),
            curvature: ground.curvature_per_mm,
            stock_mm: ground.stock_mm,
            turn: ground.turn_per_mm,
            flat_rise_mm: shape.flat_mm * tangent.z.abs(),
            beside: near,
        }
    }

    /// Height of a point of the plane above the surface, mm.
    fn above(&self, q: [f64; 2]) -> f64 {
        let v = [q[0] - self.contact[0], q[1] - self.contact[1]];
        let (along, square, k) =
            (self.normal[0] * v[0] + self.normal[1] * v[1], v[0] * v[0] + v[1] * v[1], self.curvature);
        let root = (1.0 - 2.0 * k * along + k * k * square).max(0.0).sqrt();
        (2.0 * along - k * square) / (1.0 + root)
    }

    /// Positive where the neighbouring pass did not cut.
    fn uncut(&self, q: [f64; 2]) -> f64 {
        match self.beside {
            Near::Edge(at, side) => (at - q[0]) * side,
            Near::Pass(middle) => {
                let x = q[0] - middle[0];
                if x.abs() < self.shape.radius_mm() { middle[1] + self.lower_side(x) - q[1] } else { 1.0 }
            }
        }
    }

    /// Curve that a pass leaves: height along e₂ over its centre, mm, at a distance `x` along e₁ from it, at most a +
    /// r.
    fn lower_side(&self, x: f64) -> f64 {
        let Shape { flat_mm: a, corner_mm: r } = self.shape;
        let (b, x) = (self.flat_rise_mm, x.abs().min(a + r));
        if b == 0.0 {
            let q = (x - a).max(0.0);
            return -(r * r - q * q).max(0.0).sqrt();
        }
        // With w the component of the normal along e₁ the point of the ellipse is at a² w/l along e₁ and b² √(1 − w²)/l
        // below the centre, l the distance of the centre from its tangent. x increases with w.
        let distance = |w: f64| (a * a * w * w + b * b * (1.0 - w * w)).sqrt();
        let out = |w: f64| w * (a * a / distance(w) + r);
        let w = middle(bisect(|w| out(w) <= x, 0.0, 1.0, LOWER_HALVINGS));
        -(1.0 - w * w).sqrt() * (b * b / distance(w) + r)
    }

    /// Positive in stock.
    fn stock(&self, q: [f64; 2]) -> f64 {
        let below = self.stock_mm - self.above(q);
        if below > 0.0 { below.min(self.uncut(q)) } else { below }
    }

    /// Engaged arcs of rings, sorted by ring.
    pub fn arcs(&self, rings: &[Slice]) -> Vec<EngagedArc> {
        let mut arcs = Vec::new();
        for (index, ring) in rings.iter().enumerate() {
            self.arcs_of(ring, &mut |entry, exit| {
                arcs.push(EngagedArc { slice: index as u32, entry_rad: entry as f32, exit_rad: exit as f32 });
            });
        }
        arcs
    }

    fn arcs_of(&self, ring: &Slice, put: &mut dyn FnMut(f64, f64)) {
        let Some([from, to]) = self.leading(ring) else { return };
        let level = self.tangent.x.hypot(self.tangent.y);
        let forward = Vec3::new(self.tangent.x, self.tangent.y, 0.0) / level;
        let middle = self.tip + ring.z_mm * Vec3::z();
        let flat = |p: &Vec3| self.across.map(|e| p.dot(&e));
        let (middle, forward, left) = (flat(&middle), flat(&forward), flat(&self.across[0]));
        if self.clear(middle, ring.radius_mm) {
            return;
        }
        let stock_at = |(sin, cos): (f64, f64)| {
            let (aside, ahead) = (ring.radius_mm * cos, ring.radius_mm * sin);
            let aside = if self.turn == 0.0 { aside } else { self.aside(aside, ahead) };
            let at = |k: usize| middle[k] + aside * left[k] + ahead * forward[k];
            self.stock([at(0), at(1)])
        };
        let stock = |phi: f64| stock_at(phi.sin_cos());
        let step = (to - from) / (LOOKS - 1) as f64;
        let at = |k: usize| from + step * k as f64;
        // sin and cos of the next angle by the angle between, which is the same for all.
        let (mut turned, (sin, cos)) = (from.sin_cos(), step.sin_cos());
        let (mut before, mut entry) = (stock_at(turned), None);
        if before > 0.0 {
            entry = Some(from);
        }
        for k in 1..LOOKS {
            turned = (turned.0 * cos + turned.1 * sin, turned.1 * cos - turned.0 * sin);
            let here = stock_at(turned);
            if (here > 0.0) != (before > 0.0) {
                let border = border(&stock, (at(k - 1), before), (at(k), here));
                match entry.take() {
                    Some(entry) => put(entry, border),
                    None => entry = Some(border),
                }
            }
            before = here;
        }
        if let Some(entry) = entry {
            put(entry, to);
        }
    }

    /// u' of a point u to the left (`aside`) and v `ahead` of the tip on a curved path, mm; see the head of the file.
    fn aside(&self, aside: f64, ahead: f64) -> f64 {
        let (k, square) = (self.turn, aside * aside + ahead * ahead);
        (2.0 * aside + k * square) / (1.0 + (1.0 + 2.0 * k * aside + k * k * square).max(0.0).sqrt())
    }

    /// Is a ring about `middle` above the stock everywhere? A concave surface rises by at most κ v²/2.
    fn clear(&self, middle: [f64; 2], radius_mm: f64) -> bool {
        let v = [middle[0] - self.contact[0], middle[1] - self.contact[1]];
        let nearest = self.normal[0] * v[0] + self.normal[1] * v[1] - radius_mm;
        let reach = (v[0] * v[0] + v[1] * v[1]).sqrt() + radius_mm;
        // On the inside of a curved path it comes closer by κ ρ²/2.
        let bend = 0.5 * (-self.turn).max(0.0) * radius_mm * radius_mm;
        nearest - bend - 0.5 * self.curvature.max(0.0) * reach * reach > self.stock_mm
    }

    /// Range of angles at which a ring cuts: where its normal has a component along the feed.
    fn leading(&self, ring: &Slice) -> Option<[f64; 2]> {
        let swing = self.tangent.x.hypot(self.tangent.y) * ring.normal_r;
        let base = self.tangent.z * ring.normal_z;
        if base + swing <= 1e-12 {
            return None;
        }
        if base >= swing {
            return Some([-0.5 * PI, -0.5 * PI + TAU]);
        }
        let low = (-base / swing).clamp(-1.0, 1.0).asin();
        Some([low, PI - low])
    }

    /// Height of the scallop between this pass and the neighbouring one, mm; 0 beside an edge.
    pub fn scallop_mm(&self) -> f64 {
        let Near::Pass(before) = self.beside else { return 0.0 };
        let centre = self.tip + self.shape.corner_mm * Vec3::z();
        let here = self.across.map(|e| centre.dot(&e));
        self.cusp(here, before).map_or(f64::INFINITY, |q| self.above(q).max(0.0))
    }

    /// The same where neither pass need rest on the surface; `rests`: a tip that does. Between its contact and that of the
    /// neighbouring pass the lower of the two curves is the surface left. Where they do not intersect there, one of two close
    /// passes is deeper all the way, and what is left is as high as that one, not as the intersection far beside them.
    pub fn scallop_off_mm(&self, rests: Vec3) -> f64 {
        let Near::Pass(before) = self.beside else { return 0.0 };
        let corner = self.shape.corner_mm * Vec3::z();
        let [rests, here] = [rests, self.tip].map(|tip| self.across.map(|e| (tip + corner).dot(&e)));
        let contact = |centre: [f64; 2]| [0, 1].map(|k| self.contact[k] + centre[k] - rests[k]);
        let aside = |q: [f64; 2]| self.normal[1] * q[0] - self.normal[0] * q[1];
        let ends = [contact(here), contact(before)];
        let Some(cusp) = self.cusp(here, before) else { return f64::INFINITY };
        let is_between = (aside(cusp) - aside(ends[0])) * (aside(cusp) - aside(ends[1])) <= 0.0;
        let left = if is_between {
            self.above(cusp)
        } else {
            ends.map(|end| self.above(end)).into_iter().fold(f64::INFINITY, f64::min)
        };
        left.max(0.0)
    }

    /// Heights along its normal of a point of the surface below this pass and below the neighbouring one, mm; neither need rest on the surface.
    pub fn left_mm(&self, point: Vec3, normal: Vec3) -> [f64; 2] {
        let flat = |p: &Vec3| self.across.map(|e| p.dot(&e));
        let (q, n) = (flat(&point), flat(&normal));
        let n = n.map(|x| x / n[0].hypot(n[1]).max(f64::MIN_POSITIVE));
        let here = self.below_mm(flat(&(self.tip + self.shape.corner_mm * Vec3::z())), q, n);
        let before = if let Near::Pass(before) = self.beside { self.below_mm(before, q, n) } else { f64::INFINITY };
        [here, before]
    }

    /// How far a point has to go along `n` to come to a pass, mm; infinite if that is more than the corner radius.
    fn below_mm(&self, middle: [f64; 2], q: [f64; 2], n: [f64; 2]) -> f64 {
        let r = self.shape.corner_mm;
        let from = [0, 1].map(|k| q[k] - middle[k]);
        if self.shape.flat_mm == 0.0 {
            let (ahead, square) = (-(from[0] * n[0] + from[1] * n[1]), from[0] * from[0] + from[1] * from[1]);
            let root = ahead * ahead - square + r * r;
            return if root < 0.0 { f64::INFINITY } else { ahead - root.sqrt() };
        }
        let is_below = |by: f64| {
            let [x, z] = [0, 1].map(|k| from[k] + by * n[k]);
            x.abs() >= self.shape.radius_mm() || z < self.lower_side(x)
        };
        match [0.0, r].map(is_below) {
            [false, _] => 0.0,
            [true, true] => f64::INFINITY,
            [true, false] => middle_of(is_below, r),
        }
    }

    /// Where the curves of the two passes intersect.
    fn cusp(&self, here: [f64; 2], before: [f64; 2]) -> Option<[f64; 2]> {
        if self.shape.flat_mm > 0.0 { self.widened_cusp(here, before) } else { self.ball_cusp(here, before) }
    }

    /// Where the two circles of a ball intersect, on the side of the surface.
    fn ball_cusp(&self, here: [f64; 2], before: [f64; 2]) -> Option<[f64; 2]> {
        let (dx, dy) = (before[0] - here[0], before[1] - here[1]);
        let apart = dx.hypot(dy);
        let r = self.shape.corner_mm;
        if apart >= 2.0 * r {
            return None;
        }
        if apart < 1e-9 {
            return Some([here[0] - r * self.normal[0], here[1] - r * self.normal[1]]);
        }
        let (down, half) = ((r * r - 0.25 * apart * apart).sqrt(), 0.5);
        let side = [-dy / apart, dx / apart];
        // Of the two intersections the one towards the surface.
        let sign = if side[0] * self.normal[0] + side[1] * self.normal[1] > 0.0 { -1.0 } else { 1.0 };
        Some([here[0] + half * dx + sign * down * side[0], here[1] + half * dy + sign * down * side[1]])
    }

    /// Where the curves of two passes of a bull-nose end intersect. The difference of two equal convex curves side by
    /// side is monotonic, so it is zero at most once; if one is below the other over their whole overlap, the
    /// intersection is with its side wall.
    fn widened_cusp(&self, here: [f64; 2], before: [f64; 2]) -> Option<[f64; 2]> {
        let (left, right) = if here[0] < before[0] { (here, before) } else { (before, here) };
        let reach = self.shape.radius_mm();
        let (from, to) = (right[0] - reach, left[0] + reach);
        if from >= to {
            return None;
        }
        let left_z = |x: f64| left[1] + self.lower_side(x - left[0]);
        let right_z = |x: f64| right[1] + self.lower_side(x - right[0]);
        let right_higher = |x: f64| right_z(x) > left_z(x);
        let (x, z) = if !right_higher(from) {
            (from, left_z(from))
        } else if right_higher(to) {
            (to, right_z(to))
        } else {
            let x = middle(bisect(right_higher, from, to, 40));
            (x, left_z(x))
        };
        Some([x, z])
    }
}

/// Where a condition ceases to hold between 0 and `to`.
fn middle_of(holds: impl Fn(f64) -> bool, to: f64) -> f64 {
    middle(bisect(holds, 0.0, to, LOWER_HALVINGS))
}

/// Where the sign of a function changes between two angles.
fn border(of: &dyn Fn(f64) -> f64, from: (f64, f64), to: (f64, f64)) -> f64 {
    let (negative, positive) = if from.1 > 0.0 { (to, from) } else { (from, to) };
    let mut between = SignChange::new(negative, positive);
    for _ in 0..BORDER_STEPS {
        let at = between.next();
        let value = of(at);
        between.narrow(at, value);
        if value.abs() <= BORDER_MM || between.width() <= BORDER_RAD {
            return at;
        }
    }
    between.next()
}

/// Scallop height, mm, between two passes of a ball of radius r whose centres are p = `apart_mm` apart, on a surface
/// with curvature κ across the passes (positive concave), in closed form: with ρ = 1/κ, h = ρ − √((ρ − r)² − (p/2)²) −
/// √(r² − (p/2)²); on a plane h = r − √(r² − (p/2)²).
#[cfg(feature = "rooms")]
pub fn ball_scallop_mm(r: f64, curvature_per_mm: f64, apart_mm: f64) -> f64 {
    let half = 0.5 * apart_mm;
    let down = (r * r - half * half).max(0.0).sqrt();
    if curvature_per_mm == 0.0 {
        return r - down;
    }
    let rho = curvature_per_mm.recip();
    let to_middle = ((rho - r) * (rho - r) - half * half).max(0.0).sqrt() * rho.signum();
    rho - to_middle - down
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a plane between two passes, one of them off it, against circles: a ball, and a bull-nose end whose flats part.
    #[test]
    fn heights_below_passes_are_those_of_circles() {
        let (r, off, ground) = (3.0, 0.002, plane(0.0, 0.0));
        let left = |shape: Shape, step: f64, [here, before]: [f64; 2], y: f64| {
            let (tip, beside) = (Vec3::new(0.0, 0.0, here), Beside::Pass(Vec3::new(0.0, -step, before)));
            let section = Section::new(shape, tip, Vec3::x(), &ground, beside);
            section.left_mm(Vec3::new(0.0, y, 0.0), Vec3::z()).into_iter().fold(f64::INFINITY, f64::min)
        };
        let circle = |from: f64, r: f64| r - (r * r - from * from).sqrt();
        for y in [-0.4, -0.3, -0.2, -0.1, 0.0] {
            let expected = f64::min(circle(y, r) + off, circle(y + 0.4, r));
            assert!((left(Shape::ball(r), 0.4, [off, 0.0], y) - expected).abs() < 1e-12, "{y}");
            let bull = Shape { flat_mm: 1.0, corner_mm: 2.0 };
            let expected = f64::min(circle((-y - 1.0).max(0.0), 2.0) + off, circle((y + 2.4 - 1.0).max(0.0), 2.0));
            assert!((left(bull, 2.4, [off, 0.0], y) - expected).abs() < 1e-8, "{y}");
        }
        assert!(left(Shape::ball(r), 6.1, [0.0; 2], -3.05).is_infinite());
        assert!(left(Shape { flat_mm: 1.0, corner_mm: 2.0 }, 6.1, [0.0; 2], -3.05).is_infinite());
    }

    /// Passes on a plane, one of them off it: the closed form of two circles; close together what the deeper one leaves.
    #[test]
    fn scallops_of_passes_off_the_surface_are_those_between_them() {
        let (r, off, ground) = (3.0, 0.002, plane(0.0, 0.0));
        let scallop = |shape: Shape, step: f64, [here, before]: [f64; 2]| {
            let (tip, beside) = (Vec3::new(0.0, 0.0, here), Beside::Pass(Vec3::new(0.0, -step, before)));
            Section::new(shape, tip, Vec3::x(), &ground, beside).scallop_off_mm(Vec3::zeros())
        };
        let ball = Shape::ball(r);
        let step = 0.4;
        let apart = f64::hypot(step, off);
        let expected = r + 0.5 * off - (r * r - 0.25 * apart * apart).sqrt() * step / apart;
        for heights in [[off, 0.0], [0.0, off]] {
            assert!((scallop(ball, step, heights) - expected).abs() < 1e-9, "{heights:?}");
        }
        for shape in [ball, Shape { flat_mm: 1.5, corner_mm: 1.5 }] {
            assert!((scallop(shape, 0.003, [off, 0.0])).abs() < 1e-12, "{shape:?}");
            assert!((scallop(shape, 0.003, [2.0 * off, off]) - off).abs() < 1e-9, "{shape:?}");
        }
        assert!(scallop(ball, 6.1, [0.0; 2]).is_infinite());
    }

    fn plane(slope_rad: f64, curvature_per_mm: f64) -> Ground {
        let normal = Vec3::new(0.0, -slope_rad.sin(), slope_rad.cos());
        Ground { contact: Vec3::zeros(), normal, curvature_per_mm, stock_mm: 0.1, turn_per_mm: 0.0 }
    }

    /// Scallops of a ball on slopes, in hollows and on crowns, against the closed form.
    #[test]
    fn scallops_of_a_ball_are_those_of_the_closed_form() {
        let r = 3.0;
        for slope_deg in [0.0f64, 20.0, 60.0, 80.0] {
            for curvature in [0.0, 0.05, -0.05, 0.2, -0.2] {
                let (sin, cos) = slope_deg.to_radians().sin_cos();
                let ground = plane(slope_deg.to_radians(), curvature);
                let middle = ground.normal * r;
                // The ball centre of the adjacent pass on the parallel curve, one turn of 0.1 rad or 0.4 mm away.
                let uphill = Vec3::new(0.0, cos, sin);
                let before = if curvature == 0.0 {
                    middle - 0.4 * uphill
                } else {
                    let rho = 1.0 / curvature;
                    let (s, c) = (0.4f64 / (rho - r)).sin_cos();
                    ground.normal * rho - (rho - r) * (ground.normal * c + uphill * s)
                };
                let tip = |middle: Vec3| middle - r * Vec3::z();
                let section = Section::new(Shape::ball(r), tip(middle), Vec3::x(), &ground, Beside::Pass(tip(before)));
                let expected = ball_scallop_mm(r, curvature, (middle - before).norm());
                let found = section.scallop_mm();
                assert!((found - expected).abs() < 1e-9, "{slope_deg} {curvature}: {found} {expected}");
            }
        }
    }

    /// On a floor a bull-nose end leaves a scallop only if the flats of adjacent passes do not overlap.
    #[test]
    fn a_bull_nose_leaves_no_scallop_on_a_floor_until_its_flats_part() {
        let shape = Shape { flat_mm: 2.0, corner_mm: 1.0 };
        let ground = plane(0.0, 0.0);
        let at = |y: f64| {
            Section::new(shape, Vec3::zeros(), Vec3::x(), &ground, Beside::Pass(Vec3::new(0.0, -y, 0.0))).scallop_mm()
        };
        assert!(at(3.9) < 1e-9);
        assert!((at(4.6) - (1.0 - (1.0f64 - 0.09).sqrt())).abs() < 1e-9);
        assert!(at(6.1).is_infinite());
    }

    /// A level slot in stock of 0.1 mm over a floor: a ring at z meets stock on its whole leading half while z < 0.1
    /// mm.
    #[test]
    fn a_slot_engages_the_leading_half_of_the_rings_below_the_stock() {
        let ground = plane(0.0, 0.0);
        let far = Beside::Edge(Vec3::new(0.0, -10.0, 0.0));
        let section = Section::new(Shape::ball(3.0), Vec3::zeros(), Vec3::x(), &ground, far);
        let rings = crate::machine::Profile::ball(6.0, 6.0).slices(0.02);
        let arcs = section.arcs(&rings);
        let below = rings.iter().filter(|ring| ring.z_mm < 0.1).count();
        assert_eq!(arcs.len(), below);
        let whole = |arc: &&EngagedArc| arc.entry_rad.abs() < 1e-5 && (f64::from(arc.exit_rad) - PI).abs() < 1e-5;
        assert_eq!(arcs.iter().filter(whole).count(), below);
    }

    /// Points of a circle about the centre of a bent path, on its right and on its left, come to lie beside the tip
    /// where the circle crosses the line across the feed.
    #[test]
    fn a_point_ahead_on_a_bent_path_is_brought_back_along_its_circle() {
        for radius in [7.0, -7.0] {
            let ground = Ground { turn_per_mm: 1.0 / radius, ..plane(0.5, 0.0) };
            let section = Section::new(Shape::ball(3.0), Vec3::zeros(), Vec3::x(), &ground, Beside::Edge(Vec3::y()));
            for (aside, angle) in [(0.5, 0.2f64), (-1.0, -0.3), (2.0, 0.0)] {
                let (sin, cos) = angle.sin_cos();
                let (left, ahead) = ((radius + aside) * cos - radius, (radius + aside) * sin);
                assert!((section.aside(left, ahead) - aside).abs() < 1e-12, "{radius} {aside}");
            }
        }
    }
}
