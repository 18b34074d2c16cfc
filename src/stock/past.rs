//! What sweeps overwrote in a tile. In: groups of cells as they were before they were lowered, in order. Out: the tile as it
//! was at any mark, and as it is again: going back, a group and the cells it stands for change places, the last first;
//! going forward they change places once more.

#![allow(clippy::inline_always)] // called from within loops over lanes

use super::field::Tile;
use super::wide::MOST_LANES;

/// A group of cells side by side, as they were before or after they were lowered.
#[derive(Debug, Clone, Copy)]
struct Kept {
    first: u32,
    count: u32,
    heights: [f32; MOST_LANES],
    ids: [u32; MOST_LANES],
}

/// Groups of cells that a sweep is expected to lower.
const ROOM: usize = 32;

/// What a tile overwrote.
#[derive(Debug, Clone, Default)]
pub struct Past {
    /// Is it kept?
    pub on: bool,
    kept: Vec<Kept>,
}

impl Past {
    /// Keeps from now on, with room for so many sweeps.
    pub fn begin(&mut self, sweeps: usize) {
        self.on = true;
        self.kept.reserve(ROOM * sweeps);
    }
    /// How much was overwritten so far: a mark to go back to.
    pub fn mark(&self) -> usize {
        self.kept.len()
    }
    /// Keeps `count` cells from `first` on.
    #[inline(always)]
    pub fn keep(&mut self, first: usize, count: usize, heights: [f32; MOST_LANES], ids: [u32; MOST_LANES]) {
        self.kept.push(Kept { first: first as u32, count: count as u32, heights, ids });
    }
}

/// Takes back what was lowered between two marks.
pub fn take_back(tile: &mut Tile, [from, to]: [usize; 2]) {
    let Tile { heights, ids, past, .. } = tile;
    past.kept[from..to].iter_mut().rev().for_each(|kept| exchange(kept, heights, ids));
}

/// Lowers again what was taken back since a mark.
pub fn make_again(tile: &mut Tile, from: usize) {
    let Tile { heights, ids, past, .. } = tile;
    past.kept[from..].iter_mut().for_each(|kept| exchange(kept, heights, ids));
}

fn exchange(kept: &mut Kept, heights: &mut [f32], ids: &mut [u32]) {
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
