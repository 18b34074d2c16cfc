//! One batch of the simulation: nomination and sweeping tile by tile, then arcs sample by sample. In: the fields as they
//! are before the batch, its elements and samples in order. Out: the fields after it, and an [`Outcome`] per sample. What
//! needs the fields no more ([`Swept::finish`]) can go on beside the batch that follows.
//!
//! Between samples whose engagement differs it is looked at more closely ([`super::between_samples`]). Only there are the optional
//! samples asked for, and the ends of short blocks whose neighbours do not agree ([`super::block_ends`]): the tiles are taken
//! back, sweep by sweep, and asked on the way.
//!
//! Tiles are worked in parallel, each through its own operations in order of execution; what they say about a sample is
//! merged in the order of the tiles, so the result does not depend on the number of threads.

use super::between_samples::{Between, Locate, alike, look};
use super::block_ends::{joints, turns};
use super::nominate::{Need, Nominations, Sample, Scratch, nominate};
use super::sample_outcome::Outcome;
use super::sample_view::{Gathered, View, cutter_of};
use super::scene::Scene;
use crate::stock::{Field, Past, Tile, Tiling, claim, make_again, sweep, take_back};
use rayon::prelude::*;

/// What happened in a batch.
#[derive(Debug, Default)]
pub struct BatchResult {
    /// One outcome per sample; of optional ones nothing.
    pub outcomes: Vec<Outcome>,
    /// What was found between a required sample and the one before it, where that was looked at.
    pub between: Vec<Option<Between>>,
    /// Volumes removed by the elements that were to be watched: (element, mm³).
    pub watched: Vec<(u32, f64)>,
}

/// One step of a tile.
#[derive(Debug, Clone, Copy)]
pub enum Operation {
    /// Asked about a sample.
    Nominate(u32),
    /// Swept by an element.
    Sweep(u32),
}

/// A batch that the tiles are done with.
pub struct Swept {
    said: Vec<Nominations>,
    outcomes: Vec<Outcome>,
    /// The pairs of neighbouring samples to be looked between, and the samples worked out after all.
    pairs: Vec<[usize; 2]>,
    wanted: Vec<bool>,
    watched: Vec<(u32, f64)>,
}

/// Takes the tiles through their operations ([`assign`]); the volume removed by an element is measured where
/// `watch(element)`.
pub fn run(
    scene: &Scene,
    fields: &mut [Field],
    operations: &[Vec<Operation>],
    samples: &[Sample],
    watch: impl Fn(u32) -> bool + Sync,
) -> Swept {
    let mut tiles: Vec<&mut Tile> = fields.iter_mut().flat_map(|field| field.tiles.iter_mut()).collect();
    let worked = busiest_first(&mut tiles, operations, |_, tile, operations| {
        work_tile(scene, tile, samples, operations, &watch)
    });
    let mut said = Vec::with_capacity(2 * worked.len());
    let (mut watched, mut marks) = (Vec::new(), Vec::with_capacity(worked.len()));
    for worked in worked {
        said.push(worked.said);
        watched.extend(worked.watched);
        marks.push(worked.marks);
    }
    watched.sort_by_key(|(element, _)| *element);
    let view = View::new(scene, samples, &said);
    let required: Vec<usize> = (0..samples.len()).filter(|k| samples[*k].need == Need::Always).collect();
    let mut outcomes = vec![Outcome::default(); samples.len()];
    work_out(&view, &required, &mut outcomes);
    let (pairs, wanted) = look_at(scene, samples, &required, &mut outcomes);
    let more = busiest_first(&mut tiles, operations, |k, tile, operations| {
        let said = look_back(scene, tile, samples, (operations, &marks[k]), &wanted);
        tile.past = Past::default();
        tile.update_highest();
        said
    });
    said.extend(more.into_iter().flatten());
    Swept { said, outcomes, pairs, wanted, watched }
}

/// Works the tiles that have operations side by side, those with the most first, so that none is left alone at the end; what
/// came of each, in the order of the tiles. `work` is told how many such tiles there are before it.
fn busiest_first<T: Send>(
    tiles: &mut [&mut Tile],
    operations: &[Vec<Operation>],
    work: impl Fn(usize, &mut Tile, &[Operation]) -> T + Sync,
) -> Vec<T> {
    let busy = tiles.iter_mut().zip(operations).filter(|(_, operations)| !operations.is_empty());
    let mut busy: Vec<_> = busy.enumerate().collect();
    busy.sort_by_key(|(_, (_, operations))| std::cmp::Reverse(operations.len()));
    let worked = busy.into_iter().par_bridge().map(|(k, (tile, operations))| (k, work(k, tile, operations)));
    let mut worked: Vec<(usize, T)> = worked.collect();
    worked.sort_unstable_by_key(|(k, _)| *k);
    worked.into_iter().map(|(_, of)| of).collect()
}

impl Swept {
    /// What happened: the joints wanted after all are worked out, and it is looked between samples that differ.
    pub fn finish(self, scene: &Scene, samples: &[Sample], locate: Locate) -> BatchResult {
        let Self { said, mut outcomes, pairs, wanted, watched } = self;
        let view = View::new(scene, samples, &said);
        let joints: Vec<usize> = (0..samples.len()).filter(|k| wanted[*k] && samples[*k].need == Need::Joint).collect();
        work_out(&view, &joints, &mut outcomes);
        let mut between = vec![None; samples.len()];
        let looked: Vec<(usize, Option<Between>)> = pairs
            .par_iter()
            .with_max_len(32)
            .map_init(Gathered::default, |room, ends| {
                (ends[1], look(&view, *ends, ends.map(|end| &outcomes[end]), locate, room))
            })
            .collect();
        for (index, found) in looked {
            between[index] = found;
        }
        BatchResult { outcomes, between, watched }
    }
}

/// Works out the outcomes of some samples.
fn work_out(view: &View, which: &[usize], outcomes: &mut [Outcome]) {
    let found: Vec<Outcome> = which
        .par_iter()
        .with_max_len(32)
        .map_init(Gathered::default, |gathered, index| view.outcome(*index, gathered))
        .collect();
    for (index, outcome) in which.iter().zip(found) {
        outcomes[*index] = outcome;
    }
}

/// The pairs of neighbouring samples to be looked between, and which samples that takes; joints whose neighbours agree
/// take their outcomes from these.
fn look_at(
    scene: &Scene,
    samples: &[Sample],
    required: &[usize],
    outcomes: &mut [Outcome],
) -> (Vec<[usize; 2]>, Vec<bool>) {
    let (mut pairs, mut wanted) = (Vec::new(), vec![false; samples.len()]);
    let joint = |k: &usize| samples[*k].need == Need::Joint;
    let chained = |pair: &[usize]| (pair[0] + 1..pair[1]).any(|k| joint(&k));
    let look = |k: usize| {
        let ends = &required[k..k + 2];
        let found = [&outcomes[ends[0]], &outcomes[ends[1]]];
        if !chained(ends) {
            return alike(found).then(Vec::new);
        }
        let before = k.checked_sub(1).map(|k| &required[k..k + 2]).filter(|pair| chained(pair)).map(|pair| pair[0]);
        let after = required.get(k + 1..k + 3).filter(|pair| chained(pair)).map(|pair| pair[1]);
        let point = |k: usize| (samples[k].tip, outcomes[k].cut.area_mm2);
        if turns(before.map(point), [ends[0], ends[1]].map(point), after.map(point)) {
            return None;
        }
        joints(samples, cutter_of(scene, &samples[ends[0]]), [ends[0], ends[1]], found)
    };
    let pairs_of = required.len().saturating_sub(1);
    let looks: Vec<Option<Vec<(usize, Outcome)>>> = (0..pairs_of).into_par_iter().with_max_len(128).map(look).collect();
    for (ends, agreed) in required.windows(2).zip(looks) {
        if let Some(mixed) = agreed {
            for (index, outcome) in mixed {
                outcomes[index] = outcome;
            }
            continue;
        }
        wanted[ends[0] + 1..ends[1]].fill(true);
        let mut from = ends[0];
        for to in (ends[0] + 1..ends[1]).filter(joint).chain([ends[1]]) {
            pairs.push([from, to]);
            from = to;
        }
    }
    (pairs, wanted)
}

/// What came of a tile: what it says, the volumes watched, and how much past there was before each operation, where it is
/// kept.
struct Worked {
    said: Nominations,
    watched: Vec<(u32, f64)>,
    marks: Vec<usize>,
}

/// Operations of every tile of the fields in order of execution: the elements `elements` (indices into the scene) and the
/// samples, which are sorted by element. `until` says for each tile from which element on it is not swept; empty: all are.
pub fn assign(
    scene: &Scene,
    fields: &[Tiling],
    elements: std::ops::Range<u32>,
    samples: &[Sample],
    until: &[u32],
) -> Vec<Vec<Operation>> {
    let mut operations: Vec<Vec<Operation>> = vec![Vec::new(); fields.iter().map(Tiling::count).sum()];
    let mut put = |low: [f64; 2], high: [f64; 2], bottom: f64, operation: Operation| {
        let mut first = 0;
        for field in fields {
            if bottom < field.extent.max.z {
                for tile in field.tiles_under(low, high).map(|tile| first + tile) {
                    let done = |index: u32| until.get(tile).is_some_and(|until| index >= *until);
                    if !matches!(operation, Operation::Sweep(index) if done(index)) {
                        operations[tile].push(operation);
                    }
                }
            }
            first += field.count();
        }
    };
    let mut next = 0;
    for index in elements {
        let element = &scene.elements[index as usize];
        let cutter = &scene.cutters[element.cutter as usize];
        while next < samples.len() && samples[next].element == index {
            let sample = &samples[next];
            let reach = cutter.asks_within(sample.clearance_mm);
            let [x, y] = [sample.tip.x, sample.tip.y];
            let bottom = sample.tip.z - sample.clearance_mm;
            put([x - reach, y - reach], [x + reach, y + reach], bottom, Operation::Nominate(next as u32));
            next += 1;
        }
        let (low, high) = element.track.bounds();
        let reach = cutter.form.radius + cutter.margin;
        put([low.x - reach, low.y - reach], [high.x + reach, high.y + reach], low.z, Operation::Sweep(index));
    }
    operations
}

/// Works through the operations, but for nominations of samples that may not be needed.
fn work_tile(
    scene: &Scene,
    tile: &mut Tile,
    samples: &[Sample],
    operations: &[Operation],
    watch: &(impl Fn(u32) -> bool + Sync),
) -> Worked {
    let always = |number: u32| samples[number as usize].need == Need::Always;
    if operations.iter().any(|operation| matches!(operation, Operation::Nominate(k) if !always(*k))) {
        tile.past.begin(operations.len());
    }
    let (mut said, mut watched, mut scratch) = (Nominations::default(), Vec::new(), Scratch::default());
    let mut marks = Vec::with_capacity(if tile.past.on { operations.len() } else { 0 });
    for operation in operations {
        if tile.past.on {
            marks.push(tile.past.mark());
        }
        match *operation {
            Operation::Nominate(number) if !always(number) => {}
            Operation::Nominate(number) => {
                let sample = &samples[number as usize];
                nominate(tile, number, sample, cutter_of(scene, sample), &mut scratch, &mut said);
            }
            Operation::Sweep(index) => {
                let element = &scene.elements[index as usize];
                let form = &scene.cutters[element.cutter as usize].form;
                if watch(index) {
                    let (low, high) = element.track.bounds();
                    let r = form.radius;
                    let window = ([low.x - r, low.y - r], [high.x + r, high.y + r]);
                    let before = tile.volume_in_mm3(window.0, window.1);
                    sweep(tile, (&element.track, element.joined), form, index);
                    let removed = before - tile.volume_in_mm3(window.0, window.1);
                    if removed > 0.0 {
                        watched.push((index, removed));
                    }
                } else {
                    sweep(tile, (&element.track, element.joined), form, index);
                }
                claim(tile, index, element.joined, |id| {
                    let element = &scene.elements[id as usize];
                    (&element.track, scene.form(element))
                });
            }
        }
    }
    Worked { said, watched, marks }
}

/// What a tile says about the samples wanted after all: the last first, each on the tile as it was then. The tile is left as
/// it was found. What no height exceeded before the batch holds all along.
fn look_back(
    scene: &Scene,
    tile: &mut Tile,
    samples: &[Sample],
    (operations, marks): (&[Operation], &[usize]),
    wanted: &[bool],
) -> Option<Nominations> {
    let is_wanted = |operation: &Operation| matches!(operation, Operation::Nominate(k) if wanted[*k as usize]);
    let first = operations.iter().take(marks.len()).position(is_wanted)?;
    let (mut said, mut scratch) = (Nominations::default(), Scratch::default());
    let mut at = tile.past.mark();
    for (operation, mark) in operations.iter().zip(marks).skip(first).rev() {
        match *operation {
            Operation::Sweep(_) => {
                take_back(tile, [*mark, at]);
                at = *mark;
            }
            Operation::Nominate(number) if wanted[number as usize] => {
                let sample = &samples[number as usize];
                nominate(tile, number, sample, cutter_of(scene, sample), &mut scratch, &mut said);
            }
            Operation::Nominate(_) => {}
        }
    }
    make_again(tile, at);
    Some(said)
}
