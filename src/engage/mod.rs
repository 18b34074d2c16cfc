//! Cutter–workpiece engagement. In: toolpath, tools, stock. Out: an [`EngagementMap`]: for every feed move the stations,
//! each with the engaged arcs of the cutter's slices and the removal rate.
//!
//! The height field of [`crate::stock`] only nominates earlier moves ([`nominate`]); the arcs are worked out exactly from
//! what those moves swept ([`arcs`], [`cover`]). [`batch`] runs both over the tiles of the stock, [`stations`] joins sampled points
//! into stations, [`simulate`] is the loop over the program.

pub mod again;
pub mod arcs;
pub mod batch;
pub mod between;
pub mod cache;
pub mod cover;
pub mod cutter;
mod cylinder;
pub mod finish;
pub mod gaps;
pub mod hazards;
mod inside;
mod joints;
pub mod key;
pub mod map;
pub mod nominate;
pub mod options;
pub mod outcome;
mod outline;
mod rings;
pub mod scene;
pub mod simulate;
pub mod stations;
pub mod view;
pub mod workpiece;

pub use again::Again;
pub use map::{EngagedArc, EngagementMap, Event, EventKind, Station, StationFlags};
pub use options::{EngageError, Loader, Options};
pub use simulate::{engage, engage_again, engage_and_keep};
