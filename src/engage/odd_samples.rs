//! Optional samples around which more may stand than the samples before and after meet. In: the nominations, the outcomes at those two. Out: these
//! samples.
//!
//! A thin rib, or the ridges of a raster whose pitch is the spacing of the samples, may lie wholly between two samples that meet the same.
//! Optional samples are so close that the nominations of two neighbours see every cell between them. No arcs are worked out for this: what is
//! compared is how high the stock stands that matters to a band of the cutter, and in which directions.

use super::between_samples::alike;
use super::nominate::{Mark, widened};
use super::sample_outcome::Outcome;
use super::sample_view::{Gathered, View, cutter_of};
use rayon::prelude::*;

/// Difference of the height above the tip up to which stock stands as high, as a share of it: cells of a slope differ.
const SAME_HEIGHT: f64 = 0.05;
/// The same, mm: scallops of a finished surface.
const SAME_MM: f64 = 5e-3;
/// Bins of the diamond angle by which directions may differ, some 5° each.
const SAME_BINS: u32 = 4;
/// Bands by which a mark may be off: where a cell lies between two rings it matters to either.
const SAME_BAND: u16 = 1;

/// Distance of two samples from which on the path between them is asked for, mm: the reach of a mill of 1 mm. Short blocks are sampled closer.
const LEAST_MM: f64 = 0.5;

/// Working space of [`odd_samples`].
#[derive(Default)]
pub struct Room {
    ends: [Vec<Mark>; 2],
    between: Vec<Mark>,
}

/// Those of the samples between two others that may meet more than both.
pub fn odd_samples(view: &View, ends: [usize; 2], met: [&Outcome; 2], room: &mut Room) -> Vec<usize> {
    let apart_mm = (view.samples[ends[1]].tip - view.samples[ends[0]].tip).norm();
    if ends[1] <= ends[0] + 1 || apart_mm < LEAST_MM {
        return Vec::new();
    }
    let cutter = cutter_of(view.scene(), &view.samples[ends[1]]);
    for (end, marks) in ends.iter().zip(&mut room.ends) {
        view.marks(*end, marks);
    }
    let met_mm = met[0].cut.top_mm.max(met[1].cut.top_mm);
    let (mut odd, mut doubtful) = (Vec::new(), Vec::new());
    for index in ends[0] + 1..ends[1] {
        view.marks(index, &mut room.between);
        let tip = view.samples[index].tip.z;
        let ends = [room.ends[0].as_slice(), &room.ends[1]];
        let any = |is_so: &dyn Fn(&Mark) -> bool| room.between.iter().any(is_so);
        let spread = |mark: &Mark| cutter.bands[mark.band as usize].spread;
        if any(&|mark| {
            is_higher(mark, tip, met_mm.max(lower_top(mark, ends) - tip)) || is_elsewhere(mark, ends, spread(mark))
        }) {
            odd.push(index);
        }
        if any(&|mark| is_higher(mark, tip, met_mm)) {
            doubtful.push(index);
        }
    }
    // Stock that is marked at both ends and met at neither is most often a wall along the path, and of a row of ribs each place meets others.
    if odd.is_empty() && met.iter().any(|outcome| is_in_pieces(outcome)) {
        doubtful = (ends[0] + 1..ends[1]).collect();
    }
    if odd.is_empty() { doubtful.get(doubtful.len() / 2).copied().into_iter().collect() } else { odd }
}

/// The pairs of neighbouring samples, in order, in whose middle something else is met though all of a run of pairs are alike: ribs at the pitch
/// of the samples. `are_alike`: for each pair; one place of each run is worked out.
pub fn repeated<'b>(
    view: &View<'b>,
    required: &[usize],
    are_alike: &[bool],
    outcomes: &[Outcome],
) -> Vec<(usize, usize)> {
    let between = |k: usize| required[k] + ((required[k + 1] - required[k]) / 2).max(1);
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
    for k in (0..are_alike.len()).filter(|k| are_alike[*k] && required[*k + 1] > required[*k] + 1) {
        match runs.last_mut() {
            Some(run) if run.end == k => run.end = k + 1,
            _ => runs.push(k..k + 1),
        }
    }
    runs.retain(|run| run.len() > 1);
    let differs = |room: &mut Gathered<'b>, run: &std::ops::Range<usize>| {
        !alike([&view.outcome(between(run.start), room), &outcomes[required[run.start]]])
    };
    let differ: Vec<bool> = runs.par_iter().map_init(Gathered::default, |room, run| differs(room, run)).collect();
    let those = runs.into_iter().zip(differ).filter(|(_, differs)| *differs);
    those.flat_map(|(run, _)| run).map(|k| (k, between(k))).collect()
}

/// Is a slice engaged over more than one arc?
fn is_in_pieces(outcome: &Outcome) -> bool {
    outcome.arcs.windows(2).any(|pair| pair[0].slice == pair[1].slice && pair[0].part == pair[1].part)
}

/// The marks of about the band of another.
fn near<'a>(marks: &'a [Mark], mark: &Mark) -> impl Iterator<Item = &'a Mark> {
    let band = mark.band;
    marks.iter().filter(move |other| other.band.abs_diff(band) <= SAME_BAND)
}

/// Does stock stand higher above the tip than this?
fn is_higher(mark: &Mark, tip: f64, than_mm: f64) -> bool {
    let above_mm = f64::from(mark.top) - tip;
    above_mm > than_mm + SAME_MM.max(SAME_HEIGHT * above_mm)
}

/// Up to where stock is marked at both ends, mm.
fn lower_top(mark: &Mark, ends: [&[Mark]; 2]) -> f64 {
    let top = |marks: &[Mark]| near(marks, mark).map(|other| f64::from(other.top)).fold(f64::NEG_INFINITY, f64::max);
    top(ends[0]).min(top(ends[1]))
}

/// Does stock stand in directions in which it stands at neither end?
fn is_elsewhere(mark: &Mark, ends: [&[Mark]; 2], spread: u32) -> bool {
    let bins = ends.into_iter().flat_map(|marks| near(marks, mark)).fold(0, |all, other| all | other.bins);
    mark.bins & !widened(bins, spread + SAME_BINS) != 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mark(band: u16, top: f32, bins: u64) -> Mark {
        Mark { band, top, bins }
    }

    #[test]
    fn stock_is_higher_by_more_than_a_scallop_and_a_twentieth_of_its_height() {
        // The tip is at −2 mm, and 1 mm above it is met.
        let above = |mm: f32, met_mm: f64| is_higher(&mark(3, mm - 2.0, 1), -2.0, met_mm);
        assert!(above(1.06, 1.0) && !above(1.04, 1.0));
        assert!(above(0.026, 0.02) && !above(0.024, 0.02), "of a thin layer 5 µm decide");
    }

    #[test]
    fn stock_stands_elsewhere_from_five_bins_on_and_bands_beside_count() {
        let ahead = mark(3, 0.0, 0b1);
        let at = |bin: u32, band: u16, spread: u32| is_elsewhere(&mark(band, 0.0, 1 << bin), [&[ahead], &[]], spread);
        assert!(at(5, 3, 0) && !at(4, 3, 0) && at(6, 3, 1) && !at(5, 3, 1));
        assert!(!at(0, 4, 0) && !at(0, 2, 0) && at(0, 5, 0), "the bands beside, and not those beyond");
    }

    #[test]
    fn a_wall_along_the_path_is_marked_at_both_ends() {
        let [wall, floor] = [mark(3, 0.0, 1), mark(3, -1.0, 1)];
        assert_eq!(lower_top(&wall, [&[wall], &[wall]]), 0.0);
        assert_eq!(lower_top(&wall, [&[wall], &[floor]]), -1.0);
        assert_eq!(lower_top(&wall, [&[wall], &[]]), f64::NEG_INFINITY);
    }
}
