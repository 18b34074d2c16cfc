//! The generator of hidden effects as one module, for tests: parts, hidden effects, the cut, the machine's motion, the log.
#![allow(dead_code)] // each test file uses its own part of it

pub mod cases;
pub mod cut;
pub mod hidden;
pub mod motion;
pub mod physics;
pub mod programs;
pub mod rng;
pub mod writer;
