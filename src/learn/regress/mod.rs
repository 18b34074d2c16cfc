//! Numbers without a meaning of their own: least squares, linear and not, medians, and random numbers.

pub mod levenberg_marquardt;
pub mod linear;
pub mod random;
pub mod statistics;
