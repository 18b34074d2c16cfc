//! Writes a program line by line and keeps what each line makes the machine do, so that the truth about the motion comes
//! from the writing and not from reading the text back. Coordinates are rounded to the 0.001 mm that the text shows.

use std::f64::consts::TAU;

/// A path in mm; arcs lie in the XY plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path {
    /// Start.
    pub from: [f64; 3],
    /// End.
    pub to: [f64; 3],
    /// Centre and signed sweep (counter-clockwise positive, rad) of an arc.
    pub arc: Option<([f64; 2], f64)>,
}

impl Path {
    /// Length, mm.
    pub fn length(&self) -> f64 {
        match self.arc {
            None => (0..3).map(|k| (self.to[k] - self.from[k]).powi(2)).sum::<f64>().sqrt(),
            Some((c, sweep)) => (self.from[0] - c[0]).hypot(self.from[1] - c[1]) * sweep.abs(),
        }
    }
    /// Point and unit direction at `s` mm from the start.
    pub fn at(&self, s: f64) -> ([f64; 3], [f64; 3]) {
        let length = self.length().max(1e-12);
        let t = (s / length).clamp(0.0, 1.0);
        match self.arc {
            None => {
                let d: [f64; 3] = std::array::from_fn(|k| self.to[k] - self.from[k]);
                (std::array::from_fn(|k| self.from[k] + t * d[k]), d.map(|x| x / length))
            }
            Some((c, sweep)) => {
                let (u, v) = (self.from[0] - c[0], self.from[1] - c[1]);
                let (sin, cos) = (t * sweep).sin_cos();
                let (x, y) = (u * cos - v * sin, u * sin + v * cos);
                let turn = sweep.signum() / u.hypot(v).max(1e-12);
                ([c[0] + x, c[1] + y, self.from[2]], [-y * turn, x * turn, 0.0])
            }
        }
    }
    /// Radius of an arc, infinite for a line.
    pub fn radius(&self) -> f64 {
        self.arc.map_or(f64::INFINITY, |(c, _)| (self.from[0] - c[0]).hypot(self.from[1] - c[1]))
    }
}

/// What a line makes the machine do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action {
    /// Move at a feed (mm/s), or as fast as it can.
    Move {
        /// Where.
        path: Path,
        /// Commanded feed; `None` is a rapid.
        feed_mm_s: Option<f64>,
    },
    /// Wait.
    Dwell(f64),
    /// Another spindle speed, rev/s.
    Spindle(f64),
    /// Tool change.
    Tool,
}

/// One line that does something.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// 1-based line.
    pub line: usize,
    /// What it does.
    pub action: Action,
}

/// The program while it is written.
#[derive(Debug, Default)]
pub struct Writer {
    /// Text so far.
    pub text: String,
    /// What it does so far.
    pub steps: Vec<Step>,
    lines: usize,
    position: [f64; 3],
    feed_mm_min: f64,
    rpm: f64,
}

fn rounded(x: f64) -> f64 {
    let r = (x * 1e3).round() / 1e3;
    if r == 0.0 { 0.0 } else { r }
}

impl Writer {
    /// At a start position.
    pub fn new(position: [f64; 3]) -> Self {
        Self { position, ..Self::default() }
    }

    /// A line that moves nothing.
    pub fn say(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
        self.lines += 1;
    }

    fn act(&mut self, line: &str, action: Action) {
        self.say(line);
        self.steps.push(Step { line: self.lines, action });
    }

    /// Tool change.
    pub fn tool(&mut self) {
        self.act("T1 M6", Action::Tool);
    }

    /// Spindle speed, with the dwell that lets it settle.
    pub fn spindle(&mut self, rpm: f64, dwell_s: f64) {
        if rpm != self.rpm {
            self.rpm = rpm;
            self.act(&format!("S{rpm} M3"), Action::Spindle(rpm / 60.0));
        }
        self.dwell(dwell_s);
    }

    /// Dwell.
    pub fn dwell(&mut self, seconds: f64) {
        self.act(&format!("G4 P{seconds}"), Action::Dwell(seconds));
    }

    /// Present spindle speed, rev/min.
    pub fn rpm(&self) -> f64 {
        self.rpm
    }

    /// Where the tool is.
    pub fn position(&self) -> [f64; 3] {
        self.position
    }

    fn straight(&mut self, to: [f64; 3], feed_mm_min: Option<f64>) {
        let to = to.map(rounded);
        let mut line = String::from(if feed_mm_min.is_some() { "G1" } else { "G0" });
        for (k, name) in ["X", "Y", "Z"].iter().enumerate() {
            if to[k] != self.position[k] {
                line.push_str(&format!(" {name}{}", to[k]));
            }
        }
        if line.len() == 2 {
            return;
        }
        self.feed_word(&mut line, feed_mm_min);
        let path = Path { from: self.position, to, arc: None };
        self.act(&line, Action::Move { path, feed_mm_s: feed_mm_min.map(|_| self.feed_mm_min / 60.0) });
        self.position = to;
    }

    fn feed_word(&mut self, line: &mut String, feed_mm_min: Option<f64>) {
        let Some(feed) = feed_mm_min.map(f64::round) else { return };
        if feed != self.feed_mm_min {
            line.push_str(&format!(" F{feed}"));
            self.feed_mm_min = feed;
        }
    }

    /// Rapid.
    pub fn rapid(&mut self, to: [f64; 3]) {
        self.straight(to, None);
    }

    /// Straight cut.
    pub fn feed(&mut self, to: [f64; 3], feed_mm_min: f64) {
        self.straight(to, Some(feed_mm_min));
    }

    /// Arc about a centre to a point at (nearly) the same radius.
    pub fn arc(&mut self, to: [f64; 2], centre: [f64; 2], counter_clockwise: bool, feed_mm_min: f64) {
        let (to, centre) = (to.map(rounded), centre.map(rounded));
        let from = self.position;
        let start = (from[1] - centre[1]).atan2(from[0] - centre[0]);
        let end = (to[1] - centre[1]).atan2(to[0] - centre[0]);
        let turn = (end - start).rem_euclid(TAU);
        let sweep = if counter_clockwise { turn } else { turn - TAU };
        let (word, i, j) =
            (if counter_clockwise { "G3" } else { "G2" }, rounded(centre[0] - from[0]), rounded(centre[1] - from[1]));
        let mut line = format!("{word} X{} Y{} I{i} J{j}", to[0], to[1]);
        self.feed_word(&mut line, Some(feed_mm_min));
        let to = [to[0], to[1], from[2]];
        let path = Path { from, to, arc: Some((centre, sweep)) };
        self.act(&line, Action::Move { path, feed_mm_s: Some(self.feed_mm_min / 60.0) });
        self.position = to;
    }
}
