//! From a table of steady cuts to its report. In: the columns, the rows, the drive. Out: a [`LearnReport`] and the data it rests on.
//!
//! A table that does not say when an edge was fresh can be read in two ways: a new edge with every set-up, or one edge throughout. Where the
//! second reading names wear and predicts set-ups that it has not seen better, it is taken, and said.

use crate::effects::named;
use crate::learn::dataset::layers::least_radius;
use crate::learn::dataset::samples::Data;
use crate::learn::dataset::steady_table::{COUNTED_MM, SteadyRow, numbered, way_is_counted, with_one_edge};
use crate::learn::dataset::table_data::data;
use crate::learn::diagnose::set_up_factors::set_up_factors;
use crate::learn::diagnose::{Options, diagnose};
use crate::learn::log::columns::{DataError, Frame};
use crate::learn::model::cross_validation::{by_blocks, by_kind};
use crate::learn::model::design::{FittedEffect, in_model};
use crate::learn::report::LearnReport;
use crate::machine::Spindle;

/// Learns from a table; `to_shaft` converts a meter reading to the quantity at the motor shaft.
pub fn learn_table(
    frame: &Frame,
    table: &[SteadyRow],
    to_shaft: impl Fn(f64) -> f64,
    spindle: Option<&Spindle>,
) -> Result<(LearnReport, Data), DataError> {
    let few = || DataError::Unfit("the table has too few cuts for its model: give more cuts, in more set-ups".into());
    let answer = |rows: &[SteadyRow]| -> Result<Option<(LearnReport, Data)>, DataError> {
        let found = data(frame, rows, &to_shaft, spindle)?;
        let main = main_kind(&found.kind, found.kind_names.len());
        let split = main.map_or_else(|| by_blocks(&found, "set-up"), |kind| by_kind(&found, kind, "set-up"));
        Ok(diagnose(&found, &split, &Options::default()).map(|report| (report, found)))
    };
    let declared = answer(table)?.ok_or_else(few)?;
    let one_edge = with_one_edge(frame, table).map(|rows| answer(&rows)).transpose()?.flatten();
    // What differs from set-up to set-up as a whole is no wear, which grows within them.
    let better = |(report, found): &(LearnReport, Data)| {
        names_wear(report) && report.final_test.rmse < declared.0.final_test.rmse && factors(report, found).is_none()
    };
    let is_one = one_edge.as_ref().is_some_and(better);
    let (mut report, found) = one_edge.filter(better).unwrap_or(declared);
    if is_one {
        let text = "wear goes on from set-up to set-up, so the way of the edge was counted through all of them; a column `edge` says \
                    which cuts an edge made";
        report.warnings.push(text.into());
    }
    let is_counted = way_is_counted(table);
    let furthest = found.used().map(|i| found.state[i].slid.at(-1.0)).fold(0.0, f64::max);
    report.counted_way_mm = is_counted.then_some(furthest);
    if is_counted && names_wear(&report) {
        report.warnings.push(format!(
            "no column `duration_s`: every cut was counted as {COUNTED_MM} mm long, and the growth of wear holds for that; a model file \
             takes the edge as it was at the end of the table"
        ));
    }
    report.least_radius = least_radius(table);
    report.warnings.extend(factors(&report, &found).and_then(|factors| set_ups_differ(&factors, table)));
    if let Some(spindle) = spindle {
        report.read_at_meter(spindle, &found.channel_names);
    }
    Ok((report, found))
}

/// Number of each set-up and its load over that of the first, where that explains the table better than the effects of its report.
fn factors(report: &LearnReport, found: &Data) -> Option<Vec<(usize, f64)>> {
    let effects: Vec<FittedEffect> = report.effects.iter().filter_map(in_model).collect();
    set_up_factors(found, &effects)
}

/// One sentence on set-ups whose loads are these over that of the first.
fn set_ups_differ(factors: &[(usize, f64)], table: &[SteadyRow]) -> Option<String> {
    let (_, names) = numbered(table.iter().map(|row| row.group.as_str()));
    let (first, _) = factors.first()?;
    let far = |factor: f64| factor.ln().abs();
    let (most, factor) = factors.iter().max_by(|a, b| far(a.1).total_cmp(&far(b.1)))?;
    Some(format!(
        "the set-ups differ as a whole: the cuts of set-up {} take {factor:.2} times the load of those of set-up {}; another batch of material, edge or \
         clamping does that, and the coefficients are a mean of them all. Learn from each set-up alone, or cut all from one batch with one edge",
        names[*most], names[*first]
    ))
}

/// Does the report name the wear of an edge?
fn names_wear(report: &LearnReport) -> bool {
    report.names().into_iter().any(|name| named(name).is_some_and(|effect| effect.wear.is_some()))
}

/// With several operations the most frequent one is fitted, the others are for the transfer.
fn main_kind(kind: &[usize], kinds: usize) -> Option<usize> {
    let count = |k: usize| kind.iter().filter(|x| **x == k).count();
    (kinds > 1).then(|| (0..kinds).max_by_key(|k| count(*k)).unwrap_or(0))
}
