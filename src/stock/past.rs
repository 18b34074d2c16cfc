//! Undo log of a tile. In: groups of cells as they were before a sweep lowered them, in order. Out: the tile as it was at any mark, and again
//! as it is. To undo, each stored group is swapped with its cells, last first; to redo, they are swapped once more.

#![allow(clippy::inline_always)] // called from within loops over lanes

use super::wide::MOST_LANES;

/// A group of neighbouring cells of one row, as they were before (or, once undone, after) they were lowered.
#[derive(Debug, Clone, Copy)]
struct Overwritten {
    first: u32,
    count: u32,
    heights: [f32; MOST_LANES],
    ids: [u32; MOST_LANES],
}

/// Groups of cells that a sweep is expected to lower.
const ROOM: usize = 32;

/// The undo log.
#[derive(Debug, Clone, Default)]
pub struct Past {
    /// Are overwritten cells recorded?
    pub on: bool,
    kept: Vec<Overwritten>,
}

impl Past {
    /// Records from now on, with room for this many sweeps.
    pub fn begin(&mut self, sweeps: usize) {
        self.on = true;
        self.kept.reserve(ROOM * sweeps);
    }
    /// Number of groups recorded so far, as a mark to undo to.
    pub fn mark(&self) -> usize {
        self.kept.len()
    }
    /// Records `count` cells from `first` on.
    #[inline(always)]
    pub fn keep(&mut self, first: usize, count: usize, heights: [f32; MOST_LANES], ids: [u32; MOST_LANES]) {
        self.kept.push(Overwritten { first: first as u32, count: count as u32, heights, ids });
    }
    /// Undoes what was recorded between two marks.
    pub fn undo(&mut self, heights: &mut [f32], ids: &mut [u32], [from, to]: [usize; 2]) {
        self.kept[from..to].iter_mut().rev().for_each(|kept| exchange(kept, heights, ids));
    }
    /// Redoes what was undone since a mark.
    pub fn redo(&mut self, heights: &mut [f32], ids: &mut [u32], from: usize) {
        self.kept[from..].iter_mut().for_each(|kept| exchange(kept, heights, ids));
    }
}

fn exchange(kept: &mut Overwritten, heights: &mut [f32], ids: &mut [u32]) {
    let (heights, ids) = (&mut heights[kept.first as usize..], &mut ids[kept.first as usize..]);
    let count = kept.count as usize;
    if count == MOST_LANES {
        // Of a size known beforehand: exchanged by registers.
        heights[..MOST_LANES].swap_with_slice(&mut kept.heights);
        ids[..MOST_LANES].swap_with_slice(&mut kept.ids);
    } else {
        heights[..count].swap_with_slice(&mut kept.heights[..count]);
        ids[..count].swap_with_slice(&mut kept.ids[..count]);
    }
}

#[cfg(test)]
mod tests {
    use crate::machine::{Box3, Profile};
    use crate::path::Vec3;
    use crate::stock::{Field, Form, Tile, Track, redo, sweep, undo};

    #[test]
    fn sweeps_are_taken_back_and_made_again_bit_for_bit() {
        let extent = Box3 { min: Vec3::zeros(), max: Vec3::new(12.0, 9.7, 5.0) };
        let mut tile = Field::new(extent, 0.1, |x, y| 4.0 + 0.1 * x - 0.05 * y).tiles.swap_remove(0);
        tile.past.on = true;
        let forms = [Profile::flat(3.0, 9.0), Profile::ball(4.0, 9.0), Profile::cone(6.0, 0.5, 1.2, 9.0)];
        let mut states = Vec::new();
        for k in 0..30 {
            let a = f64::from(k);
            let at =
                |a: f64| Vec3::new(6.0 + 5.0 * (a * 1.7).sin(), 5.0 + 4.0 * (a * 2.3).cos(), 3.0 + (a * 5.1).sin());
            let (line, z) = (Track::Line { from: at(a), to: at(a + 0.3) }, 2.0 - 0.03 * a);
            let arc = Track::Arc { centre: [6.0, 5.0], z, radius: [3.0; 2], start: a, sweep: 2.0 };
            let track = if k % 3 == 0 { arc } else { line };
            states.push((tile.past.mark(), tile.heights.clone(), tile.ids.clone()));
            sweep(&mut tile, (&track, false), &Form::new(&forms[k as usize % 3]), k as u32);
        }
        assert!(states.windows(2).any(|two| two[0].1 != two[1].1));
        let done = (tile.past.mark(), tile.heights.clone(), tile.ids.clone());
        let is_as = |tile: &Tile, (_, heights, ids): &(usize, Vec<f32>, Vec<u32>)| {
            tile.heights.iter().zip(heights).all(|(a, b)| a.to_bits() == b.to_bits()) && tile.ids == *ids
        };
        let mut at = done.0;
        for (k, state) in states.iter().enumerate().rev() {
            undo(&mut tile, [state.0, at]);
            at = state.0;
            assert!(is_as(&tile, state), "back to before sweep {k}");
        }
        redo(&mut tile, 0);
        assert!(is_as(&tile, &done), "and again");
    }
}
