//! Finishing with a ball end: what is changed in the geometry on purpose, so that the finishing force is constant.
//!
//! In: programs as motions, the job. Out: other motions, and programs with them. Nothing here touches a feed, and
//! nothing here is covered by the proof of [`crate::rewrite::verify()`]: each command has a proof of its own.

pub mod semifinish;
pub mod stepover;
