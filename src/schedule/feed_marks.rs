//! Feed marks on final surfaces. In: toolpath, engagement, job, feeds. Out: [`FinalSurface`]: length of path that leaves final surface,
//! time spent on it, height of the feed marks.
//!
//! A cutter of radius R that advances f_t per tooth across its axis leaves cusps of height f_t² / 8R along the wall (Martellotti). Of a plunge
//! or a ramp only the part across counts.

use super::cutters::Cutters;
use super::problem::FeedPiece;
use super::realise::pieces_of_moves;
use crate::engage::EngagementMap;
use crate::machine::Job;
use crate::nc::Toolpath;

/// Totals over all stations that leave final surface.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FinalSurface {
    /// Length of path that leaves final surface, mm.
    pub length_mm: f64,
    /// Length over commanded feed there, s.
    pub commanded_s: f64,
    /// Highest feed marks, mm.
    pub mark_max_mm: f64,
    /// Mean over the length, mm.
    pub mark_mean_mm: f64,
}

/// Height of the feed marks, mm.
pub fn feed_mark_mm(feed_per_tooth_mm: f64, radius_mm: f64) -> f64 {
    feed_per_tooth_mm * feed_per_tooth_mm / (8.0 * radius_mm)
}

/// Final surfaces under these feeds.
pub fn final_surface(toolpath: &Toolpath, map: &EngagementMap, job: &Job, feeds: &[FeedPiece]) -> FinalSurface {
    let ranges = pieces_of_moves(feeds, toolpath.moves.len());
    let cutters = Cutters::new(toolpath, map, job, feeds);
    let mut out = FinalSurface::default();
    for station in map.stations.iter().filter(|station| station.flags.final_surface) {
        let motion = &toolpath.moves[station.move_id.ix()];
        let Some(tool) = job.tool(motion.tool) else { continue };
        if cutters.of(station.move_id).is_none() {
            continue;
        }
        let range = &ranges[station.move_id.ix()];
        for piece in &feeds[range.start as usize..range.end as usize] {
            let length_mm = piece.to_mm.min(station.to_mm) - piece.from_mm.max(station.from_mm);
            if length_mm <= 0.0 || piece.feed_mm_s <= 0.0 {
                continue;
            }
            let across = motion.curve().tangent(0.5 * (station.from_mm + station.to_mm)).xy().norm();
            let per_tooth = across * piece.feed_mm_s / (motion.spin.rps * f64::from(tool.flutes));
            let mark = feed_mark_mm(per_tooth, tool.radius_mm());
            out.length_mm += length_mm;
            out.commanded_s += length_mm / piece.feed_mm_s;
            out.mark_max_mm = out.mark_max_mm.max(mark);
            out.mark_mean_mm += mark * length_mm;
        }
    }
    if out.length_mm > 0.0 {
        out.mark_mean_mm /= out.length_mm;
    }
    out
}
