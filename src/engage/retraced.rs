//! Earlier elements along the same wall. In: the elements, the extents of the stock, the width of a cell. Out: for a place on one of them, those
//! before it that left a wall less than a strip without cell centres beside the wall that it leaves.
//!
//! A cell knows only what lowered it last. A wall that was finished at one depth may lie less than a cell beside the roughed one; once the
//! roughing of the next depth has lowered the cell, nothing tells that the wall above is finished, unless a cell has its centre between the two. The
//! next finishing cut would seem to take the strip again, over the whole height.
//!
//! So the walls on both sides of every element are entered in a grid of squares, by the places that they pass.

use super::nominate::Sample;
use crate::machine::Box3;
use crate::stock::{Element, SLIVER_CELLS, Track};
use rayon::slice::ParallelSliceMut;

/// Elements that are added for a wall at a place: those that cut most of it, and of lower ones that cut less the next.
const MOST: usize = 16;
/// Most squares along a side of the grid, and length of path, mm, from which on squares grow so that the grid stays within some 50 MB.
const MOST_SQUARES: f64 = 2048.0;
const LONG_PATH_MM: f64 = 4e6;
/// Part of an element, as a share, up to which a place is abreast of its end.
const AT_END: f64 = 1e-9;

/// The elements by the places that their walls pass.
#[derive(Debug, Default)]
pub struct Retraced {
    low: [f64; 2],
    edge_mm: f64,
    squares: [usize; 2],
    /// Where the elements of each square begin in `ids`.
    begins: Vec<u32>,
    ids: Vec<u32>,
    /// Distance between two walls up to which no cell may lie between them, mm.
    strip_mm: f64,
}

impl Retraced {
    /// Enters the walls in and about the stock; `radius_mm` is that of the cutter of each element.
    pub fn new(elements: &[Element], radius_mm: impl Fn(&Element) -> f64, stock: &[Box3], cell_mm: f64) -> Self {
        // A cutter meets the stock ahead of it while its walls are abreast of a place outside.
        let widest_mm = elements.iter().map(&radius_mm).fold(0.0, f64::max);
        let Some([low, high]) = around(stock, widest_mm) else { return Self::default() };
        let strip_mm = SLIVER_CELLS * cell_mm;
        let path_mm: f64 = elements.iter().map(|element| element.track.length()).sum();
        let widest = (high[0] - low[0]).max(high[1] - low[1]);
        let edge_mm = strip_mm.max(widest / MOST_SQUARES).max(strip_mm * path_mm / LONG_PATH_MM);
        let squares = [0, 1].map(|axis| ((high[axis] - low[axis]) / edge_mm) as usize + 1);
        let mut grid = Self { low, edge_mm, squares, strip_mm, ..Self::default() };
        let mut entries: Vec<(u32, u32)> = Vec::new();
        for (id, element) in elements.iter().enumerate() {
            along_walls(&element.track, radius_mm(element), 0.5 * edge_mm, |at| {
                entries.extend(grid.square(at).map(|square| (square, id as u32)));
            });
        }
        entries.par_sort_unstable();
        entries.dedup();
        let count = (squares[0] * squares[1]) as u32;
        grid.begins = (0..=count).map(|square| entries.partition_point(|(at, _)| *at < square) as u32).collect();
        grid.ids = entries.into_iter().map(|(_, id)| id).collect();
        grid
    }

    /// Adds to the candidates those that left a wall beside one of the walls of a sample before.
    pub fn add(
        &self,
        elements: &[Element],
        sample: &Sample,
        radius_mm: impl Fn(&Element) -> f64,
        candidates: &mut Vec<u32>,
    ) {
        let radius = radius_mm(&elements[sample.element as usize]);
        let [forward_x, forward_y] = sample.dir;
        for by in [-radius, radius] {
            let wall = [sample.tip.x - by * forward_y, sample.tip.y + by * forward_x];
            let beside = |id: &u32| {
                let element = &elements[*id as usize];
                let (distance, height, at) = nearest(&element.track, wall);
                let reach = radius_mm(element) - distance;
                // What ends before the place is left to what goes on from there.
                let goes_on = at > 1.0 - AT_END && elements.get(*id as usize + 1).is_some_and(|next| next.joined);
                (reach.abs() <= self.strip_mm && !goes_on).then_some((height, reach, *id))
            };
            let mut found: Vec<(f64, f64, u32)> =
                self.near(wall).filter(|id| **id < sample.element).filter_map(beside).collect();
            found.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)).then(a.2.cmp(&b.2)));
            let mut most = f64::NEG_INFINITY;
            found.retain(|(_, reach, _)| {
                let more = *reach > most;
                most = most.max(*reach);
                more
            });
            candidates.extend(found.iter().rev().take(MOST).map(|(.., id)| *id));
        }
    }

    /// Number of the square that holds a place.
    fn square(&self, at: [f64; 2]) -> Option<u32> {
        let [x, y] = [0, 1].map(|axis| ((at[axis] - self.low[axis]) / self.edge_mm).floor());
        let inside = x >= 0.0 && y >= 0.0 && x < self.squares[0] as f64 && y < self.squares[1] as f64;
        inside.then(|| (y as usize * self.squares[0] + x as usize) as u32)
    }

    /// The elements in the square of a place and those about it; some more than once.
    fn near(&self, at: [f64; 2]) -> impl Iterator<Item = &u32> {
        let [x, y] = [0, 1].map(|axis| ((at[axis] - self.low[axis]) / self.edge_mm).floor() as i64);
        let clip = |from: i64, axis: usize| from.clamp(0, self.squares[axis] as i64) as usize;
        let [columns, rows] = [(x, 0), (y, 1)].map(|(at, axis)| clip(at - 1, axis)..clip(at + 2, axis));
        rows.flat_map(move |row| {
            let square = |column: usize| self.begins[row * self.squares[0] + column] as usize;
            if columns.is_empty() { &[] } else { &self.ids[square(columns.start)..square(columns.end)] }
        })
    }
}

/// Smallest rectangle about boxes, grown by this, if there are any.
fn around(boxes: &[Box3], by_mm: f64) -> Option<[[f64; 2]; 2]> {
    let of = |one: &Box3| [[one.min.x - by_mm, one.min.y - by_mm], [one.max.x + by_mm, one.max.y + by_mm]];
    boxes.iter().map(of).reduce(|[low, high], [other_low, other_high]| {
        [[0, 1].map(|axis| low[axis].min(other_low[axis])), [0, 1].map(|axis| high[axis].max(other_high[axis]))]
    })
}

/// Visits places on both walls of a track, at most `step_mm` apart; none where it goes straight down.
fn along_walls(track: &Track, radius_mm: f64, step_mm: f64, mut visit: impl FnMut([f64; 2])) {
    match *track {
        Track::Line { from, to } => {
            let (x, y) = (to.x - from.x, to.y - from.y);
            let length = x.hypot(y);
            if length <= 0.0 {
                return;
            }
            let steps = (length / step_mm).ceil();
            for by in [-radius_mm, radius_mm].map(|radius| radius / length) {
                for k in 0..=steps as usize {
                    let share = k as f64 / steps;
                    visit([from.x + share * x - by * y, from.y + share * y + by * x]);
                }
            }
        }
        Track::Arc { centre, radius, start, sweep, .. } => {
            let steps = ((radius[0].max(radius[1]) + radius_mm) * sweep.abs() / step_mm).ceil().max(1.0);
            for by in [-radius_mm, radius_mm] {
                for k in 0..=steps as usize {
                    let share = k as f64 / steps;
                    let (sin, cos) = (start + share * sweep).sin_cos();
                    let from_centre = radius[0] + share * (radius[1] - radius[0]) + by;
                    visit([centre[0] + from_centre * cos, centre[1] + from_centre * sin]);
                }
            }
        }
    }
}

/// Distance in XY of a place from a track, mm, with the height of the track there and the share of it that lies before.
fn nearest(track: &Track, at: [f64; 2]) -> (f64, f64, f64) {
    match *track {
        Track::Line { from, to } => {
            let (x, y) = (to.x - from.x, to.y - from.y);
            let square = x * x + y * y;
            let along = (at[0] - from.x) * x + (at[1] - from.y) * y;
            let share = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 };
            let distance = (from.x + share * x - at[0]).hypot(from.y + share * y - at[1]);
            (distance, from.z + share * (to.z - from.z), share)
        }
        Track::Arc { centre, z, radius, start, sweep } => {
            let (x, y) = (at[0] - centre[0], at[1] - centre[1]);
            let turned = sweep.signum() * (y.atan2(x) - start);
            let share = turned.rem_euclid(std::f64::consts::TAU) / sweep.abs();
            if share <= 1.0 {
                let own = radius[0] + share * (radius[1] - radius[0]);
                return ((x.hypot(y) - own).abs(), z, share);
            }
            let (from, to) = track.ends();
            let distances = [from, to].map(|end| (end.x - at[0]).hypot(end.y - at[1]));
            if distances[0] < distances[1] { (distances[0], z, 0.0) } else { (distances[1], z, 1.0) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engage::nominate::Need;
    use crate::ids::MoveId;
    use crate::path::Vec3;

    fn line(from: [f64; 3], to: [f64; 3]) -> Track {
        Track::Line { from: Vec3::from(from), to: Vec3::from(to) }
    }

    fn arc(centre: [f64; 2], radius: f64, sweep: f64) -> Track {
        Track::Arc { centre, z: -8.0, radius: [radius; 2], start: 0.0, sweep }
    }

    /// Elements that are added for a place at the middle of the last one; the cutter of the first has a radius of 5, that of the others of 6 mm.
    /// Cells are 0.4 mm wide, so the strip is 0.9 mm.
    fn added(tracks: &[Track]) -> Vec<u32> {
        added_at(0.5, tracks)
    }

    /// The same at a share of the last one.
    fn added_at(share: f64, tracks: &[Track]) -> Vec<u32> {
        let ends = |k: usize| tracks[k].ends();
        let element = |(id, track): (usize, &Track)| Element {
            track: *track,
            from_mm: 0.0,
            move_id: MoveId(id as u32),
            cutter: u16::from(id > 0),
            joined: id > 0 && (ends(id).0 - ends(id - 1).1).norm() < 1e-9,
        };
        let elements: Vec<Element> = tracks.iter().enumerate().map(element).collect();
        let radius_mm = |element: &Element| 5.0 + f64::from(element.cutter);
        let last = elements.len() as u32 - 1;
        let track = elements[last as usize].track;
        let along_mm = share * track.length();
        let tip = track.point(along_mm);
        let ahead = (track.point(along_mm + 1e-6) - track.point(along_mm - 1e-6)).normalize();
        let sample = Sample {
            element: last,
            along_mm,
            s_mm: 0.0,
            tip,
            dir: [ahead.x, ahead.y],
            tangent: [1.0, 0.0],
            cutter: 1,
            clearance_mm: 0.0,
            need: Need::Always,
        };
        let mut candidates = Vec::new();
        let stock = Box3 { min: Vec3::new(-50.0, -50.0, -20.0), max: Vec3::new(120.0, 120.0, 0.0) };
        Retraced::new(&elements, radius_mm, &[stock], 0.4).add(&elements, &sample, radius_mm, &mut candidates);
        candidates.sort_unstable();
        candidates.dedup();
        candidates
    }

    /// Along x at this y and height.
    fn at_y(y: f64, z: f64) -> Track {
        line([0.0, y, z], [100.0, y, z])
    }

    #[test]
    fn a_wall_is_known_again_whichever_way_and_with_whichever_cutter_it_was_cut() {
        let last = line([-9.0, 72.0, -8.0], [110.0, 72.0, -8.0]);
        // The walls are at y = 66 and 78. The smaller cutter left the first, at two depths, and one the other way has left the second.
        let back = line([110.0, 72.0, -3.0], [-9.0, 72.0, -3.0]);
        assert_eq!(added(&[at_y(71.0, -4.0), back, last]), [0, 1]);
        let skew = line([0.0, 71.6, -4.0], [100.0, 72.4, -4.0]);
        assert_eq!(added(&[at_y(0.0, -4.0), skew, last]), [1]);
        let round = |radius: f64| arc([9.0, 3.0], radius, -2.0);
        assert_eq!(added(&[round(13.0), round(13.5), round(12.0)]), [0], "the wall of radius 18, not that of 19.5");
        // One that goes straight down leaves no wall.
        assert_eq!(added(&[at_y(0.0, -4.0), line([50.0, 72.0, 5.0], [50.0, 72.0, -8.0]), last]), [] as [u32; 0]);
    }

    #[test]
    fn a_wall_within_a_strip_without_cells_counts_on_both_sides() {
        for (off, counts) in [(0.89, true), (-0.89, true), (0.91, false), (-0.91, false)] {
            let found = added(&[at_y(0.0, -4.0), at_y(50.0 + off, -4.0), at_y(50.0, -8.0)]);
            assert_eq!(found.contains(&1), counts, "{off} mm beside it");
        }
    }

    #[test]
    fn only_what_reaches_the_place_counts() {
        let last = at_y(50.0, -8.0);
        // The place is x = 50: a wall that ends less than a square before it is found, and none that ends two before it.
        let until = |x: f64| line([0.0, 50.0, -4.0], [x, 50.0, -4.0]);
        assert_eq!(added(&[at_y(0.0, 0.0), until(49.3), last]), [1]);
        assert_eq!(added(&[at_y(0.0, 0.0), until(48.1), last]), [] as [u32; 0]);
        // What goes on from there stands for both.
        let on = line([49.3, 50.0, -4.0], [60.0, 50.0, -4.0]);
        assert_eq!(added(&[at_y(0.0, 0.0), until(49.3), on, last]), [2]);
        // So does the own path for what lies behind, and a way back along it is found.
        let half = line([0.0, 50.0, -8.0], [50.0, 50.0, -8.0]);
        let rest = line([50.0, 50.0, -8.0], [100.0, 50.0, -8.0]);
        assert_eq!(added_at(0.01, &[at_y(0.0, 0.0), half, rest]), [] as [u32; 0]);
        assert_eq!(added(&[at_y(0.0, 0.0), half, line([50.0, 50.0, -8.0], [0.0, 50.0, -8.0])]), [1]);
    }

    #[test]
    fn the_lowest_count_and_above_them_those_that_cut_more() {
        // Each leaves 0.04 mm more on the wall at y = 44 than the one above, and less at y = 56.
        let levels = |count: usize| (0..count).map(|k| at_y(50.0 + 0.04 * k as f64, -2.0 - 0.1 * k as f64));
        let all = |count: usize| [at_y(0.0, -1.0)].into_iter().chain(levels(count)).chain([at_y(50.0, -8.0)]);
        let of = |count: usize| added(&all(count).collect::<Vec<_>>());
        assert_eq!(of(16), (1..=16).collect::<Vec<u32>>());
        // At most sixteen that cut most, and the lowest, which cuts most of the other wall.
        assert_eq!(of(18), (1..=16).chain([18]).collect::<Vec<u32>>());
        // At one wall like another only the lowest.
        let same = [at_y(0.0, -1.0), at_y(50.0, -2.0), at_y(50.0, -6.0), at_y(50.0, -4.0), at_y(50.0, -8.0)];
        assert_eq!(added(&same), [2]);
    }
}
