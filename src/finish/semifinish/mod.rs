//! Semi-finish stock adjustment (Nishida and others): the semi-finishing path is offset along the normal of the surface so that the
//! finishing force is the reference everywhere. In: the motions of both programs, the job. Out: the offsets, and what they lead to.
//!
//! Unknown is the stock t_k that is left at the knots of the semi-finishing path ([`knots`]). The force F_i at a finishing station
//! follows from both programs simulated as one ([`linked`]); which knots it depends on, and with which shares w_ik, is read from
//! the ends of the engaged arcs ([`met`]). With F_i' the derivative by a uniform change of stock, first by a difference and then
//! by the last two rounds, each round is one step of Gauss and Newton,
//!
//! minimise Σ_i ℓ_i ((F_i + F_i' Σ_k w_ik Δ_k)/F − 1)² + μ Σ_k m_k Δ_k²  under bounds on t_k and on its change per mm,
//!
//! solved by [`least_squares`] and simulated again. The first rounds take the root of each contact by itself instead, spread over the
//! knots it depends on: smooth, and where every contact meets one knot alone already the answer. Knots that leave nothing the finish
//! meets (lead-ins, links) go with the nearest that does.

mod bench;
mod centres;
mod gouge;
pub mod knots;
mod least_squares;
mod linked;
mod met;
mod picks;
pub mod proof;
mod refused;
mod rounds;
mod seen;
mod stock;
mod task;
pub mod write;
mod unknowns;
mod written;

pub use gouge::{Gouge, gouge};
pub use met::Sample;
pub use rounds::{Answer, Round, solve};
pub use seen::Seen;
pub use task::{CALIBRATED_MM, CHANGE, STOCK_MM, SemifinishError, Simulate, TOLERANCE_MM, Task, Wanted};
pub use written::{Written, written};
