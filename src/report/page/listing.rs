//! The program beside what was written for it. In: both texts. Out: a row for every line of the original with the lines that
//! stand for it now.

use crate::nc;
use crate::outcome::ProgramRun;
use crate::rewrite::verify::written_for;

/// Bytes of both programs up to which every line is listed; above that, the lines the views point at.
const WHOLE_BYTES: usize = 6 << 20;

/// Line, its text, and what stands in its place; `None`: the same.
pub type Row = (u32, String, Option<Vec<String>>);

/// The listing, and the changed lines of the whole program.
#[derive(Debug)]
pub struct Listing {
    /// Rows by line.
    pub rows: Vec<Row>,
    /// Lines of the original that were changed.
    pub changed: usize,
    /// Lines of the original.
    pub lines: usize,
}

/// The listing of a run; `shown` are the lines that must be in it.
pub fn listing(run: &ProgramRun, shown: &[u32]) -> Listing {
    let original = nc::parse(run.program.own_text().to_vec(), Some(run.program.dialect()));
    let lines = original.len();
    let text = |program: &nc::Program, block| {
        String::from_utf8_lossy(program.line_text(block)).trim_end_matches(['\r', '\n']).to_owned()
    };
    let mut news: Vec<Vec<String>> = vec![Vec::new(); lines];
    if let Some(written) = &run.written {
        let rewritten = nc::parse(written.bytes.clone(), Some(original.dialect()));
        for (block, line) in rewritten.blocks().zip(written_for(&original, &rewritten, run.toolpath.inch)) {
            if let Some(of) = news.get_mut(line) {
                of.push(text(&rewritten, block));
            }
        }
    }
    let bytes = run.program.own_text().len() + run.written.as_ref().map_or(0, |written| written.bytes.len());
    let mut wanted = vec![bytes <= WHOLE_BYTES; lines];
    for line in shown {
        if let Some(one) = wanted.get_mut((*line as usize).wrapping_sub(1)) {
            *one = true;
        }
    }
    let (mut rows, mut changed) = (Vec::new(), 0);
    for ((index, block), new) in original.blocks().enumerate().zip(news) {
        let old = text(&original, block);
        let same = run.written.is_none() || new.len() == 1 && new[0] == old;
        changed += usize::from(!same);
        if wanted[index] {
            rows.push((index as u32 + 1, old, (!same).then_some(new)));
        }
    }
    Listing { rows, changed, lines }
}
