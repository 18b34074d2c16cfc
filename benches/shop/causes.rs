//! What may be hidden in a machine: effects that have a name, in forms of their own, and causes that no list has.
//!
//! In: what the plain run of the program looks like, and a strength. Out: a machine that does otherwise.

use super::dice::Dice;
use super::physics::{Factors, OnElement, Runout, Station};
use super::programs::{Job, Needs};
use super::shop_floor::{Machine, Run};

/// A number that depends on where the machine is.
pub type OnStation<T> = Box<dyn Fn(&Station) -> T>;

/// A reading made of a reading.
pub type OnReading = Box<dyn Fn(f64, &Station) -> f64>;
/// A series made of a series, with the time between two values, s.
pub type OnSeries = Box<dyn Fn(&[f64], f64) -> Vec<f64>>;

/// Stock that does not stand as it should.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stock {
    /// How far each face stands proud, mm: −x, +x, −y, +y, top.
    pub faces: [f64; 5],
    pub shift: [f64; 3],
    /// Turn about the vertical through its middle, rad.
    pub turn: f64,
    /// How much higher its top is in the half towards +x, mm: a step, as two pieces clamped side by side have.
    pub half: f64,
    /// By how much the top rises towards +x and +y about its middle, mm/mm.
    pub slope: [f64; 2],
}

/// Everything in which a machine differs from the plain one.
pub struct Hidden {
    pub stock: Stock,
    /// True minus declared diameter, mm.
    pub diameter_mm: f64,
    pub runout: Runout,
    /// How far the tool's tip has moved in z at a time, mm.
    pub z_growth: Option<Box<dyn Fn(f64) -> f64>>,
    pub elements: Vec<OnElement>,
    pub stations: Vec<OnStation<Factors>>,
    /// Factors on the tare.
    pub tares: Vec<OnStation<f64>>,
    /// Reading from reading.
    pub drives: Vec<OnReading>,
    pub extra_w: Vec<OnStation<f64>>,
    /// What the meter makes of a whole series with this time between two values, s.
    pub meters: Vec<OnSeries>,
    pub override_at: Option<Box<dyn Fn(f64) -> f64>>,
    /// Feed holds: when, how long, s.
    pub holds: Vec<[f64; 2]>,
    pub settle_s: f64,
    /// True over declared acceleration.
    pub acceleration: f64,
    /// When a fresh edge is put in, s.
    pub fresh_edge_at: Vec<f64>,
}

impl Default for Hidden {
    fn default() -> Self {
        Self {
            stock: Stock::default(),
            diameter_mm: 0.0,
            runout: Runout::default(),
            z_growth: None,
            elements: Vec::new(),
            stations: Vec::new(),
            tares: Vec::new(),
            drives: Vec::new(),
            extra_w: Vec::new(),
            meters: Vec::new(),
            override_at: None,
            holds: Vec::new(),
            settle_s: 0.0,
            acceleration: 1.0,
            fresh_edge_at: Vec::new(),
        }
    }
}

/// What a cause needs to know of the plain run to be felt in it.
pub struct Scene {
    /// Times at which something is cut, in order, s.
    cutting_s: Vec<f64>,
    /// Greatest reading and mean cutting power, W at the meter.
    peak_w: f64,
    mean_w: f64,
    /// Way that each tooth slides in all, m (the greatest of the tools).
    slid_m: f64,
    /// Corners of the part, mm.
    low: [f64; 3],
    high: [f64; 3],
    /// Speeds at which is cut, rpm, in order, and their cutting speeds, m/s.
    rpm: Vec<f64>,
    speeds: Vec<f64>,
    /// Depths of cut in order, mm, one for each sample that cuts.
    depths: Vec<f64>,
    /// Passes that cut, with how long they cut, s.
    passes: Vec<(usize, f64)>,
}

impl Scene {
    /// Looks at a plain run.
    pub fn new(job: &Job, plain: &Run, machine: &Machine) -> Self {
        let cutting = || plain.samples.iter().filter(|s| s.station.immersion_deg > 3.0);
        let load = |step: usize| (plain.loads[step][0] + plain.loads[step][1]) / machine.efficiency;
        let sorted = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values
        };
        let mut rpm = sorted(cutting().map(|s| s.station.rpm).collect());
        rpm.dedup();
        let mut speeds = sorted(cutting().map(|s| surface_speed(&s.station)).collect());
        speeds.dedup();
        let mut passes: Vec<(usize, f64)> = Vec::new();
        for sample in cutting() {
            match passes.last_mut() {
                Some(last) if last.0 == sample.station.pass => last.1 += 0.01,
                _ => passes.push((sample.station.pass, 0.01)),
            }
        }
        let watts = sorted(cutting().map(|s| s.watts).collect());
        Self {
            cutting_s: cutting().map(|s| s.station.time_s).collect(),
            peak_w: watts[watts.len() * 99 / 100],
            mean_w: cutting().map(|s| load(s.step)).sum::<f64>() / cutting().count() as f64,
            slid_m: plain.samples.iter().map(|s| s.station.slid_m).fold(0.0, f64::max),
            low: job.low,
            high: job.high,
            rpm,
            speeds,
            depths: sorted(cutting().map(|s| s.station.depth_mm).collect()),
            passes,
        }
    }

    /// A time by which this share of all cutting is done, s.
    fn when(&self, share: f64) -> f64 {
        self.cutting_s[(share * (self.cutting_s.len() - 1) as f64) as usize]
    }

    fn depth(&self, share: f64) -> f64 {
        self.depths[(share * (self.depths.len() - 1) as f64) as usize]
    }
}

/// Speed of the teeth, m/s.
pub fn surface_speed(at: &Station) -> f64 {
    at.rpm / 60.0 * std::f64::consts::TAU * at.radius_mm / 1000.0
}

/// What the answer should be.
#[derive(Clone, Copy, Debug)]
pub enum Truth {
    /// Nothing is hidden.
    Plain,
    /// Effects by their names on the list.
    Named(&'static [&'static str]),
    /// No name on the list; covariates that carry it, any of which is right.
    Unlisted(&'static [&'static str]),
}

/// Something that may be hidden.
pub struct Cause {
    pub name: &'static str,
    pub truth: Truth,
    /// Names that are neither asked for nor false: they say a part of what is so.
    pub tolerated: &'static [&'static str],
    /// Names that say the same of these data as the covariate: as good an answer, and no false one.
    pub equivalent: &'static [&'static str],
    pub needs: Needs,
    /// What is built in, one or two of `PARTS`.
    pub parts: &'static [&'static str],
    /// Some causes show with time and power alone only: with positions the log says them outright.
    pub only_without_positions: bool,
    /// The log holds the peak force in the plane, not the power.
    pub forces: bool,
    /// A table of steady cuts, not a log.
    pub table: bool,
    /// Whether it also acts in another program: an effect does, a moment of this run does not.
    pub carries_over: bool,
}

const fn named(name: &'static str, needs: Needs, names: &'static [&'static str]) -> Cause {
    Cause {
        name,
        truth: Truth::Named(names),
        tolerated: &[],
        equivalent: &[],
        needs,
        parts: names,
        only_without_positions: false,
        forces: false,
        table: false,
        carries_over: true,
    }
}

const fn unlisted(
    name: &'static str,
    needs: Needs,
    parts: &'static [&'static str],
    covariates: &'static [&'static str],
    tolerated: &'static [&'static str],
    carries_over: bool,
) -> Cause {
    Cause {
        name,
        truth: Truth::Unlisted(covariates),
        tolerated,
        equivalent: &[],
        needs,
        parts,
        only_without_positions: false,
        forces: false,
        table: false,
        carries_over,
    }
}

/// All of them: nothing, each listed effect, causes that no list has, pairs of listed effects.
pub fn all() -> Vec<Cause> {
    let plain = Cause {
        name: "plain",
        truth: Truth::Plain,
        tolerated: &[],
        equivalent: &[],
        needs: Needs::Any,
        parts: &[],
        only_without_positions: false,
        forces: false,
        table: false,
        carries_over: true,
    };
    let mut causes = vec![
        plain,
        named("flank-wear", Needs::Any, &["flank-wear"]),
        named("edge-chipping", Needs::Any, &["edge-chipping"]),
        named("size-effect", Needs::Any, &["size-effect"]),
        named("cutting-speed", Needs::Speeds, &["cutting-speed"]),
        named("edge-position", Needs::Light, &["edge-position"]),
        named("up-down-asymmetry", Needs::Any, &["up-down-asymmetry"]),
        named("entry", Needs::Entries, &["entry"]),
        named("hard-zone", Needs::Any, &["hard-zone"]),
        named("stock-proud", Needs::Any, &["stock-proud"]),
        named("tool-diameter", Needs::Light, &["tool-diameter"]),
        named("corner-feed", Needs::Corners, &["corner-feed"]),
        named("tare-warm-up", Needs::Any, &["tare-warm-up"]),
        named("tare-speed", Needs::Speeds, &["tare-speed"]),
        named("axis-power", Needs::Corners, &["axis-power"]),
        named("drive-efficiency", Needs::Any, &["drive-efficiency"]),
        named("sensor-lag", Needs::Any, &["sensor-lag"]),
        unlisted("override", Needs::Any, &["override"], &["feed", "time"], &[], false),
        unlisted("feed-hold", Needs::Any, &["feed-hold"], &["feed", "time"], &[], false),
        unlisted("saturation", Needs::Any, &["saturation"], &["power"], &[], true),
        unlisted("gearbox", Needs::Speeds, &["gearbox"], &["speed"], &["tare-speed"], true),
        unlisted("layers-z", Needs::Any, &["layers-z"], &["z", "depth"], &["hard-zone"], true),
        unlisted("recutting", Needs::Any, &["recutting"], &["immersion"], &[], true),
        unlisted("growth-z", Needs::Light, &["growth-z"], &["time", "depth", "z"], &[], true),
        unlisted("coolant-pulses", Needs::Any, &["coolant-pulses"], &["time"], &[], true),
        unlisted("new-edge", Needs::Any, &["new-edge"], &["time", "sliding", "tool"], &["flank-wear"], false),
        unlisted(
            "notch-wear",
            Needs::Light,
            &["notch-wear"],
            &["depth", "sliding", "time"],
            &["flank-wear", "edge-position"],
            true,
        ),
        unlisted("chatter", Needs::Speeds, &["chatter"], &["speed", "depth", "immersion"], &[], true),
        unlisted("regeneration", Needs::Corners, &["regeneration"], &["acceleration"], &["axis-power"], true),
        unlisted("by-tool", Needs::TwoTools, &["by-tool"], &["tool"], &[], true),
        unlisted("direction", Needs::Any, &["direction"], &["direction"], &[], true),
        unlisted("odd-passes", Needs::Any, &["odd-passes"], &["pass", "line", "time"], &[], false),
        unlisted("coolant-off", Needs::Any, &["coolant-off"], &["time"], &[], false),
        named("wear+proud", Needs::Any, &["flank-wear", "stock-proud"]),
        named("wear+up-down", Needs::Any, &["flank-wear", "up-down-asymmetry"]),
        named("wear+tare-speed", Needs::Speeds, &["flank-wear", "tare-speed"]),
        named("lag+up-down", Needs::Any, &["sensor-lag", "up-down-asymmetry"]),
        named("zone+warm-up", Needs::Any, &["hard-zone", "tare-warm-up"]),
        named("zone+up-down", Needs::Any, &["hard-zone", "up-down-asymmetry"]),
        named("diameter+drive", Needs::Light, &["tool-diameter", "drive-efficiency"]),
        named("chipping+warm-up", Needs::Any, &["edge-chipping", "tare-warm-up"]),
        named("entry+proud", Needs::Entries, &["entry", "stock-proud"]),
        named("speed+axis-power", Needs::Speeds, &["cutting-speed", "axis-power"]),
    ];
    causes.extend(in_tables());
    // A seed counts causes by their place: new ones come last, so that the logs of the others stay what they are.
    causes.push(named("runout", Needs::Any, &["runout"]));
    for cause in &mut causes {
        cause.forces = cause.name == "runout";
        cause.equivalent = match cause.name {
            // A harder layer is a harder region.
            "layers-z" => &["hard-zone"],
            // With one diameter, the speed of the spindle is the cutting speed.
            "gearbox" | "table:gearbox" => &["cutting-speed"],
            _ => &[],
        };
        cause.only_without_positions = cause.name == "corner-feed";
        // The time of the chipping belongs to this run.
        cause.carries_over &= !cause.parts.contains(&"edge-chipping");
    }
    causes
}

/// The same in tables of steady cuts.
fn in_tables() -> Vec<Cause> {
    let named = |name, names| Cause { table: true, ..named(name, Needs::Any, names) };
    let unlisted = |name, parts, covariates, tolerated| Cause {
        table: true,
        ..unlisted(name, Needs::Any, parts, covariates, tolerated, true)
    };
    vec![
        Cause { truth: Truth::Plain, ..named("table:plain", &[]) },
        named("table:wear", &["flank-wear"]),
        named("table:up-down", &["up-down-asymmetry"]),
        named("table:size", &["size-effect"]),
        named("table:speed", &["cutting-speed"]),
        named("table:position", &["edge-position"]),
        named("table:curvature", &["path-curvature"]),
        named("table:drive", &["drive-efficiency"]),
        unlisted("table:saturation", &["saturation"], &["power"], &[]),
        unlisted("table:gearbox", &["gearbox"], &["speed"], &["tare-speed"]),
        unlisted("table:set-up-tare", &["set-up-tare"], &["group", "time"], &["tare-warm-up"]),
    ]
}

/// Wear of a flank over the share of its life, 0 to 1: running in, steady, fast (the three phases of tool-life tests,
/// ISO 8688-2), scaled to 1 at the end.
pub fn three_phases(share: f64) -> f64 {
    let law = |x: f64| 0.35 * (1.0 - (-x / 0.06).exp()) + 0.4 * x + 0.25 * ((x - 1.0) / 0.12).exp();
    (law(share) - law(0.0)) / (law(1.0) - law(0.0))
}

/// Smooth step from 0 to 1 around `at`.
pub fn step(x: f64, at: f64, width: f64) -> f64 {
    0.5 * (1.0 + ((x - at) / width).tanh())
}

/// Least strength worth the name: a hold of seconds, corners that settle in a tenth of a second, a lag that a shop would
/// see. The sharp transients of these stand above the noise long before.
pub fn least_strength(part: &str) -> f64 {
    match part {
        "feed-hold" => 1.0,
        "corner-feed" | "sensor-lag" | "override" => 0.5,
        _ => 0.02,
    }
}

/// Hides one part in the machine, at a strength around 1.
pub fn hide(part: &str, s: f64, scene: &Scene, dice: &mut Dice, hidden: &mut Hidden) {
    if !(listed(part, s, scene, dice, hidden)
        || on_the_machine(part, s, scene, dice, hidden)
        || in_the_cut(part, s, scene, dice, hidden))
    {
        panic!("no cause of the name {part}");
    }
}

/// Effects of the list, in forms of their own.
fn listed(part: &str, s: f64, scene: &Scene, dice: &mut Dice, hidden: &mut Hidden) -> bool {
    match part {
        // Edge and cutting coefficients grow in three phases, with a share of their own.
        "flank-wear" => {
            let (life, share) = (scene.slid_m, dice.between(0.2, 0.6));
            hidden.stations.push(Box::new(move |at| {
                let worn = s * three_phases(at.slid_m / life);
                [1.0 + 0.7 * share * worn, 1.0 + 0.7 * worn]
            }));
        }
        // A break, and a border that crumbles on for a while.
        "edge-chipping" => {
            let (share, more) = (dice.between(0.3, 0.7), dice.between(0.2, 0.5));
            let edge = dice.between(0.5, 1.5);
            let when = scene.when(share);
            hidden.stations.push(Box::new(move |at| {
                let since = at.time_s - when;
                let jump = if since < 0.0 { 0.0 } else { 0.2 * s * (1.0 + more * (1.0 - (-since / 40.0).exp())) };
                [1.0 + jump, 1.0 + edge * jump]
            }));
        }
        // k_tc goes from one level for thin chips to a lower one for thick chips (the shape of Ko, Yun and Cho's K_n).
        "size-effect" => {
            let thin = dice.between(0.02, 0.045);
            hidden.elements.push(Box::new(move |_, e| [1.0 + 0.5 * s * (1.0 - step(e.chip_mm, thin, 0.012)), 1.0]));
        }
        // Built-up edge below, heat above: a parabola with its optimum inside the range.
        "cutting-speed" => {
            let (least, most) = (scene.speeds[0], scene.speeds[scene.speeds.len() - 1]);
            let best = least + (most - least) * dice.between(0.25, 0.75);
            hidden.stations.push(Box::new(move |at| {
                let off = (surface_speed(at) - best) / (most - least).max(1e-9);
                [1.0 + 0.9 * s * off * off, 1.0 + 0.5 * s * off * off]
            }));
        }
        // The land at the tip (a chamfered corner) cuts harder than the edge above.
        "edge-position" => {
            let land = scene.depth(0.3).max(0.4) * dice.between(0.5, 1.0);
            hidden.elements.push(Box::new(move |_, e| {
                let tip = 1.0 - step(e.above_tip_mm, land, 0.15);
                [1.0 + 0.5 * s * tip, 1.0 + 0.5 * s * tip]
            }));
        }
        // By where the tooth is: harder where the chip thickens, easier where it thins.
        "up-down-asymmetry" => {
            let sign = dice.sign();
            hidden.elements.push(Box::new(move |_, e| {
                let up = sign * s * e.phi.cos();
                [(1.0 + 0.2 * up).max(0.1), (1.0 + 0.1 * up).max(0.1)]
            }));
        }
        // A spike at entry that dies with the square of the way.
        "entry" => {
            let length = dice.between(2.0, 6.0);
            hidden.stations.push(Box::new(move |at| {
                let spike = 0.6 * s / (1.0 + (at.since_entry_mm / length).powi(2));
                [1.0 + spike, 1.0 + 0.5 * spike]
            }));
        }
        // A turned ellipse with a blurred border, where the cut is.
        "hard-zone" => {
            let size = [0, 1].map(|k| (scene.high[k] - scene.low[k]) * dice.between(0.16, 0.3));
            let middle = [0, 1].map(|k| scene.low[k] + (scene.high[k] - scene.low[k]) * dice.between(0.3, 0.7));
            let (sin, cos) = dice.between(0.0, 1.5).sin_cos();
            let border = dice.between(0.1, 0.25);
            hidden.elements.push(Box::new(move |_, e| {
                let (x, y) = (e.place[0] - middle[0], e.place[1] - middle[1]);
                let r = ((cos * x + sin * y) / size[0]).hypot((cos * y - sin * x) / size[1]);
                let inside = 0.3 * s * (1.0 - step(r, 1.0, border));
                [1.0 + inside, 1.0 + inside]
            }));
        }
        // One face, or a zero point that is shifted or turned.
        "stock-proud" => match dice.pick(&[0, 1, 2, 3, 4, 5, 6]) {
            face @ 0..=4 => hidden.stock.faces[face] += 0.6 * s,
            5 => {
                let angle = dice.between(0.0, std::f64::consts::TAU);
                hidden.stock.shift = [0.5 * s * angle.cos(), 0.5 * s * angle.sin(), 0.0];
            }
            _ => hidden.stock.turn = dice.sign() * 0.008 * s,
        },
        // Seen by a plate that measures force: the mean power of the teeth hardly changes.
        "runout" => hidden.runout = Runout { offset_mm: 0.008 * s, angle: dice.between(-0.6, 0.6) },
        "tool-diameter" => hidden.diameter_mm = -0.3 * s,
        // The control stops in every corner until the position has settled.
        "corner-feed" => hidden.settle_s = 0.2 * s,
        // Two time constants: bearings and grease.
        "tare-warm-up" => {
            let (fast, slow, share) = (dice.between(15.0, 40.0), dice.between(120.0, 300.0), dice.between(0.3, 0.7));
            hidden.tares.push(Box::new(move |at| {
                1.0 + 0.5 * s * (share * (-at.time_s / fast).exp() + (1.0 - share) * (-at.time_s / slow).exp())
            }));
        }
        // A belt that hums at one speed.
        "tare-speed" => {
            let n = scene.rpm.len();
            let hum = scene.rpm[dice.pick(&[0, n / 2, n - 1])];
            let width = (scene.rpm[n - 1] - scene.rpm[0]).max(500.0) * 0.15;
            hidden.tares.push(Box::new(move |at| 1.0 + 0.4 * s * (-((at.rpm - hum) / width).powi(2)).exp()));
        }
        // Stick, viscous friction and the force of acceleration, all on the meter.
        "axis-power" => {
            let (stick, mass) = (dice.between(0.1, 0.3), dice.between(0.5e-4, 2e-4));
            let unit = scene.mean_w * s;
            hidden.extra_w.push(Box::new(move |at| {
                let v = at.speed_mm_s;
                let push = (mass * at.acceleration_mm_s2 * v).max(0.0);
                unit * (stick * (v / 4.0).tanh() + 0.006 * v + 0.02 * push)
            }));
        }
        // No loss up to a knee, then more and more.
        "drive-efficiency" => {
            let (knee, peak) = (scene.peak_w * dice.between(0.25, 0.45), scene.peak_w);
            hidden.drives.push(Box::new(move |watts, _| {
                let above = ((watts - knee) / (peak - knee)).max(0.0);
                watts + 0.35 * s * (peak - knee) * above.powf(1.5)
            }));
        }
        // Two lags behind one another, and a dead time.
        "sensor-lag" => {
            let (first, second, dead) = (0.25 * s, 0.15 * s, 0.05 * s);
            hidden.meters.push(Box::new(move |watts, dt| {
                let shift = (dead / dt) as usize;
                let late = (0..watts.len()).map(|i| watts[i.saturating_sub(shift)]);
                let (mut a, mut b) = (watts[0], watts[0]);
                late.map(|value| {
                    a += (value - a) * (1.0 - (-dt / first).exp());
                    b += (a - b) * (1.0 - (-dt / second).exp());
                    b
                })
                .collect()
            }));
        }
        _ => return false,
    }
    true
}

/// Causes without a name that sit in the machine, its drive or its operator.
fn on_the_machine(part: &str, s: f64, scene: &Scene, dice: &mut Dice, hidden: &mut Hidden) -> bool {
    match part {
        // Turned down for some minutes.
        "override" => {
            let (begin, share) = (dice.between(0.2, 0.45), (1.0 - 0.3 * s).max(0.25));
            let (from, to) = (scene.when(begin), scene.when(begin + 0.3));
            let ratio = (share * 20.0).round() / 20.0;
            hidden.override_at = Some(Box::new(move |time| if time >= from && time < to { ratio } else { 1.0 }));
        }
        "feed-hold" => {
            let begin = dice.between(0.2, 0.7);
            hidden.holds.push([scene.when(begin), dice.between(10.0, 20.0) * s]);
        }
        "saturation" => {
            let ceiling = scene.peak_w * (1.0 - 0.25 * s).max(0.2);
            hidden.meters.push(Box::new(move |watts, _| watts.iter().map(|w| w.min(ceiling)).collect()));
        }
        // Above the shift the gear takes its share.
        "gearbox" => {
            let n = scene.rpm.len();
            let shift = 0.5 * (scene.rpm[(n - 1) / 2] + scene.rpm[n / 2 + n % 2 - usize::from(n < 2)]) + 1.0;
            hidden.drives.push(Box::new(move |watts, at| if at.rpm > shift { watts * (1.0 + 0.2 * s) } else { watts }));
        }
        // The spindle grows downwards as it warms.
        "growth-z" => {
            let slow = dice.between(60.0, 200.0);
            hidden.z_growth = Some(Box::new(move |time| -0.2 * s * (1.0 - (-time / slow).exp())));
        }
        // A pump that shares the supply, on for a part of each period.
        "coolant-pulses" => {
            let (period, duty) = (dice.between(12.0, 30.0), dice.between(0.3, 0.6));
            let watts = scene.mean_w * 0.15 * s;
            hidden.extra_w.push(Box::new(move |at| if (at.time_s / period).fract() < duty { watts } else { 0.0 }));
        }
        // The meter stands before all drives: axes that brake give back, m a v.
        "regeneration" => {
            let mass = scene.mean_w * s * 4e-6;
            hidden.extra_w.push(Box::new(move |at| mass * at.acceleration_mm_s2.min(0.0) * at.speed_mm_s));
        }
        _ => return false,
    }
    true
}

/// Causes without a name that sit in tool, material and cut.
fn in_the_cut(part: &str, s: f64, scene: &Scene, dice: &mut Dice, hidden: &mut Hidden) -> bool {
    match part {
        "layers-z" => {
            let skin = -dice.between(1.5, 3.5);
            hidden.elements.push(Box::new(move |_, e| {
                let below = 1.0 - step(e.place[2], skin, 0.2);
                [1.0 + 0.25 * s * below, 1.0 + 0.25 * s * below]
            }));
        }
        // Chips that cannot leave a slot or pocket are cut again.
        "recutting" => hidden.stations.push(Box::new(move |at| {
            let again = 0.25 * s * step(at.immersion_deg, 140.0, 10.0);
            [1.0 + again, 1.0 + again]
        })),
        // Wear, and a fresh edge in the middle of the program, which the text does not show.
        "new-edge" => {
            let at_share = dice.between(0.4, 0.7);
            let life = scene.slid_m * at_share;
            hidden.fresh_edge_at.push(scene.when(at_share));
            hidden.stations.push(Box::new(move |at| {
                let worn = 0.5 * s * (at.slid_m / life);
                [1.0 + 0.5 * worn, 1.0 + worn]
            }));
        }
        // A notch at the height where the skin of a common depth runs.
        "notch-wear" => {
            let (notch, life) = (scene.depth(0.6), scene.slid_m);
            hidden.elements.push(Box::new(move |at, e| {
                let there = (-((e.above_tip_mm - notch) / 0.5).powi(2)).exp();
                let worn = s * there * at.slid_m / life;
                [1.0 + 1.5 * worn, 1.0 + 4.0 * worn]
            }));
        }
        // Above a depth, at speeds between two lobes.
        "chatter" => {
            let n = scene.rpm.len();
            let (rpm, width) = (scene.rpm[n / 2], (scene.rpm[n - 1] - scene.rpm[0]).max(500.0) * 0.2);
            let limit = scene.depth(0.4);
            hidden.stations.push(Box::new(move |at| {
                let more = 0.35 * s * (-((at.rpm - rpm) / width).powi(2)).exp() * step(at.depth_mm, limit, 0.2);
                [1.0 + more, 1.0 + more]
            }));
        }
        "by-tool" => hidden.stations.push(Box::new(move |at| if at.tool == 1 { [1.0 + 0.3 * s; 2] } else { [1.0; 2] })),
        // The spindle leans: one way along x is harder than the other.
        "direction" => {
            let sign = dice.sign();
            hidden.stations.push(Box::new(move |at| [(1.0 + 0.2 * s * sign * at.along[0]).max(0.1); 2]));
        }
        // A few passes beside each other with chips under the tool.
        "odd-passes" => {
            let wanted = scene.passes.iter().map(|pass| pass.1).sum::<f64>() * 0.08;
            let first = (scene.passes.len() as f64 * dice.between(0.2, 0.7)) as usize;
            let mut last = first;
            let mut time = 0.0;
            while last + 1 < scene.passes.len() && time < wanted {
                time += scene.passes[last].1;
                last += 1;
            }
            let range = scene.passes[first].0..scene.passes[last].0;
            hidden
                .stations
                .push(Box::new(move |at| if range.contains(&at.pass) { [1.0 + 0.4 * s; 2] } else { [1.0; 2] }));
        }
        "coolant-off" => {
            let begin = dice.between(0.2, 0.5);
            let (from, to) = (scene.when(begin), scene.when(begin + 0.25));
            hidden.stations.push(Box::new(move |at| {
                if at.time_s >= from && at.time_s < to { [1.0 + 0.2 * s, 1.0 + 0.4 * s] } else { [1.0; 2] }
            }));
        }
        _ => return false,
    }
    true
}
