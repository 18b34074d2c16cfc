//! A piece of stock: its blank, the cuts whose surfaces are still on it, the field that they left. In: a shape in mm, or the result of a program
//! ([`Piece::left`]). Out: the start of the next program, which finds the same exact walls as if both were one program: walls come from the
//! cuts, not from the cells.

use super::along::along;
use super::blank::{Blank, Relief};
use super::claim::claim;
use super::element::{Element, Track};
use super::field::{Field, UNTOUCHED, cells};
use super::form::Form;
use super::sweep::sweep;
use rayon::prelude::*;

/// A piece of stock.
#[derive(Debug, Clone)]
pub struct Piece {
    /// What it was before the first cut.
    pub blank: Blank,
    /// Its heights, and which of the cuts lowered each cell last.
    pub field: Field,
    /// The cuts, in order.
    pub cuts: Vec<Cut>,
    /// The outlines of the cutters.
    pub forms: Vec<Form>,
}

/// A cut of the past.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Where the tip of the cutter went.
    pub track: Track,
    /// Its outline, by index.
    pub form: u16,
    /// The cut before it ends where this one begins, with the same cutter.
    pub joined: bool,
}

impl Piece {
    /// Stock nothing has cut yet, in cells of at most `cell_mm`.
    pub fn uncut(blank: Blank, cell_mm: f64) -> Self {
        let field = blank.field(cell_mm);
        Self { blank, field, cuts: Vec::new(), forms: Vec::new() }
    }
    /// Stock with these heights, and in the cells of a field.
    pub fn of_relief(relief: Relief, field: Field) -> Self {
        Self { blank: Blank::Heights(Box::new(relief)), field, cuts: Vec::new(), forms: Vec::new() }
    }
    /// The piece that a program leaves of a blank, with the elements that cells still name and those along the path from them. `form` gives
    /// the outline of an element.
    pub fn left<'a>(blank: Blank, field: Field, elements: &[Element], form: impl Fn(&Element) -> &'a Form) -> Self {
        let kept = kept(&field, elements, &form);
        let (mut numbers, mut piece) =
            (vec![UNTOUCHED; elements.len()], Self { blank, field, cuts: Vec::new(), forms: Vec::new() });
        let mut form_of: Vec<Option<u16>> = Vec::new();
        for (number, element) in elements.iter().enumerate().filter(|(number, _)| kept[*number]) {
            numbers[number] = piece.cuts.len() as u32;
            let cutter = element.cutter as usize;
            form_of.resize(form_of.len().max(cutter + 1), None);
            let index = *form_of[cutter].get_or_insert_with(|| piece.number_of(form(element)));
            let joined = element.joined && number > 0 && kept[number - 1];
            piece.cuts.push(Cut { track: element.track, form: index, joined });
        }
        piece.field.renumber(|id| numbers[id as usize]);
        piece
    }
    /// Index of a form, which is added if it is new.
    fn number_of(&mut self, form: &Form) -> u16 {
        let known = self.forms.iter().position(|known| known.profile == form.profile);
        known.unwrap_or_else(|| {
            self.forms.push(form.clone());
            self.forms.len() - 1
        }) as u16
    }
    /// The same piece in cells of at most `cell_mm`; if its own cells differ, all cuts are swept again.
    pub fn in_cells(self, cell_mm: f64) -> Self {
        if self.field.size == cells(&self.field.extent, cell_mm) {
            return self;
        }
        let mut field = self.blank.field(cell_mm);
        let mut cuts_of: Vec<Vec<u32>> = vec![Vec::new(); field.tiles.len()];
        let tiling = field.tiling();
        for (id, Cut { track, form, .. }) in self.cuts.iter().enumerate() {
            let (low, high) = track.bounds();
            let reach = self.forms[*form as usize].radius + cell_mm;
            let under = tiling.tiles_under([low.x - reach, low.y - reach], [high.x + reach, high.y + reach]);
            under.for_each(|tile| cuts_of[tile].push(id as u32));
        }
        field.tiles.par_iter_mut().zip(cuts_of).for_each(|(tile, cuts)| {
            for id in cuts {
                let cut = |id: u32| {
                    let Cut { track, form, .. } = &self.cuts[id as usize];
                    (track, &self.forms[*form as usize])
                };
                let (track, form) = cut(id);
                sweep(tile, (track, false), form, id);
                claim(tile, id, false, cut);
            }
            tile.update_highest();
        });
        Self { field, ..self }
    }
}

/// By element: does a cell name it, or is it along the path from one that a cell names?
fn kept<'a>(field: &Field, elements: &[Element], form: impl Fn(&Element) -> &'a Form) -> Vec<bool> {
    let mut seen = vec![false; elements.len()];
    let ids = field.tiles.iter().flat_map(|tile| &tile.ids);
    ids.filter(|id| **id != UNTOUCHED).for_each(|id| seen[*id as usize] = true);
    let mut kept = seen.clone();
    let (cell_mm, until) = (field.cell[0].max(field.cell[1]), elements.len() as u32);
    for (id, element) in elements.iter().enumerate().filter(|(id, _)| seen[*id]) {
        along(elements, id as u32, (form(element), true), cell_mm, until).for_each(|id| kept[id as usize] = true);
    }
    kept
}
