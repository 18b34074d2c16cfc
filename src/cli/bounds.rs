//! Bounds of a run: memory of the whole process (`--max-memory`) and time (`--max-time`). In: the options. Out: nothing, or the end of
//! the process with one sentence, exit code 2 and nothing written.
//!
//! Some needs are known before and refused then (the height field). What grows while it is worked, as stations, pieces and reports do, is watched
//! from a thread of its own; where the system does not tell the memory of a process, only the first holds.

use std::time::{Duration, Instant};

use super::error::CliError;
use super::options::Global;
use super::screen::Screen;
use super::under_way;
use super::work::{memory, most_memory};

/// Time between two looks: what a run takes more meanwhile is some 20 MB (a core fills about 1 GB/s).
const LOOK: Duration = Duration::from_millis(20);

/// Watches from now on.
pub fn keep(global: &Global, screen: Screen) -> Result<(), CliError> {
    if let Some(most_s) = global.max_time.filter(|most_s| !(*most_s > 0.0 && most_s.is_finite())) {
        return Err(CliError::new(format!("--max-time {most_s} makes no sense"), "give a number of seconds above 0"));
    }
    let (most, most_s) = (most_memory(global), global.max_time);
    let begun = Instant::now();
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(LOOK);
            let over = over(memory(), most).or_else(|| late(begun.elapsed().as_secs_f64(), most_s));
            if let Some(error) = over {
                under_way::end(error.exit_code().into(), || screen.fail(&error));
            }
        }
    });
    Ok(())
}

fn over(now: Option<u64>, most: Option<u64>) -> Option<CliError> {
    let most = most.filter(|most| now.is_some_and(|now| now > *most))?;
    Some(CliError::new(
        format!("the run needs more than the {} MiB that it may take", most >> 20),
        "nothing was written; allow more with --max-memory, or take a coarser --resolution, a shorter program, fewer reports",
    ))
}

fn late(elapsed_s: f64, most_s: Option<f64>) -> Option<CliError> {
    let most_s = most_s.filter(|most_s| elapsed_s > *most_s)?;
    Some(CliError::new(
        format!("the run takes longer than the {most_s} s that it may take"),
        "nothing was written; allow more with --max-time, or take a coarser --resolution",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_is_kept_on_both_sides() {
        assert!(over(Some(100), Some(100)).is_none() && over(Some(101), Some(100)).is_some());
        assert!(over(Some(u64::MAX), None).is_none() && over(None, Some(1)).is_none());
        assert!(late(2.0, Some(2.0)).is_none() && late(2.1, Some(2.0)).is_some());
        assert!(late(1e9, None).is_none());
    }
}
