//! Adapter output of a real machine (NIST/MTC box assembly; the data are NIST's, by path only): read, and tied to its
//! program by line number. The times themselves are compared by `cargo bench --bench nist_time`.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use feedwright::learn::align::line::by_line;
use feedwright::learn::log::Log;
use feedwright::learn::log::shdr::shdr;
use feedwright::learn::program::simulated::simulate;
use std::path::Path;

const FOLDER: &str = "../shared/measured/nist_mtc";

#[test]
#[cfg_attr(absent_shared, ignore = "../shared is not there")]
fn a_real_log_is_read_and_follows_its_program_line_by_line() {
    let text = std::fs::read_to_string(format!("{FOLDER}/log/box_op2_run03.shdr")).unwrap();
    let frame = shdr(text.as_bytes(), &[]).unwrap();
    let (time, block) = (frame.numbers("time_s").unwrap(), frame.numbers("block").unwrap());
    // Counted in the text itself.
    let stamps: std::collections::BTreeSet<&str> = text.lines().filter_map(|l| l.split('|').next()).collect();
    let blocks = text.lines().filter(|l| l.contains("|Block_Number|")).count();
    let changes = block.windows(2).filter(|p| p[1] != p[0] && p[1].is_finite()).count();
    assert_eq!(time.len(), stamps.len());
    assert!(changes > blocks * 9 / 10 && changes <= blocks, "{changes} of {blocks}");
    assert!(frame.numbers("feed_mm_min").is_some() && frame.numbers("spindle_rpm").is_some());
    let setup = std::fs::read_to_string("../shared/programs/setups/box_op1.toml").unwrap();
    let (job, _) = feedwright::setup::load(&setup, Path::new("../shared/programs/setups")).unwrap();
    let program = std::fs::read(format!("{FOLDER}/nc/box_op2.nc")).unwrap();
    let prepared = simulate(&program, &job, false).unwrap();
    let line = block.iter().map(|b| b + 1.0).collect();
    let log = Log { time_s: time.iter().map(|t| t - time[0]).collect(), line: Some(line), ..Log::default() };
    let tied = by_line(&log, prepared.timeline(), prepared.known(&job).slower).unwrap();
    let placed: Vec<f64> = tied.program_s.iter().copied().filter(|t| t.is_finite()).collect();
    println!("{} of {} stamps placed, misfit {:.3}", placed.len(), time.len(), tied.misfit);
    // Stamps on lines that move nothing (comments, M codes, the way home) have no place on the path.
    assert!(tied.misfit < 0.2, "{}", tied.misfit);
    assert!(placed.len() * 10 > time.len() * 8, "{} of {}", placed.len(), time.len());
    assert!(placed.windows(2).all(|p| p[1] >= p[0] - 1e-9), "the program runs forwards");
}
