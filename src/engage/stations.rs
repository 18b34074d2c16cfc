//! From samples to stations. In: the outcomes at the sampled points of each move, in order. Out: the stations of the
//! [`EngagementMap`], their arcs, and the partial rings those arcs need.
//!
//! A piece between two samples has the union of the arcs at both ([`super::union`]) and the mean of their areas, or the stretches that were
//! examined between them; a part of it on which nothing is cut is a piece of its own. Neighbouring pieces with equal arcs become one station if
//! each is engaged alike at both its ends, so that entry and exit remain stations of their own. A ring that a level splits is added to the
//! slices of the tool as a ring of its own, its bounds rounded to 1/256 of the whole.
//!
//! Where a path begins or ends, or a cut on it, the arcs at that very place are entered beside those of the station, on the same rings.

use super::between_samples::{Between, Stretch};
use super::cutter::Cutter;
use super::map::{EngagedArc, EngagementMap, Station, StationFlags};
use super::sample_outcome::{Outcome, PARTS, same};
use super::scene::RawArc;
use super::union::of_place;
use crate::ids::MoveId;
use crate::machine::Slice;
use std::borrow::Cow;
use std::collections::HashMap;

/// Builds the map station by station.
#[derive(Debug, Default)]
pub struct Builder {
    /// The map so far.
    pub map: EngagementMap,
    /// Partial rings entered: (cutter, slice, from, to) → slice.
    partial: HashMap<[u16; 4], u32>,
    /// Partial rings that the map had before: (cutter, place on the outline) → slice.
    earlier: HashMap<(u16, [u64; 3]), u32>,
}

/// A sampled point of a move.
pub struct Point<'a> {
    /// Distance along the move, mm.
    pub s_mm: f64,
    /// The outcome there.
    pub outcome: &'a Outcome,
    /// The stretches between the point before and this one, if they were examined.
    pub before: Option<&'a Between>,
}

/// A piece of a move before it becomes a station.
struct Piece<'a> {
    /// Its engagement; `None` where nothing is cut.
    met: Option<Cow<'a, Outcome>>,
    /// The arcs at its beginning and at its end.
    at_ends: [&'a [RawArc]; 2],
    to_mm: f64,
    volume_mm3: f64,
    clear: bool,
    /// Engaged alike at both ends.
    steady: bool,
}

impl Builder {
    /// A map without stations that has these slices of each cutter: its own, and the partial rings of an earlier map after them.
    pub fn with_slices(slices: Vec<(u32, Vec<Slice>)>, cutters: &[Cutter]) -> Self {
        let partial = |(index, cutter): (usize, &Cutter)| {
            let parts = slices[index].1.iter().enumerate().skip(cutter.slices.len());
            parts.map(move |(k, part)| ((index as u16, place(part)), k as u32)).collect::<Vec<_>>()
        };
        let earlier = cutters.iter().enumerate().flat_map(partial).collect();
        Self { map: EngagementMap { slices, ..EngagementMap::default() }, earlier, ..Self::default() }
    }

    /// Enters the stations of a move sampled at `points` (at least two, the first at its beginning, the last at its end). `path_ends`: does the
    /// path begin with it, and does it end with it?
    pub fn push_move(
        &mut self,
        id: MoveId,
        (cutter_index, cutter): (u16, &Cutter),
        points: &[Point],
        path_ends: [bool; 2],
        uncertain: bool,
    ) {
        let first = self.map.stations.len() as u32;
        let mut current: Option<(Piece, Station)> = None;
        let mut left = points.windows(2).flat_map(|pair| pieces(&pair[0], &pair[1])).peekable();
        while let Some(mut piece) = left.next() {
            let begins = current.as_ref().map_or(path_ends[0], |(before, _)| before.met.is_none());
            let ends = left.peek().map_or(path_ends[1], |after| after.met.is_none());
            piece.at_ends = std::array::from_fn(|end| if [begins, ends][end] { piece.at_ends[end] } else { &[] });
            match &mut current {
                Some((held, station)) if joins(held, &piece) => {
                    station.to_mm = piece.to_mm;
                    held.volume_mm3 += piece.volume_mm3;
                    if area(&piece) > area(held) {
                        held.met = piece.met;
                    }
                }
                _ => {
                    let from_mm = current.as_ref().map_or(points[0].s_mm, |(_, station)| station.to_mm);
                    if let Some(done) = current.take() {
                        self.close(cutter_index, cutter, done);
                    }
                    let flags = StationFlags { clear_air: piece.clear, uncertain, ..StationFlags::default() };
                    let station = empty_station(id, [from_mm, piece.to_mm], flags);
                    current = Some((piece, station));
                }
            }
        }
        if let Some(done) = current {
            self.close(cutter_index, cutter, done);
        }
        self.end_move(id, first);
    }

    /// Enters one station without engagement for a whole move.
    pub fn push_idle(&mut self, id: MoveId, length_mm: f64, flags: StationFlags) {
        let first = self.map.stations.len() as u32;
        let mut station = empty_station(id, [0.0, length_mm], flags);
        station.first_arc = self.map.arcs.len() as u32;
        self.map.stations.push(station);
        self.end_move(id, first);
    }

    /// Enters the stations of a move of another map with the same slices; `None`: no stations.
    pub fn push_known(&mut self, id: MoveId, known: &EngagementMap, of: Option<MoveId>) {
        let first = self.map.stations.len() as u32;
        for station in of.map_or(&[][..], |of| known.stations_of(of)) {
            let [begin, end] = known.arcs_at_ends(station);
            self.map.arcs.extend_from_slice(begin);
            let first_arc = self.map.arcs.len() as u32;
            self.map.arcs.extend_from_slice(known.arcs_of(station));
            self.map.arcs.extend_from_slice(end);
            self.map.stations.push(Station { move_id: id, first_arc, ..*station });
        }
        self.end_move(id, first);
    }

    /// Enters a move without stations.
    pub fn push_none(&mut self, id: MoveId) {
        let first = self.map.stations.len() as u32;
        self.end_move(id, first);
    }

    fn end_move(&mut self, id: MoveId, first: u32) {
        debug_assert_eq!(self.map.of_move.len(), id.ix());
        self.map.of_move.push(first..self.map.stations.len() as u32);
    }

    fn close(&mut self, index: u16, cutter: &Cutter, (piece, mut station): (Piece, Station)) {
        station.first_arc = self.map.arcs.len() as u32;
        if let Some(outcome) = piece.met {
            let at_ends = piece.at_ends.map(|place| of_place(&outcome.arcs, place));
            station.at_ends[0] = self.enter(index, cutter, &at_ends[0]);
            station.first_arc += station.at_ends[0];
            station.arc_count = self.enter(index, cutter, &outcome.arcs);
            station.at_ends[1] = self.enter(index, cutter, &at_ends[1]);
            station.axial_depth_mm = outcome.cut.top_mm as f32;
            let length = station.length_mm();
            station.removal_area_mm2 = if length > 0.0 { (piece.volume_mm3 / length) as f32 } else { 0.0 };
        }
        self.map.stations.push(station);
    }

    /// Enters arcs; returns their number.
    fn enter(&mut self, index: u16, cutter: &Cutter, arcs: &[RawArc]) -> u32 {
        for arc in arcs {
            let slice = self.slice(index, cutter, arc);
            let [entry_rad, exit_rad] = arc.angles;
            self.map.arcs.push(EngagedArc { slice, entry_rad, exit_rad });
        }
        arcs.len() as u32
    }

    /// Slice of an arc: the whole ring, or a partial one entered for it.
    fn slice(&mut self, index: u16, cutter: &Cutter, arc: &RawArc) -> u32 {
        let [from, to] = arc.part.map(|part| (part * PARTS).round() as u16);
        if (from, to) == (0, PARTS as u16) {
            return u32::from(arc.slice);
        }
        let slices = &mut self.map.slices[index as usize].1;
        let to = to.max(from + 1);
        *self.partial.entry([index, arc.slice, from, to]).or_insert_with(|| {
            let part = cutter.part(arc.slice, [from, to].map(|part| f64::from(part) / f64::from(PARTS)));
            self.earlier.get(&(index, place(&part))).copied().unwrap_or_else(|| {
                slices.push(part);
                (slices.len() - 1) as u32
            })
        })
    }
}

/// Height, radius and length of a ring, bit by bit: equal for the same part of the same slice.
fn place(ring: &Slice) -> [u64; 3] {
    [ring.z_mm, ring.radius_mm, ring.edge_mm].map(f64::to_bits)
}

/// The pieces between two points.
fn pieces<'a>(a: &Point<'a>, b: &Point<'a>) -> impl Iterator<Item = Piece<'a>> + use<'a> {
    let clear = a.outcome.clear && b.outcome.clear;
    let whole = b.before.is_none().then(|| {
        let volume_mm3 = 0.5 * (a.outcome.cut.area_mm2 + b.outcome.cut.area_mm2) * (b.s_mm - a.s_mm);
        let steady = same(&a.outcome.arcs, &b.outcome.arcs);
        let more = if a.outcome.cut.area_mm2 > b.outcome.cut.area_mm2 { a.outcome } else { b.outcome };
        let met = if steady {
            (!more.arcs.is_empty()).then_some(Cow::Borrowed(more))
        } else {
            Outcome::of_places([a.outcome, b.outcome]).map(Cow::Owned)
        };
        // Where both ends are alike, all arcs are engaged at either.
        let at_ends = if steady { [&[][..]; 2] } else { [a, b].map(|end| end.outcome.arcs.as_slice()) };
        Piece { to_mm: b.s_mm, volume_mm3, clear: clear && met.is_none(), steady, met, at_ends }
    });
    let stretch = move |stretch: &'a Stretch| Piece {
        met: stretch.met.as_ref().map(Cow::Borrowed),
        to_mm: stretch.to_mm,
        volume_mm3: stretch.volume_mm3,
        clear: clear && stretch.met.is_none(),
        steady: stretch.met.is_none(),
        at_ends: [0, 1].map(|end| stretch.at_ends[end].as_slice()),
    };
    whole.into_iter().chain(b.before.into_iter().flatten().map(stretch))
}

fn joins(held: &Piece, next: &Piece) -> bool {
    held.clear == next.clear
        && held.steady
        && next.steady
        && match (&held.met, &next.met) {
            (Some(held), Some(next)) => same(&held.arcs, &next.arcs),
            (None, None) => true,
            _ => false,
        }
}

fn area(piece: &Piece) -> f64 {
    piece.met.as_ref().map_or(0.0, |outcome| outcome.cut.area_mm2)
}

fn empty_station(move_id: MoveId, [from_mm, to_mm]: [f64; 2], flags: StationFlags) -> Station {
    Station {
        move_id,
        from_mm,
        to_mm,
        removal_area_mm2: 0.0,
        axial_depth_mm: 0.0,
        first_arc: 0,
        arc_count: 0,
        at_ends: [0; 2],
        flags,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Limits, Profile, Shape, Tool};

    fn ball() -> Tool {
        Tool {
            number: 1,
            shape: Shape::Ball,
            profile: Profile::ball(6.0, 20.0),
            diameter_mm: 6.0,
            flutes: 2,
            helix_rad: 0.5,
            pitch_rad: Vec::new(),
            rake_rad: 0.0,
            flute_length_mm: 12.0,
            flute_length_given: true,
            overhang_mm: 30.0,
            shank_diameter_mm: 6.0,
            runout: None,
            youngs_modulus_mpa: 600_000.0,
            allowable_stress_mpa: None,
            holder_stiffness_n_mm: None,
            holder: Vec::new(),
            centre_cutting: true,
            coefficients: None,
            limits: Limits::default(),
            wear: None,
        }
    }

    /// Thin stock on a surface ends anywhere on a ring, so a long finishing program enters more partial rings than two bytes can
    /// number. Each keeps its place, and a map that goes on from this one enters none of them again.
    #[test]
    fn each_of_many_partial_rings_is_itself() {
        let cutter = Cutter::new(&ball(), 0.2, 1);
        let whole = vec![(1, cutter.slices.clone())];
        let step = |k: u16| f32::from(k) / PARTS;
        let parts =
            (0..3).flat_map(|slice| (0..255).flat_map(move |from| (from + 1..256).map(move |to| (slice, from, to))));
        let arcs: Vec<RawArc> =
            parts.map(|(slice, from, to)| RawArc { slice, part: [step(from), step(to)], angles: [0.0, 1.0] }).collect();
        assert!(arcs.len() > usize::from(u16::MAX));
        let own = |arc: &RawArc| cutter.part(arc.slice, arc.part.map(f64::from));
        let mut first = Builder::with_slices(whole, std::slice::from_ref(&cutter));
        let entered: Vec<u32> = arcs.iter().map(|arc| first.slice(0, &cutter, arc)).collect();
        let slices = first.map.slices;
        assert!(arcs.iter().zip(&entered).all(|(arc, k)| slices[0].1[*k as usize] == own(arc)));
        let mut second = Builder::with_slices(slices.clone(), std::slice::from_ref(&cutter));
        let again: Vec<u32> = arcs.iter().map(|arc| second.slice(0, &cutter, arc)).collect();
        assert!(again == entered && second.map.slices == slices);
    }
}
