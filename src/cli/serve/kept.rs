//! Engagement in memory: what was simulated for a program is not simulated again while its moves, tools, stock and resolution stay
//! (limits and coefficients are none of these). In: the hooks of the pipeline. Out: the map, and the stock that the page shows.

use std::cell::{Cell, RefCell};

use crate::engage::EngagementMap;
use crate::engage::cache::Key;
use crate::job::Keep;
use crate::path::Vec3;
use crate::report::Relief;
use crate::stock::Piece;

/// Simulations kept: a person goes back and forth between a few programs. One of a million blocks takes some 200 MB.
const MOST: usize = 4;

/// A simulation.
#[derive(Debug)]
struct Simulated {
    key: Key,
    map: EngagementMap,
    stock: Vec<Relief>,
}

/// The simulations of a process, the last one that was used at the end.
#[derive(Debug, Default)]
pub struct StoredSimulations(Vec<Simulated>);

impl StoredSimulations {
    /// Runs `work` with the hooks; says with its result what stock it leaves, and whether nothing was simulated for it.
    pub fn with<T>(&mut self, work: impl FnOnce(Keep) -> T) -> (T, Vec<Relief>, bool) {
        let known = RefCell::new(std::mem::take(&mut self.0));
        let (stock, recalled) = (RefCell::default(), Cell::new(false));
        let recall = |key: &Key| {
            let mut known = known.borrow_mut();
            let place = known.iter().position(|one| one.key == *key)?;
            let found = known.remove(place);
            let map = found.map.clone();
            stock.replace(found.stock.clone());
            recalled.set(true);
            known.push(found);
            Some(map)
        };
        let remember = |key: &Key, map: &EngagementMap| {
            let mut known = known.borrow_mut();
            known.push(Simulated { key: *key, map: map.clone(), stock: stock.borrow().clone() });
            let over = known.len().saturating_sub(MOST);
            known.drain(..over);
        };
        let take = |pieces: Vec<(Piece, Vec3)>| {
            stock.replace(pieces.iter().map(|(piece, _)| Relief::of(&piece.field)).collect());
        };
        let done = work(Keep { recall: Some(&recall), remember: Some(&remember), stock: Some(&take) });
        self.0 = known.into_inner();
        (done, stock.into_inner(), recalled.get())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(kept: &mut StoredSimulations, key: u8) -> (Option<f64>, bool) {
        let map = EngagementMap { removed_mm3: key.into(), ..EngagementMap::default() };
        let (found, _, recalled) = kept.with(|keep| {
            let found = keep.recall.unwrap()(&[key; 32]).map(|map| map.removed_mm3);
            if found.is_none() {
                keep.remember.unwrap()(&[key; 32], &map);
            }
            found
        });
        (found, recalled)
    }

    #[test]
    fn the_last_simulations_are_kept() {
        let mut kept = StoredSimulations::default();
        assert_eq!(run(&mut kept, 1), (None, false));
        assert_eq!(run(&mut kept, 1), (Some(1.0), true));
        for key in 2..=4 {
            assert!(!run(&mut kept, key).1);
        }
        // The first was used again, so the second is the one that goes.
        assert!(run(&mut kept, 1).1);
        assert!(!run(&mut kept, 5).1);
        assert!(run(&mut kept, 1).1 && !run(&mut kept, 2).1);
    }
}
