//! The workpiece: a height field with provenance. In: the blank ([`blank`]; from a file: [`mesh`], [`saved`]) and the elements of the
//! toolpath ([`element`]). Out: for each cell its height and the element that last lowered it ([`field`], [`sweep()`]); and the exact region
//! that an element cleared at one height ([`region`]). The grid only nominates elements; boundaries come from the exact regions.

mod along;
pub mod blank;
mod claim;
pub mod element;
pub mod field;
mod form;
mod heights;
pub mod mesh;
pub mod past;
pub mod piece;
pub mod region;
mod runs;
pub mod saved;
pub mod sweep;
pub mod wide;

pub use along::{SLIVER_CELLS, along};
pub use blank::{Blank, Relief};
pub use claim::claim;
pub use element::{Element, Track, append_elements};
pub use field::{Field, Tile, Tiling, UNTOUCHED, redo, undo};
pub use form::Form;
pub use mesh::{Mesh, MeshError, read_stl};
pub use past::Past;
pub use piece::{Cut, Piece};
pub use region::{Disc, Region, Swept};
pub use sweep::sweep;
