//! The steep part of a surface, for passes of one height: machined, with at least a given slope. In: a grid of heights,
//! the slope. Out: the stretches of such passes at a height, and places on that part.

use super::drop::{Contact, Dropper};
use super::levels::{Curve, Grid, downhill, onto};
use super::reach::Place;
use crate::numeric::bisect;
use rayon::prelude::*;

/// Shortest of several stretches of a curve, and longest gap of shallower ground that is bridged, in tool radii: about the length of a lead.
/// Judgement.
const SHORT: f64 = 1.0;
/// Shortest stretch, mm: a digit of a program.
const LEAST_MM: f64 = 1e-3;
/// Largest distance to a neighbouring node, in sides of a cell: the diagonal.
const NEXT: f64 = std::f64::consts::SQRT_2;
/// Least distance of points of a curve, in sides of a cell.
const APART: f64 = 0.4;
/// Bisections for the end of a stretch: from 0.5 mm to 0.5 µm.
const HALVINGS: u32 = 10;

/// The steep part of a surface.
#[derive(Debug)]
pub struct Steep {
    grid: Grid,
    /// Cosine of the least slope.
    flattest: f64,
}

/// Kind of ground under a point of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Under {
    /// Steep ground.
    Steep,
    /// Shallower ground.
    Shallow,
    /// The end of the surface.
    Rim,
}

impl Steep {
    /// The part with a slope of at least `shallowest_rad`.
    pub fn new(grid: Grid, shallowest_rad: f64) -> Self {
        Self { grid, flattest: shallowest_rad.cos() }
    }

    /// Is this contact on the steep part?
    pub fn holds(&self, contact: &Contact) -> bool {
        self.under(Some(contact)) == Under::Steep
    }

    fn under(&self, contact: Option<&Contact>) -> Under {
        match contact {
            None => Under::Rim,
            Some(contact) if contact.rim => Under::Rim,
            Some(contact) if contact.normal.z > self.flattest => Under::Shallow,
            Some(_) => Under::Steep,
        }
    }

    /// Sine of the least slope.
    pub fn least_sine(&self) -> f64 {
        (1.0 - self.flattest * self.flattest).sqrt()
    }

    /// Highest tip on it below a height, mm: from the highest node of the grid uphill to the end of the steep part.
    pub fn highest_below(&self, dropper: &Dropper, below_mm: f64) -> Option<f64> {
        let held = self.grid.contacts(1).filter(|(_, contact)| self.holds(contact) && contact.tip_mm < below_mm);
        let (p, highest) = held.reduce(|a, b| if b.1.tip_mm > a.1.tip_mm { b } else { a })?;
        let Some(down) = downhill(highest) else { return Some(highest.tip_mm) };
        let drop = |by_mm: f64| dropper.drop([0, 1].map(|axis| p[axis] - by_mm * down[axis]));
        let on = |by_mm: f64| drop(by_mm).is_some_and(|c| self.holds(&c) && c.tip_mm >= highest.tip_mm);
        // The next node uphill is not on it, or it would be the highest.
        let top = drop(bisect(on, 0.0, NEXT * self.grid.cell_mm(), HALVINGS)[0])?.tip_mm;
        Some(top.min(below_mm))
    }

    /// Places on it, about `apart_mm` apart, with their areas.
    pub fn places(&self, apart_mm: f64) -> Vec<Place> {
        let cell = self.grid.cell_mm();
        let stride = ((apart_mm / cell).floor() as usize).max(1);
        let area_mm2 = (stride as f64 * cell).powi(2);
        self.grid.contacts(stride).filter(|(_, contact)| self.holds(contact)).map(|(p, _)| (p, area_mm2)).collect()
    }

    /// Stretches on it at a height, each with the higher ground on its right.
    pub fn stretches(&self, dropper: &Dropper, level_mm: f64) -> Vec<Curve> {
        let short_mm = short_mm(dropper);
        let curves = self.grid.curves(dropper, level_mm);
        curves
            .into_iter()
            .flat_map(|curve| without_crumbs(self.cut(dropper, curve, level_mm, short_mm), short_mm))
            .collect()
    }

    /// Its borders, with it on their right and under their points; between these it ends within `within_mm` of the chord.
    pub fn borders(&self, dropper: &Dropper, within_mm: f64) -> Vec<Curve> {
        let fitted = |mut curve: Curve| {
            thin(&mut curve.points, APART * self.grid.cell_mm());
            let first = curve.points.first().copied().filter(|_| curve.closed);
            let ends: Vec<[f64; 2]> = curve.points.iter().copied().chain(first).collect();
            let between = |two: &[[f64; 2]]| {
                let mut points = vec![two[0]];
                self.closer([two[0], two[1]], dropper, within_mm, &mut points);
                points
            };
            let last = ends.last().copied().filter(|_| !curve.closed);
            let points: Vec<Vec<[f64; 2]>> = ends.par_windows(2).map(between).collect();
            Curve { points: points.into_iter().flatten().chain(last).collect(), ..curve }
        };
        self.grid.borders(dropper, &|contact| self.holds(contact)).into_iter().map(fitted).collect()
    }

    /// Points of a border between two of its points, by repeated halving, until it lies within `within_mm` of its chords.
    fn closer(&self, [a, b]: [[f64; 2]; 2], dropper: &Dropper, within_mm: f64, out: &mut Vec<[f64; 2]>) {
        let [x, y] = [b[0] - a[0], b[1] - a[1]];
        let apart = x.hypot(y);
        if apart <= within_mm {
            return;
        }
        let to_left = |by: f64| [0.5 * (a[0] + b[0]) - by * y / apart, 0.5 * (a[1] + b[1]) + by * x / apart];
        let on = |by: f64| dropper.drop(to_left(by)).is_some_and(|contact| self.holds(&contact));
        let far = 0.5 * apart;
        let by = match [-far, 0.0, far].map(on) {
            [_, true, true] => far,
            [_, true, false] => bisect(on, 0.0, far, HALVINGS)[0],
            [true, false, _] => bisect(on, -far, 0.0, HALVINGS)[0],
            [false, false, _] => return,
        };
        if by.abs() <= within_mm {
            return;
        }
        let middle = to_left(by);
        self.closer([a, middle], dropper, within_mm, out);
        out.push(middle);
        self.closer([middle, b], dropper, within_mm, out);
    }

    /// The stretches of a curve.
    fn cut(&self, dropper: &Dropper, mut curve: Curve, level_mm: f64, short_mm: f64) -> Vec<Curve> {
        thin(&mut curve.points, APART * self.grid.cell_mm());
        let under = |p: &[f64; 2]| self.under(dropper.drop(*p).as_ref());
        let mut all: Vec<([f64; 2], Under)> = curve.points.par_iter().map(|p| (*p, under(p))).collect();
        let mut kept: Vec<bool> = all.iter().map(|(_, under)| *under == Under::Steep).collect();
        bridge(&all, &mut kept, curve.closed, short_mm);
        if curve.closed && kept.iter().all(|kept| *kept) {
            return vec![Curve { points: all.into_iter().map(|(p, _)| p).collect(), closed: true }];
        }
        // Rotated to start at a gap, so that no stretch of a closed curve wraps around.
        let first_gap = kept.iter().position(|kept| !kept).filter(|_| curve.closed).unwrap_or(0);
        all.rotate_left(first_gap);
        kept.rotate_left(first_gap);
        let border = |inside: usize, out: usize| self.border(dropper, all[inside].0, all[out].0, level_mm);
        let mut stretches = Vec::new();
        let mut k = 0;
        while k < kept.len() {
            let to = k + kept[k..].iter().position(|kept| !kept).unwrap_or(kept.len() - k);
            if to > k {
                let before = if k > 0 { Some(k - 1) } else { None };
                let after = if to < all.len() { Some(to) } else { Some(0).filter(|_| curve.closed) };
                let begin = before.and_then(|before| border(k, before));
                let end = after.and_then(|after| border(to - 1, after));
                let points = begin.into_iter().chain(all[k..to].iter().map(|(p, _)| *p)).chain(end).collect();
                stretches.push(Curve { points, closed: false });
            }
            k = to.max(k + 1);
        }
        stretches
    }

    /// End of the steep part between a point of a curve on it and the next one outside.
    fn border(&self, dropper: &Dropper, inside: [f64; 2], out: [f64; 2], level_mm: f64) -> Option<[f64; 2]> {
        let far_mm = (out[0] - inside[0]).hypot(out[1] - inside[1]);
        let at =
            |t: f64| onto(dropper, [0, 1].map(|axis| inside[axis] + t * (out[axis] - inside[axis])), level_mm, far_mm);
        let on = |t: f64| at(t).and_then(|p| dropper.drop(p)).is_some_and(|contact| self.holds(&contact));
        let t = bisect(on, 0.0, 1.0, HALVINGS)[0];
        at(t).filter(|_| t * far_mm > 1e-3)
    }
}

/// The stretches of a curve without short ones. Where a curve runs along a rim it is broken into many, which are not worth a lead each; the one
/// stretch of a curve goes from rim to rim of a corner.
fn without_crumbs(mut stretches: Vec<Curve>, short_mm: f64) -> Vec<Curve> {
    let least_mm = if stretches.len() == 1 { LEAST_MM } else { short_mm };
    stretches.retain(|stretch| length_mm(stretch) >= least_mm);
    stretches
}

/// Shortest of several stretches, and longest gap that is bridged, mm.
pub fn short_mm(dropper: &Dropper) -> f64 {
    SHORT * dropper.shape().radius_mm()
}

/// Keeps gaps of shallow ground (without rim) shorter than `short_mm` between two kept points.
pub fn bridge(all: &[([f64; 2], Under)], kept: &mut [bool], closed: bool, short_mm: f64) {
    let count = all.len();
    let Some(first) = kept.iter().position(|kept| *kept) else { return };
    let (mut last, mut gap_mm, mut rim) = (first, 0.0, false);
    let end = if closed { first + count } else { count - 1 };
    for k in first + 1..=end {
        let [a, b] = [k - 1, k].map(|k| all[k % count].0);
        gap_mm += (b[0] - a[0]).hypot(b[1] - a[1]);
        rim |= all[k % count].1 == Under::Rim;
        if kept[k % count] {
            if !rim && gap_mm < short_mm {
                (last + 1..k).for_each(|k| kept[k % count] = true);
            }
            (last, gap_mm, rim) = (k, 0.0, false);
        }
    }
}

/// Removes points closer than `apart_mm` to the one before, except the ends.
pub fn thin(points: &mut Vec<[f64; 2]>, apart_mm: f64) {
    let last = points.len().saturating_sub(1);
    let mut before: Option<[f64; 2]> = None;
    let mut number = 0;
    points.retain(|p| {
        let far = before.is_none_or(|q| (p[0] - q[0]).hypot(p[1] - q[1]) >= apart_mm);
        let keep = far || number == last;
        number += 1;
        if keep {
            before = Some(*p);
        }
        keep
    });
}

/// Length of a curve, mm.
pub fn length_mm(curve: &Curve) -> f64 {
    let apart = |a: &[f64; 2], b: &[f64; 2]| (b[0] - a[0]).hypot(b[1] - a[1]);
    let open: f64 = curve.points.windows(2).map(|two| apart(&two[0], &two[1])).sum();
    match curve.points.as_slice() {
        [first, .., last] if curve.closed => open + apart(last, first),
        _ => open,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(kinds: &str) -> Vec<([f64; 2], Under)> {
        let under = |letter: char| match letter {
            's' => Under::Steep,
            'f' => Under::Shallow,
            _ => Under::Rim,
        };
        kinds.chars().enumerate().map(|(k, letter)| ([k as f64, 0.0], under(letter))).collect()
    }

    /// Points 1 mm apart: a gap of two shallow ones is 3 mm long.
    #[test]
    fn short_gaps_of_shallow_ground_are_passed_over_and_ends_of_the_surface_are_not() {
        let kept = |kinds: &str, short_mm: f64| {
            let all = line(kinds);
            let mut kept: Vec<bool> = all.iter().map(|(_, under)| *under == Under::Steep).collect();
            bridge(&all, &mut kept, false, short_mm);
            kept.iter().map(|kept| if *kept { 'k' } else { '.' }).collect::<String>()
        };
        assert_eq!(kept("fssffssf", 3.1), ".kkkkkk.");
        assert_eq!(kept("fssffssf", 2.9), ".kk..kk.");
        assert_eq!(kept("fssfrssf", 3.1), ".kk..kk.");
        assert_eq!(kept("ffff", 3.1), "....");
    }

    #[test]
    fn a_short_stretch_stays_where_it_is_the_only_one() {
        let of = |length_mm: f64| Curve { points: vec![[0.0, 0.0], [length_mm, 0.0]], closed: false };
        let kept = |lengths_mm: &[f64]| without_crumbs(lengths_mm.iter().copied().map(of).collect(), 3.0).len();
        assert_eq!([kept(&[0.1]), kept(&[2.9, 3.1]), kept(&[3.1, 3.1]), kept(&[0.1, 0.1]), kept(&[])], [1, 1, 2, 0, 0]);
    }

    #[test]
    fn points_are_thinned_but_for_the_ends() {
        let mut points = vec![[0.0, 0.0], [0.1, 0.0], [0.3, 0.0], [0.35, 0.0]];
        thin(&mut points, 0.2);
        assert_eq!(points, [[0.0, 0.0], [0.3, 0.0], [0.35, 0.0]]);
    }
}
