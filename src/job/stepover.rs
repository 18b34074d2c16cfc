//! `stepover`: the feeds along planned passes. In: a program at its highest feed, its stock, a reference force. Out: the program with feeds at
//! which that force is kept.
//!
//! The engagement of the passes is simulated and not taken from the plan, which knows it only roughly where walls rise ahead of the tool or two
//! passes join. The ordinary schedule chooses the feeds, so that corners, axes and power are respected too.

use super::{JobError, Keep, Task, Wanted, Watch, optimize};
use crate::engage;
use crate::finish::stepover::check::with_saved_stock;
use crate::machine::{Annotate, Job};
use crate::nc::{self, Dialect};
use crate::path::Vec3;
use crate::stock::{Piece, saved};
use std::path::Path;

/// The text with feeds that keep to a force, N.
pub fn at_reference_force(
    text: &str,
    piece: &Piece,
    (job, dialect, reference_n): (&Job, Dialect, f64),
    clock: &dyn Fn() -> f64,
) -> Result<String, JobError> {
    let mut job = with_saved_stock(job);
    job.limits.force_xy_n = Some(reference_n);
    for tool in &mut job.tools {
        tool.limits.force_xy_n = None;
    }
    job.output.annotate = Annotate::None;
    let bytes = saved::to_bytes(piece, Vec3::zeros());
    let load = |_: &Path| Ok(bytes.clone());
    let watch = Watch {
        progress: &|_, _| (),
        clock,
        subprograms: &|_| None,
        engage: engage::Options {
            cell_mm: Some(piece.field.cell[0].max(piece.field.cell[1])),
            loader: Some(&load),
            ..engage::Options::default()
        },
        keep: Keep::default(),
    };
    let program = nc::parse(text.as_bytes().to_vec(), Some(dialect));
    let task = Task { program, job, assumptions: Vec::new(), wanted: Wanted::default() };
    let run = optimize(task, &watch)?;
    let written = run.written.map_or_else(|| text.as_bytes().to_vec(), |written| written.bytes);
    Ok(String::from_utf8_lossy(&written).into_owned())
}
