//! One tool in a run, for the regulation of its life. In: a [`ProgramRun`] over a program with marks of check points. Out: the check points with
//! their places, predicted loads and lengths cut; the load at a check point as a function of wear; the job with a tool of given wear.

use crate::effects::wear;
use crate::engage::Station;
use crate::machine::{Job, LifeShare, Wear};
use crate::outcome::ProgramRun;
use crate::path::Vec3;
use crate::rewrite;
use crate::schedule::cutters::Cutters;
use crate::schedule::history::History;
use crate::schedule::realise::pieces_of_moves;
use crate::toollife::check_points::{self, Cycle};
use crate::toollife::exponent::{Lengths, POWERS};
use std::cell::OnceCell;

/// The load that is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoadKind {
    /// Peak resultant in the plane, N.
    ForcePeak,
    /// Magnitude of the mean force in the plane, N.
    ForceMean,
    /// Power at the motor shaft, W.
    Power,
}

impl LoadKind {
    /// Unit.
    pub fn unit(self) -> &'static str {
        if self == LoadKind::Power { "W" } else { "N" }
    }
}

/// A cut of a check point in a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CheckCut {
    /// Number of its check point.
    pub number: u32,
    /// Number among the cuts of that.
    pub cycle: u32,
    /// Where it is read.
    pub place: Cycle,
    /// Line of its mark in the program that was run: the first that moves behind it.
    pub line: u32,
    /// Middle of the reading, mm.
    pub position: Vec3,
    /// Feed there, mm/s.
    pub feed_mm_s: f64,
    /// Spindle speed, rev/s.
    pub rps: f64,
    /// Length cut when the tool is there, from the beginning of the program; and at the reference feed. m.
    pub cut_m: f64,
    /// At the reference feed, m.
    pub wear_m: f64,
    /// Station there.
    station: usize,
}

/// A run seen from one tool.
pub struct ToolRun<'a> {
    run: &'a ProgramRun,
    cutters: Cutters,
    history: History,
    tool: u32,
    powers: OnceCell<[History; 4]>,
}

impl<'a> ToolRun<'a> {
    /// At the feeds after.
    pub fn new(run: &'a ProgramRun, tool: u32) -> Self {
        let history = History::of(&run.toolpath, &run.map, &run.job, run.after());
        let cutters = Cutters::after(&run.toolpath, &run.map, &run.job, &history);
        Self { run, cutters, history, tool, powers: OnceCell::new() }
    }

    /// The run.
    pub fn run(&self) -> &ProgramRun {
        self.run
    }

    /// Length cut in the program, and at the reference feed, m.
    pub fn cut_m(&self) -> [f64; 2] {
        self.history.cut_by(self.tool).map(|mm| 1e-3 * mm)
    }

    /// Length cut when the tool is at a cut, at the end of the program without one, were the exponent each of [`POWERS`].
    pub fn lengths(&self, cut: Option<&CheckCut>) -> Lengths {
        let histories = self.powers.get_or_init(|| POWERS.map(|power| self.with_power(power)));
        let mm = |history: &History| cut.map_or_else(|| history.cut_by(self.tool), |cut| history.cut_mm(cut.station));
        Lengths([0, 1, 2, 3].map(|k| 1e-3 * mm(&histories[k])[1]))
    }

    /// What lies behind each station were this the exponent.
    fn with_power(&self, power: f64) -> History {
        let mut job = self.run.job.clone();
        if let Some(mut wear) = job.tool(self.tool).and_then(|tool| wear::of_tool(&job, tool)) {
            wear.law.rate.exponent = power;
            with_wear(&mut job, self.tool, wear, None);
        }
        History::of(&self.run.toolpath, &self.run.map, &job, self.run.after())
    }

    /// The cuts at the marks of the program.
    pub fn checks(&self) -> Vec<CheckCut> {
        let ProgramRun { program, toolpath, map, job, .. } = self.run;
        let marks = rewrite::checks(program);
        let steady = check_points::steady(toolpath, map, job, self.run.after(), self.tool);
        let block = |place: &Cycle| toolpath.moves[place.move_id.ix()].block;
        // A block may be cut in pieces, of which the first may be no steady cut: the next one that is, before the next mark.
        let of_mark = |(index, mark): (usize, &rewrite::CheckMark)| {
            let next = marks.get(index + 1).map_or(u32::MAX, |next| next.block.0);
            let place = steady.iter().find(|place| (mark.block.0..next).contains(&block(place).0))?;
            let cut = self.cut(mark.number, mark.cycle, *place)?;
            Some(CheckCut { line: program.place(mark.block).0, ..cut })
        };
        marks.iter().enumerate().filter_map(of_mark).collect()
    }

    /// A cut of a check point at a place.
    pub fn cut(&self, number: u32, cycle: u32, place: Cycle) -> Option<CheckCut> {
        let ProgramRun { toolpath, map, .. } = self.run;
        let motion = &toolpath.moves[place.move_id.ix()];
        let middle_mm = 0.5 * (place.read_mm[0] + place.read_mm[1]);
        let range = &map.of_move[place.move_id.ix()];
        let before = map.stations_of(place.move_id).partition_point(|station| station.to_mm < middle_mm);
        let station = range.start as usize + before;
        let feeds = self.run.after();
        let pieces = &pieces_of_moves(feeds, toolpath.moves.len())[place.move_id.ix()];
        let here = feeds[pieces.start as usize..pieces.end as usize].iter().find(|piece| piece.to_mm >= middle_mm)?;
        let [cut_mm, wear_mm] = self.history.cut_mm(station);
        Some(CheckCut {
            number,
            cycle,
            place,
            line: motion.line,
            position: motion.curve().point(middle_mm),
            feed_mm_s: here.feed_mm_s,
            rps: motion.spin.rps,
            cut_m: 1e-3 * cut_mm,
            wear_m: 1e-3 * wear_mm,
            station,
        })
    }

    /// Load at a cut with an edge whose index has risen by `worn` times that of a fresh one; `None`: as it is predicted.
    pub fn load(&self, cut: &CheckCut, kind: LoadKind, worn: Option<f64>) -> f64 {
        self.load_at(cut, kind, worn, cut.feed_mm_s)
    }

    /// The same at another feed, mm/s.
    pub fn load_at(&self, cut: &CheckCut, kind: LoadKind, worn: Option<f64>, feed_mm_s: f64) -> f64 {
        let ProgramRun { toolpath, map, .. } = self.run;
        let motion = &toolpath.moves[cut.place.move_id.ix()];
        let station: &Station = &map.stations[cut.station];
        let Some(cutter) = self.cutters.of(cut.place.move_id) else { return f64::NAN };
        let mut met = self.cutters.cut(map, motion, station);
        met.state.worn = worn.unwrap_or(met.state.worn);
        let loads = cutter.loads(&met, feed_mm_s);
        match kind {
            LoadKind::ForcePeak => loads.force_xy_peak_n,
            LoadKind::ForceMean => loads.force_xy_mean_n,
            LoadKind::Power => loads.power_w,
        }
    }
}

/// The job with this tool as worn as it is, its rate as it is known now, and a budget for the program.
pub fn with_wear(job: &mut Job, tool: u32, wear: Wear, share: Option<f64>) {
    if let Some(tool) = job.tools.iter_mut().find(|known| known.number == tool) {
        tool.wear = Some(wear.into());
    }
    job.life = share.map(|share| LifeShare { tool: Some(tool), share }).into_iter().collect();
}
