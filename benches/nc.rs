//! How fast a program of a million blocks is read: line scan with memchr, parse, lex, interpret; and what it costs in
//! memory. `cargo bench --bench nc`; with a number, of so many blocks; with the name of a file, the text is left there and only the
//! time for every token is printed (`tests/bench/peers.py`).
#![allow(clippy::print_stdout, clippy::format_collect, clippy::unwrap_used, missing_docs)]

use std::hint::black_box;
use std::time::Instant;

use feedwright::nc::{self, Environment};

/// Blocks of the program where no number is given.
const BLOCKS: usize = 1_000_000;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let blocks = words.iter().find_map(|word| word.parse().ok()).unwrap_or(BLOCKS);
    let text = program(blocks);
    if let Some(file) = words.iter().find(|word| word.parse::<usize>().is_err()) {
        std::fs::write(file, &text).unwrap();
        let tokens = |program: &nc::Program| program.blocks().map(|block| program.tokens(block).count()).sum();
        println!("seconds {}", mean(|| tokens(&nc::parse(text.clone(), None))));
        return;
    }
    let megabytes = text.len() as f64 / 1e6;
    println!("{blocks} blocks, {megabytes:.1} MB; processor time of one thread");
    let show = |name: &str, seconds: f64| {
        println!("{name:<28} {:>8.1} MB/s {:>8.2} M blocks/s", megabytes / seconds, blocks as f64 / 1e6 / seconds);
    };
    show("memchr line scan", mean(|| memchr::memchr_iter(b'\n', black_box(&text)).count()));
    let program = nc::parse(text.clone(), None);
    show("parse (lines, dialect)", mean(|| nc::parse(text.clone(), None).len()));
    show("lex every token", mean(|| program.blocks().map(|block| program.tokens(block).count()).sum()));
    let environment = Environment::default();
    show(
        "parse + interpret",
        mean(|| {
            let program = nc::parse(text.clone(), None);
            nc::interpret(&program, &environment).moves.len()
        }),
    );
    let path = nc::interpret(&program, &environment);
    let per_block = |bytes: usize| bytes as f64 / blocks as f64;
    println!(
        "memory: program {:.1} bytes/block, of which text {:.1}",
        per_block(program.memory_bytes()),
        per_block(text.len())
    );
    let both = program.memory_bytes() + path.memory_bytes();
    println!("memory: with the toolpath {:.1} bytes/block", per_block(both));
}

/// Mean time of a run, s, over as many runs as take half a second.
fn mean(mut run: impl FnMut() -> usize) -> f64 {
    let origin = Instant::now();
    let (start, mut runs) = (cpu_seconds(origin), 0.0);
    loop {
        black_box(run());
        runs += 1.0;
        let taken = cpu_seconds(origin) - start;
        if taken > 0.5 {
            return taken / runs;
        }
    }
}

/// Processor time of this thread (so that a busy machine does not count), s; elsewhere than on Linux the wall clock.
fn cpu_seconds(origin: Instant) -> f64 {
    let status = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = status.split_whitespace().next().and_then(|field| field.parse::<f64>().ok());
    nanoseconds.map_or_else(|| origin.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

/// A finishing raster: N words, coordinates with three decimals, an F or an arc now and then.
fn program(blocks: usize) -> Vec<u8> {
    use std::fmt::Write;
    let mut text = String::with_capacity(blocks * 34);
    text.push_str("%\nG21 G90 G17\nT1 M6\nS12000 M3\nG0 Z5.\nG1 Z0. F800.\n");
    let mut state = 1_u32;
    for k in text.lines().count()..blocks {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let x = f64::from(k as u32 % 4000) * 0.025;
        let y = (k / 4000) as f64 * 0.2;
        let z = -f64::from(state >> 22) * 0.002;
        let written = match k % 50 {
            0 => writeln!(text, "N{k} G1 X{x:.3} Y{y:.3} Z{z:.3} F{}", 600 + state % 300),
            25 => writeln!(text, "N{k} G3 X{x:.3} Y{y:.3} I0.2 J{:.3}", 0.1),
            26 => writeln!(text, "N{k} G1 X{x:.3} Y{y:.3} Z{z:.3}"),
            _ => writeln!(text, "N{k} X{x:.3} Y{y:.3} Z{z:.3}"),
        };
        written.unwrap();
    }
    text.into_bytes()
}
