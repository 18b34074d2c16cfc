//! Checks before the rounds. In: the task, the simulated programs. Out: an error for inconsistent settings, for
//! programs that do not meet, are in the wrong order or in different units.

use super::met_stock::{MetStock, Sample};
use super::programs::{Programs, Simulated};
use super::task::{SemifinishError, Task};
use crate::nc::{MoveKind, Toolpath};
use crate::path::Vec3;

/// Checks the settings.
pub fn check_wanted(task: &Task) -> Result<(), SemifinishError> {
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
    if [wanted.change, wanted.tolerance_mm].iter().any(|value| !(*value > 0.0 && value.is_finite())) {
        return bad("change of stock per mm, and tolerance, must be positive numbers".into());
    }
    Ok(())
}

/// Share of the finishing path that must meet the stock of the semi-finish; below it units and order are checked.
const MEETING: f64 = 0.5;

/// Checks that the finish cuts the stock that the semi-finish left. At the far sides of the first and last passes it
/// does in either order, so the lengths are compared.
pub fn check_meeting(
    programs: &Programs,
    base: &Simulated,
    samples: &[Sample],
    met: &[MetStock],
) -> Result<(), SemifinishError> {
    let task = programs.task;
    let length = |samples: &[Sample], met: &[MetStock]| -> f64 {
        let both = samples.iter().zip(met).filter(|(_, met)| !met.shares.is_empty());
        both.map(|(sample, _)| sample.length_mm).sum()
    };
    let here_mm = length(samples, met);
    if is_met(here_mm, programs.finish_length_mm()) {
        return Ok(());
    }
    if let Some(times) = in_another_unit(task) {
        return Err(SemifinishError::OtherUnit { times });
    }
    let movable = vec![false; task.finish.moves.len()];
    let swapped = Task { semi: task.finish, finish: task.semi, movable: &movable, ..*task };
    let other = Programs::new(&swapped)?;
    let simulated = other.simulated(&vec![Vec3::zeros(); other.knots.list.len()], None)?;
    let samples = other.samples(&simulated);
    if length(&samples, &other.met(&simulated, &samples)) > here_mm {
        return Err(SemifinishError::WrongOrder);
    }
    if here_mm > 0.0 { Ok(()) } else { Err(SemifinishError::NeverMeet { cut_mm: base.cut_mm() }) }
}

/// Why no stock can be chosen.
pub fn nothing_free(programs: &Programs, base: &Simulated) -> SemifinishError {
    let [semi_mm, finish_mm] = [programs.semi_tool.radius_mm(), programs.finish_tool.radius_mm()];
    if !programs.knots.list.iter().any(|knot| knot.free) {
        SemifinishError::NothingFree
    } else if let Some(times) = in_another_unit(programs.task) {
        SemifinishError::OtherUnit { times }
    } else if semi_mm > finish_mm {
        SemifinishError::TooLarge { semi_mm, finish_mm }
    } else {
        SemifinishError::NeverMeet { cut_mm: base.cut_mm() }
    }
}

const INCH_MM: f64 = 25.4;
/// Largest relative difference of a ratio of extents from that of the units: two programs of one part differ by
/// lead-ins and stock.
const ALIKE: f64 = 0.1;

/// Extent of the finish over that of the semi-finish, if it is near 25.4 or 1/25.4.
fn in_another_unit(task: &Task) -> Option<f64> {
    let extent = |path: &Toolpath| -> f64 {
        let cuts = path.moves.iter().filter(|motion| motion.kind == MoveKind::Feed);
        let ends = || cuts.clone().flat_map(|motion| [motion.curve().from(), motion.curve().to()]);
        let least = ends().reduce(|a, b| a.inf(&b));
        let most = ends().reduce(|a, b| a.sup(&b));
        least.zip(most).map_or(0.0, |(least, most)| (most - least).norm())
    };
    let times = extent(task.finish) / extent(task.semi);
    is_of_units(times).then_some(times)
}

/// Is a ratio near 25.4 or 1/25.4?
fn is_of_units(times: f64) -> bool {
    let near = |ratio: f64| (times / ratio - 1.0).abs() < ALIKE;
    near(INCH_MM) || near(1.0 / INCH_MM)
}

/// Does enough of the finishing path meet the stock of the semi-finish?
fn is_met(here_mm: f64, whole_mm: f64) -> bool {
    here_mm >= MEETING * whole_mm
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extents_within_a_tenth_of_25_4_are_those_of_units() {
        assert!(is_of_units(27.8) && is_of_units(23.0) && is_of_units(1.0 / 23.2));
        assert!(!is_of_units(28.0) && !is_of_units(22.8) && !is_of_units(1.0 / 28.3) && !is_of_units(1.0));
    }

    #[test]
    fn half_of_the_finishing_path_has_to_meet_the_semi_finish() {
        assert!(is_met(50.1, 100.0) && !is_met(49.9, 100.0));
    }
}
