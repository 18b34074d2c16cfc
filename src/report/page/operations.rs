//! The operations a page tells apart: runs of one tool under one comment of the program. In: a run and the sections of its
//! text. Out: their names, and the time each takes.

use serde::Serialize;

use crate::nc::{Move, Toolpath};
use crate::outcome::ProgramRun;
use crate::schedule::operations::Section;

/// One operation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Operation {
    /// "T1 ROUGH POCKET".
    pub name: String,
    /// Time of its moves before and after, s.
    pub time_s: [f64; 2],
}

/// Operations in the order of their first moves.
#[derive(Debug, Default)]
pub struct Operations {
    first_lines: Vec<u32>,
    /// Tool and section of each.
    keys: Vec<(u32, usize)>,
    /// Names and times.
    pub all: Vec<Operation>,
}

impl Operations {
    /// Of a run.
    pub fn new(run: &ProgramRun, sections: &[Section]) -> Self {
        let mut found = Self { first_lines: sections.iter().map(|s| s.first_line).collect(), ..Self::default() };
        found.name(&run.toolpath, sections);
        for (side, realised) in [&run.realised_before, run.realised_after()].into_iter().enumerate() {
            for (motion, seconds) in run.toolpath.moves.iter().zip(&realised.move_s) {
                let at = found.of(motion);
                found.all[at].time_s[side] += seconds;
            }
        }
        found
    }

    fn name(&mut self, toolpath: &Toolpath, sections: &[Section]) {
        for motion in &toolpath.moves {
            let key = self.key(motion);
            if self.keys.last() == Some(&key) || self.keys.contains(&key) {
                continue;
            }
            let (tool, section) = key;
            let comment = section.checked_sub(1).map_or("", |at| sections[at].name.as_str());
            self.keys.push(key);
            self.all.push(Operation { name: format!("T{tool} {comment}").trim_end().to_owned(), time_s: [0.0; 2] });
        }
    }

    fn key(&self, motion: &Move) -> (u32, usize) {
        (motion.tool, self.first_lines.partition_point(|first| *first <= motion.line))
    }

    /// Number of the operation of a move.
    pub fn of(&self, motion: &Move) -> usize {
        let key = self.key(motion);
        self.keys.iter().position(|known| *known == key).unwrap_or(0)
    }
}
