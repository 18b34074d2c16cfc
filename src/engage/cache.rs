//! The engagement map as bytes, so that changing a limit, a coefficient or an output setting does not simulate again. In:
//! a map and the key of what it was made from. Out: bytes, and back.
//!
//! Layout, little endian: mark, key (32 bytes), sections (each a count and its records), SHA-256 of all before it. The key
//! ([`super::key`]) covers everything the map depends on, the source of this file included. A stale cache is recognised by the key, a
//! damaged one by the SHA-256.

pub use super::key::{Key, key};
use super::map::{EngagedArc, EngagementMap, Event, EventKind, Station, StationFlags};
use crate::bytes::{Reader, count, numbers, seal, unsealed};
use crate::ids::MoveId;
use crate::machine::Slice;

/// First bytes of a cache of any build; in older builds a number followed.
pub const FAMILY: &[u8] = b"FWENGM";
/// First bytes of a cache. They identify the format; whether a cache fits is decided by the key.
const MARK: &[u8; 8] = b"FWENGMAP";

/// Why a cache cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unusable {
    /// Not a cache of this version, cut short, or changed since.
    Damaged,
    /// Made from another program, setup or resolution.
    Stale,
}

/// The map as bytes.
pub fn to_bytes(map: &EngagementMap, key: &Key) -> Vec<u8> {
    let mut out = Vec::with_capacity(64 + map.stations.len() * 42 + map.arcs.len() * 12);
    out.extend_from_slice(MARK);
    out.extend_from_slice(key);
    numbers(&mut out, &[map.initial_mm3, map.removed_mm3, map.remaining_mm3, map.cell_mm]);
    count(&mut out, map.slices.len());
    for (tool, slices) in &map.slices {
        out.extend_from_slice(&tool.to_le_bytes());
        count(&mut out, slices.len());
        for s in slices {
            numbers(&mut out, &[s.z_mm, s.radius_mm, s.edge_mm, s.normal_r, s.normal_z]);
            out.push(s.segment);
        }
    }
    count(&mut out, map.of_move.len());
    for range in &map.of_move {
        out.extend_from_slice(&(range.end - range.start).to_le_bytes());
    }
    count(&mut out, map.stations.len());
    for s in &map.stations {
        out.extend_from_slice(&s.move_id.0.to_le_bytes());
        out.extend_from_slice(&s.from_mm.to_le_bytes());
        out.extend_from_slice(&s.to_mm.to_le_bytes());
        out.extend_from_slice(&s.removal_area_mm2.to_le_bytes());
        out.extend_from_slice(&s.axial_depth_mm.to_le_bytes());
        for arcs in [s.arc_count, s.at_ends[0], s.at_ends[1]] {
            out.extend_from_slice(&arcs.to_le_bytes());
        }
        let flags = [s.flags.clear_air, s.flags.uncertain, s.flags.final_surface, s.flags.beside_blank];
        out.push(flags.iter().enumerate().map(|(bit, set)| u8::from(*set) << bit).sum());
    }
    count(&mut out, map.arcs.len());
    for arc in &map.arcs {
        out.extend_from_slice(&arc.slice.to_le_bytes());
        out.extend_from_slice(&arc.entry_rad.to_le_bytes());
        out.extend_from_slice(&arc.exit_rad.to_le_bytes());
    }
    count(&mut out, map.events.len());
    for event in &map.events {
        out.push(event.kind as u8);
        out.extend_from_slice(&event.move_id.0.to_le_bytes());
        count(&mut out, event.detail.len());
        out.extend_from_slice(event.detail.as_bytes());
    }
    count(&mut out, map.notes.len());
    for note in &map.notes {
        count(&mut out, note.len());
        out.extend_from_slice(note.as_bytes());
    }
    seal(&mut out);
    out
}

/// The map back from bytes, if they are whole and were made for `key`.
pub fn from_bytes(bytes: &[u8], key: &Key) -> Result<EngagementMap, Unusable> {
    let mut reader = unsealed(bytes, MARK).ok_or(Unusable::Damaged)?;
    if reader.take(32).ok_or(Unusable::Damaged)? != key {
        return Err(Unusable::Stale);
    }
    map(&mut reader).ok_or(Unusable::Damaged)
}

fn map(reader: &mut Reader) -> Option<EngagementMap> {
    let mut map = EngagementMap {
        initial_mm3: reader.f64()?,
        removed_mm3: reader.f64()?,
        remaining_mm3: reader.f64()?,
        cell_mm: reader.f64()?,
        ..EngagementMap::default()
    };
    map.slices = reader.list(|r| Some((r.u32()?, r.list(slice)?)))?;
    let mut first = 0u32;
    map.of_move = reader.list(|r| {
        let begin = first;
        first = first.checked_add(r.u32()?)?;
        Some(begin..first)
    })?;
    let mut arcs = 0u32;
    map.stations = reader.list(|r| {
        let mut station = station(r)?;
        station.first_arc = arcs.checked_add(station.at_ends[0])?;
        arcs = station.first_arc.checked_add(station.arc_count)?.checked_add(station.at_ends[1])?;
        Some(station)
    })?;
    map.arcs = reader.list(|r| Some(EngagedArc { slice: r.u32()?, entry_rad: r.f32()?, exit_rad: r.f32()? }))?;
    map.events = reader.list(event)?;
    map.notes = reader.list(text)?;
    (first as usize == map.stations.len() && arcs as usize == map.arcs.len()).then_some(map)
}

fn slice(reader: &mut Reader) -> Option<Slice> {
    Some(Slice {
        z_mm: reader.f64()?,
        radius_mm: reader.f64()?,
        edge_mm: reader.f64()?,
        normal_r: reader.f64()?,
        normal_z: reader.f64()?,
        segment: reader.u8()?,
    })
}

fn station(reader: &mut Reader) -> Option<Station> {
    Some(Station {
        move_id: MoveId(reader.u32()?),
        from_mm: reader.f64()?,
        to_mm: reader.f64()?,
        removal_area_mm2: reader.f32()?,
        axial_depth_mm: reader.f32()?,
        first_arc: 0,
        arc_count: reader.u32()?,
        at_ends: [reader.u32()?, reader.u32()?],
        flags: {
            let bits = reader.u8()?;
            let bit = |k: u8| bits >> k & 1 == 1;
            StationFlags { clear_air: bit(0), uncertain: bit(1), final_surface: bit(2), beside_blank: bit(3) }
        },
    })
}

fn text(reader: &mut Reader) -> Option<String> {
    String::from_utf8(reader.list(Reader::u8)?).ok()
}

fn event(reader: &mut Reader) -> Option<Event> {
    const KINDS: [EventKind; 7] = [
        EventKind::CutAtRapid,
        EventKind::ShankContact,
        EventKind::HolderContact,
        EventKind::FixtureContact,
        EventKind::PlungeNotCentreCutting,
        EventKind::Undercut,
        EventKind::SpindleStopped,
    ];
    let kind = *KINDS.get(usize::from(reader.u8()?))?;
    let move_id = MoveId(reader.u32()?);
    let detail = text(reader)?;
    Some(Event { kind, move_id, detail })
}
