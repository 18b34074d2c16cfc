//! Coefficients of the linear edge model by part of the cutter. In: the parameters of a material's force model. Out: coefficients for the part
//! that a ring belongs to.

use super::error::ForceError;
use super::models::{LINEAR_EDGE, POWER, Values};
use crate::machine::Slice;
use crate::machine::material::LinearEdge;

/// Parts of a cutter that may have their own coefficients.
const PARTS: [&str; 4] = ["bottom", "corner", "cone", "side"];

/// Linear edge coefficients by part of the cutter, in the order of [`PARTS`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ByPart([LinearEdge; 4]);

impl ByPart {
    /// The same everywhere.
    pub(super) fn same(k: &LinearEdge) -> Result<Self, ForceError> {
        let given = |name: &str, value: f64| (name.to_owned(), value);
        linear_edge(&[
            given("k_tc", k.k_tc),
            given("k_te", k.k_te),
            given("k_rc", k.k_rc),
            given("k_re", k.k_re),
            given("k_ac", k.k_ac),
            given("k_ae", k.k_ae),
        ])
        .map(|k| Self([k; 4]))
    }
    /// From the parameters of `linear-edge`, `power` or `linear-edge-by-part`; `None` for other models.
    pub(super) fn named(name: &str, given: &[(String, f64)]) -> Option<Result<Self, ForceError>> {
        match name {
            "linear-edge" => Some(linear_edge(given).map(|k| Self([k; 4]))),
            "power" => Some(power(given).map(|k| Self([k; 4]))),
            "linear-edge-by-part" => Some(by_part(given)),
            _ => None,
        }
    }
    /// Coefficients of the part that a ring belongs to; `curved` is true on an arc of the profile.
    pub(super) fn of(&self, slice: &Slice, curved: bool) -> &LinearEdge {
        let part = match () {
            () if curved => 1,
            () if slice.normal_z < -0.999 => 0,
            () if slice.normal_r > 0.999 => 3,
            () => 2,
        };
        &self.0[part]
    }
}

fn linear_edge(given: &[(String, f64)]) -> Result<LinearEdge, ForceError> {
    let k = Values::checked(&LINEAR_EDGE, given)?;
    Ok(LinearEdge {
        k_tc: k.get("k_tc"),
        k_te: k.get("k_te"),
        k_rc: k.get("k_rc"),
        k_re: k.get("k_re"),
        k_ac: k.get("k_ac"),
        k_ae: k.get("k_ae"),
    })
}

fn power(given: &[(String, f64)]) -> Result<LinearEdge, ForceError> {
    let k = Values::checked(&POWER, given)?;
    let (k_tc, k_te) = (k.get("k_tc"), k.get("k_te"));
    Ok(LinearEdge {
        k_tc,
        k_te,
        k_rc: k.get("normal_cutting_share") * k_tc,
        k_re: k.get("normal_edge_share") * k_te,
        k_ac: k.get("axial_cutting_share") * k_tc,
        k_ae: k.get("axial_edge_share") * k_te,
    })
}

fn by_part(given: &[(String, f64)]) -> Result<ByPart, ForceError> {
    let part_of = |key: &str| PARTS.iter().position(|part| key.strip_prefix(part).is_some_and(|k| k.starts_with('_')));
    let mut parts = [LinearEdge::default(); 4];
    for (index, part) in PARTS.iter().enumerate() {
        let mut own: Vec<(String, f64)> = given
            .iter()
            .filter(|(key, _)| part_of(key) == Some(index))
            .map(|(key, value)| (key[part.len() + 1..].to_owned(), *value))
            .collect();
        for (key, value) in given.iter().filter(|(key, _)| part_of(key).is_none()) {
            if own.iter().all(|(known, _)| known != key) {
                own.push((key.clone(), *value));
            }
        }
        parts[index] = linear_edge(&own)?;
    }
    Ok(ByPart(parts))
}
