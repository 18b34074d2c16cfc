//! Passes of varying step-over. In: the mesh of a surface, the job, a reference force and a scallop limit. Out: the passes of a ball
//! or bull-nose end over it, as motions and as an NC program, with what they are predicted to do.
//!
//! [`surface`] reads the mesh, [`drop`] lowers the tool onto it.

pub mod drop;
pub mod section;
pub mod shape;
pub mod surface;

pub use drop::{Contact, Dropper};
pub use shape::Shape;
pub use surface::Surface;
