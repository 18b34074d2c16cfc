//! A log placed in its program. In: log, alignment, simulated program. Out: [`PlacedLog`]: the spot of every sample,
//! the history of its tool, and the columns that cutting and edge coefficients multiply.

use crate::force::contact::Engaged;
use crate::learn::align::Aligned;
use crate::learn::dataset::measured_feed::{MeasuredFeed, measured_feed};
use crate::learn::dataset::samples::Class;
use crate::learn::log::Log;
use crate::learn::log::quantity::Quantity;
use crate::learn::log::quantity::{column_factor, tare_factor};
use crate::learn::program::simulated::ProgramView;
use crate::learn::program::timeline::{Activity, Spot};
use crate::learn::regress::statistics::median;
use crate::machine::Job;
use crate::machine::wear::Lengths;
use crate::units::rpm_from_rps;

/// A tool at a spindle speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::learn) struct Operation {
    pub(in crate::learn) tool: u32,
    pub(in crate::learn) rpm: u32,
}

impl Operation {
    /// Operation of a spot.
    pub(in crate::learn) fn of(spot: &Spot) -> Self {
        Self { tool: spot.tool, rpm: rpm_from_rps(spot.rps).round() as u32 }
    }
}

/// Every operation that cuts, by tool number and speed.
pub(in crate::learn) fn operations(spots: &[Spot]) -> Vec<Operation> {
    let cutting = spots.iter().filter(|spot| spot.engaged.section_mm2 > 0.0);
    let mut all: Vec<Operation> = cutting.map(Operation::of).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// The samples placed in the program.
pub(in crate::learn) struct PlacedLog<'a> {
    pub(in crate::learn) log: &'a Log,
    pub(in crate::learn) known: &'a ProgramView<'a>,
    pub(in crate::learn) aligned: &'a Aligned,
    /// Spot of each sample.
    pub(in crate::learn) spot: Vec<Option<usize>>,
    /// History of the tool at the start of each spot.
    pub(in crate::learn) history: Vec<ToolHistory>,
    pub(in crate::learn) reference_rps: f64,
    /// The operations of the program.
    pub(in crate::learn) operations: Vec<Operation>,
    /// The feed that the log shows, if any.
    pub(in crate::learn) feed: Option<MeasuredFeed>,
    /// The tools with the times of the log at which they first cut, s.
    pub(in crate::learn) first_cuts_s: Vec<(u32, f64)>,
}

impl<'a> PlacedLog<'a> {
    pub(in crate::learn) fn new(log: &'a Log, aligned: &'a Aligned, known: &'a ProgramView<'a>) -> Self {
        let spots = &known.timeline.spots;
        let mut tools: Vec<u32> = spots.iter().map(|s| s.tool).collect();
        tools.sort_unstable();
        tools.dedup();
        let cutting: Vec<f64> = spots.iter().filter(|s| s.engaged.section_mm2 > 0.0).map(|s| s.rps).collect();
        let spot: Vec<Option<usize>> = aligned.program_s.iter().map(|t| known.timeline.at(*t)).collect();
        let first_cut_s = |tool: &u32| {
            let cuts = |k: usize| spots[k].tool == *tool && spots[k].engaged.section_mm2 > 1e-6;
            let first = spot.iter().position(|spot| spot.is_some_and(cuts));
            (*tool, first.map_or(f64::INFINITY, |i| log.time_s[i]))
        };
        Self {
            first_cuts_s: tools.iter().map(first_cut_s).collect(),
            log,
            known,
            aligned,
            spot,
            history: history(spots, &tools, known.job),
            reference_rps: median(&cutting).max(1e-3),
            operations: operations(spots),
            feed: measured_feed(log, aligned, known.timeline),
        }
    }

    /// Measured feed over the predicted one at a sample; 1 if it is not known.
    pub(in crate::learn) fn feed_ratio(&self, i: usize) -> f64 {
        self.feed.as_ref().map_or(1.0, |feed| feed.ratio[i])
    }

    /// Does the tool stand still at a sample at which the program feeds?
    pub(in crate::learn) fn stands(&self, i: usize) -> bool {
        self.feed.as_ref().is_some_and(|feed| feed.stands(i))
    }

    /// Factor of the measured feed on a column at the predicted feed: chip thickness is proportional to the feed, edge
    /// contact is independent of it.
    pub(in crate::learn) fn at_feed(&self, i: usize, class: Class) -> f64 {
        if class == Class::Cutting { self.feed_ratio(i) } else { 1.0 }
    }

    pub(in crate::learn) fn rps(&self, i: usize, spot: &Spot) -> f64 {
        self.log.rps.as_ref().map_or(spot.rps, |n| n[i])
    }

    /// Interpolation weights of spots at a time: its own, and in a feed move the neighbour whose middle is nearest. The
    /// engagement is continuous along a move and may jump where another begins.
    pub(in crate::learn) fn spot_shares(&self, time_s: f64) -> [(usize, f64); 2] {
        let spots = &self.known.timeline.spots;
        let index = self.known.timeline.at(time_s).unwrap_or(0);
        let spot = &spots[index];
        let middle = |s: &Spot| f64::midpoint(s.start_s, s.end_s);
        let next = if time_s < middle(spot) { index.wrapping_sub(1) } else { index + 1 };
        let other = spots.get(next).filter(|s| spot.activity == Activity::Feed && s.move_id == spot.move_id);
        let share = other.map_or(0.0, |o| (time_s - middle(spot)) / (middle(o) - middle(spot)));
        [(index, 1.0 - share), (if other.is_some() { next } else { index }, share)]
    }

    /// Column of a cutting or edge coefficient at a spot.
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
        self.known.job.machine.spindle.tare_shape(rps, self.reference_rps)
    }

    pub(in crate::learn) fn tare_factor(&self, quantity: Quantity, rps: f64) -> f64 {
        tare_factor(quantity, Some(&self.known.job.machine.spindle), rps, self.reference_rps)
    }

    /// A meter reading as power at the motor shaft, by the efficiency of the setup; other quantities unchanged.
    pub(in crate::learn) fn at_shaft(&self, reading: f64, quantity: Option<Quantity>) -> f64 {
        if quantity == Some(Quantity::Power) {
            reading * self.known.job.machine.spindle.efficiency.at(reading)
        } else {
            reading
        }
    }
}

/// History of a tool.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::learn) struct ToolHistory {
    /// Sliding distance of its teeth in material, mm.
    pub(in crate::learn) slid: Lengths,
    /// Volume that it has removed, mm³.
    pub(in crate::learn) volume_mm3: f64,
    /// Path since it entered material, mm.
    pub(in crate::learn) since_entry_mm: f64,
}

/// Sliding distance of the teeth in material over a share of a spot.
pub(in crate::learn) fn slid(spot: &Spot, share: f64, rps: f64, job: &Job) -> Lengths {
    let flutes = job.tool(spot.tool).map_or(1.0, |tool| f64::from(tool.flutes));
    Lengths::slid(spot.engaged.way_mm * rps * (spot.end_s - spot.start_s), spot.speed_mm_s() / (flutes * rps))
        .times(share)
}

/// History of the tool of each spot at the start of the spot.
fn history(spots: &[Spot], tools: &[u32], job: &Job) -> Vec<ToolHistory> {
    let mut sums = vec![ToolHistory::default(); tools.len()];
    spots
        .iter()
        .map(|spot| {
            let sum = &mut sums[tools.binary_search(&spot.tool).unwrap_or(0)];
            let before = *sum;
            sum.slid = sum.slid.and(&slid(spot, 1.0, spot.rps, job));
            sum.volume_mm3 += spot.engaged.section_mm2 * spot.length_mm;
            let cuts = spot.engaged.section_mm2 > 1e-6;
            sum.since_entry_mm = if cuts { sum.since_entry_mm + spot.length_mm } else { 0.0 };
            before
        })
        .collect()
}
