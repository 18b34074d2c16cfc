//! The rounds of simulation and correction; the mathematics stands at the head of the room.

use super::bench::{Bench, Look};
use super::knots::Knots;
use super::least_squares::{Pair, Problem};
use super::met::{Met, Sample};
use super::stock::left;
use super::{SemifinishError, Task};
use crate::engage::Event;
use crate::engage::workpiece::shift;
use crate::force::Loads;
use crate::nc::MoveKind;
use crate::path::Vec3;

/// Uniform change of stock by which the first derivatives are found, mm: a tenth of the usual stock; forces are kept to 1 %.
const PROBE_MM: f64 = 0.02;
/// Rounds in which each contact is taken by itself, and rounds in all.
const ALONE: usize = 3;
const ROUNDS: usize = 8;
/// Largest change of stock in a round, mm: derivatives hold for about this much.
const STEP_MM: f64 = 0.1;
/// Weight of the change of a round against the error of force, both relative: what the forces do not tell stays as it is.
const RIDGE: f64 = 0.1;
/// Change of stock from which on two rounds tell the derivative, mm.
const TELLING_MM: f64 = 0.004;
/// The derivative of two rounds counts between these parts of the last one.
const TRUSTED: [f64; 2] = [0.3, 3.0];
/// A round that lowers the mean error of force by less than this part of it is the last.
const WORTH: f64 = 0.03;
/// Mean error of force that is good enough, relative.
const GOOD: f64 = 0.003;
/// Error of force, relative, up to which its square counts; beyond it the error itself (Huber): a contact that no stock brings near
/// the reference must not take its neighbours along. Three times the band of 10 % that is asked for.
const FAR: f64 = 0.3;
/// Share of the stock a sample meets that must be free for it to count.
const FREE: f64 = 0.5;

/// A stretch of the finishing path with its loads.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    /// Which.
    pub sample: Sample,
    /// Loads.
    pub loads: Loads,
    /// The semi-finishing move that left most of what it meets, and mm along it.
    pub left_by: Option<(u32, f64)>,
    /// Normal of the surface there.
    pub normal: Vec3,
    /// Stock it meets, mm: at its knots, by their shares.
    pub stock_mm: f64,
    /// Is it a full cut whose stock could be chosen?
    pub free: bool,
    /// Does a bound on stock or on its change hold where it is chosen?
    pub bound: bool,
}

/// What a round came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Round {
    /// Root of the mean square of F/reference − 1, by length, in which errors beyond 0.3 count by themselves.
    pub error: f64,
    /// Least and largest force, N.
    pub force_n: [f64; 2],
}

/// The offsets and what they lead to.
pub struct Answer {
    /// The knots.
    pub knots: Knots,
    /// Their offsets, mm.
    pub offsets: Vec<Vec3>,
    /// Knots whose stock was chosen, with the stock before and after, mm.
    pub chosen: Vec<(u32, [f64; 2])>,
    /// The reference, N.
    pub reference_n: f64,
    /// As programmed.
    pub before: Vec<Seen>,
    /// With the offsets, in the same order.
    pub after: Vec<Seen>,
    /// The rounds.
    pub rounds: Vec<Round>,
    /// Spacing of the passes of semi-finish and finish, mm.
    pub picks_mm: [Option<f64>; 2],
    /// Collisions and the like as programmed.
    pub events: Vec<Event>,
}

/// What is known of the knots whose stock is chosen.
struct Unknowns {
    /// Knot of each unknown.
    knots: Vec<u32>,
    /// Unknown of each knot: its own, or that of the nearest that leaves what the finish meets.
    of_knot: Vec<Option<u32>>,
    /// Normal at each unknown.
    normals: Vec<Vec3>,
    /// Stock as programmed, mm.
    stock_mm: Vec<f64>,
    pairs: Vec<Pair>,
}

/// Solves for the offsets.
pub fn solve(task: &Task) -> Result<Answer, SemifinishError> {
    check(task)?;
    let bench = Bench::new(task)?;
    let still = vec![Vec3::zeros(); bench.knots.list.len()];
    let base = bench.look(&still, None)?;
    let samples = bench.samples(&base);
    if !samples.is_empty() && !bench.has_force(&base, &samples) {
        return Err(SemifinishError::NoForce { tool: bench.finish_tool.number });
    }
    let met = bench.met(&base, &samples);
    meet(&bench, &base, &samples, &met)?;
    let unknowns = Unknowns::new(&bench, &base, &samples, &met)?;
    let picks_mm = super::picks::picks(&bench, &base, &unknowns_tips(&bench, &base, &unknowns));
    if !samples.iter().zip(&met).any(|(sample, met)| !sample.edge && unknowns.free_share(met) >= FREE) {
        return Err(SemifinishError::NoFullCut);
    }
    let mut rounds = Rounds::new(&bench, &unknowns, &samples, base, met);
    rounds.probe()?;
    rounds.run()?;
    rounds.answer(picks_mm)
}

fn check(task: &Task) -> Result<(), SemifinishError> {
    let bad = |what: String| Err(SemifinishError::Bad { what });
    let wanted = &task.wanted;
    let [low, high] = wanted.stock_mm;
    if wanted.force_n.is_some_and(|force| !(force > 0.0 && force.is_finite())) {
        return bad("the reference force must be a positive number of newtons".into());
    }
    if !(low >= 0.0 && high > low && high.is_finite()) {
        return bad(format!(
            "stock from {low} to {high} mm makes no sense: the least may be 0, the largest must be more"
        ));
    }
    if !(wanted.change > 0.0 && wanted.tolerance_mm > 0.0) {
        return bad("change of stock per mm, and tolerance, must be positive".into());
    }
    Ok(())
}

/// Share of the finishing path that must meet the semi-finish, or the programs are tried in the other order.
const MEETING: f64 = 0.5;

/// Do the programs meet, and in this order? At the far sides of their first and last passes they do in either.
fn meet(bench: &Bench, base: &Look, samples: &[Sample], met: &[Met]) -> Result<(), SemifinishError> {
    let task = bench.task;
    let length = |samples: &[Sample], met: &[Met]| -> f64 {
        let both = samples.iter().zip(met).filter(|(_, met)| !met.shares.is_empty());
        both.map(|(sample, _)| sample.length_mm).sum()
    };
    let here_mm = length(samples, met);
    if here_mm >= MEETING * bench.finish_length_mm() {
        return Ok(());
    }
    let movable = vec![false; task.finish.moves.len()];
    let swapped = Task { semi: task.finish, finish: task.semi, movable: &movable, ..*task };
    let other = Bench::new(&swapped)?;
    let look = other.look(&vec![Vec3::zeros(); other.knots.list.len()], None)?;
    let samples = other.samples(&look);
    if length(&samples, &other.met(&look, &samples)) > here_mm {
        return Err(SemifinishError::WrongOrder);
    }
    if here_mm > 0.0 { Ok(()) } else { Err(SemifinishError::NeverMeet { cut_mm: base.cut_mm() }) }
}

fn unknowns_tips(bench: &Bench, base: &Look, unknowns: &Unknowns) -> Vec<(Vec3, Vec3)> {
    let tip = |knot: &u32| {
        let knot = &bench.knots.list[*knot as usize];
        knot.at + shift(bench.task.job, &base.toolpath, bench.task.semi.moves[knot.of as usize].wcs)
    };
    unknowns.knots.iter().map(tip).zip(unknowns.normals.iter().copied()).collect()
}

impl Unknowns {
    fn new(bench: &Bench, base: &Look, samples: &[Sample], met: &[Met]) -> Result<Self, SemifinishError> {
        let count = bench.knots.list.len();
        let mut normals = vec![Vec3::zeros(); count];
        for (sample, met) in samples.iter().zip(met) {
            for (knot, normal) in &met.normals {
                normals[*knot as usize] += normal * sample.length_mm;
            }
        }
        let known: Vec<u32> = (0..count as u32)
            .filter(|k| bench.knots.list[*k as usize].free && normals[*k as usize].norm() > 1e-9)
            .collect();
        let mut unknowns = Self {
            normals: known.iter().map(|k| normals[*k as usize].normalize()).collect(),
            of_knot: vec![None; count],
            knots: known,
            stock_mm: Vec::new(),
            pairs: Vec::new(),
        };
        let tips = unknowns_tips(bench, base, &unknowns);
        let finish = bench.finish_centres(&base.toolpath);
        let radii = [bench.semi_tool.radius_mm(), bench.finish_tool.radius_mm()];
        let stock = left(&tips, radii[0], &finish, radii[1]);
        let kept: Vec<usize> = (0..stock.len()).filter(|k| stock[*k].is_some()).collect();
        unknowns.stock_mm = kept.iter().filter_map(|k| stock[*k]).collect();
        unknowns.knots = kept.iter().map(|k| unknowns.knots[*k]).collect();
        unknowns.normals = kept.iter().map(|k| unknowns.normals[*k]).collect();
        if unknowns.knots.is_empty() {
            return Err(SemifinishError::NothingFree);
        }
        unknowns.spread(bench);
        unknowns.pair(bench);
        Ok(unknowns)
    }

    /// Knots that leave nothing the finish meets go with the nearest along the path that does, as far as the tool stays at feed.
    fn spread(&mut self, bench: &Bench) {
        let list = &bench.knots.list;
        let moves = &bench.task.semi.moves;
        for (unknown, knot) in self.knots.iter().enumerate() {
            self.of_knot[*knot as usize] = Some(unknown as u32);
        }
        let own = self.of_knot.clone();
        let mut way = vec![f64::INFINITY; list.len()];
        let length = |k: usize| if k == 0 { 0.0 } else { (list[k].at - list[k - 1].at).norm() };
        let rapid = |k: usize| moves.get(list[k].of as usize).is_none_or(|motion| motion.kind == MoveKind::Rapid);
        let mut carried: Option<(u32, f64)> = None;
        for k in 0..list.len() {
            carried = carried.filter(|_| !rapid(k)).map(|(of, far)| (of, far + length(k)));
            if let Some(of) = own[k] {
                carried = Some((of, 0.0));
            } else if let (Some((of, far)), true) = (carried, list[k].free) {
                (self.of_knot[k], way[k]) = (Some(of), far);
            }
        }
        carried = None;
        for k in (0..list.len()).rev() {
            if let Some(of) = own[k] {
                carried = Some((of, 0.0));
            } else if let Some((of, far)) = carried.filter(|(_, far)| list[k].free && *far < way[k]) {
                (self.of_knot[k], way[k]) = (Some(of), far);
            }
            carried = carried.filter(|_| !rapid(k)).map(|(of, far)| (of, far + length(k)));
        }
    }

    /// Bounds on the change of stock between neighbours along the path.
    fn pair(&mut self, bench: &Bench) {
        let list = &bench.knots.list;
        for (j, two) in self.knots.windows(2).enumerate() {
            let [a, b] = [two[0] as usize, two[1] as usize];
            if b == a + 1 {
                let reach = bench.task.wanted.change * (list[b].at - list[a].at).norm();
                self.pairs.push(Pair { of: [j as u32, j as u32 + 1], centre: 0.0, reach });
            }
        }
    }

    /// Offsets of all knots for this stock at the unknowns.
    fn offsets(&self, stock_mm: &[f64]) -> Vec<Vec3> {
        let of = |unknown: &Option<u32>| {
            unknown.map_or_else(Vec3::zeros, |k| {
                let k = k as usize;
                self.normals[k] * (stock_mm[k] - self.stock_mm[k])
            })
        };
        self.of_knot.iter().map(of).collect()
    }
}

struct Rounds<'a> {
    bench: &'a Bench<'a>,
    unknowns: &'a Unknowns,
    samples: &'a [Sample],
    reference_n: f64,
    stock_mm: Vec<f64>,
    met: Vec<Met>,
    forces: Vec<f64>,
    slopes: Vec<f64>,
    base: (Look, Vec<Met>),
    done: Vec<Round>,
    /// The best so far: stock, look, what it meets.
    best: Option<(f64, Vec<f64>, Look, Vec<Met>)>,
}

fn forces(bench: &Bench, look: &Look, samples: &[Sample]) -> Vec<f64> {
    Bench::loads(look, bench.task.job, samples).iter().map(|loads| loads.force_xy_peak_n).collect()
}

impl<'a> Rounds<'a> {
    fn new(bench: &'a Bench<'a>, unknowns: &'a Unknowns, samples: &'a [Sample], base: Look, met: Vec<Met>) -> Self {
        let forces = forces(bench, &base, samples);
        let (mut sum, mut length) = (0.0, 0.0);
        for ((sample, force), met) in samples.iter().zip(&forces).zip(&met) {
            if unknowns.free_share(met) >= FREE && !sample.edge {
                (sum, length) = (sum + sample.length_mm * force, length + sample.length_mm);
            }
        }
        let reference_n = bench.task.wanted.force_n.unwrap_or(sum / length.max(1e-12));
        let stock_mm = unknowns.stock_mm.clone();
        let slopes = vec![0.0; samples.len()];
        let base = (base, met.clone());
        let (done, best) = (Vec::new(), None);
        Self { bench, unknowns, samples, reference_n, stock_mm, met, forces, slopes, base, done, best }
    }

    /// The first derivatives: all stock changed alike.
    fn probe(&mut self) -> Result<(), SemifinishError> {
        let more: Vec<f64> = self.stock_mm.iter().map(|stock| stock + PROBE_MM).collect();
        let look = self.bench.look(&self.unknowns.offsets(&more), Some(&self.base.0))?;
        let after = forces(self.bench, &look, self.samples);
        for (k, after) in after.iter().enumerate() {
            let share = self.unknowns.free_share(&self.met[k]).max(FREE);
            self.slopes[k] = self.sound((after - self.forces[k]) / (PROBE_MM * share), k);
        }
        self.round();
        Ok(())
    }

    /// A derivative no less than a fifth of that of a force in proportion to stock: it must not send the next round anywhere.
    fn sound(&self, slope: f64, sample: usize) -> f64 {
        slope.max(0.2 * self.forces[sample].max(0.05 * self.reference_n) / self.bench.task.wanted.stock_mm[1])
    }

    fn counts(&self, sample: usize) -> bool {
        self.unknowns.free_share(&self.met[sample]) >= FREE && !self.samples[sample].edge
    }

    fn round(&mut self) -> f64 {
        let (mut sum, mut length, mut range) = (0.0, 0.0, [f64::INFINITY, 0.0_f64]);
        for k in (0..self.samples.len()).filter(|k| self.counts(*k)) {
            let off = self.forces[k] / self.reference_n - 1.0;
            sum += self.samples[k].length_mm * off * off * weight(off);
            length += self.samples[k].length_mm;
            range = [range[0].min(self.forces[k]), range[1].max(self.forces[k])];
        }
        let error = (sum / length.max(1e-12)).sqrt();
        self.done.push(Round { error, force_n: range });
        error
    }

    fn run(&mut self) -> Result<(), SemifinishError> {
        for round in 0..ROUNDS {
            let next = if round < ALONE { self.alone() } else { self.together() };
            let look = self.bench.look(&self.unknowns.offsets(&next), Some(&self.base.0))?;
            let forces = forces(self.bench, &look, self.samples);
            self.learn_slopes(&next, &forces);
            (self.stock_mm, self.forces) = (next, forces);
            self.met = self.bench.met(&look, self.samples);
            let before = self.best.as_ref().map_or(f64::INFINITY, |best| best.0);
            let error = self.round();
            if error < before {
                self.best = Some((error, self.stock_mm.clone(), look, self.met.clone()));
            }
            if error < GOOD || (round > ALONE && error > before * (1.0 - WORTH)) {
                break;
            }
        }
        Ok(())
    }

    fn learn_slopes(&mut self, next: &[f64], forces: &[f64]) {
        for (k, force) in forces.iter().enumerate() {
            let change: f64 = self.unknowns.shares(&self.met[k]).map(|(u, w)| w * (next[u] - self.stock_mm[u])).sum();
            if change.abs() > TELLING_MM {
                let [low, high] = TRUSTED.map(|part| part * self.slopes[k]);
                self.slopes[k] = self.sound(((force - self.forces[k]) / change).clamp(low, high), k);
            }
        }
    }

    /// Every contact by itself: the stock it asks for, spread over the knots it depends on.
    fn alone(&self) -> Vec<f64> {
        let count = self.stock_mm.len();
        let (mut sum, mut mass) = (vec![0.0; count], vec![0.0; count]);
        for k in (0..self.samples.len()).filter(|k| self.counts(*k)) {
            let asks = ((self.reference_n - self.forces[k]) / self.slopes[k]).clamp(-STEP_MM, STEP_MM);
            for (unknown, share) in self.unknowns.shares(&self.met[k]) {
                let weight = share * self.samples[k].length_mm;
                (sum[unknown], mass[unknown]) = (sum[unknown] + weight * asks, mass[unknown] + weight);
            }
        }
        let mut problem = self.bounded();
        let whole = mass.iter().sum::<f64>() / count as f64;
        for unknown in 0..count {
            // Where nothing is met any more the stock stays, with a small weight.
            let weight = (mass[unknown] / whole).max(1e-3).sqrt();
            let asks = if mass[unknown] > 0.0 { sum[unknown] / mass[unknown] } else { 0.0 };
            problem.push(std::iter::once((unknown as u32, weight)), weight * asks);
        }
        self.moved_by(&problem.solve())
    }

    /// All contacts together.
    fn together(&self) -> Vec<f64> {
        let mut problem = self.bounded();
        let length: f64 = self.samples.iter().map(|sample| sample.length_mm).sum();
        let scale = self.stock_mm.len() as f64 / length;
        for k in (0..self.samples.len()).filter(|k| self.counts(*k)) {
            let off = self.forces[k] / self.reference_n - 1.0;
            let weight = (self.samples[k].length_mm * scale * weight(off)).sqrt();
            let slope = weight * self.slopes[k] / self.reference_n;
            let row: Vec<(u32, f64)> =
                self.unknowns.shares(&self.met[k]).map(|(unknown, share)| (unknown as u32, slope * share)).collect();
            for (unknown, a) in &row {
                problem.ridge[*unknown as usize] += RIDGE * a.abs() * slope;
            }
            problem.push(row.into_iter(), -weight * off);
        }
        self.moved_by(&problem.solve())
    }

    /// Bounds on the change of this round.
    fn bounded(&self) -> Problem {
        let [low, high] = self.bench.task.wanted.stock_mm;
        let bounds = self.stock_mm.iter().map(|stock| {
            let [from, to] = [low - stock, high - stock];
            [from.max(-STEP_MM.max(-to)), to.min(STEP_MM.max(from))]
        });
        let pairs = self.unknowns.pairs.iter().map(|pair| {
            let [i, j] = pair.of.map(|k| self.stock_mm[k as usize]);
            Pair { centre: i - j, ..*pair }
        });
        let ridge = vec![1e-9; self.stock_mm.len()];
        Problem { bounds: bounds.collect(), pairs: pairs.collect(), ridge, ..Problem::default() }
    }

    fn moved_by(&self, change: &[f64]) -> Vec<f64> {
        self.stock_mm.iter().zip(change).map(|(stock, by)| stock + by).collect()
    }

    fn answer(self, picks_mm: [Option<f64>; 2]) -> Result<Answer, SemifinishError> {
        let Self { bench, unknowns, samples, reference_n, base, done, best, .. } = self;
        let (_, stock_mm, look, met) = best.expect("at least one round");
        let after = seen(bench, unknowns, samples, &look, &met, &stock_mm);
        let before = seen(bench, unknowns, samples, &base.0, &base.1, &unknowns.stock_mm);
        let wanted = &bench.task.wanted;
        if let (Some(wanted_n), Some(error)) = (wanted.force_n, out_of_reach(&after, wanted.stock_mm, reference_n)) {
            let [least_n, largest_n] = error;
            let most = least_n < wanted_n;
            let stock_mm = wanted.stock_mm[usize::from(most)];
            return Err(SemifinishError::OutOfReach {
                wanted_n,
                which: if most { "most" } else { "least" },
                stock_mm,
                least_n,
                largest_n,
            });
        }
        let chosen = (0..stock_mm.len()).map(|k| (unknowns.knots[k], [unknowns.stock_mm[k], stock_mm[k]]));
        Ok(Answer {
            offsets: unknowns.offsets(&stock_mm),
            chosen: chosen.collect(),
            knots: bench.knots.clone(),
            reference_n,
            before,
            after,
            rounds: done,
            picks_mm,
            events: base.0.map.events.clone(),
        })
    }
}

/// Weight of a square, so that errors beyond [`FAR`] count by themselves.
fn weight(off: f64) -> f64 {
    (FAR / off.abs().max(FAR)).min(1.0)
}

/// Is the reference reached nowhere, with all stock at one bound? Then the forces there.
fn out_of_reach(after: &[Seen], [low, high]: [f64; 2], reference_n: f64) -> Option<[f64; 2]> {
    let free: Vec<&Seen> = after.iter().filter(|seen| seen.free && seen.loads.force_xy_peak_n > 0.0).collect();
    let force = |seen: &&Seen| seen.loads.force_xy_peak_n;
    let near =
        |bound: f64| free.iter().filter(|seen| (seen.stock_mm - bound).abs() < 1e-3).count() * 10 > free.len() * 9;
    let below = free.iter().all(|seen| force(seen) < 0.9 * reference_n) && near(high);
    let above = free.iter().all(|seen| force(seen) > 1.1 * reference_n) && near(low);
    let range = free.iter().map(force).fold([f64::INFINITY, 0.0_f64], |[a, b], f| [a.min(f), b.max(f)]);
    (below || above).then_some(range)
}

fn seen(
    bench: &Bench,
    unknowns: &Unknowns,
    samples: &[Sample],
    look: &Look,
    met: &[Met],
    stock_mm: &[f64],
) -> Vec<Seen> {
    let loads = Bench::loads(look, bench.task.job, samples);
    let [low, high] = bench.task.wanted.stock_mm;
    let mut held: Vec<bool> = stock_mm.iter().map(|stock| *stock < low + 1e-3 || *stock > high - 1e-3).collect();
    for pair in &unknowns.pairs {
        let [i, j] = pair.of.map(|k| k as usize);
        if (stock_mm[j] - stock_mm[i]).abs() > 0.98 * pair.reach {
            (held[i], held[j]) = (true, true);
        }
    }
    let one = |k: usize| {
        let shares = || unknowns.shares(&met[k]);
        let whole: f64 = shares().map(|(_, share)| share).sum::<f64>().max(1e-12);
        let normal: Vec3 = met[k].normals.iter().map(|(_, normal)| normal).sum();
        Seen {
            sample: samples[k],
            loads: loads[k],
            left_by: met[k].place,
            normal: normal.try_normalize(0.0).unwrap_or_else(Vec3::z),
            stock_mm: shares().map(|(unknown, share)| share * stock_mm[unknown]).sum::<f64>() / whole,
            free: whole >= FREE && !samples[k].edge,
            bound: shares().filter(|(unknown, _)| held[*unknown]).map(|(_, share)| share).sum::<f64>() > 0.5,
        }
    };
    (0..samples.len()).map(one).collect()
}

impl Unknowns {
    /// Unknowns that a sample depends on, with their shares.
    fn shares<'b>(&'b self, met: &'b Met) -> impl Iterator<Item = (usize, f64)> + 'b {
        met.shares.iter().filter_map(|(knot, share)| Some((self.of_knot[*knot as usize]? as usize, *share)))
    }
    /// Share of what a sample meets that can be chosen.
    fn free_share(&self, met: &Met) -> f64 {
        self.shares(met).map(|(_, share)| share).sum()
    }
}
