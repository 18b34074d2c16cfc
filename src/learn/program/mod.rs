//! The program over time: predicted motion and engagement, as declared and with another geometry, runout or
//! acceleration. In: toolpath, engagement, job. Out: [`timeline::Timeline`] and further data for its spots.

pub mod clock;
pub mod declared;
pub mod motion;
pub mod other_geometry;
pub mod peak_forces;
pub mod runout_grid;
pub mod simulated;
pub mod timeline;
mod turned;
pub mod unchanged_moves;
pub mod variant;
