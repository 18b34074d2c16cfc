//! Order of cutting of the stretches of levels. In: stretches, each with those above it. Out: the same in order; closed
//! ones start and end at the point nearest to the end of the one before.
//!
//! A stretch can be cut when all above it have been cut; of these the one that starts nearest is next. So the tool
//! finishes one peak before it continues with the next.

use super::plan::Spot;

/// A stretch of a level.
#[derive(Debug, Clone)]
pub struct LevelStretch {
    /// Its spots in order of cutting; the first of a closed one is not repeated.
    pub spots: Vec<Spot>,
    /// Is it closed?
    pub closed: bool,
    /// Does it run with the higher ground on its left?
    pub back: bool,
    /// Numbers of the stretches directly above it.
    pub parents: Vec<usize>,
    /// Height of the tip where it is one throughout, mm.
    pub level_mm: Option<f64>,
}

/// The stretches in the order of cutting, the first near a place.
pub fn order(strands: Vec<LevelStretch>, from: Option<[f64; 2]>) -> Vec<LevelStretch> {
    let mut missing: Vec<usize> = strands.iter().map(|strand| strand.parents.len()).collect();
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); strands.len()];
    for (k, strand) in strands.iter().enumerate() {
        strand.parents.iter().for_each(|parent| children[*parent].push(k));
    }
    let mut ready: Vec<usize> = (0..strands.len()).filter(|k| missing[*k] == 0).collect();
    let mut strands: Vec<Option<LevelStretch>> = strands.into_iter().map(Some).collect();
    let (mut at, mut found): (Option<[f64; 2]>, Vec<LevelStretch>) = (from, Vec::new());
    while !ready.is_empty() {
        let far = |k: &usize| strands[*k].as_ref().map_or(f64::INFINITY, |strand| start(strand, at).1);
        let nearest =
            (0..ready.len()).min_by(|a, b| far(&ready[*a]).total_cmp(&far(&ready[*b])).then(ready[*a].cmp(&ready[*b])));
        let k = ready.remove(nearest.unwrap_or(0));
        for child in &children[k] {
            missing[*child] -= 1;
            if missing[*child] == 0 {
                ready.push(*child);
            }
        }
        let Some(mut strand) = strands[k].take().filter(|strand| !strand.spots.is_empty()) else { continue };
        if strand.closed {
            let first = start(&strand, at).0;
            strand.spots.rotate_left(first);
            strand.spots.push(strand.spots[0]);
        }
        at = strand.spots.last().map(|spot| spot.at);
        found.push(strand);
    }
    found
}

/// The spot at which a stretch starts, and its distance, mm.
fn start(strand: &LevelStretch, from: Option<[f64; 2]>) -> (usize, f64) {
    let Some(from) = from else { return (0, 0.0) };
    let far = |k: usize| {
        let at = strand.spots[k].at;
        (at[0] - from[0]).hypot(at[1] - from[1])
    };
    let count = if strand.closed { strand.spots.len() } else { strand.spots.len().min(1) };
    (0..count).map(|k| (k, far(k))).reduce(|a, b| if b.1 < a.1 { b } else { a }).unwrap_or((0, f64::INFINITY))
}

#[cfg(test)]
mod tests {
    use super::super::plan::StepLimit;
    use super::*;
    use crate::path::Vec3;

    fn strand(points: &[[f64; 2]], closed: bool, parents: &[usize], height_mm: f64) -> LevelStretch {
        let spot = |at: &[f64; 2]| Spot {
            at: *at,
            step_mm: 0.0,
            feed_mm_s: 1.0,
            force_n: 0.0,
            scallop_mm: 0.0,
            beside: None,
            limit: StepLimit::Edge,
            tip: Vec3::new(at[0], at[1], height_mm),
        };
        LevelStretch {
            spots: points.iter().map(spot).collect(),
            closed,
            back: false,
            parents: parents.to_vec(),
            level_mm: Some(height_mm),
        }
    }

    /// Two peaks with two loops each, and one loop about both: a peak is finished before the next one, and each loop
    /// starts near the end of the one before.
    #[test]
    fn a_top_is_done_before_the_next_one_and_both_before_what_lies_below() {
        let round = |x: f64, by: f64| vec![[x + by, 0.0], [x, by], [x - by, 0.0], [x, -by]];
        let strands = vec![
            strand(&round(0.0, 1.0), true, &[], 9.0),
            strand(&round(20.0, 1.0), true, &[], 9.0),
            strand(&round(0.0, 2.0), true, &[0], 8.0),
            strand(&round(20.0, 2.0), true, &[1], 8.0),
            strand(&round(10.0, 15.0), true, &[2, 3], 7.0),
        ];
        let found = order(strands, None);
        let heights: Vec<f64> = found.iter().filter_map(|strand| strand.level_mm).collect();
        assert_eq!(heights, [9.0, 8.0, 9.0, 8.0, 7.0]);
        assert!(found.iter().all(|strand| strand.spots.len() == 5 && strand.spots[0] == strand.spots[4]));
        assert_eq!(found[1].spots[0].at, [2.0, 0.0]);
        assert_eq!(found[2].spots[0].at, [19.0, 0.0]);
    }

    /// An open stretch starts at its first spot, wherever the tool is.
    #[test]
    fn a_stretch_with_ends_keeps_its_direction() {
        let strands = vec![
            strand(&[[0.0, 0.0], [5.0, 0.0]], false, &[], 9.0),
            strand(&[[0.0, 1.0], [5.0, 1.0]], false, &[0], 8.0),
        ];
        let found = order(strands, None);
        assert_eq!(found[1].spots[0].at, [0.0, 1.0]);
    }
}
