//! Coefficients of the linear edge model for every segment of a cutter, from a material and the process model on top of it.

use super::ForceError;
use crate::machine::material::{ForceModel, LinearEdge, Material, Process};

/// Coefficients as the rings take them.
pub(super) type Coefficients = LinearEdge;

/// Normal to tangential coefficients where only power was calibrated (model `power`), measured by Xu, Jerard, Fussell on
/// 6061-T6: cutting and edge.
const NORMAL_SHARE: [f64; 2] = [0.395, 0.566];
/// Axial to tangential: half of the normal ones; power does not depend on it.
const AXIAL_SHARE: [f64; 2] = [0.2, 0.28];

/// The linear edge coefficients of a material under a process, where its model is one of that kind.
pub(super) fn linear_edge(material: &Material, process: &Process) -> Result<LinearEdge, ForceError> {
    match process.base.as_ref().unwrap_or(&material.model) {
        ForceModel::LinearEdge(k) => checked(*k),
        ForceModel::Named { name, parameters } if name == "linear-edge" || name == "power" => {
            checked(from_parameters(parameters))
        }
        ForceModel::Named { name, .. } => Err(ForceError::UnknownModel { name: name.clone() }),
    }
}

fn from_parameters(parameters: &[(String, f64)]) -> LinearEdge {
    let get = |key: &str| parameters.iter().find(|(name, _)| name == key).map(|(_, value)| *value);
    let (k_tc, k_te) = (get("k_tc").unwrap_or(0.0), get("k_te").unwrap_or(0.0));
    LinearEdge {
        k_tc,
        k_rc: get("k_rc").unwrap_or(NORMAL_SHARE[0] * k_tc),
        k_ac: get("k_ac").unwrap_or(AXIAL_SHARE[0] * k_tc),
        k_te,
        k_re: get("k_re").unwrap_or(NORMAL_SHARE[1] * k_te),
        k_ae: get("k_ae").unwrap_or(AXIAL_SHARE[1] * k_te),
    }
}

/// Highest sensible cutting coefficient, N/mm²: above any metal at chip thicknesses that are cut.
const CUTTING_MAX: f64 = 50_000.0;
/// Highest sensible edge coefficient, N/mm.
const EDGE_MAX: f64 = 1_000.0;

fn checked(k: LinearEdge) -> Result<LinearEdge, ForceError> {
    let entries = [
        ("k_tc", k.k_tc, 0.0, CUTTING_MAX),
        ("k_te", k.k_te, 0.0, EDGE_MAX),
        ("k_rc", k.k_rc, -CUTTING_MAX, CUTTING_MAX),
        ("k_re", k.k_re, -EDGE_MAX, EDGE_MAX),
        ("k_ac", k.k_ac, -CUTTING_MAX, CUTTING_MAX),
        ("k_ae", k.k_ae, -EDGE_MAX, EDGE_MAX),
    ];
    for (key, value, low, high) in entries {
        if !(low..=high).contains(&value) {
            return Err(ForceError::OutOfRange { key: key.to_owned(), value, low, high });
        }
    }
    Ok(k)
}
