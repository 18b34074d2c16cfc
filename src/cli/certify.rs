//! `certify`: the checker of certificates. In: a written program, its setup, its certificate, the original if there is one. Out: exit 0 and
//! what is proven, or exit 1 and the line and reason why not.

use clap::Args;
use std::path::{Path, PathBuf};

use super::error::CliError;
use super::input;
use super::options::Global;
use super::screen::Screen;
use super::{verify, work};
use crate::certify::{Basis, Proven, Refusal, check};
use crate::nc::{self, Environment};
use crate::report::Outcome;

/// `certify`.
#[derive(Debug, Args)]
pub struct Certify {
    /// The written program; or the program as it was, with the written one behind it.
    pub program: PathBuf,
    /// The written program, where the one before it is the original: only feeds may differ.
    pub rewritten: Option<PathBuf>,
    /// Setup file that it was written with; without it PROGRAM.setup.toml beside the program.
    #[arg(long, value_name = "S.toml")]
    pub setup: Option<PathBuf>,
    /// The certificate, as `optimize --certificate` writes it.
    #[arg(long, value_name = "FILE")]
    pub certificate: PathBuf,
}

/// Checks a certificate.
pub fn certify(command: &Certify, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let named = input::program(&command.program)?;
    let setup = input::setup(command.setup.as_deref(), &named, global)?;
    let text = input::text(&command.certificate)?;
    let job = &setup.job;
    let (source, only_feeds) = match &command.rewritten {
        None => (named, String::new()),
        Some(rewritten) => {
            let written = input::program(rewritten)?;
            let (_, proof) = verify::compared([&named, &written], global, Some(job))?;
            if !proof.holds() {
                return screen.show(&verify::differences(&proof)).map(|()| Outcome::Unmet);
            }
            (written, format!("original  only feeds differ: {} motions compared\n", proof.motions))
        }
    };
    let program = input::parse(&source, global, Some(job))?;
    let folder = source.path.as_deref().and_then(Path::parent).map(Path::to_owned);
    let load = |name: &str| work::subprogram(folder.as_deref(), name);
    let environment = Environment { load: &load, ..Environment::from_job(job) };
    let environment = nc::unit::with_its_unit(&program, environment, Some(job));
    let toolpath = nc::interpret(&program, &environment);
    let basis = Basis { bytes: &source.bytes, toolpath: &toolpath, job, switched: program.has_block_delete() };
    match check(&text, &basis) {
        Ok(proven) => screen.show(&(words(&proven) + &only_feeds)).map(|()| Outcome::Done),
        Err(refusal) => screen.show(&refused(&source.name, &refusal)).map(|()| Outcome::Unmet),
    }
}

fn words(proven: &Proven) -> String {
    let Proven { confidence, counts: [moves, stations, cutting], ratios, witnessed } = proven;
    let seen = if *witnessed {
        ", a coarse second one found nothing left out"
    } else {
        "; this stock has no coarse second one"
    };
    let largest: Vec<String> = ratios.iter().map(|(kind, ratio)| format!("{} {ratio:.3}", kind.name())).collect();
    let largest = if largest.is_empty() { "no load is limited".to_owned() } else { largest.join(", ") };
    format!(
        "proven: no load exceeds its limit, at a confidence of {confidence} for all loads of the program together\n\
         over      every coefficient in the ellipsoid, the stock within its uncertainty and every lesser engagement, feed override up to 100 %\n\
         checked   {moves} feed moves in {stations} stations, {cutting} of them cut\n\
         largest   bound over limit: {largest}\n\
         rests on  the engaged arcs of the certificate (from the simulation{seen}), the linear-edge model, the reader of programs and setups\n\
         not said  rapids, the approach of the spindle to its speed, chatter, what the machine does between two commanded feeds\n"
    )
}

fn refused(name: &str, refusal: &Refusal) -> String {
    match refusal.line {
        Some(line) => format!("not proven: {name}, line {line}: {}\n", refusal.why),
        None => format!("not proven: {name}: {}\n", refusal.why),
    }
}
