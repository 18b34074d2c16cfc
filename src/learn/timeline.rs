//! What the machine should be doing when: the program as a list of spots (pieces of moves, dwells, tool changes, run-ups)
//! with their predicted times and engagement.
//!
//! In: toolpath, engagement map, job. Out: [`Timeline`]. Every station of the engagement map is a spot, or several where
//! it is long; its speed comes from the realised-time model of [`crate::schedule`], asked about the same path with moves cut at the stations. Geometry
//! of a spot: removed section a_p·a_e (mm²), area swept by all edges in a revolution (mm²), share of it in the up half
//! minus the climb half. The arcs of a station belong to its most engaged point; they are scaled to its mean section.

use crate::engage::{EngagementMap, Station};
use crate::force::{Cut, Cutter};
use crate::ids::MoveId;
use crate::machine::material::{ForceModel, LinearEdge, Material, Process};
use crate::machine::{Axis, Job, Machine, Slice};
use crate::nc::{Event, Move, MoveKind, Spin, Toolpath};
use crate::path::Vec3;
use crate::schedule::realise::{as_programmed, realise};
use std::f64::consts::FRAC_PI_2;

/// Longest spot of a feed move, mm.
const LONGEST_MM: f64 = 1.0;
/// Spots are longer where there would be more than this many.
const MOST_SPOTS: f64 = 40_000.0;

/// What happens in a spot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Doing {
    /// A feed move.
    Feed,
    /// A rapid.
    Rapid,
    /// A dwell.
    Dwell,
    /// A tool change.
    ToolChange,
    /// The spindle changes speed.
    RunUp,
}

/// Engagement of a spot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Engaged {
    /// Volume removed per mm of path, mm².
    pub section_mm2: f64,
    /// Area swept by all edges over material in a revolution, mm².
    pub contact_mm2: f64,
    /// Way of one tooth in material in a revolution, mm.
    pub way_mm: f64,
    /// −1 climb … +1 up, by contact.
    pub up_share: f64,
    /// The same by chip thickness.
    pub up_share_chip: f64,
    /// Middle of the contact from the axis: along the feed and to the left of it, mm.
    pub contact_mm: [f64; 2],
    /// Height engaged, mm.
    pub axial_mm: f64,
    /// Derivative of the peak force in the plane at the predicted speed by k_tc, k_rc, k_te, k_re.
    pub peak: [f64; 4],
}

/// One piece of the program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// When it should begin, s.
    pub start_s: f64,
    /// When it should end, s.
    pub end_s: f64,
    /// What happens.
    pub doing: Doing,
    /// Its move.
    pub move_id: Option<MoveId>,
    /// Middle of the piece along the move, mm.
    pub middle_mm: f64,
    /// Physical line, 1-based.
    pub line: u32,
    /// Block, 0-based.
    pub block: u32,
    /// Tool.
    pub tool: u32,
    /// Spindle speed, rev/s.
    pub rps: f64,
    /// First point, mm.
    pub from: Vec3,
    /// Last point, mm.
    pub to: Vec3,
    /// Unit tangent in the middle.
    pub direction: Vec3,
    /// Length, mm.
    pub length_mm: f64,
    /// Curvature of the path, 1/mm.
    pub curvature_per_mm: f64,
    /// What is cut.
    pub engaged: Engaged,
}

impl Spot {
    /// Predicted speed, mm/s.
    pub fn speed_mm_s(&self) -> f64 {
        self.length_mm / (self.end_s - self.start_s).max(1e-9)
    }
}

/// The program in time.
#[derive(Debug, Clone, Default)]
pub struct Timeline {
    /// Spots in order.
    pub spots: Vec<Spot>,
}

impl Timeline {
    /// Predicted length, s.
    pub fn total_s(&self) -> f64 {
        self.spots.last().map_or(0.0, |spot| spot.end_s)
    }
    /// Spot at a predicted time; `None` outside the program.
    pub fn at(&self, time_s: f64) -> Option<usize> {
        if !(0.0..=self.total_s()).contains(&time_s) {
            return None;
        }
        Some(self.spots.partition_point(|spot| spot.end_s < time_s).min(self.spots.len() - 1))
    }
}

/// Builds the timeline of a program.
pub fn timeline(path: &Toolpath, map: &EngagementMap, job: &Job, with_forces: bool) -> Timeline {
    let pieces = Pieces::new(path, map);
    let seconds = piece_seconds(&pieces.path, &job.machine);
    let mut forces = Forces { map, job, wanted: with_forces, known: Vec::new() };
    let mut build = Build {
        path,
        job,
        pieces: &pieces,
        seconds: &seconds,
        spots: Vec::new(),
        now: 0.0,
        spin: Spin::default(),
        tool: None,
    };
    for event in path.events() {
        build.event(&event, &mut forces);
    }
    Timeline { spots: build.spots }
}

/// Speed of each spot on a machine with `factor` of the declared acceleration, over its declared speed; 1 for spots that
/// do not move.
pub fn speed_ratios(path: &Toolpath, map: &EngagementMap, job: &Job, timeline: &Timeline, factor: f64) -> Vec<f64> {
    let pieces = Pieces::new(path, map);
    let slower = piece_seconds(&pieces.path, &slower(&job.machine, factor));
    let mut next = 0;
    timeline
        .spots
        .iter()
        .map(|spot| {
            if spot.move_id.is_none() {
                return 1.0;
            }
            let seconds = slower[next];
            next += 1;
            if seconds > 0.0 { (spot.end_s - spot.start_s) / seconds } else { 1.0 }
        })
        .collect()
}

fn slower(machine: &Machine, factor: f64) -> Machine {
    let axis = |a: &Axis| Axis { acceleration_mm_s2: a.acceleration_mm_s2 * factor, ..*a };
    Machine { axes: [axis(&machine.axes[0]), axis(&machine.axes[1]), axis(&machine.axes[2])], ..machine.clone() }
}

fn piece_seconds(path: &Toolpath, machine: &Machine) -> Vec<f64> {
    realise(path, &as_programmed(path), machine).move_s
}

/// The toolpath with its moves cut at the stations.
struct Pieces {
    path: Toolpath,
    /// (move, station) of each piece.
    of: Vec<(MoveId, Option<usize>)>,
    /// First piece of each move, and one past the last.
    first: Vec<usize>,
}

impl Pieces {
    fn new(path: &Toolpath, map: &EngagementMap) -> Self {
        let (mut moves, mut of, mut first) = (Vec::new(), Vec::new(), Vec::new());
        let length: f64 = map.stations.iter().map(Station::length_mm).sum();
        let longest = f64::max(LONGEST_MM, length / MOST_SPOTS);
        for (index, motion) in path.moves.iter().enumerate() {
            let id = MoveId(index as u32);
            first.push(moves.len());
            let stations = if motion.kind == MoveKind::Feed { map.stations_of(id) } else { &[] };
            if stations.is_empty() {
                moves.push(motion.clone());
                of.push((id, None));
            }
            for (k, station) in stations.iter().enumerate() {
                let parts = (station.length_mm() / longest).ceil().max(1.0);
                let at = |j: f64| station.from_mm + station.length_mm() * j / parts;
                for j in 0..parts as usize {
                    let curve = motion.curve().part(at(j as f64), at(j as f64 + 1.0));
                    let mut part = motion.clone();
                    part.set_curve(curve);
                    moves.push(part);
                    of.push((id, Some(k)));
                }
            }
        }
        first.push(moves.len());
        let between = path.between.iter().map(|(id, event)| (MoveId(first[id.ix()] as u32), *event)).collect();
        Self { path: Toolpath { moves, between, ..Toolpath::default() }, of, first }
    }
}

struct Build<'a> {
    path: &'a Toolpath,
    job: &'a Job,
    pieces: &'a Pieces,
    seconds: &'a [f64],
    spots: Vec<Spot>,
    now: f64,
    spin: Spin,
    tool: Option<u32>,
}

impl Build<'_> {
    fn event(&mut self, event: &Event, forces: &mut Forces) {
        match event {
            Event::Move(id) => self.motion(*id, forces),
            Event::Dwell { seconds, line } => self.wait(*seconds, *line, Doing::Dwell),
            Event::Tool { number, line } => {
                if self.tool.replace(*number) != Some(*number) {
                    self.wait(self.job.machine.tool_change_time_s, *line, Doing::ToolChange);
                }
            }
            Event::Spindle { spin, line } => {
                let changed = *spin != self.spin && spin.rps > 0.0;
                self.spin = *spin;
                if changed {
                    self.wait(self.job.machine.spindle.runup_time_s, *line, Doing::RunUp);
                }
            }
            Event::Stop { .. } => {}
        }
    }

    fn wait(&mut self, seconds: f64, line: u32, doing: Doing) {
        let at = self
            .spots
            .last()
            .map_or_else(|| self.path.moves.first().map_or_else(Vec3::zeros, |m| m.curve().from()), |s| s.to);
        self.push(Spot {
            start_s: self.now,
            end_s: self.now + seconds,
            doing,
            move_id: None,
            middle_mm: 0.0,
            line,
            block: line.saturating_sub(1),
            tool: self.tool.unwrap_or(0),
            rps: self.spin.rps,
            from: at,
            to: at,
            direction: Vec3::zeros(),
            length_mm: 0.0,
            curvature_per_mm: 0.0,
            engaged: Engaged::default(),
        });
    }

    fn motion(&mut self, id: MoveId, forces: &mut Forces) {
        let motion = &self.path.moves[id.ix()];
        let mut done_mm = 0.0;
        for piece in self.pieces.first[id.ix()]..self.pieces.first[id.ix() + 1] {
            let index = self.pieces.of[piece].1;
            let station = index.map(|k| forces.map.stations_of(id)[k]);
            let curve = &self.pieces.path.moves[piece].curve();
            let half = 0.5 * curve.length();
            let middle_mm = done_mm + half;
            done_mm += curve.length();
            let speed_mm_s = curve.length() / self.seconds[piece].max(1e-9);
            let tangent_z = curve.tangent(half).z;
            self.push(Spot {
                start_s: self.now,
                end_s: self.now + self.seconds[piece],
                doing: if motion.kind == MoveKind::Feed { Doing::Feed } else { Doing::Rapid },
                move_id: Some(id),
                middle_mm,
                line: motion.line,
                block: motion.block.0,
                tool: motion.tool,
                rps: motion.spin.rps,
                from: curve.from(),
                to: curve.to(),
                direction: curve.tangent(half),
                length_mm: curve.length(),
                curvature_per_mm: curve.curvature(half).norm(),
                engaged: station.map_or_else(Engaged::default, |s| forces.engaged(motion, &s, tangent_z, speed_mm_s)),
            });
        }
    }

    fn push(&mut self, spot: Spot) {
        self.now = spot.end_s;
        self.spots.push(spot);
    }
}

/// Engagement of every spot under another job (grown stock, other tool), simulated as `map`.
pub fn engaged_otherwise(
    path: &Toolpath,
    map: &EngagementMap,
    job: &Job,
    timeline: &Timeline,
    with_forces: bool,
) -> Vec<Engaged> {
    let mut forces = Forces { map, job, wanted: with_forces, known: Vec::new() };
    let of = |spot: &Spot| {
        let id = spot.move_id?;
        let stations = map.stations_of(id);
        let k = stations.partition_point(|s| s.to_mm < spot.middle_mm);
        let station = stations.get(k.min(stations.len().checked_sub(1)?))?;
        Some(forces.engaged(&path.moves[id.ix()], station, spot.direction.z, spot.speed_mm_s()))
    };
    timeline.spots.iter().map(of).map(Option::unwrap_or_default).collect()
}

/// Cutters with one coefficient at a time a little larger, for the derivatives of the peak force.
struct Forces<'a> {
    map: &'a EngagementMap,
    job: &'a Job,
    wanted: bool,
    /// (tool, speed) and the cutters: nominal, then k_tc, k_rc, k_te, k_re larger, with by how much.
    known: Vec<((u32, u64), Option<Probe>)>,
}

struct Probe {
    nominal: Cutter,
    larger: [(Cutter, f64); 4],
}

impl Forces<'_> {
    fn engaged(&mut self, motion: &Move, station: &Station, tangent_z: f64, speed_mm_s: f64) -> Engaged {
        let Some(tool) = self.job.tool(motion.tool) else { return Engaged::default() };
        let mut engaged = geometry(station, self.map, self.map.slices_of(motion.tool), tool.flutes, tangent_z);
        if self.wanted && station.arc_count > 0 && motion.spin.rps > 0.0 {
            engaged.peak = self.peak(motion, station, tangent_z, speed_mm_s);
        }
        engaged
    }

    fn peak(&mut self, motion: &Move, station: &Station, tangent_z: f64, speed_mm_s: f64) -> [f64; 4] {
        let key = (motion.tool, motion.spin.rps.to_bits());
        if !self.known.iter().any(|(k, _)| *k == key) {
            let probe = self.probe(motion);
            self.known.push((key, probe));
        }
        let probe = self.known.iter().find(|(k, _)| *k == key).and_then(|(_, probe)| probe.as_ref());
        let Some(probe) = probe else { return [0.0; 4] };
        let cut = Cut { arcs: self.map.arcs_of(station), tangent_z, ..Cut::default() };
        let peak = |cutter: &Cutter| cutter.loads(&cut, speed_mm_s).force_xy_peak_n;
        let nominal = peak(&probe.nominal);
        std::array::from_fn(|k| (peak(&probe.larger[k].0) - nominal) / probe.larger[k].1)
    }

    fn probe(&self, motion: &Move) -> Option<Probe> {
        let tool = self.job.tool(motion.tool)?;
        let ForceModel::LinearEdge(k) = self.job.material(tool)?.model else { return None };
        let cutter = |k: LinearEdge| {
            let material = Material { name: String::new(), model: ForceModel::LinearEdge(k), uncertainty: None };
            let slices = self.map.slices_of(motion.tool);
            let spindle = &self.job.machine.spindle;
            Cutter::new(tool, &material, spindle, &Process::default(), slices, motion.spin.rps).ok()
        };
        let step = |value: f64| 1e-3 * value.abs().max(1.0);
        let (tc, rc, te, re) = (step(k.k_tc), step(k.k_rc), step(k.k_te), step(k.k_re));
        Some(Probe {
            nominal: cutter(k)?,
            larger: [
                (cutter(LinearEdge { k_tc: k.k_tc + tc, ..k })?, tc),
                (cutter(LinearEdge { k_rc: k.k_rc + rc, ..k })?, rc),
                (cutter(LinearEdge { k_te: k.k_te + te, ..k })?, te),
                (cutter(LinearEdge { k_re: k.k_re + re, ..k })?, re),
            ],
        })
    }
}

/// Engagement of a station by its arcs. Under a level feed a bottom face sweeps without a chip; it is no part of the
/// contact (Xu, Eq. 3.7).
pub fn geometry(station: &Station, map: &EngagementMap, slices: &[Slice], flutes: u32, tangent_z: f64) -> Engaged {
    let (mut contact, mut section, mut up, mut way, mut height) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut up_chip, mut middle) = (0.0, [0.0; 2]);
    let level = tangent_z.abs() < 0.02;
    for arc in map.arcs_of(station) {
        let slice = &slices[arc.slice as usize];
        if level && slice.normal_r < 0.02 {
            continue;
        }
        let (entry, exit) = (f64::from(arc.entry_rad), f64::from(arc.exit_rad));
        let swept = slice.radius_mm * (exit - entry) * slice.edge_mm;
        let in_up = (exit.min(FRAC_PI_2) - entry.min(FRAC_PI_2)).max(0.0) / (exit - entry).max(1e-9);
        contact += swept;
        section += slice.radius_mm * (entry.cos() - exit.cos()) * slice.edge_mm * slice.normal_r.max(0.0);
        up += swept * (2.0 * in_up - 1.0);
        let turn = |from: f64, to: f64| slice.radius_mm * slice.edge_mm * (from.cos() - to.cos());
        up_chip += turn(entry.min(FRAC_PI_2), exit.min(FRAC_PI_2)) - turn(entry.max(FRAC_PI_2), exit.max(FRAC_PI_2));
        middle[0] += slice.radius_mm * turn(entry, exit);
        middle[1] += slice.radius_mm * slice.radius_mm * slice.edge_mm * (exit.sin() - entry.sin());
        way += slice.radius_mm * (exit - entry) * slice.dz_mm();
        height += slice.dz_mm();
    }
    let mean = f64::from(station.removal_area_mm2);
    let share = if level && section > 1e-9 { (mean / section).clamp(0.0, 1.2) } else { 1.0 };
    Engaged {
        section_mm2: mean,
        contact_mm2: contact * f64::from(flutes) * share,
        way_mm: if height > 0.0 { way / height * share } else { 0.0 },
        up_share: if contact > 0.0 { up / contact } else { 0.0 },
        up_share_chip: if section > 0.0 { up_chip / section } else { 0.0 },
        contact_mm: middle.map(|m| m / contact.max(1e-12)),
        axial_mm: f64::from(station.axial_depth_mm),
        peak: [0.0; 4],
    }
}
