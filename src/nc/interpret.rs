//! The interpreter for a program of any family. In: a [`Program`] and its [`Environment`]. Out: a [`Toolpath`]; or the program unrolled, its
//! loops, calls and expressions replaced by the plain blocks that are executed.
//!
//! Unrolled blocks come in the order of execution and are copied byte for byte, with these exceptions. O words, labels, calls with their
//! arguments, assignments and block numbers (which would be repeated) are left out. A word with an expression gets its value, with at most
//! nine decimals, or eight digits in all where the control reads no more. Blocks of plain language are numbered anew. Comments stay.

use super::dialect::Syntax;
use super::environment::Environment;
use super::heidenhain::state::Heidenhain;
use super::interp::interpreter::{Family, Interpreter};
use super::interp::unroll::{Record, number, obstacle};
use super::program::Program;
use super::rs274::state::Rs274;
use super::siemens::state::Siemens;
use super::toolpath::Toolpath;
use crate::diag::Diagnostic;

/// Codes of diagnostics after which the rest of the toolpath is not what the control would do.
const LOST: [&str; 6] =
    ["nc::runaway", "nc::no-routine", "nc::unbalanced", "nc::no-target", "nc::expression", "nc::modal-call"];

/// Evaluates an expression with `$family` as the family that a program belongs to.
macro_rules! with_family {
    ($program:expr, $family:ident => $value:expr) => {
        match $program.dialect().syntax() {
            Syntax::Rs274 => {
                type $family = Rs274;
                $value
            }
            Syntax::Siemens => {
                type $family = Siemens;
                $value
            }
            Syntax::Heidenhain => {
                type $family = Heidenhain;
                $value
            }
        }
    };
}

/// Interprets a program; never fails. What is not understood is diagnosed, and the feed of its block frozen.
pub fn interpret(program: &Program, environment: &Environment<'_>) -> Toolpath {
    with_family!(program, Own => Interpreter::<Own>::run(program, environment))
}

/// Interprets a program together with the files it calls, with the block-delete switch off and on: the linked program
/// ([`Program::with_files`]), and what it does in this environment.
pub fn linked(program: &Program, environment: &Environment<'_>) -> (Program, Toolpath) {
    let (mut program, mut path) = (program.clone(), interpret(program, environment));
    let known = program.files().len();
    if path.files.len() > known {
        program = program.with_files(path.files.clone());
    }
    if program.has_block_delete() {
        let switched = Environment { block_delete: !environment.block_delete, ..environment.clone() };
        let files = interpret(&program, &switched).files;
        if files.len() > program.files().len() {
            program = program.with_files(files);
        }
    }
    if program.files().len() > known {
        path = interpret(&program, environment);
    }
    (program, path)
}

/// Does the program hold loops, jumps, calls, variables or expressions?
pub fn has_flow_control(program: &Program, environment: &Environment<'_>) -> bool {
    with_family!(program, Own => Own::has_flow_control(program, environment))
}

/// Interprets a program once and notes down what is executed.
fn recorded(program: &Program, environment: &Environment<'_>) -> (Record, Toolpath) {
    with_family!(program, Own => Interpreter::<Own>::run_recorded(program, environment))
}

/// A program unrolled.
#[derive(Debug, Clone, Default)]
pub struct Unrolled {
    /// The plain text.
    pub text: Vec<u8>,
    /// Why it is not the whole program; empty when it is.
    pub obstacles: Vec<Diagnostic>,
}

/// Unrolls a program.
pub fn unroll(program: &Program, environment: &Environment<'_>) -> Unrolled {
    let (record, path) = recorded(program, environment);
    let foot = with_family!(program, Own => Own::foot(program, &record));
    let unnumbered = with_family!(program, Own => Own::unnumbered as fn(&[u8]) -> &[u8]);
    let Record { mut text, mut obstacles, .. } = record;
    obstacles.extend(path.diagnostics.into_iter().filter(|d| LOST.contains(&d.code)));
    if program.has_block_delete() {
        // With the switch on, the same text without those blocks must be what is executed.
        let (on, _) = recorded(program, &Environment { block_delete: true, ..environment.clone() });
        let lines = |text: &[u8], kept: fn(&[u8]) -> bool| -> Vec<u8> {
            let lines = text.split_inclusive(|&byte| byte == b'\n').filter(|line| kept(line));
            lines.flat_map(|line| unnumbered(line).to_vec()).collect()
        };
        if lines(&text, |line| !line.trim_ascii_start().starts_with(b"/")) != lines(&on.text, |_| true) {
            obstacles.push(obstacle("what is executed depends on the block-delete switch"));
        }
    }
    // In the order of the text; those that belong to no line last.
    obstacles.sort_by_key(|obstacle| obstacle.line.unwrap_or(u32::MAX));
    text.extend(foot);
    Unrolled { text, obstacles }
}

/// The program with F words that are expressions or variables replaced by their values, where each is always the same;
/// not on the excluded lines (first, last).
pub fn plain_feeds(program: &Program, environment: &Environment<'_>, exclude: &[(u32, u32)]) -> Vec<u8> {
    let (mut record, _) = recorded(program, environment);
    record.feeds.sort_by_key(|(span, ..)| span.start);
    let mut text = Vec::with_capacity(program.text().len());
    let mut at = 0;
    for (span, value, same) in record.feeds {
        let line = program.line(program.block_at(span.start));
        if same && value > 0.0 && !exclude.iter().any(|(first, last)| (first..=last).contains(&&line)) {
            text.extend_from_slice(&program.text()[at..=span.start as usize]);
            text.extend_from_slice(number(b'F', value, program.dialect()).as_bytes());
            at = span.end as usize;
        }
    }
    text.extend_from_slice(&program.own_text()[at..]);
    text
}
