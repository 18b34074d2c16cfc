//! What kind of cut a move makes, and how deep. In: toolpath, engagement, job. Out: by station, whether the end face cuts downwards and
//! whether it is a finishing pass; by move, a [`Cut`], by which operations are told apart.

use super::problem::NotRaised;
use crate::engage::{EngagedArc, EngagementMap, Station};
use crate::ids::MoveId;
use crate::machine::{Cut, CutKind, Job, Slice};
use crate::nc::{Move, MoveKind, Toolpath};
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Fall of a whole move up to which it counts as level, mm: two increments of the usual third decimal, so that rounding
/// makes no ramps.
pub const LEVEL_MM: f64 = 0.002;
/// Thickest layer that counts as the allowance of a finishing pass, mm, and as a share of the tool's diameter for small tools;
/// the thinner of the two holds. CAM systems leave 0.2 to 0.5 mm (0.010 to 0.020 in) for finishing by default; the share is
/// our judgement. Above it a pass that happens to be the last (a slot, facing, a pocket in one layer) is roughing.
pub const ALLOWANCE: (f64, f64) = (0.5, 0.1);

/// By station: does it belong to a finishing pass, that is one which leaves the surface of the finished part and removes no more than an
/// allowance?
pub fn finishing(toolpath: &Toolpath, map: &EngagementMap, job: &Job) -> Vec<bool> {
    let thin = takes_an_allowance(toolpath, map, job);
    leaves_surface(toolpath, map).into_iter().zip(thin).map(|(leaves, thin)| leaves && thin).collect()
}

/// By move: the cut that it makes; `None` for rapids. Its kind is `Down` if the end face cuts downwards anywhere on it, else `Finishing` if
/// more than half of its cut length is a finishing pass, else `Roughing`. Its depth is the largest axial depth between the rapid before it
/// and the next one, because a pass that enters and leaves the material, or climbs a step, is one operation.
pub fn cuts(toolpath: &Toolpath, map: &EngagementMap, job: &Job) -> Vec<Option<Cut>> {
    let finishing = finishing(toolpath, map, job);
    let level = Cut { kind: CutKind::Roughing, depth_mm: 0.0 };
    let mut found: Vec<Option<Cut>> =
        toolpath.moves.iter().map(|motion| (motion.kind == MoveKind::Feed).then_some(level)).collect();
    for (id, motion) in toolpath.iter_moves() {
        let range = map.of_move[id.ix()].clone();
        let (stations, thin) = (map.stations_of(id), &finishing[range.start as usize..range.end as usize]);
        if let Some(cut) = &mut found[id.ix()] {
            cut.kind = kind(motion, stations, thin);
        }
    }
    let mut start = 0;
    while start < map.stations.len() {
        let end = chain_end(toolpath, map, start);
        let chain = &map.stations[start..end];
        let depths = chain.iter().filter(|station| station.arc_count > 0);
        let deepest_mm = depths.map(|station| f64::from(station.axial_depth_mm)).fold(0.0, f64::max);
        for station in chain {
            if let Some(cut) = &mut found[station.move_id.ix()] {
                cut.depth_mm = cut.depth_mm.max(deepest_mm);
            }
        }
        start = end;
    }
    found
}

fn kind(motion: &Move, stations: &[Station], finishing: &[bool]) -> CutKind {
    if stations.iter().any(|station| downwards(motion, station).is_some()) {
        return CutKind::Down;
    }
    let cut_mm = |only: bool| -> f64 {
        let here = stations.iter().zip(finishing).filter(|(station, thin)| station.arc_count > 0 && (**thin || !only));
        here.map(|(station, _)| station.length_mm()).sum()
    };
    if cut_mm(true) > 0.5 * cut_mm(false) { CutKind::Finishing } else { CutKind::Roughing }
}

/// [`NotRaised::Plunge`] or [`NotRaised::Ramp`] where the end face cuts downwards; `None` elsewhere.
pub fn downwards(motion: &Move, station: &Station) -> Option<NotRaised> {
    let curve = motion.curve();
    let fall = -curve.tangent(0.5 * (station.from_mm + station.to_mm)).z;
    match station.arc_count {
        0 => None,
        _ if fall > FRAC_1_SQRT_2 => Some(NotRaised::Plunge),
        _ if fall * curve.length() > LEVEL_MM => Some(NotRaised::Ramp),
        _ => None,
    }
}

/// By station: does it leave the surface of the finished part? Stations within the diagonal of a cell of such a one along the path count as
/// well, because a station shorter than a cell may have no cell of its own.
fn leaves_surface(toolpath: &Toolpath, map: &EngagementMap) -> Vec<bool> {
    let reach_mm = map.cell_mm * std::f64::consts::SQRT_2;
    let mut found = vec![false; map.stations.len()];
    let mut look = |indices: &mut dyn Iterator<Item = usize>| {
        let mut since_mm = f64::INFINITY;
        let mut last: Option<MoveId> = None;
        for index in indices {
            let station = &map.stations[index];
            if last.is_some_and(|last| !follow_on(toolpath, last, station.move_id)) {
                since_mm = f64::INFINITY;
            }
            last = Some(station.move_id);
            if station.flags.final_surface {
                since_mm = 0.0;
            }
            found[index] |= since_mm <= reach_mm && station.arc_count > 0 || station.flags.final_surface;
            if !station.flags.final_surface {
                since_mm += station.length_mm();
            }
        }
    };
    look(&mut (0..map.stations.len()));
    look(&mut (0..map.stations.len()).rev());
    found
}

/// By station: is most of what is cut around it no thicker than an allowance ([`is_thin`])? The surroundings reach one tool diameter along
/// the feed moves to either side, so that neither a corner in a finishing pass nor a thin place in a roughing pass changes the answer.
fn takes_an_allowance(toolpath: &Toolpath, map: &EngagementMap, job: &Job) -> Vec<bool> {
    let mut found = vec![false; map.stations.len()];
    let mut start = 0;
    while start < map.stations.len() {
        let end = chain_end(toolpath, map, start);
        let tool = toolpath.moves[map.stations[start].move_id.ix()].tool;
        let diameter_mm = job.tool(tool).map_or(0.0, |tool| tool.diameter_mm);
        let thick_mm = ALLOWANCE.0.min(ALLOWANCE.1 * diameter_mm);
        let slices = map.slices_of(tool);
        let thin = |station: &Station| is_thin(station, map.arcs_of(station), slices, thick_mm);
        mostly_thin(&map.stations[start..end], &thin, diameter_mm, &mut found[start..end]);
        start = end;
    }
    found
}

/// Index after the last station of the chain of feed moves of one tool that begins with station `start`.
fn chain_end(toolpath: &Toolpath, map: &EngagementMap, start: usize) -> usize {
    let joined = |pair: &[Station]| {
        let [a, b] = [pair[0].move_id, pair[1].move_id];
        follow_on(toolpath, a, b) && toolpath.moves[a.ix()].tool == toolpath.moves[b.ix()].tool
    };
    start + 1 + map.stations[start..].windows(2).take_while(|pair| joined(pair)).count()
}

/// Writes into `found` for each station of a chain whether more than half of the length cut within one diameter of it is thin.
fn mostly_thin(stations: &[Station], thin: &dyn Fn(&Station) -> bool, diameter_mm: f64, found: &mut [bool]) {
    // Length, length in material and length of thin cuts up to the end of each station, mm.
    let mut sums = Vec::with_capacity(stations.len() + 1);
    sums.push([0.0; 3]);
    for (i, station) in stations.iter().enumerate() {
        let length_mm = station.length_mm();
        let cut_mm = if station.arc_count > 0 { length_mm } else { 0.0 };
        let thin_mm = if cut_mm > 0.0 && thin(station) { cut_mm } else { 0.0 };
        sums.push([sums[i][0] + length_mm, sums[i][1] + cut_mm, sums[i][2] + thin_mm]);
    }
    for (i, found) in found.iter_mut().enumerate() {
        let middle_mm = 0.5 * (sums[i][0] + sums[i + 1][0]);
        let first = sums.partition_point(|sum| sum[0] < middle_mm - diameter_mm).min(i);
        let last = sums.partition_point(|sum| sum[0] <= middle_mm + diameter_mm).clamp(i + 1, stations.len());
        let [cut_mm, thin_mm] = [1, 2].map(|k| sums[last][k] - sums[first][k]);
        *found = thin_mm > 0.5 * cut_mm;
    }
}

/// Is the layer that is cut at a station no thicker than `thick_mm`? The layer may lie on the floor, on the wall, or on both, so the radial
/// depth is taken over the rings above the height `thick_mm` only: the mean Σ a² dz / Σ a dz of the radial depth a of each. Weighted by a
/// itself, skimming a wall within the rounding of coordinates counts for nothing. A removal area below `thick_mm`² is thin anyway.
fn is_thin(station: &Station, arcs: &[EngagedArc], slices: &[Slice], thick_mm: f64) -> bool {
    if f64::from(station.axial_depth_mm).min(f64::from(station.removal_area_mm2) / thick_mm) <= thick_mm {
        return true;
    }
    let (mut area_mm2, mut square_mm3) = (0.0, 0.0);
    let mut last = ([f32::NAN; 2], 0.0);
    for of_ring in arcs.chunk_by(|a, b| a.slice == b.slice) {
        let Some(slice) = slices.get(of_ring[0].slice as usize).filter(|slice| slice.z_mm > thick_mm) else {
            continue;
        };
        let mut radial_mm = 0.0;
        for arc in of_ring {
            // Rings of one tool mostly share their angles.
            let angles = [arc.entry_rad, arc.exit_rad];
            if angles != last.0 {
                let [entry, exit] = angles.map(|angle| f64::from(angle).clamp(0.0, PI).cos());
                last = (angles, entry - exit);
            }
            radial_mm += slice.radius_mm * last.1;
        }
        area_mm2 += radial_mm * slice.dz_mm();
        square_mm3 += radial_mm * radial_mm * slice.dz_mm();
    }
    square_mm3 <= thick_mm * area_mm2
}

/// Are these two the same feed move, or two that follow each other without a rapid between them?
fn follow_on(toolpath: &Toolpath, a: MoveId, b: MoveId) -> bool {
    let (first, last) = (a.ix().min(b.ix()), a.ix().max(b.ix()));
    toolpath.moves[first..last].iter().all(|motion| motion.kind == MoveKind::Feed)
}
