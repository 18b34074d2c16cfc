//! What the meter reads while a part is milled with effects that no setup declares ([`super::hidden`]). In: part, coefficients, hidden
//! effects, times. Out: one reading per time.
//!
//! A tooth at φ meets the chip h = f sin φ. On every slice it takes k_c·h + k_e per length of edge, tangentially and
//! radially. Power is the sum of the tangential force times cutting speed over teeth, slices and angles, plus the tare; a
//! force reading is the largest resultant in the plane over one turn. Sums are numeric (midpoints). A log with forces holds
//! power too: a peak alone cannot part a tooth that stands out from a larger edge coefficient, but the mean power does not
//! know of the one and grows with the other.

use super::cut::{Arc, Reality, Station, stations};
use super::hidden::{Hidden, local_factors, since_entry, size_exponent, terms, wear};
use super::motion::{Leg, Moment, timeline};
use super::programs::Part;
use super::rng::Rng;
use std::f64::consts::TAU;

/// True coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients {
    /// N/mm².
    pub k_tc: f64,
    /// N/mm².
    pub k_rc: f64,
    /// N/mm.
    pub k_te: f64,
    /// N/mm.
    pub k_re: f64,
    /// True tare over the declared one.
    pub tare: f64,
}

impl Coefficients {
    /// Near the declared ones, but not the same.
    pub fn draw(part: &Part, rng: &mut Rng) -> Self {
        let [k_tc, k_rc, _, k_te, k_re, _] = part.shop.declared;
        Self {
            k_tc: k_tc * rng.uniform(0.88, 1.12),
            k_rc: k_rc * rng.uniform(0.88, 1.12),
            k_te: k_te * rng.uniform(0.85, 1.15),
            k_re: k_re * rng.uniform(0.85, 1.15),
            tare: rng.uniform(0.95, 1.05),
        }
    }
}

/// What a log measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Spindle power as the meter reads it, W.
    Power,
    /// The same, and the largest resultant in the plane in the turn about the sample, N.
    PowerAndForceXy,
}

/// A reading without noise.
#[derive(Debug, Clone, Copy)]
pub struct Reading {
    /// Where the machine is.
    pub moment: Moment,
    /// Power as the meter reads it, W.
    pub value: f64,
    /// The part of it that cutting makes, before drive and meter.
    pub cutting: f64,
    /// Peak force, N; 0 where it is not measured.
    pub force: f64,
}

/// A part being milled with its hidden effects.
pub struct Milling<'a> {
    part: &'a Part,
    truth: &'a Coefficients,
    hidden: &'a [Hidden],
    channel: Channel,
    legs: Vec<Leg>,
    /// Legs whose speeds count in place of the real ones, at the real places and times.
    speeds: Option<Vec<Leg>>,
    stations: Vec<Vec<Station>>,
    /// Removal and contact terms of every station.
    terms: Vec<Vec<[f64; 3]>>,
    /// Way since material was met, at every station, mm.
    since_entry: Vec<Vec<f64>>,
    radius_mm: f64,
    /// Sliding of a tooth over the whole program, mm.
    total_sliding_mm: f64,
    /// Greatest power of the shaft, W; mean of the cutting power, W.
    top_w: f64,
    mean_cutting_w: f64,
}

/// State that runs along with time.
#[derive(Debug, Clone, Copy, Default)]
struct Running {
    sliding_mm: f64,
    lagged: Option<f64>,
}

impl<'a> Milling<'a> {
    /// Prepares engagement and timeline.
    pub fn new(part: &'a Part, truth: &'a Coefficients, hidden: &'a [Hidden], channel: Channel) -> Self {
        let mut reality = Reality::declared(part);
        let mut acceleration = 1.0;
        for effect in hidden {
            match effect {
                Hidden::StockProud { top_mm, side_mm } => {
                    (reality.proud_top_mm, reality.proud_side_mm) = (*top_mm, *side_mm);
                }
                Hidden::ToolDiameter { change_mm } => reality.diameter_mm += change_mm,
                Hidden::CornerFeed { acceleration: share } => acceleration = *share,
                _ => {}
            }
        }
        let stations = stations(part, &reality);
        let radius_mm = 0.5 * reality.diameter_mm;
        let terms = stations.iter().map(|s| s.iter().map(|s| terms(s, radius_mm, hidden)).collect()).collect();
        let legs = timeline(part, acceleration);
        let mut milling = Self {
            part,
            truth,
            hidden,
            channel,
            legs,
            speeds: None,
            since_entry: since_entry(&stations),
            stations,
            terms,
            radius_mm,
            total_sliding_mm: 1.0,
            top_w: 1.0,
            mean_cutting_w: 1.0,
        };
        milling.measure_extent();
        milling
    }

    /// End of the program, s.
    pub fn end_s(&self) -> f64 {
        self.legs.last().map_or(0.0, Leg::end_s)
    }

    /// Sliding, greatest and mean power, before wear.
    fn measure_extent(&mut self) {
        let (step_s, mut now) = (0.05, 0.0);
        let (mut sliding, mut top, mut sum, mut count) = (0.0, 1.0f64, 0.0, 0.0);
        let mut leg = 0;
        while now < self.end_s() {
            let moment = self.moment(now, &mut leg);
            let [q, a, slide] = self.terms_at(&moment);
            sliding += slide * moment.rps * step_s;
            let cutting = self.power(&moment, q, a, 1.0, 1.0);
            if cutting > 0.0 {
                (sum, count) = (sum + cutting, count + 1.0);
            }
            top = top.max(cutting + self.part.shop.tare_at(moment.rps));
            now += step_s;
        }
        (self.total_sliding_mm, self.top_w, self.mean_cutting_w) =
            (f64::max(sliding, 1.0), top, sum / f64::max(count, 1.0));
    }

    fn moment(&self, t: f64, leg: &mut usize) -> Moment {
        while *leg + 1 < self.legs.len() && t > self.legs[*leg].end_s() {
            *leg += 1;
        }
        let mut moment = self.legs[*leg].at(t);
        if let Some(speeds) = &self.speeds {
            moment.speed_mm_s = speeds[*leg].speed_at(moment.s_mm);
        }
        moment
    }

    /// The same milling at the places and times of another one, with its own speeds there: what somebody computes who
    /// knows where the tool was but not how fast.
    pub fn at_places_of(mut self, other: &Milling) -> Self {
        self.speeds = Some(std::mem::replace(&mut self.legs, other.legs.clone()));
        self
    }

    /// Removal, contact and sliding terms, between the stations about the moment.
    fn terms_at(&self, moment: &Moment) -> [f64; 3] {
        let (stations, terms) = (&self.stations[moment.step], &self.terms[moment.step]);
        let after = stations.partition_point(|s| s.s_mm <= moment.s_mm);
        match (after, stations.len()) {
            (_, 0) => [0.0; 3],
            (k, n) if k == n => terms[n - 1],
            (k, _) => {
                let (a, b) = (&stations[k - 1], &stations[k]);
                let t = (moment.s_mm - a.s_mm) / (b.s_mm - a.s_mm);
                std::array::from_fn(|i| terms[k - 1][i] + t * (terms[k][i] - terms[k - 1][i]))
            }
        }
    }

    fn feed_per_tooth(&self, moment: &Moment) -> f64 {
        moment.speed_mm_s / (f64::from(self.part.mill.flutes) * moment.rps.max(1e-9))
    }

    /// Cutting power, W, with factors on k_tc and k_te.
    fn power(&self, moment: &Moment, q: f64, a: f64, cutting: f64, edge: f64) -> f64 {
        if q <= 0.0 && a <= 0.0 {
            return 0.0;
        }
        let exponent = size_exponent(self.hidden);
        let chip = self.feed_per_tooth(moment).powf(1.0 - exponent) * 0.05f64.powf(exponent);
        let passes = f64::from(self.part.mill.flutes) * moment.rps;
        1e-3 * passes * (self.truth.k_tc * cutting * chip * q + self.truth.k_te * edge * a)
    }

    /// Readings at rising times; `t` counts from the start of the program.
    pub fn read(&self, times: &[f64]) -> Vec<Reading> {
        let mut running = Running::default();
        let (mut now, mut leg) = (0.0, 0);
        let mut readings = Vec::with_capacity(times.len());
        for &time in times {
            // Steps of at most 20 ms carry sliding and lag along.
            let steps = ((time - now) / 0.02).ceil().max(1.0);
            let step_s = ((time - now) / steps).max(0.0);
            let mut last = None;
            for _ in 0..steps as usize {
                now += step_s;
                last = Some(self.step(now, step_s, &mut leg, &mut running));
            }
            readings.extend(last);
        }
        readings
    }

    fn step(&self, now: f64, step_s: f64, leg: &mut usize, running: &mut Running) -> Reading {
        let mut moment = self.moment(now, leg);
        if now < 0.0 || now > self.end_s() {
            (moment.rps, moment.speed_mm_s) = (0.0, 0.0);
        }
        let [q, a, slide] = self.terms_at(&moment);
        running.sliding_mm += slide * moment.rps * step_s;
        let (mut cutting, mut edge) = self.factors_in_time(now, running.sliding_mm);
        let at_entry = self.at_entry(&moment);
        (cutting, edge) = (cutting * at_entry, edge * at_entry);
        let idle = self.idle(&moment);
        let load = self.power(&moment, q, a, cutting, edge * (1.0 - idle));
        let value = self.meter(load + self.tare(&moment, now)) + self.aside(now, moment.rps) + self.axes(&moment);
        let force = match self.channel {
            Channel::Power => 0.0,
            Channel::PowerAndForceXy => self.force_peak(&moment, cutting, edge),
        };
        Reading { moment, value: self.lagged(value, step_s, running), cutting: load, force }
    }

    /// Station next to a moment.
    fn station(&self, moment: &Moment) -> Option<&Station> {
        let stations = &self.stations[moment.step];
        let last = stations.len().checked_sub(1)?;
        let spacing = stations[last].s_mm / last.max(1) as f64;
        let station = &stations[((moment.s_mm / spacing.max(1e-9)).round() as usize).min(last)];
        (!station.arcs.is_empty()).then_some(station)
    }

    /// Share of the contact that teeth miss because those before them left nothing: their edges rub nothing there, while
    /// the chips of all teeth together stay what they are.
    fn idle(&self, moment: &Moment) -> f64 {
        let has_runout = self.hidden.iter().any(|h| matches!(h, Hidden::Runout { .. }));
        let Some(station) = self.station(moment).filter(|_| has_runout) else { return 0.0 };
        let chips = self.chips(self.feed_per_tooth(moment));
        let (mut missed, mut all) = (0.0, 0.0);
        for arc in &station.arcs {
            let step = (arc.phi[1] - arc.phi[0]) / IDLE_STEPS as f64;
            for k in 0..IDLE_STEPS {
                let sin = (arc.phi[0] + (k as f64 + 0.5) * step).sin();
                let misses = |before: &&Vec<[f64; 2]>| before.iter().any(|[f, out]| f * sin + out <= 0.0);
                missed += chips.iter().filter(misses).count() as f64 * step * arc.dz_mm;
                all += chips.len() as f64 * step * arc.dz_mm;
            }
        }
        missed / f64::max(all, 1e-12)
    }

    fn factors_in_time(&self, now: f64, sliding_mm: f64) -> (f64, f64) {
        let (mut cutting, mut edge) = (1.0, 1.0);
        for effect in self.hidden {
            match effect {
                Hidden::FlankWear { growth } => edge *= 1.0 + growth * wear(sliding_mm / self.total_sliding_mm),
                Hidden::EdgeChipping { jump, at_share } if now > at_share * self.end_s() => {
                    cutting *= 1.0 + jump;
                    edge *= 1.0 + 0.5 * jump;
                }
                _ => {}
            }
        }
        (cutting, edge)
    }

    /// Factor on all coefficients where the tool has just met material.
    fn at_entry(&self, moment: &Moment) -> f64 {
        let found = self.hidden.iter().find_map(|h| match h {
            Hidden::Entry { excess, length_mm } => Some((*excess, *length_mm)),
            _ => None,
        });
        let Some((excess, length_mm)) = found else { return 1.0 };
        let stations = &self.stations[moment.step];
        let Some(k) = stations.partition_point(|s| s.s_mm <= moment.s_mm).checked_sub(1) else { return 1.0 };
        let way = self.since_entry[moment.step][k] + moment.s_mm - stations[k].s_mm;
        1.0 + excess * (1.0 - way / length_mm).max(0.0).powi(2)
    }

    /// What the axes take on the same line, W; braking gives nothing back.
    fn axes(&self, moment: &Moment) -> f64 {
        let shop = &self.part.shop;
        let share = moment.speed_mm_s / shop.rapid_mm_s;
        let of = |h: &Hidden| match h {
            Hidden::AxisPower { friction, acceleration } => {
                let ramp = (moment.acceleration_mm_s2 / shop.acceleration_mm_s2).max(0.0);
                self.mean_cutting_w * share * (friction + acceleration * ramp)
            }
            _ => 0.0,
        };
        self.hidden.iter().map(of).sum()
    }

    fn tare(&self, moment: &Moment, now: f64) -> f64 {
        if moment.rps <= 0.0 {
            return 0.0;
        }
        let declared = self.part.shop.tare_at(moment.rps);
        let mut tare = self.truth.tare * declared;
        for effect in self.hidden {
            match effect {
                Hidden::TareWarmUp { excess, tau_s } => tare += declared * excess * (-now / tau_s).exp(),
                Hidden::TareSpeed { share, power } => {
                    let top = self.part.shop.tare_at(200.0);
                    tare += share * top * ((moment.rps / 200.0).powf(*power) - 0.2f64.powf(*power));
                }
                _ => {}
            }
        }
        // Running up takes the share of the tare that belongs to the speed, and what the mass takes.
        moment.runup.map_or(tare, |share| share * (tare + 400.0))
    }

    fn meter(&self, shaft_w: f64) -> f64 {
        let loss =
            self.hidden.iter().find_map(|h| if let Hidden::DriveEfficiency { loss } = h { Some(*loss) } else { None });
        shaft_w / (self.part.shop.efficiency * (1.0 - loss.unwrap_or(0.0) * (shaft_w / self.top_w).min(1.2)))
    }

    /// What others take on the same line.
    fn aside(&self, now: f64, rps: f64) -> f64 {
        let mut sum = 0.0;
        for effect in self.hidden {
            match effect {
                Hidden::CoolantPump { share, period_s, duty }
                    if rps > 0.0 && (now / period_s).rem_euclid(1.0) < *duty =>
                {
                    sum += share * self.mean_cutting_w;
                }
                Hidden::Chiller { share, period_s } if rps > 0.0 => {
                    sum += share * self.mean_cutting_w * (TAU * now / period_s).sin();
                }
                _ => {}
            }
        }
        sum
    }

    fn lagged(&self, value: f64, step_s: f64, running: &mut Running) -> f64 {
        let time =
            self.hidden.iter().find_map(|h| if let Hidden::SensorLag { time_s } = h { Some(*time_s) } else { None });
        let Some(time_s) = time else { return value };
        let before = running.lagged.unwrap_or(value);
        let after = value + (before - value) * (-step_s / time_s).exp();
        running.lagged = Some(after);
        after
    }

    /// Largest resultant in the plane over one turn, N.
    ///
    /// The edge of a tooth at the height z is at φ = turn + lead − z tan β / r: what it takes along z is an integral over φ of
    /// what it takes at φ, read off cumulated sums over a turn.
    fn force_peak(&self, moment: &Moment, cutting: f64, edge: f64) -> f64 {
        let Some(station) = self.station(moment) else { return 0.0 };
        let chips = self.chips(self.feed_per_tooth(moment));
        let lag = self.part.mill.helix_deg.to_radians().tan() / self.radius_mm;
        let tables: Vec<(Arc, usize, Vec<[f64; 2]>)> = (station.arcs.iter())
            .flat_map(|arc| (0..chips.len()).map(move |tooth| (*arc, tooth)))
            .map(|(arc, tooth)| (arc, tooth, self.cumulated(station, &arc, &chips[tooth], cutting, edge)))
            .collect();
        let resultant = |turn: f64| {
            let mut sum = [0.0; 2];
            for (arc, tooth, table) in &tables {
                let lead = turn + TAU * *tooth as f64 / chips.len() as f64;
                let [low, high] = [arc.z_mm, arc.z_mm + arc.dz_mm].map(|z| up_to(table, lead - lag * z));
                (0..2).for_each(|k| sum[k] += (low[k] - high[k]) / lag);
            }
            sum[0].hypot(sum[1])
        };
        (0..TURN_STEPS).map(|k| resultant(TAU * k as f64 / TURN_STEPS as f64)).fold(0.0, f64::max)
    }

    /// ∫ of the force in the plane of a tooth per mm of height, over φ from 0, N/mm·rad, at [`TURN_STEPS`] + 1 places.
    fn cumulated(&self, station: &Station, arc: &Arc, before: &[[f64; 2]], cutting: f64, edge: f64) -> Vec<[f64; 2]> {
        let step = TAU / TURN_STEPS as f64;
        let mut sum = [0.0; 2];
        let mut sums = vec![sum];
        for k in 0..TURN_STEPS {
            let [from, to] = [k, k + 1].map(|k| (k as f64 * step).clamp(arc.phi[0], arc.phi[1]));
            if to > from {
                let at = self.at_angle(station, 0.5 * (from + to), before, cutting, edge);
                (0..2).for_each(|i| sum[i] += at[i] * (to - from));
            }
            sums.push(sum);
        }
        sums
    }

    /// Tooth i + 1 is ahead of tooth i, so that the chip of tooth i is f·m·sin φ + r_i − r_(i+m), the least over the m teeth
    /// before it: pairs (f m, r_i − r_(i+m)).
    fn chips(&self, feed_per_tooth: f64) -> Vec<Vec<[f64; 2]>> {
        let n = self.part.mill.flutes as usize;
        let stands_out = |i: usize| -> f64 {
            let of = |h: &Hidden| match h {
                Hidden::Runout { offset_mm, angle } => offset_mm * (angle - TAU * i as f64 / n as f64).cos(),
                _ => 0.0,
            };
            self.hidden.iter().map(of).sum()
        };
        (0..n)
            .map(|i| (1..=n).map(|m| [feed_per_tooth * m as f64, stands_out(i) - stands_out((i + m) % n)]).collect())
            .collect()
    }

    /// Force in the plane of a tooth at φ per mm of height, N/mm.
    fn at_angle(&self, station: &Station, phi: f64, before: &[[f64; 2]], cutting: f64, edge: f64) -> [f64; 2] {
        let (sin, cos) = phi.sin_cos();
        let h = before.iter().map(|[f, out]| f * sin + out).fold(f64::INFINITY, f64::min);
        if h <= 0.0 {
            return [0.0; 2];
        }
        let (c, e) = local_factors(station, phi, self.radius_mm, self.hidden);
        let size = (h / 0.05).powf(-size_exponent(self.hidden));
        let tangential = self.truth.k_tc * c * cutting * size * h + self.truth.k_te * e * edge;
        let radial = self.truth.k_rc * c * cutting * size * h + self.truth.k_re * e * edge;
        [-(tangential * cos + radial * sin), tangential * sin - radial * cos]
    }
}

/// Places on an arc at which a tooth is looked at that may meet nothing: to this share of the contact its edges are known to
/// rub or not.
const IDLE_STEPS: usize = 400;

/// Places in a turn.
const TURN_STEPS: usize = 720;

/// Value of a cumulated sum at any angle: every turn adds its whole.
fn up_to(sums: &[[f64; 2]], angle: f64) -> [f64; 2] {
    let turns = (angle / TAU).floor();
    let place = (angle / TAU - turns) * TURN_STEPS as f64;
    let k = (place as usize).min(TURN_STEPS - 1);
    let t = place - k as f64;
    [0, 1].map(|i| turns * sums[TURN_STEPS][i] + sums[k][i] + t * (sums[k + 1][i] - sums[k][i]))
}
