//! Random programs for the engagement tests. In: a seed. Out: 30 to 80 moves in a box of stock: level cuts, ramps, plunges,
//! arcs, helices, passes beside earlier ones, chains of short blocks; one or two cutters.
#![allow(dead_code)] // each test file uses its own part of it

use super::oracle::Mill;
use super::ways::{Sweep, Way};
use super::{block, job, state};
use feedwright::engage::{EngagementMap, Options, engage};
use feedwright::ids::BlockId;
use feedwright::nc::{Move, MoveKind, Toolpath};
use feedwright::path::{Arc, Curve, Plane};
use std::f64::consts::{FRAC_PI_4, TAU};

pub const MIN: [f64; 3] = [0.0, 0.0, -12.0];
pub const MAX: [f64; 3] = [40.0, 30.0, 0.0];
pub const MILLS: [Mill; 7] = [
    Mill::Flat(3.0),
    Mill::Flat(5.0),
    Mill::Ball(3.0),
    Mill::Ball(5.0),
    Mill::Bull(5.0, 2.0),
    Mill::Taper(3.0, 1.0, 0.17),
    Mill::Chamfer(4.0, 0.5, FRAC_PI_4),
];
const FLOORS: [f64; 5] = [-0.7, -1.5, -1.5, -2.5, -4.0];

/// A move of a random program: where, with which of two tools (1, 2), and what the generator meant by it.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    pub way: Way,
    pub tool: u32,
    pub rapid: bool,
    pub what: &'static str,
}

/// A random program.
#[derive(Debug, Clone)]
pub struct Program {
    pub mills: [Mill; 2],
    pub steps: Vec<Step>,
}

/// A small generator of numbers.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33
    }
    fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }
    fn within(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * (self.next() as f64 / (1u64 << 31) as f64)
    }
    fn of<T: Copy>(&mut self, values: &[T]) -> T {
        values[self.below(values.len())]
    }
    fn sign(&mut self) -> f64 {
        self.of(&[1.0, -1.0])
    }
}

/// Builds a program.
struct Maker {
    dice: Dice,
    program: Program,
    at: [f64; 3],
    tool: u32,
}

impl Maker {
    fn push(&mut self, way: Way, rapid: bool, what: &'static str) {
        self.at = way.point(1.0);
        self.program.steps.push(Step { way, tool: self.tool, rapid, what });
    }
    fn line(&mut self, to: [f64; 3], what: &'static str) {
        self.push(Way::Line(self.at, to), false, what);
    }
    fn rapid(&mut self, to: [f64; 3]) {
        self.push(Way::Line(self.at, to), true, "rapid");
    }
    fn anywhere(&mut self) -> [f64; 2] {
        [self.dice.within(-3.0, 43.0), self.dice.within(-3.0, 33.0)]
    }
    /// Lifts, goes to a place and plunges there.
    fn plunge(&mut self, [x, y]: [f64; 2], z: f64) {
        let [x0, y0, _] = self.at;
        self.rapid([x0, y0, 3.0]);
        self.rapid([x, y, 3.0]);
        self.line([x, y, z], "plunge");
    }
    fn radius(&self) -> f64 {
        self.program.mills[self.tool as usize - 1].radius()
    }
    /// A pass beside an earlier straight one, at its height or below.
    fn beside(&mut self) {
        let level = |step: &Step| match step.way {
            Way::Line(a, b) if !step.rapid && a[2] == b[2] && step.way.length() > 2.0 => Some([a, b]),
            _ => None,
        };
        let lines: Vec<[[f64; 3]; 2]> = self.program.steps.iter().filter_map(level).collect();
        if lines.is_empty() {
            return;
        }
        let [mut a, mut b] = self.dice.of(&lines);
        if self.dice.below(2) == 0 {
            (a, b) = (b, a);
        }
        let length = (a[0] - b[0]).hypot(a[1] - b[1]);
        let (u, v) = ((b[0] - a[0]) / length, (b[1] - a[1]) / length);
        let r = self.radius();
        let by = self.dice.of(&[0.1, 0.1, 0.3 * r, r, 2.0 * r - 0.03, 2.0 * r + 0.05, 0.02]) * self.dice.sign();
        let z = self.dice.of(&[a[2], a[2], a[2] - 1.0]);
        self.plunge([a[0] - v * by, a[1] + u * by], z);
        self.line([b[0] - v * by, b[1] + u * by, z], "beside");
    }
    /// A chain of short blocks.
    fn chain(&mut self) {
        let (step, bend) = (self.dice.within(0.05, 0.3), self.dice.of(&[0.0, 0.02, 0.08, 0.35, 1.0]));
        let count = 5 + self.dice.below(20);
        let mut heading = self.dice.within(0.0, TAU);
        let turn = bend * self.dice.sign();
        let zigzag = self.dice.below(3) == 0;
        let rise = self.dice.of(&[0.0, 0.0, -0.01, -0.03, 0.02]);
        for k in 0..count {
            let [x, y, z] = self.at;
            self.line([x + step * heading.cos(), y + step * heading.sin(), z + rise], "chain");
            heading += if zigzag && k % 2 == 0 { -turn } else { turn };
        }
    }
    fn turn(&mut self, radius: f64, sweep: f64, rise: f64, what: &'static str) {
        let heading = self.dice.within(0.0, TAU);
        let [x, y, z] = self.at;
        let centre = [x - radius * heading.cos(), y - radius * heading.sin()];
        self.push(Way::Turn(centre, radius, heading, sweep, z, rise), false, what);
    }
    fn any(&mut self) {
        let z = self.dice.of(&FLOORS);
        match self.dice.below(12) {
            0..=2 => {
                let [x, y] = self.anywhere();
                self.line([x, y, self.at[2]], "level");
            }
            3 => {
                let [x, y] = self.anywhere();
                self.line([x, y, z], "ramp");
            }
            4 => {
                let at = self.anywhere();
                self.plunge(at, z);
            }
            5..=6 => {
                let (radius, sweep) = (self.dice.within(0.4, 8.0), self.dice.within(0.3, 7.0) * self.dice.sign());
                self.turn(radius, sweep, 0.0, "arc");
            }
            7 => {
                let (radius, sweep) = (self.dice.within(0.8, 4.0), self.dice.within(2.0, 9.0) * self.dice.sign());
                let rise = self.dice.of(&[-0.2, -0.6, -1.2, 0.4]);
                self.turn(radius, sweep, rise, "helix");
            }
            8..=10 => self.beside(),
            _ => self.chain(),
        }
        if self.at[2] < -9.0 || self.at[2] > 0.0 {
            let at = self.anywhere();
            self.plunge(at, z);
        }
    }
}

/// The random program of a seed.
pub fn program(seed: u64) -> Program {
    let mut dice = Dice(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xD1B5_4A32_D192_ED03);
    for _ in 0..20 {
        dice.next();
    }
    let mills = [dice.of(&MILLS), dice.of(&MILLS)];
    let count = 30 + dice.below(50);
    let change = if dice.below(2) == 0 { count / 2 } else { usize::MAX };
    let mut maker = Maker { dice, program: Program { mills, steps: Vec::new() }, at: [20.0, 15.0, 3.0], tool: 1 };
    let first = maker.anywhere();
    let z = maker.dice.of(&FLOORS);
    maker.plunge(first, z);
    while maker.program.steps.len() < count {
        if maker.program.steps.len() >= change && maker.tool == 1 {
            let [x, y, _] = maker.at;
            maker.rapid([x, y, 3.0]);
            maker.tool = 2;
            let at = maker.anywhere();
            maker.plunge(at, z);
        }
        maker.any();
    }
    maker.program
}

impl Program {
    pub fn toolpath(&self) -> Toolpath {
        let mut toolpath = Toolpath::default();
        for (index, step) in self.steps.iter().enumerate() {
            let (from, to) = (step.way.point(0.0).into(), step.way.point(1.0).into());
            let curve = match step.way {
                Way::Line(..) => Curve::Line { from, to },
                Way::Turn(c, _, _, sweep, z, _) => {
                    Curve::Arc(Arc::new(Plane::Xy, from, to, [c[0], c[1], z].into(), sweep))
                }
            };
            let kind = if step.rapid { MoveKind::Rapid } else { MoveKind::Feed };
            toolpath.moves.push(Move::new(BlockId(index as u32), kind, curve, state(step.tool).into()));
        }
        toolpath
    }
    pub fn engage(&self, cell_mm: f64) -> EngagementMap {
        let mut tools = self.mills.map(Mill::tool);
        (tools[0].number, tools[1].number) = (1, 2);
        let job = job(tools.into(), vec![block(MIN, MAX)]);
        engage(&self.toolpath(), &job, &Options { cell_mm: Some(cell_mm), ..Options::default() }, &|_| {}).unwrap()
    }
    pub fn sweeps(&self) -> Vec<Sweep> {
        self.steps.iter().map(|step| Sweep::new(step.way, self.mills[step.tool as usize - 1])).collect()
    }
}
