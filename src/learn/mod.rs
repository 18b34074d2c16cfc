//! Measured data → residual → named effect → process model.
