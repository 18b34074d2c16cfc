//! From caps to feeds. In: a [`Problem`] (the path with its caps, floors and programmed feeds) and the machine. Out: a
//! [`Schedule`]: feeds per piece, what bound them and at what price, realised speeds and times.
//!
//! | what | files |
//! |---|---|
//! | which limits and modes hold where | [`rules`], [`operations`], [`kinds_of_cut`], [`reference`](mod@reference), [`idle_limits`] |
//! | from limits to caps and floors | [`problem`](mod@problem), [`caps`], [`cutters`], [`known_loads`], [`history`], [`confidence`], [`not_raised`], [`ramps`], [`force_rate`], [`budget`], [`wear`] |
//! | the continuous optimum | [`track`], [`corner`], [`exact_pass`], [`optimum`], [`interior_point`], [`five_diagonals`], [`convex`], [`cone`], [`check`] |
//! | F words | [`solve`](mod@solve), [`feed_segments`], [`f_words`], [`prices`], [`holders`](mod@holders) |
//! | the model of the control | [`control`], `first_period`, [`realise`](mod@realise), [`cycle_time`] |
//! | further answers for the report | [`feed_marks`], [`stress`] |

pub mod budget;
pub mod caps;
pub mod check;
pub mod cone;
pub mod confidence;
pub mod control;
pub mod convex;
pub mod corner;
pub mod cutters;
pub mod cycle_time;
pub mod exact_pass;
pub mod f_words;
pub mod feed_marks;
pub mod feed_segments;
mod first_period;
pub mod five_diagonals;
pub mod force_rate;
pub mod history;
pub mod holders;
pub mod idle_limits;
pub mod interior_point;
pub mod not_raised;
pub mod kinds_of_cut;
pub mod known_loads;
pub mod operations;
pub mod optimum;
pub mod prices;
pub mod problem;
pub mod ramps;
pub mod realise;
pub mod reference;
pub mod rules;
pub mod solve;
pub mod stress;
pub mod track;
pub mod wear;

pub use caps::{problem, problem_after};
pub use not_raised::EarlierOutput;
pub use problem::{Bound, Conflict, FeedPiece, Node, NotRaised, Problem, Realised, Schedule};
pub use realise::{as_programmed, realise};
#[cfg(feature = "rooms")]
pub use solve::solve;
pub use solve::{Growth, Options, explain, feeds};
