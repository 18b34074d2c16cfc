//! What the machine should be doing when: the program as a list of spots (pieces of moves, dwells, tool changes, run-ups)
//! with their predicted times and engagement.
//!
//! In: toolpath, engagement map, job. Out: [`Timeline`]. Every station of the engagement map is a spot, or several where
//! it is long; its speed comes from the realised-time model of [`crate::schedule`], asked about the same path with moves cut at the stations. Geometry
//! of a spot: removed section a_p·a_e (mm²), area swept by all edges in a revolution (mm²), share of it in the up half
//! minus the climb half. The arcs of a station belong to its most engaged point; they are scaled to its mean section.

use super::forces::Sample;
use crate::engage::{EngagementMap, Station};
use crate::force::contact::{Engaged, Runouts, engaged as geometry};
use crate::force::{Cut, Cutter, Loads};
use crate::ids::MoveId;
use crate::machine::material::{ForceModel, LinearEdge, Material, Process};
use crate::machine::{Job, Machine, Runout, Tool};
use crate::nc::{Event, Move, MoveKind, Spin, Toolpath};
use crate::path::Vec3;
use crate::schedule::realise::{as_programmed, realise};

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
pub fn timeline(path: &Toolpath, map: &EngagementMap, job: &Job, wanted: Option<Sample>) -> Timeline {
    let pieces = Pieces::new(path, map);
    let seconds = piece_seconds(&pieces.path, &job.machine);
    let mut forces = Forces { map, job, wanted, runout: true, known: Vec::new() };
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
    let slower = piece_seconds(&pieces.path, &job.machine.with_acceleration(factor));
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
        self.push(&Spot {
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
            self.push(&Spot {
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

    fn push(&mut self, spot: &Spot) {
        self.now = spot.end_s;
        self.spots.push(*spot);
    }
}

/// Engagement of every spot under another job (grown stock, other tool), simulated as `map`.
pub fn engaged_otherwise(
    path: &Toolpath,
    map: &EngagementMap,
    job: &Job,
    timeline: &Timeline,
    wanted: Option<Sample>,
) -> Vec<Engaged> {
    let mut forces = Forces { map, job, wanted, runout: false, known: Vec::new() };
    let of = |spot: &Spot| {
        let id = spot.move_id?;
        let stations = map.stations_of(id);
        let k = stations.partition_point(|s| s.to_mm < spot.middle_mm);
        let station = stations.get(k.min(stations.len().checked_sub(1)?))?;
        Some(forces.engaged(&path.moves[id.ix()], station, spot.direction.z, spot.speed_mm_s()))
    };
    timeline.spots.iter().map(of).map(Option::unwrap_or_default).collect()
}

/// Cutters with one coefficient at a time a little larger, round and with runout, for the derivatives of the peak force.
struct Forces<'a> {
    map: &'a EngagementMap,
    job: &'a Job,
    /// The force that is asked for: a peak, or the magnitude of the mean vector.
    wanted: Option<Sample>,
    /// Is the change by runout asked for?
    runout: bool,
    /// (tool, speed) and the cutters.
    known: Vec<((u32, u64), Option<Probe>)>,
}

struct Probe {
    nominal: Cutter,
    /// k_tc, k_rc, k_te, k_re larger, with by how much.
    larger: [(Cutter, f64); 4],
    /// k_te larger, with by how much relative to it.
    sharper: (Cutter, f64),
    /// Nominal with each of [`RUNOUTS_MM`], pointing each of the first four ways of [`RUNOUT_PHASES`].
    out: Vec<Cutter>,
}

/// Offsets of the axis at which the change of the loads is taken, mm.
pub const RUNOUTS_MM: [f64; 2] = [0.006, 0.018];
/// Ways that it points, in pitches of the teeth; the last is the first again.
pub const RUNOUT_PHASES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

impl Forces<'_> {
    fn engaged(&mut self, motion: &Move, station: &Station, tangent_z: f64, speed_mm_s: f64) -> Engaged {
        let Some(tool) = self.job.tool(motion.tool) else { return Engaged::default() };
        let mut engaged = geometry(station, self.map, self.map.slices_of(motion.tool), tool.flutes, tangent_z);
        if self.wanted.is_some() && station.arc_count > 0 && motion.spin.rps > 0.0 {
            (engaged.peak, engaged.runout) = self.peak(motion, station, tangent_z, speed_mm_s);
        }
        engaged
    }

    fn peak(&mut self, motion: &Move, station: &Station, tangent_z: f64, speed_mm_s: f64) -> ([f64; 4], Runouts) {
        let key = (motion.tool, motion.spin.rps.to_bits());
        if !self.known.iter().any(|(k, _)| *k == key) {
            let probe = self.probe(motion);
            self.known.push((key, probe));
        }
        let probe = self.known.iter().find(|(k, _)| *k == key).and_then(|(_, probe)| probe.as_ref());
        let Some(probe) = probe else { return Default::default() };
        let cut = Cut { arcs: self.map.arcs_of(station), tangent_z, ..Cut::default() };
        let loads = |cutter: &Cutter| cutter.loads(&cut, speed_mm_s);
        let mean = self.wanted == Some(Sample::Mean);
        let force = |loads: &Loads| if mean { loads.force_xy_mean_n } else { loads.force_xy_peak_n };
        let nominal = loads(&probe.nominal);
        let peak = force(&nominal);
        let slopes = std::array::from_fn(|k| {
            let (cutter, step) = &probe.larger[k];
            (force(&loads(cutter)) - peak) / step
        });
        if !self.runout || peak <= 0.0 {
            return (slopes, Runouts::default());
        }
        // The chips of all teeth together stay; what the power loses, the edges lose.
        let edge_w = (loads(&probe.sharper.0).power_w - nominal.power_w) / probe.sharper.1;
        let change = |out: &Cutter| {
            let out = loads(out);
            let lost = if edge_w.abs() > 1e-9 { (out.power_w - nominal.power_w) / edge_w } else { 0.0 };
            [force(&out) / peak - 1.0, lost.clamp(-1.0, 0.0)]
        };
        (slopes, std::array::from_fn(|k| std::array::from_fn(|p| change(&probe.out[4 * k + p]))))
    }

    fn probe(&self, motion: &Move) -> Option<Probe> {
        let tool = self.job.tool(motion.tool)?;
        let ForceModel::LinearEdge(k) = self.job.material(tool)?.model else { return None };
        let cutter = |k: LinearEdge, runout: Option<Runout>| {
            let material = Material { name: String::new(), model: ForceModel::LinearEdge(k), uncertainty: None };
            let tool = Tool { runout, ..tool.clone() };
            let slices = self.map.slices_of(motion.tool);
            Cutter::new(&tool, &material, &self.job.machine.spindle, &Process::default(), slices, motion.spin.rps).ok()
        };
        let step = |value: f64| 1e-3 * value.abs().max(1.0);
        let (tc, rc, te, re) = (step(k.k_tc), step(k.k_rc), step(k.k_te), step(k.k_re));
        let pitch = std::f64::consts::TAU / f64::from(tool.flutes.max(1));
        let ways = |offset_mm: f64| RUNOUT_PHASES[..4].iter().map(move |p| (offset_mm, p * pitch));
        let out = |(offset_mm, angle_rad): (f64, f64)| cutter(k, Some(Runout { offset_mm, angle_rad }));
        Some(Probe {
            nominal: cutter(k, tool.runout)?,
            larger: [
                (cutter(LinearEdge { k_tc: k.k_tc + tc, ..k }, tool.runout)?, tc),
                (cutter(LinearEdge { k_rc: k.k_rc + rc, ..k }, tool.runout)?, rc),
                (cutter(LinearEdge { k_te: k.k_te + te, ..k }, tool.runout)?, te),
                (cutter(LinearEdge { k_re: k.k_re + re, ..k }, tool.runout)?, re),
            ],
            sharper: (cutter(LinearEdge { k_te: 1.1 * k.k_te, ..k }, tool.runout)?, 0.1),
            out: RUNOUTS_MM.into_iter().flat_map(ways).map(out).collect::<Option<_>>()?,
        })
    }
}
