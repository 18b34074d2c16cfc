//! Variations of a job (`--stress`). In: a job. Out: the same job with larger stock, a shifted work offset, other coefficients and so on, each
//! with a name. The written program is simulated again under each of them: under the job itself the prediction only agrees with itself.

use crate::machine::material::{ForceModel, LinearEdge, Process};
use crate::machine::{Job, Material, Runout, Stock, StockShape};
use crate::path::Vec3;

/// One variation.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// What is varied, for the report.
    pub name: &'static str,
    /// The job under it.
    pub job: Job,
    /// Factor on every commanded feed (feed override).
    pub override_factor: f64,
}

/// The variations: stock grown by its uncertainty, work offset ± 0.3 mm, coefficients ± 30 %, runout 0.01 mm, override 120 %.
pub fn cases(job: &Job) -> Vec<Case> {
    let case = |name, job| Case { name, job, override_factor: 1.0 };
    let shifted = |x, y, z| with_stock(job, &|stock| stock.moved_mm += Vec3::new(x, y, z));
    vec![
        case("stock grown by its uncertainty", with_grown_stock(job)),
        case("work offset +0.3 mm in x", shifted(-0.3, 0.0, 0.0)),
        case("work offset -0.3 mm in x", shifted(0.3, 0.0, 0.0)),
        case("work offset +0.3 mm in y", shifted(0.0, -0.3, 0.0)),
        case("work offset -0.3 mm in y", shifted(0.0, 0.3, 0.0)),
        case("work offset +0.3 mm in z", shifted(0.0, 0.0, -0.3)),
        case("work offset -0.3 mm in z", shifted(0.0, 0.0, 0.3)),
        case("coefficients +30 %", with_coefficients(job, 1.3)),
        case("coefficients -30 %", with_coefficients(job, 0.7)),
        case("runout 0.01 mm", with_runout(job, 0.01)),
        Case { name: "feed override 120 %", job: job.clone(), override_factor: 1.2 },
    ]
}

/// The job with all cutting and edge coefficients multiplied.
pub fn with_coefficients(job: &Job, factor: f64) -> Job {
    let mut job = job.clone();
    for stock in &mut job.stocks {
        scale(&mut stock.material, factor);
    }
    for tool in &mut job.tools {
        if let Some(material) = &mut tool.coefficients {
            scale(material, factor);
        }
    }
    if let Process { base: Some(model), .. } = &mut job.process {
        scale_model(model, factor);
    }
    job
}

fn scale(material: &mut Material, factor: f64) {
    scale_model(&mut material.model, factor);
}

fn scale_model(model: &mut ForceModel, factor: f64) {
    match model {
        ForceModel::LinearEdge(k) => {
            let LinearEdge { k_tc, k_rc, k_ac, k_te, k_re, k_ae } = *k;
            let [k_tc, k_rc, k_ac, k_te, k_re, k_ae] = [k_tc, k_rc, k_ac, k_te, k_re, k_ae].map(|k| k * factor);
            *k = LinearEdge { k_tc, k_rc, k_ac, k_te, k_re, k_ae };
        }
        ForceModel::Named { parameters, .. } => {
            for (_, value) in parameters.iter_mut().filter(|(name, _)| name.starts_with('k')) {
                *value *= factor;
            }
        }
    }
}

fn with_runout(job: &Job, offset_mm: f64) -> Job {
    let mut job = job.clone();
    for tool in &mut job.tools {
        let angle_rad = tool.runout.map_or(0.0, |runout| runout.angle_rad);
        tool.runout = Some(Runout { offset_mm, angle_rad });
    }
    job
}

/// The job with every stock grown by its uncertainty: one from a file is raised by it, its sides stay.
pub fn with_grown_stock(job: &Job) -> Job {
    with_stock(job, &grow)
}

fn with_stock(job: &Job, change: &dyn Fn(&mut Stock)) -> Job {
    let mut job = job.clone();
    job.stocks.iter_mut().for_each(change);
    job
}

fn grow(stock: &mut Stock) {
    let by = stock.uncertainty_mm;
    match &mut stock.shape {
        StockShape::Box(shape) => *shape = shape.grown(by),
        StockShape::Cylinder { diameter_mm, z_mm, .. } => {
            *diameter_mm += 2.0 * by;
            *z_mm = [z_mm[0] - by, z_mm[1] + by];
        }
        StockShape::Stl(_) | StockShape::Saved(_) => stock.moved_mm.z += by,
    }
}
