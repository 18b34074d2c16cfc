//! The text of a program is kept byte for byte: tokens tile every line of every program there is, and of any bytes.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use std::fs;

use feedwright::nc::{self, Dialect, Environment};
use proptest::prelude::*;

fn assert_tiles(bytes: &[u8], dialect: Option<Dialect>) {
    let program = nc::parse(bytes.to_vec(), dialect);
    assert_eq!(program.text(), bytes);
    let mut at = 0;
    for block in program.blocks() {
        assert_eq!(program.span(block).start, at);
        for token in program.tokens(block) {
            assert_eq!(token.span.start, at, "gap or overlap");
            assert!(token.span.end > at);
            at = token.span.end;
        }
        assert_eq!(program.span(block).end, at);
    }
    assert_eq!(at as usize, bytes.len());
}

fn every_file_is_tiled(folder: &str) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            assert_tiles(&fs::read(&path).unwrap(), None);
        }
    }
}

#[test]
fn tokens_tile_our_own_programs() {
    ["programs", "tests/nc"].into_iter().for_each(every_file_is_tiled);
}

#[test]
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn tokens_tile_every_program_of_the_corpus() {
    ["../shared/programs", "../shared/measured/nist_mtc/nc"].into_iter().for_each(every_file_is_tiled);
}

proptest! {
    #[test]
    fn arbitrary_bytes_are_tiled_and_interpreted_without_a_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..300),
        which in 0..Dialect::ALL.len(),
    ) {
        let dialect = Dialect::ALL[which];
        assert_tiles(&bytes, Some(dialect));
        nc::interpret(&nc::parse(bytes, Some(dialect)), &Environment::default());
    }

    #[test]
    fn arbitrary_words_are_tiled_and_interpreted_without_a_panic(
        words in prop::collection::vec("[GMXYZIJKRFSTNOPQLD#<>%/()\\[\\]=;+*. \r\n-]|[GM][0-9]{1,3}|[XYZIJKRFP]-?[0-9.]{1,5}|\n", 0..80),
        which in 0..Dialect::ALL.len(),
    ) {
        let bytes = words.concat().into_bytes();
        let dialect = Dialect::ALL[which];
        assert_tiles(&bytes, Some(dialect));
        let environment = Environment { max_repeated_bytes: 100_000, ..Environment::default() };
        nc::interpret(&nc::parse(bytes, Some(dialect)), &environment);
    }
}
