//! A reader of its own for the test programs of `calibrate --plan`: it follows the words at constant feed and knows from
//! the comments what is being cut, so that logs can be made by closed forms.

#![allow(clippy::format_collect, clippy::unwrap_used)]
#![allow(dead_code)] // each test file uses its own part of it

use feedwright::machine::Job;
use std::path::Path;

/// Length of the block along X, mm.
const LENGTH_MM: f64 = 120.0;

/// Setup of the test block: flat mill T1, ball T2.
pub const SETUP: &str = r#"
units = "mm"
[machine]
dialect = "linuxcnc"
rapid = 15000
[machine.axes]
x = { velocity = 15000, acceleration = 1500 }
y = { velocity = 15000, acceleration = 1500 }
z = { velocity = 12000, acceleration = 1200 }
[machine.spindle]
max_rpm = 12000
power = [[0, 0], [1500, 7500], [12000, 7500]]
tare = [[1000, 120], [12000, 480]]
runup_time = 1.5
[stock]
box = { min = [0, 0, -30], max = [120, 70, 0] }
[material]
k_tc = 800
k_rc = 300
k_te = 16
k_re = 10
[[tool]]
number = 1
shape = "flat"
diameter = 10
flutes = 3
flute_length = 22
overhang = 35
[[tool]]
number = 2
shape = "ball"
diameter = 8
flutes = 2
flute_length = 22
overhang = 35
"#;

/// The same as a job.
pub fn job() -> Job {
    feedwright::setup::load(SETUP, Path::new(".")).unwrap().0
}

/// One reading of the log.
pub struct At {
    pub time_s: f64,
    pub position: [f64; 3],
    pub rps: f64,
    pub feed_mm_s: f64,
    /// Depth and width of the cut that its comment announced, and whether the tool is inside the block along X.
    pub cut: Option<(f64, f64)>,
}

/// Follows the words of a program: G0 at 250 mm/s, G1 at its F, no acceleration; a reading every 20 ms.
pub fn follow(text: &str, radius: f64) -> Vec<At> {
    let word = |line: &str, letter: char| -> Option<f64> {
        line.split_whitespace().find_map(|w| w.strip_prefix(letter)?.parse().ok())
    };
    let (mut at, mut now, mut next, mut rps, mut feed) = ([0.0, 0.0, 100.0], 0.0, 0.0, 0.0, 0.0);
    let (mut depths, mut out) = (None, Vec::new());
    for line in text.lines() {
        if let Some(note) = line.strip_prefix("(CUT ") {
            let words: Vec<&str> = note.trim_end_matches(')').split_whitespace().collect();
            depths = Some((words[1].parse().unwrap(), words[3].parse().unwrap()));
        } else if line.starts_with("(GROOVE") {
            depths = None;
        }
        let code = line.split_whitespace().next().unwrap_or("");
        if let (Some(rpm), true) = (word(line, 'S'), line.contains("M3")) {
            rps = rpm / 60.0;
            now += 1.5;
        }
        if code != "G0" && code != "G1" {
            continue;
        }
        feed = word(line, 'F').unwrap_or(feed);
        let from = at;
        for (k, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            at[k] = word(line, letter).unwrap_or(at[k]);
        }
        let length = (0..3).map(|k| (at[k] - from[k]).powi(2)).sum::<f64>().sqrt();
        let speed = if code == "G0" { 250.0 } else { feed / 60.0 };
        let lasts = length / speed;
        while next <= now + lasts {
            let t: f64 = if lasts > 0.0 { ((next - now) / lasts).max(0.0) } else { 1.0 };
            let position = std::array::from_fn(|k| from[k] + (at[k] - from[k]) * t);
            let inside = code == "G1" && position[2] < -1e-6 && (0.0..LENGTH_MM - radius).contains(&position[0]);
            out.push(At { time_s: next, position, rps, feed_mm_s: speed, cut: depths.filter(|_| inside) });
            next += 0.02;
        }
        now += lasts;
    }
    out
}

/// Normal noise, the same every time.
pub struct Noise(pub u64);

impl Noise {
    /// The next number.
    pub fn normal(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// The log as text; `measure` gives the cells of the columns in `header`.
pub fn log(samples: &[At], header: &str, mut measure: impl FnMut(&At) -> String) -> String {
    let mut text = format!("time_s,x_mm,y_mm,z_mm,spindle_rpm,{header}\n");
    for s in samples {
        let [x, y, z] = s.position;
        text += &format!("{:.3},{x:.4},{y:.4},{z:.4},{:.1},{}\n", s.time_s, s.rps * 60.0, measure(s));
    }
    text
}

/// Every so many-th reading of the spindle's power of a mill of 10 mm: 300 W, and 0.9 J/mm³ of what is removed.
pub fn power_log(program: &str, every: usize) -> String {
    let samples: Vec<At> = follow(program, 5.0).into_iter().step_by(every).collect();
    log(&samples, "spindle_power_w", |at| {
        format!("{:.0}", 300.0 + at.cut.map_or(0.0, |(axial, radial)| 0.9 * axial * radial * at.feed_mm_s))
    })
}

/// Without the readings in which the tool is only partly in the block, where closed forms do not hold.
pub fn clear_of_ends(samples: Vec<At>, radius: f64) -> Vec<At> {
    let partly = |s: &At| {
        let x = s.position[0];
        s.position[2] < 0.0 && s.cut.is_none() && (-radius..LENGTH_MM + radius).contains(&x)
    };
    samples.into_iter().filter(|s| !partly(s)).collect()
}
