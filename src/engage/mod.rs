//! Cutter–workpiece engagement. In: toolpath, tools, stock. Out: an [`EngagementMap`]: for every feed move the stations,
//! each with the engaged arcs of the cutter's slices and the removal rate.

pub mod map;

pub use map::{EngagedArc, EngagementMap, Event, EventKind, Station, StationFlags};
