//! Semi-finish stock adjustment (Nishida and others): the semi-finishing path is offset along the normal of the surface
//! so that the finishing force is the reference everywhere. In: the motions of both programs, the job. Out: the
//! offsets, and what they lead to.
//!
//! Unknown is the stock t_k that is left at the knots of the semi-finishing path ([`knots`]). The force F_i at a
//! finishing station follows from both programs simulated as one ([`linked`]); which knots it depends on, and with
//! which shares w_ik, is read from the ends of the engaged arcs ([`met`]). With F_i' the derivative by a uniform change
//! of stock, first by a difference and then by what each round finds (Broyden's rule, in the row of each station), each
//! round is one step of Gauss and Newton,
//!
//! minimise Σ_i ℓ_i p_i ((F_i + Σ_k J_ik Δ_k)/F − 1)² + μ Σ_k m_k Δ_k²  under bounds on t_k and on its change per mm,
//!
//! J_ik = F_i' w_ik at first, solved by [`least_squares`] and simulated again. Kept is what lowers Σ ℓ_i ρ(ln F_i/F), ρ
//! square for small and linear for large errors (Huber), which p_i stands for; a round that does not is taken back and
//! the next one goes less far. The first rounds take the root of each contact by itself instead, spread over the knots
//! it depends on: smooth, and where every contact meets one knot alone already the answer. Knots that leave nothing the
//! finish meets (lead-ins, links) go with the nearest that does.
//!
//! *Convex* is said of the part, as everywhere here: a surface that bulges towards the tool, whose centre of curvature
//! lies in the material; the contact of a cutter is shorter there. Ibaraki's Eq. 2 has R as the radius of the finished
//! *concave* arc; Nishida's sentence on the petal can be read either way.

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
pub use task::{CALIBRATED_MM, CHANGE, STOCK_MM, SemifinishError, TOLERANCE_MM, Task, Wanted};
pub use written::{Written, written};
