//! The workpiece: a height field with provenance. In: the blank and the elements of the toolpath. Out: heights and, per
//! cell, the element that last lowered it ([`field`], [`sweep`]); and what an element cleared at one height, exactly
//! ([`region`]). The grid only nominates elements; boundaries come from the exact regions.

pub mod blank;
pub mod element;
pub mod field;
pub mod region;
pub mod sweep;

pub use blank::Blank;
pub use element::{Element, Track, append_elements};
pub use field::{Field, Tile, UNTOUCHED};
pub use region::{Region, region};
pub use sweep::{Form, sweep};
