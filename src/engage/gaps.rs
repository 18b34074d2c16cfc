//! The angles of a circle that nothing covers. In: intervals, caps and predicates to take away. Out: the intervals that are left, in order.
//!
//! A direction is stored as its unit vector and its *key*, the diamond angle in [−2, 2] (0 ahead, ±2 behind). The key grows with the angle and
//! costs one division, so it orders directions; angles in rad are worked out only for the result.

use std::f64::consts::TAU;

/// A direction from the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dir {
    /// Cosine and sine of its angle.
    pub at: [f64; 2],
    /// Diamond angle, −2 to 2.
    pub key: f64,
}

/// An interval of directions, counter-clockwise; its keys ascend.
pub type Interval = [Dir; 2];

impl Dir {
    /// The direction of a unit vector.
    #[inline]
    pub fn of(at: [f64; 2]) -> Self {
        Self { at, key: key(at) }
    }
    /// The direction at an angle from −π to π; both ends of the turn are kept apart.
    pub fn at_angle(angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        let key = key([cos, sin]);
        Self { at: [cos, sin], key: if key * angle < 0.0 { -key } else { key } }
    }
    /// Its angle, −π to π, rad.
    pub fn angle(&self) -> f64 {
        let angle = self.at[1].atan2(self.at[0]);
        if angle * self.key < 0.0 { -angle } else { angle }
    }
    /// Component along a vector.
    #[inline]
    pub fn along(&self, [x, y]: [f64; 2]) -> f64 {
        self.at[0] * x + self.at[1] * y
    }
}

/// Keys nearer to each other than this are those of one direction: at most 2e-9 rad apart.
const TOUCH_KEY: f64 = 1e-9;

/// Straight behind, at either end of the turn.
const BEHIND: Interval = [Dir { at: [-1.0, 0.0], key: -2.0 }, Dir { at: [-1.0, 0.0], key: 2.0 }];

/// Diamond angle of a vector, −2 to 2.
#[inline]
fn key([x, y]: [f64; 2]) -> f64 {
    let share = y.abs() / (x.abs() + y.abs());
    let half = if x >= 0.0 { share } else { 2.0 - share };
    if y >= 0.0 { half } else { -half }
}

/// The direction a part of the way between two that are less than half a turn apart.
#[inline]
pub fn between(a: &Dir, b: &Dir, part: f64) -> Dir {
    let [x, y] = [0, 1].map(|axis| a.at[axis] + part * (b.at[axis] - a.at[axis]));
    let by = 1.0 / (x * x + y * y).sqrt();
    Dir::of([x * by, y * by])
}

/// Distance of two directions as points of the unit circle.
#[inline]
pub fn chord(a: &Dir, b: &Dir) -> f64 {
    let (x, y) = (a.at[0] - b.at[0], a.at[1] - b.at[1]);
    (x * x + y * y).sqrt()
}

/// Angle from the first to the second, rad.
pub fn span([from, to]: &Interval) -> f64 {
    let [[x0, y0], [x1, y1]] = [from.at, to.at];
    let turn = (x0 * y1 - y0 * x1).atan2(x0 * x1 + y0 * y1);
    // More than half a turn, or the whole.
    if to.key - from.key > 1.5 && turn < 1.0 { turn + TAU } else { turn }
}

/// Sorted, disjoint intervals within one turn.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Gaps(pub Vec<Interval>);

/// Change of height over a step above which the step is halved, mm, and how often at most: a step of a cell to 1/64 of it.
const ABRUPT_MM: f64 = 0.5;
const HALVED: u32 = 6;

impl Gaps {
    /// The whole circle.
    pub fn whole() -> Self {
        Self(vec![BEHIND])
    }
    /// Nothing left?
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
    /// First and last direction.
    #[inline]
    pub fn hull(&self) -> Option<[&Dir; 2]> {
        Some([&self.0.first()?[0], &self.0.last()?[1]])
    }
    /// Takes away what lies counter-clockwise from `from` to `to`, less than a turn.
    pub fn cover(&mut self, from: Dir, to: Dir) {
        if from.key <= to.key {
            self.cut(from, to);
        } else {
            self.cut(BEHIND[0], to);
            self.cut(from, BEHIND[1]);
        }
    }
    /// Takes away the angles from `from` to `to`, in whichever turn they are given.
    pub fn cover_angles(&mut self, from: f64, to: f64) {
        if to - from >= TAU {
            self.0.clear();
        } else if to - from > 1e-12 {
            let within = |angle: f64| Dir::at_angle(angle - TAU * (angle / TAU).round());
            self.cover(within(from), within(to));
        }
    }
    /// Removes the intervals of `others`.
    pub fn take(&mut self, others: &Self) {
        for [from, to] in &others.0 {
            self.cut(*from, *to);
        }
    }
    /// Adds the intervals of `others`, which may touch those here but not overlap them.
    pub fn join(&mut self, others: Self) {
        self.0.extend(others.0);
        self.0.sort_unstable_by(|a, b| a[0].key.total_cmp(&b[0].key));
        self.0.dedup_by(|next, kept| {
            let touches = next[0].key <= kept[1].key + TOUCH_KEY;
            if touches && next[1].key > kept[1].key {
                kept[1] = next[1];
            }
            touches
        });
    }
    fn cut(&mut self, from: Dir, to: Dir) {
        let mut k = 0;
        while let Some([a, b]) = self.0.get(k).copied() {
            if to.key <= a.key {
                break;
            }
            match (from.key >= b.key, from.key > a.key, to.key < b.key) {
                (true, ..) => k += 1,
                (_, true, true) => {
                    self.0[k] = [a, from];
                    self.0.insert(k + 1, [to, b]);
                    break;
                }
                (_, true, false) => {
                    self.0[k] = [a, from];
                    k += 1;
                }
                (_, false, true) => {
                    self.0[k] = [to, b];
                    break;
                }
                (_, false, false) => {
                    self.0.remove(k);
                }
            }
        }
    }
    /// Quick test: false if no gap reaches the cap where the component along `axis` is at least `least`: neither end of the hull is in the
    /// cap, and the cap is not inside the hull.
    #[inline]
    pub fn may_meet(&self, axis: [f64; 2], least: f64) -> bool {
        let Some([a, b]) = self.hull() else { return false };
        if a.along(axis) >= least || b.along(axis) >= least {
            return true;
        }
        let key = key(axis);
        a.key < key && key < b.key
    }
    /// Covers where the component along a unit vector is at least `least`.
    pub fn cover_cap(&mut self, [x, y]: [f64; 2], least: f64) {
        if least >= 1.0 || !self.may_meet([x, y], least) {
            return;
        }
        if least <= -1.0 {
            self.0.clear();
            return;
        }
        let side = ((1.0 - least) * (1.0 + least)).sqrt();
        let turned = |side: f64| Dir::of([x * least - y * side, y * least + x * side]);
        self.cover(turned(-side), turned(side));
    }
    /// Keeps only angles at which `depth` is positive. `depth` must be a signed distance, because its value is the step along the circle.
    pub fn keep_where(&mut self, radius: f64, shortest: f64, depth: &impl Fn(f64) -> f64) {
        let mut kept = Vec::new();
        for [from, to] in std::mem::take(&mut self.0) {
            walk(depth, [from.angle(), to.angle()], radius, shortest, &mut kept);
        }
        self.0.extend(kept.into_iter().map(|ends| ends.map(Dir::at_angle)));
    }
    /// Keeps only points at which `inside` is positive, evaluated every `step` along the circle; an interval for which `surely` is true is kept
    /// without that. A point is given by cosine and sine of its angle.
    pub fn keep_points(
        &mut self,
        radius: f64,
        step: f64,
        surely: &impl Fn(&Interval) -> bool,
        inside: &impl Fn([f64; 2]) -> f64,
    ) {
        if self.0.iter().all(surely) {
            return;
        }
        for gap in std::mem::take(&mut self.0) {
            let [from, to] = gap;
            let turn = span(&gap);
            let count = (turn * radius / step).ceil().max(1.0);
            let (sin_by, cos_by) = (turn / count).sin_cos();
            let mut here = from;
            let mut last = inside(here.at);
            let mut open = (last > 0.0).then_some(from);
            for _ in 0..count as usize {
                let [cos, sin] = here.at;
                let at = [cos * cos_by - sin * sin_by, sin * cos_by + cos * sin_by];
                let next = inside(at);
                let there = Dir { at, key: 0.0 };
                if (next > 0.0) != (last > 0.0) {
                    let boundary = between(&here, &there, place_of_change(&here, &there, [last, next], inside));
                    match open.take() {
                        Some(from) if from.key < boundary.key => self.0.push([from, boundary]),
                        Some(_) => {}
                        None => open = Some(boundary),
                    }
                }
                (here, last) = (there, next);
            }
            self.0.extend(open.filter(|from| from.key < to.key).map(|from| [from, to]));
        }
    }
}

/// Share of the way from one direction to another at which `inside` changes its sign: linear between the two, halved first while the change is as
/// abrupt as that of a wall.
fn place_of_change(here: &Dir, there: &Dir, [last, next]: [f64; 2], inside: &impl Fn([f64; 2]) -> f64) -> f64 {
    let (mut from, mut to, mut values) = (0.0, 1.0, [last, next]);
    for _ in 0..HALVED {
        if (values[0] - values[1]).abs() <= ABRUPT_MM {
            break;
        }
        let middle = 0.5 * (from + to);
        let value = inside(between(here, there, middle).at);
        if (value > 0.0) == (values[0] > 0.0) {
            (from, values[0]) = (middle, value);
        } else {
            (to, values[1]) = (middle, value);
        }
    }
    let is_abrupt = (values[0] - values[1]).abs() > ABRUPT_MM;
    // What is not known better is in material.
    let within = if values[0] > 0.0 { to } else { from };
    if is_abrupt { within } else { from + (to - from) * values[0] / (values[0] - values[1]) }
}

/// Appends the intervals of `window` in which `depth` is positive.
fn walk(depth: &impl Fn(f64) -> f64, window: [f64; 2], radius: f64, shortest: f64, out: &mut Vec<[f64; 2]>) {
    let (mut at, mut value) = (window[0], depth(window[0]));
    let mut open = (value > 0.0).then_some(at);
    while at < window[1] {
        let next = (at + value.abs().max(shortest) / radius).min(window[1]);
        let next_value = depth(next);
        if (next_value > 0.0) != (value > 0.0) {
            let boundary = root(depth, [at, next], [value, next_value], 1e-7);
            match open.take() {
                Some(from) => out.push([from, boundary]),
                None => open = Some(boundary),
            }
        }
        (at, value) = (next, next_value);
    }
    if let Some(from) = open {
        out.push([from, window[1]]);
    }
}

/// Root of a function that changes sign on an interval: regula falsi (Illinois), to `width`.
pub fn root(f: &impl Fn(f64) -> f64, [mut a, mut b]: [f64; 2], [mut fa, mut fb]: [f64; 2], width: f64) -> f64 {
    let mut side = 0;
    for _ in 0..60 {
        if b - a < width {
            break;
        }
        let x = ((a * fb - b * fa) / (fb - fa)).clamp(a, b);
        let fx = f(x);
        if fx.abs() < 2e-8 {
            return x;
        }
        if (fx > 0.0) == (fb > 0.0) {
            (b, fb) = (x, fx);
            if side == -1 {
                fa *= 0.5;
            }
            side = -1;
        } else {
            (a, fa) = (x, fx);
            if side == 1 {
                fb *= 0.5;
            }
            side = 1;
        }
    }
    0.5 * (a + b)
}

/// Directions whose bins of the diamond angle (64 of a turn, bin 0 ahead) are set, as intervals in order.
pub fn windows(bins: u64) -> Vec<Interval> {
    let mut windows: Vec<Interval> = Vec::new();
    let ordered = bins.rotate_left(32); // from straight behind, counter-clockwise
    let edge = |k: u32| {
        let key = f64::from(k) / 16.0 - 2.0;
        let (x, y) = (1.0 - key.abs(), if key.abs() > 1.0 { 2.0 - key.abs() } else { key.abs() });
        let by = 1.0 / (x * x + y * y).sqrt();
        Dir { at: [x * by, y.copysign(key) * by], key }
    };
    let mut rest = ordered;
    let mut at = 0;
    while rest != 0 {
        let skip = rest.trailing_zeros();
        rest >>= skip;
        let run = rest.trailing_ones();
        windows.push([edge(at + skip), edge(at + skip + run)]);
        rest = if run == 64 { 0 } else { rest >> run };
        at += skip + run;
    }
    windows
}
