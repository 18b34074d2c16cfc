//! The program over time: what the machine should be doing when, what is cut there, and what would be under another
//! geometry, runout or acceleration. In: toolpath, engagement, job. Out: [`timeline::Timeline`] and what goes with its
//! spots.

pub mod clock;
pub mod declared;
pub mod motion;
pub mod other_geometry;
pub mod peak_forces;
pub mod runout_grid;
pub mod simulated;
pub mod timeline;
mod turned;
pub mod variant;
