//! From caps to feeds. In: a [`Problem`] (the path with its caps, floors and programmed feeds) and the machine. Out: a
//! [`Schedule`]: feeds per piece, what bound them and at what price, realised speeds and times.

pub mod problem;

pub use problem::{Bound, FeedPiece, Node, Problem, Realised, Schedule};
