//! What cannot be solved, found before the rounds begin: wishes that make no sense, programs that do not meet or stand in the wrong
//! order.

use super::bench::{Bench, Look};
use super::met::{Met, Sample};
use super::task::{SemifinishError, Task};
use crate::path::Vec3;

/// Do the wishes make sense?
pub fn check(task: &Task) -> Result<(), SemifinishError> {
    let bad = |what: String| Err(SemifinishError::Bad { what });
    let wanted = &task.wanted;
    let [low, high] = wanted.stock_mm;
    if wanted.force_n.is_some_and(|force| !(force > 0.0 && force.is_finite())) {
        return bad("the reference force must be a positive number of newtons".into());
    }
    if !(low >= 0.0 && high > low && high.is_finite()) {
        return bad(format!(
            "stock from {low} to {high} mm makes no sense: the least may be 0, the largest must be more"
        ));
    }
    if !(wanted.change > 0.0 && wanted.tolerance_mm > 0.0) {
        return bad("change of stock per mm, and tolerance, must be positive".into());
    }
    Ok(())
}

/// Share of the finishing path that must meet the semi-finish, or the programs are tried in the other order.
const MEETING: f64 = 0.5;

/// Do the programs meet, and in this order? At the far sides of their first and last passes they do in either.
pub fn meet(bench: &Bench, base: &Look, samples: &[Sample], met: &[Met]) -> Result<(), SemifinishError> {
    let task = bench.task;
    let length = |samples: &[Sample], met: &[Met]| -> f64 {
        let both = samples.iter().zip(met).filter(|(_, met)| !met.shares.is_empty());
        both.map(|(sample, _)| sample.length_mm).sum()
    };
    let here_mm = length(samples, met);
    if here_mm >= MEETING * bench.finish_length_mm() {
        return Ok(());
    }
    let movable = vec![false; task.finish.moves.len()];
    let swapped = Task { semi: task.finish, finish: task.semi, movable: &movable, ..*task };
    let other = Bench::new(&swapped)?;
    let look = other.look(&vec![Vec3::zeros(); other.knots.list.len()], None)?;
    let samples = other.samples(&look);
    if length(&samples, &other.met(&look, &samples)) > here_mm {
        return Err(SemifinishError::WrongOrder);
    }
    if here_mm > 0.0 { Ok(()) } else { Err(SemifinishError::NeverMeet { cut_mm: base.cut_mm() }) }
}
