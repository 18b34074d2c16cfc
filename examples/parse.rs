//! Reads a program and prints its motions.
//!
//! ```text
//! cargo run --example parse -- programs/island.nc
//! ```

#![allow(dead_code, clippy::print_stdout)]

use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("which program?")?;
    print!("{}", motions(&std::fs::read(file)?)?);
    Ok(())
}

/// The motions of a program, a line each.
pub fn motions(text: &[u8]) -> Result<String, Box<dyn Error>> {
    let program = feedwright::parse(text, None)?;
    let mut out = format!("dialect {}\n", program.dialect());
    for motion in program.motions() {
        let [x, y, z] = motion.to_mm;
        let feed = motion.feed_mm_min.map_or("rapid".to_owned(), |feed| format!("F{feed:.0}"));
        out += &format!("line {:4}  T{}  X{x:.3} Y{y:.3} Z{z:.3}  {feed}\n", motion.line, motion.tool);
    }
    for noticed in program.diagnostics() {
        out += &format!("line {}: {}\n", noticed.line.unwrap_or(0), noticed.text);
    }
    Ok(out)
}
