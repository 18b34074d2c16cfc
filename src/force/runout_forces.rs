//! Forces of a cutter with runout through a turn, coefficient by coefficient. In: tool, rings, engaged arcs, feed,
//! runout. Out: [`Turn`], from which the peak at any coefficients, its derivatives and the contact that teeth miss are
//! read.
//!
//! Frame and signs are those of [`crate::force`]: tooth i is at φ = θ − ψ_i − lag(z), stands R_i = ρ cos(α − ψ_i)
//! further out and cuts h = min over m of (feed of the last m teeth)·g + (R_i − R_{i−m}) n_r, g = c n_r sin φ + t_z
//! n_z. With w = F_x + i F_y an edge of length du takes −(k_t + i n_r k_r − i n_z k_a) e^{−iφ} du, k = k_c h + k_e
//! where h > 0. The edge on a layer of equal arcs lags from its bottom to its top: what it takes there is an integral
//! over φ, read off cumulated sums.

use crate::engage::EngagedArc;
use crate::machine::material::LinearEdge;
use crate::machine::{Runout, Slice, Tool};
use nalgebra::Complex;
use std::f64::consts::TAU;

type C = Complex<f64>;

/// Angles of a turn.
const ANGLES: usize = 720;
/// Step of the sums over an arc, rad.
const STEP_RAD: f64 = 0.012;
/// Arcs of neighbouring rings are one layer if they end within this, rad.
const SAME_RAD: f32 = 2e-4;
/// Least lag of a layer, rad.
const LEAST_LAG: f64 = 1e-4;

/// Forces in the plane per unit of k_tc, k_rc, k_te, k_re, k_ac, k_ae at every angle of a turn.
pub struct Turn {
    by_angle: Vec<[C; 6]>,
    /// Share of the contact in which a tooth finds nothing left to cut.
    pub idle: f64,
}

/// A tooth: its angle behind the first, and (feed, in mean feeds per tooth; R_i − R_{i−m}) for each m.
struct Tooth {
    behind: f64,
    before: Vec<[f64; 2]>,
}

/// Neighbouring rings with the same arc.
#[derive(Clone, Copy)]
struct Layer {
    slice: Slice,
    last: u32,
    arc: [f64; 2],
    lag: [f64; 2],
    edge_mm: f64,
}

fn teeth(tool: &Tool, runout: Runout) -> Vec<Tooth> {
    let n = tool.flutes as usize;
    let pitch = |k: usize| if tool.pitch_rad.is_empty() { TAU / n as f64 } else { tool.pitch_rad[k % n] };
    let behind = |i: usize| (0..i).map(pitch).sum::<f64>();
    let radius = |i: usize| runout.offset_mm * (runout.angle_rad - behind(i % n)).cos();
    let meets = |i: usize, m: usize| {
        let turned: f64 = (1..=m).map(|k| pitch(i + n - k)).sum();
        [turned * n as f64 / TAU, radius(i) - radius(i + n - m)]
    };
    (0..n).map(|i| Tooth { behind: behind(i), before: (1..=n).map(|m| meets(i, m)).collect() }).collect()
}

fn layers(tool: &Tool, slices: &[Slice], arcs: &[EngagedArc]) -> Vec<Layer> {
    let by_height = tool.helix_rad.tan() / tool.radius_mm().max(1e-9);
    let mut layers: Vec<Layer> = Vec::new();
    for arc in arcs {
        let slice = slices[arc.slice as usize];
        let ends = [-0.5, 0.5].map(|end| (slice.z_mm + end * slice.dz_mm()) * by_height);
        let lag = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        let own = [f64::from(arc.entry_rad), f64::from(arc.exit_rad)];
        let alike = |l: &&mut Layer| {
            let same = (0..2).all(|k| (own[k] - l.arc[k]).abs() < f64::from(SAME_RAD));
            same && l.last + 1 == arc.slice && l.slice.normal_r > 0.999 && slice.normal_r > 0.999
        };
        if let Some(layer) = layers.last_mut().filter(alike) {
            layer.last = arc.slice;
            layer.lag = [layer.lag[0].min(lag[0]), layer.lag[1].max(lag[1])];
            layer.edge_mm += slice.edge_mm;
        } else {
            layers.push(Layer { slice, last: arc.slice, arc: own, lag, edge_mm: slice.edge_mm });
        }
    }
    layers
}

/// ∫ h e^{−iφ} and ∫ e^{−iφ} over φ where the tooth cuts, from the entry on, and how much of the arc it misses.
fn sums(layer: &Layer, tooth: &Tooth, tangent_z: f64, feed_per_tooth_mm: f64) -> (Vec<[C; 2]>, f64) {
    let [entry, exit] = layer.arc;
    let count = ((exit - entry) / STEP_RAD).ceil().max(4.0);
    let step = (exit - entry) / count;
    let level = (1.0 - tangent_z * tangent_z).max(0.0).sqrt() * layer.slice.normal_r;
    let (mut sum, mut missed) = ([C::default(); 2], 0.0);
    let mut all = vec![sum];
    for k in 0..count as usize {
        let phi = entry + (k as f64 + 0.5) * step;
        let chip = feed_per_tooth_mm * (level * phi.sin() + tangent_z * layer.slice.normal_z);
        let left = |[feeds, out]: &[f64; 2]| feeds * chip + out * layer.slice.normal_r;
        let h = tooth.before.iter().map(left).fold(f64::INFINITY, f64::min);
        if h > 0.0 {
            let turned = C::from_polar(step, -phi);
            sum = [sum[0] + turned * h, sum[1] + turned];
        } else {
            missed += step;
        }
        all.push(sum);
    }
    (all, missed)
}

impl Turn {
    /// Forces of the `arcs` on the rings `slices` while the tool moves with `tangent_z` of its direction along Z,
    /// mm/mm.
    pub fn new(
        tool: &Tool,
        slices: &[Slice],
        arcs: &[EngagedArc],
        tangent_z: f64,
        feed_per_tooth_mm: f64,
        runout: Runout,
    ) -> Self {
        let mut turn = Self { by_angle: vec![[C::default(); 6]; ANGLES], idle: 0.0 };
        let (mut missed, mut whole) = (0.0, 0.0);
        let teeth = teeth(tool, runout);
        for layer in layers(tool, slices, arcs) {
            let contact = layer.slice.radius_mm * layer.edge_mm;
            for tooth in &teeth {
                let (sums, misses) = sums(&layer, tooth, tangent_z, feed_per_tooth_mm);
                missed += misses * contact;
                whole += (layer.arc[1] - layer.arc[0]) * contact;
                turn.add(&layer, tooth.behind, &sums);
            }
        }
        turn.idle = missed / f64::max(whole, 1e-12);
        turn
    }

    /// Adds what a tooth takes on a layer while any of its edge there is in the arc.
    fn add(&mut self, layer: &Layer, behind: f64, sums: &[[C; 2]]) {
        let ([entry, exit], [low, high]) = (layer.arc, layer.lag);
        let high = high.max(low + LEAST_LAG);
        let per_angle = ANGLES as f64 / TAU;
        let steps = (sums.len() - 1) as f64 / (exit - entry).max(1e-9);
        let up_to = |phi: f64| {
            let place = ((phi - entry) * steps).clamp(0.0, (sums.len() - 1) as f64);
            let k = (place as usize).min(sums.len() - 2);
            let t = place - k as f64;
            [0, 1].map(|i| sums[k][i] + (sums[k + 1][i] - sums[k][i]) * t)
        };
        let from = ((entry + behind + low) * per_angle).ceil() as i64;
        let to = ((exit + behind + high) * per_angle).floor() as i64;
        let (share, n_r, n_z) = (layer.edge_mm / (high - low), layer.slice.normal_r, layer.slice.normal_z);
        for angle in from..=to {
            let phi = angle as f64 / per_angle - behind;
            let ([upper_c, upper_e], [lower_c, lower_e]) = (up_to(phi - low), up_to(phi - high));
            let (cutting, edge) = ((upper_c - lower_c) * share, (upper_e - lower_e) * share);
            let at = &mut self.by_angle[angle.rem_euclid(ANGLES as i64) as usize];
            let parts = [-1.0, 1.0].map(|sign| C::new(0.0, sign));
            let more = [
                -cutting,
                parts[0] * n_r * cutting,
                -edge,
                parts[0] * n_r * edge,
                parts[1] * n_z * cutting,
                parts[1] * n_z * edge,
            ];
            at.iter_mut().zip(more).for_each(|(sum, m)| *sum += m);
        }
    }

    /// Largest force in the plane with these coefficients, its derivatives by k_tc, k_rc, k_te, k_re; of the magnitude
    /// of the mean where `mean`.
    pub fn slopes(&self, k: &LinearEdge, mean: bool) -> [f64; 4] {
        let values = [k.k_tc, k.k_rc, k.k_te, k.k_re, k.k_ac, k.k_ae];
        let force = |at: &[C; 6]| at.iter().zip(values).map(|(w, k)| w * k).sum::<C>();
        let whole: [C; 6] = std::array::from_fn(|b| self.by_angle.iter().map(|at| at[b]).sum::<C>() / ANGLES as f64);
        let most = || self.by_angle.iter().max_by(|a, b| force(a).norm_sqr().total_cmp(&force(b).norm_sqr()));
        let at = if mean { &whole } else { most().unwrap_or(&whole) };
        let total = force(at);
        let along = if total.norm() > 0.0 { total.conj() / total.norm() } else { C::default() };
        std::array::from_fn(|b| (along * at[b]).re)
    }
}
