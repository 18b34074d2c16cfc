//! Cases of the confusion matrix: a part, its hidden effects, and the log that the machine would have written. In: row,
//! seed, noise. Out: [`Case`].
//!
//! Seeds 0–19 are the ones the matrix reports; whoever develops the diagnosis uses seeds from 1000 on. The form of the log
//! goes by the seed: positions with feed, positions without, line numbers, or time and load alone.

use super::hidden::{Hidden, LISTED, UNLISTED};
use super::physics::{Channel, Coefficients, Milling, Reading};
use super::programs::Part;
use super::rng::Rng;

/// Pairs of the row `two`.
pub const PAIRS: [[&str; 2]; 10] = [
    ["flank-wear", "tare-warm-up"],
    ["size-effect", "hard-zone"],
    ["up-down-asymmetry", "sensor-lag"],
    ["stock-proud", "flank-wear"],
    ["tare-speed", "edge-chipping"],
    ["corner-feed", "up-down-asymmetry"],
    ["tool-diameter", "tare-speed"],
    ["drive-efficiency", "tare-warm-up"],
    ["hard-zone", "flank-wear"],
    ["size-effect", "tare-speed"],
];

/// Rows whose programs do not hold the cut that parts the truth from its rival, with the truth: the mill eats through the
/// stock from one side to the other, so that "from some instant on" and "beyond some place" are the same readings.
pub const TWINS: [(&str, &str); 2] = [("chipping-or-zone", "edge-chipping"), ("zone-or-chipping", "hard-zone")];

/// Is the row one of [`TWINS`]?
pub fn is_twin(row: &str) -> bool {
    TWINS.iter().any(|(name, _)| *name == row)
}

/// Correlation of the noise of neighbouring readings.
pub const MEMORY: f64 = 0.3;

/// Rows of the matrix: none, every single effect, two, unlisted ones.
pub fn rows() -> Vec<&'static str> {
    let mut rows = vec!["none"];
    rows.extend(LISTED);
    rows.push("two");
    rows.extend(TWINS.map(|(row, _)| row));
    rows.extend(UNLISTED);
    rows
}

/// What a log says besides time and load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Positions, feed, spindle speed.
    PositionsAndFeed,
    /// Positions and spindle speed.
    Positions,
    /// Line and spindle speed.
    Lines,
    /// Nothing.
    TimeOnly,
}

/// One case.
#[derive(Debug, Clone)]
pub struct Case {
    /// Seed.
    pub seed: u64,
    /// Names of the effects that a diagnosis should give (none of them for unlisted ones).
    pub names: Vec<&'static str>,
    /// The effects themselves.
    pub hidden: Vec<Hidden>,
    /// Coefficients.
    pub truth: Coefficients,
    /// The part.
    pub part: Part,
    /// What is measured.
    pub channel: Channel,
    /// Form of the log.
    pub form: Form,
    /// Readings per second.
    pub rate_hz: f64,
}

impl Case {
    /// Draws a case.
    pub fn new(row: &'static str, seed: u64) -> Self {
        let part = if is_twin(row) { Part::lean(seed) } else { Part::new(seed) };
        let mut rng = Rng::new(seed, 2);
        let truth = Coefficients::draw(&part, &mut rng);
        let names = match row {
            "none" => vec![],
            "two" => PAIRS[seed as usize % PAIRS.len()].to_vec(),
            row => vec![TWINS.iter().find(|(twin, _)| *twin == row).map_or(row, |(_, truth)| truth)],
        };
        let hidden = names.iter().map(|name| match row {
            "zone-or-chipping" => Self::beyond_a_place(&part, &mut rng),
            _ => Hidden::draw(name, 1.0, &part, &mut rng),
        });
        let hidden = hidden.collect();
        let channel = if Self::has_forces(row, seed) { Channel::PowerAndForceXy } else { Channel::Power };
        let form = match seed % 5 {
            0 | 1 => Form::PositionsAndFeed,
            2 => Form::Positions,
            3 => Form::Lines,
            _ => Form::TimeOnly,
        };
        let names = if UNLISTED.contains(&row) { vec![] } else { names };
        let rate_hz = rng.pick(&[10.0, 20.0]);
        Self { seed, names, hidden, truth, part, channel, form, rate_hz }
    }

    /// A hard zone over the whole length, from somewhere near the middle of the width on.
    fn beyond_a_place(part: &Part, rng: &mut Rng) -> Hidden {
        let [length, width, _] = part.stock_mm;
        let from = width * rng.uniform(0.3, 0.7);
        let (centre, half) = ([0.5 * length, 2.0 * width], [5.0 * length, 2.0 * width - from]);
        Hidden::HardZone { excess: rng.uniform(0.12, 0.3), centre, half }
    }

    /// Is a force measured beside the power? Runout shows in forces only; some logs without an effect have them too.
    pub fn has_forces(row: &str, seed: u64) -> bool {
        row == "runout" || (row == "none" && seed % 4 == 3)
    }

    /// The log with noise of a standard deviation of `noise` times the mean cutting load, and that deviation: of power and
    /// of force.
    pub fn log(&self, noise: f64) -> (String, [f64; 2]) {
        let mut rng = Rng::new(self.seed, 3);
        let (before_s, times, readings) = self.readings(&mut rng);
        let mean = |of: &dyn Fn(&Reading) -> f64| {
            let cutting: Vec<f64> = readings.iter().map(of).filter(|c| *c > 0.0).collect();
            cutting.iter().sum::<f64>() / cutting.len().max(1) as f64
        };
        let deviation = [noise * mean(&|r| r.cutting), noise * mean(&|r| r.force)];
        (self.text(&times, &readings, before_s, deviation, &mut rng), deviation)
    }

    /// How long the log runs before the program begins, s, and its rows: times since the program began, and readings without
    /// noise.
    pub fn readings(&self, rng: &mut Rng) -> (f64, Vec<f64>, Vec<Reading>) {
        let milling = Milling::new(&self.part, &self.truth, &self.hidden, self.channel);
        let rate_hz = self.rate_hz;
        let before_s = rng.uniform(0.5, 4.0);
        let count = ((milling.end_s() + before_s + 1.0) * rate_hz) as usize;
        let times: Vec<f64> = (0..count).map(|k| (k as f64 + rng.uniform(-0.03, 0.03)) / rate_hz - before_s).collect();
        let readings = milling.read(&times);
        (before_s, times, readings)
    }

    fn text(&self, times: &[f64], readings: &[Reading], before_s: f64, deviation: [f64; 2], rng: &mut Rng) -> String {
        let mut text = format!("{}\n", self.header());
        let mut noise = [0.0; 2];
        let channels = if self.channel == Channel::Power { 1 } else { 2 };
        for (time, reading) in times.iter().zip(readings) {
            text.push_str(&format!("{:.3},{}", time + before_s, self.place(reading)));
            for k in 0..channels {
                noise[k] = MEMORY * noise[k] + (1.0 - MEMORY * MEMORY).sqrt() * rng.normal();
                let value = ([reading.value, reading.force][k] + deviation[k] * noise[k]).max(0.0);
                text.push_str(&format!("{}{value:.2}", if k == 0 { "" } else { "," }));
            }
            text.push('\n');
        }
        text
    }

    fn header(&self) -> String {
        let measured = match self.channel {
            Channel::Power => "spindle_power_w",
            Channel::PowerAndForceXy => "spindle_power_w,force_xy_n",
        };
        let place = match self.form {
            Form::PositionsAndFeed => "x_mm,y_mm,z_mm,spindle_rpm,feed_mm_min,",
            Form::Positions => "x_mm,y_mm,z_mm,spindle_rpm,",
            Form::Lines => "line,spindle_rpm,",
            Form::TimeOnly => "",
        };
        format!("time_s,{place}{measured}")
    }

    fn place(&self, reading: &Reading) -> String {
        let moment = &reading.moment;
        let [x, y, z] = moment.at_mm;
        let rpm = 60.0 * moment.rps * moment.runup.unwrap_or(1.0);
        match self.form {
            Form::PositionsAndFeed => format!("{x:.3},{y:.3},{z:.3},{rpm:.0},{:.0},", 60.0 * moment.speed_mm_s),
            Form::Positions => format!("{x:.3},{y:.3},{z:.3},{rpm:.0},"),
            Form::Lines => format!("{},{rpm:.0},", self.part.steps[moment.step].line),
            Form::TimeOnly => String::new(),
        }
    }
}
