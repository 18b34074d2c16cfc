//! The program as a list of spots (pieces of moves, dwells, tool changes, run-ups) with their predicted times and
//! engagement.
//!
//! In: toolpath, engagement map, job. Out: [`Timeline`]. Every station of the engagement map is a spot, or several if
//! it is long; its speed comes from the model of realised times in [`crate::schedule`], applied to the path with moves
//! split at the stations. Geometry of a spot: removal area a_p·a_e (mm²), area swept by all edges in a revolution
//! (mm²), share of that in the up half minus the climb half. The arcs of a station are the union of those engaged
//! anywhere along it; they are scaled to its mean removal area.

use crate::engage::{EngagementMap, Station};
use crate::force::contact::Engaged;
use crate::ids::MoveId;
use crate::learn::log::resultant::Sample;
use crate::learn::program::peak_forces::{About, Forces};
use crate::learn::program::runout_grid::Runouts;
use crate::machine::{Job, Machine};
use crate::nc::{Event, MoveKind, Spin, Toolpath};
use crate::path::Vec3;
use crate::schedule::realise::{as_programmed, realise};

/// Longest spot of a feed move, mm.
const LONGEST_MM: f64 = 1.0;
/// Most spots of feed moves: beyond this number they are made longer.
const MOST_SPOTS: f64 = 40_000.0;

/// What happens in a spot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activity {
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
    /// Predicted start, s.
    pub start_s: f64,
    /// Predicted end, s.
    pub end_s: f64,
    /// Activity.
    pub activity: Activity,
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
    /// Coolant or mist is on.
    pub coolant: bool,
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
    /// Engagement.
    pub engaged: Engaged,
}

impl Spot {
    /// Predicted speed, mm/s.
    pub fn speed_mm_s(&self) -> f64 {
        self.length_mm / (self.end_s - self.start_s).max(1e-9)
    }
}

/// The program over time.
#[derive(Debug, Clone, Default)]
pub struct Timeline {
    /// Spots in order.
    pub spots: Vec<Spot>,
    /// Changes of their forces by runout; empty if no forces are measured.
    pub runouts: Vec<Runouts>,
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
    let mut forces = Forces::new(map, job, wanted, Some(About::default()));
    let mut build = Build {
        path,
        job,
        pieces: &pieces,
        seconds: &seconds,
        spots: Vec::new(),
        runouts: Vec::new(),
        now: 0.0,
        spin: Spin::default(),
        tool: None,
    };
    for event in path.events() {
        build.event(&event, &mut forces);
    }
    let runouts = if wanted.is_some() { build.runouts } else { Vec::new() };
    Timeline { spots: build.spots, runouts }
}

/// Speed of each spot on a machine with `factor` of the declared acceleration, over its declared speed; 1 for spots
/// that do not move.
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

/// The toolpath with its moves split at the stations.
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
    runouts: Vec<Runouts>,
    now: f64,
    spin: Spin,
    tool: Option<u32>,
}

impl Build<'_> {
    fn event(&mut self, event: &Event, forces: &mut Forces) {
        match event {
            Event::Move(id) => self.motion(*id, forces),
            Event::Dwell { seconds, line } => self.wait(*seconds, *line, Activity::Dwell),
            Event::Tool { number, line } => {
                if self.tool.replace(*number) != Some(*number) {
                    self.wait(self.job.machine.tool_change_time_s, *line, Activity::ToolChange);
                }
            }
            Event::Spindle { spin, line } => {
                let changed = *spin != self.spin && spin.rps > 0.0;
                self.spin = *spin;
                if changed {
                    self.wait(self.job.machine.spindle.runup_time_s, *line, Activity::RunUp);
                }
            }
            Event::Stop { .. } => {}
        }
    }

    fn wait(&mut self, seconds: f64, line: u32, activity: Activity) {
        let at = self
            .spots
            .last()
            .map_or_else(|| self.path.moves.first().map_or_else(Vec3::zeros, |m| m.curve().from()), |s| s.to);
        self.push(&Spot {
            start_s: self.now,
            end_s: self.now + seconds,
            activity,
            move_id: None,
            middle_mm: 0.0,
            line,
            block: line.saturating_sub(1),
            tool: self.tool.unwrap_or(0),
            rps: self.spin.rps,
            coolant: self.spots.last().is_some_and(|spot| spot.coolant),
            from: at,
            to: at,
            direction: Vec3::zeros(),
            length_mm: 0.0,
            curvature_per_mm: 0.0,
            engaged: Engaged::default(),
        });
        self.runouts.push(Runouts::default());
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
            let cut = station.map(|s| forces.engaged(motion, &s, tangent_z, speed_mm_s));
            let (engaged, runouts) = cut.unwrap_or_default();
            self.runouts.push(runouts);
            self.push(&Spot {
                start_s: self.now,
                end_s: self.now + self.seconds[piece],
                activity: if motion.kind == MoveKind::Feed { Activity::Feed } else { Activity::Rapid },
                move_id: Some(id),
                middle_mm,
                line: motion.line,
                block: motion.block.0,
                tool: motion.tool,
                rps: motion.spin.rps,
                coolant: motion.coolant,
                from: curve.from(),
                to: curve.to(),
                direction: curve.tangent(half),
                length_mm: curve.length(),
                curvature_per_mm: curve.curvature(half).norm(),
                engaged,
            });
        }
    }

    fn push(&mut self, spot: &Spot) {
        self.now = spot.end_s;
        self.spots.push(*spot);
    }
}

/// Engagement of every spot with another job (larger stock, other tool), simulated as `map`; moves that are `unchanged` keep theirs.
pub fn engaged_otherwise(
    path: &Toolpath,
    map: &EngagementMap,
    job: &Job,
    timeline: &Timeline,
    wanted: Option<Sample>,
    unchanged: Option<&[Option<MoveId>]>,
) -> Vec<Engaged> {
    let forces = &mut Forces::new(map, job, wanted, None);
    let is_unchanged = |id: MoveId| unchanged.is_some_and(|of_move| of_move[id.ix()].is_some());
    let of = |spot: &Spot| match spot.move_id {
        Some(id) if is_unchanged(id) => spot.engaged,
        _ => engaged(path, spot, forces).unwrap_or_default().0,
    };
    timeline.spots.iter().map(of).collect()
}

/// Engagement of a spot, and its changes by runout; `None` where nothing is engaged.
fn engaged(path: &Toolpath, spot: &Spot, forces: &mut Forces) -> Option<(Engaged, Runouts)> {
    let id = spot.move_id?;
    let stations = forces.map.stations_of(id);
    let k = stations.partition_point(|s| s.to_mm < spot.middle_mm);
    let station = stations.get(k.min(stations.len().checked_sub(1)?))?;
    Some(forces.engaged(&path.moves[id.ix()], station, spot.direction.z, spot.speed_mm_s()))
}

impl Timeline {
    /// The same with changes by runout linearised about a known runout and known coefficients.
    pub(in crate::learn) fn with_runouts(
        &self,
        path: &Toolpath,
        map: &EngagementMap,
        job: &Job,
        wanted: Sample,
        about: About,
    ) -> Self {
        let forces = &mut Forces::new(map, job, Some(wanted), Some(about));
        let of = |spot: &Spot| engaged(path, spot, forces).unwrap_or_default().1;
        let runouts = self.spots.iter().map(of).collect();
        Timeline { spots: self.spots.clone(), runouts }
    }
}
