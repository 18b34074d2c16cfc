//! Types of the results. In: filled by [`super::line`]. Out: [`Loads`] at one station and one feed; [`Cap`], the largest feed for a limit.

use crate::machine::LimitKind;

/// All loads at one station and one feed, with the names and units of reports.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Loads {
    /// Largest resultant in a revolution, in the plane normal to the tool axis, N.
    pub force_xy_peak_n: f64,
    /// Magnitude of the force vector averaged over a revolution, N.
    pub force_xy_mean_n: f64,
    /// Mean force towards the machined wall, N.
    pub force_normal_mean_n: f64,
    /// Largest axial force in a revolution (magnitude), N.
    pub force_axial_peak_n: f64,
    /// Mean torque, N·m.
    pub torque_nm: f64,
    /// Largest torque in a revolution, N·m.
    pub torque_peak_nm: f64,
    /// Power at the motor shaft, tare included, W.
    pub power_w: f64,
    /// Tip deflection under the peak resultant, mm.
    pub deflection_mm: f64,
    /// Surface error, mm.
    pub surface_error_mm: f64,
    /// Bending stress, MPa.
    pub bending_stress_mpa: f64,
    /// Largest chip thickness, mm.
    pub chip_thickness_max_mm: f64,
    /// Feed per tooth, mm.
    pub feed_per_tooth_mm: f64,
    /// Mean force on the tool along the feed direction, its left normal, and the tool axis, N.
    pub mean_force_n: [f64; 3],
}

impl Loads {
    /// The same chips under forces, torques and power so many times as large.
    pub(super) fn times(self, by: f64) -> Self {
        Self {
            force_xy_peak_n: by * self.force_xy_peak_n,
            force_xy_mean_n: by * self.force_xy_mean_n,
            force_normal_mean_n: by * self.force_normal_mean_n,
            force_axial_peak_n: by * self.force_axial_peak_n,
            torque_nm: by * self.torque_nm,
            torque_peak_nm: by * self.torque_peak_nm,
            power_w: by * self.power_w,
            deflection_mm: by * self.deflection_mm,
            surface_error_mm: by * self.surface_error_mm,
            bending_stress_mpa: by * self.bending_stress_mpa,
            mean_force_n: self.mean_force_n.map(|force| by * force),
            ..self
        }
    }

    /// The load that a limit bounds, in the unit of [`crate::machine::Limits`] (torque: N·mm); `None` for limits that are not on a load.
    pub fn bounded_by(&self, kind: LimitKind) -> Option<f64> {
        Some(match kind {
            LimitKind::ForceXy => self.force_xy_peak_n,
            LimitKind::ForceNormalMean => self.force_normal_mean_n,
            LimitKind::ForceAxial => self.force_axial_peak_n,
            LimitKind::Power => self.power_w,
            LimitKind::Torque => crate::units::nmm_from_nm(self.torque_nm),
            LimitKind::Deflection => self.deflection_mm,
            LimitKind::SurfaceError => self.surface_error_mm,
            LimitKind::BendingStress => self.bending_stress_mpa,
            LimitKind::ChipThickness => self.chip_thickness_max_mm,
            LimitKind::FeedPerTooth => self.feed_per_tooth_mm,
            _ => return None,
        })
    }
}

/// Forces and torque at one feed, as an engine gives them: N and N·mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Forces {
    pub xy_peak: f64,
    pub axial_peak: f64,
    pub torque_peak: f64,
    /// Largest force normal to the wall at the moments that leave it.
    pub wall: f64,
    pub mean: [f64; 3],
    pub torque: f64,
    pub chip: f64,
}

/// The largest feed at which a limit is met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cap {
    /// The limit is never reached.
    Free,
    /// Met up to this feed, mm/s; `per_unit` is its derivative with respect to the limit, (mm/s)/unit.
    Feed {
        /// Highest feed, mm/s.
        feed_mm_s: f64,
        /// d feed / d limit.
        per_unit: f64,
    },
    /// The limit is exceeded at any feed, because edge force or tare alone exceed it.
    Unreachable,
}
