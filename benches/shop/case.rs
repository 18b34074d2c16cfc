//! A hidden machine at work: job, machine, and its causes as strong as can just be asked for.
//!
//! In: a cause and a seed. Out: what the shop has (program, setup) and what it does not know.

use super::causes::{Cause, Hidden, Scene, hide, least_strength};
use super::dice::Dice;
use super::programs::{Job, everyday};
use super::shop_floor::{Machine, Run, mean_cutting_w, misfit_w, simulate};

/// Error of the best plain model over the noise, least and most.
pub const VISIBLE: [f64; 2] = [2.0, 3.2];

/// A log with its truth.
pub struct Case {
    pub job: Job,
    pub machine: Machine,
    pub hidden: Hidden,
    pub noise_w: f64,
    /// Error of the best plain model over the noise.
    pub seen: f64,
    pub strengths: Vec<f64>,
    pub run: Run,
}

/// Builds a case: each part as strong as can just be asked for.
pub fn case(cause: &Cause, seed: u64, noise: f64) -> Case {
    let job = everyday(seed, cause.needs, false);
    let mut machine = Machine::new(seed);
    machine.positions = cause.forces || machine.positions && !cause.only_without_positions;
    machine.forces = cause.forces;
    let plain = simulate(&job, &machine, &Hidden::default());
    let noise_w = noise * mean_cutting_w(&plain, &machine);
    let scene = Scene::new(&job, &plain, &machine);
    let over_noise = |hidden: &Hidden| {
        let run = simulate(&job, &machine, hidden);
        let misfit = misfit_w(&run, &plain, &machine);
        (run, misfit.hypot(noise_w) / noise_w)
    };
    let mut hidden = Hidden::default();
    let mut strengths = Vec::new();
    for part in cause.parts {
        let strength = strong_enough(part, |strength| {
            let mut alone = Hidden::default();
            hide(part, strength, &scene, &mut Dice::new(seed, part), &mut alone);
            over_noise(&alone).1
        });
        hide(part, strength, &scene, &mut Dice::new(seed, part), &mut hidden);
        strengths.push(strength);
    }
    let (run, seen) = over_noise(&hidden);
    Case { job, machine, hidden, noise_w, seen, strengths, run }
}

/// The strength at which a cause leaves the plain model as much as `VISIBLE` says. What is left grows with the strength.
pub fn strong_enough(part: &str, mut seen_at: impl FnMut(f64) -> f64) -> f64 {
    let wanted: f64 = f64::midpoint(VISIBLE[0], VISIBLE[1]);
    let mut strength: f64 = 1.0;
    for _ in 0..7 {
        let seen = seen_at(strength);
        if (VISIBLE[0]..=VISIBLE[1]).contains(&seen) {
            break;
        }
        let step = ((wanted * wanted - 1.0) / (seen * seen - 1.0).max(1e-3)).sqrt().clamp(0.4, 2.5);
        strength = (strength * step).clamp(least_strength(part), 5.0);
    }
    strength
}
