//! Finishing with a constant force: the only room that changes geometry.
//!
//! In: programs as motions or a mesh, the job. Out: programs with other motions. They are not covered by the proof of
//! [`crate::rewrite::verify()`]: each command has a proof or check of its own.

pub mod semifinish;
pub mod stepover;
