//! What only controls of the Siemens family remember. In: changed by the files of this folder. Out: read by them.

use std::collections::BTreeSet;

/// What the controls of the family remember beside what all do.
pub(crate) struct Siemens {
    /// The cycle MCALL repeats.
    pub(super) modal_call: Option<ModalCall>,
    /// Arguments of the call, until PROC gives them names.
    pub(super) passed: Vec<Option<f64>>,
    /// Names of variables that DEF and PROC have made.
    pub(super) defined: BTreeSet<String>,
    /// Those of them that hold whole numbers, each with the depth of its call.
    pub(super) whole: BTreeSet<(usize, String)>,
    /// The point that CIP goes through, mm, and whether it is given by steps.
    pub(super) through: [Option<(f64, bool)>; 3],
}

/// A cycle that MCALL repeats at every position.
#[derive(Debug, Clone)]
pub(crate) struct ModalCall {
    pub(super) name: String,
    pub(super) arguments: Vec<Option<f64>>,
}
