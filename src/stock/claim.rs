//! Provenance of cells that several cuts leave at one height. In: a tile, the cut that passed last. Out: near the edge of that cut, each cell
//! names the cut in which it lies deepest, because that cut made the wall beside it. (An arc that leads onto a wall lowers the cells there
//! first, although it ends short of the wall by less than a cell.)
//!
//! Only level sweeps of flat ends leave several cuts at one height; with other outlines the deeper cut leaves the lower cell.

use super::element::Track;
use super::field::{Tile, UNTOUCHED};
use super::form::Form;
use super::region::{Region, Swept};
use super::runs::{Grid, Run, level_runs};
use super::wide::MOST_LANES;

/// Width of the strip inside its edge in which a cut claims cells, in cells: those beside a higher cell, and one more.
const BAND_CELLS: f64 = 2.5;
/// How far away something stands that counts as beside a cell, in cells.
const AWAY: usize = 3;
/// By how much deeper a cell must lie, mm.
const DEEPER_MM: f64 = 1e-6;
/// Height above a floor at which depths are compared, mm.
const ABOVE_MM: f64 = 1e-6;

/// Claims cells for cut `id`. `cut` gives the track and outline of a cut. `joined`: the cut continues the one before, whose cells keep their
/// provenance.
pub fn claim<'a>(tile: &mut Tile, id: u32, joined: bool, cut: impl Fn(u32) -> (&'a Track, &'a Form)) {
    let (track, form) = cut(id);
    let (low, high) = track.bounds();
    let level = (low.z as f32).max(tile.floor);
    if !form.is_flat() || high.z - low.z > 0.0 || level >= tile.highest {
        return;
    }
    let z = f64::from(level) + ABOVE_MM;
    let Some(own) = Swept::new(track, form).at(z) else { return };
    let band = BAND_CELLS * tile.cell[0].max(tile.cell[1]);
    let grid = Grid::of(tile);
    let columns = tile.window([low.x - form.radius, low.y - form.radius], [high.x + form.radius, high.y + form.radius]);
    for [outer, inner] in level_runs(&grid, columns, track, joined, [form.radius, form.radius - band]) {
        let Some(Run { cells, .. }) = outer else { continue };
        let hole = inner.map_or(cells.end..cells.end, |inner| inner.cells);
        for k in (cells.start..hole.start.max(cells.start)).chain(hole.end.max(cells.start)..cells.end) {
            let tied = tile.heights[k] == level && tile.ids[k] != id && tile.ids[k] != UNTOUCHED;
            if tied && stands_beside(tile, k, level) {
                let place = grid.place(k);
                let depth = -own.distance(place);
                if depth > 0.0 && depth < band && depth > depth_in(cut(tile.ids[k]), z, place) + DEEPER_MM {
                    take(tile, k, id);
                }
            }
        }
    }
}

/// Is a cell a few cells away along X or Y higher than `level`? Beyond the border of the tile this is assumed.
fn stands_beside(tile: &Tile, cell: usize, level: f32) -> bool {
    let (column, row) = (cell % tile.size[0], cell / tile.size[0]);
    if column < AWAY || row < AWAY || column + AWAY >= tile.size[0] || row + AWAY >= tile.size[1] {
        return true;
    }
    let rows = AWAY * tile.size[0];
    [cell - AWAY, cell + AWAY, cell - rows, cell + rows].iter().any(|k| tile.heights[*k] > level)
}

fn depth_in((track, form): (&Track, &Form), z: f64, place: [f64; 2]) -> f64 {
    let region: Option<Region> = Swept::new(track, form).at(z);
    region.map_or(f64::NEG_INFINITY, |region| -region.distance(place))
}

fn take(tile: &mut Tile, cell: usize, id: u32) {
    if tile.past.on {
        let (mut heights, mut ids) = ([0.0; MOST_LANES], [0; MOST_LANES]);
        (heights[0], ids[0]) = (tile.heights[cell], tile.ids[cell]);
        tile.past.keep(cell, 1, heights, ids);
    }
    tile.ids[cell] = id;
}
