//! Limits taken from the program itself (`--reference`): for coefficients that nobody has measured, the loads that each operation of a
//! proven program already stands. In: toolpath, engagement, job, the operations. Out: per operation and load the distribution over the cut
//! length, and limits at a percentile of it. Each operation is its own reference: what roughing stands says nothing about finishing.
//!
//! An error common to all coefficients cancels, because it scales limit and prediction alike.

use rayon::prelude::*;

use super::cutters::Cutters;
use super::kinds_of_cut::cuts;
use super::operations::{Segment, nearest};
use super::realise::as_programmed;
use crate::engage::EngagementMap;
use crate::machine::{Job, LimitKind, Limits, Reference};
use crate::nc::Toolpath;

/// A load below this counts as zero, in the unit of [`Limits`]: the force of a drill in the plane is rounding only.
const NOTHING: f64 = 1e-6;

/// Distribution of one load of one operation over the cut length. Values are in the unit of [`Limits`].
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution {
    /// Tool number.
    pub tool: u32,
    /// Index of the segment.
    pub segment: usize,
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

/// Distributions of the loads as programmed, by segment and load.
pub fn distributions(segments: &[Segment], toolpath: &Toolpath, map: &EngagementMap, job: &Job) -> Vec<Distribution> {
    let cutters = Cutters::new(toolpath, map, job, &as_programmed(toolpath));
    let scopes = || segments.iter().map(|segment| &segment.scope);
    let cuts = cuts(toolpath, map, job);
    let of_move: Vec<Option<usize>> =
        toolpath.moves.iter().zip(&cuts).map(|(motion, cut)| nearest(scopes(), motion, (*cut)?)).collect();
    let kinds: Vec<LimitKind> = LimitKind::references().collect();
    let met: Vec<Option<(usize, f64, Vec<f64>)>> = map
        .stations
        .par_iter()
        .map(|station| {
            let motion = &toolpath.moves[station.move_id.ix()];
            let segment = of_move[station.move_id.ix()]?;
            let cutter = cutters.of(station.move_id).filter(|_| station.arc_count > 0 && motion.feed.mm_s > 0.0)?;
            let loads = cutter.loads(&cutters.cut(map, motion, station), motion.feed.mm_s);
            Some((
                segment,
                station.length_mm(),
                kinds.iter().map(|kind| loads.bounded_by(*kind).unwrap_or(0.0)).collect(),
            ))
        })
        .collect();
    let of = |segment: usize, column: usize| {
        let mine = met.iter().flatten().filter(|(number, ..)| *number == segment);
        let mut values: Vec<(f64, f64)> = mine.map(|(_, length, loads)| (loads[column], *length)).collect();
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        Distribution { tool: segments[segment].scope.tool, segment, kind: kinds[column], values }
    };
    let all = (0..segments.len()).flat_map(|segment| (0..kinds.len()).map(move |column| (segment, column)));
    all.map(|(segment, column)| of(segment, column)).filter(|found| !found.values.is_empty()).collect()
}

/// The job with force, power, torque and deflection of every segment limited to a percentile (0 … 100) of their values at the programmed
/// feeds, or to the largest value where that percentile is zero. Lower limits of the setup stay. A load that is zero all over a segment
/// is not limited there.
pub fn limited_to_itself(job: &Job, segments: &[Segment], found: &[Distribution], percentile: f64) -> Job {
    let reference = |(index, segment): (usize, &Segment)| {
        let mut limits = Limits::default();
        for distribution in found.iter().filter(|one| one.segment == index) {
            let at = distribution.quantile(percentile / 100.0);
            let value = if at > NOTHING { at } else { distribution.max() };
            if value > NOTHING {
                limits.set(distribution.kind, Some(value));
            }
        }
        Reference { scope: segment.scope, limits }
    };
    Job { references: segments.iter().enumerate().map(reference).collect(), ..job.clone() }
}
