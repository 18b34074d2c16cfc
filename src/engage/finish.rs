//! Which stations leave the finished surface. In: the final provenance of the cells. Out: the flag `final_surface` of the
//! stations whose piece of path lies nearest to a cell their move was the last to lower.

use super::map::EngagementMap;
use crate::stock::{Element, Field, Track, UNTOUCHED};

/// Sets the flag.
pub fn mark_final_surface(map: &mut EngagementMap, elements: &[Element], fields: &[Field]) {
    for tile in fields.iter().flat_map(|field| &field.tiles) {
        for j in tile.core[1][0]..tile.core[1][1] {
            let y = tile.first[1] + j as f64 * tile.cell[1];
            for i in tile.core[0][0]..tile.core[0][1] {
                let k = j * tile.size[0] + i;
                // A cell cut through to the bottom leaves no surface.
                if tile.ids[k] == UNTOUCHED || tile.heights[k] <= tile.floor {
                    continue;
                }
                let element = &elements[tile.ids[k] as usize];
                let along = nearest_along(&element.track, [tile.first[0] + i as f64 * tile.cell[0], y]);
                mark(map, element, element.from_mm + along);
            }
        }
    }
}

fn mark(map: &mut EngagementMap, element: &Element, s_mm: f64) {
    let range = &map.of_move[element.move_id.ix()];
    let stations = &mut map.stations[range.start as usize..range.end as usize];
    let index = stations.partition_point(|station| station.to_mm < s_mm).min(stations.len().saturating_sub(1));
    if let Some(station) = stations.get_mut(index) {
        station.flags.final_surface = true;
    }
}

/// Distance along a track of its point nearest to `p` in the plane, mm.
fn nearest_along(track: &Track, p: [f64; 2]) -> f64 {
    match *track {
        Track::Line { from, to } => {
            let delta = to - from;
            let square = delta.x * delta.x + delta.y * delta.y;
            if square < 1e-18 {
                return 0.0;
            }
            let t = ((p[0] - from.x) * delta.x + (p[1] - from.y) * delta.y) / square;
            t.clamp(0.0, 1.0) * delta.norm()
        }
        Track::Arc { centre, start, sweep, .. } => {
            let angle = (p[1] - centre[1]).atan2(p[0] - centre[0]);
            let ahead = ((angle - start) * sweep.signum()).rem_euclid(std::f64::consts::TAU);
            (ahead / sweep.abs()).min(1.0) * track.length()
        }
    }
}
