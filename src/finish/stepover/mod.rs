//! Finishing passes of varying step-over. In: the mesh of a surface, the job, a reference force and a scallop limit.
//! Out: the passes of a ball or bull-nose end over it, as motions and as an NC program, with predicted and simulated
//! loads.
//!
//! ```text
//! bytes ─surface─▶ triangles ─drop─▶ tip and contact at any place ─section─▶ engaged arcs, scallop
//!            ─reach─▶ allowed step-over ─least_straight, least_time─▶ lower bounds of the time
//!                                 ─passes, contour─▶ curves and feeds ─path─▶ motions ─text─▶ program ─check─▶ loads
//!                                                                                              ─around─▶ stock met beside the surface
//! ```
//! [`job`] runs all of it.

pub mod around;
pub mod bound;
pub mod check;
pub mod columns;
pub mod comparison;
pub mod contour;
pub mod drop;
pub mod earlier;
pub mod ends;
pub mod fit;
pub mod job;
pub mod layout;
pub mod least_straight;
pub mod least_time;
pub mod left;
pub mod levels;
pub mod lowered;
pub mod near;
pub mod order;
pub mod passes;
pub mod path;
pub mod plan;
pub mod preconditions;
pub mod reach;
pub mod request;
pub mod section;
pub mod shape;
pub mod steep;
pub mod surface;
pub mod text;
pub mod touch;
pub mod written;

pub use around::Around;
pub use job::{Answer, Refusal, Request, run};
pub use layout::Layout;
pub use surface::Surface;
