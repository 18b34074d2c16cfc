//! A log in which the program runs more than once: two parts, or a run that was broken off and begun again. In: a log, and how it is
//! aligned. Out: the log of the run that covers most of the program, and what is said of the others.
//!
//! An alignment never goes back, so a second run belongs to nothing: a long stretch of samples is not placed. If the samples on either side
//! of one of its ends, aligned on their own, have clearly more samples placed than together, there one run ends and the next begins.

use crate::learn::align::Aligned;
use crate::learn::log::Log;
use crate::learn::log::gaps::gaps;
use std::ops::Range;

/// Least share of the samples that are placed in addition if they are runs of their own. Judgement.
const MORE: f64 = 0.1;
/// Most stretches, and gaps in the readings, whose ends are tried.
const MOST_TRIED: usize = 3;
/// Least share of the program that a run covers, and the difference in it that decides which is used. Judgement.
const COVERED: f64 = 0.05;
const CLEARLY: f64 = 0.05;
/// Least share of the program that the best of several runs covers: of less, by the load, each may be of another program. Judgement.
const MOSTLY: f64 = 0.5;

/// How a log is aligned on its own: the alignment, and the share of the program that it covers; `None` if it is not of this program.
pub type Align<'a> = &'a dyn Fn(&Log) -> Option<(Aligned, f64)>;

/// A run of the program: its samples, how many of them are placed, and the share of the program they cover.
#[derive(Debug, Clone, PartialEq)]
struct Run {
    samples: Range<usize>,
    placed: usize,
    covered: f64,
}

/// The log of the run that covers most, if there are several; a warning says where they are. Stretches that are not placed for so many
/// seconds are looked at.
pub fn one_run(log: &Log, aligned: &Aligned, shortest_s: f64, align: Align) -> Option<Log> {
    let whole = 0..log.time_s.len();
    let all = Run { placed: count(&aligned.placed), covered: 1.0, samples: whole };
    let mut runs = apart(log, all, &aligned.placed, shortest_s, align);
    runs.retain(|run| run.covered >= COVERED);
    let clearer = |best: Run, run: Run| if run.covered > best.covered + CLEARLY { run } else { best };
    let used = runs.iter().cloned().reduce(clearer).filter(|used| used.covered >= MOSTLY)?;
    if used.samples.len() == log.time_s.len() {
        return None;
    }
    let mut own = rows(log, used.samples.clone());
    let place = |run: &Run| {
        let [from, to] = [run.samples.start, run.samples.end - 1].map(|i| log.time_s[i]);
        format!("from {from:.1} to {to:.1} s ({:.0} % of it)", 100.0 * run.covered)
    };
    if runs.len() > 1 {
        own.warnings.push(format!(
            "the program runs {} times in this log: {}; that from {:.1} s on is used, and times count from there",
            runs.len(),
            runs.iter().map(place).collect::<Vec<String>>().join(", "),
            log.time_s[used.samples.start]
        ));
    }
    Some(own)
}

/// The runs of a stretch of the log in order; `placed`: which of its samples an alignment of all of them places.
fn apart(log: &Log, all: Run, placed: &[bool], shortest_s: f64, align: Align) -> Vec<Run> {
    let length = all.samples.len() as f64;
    let of = |samples: Range<usize>| {
        let found = align(&rows(log, samples.clone()));
        let run = found.filter(|(_, covered)| *covered >= COVERED);
        let (placed, covered) = run.map_or((Vec::new(), 0.0), |(aligned, covered)| (aligned.placed, covered));
        (Run { samples, placed: count(&placed), covered }, placed)
    };
    let split = |at: usize| {
        let middle = all.samples.start + at;
        [of(all.samples.start..middle), of(middle..all.samples.end)]
    };
    let together = |runs: &[(Run, Vec<bool>); 2]| runs[0].0.placed + runs[1].0.placed;
    let splits = borders(placed, &log.time_s[all.samples.clone()], shortest_s).into_iter().map(split);
    let better = |best: [(Run, Vec<bool>); 2], other| if together(&other) > together(&best) { other } else { best };
    match splits.reduce(better).filter(|runs| together(runs) as f64 > all.placed as f64 + MORE * length) {
        Some(runs) => runs.into_iter().flat_map(|(run, placed)| apart(log, run, &placed, shortest_s, align)).collect(),
        None => vec![all],
    }
}

fn count(placed: &[bool]) -> usize {
    placed.iter().filter(|placed| **placed).count()
}

/// Ends of the stretches that are not placed for so many seconds, the longest first; and of the longest gaps, if there are such stretches.
fn borders(placed: &[bool], time_s: &[f64], shortest_s: f64) -> Vec<usize> {
    let mut stretches: Vec<Range<usize>> = Vec::new();
    let mut at = 0;
    for same in placed.chunk_by(|a, b| a == b) {
        let end = at + same.len();
        if !same[0] && time_s[end - 1] - time_s[at] > shortest_s {
            stretches.push(at..end);
        }
        at = end;
    }
    if stretches.is_empty() {
        return Vec::new();
    }
    stretches.sort_by_key(|stretch| std::cmp::Reverse(stretch.len()));
    stretches.truncate(MOST_TRIED);
    let mut gaps = gaps(time_s);
    gaps.sort_by(|a, b| (b[1] - b[0]).total_cmp(&(a[1] - a[0])));
    let after_gaps = gaps.into_iter().take(MOST_TRIED).map(|[_, to_s]| time_s.partition_point(|time| *time < to_s));
    let ends = stretches.into_iter().flat_map(|stretch| [stretch.start, stretch.end]);
    ends.chain(after_gaps).filter(|at| (1..placed.len()).contains(at)).collect()
}

/// Some rows of a log; times count from the first.
fn rows(log: &Log, range: Range<usize>) -> Log {
    let start_s = log.time_s[range.start];
    let of = |values: &Vec<f64>| values[range.clone()].to_vec();
    Log {
        time_s: log.time_s[range.clone()].iter().map(|time| time - start_s).collect(),
        position_mm: log.position_mm.as_ref().map(|axes| [0, 1, 2].map(|axis| of(&axes[axis]))),
        line: log.line.as_ref().map(of),
        feed_mm_s: log.feed_mm_s.as_ref().map(of),
        rps: log.rps.as_ref().map(of),
        tool: log.tool.as_ref().map(of),
        measured: log.measured.iter().map(|(name, values)| (*name, of(values))).collect(),
        on_change: log.on_change,
        higher_mm: log.higher_mm,
        warnings: log.warnings.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A program of 100 lines, one a second; an alignment by lines that never go back.
    fn align(log: &Log) -> Option<(Aligned, f64)> {
        let lines = log.line.as_ref()?;
        let mut last = 0.0;
        let mut ahead = |line: &f64| {
            let is_ahead = *line >= last && *line <= last + 10.0;
            last = if is_ahead { *line } else { last };
            is_ahead
        };
        let placed: Vec<bool> = lines.iter().map(&mut ahead).collect();
        let covered = lines.iter().zip(&placed).filter(|(_, placed)| **placed).count() as f64 / 100.0;
        Some((Aligned { placed, ..Aligned::default() }, covered))
    }

    fn used(lines: impl Iterator<Item = u32>) -> Log {
        let line: Vec<f64> = lines.map(f64::from).collect();
        let log = Log { time_s: (0..line.len()).map(|k| k as f64).collect(), line: Some(line), ..Log::default() };
        let aligned = align(&log).unwrap().0;
        one_run(&log, &aligned, 5.0, &align).unwrap_or(log)
    }

    #[test]
    fn of_two_parts_the_first_is_used_and_both_are_said() {
        let own = used((1..=100).chain(1..=100).chain(1..=100));
        assert_eq!((own.time_s.len(), own.line.unwrap()[99]), (100, 100.0));
        assert!(own.warnings[0].contains("runs 3 times in this log: from 0.0 to 99.0 s (100 % of it), from 100.0"));
    }

    #[test]
    fn of_a_run_that_was_broken_off_and_a_whole_one_the_whole_one_is_used() {
        let own = used((1..=50).chain(1..=100));
        assert_eq!((own.time_s[0], own.line.unwrap()[0], own.time_s.len()), (0.0, 1.0, 100));
        assert!(own.warnings[0].contains("that from 50.0 s on is used"), "{:?}", own.warnings);
    }

    #[test]
    fn runs_of_less_than_half_of_the_program_are_none() {
        // Two runs that were broken off, the longer one just above or below half of the program.
        assert_eq!(used((1..=30).chain(1..=45)).time_s.len(), 75);
        assert_eq!(used((1..=30).chain(1..=55)).time_s.len(), 55);
    }

    #[test]
    fn a_second_run_of_a_few_lines_is_none() {
        // A tenth of the samples, and a twentieth of the program, are the least.
        assert_eq!(used((1..=100).chain(1..=20)).warnings.len(), 1);
        assert_eq!(used((1..=100).chain(1..=8)).warnings.len(), 0);
    }

    #[test]
    fn of_two_places_between_runs_the_one_with_the_gap_is_taken() {
        // The second run is followed for a while as if it went on with the first.
        let line: Vec<f64> = (1..=50).chain(45..=70).chain(1..=100).map(f64::from).collect();
        let time_s = (0..line.len()).map(|k| k as f64 + if k >= 50 { 60.0 } else { 0.0 }).collect();
        let log = Log { time_s, line: Some(line), ..Log::default() };
        let own = one_run(&log, &align(&log).unwrap().0, 5.0, &align).unwrap();
        assert_eq!(own.line.unwrap(), (1..=100).map(f64::from).collect::<Vec<f64>>());
    }

    #[test]
    fn one_run_with_other_lines_before_or_within_it_stays_whole() {
        for (before, within) in [(0, 0), (30, 0), (0, 30)] {
            let foreign = |n: usize| std::iter::repeat_n(500, n);
            let own = used(foreign(before).chain(1..=60).chain(foreign(within)).chain(61..=100));
            assert_eq!((own.time_s.len(), own.warnings.len()), (100 + before + within, 0));
        }
    }
}
