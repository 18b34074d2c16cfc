//! The nominations of all tiles for the samples of a batch, merged. In: nominations, tile by tile. Out: the outcome at a sample, or between two.

use super::arcs::arcs_at;
use super::cover::Cover;
use super::cutter::Cutter;
use super::nominate::{Mark, Nomination, Nominations, Sample};
use super::sample_outcome::Outcome;
use super::scene::{RawArc, Scene};
use crate::ids::MoveId;

/// Height of stock above the neck of an undercutting tool that counts as rounding, mm.
const UNDERCUT_MM: f64 = 0.01;

/// Cutter at a sample.
pub fn cutter_of<'a>(scene: &'a Scene, sample: &Sample) -> &'a Cutter {
    &scene.cutters[sample.cutter as usize]
}

/// Where the nominations for each sample are.
struct Merged {
    first: Vec<u32>,
    /// (tile, entry, first mark, first candidate)
    places: Vec<[u32; 4]>,
}

impl Merged {
    fn new(said: &[Nominations], samples: usize) -> Self {
        let mut first = vec![0u32; samples + 1];
        for entry in said.iter().flat_map(|said| &said.entries) {
            first[entry.sample as usize + 1] += 1;
        }
        for k in 0..samples {
            first[k + 1] += first[k];
        }
        let mut at = first.clone();
        let mut places = vec![[0; 4]; first[samples] as usize];
        for (tile, said) in said.iter().enumerate() {
            let (mut marks, mut candidates) = (0, 0);
            for (index, entry) in said.entries.iter().enumerate() {
                let slot = &mut at[entry.sample as usize];
                places[*slot as usize] = [tile as u32, index as u32, marks, candidates];
                *slot += 1;
                marks += entry.marks;
                candidates += entry.candidates;
            }
        }
        Self { first, places }
    }
    fn of(&self, sample: usize) -> &[[u32; 4]] {
        &self.places[self.first[sample] as usize..self.first[sample + 1] as usize]
    }
}

/// Working space of an outcome.
#[derive(Default)]
pub struct Gathered<'a> {
    marks: Vec<Mark>,
    candidates: Vec<u32>,
    covers: Vec<Cover<'a>>,
    arcs: Vec<RawArc>,
}

/// The merged nominations for the samples of a batch.
pub struct View<'a> {
    scene: &'a Scene<'a>,
    /// The samples.
    pub samples: &'a [Sample],
    merged: Merged,
    said: &'a [Nominations],
}

impl<'a> View<'a> {
    /// Merges the nominations of the tiles.
    pub fn new(scene: &'a Scene<'a>, samples: &'a [Sample], said: &'a [Nominations]) -> Self {
        View { scene, samples, merged: Merged::new(said, samples.len()), said }
    }
    /// The geometry around the samples.
    pub fn scene(&self) -> &'a Scene<'a> {
        self.scene
    }
    /// Move of a sample.
    pub fn move_of(&self, index: usize) -> MoveId {
        self.scene.elements[self.samples[index].element as usize].move_id
    }
    /// May there be material at this sample, as far as the grid tells?
    pub fn nominated(&self, index: usize) -> bool {
        self.entries(index).any(|(entry, ..)| entry.marks > 0)
    }
    /// What the tiles mark around a sample, sorted by band.
    pub fn marks(&self, index: usize, marks: &mut Vec<Mark>) {
        marks.clear();
        for (entry, tile, mark, _) in self.entries(index) {
            marks.extend_from_slice(&self.said[tile].marks[mark as usize..(mark + entry.marks) as usize]);
        }
        merge(marks);
    }
    /// Outcome at a position between a sample and the next one, from the nominations for both.
    pub fn outcome_between(&self, index: usize, sample: &Sample, gathered: &mut Gathered<'a>) -> Outcome {
        let mut outcome = Outcome::default();
        gathered.marks.clear();
        gathered.candidates.clear();
        for index in [index, index + 1] {
            self.gather(index, gathered, &mut outcome);
        }
        // The later sample knows chords that are still to come here, and may show nothing else of those that went before.
        gathered.candidates.retain(|id| *id < sample.element);
        let own = self.scene.elements[sample.element as usize].move_id;
        let since = self.samples[index].element..sample.element;
        gathered.candidates.extend(since.filter(|id| self.scene.elements[*id as usize].move_id == own));
        self.resolve(sample, gathered, &mut outcome);
        outcome
    }
    /// Outcome at a sample.
    pub fn outcome(&self, index: usize, gathered: &mut Gathered<'a>) -> Outcome {
        let sample = &self.samples[index];
        let mut outcome = Outcome { clear: self.scene.clear_of_fixtures(sample), ..Outcome::default() };
        gathered.marks.clear();
        gathered.candidates.clear();
        self.gather(index, gathered, &mut outcome);
        self.resolve(sample, gathered, &mut outcome);
        outcome
    }
    fn entries(&self, index: usize) -> impl Iterator<Item = (Nomination, usize, u32, u32)> {
        self.merged.of(index).iter().map(|[tile, entry, mark, candidate]| {
            let tile = *tile as usize;
            (self.said[tile].entries[*entry as usize], tile, *mark, *candidate)
        })
    }
    fn gather(&self, index: usize, gathered: &mut Gathered<'a>, outcome: &mut Outcome) {
        for (entry, tile, mark, candidate) in self.entries(index) {
            let said = &self.said[tile];
            outcome.clear &= entry.clear;
            let struck = outcome.struck;
            outcome.struck = [struck[0].max(entry.struck[0]), struck[1].max(entry.struck[1])];
            gathered.marks.extend_from_slice(&said.marks[mark as usize..(mark + entry.marks) as usize]);
            let candidates = &said.candidates[candidate as usize..(candidate + entry.candidates) as usize];
            gathered.candidates.extend_from_slice(candidates);
        }
    }
    fn resolve(&self, sample: &Sample, gathered: &mut Gathered<'a>, outcome: &mut Outcome) {
        merge(&mut gathered.marks);
        gathered.candidates.sort_unstable();
        gathered.candidates.dedup();
        self.scene.add_retraced(&mut gathered.candidates, sample, &gathered.marks);
        self.scene.add_along(&mut gathered.candidates, sample, &gathered.marks);
        let neck = cutter_of(self.scene, sample).neck_mm.map_or(f64::INFINITY, |neck| sample.tip.z + neck);
        outcome.undercut = gathered.marks.iter().any(|mark| f64::from(mark.top) > neck + UNDERCUT_MM);
        gathered.arcs.clear();
        let asked = (gathered.marks.as_slice(), gathered.candidates.as_slice());
        outcome.cut = arcs_at(self.scene, sample, asked, &mut gathered.covers, &mut gathered.arcs);
        outcome.arcs = gathered.arcs.as_slice().to_vec();
        outcome.struck[0] = outcome.struck[0].max(outcome.cut.rub_mm as f32);
    }
}

/// Makes one mark of those of a band, by which they are sorted.
fn merge(marks: &mut Vec<Mark>) {
    marks.sort_by_key(|mark| mark.band);
    marks.dedup_by(|next, kept| {
        let one = next.band == kept.band;
        if one {
            kept.bins |= next.bins;
            kept.top = kept.top.max(next.top);
        }
        one
    });
}
