//! How the machine moves: from steps of a path to the times at which they are passed.
//!
//! In: steps (short straight pieces with the programmed feed), acceleration and the tolerance at corners, what the
//! operator does to the override. Out: one tick for each step: when it begins, how long it takes, speed, acceleration.
//!
//! Corners: a machine that rounds a corner of turn θ within the tolerance δ on an arc keeps v² = a δ s/(1 − s) with
//! s = cos(θ/2) (the arc that touches both sides δ away from the corner). Backwards over the path the speed at each
//! corner is what can still be braked; forwards it is what can be reached.

/// A piece of the path, or a wait where it has no length.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    pub from: [f64; 3],
    pub to: [f64; 3],
    pub length_mm: f64,
    /// Programmed speed, mm/s.
    pub speed_mm_s: f64,
    pub rapid: bool,
    pub wait_s: f64,
    /// Speed of the spindle, rpm.
    pub rpm: f64,
    pub tool: usize,
    pub line: usize,
    pub pass: usize,
}

/// What moves the axes.
pub struct Drives<'a> {
    pub acceleration_mm_s2: f64,
    pub corner_tolerance_mm: f64,
    /// Time lost at each sharp corner (more than 30°) while the position settles, s.
    pub settle_s: f64,
    /// Share of the programmed feed at a time.
    pub override_at: Option<&'a dyn Fn(f64) -> f64>,
    /// When the operator holds the feed, and for how long, s.
    pub holds: &'a [[f64; 2]],
}

/// When and how one step is passed.
#[derive(Clone, Copy, Debug)]
pub struct Tick {
    pub step: usize,
    pub time_s: f64,
    pub duration_s: f64,
    pub speed_mm_s: f64,
    pub acceleration_mm_s2: f64,
}

/// Unit vector of a step.
fn along(step: &Step) -> [f64; 3] {
    [0, 1, 2].map(|k| (step.to[k] - step.from[k]) / step.length_mm.max(1e-9))
}

/// Cosine of the turn between two steps.
fn cos_turn(before: &Step, after: &Step) -> f64 {
    let (a, b) = (along(before), along(after));
    (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]).clamp(-1.0, 1.0)
}

/// Highest speed from one step into the next.
fn corner_speed(before: &Step, after: &Step, drives: &Drives<'_>) -> f64 {
    if before.length_mm == 0.0 || after.length_mm == 0.0 {
        return 0.0;
    }
    let half = f64::midpoint(1.0, cos_turn(before, after)).max(0.0).sqrt();
    let round = if half > 1.0 - 1e-9 {
        f64::INFINITY
    } else {
        (drives.acceleration_mm_s2 * drives.corner_tolerance_mm * half / (1.0 - half)).sqrt()
    };
    round.min(before.speed_mm_s).min(after.speed_mm_s)
}

/// Runs over the path in time.
pub fn run(steps: &[Step], drives: &Drives<'_>) -> Vec<Tick> {
    let a = drives.acceleration_mm_s2;
    // Speed at the end of each step that leaves room to brake.
    let mut end = vec![0.0; steps.len()];
    for i in (0..steps.len().saturating_sub(1)).rev() {
        let brake = (end[i + 1] * end[i + 1] + 2.0 * a * steps[i + 1].length_mm).sqrt();
        end[i] = corner_speed(&steps[i], &steps[i + 1], drives).min(brake);
    }
    let mut ticks = Vec::with_capacity(steps.len());
    let (mut time, mut speed, mut next_hold) = (0.0, 0.0_f64, 0);
    for (i, step) in steps.iter().enumerate() {
        if step.length_mm == 0.0 {
            ticks.push(Tick {
                step: i,
                time_s: time,
                duration_s: step.wait_s,
                speed_mm_s: 0.0,
                acceleration_mm_s2: 0.0,
            });
            time += step.wait_s;
            speed = 0.0;
            continue;
        }
        if !step.rapid && drives.holds.get(next_hold).is_some_and(|hold| time >= hold[0]) {
            let rest = drives.holds[next_hold][1];
            ticks.push(Tick { step: i, time_s: time, duration_s: rest, speed_mm_s: 0.0, acceleration_mm_s2: 0.0 });
            time += rest;
            speed = 0.0;
            next_hold += 1;
        }
        let share = drives.override_at.as_ref().map_or(1.0, |at| if step.rapid { 1.0 } else { at(time) });
        let reach = (speed * speed + 2.0 * a * step.length_mm).sqrt();
        let least = (speed * speed - 2.0 * a * step.length_mm).max(0.0).sqrt();
        let leave = end[i].min(step.speed_mm_s * share).min(reach).max(least);
        // On a long step the speed rises to a plateau between its ends.
        let top =
            (f64::midpoint(speed * speed, leave * leave) + a * step.length_mm).sqrt().min(step.speed_mm_s * share);
        let top = top.max(speed).max(leave).max(1e-3);
        let ramps = (2.0 * top * top - speed * speed - leave * leave) / (2.0 * a);
        let plateau = (step.length_mm - ramps).max(0.0) / top;
        let ramping = (2.0 * top - speed - leave) / a;
        let duration = if ramps <= step.length_mm { ramping + plateau } else { 2.0 * step.length_mm / (speed + leave) };
        let acceleration = (leave - speed) / duration.max(1e-9);
        let mean = step.length_mm / duration;
        ticks.push(Tick {
            step: i,
            time_s: time,
            duration_s: duration,
            speed_mm_s: mean,
            acceleration_mm_s2: acceleration,
        });
        time += duration;
        speed = leave;
        let sharp = steps.get(i + 1).is_some_and(|next| next.length_mm > 0.0 && cos_turn(step, next) < 0.866);
        if sharp && drives.settle_s > 0.0 && !step.rapid {
            let rest = drives.settle_s;
            ticks.push(Tick { step: i, time_s: time, duration_s: rest, speed_mm_s: 0.0, acceleration_mm_s2: 0.0 });
            time += rest;
            speed = 0.0;
        }
    }
    ticks
}
