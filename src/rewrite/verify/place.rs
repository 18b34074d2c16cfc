//! Where a line may be added. In: the rewritten program, the roles of its lines, what the control does in them. Out: for an added line, why it
//! may not stand there.
//!
//! A control takes a line for more than a feed before the number of the program, in plain language, whose blocks are numbered without gaps, among
//! the data of a G10, and under G66.1, which calls a macro after every block. Under radius compensation two blocks without a motion end the
//! look-ahead of many controls: the path then leaves the contour.

use crate::ids::BlockId;
use crate::nc::{Program, Syntax, Token, TokenKind};

use super::align::{Role, Roles};
use super::done::Done;
use super::line;

/// What is known of the lines of a rewritten program.
pub struct Places {
    /// No line can be added anywhere.
    counted: bool,
    /// The line that begins the program: its `%`, its number behind that.
    head: usize,
    /// Lines at which every block is data, or calls a macro.
    taken: Vec<bool>,
    /// Lines without a motion that stand beside another one under radius compensation.
    aside: Vec<bool>,
}

/// L of a G10 that stands alone; all others put in data up to G11.
const ALONE: [f64; 7] = [1.0, 2.0, 10.0, 11.0, 12.0, 13.0, 20.0];

impl Places {
    /// Goes through the program once.
    pub fn of(program: &Program, roles: &Roles, done: &Done) -> Self {
        let counted = program.dialect().properties().counts_blocks;
        let mut taken_now = false;
        let taken = |block: BlockId| {
            let here = taken_now;
            taken_now = begins(program, block).unwrap_or(taken_now);
            here
        };
        let taken = program.blocks().map(taken).collect();
        Self { counted, head: head(program, roles), taken, aside: aside(program, done) }
    }

    /// Why an added line may not stand there.
    pub fn wrong(&self, line: usize) -> Option<&'static str> {
        if self.counted {
            Some("a line is added where blocks are numbered without gaps")
        } else if self.taken[line] {
            Some("a line is added where each block is data or calls a macro")
        } else if line < self.head {
            Some("a line is added before the program begins")
        } else if self.aside[line] {
            Some("two blocks without a motion stand in a row under radius compensation")
        } else {
            None
        }
    }
}

/// Kinds of the tokens of a line but for blanks and comments.
fn kinds(program: &Program, line: usize) -> impl Iterator<Item = TokenKind> + '_ {
    let kinds = program.tokens(BlockId(line as u32)).map(|token| token.kind);
    kinds.filter(|kind| !matches!(kind, TokenKind::Blank | TokenKind::LineEnd | TokenKind::Comment))
}

/// The last of the lines with which the program begins: `%`, `%_N_NAME_MPF`, `O1000`, `:1000`, but not `O100 SUB`.
fn head(program: &Program, roles: &Roles) -> usize {
    let begins = |line: usize| {
        let mut kinds = kinds(program, line);
        match kinds.next() {
            Some(TokenKind::Percent) => true,
            Some(TokenKind::Word(b'O')) => kinds.next() != Some(TokenKind::Name),
            _ => false,
        }
    };
    let own = |line: &usize| !matches!(roles.of[*line], Role::Added) && kinds(program, *line).next().is_some();
    (0..roles.of.len()).filter(own).take_while(|line| begins(*line)).last().unwrap_or(0)
}

/// For each line: is it one of several without a motion between two motions under compensation?
fn aside(program: &Program, done: &Done) -> Vec<bool> {
    let mut aside = vec![false; program.len()];
    let (mut since, mut compensated) = (Vec::<usize>::new(), false);
    for line in 0..program.len() {
        if done.moves(line) {
            if since.len() > 1 && compensated && done.compensated(line) {
                for line in &since {
                    aside[*line] = true;
                }
            }
            since.clear();
            compensated = done.compensated(line);
        } else if compensated && kinds(program, line).next().is_some() {
            since.push(line);
        }
    }
    aside
}

/// Does a stretch begin behind this line in which each block is more than a block (true), or end (false)?
fn begins(program: &Program, block: BlockId) -> Option<bool> {
    if program.dialect().syntax() != Syntax::Rs274 {
        return None;
    }
    let level = || program.tokens(block).find(|token| line::is(token, b'L')).map(|token| token.number);
    let is = |code: f64| program.tokens(block).any(|token: Token| line::is(&token, b'G') && token.number == code);
    if is(10.0) {
        return Some(level().is_some_and(|level| !ALONE.contains(&level)));
    }
    if is(66.1) { Some(true) } else { (is(11.0) || is(67.0)).then_some(false) }
}
