//! Stations that leave the surface of the finished part. In: for each cell the move that was the last to lower it. Out: the flag
//! `final_surface` of the station of that move that lies nearest to the cell.

use super::map::EngagementMap;
use crate::ids::MoveId;
use crate::stock::{Element, Field, Tile, Track, UNTOUCHED};
use rayon::prelude::*;

/// Sets the flag.
pub fn mark_final_surface(map: &mut EngagementMap, elements: &[Element], fields: &[Field]) {
    let tiles: Vec<&Tile> = fields.iter().flat_map(|field| &field.tiles).collect();
    let found: Vec<Vec<u32>> = tiles.par_iter().map(|tile| stations_of(map, elements, tile)).collect();
    for index in found.into_iter().flatten() {
        map.stations[index as usize].flags.final_surface = true;
    }
}

/// The stations that leave the surface of a tile; some several times.
fn stations_of(map: &EngagementMap, elements: &[Element], tile: &Tile) -> Vec<u32> {
    let mut found = Vec::new();
    for j in tile.core[1][0]..tile.core[1][1] {
        let y = tile.first[1] + j as f64 * tile.cell[1];
        for i in tile.core[0][0]..tile.core[0][1] {
            let k = j * tile.size[0] + i;
            // A cell cut through to the bottom leaves a wall where one beside it stands, and no surface elsewhere.
            let is_through = |k: usize| tile.heights[k] <= tile.floor;
            if tile.ids[k] == UNTOUCHED || (is_through(k) && beside(tile, [i, j]).all(is_through)) {
                continue;
            }
            let element = &elements[tile.ids[k] as usize];
            if element.move_id == MoveId::BEFORE {
                continue;
            }
            let along = nearest_along(&element.track, [tile.first[0] + i as f64 * tile.cell[0], y]);
            let station = station_at(map, element, element.from_mm + along);
            if station != found.last().copied() {
                found.extend(station);
            }
        }
    }
    found
}

/// The cells beside a cell of a tile.
fn beside(tile: &Tile, [i, j]: [usize; 2]) -> impl Iterator<Item = usize> {
    let about = |at: usize, size: usize| at.saturating_sub(1)..(at + 2).min(size);
    let [nx, ny] = tile.size;
    about(j, ny).flat_map(move |j| about(i, nx).map(move |i| j * nx + i))
}

/// The station of an element's move at a distance along it.
fn station_at(map: &EngagementMap, element: &Element, s_mm: f64) -> Option<u32> {
    let range = map.of_move[element.move_id.ix()].clone();
    let stations = &map.stations[range.start as usize..range.end as usize];
    let last = stations.len().checked_sub(1)?;
    Some(range.start + stations.partition_point(|station| station.to_mm < s_mm).min(last) as u32)
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
