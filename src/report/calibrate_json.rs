//! JSON of `calibrate`: coefficients found, and test cuts planned, with the keys of the interface. In: either. Out: text.

use serde::Serialize;

use super::json_parts::{ErrorsPart, EstimatePart, estimates, finite, text};
use super::marks::WRITTEN_BY;
use crate::learn::calibrate::Calibration;
use crate::learn::calibrate::plan::{Plan, TestCut};

/// JSON report of a calibration.
pub fn calibrate_json(calibration: &Calibration) -> String {
    text(&CalibrationPart::of(calibration))
}

/// JSON of planned test cuts.
pub fn plan_json(plan: &Plan) -> String {
    text(&PlanPart {
        written_by: WRITTEN_BY,
        model: plan.model,
        cuts: plan.cuts.iter().map(TestCutPart::of).collect(),
        condition: plan.condition,
        expected: estimates(&plan.expected),
        notes: &plan.notes,
    })
}

#[derive(Serialize)]
struct CalibrationPart<'a> {
    written_by: &'static str,
    model: &'a str,
    tests: usize,
    parameters: Vec<EstimatePart<'a>>,
    derived: Vec<EstimatePart<'a>>,
    tare_w: Option<f64>,
    covariance: &'a [Vec<f64>],
    condition: Option<f64>,
    indistinguishable: &'a [Vec<String>],
    train: ErrorsPart,
    leave_one_out_rmse: Option<f64>,
    leave_set_up_out_rmse: Option<f64>,
    force_uncertainty: Option<f64>,
    notes: &'a [String],
    doubts: &'a [String],
}

impl<'a> CalibrationPart<'a> {
    fn of(c: &'a Calibration) -> Self {
        Self {
            written_by: WRITTEN_BY,
            model: &c.model,
            tests: c.tests,
            parameters: estimates(&c.parameters),
            derived: estimates(&c.derived),
            tare_w: c.tare,
            covariance: &c.covariance,
            condition: finite(c.condition),
            indistinguishable: &c.indistinguishable,
            train: ErrorsPart::of(&c.train),
            leave_one_out_rmse: finite(c.leave_one_out_rmse),
            leave_set_up_out_rmse: c.leave_set_up_out_rmse,
            force_uncertainty: c.force_uncertainty,
            notes: &c.notes,
            doubts: &c.doubts,
        }
    }
}

#[derive(Serialize)]
struct PlanPart<'a> {
    written_by: &'static str,
    model: &'static str,
    cuts: Vec<TestCutPart>,
    condition: f64,
    expected: Vec<EstimatePart<'a>>,
    notes: &'a [String],
}

#[derive(Serialize)]
#[allow(clippy::struct_field_names)] // keys of the interface, each with its unit
struct TestCutPart {
    axial_depth_mm: f64,
    radial_depth_mm: f64,
    feed_per_tooth_mm: f64,
}

impl TestCutPart {
    fn of(cut: &TestCut) -> Self {
        Self { axial_depth_mm: cut.axial_mm, radial_depth_mm: cut.radial_mm, feed_per_tooth_mm: cut.feed_per_tooth_mm }
    }
}
