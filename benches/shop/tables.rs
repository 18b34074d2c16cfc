//! Tables of steady cuts from hidden machines, for `feedwright learn-table`.
//!
//! In: a seed, what is hidden and how strongly. Out: the table as CSV, its setup, and its error against the plain model.
//!
//! Four set-ups, each a block clamped anew, with cuts of differing depth, width, side, feed and speed in a random order. The arc
//! of contact is that of a straight or round path: with the tool's centre on a circle of radius ρ and a wall left at ρ ± R, the
//! tooth meets material until it comes to the wall of the pass before, ρ ± (R − a_e): cos α = (w² − ρ² − R²)/(± 2 ρ R).

use std::f64::consts::PI;
use std::fmt::Write as _;

use super::causes::{step, surface_speed, three_phases};
use super::dice::Dice;
use super::engagement::{RIM, rim_angle};
use super::physics::{Coefficients, Factors, OnElement, Runout, Station, power};

/// Which way the tool goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    Up,
    Climb,
    Slot,
}

/// One steady cut.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    group: usize,
    order: usize,
    depth_mm: f64,
    width_mm: f64,
    side: Side,
    /// Of the tool's centre, concave above zero, convex below, straight at zero, mm.
    path_radius_mm: f64,
    feed_mm_min: f64,
    rpm: f64,
}

/// A table, and how it came about.
pub struct Table {
    pub text: String,
    pub setup: String,
    pub noise_w: f64,
    /// Error of the best plain model over the noise.
    pub seen: f64,
}

/// Factors on a cut.
type OnCut = Box<dyn Fn(&Station, &Cut) -> Factors>;
/// A reading made of a reading.
type OnReading = Box<dyn Fn(f64, &Cut) -> f64>;

/// What is not plain in the table's machine.
#[derive(Default)]
struct Twist {
    elements: Vec<OnElement>,
    station: Option<OnCut>,
    /// Reading from reading and cut.
    reading: Option<OnReading>,
}

const RADIUS: f64 = 6.0;
const FLUTES: usize = 3;
const EFFICIENCY: f64 = 0.85;

/// Arc of contact, rad.
fn arc(cut: &Cut, curved: bool) -> f64 {
    if cut.side == Side::Slot {
        return PI;
    }
    let straight = (1.0 - cut.width_mm / RADIUS).acos();
    if !curved || cut.path_radius_mm == 0.0 {
        return straight;
    }
    let (path, sign) = (cut.path_radius_mm.abs(), cut.path_radius_mm.signum());
    let wall = path + sign * (RADIUS - cut.width_mm);
    (sign * (wall * wall - path * path - RADIUS * RADIUS) / (2.0 * path * RADIUS)).clamp(-1.0, 1.0).acos()
}

/// Cuts of a table in their order. Round paths only where curvature is asked for: a straight table has none.
fn cuts(dice: &mut Dice, round: bool) -> Vec<Cut> {
    let speeds = [2400.0, 3200.0, 4000.0, 4800.0, 5600.0];
    (0..64)
        .map(|order| {
            let side = dice.pick(&[Side::Up, Side::Climb, Side::Up, Side::Climb, Side::Slot]);
            let rpm = dice.pick(&speeds);
            let path_radius_mm =
                if round && side != Side::Slot { dice.pick(&[0.0, 12.0, 20.0, -12.0, -20.0]) } else { 0.0 };
            Cut {
                group: order / 16 + 1,
                order: order + 1,
                depth_mm: dice.pick(&[0.4, 0.8, 1.5, 3.0, 5.0]),
                width_mm: if side == Side::Slot { 2.0 * RADIUS } else { dice.pick(&[1.0, 2.0, 3.5, 5.0, 7.0]) },
                side,
                path_radius_mm,
                feed_mm_min: (dice.pick(&[0.02, 0.04, 0.07, 0.12, 0.2]) * FLUTES as f64 * rpm).round(),
                rpm,
            }
        })
        .collect()
}

/// Hides a part at a strength; nothing for a name that is none.
fn twist(part: &str, s: f64, dice: &mut Dice, peak_w: f64, slid_m: f64) -> Twist {
    let mut twist = Twist::default();
    match part {
        "flank-wear" => {
            let share = dice.between(0.2, 0.6);
            twist.station = Some(Box::new(move |at, _| {
                let worn = 0.7 * s * three_phases(at.slid_m / slid_m);
                [1.0 + share * worn, 1.0 + worn]
            }));
        }
        "up-down-asymmetry" => {
            let sign = dice.sign();
            twist
                .elements
                .push(Box::new(move |_, e| [1.0 + 0.2 * s * sign * e.phi.cos(), 1.0 + 0.1 * s * sign * e.phi.cos()]));
        }
        "size-effect" => {
            let thin = dice.between(0.03, 0.06);
            twist.elements.push(Box::new(move |_, e| [1.0 + 0.5 * s * (1.0 - step(e.chip_mm, thin, 0.012)), 1.0]));
        }
        "cutting-speed" => {
            let best = dice.between(1.8, 3.2);
            twist.station = Some(Box::new(move |at, _| {
                let off = (surface_speed(at) - best) / 2.0;
                [1.0 + 0.9 * s * off * off, 1.0 + 0.5 * s * off * off]
            }));
        }
        "edge-position" => {
            let land = dice.between(1.0, 1.8);
            twist.elements.push(Box::new(move |_, e| {
                let more = if e.above_tip_mm < land { 0.5 * s } else { 0.0 };
                [1.0 + more, 1.0 + more]
            }));
        }
        "drive-efficiency" => {
            let knee = peak_w * dice.between(0.2, 0.4);
            twist.reading = Some(Box::new(move |watts, _| {
                let above = ((watts - knee) / (peak_w - knee)).max(0.0);
                watts + 0.35 * s * (peak_w - knee) * above.powf(1.5)
            }));
        }
        "saturation" => {
            let ceiling = peak_w * (1.0 - 0.35 * s).max(0.2);
            twist.reading = Some(Box::new(move |watts, _| watts.min(ceiling)));
        }
        "gearbox" => {
            twist.reading =
                Some(Box::new(move |watts, cut| if cut.rpm > 4400.0 { watts * (1.0 + 0.2 * s) } else { watts }));
        }
        // Each clamping leaves the meter at another zero.
        "set-up-tare" => {
            let zero = [0.0, 1.0, 2.0, 3.0].map(|_| dice.gauss() * 0.08 * s * peak_w);
            twist.reading = Some(Box::new(move |watts, cut| watts + zero[cut.group - 1]));
        }
        _ => {}
    }
    twist
}

/// Powers of cutting and edge, W at the tool, of a straight reading of the table and of the true machine, and the reading.
fn rows(cuts: &[Cut], k: &Coefficients, tare: [f64; 2], curved: bool, twist: &Twist) -> Vec<([f64; 2], f64)> {
    let mut slid_m = 0.0;
    cuts.iter()
        .map(|cut| {
            let at = Station {
                along: [1.0, 0.0],
                speed_mm_s: cut.feed_mm_min / 60.0,
                rpm: cut.rpm,
                radius_mm: RADIUS,
                flutes: FLUTES,
                slid_m,
                ..Station::default()
            };
            let load = |curved: bool, elements: &[OnElement]| {
                let arc = arc(cut, curved);
                let mut rim = [0.0; RIM];
                for (i, depth) in rim.iter_mut().enumerate() {
                    let phi = if cut.side == Side::Climb { PI - rim_angle(i) } else { rim_angle(i) };
                    *depth = if phi < arc { cut.depth_mm } else { 0.0 };
                }
                power(&at, &rim, k, Runout::default(), elements, 0.25)
            };
            let plain = load(false, &[]);
            let mut truth = load(curved, &twist.elements);
            if let Some(station) = &twist.station {
                let factors = station(&at, cut);
                truth = [truth[0] * factors[0], truth[1] * factors[1]];
            }
            // A cut of 300 mm.
            let seconds = 300.0 / at.speed_mm_s;
            slid_m += arc(cut, curved) / (2.0 * PI) * surface_speed(&at) * seconds;
            let watts = (tare[0] + tare[1] * cut.rpm + truth[0] + truth[1]) / EFFICIENCY;
            (plain, twist.reading.as_ref().map_or(watts, |reading| reading(watts, cut)))
        })
        .collect()
}

/// The table of a seed with something hidden in it (nothing for an unknown name).
pub fn table(part: &str, s: f64, seed: u64, noise: f64) -> Table {
    let mut dice = Dice::new(seed, "table");
    let k_tc = dice.between(620.0, 2000.0);
    let k = Coefficients { k_tc, k_te: 0.02 * k_tc, k_rc: 0.35 * k_tc, k_re: 0.018 * k_tc };
    let tare = [dice.between(60.0, 150.0), dice.between(0.02, 0.04)];
    let curved = part == "path-curvature";
    let cuts = cuts(&mut dice, curved);
    let plain = rows(&cuts, &k, tare, false, &Twist::default());
    let peak_w = plain.iter().map(|row| row.1).fold(0.0, f64::max);
    let noise_w = noise * plain.iter().map(|row| row.0[0] + row.0[1]).sum::<f64>() / plain.len() as f64 / EFFICIENCY;
    let slid: f64 = cuts.iter().map(|cut| arc(cut, false) * RADIUS * cut.rpm / 60.0 * 18.0 / cut.feed_mm_min).sum();
    let true_rows = rows(&cuts, &k, tare, curved, &twist(part, s, &mut dice, peak_w, slid));
    let regressors: Vec<([f64; 4], f64)> = cuts
        .iter()
        .zip(&true_rows)
        .map(|(cut, row)| ([row.0[0], row.0[1], tare[0] + tare[1] * cut.rpm, 1.0], row.1))
        .collect();
    let seen = super::shop_floor::left_over(&regressors).hypot(noise_w) / noise_w;
    let mut text = String::from(
        "group,order,feed_mm_min,spindle_rpm,axial_depth_mm,radial_depth_mm,side,path_radius_mm,spindle_power_w\n",
    );
    for (cut, (_, watts)) in cuts.iter().zip(&true_rows) {
        let side = match cut.side {
            Side::Up => "up",
            Side::Climb => "down",
            Side::Slot => "slot",
        };
        let radius = if cut.path_radius_mm == 0.0 { String::new() } else { cut.path_radius_mm.to_string() };
        let _ = writeln!(
            text,
            "{},{},{:.0},{:.0},{},{},{side},{radius},{:.1}",
            cut.group,
            cut.order,
            cut.feed_mm_min,
            cut.rpm,
            cut.depth_mm,
            cut.width_mm,
            watts + noise_w * dice.gauss()
        );
    }
    let (low, high) = (tare[0] + tare[1] * 1000.0, tare[0] + tare[1] * 12000.0);
    let setup = format!(
        "units = \"mm\"\n\n[machine]\ndialect = \"linuxcnc\"\n\n[machine.spindle]\nmax_rpm = 12000\n\
         power = [[0, 0], [1500, 7500], [12000, 7500]]\ntare = [[1000, {low:.1}], [12000, {high:.1}]]\n\
         efficiency = {EFFICIENCY}\n\n[stock]\nbox = {{ min = [0, 0, -20], max = [100, 60, 0] }}\n\n[material]\n\
         k_tc = {:.0}\nk_te = {:.1}\nk_rc = {:.0}\nk_re = {:.1}\n\n[[tool]]\nnumber = 1\nshape = \"flat\"\n\
         diameter = {}\nflutes = {FLUTES}\nhelix = 30\nflute_length = 26\noverhang = 40\nmaterial = \"carbide\"\n",
        k.k_tc * 1.1,
        k.k_te * 1.1,
        k.k_rc * 1.1,
        k.k_re * 1.1,
        2.0 * RADIUS
    );
    Table { text, setup, noise_w, seen }
}
