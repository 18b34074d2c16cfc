//! Simulation of both programs as one. In: the semi-finish, original or with offsets; the finish. Out: for each stretch
//! of the finishing path its loads, and the stock of the semi-finish that it meets.

use super::centres::Centres;
use super::knots::Knots;
use super::linked::linked;
use super::met_stock::{MetStock, Sample, SemiSurface, ToolPlace, met};
use super::task::{SemifinishError, Task};
use crate::engage::workpiece::shift;
use crate::engage::{Again, EngagementMap, Station};
use crate::force::Loads;
use crate::ids::MoveId;
use crate::machine::{Job, Shape, Tool};
use crate::nc::{Move, MoveKind, Toolpath};
use crate::path::{Curve, Vec3};
use crate::schedule::as_programmed;
use crate::schedule::cutters::Cutters;
use rayon::prelude::*;

/// Longest stretch of the finishing path with one force, mm.
const STRETCH_MM: f64 = 2.0;

/// Both programs with their tools and knots; the same in all rounds.
pub(super) struct Programs<'a> {
    pub task: &'a Task<'a>,
    pub semi_tool: &'a Tool,
    pub finish_tool: &'a Tool,
    pub knots: Knots,
}

/// A simulation of both programs.
pub(super) struct Simulated {
    pub map: EngagementMap,
    pub toolpath: Toolpath,
    pub first: usize,
    made_of: Vec<(u32, [f64; 2])>,
}

impl<'a> Programs<'a> {
    pub(super) fn new(task: &'a Task<'a>) -> Result<Self, SemifinishError> {
        let semi_tool = ball("semi-finishing", task.semi, task.job)?;
        let finish_tool = ball("finishing", task.finish, task.job)?;
        let movable: Vec<bool> = task
            .semi
            .moves
            .iter()
            .zip(task.movable)
            .map(|(motion, movable)| *movable && motion.tool == semi_tool.number && motion.kind == MoveKind::Feed)
            .collect();
        Ok(Self { task, semi_tool, finish_tool, knots: Knots::new(task.semi, &movable) })
    }

    /// Simulates both with these offsets of the knots. The engagement of the semi-finish itself is computed once: with
    /// `base`, the simulation of the original programs, its stations are reused and it only removes stock.
    pub(super) fn simulated(&self, offsets: &[Vec3], base: Option<&Simulated>) -> Result<Simulated, SemifinishError> {
        let (semi, made_of) = self.moved(offsets);
        let both = linked(semi, self.task.finish);
        let mut of_move: Vec<Option<MoveId>> = made_of.iter().map(|(of, _)| Some(MoveId(*of))).collect();
        of_move.resize(both.toolpath.moves.len(), None);
        let again = base.map(|base| Again { known: &base.map, of_move: &of_move });
        let map = (self.task.simulate)(&both.toolpath, again)?;
        Ok(Simulated { map, toolpath: both.toolpath, first: both.first, made_of })
    }

    /// The semi-finish with offsets; for each of its moves the original move and the part of it, mm.
    fn moved(&self, offsets: &[Vec3]) -> (Toolpath, Vec<(u32, [f64; 2])>) {
        let semi = self.task.semi;
        let (mut moves, mut made_of, mut first) = (Vec::with_capacity(semi.moves.len()), Vec::new(), Vec::new());
        for (index, motion) in semi.moves.iter().enumerate() {
            first.push(moves.len() as u32);
            let curve = motion.curve();
            let curves = self.knots.moved(&curve, index, offsets, self.task.wanted.tolerance_mm);
            for (curve, part) in curves {
                let mut moved: Move = motion.clone();
                moved.set_curve(curve);
                moves.push(moved);
                made_of.push((index as u32, part));
            }
        }
        first.push(moves.len() as u32);
        let new = |id: MoveId| MoveId(first[id.ix().min(semi.moves.len())]);
        let mut path = semi.clone();
        path.moves = moves;
        path.between.iter_mut().for_each(|(id, _)| *id = new(*id));
        path.shifts.iter_mut().for_each(|(id, _)| *id = new(*id));
        for doubted in &mut path.doubts {
            (doubted.from, doubted.until) = (new(doubted.from), doubted.until.map(new));
        }
        (path, made_of)
    }

    /// The stretches of the finishing path that cut.
    pub(super) fn samples(&self, simulated: &Simulated) -> Vec<Sample> {
        let mut samples: Vec<Sample> = Vec::new();
        // Path since the tool was last in air, mm, and the first sample of the current cut.
        let (mut way, mut begin) = (0.0, 0);
        let contact_mm = self.contact_mm();
        let close = |samples: &mut [Sample]| {
            let mut left = 0.0;
            for sample in samples.iter_mut().rev() {
                sample.edge |= left + 0.5 * sample.length_mm < contact_mm;
                left += sample.length_mm;
            }
        };
        for (index, motion) in self.task.finish.moves.iter().enumerate() {
            if motion.tool != self.finish_tool.number || motion.kind == MoveKind::Rapid {
                close(&mut samples[begin..]);
                (way, begin) = (0.0, samples.len());
                continue;
            }
            for station in simulated.stations(index as u32) {
                if station.arc_count == 0 {
                    close(&mut samples[begin..]);
                    (way, begin) = (0.0, samples.len());
                    continue;
                }
                let parts = (station.length_mm() / STRETCH_MM).ceil().max(1.0);
                let length_mm = station.length_mm() / parts;
                for part in 0..parts as usize {
                    let s_mm = station.from_mm + (part as f64 + 0.5) * length_mm;
                    let edge = way + 0.5 * length_mm < contact_mm;
                    samples.push(Sample { of: index as u32, s_mm, length_mm, edge });
                    way += length_mm;
                }
            }
        }
        close(&mut samples[begin..]);
        samples
    }

    /// Length of the feed moves of the finish with its ball, mm.
    pub(super) fn finish_length_mm(&self) -> f64 {
        let cuts = |motion: &&Move| motion.kind == MoveKind::Feed && motion.tool == self.finish_tool.number;
        self.task.finish.moves.iter().filter(cuts).map(|motion| motion.curve().length()).sum()
    }

    /// Largest distance of the contact from the middle of the ball, mm: half the chord cut off by the largest stock.
    fn contact_mm(&self) -> f64 {
        let (radius, most) = (self.finish_tool.radius_mm(), self.task.wanted.stock_mm[1]);
        (radius * radius - (radius - most.min(radius)).powi(2)).sqrt()
    }

    /// Loads of the samples; 0 where nothing is cut.
    pub(super) fn loads(simulated: &Simulated, job: &Job, samples: &[Sample]) -> Vec<Loads> {
        let cutters = Cutters::new(&simulated.toolpath, &simulated.map, job, &as_programmed(&simulated.toolpath));
        let of = |sample: &Sample| {
            let id = MoveId(simulated.first as u32 + sample.of);
            let motion = &simulated.toolpath.moves[id.ix()];
            let station = simulated.station(sample).filter(|station| station.arc_count > 0);
            let cutter = cutters.of(id).filter(|_| motion.feed.mm_s > 0.0);
            let both = station.zip(cutter);
            both.map(|(station, cutter)| cutter.loads(&cutters.cut(&simulated.map, motion, station), motion.feed.mm_s))
                .unwrap_or_default()
        };
        samples.par_iter().map(of).collect()
    }

    /// Can forces of the finish be predicted?
    pub(super) fn has_force(&self, simulated: &Simulated, samples: &[Sample]) -> bool {
        let cutters =
            Cutters::new(&simulated.toolpath, &simulated.map, self.task.job, &as_programmed(&simulated.toolpath));
        samples.iter().any(|sample| cutters.of(MoveId(simulated.first as u32 + sample.of)).is_some())
    }

    /// The stock that the samples meet.
    pub(super) fn met(&self, simulated: &Simulated, samples: &[Sample]) -> Vec<MetStock> {
        let tool = self.semi_tool;
        let semi = &simulated.toolpath.moves[..simulated.first];
        let centres = self.semi_centres(simulated);
        let lengths_mm: Vec<f64> = semi.iter().map(|motion| motion.curve().length()).collect();
        let left = SemiSurface {
            centres: &centres,
            radius_mm: tool.radius_mm(),
            made_of: &simulated.made_of,
            lengths_mm: &lengths_mm,
            knots: &self.knots,
        };
        let tool_places = self.tool_places(simulated, samples);
        let stations: Vec<Option<(&Station, ToolPlace)>> = samples
            .iter()
            .zip(tool_places)
            .map(|(sample, stand)| {
                simulated.station(sample).filter(|station| station.arc_count > 0).map(|s| (s, stand))
            })
            .collect();
        met(
            &stations,
            &simulated.map,
            simulated.map.slices_of(self.finish_tool.number),
            self.finish_tool.radius_mm(),
            &left,
        )
    }

    /// Tip and heading at the samples; a vertical move has the heading of the one before.
    pub(super) fn tool_places(&self, simulated: &Simulated, samples: &[Sample]) -> Vec<ToolPlace> {
        let mut dir = [1.0, 0.0];
        let stand = |sample: &Sample| {
            let motion = &simulated.toolpath.moves[simulated.first + sample.of as usize];
            let curve = motion.curve();
            let along = curve.tangent(sample.s_mm);
            let level = along.x.hypot(along.y);
            if level > 1e-9 {
                dir = [along.x / level, along.y / level];
            }
            ToolPlace { tip: curve.point(sample.s_mm) + shift(self.task.job, &simulated.toolpath, motion.wcs), dir }
        };
        samples.iter().map(stand).collect()
    }

    /// The path of the centre of the semi-finishing ball.
    pub(super) fn semi_centres(&self, simulated: &Simulated) -> Centres {
        let toolpath = &simulated.toolpath;
        centres(self.task.job, toolpath, &toolpath.moves[..simulated.first], self.semi_tool)
    }

    /// The path of the centre of the finishing ball.
    pub(super) fn finish_centres(&self, toolpath: &Toolpath) -> Centres {
        centres(self.task.job, toolpath, &self.task.finish.moves, self.finish_tool)
    }
}

/// The path of the centre of a ball over these moves, numbered from 0, in the common frame; `toolpath` has their work
/// offsets.
pub(super) fn centres(job: &Job, toolpath: &Toolpath, moves: &[Move], tool: &Tool) -> Centres {
    let cuts = |motion: &Move| motion.kind == MoveKind::Feed && motion.tool == tool.number;
    let curves = moves
        .iter()
        .enumerate()
        .filter(|(_, motion)| cuts(motion))
        .map(|(index, motion)| (index as u32, shifted(&motion.curve(), shift(job, toolpath, motion.wcs))));
    Centres::new(curves, tool.radius_mm())
}

impl Simulated {
    /// Stations of a move of the finish.
    fn stations(&self, of: u32) -> &[Station] {
        self.map.stations_of(MoveId(self.first as u32 + of))
    }
    /// The station of a sample.
    pub(super) fn station(&self, sample: &Sample) -> Option<&Station> {
        let stations = self.stations(sample.of);
        stations.get(stations.partition_point(|station| station.to_mm < sample.s_mm))
    }
    /// Length on which the finish cuts, mm.
    pub(super) fn cut_mm(&self) -> f64 {
        let stations = self.map.stations.iter().filter(|s| s.move_id.ix() >= self.first && s.arc_count > 0);
        // From +0, as the sum of none is −0.
        stations.fold(0.0, |sum, station| sum + station.length_mm())
    }
}

pub(super) fn shifted(curve: &Curve, by: Vec3) -> Curve {
    match curve {
        Curve::Line { from, to } => Curve::Line { from: from + by, to: to + by },
        Curve::Arc(arc) => {
            let mut arc = *arc;
            (arc.from, arc.to, arc.centre) = (arc.from + by, arc.to + by, arc.centre + by);
            Curve::Arc(arc)
        }
    }
}

/// The one ball end mill that a program cuts with.
pub(super) fn ball<'a>(which: &'static str, path: &Toolpath, job: &'a Job) -> Result<&'a Tool, SemifinishError> {
    let mut used: Vec<u32> =
        path.moves.iter().filter(|motion| motion.kind == MoveKind::Feed).map(|motion| motion.tool).collect();
    used.sort_unstable();
    used.dedup();
    let tools: Vec<&Tool> = used.iter().filter_map(|number| job.tool(*number)).collect();
    let balls: Vec<&Tool> = tools.iter().copied().filter(|tool| tool.shape == Shape::Ball).collect();
    match balls[..] {
        [one] => Ok(one),
        [one, two, ..] => Err(SemifinishError::TwoBalls { which, tools: [one.number, two.number] }),
        [] => {
            let names: Vec<String> = used.iter().map(|number| format!("T{number}")).collect();
            let found = if names.is_empty() { "it has no feed move".into() } else { names.join(", ") };
            Err(SemifinishError::NoBall { which, found })
        }
    }
}
