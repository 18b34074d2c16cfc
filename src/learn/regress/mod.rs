//! Numerical tools: least squares, linear and nonlinear, medians, random numbers.

pub mod levenberg_marquardt;
pub mod linear;
pub mod random;
pub mod statistics;
