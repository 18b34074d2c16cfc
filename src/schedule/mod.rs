//! From caps to feeds. In: a [`Problem`] (the path with its caps, floors and programmed feeds) and the machine. Out: a
//! [`Schedule`]: feeds per piece, what bound them and at what price, realised speeds and times.

pub mod idle_limits;
pub mod five_diagonals;
pub mod budget;
pub mod caps;
pub mod check;
pub mod cone;
pub mod control;
pub mod convex;
pub mod corner;
pub mod cutters;
pub mod cycle_time;
pub mod feed_segments;
pub mod force_rate;
pub mod history;
pub mod interior_point;
pub mod kept;
pub mod kinds_of_cut;
pub mod feed_marks;
pub mod operations;
pub mod optimum;
pub mod exact_pass;
pub mod prices;
pub mod problem;
pub mod ramps;
pub mod realise;
pub mod reference;
pub mod confidence;
pub mod rules;
pub mod solve;
pub mod stress;
pub mod track;
pub mod wear;
pub mod f_words;

pub use caps::{problem, problem_after};
pub use kept::Standing;
pub use problem::{Bound, Conflict, FeedPiece, Kept, Node, Problem, Realised, Schedule};
pub use realise::{as_programmed, realise};
pub use solve::{Options, Room, explain, feeds, solve};
