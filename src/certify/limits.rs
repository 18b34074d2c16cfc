//! The scope of a certificate. In: the setup, the moves. Out: the limits in force on a tool (the lowest, where operations would have to be
//! told apart); limits and tools that are not covered; the fingerprint of the setup that the certificate is bound to.

use super::cutter::unfit;
use super::place::is_covered;
use super::text::sha256;
use crate::machine::limits::Role;
use crate::machine::{Job, LimitKind, Limits, Tool};
use crate::nc::{Freeze, Move, Toolpath};

/// What the control is given.
#[derive(Clone, Copy)]
pub struct Basis<'a> {
    /// The bytes of the program.
    pub bytes: &'a [u8],
    /// What it does.
    pub toolpath: &'a Toolpath,
    /// The setup as it is read.
    pub job: &'a Job,
    /// Are there blocks under the block-delete switch?
    pub switched: bool,
}

/// SHA-256 of all that a setup says, but for what no load depends on.
pub fn fingerprint(job: &Job) -> String {
    let bare = Job { cell_mm: None, life: Vec::new(), confidence: None, ..job.clone() };
    sha256(format!("{bare:?}").as_bytes())
}

/// The tool of a move; where the program calls none, the only one of the setup.
pub fn tool_of<'a>(job: &'a Job, motion: &Move) -> Option<&'a Tool> {
    let only = || job.tools.first().filter(|_| motion.tool == 0 && job.tools.len() == 1);
    job.tools.iter().find(|tool| tool.number == motion.tool).or_else(only)
}

/// Load limits of a tool, each at its lowest: the setup's, the tool's in its place, and those of every operation that may match it (which
/// lines and comments an operation means is not known in the written program). The spindle's curves at this speed are among them.
pub fn in_force(job: &Job, tool: &Tool, rps: f64) -> Vec<(LimitKind, f64)> {
    let operations = job.operations.iter().filter(|of| of.matches.tool.is_none_or(|number| number == tool.number));
    let spindle = &job.machine.spindle;
    let lowest = |kind: LimitKind| {
        let own = tool.limits.value(kind).or(job.limits.value(kind));
        let of_operations = operations.clone().filter_map(|of| Limits::value(&of.limits, kind));
        let of_spindle = match kind {
            LimitKind::Power => spindle.power_w.as_ref(),
            LimitKind::Torque => spindle.torque_nmm.as_ref(),
            _ => None,
        };
        let all = own.into_iter().chain(of_operations).chain(of_spindle.map(|curve| curve.at(rps)));
        Some((kind, all.reduce(f64::min)?))
    };
    let loads = LimitKind::ALL.into_iter().filter(|kind| matches!(kind.row().role, Role::Load { .. } | Role::Rate));
    loads.filter_map(lowest).collect()
}

/// What of a tool and its limits is not certified, in words.
pub fn not_covered(tool: &Tool, limits: &[(LimitKind, f64)]) -> Option<String> {
    let of_kind =
        limits.iter().find(|(kind, _)| !is_covered(*kind)).map(|(kind, _)| format!("the limit {}", kind.name()));
    of_kind.or_else(|| unfit(tool).map(str::to_owned))
}

/// Why what a move does is not known well enough.
pub fn unknown_motion(motion: &Move) -> Option<&'static str> {
    use Freeze::{BlockDelete, Compensation, NoFeed, NotUnderstood, OtherFile, Rotary};
    let doubtful = [Rotary, NotUnderstood, NoFeed, OtherFile, Compensation, BlockDelete];
    if !motion.placed {
        return Some("only the control knows where it begins");
    }
    motion.freeze.filter(|freeze| doubtful.contains(freeze)).map(Freeze::why)
}
