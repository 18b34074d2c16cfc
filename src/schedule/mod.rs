//! From caps to feeds. In: a [`Problem`] (the path with its caps, floors and programmed feeds) and the machine. Out: a
//! [`Schedule`]: feeds per piece, what bound them and at what price, realised speeds and times.

pub mod acting;
pub mod band;
pub mod budget;
pub mod caps;
pub mod check;
pub mod cone;
pub mod control;
pub mod convex;
pub mod corner;
pub mod cutters;
pub mod cycle;
pub mod feed_segments;
pub mod force_rate;
pub mod history;
pub mod interior;
pub mod kept;
pub mod kinds;
pub mod marks;
pub mod operations;
pub mod optimum;
pub mod pass;
pub mod prices;
pub mod problem;
pub mod ramps;
pub mod realise;
pub mod reference;
pub mod robust;
pub mod rules;
pub mod solve;
pub mod stress;
pub mod track;
pub mod wear;
pub mod words;

pub use caps::{problem, problem_after};
pub use kept::Standing;
pub use problem::{Bound, Conflict, FeedPiece, Kept, Node, Problem, Realised, Schedule};
pub use realise::{as_programmed, realise};
pub use solve::{Options, Room, explain, feeds, solve};
