//! One text, one feed: a block in a loop, or one F word of a cycle, is written once and drives many moves. In: the moves, and the
//! block whose F word drives each move of a cycle. Out: [`Move::shared`], the same number for all moves of one such text.
//!
//! A block executed several times is one text; so is the F word of a drilling cycle repeated at several positions. Where
//! both meet (a cycle in a subprogram) the groups are joined.

use std::collections::BTreeMap;

use crate::ids::BlockId;
use crate::nc::toolpath::{Move, MoveKind};

/// Numbers the groups. `cycles[m]` is the block whose F word drives cycle move `m`.
pub(super) fn number(moves: &mut [Move], cycles: &[(u32, BlockId)]) {
    let repeated: std::collections::BTreeSet<u32> =
        moves.iter().filter(|m| m.instance > 0 && m.kind == MoveKind::Feed).map(|m| m.block.0).collect();
    if repeated.is_empty() && cycles.is_empty() {
        return;
    }
    let mut parent: Vec<u32> = Vec::new();
    let mut of_text: BTreeMap<(bool, u32), u32> = BTreeMap::new();
    let mut group_of: BTreeMap<u32, u32> = BTreeMap::new();
    let mut join = |index: u32, text: (bool, u32)| {
        let next = parent.len() as u32;
        let group = *of_text.entry(text).or_insert(next);
        if group == next {
            parent.push(next);
        }
        match group_of.get(&index) {
            Some(&other) => {
                let (a, b) = (root(&parent, group), root(&parent, other));
                parent[a.max(b) as usize] = a.min(b);
            }
            None => {
                group_of.insert(index, group);
            }
        }
    };
    for (index, motion) in moves.iter().enumerate() {
        if motion.kind == MoveKind::Feed && repeated.contains(&motion.block.0) {
            join(index as u32, (false, motion.block.0));
        }
    }
    for &(index, block) in cycles {
        join(index, (true, block.0));
    }
    for (index, group) in group_of {
        moves[index as usize].shared = Some(root(&parent, group));
        moves[index as usize].splittable = false;
    }
}

fn root(parent: &[u32], mut group: u32) -> u32 {
    while parent[group as usize] != group {
        group = parent[group as usize];
    }
    group
}
