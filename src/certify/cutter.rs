//! The tool, implemented independently of [`crate::force`]. In: a tool of the setup, parts of its outline. Out: rings with places and normals,
//! teeth, deflection of the tip and bending stress per newton at a height.
//!
//! A ring is a part of one piece of the outline, taken at its middle. Tooth j stands at φ = θ + ψⱼ − z tan β / R on a ring at height z,
//! θ the rotation, β the helix, R the radius of the tool; φ counts from the left normal of the feed, clockwise seen from above.

use std::f64::consts::{PI, TAU};

use super::interval::Interval;
use crate::machine::Tool;

/// A part of one piece of the outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Which piece.
    pub segment: usize,
    /// Shares of its length, from below.
    pub from: f64,
    /// The upper end.
    pub to: f64,
}

/// A ring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    /// Height and radius of its middle, mm.
    pub z: f64,
    /// Radius, mm.
    pub r: f64,
    /// Length of the edge on it, mm.
    pub edge: f64,
    /// Outward normal: radial and axial part.
    pub normal: [f64; 2],
    /// How far its upper end is above the tip, mm.
    pub top: f64,
    /// Half of its height, mm.
    pub half: f64,
    /// Outward normals at its lower and upper end.
    pub ends: [[f64; 2]; 2],
}

impl Ring {
    /// A part of the outline of a tool; `None` if it has no such part.
    pub fn of(tool: &Tool, part: &Part) -> Option<Self> {
        let share = part.to - part.from;
        let inside = part.from >= -1e-9 && part.to <= 1.0 + 1e-9 && share > 0.0;
        let segment = tool.profile.segments.get(part.segment).filter(|_| inside)?;
        let ([r, z], normal) = segment.at(0.5 * (part.from + part.to));
        let [([_, bottom], lower), ([_, top], upper)] = [part.from, part.to].map(|place| segment.at(place));
        let (edge, half) = (share * segment.length(), 0.5 * (top - bottom).abs());
        Some(Self { z, r, edge, normal, top, half, ends: [lower, upper] })
    }
}

/// The teeth: lead of each before tooth 0, rad, and its share of the feed per tooth.
pub struct Teeth {
    /// Rotation after which they repeat, rad.
    pub period: f64,
    /// One entry a tooth, or one for all where the pitch is even.
    pub each: Vec<[f64; 2]>,
}

impl Teeth {
    /// Of a tool.
    pub fn of(tool: &Tool) -> Self {
        let n = f64::from(tool.flutes);
        if tool.pitch_rad.is_empty() {
            return Self { period: TAU / n, each: vec![[0.0, 1.0]] };
        }
        // A tooth cuts what the one before it left: the feed of the pitch between them.
        let mut lag = 0.0;
        let before = tool.pitch_rad.iter().cycle().skip(tool.pitch_rad.len() - 1);
        let of = |(own, before): (&f64, &f64)| {
            lag += own;
            [own - lag, before * n / TAU]
        };
        let each = tool.pitch_rad.iter().zip(before).map(of).collect();
        Self { period: TAU, each }
    }
}

/// Angle by which the edge lags at a height, rad.
pub fn lag_rad(tool: &Tool, z: f64) -> f64 {
    z * tool.helix_rad.tan() / (0.5 * tool.diameter_mm)
}

/// Share of the diameter that the fluted part bends like (Kops and Vo).
const FLUTED: f64 = 0.8;

/// Deflection of the tip, mm, and largest bending stress, MPa, under 1 N at a height: a cantilever of two steps with the holder as a
/// spring. u = ∫ (x − a) x / (E π d⁴/64) dx from a to the collet; σ = (x − a) 32 / (π d³) at the upper end of each step.
pub fn compliance(tool: &Tool, at: f64) -> [Interval; 2] {
    let flutes = tool.flute_length_mm.min(tool.overhang_mm);
    let steps = [[0.0, flutes, FLUTED * tool.diameter_mm], [flutes, tool.overhang_mm, tool.shank_diameter_mm]];
    let e = Interval::exact;
    let at = e(at);
    let mut bend = tool.holder_stiffness_n_mm.map_or(e(0.0), |k| e(1.0) / e(k));
    let mut stress = e(0.0);
    for [from, to, d] in steps.into_iter().filter(|[from, to, _]| to > from) {
        let (d, pi) = (e(d), Interval::pi());
        let lever = (e(to) - at).not_negative();
        let of_step = lever * e(32.0) / (pi * d * d * d);
        stress = Interval { lo: stress.lo.max(of_step.lo), hi: stress.hi.max(of_step.hi) };
        if to <= at.lo {
            continue;
        }
        let integral = |x: Interval| x * x * x / e(3.0) - x * x * at / e(2.0);
        let inertia = pi * d * d * d * d / e(64.0);
        let part = integral(e(to)) - integral(e(from.max(at.lo)));
        bend = bend + part / (e(tool.youngs_modulus_mpa) * inertia);
    }
    [bend, stress]
}

/// Why no certificate is possible with this tool, if so.
pub fn unfit(tool: &Tool) -> Option<&'static str> {
    let sized = tool.diameter_mm > 0.0 && tool.flutes > 0 && tool.helix_rad.abs() < 0.49 * PI;
    let runs_out = tool.runout.is_some_and(|runout| runout.offset_mm != 0.0);
    let unfit = [
        (!sized, "a tool without diameter or teeth"),
        (runs_out, "a tool with runout"),
        (tool.wear.is_some(), "a tool with a law of wear"),
    ];
    unfit.into_iter().find(|(is, _)| *is).map(|(_, what)| what)
}
