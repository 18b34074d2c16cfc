//! A log laid along its program. In: log, alignment, what is known of the program. Out: [`PlacedLog`]: the spot of
//! every sample, and what its tool had cut by then; the columns that the coefficients of a cut multiply.

use crate::force::contact::Engaged;
use crate::learn::align::Aligned;
use crate::learn::log::Log;
use crate::learn::log::quantity::Quantity;
use crate::learn::log::quantity::column_factor;
use crate::learn::program::simulated::ProgramView;
use crate::learn::program::timeline::{Activity, Spot};
use crate::learn::regress::statistics::median;

/// The samples laid along the program.
pub(in crate::learn) struct PlacedLog<'a> {
    pub(in crate::learn) log: &'a Log,
    pub(in crate::learn) known: &'a ProgramView<'a>,
    pub(in crate::learn) aligned: &'a Aligned,
    /// Spot of each sample.
    pub(in crate::learn) spot: Vec<Option<usize>>,
    /// Cumulated sliding and volume, and the path since material was met, at the start of each spot.
    pub(in crate::learn) cumulated: Vec<[f64; 3]>,
    pub(in crate::learn) reference_rps: f64,
    pub(in crate::learn) tools: Vec<u32>,
}

impl<'a> PlacedLog<'a> {
    pub(in crate::learn) fn new(log: &'a Log, aligned: &'a Aligned, known: &'a ProgramView<'a>) -> Self {
        let spots = &known.timeline.spots;
        let mut tools: Vec<u32> = spots.iter().map(|s| s.tool).collect();
        tools.sort_unstable();
        tools.dedup();
        let cutting: Vec<f64> = spots.iter().filter(|s| s.engaged.section_mm2 > 0.0).map(|s| s.rps).collect();
        Self {
            log,
            known,
            aligned,
            spot: aligned.program_s.iter().map(|t| known.timeline.at(*t)).collect(),
            cumulated: cumulated(spots, &tools),
            reference_rps: median(&cutting).max(1e-3),
            tools,
        }
    }

    pub(in crate::learn) fn rps(&self, i: usize, spot: &Spot) -> f64 {
        self.log.rps.as_ref().map_or(spot.rps, |n| n[i])
    }

    /// Spots that a time lies between, with shares: its own, and in a feed move the one whose middle is nearest on the
    /// other side. What is cut changes steadily along a move, and jumps only where another begins.
    pub(in crate::learn) fn about(&self, time_s: f64) -> [(usize, f64); 2] {
        let spots = &self.known.timeline.spots;
        let index = self.known.timeline.at(time_s).unwrap_or(0);
        let spot = &spots[index];
        let middle = |s: &Spot| f64::midpoint(s.start_s, s.end_s);
        let next = if time_s < middle(spot) { index.wrapping_sub(1) } else { index + 1 };
        let other = spots.get(next).filter(|s| spot.activity == Activity::Feed && s.move_id == spot.move_id);
        let share = other.map_or(0.0, |o| (time_s - middle(spot)) / (middle(o) - middle(spot)));
        [(index, 1.0 - share), (if other.is_some() { next } else { index }, share)]
    }

    /// What a coefficient of the cut multiplies.
    pub(in crate::learn) fn column(
        name: &str,
        quantity: Option<Quantity>,
        rps: f64,
        spot: &Spot,
        engaged: &Engaged,
    ) -> f64 {
        match (quantity, name) {
            (Some(q), "k_tc") => column_factor(q, rps) * engaged.section_mm2 * spot.speed_mm_s(),
            (Some(q), "k_te") => column_factor(q, rps) * engaged.contact_mm2 * rps,
            (None, "k_tc") => engaged.peak[0],
            (None, "k_rc") => engaged.peak[1],
            (None, "k_te") => engaged.peak[2],
            (None, "k_re") => engaged.peak[3],
            _ => 0.0,
        }
    }

    pub(in crate::learn) fn tare_shape(&self, rps: f64) -> f64 {
        let tare = &self.known.job.machine.spindle.tare_w;
        let reference = tare.at(self.reference_rps);
        if rps < 0.02 * self.reference_rps {
            0.0
        } else if reference > 0.0 {
            tare.at(rps) / reference
        } else {
            1.0
        }
    }

    /// A meter reading as the power at the motor shaft that the setup makes of it.
    pub(in crate::learn) fn at_shaft(&self, reading: f64, quantity: Option<Quantity>) -> f64 {
        if quantity == Some(Quantity::Power) {
            reading * self.known.job.machine.spindle.efficiency.at(reading)
        } else {
            reading
        }
    }
}

/// Sliding and volume so far of each spot's tool, and the path since material was met, at the start of each spot.
fn cumulated(spots: &[Spot], tools: &[u32]) -> Vec<[f64; 3]> {
    let mut sums = vec![[0.0; 3]; tools.len()];
    spots
        .iter()
        .map(|spot| {
            let sum = &mut sums[tools.binary_search(&spot.tool).unwrap_or(0)];
            let before = *sum;
            sum[0] += spot.engaged.way_mm * spot.rps * (spot.end_s - spot.start_s);
            sum[1] += spot.engaged.section_mm2 * spot.length_mm;
            sum[2] = if spot.engaged.section_mm2 > 1e-6 { sum[2] + spot.length_mm } else { 0.0 };
            before
        })
        .collect()
}
