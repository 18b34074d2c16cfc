//! Finds what the model of a setup lacks in a log that was measured while the program ran, and writes a better model.
//!
//! ```text
//! cargo run --release --example learn -- part.nc part.setup.toml log.csv model.toml
//! ```

#![allow(dead_code, clippy::print_stdout)]

use std::error::Error;
use std::path::Path;

use feedwright::{Learned, Setup, learn, parse};

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let [program, setup, log, model] = files.as_slice() else {
        return Err("give program, setup, log and model".into());
    };
    let learned = from_log(Path::new(program), Path::new(setup), Path::new(log))?;
    print!("{}", learned.summary());
    match learned.model() {
        Some(text) => std::fs::write(model, text)?,
        None => println!("no model was written: the log does not support one"),
    }
    Ok(())
}

/// What a log says.
pub fn from_log(program: &Path, setup: &Path, log: &Path) -> Result<Learned, Box<dyn Error>> {
    let folder = setup.parent().unwrap_or(Path::new("."));
    let setup = Setup::from_toml(&std::fs::read_to_string(setup)?, folder)?;
    let program = parse(std::fs::read(program)?, Some(&setup))?;
    Ok(learn(&program, &std::fs::read(log)?, &setup)?)
}
