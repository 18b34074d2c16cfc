//! The columns that passes side by side are planned in. In: the tool on the surface, a box. Out: columns along X, each with the stretches of Y
//! on which the surface is machined; places on it.

use super::reach::{Place, ToolOnSurface};
use crate::numeric::bisect;
use rayon::prelude::*;

/// The columns, each with the stretches of Y on which the surface is machined. They are evenly spaced, with more of them where ground
/// between two would be missed.
pub struct Columns {
    /// X of each, rising, mm.
    pub at_mm: Vec<f64>,
    /// Largest distance of two, mm.
    pub column_mm: f64,
    /// The stretches of each, rising, mm.
    pub stretches: Vec<Vec<[f64; 2]>>,
}

/// Bisections for the end of a stretch: of 0.5 mm to 0.12 µm.
pub const HALVINGS: u32 = 12;
/// Ground between two columns that neither of them meets is looked for at so many parts of their distance: ground narrower than a part may be
/// missed. Judgement: 0.06 mm, a fiftieth of the radius of a 6 mm tool.
const PARTS: f64 = 8.0;
impl Columns {
    /// Finds where the tool touches the machined surface, in columns at most `column_mm` apart and rows `fine_mm` apart.
    pub fn new(on_surface: &ToolOnSurface, low: [f64; 2], high: [f64; 2], column_mm: f64, fine_mm: f64) -> Self {
        let reach = on_surface.shape().radius_mm();
        let [count, rows] = [(0, column_mm), (1, fine_mm)]
            .map(|(axis, apart_mm)| ((high[axis] - low[axis] + 2.0 * reach) / apart_mm).ceil() as usize + 1);
        let even: Vec<f64> = (0..count).map(|i| low[0] - reach + i as f64 * column_mm).collect();
        let rows: Vec<f64> = (0..rows).map(|j| low[1] - reach + j as f64 * fine_mm).collect();
        let on = |x: f64, y: f64| is_on(on_surface, [x, y]);
        let missed = |two: &[f64]| {
            let mut missed = Vec::new();
            between(&on, [two[0], two[1]], (&rows, column_mm / PARTS), &mut missed);
            missed
        };
        let missed: Vec<Vec<f64>> = even.par_windows(2).map(missed).collect();
        let mut at_mm = even;
        at_mm.extend(missed.into_iter().flatten());
        at_mm.sort_by(f64::total_cmp);
        let stretches = at_mm.par_iter().map(|x| stretches_of(&|y| on(*x, y), &rows)).collect();
        Self { at_mm, column_mm, stretches }
    }

    /// Places over the machined surface, about `apart_mm` apart, with their areas. These add up to the whole: where a row of places stands
    /// for a strip that ends before the surface does, or beyond it, all count as much more or less.
    pub fn places(&self, apart_mm: f64) -> Vec<Place> {
        let wide_mm = (apart_mm / self.column_mm).round().max(1.0) * self.column_mm;
        let Some([first, last]) = self.at_mm.first().zip(self.at_mm.last()).map(|(a, b)| [*a, *b]) else {
            return Vec::new();
        };
        let mut places = Vec::new();
        for k in 0..((last - first) / wide_mm).ceil() as usize {
            let middle = first + (k as f64 + 0.5) * wide_mm;
            let i = self.at_mm.partition_point(|x| *x < middle).min(self.at_mm.len() - 1);
            for [from, to] in &self.stretches[i] {
                let rows = ((to - from) / apart_mm).ceil().max(1.0);
                let row = (to - from) / rows;
                let place = |j: usize| ([self.x(i), from + (j as f64 + 0.5) * row], row * wide_mm);
                places.extend((0..rows as usize).map(place));
            }
        }
        let [counted, whole] = [places.iter().map(|(_, area)| area).sum(), self.area_mm2()];
        for (_, area) in &mut places {
            *area *= whole / f64::max(counted, f64::MIN_POSITIVE);
        }
        places
    }

    /// Area of the machined surface between its outermost columns seen from above, mm².
    fn area_mm2(&self) -> f64 {
        let long = |i: usize| self.stretches[i].iter().map(|[from, to]| to - from).sum::<f64>();
        let strip = |i: usize| {
            let [a, b] = [long(i - 1), long(i)];
            if a > 0.0 && b > 0.0 { 0.5 * (a + b) * (self.at_mm[i] - self.at_mm[i - 1]) } else { 0.0 }
        };
        (1..self.at_mm.len()).map(strip).sum()
    }

    /// X of a column, mm.
    pub fn x(&self, i: usize) -> f64 {
        self.at_mm[i]
    }

    /// The two columns beside an X, the nearer one first.
    pub fn beside(&self, x: f64) -> [usize; 2] {
        let after = self.at_mm.partition_point(|at| *at < x).min(self.at_mm.len() - 1);
        let before = after.saturating_sub(1);
        if x - self.at_mm[before] < self.at_mm[after] - x { [before, after] } else { [after, before] }
    }

    /// Width of the ground of a column, mm: half way to the next one on either side.
    pub fn width(&self, i: usize) -> f64 {
        let last = self.at_mm.len() - 1;
        0.5 * (self.at_mm[(i + 1).min(last)] - self.at_mm[i.saturating_sub(1)])
    }

    /// Is the surface machined at this Y of a column?
    pub fn on(&self, i: usize, y: f64) -> bool {
        self.stretch(i, y).is_some()
    }

    /// The stretch that this Y of a column lies on, mm.
    pub fn stretch(&self, i: usize, y: f64) -> Option<[f64; 2]> {
        let slack = 1e-6;
        self.stretches[i].iter().find(|[from, to]| (from - slack..=to + slack).contains(&y)).copied()
    }

    /// Place in the next stretch of a column above a Y, mm, at most so far behind its start; infinite if there is none.
    pub fn start(&self, i: usize, y: f64, late_mm: f64) -> f64 {
        let next = self.stretches[i].iter().find(|[from, _]| *from > y + 1e-6);
        next.map_or(f64::INFINITY, |[from, to]| (from + late_mm).min(*to))
    }
}

/// Does the tool touch the machined surface at a place, and not its rim?
pub fn is_on(on_surface: &ToolOnSurface, p: [f64; 2]) -> bool {
    on_surface.dropper.drop(p).is_some_and(|contact| !contact.rim)
}

/// X between two columns at which more are needed, mm: where some row meets ground that ends before both, in the middle of the widest.
fn between(on: &dyn Fn(f64, f64) -> bool, [from, to]: [f64; 2], (rows, part_mm): (&[f64], f64), found: &mut Vec<f64>) {
    let count = ((to - from) / part_mm - 1e-6).ceil() as usize;
    let looks = (1..count).map(|k| from + (to - from) * k as f64 / count as f64);
    let mut widest: Option<[f64; 2]> = None;
    for y in rows.iter().filter(|y| !on(from, **y) && !on(to, **y)) {
        let Some(x) = looks.clone().find(|x| on(*x, *y)) else { continue };
        let here = [from, to].map(|out| border(&|x| on(x, *y), out, x));
        if widest.is_none_or(|known| here[1] - here[0] > known[1] - known[0]) {
            widest = Some(here);
        }
    }
    if let Some([low, high]) = widest {
        let middle = 0.5 * (low + high);
        between(on, [from, middle], (rows, part_mm), found);
        found.push(middle);
        between(on, [middle, to], (rows, part_mm), found);
    }
}

/// The stretches of a column on which `on` holds, looked for at some rows.
fn stretches_of(on: &dyn Fn(f64) -> bool, rows: &[f64]) -> Vec<[f64; 2]> {
    let (mut found, mut begin, mut before) = (Vec::new(), None, false);
    for j in 0..=rows.len() {
        let here = j < rows.len() && on(rows[j]);
        if here && !before {
            begin = Some(if j == 0 { rows[0] } else { border(on, rows[j - 1], rows[j]) });
        }
        if let (true, false, Some(begin)) = (before, here, begin) {
            let out = rows.get(j).copied().unwrap_or(2.0 * rows[j - 1] - rows[j.saturating_sub(2)]);
            found.push([begin, border(on, out, rows[j - 1])]);
        }
        before = here;
    }
    found
}

/// Border between a place where `on` is false and one where it is true, on the true side.
fn border(on: &dyn Fn(f64) -> bool, out: f64, inside: f64) -> f64 {
    bisect(on, inside, out, HALVINGS)[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A surface 12 mm wide and 10 mm long, in columns of 0.5 mm with room on either side.
    #[test]
    fn areas_of_places_add_up_to_that_of_the_surface_at_any_distance() {
        let at_mm: Vec<f64> = (0..=36).map(|i| -3.0 + 0.5 * f64::from(i)).collect();
        let stretches = at_mm.iter().map(|x| if (0.0..=12.0).contains(x) { vec![[0.0, 10.0]] } else { vec![] });
        let columns = Columns { stretches: stretches.collect(), at_mm, column_mm: 0.5 };
        for apart_mm in [0.4, 0.8, 1.1, 1.7, 2.3, 5.0] {
            let area: f64 = columns.places(apart_mm).iter().map(|(_, area)| area).sum();
            assert!((area - 120.0).abs() < 1e-9, "{apart_mm} mm apart: {area} mm²");
        }
    }
}
