//! One batch of the simulation: nomination and sweeping tile by tile, then arcs sample by sample. In: the fields before the batch, its
//! elements and samples in order. Out: the fields after it, and an [`Outcome`] per sample. The second part ([`Swept::finish`]) does not need
//! the fields and runs at the same time as the next batch.
//!
//! Where the engagement at two neighbouring samples differs, or other stock may stand between them ([`super::odd_samples`]), the path between
//! them is examined more closely ([`super::between_samples`]). There the ends of short blocks are needed too ([`super::block_ends`]): for these
//! the sweeps of a tile are undone one after the other, and the tile is queried in between.
//!
//! Tiles are processed in parallel, each through its own operations in order of execution. Their nominations for a sample are merged in the
//! order of the tiles, so the result does not depend on the number of threads.

use super::between_samples::{Between, Locate, alike, look};
use super::block_ends::{joints, turns};
use super::nominate::{Need, Nominations, Sample, Scratch, nominate};
use super::odd_samples::{Room, odd_samples, repeated};
use super::sample_outcome::Outcome;
use super::sample_view::{Gathered, View, cutter_of};
use super::scene::Scene;
use crate::stock::{Field, Past, Tile, Tiling, claim, redo, sweep, undo};
use rayon::prelude::*;

/// The result of a batch.
#[derive(Debug, Default)]
pub struct BatchResult {
    /// One outcome per sample; empty for optional samples.
    pub outcomes: Vec<Outcome>,
    /// For each required sample the stretches between the one before and it, where these were examined.
    pub between: Vec<Option<Between>>,
    /// Volumes removed by the elements that were watched: (element, mm³).
    pub watched: Vec<(u32, f64)>,
}

/// One step of a tile.
#[derive(Debug, Clone, Copy)]
pub enum Operation {
    /// Nominates earlier moves for a sample.
    Nominate(u32),
    /// Lowers the cells that an element sweeps.
    Sweep(u32),
}

/// Two samples between which the path is examined.
struct Pair {
    ends: [usize; 2],
    /// Optional samples between them around which other stock may stand.
    via: Vec<usize>,
}

/// What two neighbouring samples that are worked out tell about the path between them.
struct Seen {
    /// They agree: outcomes of the joints between them.
    agreed: Option<Vec<(usize, Outcome)>>,
    /// Optional samples around which other stock may stand.
    odd: Vec<usize>,
}

/// A batch whose tiles are swept; the arcs are still to be worked out.
pub struct Swept {
    said: Vec<Nominations>,
    outcomes: Vec<Outcome>,
    /// The pairs of neighbouring samples between which the path is examined, and the samples that this takes.
    pairs: Vec<Pair>,
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
    let (pairs, wanted) = look_at(&view, &required, &mut outcomes);
    let more = busiest_first(&mut tiles, operations, |k, tile, operations| {
        let said = look_back(scene, tile, samples, (operations, &marks[k]), &wanted);
        tile.past = Past::default();
        tile.update_highest();
        said
    });
    said.extend(more.into_iter().flatten());
    Swept { said, outcomes, pairs, wanted, watched }
}

/// Processes the tiles that have operations in parallel, those with the most operations first, so that no long one is left at the end.
/// Returns their results in the order of the tiles. `work` gets the number of such tiles before it.
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
    /// Works out the arcs at all samples, and between neighbouring samples whose engagement differs.
    pub fn finish(self, scene: &Scene, samples: &[Sample], locate: Locate) -> BatchResult {
        let Self { said, mut outcomes, pairs, wanted, watched } = self;
        let view = View::new(scene, samples, &said);
        let joints: Vec<usize> = (0..samples.len()).filter(|k| wanted[*k] && samples[*k].need == Need::Joint).collect();
        work_out(&view, &joints, &mut outcomes);
        let mut between = vec![None; samples.len()];
        let looked: Vec<(usize, Option<Between>)> = pairs
            .par_iter()
            .with_max_len(32)
            .map_init(Gathered::default, |room, Pair { ends, via }| {
                (ends[1], look(&view, (*ends, via), ends.map(|end| &outcomes[end]), locate, room))
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

/// The pairs of neighbouring samples between which the path has to be examined, and the samples that this takes. Joints whose neighbours
/// agree get their outcomes from these neighbours.
fn look_at(view: &View, required: &[usize], outcomes: &mut [Outcome]) -> (Vec<Pair>, Vec<bool>) {
    let (scene, samples) = (view.scene(), view.samples);
    let (mut pairs, mut wanted) = (Vec::new(), vec![false; samples.len()]);
    let joint = |k: &usize| samples[*k].need == Need::Joint;
    let chained = |pair: &[usize]| (pair[0] + 1..pair[1]).any(|k| joint(&k));
    let agreed = |k: usize| {
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
    let is_cut = |k: usize| !outcomes[required[k]].arcs.is_empty();
    let odd = |k: usize, room: &mut Room| {
        let ends = [required[k], required[k + 1]];
        if !chained(&ends) && (is_cut(k) || is_cut(k + 1)) {
            odd_samples(view, ends, ends.map(|end| &outcomes[end]), room)
        } else {
            Vec::new()
        }
    };
    let mut looks: Vec<Seen> = (0..pairs_of)
        .into_par_iter()
        .with_max_len(128)
        .map_init(Room::default, |room, k| Seen { agreed: agreed(k), odd: odd(k, room) })
        .collect();
    let is_alike = |seen: &Seen| seen.agreed.as_ref().is_some_and(Vec::is_empty) && seen.odd.is_empty();
    let are_alike: Vec<bool> = looks.iter().map(is_alike).collect();
    for (k, between) in repeated(view, required, &are_alike, outcomes) {
        looks[k].odd.push(between);
    }
    for (ends, Seen { agreed, odd }) in required.windows(2).zip(looks) {
        if let Some(mixed) = agreed.filter(|_| odd.is_empty()) {
            for (index, outcome) in mixed {
                outcomes[index] = outcome;
            }
            continue;
        }
        wanted[ends[0] + 1..ends[1]].fill(true);
        let mut from = ends[0];
        for to in (ends[0] + 1..ends[1]).filter(joint).chain([ends[1]]) {
            let via = odd.iter().copied().filter(|k| (from..to).contains(k)).collect();
            pairs.push(Pair { ends: [from, to], via });
            from = to;
        }
    }
    (pairs, wanted)
}

/// The result of one tile: its nominations, the volumes watched, and, where sweeps may have to be undone, how much there was to undo before
/// each operation.
struct Worked {
    said: Nominations,
    watched: Vec<(u32, f64)>,
    marks: Vec<usize>,
}

/// Operations of every tile of the fields in order of execution: the elements `elements` (indices into the scene) and the
/// samples, which are sorted by element. `until`: for each tile the element from which on it need not be swept; empty: sweep all.
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

/// Carries out the operations of a tile, except nominations for samples that may turn out not to be needed.
fn work_tile(
    scene: &Scene,
    tile: &mut Tile,
    samples: &[Sample],
    operations: &[Operation],
    watch: &(impl Fn(u32) -> bool + Sync),
) -> Worked {
    let later = |number: u32| samples[number as usize].need == Need::Joint;
    if operations.iter().any(|operation| matches!(operation, Operation::Nominate(k) if later(*k))) {
        tile.past.begin(operations.len());
    }
    let (mut said, mut watched, mut scratch) = (Nominations::default(), Vec::new(), Scratch::default());
    let mut marks = Vec::with_capacity(if tile.past.on { operations.len() } else { 0 });
    for operation in operations {
        if tile.past.on {
            marks.push(tile.past.mark());
        }
        match *operation {
            Operation::Nominate(number) if later(number) => {}
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

/// Nominates for the samples that turned out to be needed, last first, on the tile as it was at each; afterwards the tile is as before. A
/// height that no cell exceeded before the batch is exceeded by none during it.
fn look_back(
    scene: &Scene,
    tile: &mut Tile,
    samples: &[Sample],
    (operations, marks): (&[Operation], &[usize]),
    wanted: &[bool],
) -> Option<Nominations> {
    let is_wanted = |number: u32| wanted[number as usize] && samples[number as usize].need == Need::Joint;
    let asks = |operation: &Operation| matches!(operation, Operation::Nominate(k) if is_wanted(*k));
    let first = operations.iter().take(marks.len()).position(asks)?;
    let (mut said, mut scratch) = (Nominations::default(), Scratch::default());
    let mut at = tile.past.mark();
    for (operation, mark) in operations.iter().zip(marks).skip(first).rev() {
        match *operation {
            Operation::Sweep(_) => {
                undo(tile, [*mark, at]);
                at = *mark;
            }
            Operation::Nominate(number) if is_wanted(number) => {
                let sample = &samples[number as usize];
                nominate(tile, number, sample, cutter_of(scene, sample), &mut scratch, &mut said);
            }
            Operation::Nominate(_) => {}
        }
    }
    redo(tile, at);
    Some(said)
}
