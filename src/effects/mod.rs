//! The open list of effects as data: what each means, its covariates, its parameters with bounds, and where it acts.
