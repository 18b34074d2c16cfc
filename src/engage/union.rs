//! The engagement of a stretch of path. In: the arcs at several places of it, each list sorted by slice. Out: the union of these arcs, sorted
//! by slice.
//!
//! Load does not grow with removal area alone: a narrow arc at 110° causes more force in the plane than a wider one at 130°. So no single
//! place represents a stretch, and the stretch has every arc that is in material at any of its places.

use super::scene::RawArc;

/// Parts of one ring that differ by less than this share of the ring are replaced by the larger. So at most this share of the height of a
/// ring counts as engaged although it is not, and a slope does not split rings at every place.
const ALIKE: f32 = 0.25;

/// Adds the arcs of another place.
pub fn unite(met: &mut Vec<RawArc>, more: &[RawArc]) {
    if met.is_empty() {
        met.extend_from_slice(more);
        return;
    }
    if more.is_empty() || met == more {
        return;
    }
    let mut united = Vec::with_capacity(met.len().max(more.len()));
    let (mut ours, mut theirs) = (met.as_slice(), more);
    while let Some(slice) = ours.first().into_iter().chain(theirs.first()).map(|arc| arc.slice).min() {
        let [a, b] = [first_of(&mut ours, slice), first_of(&mut theirs, slice)];
        match (a, b) {
            ([], only) | (only, []) => united.extend_from_slice(only),
            ([one], [other]) if overlap(one, other) && parts_are_alike([one, other]) => {
                let hull = |of: fn(&RawArc) -> [f32; 2]| [of(one)[0].min(of(other)[0]), of(one)[1].max(of(other)[1])];
                united.push(RawArc { slice, part: hull(|arc| arc.part), angles: hull(|arc| arc.angles) });
            }
            (a, b) => of_ring(slice, &[a, b].concat(), &mut united),
        }
    }
    *met = united;
}

/// What of the arcs of a stretch is engaged at one place of it, on the same parts of rings, each as its middle is; none where that is all.
pub fn of_place(arcs: &[RawArc], place: &[RawArc]) -> Vec<RawArc> {
    let mut engaged = Vec::new();
    let mut left = place;
    for ring in arcs.chunk_by(|a, b| a.slice == b.slice) {
        left = &left[left.partition_point(|arc| arc.slice < ring[0].slice)..];
        let here = first_of(&mut left, ring[0].slice);
        for arc in ring {
            let middle = 0.5 * (arc.part[0] + arc.part[1]);
            let within = here.iter().filter(|other| other.part[0] < middle && middle < other.part[1]);
            let shared = within.map(|other| [arc.angles[0].max(other.angles[0]), arc.angles[1].min(other.angles[1])]);
            engaged.extend(shared.filter(|[from, to]| from < to).map(|angles| RawArc { angles, ..*arc }));
        }
    }
    if engaged == arcs { Vec::new() } else { engaged }
}

/// Splits off the arcs of a slice, which are the first if there are any.
fn first_of<'a>(arcs: &mut &'a [RawArc], slice: u16) -> &'a [RawArc] {
    let (first, rest) = arcs.split_at(arcs.partition_point(|arc| arc.slice <= slice));
    *arcs = rest;
    first
}

fn overlap(a: &RawArc, b: &RawArc) -> bool {
    a.angles[0] <= b.angles[1] && b.angles[0] <= a.angles[1]
}

fn parts_are_alike<'a>(arcs: impl IntoIterator<Item = &'a RawArc> + Clone) -> bool {
    let [low, high] = hull_of_parts(arcs.clone());
    arcs.into_iter().all(|arc| arc.part[0] - low < ALIKE && high - arc.part[1] < ALIKE)
}

fn hull_of_parts<'a>(arcs: impl IntoIterator<Item = &'a RawArc>) -> [f32; 2] {
    arcs.into_iter().fold([1.0, 0.0], |[low, high], arc| [low.min(arc.part[0]), high.max(arc.part[1])])
}

/// Union of arcs of one ring: over the hull of their parts where these are alike, else part by part.
fn of_ring(slice: u16, arcs: &[RawArc], united: &mut Vec<RawArc>) {
    let mut borders: Vec<f32> = if parts_are_alike(arcs) {
        hull_of_parts(arcs).to_vec()
    } else {
        arcs.iter().flat_map(|arc| arc.part).collect()
    };
    borders.sort_unstable_by(f32::total_cmp);
    borders.dedup();
    let mut last: Option<([f32; 2], Vec<[f32; 2]>)> = None;
    for part in borders.windows(2).map(|ends| [ends[0], ends[1]]) {
        let middle = 0.5 * (part[0] + part[1]);
        let within = arcs.iter().filter(|arc| borders.len() == 2 || (arc.part[0] < middle && middle < arc.part[1]));
        let angles = joined(within.map(|arc| arc.angles).collect());
        match &mut last {
            Some((held, same)) if *same == angles && held[1] == part[0] => held[1] = part[1],
            _ => {
                hand_on(slice, last.replace((part, angles)), united);
            }
        }
    }
    hand_on(slice, last, united);
}

fn hand_on(slice: u16, of: Option<([f32; 2], Vec<[f32; 2]>)>, united: &mut Vec<RawArc>) {
    let arcs = of.into_iter().flat_map(|(part, angles)| angles.into_iter().map(move |angles| (part, angles)));
    united.extend(arcs.map(|(part, angles)| RawArc { slice, part, angles }));
}

/// The intervals, with those joined that touch or overlap.
fn joined(mut intervals: Vec<[f32; 2]>) -> Vec<[f32; 2]> {
    intervals.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    intervals.dedup_by(|next, kept| {
        let meets = next[0] <= kept[1];
        if meets {
            kept[1] = kept[1].max(next[1]);
        }
        meets
    });
    intervals
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(slice: u16, part: [f32; 2], angles: [f32; 2]) -> RawArc {
        RawArc { slice, part, angles }
    }

    /// Is a point of a ring in one of the arcs?
    fn holds(arcs: &[RawArc], slice: u16, part: f32, angle: f32) -> bool {
        let within = |[from, to]: [f32; 2], at: f32| from <= at && at <= to;
        arcs.iter().any(|arc| arc.slice == slice && within(arc.part, part) && within(arc.angles, angle))
    }

    /// Every point of both lists is in the union, and none that is further than [`ALIKE`] of a ring above or below one of them.
    #[test]
    fn the_union_holds_both_and_little_else() {
        let lists = [
            vec![arc(0, [0.0, 1.0], [0.2, 0.4]), arc(1, [0.0, 0.5], [0.2, 0.4]), arc(1, [0.5, 1.0], [0.3, 0.4])],
            vec![arc(1, [0.0, 0.1], [0.0, 3.0]), arc(2, [0.3, 1.0], [1.0, 1.5])],
            vec![arc(0, [0.0, 0.9], [0.3, 0.8]), arc(0, [0.0, 0.9], [1.2, 1.4]), arc(2, [0.2, 0.8], [2.0, 2.5])],
            vec![arc(0, [0.0, 1.0], [0.1, 1.3])],
        ];
        for a in &lists {
            for b in &lists {
                let mut met = a.clone();
                unite(&mut met, b);
                assert!(met.windows(2).all(|two| two[0].slice <= two[1].slice), "{met:?}");
                for (slice, k, l) in (0..3).flat_map(|s| (0..100).flat_map(move |k| (0..160).map(move |l| (s, k, l)))) {
                    let (part, angle) = (0.005 + k as f32 / 100.0, 0.011 + l as f32 / 50.0);
                    let any = |part: f32| holds(a, slice, part, angle) || holds(b, slice, part, angle);
                    let united = holds(&met, slice, part, angle);
                    assert!(!any(part) || united, "{a:?} {b:?}: {met:?} lacks {slice} {part} {angle}");
                    let near = || (0..=50).any(|k| any(part - ALIKE + ALIKE * k as f32 / 25.0));
                    assert!(!united || near(), "{a:?} {b:?}: {met:?} has {slice} {part} {angle}");
                }
            }
        }
    }

    /// On the parts of rings that the stretch has, whatever the place's own; nothing where all is engaged.
    #[test]
    fn a_place_has_what_it_shares_with_its_stretch() {
        let place = [arc(0, [0.0, 0.5], [0.1, 1.0]), arc(1, [0.0, 1.0], [0.0, 3.0]), arc(3, [0.0, 0.4], [1.0, 2.0])];
        let mut met = place.to_vec();
        unite(
            &mut met,
            &[arc(0, [0.0, 0.6], [0.4, 2.0]), arc(2, [0.0, 1.0], [0.0, 1.0]), arc(3, [0.0, 1.0], [1.5, 2.5])],
        );
        let wanted = [arc(0, [0.0, 0.6], [0.1, 1.0]), arc(1, [0.0, 1.0], [0.0, 3.0]), arc(3, [0.0, 0.4], [1.0, 2.0])];
        assert_eq!(of_place(&met, &place), wanted, "{met:?}");
        assert!(of_place(&met, &met).is_empty() && of_place(&met, &[]).is_empty());
    }

    /// Two parts of a ring are one as long as they differ by less than a quarter of it.
    #[test]
    fn rings_are_cut_only_where_parts_differ() {
        let united = |top: f32| {
            let mut met = vec![arc(0, [0.0, 0.5], [0.0, 1.0])];
            unite(&mut met, &[arc(0, [0.0, top], [0.5, 2.0])]);
            met
        };
        assert_eq!(united(0.74), [arc(0, [0.0, 0.74], [0.0, 2.0])]);
        assert_eq!(united(0.76), [arc(0, [0.0, 0.5], [0.0, 2.0]), arc(0, [0.5, 0.76], [0.5, 2.0])]);
    }
}
