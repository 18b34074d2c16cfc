//! How much of its limit each commanded feed uses, for the notes in the program. In: a run and its feeds. Out: every
//! piece knows the largest ratio of the load that bounds it to its limit; nothing where no load does.

use rayon::prelude::*;

use crate::engage::Station;
use crate::outcome::ProgramRun;
use crate::outcome::over_limits::load_limits;
use crate::schedule::FeedPiece;
use crate::schedule::cutters::Cutters;
use crate::schedule::rules::rules;

/// Puts the ratio of load to limit into each piece.
pub fn tell(run: &ProgramRun, pieces: &mut [FeedPiece]) {
    let cutters = Cutters::new(&run.toolpath, &run.map, &run.job, pieces);
    let rules = rules(&run.toolpath, &run.map, &run.job);
    let of_piece = |piece: &FeedPiece| {
        let motion = &run.toolpath.moves[piece.move_id.ix()];
        let mut limits = load_limits(&rules.of(piece.move_id).loads, &run.job, motion.spin.rps);
        let limit = limits.find(|limit| limit.kind == piece.limit)?.limit;
        let cutter = cutters.of(piece.move_id)?;
        let inside = |station: &&Station| {
            station.from_mm < piece.to_mm && station.to_mm > piece.from_mm && station.arc_count > 0
        };
        let load = |station: &Station| {
            cutter.line(&cutters.cut(&run.map, motion, station)).loads(piece.feed_mm_s).bounded_by(piece.limit)
        };
        let loads = run.map.stations_of(piece.move_id).iter().filter(inside).filter_map(load);
        loads.reduce(f64::max).map(|load| load / limit)
    };
    let used: Vec<Option<f64>> = pieces.par_iter().map(of_piece).collect();
    pieces.iter_mut().zip(used).for_each(|(piece, used)| piece.used = used);
}
