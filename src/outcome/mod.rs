//! The result of a run over one program, as plain data between [`crate::job`], which fills it, and [`crate::report`] and the commands, which read
//! it. In: program, setup, engagement, feeds. Out: a [`ProgramRun`], its loads at every station, and loads over their limits.

pub mod answers;
pub mod over_limits;
mod program_run;
pub mod station_loads;

pub use answers::Answers;
pub use over_limits::LIMIT_TOLERANCE;
pub use program_run::{Check, Infeasible, ProgramRun, Switched, Written};
pub use station_loads::{StationLoads, each_station};
