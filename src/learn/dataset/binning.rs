//! Data of a log: columns of every sample, averaged over cells of a few samples. In: an aligned log, a simulated
//! program. Out: [`Data`].
//!
//! The columns of a power sample are tare(n)/tare(n₀), removal area·speed and contact·n (times 1e-3: 1 N·mm/s is 1 mW);
//! those of a peak force its derivatives by k_tc, k_rc, k_te, k_re. A cell holds either reliable or doubtful samples,
//! and has the sum of their weights ([`super::weights`]).

use crate::force::contact::Engaged;
use crate::learn::align::Aligned;
use crate::learn::dataset::placed_log::{Operation, PlacedLog, operations};
use crate::learn::dataset::samples::{Base, Class, Data, SlowerMachine, UNBOUNDED, VariantColumns};
use crate::learn::dataset::steady_table::spindle_base;
use crate::learn::dataset::weights::cell_sizes;
use crate::learn::log::Log;
use crate::learn::log::gaps::longest_step;
use crate::learn::log::gaps::median_step;
use crate::learn::log::quantity::OF_SPINDLE;
use crate::learn::log::quantity::Quantity;
use crate::learn::program::declared::in_force;
use crate::learn::program::runout_grid::RUNOUT_GRID;
use crate::learn::program::simulated::ProgramView;
use crate::learn::program::timeline::{Activity, Spot};
use crate::learn::program::variant::OtherGeometry;
use crate::learn::program::variant::Variant;
use crate::machine::Job;

/// Most cells that a log is averaged into.
const MOST_CELLS: usize = 8000;
/// Number of blocks of time for splits.
const BLOCKS: f64 = 60.0;
/// Most spots between two readings; with more it is a gap.
const MOST_BETWEEN: usize = 200;
/// Relative standard deviation of the priors on base coefficients about the declared values: power, forces. Judgement.
const PRIOR: [f64; 2] = [0.5, 0.25];

/// Standard deviation of the prior on the run-up coefficient, W, % or A: wide enough for every meter, and finite, so
/// that the coefficient is 0 without a run-up in the data. Judgement.
const RUN_UP: f64 = 1e3;

/// Bounds of the force coefficients over the declared ones: from peak forces alone a larger edge coefficient cannot be
/// separated from runout. Judgement.
const FORCE_BOUNDS: [f64; 2] = [0.6, 1.5];

/// The measured quantities of a log that are used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channels {
    /// A spindle quantity: index into the measured ones, kind and unit.
    pub spindle: Option<(usize, Quantity, &'static str)>,
    /// Peak force in the plane: index into the measured ones.
    pub force_xy: Option<usize>,
}

/// Chooses the measured quantities.
pub fn channels(log: &Log) -> Channels {
    let find = |name: &str| log.measured.iter().position(|(n, _)| *n == name);
    let spindle = OF_SPINDLE.into_iter().find_map(|(name, kind, unit)| find(name).map(|k| (k, kind, unit)));
    Channels { spindle, force_xy: find("force_xy_n") }
}

/// Data of a log, and how many samples were weighted down.
pub fn bin_log(log: &Log, aligned: &Aligned, known: &ProgramView, channels: &Channels) -> (Data, usize) {
    let spots = &known.timeline.spots;
    let mut data = Data { kind_names: operation_names(spots), ..Data::default() };
    data.base = base(known.job, channels);
    data.columns = vec![Vec::new(); data.base.len()];
    data.variants = known
        .others
        .iter()
        .map(|o| (o.variant, o.size))
        .chain(
            channels
                .force_xy
                .iter()
                .flat_map(|_| runouts())
                .map(|(offset, phase)| (Variant::Runout { offset, phase }, 1.0)),
        )
        .chain([(Variant::OverSpan, 1.0)])
        .map(|(variant, size)| VariantColumns { variant, size, columns: vec![Vec::new(); data.base.len()] })
        .collect();
    data.runouts = known.runouts;
    data.slower = known.slower.iter().map(|(factor, _)| SlowerMachine { factor: *factor, ratio: Vec::new() }).collect();
    let path = PlacedLog::new(log, aligned, known);
    let mut lowered = 0;
    if let Some((k, quantity, unit)) = channels.spindle {
        data.channel_names.push(format!("{} ({unit})", log.measured[k].0));
        lowered += path.channel(&mut data, k, Some(quantity), 0);
    }
    if let Some(k) = channels.force_xy {
        data.channel_names.push("force_xy_n".into());
        lowered += path.channel(&mut data, k, None, usize::from(channels.spindle.is_some()));
    }
    (data, lowered)
}

/// Names of the operations; the last is air.
fn operation_names(spots: &[Spot]) -> Vec<String> {
    let cutting = operations(spots).into_iter().map(|each| format!("tool {} at {} rpm", each.tool, each.rpm));
    cutting.chain(["air".to_owned()]).collect()
}

/// Base coefficients: tare, k_tc, k_te and run-up for the spindle; in addition k_rc, k_re for forces.
fn base(job: &Job, channels: &Channels) -> Vec<Base> {
    let mut all = channels.spindle.map_or_else(Vec::new, |(_, quantity, unit)| spindle_base(quantity, unit));
    if let Some((_, _, unit)) = channels.spindle {
        all.push(Base {
            name: "run_up".into(),
            unit: unit.into(),
            class: Class::Tare,
            prior: Some((0.0, RUN_UP)),
            bounds: UNBOUNDED,
        });
    }
    let k = in_force(job);
    let relative = channels.spindle.is_some_and(|(_, quantity, _)| quantity == Quantity::Relative);
    let prior = |value: f64, force: bool| {
        (value.abs() > 0.0 && !relative).then(|| (value, PRIOR[usize::from(force)] * value.abs()))
    };
    if let Some(k) = k {
        for each in &mut all {
            each.prior = match each.name.as_str() {
                "k_tc" => prior(k.k_tc, false),
                "k_te" => prior(k.k_te, false),
                _ => None,
            };
        }
    }
    if channels.force_xy.is_some() {
        let k = k.unwrap_or_default();
        let force = |name: &str, unit: &str, class, value: f64| Base {
            name: name.into(),
            unit: unit.into(),
            class,
            prior: prior(value, true),
            bounds: if value > 0.0 { (FORCE_BOUNDS[0] * value, FORCE_BOUNDS[1] * value) } else { UNBOUNDED },
        };
        if all.is_empty() {
            all.push(force("k_tc", "N/mm²", Class::Cutting, k.k_tc));
            all.push(force("k_te", "N/mm", Class::Edge, k.k_te));
        }
        all.push(force("k_rc", "N/mm²", Class::Cutting, k.k_rc));
        all.push(force("k_re", "N/mm", Class::Edge, k.k_re));
    }
    all
}

impl PlacedLog<'_> {
    /// Interpolation weights of spots for a peak force at a time. The arcs of a spot are those of its most engaged end,
    /// so that at a joint the smaller force of the two spots applies. At the first or last end of a move it follows
    /// from the mean removal area.
    fn peak_shares(&self, time_s: f64) -> [(usize, f64); 2] {
        let spots = &self.known.timeline.spots;
        let own = self.known.timeline.at(time_s).unwrap_or(0);
        let spot = &spots[own];
        if spot.activity != Activity::Feed {
            return [(own, 1.0), (own, 0.0)];
        }
        let over = ((time_s - spot.start_s) / (spot.end_s - spot.start_s).max(1e-9)).clamp(0.0, 1.0);
        let near = |k: usize| spots.get(k).filter(|s| s.move_id == spot.move_id).map(|s| (k, s.engaged.peak[0]));
        let beside = [near(own.wrapping_sub(1)), near(own + 1)];
        let joint = |side: usize| match (beside[side], beside[1 - side]) {
            (Some((other, peak)), _) => (if peak < spot.engaged.peak[0] { other } else { own }, 1.0),
            (None, Some((_, peak))) if peak >= spot.engaged.peak[0] => (own, at_lesser_end(&spot.engaged)),
            _ => (own, 1.0),
        };
        let [(first, a), (last, b)] = [joint(0), joint(1)];
        [(first, a * (1.0 - over)), (last, b * over)]
    }

    /// Columns of the cut at one sample, in the engagement `of` the spots.
    fn cut<'e>(
        &self,
        i: usize,
        quantity: Option<Quantity>,
        base: &[Base],
        of: &impl Fn(usize) -> &'e Engaged,
    ) -> Vec<f64> {
        let mut columns = vec![0.0; base.len()];
        for (index, share) in self.load_shares(self.aligned.program_s[i], quantity, of) {
            let spot = &self.known.timeline.spots[index];
            for (column, b) in columns.iter_mut().zip(base) {
                let at_predicted_feed = Self::column(&b.name, quantity, self.rps(i, spot), spot, of(index));
                *column += share * self.at_feed(i, b.class) * at_predicted_feed;
            }
        }
        columns
    }

    /// Spots with weights whose weighted loads add up to that at a time.
    fn load_shares<'e>(
        &self,
        time_s: f64,
        quantity: Option<Quantity>,
        of: &impl Fn(usize) -> &'e Engaged,
    ) -> [(usize, f64); 3] {
        if quantity.is_some() {
            return self.section_shares(time_s, of);
        }
        let [one, other] = self.peak_shares(time_s);
        [one, other, (one.0, 0.0)]
    }

    /// Columns of the tare and of the run-up.
    fn idle(&self, i: usize, quantity: Quantity, spot: &Spot, base: &Base) -> f64 {
        match base.name.as_str() {
            "tare" => self.tare_factor(quantity, self.rps(i, spot)),
            "run_up" => self.running_up(i, spot),
            _ => 0.0,
        }
    }

    /// Share of the spindle speed reached during a run-up, 0 otherwise: the power that accelerates the spindle is not
    /// part of the tare.
    fn running_up(&self, i: usize, spot: &Spot) -> f64 {
        let running = spot.activity == Activity::RunUp && spot.rps > 0.0;
        if !running {
            return 0.0;
        }
        let planned = (self.aligned.program_s[i] - spot.start_s) / (spot.end_s - spot.start_s).max(1e-9);
        self.log.rps.as_ref().map_or(planned, |n| n[i] / spot.rps).clamp(0.0, 1.0)
    }

    /// Adds the cells of one measured quantity; returns the number of samples of reduced weight.
    fn channel(&self, data: &mut Data, k: usize, quantity: Option<Quantity>, channel: usize) -> usize {
        let values = &self.log.measured[k].1;
        let valid: Vec<usize> = (0..values.len())
            .filter(|i| values[*i].is_finite() && self.spot[*i].is_some() && !self.stands(*i))
            .collect();
        let loads = self.rough_loads(quantity, &data.base);
        let weights = self.weights(&valid, values, &loads);
        let (step_s, longest_s) = (median_step(&self.log.time_s), longest_step(&self.log.time_s));
        let offset = data.run.last().map_or(0, |r| r + 1);
        let (mut run, mut lowered, mut last) = (offset, 0, f64::NEG_INFINITY);
        let span = self.known.timeline.total_s();
        let mut next = 0;
        let channels = usize::from(data.variants.iter().any(|v| matches!(v.variant, Variant::Runout { .. }))) + 1;
        for size in cell_sizes(&weights, MOST_CELLS / channels) {
            let (members, weights) = (&valid[next..next + size], &weights[next..next + size]);
            next += size;
            let begin = self.log.time_s[members[0]];
            run += usize::from(begin - last > longest_s && last.is_finite());
            last = self.log.time_s[members[members.len() - 1]];
            let weight: f64 = weights.iter().sum();
            lowered += if weight < 0.5 * members.len() as f64 { members.len() } else { 0 };
            self.cell(data, members, quantity, values, channel);
            data.weight.push(weight);
            data.span_s.push(last - begin + step_s);
            data.readings_per_sample.push(members.len() as f64);
            data.run.push(run);
            data.load_variance.push(self.load_variance(members[members.len() - 1], weights));
            let middle = self.aligned.program_s[members[members.len() / 2]];
            let spot = self.spot[members[members.len() / 2]].unwrap_or(0);
            data.line.push(self.known.timeline.spots[spot].line);
            data.block.push((middle / (span / BLOCKS).max(1.0)) as usize);
        }
        lowered
    }

    /// Averages of one cell.
    fn cell(&self, data: &mut Data, members: &[usize], quantity: Option<Quantity>, values: &[f64], channel: usize) {
        let n = members.len() as f64;
        let p = data.base.len();
        let mut columns = vec![0.0; p];
        let mut variants = vec![vec![0.0; p]; data.variants.len()];
        let mut ratios = vec![0.0; data.slower.len()];
        let mut reading = 0.0;
        let (first, last) = (self.known.others.len(), data.variants.len() - 1);
        // Sums over the cell for covariates that are their ratios: removal rate, plain, by the up share and by the mean cosine; contact rate
        // likewise.
        let mut rates = [0.0; 6];
        // The spot that removes most in the cell: its removal rate times its share, and its index.
        let mut loaded: (f64, Option<usize>) = (0.0, None);
        for &i in members {
            let at_s = self.aligned.program_s[i];
            let declared = |k: usize| &self.known.timeline.spots[k].engaged;
            let mut at_sample = self.cut(i, quantity, &data.base, &declared);
            let changed = |other: &OtherGeometry| self.cut(i, quantity, &data.base, &|k| &other.engaged[k]);
            let changed: Vec<Vec<f64>> = self.known.others.iter().map(changed).collect();
            for ((sum, other), to) in variants.iter_mut().zip(self.known.others).zip(&changed) {
                let from = other.over.map_or(&at_sample, |k| &changed[k]);
                for b in 0..p {
                    sum[b] += (to[b] - from[b]) / other.size / n;
                }
            }
            for (index, share) in
                self.load_shares(at_s, quantity, &declared).into_iter().filter(|(_, share)| *share > 0.0)
            {
                let spot = &self.known.timeline.spots[index];
                let speed_mm_s = self.feed_ratio(i) * spot.speed_mm_s();
                let (removed, swept) =
                    (spot.engaged.section_mm2 * speed_mm_s, spot.engaged.contact_mm2 * self.rps(i, spot));
                let [cosine_chip, cosine] = spot.engaged.mean_cosine;
                let by_chip = [1.0, spot.engaged.up_share_chip, cosine_chip].map(|of| of * removed);
                let by_contact = [1.0, spot.engaged.up_share, cosine].map(|of| of * swept);
                let more = by_chip.into_iter().chain(by_contact);
                rates.iter_mut().zip(more).for_each(|(r, m)| *r += share * m);
                if share * removed > loaded.0 {
                    loaded = (share * removed, Some(index));
                }
                for (sums, (offset, phase)) in variants[first..last].iter_mut().zip(runouts()) {
                    let change = &self.known.timeline.runouts[index][offset][phase];
                    for (b, sum) in sums.iter_mut().enumerate() {
                        let plain = Self::column(&data.base[b].name, quantity, self.rps(i, spot), spot, &spot.engaged);
                        let at_predicted_feed = runout_change(quantity, &data.base[b], change, plain);
                        *sum += share * self.at_feed(i, data.base[b].class) * at_predicted_feed / n;
                    }
                }
            }
            for (index, share) in self.spot_shares(at_s) {
                // A measured feed does not depend on the assumed machine.
                let slower = |all: &Vec<f64>| if self.feed.is_some() { 1.0 } else { all[index] };
                ratios.iter_mut().zip(self.known.slower).for_each(|(r, (_, all))| *r += share * slower(all) / n);
            }
            if let (Some(spot), Some(quantity)) = (self.spot[i].map(|k| &self.known.timeline.spots[k]), quantity) {
                for (value, base) in at_sample.iter_mut().zip(&data.base) {
                    *value += self.idle(i, quantity, spot, base);
                }
            }
            let more = self.over_span(i, quantity, &data.base, &at_sample);
            variants[last].iter_mut().zip(more).for_each(|(sum, m)| *sum += m / n);
            columns.iter_mut().zip(&at_sample).for_each(|(c, x)| *c += x / n);
            reading += self.at_shaft(values[i], quantity) / n;
        }
        data.columns.iter_mut().zip(columns).for_each(|(c, x)| c.push(x));
        for (variant, sums) in data.variants.iter_mut().zip(variants) {
            variant.columns.iter_mut().zip(sums).for_each(|(c, x)| c.push(x));
        }
        data.slower.iter_mut().zip(ratios).for_each(|(s, r)| s.ratio.push(r));
        data.reading.push(reading);
        data.channel.push(channel);
        let spot = self.spot[members[members.len() / 2]].unwrap_or(0);
        let operation = Operation::of(&self.known.timeline.spots[spot]);
        data.kind.push(self.operations.binary_search(&operation).unwrap_or(self.operations.len()));
        let mut state = self.state(members, loaded.1);
        if rates[0] > 1e-9 && rates[3] > 1e-9 {
            state.chip_thickness_mm = rates[0] / rates[3];
            (state.up_share_chip, state.up_share) = (rates[1] / rates[0], rates[4] / rates[3]);
            state.mean_cosine = [rates[2] / rates[0], rates[5] / rates[3]];
        }
        data.state.push(state);
    }

    /// Mean of the columns since the reading before, minus those at the reading.
    fn over_span(&self, i: usize, quantity: Option<Quantity>, base: &[Base], plain: &[f64]) -> Vec<f64> {
        let spots = &self.known.timeline.spots;
        let end_s = self.aligned.program_s[i];
        let begin_s = if i == 0 { f64::NAN } else { self.aligned.program_s[i - 1] };
        let (Some(from), Some(to)) = (self.known.timeline.at(begin_s), self.spot[i]) else {
            return vec![0.0; base.len()];
        };
        if from >= to || to - from > MOST_BETWEEN {
            return vec![0.0; base.len()];
        }
        let mut mean = vec![0.0; base.len()];
        for spot in &spots[from..=to] {
            let share = (spot.end_s.min(end_s) - spot.start_s.max(begin_s)).max(0.0) / (end_s - begin_s);
            for ((sum, b), at_end) in mean.iter_mut().zip(base).zip(plain) {
                let own = if b.class == Class::Tare {
                    *at_end
                } else {
                    self.at_feed(i, b.class) * Self::column(&b.name, quantity, self.rps(i, spot), spot, &spot.engaged)
                };
                *sum += share * (own - at_end);
            }
        }
        mean
    }
}

/// Indices of offset and direction of the grid's runouts, in the order of their variants.
fn runouts() -> impl Iterator<Item = (usize, usize)> {
    (0..RUNOUT_GRID[0]).flat_map(|offset| (0..RUNOUT_GRID[1]).map(move |phase| (offset, phase)))
}

/// Removal area at the less engaged end of a station over that at the other, from its mean: 2·mean/most − 1.
fn at_lesser_end(engaged: &Engaged) -> f64 {
    let most: f64 = engaged.sectors.iter().map(|s| s[0]).sum();
    if most > 1e-9 { (2.0 * engaged.section_mm2 / most - 1.0).clamp(0.0, 1.0) } else { 1.0 }
}

/// Change of a column by runout: of every term for a peak force, of the edge term for power.
fn runout_change(quantity: Option<Quantity>, base: &Base, [tc, rc, te, re, power]: &[f64; 5], plain: f64) -> f64 {
    match (quantity, base.name.as_str()) {
        (None, "k_tc") => *tc,
        (None, "k_rc") => *rc,
        (None, "k_te") => *te,
        (None, "k_re") => *re,
        (Some(_), "k_te") => plain * power,
        _ => 0.0,
    }
}
