//! Proof, from two texts alone, that only feeds, split points and our own comments differ. In: the original, the rewritten
//! program, and the surroundings they are read in. Out: a [`Proof`]; it holds when it lists no difference.
//!
//! There are three independent steps. *Text* ([`align`]): without F words and our comments, every line of the rewritten program is a line of the
//! original byte for byte, a line with nothing but F, or a piece of a block. *Motion* ([`motion`]): both programs are interpreted; every event
//! must be the same in the same order, the pieces of a block must lie on its path, join, and end where it ends, and feeds that must not change
//! (threads, probes …) must be equal. *Words* ([`words`]): an F differs only in a line that moves at a feed in both programs, and the other
//! tokens of the line are the same; a line is added only where it is nothing but a feed ([`place`]). Where blocks depend on the block-delete
//! switch, motions are compared with the switch on and off.
//!
//! The proof shares no code with what writes the program (`tests/tidy.rs`), except that both read tokens and interpret programs by `nc`.
//!
//! Where the original has loops, calls or expressions and the rewritten program has none, it is an unrolled one: the
//! original is unrolled here too, its motions are compared with those of the original ([`motion::compare_unrolled`]), and
//! the proof is made against that plain text, whose lines the differences name.

mod align;
pub(super) mod comment;
mod done;
mod exact;
mod line;
mod motion;
mod place;
mod proof;
mod words;

use std::collections::BTreeSet;

use crate::nc::{self, BYTE_ORDER_MARK, Environment, Program, Toolpath, interpret, parse};
use done::Done;
pub use proof::{Difference, Proof, Rise};

/// Compares the two; see the head of the file. The rewritten program is read in the dialect of the original. Files linked
/// to the programs ([`nc::linked`]) are compared like their own texts; others are the same for both.
pub fn verify(original: &Program, rewritten: &Program, environment: &Environment<'_>) -> Proof {
    if rewritten.dialect() != original.dialect() {
        let same = parse(rewritten.own_text().to_vec(), Some(original.dialect()));
        return verify(original, &same, environment);
    }
    if nc::has_flow_control(original, environment) && !nc::has_flow_control(rewritten, environment) {
        return verify_unrolled(original, rewritten, environment);
    }
    prove(original, rewritten, environment)
}

fn verify_unrolled(original: &Program, rewritten: &Program, environment: &Environment<'_>) -> Proof {
    let mut proof = Proof { unrolled: true, ..Proof::default() };
    let expanded = nc::unroll(original, environment);
    let plain = parse(expanded.text, Some(original.dialect()));
    for obstacle in expanded.obstacles {
        proof.differ(obstacle.line, None, format!("the original cannot be unrolled: {}", obstacle.text));
    }
    each_switch(original, environment, |environment| {
        motion::compare_unrolled(&interpret(original, environment), &interpret(&plain, environment), &mut proof);
    });
    if proof.holds() { Proof { unrolled: true, ..prove(&plain, rewritten, environment) } } else { proof }
}

fn prove(original: &Program, rewritten: &Program, environment: &Environment<'_>) -> Proof {
    let mut proof = Proof::default();
    if original.text().starts_with(BYTE_ORDER_MARK) != rewritten.text().starts_with(BYTE_ORDER_MARK) {
        proof.differ(Some(1), Some(1), "only one of them begins with a byte order mark");
    }
    let read = |block_delete, switches_on| {
        let environment = Environment { block_delete, switches_on, ..environment.clone() };
        let read = |program| interpret(program, &environment);
        <[Toolpath; 2]>::from(rayon::join(|| read(original), || read(rewritten)))
    };
    let (roles, off) =
        rayon::join(|| align::align(original, rewritten, environment.inch, &mut proof), || read(false, 0));
    if proof.holds() {
        let mut done = [original, rewritten].map(|program| Done::new(program.len()));
        let mut compare = |both: &[Toolpath; 2], keeps: bool, proof: &mut Proof| {
            motion::compare(both, &roles, keeps, proof);
            done.iter_mut().zip(both).for_each(|(done, toolpath)| done.add(toolpath));
        };
        compare(&off, true, &mut proof);
        if original.has_block_delete() {
            compare(&read(true, 0), false, &mut proof);
        }
        for switches_on in some_switches(original) {
            compare(&read(false, switches_on), false, &mut proof);
        }
        words::check(original, rewritten, &roles, &done, &mut proof);
        proof.lines = done[0].lines();
    }
    proof.inch = off[0].inch;
    proof.quote(original, rewritten);
    proof.name_files(original, rewritten);
    proof
}

/// Positions of block-delete switches of different numbers, as bits of those that are on: each alone, and each alone off.
fn some_switches(original: &Program) -> Vec<u16> {
    let number = |token: nc::Token| (token.kind == nc::TokenKind::Delete).then_some(token.number.max(1.0) as u8);
    let all = original.blocks().flat_map(|block| original.tokens(block)).filter_map(number);
    let all = all.fold(0_u16, |bits, number| bits | 1 << number);
    if !original.has_block_delete() || all.count_ones() < 2 {
        return Vec::new();
    }
    let each = (1..10).map(|number| 1 << number).filter(|bit| all & bit != 0);
    each.flat_map(|bit| [bit, all & !bit]).collect::<BTreeSet<_>>().into_iter().collect()
}

/// For every line of a rewritten program, the line of its original (by index) that it stands for or stands before. Where the
/// texts do not fit each other, lines are paired as far as they do.
pub fn written_for(original: &Program, rewritten: &Program, inch: bool) -> Vec<usize> {
    let roles = align::align(original, rewritten, inch, &mut Proof::default());
    let mut lines = vec![original.len().saturating_sub(1); roles.of.len()];
    let mut next = original.len().saturating_sub(1);
    for (line, role) in lines.iter_mut().zip(&roles.of).rev() {
        if let align::Role::Same(block) | align::Role::Piece(block) | align::Role::Last(block) = role {
            next = block.ix();
        }
        *line = next;
    }
    lines
}

/// Calls `with` for the block-delete switch off, and also for on if a block depends on it.
fn each_switch(original: &Program, environment: &Environment<'_>, mut with: impl FnMut(&Environment<'_>)) {
    let switches: &[bool] = if original.has_block_delete() { &[false, true] } else { &[false] };
    for &block_delete in switches {
        with(&Environment { block_delete, ..environment.clone() });
    }
}
