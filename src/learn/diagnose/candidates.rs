//! Where the search for an effect begins: whether the data can show it at all, and values of its parameters worth trying.
//!
//! Smooth parameters begin at the values of the effects list. Those that are found by scanning (the instant of a chipped
//! edge, the box of a hard zone) come from a score test: with sensitivity s of the reading and the Jacobian J of the
//! present model, a mask m gains (Σ m w s r)² / (Σ m w s² − vᵀ(JᵀWJ)⁻¹v), v = Σ m w s J, and all these sums add up over
//! cells, so that thousands of masks cost no more than one pass over the samples.

use crate::effects::{Covariate, Effect};
use crate::learn::dataset::samples::{Class, Data};
use crate::learn::diagnose::residual::value_of;
use crate::learn::model::design::{Acting, Use, acting, changed_columns};
use crate::learn::model::fit::{Fitted, jacobian, pseudo_inverse};
use crate::learn::program::variant::Variant;
use nalgebra::{DMatrix, DVector};

/// Why an effect cannot be seen in these data; `None`: it can.
pub fn why_not(effect: &Effect, data: &Data) -> Option<String> {
    let spread = |covariate: Covariate| {
        let values = data.used().map(|i| value_of(covariate, &data.state[i])).filter(|v| v.is_finite());
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)))
    };
    let varies = |covariate: Covariate, by: f64| {
        let (lo, hi) = spread(covariate);
        (hi - lo <= by).then(|| format!("{} does not vary in these data", covariate.name()))
    };
    let ratio = |covariate: Covariate, by: f64| {
        let top = spread(covariate).1;
        let values = data.used().map(|i| value_of(covariate, &data.state[i])).filter(|v| *v > 0.02 * top);
        let (lo, hi) = values.fold((f64::INFINITY, 0.0), |(lo, hi), v| (f64::min(lo, v), f64::max(hi, v)));
        let enough = hi / lo >= by;
        (!enough).then(|| format!("{} varies by less than a factor of {by}", covariate.name()))
    };
    let variant = |variant: Variant| {
        let moves =
            |v: &crate::learn::dataset::samples::VariantColumns| v.columns.iter().flatten().any(|x| x.abs() > 1e-12);
        (!data.variant(variant).is_some_and(moves)).then(|| "these data do not show the geometry it acts on".to_owned())
    };
    let unknown = |covariate: Covariate| {
        let known = data.used().any(|i| value_of(covariate, &data.state[i]).is_finite());
        (!known).then(|| format!("{} is not known of these data", covariate.name()))
    };
    match effect.name {
        "flank-wear" => varies(Covariate::Sliding, 1e3),
        "edge-chipping" => varies(Covariate::Time, 1.0).or_else(|| too_short(data)),
        "size-effect" => ratio(Covariate::ChipThickness, 1.2),
        "edge-force" => has_edge(data).or_else(|| ratio(Covariate::ChipThickness, 1.2)),
        "entry" => unknown(Covariate::SinceEntry).or_else(|| varies(Covariate::SinceEntry, 1.0)),
        "axis-power" => no_tare(data).or_else(|| unknown(Covariate::PathSpeed)),
        "cutting-speed" => ratio(Covariate::CuttingSpeed, 1.05),
        "edge-position" => varies(Covariate::EdgePosition, 0.05),
        "up-down-asymmetry" => varies(Covariate::UpShare, 0.3),
        "hard-zone" => varies(Covariate::X, 1.0).or_else(|| varies(Covariate::Y, 1.0)).or_else(|| too_short(data)),
        "runout" => variant(Variant::Runout { offset: 1, phase: 0 }),
        "stock-proud" => match (variant(Variant::StockTop), variant(Variant::StockSide)) {
            (Some(why), Some(_)) => Some(why),
            _ => None,
        },
        "tool-diameter" => variant(Variant::Diameter),
        "path-curvature" => variant(Variant::Curved),
        "corner-feed" => data.slower.is_empty().then(|| "no motion model belongs to these data".to_owned()),
        "tare-warm-up" => no_tare(data).or_else(|| varies(Covariate::Time, 1.0)).or_else(|| too_short(data)),
        "tare-speed" => no_tare(data).or_else(|| ratio(Covariate::SpindleSpeed, 1.05)),
        "sensor-lag" => (!data.is_series()).then(|| "steady readings have no lag".to_owned()),
        _ => None,
    }
}

fn has_edge(data: &Data) -> Option<String> {
    let has = data.base.iter().any(|base| base.class == Class::Edge);
    has.then(|| "the base model has edge coefficients".to_owned())
}

fn no_tare(data: &Data) -> Option<String> {
    let has = data.base.iter().any(|base| base.class == Class::Tare);
    (!has).then(|| "nothing measured has a tare".to_owned())
}

fn too_short(data: &Data) -> Option<String> {
    (data.used().count() < 40).then(|| "too few samples to place it".to_owned())
}

/// Is the place of an effect (an instant, a region) looked for in the data?
pub fn is_looked_for(effect: &Effect) -> bool {
    matches!(effect.name, "edge-chipping" | "hard-zone")
}

/// Forms of the effect and values of its parameters to begin with; empty when none are worth trying. A form leaves some
/// of the parameters that have a neutral value there; of what is looked for those that begin there stay ([`crate::learn::diagnose::forms`]).
pub fn starts(effect: &'static Effect, data: &Data, present: &Fitted) -> Vec<Use> {
    let values = match effect.name {
        "edge-chipping" => chipping_starts(data, present),
        "hard-zone" => zone_starts(data, present),
        "runout" if data.runouts.is_narrow() => vec![data.runouts.middle().to_vec()],
        _ => product(effect),
    };
    values.iter().flat_map(|values| forms(effect, values)).collect()
}

fn forms(effect: &'static Effect, values: &[f64]) -> Vec<Use> {
    let stays = |k: usize| is_looked_for(effect) && effect.parameters[k].neutral == Some(values[k]);
    let optional: Vec<usize> =
        (0..values.len()).filter(|k| effect.parameters[*k].neutral.is_some() && !stays(*k)).collect();
    let form = |pinned: usize| {
        let chosen = |k: usize| optional.iter().position(|o| *o == k).is_some_and(|bit| pinned >> bit & 1 == 1);
        let is_pinned = |k: usize| stays(k) || chosen(k);
        let value = |k: usize| effect.parameters[k].neutral.filter(|_| is_pinned(k)).unwrap_or(values[k]);
        Use {
            effect,
            values: (0..values.len()).map(value).collect(),
            free: (0..values.len()).map(|k| !is_pinned(k)).collect(),
        }
    };
    let strong = |u: &Use| u.free.is_empty() || (0..u.free.len()).any(|k| u.free[k] && !effect.parameters[k].scanned);
    (0..1usize << optional.len()).map(form).filter(strong).collect()
}

fn product(effect: &Effect) -> Vec<Vec<f64>> {
    let mut all = vec![Vec::new()];
    for parameter in effect.parameters {
        all = all
            .iter()
            .flat_map(|head: &Vec<f64>| {
                parameter.starts.iter().map(|start| head.iter().copied().chain([*start]).collect::<Vec<f64>>())
            })
            .collect();
    }
    all
}

/// Sums over a set of samples that the score of a mask needs.
#[derive(Clone)]
struct Sums {
    g: f64,
    ss: f64,
    sj: DVector<f64>,
}

impl Sums {
    fn zero(p: usize) -> Self {
        Self { g: 0.0, ss: 0.0, sj: DVector::zeros(p) }
    }
    fn add(&mut self, other: &Sums, sign: f64) {
        self.g += sign * other.g;
        self.ss += sign * other.ss;
        self.sj.axpy(sign, &other.sj, 1.0);
    }
}

/// Score test of masks.
struct Score {
    each: Vec<Sums>,
    used: Vec<usize>,
    inverse: DMatrix<f64>,
    p: usize,
}

impl Score {
    fn new(data: &Data, present: &Fitted, sensitivity: &[f64]) -> Self {
        let j = jacobian(data, present);
        let p = j.len();
        let residual = present.residuals(data);
        let used: Vec<usize> = data.used().collect();
        let mut normal = DMatrix::<f64>::zeros(p, p);
        let mut each = Vec::with_capacity(used.len());
        for &i in &used {
            let row = DVector::from_fn(p, |a, _| j[a][i]);
            normal.syger(data.weight[i], &row, &row, 1.0);
            let (w, s) = (data.weight[i], sensitivity[i]);
            each.push(Sums { g: w * s * residual[i], ss: w * s * s, sj: row * (w * s) });
        }
        let mut full = DMatrix::from_fn(p, p, |a, b| normal[(a.max(b), a.min(b))]);
        // Columns that these cuts cannot tell apart are told apart by the priors, as in the fit.
        for (b, sd) in data.base.iter().enumerate().filter_map(|(b, base)| Some((b, base.prior?.1))) {
            full[(b, b)] += 1.0 / (sd * sd);
        }
        let inverse = pseudo_inverse(&full);
        Self { each, used, inverse, p }
    }

    fn gain(&self, sums: &Sums) -> f64 {
        let rest = sums.ss - (sums.sj.transpose() * &self.inverse * &sums.sj)[(0, 0)];
        if rest > 1e-6 * sums.ss && sums.ss > 0.0 { sums.g * sums.g / rest } else { 0.0 }
    }

    fn of_mask(&self, mask: impl Fn(usize) -> bool) -> f64 {
        let mut sums = Sums::zero(self.p);
        for (k, &i) in self.used.iter().enumerate() {
            if mask(i) {
                sums.add(&self.each[k], 1.0);
            }
        }
        self.gain(&sums)
    }
}

/// Part of the present prediction that belongs to the given classes.
pub fn part(data: &Data, present: &Fitted, classes: &[Class]) -> Vec<f64> {
    let acting: Vec<Acting> = present.model.effects.iter().map(|each| acting(each, data)).collect();
    let columns = changed_columns(data, &acting.iter().collect::<Vec<_>>());
    let mut sum = vec![0.0; data.len()];
    for (b, column) in columns.iter().enumerate() {
        if classes.contains(&data.base[b].class) {
            sum.iter_mut().zip(column).for_each(|(s, x)| *s += present.model.base[b] * x);
        }
    }
    sum
}

fn chipping_starts(data: &Data, present: &Fitted) -> Vec<Vec<f64>> {
    let score = Score::new(data, present, &part(data, present, &[Class::Cutting, Class::Edge]));
    let n = score.used.len();
    let mut order: Vec<usize> = (0..n).collect();
    let time = |k: usize| data.state[score.used[k]].time_s;
    order.sort_by(|a, b| time(*a).total_cmp(&time(*b)));
    let (mut sums, mut best) = (Sums::zero(score.p), (0.0, f64::NAN));
    for (rank, &k) in order.iter().enumerate().rev() {
        sums.add(&score.each[k], 1.0);
        let inside = rank > n / 50 && rank < n - n / 50;
        let gain = if inside { score.gain(&sums) } else { 0.0 };
        if gain > best.0 {
            best = (gain, time(k));
        }
    }
    if best.1.is_nan() { Vec::new() } else { vec![vec![0.1, 0.1, best.1]] }
}

const GRID: usize = 12;
/// A zone is looked for as a box with round corners. Its shape is asked for when it is found: as a rival of others it would
/// follow too much.
const SQUARENESS: f64 = 4.0;

fn zone_starts(data: &Data, present: &Fitted) -> Vec<Vec<f64>> {
    let sensitivity = part(data, present, &[Class::Cutting, Class::Edge]);
    let top = sensitivity.iter().copied().fold(0.0, f64::max);
    let cutting: Vec<usize> = data.used().filter(|i| sensitivity[*i] > 0.02 * top).collect();
    let Some([x, y]) = edges(data, &cutting) else { return Vec::new() };
    let score = Score::new(data, present, &sensitivity);
    let place = |i: usize| (cell(&x, data.state[i].position.x), cell(&y, data.state[i].position.y));
    // prefix[a][b]: sums over the cells left of a and below b
    let mut prefix = vec![vec![Sums::zero(score.p); GRID + 1]; GRID + 1];
    for (k, &i) in score.used.iter().enumerate() {
        let (a, b) = place(i);
        prefix[a + 1][b + 1].add(&score.each[k], 1.0);
    }
    for a in 1..=GRID {
        for b in 1..=GRID {
            let (left, below, corner) =
                (prefix[a - 1][b].clone(), prefix[a][b - 1].clone(), prefix[a - 1][b - 1].clone());
            prefix[a][b].add(&left, 1.0);
            prefix[a][b].add(&below, 1.0);
            prefix[a][b].add(&corner, -1.0);
        }
    }
    let mut best = (0.0, [0, GRID, 0, GRID]);
    for a0 in 0..GRID {
        for a1 in a0 + 1..=GRID {
            for b0 in 0..GRID {
                for b1 in b0 + 1..=GRID {
                    let mut sums = prefix[a1][b1].clone();
                    sums.add(&prefix[a0][b1], -1.0);
                    sums.add(&prefix[a1][b0], -1.0);
                    sums.add(&prefix[a0][b0], 1.0);
                    let gain = score.gain(&sums);
                    if gain > best.0 {
                        best = (gain, [a0, a1, b0, b1]);
                    }
                }
            }
        }
    }
    if best.0 <= 0.0 {
        return Vec::new();
    }
    let [a0, a1, b0, b1] = best.1;
    let refined = refine(data, &score, [x[a0], x[a1], y[b0], y[b1]], [x[1] - x[0], y[1] - y[0]]);
    let starts = |excess: f64, border: f64| [excess].into_iter().chain(refined).chain([border, SQUARENESS]).collect();
    vec![starts(0.2, 0.1), starts(0.2, 0.4)]
}

/// Cell edges in x and y; `None` when nothing is cut over an area.
fn edges(data: &Data, cutting: &[usize]) -> Option<[Vec<f64>; 2]> {
    let axis = |index: usize| {
        let values = cutting.iter().map(|i| data.state[*i].position[index]);
        let (lo, hi) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
        let (lo, hi) = (lo - 1e-6, hi + 1e-6);
        (hi > lo).then(|| (0..=GRID).map(|k| lo + (hi - lo) * k as f64 / GRID as f64).collect::<Vec<f64>>())
    };
    Some([axis(0)?, axis(1)?])
}

fn cell(edges: &[f64], value: f64) -> usize {
    edges.partition_point(|edge| *edge <= value).saturating_sub(1).min(GRID - 1)
}

/// Moves one side of the box at a time while the score rises.
fn refine(data: &Data, score: &Score, start: [f64; 4], step: [f64; 2]) -> [f64; 4] {
    let gain = |b: &[f64; 4]| {
        score.of_mask(|i| {
            let p = data.state[i].position;
            p.x >= b[0] && p.x <= b[1] && p.y >= b[2] && p.y <= b[3]
        })
    };
    let (mut at, mut best) = (start, gain(&start));
    for shrink in [0.5, 0.25, 0.125] {
        for side in 0..4 {
            for sign in [-1.0, 1.0] {
                let mut trial = at;
                trial[side] += sign * shrink * step[side / 2];
                let value = gain(&trial);
                if value > best {
                    (at, best) = (trial, value);
                }
            }
        }
    }
    at
}
