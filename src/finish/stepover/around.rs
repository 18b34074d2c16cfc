//! What the setup says to stand beside the surface. In: its stock, the surface, the thickness that is to be cut there, a written program. Out: what
//! of that stock the program meets beyond the edge of the surface.
//!
//! The program is planned and checked in the stock on the surface alone. A mesh of a part of the workpiece has walls around it that it does not
//! know: the tool comes down beside its edge, and its passes run on beyond it by up to their own width.

use super::check::{Simulated, on_surface_mm};
use super::surface::Surface;
use crate::engage::{EngageError, EventKind};
use crate::machine::{Box3, Job};
use crate::nc::Dialect;
use crate::schedule::as_programmed;
use crate::stock::{Blank, Piece, Relief};

/// Where stock beside the surface counts as standing there: higher than the lowest point of the surface by this, mm.
const STANDS_MM: f64 = 0.01;
/// Cells, mm, and most of them.
const CELL_MM: f64 = 0.1;
const CELLS: f64 = 2e6;
/// Most lines that are named.
const NAMED: usize = 4;

/// What the setup has as stock.
#[derive(Debug, Clone)]
pub struct Around {
    /// The piece, in coordinates of the surface.
    pub piece: Piece,
    /// An earlier program left it: it is no raw stock, of which some may be gone by now.
    pub is_left: bool,
}

/// Cells of raw stock, mm: those of the stock on the surface, but no more than so many.
pub fn cell_mm(extent: &Box3) -> f64 {
    let side = |axis: usize| extent.max[axis] - extent.min[axis];
    CELL_MM.max((side(0) * side(1) / CELLS).sqrt())
}

/// What a program meets of it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Met {
    /// Lines on which it is cut at rapid.
    pub rapid_lines: Vec<u32>,
    /// Largest force with it, N.
    pub force_n: f64,
}

impl Around {
    /// The stock with no more than `thickness_mm` left on the surface; `None`: nothing stands beside the surface.
    pub fn beside(&self, surface: &Surface, thickness_mm: f64) -> Option<Piece> {
        let field = &self.piece.field;
        let middle = |axis: usize, k: usize| field.extent.min[axis] + (k as f64 + 0.5) * field.cell[axis];
        let places = |k: usize| [middle(0, k % field.size[0]), middle(1, k / field.size[0])];
        let on_surface = on_surface_mm(surface, thickness_mm, field.size[0] * field.size[1], &places);
        let mut heights = field.by_row(|tile| &tile.heights);
        let mut stands = false;
        for (height, on_surface) in heights.iter_mut().zip(on_surface) {
            match on_surface {
                Some(top_mm) => *height = height.min(top_mm as f32),
                None => stands |= f64::from(*height) > surface.extent.min.z + STANDS_MM,
            }
        }
        let relief = Relief::from_rows(field.extent, field.size, heights);
        stands.then(|| Piece::uncut(Blank::Heights(Box::new(relief)), field.cell[0].max(field.cell[1])))
    }
}

impl Met {
    /// Of a program in this stock.
    pub fn by(text: &str, dialect: Dialect, job: &Job, piece: &Piece) -> Result<Self, EngageError> {
        let simulated = Simulated::new(text, dialect, job, piece)?;
        let line = |event: &crate::engage::Event| simulated.toolpath.moves[event.move_id.ix()].line;
        let struck = |kind: EventKind| {
            matches!(kind, EventKind::CutAtRapid | EventKind::ShankContact | EventKind::HolderContact)
        };
        let mut rapid_lines: Vec<u32> =
            simulated.map.events.iter().filter(|event| struck(event.kind)).map(line).collect();
        rapid_lines.dedup();
        let force = |station: &crate::engage::Station, line: &crate::force::LoadLine| {
            line.loads(simulated.toolpath.moves[station.move_id.ix()].feed.mm_s).force_xy_peak_n
        };
        let cuts = simulated.cuts(&as_programmed(&simulated.toolpath));
        let forces = cuts.iter().filter_map(|(station, line)| Some(force(station, line.as_ref()?)));
        Ok(Self { rapid_lines, force_n: forces.fold(0.0, f64::max) })
    }

    /// One sentence, if anything is met that a force of `held_n` does not allow.
    pub fn said(&self, held_n: f64) -> Option<String> {
        let named: Vec<String> = self.rapid_lines.iter().take(NAMED).map(ToString::to_string).collect();
        let more = if self.rapid_lines.len() > NAMED { ", …" } else { "" };
        let lines = if self.rapid_lines.len() == 1 { "line" } else { "lines" };
        let rapid = format!("at rapid on {lines} {}{more}", named.join(", "));
        let force = format!("with up to {:.0} N", self.force_n);
        let how = match (self.rapid_lines.is_empty(), self.force_n > held_n) {
            (true, false) => return None,
            (true, true) => force,
            (false, false) => rapid,
            (false, true) => format!("{rapid}, and {force}"),
        };
        Some(format!(
            "beyond the edge of the surface the program meets stock that the setup says to stand there, {how}"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::Met;

    #[test]
    fn what_is_met_is_one_sentence() {
        let said = |rapid_lines: &[u32], force_n: f64| Met { rapid_lines: rapid_lines.to_vec(), force_n }.said(10.0);
        assert_eq!(said(&[], 9.9), None);
        assert!(said(&[], 10.1).unwrap().ends_with("there, with up to 10 N"));
        assert!(said(&[7], 9.0).unwrap().ends_with("there, at rapid on line 7"));
        assert!(
            said(&[1, 2, 3, 4, 5], 20.0).unwrap().ends_with("at rapid on lines 1, 2, 3, 4, …, and with up to 20 N")
        );
    }
}
