//! The data of a diagnosis: one row per sample with reading, weight, covariates and the columns that base coefficients
//! multiply. In: an aligned log, or a table of steady cuts. Out: [`samples::Data`].

pub mod axes_on_meter;
pub mod binning;
pub mod covariates;
pub mod errors;
pub mod highest_feeds;
pub mod layers;
pub mod mean_forces;
pub mod measured_feed;
pub mod measured_speed;
pub mod placed_log;
pub mod samples;
pub mod section;
pub mod steady_cuts;
pub mod steady_table;
pub mod table_data;
pub mod weights;
