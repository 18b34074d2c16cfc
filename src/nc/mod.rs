//! The NC language. In: the bytes of a program. Out: a [`Program`] (blocks and words with byte spans) and a [`Toolpath`]
//! (what the machine does, in mm, s, rad). Nothing here fails: what is not understood is kept, diagnosed and frozen.

pub mod toolpath;

pub use toolpath::{Event, Feed, FeedMode, Freeze, Move, MoveKind, PathMode, Spin, Toolpath};
