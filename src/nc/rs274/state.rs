//! What only controls of the RS274 family remember. In: changed by the files of this folder. Out: read by them.

/// What the controls of the family remember beside what all do.
pub(crate) struct Rs274 {
    /// O-repeat loops under way: depth of calls, block, times left.
    pub(super) repeats: Vec<(usize, u32, u64)>,
    /// G66 is in force: the macro that is called after every motion.
    pub(super) modal_macro: Option<ModalMacro>,
}

/// The macro that G66 calls after every motion.
#[derive(Debug, Clone)]
pub(super) struct ModalMacro {
    /// Its number; `None`: it is not executed (it was not found, or is called after blocks of any kind).
    pub(super) label: Option<String>,
    /// #1–#33 as the last call left them.
    pub(super) arguments: Vec<(u32, f64)>,
    pub(super) repeats: u64,
}
