//! A tool that wears, apart from the model that regulates it, and the loop between them. In: a plant, a way to regulate it,
//! random numbers. Out: how long it lasted, how long it took, how well it was foreseen.
//!
//! Plant: force F = β + b r, r the ratio of the feed to that of the plan; dβ/ds = k (1 + u(s)) r^p with k of this tool, u a
//! slow wander; β runs in over its first metres; the tool is worn out at its own end index. A reading is F with noise. All lengths
//! in m, forces in N.

#![allow(dead_code)]

use feedwright::machine::{WearLaw, WearRate};
use feedwright::toollife::exponent::{self, Estimate, Lengths, POWERS};
use feedwright::toollife::regulation::{Regulation, TargetLine, ratio_of_pace, regulate};
use feedwright::toollife::trend::{Known, Reading, Trend, trend};

/// Random numbers: SplitMix64, and from it normal ones by Box and Muller.
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    fn uniform(&mut self) -> f64 {
        ((self.next() >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }
    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        let (a, b) = (self.uniform(), self.uniform());
        (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }
}

/// What is common to all tools, as the model has it.
#[derive(Clone, Copy)]
pub struct Shop {
    /// Index of a fresh edge behind its run-in, N.
    pub fresh_n: f64,
    /// Index at the end of a mean tool, N.
    pub end_n: f64,
    /// Its standard deviation from tool to tool, N.
    pub end_deviation_n: f64,
    /// Rate of a mean tool at r = 1, N per m.
    pub rate: f64,
    /// Relative standard deviation of the rate.
    pub rate_scatter: f64,
    /// Force of the chip at r = 1, N.
    pub chip_n: f64,
    /// Standard deviation of a reading, N.
    pub noise_n: f64,
    /// From check point to check point, m.
    pub every_m: f64,
    /// Target, m.
    pub target_m: f64,
    /// Lowest and highest ratio of the feed.
    pub ratios: [f64; 2],
    /// Probability with which the tool shall last.
    pub assurance: f64,
}

/// The shop of the comparison: a mean tool lasts for exactly the target.
pub const SHOP: Shop = Shop {
    fresh_n: 90.0,
    end_n: 240.0,
    end_deviation_n: 10.0,
    rate: 0.5,
    rate_scatter: 0.2,
    chip_n: 160.0,
    noise_n: 5.0,
    every_m: 20.0,
    target_m: 300.0,
    ratios: [0.4, 1.3],
    assurance: 0.9,
};

/// How far the index of a fresh edge lies below its line, N, and over which length it runs in, m.
const RUN_IN: [f64; 2] = [25.0, 6.0];
/// Standard deviation of the wander of the rate, and the length over which it changes, m.
const WANDER: [f64; 2] = [0.05, 40.0];
/// Step of the plant, m.
const STEP_M: f64 = 1.0;

/// One tool.
#[derive(Clone)]
pub struct Plant {
    rate: f64,
    end_n: f64,
    wander: Vec<f64>,
    noise: Vec<f64>,
}

/// Most steps that a tool is followed, m.
const MOST_M: usize = 3000;

impl Plant {
    /// A tool by its number: the same whatever regulates it.
    pub fn drawn(shop: &Shop, number: u64) -> Self {
        let mut random = Random(number.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ 0x5eed);
        let rate = shop.rate * (shop.rate_scatter * random.normal()).exp();
        let end_n = shop.end_n + shop.end_deviation_n * random.normal();
        let keep = (-STEP_M / WANDER[1]).exp();
        let mut u = WANDER[0] * random.normal();
        let wander = (0..MOST_M).map(|_| {
            u = keep * u + WANDER[0] * (1.0 - keep * keep).sqrt() * random.normal();
            u
        });
        let wander = wander.collect();
        Self { rate, end_n, wander, noise: (0..MOST_M).map(|_| random.normal()).collect() }
    }
}

/// How a tool is regulated.
#[derive(Clone, Copy, PartialEq)]
pub enum Way {
    /// Not at all: the feed of the plan.
    None,
    /// By the pace of wear that is left (budget).
    Budget,
    /// By the shift of the whole profile to the target line of force.
    Shift,
}

/// How it went.
#[derive(Clone, Debug)]
pub struct Course {
    /// Length at which it was worn out, m.
    pub life_m: f64,
    /// Time to the target or to the end, whichever came first, over that at r = 1 for the whole target.
    pub time: f64,
    /// Length cut by then over the target.
    pub cut: f64,
    /// Predicted end as it was foreseen half way to the true one, with its interval (5 %, 95 %), m, and the true one.
    pub foreseen: Option<([f64; 2], f64)>,
    /// Largest distance of the force from the target line at a check point to which a shift within the bounds of the feed
    /// led, N; and the largest by which it exceeds what the index rose since the check point before (the lag).
    pub tracking_n: [f64; 2],
    /// Was regulation refused, because slower does not spare this tool?
    pub refused: bool,
    /// Did the readings refute the exponent that was believed?
    pub refuted: bool,
}

/// Runs one tool to its end. `believed`: the exponent that is declared for the law that regulates; `exponent`: that of the tool.
pub fn course(shop: &Shop, [believed, exponent]: [f64; 2], plant: &Plant, way: Way) -> Course {
    let law_of = |exponent: f64| WearLaw {
        rate: WearRate::along_path(1e-3 * shop.rate, 1.0, exponent),
        end: shop.end_n,
        rate_scatter: shop.rate_scatter,
        end_scatter: shop.end_deviation_n,
    };
    let known = Known { rate: shop.rate, rate_deviation: shop.rate_scatter * shop.rate, noise: shop.noise_n };
    let line = TargetLine {
        from_m: 0.0,
        from_n: shop.fresh_n + shop.chip_n,
        to_m: shop.target_m,
        to_n: shop.end_n + shop.chip_n,
    };
    let mut readings: Vec<(Lengths, f64)> = Vec::new();
    let (mut index, mut ratio, mut cut_m, mut lengths, mut time) = (shop.fresh_n, 1.0f64, 0.0, Lengths::default(), 0.0);
    let (mut tracking_n, mut tracks, mut refused, mut refuted) = ([0.0f64; 2], None, false, false);
    let mut predictions: Vec<(Lengths, f64, Trend)> = Vec::new();
    let mut next_m = shop.every_m;
    // The ratio wanted, and whether it is one that leads to the target line.
    let decide = |trend: &Trend,
                  power: f64,
                  seen: Option<&Estimate>,
                  [cut_m, wear_m]: [f64; 2],
                  ratio: f64,
                  refused: &mut bool|
     -> (f64, bool) {
        let rest_m = (shop.target_m - cut_m).max(1e-9);
        let law = law_of(power);
        match regulate(trend, &law, seen, [wear_m, rest_m], shop.assurance) {
            Regulation::AsTheyAre => {
                *refused = true;
                (1.0, false)
            }
            Regulation::Faster => (shop.ratios[1], false),
            Regulation::WornOut => (shop.ratios[0], false),
            Regulation::Pace(pace) if way == Way::Budget => (ratio_of_pace(&law, pace), false),
            Regulation::Pace(_) => {
                let next_m = cut_m + shop.every_m;
                let expected = trend.at(wear_m) + trend.rate * ratio.powf(power) * shop.every_m;
                (line.shift(next_m, expected + shop.chip_n, shop.chip_n), true)
            }
        }
    };
    if way != Way::None {
        let before = Trend::before(0.0, shop.fresh_n, &known);
        let (wanted, _) = decide(&before, believed, None, [0.0; 2], ratio, &mut refused);
        ratio = wanted.clamp(shop.ratios[0], shop.ratios[1]);
    }
    for step in 0..MOST_M {
        let run_in = RUN_IN[0] * (-cut_m / RUN_IN[1]).exp();
        if index - run_in >= plant.end_n {
            break;
        }
        if cut_m >= next_m - 1e-9 {
            let force = index - run_in + shop.chip_n * ratio;
            if let Some(index_then) = tracks.filter(|_| readings.len() > 3 && cut_m <= shop.target_m) {
                let off_n = (force - line.at(cut_m)).abs();
                tracking_n = [tracking_n[0].max(off_n), tracking_n[1].max(off_n - (index - index_then))];
            }
            let read = force + shop.noise_n * plant.noise[step];
            readings.push((lengths, read - shop.chip_n * ratio));
            let seen = (way != Way::None).then(|| exponent::estimate(&readings, &known, believed)).flatten();
            refuted |= seen.is_some_and(|seen| seen.refutes);
            let power = exponent::trusted(seen.as_ref(), believed, shop.assurance);
            let counted: Vec<Reading> =
                readings.iter().map(|(lengths, index)| Reading { at_m: lengths.at(power), index: *index }).collect();
            let found = trend(&counted, &known).expect("there are readings");
            if way != Way::None && cut_m < shop.target_m {
                let (wanted, leads) =
                    decide(&found, power, seen.as_ref(), [cut_m, lengths.at(power)], ratio, &mut refused);
                ratio = wanted.clamp(shop.ratios[0], shop.ratios[1]);
                tracks = (leads && ratio == wanted).then_some(index);
            }
            predictions.push((lengths, power, found));
            next_m += shop.every_m;
        }
        index += plant.rate * (1.0 + plant.wander[step]) * ratio.powf(exponent) * STEP_M;
        cut_m += STEP_M;
        lengths = lengths.and(&Lengths(POWERS.map(|power| ratio.powf(power) * STEP_M)));
        if cut_m <= shop.target_m + 1e-9 {
            time += STEP_M / ratio / shop.target_m;
        }
    }
    // Lengths at the reference feed, in which later changes of the feed do not matter.
    let half = predictions.iter().rfind(|(then, power, _)| then.at(*power) <= 0.5 * lengths.at(*power));
    let foreseen = half.and_then(|(_, power, found)| {
        let end = |share| found.worn_out_m(share, shop.end_n, shop.end_deviation_n);
        Some(([end(0.05)?, end(0.95)?], lengths.at(*power)))
    });
    Course { life_m: cut_m, time, cut: (cut_m / shop.target_m).min(1.0), foreseen, tracking_n, refused, refuted }
}

/// One row of the table.
#[derive(Debug, Clone)]
pub struct Row {
    /// Share that reached the target.
    pub reached: f64,
    /// Mean time per length cut, over that at r = 1, of all tools.
    pub time: f64,
    /// Share of the runs in which the interval of the predicted end held the true one.
    pub covered: f64,
    /// Largest tracking error, N, and beyond the lag.
    pub tracking_n: [f64; 2],
    /// Was regulation refused?
    pub refused: bool,
    /// Share of the tools whose readings refuted the exponent that was believed.
    pub refuted: f64,
}

/// So many tools, the same ones for every way.
pub fn row(shop: &Shop, exponents: [f64; 2], way: Way, tools: u64) -> Row {
    let courses: Vec<Course> =
        (0..tools).map(|number| course(shop, exponents, &Plant::drawn(shop, number), way)).collect();
    let share = |of: &dyn Fn(&Course) -> bool| courses.iter().filter(|c| of(c)).count() as f64 / courses.len() as f64;
    let foreseen: Vec<([f64; 2], f64)> = courses.iter().filter_map(|course| course.foreseen).collect();
    let inside = foreseen.iter().filter(|([early, late], true_m)| (*early..=*late).contains(true_m)).count();
    Row {
        reached: share(&|course| course.life_m >= shop.target_m),
        time: courses.iter().map(|course| course.time).sum::<f64>() / courses.iter().map(|c| c.cut).sum::<f64>(),
        covered: inside as f64 / courses.len() as f64,
        tracking_n: [0, 1].map(|k| courses.iter().map(|course| course.tracking_n[k]).fold(0.0, f64::max)),
        refused: courses.iter().all(|course| course.refused),
        refuted: share(&|course| course.refuted),
    }
}

/// One feed for all tools with which at least this share of them reaches the target, and its time per length; `None`: none.
pub fn as_sure(shop: &Shop, exponent: f64, share: f64, tools: u64) -> Option<f64> {
    let reached = |ratio: f64| {
        // Nothing is read: no trend is asked for.
        let slower = Shop { rate: shop.rate * ratio.powf(exponent), every_m: f64::INFINITY, ..*shop };
        row(&slower, [exponent; 2], Way::None, tools).reached
    };
    let (mut low, mut high) = (0.05, 1.0);
    if exponent <= 0.0 || reached(low) < share {
        return None;
    }
    for _ in 0..12 {
        let middle = 0.5 * (low + high);
        if reached(middle) < share { high = middle } else { low = middle }
    }
    Some(low.recip())
}

/// The table over p and ways; then what becomes of a regulation that believes in another p than there is.
pub fn table(shop: &Shop, tools: u64) -> String {
    let mut text =
        String::from("p    regulation          reached  time per length  interval holds  tracking N  p refuted\n");
    let mut line = |exponent: f64, name: &str, row: &Row| {
        text += &format!(
            "{exponent:<4} {name:<18} {:>6.1} %  {:>13.3}  {:>12.1} %  {:>10}  {:>7.1} %\n",
            100.0 * row.reached,
            row.time,
            100.0 * row.covered,
            if row.tracking_n[0] > 0.0 { format!("{:.1}", row.tracking_n[0]) } else { "-".into() },
            100.0 * row.refuted
        );
    };
    for exponent in [-1.0, 0.0, 1.0, 2.0] {
        for (name, way) in [("none", Way::None), ("budget", Way::Budget), ("shift", Way::Shift)] {
            let row = row(shop, [exponent; 2], way, tools);
            line(exponent, &if row.refused { format!("{name}, refused") } else { name.to_owned() }, &row);
            if let Some(time) = as_sure(shop, exponent, row.reached, tools).filter(|_| way == Way::Budget) {
                line(exponent, "one slower feed", &Row { time, tracking_n: [0.0; 2], ..row });
            }
        }
    }
    for [believed, exponent] in [[1.0, -1.0], [1.0, 0.0], [1.0, 2.0], [2.0, -1.0], [-1.0, 1.0]] {
        line(exponent, &format!("budget, believes {believed}"), &row(shop, [believed, exponent], Way::Budget, tools));
    }
    text
}

/// The plant of the paper without noise: F = β + b (r − 1), β from 250 N at `from_m`; rate k r^p.
#[derive(Clone, Copy)]
pub struct PaperRun {
    /// Where regulation begins, m.
    pub from_m: f64,
    /// k, N per m.
    pub rate: f64,
    /// p.
    pub exponent: f64,
    /// Index at which the tool is worn out, N.
    pub end_n: f64,
    /// Target; `None`: not regulated. m.
    pub target_m: Option<f64>,
    /// From check point to check point, m.
    pub every_m: f64,
}

/// Force of the chip per ratio of feeds, N: a calibration to the removal rate of the paper's case 1.
pub const CHIP_N: f64 = 163.2;
/// Force where regulation begins and at the target, N.
pub const FORCES_N: [f64; 2] = [250.0, 400.0];

/// Life in m, mean feed over the whole life relative to r = 1, lowest and highest ratio, force at the end.
pub fn paper(run: &PaperRun) -> (f64, f64, [f64; 2], f64) {
    const STEP_M: f64 = 0.01;
    let line = run.target_m.map(|to_m| TargetLine { from_m: run.from_m, from_n: FORCES_N[0], to_m, to_n: FORCES_N[1] });
    let (mut at_m, mut index, mut ratio, mut pace, mut time) = (run.from_m, FORCES_N[0], 1.0f64, 1.0f64, run.from_m);
    let mut next_m = run.from_m;
    let mut ratios = [f64::INFINITY, f64::NEG_INFINITY];
    while index < run.end_n && at_m < 2000.0 {
        if let Some(line) = line.filter(|line| at_m >= next_m - 1e-9 && at_m < line.to_m) {
            ratio = line.shift(at_m + run.every_m, index + run.rate * pace * run.every_m, CHIP_N).max(1e-3);
            pace = ratio.powf(run.exponent);
            ratios = [ratios[0].min(ratio), ratios[1].max(ratio)];
            next_m += run.every_m;
        }
        index += run.rate * pace * STEP_M;
        at_m += STEP_M;
        time += STEP_M / ratio;
    }
    (at_m, at_m / time, ratios, index + CHIP_N * (ratio - 1.0))
}
