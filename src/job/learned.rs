//! What a process model changes of the job before anything is simulated. In: a job whose process model carries effects.
//! Out: stock, tools and machine as those effects say, and what was done, for the list of assumptions.
//!
//! Effects on loads stay in the process model: the force room applies them station by station. Effects on the measuring
//! chain change no cut. An accident of the log (a chipped edge) does not happen again: it is taken out, unless the model
//! has it from the beginning on, as one does that cannot tell it from something that stays.

use crate::effects::{Acts, Change, Effect, Place, State, named};
use crate::machine::material::EffectUse;
use crate::machine::{Job, StockShape};
use crate::setup::Assumption;

/// Stock larger than declared, by this much at most, counts as the same.
const NOTHING_MM: f64 = 1e-9;

/// The job as the learned effects say.
pub fn apply(job: &mut Job) -> Vec<Assumption> {
    let mut said = Vec::new();
    for used in job.process.effects.clone() {
        let Some(effect) = named(&used.name) else { continue };
        let change = change_of(effect, &used);
        match effect.acts {
            Acts::Geometry => said.extend(geometry(job, effect, &change)),
            Acts::Motion => {
                job.machine = job.machine.with_acceleration(change.acceleration);
                said.push(learned(effect, format!("{:.0} % of the declared", 100.0 * change.acceleration)));
            }
            Acts::Measuring => said.push(learned(effect, "changes readings, not the cut".into())),
            Acts::Load if effect.is_accident && !is_from_the_beginning(effect, &used) => {
                job.process.effects.retain(|other| other.name != used.name);
                said.push(learned(effect, "left out: it happened once; these are the loads of a sound tool".into()));
            }
            Acts::Load => {}
        }
    }
    said
}

/// Does its instant lie at the beginning of the program?
fn is_from_the_beginning(effect: &Effect, used: &EffectUse) -> bool {
    let instant = effect.parameters.iter().find(|p| p.place == Some(Place::Instant));
    instant.is_some_and(|p| used.parameters.iter().any(|(name, value)| name == p.name && *value <= 0.0))
}

/// Effects on geometry and motion do not depend on the cut.
fn change_of(effect: &Effect, used: &EffectUse) -> Change {
    let given = |name: &str| used.parameters.iter().find(|(key, _)| key == name).map(|(_, value)| *value);
    let values: Vec<f64> = effect.parameters.iter().map(|p| given(p.name).or(p.neutral).unwrap_or(f64::NAN)).collect();
    if values.iter().all(|value| value.is_finite()) {
        (effect.change)(&values, &State::default())
    } else {
        Change::default()
    }
}

fn geometry(job: &mut Job, effect: &Effect, change: &Change) -> Option<Assumption> {
    let [top, side] = [change.stock_top_mm, change.stock_side_mm];
    if top.abs().max(side.abs()) > NOTHING_MM {
        *job = job.with_stock_grown(top, side);
        let fixed = |shape: &StockShape| matches!(shape, StockShape::Stl(_) | StockShape::Saved(_));
        for stock in job.stocks.iter_mut().filter(|stock| fixed(&stock.shape)) {
            stock.uncertainty_mm += side.max(0.0);
        }
        return Some(learned(effect, format!("{top:+.2} mm on top, {side:+.2} mm on each side")));
    }
    let by = change.diameter_mm;
    if by.abs() > NOTHING_MM {
        *job = job.with_mills_wider(by)?;
        return Some(learned(effect, format!("{by:+.3} mm")));
    }
    let offset_mm = change.runout_mm;
    (offset_mm > NOTHING_MM).then(|| {
        *job = job.with_mills_off_axis(offset_mm, change.runout_phase);
        learned(effect, format!("{offset_mm:.4} mm, on every end mill"))
    })
}

fn learned(effect: &Effect, value: String) -> Assumption {
    Assumption { key: format!("process.{}", effect.name), value, source: "the process model".into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job(effect: &str, parameters: &[(&str, f64)]) -> Job {
        let text = "[stock]\nmaterial = \"aluminium-6061-t6\"\nbox = { min = [0, 0, -20], max = [100, 60, 0] }\n\
                    [[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 10\nflutes = 3\n";
        let (mut job, _) = crate::setup::load(text, std::path::Path::new(".")).expect("a sound setup");
        let parameters = parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        job.process.effects.push(EffectUse { name: effect.into(), parameters });
        job
    }

    #[test]
    fn geometry_and_motion_are_those_that_were_learned() {
        let mut proud = job("stock-proud", &[("top", 0.4), ("side", 0.0)]);
        assert_eq!(apply(&mut proud).len(), 1);
        let StockShape::Box(shape) = &proud.stocks[0].shape else { panic!("a box") };
        assert_eq!([shape.max.z, shape.max.x], [0.4, 100.0]);
        let mut small = job("tool-diameter", &[("difference", -0.2)]);
        apply(&mut small);
        assert!((small.tools[0].diameter_mm - 9.8).abs() < 1e-12);
        let mut off = job("runout", &[("offset", 0.02), ("phase", 0.5)]);
        apply(&mut off);
        let runout = off.tools[0].runout.expect("a runout");
        assert!(runout.offset_mm == 0.02 && (runout.angle_rad - std::f64::consts::PI / 3.0).abs() < 1e-12);
        let mut slow = job("corner-feed", &[("acceleration", 0.25)]);
        let declared = slow.machine.axes[0].acceleration_mm_s2;
        apply(&mut slow);
        assert_eq!(slow.machine.axes[0].acceleration_mm_s2, 0.25 * declared);
    }

    #[test]
    fn an_accident_does_not_happen_again() {
        let mut job = job("edge-chipping", &[("jump_cutting", 0.2), ("jump_edge", 0.3), ("time", 100.0)]);
        assert_eq!(apply(&mut job).len(), 1);
        assert!(job.process.effects.is_empty());
    }

    #[test]
    fn an_accident_from_the_beginning_on_stays() {
        let mut job = job("edge-chipping", &[("jump_cutting", 0.2), ("jump_edge", 0.3), ("time", 0.0)]);
        assert_eq!(apply(&mut job), []);
        assert_eq!(job.process.effects.len(), 1);
    }
}
