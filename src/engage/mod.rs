//! Cutter–workpiece engagement. In: toolpath, tools, stock. Out: an [`EngagementMap`]: for every feed move the stations,
//! each with the engaged arcs of the cutter's slices and the removal rate.
//!
//! The height field of [`crate::stock`] only finds out which earlier moves matter at a place; the arcs are worked out exactly from the
//! regions that these moves swept.
//!
//! | what | files |
//! |---|---|
//! | the loop over the program, in batches of moves | [`simulate`], `plan`, `place_samples`, `in_batches`, [`batch`], [`options`], [`workpiece`] |
//! | which earlier moves may matter at a place | [`nominate`], [`retraced`] |
//! | exact geometry at one place: rings of the cutter, and the part of each that earlier moves left | [`cutter`], [`scene`], [`arcs`], `rings`, `cylinder`, `outline`, [`cover`], `discs`, `quadric`, [`gaps`], `inside_stock` |
//! | from place to place: where to examine more closely, what may be interpolated | [`sample_view`], [`sample_outcome`], [`between_samples`], `odd_samples`, `block_ends`, `union` |
//! | the result | [`map`], [`stations`], [`final_surface`], `beside_blank`, [`hazards`] |
//! | reuse of an earlier simulation | [`reused_stations`], [`cache`], [`key`] |

pub mod arcs;
pub mod batch;
mod beside_blank;
pub mod between_samples;
mod block_ends;
pub mod cache;
pub mod cover;
pub mod cutter;
mod cylinder;
mod discs;
pub mod final_surface;
pub mod gaps;
pub mod hazards;
mod in_batches;
mod inside_stock;
pub mod key;
pub mod map;
pub mod nominate;
pub mod options;
mod odd_samples;
mod outline;
mod place_samples;
mod plan;
mod quadric;
pub mod retraced;
pub mod reused_stations;
mod rings;
pub mod sample_outcome;
pub mod sample_view;
pub mod scene;
pub mod simulate;
pub mod stations;
mod union;
pub mod workpiece;

pub use map::{EngagedArc, EngagementMap, Event, EventKind, Station, goes_on};
pub use options::{EngageError, Loader, Options};
pub use reused_stations::Again;
pub use simulate::{engage, engage_again, engage_and_keep, left_stock};
