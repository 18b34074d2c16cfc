//! Predicts the largest loads of a program and the time it takes.
//!
//! ```text
//! cargo run --release --example simulate -- programs/island.nc programs/island.setup.toml
//! ```

#![allow(dead_code, clippy::print_stdout)]

use std::error::Error;
use std::path::Path;

use feedwright::{Setup, parse, simulate};

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let [program, setup] = files.as_slice() else { return Err("give a program and its setup".into()) };
    print!("{}", loads(Path::new(program), Path::new(setup))?);
    Ok(())
}

/// Time and largest loads, a line each.
pub fn loads(program: &Path, setup: &Path) -> Result<String, Box<dyn Error>> {
    let folder = setup.parent().unwrap_or(Path::new("."));
    let setup = Setup::from_toml(&std::fs::read_to_string(setup)?, folder)?;
    let program = parse(std::fs::read(program)?, Some(&setup))?;
    let predicted = simulate(&program, &setup)?;
    let mut out = format!("{:.1} s: {}\n", predicted.time_s()[0], predicted.headline());
    for load in predicted.loads() {
        let tool = load.tool.map_or(String::new(), |number| format!(" of T{number}"));
        let limit = load.limit.map_or(String::new(), |limit| format!(", limit {limit} {}", load.unit));
        let largest = load.before.unwrap_or(0.0);
        out += &format!("{}{tool}: at most {largest:.3} {}{limit}\n", load.name, load.unit);
    }
    Ok(out)
}
