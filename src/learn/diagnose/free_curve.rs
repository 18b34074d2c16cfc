//! A free curve through a residual: by which share s(x) of the load l the reading exceeds the prediction, r ≈ s(x)·l,
//! over one covariate x. In: held-out residuals, the load, values of the covariate. Out: [`Curve`], and the residuals
//! it leaves in folds that it was not learned on.
//!
//! At every value of the covariate A = Σ w l² and B = Σ w l r are summed (weight w). *Steps* (a regression tree of one
//! variable, Breiman and others 1984): the range is split again and again where Σ B²/A over the parts, the reduction of
//! the squares, grows most; the share of a part is ΣB/ΣA. *Bends*: a piecewise linear function with knots at equal sums
//! of A, by least squares.

use crate::effects::Covariate;
use crate::effects::unnamed::{CURVES, KNOTS};
use crate::learn::dataset::samples::Data;
use crate::learn::model::cross_validation::Split;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Fewest samples in a part, absolute and as a share of all: fewer may be outliers or the end of a move. Judgement.
const FEWEST: usize = 6;
const LEAST_PART: f64 = 0.01;
/// Fewest samples for a curve.
const FEWEST_IN_ALL: usize = 4 * FEWEST;
/// Values of a covariate that differ by less, relative to its range, are merged: a machine that holds 1852 mm/min does
/// not repeat that to the last digit. Judgement.
const SAME: f64 = 1e-3;
/// Share added to each diagonal element of the normal matrix, so that coefficients without data are 0.
const RIDGE: f64 = 1e-9;

/// The shape of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Piecewise constant, with this number of parts.
    Steps(usize),
    /// Piecewise linear, with this number of knots.
    Bends(usize),
}

/// Shapes that are tried, from few parameters to many.
const SHAPES: [Shape; 7] = [
    Shape::Steps(2),
    Shape::Bends(3),
    Shape::Steps(3),
    Shape::Steps(4),
    Shape::Bends(5),
    Shape::Steps(6),
    Shape::Bends(KNOTS),
];

/// Share of the load by which the reading exceeds the prediction, over one covariate: linear between knots or constant
/// from each knot to the next, and constant beyond the first and the last.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// (covariate, share) in rising order; for steps the first is the least value of the covariate.
    pub knots: Vec<[f64; 2]>,
    /// Σ w l² about each knot, or in each part.
    pub weight: Vec<f64>,
    /// Is it constant from each knot to the next?
    pub in_steps: bool,
}

impl Curve {
    /// The two knots that a value of the covariate lies between, with their weights in the interpolation.
    fn knot_shares(&self, x: f64) -> [(usize, f64); 2] {
        let n = self.knots.len();
        let next = self.knots.partition_point(|knot| knot[0] <= x);
        let last = next.saturating_sub(1);
        if self.in_steps || next == 0 || next == n {
            return [(last, 1.0), (last, 0.0)];
        }
        let share = (x - self.knots[last][0]) / (self.knots[next][0] - self.knots[last][0]);
        [(last, 1.0 - share), (next, share)]
    }

    /// Share at a value of the covariate; 0 if that is NaN.
    #[cfg(test)]
    pub fn at(&self, x: f64) -> f64 {
        self.share_before(self.knots.partition_point(|knot| knot[0] <= x), x)
    }

    /// The same, given the index of the first knot beyond the value.
    fn share_before(&self, next: usize, x: f64) -> f64 {
        match (next.checked_sub(1).map(|k| self.knots[k]), self.knots.get(next)) {
            _ if x.is_nan() => 0.0,
            (None, None) => 0.0,
            (None, Some(first)) => first[1],
            (Some(last), None) => last[1],
            (Some(last), Some(_)) if self.in_steps => last[1],
            (Some(a), Some(b)) => a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1]),
        }
    }
}

/// The best curve of a residual.
#[derive(Debug, Clone)]
pub struct CurveFit {
    /// Learned on all folds.
    pub curve: Curve,
    /// The residuals less the curve learned on the other folds.
    pub left: Vec<f64>,
    /// Σ w r² of that.
    pub squares: f64,
}

/// The samples in order of a covariate.
#[derive(Debug, Clone)]
pub struct Along {
    /// Value of the covariate in each sample.
    pub values: Vec<f64>,
    /// Samples with a finite value, in rising order of it.
    order: Vec<usize>,
}

impl Along {
    /// Sorts the samples by these values.
    pub fn new(values: Vec<f64>) -> Self {
        let mut order: Vec<usize> = (0..values.len()).filter(|i| values[*i].is_finite()).collect();
        order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
        Self { values, order }
    }
}

/// The samples in order of each covariate that a curve may follow. Where all cuts have one diameter, the spindle speed says all that the
/// cutting speed does.
pub fn along_all(data: &Data) -> Vec<(Covariate, Along)> {
    let mut covariates: Vec<Covariate> = CURVES.iter().map(|(covariate, _)| *covariate).collect();
    covariates.dedup();
    if has_one_diameter(data) {
        covariates.retain(|covariate| *covariate != Covariate::CuttingSpeed);
    }
    let along = |covariate: &Covariate| Along::new(data.state.iter().map(|state| covariate.of(state)).collect());
    covariates.par_iter().map(|covariate| (*covariate, along(covariate))).collect()
}

/// Do all cuts have the same cutting speed per spindle speed, to 1 %?
fn has_one_diameter(data: &Data) -> bool {
    let per_turn = data.state.iter().map(|state| state.cutting_speed_mm_s / state.rps).filter(|mm| *mm > 0.0);
    let [least, most] = per_turn.fold([f64::INFINITY, 0.0], |[a, b]: [f64; 2], mm| [a.min(mm), b.max(mm)]);
    most <= 1.01 * least
}

/// Sums at a value of the covariate; see the head of the file.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    at: f64,
    samples: usize,
    a: f64,
    b: f64,
}

/// What a curve is fitted to.
pub struct Residual<'a> {
    /// Samples.
    pub data: &'a Data,
    /// Folds.
    pub split: &'a Split,
    /// Held-out residuals.
    pub left: &'a [f64],
    /// The load that the curve multiplies.
    pub load: &'a [f64],
}

impl Residual<'_> {
    /// The curve with the least squares in folds that it was not learned on, among the shapes that `may_be` accepts; a
    /// shape of more parameters must lower the squares by [`RICHER`]. `None` if the covariate does not vary, is known
    /// for too few samples, or no shape is accepted.
    pub fn best_curve(&self, along: &Along, may_be: impl Fn(&Curve) -> bool) -> Option<CurveFit> {
        let values = &along.values;
        let known = |i: &usize| self.data.weight[*i] > 0.0 && self.left[*i].is_finite() && self.load[*i] > 0.0;
        let used: Vec<usize> = along.order.iter().copied().filter(known).collect();
        if used.len() < FEWEST_IN_ALL {
            return None;
        }
        let same = SAME * (values[used[used.len() - 1]] - values[used[0]]);
        let groups = groups(&used, values, same);
        if groups.len() < 2 {
            return None;
        }
        let (all, others) = self.sums(&groups, values);
        let learned: Vec<Vec<Option<Curve>>> = others.iter().map(|sums| every_shape(sums)).collect();
        let mut of_all = every_shape(&all);
        let mut best: Option<(f64, usize, Vec<f64>)> = None;
        for shape in (0..SHAPES.len()).filter(|shape| of_all[*shape].as_ref().is_some_and(&may_be)) {
            let of_folds: Vec<Option<&Curve>> = learned.iter().map(|shapes| shapes[shape].as_ref()).collect();
            let left = self.less_curves(&of_folds, &used, values);
            let squares = self.squares(&left);
            if best.as_ref().is_none_or(|(least, ..)| squares < *least * (1.0 - RICHER)) {
                best = Some((squares, shape, left));
            }
        }
        let (squares, shape, left) = best?;
        Some(CurveFit { curve: of_all.swap_remove(shape)?, left, squares })
    }

    /// The residuals less the curve of each sample's fold; `used` in rising order of `values`.
    fn less_curves(&self, of_folds: &[Option<&Curve>], used: &[usize], values: &[f64]) -> Vec<f64> {
        let mut left = self.left.to_vec();
        let mut next = vec![0; of_folds.len()];
        for &i in used {
            let fold = self.split.fold[i];
            if let Some(curve) = of_folds[fold] {
                while curve.knots.get(next[fold]).is_some_and(|knot| knot[0] <= values[i]) {
                    next[fold] += 1;
                }
                left[i] -= self.load[i] * curve.share_before(next[fold], values[i]);
            }
        }
        left
    }

    /// Fits the knots of a curve together with corrections of the coefficients of `columns`, and returns the residuals
    /// less these corrections, but with the curve still in them. Each fold by the fit of the others.
    pub fn beside_curve(&self, curve: &Curve, values: &[f64], columns: &[Vec<f64>]) -> Option<Vec<f64>> {
        let heaviest = (0..curve.weight.len()).max_by(|a, b| curve.weight[*a].total_cmp(&curve.weight[*b]))?;
        let (p, n) = (columns.len(), columns.len() + curve.knots.len());
        let row = |i: usize| {
            let mut row: Vec<f64> = columns.iter().map(|column| column[i]).collect();
            row.resize(n, 0.0);
            let known = values[i].is_finite() && self.load[i] > 0.0;
            for (k, share) in curve.knot_shares(values[i]).into_iter().filter(|(k, _)| known && *k != heaviest) {
                row[p + k] += share * self.load[i];
            }
            row
        };
        let mut sums = vec![(DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n)); self.split.folds];
        for i in self.data.used().filter(|i| self.left[*i].is_finite()) {
            let (row, weight) = (row(i), self.data.weight[i]);
            let (normal, rhs) = &mut sums[self.split.fold[i]];
            for a in (0..n).filter(|a| row[*a] != 0.0) {
                let weighted = weight * row[a];
                rhs[a] += weighted * self.left[i];
                (0..n).for_each(|b| normal[(a, b)] += weighted * row[b]);
            }
        }
        let whole = sums.iter().fold((DMatrix::zeros(n, n), DVector::zeros(n)), |(m, v), (a, b)| (m + a, v + b));
        let without = |(normal, rhs): &(DMatrix<f64>, DVector<f64>)| {
            let (mut normal, rhs) = (&whole.0 - normal, &whole.1 - rhs);
            (0..n).for_each(|k| normal[(k, k)] += RIDGE * whole.0[(k, k)] + f64::MIN_POSITIVE.sqrt());
            Some(normal.cholesky()?.solve(&rhs))
        };
        let coefficients: Vec<DVector<f64>> = sums.iter().map(without).collect::<Option<_>>()?;
        let of_base = |i: usize| (0..p).map(|b| coefficients[self.split.fold[i]][b] * columns[b][i]).sum::<f64>();
        Some(
            (0..self.left.len())
                .map(|i| if self.left[i].is_finite() { self.left[i] - of_base(i) } else { self.left[i] })
                .collect(),
        )
    }

    /// Σ w r² over the samples that count.
    pub fn squares(&self, left: &[f64]) -> f64 {
        let finite = self.data.used().filter(|i| left[*i].is_finite());
        finite.map(|i| self.data.weight[i] * left[i].powi(2)).sum()
    }

    /// Sums over all samples, and for each fold over the samples of the other folds; values without a sample are
    /// omitted.
    fn sums(&self, groups: &[&[usize]], values: &[f64]) -> (Vec<Sums>, Vec<Vec<Sums>>) {
        let by_fold = |group: &&[usize]| {
            let mut sums = vec![Sums { at: values[group[0]], ..Sums::default() }; self.split.folds];
            for &i in *group {
                let weighted = self.data.weight[i] * self.load[i];
                let own = &mut sums[self.split.fold[i]];
                own.samples += 1;
                own.a += weighted * self.load[i];
                own.b += weighted * self.left[i];
            }
            sums
        };
        let groups: Vec<Vec<Sums>> = groups.iter().map(by_fold).collect();
        let but = |out: Option<usize>| {
            let of = |folds: &Vec<Sums>| {
                let others = folds.iter().enumerate().filter(|(fold, _)| Some(*fold) != out).map(|(_, each)| *each);
                let none = Sums { at: folds[0].at, ..Sums::default() };
                others.fold(none, |sum, each| Sums {
                    at: sum.at,
                    samples: sum.samples + each.samples,
                    a: sum.a + each.a,
                    b: sum.b + each.b,
                })
            };
            groups.iter().map(of).filter(|sums| sums.samples > 0).collect()
        };
        (but(None), (0..self.split.folds).map(|fold| but(Some(fold))).collect())
    }
}

/// Groups of samples, in order of their values, that differ from the least of their group by no more than `same`.
fn groups<'a>(used: &'a [usize], values: &[f64], same: f64) -> Vec<&'a [usize]> {
    let mut groups = Vec::new();
    let mut rest = used;
    while let Some(first) = rest.first() {
        let (group, after) = rest.split_at(rest.partition_point(|i| values[*i] - values[*first] <= same));
        groups.push(group);
        rest = after;
    }
    groups
}

/// Least distance between two knots of a bend, relative to that of the outermost: what changes from one kind of cut to the next, as from slots
/// along an axis (179.8°) to ramps (180.02°), is no slope over the covariate. Judgement.
const BEND_APART: f64 = 0.02;

/// Share of ΣA beyond each of the outermost knots: so few samples would not determine a slope.
const BEYOND_ENDS: f64 = 0.01;

/// Least relative drop of the squares for a shape of more parameters. Judgement.
const RICHER: f64 = 0.01;

/// The curve in each shape; `None` if there are too few samples for it.
fn every_shape(sums: &[Sums]) -> Vec<Option<Curve>> {
    let so_far = cumulated(sums);
    let borders = borders(&so_far);
    let curve = |shape: &Shape| match *shape {
        Shape::Steps(parts) => steps(sums, &so_far, borders.get(..parts - 1)?),
        Shape::Bends(knots) => bends(sums, knots),
    };
    SHAPES.iter().map(curve).collect()
}

/// Cumulative sums; the k-th is over the first k values.
fn cumulated(sums: &[Sums]) -> Vec<Sums> {
    let mut so_far = vec![Sums::default()];
    for each in sums {
        let last = so_far[so_far.len() - 1];
        so_far.push(Sums { samples: last.samples + each.samples, a: last.a + each.a, b: last.b + each.b, ..*each });
    }
    so_far
}

/// ΣA and ΣB over the values `from..to`.
fn over(so_far: &[Sums], from: usize, to: usize) -> [f64; 2] {
    [so_far[to].a - so_far[from].a, so_far[to].b - so_far[from].b]
}

/// Borders between parts in the order in which they are split, always the split of largest reduction of the squares
/// next.
fn borders(so_far: &[Sums]) -> Vec<usize> {
    let least = FEWEST.max((LEAST_PART * so_far[so_far.len() - 1].samples as f64) as usize);
    let gain = |from: usize, to: usize| {
        let [a, b] = over(so_far, from, to);
        if a > 0.0 { b * b / a } else { 0.0 }
    };
    let is_part = |from: usize, to: usize| so_far[to].samples - so_far[from].samples >= least;
    let cut = |from: usize, to: usize| {
        let cuts = (from + 1..to).filter(|k| is_part(from, *k) && is_part(*k, to));
        let gained = cuts.map(|k| (gain(from, k) + gain(k, to) - gain(from, to), k));
        let (gained, at) = gained.max_by(|x, y| x.0.total_cmp(&y.0))?;
        Some((gained, from, at, to))
    };
    let mut open: Vec<(f64, usize, usize, usize)> = cut(0, so_far.len() - 1).into_iter().collect();
    let mut borders = Vec::new();
    while borders.len() + 1 < KNOTS {
        let Some(best) = (0..open.len()).max_by(|a, b| open[*a].0.total_cmp(&open[*b].0)) else { break };
        let (_, from, at, to) = open.swap_remove(best);
        borders.push(at);
        open.extend([cut(from, at), cut(at, to)].into_iter().flatten());
    }
    borders
}

fn steps(sums: &[Sums], so_far: &[Sums], borders: &[usize]) -> Option<Curve> {
    let mut edges: Vec<usize> = borders.iter().copied().chain([0, sums.len()]).collect();
    edges.sort_unstable();
    let from = |k: usize| if k == 0 { sums[0].at } else { f64::midpoint(sums[k - 1].at, sums[k].at) };
    let part = |pair: &[usize]| {
        let [a, b] = over(so_far, pair[0], pair[1]);
        ([from(pair[0]), if a > 0.0 { b / a } else { 0.0 }], a)
    };
    let (knots, weight): (Vec<[f64; 2]>, Vec<f64>) = edges.windows(2).map(part).unzip();
    (knots.len() == borders.len() + 1).then_some(Curve { knots, weight, in_steps: true })
}

fn bends(sums: &[Sums], count: usize) -> Option<Curve> {
    let known: Vec<&Sums> = sums.iter().filter(|each| each.a > 0.0).collect();
    let whole: f64 = known.iter().map(|each| each.a).sum();
    let mut places: Vec<f64> = Vec::new();
    let mut so_far = 0.0;
    for each in &known {
        so_far += each.a;
        let share = |k: usize| BEYOND_ENDS + (1.0 - 2.0 * BEYOND_ENDS) * k as f64 / (count - 1) as f64;
        while places.len() < count && so_far >= share(places.len()) * whole {
            places.push(each.at);
        }
    }
    let least = BEND_APART * (places.last()? - places.first()?);
    places.dedup_by(|b, a| *b - *a <= least);
    if places.len() < 2 {
        return None;
    }
    let n = places.len();
    let knot_shares = |x: f64| {
        let k = places.partition_point(|p| *p <= x).clamp(1, n - 1);
        let share = ((x - places[k - 1]) / (places[k] - places[k - 1])).clamp(0.0, 1.0);
        [(k - 1, 1.0 - share), (k, share)]
    };
    let (mut normal, mut rhs) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
    for each in &known {
        for (a, x) in knot_shares(each.at) {
            rhs[a] += x * each.b;
            for (b, y) in knot_shares(each.at) {
                normal[(a, b)] += each.a * x * y;
            }
        }
    }
    let weight: Vec<f64> = (0..n).map(|k| normal[(k, k)]).collect();
    for k in 0..n {
        normal[(k, k)] += 1e-6 * whole / n as f64;
    }
    let shares = normal.cholesky()?.solve(&rhs);
    Some(Curve {
        knots: places.iter().zip(shares.iter()).map(|(at, share)| [*at, *share]).collect(),
        weight,
        in_steps: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::path::Vec3;

    /// 24 blocks of 40 samples with a load of 100 and noise between −1 and 1; z between 0 and −10, the reading higher
    /// by `share(z)` of the load.
    fn falling(share: impl Fn(f64) -> f64) -> (Data, Split, Vec<f64>) {
        let n = 960;
        let z = |i: usize| -10.0 * ((i * 577) % n) as f64 / n as f64;
        let wobble = |i: usize| ((i * 7919) % 101) as f64 / 50.0 - 1.0;
        let state = |i: usize| State { position: Vec3::new(0.0, 0.0, z(i)), ..State::default() };
        let data = Data {
            reading: (0..n).map(|i| 100.0 * share(z(i)) + wobble(i)).collect(),
            weight: vec![1.0; n],
            state: (0..n).map(state).collect(),
            block: (0..n).map(|i| i / 40).collect(),
            ..Data::default()
        };
        let fold = (0..n).map(|i| (i / 40) % 5).collect();
        (data, Split { test: vec![false; n], fold, folds: 5, how: String::new() }, vec![100.0; n])
    }

    fn height(data: &Data) -> Along {
        Along::new(data.state.iter().map(|state| Covariate::Z.of(state)).collect())
    }

    fn found(share: impl Fn(f64) -> f64) -> CurveFit {
        let (data, split, load) = falling(share);
        let residual = Residual { data: &data, split: &split, left: &data.reading, load: &load };
        residual.best_curve(&height(&data), |_| true).unwrap()
    }

    #[test]
    fn a_step_a_window_and_a_bend_are_found_in_their_own_shape() {
        let step = found(|z| if z < -4.5 { 0.18 } else { 0.0 });
        assert!(step.curve.in_steps && step.curve.knots.len() == 2, "{:?}", step.curve);
        assert!((step.curve.knots[1][0] + 4.5).abs() < 0.15 && (step.curve.at(-9.0) - 0.18).abs() < 0.005);
        let window = found(|z| if (-7.0..-4.0).contains(&z) { -0.2 } else { 0.0 });
        assert!((window.curve.at(-5.5) + 0.2).abs() < 0.01 && window.curve.at(-1.0).abs() < 0.01);
        let bend = found(|z| 0.004 * z * z);
        for z in [-9.0, -5.0, -1.0] {
            assert!((bend.curve.at(z) - 0.004 * z * z).abs() < 0.02, "{z}: {:?}", bend.curve);
        }
        // Left is the noise (variance 1/3), and at each border one misplaced sample in each of the five folds.
        let noise = 960.0 / 3.0;
        assert!(bend.squares < 1.35 * noise, "{}", bend.squares);
        assert!(step.squares < noise + 5.0 * 18f64.powi(2), "{}", step.squares);
        assert!(window.squares < noise + 10.0 * 20f64.powi(2), "{}", window.squares);
    }

    #[test]
    fn values_that_no_sentence_tells_apart_are_one() {
        // Two feeds; the last digits of the slower one correlate with the residual.
        let share = |i: usize| if i.is_multiple_of(3) { 0.2 } else { 0.0 };
        let (mut data, split, load) = falling(|_| 0.0);
        data.reading.iter_mut().enumerate().for_each(|(i, reading)| *reading += 100.0 * share(i));
        let feed = |i: usize| if i.is_multiple_of(2) { 3000.0 } else { 1852.0 + share(i) };
        let feeds: Vec<f64> = (0..data.len()).map(feed).collect();
        let residual = Residual { data: &data, split: &split, left: &data.reading, load: &load };
        let found = residual.best_curve(&Along::new(feeds), |_| true).unwrap();
        let between = |knot: &&[f64; 2]| (1852.0..1853.0).contains(&knot[0]);
        assert_eq!(found.curve.knots.iter().skip(1).filter(between).count(), 0, "{:?}", found.curve);
    }

    #[test]
    fn a_bend_has_no_knots_closer_than_a_part_of_its_range() {
        // Most of the load lies at two values, which differ in their share and by a part of the range.
        let close = |apart: f64| {
            let of = |(at, b): (f64, f64), a: f64| Sums { at, samples: 40, a, b: a * b };
            let few = (0..20).map(|k| of((f64::from(k), 0.05), 1.0));
            let sums: Vec<Sums> = few.chain([of((20.0, 0.1), 100.0), of((20.0 + apart, 0.0), 100.0)]).collect();
            bends(&sums, 5).unwrap().knots.windows(2).map(|pair| pair[1][0] - pair[0][0]).fold(f64::INFINITY, f64::min)
        };
        assert!(close(0.35) > 1.0 && (close(0.6) - 0.6).abs() < 1e-9, "{} {}", close(0.35), close(0.6));
    }

    #[test]
    fn a_curve_is_found_anew_without_what_the_coefficients_made_of_it() {
        // After a fit of one coefficient a step of 0.18 below −7 appears as +0.126 and −0.054 about the mean.
        let step = |z: f64| if z < -7.0 { 0.18 } else { 0.0 };
        let (data, split, load) = falling(|z| step(z) - 0.054);
        let residual = Residual { data: &data, split: &split, left: &data.reading, load: &load };
        let z = height(&data);
        let first = residual.best_curve(&z, |_| true).unwrap().curve;
        assert!((first.at(-3.0) + 0.054).abs() < 0.01);
        let beside_curve = residual.beside_curve(&first, &z.values, std::slice::from_ref(&load)).unwrap();
        let again = Residual { left: &beside_curve, ..residual }.best_curve(&z, |_| true).unwrap().curve;
        assert!(again.at(-3.0).abs() < 0.005 && (again.at(-9.0) - 0.18).abs() < 0.01, "{again:?}");
    }

    #[test]
    fn the_cutting_speed_is_followed_where_tools_of_two_diameters_cut() {
        let (mut data, ..) = falling(|_| 0.1);
        let mut is_followed = |radius_mm: f64| {
            for (i, state) in data.state.iter_mut().enumerate() {
                state.rps = 100.0 + i as f64;
                state.cutting_speed_mm_s = state.rps * if i < 9 { 5.0 } else { radius_mm };
            }
            along_all(&data).iter().any(|(covariate, _)| *covariate == Covariate::CuttingSpeed)
        };
        assert!(is_followed(8.0) && !is_followed(5.0) && !is_followed(5.04));
    }

    #[test]
    fn a_covariate_that_stands_still_has_no_curve() {
        let (data, split, load) = falling(|_| 0.1);
        let residual = Residual { data: &data, split: &split, left: &data.reading, load: &load };
        assert!(residual.best_curve(&Along::new(vec![3.0; data.len()]), |_| true).is_none());
        assert!(residual.best_curve(&Along::new(vec![f64::NAN; data.len()]), |_| true).is_none());
    }
}
