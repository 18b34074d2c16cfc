//! Structure in a residual. In: samples and residuals. Out: inflation, noise, and the covariates along which the
//! residual has a pattern that also holds on blocks it was not learned on.
//!
//! *Inflation* φ = 1 + 2 Σ ρ_k (over lags k until the autocorrelation ρ_k falls below its standard error) is the number
//! of neighbouring samples that count as one independent sample; in tables it is the design effect 1 + (m − 1)·ICC of
//! set-ups of m cuts (Kish 1965; ICC: intraclass correlation). *Noise floor*: √(Σ d²/2m) over m differences d of
//! neighbouring samples, in which slow structure cancels. *Pattern*: bin means along a covariate, learned on the even
//! blocks and scored on the odd ones and vice versa (R²), compared with the same score after the covariate values were
//! permuted between whole blocks.

use crate::effects::Covariate;
use crate::learn::dataset::samples::Data;
use crate::learn::diagnose::criteria::is_structure;
use crate::learn::diagnose::worst_stretch::worst_stretch;
use crate::learn::regress::random::Chance;
use crate::learn::regress::statistics::dot;

/// A pattern found in a residual.
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern {
    /// Covariate along which it runs, or "time (repeats every … s)".
    pub along: String,
    /// Share of the residual's variance that it predicts in blocks it was not learned on.
    pub test_r2: f64,
    /// Probability of such a score without a pattern.
    pub p_value: f64,
    /// Is it only an autocorrelation of neighbouring samples?
    pub is_persistence: bool,
    /// Of that: the time and the lines of the program at which the residual is largest, in words.
    pub largest: Option<String>,
}

/// φ; see the head of the file. At least 1.
pub fn inflation(data: &Data, residual: &[f64]) -> f64 {
    if data.is_series() { series_inflation(data, residual) } else { group_inflation(data, residual) }
}

/// A residual about its mean, in units of its expected standard deviation.
struct Scaled {
    used: usize,
    /// For each run without a gap the values, and 1 for each sample that counts; both 0 for one that does not.
    runs: Vec<(Vec<f64>, Vec<f64>)>,
    variance: f64,
}

impl Scaled {
    fn new(data: &Data, residual: &[f64]) -> Self {
        let used: Vec<usize> = data.used().collect();
        let whole: f64 = used.iter().map(|&i| data.weight[i]).sum();
        let mean = used.iter().map(|&i| data.weight[i] * residual[i]).sum::<f64>() / whole.max(1e-300);
        let mut values = vec![0.0; data.len()];
        for &i in &used {
            values[i] = data.weight[i].sqrt() * (residual[i] - mean);
        }
        let variance = values.iter().map(|r| r * r).sum::<f64>() / used.len().max(1) as f64;
        let counts: Vec<f64> = data.weight.iter().map(|w| f64::from(u8::from(*w > 0.0))).collect();
        let mut runs = Vec::new();
        let mut begin = 0;
        for run in data.run.chunk_by(|a, b| a == b) {
            let range = begin..begin + run.len();
            begin = range.end;
            runs.push((values[range.clone()].to_vec(), counts[range].to_vec()));
        }
        Self { used: used.len(), runs, variance }
    }

    /// Autocorrelation at a lag, within runs.
    fn autocorrelation(&self, lag: usize) -> f64 {
        let (mut product, mut pairs) = (0.0, 0.0);
        for (values, counts) in self.runs.iter().filter(|(values, _)| values.len() > lag) {
            product += dot(values, &values[lag..]);
            pairs += dot(counts, &counts[lag..]);
        }
        if pairs < 8.0 || self.variance <= 0.0 { 0.0 } else { product / pairs / self.variance }
    }
}

fn series_inflation(data: &Data, residual: &[f64]) -> f64 {
    let scaled = Scaled::new(data, residual);
    let noise = 2.0 / (scaled.used.max(4) as f64).sqrt();
    let mut sum = 1.0;
    for lag in 1..(data.len() / 4).min(400) {
        let rho = scaled.autocorrelation(lag);
        if rho < noise {
            break;
        }
        sum += 2.0 * rho;
    }
    sum
}

fn group_inflation(data: &Data, residual: &[f64]) -> f64 {
    let blocks = data.blocks();
    let n = data.used().count() as f64;
    let k = blocks.len() as f64;
    if k < 3.0 || n - k < 2.0 {
        return 1.0;
    }
    let mean = data.used().map(|i| residual[i]).sum::<f64>() / n;
    let (mut between, mut within) = (0.0, 0.0);
    for block in &blocks {
        let members: Vec<f64> = data.used().filter(|i| data.block[*i] == *block).map(|i| residual[i]).collect();
        let own = members.iter().sum::<f64>() / members.len() as f64;
        between += members.len() as f64 * (own - mean).powi(2);
        within += members.iter().map(|r| (r - own).powi(2)).sum::<f64>();
    }
    let (between, within) = (between / (k - 1.0), within / (n - k));
    let size = n / k;
    if size < 1.5 || within <= 0.0 {
        return 1.0;
    }
    let share = ((between - within) / (between + (size - 1.0) * within)).clamp(0.0, 1.0);
    1.0 + (size - 1.0) * share
}

/// Standard deviation of the noise, from differences of neighbouring samples; `None` for tables.
pub fn noise_floor(data: &Data, residual: &[f64]) -> Option<f64> {
    Some(half_squares(data, residual, 1)?.sqrt())
}

/// Largest autocorrelation of neighbouring samples that is taken for noise rather than structure. Judgement.
const MOST_SHARED: f64 = 0.5;

/// The same for an autocorrelated noise. If the autocorrelation is ρᵏ at lag k, half the mean square of differences
/// over k samples is σ²(1 − ρᵏ); that over two samples is therefore 1 + ρ times that over one, which gives ρ and σ.
pub fn noise_with_memory(data: &Data, residual: &[f64]) -> Option<f64> {
    let (one, two) = (half_squares(data, residual, 1)?, half_squares(data, residual, 2)?);
    let shared = (two / one.max(1e-300) - 1.0).clamp(0.0, MOST_SHARED);
    Some((one / (1.0 - shared)).sqrt())
}

/// Half the mean square of differences between samples `apart` in a run, without the largest 5 %; `None` if there are
/// too few. For normal noise the others have 0.7587 of the mean square of all.
fn half_squares(data: &Data, residual: &[f64], apart: usize) -> Option<f64> {
    let sure = 0.5 * data.weight.iter().copied().fold(0.0, f64::max);
    let counts = |i: usize| data.run[i] == data.run[i - apart] && (i - apart..=i).all(|k| data.weight[k] > sure);
    let difference = |i: usize| 0.5 * (residual[i] - residual[i - apart]).powi(2);
    let mut squares: Vec<f64> = (apart..data.len()).filter(|i| counts(*i)).map(difference).collect();
    if squares.len() < 20 {
        return None;
    }
    // The largest 5 % are steps of the load, not noise.
    squares.sort_by(f64::total_cmp);
    squares.truncate(squares.len() * 19 / 20);
    Some(squares.iter().sum::<f64>() / squares.len() as f64 / 0.7587)
}

/// Covariates along which a residual is searched for patterns.
pub const COVARIATES: [Covariate; 19] = [
    Covariate::Time,
    Covariate::Sliding,
    Covariate::Volume,
    Covariate::FeedPerTooth,
    Covariate::ChipThickness,
    Covariate::CuttingSpeed,
    Covariate::SpindleSpeed,
    Covariate::AxialDepth,
    Covariate::RadialDepth,
    Covariate::Immersion,
    Covariate::UpShare,
    Covariate::X,
    Covariate::Y,
    Covariate::Z,
    Covariate::DirectionX,
    Covariate::DirectionY,
    Covariate::Heading,
    Covariate::Curvature,
    Covariate::EdgePosition,
];

/// Every pattern that counts as structure ([`is_structure`]) with a p value below 5 %, strongest first.
pub fn patterns(data: &Data, residual: &[f64], load: &[f64], seed: u64) -> Vec<Pattern> {
    let mut found = Vec::new();
    for covariate in COVARIATES {
        let values: Vec<f64> = data.state.iter().map(|state| covariate.of(state)).collect();
        found.extend(along(data, residual, &values, covariate.name(), seed));
    }
    found.extend(along(data, residual, load, Covariate::Load.name(), seed));
    if data.is_series() {
        found.extend(in_time(data, residual, load));
    } else {
        found.extend(from_set_up_to_set_up(data, residual, seed));
    }
    found.retain(|p| p.p_value < 0.05 && is_structure(p.test_r2, data.is_series()));
    found.sort_by(|a, b| b.test_r2.total_cmp(&a.test_r2));
    found
}

/// Permutations for a p value.
const ROUNDS: usize = 99;

/// Pattern along one covariate; `None` if the covariate does not vary, blocks are too few, or it is no structure.
fn along(data: &Data, residual: &[f64], values: &[f64], name: &str, seed: u64) -> Option<Pattern> {
    let used: Vec<usize> = data.used().filter(|i| values[*i].is_finite()).collect();
    let blocks = data.blocks();
    if used.len() < 8 || blocks.len() < 4 {
        return None;
    }
    let bins = bins_of(&used, values, (used.len() / 6).clamp(2, 12))?;
    let half: Vec<bool> =
        used.iter().map(|i| blocks.binary_search(&data.block[*i]).unwrap_or(0).is_multiple_of(2)).collect();
    let score = |bins: &[usize]| cross_r2(&used, bins, &half, residual, data);
    let test_r2 = score(&bins);
    if !is_structure(test_r2, data.is_series()) {
        return None;
    }
    let members = members(data, &used, &blocks);
    let mut chance = Chance::new(seed);
    let beaten = (0..ROUNDS).filter(|_| score(&permuted(&members, &bins, &mut chance)) >= test_r2).count();
    Some(Pattern {
        along: name.to_owned(),
        test_r2,
        p_value: (beaten + 1) as f64 / (ROUNDS + 1) as f64,
        is_persistence: false,
        largest: None,
    })
}

/// Fewest cuts per set-up on average: two to learn from and two to score. Judgement.
const CUTS_OF_A_SET_UP: usize = 4;

/// Do cuts of one set-up share a residual? Means learned on every other cut of each set-up and scored on the rest,
/// compared with the same after the cuts were shuffled over the set-ups.
fn from_set_up_to_set_up(data: &Data, residual: &[f64], seed: u64) -> Option<Pattern> {
    let blocks = data.blocks();
    let used: Vec<usize> = data.used().collect();
    if blocks.len() < 2 || used.len() < CUTS_OF_A_SET_UP * blocks.len() {
        return None;
    }
    let mut bins: Vec<usize> = used.iter().map(|i| blocks.binary_search(&data.block[*i]).unwrap_or(0)).collect();
    let score = |bins: &[usize]| {
        let mut seen = vec![0_usize; blocks.len()];
        let half: Vec<bool> = bins
            .iter()
            .map(|b| {
                seen[*b] += 1;
                seen[*b] % 2 == 1
            })
            .collect();
        cross_r2(&used, bins, &half, residual, data)
    };
    let test_r2 = score(&bins);
    let mut chance = Chance::new(seed);
    let mut beats = || {
        chance.shuffle(&mut bins);
        score(&bins) >= test_r2
    };
    let beaten = (0..ROUNDS).filter(|_| beats()).count();
    Some(Pattern {
        along: Covariate::SetUp.name().to_owned(),
        test_r2,
        p_value: (beaten + 1) as f64 / (ROUNDS + 1) as f64,
        is_persistence: false,
        largest: None,
    })
}

/// Bin of each used sample, bins by quantiles; `None` if there is only one bin.
fn bins_of(used: &[usize], values: &[f64], count: usize) -> Option<Vec<usize>> {
    let mut sorted: Vec<f64> = used.iter().map(|i| values[*i]).collect();
    sorted.sort_by(f64::total_cmp);
    let mut edges: Vec<f64> = (1..count).map(|k| sorted[k * sorted.len() / count]).collect();
    edges.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * b.abs().max(1e-9));
    edges.retain(|edge| *edge > sorted[0] + 1e-9 * sorted[0].abs().max(1e-9));
    if edges.is_empty() {
        return None;
    }
    Some(used.iter().map(|i| edges.partition_point(|edge| *edge <= values[*i] * (1.0 + 1e-12))).collect())
}

/// R² of bin means learned on one half of the samples (`half`) and scored on the other, over both ways.
fn cross_r2(used: &[usize], bins: &[usize], half: &[bool], residual: &[f64], data: &Data) -> f64 {
    let count = bins.iter().max().map_or(1, |m| m + 1);
    let (mut sums, mut weights) = (vec![[0.0; 2]; count], vec![[0.0; 2]; count]);
    for (k, &i) in used.iter().enumerate() {
        let side = usize::from(half[k]);
        sums[bins[k]][side] += data.weight[i] * residual[i];
        weights[bins[k]][side] += data.weight[i];
    }
    let (mut before, mut after) = (0.0, 0.0);
    for (k, &i) in used.iter().enumerate() {
        let other = 1 - usize::from(half[k]);
        let weight = weights[bins[k]][other];
        let guess = if weight > 0.0 { sums[bins[k]][other] / weight } else { 0.0 };
        before += data.weight[i] * residual[i].powi(2);
        after += data.weight[i] * (residual[i] - guess).powi(2);
    }
    1.0 - after / before.max(1e-300)
}

/// Which of the used samples belong to each block.
fn members(data: &Data, used: &[usize], blocks: &[usize]) -> Vec<Vec<usize>> {
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); blocks.len()];
    for (k, &i) in used.iter().enumerate() {
        if let Ok(b) = blocks.binary_search(&data.block[i]) {
            members[b].push(k);
        }
    }
    members.retain(|m| !m.is_empty());
    members
}

/// Gives whole blocks the bins of other blocks, in their order.
fn permuted(members: &[Vec<usize>], bins: &[usize], chance: &mut Chance) -> Vec<usize> {
    let mut order: Vec<usize> = (0..members.len()).collect();
    chance.shuffle(&mut order);
    let mut out = vec![0; bins.len()];
    for (target, &source) in members.iter().zip(&order) {
        let from = &members[source];
        for (j, &k) in target.iter().enumerate() {
            out[k] = bins[from[j * from.len() / target.len()]];
        }
    }
    out
}

/// Structure in time: autocorrelation of neighbouring samples with the stretch in which the residual is largest, and a period.
fn in_time(data: &Data, residual: &[f64], load: &[f64]) -> Vec<Pattern> {
    let scaled = Scaled::new(data, residual);
    let rho = scaled.autocorrelation(1);
    let n = data.used().count() as f64;
    let z = rho * n.sqrt();
    if z < 4.0 || rho < 0.1 {
        return Vec::new();
    }
    let span = data.used().map(|i| data.span_s[i]).sum::<f64>() / n;
    let lasts = (1..400).find(|k| scaled.autocorrelation(*k) < 0.37 * rho).unwrap_or(400);
    let largest = worst_stretch(data, residual, load, lasts).map(|stretch| {
        let ([from_s, to_s], percent) = (stretch.between_s, 100.0 * stretch.above);
        let side = if percent < 0.0 { "below" } else { "above" };
        let lines = stretch.lines.map_or_else(String::new, |lines| format!(" ({})", in_words(lines)));
        format!("largest from {from_s:.0} s to {to_s:.0} s{lines}, {:.1} % {side} the prediction", percent.abs())
    });
    let stretch = largest.as_ref().map_or_else(String::new, |largest| format!("; {largest}"));
    let mut found = vec![Pattern {
        along: format!("time (persists over about {:.1} s{stretch})", lasts as f64 * span),
        test_r2: rho * rho,
        p_value: (-0.5 * z * z).exp().max(1e-12),
        is_persistence: true,
        largest,
    }];
    if let Some((period_s, r2)) = period(data, residual, span) {
        let along = format!("time (repeats every {period_s:.2} s)");
        found.push(Pattern { along, test_r2: r2, p_value: 1e-6, is_persistence: false, largest: None });
    }
    found
}

/// A range of lines of a program.
fn in_words([first, last]: [u32; 2]) -> String {
    if first == last { format!("line {first}") } else { format!("lines {first} to {last}") }
}

/// The period of largest spectral power, s, and its R² from bin means over the phase, learned and scored on alternate
/// blocks.
fn period(data: &Data, residual: &[f64], span: f64) -> Option<(f64, f64)> {
    let used: Vec<usize> = data.used().filter(|i| data.state[*i].time_s.is_finite()).collect();
    let (first, last) = (data.state[*used.first()?].time_s, data.state[*used.last()?].time_s);
    let length = last - first;
    let (low, high) = (3.0 / length, 0.25 / span.max(1e-6));
    let count = ((high - low) * length * 3.0).clamp(10.0, 4000.0) as usize;
    let step = (high - low) / count as f64;
    // w r e^(2πift) of each sample, multiplied by e^(2πi Δf t) from one frequency to the next.
    let turned = |f: f64| used.iter().map(move |i| (std::f64::consts::TAU * f * data.state[*i].time_s).sin_cos());
    let turns: Vec<(f64, f64)> = turned(step).collect();
    let begin = turned(low).zip(&used).map(|((sin, cos), i)| {
        let size = data.weight[*i] * residual[*i];
        (size * sin, size * cos)
    });
    let mut at: Vec<(f64, f64)> = begin.collect();
    let mut best = (f64::NEG_INFINITY, low);
    for k in 0..count {
        let (sin, cos) = at.iter().fold((0.0, 0.0), |(s, c), (sin, cos)| (s + sin, c + cos));
        let power: f64 = sin * sin + cos * cos;
        if power >= best.0 {
            best = (power, low + step * k as f64);
        }
        for ((sin, cos), (by_sin, by_cos)) in at.iter_mut().zip(&turns) {
            (*sin, *cos) = (*sin * by_cos + *cos * by_sin, *cos * by_cos - *sin * by_sin);
        }
    }
    let best = best.1;
    let bins: Vec<usize> =
        used.iter().map(|i| ((data.state[*i].time_s * best).rem_euclid(1.0) * 10.0) as usize % 10).collect();
    let blocks = data.blocks();
    let half: Vec<bool> =
        used.iter().map(|i| blocks.binary_search(&data.block[*i]).unwrap_or(0).is_multiple_of(2)).collect();
    Some((1.0 / best, cross_r2(&used, &bins, &half, residual, data)))
}
