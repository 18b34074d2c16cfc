//! Long-term regulation of the cutting load over the life of a tool (Ibaraki, Shimizu, Matsubara). In: what a program cuts, the
//! wear law of its tool, readings of force or power at check points. Out: where to measure, the wear index at each reading, its trend, when the
//! tool will be worn out, and the pace of wear with which it lasts.
//!
//! ```text
//! program, simulated ─check_points─▶ steady cuts to read at
//! reading ─index─▶ wear index ─exponent, trend─▶ line with its uncertainty ─regulation─▶ pace of wear ─▶ feeds (schedule::budget)
//! ```

pub mod check_points;
pub mod exponent;
pub mod index;
pub mod regulation;
pub mod trend;
