//! The statistical model of the readings: base coefficients times columns as the effects change them; its fit, and its
//! errors on blocks that it was not fitted on. In: [`crate::learn::dataset::samples::Data`], effects with start values.
//! Out: [`fit::Fitted`].

pub mod cross_validation;
pub mod design;
pub mod fit;
pub mod starts;
pub mod stretch_covariance;
pub mod whitening;
