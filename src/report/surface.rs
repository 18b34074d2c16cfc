//! The machined wall in space. In: a run. Out: one row per point that a tooth leaves on a wall: where, and how far the bent,
//! run-out tool stands off the ideal wall there at the programmed feed (Ko, Yun, Cho 2002).

use super::number::unsigned_zero;
use crate::outcome::ProgramRun;
use crate::path::Vec3;
use crate::schedule::cutters::Cutters;
use crate::units::mm_min_from_mm_s;
use std::io::{self, Write};

/// Writes the points, tab-separated; the error is positive where material is left, negative where the tool cut too deep.
pub fn surface(run: &ProgramRun, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "line\tx_mm\ty_mm\tz_mm\terror_mm\tfeed_mm_min")?;
    let cutters = Cutters::new(&run.toolpath, &run.map, &run.job, &run.before);
    for station in run.map.stations.iter().filter(|station| station.arc_count > 0) {
        let motion = &run.toolpath.moves[station.move_id.ix()];
        let Some(cutter) = cutters.of(station.move_id) else { continue };
        let middle_mm = 0.5 * (station.from_mm + station.to_mm);
        let (tip, ahead) = (motion.curve().point(middle_mm), motion.curve().tangent(middle_mm));
        let Some(left) = Vec3::new(-ahead.y, ahead.x, 0.0).try_normalize(1e-9) else { continue };
        let feed_mm_s = motion.feed.mm_s;
        for point in cutter.wall(&cutters.cut(&run.map, motion, station), feed_mm_s) {
            let at = tip - left * (point.side * point.radius_mm) + Vec3::new(0.0, 0.0, point.z_mm);
            writeln!(
                out,
                "{}\t{:.4}\t{:.4}\t{:.4}\t{:.5}\t{:.1}",
                motion.line,
                unsigned_zero(at.x, 4),
                unsigned_zero(at.y, 4),
                unsigned_zero(at.z, 4),
                unsigned_zero(point.error_mm, 5),
                mm_min_from_mm_s(feed_mm_s)
            )?;
        }
    }
    Ok(())
}
