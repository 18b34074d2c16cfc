//! The arcs of a certificate. In: the engaged arcs of a station, each found at the middle of its ring. Out: arcs that hold what is engaged anywhere
//! on the height of each ring.
//!
//! Along a curved or sloped outline engagement changes with the height. Of two rings that touch, each reaches from its middle towards that of
//! the other by its share of the way, and an end of an arc that moves straight from one middle to the other is covered by both as far as their
//! border. Where two arcs of one ring meet one of the other, the gap between them closes somewhere between the rings, and they are one. An arc that
//! only one of two rings has begins between them, and both get it. On a cylindrical side engagement changes at levels, and rings are split there.

use crate::certify::place::Arc;
use crate::engage::EngagedArc;
use crate::machine::Slice;

/// Rings that are no further apart touch, as a share of the shorter: parts of rings are kept in steps of 1/256 of the whole.
const TOUCHES: f64 = 0.1;
/// Axial part of the normal of a cylindrical side, at most.
const UPRIGHT: f64 = 1e-9;

/// Arcs that hold what lies between each ring and those that touch it, sorted as before.
pub(super) fn covering(arcs: &[EngagedArc], slices: &[Slice]) -> Vec<Arc> {
    let rings: Vec<&[EngagedArc]> = arcs.chunk_by(|a, b| a.slice == b.slice).collect();
    let mut covering = Vec::with_capacity(arcs.len());
    for (k, ring) in rings.iter().enumerate() {
        let own = &slices[ring[0].slice as usize];
        let mut spans: Vec<[f64; 2]> = ring.iter().map(ends).collect();
        for beside in [k.checked_sub(1), Some(k + 1)].into_iter().flatten().filter_map(|k| rings.get(k)) {
            let other = &slices[beside[0].slice as usize];
            if touch(own, other) {
                reach(&mut spans, ring, beside, own.edge_mm / (own.edge_mm + other.edge_mm));
            }
        }
        let ring = ring[0].slice as usize;
        covering.extend(joined(spans).into_iter().map(|[entry, exit]| Arc { ring, entry, exit }));
    }
    covering
}

fn ends(arc: &EngagedArc) -> [f64; 2] {
    [arc.entry_rad, arc.exit_rad].map(f64::from)
}

/// Do two rings follow each other on an outline that is no cylindrical side?
fn touch(a: &Slice, b: &Slice) -> bool {
    let apart_mm = (a.z_mm - b.z_mm).hypot(a.radius_mm - b.radius_mm) - 0.5 * (a.edge_mm + b.edge_mm);
    a.segment == b.segment && a.normal_z.abs() > UPRIGHT && apart_mm < TOUCHES * a.edge_mm.min(b.edge_mm)
}

/// Extends the arcs of a ring (`spans`, from `own`) by this share of the way to those of a ring beside it. An arc beside that meets several of them
/// joins these, one that meets none is added.
fn reach(spans: &mut Vec<[f64; 2]>, own: &[EngagedArc], beside: &[EngagedArc], share: f64) {
    for [entry, exit] in beside.iter().map(ends) {
        let meets = |[from, to]: &[f64; 2]| entry <= *to && *from <= exit;
        let mut met = Vec::new();
        for (span, [from, to]) in spans.iter_mut().zip(own.iter().map(ends)).filter(|(_, own)| meets(own)) {
            *span = [span[0].min(from + share * (entry - from)), span[1].max(to + share * (exit - to))];
            met.push(*span);
        }
        let joined = met.into_iter().reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        spans.push(joined.unwrap_or([entry, exit]));
    }
}

/// The spans in order, with those joined that meet.
fn joined(mut spans: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    spans.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    spans.dedup_by(|next, kept| {
        let meets = next[0] <= kept[1];
        if meets {
            kept[1] = kept[1].max(next[1]);
        }
        meets
    });
    spans
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Profile;

    fn arc(slice: u32, entry_rad: f32, exit_rad: f32) -> EngagedArc {
        EngagedArc { slice, entry_rad, exit_rad }
    }

    fn spans(arcs: &[EngagedArc], slices: &[Slice]) -> Vec<(usize, [f64; 2])> {
        let to_thousandth = |x: f64| (x * 1e3).round() / 1e3;
        let of = |arc: &Arc| (arc.ring, [arc.entry, arc.exit].map(to_thousandth));
        covering(arcs, slices).iter().map(of).collect()
    }

    /// On rings of equal height each arc reaches half of the way to those beside it, outward only.
    #[test]
    fn arcs_reach_to_the_borders_of_their_rings() {
        let slices = Profile::ball(6.0, 3.0).rings(1);
        let found = spans(&[arc(3, 1.0, 2.0), arc(4, 0.8, 1.8), arc(5, 0.9, 1.2)], &slices);
        assert_eq!(found, [(3, [0.9, 2.0]), (4, [0.8, 1.9]), (5, [0.85, 1.5])]);
        assert_eq!(spans(&[arc(3, 1.0, 2.0), arc(5, 0.8, 1.8)], &slices), [(3, [1.0, 2.0]), (5, [0.8, 1.8])]);
    }

    /// A gap that only one of two rings has is closed on it; an arc that only one has is on both.
    #[test]
    fn a_gap_closes_and_an_arc_begins_between_two_rings() {
        let slices = Profile::ball(6.0, 3.0).rings(1);
        let found = spans(&[arc(3, 0.2, 3.0), arc(4, 0.2, 1.4), arc(4, 2.6, 3.0)], &slices);
        assert_eq!(found, [(3, [0.2, 3.0]), (4, [0.2, 3.0])]);
        let found = spans(&[arc(3, 0.2, 1.0), arc(4, 0.2, 1.0), arc(4, 2.0, 2.1)], &slices);
        assert_eq!(found, [(3, [0.2, 1.0]), (3, [2.0, 2.1]), (4, [0.2, 1.0]), (4, [2.0, 2.1])]);
    }

    /// The rings of a cylindrical side keep their arcs: they differ at a level, where the rings end.
    #[test]
    fn a_level_on_a_side_is_kept() {
        let slices = Profile::flat(10.0, 20.0).rings(1);
        let first = slices.iter().position(|slice| slice.normal_r == 1.0).unwrap() as u32;
        let arcs = [arc(first, 0.0, 1.0), arc(first + 1, 0.0, 3.0)];
        let found: Vec<[f64; 2]> = spans(&arcs, &slices).into_iter().map(|(_, span)| span).collect();
        assert_eq!(found, [[0.0, 1.0], [0.0, 3.0]]);
    }
}
