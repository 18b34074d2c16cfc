//! `semifinish`: both programs read, the semi-finish moved, written, read back and simulated with the finish again. In: two
//! programs and the job. Out: the moved program, with its warnings.

use crate::diag::Diagnostic;
use crate::engage::{self, EngageError, EngagementMap, Event, EventKind};
use crate::finish::semifinish::{self, Answer, Gouge, Sample, SemifinishError, Wanted, Written, proof, write};
use crate::job::{JobError, Watch, environment, learned, remarks};
use crate::machine::Job;
use crate::nc::{self, Program, Toolpath};
use crate::rewrite;
use crate::setup::Assumption;
use crate::stock::Piece;

/// Spacing of the stations, mm: stock varies along the path, so it is finer than that of `optimize`.
const SPACING_MM: f64 = 0.5;

/// Why nothing is written.
#[derive(Debug, thiserror::Error)]
pub enum MoveError {
    /// A program cannot be used.
    #[error("{error}")]
    Job {
        /// Why.
        error: JobError,
        /// Which: the semi-finish or the finish.
        of: Which,
    },
    /// Nothing can be offset.
    #[error(transparent)]
    Finish(#[from] SemifinishError),
}

/// One of the two programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// The semi-finish.
    Semi,
    /// The finish.
    Finish,
}

/// Two programs with their setup.
pub struct Pair {
    /// The semi-finish.
    pub semi: Program,
    /// The finish.
    pub finish: Program,
    /// The job.
    pub job: Job,
    /// What the setup assumes.
    pub assumptions: Vec<Assumption>,
    /// What is asked for.
    pub wanted: Wanted,
}

/// A moved semi-finish.
pub struct Shifted {
    /// The job with what was learned.
    pub job: Job,
    /// What is assumed.
    pub assumptions: Vec<Assumption>,
    /// What was asked for, with the reference of the setup where none was given.
    pub wanted: Wanted,
    /// Where the reference comes from.
    pub reference_source: &'static str,
    /// Motions of both programs as they came.
    pub paths: [Toolpath; 2],
    /// The offsets, and what they lead to.
    pub answer: Answer,
    /// The text.
    pub moved: write::Moved,
    /// The text read back and simulated with the finish.
    pub again: Written,
    /// Whether it cuts below what the finish leaves.
    pub gouge: Gouge,
    /// What was said while reading.
    pub diagnostics: Vec<Diagnostic>,
    /// What this command warns of.
    pub warnings: Vec<String>,
    /// Why the moved program must not be written, and the remedy.
    pub refused: Option<[String; 2]>,
}

/// Moves the semi-finish.
pub fn semifinish(pair: Pair, watch: &Watch) -> Result<Shifted, MoveError> {
    let Pair { semi, finish, mut job, mut assumptions, wanted } = pair;
    assumptions.extend(learned::apply(&mut job));
    let mut diagnostics = Vec::new();
    let mut read = |program: &Program, of: Which, job: &mut Job| -> Result<Toolpath, MoveError> {
        let unit = remarks::unit(program, &environment(job, watch), job);
        if let Some((told, said, _)) = unit {
            assumptions.push(told);
            diagnostics.push(said);
        }
        let mut path = nc::interpret(program, &environment(job, watch));
        if path.moves.is_empty() {
            return Err(MoveError::Job { error: JobError::NoMotion, of });
        }
        assumptions.extend(remarks::tool_assumption(&path, job));
        let unknown = remarks::unknown_tools(&path, job);
        if !unknown.is_empty() {
            return Err(MoveError::Job { error: JobError::UnknownTools(unknown), of });
        }
        remarks::freeze_tools(&mut path, job);
        rewrite::freeze(program, &mut path, job);
        diagnostics.append(&mut path.diagnostics);
        Ok(path)
    };
    if !write::is_written(&semi) {
        return Err(SemifinishError::Dialect { name: semi.dialect().name() }.into());
    }
    let semi_path = read(&semi, Which::Semi, &mut job)?;
    let finish_path = read(&finish, Which::Finish, &mut job)?;
    let (wanted, reference_source) = referred(wanted, &finish_path, &job);
    let movable = write::movable(&semi, &semi_path);
    let simulate = |path: &Toolpath, again: Option<engage::Again>| -> Result<EngagementMap, EngageError> {
        let options = engage::Options { spacing_mm: SPACING_MM, ..watch.engage };
        let progress = |done| (watch.progress)("simulate", done);
        match again {
            Some(again) => engage::engage_again(path, &job, &options, again, &progress),
            None => engage::engage(path, &job, &options, &progress),
        }
    };
    let task = semifinish::Task {
        semi: &semi_path,
        finish: &finish_path,
        job: &job,
        movable: &movable,
        wanted,
        simulate: &simulate,
    };
    let answer = semifinish::solve(&task)?;
    let moved = write::write(&semi, &semi_path, &answer.knots, &answer.offsets, wanted.tolerance_mm);
    let back = nc::parse(moved.bytes.clone(), Some(semi.dialect()));
    let mut back_path = nc::interpret(&back, &environment(&job, watch));
    // How far moves went is said; that nothing else differs is proven here like with `--prove`.
    let came = nc::interpret(&semi, &environment(&job, watch));
    let proof = proof::prove([&semi, &back], [&came, &back_path], f64::INFINITY);
    remarks::freeze_tools(&mut back_path, &job);
    let still = vec![false; back_path.moves.len()];
    let samples: Vec<Sample> = answer.before.iter().map(|seen| seen.sample).collect();
    let written = semifinish::Task { semi: &back_path, movable: &still, ..task };
    let again = semifinish::written(&written, &samples)?;
    let left = left_by([&finish_path, &semi_path, &back_path], &job, watch)?;
    let gouge = semifinish::gouge(&task, left.each_ref().map(Vec::as_slice))?;
    let warnings = warnings(&answer, gouge);
    let refused = unproven(&proof).or_else(|| refused(&answer, &again, gouge));
    let paths = [semi_path, finish_path];
    Ok(Shifted {
        job,
        assumptions,
        wanted,
        reference_source,
        paths,
        answer,
        moved,
        again,
        gouge,
        diagnostics,
        warnings,
        refused,
    })
}

/// What each program leaves of the stock, all in the same cells: the finest of those that the programs have by themselves, which follow from their
/// tools.
fn left_by(paths: [&Toolpath; 3], job: &Job, watch: &Watch) -> Result<[Vec<Piece>; 3], SemifinishError> {
    let progress = |done| (watch.progress)("gouge check", done);
    let left = |path: &Toolpath, cell_mm: Option<f64>| {
        let options = engage::Options { cell_mm: cell_mm.or(watch.engage.cell_mm), ..watch.engage };
        engage::left_stock(path, job, &options, &progress)
    };
    let all = |cell_mm: Option<f64>| -> Result<[Vec<Piece>; 3], SemifinishError> {
        Ok([left(paths[0], cell_mm)?, left(paths[1], cell_mm)?, left(paths[2], cell_mm)?])
    };
    let found = all(None)?;
    let sizes = |pieces: &[Piece]| pieces.iter().map(|piece| piece.field.size).collect::<Vec<_>>();
    if found.iter().all(|pieces| sizes(pieces) == sizes(&found[0])) {
        return Ok(found);
    }
    let cells = found.iter().flatten().map(|piece| piece.field.cell[0].max(piece.field.cell[1]));
    all(Some(cells.fold(f64::INFINITY, f64::min)))
}

/// The reference: as given, else the limit that the setup sets for the finishing tool, else the mean as programmed.
fn referred(wanted: Wanted, finish: &Toolpath, job: &Job) -> (Wanted, &'static str) {
    if wanted.force_n.is_some() {
        return (wanted, "given");
    }
    let cuts = |motion: &&nc::Move| motion.kind == nc::MoveKind::Feed;
    let tool = finish.moves.iter().rfind(cuts).and_then(|motion| job.tool(motion.tool));
    let limit = tool.and_then(|tool| job.limits.overridden_by(&tool.limits).force_xy_n);
    let source =
        if limit.is_some() { "limits.force_xy of the setup" } else { "mean of the finishing force as programmed" };
    (Wanted { force_n: limit, ..wanted }, source)
}

/// A pick of the semi-finish coarser than that of the finish by this ratio is warned of; posts round it. The ripple of force over
/// the cusps is ±0.6 % where they are equal and ±2.5 % at twice.
const COARSER: f64 = 1.02;

fn warnings(answer: &Answer, gouge: Gouge) -> Vec<String> {
    let mut warnings = Vec::new();
    let coarser = |[semi, finish]: &[f64; 2]| *finish > 0.0 && *semi > COARSER * finish;
    if let Some([semi, finish]) = answer.picks_mm[0].zip(answer.picks_mm[1]).map(<[f64; 2]>::from).filter(coarser) {
        warnings.push(format!(
                "the passes of the semi-finish are {semi:.3} mm apart, those of the finish {finish:.3} mm: its cusps stay in the stock and make the force ripple; take the same pick for both"
        ));
    }
    if gouge.beside > 0 {
        warnings.push(format!(
            "beside the finished surface, at the first and last passes, the moved program reaches up to {:.3} mm deeper than both programs as they came ({} cells): see that nothing of the part stands there",
            gouge.beside_mm, gouge.beside
        ));
    }
    let [most, all] = answer.after.iter().fold([0.0, 0.0], |[off, all], seen| {
        let length = seen.sample.length_mm;
        [off + if seen.free || seen.sample.edge { 0.0 } else { length }, all + length]
    });
    if most > 0.01 * all {
        warnings.push(format!(
            "{most:.0} of {all:.0} mm of the finishing cut meet stock that this semi-finish did not leave, or that cannot be moved: the force there stays as it is"
        ));
    }
    warnings
}

/// What the proof of the moved program found.
fn unproven(proof: &proof::Proof) -> Option<[String; 2]> {
    let ([own, other], what) = proof.differences.first()?;
    Some([
        format!(
            "the moved program would differ in more than coordinates of cutting moves: line {own} → line {other}: {what}"
        ),
        "no program was written; post the semi-finish as plain moves, one in each block".into(),
    ])
}

/// Gouges, and collisions that were not there before.
fn refused(answer: &Answer, again: &Written, gouge: Gouge) -> Option<[String; 2]> {
    let help = "no program was written; give a larger least stock (--stock), or a lower --force-xy";
    if gouge.gouged > 0 {
        let [x, y] = gouge.at;
        let why = format!(
            "the moved program would cut {:.3} mm below what the finish leaves, at X{x:.2} Y{y:.2} and on {} of {} cells",
            gouge.deepest_mm, gouge.gouged, gouge.cells
        );
        return Some([why, help.into()]);
    }
    let count = |events: &[Event], kind: EventKind| events.iter().filter(|event| event.kind == kind).count();
    let worse = again.events.iter().find(|event| count(&again.events, event.kind) > count(&answer.events, event.kind));
    worse.map(|event| {
        let line = again.toolpath.moves[event.move_id.ix()].line;
        let why = format!(
            "the moved program would bring a collision that was not there before: {:?}, line {line}",
            event.kind
        );
        [why, help.into()]
    })
}
