//! `optimize` and `simulate`. In: a program with its setup. Out: the rewritten program, reports, and the exit code of the verdict.

use clap::Args;
use std::path::{Path, PathBuf};

use super::error::CliError;
use super::input::{self, Source};
use super::keep::StoredFiles;
use super::lacks_of_wear::lacks_of_wear;
use super::options::Global;
use super::output::{Kind, Output, Outputs};
use super::plain::plain;
use super::problem;
use super::screen::Screen;
use super::subprograms;
use super::work::{Done, Work, execute, inputs, peak_memory, run_keeping, task, wanted};
use crate::effects::wear;
use crate::job::{self, Wanted};
use crate::machine::{Job, LifeShare};
use crate::outcome::ProgramRun;
use crate::report::{self, Extras, HeldBack, Outcome, Relief, Verdict};

/// `optimize`.
#[derive(Debug, Args)]
pub struct Optimize {
    /// Program, setup and reports.
    #[command(flatten)]
    pub work: Work,
    /// More programs, each with the setup beside it or all with --setup: all are written, or none.
    #[arg(value_name = "PROGRAM")]
    pub more: Vec<PathBuf>,
    /// Folder in which the programs are written, as NAME.fw.EXT.
    #[arg(long, value_name = "DIR", conflicts_with = "output")]
    pub out_dir: Option<PathBuf>,
    /// Where the program goes; without it PROGRAM.fw.EXT beside the program; - is standard output. In another folder the files
    /// of its subprograms are written beside it, under their own names.
    #[arg(short, long, value_name = "OUT")]
    pub output: Option<PathBuf>,
    /// Unroll loops, calls and expressions into plain blocks, so that each pass gets its own feeds. What cannot be written as
    /// plain blocks (values only the control knows, modal macros) is refused with its place.
    #[arg(long)]
    pub expand: bool,
    /// Write the program even if limits cannot be met on more than a fifth of the cutting length.
    #[arg(long)]
    pub accept_infeasible: bool,
    /// Write the program even if it cuts at rapid, or shank, holder or a fixture are touched.
    #[arg(long)]
    pub accept_collisions: bool,
    /// Use at most this share of the life of each tool that has a law of wear in the setup, like 0.05; T3=0.05 for one tool.
    #[arg(long, value_name = "SHARE", value_parser = life_share)]
    pub wear_budget: Vec<LifeShare>,
    /// Do everything but write the program: summary and reports tell what it would be.
    #[arg(long)]
    pub dry_run: bool,
    /// Simulate the written program again with stock, offset, coefficients, runout and override other than assumed.
    #[arg(long)]
    pub stress: bool,
    /// Write a certificate: what `feedwright certify` needs to prove that no load exceeds its limit at the --confidence asked for, whatever
    /// the coefficients within their ellipsoid and the stock within its uncertainty. Feeds are lowered until it does.
    #[arg(long, value_name = "FILE", requires = "confidence", conflicts_with = "reference")]
    pub certificate: Option<PathBuf>,
    /// Write one page to print and sign: hashes, limits, assumptions, what keeps its feed, the largest rise, and the worst under --stress,
    /// which it asks for.
    #[arg(long, value_name = "FILE.html")]
    pub sign_off: Option<PathBuf>,
}

impl Optimize {
    /// Those of its options that decide feeds.
    pub fn deciding(&self, global: &Global) -> Result<Vec<String>, CliError> {
        let budget = |life: &LifeShare| {
            let tool = life.tool.map_or_else(String::new, |number| format!("T{number}="));
            format!("--wear-budget {tool}{}", life.share)
        };
        let expand = self.expand.then(|| "--expand".to_owned());
        let certificate = self.certificate.is_some().then(|| "--certificate".to_owned());
        let own = expand.into_iter().chain(certificate).chain(self.wear_budget.iter().map(budget)).collect();
        Ok([global.deciding()?, self.work.deciding(), own].concat())
    }

    /// With nothing else said.
    pub fn of(work: Work) -> Self {
        Self {
            work,
            more: Vec::new(),
            out_dir: None,
            output: None,
            wear_budget: Vec::new(),
            expand: false,
            accept_infeasible: false,
            accept_collisions: false,
            dry_run: false,
            stress: false,
            sign_off: None,
            certificate: None,
        }
    }
}

/// Rewrites the feeds. Several programs are one set: all are written, or none.
pub fn optimize(command: &Optimize, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let alone = command.more.is_empty();
    if !alone {
        each_for_itself(command)?;
    }
    let setup = command.work.common.setup();
    let programs = std::iter::once(&command.work.program).chain(&command.more);
    let sources: Vec<Source> = programs.map(|path| input::program(path)).collect::<Result<_, _>>()?;
    if let Some(folder) = &command.out_dir {
        std::fs::create_dir_all(folder).map_err(|error| CliError::file("make the folder", folder, &error))?;
    }
    let mut outputs = Outputs::new(sources.iter().flat_map(|source| inputs(source, setup, global)), global.force);
    let under_way: Vec<UnderWay> = sources
        .into_iter()
        .map(|source| UnderWay::open(command, source, &mut outputs, screen))
        .collect::<Result<_, _>>()?;
    let mut found = Vec::new();
    for one in under_way {
        found.push(one.rewrite(command, global, if alone { screen } else { screen.quietly() }, &mut outputs)?);
    }
    outputs.commit()?;
    for one in &found {
        if !alone {
            screen.show(&line(&one.name, one.time_s, &one.headline))?;
        }
        one.said.iter().for_each(|said| screen.say(said));
    }
    Ok(found.iter().map(|one| one.outcome).max().unwrap_or(Outcome::Done))
}

/// Options that name one file, or are true of one program.
fn each_for_itself(command: &Optimize) -> Result<(), CliError> {
    let work = &command.work;
    let given = [
        ("-o", command.output.is_some()),
        ("--json", work.common.json.is_some()),
        ("--report", work.report.is_some()),
        ("--csv", work.csv.is_some()),
        ("--svg", work.svg.is_some()),
        ("--dump-problem", work.dump_problem.is_some()),
        ("--save-stock", work.save_stock.is_some()),
        ("--cycle-time", work.cycle_time.is_some()),
        ("--sign-off", command.sign_off.is_some()),
        ("--certificate", command.certificate.is_some()),
    ];
    match given.iter().find(|(_, given)| *given) {
        None => Ok(()),
        Some((name, _)) => Err(CliError::new(
            format!("{name} is for one program, and {} are given", 1 + command.more.len()),
            "give --out-dir for where the programs go; `feedwright batch` keeps a JSON report of each",
        )),
    }
}

/// One program in a line: times before and after, and the verdict.
pub fn line(name: &str, [before_s, after_s]: [f64; 2], headline: &str) -> String {
    format!("{name:<32} {:>9} → {:>9}  {headline}\n", report::clock(before_s), report::clock(after_s))
}

/// A program whose outputs are ready before the work begins.
struct UnderWay {
    source: Source,
    target: PathBuf,
    program: Option<Output>,
    reports: Reports,
    certificate: Option<Output>,
    kept: StoredFiles,
}

/// What a program came to, and what is to be said once everything is written.
struct Rewritten {
    name: String,
    outcome: Outcome,
    headline: String,
    time_s: [f64; 2],
    said: Vec<String>,
}

impl UnderWay {
    fn open(command: &Optimize, source: Source, outputs: &mut Outputs, screen: Screen) -> Result<Self, CliError> {
        let target = target(command.output.as_deref(), command.out_dir.as_deref(), &source);
        let program = if command.dry_run { None } else { Some(outputs.open(&target, Kind::Program)?) };
        let mut reports = Reports::open(&command.work, outputs)?;
        reports.sign_off = command.sign_off.as_deref().map(|path| outputs.open(path, Kind::Markup)).transpose()?;
        let certificate =
            command.certificate.as_deref().map(|path| outputs.open(path, Kind::Certificate)).transpose()?;
        let kept = StoredFiles::open(&command.work, &source, outputs, screen)?;
        Ok(Self { source, target, program, reports, certificate, kept })
    }

    /// Everything but giving the files their names.
    fn rewrite(
        self,
        command: &Optimize,
        global: &Global,
        screen: Screen,
        outputs: &mut Outputs,
    ) -> Result<Rewritten, CliError> {
        let Self { source, target, program, reports, certificate, kept } = self;
        let setup = command.work.common.setup();
        let source = plain(source, setup, command.expand, global, screen)?;
        let beside = subprograms::folder(&target, &source);
        let wanted = Wanted {
            rewrites_files: beside.is_some(),
            certificate: certificate.is_some(),
            ..wanted(&command.work, command.stress || command.sign_off.is_some())
        };
        let mut task = task(&source, setup, global, wanted)?;
        task.job.life = budgets(&command.wear_budget, &task.job)?;
        let done = kept.with(|keep| execute(source, task, job::optimize, global, screen, keep))?;
        let stock = kept.reliefs();
        kept.write(outputs)?;
        let written = done.run.written.as_ref().expect("optimize always writes");
        let to_stdout = program.as_ref().is_some_and(Output::is_stdout) || reports.uses_stdout();
        if !written.check.identical {
            return Err(CliError::new(
                format!(
                    "{}: the rewritten program would not be the same but for its feeds: {}",
                    done.source.name,
                    written.check.differences.join("; ")
                ),
                "nothing was written; leave the block out with [output] exclude, and please report it",
            ));
        }
        let setup_text = setup_text(setup, &done.source);
        let may_write = |verdict: &Verdict| {
            program.is_some() && verdict.held_back().into_iter().all(|why| is_accepted(why, command))
        };
        let options = command.deciding(global)?;
        let shown =
            ReportInputs { done: &done, stock: &stock, setup: setup_text.as_deref(), options, is_written: &may_write };
        let verdict = reports.write(&shown, global, screen, to_stdout)?;
        let mut found = Rewritten {
            name: done.source.name.clone(),
            outcome: verdict.outcome,
            headline: verdict.headline.clone(),
            time_s: [done.run.realised_before.total_s, done.run.realised_after().total_s],
            said: Vec::new(),
        };
        if let Some(why) = verdict.held_back().into_iter().find(|why| !is_accepted(*why, command)) {
            found.said.push(refusal(why).to_owned());
            return Ok(found);
        }
        let Some(program) = program else {
            found.said.push(format!("not written, as --dry-run asks: {}", target.display()));
            return Ok(found);
        };
        let files = beside.map(|folder| subprograms::write(&written.files, &folder, &done.source, outputs));
        let files = files.transpose()?.unwrap_or_default();
        program.write(&written.bytes)?;
        if let (Some(output), Some(text)) = (certificate, &done.run.answers.certificate) {
            output.write(text.as_bytes())?;
        }
        found.said.extend(files.iter().map(|path| format!("written   {}", path.display())));
        if !to_stdout {
            found.said.push(format!("written   {}", target.display()));
        }
        Ok(found)
    }
}

/// Predicts, changes nothing.
pub fn simulate(command: &Work, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let source = input::program(&command.program)?;
    let mut outputs = Outputs::new(inputs(&source, command.common.setup(), global), global.force);
    let reports = Reports::open(command, &mut outputs)?;
    let kept = StoredFiles::open(command, &source, &mut outputs, screen)?;
    let source = plain(source, command.common.setup(), false, global, screen)?;
    let setup = command.common.setup();
    let wanted = wanted(command, false);
    let done = kept.with(|keep| run_keeping(source, setup, job::simulate, global, wanted, screen, keep))?;
    let stock = kept.reliefs();
    kept.write(&mut outputs)?;
    let to_stdout = reports.uses_stdout();
    let setup_text = setup_text(setup, &done.source);
    let options = [global.deciding()?, command.deciding()].concat();
    let shown =
        ReportInputs { done: &done, stock: &stock, setup: setup_text.as_deref(), options, is_written: &|_| false };
    let outcome = reports.write(&shown, global, screen, to_stdout)?.outcome;
    outputs.commit()?;
    Ok(outcome)
}

/// The budgets of wear, each for a tool whose law and end are known.
fn budgets(asked: &[LifeShare], job: &Job) -> Result<Vec<LifeShare>, CliError> {
    let known: Vec<u32> =
        job.tools.iter().filter(|tool| wear::with_end(job, tool).is_some()).map(|tool| tool.number).collect();
    let unknown = asked.iter().find(|life| life.tool.map_or(known.is_empty(), |number| !known.contains(&number)));
    let Some(life) = unknown else { return Ok(asked.to_vec()) };
    let of = life.tool.map_or_else(|| "any tool".to_owned(), |number| format!("T{number}"));
    let tool = job.tools.iter().find(|tool| life.tool.is_none_or(|number| number == tool.number));
    Err(lacks_of_wear(&of, tool.and_then(|tool| wear::of_tool(job, tool))))
}

/// Did the user say that the program is to be written all the same?
fn is_accepted(why: HeldBack, command: &Optimize) -> bool {
    match why {
        HeldBack::NoMeeting => false,
        HeldBack::Hopeless => command.accept_infeasible,
        HeldBack::Collision => command.accept_collisions,
    }
}

fn refusal(why: HeldBack) -> &'static str {
    match why {
        HeldBack::NoMeeting => "nothing was written; correct [stock], its offset, or the units of the setup",
        HeldBack::Hopeless => "nothing was written; with --accept-infeasible the program is written all the same",
        HeldBack::Collision => "nothing was written; with --accept-collisions the program is written all the same",
    }
}

/// `part.nc` → `part.fw.nc` beside it or in a folder; a program that was optimised before keeps its name's `.fw` once.
fn target(given: Option<&Path>, folder: Option<&Path>, source: &Source) -> PathBuf {
    if let Some(path) = given {
        return path.to_owned();
    }
    let Some(path) = &source.path else { return PathBuf::from("-") };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let name = match path.extension() {
        Some(extension) => format!("{stem}.fw.{}", extension.to_string_lossy()),
        None => format!("{stem}.fw"),
    };
    folder.map_or_else(|| path.with_file_name(&name), |folder| folder.join(&name))
}

/// The bytes of the setup, where there is one.
fn setup_text(given: Option<&Path>, source: &Source) -> Option<Vec<u8>> {
    std::fs::read(given.map(Path::to_owned).or_else(|| input::beside(source))?).ok()
}

/// What the reports show.
struct ReportInputs<'a> {
    done: &'a Done,
    stock: &'a [Relief],
    setup: Option<&'a [u8]>,
    /// Those of the command line that decide feeds.
    options: Vec<String>,
    /// Will the program be written under this verdict?
    is_written: &'a dyn Fn(&Verdict) -> bool,
}

/// Where the reports go, each ready before the work begins.
struct Reports {
    json: Option<Output>,
    json_blocks: bool,
    html: Option<Output>,
    csv: Option<Output>,
    svg: Option<Output>,
    problem: Option<Output>,
    sign_off: Option<Output>,
}

impl Reports {
    fn open(command: &Work, outputs: &mut Outputs) -> Result<Self, CliError> {
        let mut open = |path: &Option<PathBuf>, kind| path.as_deref().map(|path| outputs.open(path, kind)).transpose();
        Ok(Self {
            json: open(&command.common.json, Kind::Json)?,
            json_blocks: command.json_blocks,
            html: open(&command.report, Kind::Markup)?,
            csv: open(&command.csv, Kind::Csv)?,
            svg: open(&command.svg, Kind::Markup)?,
            problem: open(&command.dump_problem, Kind::Json)?,
            sign_off: None,
        })
    }

    fn uses_stdout(&self) -> bool {
        [&self.json, &self.html, &self.csv, &self.svg, &self.problem, &self.sign_off]
            .into_iter()
            .flatten()
            .any(Output::is_stdout)
    }

    /// Files as asked for; the summary to standard output, or to standard error where that is taken. Returns the verdict that
    /// they all show.
    fn write(
        self,
        found: &ReportInputs,
        global: &Global,
        screen: Screen,
        stdout_taken: bool,
    ) -> Result<Verdict, CliError> {
        let Done { source, run } = found.done;
        let figures = report::figures(run);
        let from = report::provenance(run, found.setup, found.options.clone());
        screen.diagnostics(&source.name, &source.bytes, &run.diagnostics);
        let summary = report::summary(run, &figures, &source.name);
        if stdout_taken {
            screen.say(&summary);
        } else {
            screen.show(&summary)?;
        }
        if global.timings {
            screen.say(&timings(run));
        }
        if let Some(output) = self.json {
            let extras = Extras { blocks: self.json_blocks, timings: global.timings.then(peak_memory) };
            output.write(report::json(run, &figures, &from, &source.name, extras).as_bytes())?;
        }
        if let Some(output) = self.problem {
            output.write(problem::json(run, &source.name).as_bytes())?;
        }
        if let Some(output) = self.csv {
            output.write_with(|out| report::csv(run, out))?;
        }
        if let Some(output) = self.svg {
            output.write(report::picture(run, &figures, &source.name).as_bytes())?;
        }
        if let Some(output) = self.html {
            let sections = job::sections(&run.program, &run.toolpath, &run.map);
            let shown = report::Shown {
                run,
                figures: &figures,
                file: &source.name,
                sections: &sections,
                stock: found.stock,
                form: None,
            };
            output.write(report::html(&shown).as_bytes())?;
        }
        if let Some(output) = self.sign_off {
            let is_written = (found.is_written)(&figures.verdict);
            output.write(report::sign_off(run, &figures, &from, &source.name, is_written).as_bytes())?;
        }
        Ok(figures.verdict)
    }
}

fn timings(run: &ProgramRun) -> String {
    let [parse, simulate, schedule, rewrite, check] = run.stage_s;
    let memory = peak_memory().map_or(String::new(), |bytes| format!(", peak memory {} MiB", bytes >> 20));
    format!(
        "stages    parse {parse:.2} s, simulate {simulate:.2} s, schedule {schedule:.2} s, rewrite {rewrite:.2} s, check {check:.2} s{memory}"
    )
}

fn life_share(text: &str) -> Result<LifeShare, String> {
    let (tool, share) = match text.split_once('=') {
        Some((tool, share)) => (Some(tool), share),
        None => (None, text),
    };
    let help = "write a share of the life from above 0 to 1, like 0.05 for every tool or T3=0.05 for one";
    let number = |tool: &str| tool.strip_prefix(['T', 't']).and_then(|number| number.parse().ok());
    let tool = tool.map(|tool| number(tool).ok_or(help)).transpose()?;
    let share = share.parse::<f64>().ok().filter(|share| *share > 0.0 && *share <= 1.0).ok_or(help)?;
    Ok(LifeShare { tool, share })
}
