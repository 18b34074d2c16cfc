//! What the true tool bears: torque along the path against its limit, and the least time in which it bears no more.
//!
//! In: the true machine, steps with feeds. Out: by how much the limit is exceeded, where, for how long; the time of an oracle.
//!
//! Torque of a step: M = P/(2π n), P the power of cutting and edge at the tool. A step's torque is the mean over
//! `SPAN_MM` of path around it: below that the pixels of the engagement show (`engagement.rs`).

use super::causes::Hidden;
use super::machine::Step;
use super::programs::Job;
use super::shop_floor::{Machine, Run, simulate};

/// Length over which torque is averaged, mm.
const SPAN_MM: f64 = 1.0;
/// Share of the greatest torque under the programmed feeds that a tool is limited to: some cuts must slow, most may rise.
const SHARE: f64 = 0.7;
/// Changes of feed that the setup allows in cuts.
pub const CHANGE: [f64; 2] = [0.2, 2.0];
/// Excess from which a place counts in the length over the limit.
pub const COUNTS: f64 = 0.05;

/// Torque of each step, N·m, averaged along the path; 0 where nothing is cut.
pub fn torques(steps: &[Step], run: &Run) -> Vec<f64> {
    let raw: Vec<f64> = steps
        .iter()
        .zip(&run.loads)
        .map(
            |(step, load)| {
                if step.rpm > 0.0 { (load[0] + load[1]) / (std::f64::consts::TAU * step.rpm / 60.0) } else { 0.0 }
            },
        )
        .collect();
    let cuts = |i: usize| raw[i] > 0.0 && !steps[i].rapid;
    (0..steps.len()).map(|i| if cuts(i) { mean_around(i, steps, &raw) } else { 0.0 }).collect()
}

/// Mean of the torque over half the span on both sides, as far as the tool cuts on in the same line of the program.
fn mean_around(i: usize, steps: &[Step], raw: &[f64]) -> f64 {
    let (mut sum, mut length) = (raw[i] * steps[i].length_mm, steps[i].length_mm);
    let mut add = |others: &mut dyn Iterator<Item = usize>| {
        let mut left = (SPAN_MM - steps[i].length_mm) / 2.0;
        for j in others {
            if left <= 0.0 || raw[j] <= 0.0 || steps[j].pass != steps[i].pass || steps[j].length_mm == 0.0 {
                break;
            }
            let taken = steps[j].length_mm.min(left);
            sum += raw[j] * taken;
            length += taken;
            left -= taken;
        }
    };
    add(&mut (i + 1..steps.len()));
    add(&mut (0..i).rev());
    sum / length.max(1e-9)
}

/// Limit of each tool, N·m: a share of what a sound machine would meet under the programmed feeds.
pub fn limits(job: &Job, machine: &Machine) -> Vec<f64> {
    let plain = torques(&job.steps, &simulate(job, machine, &Hidden::default()));
    let of = |tool: usize| {
        let mut own: Vec<f64> =
            plain.iter().zip(&job.steps).filter(|(m, s)| s.tool == tool && **m > 0.0).map(|(m, _)| *m).collect();
        own.sort_by(f64::total_cmp);
        own.get(own.len().saturating_sub(1) * 99 / 100).map_or(1.0, |m| SHARE * m)
    };
    (0..job.tools.len()).map(of).collect()
}

/// How a run kept its limits.
#[derive(Clone, Copy, Debug, Default)]
pub struct Kept {
    /// Greatest excess over the limit, as a share; negative where the limit is never reached.
    pub worst: f64,
    /// Share of the cut length that is more than `COUNTS` above.
    pub over: f64,
    /// The step of the worst.
    pub at: usize,
    pub duration_s: f64,
}

/// The same job with other feeds.
pub fn with_steps(job: &Job, steps: Vec<Step>) -> Job {
    Job { text: String::new(), steps, tools: job.tools.clone(), low: job.low, high: job.high, truth: job.truth }
}

/// Runs steps on the true machine and holds them against the limits. `least`: torque at the lowest feed allowed, by the pass
/// and place of the original; what no feed could have met is no excess.
pub fn kept(job: &Job, machine: &Machine, hidden: &Hidden, limits: &[f64], least: &Least) -> Kept {
    let run = simulate(job, machine, hidden);
    let torque = torques(&job.steps, &run);
    let (mut answer, mut cut, mut over) =
        (Kept { worst: -1.0, duration_s: run.duration_s, ..Kept::default() }, 0.0, 0.0);
    let mut gone = 0.0;
    for (i, step) in job.steps.iter().enumerate() {
        let place = gone + step.length_mm / 2.0;
        gone += step.length_mm;
        if torque[i] <= 0.0 {
            continue;
        }
        let excess = torque[i] / limits[step.tool].max(least.at(place)) - 1.0;
        cut += step.length_mm;
        over += if excess > COUNTS { step.length_mm } else { 0.0 };
        if excess > answer.worst {
            (answer.worst, answer.at) = (excess, i);
        }
    }
    answer.over = over / f64::max(cut, 1e-9);
    answer
}

/// Torque at the lowest feed allowed along the path: ends of the steps, mm, and torque, N·m.
pub struct Least(Vec<(f64, f64)>);

impl Least {
    /// The largest within the span over which torque is averaged.
    fn at(&self, place: f64) -> f64 {
        let from = self.0.partition_point(|(end, _)| *end < place - SPAN_MM);
        self.0[from..].iter().take_while(|(end, _)| *end < place + SPAN_MM).map(|(_, m)| *m).fold(0.0, f64::max)
    }
}

/// Runs the original at the lowest feeds.
pub fn least(job: &Job, machine: &Machine, hidden: &Hidden) -> Least {
    let slow = |step: &Step| Step {
        speed_mm_s: if step.rapid { step.speed_mm_s } else { CHANGE[0] * step.speed_mm_s },
        ..*step
    };
    let slow = with_steps(job, job.steps.iter().map(slow).collect());
    let torque = torques(&slow.steps, &simulate(&slow, machine, hidden));
    let mut end = 0.0;
    let ends = slow.steps.iter().zip(torque).map(|(step, m)| {
        end += step.length_mm;
        (end, m)
    });
    Least(ends.collect())
}

/// Rounds in which the oracle's feeds find the limit.
const ROUNDS: usize = 4;

/// Time of one that knows the truth, s: at each step the highest feed within the allowed change at which the true torque
/// keeps its limit. It enters cuts at full feed as well, which the optimiser by default does not.
pub fn oracle_s(job: &Job, machine: &Machine, hidden: &Hidden, limits: &[f64]) -> f64 {
    let mut steps = job.steps.clone();
    let mut duration = 0.0;
    for round in 0..=ROUNDS {
        let now = with_steps(job, steps.clone());
        let run = simulate(&now, machine, hidden);
        duration = run.duration_s;
        if round == ROUNDS {
            break;
        }
        for ((step, m), first) in steps.iter_mut().zip(torques(&now.steps, &run)).zip(&job.steps) {
            if m <= 0.0 || step.rapid {
                continue;
            }
            // Torque falls slower than the feed, by the share of the edge: a little more than in proportion.
            let by = (limits[step.tool] / m).powf(1.3);
            step.speed_mm_s = (step.speed_mm_s * by).clamp(CHANGE[0] * first.speed_mm_s, CHANGE[1] * first.speed_mm_s);
        }
    }
    duration
}
