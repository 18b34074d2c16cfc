//! Earlier elements along the same wall. In: the elements. Out: for a place on one of them, those before it that left a wall where it leaves one.
//!
//! A cell knows only what lowered it last. A wall that was finished at one depth may lie less than a cell beside the roughed one; once the
//! roughing of the next depth has lowered the cell, nothing tells that the wall above is finished, unless a cell has its centre between the two. The
//! next finishing cut would seem to take the strip again, over the whole height.

use super::nominate::Sample;
use crate::path::Vec3;
use crate::stock::{Element, Track};

/// Least length in XY, mm, of an element that is looked up: of shorter ones the cells of a strip show several, and their neighbours along the
/// path are looked at too.
const LEAST_MM: f64 = 1.0;
/// Distance up to which two walls are the same, mm, and difference of their directions. Coordinates have three decimals or more.
const SAME_MM: f64 = 1e-3;
const SAME_DIRECTION: f64 = 1e-6;
/// Elements that are added for a wall at a place: the lowest, and where they end others go on.
const MOST: usize = 4;
/// Elements of one wall that are looked through: levels of a part, each cut into a few blocks.
const MOST_LEVELS: usize = 64;

/// The elements by the walls that they leave.
#[derive(Debug, Default)]
pub struct Retraced {
    /// Wall and element, sorted.
    by_wall: Vec<(Wall, u32)>,
}

/// A line or circle in XY, in steps within which two are the same: direction and distance from the origin, or centre and radius.
type Wall = [i64; 3];

impl Retraced {
    /// Sorts the elements by their walls; `radius_mm` is that of the cutter of each.
    pub fn new(elements: &[Element], radius_mm: impl Fn(&Element) -> f64) -> Self {
        let own = |(id, element): (usize, &Element)| {
            walls_of(&element.track, radius_mm(element)).into_iter().flatten().map(move |wall| (wall, id as u32))
        };
        let mut by_wall: Vec<(Wall, u32)> = elements.iter().enumerate().flat_map(own).collect();
        by_wall.sort_unstable();
        Self { by_wall }
    }

    /// Adds to the candidates those that left one of the walls of a sample before, and reach it.
    pub fn add(
        &self,
        elements: &[Element],
        sample: &Sample,
        radius_mm: impl Fn(&Element) -> f64,
        candidates: &mut Vec<u32>,
    ) {
        let own = &elements[sample.element as usize];
        for wall in walls_of(&own.track, radius_mm(own)).into_iter().flatten() {
            let end = self.by_wall.partition_point(|known| *known < (wall, sample.element));
            let before = self.by_wall[..end].iter().rev().take_while(|(other, _)| *other == wall).take(MOST_LEVELS);
            let reaching = |(_, id): &(Wall, u32)| {
                let element = &elements[*id as usize];
                let (low, high) = element.track.bounds();
                is_within((low, high), sample.tip, radius_mm(element)).then_some((low.z, *id))
            };
            let mut found: Vec<(f64, u32)> = before.filter_map(reaching).collect();
            found.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
            candidates.extend(found.iter().take(MOST).map(|(_, id)| *id));
        }
    }
}

/// Does a box, grown by this in XY, hold a place?
fn is_within((low, high): (Vec3, Vec3), at: Vec3, by_mm: f64) -> bool {
    (0..2).all(|axis| (low[axis] - by_mm..=high[axis] + by_mm).contains(&at[axis]))
}

/// The walls that a cutter of this radius leaves on both sides of a track; none of short ones.
fn walls_of(track: &Track, radius_mm: f64) -> [Option<Wall>; 2] {
    let steps = |value: f64, step: f64| (value / step).round() as i64;
    match *track {
        Track::Line { from, to } => {
            // Either way along it, from the same end.
            let (from, to) = if (from.x, from.y) <= (to.x, to.y) { (from, to) } else { (to, from) };
            let (x, y) = (to.x - from.x, to.y - from.y);
            let length = x.hypot(y);
            let beside = (from.y * x - from.x * y) / length;
            let wall = |by: f64| [steps(y.atan2(x), SAME_DIRECTION), steps(beside + by, SAME_MM), i64::MIN];
            [-radius_mm, radius_mm].map(|by| (length >= LEAST_MM).then(|| wall(by)))
        }
        Track::Arc { centre, radius, sweep, .. } => {
            let is_long = radius[0].min(radius[1]) * sweep.abs() >= LEAST_MM;
            let [x, y] = centre.map(|at| steps(at, SAME_MM));
            let wall = |by: f64| [x, y, steps((radius[0] + by).abs(), SAME_MM)];
            [-radius_mm, radius_mm].map(|by| is_long.then(|| wall(by)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engage::nominate::Need;
    use crate::ids::MoveId;

    fn line(from: [f64; 3], to: [f64; 3]) -> Track {
        Track::Line { from: Vec3::from(from), to: Vec3::from(to) }
    }

    fn arc(centre: [f64; 2], radius: f64, sweep: f64) -> Track {
        Track::Arc { centre, z: -8.0, radius: [radius; 2], start: 0.0, sweep }
    }

    /// Elements that are added for a place at the middle of the last one; the cutter of the first has a radius of 5, that of the others of 6 mm.
    fn added(tracks: &[Track]) -> Vec<u32> {
        let element = |(id, track): (usize, &Track)| Element {
            track: *track,
            from_mm: 0.0,
            move_id: MoveId(id as u32),
            cutter: u16::from(id > 0),
            joined: false,
        };
        let elements: Vec<Element> = tracks.iter().enumerate().map(element).collect();
        let radius_mm = |element: &Element| 5.0 + f64::from(element.cutter);
        let last = elements.len() as u32 - 1;
        let track = elements[last as usize].track;
        let sample = Sample {
            element: last,
            along_mm: 0.5 * track.length(),
            s_mm: 0.0,
            tip: track.point(0.5 * track.length()),
            dir: [1.0, 0.0],
            tangent: [1.0, 0.0],
            cutter: 1,
            clearance_mm: 0.0,
            need: Need::Always,
        };
        let mut candidates = Vec::new();
        Retraced::new(&elements, radius_mm).add(&elements, &sample, radius_mm, &mut candidates);
        candidates.sort_unstable();
        candidates.dedup();
        candidates
    }

    #[test]
    fn a_wall_is_known_again_whichever_way_and_with_whichever_cutter_it_was_cut() {
        let last = line([-9.0, 72.0, -8.0], [110.0, 72.0, -8.0]);
        let same = line([110.0, 72.0, -4.0], [-9.0, 72.0, -4.0]);
        let smaller = line([-9.0, 71.0, -4.0], [110.0, 71.0, -4.0]);
        let other_side = line([-9.0, 67.0, -4.0], [110.0, 67.0, -4.0]);
        let beside = line([-9.0, 72.002, -4.0], [110.0, 72.002, -4.0]);
        assert_eq!(added(&[smaller, same, beside, last]), [0, 1]);
        assert_eq!(added(&[other_side, beside, last]), [] as [u32; 0]);
        assert_eq!(
            added(&[arc([9.0, 3.0], 13.0, -2.0), arc([9.0, 3.0], 12.5, -2.0), arc([9.0, 3.0], 12.0, -2.0)]),
            [0]
        );
    }

    #[test]
    fn only_what_reaches_the_place_counts_and_the_lowest_of_many() {
        let at = |x: [f64; 2], z: f64| line([x[0], 72.0, z], [x[1], 72.0, z]);
        // The place is x = 50: the first ends 6 mm before it, the second 6.1 mm, and the third is too short.
        let near = at([0.0, 44.0], -1.0);
        assert_eq!(added(&[near, near, at([0.0, 43.9], -1.0), at([49.5, 50.4], -1.0), at([0.0, 100.0], -8.0)]), [1]);
        let levels: Vec<Track> = (0..7).chain([20]).map(|k| at([0.0, 100.0], -f64::from(k))).collect();
        assert_eq!(added(&levels), [3, 4, 5, 6]);
        // Of 70 from below, the last 64 are looked through.
        let upwards: Vec<Track> = (0..71).map(|k| at([0.0, 100.0], f64::from(k) - 80.0)).collect();
        assert_eq!(added(&upwards), [6, 7, 8, 9]);
    }

    #[test]
    fn what_is_long_enough_and_runs_the_same_way_counts() {
        let last = line([0.0, 72.0, -8.0], [100.0, 72.0, -8.0]);
        let is_added = |from: [f64; 3], to: [f64; 3]| added(&[last, line(from, to), last]).contains(&1);
        assert!(is_added([49.4, 72.0, -1.0], [50.5, 72.0, -1.0]) && !is_added([49.5, 72.0, -1.0], [50.4, 72.0, -1.0]));
        let turned_by = |rad: f64| is_added([0.0, 72.0, -1.0], [100.0, 72.0 + 100.0 * rad, -1.0]);
        assert!(turned_by(2e-7) && !turned_by(3e-6));
    }
}
