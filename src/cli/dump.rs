//! `dump`. In: a program and the name of a stage. Out: the data after that stage, one record per line, tab-separated with a head line.

use clap::{Args, ValueEnum};
use std::io::{self, Write};
use std::path::PathBuf;

use super::error::CliError;
use super::input;
use super::options::Global;
use super::screen::{Screen, written};
use super::work::run;
use crate::job;
use crate::nc::{self, Environment, FeedMode, MoveKind, Program, Toolpath, interpret};
use crate::outcome::ProgramRun;
use crate::report::{self, Outcome};
use crate::units::{deg_from_rad, mm_min_from_mm_s, rpm_from_rps};

/// `dump`.
#[derive(Debug, Args)]
pub struct Dump {
    /// Which stage.
    pub stage: Stage,
    /// NC program; - is standard input.
    pub program: PathBuf,
    /// Setup file; without it PROGRAM.setup.toml beside the program.
    #[arg(long, value_name = "S.toml")]
    pub setup: Option<PathBuf>,
}

/// A stage of the pipeline.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Stage {
    /// Tokens with their bytes
    Tokens,
    /// Blocks
    Blocks,
    /// Motions with feed, tool and freeze
    Moves,
    /// Engaged arcs at every station
    Engagement,
    /// Loads at every station at the programmed feed
    Loads,
    /// Points of the machined walls with their error at the programmed feed
    Surface,
    /// What the schedule is asked
    Problem,
}

/// Prints one stage.
pub fn dump(command: &Dump, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let source = input::program(&command.program)?;
    let mut out = io::BufWriter::new(io::stdout().lock());
    match command.stage {
        Stage::Tokens | Stage::Blocks | Stage::Moves => {
            let setup = input::setup_if_any(command.setup.as_deref(), &source, global)?;
            let job = setup.as_ref().map(|setup| &setup.job);
            let program = input::parse(&source, global, job)?;
            written(match command.stage {
                Stage::Tokens => tokens(&program, &mut out),
                Stage::Blocks => blocks(&program, &mut out),
                _ => {
                    let environment = job.map(Environment::from_job).unwrap_or_default();
                    moves(&interpret(&program, &nc::unit::with_its_unit(&program, environment, job)), &mut out)
                }
            })?;
        }
        stage => {
            let done = run(source, command.setup.as_deref(), job::simulate, global, job::Wanted::default(), screen)?;
            written(match stage {
                Stage::Engagement => engagement(&done.run, &mut out),
                Stage::Surface => report::surface(&done.run, &mut out),
                Stage::Problem => problem(&done.run, &mut out),
                _ => report::csv(&done.run, &mut out),
            })?;
        }
    }
    written(out.flush())?;
    Ok(Outcome::Done)
}

fn tokens(program: &Program, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "line\tstart\tend\tkind\tbytes")?;
    for block in program.blocks() {
        for token in program.tokens(block) {
            let bytes = token.span.of(program.text()).escape_ascii();
            let (start, end) = (token.span.start, token.span.end);
            writeln!(out, "{}\t{start}\t{end}\t{:?}\t{bytes}", program.line(block), token.kind)?;
        }
    }
    Ok(())
}

fn blocks(program: &Program, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "line\tstart\tend\ttokens\tbytes")?;
    for block in program.blocks() {
        let span = program.span(block);
        let bytes = program.line_text(block).escape_ascii();
        writeln!(
            out,
            "{}\t{}\t{}\t{}\t{bytes}",
            program.line(block),
            span.start,
            span.end,
            program.tokens(block).count()
        )?;
    }
    Ok(())
}

fn moves(path: &Toolpath, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "line\tinstance\tkind\tx\ty\tz\tlength_mm\tfeed_mm_min\tmode\ttool\trpm\twcs\tsplittable\tfrozen")?;
    for motion in &path.moves {
        let to = motion.curve().to();
        let kind = if motion.kind == MoveKind::Rapid { "rapid" } else { "feed" };
        let mode = match motion.feed.mode {
            FeedMode::PerMinute => "G94",
            FeedMode::InverseTime => "G93",
            FeedMode::PerRev => "G95",
        };
        writeln!(
            out,
            "{}\t{}\t{kind}\t{:.6}\t{:.6}\t{:.6}\t{:.6}\t{:.3}\t{mode}\t{}\t{:.1}\t{}\t{}\t{}",
            motion.line,
            motion.instance,
            to.x,
            to.y,
            to.z,
            motion.curve().length(),
            mm_min_from_mm_s(motion.feed.mm_s),
            motion.tool,
            rpm_from_rps(motion.spin.rps),
            motion.wcs,
            motion.splittable,
            motion.freeze.map_or("", nc::Freeze::why)
        )?;
    }
    Ok(())
}

fn engagement(run: &ProgramRun, out: &mut dyn Write) -> io::Result<()> {
    writeln!(
        out,
        "line\tmotion\tfrom_mm\tto_mm\tremoval_area_mm2\taxial_depth_mm\tclear_air\tuncertain\tarcs (slice:entry-exit deg)"
    )?;
    for station in &run.map.stations {
        let motion = &run.toolpath.moves[station.move_id.ix()];
        let arc = |arc: &crate::engage::EngagedArc| {
            let (entry, exit) = (f64::from(arc.entry_rad), f64::from(arc.exit_rad));
            format!("{}:{:.2}-{:.2}", arc.slice, deg_from_rad(entry), deg_from_rad(exit))
        };
        let arcs: Vec<String> = run.map.arcs_of(station).iter().map(arc).collect();
        writeln!(
            out,
            "{}\t{}\t{:.4}\t{:.4}\t{:.5}\t{:.4}\t{}\t{}\t{}",
            motion.line,
            station.move_id.0,
            station.from_mm,
            station.to_mm,
            station.removal_area_mm2,
            station.axial_depth_mm,
            station.flags.clear_air,
            station.flags.uncertain,
            arcs.join(" ")
        )?;
    }
    Ok(())
}

fn problem(run: &ProgramRun, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "line\tmotion\tfrom_mm\tto_mm\tprogrammed\tcap\tcap_by\tfloor\tfloor_by\tcutting\tfree\tinfeasible")?;
    for node in &run.problem.nodes {
        let motion = &run.toolpath.moves[node.move_id.ix()];
        writeln!(
            out,
            "{}\t{}\t{:.4}\t{:.4}\t{:.2}\t{:.2}\t{}\t{:.2}\t{}\t{}\t{}\t{}",
            motion.line,
            node.move_id.0,
            node.from_mm,
            node.to_mm,
            mm_min_from_mm_s(node.programmed_mm_s),
            mm_min_from_mm_s(node.cap.feed_mm_s),
            node.cap.kind.name(),
            mm_min_from_mm_s(node.floor.feed_mm_s),
            node.floor.kind.name(),
            node.cutting,
            node.free,
            node.infeasible.map_or("", crate::machine::LimitKind::name)
        )?;
    }
    Ok(())
}
