//! Semi-finish stock adjustment (Nishida and others): the semi-finishing path is offset along the surface normal so
//! that the finishing force equals a reference everywhere. In: the motions of both programs, the job. Out: the offsets,
//! with loads before and after.
//!
//! Unknowns are the stock t_k left at the knots of the semi-finishing path ([`knots`]). The force F_i in a stretch of
//! the finish of length ℓ_i follows from both programs simulated as one ([`linked`]). The knots it depends on, with
//! weights w_ik, follow from the ends of the engaged arcs ([`met_stock`]). Each round is one Gauss–Newton step with
//! reference force F,
//!
//! minimise Σ_i ℓ_i p_i ((F_i + Σ_k J_ik Δ_k)/F − 1)² + μ Σ_k m_k Δ_k²  under bounds on t_k and on its change per mm,
//!
//! solved by [`least_squares`] and simulated again. J_ik = F_i' w_ik at first, with F_i' from a simulated uniform
//! change of stock; then each row is updated from what the round found (Broyden 1965, Schubert 1970). A round is
//! accepted if it lowers Σ ℓ_i ρ(ln F_i/F), with a ρ that is quadratic for small errors and bounded for large ones, for which
//! p_i are the weights; otherwise it is discarded and the next step is shorter. The first rounds solve each contact
//! separately and average over the knots it depends on, which is robust, and exact if every contact depends on one
//! knot. Knots whose stock the finish does not cut (lead-ins, links) take the offset of the nearest one that it does.
//!
//! *Convex* describes the part: a surface that bulges towards the tool, with its centre of curvature in the material;
//! the contact of a cutter is shorter there. In Eq. 2 of Ibaraki R is the radius of the finished *concave* arc;
//! Nishida's sentence on the petal is ambiguous.

mod centres;
mod gouge;
pub mod knots;
mod least_squares;
mod linked;
mod met_stock;
mod pass_spacing;
mod preconditions;
mod programs;
pub mod proof;
mod rounds;
mod sparse;
mod stock;
mod stretch_loads;
mod task;
mod unknowns;
mod walk;
pub mod write;
mod written;

pub use gouge::{Gouge, gouge};
pub use met_stock::Sample;
pub use rounds::{Answer, Round, solve};
pub use stretch_loads::StretchLoads;
pub use task::{CALIBRATED_MM, CHANGE, STOCK_MM, SemifinishError, TOLERANCE_MM, Task, Wanted};
pub use written::{Written, written};
