//! Limits without coefficients to trust: the loads that each tool already survives in the proven program. In: toolpath,
//! engagement, job. Out: per tool and load the distribution over the cut length, and limits at a percentile of it.
//!
//! A common error of the coefficients cancels: it scales the reference and the prediction alike.

use rayon::prelude::*;

use super::caps::Cutters;
use crate::engage::EngagementMap;
use crate::machine::{Job, LimitKind, Limits};
use crate::nc::Toolpath;

/// A load below this is none, in the unit of [`Limits`]: a drill has no force in the plane but for rounding.
const NOTHING: f64 = 1e-6;

/// Loads that can serve as a reference.
pub const LOADS: [LimitKind; 6] = [
    LimitKind::ForceXy,
    LimitKind::ForceNormalMean,
    LimitKind::ForceAxial,
    LimitKind::Power,
    LimitKind::Torque,
    LimitKind::Deflection,
];

/// One load of one tool over the whole program: values in the unit of [`Limits`], with the length they were met over.
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution {
    /// Tool number.
    pub tool: u32,
    /// Which load.
    pub kind: LimitKind,
    /// (value, mm), by rising value.
    values: Vec<(f64, f64)>,
}

impl Distribution {
    /// Value that this share (0 … 1) of the cut length stays at or below.
    pub fn quantile(&self, share: f64) -> f64 {
        let whole: f64 = self.values.iter().map(|(_, length)| length).sum();
        let mut below = 0.0;
        for (value, length) in &self.values {
            below += length;
            if below >= share * whole * (1.0 - 1e-12) {
                return *value;
            }
        }
        self.values.last().map_or(0.0, |(value, _)| *value)
    }
    /// Largest value.
    pub fn max(&self) -> f64 {
        self.values.last().map_or(0.0, |(value, _)| *value)
    }
    /// Cut length, mm.
    pub fn length_mm(&self) -> f64 {
        self.values.iter().map(|(_, length)| length).sum()
    }
}

/// Distributions of the loads as programmed, by tool (in order of number) and load.
pub fn distributions(toolpath: &Toolpath, map: &EngagementMap, job: &Job) -> Vec<Distribution> {
    let cutters = Cutters::new(toolpath, map, job);
    let met: Vec<Option<(u32, f64, [f64; LOADS.len()])>> = map
        .stations
        .par_iter()
        .map(|station| {
            let motion = &toolpath.moves[station.move_id.ix()];
            let cutter = cutters.of(station.move_id).filter(|_| station.arc_count > 0 && motion.feed.mm_s > 0.0)?;
            let loads = cutter.loads(&cutters.cut(map, motion, station), motion.feed.mm_s);
            Some((motion.tool, station.length_mm(), LOADS.map(|kind| loads.bounded_by(kind).unwrap_or(0.0))))
        })
        .collect();
    let mut tools: Vec<u32> = met.iter().flatten().map(|(tool, ..)| *tool).collect();
    tools.sort_unstable();
    tools.dedup();
    let of = |tool: u32, column: usize| {
        let mine = met.iter().flatten().filter(|(number, ..)| *number == tool);
        let mut values: Vec<(f64, f64)> = mine.map(|(_, length, loads)| (loads[column], *length)).collect();
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        Distribution { tool, kind: LOADS[column], values }
    };
    tools
        .into_iter()
        .flat_map(|tool| (0..LOADS.len()).map(move |column| (tool, column)))
        .map(|(t, c)| of(t, c))
        .collect()
}

/// The job with every tool's force, power, torque and deflection limited to a percentile (0 … 100) of what it meets in the
/// program as it stands, or the largest where that percentile is nothing; limits that the setup gives stay where they are lower. A
/// load that the tool does not meet limits nothing.
pub fn limited_to_itself(job: &Job, found: &[Distribution], percentile: f64) -> Job {
    let mut job = job.clone();
    for tool in &mut job.tools {
        let merged = job.limits.overridden_by(&tool.limits);
        for distribution in found.iter().filter(|one| one.tool == tool.number) {
            let at = distribution.quantile(percentile / 100.0);
            let reference = if at > NOTHING { at } else { distribution.max() };
            if reference <= NOTHING {
                continue;
            }
            let lower = |own: Option<f64>| Some(own.map_or(reference, |own| own.min(reference)));
            put(&mut tool.limits, &merged, distribution.kind, &lower);
        }
    }
    job
}

fn put(limits: &mut Limits, merged: &Limits, kind: LimitKind, lower: &dyn Fn(Option<f64>) -> Option<f64>) {
    match kind {
        LimitKind::ForceXy => limits.force_xy_n = lower(merged.force_xy_n),
        LimitKind::ForceNormalMean => limits.force_normal_mean_n = lower(merged.force_normal_mean_n),
        LimitKind::ForceAxial => limits.force_axial_n = lower(merged.force_axial_n),
        LimitKind::Power => limits.power_w = lower(merged.power_w),
        LimitKind::Torque => limits.torque_nmm = lower(merged.torque_nmm),
        LimitKind::Deflection => limits.deflection_mm = lower(merged.deflection_mm),
        _ => {}
    }
}
