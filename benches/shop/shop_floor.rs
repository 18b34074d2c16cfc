//! A program run on the true machine: what its meter reads, and how far a hidden cause shows.
//!
//! In: a job, the machine, what is hidden. Out: samples of time, place, feed, speed and power; the log as CSV.
//!
//! Reading: motor = tare(n) + P_cutting + P_edge; meter = motor/η, then what drive and meter make of it.

use std::fmt::Write as _;

use super::causes::Hidden;
use super::dice::Dice;
use super::engagement::{Grid, RIM, Trail};
use super::machine::{Drives, run};
use super::physics::{Station, end_face_power, peak_force, power};
use super::programs::{Job, RUN_UP_S, TOOL_CHANGE_S};

/// Pixel of the stock, mm.
const CELL: f64 = 0.08;
/// Slices along the axis where coefficients differ along it, mm.
const SLICE: f64 = 0.35;
/// Time between two values of the meter before it is sampled, s.
const FINE_S: f64 = 0.01;

/// The machine without anything hidden.
#[derive(Clone, Copy, Debug)]
pub struct Machine {
    pub acceleration_mm_s2: f64,
    pub corner_tolerance_mm: f64,
    /// Power with nothing cut: W, and W per rev/min.
    pub tare: [f64; 2],
    pub efficiency: f64,
    /// Declared over true tare, and over true coefficients: what the shop believes.
    pub declared: [f64; 2],
    pub rate_hz: usize,
    /// True: the log holds place, feed and speed; false: time and power.
    pub positions: bool,
    /// The sensor is a plate under the part that gives the peak force of a turn, N, in place of the meter.
    pub forces: bool,
}

impl Machine {
    /// The machine of a seed.
    pub fn new(seed: u64) -> Self {
        let mut dice = Dice::new(seed, "machine");
        Self {
            acceleration_mm_s2: dice.pick(&[800.0, 1500.0, 2500.0]),
            corner_tolerance_mm: dice.pick(&[0.01, 0.02, 0.05]),
            tare: [dice.between(30.0, 80.0), dice.between(0.01, 0.03)],
            efficiency: dice.between(0.78, 0.92),
            declared: [dice.between(0.85, 1.15), dice.between(0.85, 1.2)],
            rate_hz: dice.pick(&[10, 20, 25, 50]),
            positions: seed.is_multiple_of(2),
            forces: false,
        }
    }

    /// Power with nothing cut, W at the motor.
    pub fn tare_w(&self, rpm: f64) -> f64 {
        if rpm > 0.0 { self.tare[0] + self.tare[1] * rpm } else { 0.0 }
    }
}

/// A moment of the meter.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub station: Station,
    pub step: usize,
    /// Power of cutting and edge at the tool, W.
    pub load: [f64; 2],
    /// What the meter reads.
    pub watts: f64,
}

/// What a run leaves behind.
pub struct Run {
    /// Every `FINE_S`.
    pub samples: Vec<Sample>,
    /// Power of cutting and edge of each step of the path, W at the tool.
    pub loads: Vec<[f64; 2]>,
    pub duration_s: f64,
}

/// Runs the job.
pub fn simulate(job: &Job, machine: &Machine, hidden: &Hidden) -> Run {
    let drives = Drives {
        acceleration_mm_s2: machine.acceleration_mm_s2 * hidden.acceleration,
        corner_tolerance_mm: machine.corner_tolerance_mm,
        settle_s: hidden.settle_s,
        override_at: hidden.override_at.as_deref(),
        holds: &hidden.holds,
    };
    let ticks = run(&job.steps, &drives);
    let mut stock = raw_stock(job, hidden);
    let mut loads = vec![[0.0; 2]; job.steps.len()];
    let mut slid = vec![0.0; job.tools.len()];
    let mut fresh = hidden.fresh_edge_at.iter().peekable();
    let (mut since_entry, mut in_air) = (0.0, 1.0);
    let mut depth = [0.0; RIM];
    let mut trail = Trail::default();
    let mut stations = Vec::with_capacity(ticks.len());
    for tick in &ticks {
        let step = &job.steps[tick.step];
        let tool = job.tools[step.tool];
        if fresh.next_if(|at| tick.time_s >= **at).is_some() {
            slid.fill(0.0);
        }
        let flat = (step.to[0] - step.from[0]).hypot(step.to[1] - step.from[1]);
        let along = if flat > 1e-9 { [0, 1].map(|k| (step.to[k] - step.from[k]) / flat) } else { [1.0, 0.0] };
        let radius = tool.diameter_mm / 2.0 + hidden.diameter_mm / 2.0;
        let mut at = Station {
            time_s: tick.time_s,
            place: step.to,
            along,
            speed_mm_s: tick.speed_mm_s,
            acceleration_mm_s2: tick.acceleration_mm_s2,
            rpm: step.rpm,
            tool: step.tool,
            radius_mm: radius,
            flutes: tool.flutes,
            pass: step.pass,
            slid_m: slid[step.tool],
            ..Station::default()
        };
        if step.rapid {
            trail.end(&mut stock, radius);
        }
        let mut load = [0.0; 2];
        if tick.speed_mm_s > 0.0 && !step.rapid {
            let lower = hidden.z_growth.as_ref().map_or(0.0, |growth| growth(tick.time_s));
            let (from, to) =
                ([step.from[0], step.from[1], step.from[2] + lower], [step.to[0], step.to[1], step.to[2] + lower]);
            trail.before(&mut stock, from, to, radius);
            stock.rim(between(from, to, 0.5), along, radius, &mut depth);
            if flat < 1e-9 {
                depth.fill(0.0);
            }
            let touched = depth.iter().filter(|d| **d > 1e-3).count();
            at.depth_mm = depth.iter().copied().fold(0.0, f64::max);
            at.immersion_deg = 180.0 * touched as f64 / RIM as f64;
            if touched > 0 {
                in_air = 0.0;
                since_entry += step.length_mm;
            } else {
                in_air += step.length_mm;
                if in_air > 0.5 {
                    since_entry = 0.0;
                }
            }
            at.since_entry_mm = since_entry;
            load = power(&at, &depth, &job.truth, hidden.runout, &hidden.elements, SLICE);
            if step.to[2] < step.from[2] {
                let down = tick.speed_mm_s * (step.from[2] - step.to[2]) / step.length_mm;
                let end = end_face_power(&at, stock.area_above(to, radius), down, &job.truth);
                load = [load[0] + end[0], load[1] + end[1]];
            }
            for factor in &hidden.stations {
                let factor = factor(&at);
                load = [load[0] * factor[0], load[1] * factor[1]];
            }
            if machine.forces {
                load = [peak_force(&at, &depth, &job.truth, hidden.runout, tool.helix_deg), 0.0];
            }
            let contact = touched as f64 / (2.0 * RIM as f64);
            let speed = step.rpm / 60.0 * std::f64::consts::TAU * radius / 1000.0;
            slid[step.tool] += contact * speed * tick.duration_s;
            trail.after(&mut stock, from, to, radius);
            loads[tick.step] = load;
        }
        stations.push((at, load));
    }
    let last = ticks.last().map_or(0.0, |tick| tick.time_s + tick.duration_s);
    let mut samples = Vec::with_capacity((last / FINE_S) as usize + 1);
    let mut now = 0;
    for n in 0..(last / FINE_S) as usize {
        let time = n as f64 * FINE_S;
        while now + 1 < ticks.len() && ticks[now + 1].time_s <= time {
            now += 1;
        }
        let (mut at, load) = stations[now];
        let (tick, step) = (&ticks[now], &job.steps[ticks[now].step]);
        at.time_s = time;
        let share = (time - tick.time_s) / tick.duration_s.max(1e-9);
        at.place = between(step.from, step.to, if tick.speed_mm_s > 0.0 { share.min(1.0) } else { 1.0 });
        samples.push(Sample { station: at, step: ticks[now].step, load, watts: reading(&at, load, machine, hidden) });
    }
    let mut watts: Vec<f64> = samples.iter().map(|sample| sample.watts).collect();
    for meter in &hidden.meters {
        watts = meter(&watts, FINE_S);
    }
    samples.iter_mut().zip(watts).for_each(|(sample, watts)| sample.watts = watts);
    Run { samples, loads, duration_s: last }
}

/// A share of the way from one place to another.
fn between(from: [f64; 3], to: [f64; 3], share: f64) -> [f64; 3] {
    [0, 1, 2].map(|k| from[k] + share * (to[k] - from[k]))
}

/// What the meter would read at once, W.
fn reading(at: &Station, load: [f64; 2], machine: &Machine, hidden: &Hidden) -> f64 {
    if machine.forces {
        return load[0];
    }
    let tare: f64 = hidden.tares.iter().map(|factor| factor(at)).product::<f64>() * machine.tare_w(at.rpm);
    let motor = tare + load[0] + load[1];
    let meter = hidden.drives.iter().fold(motor / machine.efficiency, |watts, drive| drive(watts, at));
    meter + hidden.extra_w.iter().map(|extra| extra(at)).sum::<f64>()
}

/// The stock as it truly stands: faces that stand proud, a zero point that is shifted or turned.
fn raw_stock(job: &Job, hidden: &Hidden) -> Grid {
    let stock = &hidden.stock;
    let (sin, cos) = stock.turn.sin_cos();
    let middle = [0, 1].map(|k| f64::midpoint(job.low[k], job.high[k]));
    let height = |p: [f64; 2]| {
        let d = [p[0] - middle[0] - stock.shift[0], p[1] - middle[1] - stock.shift[1]];
        let q = [middle[0] + cos * d[0] + sin * d[1], middle[1] + cos * d[1] - sin * d[0]];
        let inside = q[0] > job.low[0] - stock.faces[0]
            && q[0] < job.high[0] + stock.faces[1]
            && q[1] > job.low[1] - stock.faces[2]
            && q[1] < job.high[1] + stock.faces[3];
        let half = if p[0] > middle[0] { stock.half } else { 0.0 };
        let slope = stock.slope[0] * (p[0] - middle[0]) + stock.slope[1] * (p[1] - middle[1]);
        inside.then_some(job.high[2] + stock.faces[4] + stock.shift[2] + half + slope)
    };
    Grid::new([job.low[0] - 6.0, job.low[1] - 6.0], [job.high[0] + 6.0, job.high[1] + 6.0], CELL, height)
}

/// Mean power of cutting while something is cut, W at the meter: what noise is a share of.
pub fn mean_cutting_w(plain: &Run, machine: &Machine) -> f64 {
    let loads = plain.samples.iter().map(|sample| plain.loads[sample.step]).map(|load| load[0] + load[1]);
    let cutting: Vec<f64> = loads.filter(|watts| *watts > 1.0).collect();
    cutting.iter().sum::<f64>() / cutting.len().max(1) as f64 / machine.efficiency
}

/// Residual of the best plain model on the readings, W rms, before any noise: readings against the plain run's cutting and
/// edge power at the same place of the program, the tare, and a constant, by least squares.
pub fn misfit_w(run: &Run, plain: &Run, machine: &Machine) -> f64 {
    let row = |sample: &Sample| {
        let load = plain.loads[sample.step];
        ([load[0], load[1], machine.tare_w(sample.station.rpm), 1.0], sample.watts)
    };
    left_over(&run.samples.iter().step_by(5).map(row).collect::<Vec<_>>())
}

/// What a fit of four terms by least squares leaves, rms. A term that does nothing gets no weight.
pub fn left_over(rows: &[([f64; 4], f64)]) -> f64 {
    let mut normal = [[0.0; 5]; 4];
    for (x, y) in rows {
        for i in 0..4 {
            for j in 0..4 {
                normal[i][j] += x[i] * x[j];
            }
            normal[i][4] += x[i] * y;
        }
    }
    // Gauss-Jordan on the diagonal; the ridge keeps a term that another one holds from dividing by nothing.
    for i in 0..4 {
        normal[i][i] = normal[i][i] * (1.0 + 1e-12) + 1e-12;
        let pivot = normal[i];
        for (j, line) in normal.iter_mut().enumerate() {
            if j != i {
                let factor = line[i] / pivot[i];
                line.iter_mut().zip(pivot).for_each(|(value, p)| *value -= factor * p);
            }
        }
    }
    let weights = [0, 1, 2, 3].map(|i| normal[i][4] / normal[i][i]);
    let left = |(x, y): &([f64; 4], f64)| (y - x.iter().zip(weights).map(|(x, w)| x * w).sum::<f64>()).powi(2);
    (rows.iter().map(left).sum::<f64>() / rows.len().max(1) as f64).sqrt()
}

/// The rows of the log: up to two seconds of a machine at rest, then the run.
fn sampled(run: &Run, machine: &Machine, dice: &mut Dice) -> Vec<Sample> {
    let lead = dice.between(0.0, 2.0);
    let every = (1.0 / FINE_S) as usize / machine.rate_hz;
    let first = run.samples[0];
    let rest = Sample { station: Station { rpm: 0.0, ..first.station }, watts: 0.0, ..first };
    let mut rows = vec![rest; (lead * machine.rate_hz as f64) as usize];
    rows.extend(run.samples.iter().step_by(every));
    rows
}

/// The log as the shop would export it: noise on the meter, a clock that goes wrong by up to half a thousandth.
pub fn log(run: &Run, machine: &Machine, noise_w: f64, seed: u64) -> String {
    let mut dice = Dice::new(seed, "noise");
    let rows = sampled(run, machine, &mut dice);
    let drift = 1.0 + dice.between(-1.0, 1.0) * 5e-4;
    let mut text = String::from(if machine.forces {
        "time_s,x_mm,y_mm,z_mm,feed_mm_min,spindle_rpm,force_xy_n\n"
    } else if machine.positions {
        "time_s,x_mm,y_mm,z_mm,feed_mm_min,spindle_rpm,spindle_power_w\n"
    } else {
        "time_s,spindle_power_w\n"
    });
    for (n, sample) in rows.iter().enumerate() {
        let time = n as f64 / machine.rate_hz as f64 * drift;
        let watts = sample.watts + noise_w * dice.gauss();
        let s = &sample.station;
        if machine.positions || machine.forces {
            let feed = s.speed_mm_s * 60.0 * (1.0 + 0.003 * dice.gauss());
            let [x, y, z] = s.place.map(|v| v + 0.001 * dice.gauss());
            let _ = writeln!(text, "{time:.3},{x:.3},{y:.3},{z:.3},{feed:.1},{:.0},{watts:.1}", s.rpm);
        } else {
            let _ = writeln!(text, "{time:.3},{watts:.1}");
        }
    }
    text
}

/// The setup file: what the shop believes.
pub fn setup(job: &Job, machine: &Machine) -> String {
    let (a, v) = (machine.acceleration_mm_s2, 9000.0);
    let tare = |rpm: f64| machine.tare_w(rpm) * machine.declared[0];
    let k = &job.truth;
    let believed = |value: f64| value * machine.declared[1];
    let mut text = format!(
        "units = \"mm\"\n\n[machine]\ndialect = \"linuxcnc\"\nrapid = {v}\ncorner_tolerance = {}\nblock_time = 0.001\n\
         tool_change_time = {TOOL_CHANGE_S}\nhome = [0, 0, 50]\n\n[machine.axes]\n",
        machine.corner_tolerance_mm
    );
    for axis in ["x", "y", "z"] {
        let _ = writeln!(text, "{axis} = {{ velocity = {v}, acceleration = {a} }}");
    }
    let _ = write!(
        text,
        "\n[machine.spindle]\nmax_rpm = 24000\npower = [[0, 0], [1500, 7500], [24000, 7500]]\n\
         tare = [[1000, {:.1}], [24000, {:.1}]]\nefficiency = {:.3}\nrunup_time = {RUN_UP_S}\n",
        tare(1000.0),
        tare(24000.0),
        machine.efficiency
    );
    let _ = write!(
        text,
        "\n[stock]\nbox = {{ min = [{}, {}, {}], max = [{}, {}, {}] }}\n\n[material]\nk_tc = {:.0}\nk_te = {:.1}\n\
         k_rc = {:.0}\nk_re = {:.1}\nk_ac = {:.0}\nk_ae = 2\n",
        job.low[0],
        job.low[1],
        job.low[2],
        job.high[0],
        job.high[1],
        job.high[2],
        believed(k.k_tc),
        believed(k.k_te),
        believed(k.k_rc),
        believed(k.k_re),
        0.2 * believed(k.k_tc)
    );
    for tool in &job.tools {
        let _ = write!(
            text,
            "\n[[tool]]\nnumber = {}\nshape = \"flat\"\ndiameter = {}\nflutes = {}\nhelix = {}\nflute_length = 26\n\
             overhang = 40\nmaterial = \"carbide\"\n",
            tool.number, tool.diameter_mm, tool.flutes, tool.helix_deg
        );
    }
    text
}

/// What a person would look at to see the truth, row by row of the log: line, pass, power at the tool, reading without noise.
pub fn truth(run: &Run, job: &Job, machine: &Machine, seed: u64) -> String {
    let mut text = String::from("line,pass,cutting_w,edge_w,depth_mm,immersion_deg,reading_w\n");
    for sample in sampled(run, machine, &mut Dice::new(seed, "noise")) {
        let (s, step, load) = (&sample.station, &job.steps[sample.step], sample.load);
        let _ = writeln!(
            text,
            "{},{},{:.2},{:.2},{:.3},{:.1},{:.2}",
            step.line, step.pass, load[0], load[1], s.depth_mm, s.immersion_deg, sample.watts
        );
    }
    text
}
