//! The rounds of simulation and correction; for the mathematics see [`super`]. In: a task. Out: [`Answer`].

use super::knots::Knots;
use super::least_squares::{Pair, Problem};
use super::met_stock::{MetStock, Sample};
use super::preconditions::{check_meeting, check_wanted};
use super::programs::{Programs, Simulated};
use super::stretch_loads::{StretchLoads, out_of_reach, stretch_loads};
use super::task::{SemifinishError, Task};
use super::unknowns::{FREE, Unknowns};
use crate::engage::Event;
use crate::path::Vec3;

/// Uniform change of stock for the first derivatives, mm: a tenth of the usual stock.
const PROBE_MM: f64 = 0.02;
/// Rounds that solve each contact separately, and most rounds in all.
const SEPARATE_ROUNDS: usize = 3;
const ROUNDS: usize = 16;
/// Largest change of stock in a round, mm: derivatives hold for about this much. After a round that is discarded it is
/// multiplied by [`SHORTER`], after an accepted one doubled; below the least the rounds end. Judgement, like the
/// constants below.
const STEP_MM: f64 = 0.1;
const SHORTER: f64 = 0.3;
const LEAST_STEP_MM: f64 = 0.002;
/// μ, weight of the change of stock against the relative error of force: stock that the forces do not determine stays
/// as it is.
const RIDGE: f64 = 0.1;
/// Least change of stock in a round from which a derivative is updated, mm.
const INFORMATIVE_MM: f64 = 0.004;
/// Least relative drop of the mean error; the second round in a row with less is the last.
const LEAST_GAIN: f64 = 0.01;
/// Mean relative error of force at which the rounds end.
const GOOD: f64 = 0.003;
/// Relative error of force up to which it counts by its square. Beyond it its pull falls as the square of the error, so that a contact that
/// cannot reach the reference does not distort its neighbours: beside a wall of raw stock it is four times the reference, and with a pull that
/// stays the same (Huber) kept the stock of the pass before it at half of what that one needs. One and a half times the band of 10 % that is wanted.
const NEAR: f64 = 0.15;
/// Least force over the reference that is assumed, in steps and in the logarithm, to keep these finite.
const LEAST_FORCE: f64 = 0.05;
const LEAST_RATIO: f64 = 1e-3;

/// Result of a round.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Round {
    /// Root of the mean of the [`cost`] of ln(F/reference), weighted by length.
    pub error: f64,
    /// Least and largest force, N.
    pub force_n: [f64; 2],
}

/// The offsets, with loads before and after.
pub struct Answer {
    /// The knots.
    pub knots: Knots,
    /// Their offsets, mm.
    pub offsets: Vec<Vec3>,
    /// Knots whose stock was chosen, with the stock before and after, mm.
    pub chosen: Vec<(u32, [f64; 2])>,
    /// The reference, N.
    pub reference_n: f64,
    /// Loads as programmed.
    pub before: Vec<StretchLoads>,
    /// Loads with the offsets, in the same order.
    pub after: Vec<StretchLoads>,
    /// The rounds.
    pub rounds: Vec<Round>,
    /// Spacing of the passes of semi-finish and finish, mm.
    pub picks_mm: [Option<f64>; 2],
    /// Collisions and the like as programmed.
    pub events: Vec<Event>,
}

/// Solves for the offsets.
pub fn solve(task: &Task) -> Result<Answer, SemifinishError> {
    check_wanted(task)?;
    let programs = Programs::new(task)?;
    let still = vec![Vec3::zeros(); programs.knots.list.len()];
    let base = programs.simulated(&still, None)?;
    let samples = programs.samples(&base);
    if !samples.is_empty() && !programs.has_force(&base, &samples) {
        return Err(SemifinishError::NoForce { tool: programs.finish_tool.number });
    }
    let met = programs.met(&base, &samples);
    check_meeting(&programs, &base, &samples, &met)?;
    let unknowns = Unknowns::new(&programs, &base, &samples, &met)?;
    let picks_mm = super::pass_spacing::pass_spacing(&programs, &base, &unknowns.tips(&programs, &base));
    if !samples.iter().zip(&met).any(|(sample, met)| !sample.edge && unknowns.free_share(met) >= FREE) {
        return Err(SemifinishError::NoFullCut);
    }
    let mut rounds = Rounds::new(&programs, &unknowns, &samples, base, met);
    rounds.probe()?;
    rounds.run()?;
    rounds.answer(picks_mm)
}

struct Rounds<'a> {
    programs: &'a Programs<'a>,
    unknowns: &'a Unknowns,
    samples: &'a [Sample],
    reference_n: f64,
    stock_mm: Vec<f64>,
    met: Vec<MetStock>,
    forces: Vec<f64>,
    /// ∂F/∂t of every sample by the unknowns that it depends on, N/mm.
    slopes: Vec<Vec<(u32, f64)>>,
    base: (Simulated, Vec<MetStock>),
    done: Vec<Round>,
    /// The best simulation so far; `None`: the original programs.
    best: Option<Simulated>,
    error: f64,
    step_mm: f64,
}

fn forces(programs: &Programs, simulated: &Simulated, samples: &[Sample]) -> Vec<f64> {
    Programs::loads(simulated, programs.task.job, samples).iter().map(|loads| loads.force_xy_peak_n).collect()
}

impl<'a> Rounds<'a> {
    fn new(
        programs: &'a Programs<'a>,
        unknowns: &'a Unknowns,
        samples: &'a [Sample],
        base: Simulated,
        met: Vec<MetStock>,
    ) -> Self {
        let forces = forces(programs, &base, samples);
        let (mut sum, mut length) = (0.0, 0.0);
        for ((sample, force), met) in samples.iter().zip(&forces).zip(&met) {
            if unknowns.free_share(met) >= FREE && !sample.edge {
                (sum, length) = (sum + sample.length_mm * force, length + sample.length_mm);
            }
        }
        let reference_n = programs.task.wanted.force_n.unwrap_or(sum / length.max(1e-12));
        let stock_mm = unknowns.stock_mm.clone();
        let slopes = vec![Vec::new(); samples.len()];
        let base = (base, met.clone());
        let (done, best, error, step_mm) = (Vec::new(), None, f64::INFINITY, STEP_MM);
        Self {
            programs,
            unknowns,
            samples,
            reference_n,
            stock_mm,
            met,
            forces,
            slopes,
            base,
            done,
            best,
            error,
            step_mm,
        }
    }

    /// First derivatives, from a uniform change of stock.
    fn probe(&mut self) -> Result<(), SemifinishError> {
        let more: Vec<f64> = self.stock_mm.iter().map(|stock| stock + PROBE_MM).collect();
        let simulated = self.programs.simulated(&self.unknowns.offsets(&more), Some(&self.base.0))?;
        let after = forces(self.programs, &simulated, self.samples);
        for (k, after) in after.iter().enumerate() {
            let share = self.unknowns.free_share(&self.met[k]).max(FREE);
            let slope = self.at_least_slope((after - self.forces[k]) / (PROBE_MM * share), k);
            self.slopes[k] = self.unknowns.shares(&self.met[k]).map(|(u, share)| (u as u32, slope * share)).collect();
        }
        self.enter_round(&self.forces.clone());
        Ok(())
    }

    /// A derivative of at least a fifth of that of a force proportional to stock, so that steps stay bounded.
    fn at_least_slope(&self, slope: f64, sample: usize) -> f64 {
        slope.max(0.2 * self.forces[sample].max(LEAST_FORCE * self.reference_n) / self.programs.task.wanted.stock_mm[1])
    }

    /// The derivative by a uniform change of stock.
    fn slope(&self, sample: usize) -> f64 {
        self.at_least_slope(self.slopes[sample].iter().map(|(_, slope)| slope).sum(), sample)
    }

    fn counts(&self, sample: usize) -> bool {
        self.unknowns.free_share(&self.met[sample]) >= FREE && !self.samples[sample].edge
    }

    /// ln(F/reference).
    fn log_ratio(&self, force_n: f64) -> f64 {
        (force_n / self.reference_n).max(LEAST_RATIO).ln()
    }

    /// Records a round and returns its mean error, over the samples that counted in the original programs.
    fn enter_round(&mut self, forces: &[f64]) -> f64 {
        let (mut sum, mut length, mut range) = (0.0, 0.0, [f64::INFINITY, 0.0_f64]);
        for (k, force) in forces.iter().enumerate() {
            if self.samples[k].edge || self.unknowns.free_share(&self.base.1[k]) < FREE {
                continue;
            }
            sum += self.samples[k].length_mm * cost(self.log_ratio(*force));
            length += self.samples[k].length_mm;
            range = [range[0].min(*force), range[1].max(*force)];
        }
        let error = (sum / length.max(1e-12)).sqrt();
        self.done.push(Round { error, force_n: range });
        error
    }

    fn run(&mut self) -> Result<(), SemifinishError> {
        let (mut alone, mut idle) = (0, 0);
        for _ in 0..ROUNDS {
            let next = if alone < SEPARATE_ROUNDS { self.each_contact() } else { self.all_contacts() };
            let simulated = self.programs.simulated(&self.unknowns.offsets(&next), Some(&self.base.0))?;
            let forces = forces(self.programs, &simulated, self.samples);
            let met = self.programs.met(&simulated, self.samples);
            self.update_slopes(&next, &forces, &met);
            let error = self.enter_round(&forces);
            alone += 1;
            if error < self.error {
                idle = if lowers_enough(error, self.error) { 0 } else { idle + 1 };
                (self.stock_mm, self.forces, self.met, self.best, self.error) =
                    (next, forces, met, Some(simulated), error);
                self.step_mm = longer_mm(self.step_mm);
            } else {
                if alone >= SEPARATE_ROUNDS {
                    self.step_mm *= SHORTER;
                }
                alone = SEPARATE_ROUNDS;
            }
            if is_last(self.error, idle, self.step_mm) {
                break;
            }
        }
        Ok(())
    }

    /// Updates the derivatives of each sample by the least change that explains the force of this round (Broyden 1965;
    /// sparse by Schubert 1970). They are not negative, as more stock never gives less to cut.
    fn update_slopes(&mut self, next: &[f64], forces: &[f64], met: &[MetStock]) {
        for k in 0..forces.len() {
            let change = |unknown: u32| next[unknown as usize] - self.stock_mm[unknown as usize];
            let square: f64 = self.slopes[k].iter().map(|(unknown, _)| change(*unknown).powi(2)).sum();
            let whole = self.slope(k);
            let mut row = std::mem::take(&mut self.slopes[k]);
            if is_informative(square.sqrt()) {
                let expected: f64 = row.iter().map(|(unknown, slope)| slope * change(*unknown)).sum();
                let missed = (forces[k] - self.forces[k] - expected) / square;
                for (unknown, slope) in &mut row {
                    *slope = (*slope + missed * change(*unknown)).clamp(0.0, 3.0 * whole);
                }
            }
            // Unknowns that were not met before get their share of the same sum.
            let sum = |row: &[(u32, f64)]| row.iter().map(|(_, slope)| slope).sum::<f64>();
            let told = sum(&row);
            for (unknown, share) in self.unknowns.shares(&met[k]) {
                if !row.iter().any(|(known, _)| *known as usize == unknown) {
                    row.push((unknown as u32, share * whole));
                }
            }
            let scale = if told > 0.0 { told / sum(&row) } else { 1.0 };
            for (_, slope) in &mut row {
                *slope *= scale;
            }
            self.slopes[k] = row;
        }
    }

    /// Next stock if each contact is solved separately and its change is averaged over the knots it depends on.
    fn each_contact(&self) -> Vec<f64> {
        let count = self.stock_mm.len();
        let (mut sum, mut mass) = (vec![0.0; count], vec![0.0; count]);
        for k in (0..self.samples.len()).filter(|k| self.counts(*k)) {
            let asks = ((self.reference_n - self.forces[k]) / self.slope(k)).clamp(-STEP_MM, STEP_MM);
            for (unknown, share) in self.unknowns.shares(&self.met[k]) {
                let weight = share * self.samples[k].length_mm;
                (sum[unknown], mass[unknown]) = (sum[unknown] + weight * asks, mass[unknown] + weight);
            }
        }
        let mut problem = self.bounded();
        let whole = mass.iter().sum::<f64>() / count as f64;
        for unknown in 0..count {
            // Stock that no sample meets any more is kept, with a small weight.
            let weight = (mass[unknown] / whole).max(1e-3).sqrt();
            let asks = if mass[unknown] > 0.0 { sum[unknown] / mass[unknown] } else { 0.0 };
            problem.push(std::iter::once((unknown as u32, weight)), weight * asks);
        }
        self.moved_by(&problem.solve())
    }

    /// Next stock by a Gauss–Newton step for all contacts.
    fn all_contacts(&self) -> Vec<f64> {
        let mut problem = self.bounded();
        let length: f64 = self.samples.iter().map(|sample| sample.length_mm).sum();
        let scale = self.stock_mm.len() as f64 / length;
        for k in (0..self.samples.len()).filter(|k| self.counts(*k)) {
            // Relative step to the reference, with the weight that gives it the pull of the cost.
            let force = self.forces[k].max(LEAST_FORCE * self.reference_n);
            let (asks, off) = (self.reference_n / force - 1.0, self.log_ratio(force));
            let pull = (pull(off.abs()) / asks.abs().max(1e-9)).min(1.0);
            let weight = (self.samples[k].length_mm * scale * pull).sqrt();
            let row: Vec<(u32, f64)> = self.slopes[k]
                .iter()
                .map(|(unknown, slope)| (*unknown, weight * slope / force))
                .filter(|(_, a)| *a != 0.0)
                .collect();
            let whole: f64 = row.iter().map(|(_, a)| a).sum();
            for (unknown, a) in &row {
                problem.ridge[*unknown as usize] += RIDGE * a * whole;
            }
            problem.push(row.into_iter(), weight * asks);
        }
        self.moved_by(&problem.solve())
    }

    /// The problem of a round with its bounds, without rows.
    fn bounded(&self) -> Problem {
        let [low, high] = self.programs.task.wanted.stock_mm;
        let bounds = self.stock_mm.iter().map(|stock| {
            let [from, to] = [low - stock, high - stock];
            [from.max(-self.step_mm.max(-to)), to.min(self.step_mm.max(from))]
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
        let Self { programs, unknowns, samples, reference_n, base, done, best, stock_mm, met, .. } = self;
        let after = stretch_loads(programs, unknowns, samples, best.as_ref().unwrap_or(&base.0), &met, &stock_mm);
        let before = stretch_loads(programs, unknowns, samples, &base.0, &base.1, &unknowns.stock_mm);
        let wanted = &programs.task.wanted;
        if let (Some(wanted_n), Some([force_n, stock_mm])) = (wanted.force_n, out_of_reach(&after, reference_n)) {
            return Err(SemifinishError::OutOfReach { wanted_n, force_n, stock_mm });
        }
        let chosen = (0..stock_mm.len()).map(|k| (unknowns.knots[k], [unknowns.stock_mm[k], stock_mm[k]]));
        Ok(Answer {
            offsets: unknowns.offsets(&stock_mm),
            chosen: chosen.collect(),
            knots: programs.knots.clone(),
            reference_n,
            before,
            after,
            rounds: done,
            picks_mm,
            events: base.0.map.events.clone(),
        })
    }
}

/// Square of an error, and beyond [`NEAR`] what goes on with twice the [`pull`] as its slope: at most three times the square of that.
fn cost(off: f64) -> f64 {
    if off.abs() < NEAR { off * off } else { NEAR * NEAR * (3.0 - 2.0 * NEAR / off.abs()) }
}

/// Half the slope of the [`cost`] at an error that is not negative.
fn pull(off: f64) -> f64 {
    if off < NEAR { off } else { NEAR * (NEAR / off).powi(2) }
}

/// Does a round lower the mean error by at least [`LEAST_GAIN`]?
fn lowers_enough(error: f64, before: f64) -> bool {
    error <= before * (1.0 - LEAST_GAIN)
}

/// Is it the last round: small error, two rounds in a row with little gain, or too short a step?
fn is_last(error: f64, idle: u32, step_mm: f64) -> bool {
    error < GOOD || idle == 2 || step_mm < LEAST_STEP_MM
}

/// Largest change of stock after an accepted round, mm.
fn longer_mm(step_mm: f64) -> f64 {
    (2.0 * step_mm).min(STEP_MM)
}

/// Is a change of stock large enough to update the derivative?
fn is_informative(change_mm: f64) -> bool {
    change_mm > INFORMATIVE_MM
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_is_worth_it_from_a_hundredth_less_error_on() {
        assert!(lowers_enough(0.0989, 0.1) && !lowers_enough(0.0991, 0.1));
    }

    #[test]
    fn the_rounds_end_at_a_small_error_two_idle_rounds_or_a_short_step() {
        assert!(!is_last(0.0031, 1, 0.0021));
        assert!(is_last(0.0029, 0, 0.1) && is_last(0.1, 2, 0.1) && is_last(0.1, 0, 0.0019));
    }

    #[test]
    fn a_step_doubles_up_to_the_largest_and_a_bad_one_shrinks_to_three_tenths() {
        assert!((longer_mm(0.04) - 0.08).abs() < 1e-12 && (longer_mm(0.06) - 0.1).abs() < 1e-12);
        // From the largest to the least in four bad rounds, not in three.
        assert!(STEP_MM * SHORTER.powi(4) < LEAST_STEP_MM && STEP_MM * SHORTER.powi(3) > LEAST_STEP_MM);
    }

    #[test]
    fn a_change_of_stock_tells_the_derivative_from_four_micrometres_on() {
        assert!(is_informative(0.0041) && !is_informative(0.0039));
    }

    /// The square up to 0.15, beyond it less and less; the pull is half its slope everywhere.
    #[test]
    fn errors_far_beyond_the_band_hardly_pull() {
        assert!((cost(-0.14) - 0.0196).abs() < 1e-12 && (cost(0.3) - 0.045).abs() < 1e-12 && cost(1e9) < 0.0675);
        for off in [0.01, 0.149, 0.151, 0.3, 1.4] {
            let slope = (cost(off + 1e-6) - cost(off - 1e-6)) / 2e-6;
            assert!((0.5 * slope - pull(off)).abs() < 1e-9, "{off}");
        }
        assert!((pull(0.3) - 0.0375).abs() < 1e-12 && pull(1.5) < 0.0016);
    }
}
