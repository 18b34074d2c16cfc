//! The check of the written file: it is read back, proved to differ in feeds only, and simulated again at a finer spacing wherever that can
//! matter. In: the run so far and the written text. Out: the largest ratio of a load to its limit at the commanded feeds, and the places
//! where it is above [`LIMIT_TOLERANCE`](crate::outcome::LIMIT_TOLERANCE), with the cap they should have had.
//!
//! ```text
//! read back → what is known of its engagement (known) → loads over limits (ratios) → what to simulate again (closer)
//!                        ▲                                                                   │
//!                        └────────────────────────── at the finer spacing ◂──────────────────┘
//! ```
//! If stations whose engagement is known already exceed a limit and need a lower cap, the check ends there, before anything is simulated. The
//! proof is made only for a file that meets the limits.
//!
//! Where blocks depend on the block-delete switch, all this is done for both of its positions.
//!
//! Places that are infeasible, frozen or were kept by the rewriting do not tighten any cap, because their feed cannot be chosen. Their loads
//! count nevertheless in the report ([`over`]).

use super::block_delete;
use super::origins::{Origin, feeds, follow};
use super::problem::{engagement, environment};
use super::ratios::Ratios;
use super::simulated_again::to_simulate_again;
use super::task::{JobError, SPACING_MM, Watch};
use super::tighten::{Breach, asks_for_lower_cap};
use super::written_engagement::{Side, StationsFrom, WrittenEngagement};
use crate::engage::EngagementMap;
use crate::ids::BlockId;
use crate::nc::{Environment, Toolpath};
use crate::outcome::answers::Stressed;
use crate::outcome::over_limits::Over;
use crate::outcome::{Check, ProgramRun, Switched};
use crate::rewrite::{Rewritten, verify};
use crate::schedule::FeedPiece;
use crate::schedule::history;
use crate::schedule::known_loads::KnownLoads;
use crate::schedule::stress::cases;

/// The result of the check.
pub struct CheckedFile {
    /// Numbers for the report.
    pub check: Check,
    /// Written feeds on the original's moves.
    pub after: Vec<FeedPiece>,
    /// Loads above their limits.
    pub breaches: Vec<Breach>,
    /// Blocks of the original in which the proof found a difference.
    pub doubtful: Vec<BlockId>,
}

impl CheckedFile {
    /// Are all limits met, and does the proof hold?
    pub fn is_good(&self) -> bool {
        self.breaches.is_empty() && self.doubtful.is_empty()
    }
}

/// Loads of the written program in one position of the switch.
struct Rated {
    after: Vec<FeedPiece>,
    force_rate: Option<f64>,
    breaches: Vec<Breach>,
}

/// Reads the file back and simulates what `known` does not give yet, with the block-delete switch off and, where blocks depend on it, on. Makes
/// the proof if the file meets the limits, or this is the `last` round.
pub fn check(
    run: &ProgramRun,
    rewritten: &Rewritten,
    watch: &Watch,
    known: &mut [Option<WrittenEngagement>; 2],
    last: bool,
) -> Result<CheckedFile, JobError> {
    let environment = environment(&run.job, watch);
    let reread = |environment: &Environment| crate::nc::interpret(&rewritten.read(&run.program), environment);
    let kept: Vec<BlockId> = rewritten.kept.iter().map(|(block, _)| *block).collect();
    let [off, on] = known;
    let mut sides = vec![rated(&Side::off(run), &kept, reread(&environment), watch, off, last)?];
    if let (Some(switched), [Some(_)]) = (&run.switched, &sides[..]) {
        let written = reread(&Environment { block_delete: true, ..environment.clone() });
        let rated = rated(&Side::on(switched, &run.job), &kept, written, watch, on, last)?;
        sides.push(rated.map(|rated| on_off(rated, run, switched)));
    }
    let again =
        |known: &WrittenEngagement| known.stations_from.iter().filter(|met| **met == StationsFrom::Finer).count();
    let simulated_again = [&*off, &*on].into_iter().flatten().map(again).sum();
    let mut check = Check { spacing_mm: SPACING_MM[1], simulated_again, ..Check::default() };
    let (mut after, mut breaches) = (None, Vec::new());
    for rated in sides.iter_mut().flatten() {
        check.force_rate_ratio = [check.force_rate_ratio, rated.force_rate].into_iter().flatten().reduce(f64::max);
        after = after.or_else(|| Some(std::mem::take(&mut rated.after)));
        breaches.append(&mut rated.breaches);
    }
    let strays = sides.iter().any(Option::is_none);
    let proof = (breaches.is_empty() || strays || last)
        .then(|| verify(&run.program, &rewritten.read(&run.program), &environment));
    let differences = || proof.iter().flat_map(|proof| &proof.differences);
    let doubtful = differences().filter_map(|difference| difference.block).collect();
    check.differences = differences().map(ToString::to_string).collect();
    check.differences.extend(strays.then(|| "the written path does not run along the original".into()));
    check.identical = proof.is_some() && check.differences.is_empty();
    Ok(CheckedFile { check, after: after.unwrap_or_else(|| run.before.clone()), breaches, doubtful })
}

/// Breaches found with the switch on, on the moves of the program with it off.
fn on_off(rated: Rated, run: &ProgramRun, switched: &Switched) -> Rated {
    let ids = block_delete::moves_off(&run.toolpath, &switched.toolpath);
    let place = |breach: &Breach| Some(Origin { move_id: ids[breach.origin.move_id.ix()]?, ..breach.origin });
    let breaches = rated.breaches.iter().filter_map(|b| Some(Breach { origin: place(b)?, ..*b })).collect();
    Rated { breaches, ..rated }
}

/// Loads of the written program in one position of the switch; `None` if its path is not that of the original. In the `last` round everything
/// is simulated that is not known.
fn rated(
    side: &Side,
    kept: &[BlockId],
    mut written: Toolpath,
    watch: &Watch,
    known: &mut Option<WrittenEngagement>,
    last: bool,
) -> Result<Option<Rated>, JobError> {
    super::remarks::freeze_tools(&mut written, side.job);
    let Some(origins) = follow(side.toolpath, &written) else { return Ok(None) };
    let mut now = match known.take() {
        Some(known) => known.on_with(written, origins),
        None => WrittenEngagement::whole(side, written, origins),
    };
    let after = feeds(&now.written, &now.origins);
    let mut found = rate(&mut now, side, &after, kept);
    // Loads that depend on earlier cuts need all of these.
    let tells = !(last || now.stations_from.contains(&StationsFrom::NotYet) && history::is_asked_for(side.job));
    if !(tells && found.breaches.iter().any(|breach| asks_for_lower_cap(side.problem, breach)))
        && found.to_simulate_again.contains(&true)
    {
        now.see(side, &found.to_simulate_again, watch)?;
        found = rate(&mut now, side, &after, kept);
    }
    let Round { breaches, force_rate, .. } = found;
    *known = Some(now);
    Ok(Some(Rated { after, force_rate, breaches }))
}

/// Loads over limits at the stations that are known.
struct Round {
    force_rate: Option<f64>,
    breaches: Vec<Breach>,
    /// The moves that are to be simulated again.
    to_simulate_again: Vec<bool>,
}

/// Loads over limits at the stations that are known, at the feeds of the file.
fn rate(now: &mut WrittenEngagement, side: &Side, after: &[FeedPiece], kept: &[BlockId]) -> Round {
    let mut carried = std::mem::take(&mut now.carried);
    let ratios = Ratios::new(side, now, &now.map, side.job, (after, 1.0), kept);
    ratios.work_out(&mut carried);
    let mut breaches = ratios.breaches(&carried);
    let force_rate = ratios.force_rate(&mut breaches);
    let to_simulate_again = to_simulate_again(now, &ratios, &carried);
    now.carried = carried;
    Round { force_rate, breaches, to_simulate_again }
}

/// Loads over limits of everything that cuts in the written program, in both positions of the switch.
pub fn over(run: &ProgramRun, rewritten: &Rewritten, known: &[Option<WrittenEngagement>; 2]) -> Over {
    let kept: Vec<BlockId> = rewritten.kept.iter().map(|(block, _)| *block).collect();
    let on = run.switched.as_ref().map(|switched| Side::on(switched, &run.job));
    let mut found = Over::default();
    for (side, known) in [Some(Side::off(run)), on].iter().zip(known) {
        let (Some(side), Some(known)) = (side, known) else { continue };
        let after = feeds(&known.written, &known.origins);
        found.join(Ratios::new(side, known, &known.map, side.job, (&after, 1.0), &kept).tally(&known.carried));
    }
    found
}

/// The written program under each variation of what was assumed.
pub fn stressed(run: &ProgramRun, known: &WrittenEngagement, watch: &Watch) -> Vec<Stressed> {
    let after = feeds(&known.written, &known.origins);
    let kept = run.written.iter().flat_map(|written| &written.kept);
    let kept: Vec<BlockId> = kept.map(|(block, _)| *block).collect();
    let side = Side::off(run);
    cases(&run.job)
        .into_iter()
        .map(|case| {
            let same = case.job.stocks == run.job.stocks;
            let map = (!same).then(|| engagement(&known.written, &case.job, watch, "stress", SPACING_MM[1]));
            let ratios = |map: &EngagementMap| {
                let feeds = (&after[..], case.override_factor);
                let (ratios, mut carried) =
                    (Ratios::new(&side, known, map, &case.job, feeds, &kept), KnownLoads::default());
                ratios.work_out(&mut carried);
                ratios.tally(&carried)
            };
            let found = match &map {
                None => Some(ratios(&known.map)),
                Some(map) => map.as_ref().ok().map(ratios),
            };
            let (worst_ratio, p99_ratio) =
                found.map_or((None, None), |found| (Some(found.ratio()), Some(found.p99_ratio)));
            Stressed { case: case.name, worst_ratio, p99_ratio }
        })
        .collect()
}
