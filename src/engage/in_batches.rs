//! The moves in batches, one after the other. In: the plan, the fields. Out: stations and events in the map, and the fields after the last.

use super::batch::{BatchResult, Operation, Swept, assign, run};
use super::block_ends::Marker;
use super::hazards::{report, report_fixtures, report_rapids};
use super::map::goes_on;
use super::nominate::{Need, Sample};
use super::place_samples::{Sampling, StationSource, bend, mark_joints, sample_at, sample_move};
use super::plan::Plan;
use super::sample_outcome::{Outcome, STRAIGHT_RAD};
use super::scene::Scene;
use super::stations::{Builder, Point};
use crate::ids::MoveId;
use crate::nc::MoveKind;
use crate::stock::Field;

/// Moves worked together.
struct Batch {
    moves: std::ops::Range<usize>,
    samples: Vec<Sample>,
    ways: Vec<StationSource>,
    /// What the tiles do.
    operations: Vec<Vec<Operation>>,
}

/// Processes all batches. While the tiles of one batch are swept, the arcs of the batch before are worked out and entered into the map, and
/// the next batch is sampled.
pub(super) fn simulate(
    plan: &Plan,
    scene: &Scene,
    fields: &mut [Field],
    builder: &mut Builder,
    progress: &(dyn Fn(f64) + Sync),
) {
    let mut held = Outcome::default();
    let mut state = Sampling { heading: [1.0, 0.0], goes_on: false, marker: Marker::default() };
    let mut next = prepare(plan, scene, 0, &mut state);
    let mut done: Option<(Batch, Swept)> = None;
    let rapid = |element: u32| {
        let motion = || &plan.path.moves[scene.elements[element as usize].move_id.ix()];
        plan.again.is_none() && motion().kind == MoveKind::Rapid
    };
    while let Some(batch) = next.take() {
        let fields = &mut *fields;
        let (swept, prepared) = rayon::join(
            || run(scene, fields, &batch.operations, &batch.samples, rapid),
            || {
                if let Some((batch, swept)) = done.take() {
                    enter_batch(plan, scene, &batch, swept, &mut held, builder);
                }
                prepare(plan, scene, batch.moves.end, &mut state)
            },
        );
        progress(batch.moves.end as f64 / plan.path.moves.len() as f64);
        (next, done) = (prepared, Some((batch, swept)));
    }
    if let Some((batch, swept)) = done {
        enter_batch(plan, scene, &batch, swept, &mut held, builder);
    }
}

/// Samples the moves of the batch that begins with this one; `None` after the last.
fn prepare(plan: &Plan, scene: &Scene, begin: usize, state: &mut Sampling) -> Option<Batch> {
    let moves = begin..plan.batch_end(begin, scene);
    let mut samples = Vec::new();
    let ways: Vec<StationSource> =
        moves.clone().map(|index| sample_move(plan, scene, index, state, &mut samples)).collect();
    mark_joints(plan, scene, begin, &ways, &mut samples, &mut state.marker);
    let elements = plan.laid.first[moves.start]..plan.laid.first[moves.end];
    let operations = assign(scene, &plan.tilings, elements, &samples, &plan.until);
    (!moves.is_empty()).then_some(Batch { moves, samples, ways, operations })
}

fn enter_batch(plan: &Plan, scene: &Scene, batch: &Batch, swept: Swept, held: &mut Outcome, builder: &mut Builder) {
    let locate = |like: &Sample, s_mm: f64| {
        let element = &scene.elements[like.element as usize];
        sample_at(plan, element.move_id.ix(), s_mm, like.dir, like.cutter)
    };
    let result = swept.finish(scene, &batch.samples, &locate);
    report_rapids(scene, &result, &mut builder.map);
    report_fixtures(&plan.fixtures, |index| plan.elements_of(index), scene, batch.moves.clone(), &mut builder.map);
    let idle = [false, true].map(|clear| Outcome { clear, ..Outcome::default() });
    let mut last = &*held;
    for (index, way) in batch.moves.clone().zip(&batch.ways) {
        last = match way {
            StationSource::None => {
                builder.push_none(MoveId(index as u32));
                &idle[0]
            }
            StationSource::Known(of) => {
                if let Some(again) = plan.again {
                    builder.push_known(MoveId(index as u32), again.known, Some(*of));
                }
                &idle[0]
            }
            StationSource::Idle(flags) => {
                builder.push_idle(MoveId(index as u32), plan.path.moves[index].curve().length(), *flags);
                &idle[usize::from(flags.clear_air)]
            }
            StationSource::Sampled { samples, inherits } => {
                let bend = if *inherits { bend(plan, index) } else { 0.0 };
                let seen = (bend.abs() > STRAIGHT_RAD).then(|| {
                    let sample = &batch.samples[samples.start];
                    last.beyond_bend(bend, &scene.cutters[sample.cutter as usize], sample.tangent)
                });
                let begin = seen.as_ref().unwrap_or(last);
                let mut points: Vec<Point> = Vec::with_capacity(samples.len() + 1);
                points.extend(inherits.then_some(Point { s_mm: 0.0, outcome: begin, before: None }));
                points.extend(points_of(&batch.samples, &result, samples.clone()));
                enter(
                    plan,
                    scene,
                    index,
                    (&batch.samples[samples.clone()], &result.outcomes[samples.clone()]),
                    &points,
                    builder,
                );
                &result.outcomes[samples.end - 1]
            }
        };
    }
    *held = last.clone();
}

/// The sampled points of a move but for optional ones.
fn points_of<'a>(
    samples: &'a [Sample],
    result: &'a BatchResult,
    range: std::ops::Range<usize>,
) -> impl Iterator<Item = Point<'a>> {
    range.filter(|k| samples[*k].need != Need::Change).map(|k| Point {
        s_mm: samples[k].s_mm,
        outcome: &result.outcomes[k],
        before: result.between[k].as_ref(),
    })
}

/// Enters a move into the map, from its samples and their outcomes.
fn enter(
    plan: &Plan,
    scene: &Scene,
    index: usize,
    (samples, outcomes): (&[Sample], &[Outcome]),
    points: &[Point],
    builder: &mut Builder,
) {
    let id = MoveId(index as u32);
    let cutter = samples[0].cutter;
    let tool = &scene.cutters[cutter as usize];
    let uncertain = points.iter().any(|point| point.outcome.undercut);
    report(&mut builder.map, id, &plan.path.moves[index], tool, samples, outcomes);
    let goes_on = |later: usize| plan.path.moves.get(later).is_some_and(|b| goes_on(&plan.path.moves[later - 1], b));
    let path_ends = [index == 0 || !goes_on(index), !goes_on(index + 1)];
    builder.push_move(id, (cutter, tool), points, path_ends, uncertain);
}
