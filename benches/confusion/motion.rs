//! When the machine is where. In: the part and the share of the declared acceleration that the machine really has. Out: a
//! timeline of legs with trapezoids of speed.
//!
//! Path acceleration and rapid speed are what the axes allow in the direction of the move. A corner that turns by 2β is
//! passed at v² = a δ s/(1 − s), s = cos β (the arc that stays within the tolerance δ), never faster than either feed;
//! rapids, dwells and spindle changes begin and end at rest.

use super::programs::Part;
use super::writer::{Action, Path};

/// One leg of the timeline.
#[derive(Debug, Clone, Copy)]
pub struct Leg {
    /// Its step.
    pub step: usize,
    /// Start, s.
    pub start_s: f64,
    /// Duration, s.
    pub duration_s: f64,
    /// Spindle speed during it, rev/s.
    pub rps: f64,
    /// The spindle runs up during it.
    pub runup: bool,
    motion: Option<Trapezoid>,
    path: Option<Path>,
    rest: [f64; 3],
}

#[derive(Debug, Clone, Copy)]
struct Trapezoid {
    entry: f64,
    top: f64,
    exit: f64,
    acceleration: f64,
    length: f64,
}

impl Trapezoid {
    fn new(length: f64, entry: f64, limit: f64, exit: f64, acceleration: f64) -> Self {
        let reachable = (acceleration * length + 0.5 * (entry * entry + exit * exit)).sqrt();
        Self { entry, top: limit.min(reachable).max(entry).max(exit), exit, acceleration, length }
    }
    fn phases(&self) -> [f64; 3] {
        let up = (self.top - self.entry) / self.acceleration;
        let down = (self.top - self.exit) / self.acceleration;
        let used = 0.5 * (self.top + self.entry) * up + 0.5 * (self.top + self.exit) * down;
        [up, (self.length - used).max(0.0) / self.top, down]
    }
    /// Distance, speed and acceleration at a time after its start.
    fn at(&self, t: f64) -> (f64, f64, f64) {
        let [up, steady, _] = self.phases();
        let a = self.acceleration;
        if t < up {
            return (t * (self.entry + 0.5 * a * t), self.entry + a * t, a);
        }
        let first = 0.5 * (self.top + self.entry) * up;
        if t < up + steady {
            return (first + self.top * (t - up), self.top, 0.0);
        }
        let late = t - up - steady;
        (first + self.top * steady + late * (self.top - 0.5 * a * late), (self.top - a * late).max(0.0), -a)
    }
}

/// What the machine does at a moment.
#[derive(Debug, Clone, Copy)]
pub struct Moment {
    /// Index of the step.
    pub step: usize,
    /// Distance along its path, mm.
    pub s_mm: f64,
    /// Speed along it, mm/s.
    pub speed_mm_s: f64,
    /// Acceleration along it, mm/s².
    pub acceleration_mm_s2: f64,
    /// Tool tip, mm.
    pub at_mm: [f64; 3],
    /// Spindle speed, rev/s.
    pub rps: f64,
    /// Share of the speed reached, while running up.
    pub runup: Option<f64>,
}

impl Leg {
    /// Where the machine is at the time `t`.
    pub fn at(&self, t: f64) -> Moment {
        let late = (t - self.start_s).clamp(0.0, self.duration_s);
        let (s_mm, speed_mm_s, acceleration_mm_s2) = self.motion.map_or((0.0, 0.0, 0.0), |m| m.at(late));
        let at_mm = self.path.map_or(self.rest, |path| path.at(s_mm).0);
        let runup = self.runup.then(|| late / self.duration_s.max(1e-9));
        Moment { step: self.step, s_mm, speed_mm_s, acceleration_mm_s2, at_mm, rps: self.rps, runup }
    }
    /// Speed at a distance along the path, mm/s.
    pub fn speed_at(&self, s_mm: f64) -> f64 {
        let Some(m) = &self.motion else { return 0.0 };
        let rising = m.entry * m.entry + 2.0 * m.acceleration * s_mm;
        let falling = m.exit * m.exit + 2.0 * m.acceleration * (m.length - s_mm);
        m.top.min(rising.max(0.0).sqrt()).min(falling.max(0.0).sqrt())
    }
    /// End, s.
    pub fn end_s(&self) -> f64 {
        self.start_s + self.duration_s
    }
}

/// The timeline of a part, in order.
pub fn timeline(part: &Part, acceleration_share: f64) -> Vec<Leg> {
    let acceleration = part.shop.acceleration_mm_s2 * acceleration_share;
    let speeds = junctions(part, acceleration);
    let (mut legs, mut now, mut rps, mut rest) = (Vec::new(), 0.0, 0.0, [0.0, 0.0, 60.0]);
    for (k, step) in part.steps.iter().enumerate() {
        let mut leg = Leg { step: k, start_s: now, duration_s: 0.0, rps, runup: false, motion: None, path: None, rest };
        match step.action {
            Action::Dwell(seconds) => leg.duration_s = seconds,
            Action::Tool => leg.duration_s = part.shop.tool_change_s,
            Action::Spindle(to) => {
                (rps, leg.rps, leg.runup) = (to, to, true);
                leg.duration_s = part.shop.runup_s;
            }
            Action::Move { path, feed_mm_s } => {
                let a = along_axes(acceleration, &path);
                let limit = limit(part, &path, feed_mm_s, acceleration);
                let motion = Trapezoid::new(path.length(), speeds[k], limit, speeds[k + 1], a);
                leg.duration_s = motion.phases().iter().sum();
                (leg.motion, leg.path) = (Some(motion), Some(path));
                rest = path.to;
            }
        }
        now += leg.duration_s;
        legs.push(leg);
    }
    legs
}

fn limit(part: &Part, path: &Path, feed_mm_s: Option<f64>, acceleration: f64) -> f64 {
    let speed = feed_mm_s.unwrap_or_else(|| part.shop.rapid_mm_s.min(along_axes(part.shop.rapid_mm_s, path)));
    speed.min((acceleration * path.radius()).sqrt())
}

/// The least over the axes of value / share of the direction.
fn along_axes(value: f64, path: &Path) -> f64 {
    let (_, d) = path.at(0.0);
    if path.arc.is_some() { value } else { value / d.iter().fold(0.0f64, |m, x| m.max(x.abs())).max(1e-9) }
}

/// Speeds at the beginning of each step (and at the very end), from corners, then forward and backward.
fn junctions(part: &Part, acceleration: f64) -> Vec<f64> {
    let n = part.steps.len();
    let mut speed = vec![0.0; n + 1];
    let feed_move = |k: usize| match part.steps[k].action {
        Action::Move { path, feed_mm_s: Some(feed) } => Some((path, limit(part, &path, Some(feed), acceleration))),
        _ => None,
    };
    for (k, speed) in speed.iter_mut().enumerate().take(n).skip(1) {
        if let (Some((a, va)), Some((b, vb))) = (feed_move(k - 1), feed_move(k)) {
            let (_, before) = a.at(a.length());
            let (_, after) = b.at(0.0);
            let dot: f64 = (0..3).map(|i| before[i] * after[i]).sum();
            let s = f64::midpoint(1.0, dot.clamp(-1.0, 1.0)).sqrt();
            let corner = acceleration * part.shop.tolerance_mm * s / (1.0 - s).max(1e-9);
            *speed = corner.sqrt().min(va).min(vb);
        }
    }
    for k in 0..n {
        if let Some((path, _)) = feed_move(k) {
            let gain = 2.0 * along_axes(acceleration, &path) * path.length();
            speed[k + 1] = speed[k + 1].min((speed[k].powi(2) + gain).sqrt());
        }
    }
    for k in (0..n).rev() {
        if let Some((path, _)) = feed_move(k) {
            let gain = 2.0 * along_axes(acceleration, &path) * path.length();
            speed[k] = speed[k].min((speed[k + 1].powi(2) + gain).sqrt());
        }
    }
    speed
}
