//! How effects change the columns of [`Data`]. In: samples, effects with values. Out: the changed columns, or their sum
//! weighted by the base coefficients.
//!
//! First geometry variants are added to the columns; then tare columns are multiplied by Π tare, cutting columns by Π
//! cutting · feed ratio, edge columns by Π edge; last, a lag filters along time. The factors differ from sample to
//! sample; changes of geometry, acceleration, lag and excess of the reading are the same for all samples
//! ([`Acting::whole`]).

use crate::effects::{Acts, Change, Effect, Excess, Parameter, Place, State, named};
use crate::learn::dataset::samples::{Class, Data, VariantColumns};
use crate::learn::program::runout_grid::RunoutGrid;
use crate::learn::program::variant::Variant;
use crate::learn::report::Added;
use crate::machine::material::{EffectUse, Process};
use crate::path::Vec3;
use std::f64::consts::TAU;

/// Most Newton steps to find the load of a reading; about five suffice.
const MOST_INVERSIONS: usize = 24;
/// Newton step, relative to the load, behind which nothing is left to a double.
const LAST_STEP: f64 = 1e-8;

/// An effect with values of its parameters.
#[derive(Debug, Clone)]
pub struct FittedEffect {
    /// The effect.
    pub effect: &'static Effect,
    /// Values in the order of its parameters.
    pub values: Vec<f64>,
    /// Which of them are fitted.
    pub free: Vec<bool>,
}

impl FittedEffect {
    /// Number of fitted parameters.
    pub fn free_count(&self) -> usize {
        self.free.iter().filter(|f| **f).count()
    }

    /// The same with no parameter fitted.
    pub fn held(&self) -> Self {
        Self { free: vec![false; self.free.len()], ..self.clone() }
    }
}

/// An effect of a report in the form that the fit uses.
pub fn in_model(added: &Added) -> Option<FittedEffect> {
    let effect = named(&added.name)?;
    let given = |name: &str| added.parameters.iter().find(|v| v.name == name).map(|v| v.value);
    let value = |p: &Parameter| given(p.name).or(p.neutral);
    let values: Vec<f64> = effect.parameters.iter().map(value).collect::<Option<_>>()?;
    let free = effect.parameters.iter().zip(&values).map(|(p, v)| p.neutral != Some(*v) && !p.is_read_off()).collect();
    Some(FittedEffect { effect, values, free })
}

/// The effects of a model file on loads and readings; those on geometry and motion already act in the job.
pub fn in_model_file(process: &Process) -> Vec<FittedEffect> {
    let acting = |used: &EffectUse| {
        let effect = named(&used.name).filter(|e| matches!(e.acts, Acts::Load | Acts::Measuring))?;
        let values = effect.values(used)?;
        let is_fixed = |p: &Parameter| p.is_scanned() || p.is_read_off();
        let free = effect.parameters.iter().zip(&values).map(|(p, v)| p.neutral != Some(*v) && !is_fixed(p));
        Some(FittedEffect { effect, free: free.collect(), values })
    };
    process.effects.iter().filter_map(acting).collect()
}

/// The changes by the effects of a report that are the same for every cut.
pub fn changes(found: &[Added]) -> Vec<Change> {
    found.iter().filter_map(in_model).map(|each| (each.effect.change)(&each.values, &State::default())).collect()
}

/// One effect evaluated for every sample.
pub struct Acting {
    /// Factors on tare, cutting and edge columns; `None` where all are 1.
    factors: [Option<Vec<f64>>; 3],
    /// Changes that are the same for all samples.
    whole: Change,
}

/// Evaluates an effect for every sample.
pub fn acting(each: &FittedEffect, data: &Data) -> Acting {
    acting_on(each, data, 0..data.len())
}

/// The same for some samples; all factors of the others are 1.
pub fn acting_on(each: &FittedEffect, data: &Data, samples: impl Iterator<Item = usize>) -> Acting {
    let mut factors = [const { None::<Vec<f64>> }; 3];
    let is_whole = matches!(each.effect.acts, Acts::Geometry | Acts::Motion);
    for i in samples.filter(|_| !is_whole) {
        let one = (each.effect.change)(&each.values, &data.state[i]);
        for (factor, value) in factors.iter_mut().zip([one.tare, one.cutting, one.edge]) {
            // In air covariates of the cut are NaN, and there is no load to change.
            if value.is_finite() && value != 1.0 {
                factor.get_or_insert_with(|| vec![1.0; data.len()])[i] = value;
            }
        }
    }
    Acting { factors, whole: (each.effect.change)(&each.values, &State::default()) }
}

/// The changes by all effects that are the same for all samples.
pub fn combined(acting: &[&Acting]) -> Change {
    let mut sum = Change::default();
    for one in acting.iter().map(|a| &a.whole) {
        sum.runout_mm += one.runout_mm;
        sum.runout_phase += one.runout_phase;
        sum.stock_top_mm += one.stock_top_mm;
        sum.stock_side_mm += one.stock_side_mm;
        sum.stock_faces_mm.iter_mut().zip(one.stock_faces_mm).for_each(|(sum, face)| *sum += face);
        sum.stock_turn_rad += one.stock_turn_rad;
        sum.stock_slope.iter_mut().zip(one.stock_slope).for_each(|(sum, slope)| *sum += slope);
        sum.diameter_mm += one.diameter_mm;
        sum.acceleration *= one.acceleration;
        if one.excess.at_full != 0.0 {
            sum.excess = one.excess;
        }
        sum.lag_s += one.lag_s;
        sum.curved += one.curved;
    }
    sum
}

/// Columns as the effects change them.
pub fn changed_columns(data: &Data, acting: &[&Acting]) -> Vec<Vec<f64>> {
    let whole = combined(acting);
    let ratio = feed_ratio(data, whole.acceleration);
    let filter = Filter::new(data, whole.lag_s);
    let mut columns = data.columns.clone();
    for (b, column) in columns.iter_mut().enumerate() {
        for (size, more) in variant_sizes(data, &whole) {
            size.add(1.0, &more[b], column);
        }
        multiply_by_factors(column, data.base[b].class, acting, ratio.as_ref());
        if let Some(f) = &filter {
            f.run(column, None);
        }
    }
    columns
}

/// The part of a lagged load that comes from readings instead of Σ β·column, because the load before is unknown; `None`
/// if there is none. See [`Filter`].
pub fn load_from_readings(data: &Data, acting: &[&Acting]) -> Option<Vec<f64>> {
    let whole = combined(acting);
    let filter = Filter::new(data, whole.lag_s).filter(Filter::reads)?;
    let mut kept = vec![0.0; data.len()];
    filter.run(&mut kept, Some(&before_drive(data, &whole.excess)));
    Some(kept)
}

/// Response of the same filter to residuals in place of readings: errors at samples of unknown load that it carries
/// over into the samples after them. `None` if no level comes from a reading.
pub fn carried_over(data: &Data, lag_s: f64, residual: &[f64]) -> Option<Vec<f64>> {
    let filter = Filter::new(data, lag_s).filter(Filter::reads)?;
    let mut carried_over = vec![0.0; data.len()];
    filter.run(&mut carried_over, Some(residual));
    Some(carried_over)
}

/// Σ β·column with the columns as the effects change them.
pub fn load(data: &Data, acting: &[&Acting], base: &[f64]) -> Vec<f64> {
    load_of_parts(data, &parts(data, acting, base), acting)
}

const CLASSES: [Class; 3] = [Class::Tare, Class::Cutting, Class::Edge];

/// Σ β·column of the tare, of the cutting and of the edge terms, in the geometry as the effects change it, before their factors.
pub fn parts(data: &Data, acting: &[&Acting], base: &[f64]) -> [Vec<f64>; 3] {
    let sizes = variant_sizes(data, &combined(acting));
    CLASSES.map(|class| {
        let mut part = vec![0.0; data.len()];
        for (b, beta) in base.iter().enumerate().filter(|(b, _)| data.base[*b].class == class) {
            part.iter_mut().zip(&data.columns[b]).for_each(|(p, x)| *p += beta * x);
            for (size, more) in &sizes {
                size.add(*beta, &more[b], &mut part);
            }
        }
        part
    })
}

/// Does an effect with other values leave the parts of a load as they are?
pub fn leaves_parts(before: &Acting, after: &Acting) -> bool {
    combined(&[before]) == combined(&[after])
}

/// The load with these [`parts`].
pub fn load_of_parts(data: &Data, parts: &[Vec<f64>; 3], acting: &[&Acting]) -> Vec<f64> {
    let whole = combined(acting);
    let ratio = feed_ratio(data, whole.acceleration);
    let mut sum = vec![0.0; data.len()];
    for (class, part) in CLASSES.into_iter().zip(parts) {
        let mut part = part.clone();
        multiply_by_factors(&mut part, class, acting, ratio.as_ref());
        sum.iter_mut().zip(&part).for_each(|(s, p)| *s += p);
    }
    if let Some(f) = &Filter::new(data, whole.lag_s) {
        f.run(&mut sum, Some(&before_drive(data, &whole.excess)));
    }
    sum
}

/// Is a sample a reading of the drive? Forces are measured beside it.
fn is_of_drive(data: &Data, i: usize) -> bool {
    data.channel.get(i).is_none_or(|channel| *channel == 0)
}

/// The loads whose readings with the excess of the drive are those of the data.
pub fn before_drive(data: &Data, excess: &Excess) -> Vec<f64> {
    if excess.at_full == 0.0 {
        return data.reading.clone();
    }
    let load = |(i, y): (usize, &f64)| if is_of_drive(data, i) { load_of_reading(*y, excess) } else { *y };
    data.reading.iter().enumerate().map(load).collect()
}

/// The load P with P(1 + c(P/P₁)^p) = y, by Newton's method from P = y. The function is convex for P > 0, so the steps
/// converge from one side; below 0 there is no excess.
fn load_of_reading(y: f64, excess: &Excess) -> f64 {
    let mut p = y;
    for _ in 0..MOST_INVERSIONS {
        let [reading, slope] = excess.reading_and_slope(p);
        let step = (reading - y) / slope;
        p -= step;
        // What is left is of the order of the square of the step.
        if step.abs() <= LAST_STEP * p.abs() {
            break;
        }
    }
    p
}

fn multiply_by_factors(column: &mut [f64], class: Class, acting: &[&Acting], ratio: Option<&Vec<f64>>) {
    for factors in acting.iter().filter_map(|a| a.factors[class as usize].as_ref()) {
        column.iter_mut().zip(factors).for_each(|(x, f)| *x *= f);
    }
    if let Some(ratio) = ratio.filter(|_| class == Class::Cutting) {
        column.iter_mut().zip(ratio).for_each(|(x, r)| *x *= r);
    }
}

/// How much of a variant is in a change.
enum Share {
    /// The same in all samples.
    Of(f64),
    /// By sample.
    OfEach(Vec<f64>),
}

impl Share {
    /// Adds `factor` times so much of these values to `sum`.
    fn add(&self, factor: f64, values: &[f64], sum: &mut [f64]) {
        let of = sum.iter_mut().zip(values);
        match self {
            Share::Of(share) => of.for_each(|(s, value)| *s += factor * share * value),
            Share::OfEach(shares) => of.zip(shares).for_each(|((s, value), share)| *s += factor * share * value),
        }
    }
}

/// Variants that the change asks for, with how much of them.
fn variant_sizes<'a>(data: &'a Data, change: &Change) -> Vec<(Share, &'a Vec<Vec<f64>>)> {
    // Stock from a file has no sides to move and no extent that is known here: nothing would bound its slope in another program.
    let has_extent = data.variants.iter().any(|v| v.variant == Variant::StockSide);
    let slopes = has_extent && change.stock_slope != [0.0; 2];
    let asked = |v: &'a VariantColumns| {
        let size = variant_size(v.variant, change, &data.runouts);
        let size = Some(size).filter(|size| *size != 0.0 && !(slopes && v.variant == Variant::StockTop))?;
        let simulated = data.variants.iter().filter(|other| other.variant == v.variant).map(|other| other.size);
        let share = Some(share_of(size, v.size, simulated)).filter(|share| *share != 0.0)?;
        Some((Share::Of(share), &v.columns))
    };
    let found = data.variants.iter().filter_map(asked);
    if !slopes {
        return found.collect();
    }
    let tops: Vec<&VariantColumns> = data.variants.iter().filter(|v| v.variant == Variant::StockTop).collect();
    let sizes: Vec<f64> = tops.iter().map(|v| v.size).collect();
    let top = |at: Vec3| if at.x.is_finite() { change.stock_top_at_mm(at.x, at.y) } else { change.stock_top_mm };
    let shares = shares_of_each(data.state.iter().map(|state| top(state.position)), &sizes);
    found.chain(shares.into_iter().zip(tops).map(|(each, v)| (Share::OfEach(each), &v.columns))).collect()
}

/// [`share_of`] of many sizes: for each size that was simulated, how much of it is in each of them.
fn shares_of_each(sizes: impl ExactSizeIterator<Item = f64>, simulated: &[f64]) -> Vec<Vec<f64>> {
    let mut order: Vec<usize> = (0..simulated.len()).collect();
    order.sort_by(|a, b| simulated[*a].abs().total_cmp(&simulated[*b].abs()));
    let [inward, outward] = [-1.0, 1.0].map(|sign: f64| -> Vec<usize> {
        let own: Vec<usize> = order.iter().copied().filter(|k| simulated[*k].signum() == sign).collect();
        // Where none has that sign, the least stands for it.
        if own.is_empty() { order.first().copied().into_iter().collect() } else { own }
    });
    let mut shares = vec![vec![0.0; sizes.len()]; simulated.len()];
    for (i, size) in sizes.enumerate() {
        let side = if size < 0.0 { &inward } else { &outward };
        let reaches = |k: &usize| simulated[*k].abs() < size.abs();
        match side.partition_point(reaches) {
            0 => side.first().into_iter().for_each(|k| shares[*k][i] = size),
            next if next == side.len() => shares[side[next - 1]][i] = size,
            next => {
                let [below, above] = [side[next - 1], side[next]];
                let [low, high] = [below, above].map(|k| simulated[k]);
                let past = (size - low) / (high - low);
                (shares[below][i], shares[above][i]) = ((1.0 - past) * low, past * high);
            }
        }
    }
    shares
}

/// How much of the variant simulated at the size `own` is in a change by `size`: between zero and the sizes of its sign that were
/// simulated the columns are linear, beyond the farthest in proportion to it; where none has that sign, to the least.
fn share_of(size: f64, own: f64, simulated: impl Iterator<Item = f64> + Clone) -> f64 {
    let has_its_sign = |other: &f64| other.signum() == size.signum();
    if !simulated.clone().any(|other| has_its_sign(&other)) {
        let least = simulated.map(f64::abs).fold(f64::INFINITY, f64::min);
        return if own.abs() == least { size } else { 0.0 };
    }
    let sizes = simulated.filter(has_its_sign).map(f64::abs);
    let below = sizes.clone().filter(|other| *other <= size.abs()).fold(0.0, f64::max);
    let above = sizes.filter(|other| *other > size.abs()).fold(f64::INFINITY, f64::min);
    let past = (size.abs() - below) / (above - below);
    match own {
        _ if !has_its_sign(&own) => 0.0,
        own if own.abs() == below && above.is_infinite() => size,
        own if own.abs() == below => (1.0 - past) * own,
        own if own.abs() == above => past * own,
        _ => 0.0,
    }
}

/// Size of a variant in a change, mm; a share 0 … 1 for curvature, runout and span.
fn variant_size(variant: Variant, change: &Change, runouts: &RunoutGrid) -> f64 {
    match variant {
        Variant::StockTop => change.stock_top_mm,
        Variant::StockSide => change.stock_side_mm,
        Variant::StockFace(face) => change.stock_faces_mm[face],
        Variant::StockTurn => change.stock_turn_rad,
        Variant::Diameter => change.diameter_mm,
        Variant::Curved => change.curved,
        Variant::Runout { offset, phase } => runouts.share(change.runout_mm, change.runout_phase, offset, phase),
        Variant::OverSpan => f64::from(change.lag_s > 0.0),
    }
}

/// Feed over declared feed on a machine with this factor of the acceleration, interpolated in the logarithm of the
/// factor.
fn feed_ratio(data: &Data, factor: f64) -> Option<Vec<f64>> {
    let last = data.slower.last().filter(|_| factor < 1.0)?;
    let after = data.slower.iter().position(|s| s.factor <= factor);
    let (below, t) = match after {
        None => (last, 1.0),
        Some(k) => {
            let above = if k == 0 { 1.0 } else { data.slower[k - 1].factor };
            (&data.slower[k], (above / factor).ln() / (above / data.slower[k].factor).ln())
        }
    };
    let above = after.filter(|k| *k > 0).map(|k| &data.slower[k - 1].ratio);
    let between = |i: usize| {
        let high = above.map_or(1.0, |ratio| ratio[i]);
        high + t * (below.ratio[i] - high)
    };
    Some((0..data.len()).map(between).collect())
}

/// First-order lag of time constant T along the runs. With u the mean load over the span of a sample and L the level
/// before it, the level after k of its m readings is u + (L − u)·qᵏ, q = e^(−span/(m T)); the sample is the mean over k
/// = 1 … m.
///
/// If a load is uncertain, the level is corrected by the reading (Kalman filter). Variances are in units of that of a
/// reading: d of the load of a sample (infinite: unknown), v of the level before the correction. v = κ²·v′ + (1 −
/// κ)²·d, with κ = e^(−span/T) and v′ the variance after the sample before; then the level moves by v/(v + 1) of
/// reading less prediction, and v′ = v/(v + 1). With all d = 0 no reading has influence.
struct Filter {
    steps: Vec<Step>,
}

/// Coefficients of the filter at a sample.
struct Step {
    /// Does it follow the sample before without a gap?
    follows: bool,
    /// Share of L − u in the sample.
    share: f64,
    /// Share of L − u in the level after it, κ.
    keep: f64,
    /// Share of the reading's deviation in the level after it, v/(v + 1).
    read: f64,
}

impl Filter {
    fn new(data: &Data, lag_s: f64) -> Option<Self> {
        let mut variance = 0.0;
        let mut step = |i: usize| {
            let m = data.readings_per_sample.get(i).copied().unwrap_or(1.0).max(1.0);
            let q = (-data.span_s[i] / (m * lag_s)).exp();
            let keep = (-data.span_s[i] / lag_s).exp();
            let share = if q < 1.0 { q * (1.0 - keep) / ((1.0 - q) * m) } else { 1.0 };
            let doubt = data.load_variance.get(i).copied().unwrap_or(0.0);
            let follows = i > 0 && data.run[i] == data.run[i - 1];
            let kept = if follows { keep * keep * variance } else { 0.0 };
            let before = kept + (1.0 - keep).powi(2) * doubt;
            let read = if before.is_finite() { before / (before + 1.0) } else { 1.0 };
            variance = read;
            Step { follows, share, keep, read }
        };
        (lag_s > 0.0).then(|| Self { steps: (0..data.len()).map(&mut step).collect() })
    }

    /// Does a reading have influence anywhere?
    fn reads(&self) -> bool {
        self.steps.iter().any(|s| s.read > 0.0)
    }

    /// Filters loads with their readings, or a column without readings (0).
    fn run(&self, values: &mut [f64], readings: Option<&[f64]>) {
        let mut level = 0.0;
        for (i, (value, step)) in values.iter_mut().zip(&self.steps).enumerate() {
            let input = *value;
            level = if step.follows { level } else { input };
            *value = input + (level - input) * step.share;
            level = input + (level - input) * step.keep;
            level += step.read * (readings.map_or(0.0, |r| r[i]) - *value);
        }
    }
}

/// The readings of loads with the excess of the drive.
pub fn measured(data: &Data, mut load: Vec<f64>, acting: &[&Acting]) -> Vec<f64> {
    let excess = combined(acting).excess;
    if excess.at_full != 0.0 {
        let of_drive = load.iter_mut().enumerate().filter(|(i, _)| is_of_drive(data, *i));
        of_drive.for_each(|(_, p)| *p *= 1.0 + excess.of(*p));
    }
    load
}

/// Slopes of the readings over these loads; `None` without an excess.
pub fn slopes_of_readings(data: &Data, load: &[f64], excess: &Excess) -> Option<Vec<f64>> {
    let slope = |(i, p): (usize, &f64)| if is_of_drive(data, i) { excess.slope(*p) } else { 1.0 };
    (excess.at_full != 0.0).then(|| load.iter().enumerate().map(slope).collect())
}

/// The full load of the first quantity of these data where it is this place: the 99th percentile of the readings; 0 where it is not.
pub fn full_load(data: &Data, place: Option<Place>) -> f64 {
    let reads_torque = data.channel_names.first().is_some_and(|name| name.starts_with("spindle_torque"));
    if place != Some(if reads_torque { Place::LargestTorque } else { Place::LargestPower }) {
        return 0.0;
    }
    let mut readings: Vec<f64> = data.used().filter(|i| data.channel[*i] == 0).map(|i| data.reading[i]).collect();
    let at = readings.len() * 99 / 100;
    if readings.is_empty() { 0.0 } else { readings.select_nth_unstable_by(at, f64::total_cmp).1.abs().max(1e-9) }
}

/// An effect of a model file with its full load in the quantity of these data: a torque is a power over 2πn, n being the speed of their tare.
pub fn in_quantity_of(data: &Data, mut each: FittedEffect) -> FittedEffect {
    let place = |place: Place| each.effect.parameters.iter().position(|p| p.place == Some(place));
    let Some((power, torque)) = place(Place::LargestPower).zip(place(Place::LargestTorque)) else { return each };
    let rps = data.state.iter().map(|state| state.reference_rps).find(|rps| rps.is_finite());
    let Some(per_nm) = rps.map(|rps| TAU * rps) else { return each };
    if full_load(data, Some(Place::LargestTorque)) > 0.0 {
        each.values[torque] = each.values[torque].max(each.values[power] / per_nm);
        each.values[power] = 0.0;
    } else {
        each.values[power] = each.values[power].max(each.values[torque] * per_nm);
        each.values[torque] = 0.0;
    }
    each
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::named;

    /// A load that steps from 0 to 1 at sample 10.
    fn stepped(readings_per_sample: f64) -> Data {
        let n = 40;
        Data {
            base: vec![crate::learn::dataset::samples::Base {
                name: "k_tc".into(),
                unit: String::new(),
                class: Class::Cutting,
                prior: None,
                bounds: crate::learn::dataset::samples::UNBOUNDED,
            }],
            columns: vec![(0..n).map(|i| f64::from(i >= 10)).collect()],
            reading: vec![0.0; n as usize],
            weight: vec![1.0; n as usize],
            state: vec![State::default(); n as usize],
            span_s: vec![0.1 * readings_per_sample; n as usize],
            readings_per_sample: vec![readings_per_sample; n as usize],
            run: vec![0; n as usize],
            ..Data::default()
        }
    }

    #[test]
    fn a_size_between_two_simulated_ones_is_made_of_both_and_beyond_them_of_the_farthest() {
        let simulated = [0.5, 1.5, -0.5];
        let shares = |size: f64| simulated.map(|own| share_of(size, own, simulated.into_iter()));
        assert_eq!(shares(0.2), [0.2, 0.0, 0.0]);
        // Half way: half of what half a millimetre changes, and half of what one and a half do.
        assert_eq!(shares(1.0), [0.25, 0.75, 0.0]);
        assert_eq!(shares(3.0), [0.0, 3.0, 0.0]);
        assert_eq!([shares(-0.2), shares(-2.0)], [[0.0, 0.0, -0.2], [0.0, 0.0, -2.0]]);
        for size in [0.2, 1.0, 3.0, -0.2, -2.0, 0.0] {
            let each: Vec<f64> = shares_of_each([size].into_iter(), &simulated).concat();
            assert!(each.iter().zip(shares(size)).all(|(a, b)| (a - b).abs() < 1e-15), "{size}: {each:?}");
        }
        assert_eq!(shares_of_each([-0.3].into_iter(), &[0.5]), [[-0.3]]);
        // Inward was not simulated: the negative of outward.
        assert_eq!(share_of(-0.3, 0.5, [0.5].into_iter()), -0.3);
    }

    #[test]
    fn a_top_with_a_slope_is_higher_by_place_where_the_stock_has_sides() {
        let each = FittedEffect {
            effect: named("stock-proud").unwrap(),
            values: vec![0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -2.0],
            free: vec![true; 9],
        };
        let at = |x: f64, y: f64| State { position: Vec3::new(x, y, 0.0), ..State::default() };
        let columns = |value: f64| vec![vec![value; 3]];
        let variant = |variant, size| VariantColumns { variant, size, columns: columns(7.0) };
        let data = Data {
            columns: columns(1.0),
            state: vec![at(0.0, 0.0), at(30.0, 0.0), at(0.0, 10.0)],
            variants: vec![
                variant(Variant::StockTop, 0.5),
                variant(Variant::StockTop, -0.5),
                variant(Variant::StockSide, 0.5),
            ],
            ..Data { base: stepped(1.0).base, ..Data::default() }
        };
        let found = |data: &Data| changed_columns(data, &[&acting(&each, data)])[0].clone();
        // 7 per mm, of 0.1, 0.1 + 0.3 and 0.1 − 0.2 mm.
        for (value, expected) in found(&data).iter().zip([1.7, 3.8, 0.3]) {
            assert!((value - expected).abs() < 1e-12, "{value} for {expected}");
        }
        let of_a_file = Data { variants: data.variants[..2].to_vec(), ..data };
        assert!(found(&of_a_file).iter().all(|value| (value - 1.7).abs() < 1e-12));
    }

    #[test]
    fn a_lag_is_the_step_response_at_the_readings_and_their_mean_in_a_cell() {
        let lag = FittedEffect { effect: named("sensor-lag").unwrap(), values: vec![0.4], free: vec![true] };
        let response = |t: f64| 1.0 - (-t / 0.4f64).exp();
        for m in [1usize, 3] {
            let data = stepped(m as f64);
            let out = &changed_columns(&data, &[&acting(&lag, &data)])[0];
            for (i, value) in out.iter().enumerate() {
                let readings = (1..=m).map(|k| response(0.1 * ((i as f64 - 10.0) * m as f64 + k as f64)).max(0.0));
                let expected = readings.sum::<f64>() / m as f64;
                assert!((value - expected).abs() < 1e-12, "{m} {i}: {value} {expected}");
            }
            let whole = load(&data, &[&acting(&lag, &data)], &[2.0]);
            assert!(whole.iter().zip(out).all(|(w, x)| (w - 2.0 * x).abs() < 1e-12));
        }
    }

    #[test]
    fn the_load_behind_a_reading_has_that_reading() {
        for (excess, exponent) in [(0.1, 1.0), (1.5, 4.0), (1.5, 0.3)] {
            let drive = Excess { at_full: excess, exponent, full_power: 100.0, ..Excess::default() };
            for load in [-3.0, 0.0, 1e-3, 40.0, 100.0, 250.0] {
                let reading = load * (1.0 + drive.of(load));
                let found = load_of_reading(reading, &drive);
                assert!((found - load).abs() <= 1e-12 * load.abs(), "{excess} {exponent} {load}: {found}");
            }
        }
    }

    #[test]
    fn after_a_load_that_nobody_knows_the_level_is_what_was_read() {
        let lag = FittedEffect { effect: named("sensor-lag").unwrap(), values: vec![0.4], free: vec![true] };
        let mut data = stepped(1.0);
        // The true load is 5 at samples 20 … 24; the columns have 1.
        let hidden = |i: usize| f64::from(i >= 10) + if (20..25).contains(&i) { 4.0 } else { 0.0 };
        let keep = (-0.1 / 0.4f64).exp();
        let mut level = 0.0;
        for i in 0..data.len() {
            level = hidden(i) + (level - hidden(i)) * keep;
            data.reading[i] = level;
        }
        data.load_variance = (0..40).map(|i| if (20..25).contains(&i) { f64::INFINITY } else { 0.0 }).collect();
        let acts = acting(&lag, &data);
        let whole = load(&data, &[&acts], &[1.0]);
        let kept = load_from_readings(&data, &[&acts]).unwrap();
        let column = &changed_columns(&data, &[&acts])[0];
        for i in 0..data.len() {
            assert!((whole[i] - column[i] - kept[i]).abs() < 1e-12, "{i}");
            let known = !(20..25).contains(&i);
            assert!(!known || (whole[i] - data.reading[i]).abs() < 1e-12, "{i}: {} {}", whole[i], data.reading[i]);
        }
        data.load_variance.clear();
        let without = load(&data, &[&acting(&lag, &data)], &[1.0]);
        assert!((without[26] - data.reading[26]).abs() > 1.0);
    }

    #[test]
    fn what_a_doubtful_load_leaves_behind_is_read_off() {
        let lag = FittedEffect { effect: named("sensor-lag").unwrap(), values: vec![0.4], free: vec![true] };
        let mut data = stepped(2.0);
        let columns = data.columns[0].clone();
        // The true load is a third higher at samples 20 … 24, and the column is uncertain by as much.
        data.columns[0][20..25].iter_mut().for_each(|x| *x = 4.0 / 3.0);
        data.reading = load(&data, &[&acting(&lag, &data)], &[300.0]);
        data.columns[0] = columns;
        let off = |data: &Data| -> Vec<f64> {
            let predicted = load(data, &[&acting(&lag, data)], &[300.0]);
            predicted.iter().zip(&data.reading).map(|(p, y)| (p - y).abs()).collect()
        };
        let without = off(&data);
        assert!(without[25] > 40.0 && without[27] > 10.0);
        data.load_variance = (0..40).map(|i| if (20..25).contains(&i) { 1e4 } else { 0.0 }).collect();
        let with = off(&data);
        assert!((0..20).all(|i| with[i] < 1e-9) && (25..40).all(|i| with[i] < 0.1 * without[i] + 1e-9), "{with:?}");
    }
}
