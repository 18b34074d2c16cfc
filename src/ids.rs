//! Typed indices. In: a number. Out: [`BlockId`] or [`MoveId`], so that the index of a block cannot be used for a move.

/// Index of a block (one line of text) in a [`crate::nc::Program`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlockId(pub u32);

/// Index of a move in a [`crate::nc::Toolpath`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MoveId(pub u32);

impl BlockId {
    /// As an index.
    pub fn ix(self) -> usize {
        self.0 as usize
    }
}

impl MoveId {
    /// The move of a cut that an earlier program made.
    pub const BEFORE: Self = Self(u32::MAX);
    /// As an index.
    pub fn ix(self) -> usize {
        self.0 as usize
    }
}
