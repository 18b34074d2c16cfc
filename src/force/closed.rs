//! Closed forms of steady cuts: removal rate and swept contact area from the depths alone, without simulation.
//!
//! In: diameter, flat or ball, axial depth a, radial depth b, radius of the tool-centre path, feed at the tool centre
//! f, teeth N, speed n. Out: removal rate Q in mm³/s and contact rate A in mm²/s (the area that the edges sweep over
//! material), so that cutting power is `k_tc·Q + k_te·A` (Xu, Jerard, Fussell, Eq. 3.7).
//!
//! Flat, tool radius r, straight: Q = a b f, A = a r θ N n with cos θ = 1 − b/r. On an arc of tool-centre radius ρ,
//! with s = +1 concave and −1 convex: wall radius w = ρ + s r, stock radius u = w − s b, cos θ = s(u² − ρ² − r²)/(2ρr),
//! Q = a b f (w − s b/2)/ρ. Only the side counts: the bottom face of a flat mill has no chip thickness here.
//!
//! Ball of radius R, wall at the lateral distance y₀ = R − b: a ring at depth z has radius w(z) = √(R² − (R−z)²) and is
//! engaged over acos(y₀/w), so A = N n R ∫ acos(y₀/w) dz, which integrates to the form in [`ball_contact`]; the removed
//! section is ∫ (w − y₀) dz. Above the equator the shank continues the ball as a cylinder.

use crate::machine::Shape;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A steady cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadyCut {
    /// Tool diameter, mm.
    pub diameter_mm: f64,
    /// [`Shape::Ball`], or any other shape taken as flat.
    pub shape: Shape,
    /// Axial depth, mm.
    pub axial_depth_mm: f64,
    /// Radial depth, mm; a slot is the diameter or more.
    pub radial_depth_mm: f64,
    /// Radius of the tool-centre path, mm: positive concave (material outside), negative convex; `None`: straight.
    pub path_radius_mm: Option<f64>,
    /// Feed at the tool centre, mm/s.
    pub feed_mm_s: f64,
    /// Teeth.
    pub flutes: u32,
    /// Spindle speed, rev/s.
    pub rps: f64,
}

/// What a steady cut removes and sweeps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// Volume removed, mm³/s.
    pub removal_rate_mm3_s: f64,
    /// Area swept by the edges over material, mm²/s.
    pub contact_rate_mm2_s: f64,
}

/// Removal and contact rate of a steady cut.
pub fn rates(cut: &SteadyCut) -> Rates {
    let section = if cut.shape == Shape::Ball { ball_section(cut) } else { flat_section(cut) };
    let passes_per_s = f64::from(cut.flutes) * cut.rps;
    Rates {
        removal_rate_mm3_s: section.removal_mm2 * cut.feed_mm_s,
        contact_rate_mm2_s: section.contact_mm2 * passes_per_s,
    }
}

/// Angle over which a ring of radius `r` is engaged at the radial depth `b`, rad; `path` as in [`SteadyCut`].
pub fn immersion_rad(r: f64, b: f64, path: Option<f64>) -> f64 {
    let b = b.clamp(0.0, 2.0 * r);
    let cos = match path {
        None => 1.0 - b / r,
        Some(signed) => {
            let (s, rho) = (signed.signum(), signed.abs());
            let stock = rho + s * r - s * b;
            s * (stock * stock - rho * rho - r * r) / (2.0 * rho * r)
        }
    };
    cos.clamp(-1.0, 1.0).acos()
}

/// Entry and exit angle of a cut of immersion `immersion_rad`: up-milling begins at 0, climb ends at π.
pub fn entry_exit_rad(immersion_rad: f64, climb: bool) -> (f64, f64) {
    if climb { (PI - immersion_rad, PI) } else { (0.0, immersion_rad) }
}

/// Factors of K_t, K_r, K_te, K_re in the mean force on the workpiece, x along the feed or `y` into the wall (Niu,
/// Wang, Zhao, Huang, Eqs 2–3): with k = N a_p/2π and ψ = acos(1 − a_e/R), F_x = k[f(−K_t sin²ψ/2 + K_r(ψ − sin ψ cos
/// ψ)/2) − K_te sin ψ + K_re(1 − cos ψ)], F_y = k[f(K_t(ψ − sin ψ cos ψ)/2 + K_r sin²ψ/2) + K_te(1 − cos ψ) + K_re sin
/// ψ]. In conventional milling the teeth run the other way along the same wall: the tangential factors change their
/// sign.
pub fn mean_force_factors(cut: &SteadyCut, conventional: bool, y: bool) -> [f64; 4] {
    let columns = climb_factors(cut, y);
    let turn = if conventional { -1.0 } else { 1.0 };
    [turn * columns[0], columns[1], turn * columns[2], columns[3]]
}

fn climb_factors(c: &SteadyCut, y: bool) -> [f64; 4] {
    let psi = immersion_rad(0.5 * c.diameter_mm, c.radial_depth_mm, None);
    let k = f64::from(c.flutes) * c.axial_depth_mm / TAU;
    let f = c.feed_mm_s / (f64::from(c.flutes) * c.rps);
    let (s, co) = psi.sin_cos();
    let (half, turn) = (0.5 * s * s, 0.5 * (psi - s * co));
    if y {
        [k * f * turn, k * f * half, k * (1.0 - co), k * s]
    } else {
        [-k * f * half, k * f * turn, -k * s, k * (1.0 - co)]
    }
}

/// Length of contact (mm) and largest chip thickness (mm) in a plane at `height_mm` above the tip of a ball.
pub fn ball_layer(ball_mm: f64, height_mm: f64, radial_mm: f64, feed_per_tooth_mm: f64) -> (f64, f64) {
    let below = (ball_mm - height_mm).max(0.0);
    let r = (ball_mm * ball_mm - below * below).max(0.0).sqrt();
    let alpha = immersion_rad(r, radial_mm, None);
    let fz = feed_per_tooth_mm;
    (r * alpha, r - (r * r + fz * fz - 2.0 * r * fz * alpha.sin()).max(0.0).sqrt())
}

/// Volume removed per mm of tool-centre path, and area swept by one edge in one pass.
struct Section {
    removal_mm2: f64,
    contact_mm2: f64,
}

fn flat_section(cut: &SteadyCut) -> Section {
    ring_section(cut.axial_depth_mm, 0.5 * cut.diameter_mm, cut.radial_depth_mm, cut.path_radius_mm)
}

/// A cylinder of radius `r` and height `dz` at the radial depth `b`.
fn ring_section(dz: f64, r: f64, b: f64, path: Option<f64>) -> Section {
    let b = b.clamp(0.0, 2.0 * r);
    let stretch = path.map_or(1.0, |signed| {
        let (s, rho) = (signed.signum(), signed.abs());
        (rho + s * (r - 0.5 * b)) / rho
    });
    Section { removal_mm2: dz * b * stretch, contact_mm2: dz * r * immersion_rad(r, b, path) }
}

fn ball_section(cut: &SteadyCut) -> Section {
    let ball = 0.5 * cut.diameter_mm;
    let depth = cut.axial_depth_mm.min(ball);
    let side = ring_section(cut.axial_depth_mm - depth, ball, cut.radial_depth_mm, cut.path_radius_mm);
    let wall = (ball - cut.radial_depth_mm).max(-ball);
    let part = match cut.path_radius_mm {
        None => Section {
            removal_mm2: ball_removal(ball, wall, depth),
            contact_mm2: ball * (ball_contact(ball, wall, ball) - ball_contact(ball, wall, ball - depth)),
        },
        Some(_) => ball_on_arc(ball, wall, depth, cut.path_radius_mm),
    };
    Section { removal_mm2: part.removal_mm2 + side.removal_mm2, contact_mm2: part.contact_mm2 + side.contact_mm2 }
}

/// ∫ acos(y₀/√(R²−x²)) dx from 0 to x, x being the height below the equator: by parts x acos(y₀/w) + R atan(x y₀ / (R
/// √(ρ²−x²))) − y₀ asin(x/ρ) with ρ² = R² − y₀². Below ρ the ring does not reach the wall (y₀ > 0: not engaged) or lies
/// wholly in the material (y₀ < 0: engaged over π).
pub fn ball_contact(ball: f64, wall: f64, x: f64) -> f64 {
    let rho = (ball * ball - wall * wall).max(0.0).sqrt();
    let inside = x.min(rho);
    let below = if wall < 0.0 { PI * (x - inside) } else { 0.0 };
    if rho <= 0.0 {
        return below;
    }
    let w = (ball * ball - inside * inside).max(0.0).sqrt();
    let root = (rho * rho - inside * inside).max(0.0).sqrt();
    let turn = if root > 0.0 { (inside * wall / (ball * root)).atan() } else { FRAC_PI_2.copysign(wall) };
    let engaged = if w > 0.0 { (wall / w).clamp(-1.0, 1.0).acos() } else { 0.0 };
    inside * engaged + ball * turn - wall * (inside / rho).clamp(-1.0, 1.0).asin() + below
}

/// Section of a ball of depth `depth` beyond the lateral distance `wall`: ∫ (w − max(y₀, −w)) dz.
fn ball_removal(ball: f64, wall: f64, depth: f64) -> f64 {
    // ∫ w dx = (x w + R² asin(x/R))/2
    let half_disc = |x: f64| {
        let w = (ball * ball - x * x).max(0.0).sqrt();
        0.5 * (x * w + ball * ball * (x / ball).clamp(-1.0, 1.0).asin())
    };
    let rho = (ball * ball - wall * wall).max(0.0).sqrt();
    let top = ball - depth;
    let within = rho.max(top);
    let beyond_wall = half_disc(within) - half_disc(top) - wall * (within - top);
    let full = if wall < 0.0 { 2.0 * (half_disc(ball) - half_disc(within)) } else { 0.0 };
    beyond_wall + full
}

/// A ball on a circular path, in rings of equal angle (the error of 2000 rings is below 1e-6).
fn ball_on_arc(ball: f64, wall: f64, depth: f64, path: Option<f64>) -> Section {
    const RINGS: usize = 2000;
    let end = (1.0 - depth / ball).clamp(-1.0, 1.0).acos();
    let step = end / RINGS as f64;
    let mut sum = Section { removal_mm2: 0.0, contact_mm2: 0.0 };
    for k in 0..RINGS {
        let angle = (k as f64 + 0.5) * step;
        let w = ball * angle.sin();
        let edge = ball * step;
        let b = (w - wall).clamp(0.0, 2.0 * w);
        if b > 0.0 {
            let ring = ring_section(edge, w, b, path);
            sum.removal_mm2 += ring.removal_mm2 * angle.sin();
            sum.contact_mm2 += ring.contact_mm2;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball(a: f64, b: f64, path: Option<f64>) -> Rates {
        rates(&SteadyCut {
            diameter_mm: 12.7,
            shape: Shape::Ball,
            axial_depth_mm: a,
            radial_depth_mm: b,
            path_radius_mm: path,
            feed_mm_s: 8.0,
            flutes: 2,
            rps: 35.0,
        })
    }

    #[test]
    fn a_ball_on_a_huge_circle_cuts_as_on_a_line() {
        for (a, b) in [(6.35, 12.7), (3.0, 12.7), (6.35, 3.0), (2.0, 8.0), (9.0, 1.0), (1.0, 6.0)] {
            let (line, arc) = (ball(a, b, None), ball(a, b, Some(1e9)));
            assert!((line.removal_rate_mm3_s / arc.removal_rate_mm3_s - 1.0).abs() < 2e-5, "{a} {b}: {line:?} {arc:?}");
            assert!((line.contact_rate_mm2_s / arc.contact_rate_mm2_s - 1.0).abs() < 2e-4, "{a} {b}: {line:?} {arc:?}");
        }
    }

    #[test]
    fn a_ball_slot_sweeps_the_half_sphere_of_archimedes() {
        let slot = ball(6.35, 12.7, None);
        assert!((slot.contact_rate_mm2_s - PI * 6.35 * 6.35 * 70.0).abs() < 1e-6);
        assert!((slot.removal_rate_mm3_s - 0.5 * PI * 6.35 * 6.35 * 8.0).abs() < 1e-9);
        let wall = ball(6.35, 3.175, None);
        assert!((wall.contact_rate_mm2_s - 0.5 * PI * 6.35 * 3.175 * 70.0).abs() < 1e-6);
    }
}
