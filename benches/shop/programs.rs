//! Everyday programs: facing zigzag, shoulders, contours, slots, a pocket. Each is written as NC text and as the steps
//! that the machine will make, from the same calls, so that the two cannot differ.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use super::dice::Dice;
use super::machine::Step;
use super::physics::{Coefficients, Tool};

/// Longest step in a cut and in air, mm.
const STEP: f64 = 0.3;
const AIR_STEP: f64 = 4.0;
/// Time from one spindle speed to another, and of a tool change, s.
pub const RUN_UP_S: f64 = 1.5;
pub const TOOL_CHANGE_S: f64 = 6.0;

/// What the shop has on the machine: program, tools and stock as the shop believes they are.
pub struct Job {
    pub text: String,
    pub steps: Vec<Step>,
    pub tools: Vec<Tool>,
    /// Corners of the box of stock, mm.
    pub low: [f64; 3],
    pub high: [f64; 3],
    /// What the material truly asks for.
    pub truth: Coefficients,
}

/// Which operations a program must hold so that a cause can be seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// Any mixture.
    Any,
    /// Two tools with a change.
    TwoTools,
    /// Many passes with entries.
    Entries,
    /// Four spindle speeds.
    Speeds,
    /// Short moves with many corners.
    Corners,
    /// Light cuts beside full ones.
    Light,
}

/// Writes text and steps at once.
struct Writer {
    text: String,
    lines: usize,
    inch: bool,
    steps: Vec<Step>,
    at: [f64; 3],
    feed: f64,
    rpm: f64,
    tool: usize,
    pass: usize,
    rapid_mm_s: f64,
}

impl Writer {
    fn line(&mut self, text: &str) {
        self.text.push_str(text);
        self.text.push('\n');
        self.lines += 1;
    }

    /// A length in the unit of the program.
    fn number(&self, mm: f64) -> String {
        let text = if self.inch { format!("{:.5}", mm / 25.4) } else { format!("{mm:.3}") };
        let text = text.trim_end_matches('0').trim_end_matches('.').to_owned();
        if text == "-0" { "0".to_owned() } else { text }
    }

    /// Words of the axes that change.
    fn words(&self, to: [f64; 3]) -> String {
        let mut words = String::new();
        for (k, name) in ["X", "Y", "Z"].iter().enumerate() {
            if self.number(to[k]) != self.number(self.at[k]) {
                let _ = write!(words, " {name}{}", self.number(to[k]));
            }
        }
        words
    }

    fn feed_word(&mut self, mm_min: f64) -> String {
        let rounded = if self.inch { (mm_min / 2.54).round() * 2.54 } else { mm_min.round() };
        if (rounded - self.feed).abs() < 1e-9 {
            return String::new();
        }
        self.feed = rounded;
        format!(" F{}", if self.inch { format!("{:.1}", rounded / 25.4) } else { format!("{rounded:.0}") })
    }

    fn push(&mut self, to: [f64; 3], rapid: bool) {
        let length = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (b[k] - a[k]).powi(2)).sum::<f64>().sqrt();
        let total = length(self.at, to);
        let pieces = (total / if rapid { AIR_STEP } else { STEP }).ceil().max(1.0) as usize;
        let from = self.at;
        let place = |i: usize| [0, 1, 2].map(|k| from[k] + (to[k] - from[k]) * i as f64 / pieces as f64);
        for i in 0..pieces {
            let (from, to) = (place(i), place(i + 1));
            let speed = if rapid { self.rapid_mm_s } else { self.feed / 60.0 };
            self.steps.push(Step {
                from,
                to,
                length_mm: length(from, to),
                speed_mm_s: speed,
                rapid,
                wait_s: 0.0,
                rpm: self.rpm,
                tool: self.tool,
                line: self.lines,
                pass: self.pass,
            });
        }
        self.at = to;
    }

    fn wait(&mut self, seconds: f64) {
        self.steps.push(Step {
            from: self.at,
            to: self.at,
            length_mm: 0.0,
            speed_mm_s: 0.0,
            rapid: true,
            wait_s: seconds,
            rpm: self.rpm,
            tool: self.tool,
            line: self.lines,
            pass: self.pass,
        });
    }

    fn rapid(&mut self, to: [f64; 3]) {
        let words = self.words(to);
        if !words.is_empty() {
            self.line(&format!("G0{words}"));
            self.push(to, true);
        }
    }

    fn cut(&mut self, to: [f64; 3], feed: f64) {
        let words = self.words(to);
        if !words.is_empty() {
            let feed = self.feed_word(feed);
            self.line(&format!("G1{words}{feed}"));
            self.push(to, false);
        }
    }

    /// An arc in the plane, in pieces whose chords leave it by less than a micrometre.
    fn arc(&mut self, to: [f64; 2], centre: [f64; 2], clockwise: bool, feed: f64) {
        let target = [to[0], to[1], self.at[2]];
        let feed = self.feed_word(feed);
        let i = self.number(centre[0] - self.at[0]);
        let j = self.number(centre[1] - self.at[1]);
        let (x, y) = (self.number(to[0]), self.number(to[1]));
        self.line(&format!("{} X{x} Y{y} I{i} J{j}{feed}", if clockwise { "G2" } else { "G3" }));
        let angle = |p: [f64; 2]| (p[1] - centre[1]).atan2(p[0] - centre[0]);
        let radius = (to[0] - centre[0]).hypot(to[1] - centre[1]);
        let (start, end) = (angle([self.at[0], self.at[1]]), angle(to));
        let turn = if clockwise { -(start - end).rem_euclid(TAU) } else { (end - start).rem_euclid(TAU) };
        let pieces = (turn.abs() * radius / STEP).ceil().max(1.0) as usize;
        for n in 1..pieces {
            let at = start + turn * n as f64 / pieces as f64;
            self.push([centre[0] + radius * at.cos(), centre[1] + radius * at.sin(), self.at[2]], false);
        }
        self.push(target, false);
    }

    fn tool(&mut self, index: usize, number: usize, rpm: f64) {
        self.rapid([self.at[0], self.at[1], 50.0]);
        self.rpm = 0.0;
        self.line(&format!("T{number} M6"));
        self.tool = index;
        self.wait(TOOL_CHANGE_S);
        self.speed(rpm);
    }

    fn speed(&mut self, rpm: f64) {
        if rpm != self.rpm {
            self.line(&format!("S{rpm:.0} M3"));
            self.rpm = rpm;
            self.wait(RUN_UP_S);
        }
    }
}

/// Cutting data of one operation.
#[derive(Clone, Copy)]
struct Data {
    radius: f64,
    /// mm/min at the common feed per tooth.
    feed: f64,
    depth: f64,
    /// Retract height.
    safe: f64,
}

/// The top of the stock in rows along x, to and fro.
fn face(w: &mut Writer, dice: &mut Dice, low: [f64; 3], high: [f64; 3], d: Data) {
    let step = d.radius * dice.between(0.9, 1.5);
    let over = d.radius + 2.0;
    let mut y = low[1] - d.radius + step;
    let mut left = true;
    w.rapid([low[0] - over, y, d.safe]);
    w.cut([low[0] - over, y, 0.0], d.feed * 2.0);
    while y < high[1] + d.radius - 0.3 * step {
        w.pass += 1;
        let x = if left { high[0] + over } else { low[0] - over };
        w.cut([x, y, 0.0], d.feed);
        left = !left;
        y += step;
        w.cut([x, y, 0.0], d.feed);
    }
    w.rapid([w.at[0], w.at[1], d.safe]);
}

/// Along the front edge of the part, each pass a little deeper into it; to and fro, so that one is up and the next climb.
fn shoulder(w: &mut Writer, dice: &mut Dice, low: [f64; 3], high: [f64; 3], d: Data, width: f64, deep: f64) {
    let over = d.radius + 2.0;
    let mut z: f64 = 0.0;
    while z > -deep + 1e-6 {
        z = (z - d.depth * dice.pick(&[0.5, 1.0, 1.5])).max(-deep);
        let mut edge = low[1];
        let mut left = true;
        w.rapid([low[0] - over, edge - over, d.safe]);
        while edge < width - 1e-6 {
            edge = (edge + d.radius * dice.pick(&[0.15, 0.3, 0.5, 0.8])).min(width);
            w.pass += 1;
            let y = edge - d.radius;
            w.rapid([if left { low[0] - over } else { high[0] + over }, y, w.at[2].max(z)]);
            w.cut([w.at[0], y, z], d.feed * 2.0);
            let feed = d.feed * dice.pick(&[0.6, 0.8, 1.0, 1.3]);
            w.cut([if left { high[0] + over } else { low[0] - over }, y, z], feed);
            left = !left;
        }
        w.rapid([w.at[0], w.at[1], d.safe]);
    }
}

/// Around the part from outside, up first and climb last.
fn contour(w: &mut Writer, dice: &mut Dice, part: [f64; 2], allowance: f64, d: Data, deep: f64) {
    let mut z: f64 = 0.0;
    while z > -deep + 1e-6 {
        z = (z - d.depth * dice.pick(&[0.8, 1.2, 1.6])).max(-deep);
        let mut left: f64 = allowance;
        while left > 1e-6 {
            left = (left - dice.pick(&[0.3, 0.6, 1.0]) * d.radius * 0.6).max(0.0);
            if left < 0.25 {
                left = 0.0;
            }
            let clockwise = dice.chance(0.5);
            let feed = d.feed * dice.pick(&[0.7, 1.0, 1.3]);
            ring_outside(w, part, d.radius + left, z, clockwise, feed, d);
        }
    }
    w.rapid([w.at[0], w.at[1], d.safe]);
}

/// Once around the part at a distance of the tool's centre from it, with round corners.
fn ring_outside(w: &mut Writer, part: [f64; 2], off: f64, z: f64, clockwise: bool, feed: f64, d: Data) {
    let (x, y) = (part[0], part[1]);
    let start = [x / 2.0, -off];
    w.rapid([w.at[0], w.at[1], d.safe]);
    w.rapid([start[0], start[1] - 2.0 * d.radius - 4.0, d.safe]);
    w.cut([w.at[0], w.at[1], z], feed * 2.0);
    w.pass += 1;
    w.cut([start[0], start[1], z], feed);
    // Corner centres counter-clockwise from the front right, each with the direction in which it is reached.
    let corners = [([x, 0.0], 0), ([x, y], 1), ([0.0, y], 2), ([0.0, 0.0], 3)];
    let side = |k: usize| [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]][k % 4];
    let point = |c: [f64; 2], k: usize| [c[0] + off * side(k)[0], c[1] + off * side(k)[1]];
    let order: Vec<_> = if clockwise { corners.iter().rev().collect() } else { corners.iter().collect() };
    for (centre, k) in order {
        let (first, last) = if clockwise { (k + 1, *k) } else { (*k, k + 1) };
        let (a, b) = (point(*centre, first), point(*centre, last));
        w.pass += 1;
        w.cut([a[0], a[1], z], feed);
        w.arc(b, *centre, clockwise, feed);
    }
    w.pass += 1;
    w.cut([start[0], start[1], z], feed);
    w.cut([start[0], start[1] - 2.0 * d.radius - 4.0, z], feed * 2.0);
}

/// Full slots along y from behind the part, in levels.
fn slots(w: &mut Writer, dice: &mut Dice, low: [f64; 3], high: [f64; 3], d: Data, from_x: f64, deep: f64) {
    let mut x = from_x + d.radius;
    let over = d.radius + 2.0;
    while x < high[0] - 2.0 * d.radius {
        let mut z: f64 = 0.0;
        let mut back = true;
        w.rapid([x, high[1] + over, d.safe]);
        while z > -deep + 1e-6 {
            z = (z - d.depth * dice.pick(&[0.5, 0.8, 1.1])).max(-deep);
            w.cut([x, w.at[1], z], d.feed * 2.0);
            w.pass += 1;
            let feed = d.feed * dice.pick(&[0.5, 0.7, 0.9]);
            w.cut([x, if back { low[1] - over } else { high[1] + over }, z], feed);
            back = !back;
        }
        w.rapid([w.at[0], w.at[1], d.safe]);
        x += 2.0 * d.radius * dice.between(1.15, 1.5);
    }
}

/// Slope of a ramp, a little over two degrees.
const RAMP_SLOPE: f64 = 0.04;

/// A pocket: a ramp to and fro, then rings outwards with sharp corners.
fn pocket(w: &mut Writer, dice: &mut Dice, low: [f64; 2], high: [f64; 2], d: Data, levels: usize) {
    let middle = [f64::midpoint(low[0], high[0]), f64::midpoint(low[1], high[1])];
    let half = [(high[0] - low[0]) / 2.0 - d.radius, (high[1] - low[1]) / 2.0 - d.radius];
    let bar = (half[0] - half[1]).max(0.0);
    let step = d.radius * dice.between(0.7, 1.2);
    let mut z: f64 = 0.0;
    w.rapid([middle[0] - bar, middle[1], d.safe]);
    w.rapid([middle[0] - bar, middle[1], 1.0]);
    w.cut([w.at[0], w.at[1], 0.2], d.feed);
    for _ in 0..levels {
        let floor = z - d.depth;
        // Legs of one slope: a last one that is nearly level would rub with its end face and make no chip.
        let down = w.at[2] - floor;
        let pairs = (down / (2.0 * RAMP_SLOPE * d.radius.max(2.0 * bar))).ceil();
        let drop = down / (2.0 * pairs);
        w.pass += 1;
        for _ in 0..pairs as usize {
            let next = w.at[2] - drop;
            w.cut([middle[0] - bar + drop / RAMP_SLOPE, middle[1], next], d.feed * 0.5);
            w.cut([middle[0] - bar, middle[1], next - drop], d.feed * 0.5);
        }
        z = floor;
        let mut grown = 0.0;
        let widest = half[1].min(half[0]);
        let clockwise = dice.chance(0.3);
        while grown < widest - 1e-6 {
            grown = (grown + step).min(widest);
            let (a, b) = ((bar + grown).min(half[0]), grown);
            let feed = d.feed * dice.pick(&[0.7, 0.9, 1.1]);
            let mut corners = [[a, -b], [a, b], [-a, b], [-a, -b]].map(|c| [middle[0] + c[0], middle[1] + c[1]]);
            if clockwise {
                corners.reverse();
            }
            for corner in corners.iter().chain([&corners[0]]) {
                w.pass += 1;
                w.cut([corner[0], corner[1], z], feed);
            }
        }
        w.rapid([w.at[0], w.at[1], z + 1.0]);
        w.rapid([middle[0] - bar, middle[1], z + 1.0]);
        w.cut([w.at[0], w.at[1], z + 0.1], d.feed);
    }
    w.rapid([w.at[0], w.at[1], d.safe]);
}

/// Short moves to and fro in a groove's width: many corners (a comb along the back edge).
fn comb(w: &mut Writer, dice: &mut Dice, high: [f64; 3], d: Data, deep: f64) {
    let mut x = 4.0;
    let z = -deep;
    w.rapid([x, high[1] + d.radius + 2.0, d.safe]);
    w.cut([x, w.at[1], z], d.feed * 2.0);
    while x < high[0] - d.radius {
        w.pass += 1;
        let feed = d.feed * dice.pick(&[0.9, 1.2, 1.5]);
        let reach = high[1] + d.radius - dice.between(4.0, 7.0);
        w.cut([x, reach, z], feed);
        x += d.radius * dice.between(0.25, 0.45);
        w.cut([x, reach, z], feed);
        w.cut([x, high[1] + d.radius - 0.5, z], feed);
        x += d.radius * 0.2;
        w.cut([x, high[1] + d.radius - 0.5, z], feed);
    }
    w.rapid([w.at[0], w.at[1], d.safe]);
}

/// Longest program, s: a larger part is made smaller until it is done in this time.
const LONGEST_S: f64 = 560.0;

/// A program of three to ten minutes for a seed. The second one is another program for the same machine.
pub fn everyday(seed: u64, needs: Needs, second: bool) -> Job {
    let mut size = 1.0;
    loop {
        let job = written(seed, needs, second, size);
        let time: f64 = job.steps.iter().map(|step| step.wait_s + step.length_mm / step.speed_mm_s.max(1e-9)).sum();
        if time < LONGEST_S || size < 0.55 {
            return job;
        }
        size *= 0.85;
    }
}

/// A program for a part of a size, 1 for the usual one.
fn written(seed: u64, needs: Needs, second: bool, size: f64) -> Job {
    // Machine, material and tools are those of the seed; the second program differs in all else.
    let mut shop = Dice::new(seed, "shop");
    let steel = shop.chance(0.3);
    let truth = if steel {
        let k_tc = shop.between(1700.0, 2300.0);
        let k_te = shop.between(25.0, 45.0);
        Coefficients { k_tc, k_te, k_rc: 0.4 * k_tc, k_re: 1.2 * k_te }
    } else {
        let k_tc = shop.between(620.0, 950.0);
        let k_te = shop.between(11.0, 22.0);
        Coefficients { k_tc, k_te, k_rc: 0.35 * k_tc, k_re: 0.9 * k_te }
    };
    let count = if needs == Needs::TwoTools || shop.chance(0.4) { 2 } else { 1 };
    let diameters = [shop.pick(&[12.0, 16.0]), shop.pick(&[6.0, 8.0, 10.0])];
    let tools: Vec<Tool> = (0..count)
        .map(|i| Tool {
            number: i + 1,
            diameter_mm: if count == 2 { diameters[i] } else { shop.pick(&[8.0, 10.0, 12.0]) },
            flutes: shop.pick(&[2, 3, 4]),
            helix_deg: shop.pick(&[30.0, 38.0, 45.0]),
        })
        .collect();
    let inch = shop.chance(0.15);
    let mut dice = Dice::new(seed, if second { "second program" } else { "program" });
    let part = [(size * dice.between(75.0, 110.0)).round(), (size * dice.between(55.0, 75.0)).round()];
    let (allowance, top) = (dice.between(2.0, 4.5), dice.between(0.8, 2.0));
    let round = |v: f64| (v * 10.0).round() / 10.0;
    let (allowance, top) = (round(allowance), round(top));
    let low = [-allowance, -allowance, -30.0];
    let high = [part[0] + allowance, part[1] + allowance, top];
    let mut w = Writer {
        text: String::new(),
        lines: 0,
        inch,
        steps: Vec::new(),
        at: [0.0, 0.0, 50.0],
        feed: 0.0,
        rpm: 0.0,
        tool: 0,
        pass: 0,
        rapid_mm_s: 150.0,
    };
    w.line("%");
    w.line(&format!("(JOB {seed})"));
    w.line(&format!("{} G17 G40 G49 G80 G90 G94 G54", if inch { "G20" } else { "G21" }));
    let cutting_speed = if steel { dice.between(130.0, 200.0) } else { dice.between(220.0, 380.0) };
    let levels: &[f64] = if needs == Needs::Speeds { &[0.45, 0.65, 0.85, 1.1, 1.4] } else { &[0.7, 0.85, 1.0, 1.2] };
    let mut turn = dice.between(0.0, 10.0) as usize;
    let mut speed_of = move |tool: &Tool| {
        turn += 1;
        let rpm = cutting_speed * 1000.0 / (std::f64::consts::PI * tool.diameter_mm) * levels[turn % levels.len()];
        (rpm / 50.0).round() * 50.0
    };
    let per_tooth = |tool: &Tool, share: f64| share * tool.diameter_mm * if steel { 0.005 } else { 0.008 };
    let data = |tool: &Tool, rpm: f64, share: f64, depth: f64| Data {
        radius: tool.diameter_mm / 2.0,
        feed: per_tooth(tool, share) * tool.flutes as f64 * rpm,
        depth: depth * tool.diameter_mm * if steel { 0.6 } else { 1.0 },
        safe: top + 5.0,
    };
    // Operations of the first tool, then of the last.
    let first = tools[0];
    let rpm = speed_of(&first);
    w.tool(0, 1, rpm);
    w.rapid([low[0] - 10.0, low[1] - 10.0, 50.0]);
    w.line("(FACE)");
    face(&mut w, &mut dice, low, high, data(&first, rpm, dice_share(seed), 0.1));
    let deep = if steel { 5.0 } else { 9.0 };
    w.line("(CONTOUR)");
    let rpm = speed_of(&first);
    w.speed(rpm);
    let light = if needs == Needs::Light { 0.25 } else { 0.4 };
    contour(&mut w, &mut dice, part, allowance, data(&first, rpm, 1.0, light), deep);
    let last = tools[tools.len() - 1];
    if tools.len() == 2 {
        let rpm = speed_of(&last);
        w.tool(1, 2, rpm);
        w.rapid([low[0] - 10.0, low[1] - 10.0, 50.0]);
    }
    let mut order: Vec<usize> = vec![0, 1, 2];
    if dice.chance(0.5) {
        order.swap(0, 2);
    }
    if needs == Needs::Corners {
        order.insert(0, 3);
    }
    if needs == Needs::Entries {
        order.insert(1, 3);
    }
    let strip = (part[1] * 0.22).round();
    for operation in order {
        let rpm = speed_of(&last);
        w.speed(rpm);
        match operation {
            0 => {
                w.line("(SHOULDER)");
                let depth = if needs == Needs::Light { 0.25 } else { 0.4 };
                let low = [0.0, 0.0, low[2]];
                shoulder(&mut w, &mut dice, low, [part[0], part[1], top], data(&last, rpm, 1.0, depth), strip, deep);
            }
            1 => {
                w.line("(POCKET)");
                let to = [part[0] * 0.52, part[1] - 8.0];
                let levels = 2;
                pocket(&mut w, &mut dice, [8.0, strip + 6.0], to, data(&last, rpm, 1.0, 0.3), levels);
            }
            2 => {
                w.line("(SLOTS)");
                slots(&mut w, &mut dice, low, high, data(&last, rpm, 1.0, 0.4), part[0] * 0.56, deep * 0.7);
            }
            _ => {
                w.line("(COMB)");
                for level in 1..=3 {
                    let depth = f64::from(level) * 0.2 * last.diameter_mm;
                    comb(&mut w, &mut dice, [part[0], part[1], top], data(&last, rpm, 1.0, 0.2), depth);
                }
            }
        }
    }
    w.rapid([w.at[0], w.at[1], 50.0]);
    w.rpm = 0.0;
    w.line("M5");
    w.line("M30");
    w.line("%");
    Job { text: w.text, steps: w.steps, tools, low, high, truth }
}

/// Feed of the facing cut over the common one.
fn dice_share(seed: u64) -> f64 {
    Dice::new(seed, "face").pick(&[0.8, 1.0, 1.2])
}
