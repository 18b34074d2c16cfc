//! The statistical model of the readings: base coefficients times columns as effects change them, fitted, and judged on
//! blocks that it was not fitted on. In: [`crate::learn::dataset::samples::Data`], effects with starting values. Out:
//! [`fit::Fitted`].

pub mod cross_validation;
pub mod design;
pub mod fit;
pub mod starts;
pub mod stretch_covariance;
pub mod whitening;
