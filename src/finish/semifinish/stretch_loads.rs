//! Loads of each stretch of the finishing path with the chosen stock. In: a simulation, the stock at the unknowns. Out:
//! loads, stock and whether a bound is active there; whether the reference force can be reached at all.

use super::met_stock::{MetStock, Sample};
use super::programs::{Programs, Simulated};
use super::unknowns::{FREE, Unknowns};
use crate::force::Loads;
use crate::path::Vec3;

/// Stock closer to its bound than this is at the bound, mm.
const AT_BOUND_MM: f64 = 1e-3;

/// A stretch of the finishing path with its loads.
#[derive(Debug, Clone, Copy)]
pub struct StretchLoads {
    /// The stretch.
    pub sample: Sample,
    /// Loads.
    pub loads: Loads,
    /// The semi-finishing move that left most of its stock, and mm along it.
    pub left_by: Option<(u32, f64)>,
    /// Normal of the surface there.
    pub normal: Vec3,
    /// Stock it meets, mm: weighted mean over its knots.
    pub stock_mm: f64,
    /// Is it a full cut whose stock could be chosen?
    pub free: bool,
    /// Is a bound on the stock or on its change active at most of its knots?
    pub bound: bool,
}

/// Loads and stock of every stretch with this stock at the unknowns.
pub fn stretch_loads(
    programs: &Programs,
    unknowns: &Unknowns,
    samples: &[Sample],
    simulated: &Simulated,
    met: &[MetStock],
    stock_mm: &[f64],
) -> Vec<StretchLoads> {
    let loads = Programs::loads(simulated, programs.task.job, samples);
    let [low, high] = programs.task.wanted.stock_mm;
    let mut held: Vec<bool> =
        stock_mm.iter().map(|stock| *stock < low + AT_BOUND_MM || *stock > high - AT_BOUND_MM).collect();
    for pair in &unknowns.pairs {
        let [i, j] = pair.of.map(|k| k as usize);
        if (stock_mm[j] - stock_mm[i]).abs() > 0.98 * pair.reach {
            (held[i], held[j]) = (true, true);
        }
    }
    let one = |k: usize| {
        let shares = || unknowns.shares(&met[k]);
        let whole: f64 = shares().map(|(_, share)| share).sum::<f64>().max(1e-12);
        let normal: Vec3 = met[k].normals.iter().map(|(_, normal)| normal).sum();
        StretchLoads {
            sample: samples[k],
            loads: loads[k],
            left_by: met[k].place,
            normal: normal.try_normalize(0.0).unwrap_or_else(Vec3::z),
            stock_mm: shares().map(|(unknown, share)| share * stock_mm[unknown]).sum::<f64>() / whole,
            free: whole >= FREE && !samples[k].edge,
            bound: shares().filter(|(unknown, _)| held[*unknown]).map(|(_, share)| share).sum::<f64>() > 0.5,
        }
    };
    (0..samples.len()).map(one).collect()
}

/// Least and largest force, N, and stock, mm, if all forces lie more than 10 % to one side of the reference.
pub fn out_of_reach(after: &[StretchLoads], reference_n: f64) -> Option<[[f64; 2]; 2]> {
    let free = || after.iter().filter(|seen| seen.free && seen.loads.force_xy_peak_n > 0.0);
    let range = |of: fn(&StretchLoads) -> f64| {
        free().map(of).fold([f64::INFINITY, 0.0_f64], |[least, most], value| [least.min(value), most.max(value)])
    };
    let force_n = range(|seen| seen.loads.force_xy_peak_n);
    let is_missed = force_n[0].is_finite() && (force_n[1] < 0.9 * reference_n || force_n[0] > 1.1 * reference_n);
    is_missed.then(|| [force_n, range(|seen| seen.stock_mm)])
}
