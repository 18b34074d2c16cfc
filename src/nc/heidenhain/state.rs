//! What only controls of Heidenhain remember. In: changed by the files of this folder. Out: read by them.

use crate::diag::Span;
use crate::nc::interp::state::FeedWord;
use crate::nc::toolpath::Move;
use crate::path::{Plane, Vec3};

/// What the controls of the family remember beside what all do.
pub(crate) struct Heidenhain {
    /// An approach that is made when the element it leads to is known.
    pub(super) approach: Option<Approach>,
    /// Centre of circles, mm, and the plane of arcs about it.
    pub(super) pole: Vec3,
    pub(super) pole_plane: Plane,
    /// The plane across the axis of the tool.
    pub(super) tool_plane: Plane,
    /// Frames that are not followed, a bit for each [`LostFrame`](super::blocks::LostFrame); the first preset.
    pub(super) lost_frames: u8,
    pub(super) first_preset: Option<f64>,
    /// The cycle defined last, and whether it is called at the end of this block.
    pub(super) cycle_number: u32,
    pub(super) call_after: bool,
    /// R0, RL, RR as G code times ten.
    pub(super) compensation_side: u16,
    /// Feed of the tool call, for FAUTO.
    pub(super) tool_feed: FeedWord,
    /// Repetitions of labels under way: depth of calls, block, times left.
    pub(super) repeats: Vec<(usize, u32, u64)>,
}

/// Form of an approach or a departure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    Tangent,
    Normal,
    Arc,
    LineAndArc,
}

/// What the block says of the way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Way {
    pub(super) shape: Shape,
    /// +1 left of the contour, −1 right, 0 not said.
    pub(super) side: f64,
    /// LEN or R, mm.
    pub(super) size: f64,
    /// CCA, rad.
    pub(super) angle: f64,
}

/// An approach that waits for the contour it leads to.
#[derive(Debug, Clone)]
pub(super) struct Approach {
    /// `None`: what the block says is not followed.
    pub(super) way: Option<Way>,
    /// Its motions but for their curves: to H, and from there.
    pub(super) moves: Box<[Move; 2]>,
    pub(super) place: Span,
}
