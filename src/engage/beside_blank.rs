//! Stations in air where a clamp may stand. In: the stations of a map, the extents of the blanks. Out: the flag `beside_blank` of stations in
//! air whose cutter is below the top of the blanks and reaches beyond the outline of each: that is where vice jaws and clamps are.

use super::map::EngagementMap;
use crate::machine::Box3;
use crate::nc::{Move, Toolpath};
use crate::path::Vec3;

/// Sets the flag. `placed`: shift of a move into the frame of the extents, and the radius of its cutter, mm.
pub fn mark_beside_blank(
    map: &mut EngagementMap,
    path: &Toolpath,
    extents: &[Box3],
    placed: &dyn Fn(&Move) -> (Vec3, f64),
) {
    for station in map.stations.iter_mut().filter(|station| station.flags.clear_air) {
        let motion = &path.moves[station.move_id.ix()];
        let (curve, (shift, radius_mm)) = (motion.curve(), placed(motion));
        let middle_mm = 0.5 * (station.from_mm + station.to_mm);
        let places = [station.from_mm, middle_mm, station.to_mm].map(|s_mm| curve.point(s_mm) + shift);
        station.flags.beside_blank = places.iter().any(|tip| is_beside(extents, tip, radius_mm));
    }
}

fn is_beside(extents: &[Box3], tip: &Vec3, radius_mm: f64) -> bool {
    let within = |blank: &Box3| {
        (0..2).all(|axis| tip[axis] - radius_mm >= blank.min[axis] && tip[axis] + radius_mm <= blank.max[axis])
    };
    extents.iter().any(|blank| tip.z < blank.max.z) && !extents.iter().any(within)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beside_is_below_the_top_and_beyond_the_outline() {
        let blank = [Box3 { min: Vec3::new(0.0, 0.0, -20.0), max: Vec3::new(50.0, 40.0, 0.0) }];
        for (x, z, beside) in
            [(-8.0, -1.0, true), (4.9, -1.0, true), (5.0, -1.0, false), (45.1, -1.0, true), (-8.0, 0.0, false)]
        {
            assert_eq!(is_beside(&blank, &Vec3::new(x, 20.0, z), 5.0), beside, "X{x} Z{z}");
        }
    }
}
