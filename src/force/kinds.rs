//! What a force model needs of the cutter. In: model and tool. Out: the kind of engine, the coefficients of the rings, and the radial offset and
//! feed of each tooth under runout and uneven pitch.

use super::coefficients::ByPart;
use super::error::ForceError;
use super::laws::{Kienzle, Law, Polynomial, Sigmoid};
use super::models::{KIENZLE, LAYER, POLYNOMIAL, RESPONSE, SIGMOID, Values};
use super::scan::Before;
use super::summary::Formula;
use crate::machine::Tool;
use crate::machine::material::{ForceModel, LinearEdge};
use std::f64::consts::TAU;

/// How forces are worked out from chips.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    /// Affine in feed.
    Exact,
    /// Sampled.
    Sampled { law: Law, bends: bool },
    /// The resultant alone.
    Summed { formula: Formula, normal_share: f64 },
}

/// The kind of a model, and the coefficients of the rings where it has such.
pub(super) fn kind_of(model: &ForceModel, tool: &Tool) -> Result<(Kind, ByPart), ForceError> {
    let none = ByPart::same(&LinearEdge::default())?;
    let (name, given) = match model {
        ForceModel::LinearEdge(k) => return Ok((Kind::Exact, ByPart::same(k)?)),
        ForceModel::Named { name, parameters } => (name.as_str(), parameters.as_slice()),
    };
    if let Some(found) = ByPart::named(name, given) {
        return found.map(|by_part| (Kind::Exact, by_part));
    }
    let sampled = |law: Law, bends: bool| Ok((Kind::Sampled { law, bends }, none));
    match name {
        "kienzle" => sampled(Law::Kienzle(Kienzle::new(&Values::checked(&KIENZLE, given)?)), false),
        "sigmoid" => {
            let values = Values::checked(&SIGMOID, given)?;
            sampled(Law::Sigmoid(Sigmoid::new(&values, tool)), values.get("deflection") > 0.0)
        }
        "polynomial" => sampled(Law::Polynomial(Polynomial::new(&Values::checked(&POLYNOMIAL, given)?)), false),
        "response" => {
            let values = Values::checked(&RESPONSE, given)?;
            let normal_share = values.get("normal_share");
            Ok((Kind::Summed { formula: Formula::response(&values), normal_share }, none))
        }
        "layer" => {
            let values = Values::checked(&LAYER, given)?;
            let normal_share = values.get("normal_share");
            Ok((Kind::Summed { formula: Formula::layer(&values, 0.5 * tool.diameter_mm), normal_share }, none))
        }
        _ => Err(ForceError::UnknownModel { name: name.to_owned() }),
    }
}

/// For each tooth the paths of the teeth before it: one entry where all teeth are alike, else one for each tooth before it.
pub(super) fn before(tool: &Tool) -> Vec<Vec<Before>> {
    let n = tool.flutes as usize;
    let radii = radii(tool);
    let paths = if radii.iter().any(|radius| *radius != 0.0) { n } else { 1 };
    let meets = |i: usize, m: usize| {
        let turned: f64 = (1..=m).map(|k| pitch(tool, i + n - k)).sum();
        Before { feeds: turned * n as f64 / TAU, radius_mm: radii[i] - radii[(i + n - m) % n] }
    };
    (0..n).map(|i| (1..=paths).map(|m| meets(i, m)).collect()).collect()
}

/// R_i = ρ cos(α − ψ_i) of every tooth, in the order in which they pass.
pub(super) fn radii(tool: &Tool) -> Vec<f64> {
    let behind = |i: u32| (0..i as usize).map(|k| pitch(tool, k)).sum::<f64>();
    let radius = |i: u32| tool.runout.map_or(0.0, |runout| runout.offset_mm * (runout.angle_rad - behind(i)).cos());
    (0..tool.flutes).map(radius).collect()
}

/// Angle between a tooth and the next.
fn pitch(tool: &Tool, tooth: usize) -> f64 {
    let n = tool.flutes as usize;
    if tool.pitch_rad.is_empty() { TAU / n as f64 } else { tool.pitch_rad[tooth % n] }
}
