//! Effects that no setup declares, and what they do to a cut. In: names, a part, dice; stations. Out: effects of a drawn size,
//! factors on the coefficients, sums over a station.
//!
//! Effects, with their own formulas (not those of the program under test):
//!
//! | effect | formula |
//! |---|---|
//! | flank-wear | k_e·(1 + g·w(x)), w = 0.35(1 − e^(−x/0.08)) + 0.5x + 0.2x⁶ (run-in, steady, end), x = share of the sliding |
//! | tare-warm-up | tare·(1 + c e^(−t/τ)) |
//! | tare-speed | tare + c·tare_top·((n/n_top)^p − (n_low/n_top)^p) |
//! | size-effect | k_tc·(h/0.05)^−m at every angle |
//! | up-down-asymmetry | k·(1 + c) where the chip grows (φ < π/2), k·(1 − c) where it shrinks |
//! | runout | tooth i stands out by ρ cos(α − 2πi/N); h is cut down to the deepest of the teeth before it |
//! | stock-proud, tool-diameter | the engagement is found again |
//! | corner-feed | the timeline is found again with less acceleration |
//! | drive-efficiency | η = η₀·(1 − c P/P_top) |
//! | sensor-lag | T ẏ + y = P |
//! | hard-zone | k·(1 + c u), u = 1/(1 + ((x−x₀)/a)⁸ + ((y−y₀)/b)⁸), at the place of the cutting edge |
//! | entry | k·(1 + c (1 − s/l)²) over the first l of the way s since the tool met material |
//! | axis-power | + X v/v_rapid, and + Y v a/(v_rapid a_top) while the axes accelerate |
//! | edge-chipping | from t₀: k_c·(1 + c), k_e·(1 + c/2) |
//! | coolant-pump (unlisted) | + X while the pump is on, period and duty |
//! | rolling-direction (unlisted) | k·(1 + c cos 2(γ − γ₀)), γ the direction of the feed |
//! | chiller (unlisted) | + X sin(2πt/period) |

use super::cut::{Station, contact_point};
use super::programs::Part;
use super::rng::Rng;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// An effect that the setup does not declare; see the head of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)]
pub enum Hidden {
    FlankWear { growth: f64 },
    TareWarmUp { excess: f64, tau_s: f64 },
    TareSpeed { share: f64, power: f64 },
    SizeEffect { exponent: f64 },
    UpDown { share: f64 },
    Runout { offset_mm: f64, angle: f64 },
    StockProud { top_mm: f64, side_mm: f64 },
    ToolDiameter { change_mm: f64 },
    CornerFeed { acceleration: f64 },
    DriveEfficiency { loss: f64 },
    SensorLag { time_s: f64 },
    HardZone { excess: f64, centre: [f64; 2], half: [f64; 2] },
    EdgeChipping { jump: f64, at_share: f64 },
    Entry { excess: f64, length_mm: f64 },
    AxisPower { friction: f64, acceleration: f64 },
    CoolantPump { share: f64, period_s: f64, duty: f64 },
    RollingDirection { share: f64, angle: f64 },
    Chiller { share: f64, period_s: f64 },
}

/// Singles in the list of effects, in the order of the rows.
pub const LISTED: [&str; 15] = [
    "flank-wear",
    "tare-warm-up",
    "tare-speed",
    "size-effect",
    "up-down-asymmetry",
    "runout",
    "stock-proud",
    "tool-diameter",
    "corner-feed",
    "drive-efficiency",
    "sensor-lag",
    "hard-zone",
    "edge-chipping",
    "entry",
    "axis-power",
];

/// Effects in no list. The last two are kept for checking: nothing was developed against them.
pub const UNLISTED: [&str; 3] = ["coolant-pump", "rolling-direction", "chiller"];

impl Hidden {
    /// An effect of this name, of usual size times `strength`.
    pub fn draw(name: &str, strength: f64, part: &Part, rng: &mut Rng) -> Self {
        let [length, width, _] = part.stock_mm;
        let d = part.mill.diameter_mm;
        let mut size = |low: f64, high: f64| strength * rng.uniform(low, high);
        match name {
            "flank-wear" => Self::FlankWear { growth: size(0.8, 1.8) },
            "tare-warm-up" => Self::TareWarmUp { excess: size(0.3, 0.7), tau_s: rng.uniform(70.0, 180.0) },
            "tare-speed" => Self::TareSpeed { share: size(0.3, 0.6), power: rng.uniform(1.2, 2.2) },
            "size-effect" => Self::SizeEffect { exponent: size(0.15, 0.3) },
            "up-down-asymmetry" => Self::UpDown { share: size(0.06, 0.14) * rng.sign() },
            "runout" => Self::Runout { offset_mm: size(0.008, 0.02), angle: rng.uniform(0.0, TAU) },
            "stock-proud" => {
                let (top, side) = rng.pick(&[(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]);
                let mm = strength * rng.uniform(0.35, 0.9);
                Self::StockProud { top_mm: top * mm, side_mm: side * 1.3 * mm }
            }
            "tool-diameter" => Self::ToolDiameter { change_mm: -size(0.03, 0.06) * d },
            "corner-feed" => Self::CornerFeed { acceleration: (rng.uniform(0.03, 0.1) / strength).min(1.0) },
            "drive-efficiency" => Self::DriveEfficiency { loss: size(0.12, 0.25).min(0.6) },
            "sensor-lag" => Self::SensorLag { time_s: size(0.4, 1.5) },
            "hard-zone" => Self::HardZone {
                excess: size(0.15, 0.35),
                centre: [length * rng.uniform(0.25, 0.75), width * rng.uniform(0.3, 0.7)],
                half: [length * rng.uniform(0.14, 0.24), width * rng.uniform(0.16, 0.28)],
            },
            "edge-chipping" => Self::EdgeChipping { jump: size(0.12, 0.3), at_share: rng.uniform(0.3, 0.7) },
            "entry" => Self::Entry { excess: size(0.4, 0.9), length_mm: rng.uniform(8.0, 16.0) },
            "axis-power" => Self::AxisPower { friction: size(0.4, 0.8), acceleration: size(0.4, 0.8) },
            "coolant-pump" => Self::CoolantPump {
                share: size(0.15, 0.3),
                period_s: rng.uniform(5.0, 13.0),
                duty: rng.uniform(0.35, 0.65),
            },
            "rolling-direction" => Self::RollingDirection { share: size(0.08, 0.15), angle: rng.uniform(0.0, 0.4) },
            "chiller" => Self::Chiller { share: size(0.15, 0.3), period_s: rng.uniform(40.0, 90.0) },
            _ => panic!("no effect is called {name}"),
        }
    }
}

/// Way since material was met, station by station; a step that cuts nothing ends it.
pub fn since_entry(stations: &[Vec<Station>]) -> Vec<Vec<f64>> {
    let mut way = 0.0;
    let mut of_step = |step: &Vec<Station>| {
        let mut last = 0.0;
        let mut next = |s: &Station| {
            way = if s.arcs.is_empty() { 0.0 } else { way + s.s_mm - last };
            last = s.s_mm;
            way
        };
        let ways: Vec<f64> = step.iter().map(&mut next).collect();
        if step.is_empty() {
            way = 0.0;
        }
        ways
    };
    stations.iter().map(&mut of_step).collect()
}

/// Run-in, steady wear, end of life.
pub fn wear(x: f64) -> f64 {
    0.35 * (1.0 - (-x / 0.08).exp()) + 0.5 * x + 0.2 * x.powi(6)
}

/// Exponent of the chip's size, 0 without that effect.
pub fn size_exponent(hidden: &[Hidden]) -> f64 {
    hidden.iter().map(|h| if let Hidden::SizeEffect { exponent } = h { *exponent } else { 0.0 }).sum()
}

/// ∫∫ c·sin^(1−m) φ r dφ dz, ∫∫ e r dφ dz, and the way a tooth slides in one turn (mean over the height).
pub fn terms(station: &Station, radius_mm: f64, hidden: &[Hidden]) -> [f64; 3] {
    const POINTS: usize = 16;
    let power = 1.0 - size_exponent(hidden);
    let (mut q, mut a, mut way, mut height) = (0.0, 0.0, 0.0, 0.0);
    for arc in &station.arcs {
        // Halves that end at π/2, where a factor may jump.
        for [from, to] in halves(arc.phi) {
            let step = (to - from) / POINTS as f64;
            for k in 0..POINTS {
                let phi = from + (k as f64 + 0.5) * step;
                let (c, e) = local_factors(station, phi, radius_mm, hidden);
                q += c * phi.sin().powf(power) * radius_mm * step * arc.dz_mm;
                a += e * radius_mm * step * arc.dz_mm;
            }
        }
        way += radius_mm * (arc.phi[1] - arc.phi[0]) * arc.dz_mm;
        height += arc.dz_mm;
    }
    [q, a, if height > 0.0 { way / height } else { 0.0 }]
}

fn halves([from, to]: [f64; 2]) -> [[f64; 2]; 2] {
    let middle = FRAC_PI_2.clamp(from, to);
    [[from, middle], [middle, to]]
}

/// Factors on the cutting and edge coefficients at one angle of one station.
pub fn local_factors(station: &Station, phi: f64, radius_mm: f64, hidden: &[Hidden]) -> (f64, f64) {
    let mut factor = 1.0;
    for effect in hidden {
        match effect {
            Hidden::UpDown { share } => factor *= 1.0 + share * (FRAC_PI_2 - phi).signum(),
            Hidden::HardZone { excess, centre, half } => {
                let p = contact_point(station, phi, radius_mm);
                let far: f64 = (0..2).map(|k| ((p[k] - centre[k]) / half[k]).powi(8)).sum();
                factor *= 1.0 + excess / (1.0 + far);
            }
            Hidden::RollingDirection { share, angle } => {
                let [dx, dy] = station.direction;
                factor *= 1.0 + share * (2.0 * (dy.atan2(dx) - angle)).rem_euclid(2.0 * PI).cos();
            }
            _ => {}
        }
    }
    (factor, factor)
}
