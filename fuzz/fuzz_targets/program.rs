//! Any bytes in any dialect (the first byte chooses it) through parsing, interpreting, unrolling and the proof.
#![cfg_attr(feature = "libfuzzer", no_main)]

mod target;

use feedwright::nc::{self, Dialect, Environment};
use feedwright::rewrite::verify;

fn go_through(data: &[u8]) {
    let Some((first, text)) = data.split_first() else { return };
    let dialect = Dialect::ALL[usize::from(*first) % Dialect::ALL.len()];
    let environment = Environment { max_repeated_bytes: 1 << 14, max_depth: 8, ..Environment::default() };
    let program = nc::parse(text.to_vec(), Some(dialect));
    let tokens: usize = program.blocks().flat_map(|block| program.tokens(block)).map(|token| token.span.len()).sum();
    assert_eq!(tokens, text.len(), "tokens tile the text");
    nc::interpret(&program, &environment);
    assert!(verify(&program, &program, &environment).holds(), "a program is itself");
    let plain = nc::parse(nc::unroll(&program, &environment).text, Some(dialect));
    verify(&program, &plain, &environment);
}

target::target!(go_through);
