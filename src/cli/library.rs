//! `library`: what is built in.

use super::Outcome;
use super::args::{Library, Shelf};
use super::error::CliError;
use super::screen;

/// Lists one shelf, or all of them.
pub fn library(command: &Library) -> Result<Outcome, CliError> {
    let shelves = match command.shelf {
        Some(shelf) => vec![shelf],
        None => vec![Shelf::Tools, Shelf::Materials, Shelf::Machines, Shelf::Effects, Shelf::Models],
    };
    for shelf in shelves {
        screen::put(list(shelf).as_bytes())?;
    }
    Ok(Outcome::Done)
}

fn list(shelf: Shelf) -> String {
    match shelf {
        Shelf::Effects => effects(),
        _ => String::new(),
    }
}

fn effects() -> String {
    let mut text = String::new();
    for effect in crate::effects::ALL {
        text += &format!("{:<20} {:<10} {}\n", effect.name, effect.acts.name(), effect.meaning);
    }
    text
}
