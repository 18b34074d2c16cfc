//! Rewrites the feeds of a program and proves that nothing else changed.
//!
//! ```text
//! cargo run --release --example optimise -- programs/island.nc programs/island.setup.toml island.fw.nc
//! ```

#![allow(dead_code, clippy::print_stdout)]

use std::error::Error;
use std::path::Path;

use feedwright::{Outcome, Setup, optimise, parse, verify};

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let [program, setup, target] = files.as_slice() else {
        return Err("give a program, its setup and a target".into());
    };
    let new = rewritten(Path::new(program), Path::new(setup))?;
    std::fs::write(target, new)?;
    Ok(())
}

/// The program with new feeds.
pub fn rewritten(program: &Path, setup: &Path) -> Result<Vec<u8>, Box<dyn Error>> {
    let folder = setup.parent().unwrap_or(Path::new("."));
    let setup = Setup::from_toml(&std::fs::read_to_string(setup)?, folder)?;
    let original = std::fs::read(program)?;
    let found = optimise(&parse(original.clone(), Some(&setup))?, &setup)?;
    let [before_s, after_s] = found.prediction.time_s();
    println!("{before_s:.1} s -> {after_s:.1} s: {}", found.prediction.headline());
    if found.prediction.outcome() == Outcome::Unmet {
        println!("look at it before it runs: {:?}", found.prediction.loads());
    }
    let new = found.program.ok_or("it must not run: nothing was written")?;
    // The library has proved this already; here it is how to prove it of any two programs.
    let proof = verify(original, new.clone(), Some(&setup))?;
    if !proof.holds() {
        return Err(proof.differences.join("\n").into());
    }
    Ok(new)
}
