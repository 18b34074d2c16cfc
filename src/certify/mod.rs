//! The checker of certificates. In: the written program as the control reads it, the setup, a certificate. Out: that no load exceeds
//! its limit for any coefficients of the stated ellipsoid, any stock within its uncertainty and any override up to 100 %; or where and
//! why that is not proven.
//!
//! It is small, and shares no code with what plans feeds ([`crate::schedule`]) or works out loads ([`crate::force`]): the mechanics are
//! implemented a second time here, with outward rounding. Everything that can be worked out is worked out and not read from the certificate:
//! feeds, speeds, lengths and places come from the program through the interpreter; limits, tools and coefficients from the setup; stations must
//! cover each feed move without a gap.
//!
//! What it has to trust:
//! * the interpreter and the reader of the setup, which the rest of Feedwright uses too;
//! * **the engaged arcs**, which the simulation of the written program found with the stock grown by its uncertainty. Any part of them may be
//!   missing: a smaller stock and every lesser engagement are covered. [`witness`] looks for material outside of them with a coarse
//!   simulation of its own;
//! * the linear edge model on rings with one arc each (the edge winds through a ring; its direction and chip are those at its middle), and
//!   that the coefficients lie in their ellipsoid.

pub mod check;
pub mod cutter;
pub mod ellipsoid;
pub mod interval;
pub mod limits;
pub mod peak;
pub mod place;
pub mod text;
pub mod witness;

pub use check::{Proven, Refusal, check};
pub use limits::Basis;
pub use text::Certificate;
