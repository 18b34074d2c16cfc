//! Dangerous events in the simulation. In: the outcomes of a batch. Out: [`Event`]s, at most one of each kind for a move: cutting at rapid,
//! shank or holder in stock, fixtures touched, plunges of tools that do not cut at their centre, cutting with the spindle stopped, undercuts.

use super::batch::BatchResult;
use super::cutter::Cutter;
use super::map::{EngagementMap, Event, EventKind};
use super::nominate::Sample;
use super::sample_outcome::Outcome;
use super::scene::Scene;
use crate::ids::MoveId;
use crate::machine::Box3;
use crate::nc::Move;
use crate::path::Vec3;
use crate::stock::Track;

/// Volume that a rapid may remove without being reported, mm³.
const SCRAPE_MM3: f64 = 0.05;
/// Step in which a move near a fixture is checked, mm.
const FIXTURE_STEP_MM: f64 = 0.25;
/// Sine of the steepest descent that counts as a ramp, not as a plunge.
const PLUNGE: f64 = 0.7;

/// Records the events of a sampled feed move.
pub fn report(
    map: &mut EngagementMap,
    move_id: MoveId,
    motion: &Move,
    cutter: &Cutter,
    samples: &[Sample],
    outcomes: &[Outcome],
) {
    let mut event = |kind: EventKind, detail: String| map.events.push(Event { kind, move_id, detail });
    let struck = |which: usize| outcomes.iter().map(|outcome| outcome.struck[which]).fold(0.0, f32::max);
    if struck(0) > 0.0 {
        event(EventKind::ShankContact, format!("stock stands {:.2} mm above the cutting edges", struck(0)));
    }
    if struck(1) > 0.0 {
        event(EventKind::HolderContact, format!("stock stands {:.2} mm into the holder", struck(1)));
    }
    if outcomes.iter().any(|outcome| outcome.undercut) {
        event(EventKind::Undercut, "stock stays above the cutter: the simulation keeps it as if it were solid".into());
    }
    if motion.spin.rps == 0.0 && outcomes.iter().any(|outcome| outcome.cut.arcs > 0) {
        let depth = outcomes.iter().map(|outcome| outcome.cut.top_mm).fold(0.0, f64::max);
        event(EventKind::SpindleStopped, format!("engaged up to {depth:.2} mm with the spindle stopped"));
    }
    let central = |outcome: &Outcome| {
        let inner = 0.25 * cutter.form.radius;
        outcome.arcs.iter().any(|arc| cutter.slices[arc.slice as usize].radius_mm < inner)
    };
    let plunges = |(sample, outcome): (&Sample, &Outcome)| sample.tangent[1] < -PLUNGE && central(outcome);
    if !cutter.centre_cutting && samples.iter().zip(outcomes).any(plunges) {
        event(EventKind::PlungeNotCentreCutting, "there is material under the middle of the cutter".into());
    }
}

/// Records the rapids that removed material.
pub fn report_rapids(scene: &Scene, result: &BatchResult, map: &mut EngagementMap) {
    let mut volumes: Vec<(MoveId, f64)> = Vec::new();
    for (element, volume) in &result.watched {
        let id = scene.elements[*element as usize].move_id;
        match volumes.last_mut() {
            Some((last, sum)) if *last == id => *sum += volume,
            _ => volumes.push((id, *volume)),
        }
    }
    for (move_id, volume) in volumes.into_iter().filter(|(_, volume)| *volume > SCRAPE_MM3) {
        let detail = format!("{volume:.2} mm³ of stock in the way of a rapid");
        map.events.push(Event { kind: EventKind::CutAtRapid, move_id, detail });
    }
}

/// Records the moves of a range that touch a fixture, both rapids and feed moves.
pub(super) fn report_fixtures(
    fixtures: &[Box3],
    elements_of: impl Fn(usize) -> std::ops::Range<u32>,
    scene: &Scene,
    moves: std::ops::Range<usize>,
    map: &mut EngagementMap,
) {
    if fixtures.is_empty() {
        return;
    }
    for index in moves {
        let depth = elements_of(index)
            .map(|element| {
                let element = &scene.elements[element as usize];
                let cutter = &scene.cutters[element.cutter as usize];
                fixtures.iter().map(|fixture| into_fixture(&element.track, cutter, fixture)).fold(0.0, f64::max)
            })
            .fold(0.0, f64::max);
        if depth > 0.0 {
            let detail = format!("the tool goes {depth:.2} mm into a fixture");
            map.events.push(Event { kind: EventKind::FixtureContact, move_id: MoveId(index as u32), detail });
        }
    }
}

/// How far cutter or holder reach sideways into a fixture on their way along a track, mm.
fn into_fixture(track: &Track, cutter: &Cutter, fixture: &Box3) -> f64 {
    let reach = cutter.form.radius.max(cutter.widest_body());
    let (low, high) = track.bounds();
    let away = (0..2).any(|axis| low[axis] - reach >= fixture.max[axis] || high[axis] + reach <= fixture.min[axis]);
    if away || low.z >= fixture.max.z {
        return 0.0;
    }
    let length = track.length();
    let steps = (length / FIXTURE_STEP_MM).ceil().max(1.0) as usize;
    (0..=steps)
        .map(|k| {
            let tip = track.point(length * k as f64 / steps as f64);
            let below = fixture.max.z - tip.z;
            let cutting = if below > 0.0 { cutter.form.radius_below(below).unwrap_or(0.0) } else { 0.0 };
            let bodies = cutter.bodies.iter().filter(|body| body.low < below).map(|body| body.radius);
            bodies.fold(cutting, f64::max) - beside(fixture, tip)
        })
        .fold(0.0, f64::max)
}

/// Distance of a point from a box in the plane.
fn beside(fixture: &Box3, p: Vec3) -> f64 {
    let gap = |axis: usize| (fixture.min[axis] - p[axis]).max(p[axis] - fixture.max[axis]).max(0.0);
    gap(0).hypot(gap(1))
}
