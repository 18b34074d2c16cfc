//! The tool as data. In: filled by the setup. Out: [`Tool`]: shape, teeth, stiffness, holder, wear.

use super::limits::Limits;
use super::material::Material;
use super::profile::Profile;
use super::wear::ToolWear;

/// Kinds of cutter the setup file names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Shape {
    /// Flat end mill.
    Flat,
    /// Ball end mill.
    Ball,
    /// Bull-nose (corner radius) end mill.
    Bull,
    /// Tapered, with a flat or ball tip.
    Taper,
    /// Drill.
    Drill,
    /// Chamfer or V cutter.
    Chamfer,
    /// Face mill with a lead angle.
    Face,
    /// High-feed cutter.
    HighFeed,
    /// Any profile of lines and arcs.
    Profile,
    /// Tap: moves in Z only at its pitch; its feed is frozen.
    Tap,
    /// Reamer: frozen.
    Reamer,
    /// Probe: frozen, cuts nothing.
    Probe,
}

/// Offset of the cutter axis from the spindle axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Runout {
    /// Offset, mm.
    pub offset_mm: f64,
    /// Direction, rad, from tooth 1.
    pub angle_rad: f64,
}

/// A tool in its holder.
#[derive(Debug, Clone, PartialEq)]
pub struct Tool {
    /// Number (T word).
    pub number: u32,
    /// Kind.
    pub shape: Shape,
    /// Outline of the cutting part, from the tip at the axis outward and up.
    pub profile: Profile,
    /// Diameter, mm.
    pub diameter_mm: f64,
    /// Teeth.
    pub flutes: u32,
    /// Helix angle, rad.
    pub helix_rad: f64,
    /// Angles between each tooth and the next, rad; empty: equal pitch.
    pub pitch_rad: Vec<f64>,
    /// Radial rake angle, rad.
    pub rake_rad: f64,
    /// Length of the cutting edges along the axis, mm.
    pub flute_length_mm: f64,
    /// Was that length given? One that is assumed says nothing about where the shank begins to rub.
    pub flute_length_given: bool,
    /// Length out of the holder, mm.
    pub overhang_mm: f64,
    /// Diameter of the shank above the flutes, mm.
    pub shank_diameter_mm: f64,
    /// Runout, where it is known.
    pub runout: Option<Runout>,
    /// Young's modulus, MPa (N/mm²).
    pub youngs_modulus_mpa: f64,
    /// Bending stress that its material allows, MPa, where the material is named.
    pub allowable_stress_mpa: Option<f64>,
    /// Radial stiffness of holder and spindle at the collet, N/mm; `None`: rigid.
    pub holder_stiffness_n_mm: Option<f64>,
    /// Holder cylinders from the collet face up: (diameter, length), mm.
    pub holder: Vec<(f64, f64)>,
    /// May it plunge without a pilot hole?
    pub centre_cutting: bool,
    /// Its own coefficients, in place of the stock's.
    pub coefficients: Option<Material>,
    /// Its own limits.
    pub limits: Limits,
    /// What the setup says of its wear.
    pub wear: Option<ToolWear>,
}

impl Tool {
    /// Radius at the widest point of the cutting part, mm.
    pub fn radius_mm(&self) -> f64 {
        0.5 * self.diameter_mm
    }
    /// True for tools whose feed is never touched (taps, reamers, probes).
    pub fn is_frozen(&self) -> bool {
        matches!(self.shape, Shape::Tap | Shape::Reamer | Shape::Probe)
    }
}
