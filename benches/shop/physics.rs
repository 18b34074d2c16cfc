//! Forces of the teeth and the power they take: tooth by tooth, from the chip that the tooth before has left.
//!
//! In: what stands along the rim, feed and speed, the coefficients and what changes them. Out: power at the tool, W.
//!
//! On each element of edge of height dz the tangential force is dF_t = (k_tc h + k_te) dz (linear edge model; Altintas,
//! Manufacturing Automation, section 2.7). One turn of a tooth at φ, averaged over N teeth, takes
//! P = N/(2π) ω R ∫ dφ ∫ dz (k_tc h(φ) + k_te). The helix shifts when a slice cuts, not how much: it drops out of the
//! mean. A full slot of depth a is the closed form: ∫ h dφ = 2 f_z, so P = k_tc·MRR + k_te·N a ω R / 2.

use super::engagement::{RIM, rim_angle};

/// A flat end mill as the shop knows it.
#[derive(Clone, Copy, Debug)]
pub struct Tool {
    pub number: usize,
    pub diameter_mm: f64,
    pub flutes: usize,
    pub helix_deg: f64,
}

/// Tangential coefficients of a material, N/mm² and N/mm, and radial over tangential ones.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::struct_field_names)]
pub struct Coefficients {
    pub k_tc: f64,
    pub k_te: f64,
    pub k_rc: f64,
    pub k_re: f64,
}

/// Where the machine is, and what the tool has behind it: what hidden causes may depend on.
#[derive(Clone, Copy, Debug, Default)]
pub struct Station {
    pub time_s: f64,
    pub place: [f64; 3],
    /// Unit vector of the feed in the plane.
    pub along: [f64; 2],
    pub speed_mm_s: f64,
    pub acceleration_mm_s2: f64,
    pub rpm: f64,
    pub tool: usize,
    pub radius_mm: f64,
    pub flutes: usize,
    pub pass: usize,
    /// Way that each tooth has slid in material since its edge was fresh, m.
    pub slid_m: f64,
    pub since_entry_mm: f64,
    /// Greatest depth along the rim, mm.
    pub depth_mm: f64,
    /// Arc of the rim in contact, deg.
    pub immersion_deg: f64,
}

/// One piece of edge in the cut.
#[derive(Clone, Copy, Debug)]
pub struct Element {
    /// From the left of the feed, rad; below π/2 the chip thickens (up), above it thins (climb).
    pub phi: f64,
    /// Height above the tip, mm.
    pub above_tip_mm: f64,
    pub chip_mm: f64,
    pub place: [f64; 3],
}

/// Factors on cutting and edge coefficients.
pub type Factors = [f64; 2];
/// What an element's coefficients are multiplied by.
pub type OnElement = Box<dyn Fn(&Station, &Element) -> Factors>;

/// Runout of the tool: its axis beside that of the spindle, mm and rad.
#[derive(Clone, Copy, Debug, Default)]
pub struct Runout {
    pub offset_mm: f64,
    pub angle: f64,
}

/// Thickness of the chip at φ, mm: from the rim inwards to the circle that the tooth before has cut, one feed per tooth
/// behind. With the feed along +y of the tool's frame that is R + f sin φ − sqrt(R² − f² cos² φ).
pub fn chip_thickness(feed_per_tooth_mm: f64, radius_mm: f64, phi: f64) -> f64 {
    let (sin, cos) = phi.sin_cos();
    let across = feed_per_tooth_mm * cos;
    radius_mm + feed_per_tooth_mm * sin - (radius_mm * radius_mm - across * across).max(0.0).sqrt()
}

/// Chips of the teeth of a tool that runs out: tooth j cuts what the deepest of the teeth before has left,
/// h_j = min over m of (m f sin φ + R_j − R_{j−m}), and nothing below zero (Kline, DeVor 1983).
fn chips_with_runout(feed_mm: f64, at: &Station, phi: f64, runout: Runout, out: &mut Vec<f64>) {
    let n = at.flutes;
    let radius = |j: usize| runout.offset_mm * (runout.angle - std::f64::consts::TAU * j as f64 / n as f64).cos();
    out.clear();
    for j in 0..n {
        let left = (1..=n).map(|m| m as f64 * feed_mm * phi.sin() + radius(j) - radius((j + n - m) % n));
        out.push(left.fold(f64::INFINITY, f64::min).max(0.0));
    }
}

/// Power of cutting and of the edges, W, for the heights along the rim. Slices of at most `slice_mm` along the axis.
pub fn power(
    at: &Station,
    depth: &[f64; RIM],
    k: &Coefficients,
    runout: Runout,
    weights: &[OnElement],
    slice_mm: f64,
) -> [f64; 2] {
    let turns_per_s = at.rpm / 60.0;
    if at.speed_mm_s < 1e-6 || turns_per_s <= 0.0 {
        return [0.0; 2];
    }
    let feed_mm = at.speed_mm_s / (turns_per_s * at.flutes as f64);
    // N/(2π) · ω R · dφ = N n R dφ, and N·mm/s to W.
    let per_edge = at.flutes as f64 * turns_per_s * at.radius_mm * (std::f64::consts::PI / RIM as f64) / 1000.0;
    let right = [at.along[1], -at.along[0]];
    let (mut cutting, mut edge) = (0.0, 0.0);
    let mut chips = Vec::with_capacity(at.flutes);
    for (i, height) in depth.iter().enumerate().filter(|(_, height)| **height > 1e-4) {
        let phi = rim_angle(i);
        let nominal = chip_thickness(feed_mm, at.radius_mm, phi);
        let (chip, in_cut) = if runout.offset_mm == 0.0 {
            (nominal, 1.0)
        } else {
            chips_with_runout(feed_mm, at, phi, runout, &mut chips);
            let cutting = chips.iter().filter(|h| **h > 0.0).count();
            (chips.iter().sum::<f64>() / at.flutes as f64, cutting as f64 / at.flutes as f64)
        };
        if weights.is_empty() {
            cutting += height * chip;
            edge += height * in_cut;
            continue;
        }
        let (sin, cos) = phi.sin_cos();
        let place = |axis: usize| at.place[axis] + at.radius_mm * (sin * at.along[axis] - cos * right[axis]);
        let slices = (height / slice_mm).ceil() as usize;
        let dz = height / slices as f64;
        for slice in 0..slices {
            let above = (slice as f64 + 0.5) * dz;
            let place = [place(0), place(1), at.place[2] + above];
            let element = Element { phi, above_tip_mm: above, chip_mm: chip, place };
            let mut factors = [1.0; 2];
            for weight in weights {
                let more = weight(at, &element);
                factors = [factors[0] * more[0], factors[1] * more[1]];
            }
            cutting += dz * chip * factors[0];
            edge += dz * in_cut * factors[1];
        }
    }
    [k.k_tc * cutting * per_edge, k.k_te * edge * per_edge]
}

/// Steps of the angle in a turn, and height of a slice of the helix, mm, for peak forces.
const TURN_STEPS: usize = 72;
const HELIX_SLICE: f64 = 0.5;

/// Largest force in the plane of the feed over one turn of the spindle, N. A slice at height z of tooth j stands at
/// φ = θ + 2π j/N − z tan β/R; where material stands there it gives (k_tc h + k_te) dz along the cut and (k_rc h + k_re) dz
/// towards the axis.
pub fn peak_force(at: &Station, depth: &[f64; RIM], k: &Coefficients, runout: Runout, helix_deg: f64) -> f64 {
    let turns_per_s = at.rpm / 60.0;
    if at.speed_mm_s < 1e-6 || turns_per_s <= 0.0 || at.depth_mm < 1e-3 {
        return 0.0;
    }
    let feed_mm = at.speed_mm_s / (turns_per_s * at.flutes as f64);
    let lag = helix_deg.to_radians().tan() / at.radius_mm;
    let slices = (at.depth_mm / HELIX_SLICE).ceil() as usize;
    let dz = at.depth_mm / slices as f64;
    let mut chips = Vec::with_capacity(at.flutes);
    let mut largest: f64 = 0.0;
    for turn in 0..TURN_STEPS {
        let theta = std::f64::consts::TAU * turn as f64 / TURN_STEPS as f64;
        let mut force = [0.0; 2];
        for tooth in 0..at.flutes {
            for slice in 0..slices {
                let z = (slice as f64 + 0.5) * dz;
                let pitch = std::f64::consts::TAU * tooth as f64 / at.flutes as f64;
                let phi = (theta + pitch - z * lag).rem_euclid(std::f64::consts::TAU);
                if phi >= std::f64::consts::PI || depth[(phi / std::f64::consts::PI * RIM as f64) as usize] < z {
                    continue;
                }
                chips_with_runout(feed_mm, at, phi, runout, &mut chips);
                let chip = chips[tooth];
                if chip <= 0.0 {
                    continue;
                }
                let (along, inward) = ((k.k_tc * chip + k.k_te) * dz, (k.k_rc * chip + k.k_re) * dz);
                let (sin, cos) = phi.sin_cos();
                force[0] += along * cos + inward * sin;
                force[1] += inward * cos - along * sin;
            }
        }
        largest = largest.max(force[0].hypot(force[1]));
    }
    largest
}

/// Power of the end face where the tool goes down, W: every piece of end edge under material takes k_tc times the
/// downward feed per tooth plus k_te, at speed ω r. Over an area A: P = N ω/(2π) A (k_tc f_down + k_te).
pub fn end_face_power(at: &Station, area_mm2: f64, down_mm_s: f64, k: &Coefficients) -> [f64; 2] {
    let teeth_per_s = at.flutes as f64 * at.rpm / 60.0;
    if teeth_per_s <= 0.0 {
        return [0.0; 2];
    }
    [k.k_tc * area_mm2 * down_mm_s / 1000.0, k.k_te * teeth_per_s * area_mm2 / 1000.0]
}
