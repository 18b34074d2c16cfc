//! A program as the optimiser wrote it, back into the steps that the machine will make.
//!
//! In: the text, and the steps it began as. Out: steps with the feeds of the text; each belongs to the pass of the original
//! step at the same length of path. Knows the words that the programs of `programs.rs` use, and no others.

use std::f64::consts::TAU;

use super::machine::Step;
use super::physics::Tool;
use super::programs::{RUN_UP_S, TOOL_CHANGE_S};

/// Longest step in a cut and in air, mm, and speed of rapids, mm/s: those of `programs.rs`.
const STEP: f64 = 0.3;
const AIR_STEP: f64 = 4.0;
const RAPID_MM_S: f64 = 150.0;

/// Words of a line without its comments: letter and number.
fn words(line: &str) -> Vec<(char, f64)> {
    let mut plain = String::new();
    let mut depth = 0;
    for c in line.chars() {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            ';' if depth == 0 => break,
            _ if depth == 0 && !c.is_whitespace() => plain.push(c),
            _ => {}
        }
    }
    let mut found = Vec::new();
    let mut rest = plain.as_str();
    while let Some(letter) = rest.chars().next() {
        let end = rest[1..].find(|c: char| c.is_ascii_alphabetic()).map_or(rest.len(), |i| i + 1);
        found.extend(rest[1..end].parse().ok().map(|value| (letter, value)));
        rest = &rest[end..];
    }
    found
}

/// Where the machine stands in the text.
struct Reader {
    steps: Vec<Step>,
    at: [f64; 3],
    speed_mm_s: f64,
    rpm: f64,
    tool: usize,
    line: usize,
}

impl Reader {
    fn push(&mut self, places: &[[f64; 3]], rapid: bool) {
        for to in places {
            self.steps.push(Step {
                from: self.at,
                to: *to,
                length_mm: (0..3).map(|k| (to[k] - self.at[k]).powi(2)).sum::<f64>().sqrt(),
                speed_mm_s: if rapid { RAPID_MM_S } else { self.speed_mm_s },
                rapid,
                wait_s: 0.0,
                rpm: self.rpm,
                tool: self.tool,
                line: self.line,
                pass: 0,
            });
            self.at = *to;
        }
    }

    fn straight(&mut self, to: [f64; 3], rapid: bool) {
        let from = self.at;
        let length = (0..3).map(|k| (to[k] - from[k]).powi(2)).sum::<f64>().sqrt();
        let pieces = (length / if rapid { AIR_STEP } else { STEP }).ceil() as usize;
        let place = |i: usize| [0, 1, 2].map(|k| from[k] + (to[k] - from[k]) * i as f64 / pieces as f64);
        self.push(&(1..=pieces).map(place).collect::<Vec<_>>(), rapid);
    }

    fn arc(&mut self, to: [f64; 3], centre: [f64; 2], clockwise: bool) {
        let angle = |p: [f64; 3]| (p[1] - centre[1]).atan2(p[0] - centre[0]);
        let radius = (to[0] - centre[0]).hypot(to[1] - centre[1]);
        let start = angle(self.at);
        let turn = if clockwise { -(start - angle(to)).rem_euclid(TAU) } else { (angle(to) - start).rem_euclid(TAU) };
        let pieces = (turn.abs() * radius / STEP).ceil().max(1.0) as usize;
        let place = |n: usize| {
            let at = start + turn * n as f64 / pieces as f64;
            [centre[0] + radius * at.cos(), centre[1] + radius * at.sin(), self.at[2]]
        };
        let mut places: Vec<_> = (1..pieces).map(place).collect();
        places.push(to);
        self.push(&places, false);
    }

    fn wait(&mut self, seconds: f64) {
        self.push(&[self.at], true);
        if let Some(step) = self.steps.last_mut() {
            step.wait_s = seconds;
        }
    }
}

/// Reads a program.
pub fn steps(text: &str, tools: &[Tool], original: &[Step]) -> Vec<Step> {
    let mut r = Reader { steps: Vec::new(), at: [0.0, 0.0, 50.0], speed_mm_s: 0.0, rpm: 0.0, tool: 0, line: 0 };
    let (mut mode, mut unit, mut number) = (0.0, 1.0, 0.0);
    for line in text.lines() {
        r.line += 1;
        let words = words(line);
        let value = |letter: char| words.iter().find(|word| word.0 == letter).map(|word| word.1);
        let has = |letter: char, v: f64| words.contains(&(letter, v));
        for (_, g) in words.iter().filter(|word| word.0 == 'G') {
            match *g {
                20.0 => unit = 25.4,
                0.0..=3.0 => mode = *g,
                _ => {}
            }
        }
        number = value('T').unwrap_or(number);
        if let Some(feed) = value('F') {
            r.speed_mm_s = feed * unit / 60.0;
        }
        if has('M', 6.0) {
            r.rpm = 0.0;
            r.tool = tools.iter().position(|tool| tool.number as f64 == number).unwrap_or(0);
            r.wait(TOOL_CHANGE_S);
        }
        if let Some(rpm) = value('S') {
            r.rpm = rpm;
            r.wait(RUN_UP_S);
        }
        let to = ['X', 'Y', 'Z'].map(value);
        if to.iter().all(Option::is_none) {
            continue;
        }
        let to = [0, 1, 2].map(|k| to[k].map_or(r.at[k], |v| v * unit));
        if mode < 2.0 {
            r.straight(to, mode == 0.0);
        } else {
            let off = ['I', 'J'].map(|letter| value(letter).unwrap_or(0.0) * unit);
            r.arc(to, [r.at[0] + off[0], r.at[1] + off[1]], mode == 2.0);
        }
    }
    as_passes_of(&mut r.steps, original);
    r.steps
}

/// Gives each step the pass of the original step in which its middle lies.
fn as_passes_of(steps: &mut [Step], original: &[Step]) {
    let (mut of, mut end, mut gone) = (0, original.first().map_or(0.0, |step| step.length_mm), 0.0);
    for step in steps {
        while of + 1 < original.len() && end < gone + step.length_mm / 2.0 {
            of += 1;
            end += original[of].length_mm;
        }
        step.pass = original[of].pass;
        gone += step.length_mm;
    }
}

/// Farthest apart that two paths are, over their length and at their ends, mm: no feed may change them.
pub fn apart_mm(a: &[Step], b: &[Step]) -> f64 {
    let length = |steps: &[Step]| steps.iter().map(|step| step.length_mm).sum::<f64>();
    let end = |steps: &[Step]| steps.last().map_or([0.0; 3], |step| step.to);
    let ends = (0..3).map(|k| (end(a)[k] - end(b)[k]).abs()).fold(0.0, f64::max);
    ends.max((length(a) - length(b)).abs())
}
