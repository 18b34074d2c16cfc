//! What a station cuts, in a few numbers. In: a station with its arcs, the rings of its tool. Out: [`Engaged`]: removed section
//! a_p·a_e, swept area, its share in the up half, its middle. Diagnosis reads its covariates from it, and the schedule what
//! effects need to know of a cut. The arcs of a station are the union of all places along it; they are scaled to
//! its mean section.

use crate::effects::{AlongEdge, EdgePiece, SECTORS, Sector};
use crate::engage::{EngagedArc, EngagementMap, Station};
use crate::machine::Slice;
use crate::path::Vec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Width of a sector of the engaged arc.
const SECTOR_RAD: f64 = PI / SECTORS as f64;

/// Engagement of a station as effects and diagnosis look at it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Engaged {
    /// Volume removed per mm of path, mm².
    pub section_mm2: f64,
    /// Area swept by all edges over material in a revolution, mm².
    pub contact_mm2: f64,
    /// Way of one tooth in material in a revolution, mm.
    pub way_mm: f64,
    /// Angle over which a tooth is in material, mean over the depth, rad.
    pub immersion_rad: f64,
    /// −1 climb … +1 up, by contact.
    pub up_share: f64,
    /// The same by chip thickness.
    pub up_share_chip: f64,
    /// Mean of cos φ over the arc, by chip thickness and by contact.
    pub mean_cosine: [f64; 2],
    /// Middle of the contact from the axis: along the feed and to the left of it, mm.
    pub contact_mm: [f64; 2],
    /// Engaged arc by sectors of φ: section (mm²), contact of one tooth (mm²), middle from the axis as above (mm).
    pub sectors: [[f64; 4]; SECTORS],
    /// Height engaged, mm.
    pub axial_mm: f64,
    /// How it is spread along the cutting edge.
    pub along_edge: AlongEdge,
    /// Derivative of the peak force in the plane at the predicted speed by k_tc, k_rc, k_te, k_re.
    pub peak: [f64; 4],
}

impl Engaged {
    /// The engaged arc as effects see it, at this feed per tooth, mm; `place`: the place this far along the feed from the axis and to the left
    /// of it, mm.
    pub fn sectors_at(&self, feed_per_tooth_mm: f64, place: impl Fn(f64, f64) -> Vec3) -> [Sector; SECTORS] {
        let whole = [0, 1].map(|k| self.sectors.iter().map(|s| s[k]).sum::<f64>().max(1e-12));
        self.sectors.map(|[section, contact, along, aside]| {
            let place = place(along, aside);
            Sector {
                share: [section / whole[0], contact / whole[1]],
                chip_thickness_mm: feed_per_tooth_mm * section / contact.max(1e-12),
                at: [place.x, place.y],
            }
        })
    }
}

/// Engagement of a station by its arcs. An end face has arcs only where it goes down, and rubs there however shallow the ramp is; under a
/// level feed it sweeps without a chip and is no part of the contact (Xu, Eq. 3.7).
pub fn engaged(station: &Station, map: &EngagementMap, slices: &[Slice], flutes: u32, tangent_z: f64) -> Engaged {
    let (mut contact, mut section, mut up, mut way, mut height) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut angle, mut last_slice) = (0.0, None);
    let (mut up_chip, mut middle, mut sectors) = (0.0, [0.0; 2], [[0.0; 4]; SECTORS]);
    let (mut chip, mut cosine) = (0.0, [0.0; 2]);
    for arc in map.arcs_of(station) {
        let slice = &slices[arc.slice as usize];
        let (entry, exit) = (f64::from(arc.entry_rad), f64::from(arc.exit_rad));
        let [cut, swept] = section_and_contact(arc, slice, tangent_z);
        let in_up = (exit.min(FRAC_PI_2) - entry.min(FRAC_PI_2)).max(0.0) / (exit - entry).max(1e-9);
        contact += swept;
        section += cut;
        up += swept * (2.0 * in_up - 1.0);
        let turn = |from: f64, to: f64| slice.radius_mm * slice.edge_mm * (from.cos() - to.cos());
        up_chip += turn(entry.min(FRAC_PI_2), exit.min(FRAC_PI_2)) - turn(entry.max(FRAC_PI_2), exit.max(FRAC_PI_2));
        chip += turn(entry, exit);
        cosine[0] += 0.5 * slice.radius_mm * slice.edge_mm * (exit.sin().powi(2) - entry.sin().powi(2));
        cosine[1] += slice.radius_mm * slice.edge_mm * (exit.sin() - entry.sin());
        middle[0] += slice.radius_mm * turn(entry, exit);
        middle[1] += slice.radius_mm * slice.radius_mm * slice.edge_mm * (exit.sin() - entry.sin());
        for (k, sector) in sectors.iter_mut().enumerate() {
            let [from, to] = [k, k + 1].map(|k| (k as f64 * SECTOR_RAD).clamp(entry, exit));
            let (chip, r) = (turn(from, to), slice.radius_mm);
            sector[0] += chip * slice.normal_r.max(0.0);
            sector[1] += r * (to - from) * slice.edge_mm;
            sector[2] += r * chip;
            sector[3] += r * r * slice.edge_mm * (to.sin() - from.sin());
        }
        way += slice.radius_mm * (exit - entry) * slice.dz_mm();
        angle += (exit - entry) * slice.dz_mm();
        // A slice may be engaged over several arcs: its height counts once.
        if last_slice.replace(arc.slice) != Some(arc.slice) {
            height += slice.dz_mm();
        }
    }
    for sector in sectors.iter_mut().filter(|s| s[1] > 0.0) {
        (sector[2], sector[3]) = (sector[2] / sector[1], sector[3] / sector[1]);
    }
    let mean = f64::from(station.removal_area_mm2);
    let share = if section > 1e-9 { (mean / section).clamp(0.0, 1.2) } else { 1.0 };
    Engaged {
        section_mm2: mean,
        contact_mm2: contact * f64::from(flutes) * share,
        way_mm: if height > 0.0 { way / height * share } else { 0.0 },
        immersion_rad: if height > 0.0 { angle / height * share } else { 0.0 },
        up_share: if contact > 0.0 { up / contact } else { 0.0 },
        up_share_chip: if section > 0.0 { up_chip / section } else { 0.0 },
        mean_cosine: [cosine[0] / chip.max(1e-12), cosine[1] / contact.max(1e-12)],
        contact_mm: middle.map(|m| m / contact.max(1e-12)),
        sectors,
        axial_mm: f64::from(station.axial_depth_mm),
        along_edge: AlongEdge::of(
            map.arcs_of(station).iter().map(|arc| edge_piece(arc, &slices[arc.slice as usize], tangent_z)),
        ),
        peak: [0.0; 4],
    }
}

/// Section removed per mm of path and area swept by one edge in a revolution, mm².
fn section_and_contact(arc: &EngagedArc, slice: &Slice, tangent_z: f64) -> [f64; 2] {
    let (entry, exit) = (f64::from(arc.entry_rad), f64::from(arc.exit_rad));
    let across = (1.0 - tangent_z * tangent_z).max(0.0).sqrt();
    let (swing, lift) = (across * slice.normal_r.max(0.0), tangent_z * slice.normal_z);
    let chip = swing * (entry.cos() - exit.cos()) + lift * (exit - entry);
    [(slice.radius_mm * slice.edge_mm * chip).max(0.0), slice.radius_mm * (exit - entry) * slice.edge_mm]
}

fn edge_piece(arc: &EngagedArc, slice: &Slice, tangent_z: f64) -> EdgePiece {
    let half = 0.5 * slice.dz_mm().abs();
    let from_to_mm = [slice.z_mm - half, slice.z_mm + half];
    EdgePiece { from_to_mm, section_and_contact_mm2: section_and_contact(arc, slice, tangent_z) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engage::map::StationFlags;
    use crate::ids::MoveId;

    #[test]
    fn the_mean_cosine_is_that_of_a_sum_over_the_arc() {
        const STEPS: u32 = 20_000;
        let slices = [Slice { z_mm: 0.25, radius_mm: 5.0, edge_mm: 0.5, normal_r: 1.0, normal_z: 0.0, segment: 0 }];
        for (entry, exit) in [(0.0, 1.2), (0.4, 2.9), (2.0, PI)] {
            let arc = EngagedArc { slice: 0, entry_rad: entry as f32, exit_rad: exit as f32 };
            let map = EngagementMap { arcs: vec![arc], ..EngagementMap::default() };
            let station = Station {
                move_id: MoveId(0),
                from_mm: 0.0,
                to_mm: 1.0,
                removal_area_mm2: 1.0,
                axial_depth_mm: 0.5,
                first_arc: 0,
                arc_count: 1,
                at_ends: [0; 2],
                flags: StationFlags::default(),
            };
            let found = engaged(&station, &map, &slices, 2, 0.0).mean_cosine;
            let step = (exit - entry) / f64::from(STEPS);
            let sums = (0..STEPS)
                .map(|k| entry + step * (f64::from(k) + 0.5))
                .fold([0.0; 3], |sum, phi| [sum[0] + phi.sin() * phi.cos(), sum[1] + phi.sin(), sum[2] + phi.cos()]);
            let expected = [sums[0] / sums[1], sums[2] / f64::from(STEPS)];
            assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-6), "{entry}: {found:?} for {expected:?}");
        }
    }
}
