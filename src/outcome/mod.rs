//! What a job found about one program, as plain data: filled by [`crate::job`], read by [`crate::report`] and by the commands, in neither
//! of them. In: program, setup, engagement, feeds. Out: a [`ProgramRun`] with its loads at every station and those over their limits.

pub mod answers;
pub mod over_limits;
mod program_run;
pub mod station_loads;

pub use answers::Answers;
pub use over_limits::LIMIT_TOLERANCE;
pub use program_run::{Check, Infeasible, ProgramRun, Switched, Written};
pub use station_loads::{StationLoads, each_station};
