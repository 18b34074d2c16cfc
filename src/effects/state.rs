//! The state of a cut: everything that an effect may depend on. In: filled by `learn/dataset/covariates.rs` for samples of a log and by
//! `schedule/history.rs` for stations of a program. Out: read by [`super::Effect::change`] and by [`super::Covariate::of`].

use super::along_edge::AlongEdge;
use crate::machine::wear::Lengths;
use crate::path::Vec3;

/// Number of sectors of 30° into which the engaged arc is divided.
pub const SECTORS: usize = 6;

/// The cut in one sector of the engaged arc.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sector {
    /// Share of this sector in the cutting terms (by chip thickness) and in the edge terms (by contact length).
    pub share: [f64; 2],
    /// Mean chip thickness, mm.
    pub chip_thickness_mm: f64,
    /// X and Y of its middle in work coordinates, mm.
    pub at: [f64; 2],
}

/// Everything about a cut that an effect may depend on. Quantities that are not known are NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Time since the start, s.
    pub time_s: f64,
    /// Time at which this tool first cut, s.
    pub in_use_since_s: f64,
    /// Distance that each tooth of this tool has slid through material, mm, weighted for each exponent of the wear law; for the exponent −1
    /// it is that distance itself.
    pub slid: Lengths,
    /// Rise of the wear index since the edge was fresh, as a share of the index of a fresh edge, by the wear law of the tool or of the model.
    pub worn: f64,
    /// Volume this tool has removed so far, mm³.
    pub volume_mm3: f64,
    /// Spindle speed, rev/s.
    pub rps: f64,
    /// Spindle speed at which the tare was declared or first seen, rev/s.
    pub reference_rps: f64,
    /// Feed per tooth, mm.
    pub feed_per_tooth_mm: f64,
    /// Chip thickness averaged over the engaged arc, mm.
    pub chip_thickness_mm: f64,
    /// Cutting speed, mm/s.
    pub cutting_speed_mm_s: f64,
    /// Axial depth, mm.
    pub axial_depth_mm: f64,
    /// Radial depth, mm.
    pub radial_depth_mm: f64,
    /// Angle over which a tooth is in material, mean over the depth, rad.
    pub immersion_rad: f64,
    /// −1 all climb … +1 all up, by contact.
    pub up_share: f64,
    /// Share of up-milling weighted by chip thickness instead.
    pub up_share_chip: f64,
    /// Mean of cos φ over the engaged arc, φ from where up-milling begins, by chip thickness and by contact: as the two above, but fading
    /// towards the middle of the arc, where a tooth runs along the feed.
    pub mean_cosine: [f64; 2],
    /// Tool tip in work coordinates, mm.
    pub position: Vec3,
    /// Unit vector of the feed.
    pub direction: Vec3,
    /// Signed curvature of the tool-centre path, 1/mm: positive concave.
    pub curvature_per_mm: f64,
    /// How the cut is spread along the cutting edge.
    pub along_edge: AlongEdge,
    /// Path since the tool met material, mm.
    pub since_entry_mm: f64,
    /// Declared tare at this spindle speed over that at the reference speed.
    pub tare_share: f64,
    /// Speed along the path, mm/s.
    pub path_speed_mm_s: f64,
    /// Acceleration along the path, mm/s².
    pub path_acceleration_mm_s2: f64,
    /// Number of the tool.
    pub tool: f64,
    /// 1 where the program has coolant or mist on, 0 where it has not.
    pub coolant: f64,
    /// Predicted reading of the meter here, in the unit of the log. Known only in a diagnosis.
    pub load: f64,
    /// The engaged arc in sectors; all shares 0 where it is not known.
    pub sectors: [Sector; SECTORS],
}

impl State {
    /// Mean of a factor over the engaged arc: weighted by chip thickness, and by contact length. Where the arc is not known, the cut counts
    /// as one sector with its mean chip thickness.
    pub fn over_arc(&self, factor: impl Fn(&Sector) -> f64) -> [f64; 2] {
        let whole: f64 = self.sectors.iter().map(|s| s.share[0] + s.share[1]).sum();
        if whole <= 0.0 {
            let at = [self.position.x, self.position.y];
            let one = Sector { share: [1.0; 2], chip_thickness_mm: self.chip_thickness_mm, at };
            return [factor(&one); 2];
        }
        let mut mean = [0.0; 2];
        for sector in self.sectors.iter().filter(|s| s.share[0] + s.share[1] > 0.0) {
            let value = factor(sector);
            mean[0] += sector.share[0] * value;
            mean[1] += sector.share[1] * value;
        }
        mean
    }
}

impl Default for State {
    fn default() -> Self {
        let nan = f64::NAN;
        Self {
            time_s: nan,
            in_use_since_s: f64::NEG_INFINITY,
            slid: Lengths([nan; 4]),
            worn: nan,
            volume_mm3: nan,
            rps: nan,
            reference_rps: nan,
            feed_per_tooth_mm: nan,
            chip_thickness_mm: nan,
            cutting_speed_mm_s: nan,
            axial_depth_mm: nan,
            radial_depth_mm: nan,
            immersion_rad: nan,
            up_share: nan,
            up_share_chip: nan,
            mean_cosine: [nan; 2],
            position: Vec3::repeat(nan),
            direction: Vec3::repeat(nan),
            curvature_per_mm: nan,
            along_edge: AlongEdge::default(),
            since_entry_mm: nan,
            tare_share: nan,
            path_speed_mm_s: nan,
            path_acceleration_mm_s2: nan,
            tool: nan,
            coolant: nan,
            load: nan,
            sectors: [Sector::default(); SECTORS],
        }
    }
}

/// Angle of the feed in the plane, rad; NaN for a plunge, which has none.
pub(super) fn heading(state: &State) -> f64 {
    let d = state.direction;
    if d.x.hypot(d.y) > 0.1 { d.y.atan2(d.x) } else { f64::NAN }
}
