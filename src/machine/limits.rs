//! Limits on loads and feeds, and the names they go by in the setup file, the report and the annotation.

/// Lowest feed in a cut relative to the programmed one, where the setup says nothing.
pub const FEED_CHANGE_MIN: f64 = 0.2;
/// Highest feed in a cut relative to the programmed one, where the setup says nothing: while coefficients are those of a
/// library or a book (a feed that rises by this much stays within what such coefficients are commonly off by), and once they
/// are measured on this machine.
pub const FEED_CHANGE_MAX: [f64; 2] = [1.3, 2.0];

/// Every kind of bound that can hold a feed down (or up).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LimitKind {
    /// Peak resultant in the plane normal to the tool axis, N.
    ForceXy,
    /// Mean force normal to the machined wall, N.
    ForceNormalMean,
    /// Peak axial force, N.
    ForceAxial,
    /// Power at the motor shaft, tare included, W: of the setup, or of the spindle's curve.
    Power,
    /// Torque at the tool, N·m.
    Torque,
    /// Deflection at the tool tip, mm.
    Deflection,
    /// Surface error, mm.
    SurfaceError,
    /// Bending stress of the tool, MPa.
    BendingStress,
    /// Largest chip thickness, mm.
    ChipThickness,
    /// Smallest chip thickness, mm (a floor).
    ChipThicknessMin,
    /// Largest feed per tooth, mm.
    FeedPerTooth,
    /// Fastest change of the peak resultant, N/s.
    ForceRate,
    /// Highest feed, mm/min.
    Feed,
    /// Lowest feed, mm/min (a floor).
    FeedMin,
    /// Change relative to the programmed feed.
    FeedChange,
    /// Feed where nothing can be cut.
    AirFeed,
    /// The programmed feed itself: mode keep or slow-only, or nothing to gain from more.
    Programmed,
    /// Ramp at entry, exit or a change of direction.
    Ramp,
    /// Axis velocity.
    Velocity,
    /// Axis acceleration.
    Acceleration,
    /// Axis jerk.
    Jerk,
    /// Speed through a corner within the path tolerance.
    Corner,
    /// Shortest block time of the control.
    BlockTime,
    /// Life or energy budget over the program.
    Budget,
}

impl LimitKind {
    /// Every kind, in the order of the report.
    pub const ALL: [LimitKind; 24] = [
        LimitKind::ForceXy,
        LimitKind::ForceNormalMean,
        LimitKind::ForceAxial,
        LimitKind::Power,
        LimitKind::Torque,
        LimitKind::Deflection,
        LimitKind::SurfaceError,
        LimitKind::BendingStress,
        LimitKind::ChipThickness,
        LimitKind::ChipThicknessMin,
        LimitKind::FeedPerTooth,
        LimitKind::ForceRate,
        LimitKind::Feed,
        LimitKind::FeedMin,
        LimitKind::FeedChange,
        LimitKind::AirFeed,
        LimitKind::Programmed,
        LimitKind::Ramp,
        LimitKind::Velocity,
        LimitKind::Acceleration,
        LimitKind::Jerk,
        LimitKind::Corner,
        LimitKind::BlockTime,
        LimitKind::Budget,
    ];

    /// Is it a load that is predicted, and so known no better than the prediction?
    pub fn is_load(self) -> bool {
        use LimitKind::{BendingStress, ChipThickness, Deflection, ForceAxial, ForceNormalMean, ForceRate, ForceXy};
        use LimitKind::{FeedPerTooth, Power, SurfaceError, Torque};
        matches!(self, ForceXy | ForceNormalMean | ForceAxial | ForceRate | Power | Torque | Deflection)
            || matches!(self, SurfaceError | BendingStress | ChipThickness | FeedPerTooth)
    }

    /// Name in the setup file and in the report.
    pub fn name(self) -> &'static str {
        match self {
            LimitKind::ForceXy => "force_xy",
            LimitKind::ForceNormalMean => "force_normal_mean",
            LimitKind::ForceAxial => "force_axial",
            LimitKind::Power => "power",
            LimitKind::Torque => "torque",
            LimitKind::Deflection => "deflection",
            LimitKind::SurfaceError => "surface_error",
            LimitKind::BendingStress => "bending_stress",
            LimitKind::ChipThickness => "chip_thickness",
            LimitKind::ChipThicknessMin => "chip_thickness_min",
            LimitKind::FeedPerTooth => "feed_per_tooth",
            LimitKind::ForceRate => "force_rate",
            LimitKind::Feed => "feed",
            LimitKind::FeedMin => "feed_min",
            LimitKind::FeedChange => "feed_change",
            LimitKind::AirFeed => "air_feed",
            LimitKind::Programmed => "programmed",
            LimitKind::Ramp => "ramp",
            LimitKind::Velocity => "velocity",
            LimitKind::Acceleration => "acceleration",
            LimitKind::Jerk => "jerk",
            LimitKind::Corner => "corner",
            LimitKind::BlockTime => "block_time",
            LimitKind::Budget => "budget",
        }
    }

    /// Unit of its value in the report.
    pub fn unit(self) -> &'static str {
        match self {
            LimitKind::ForceXy | LimitKind::ForceNormalMean | LimitKind::ForceAxial => "N",
            LimitKind::Power => "W",
            LimitKind::ForceRate => "N/s",
            LimitKind::Torque => "N·m",
            LimitKind::Deflection
            | LimitKind::SurfaceError
            | LimitKind::ChipThickness
            | LimitKind::ChipThicknessMin
            | LimitKind::FeedPerTooth
            | LimitKind::Corner => "mm",
            LimitKind::BendingStress => "MPa",
            LimitKind::Feed
            | LimitKind::FeedMin
            | LimitKind::AirFeed
            | LimitKind::Programmed
            | LimitKind::Ramp
            | LimitKind::Velocity => "mm/min",
            LimitKind::FeedChange | LimitKind::Budget => "-",
            LimitKind::Acceleration => "mm/s²",
            LimitKind::Jerk => "mm/s³",
            LimitKind::BlockTime => "s",
        }
    }
}

/// Limits in force; `None` does not bind. Those of a tool or an operation replace those of the setup one by one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// Peak resultant in the plane normal to the tool axis, N.
    pub force_xy_n: Option<f64>,
    /// Mean force normal to the machined wall, N.
    pub force_normal_mean_n: Option<f64>,
    /// Peak axial force, N.
    pub force_axial_n: Option<f64>,
    /// Power at the motor shaft, tare included, W.
    pub power_w: Option<f64>,
    /// Torque at the tool, N·mm.
    pub torque_nmm: Option<f64>,
    /// Deflection at the tool tip, mm.
    pub deflection_mm: Option<f64>,
    /// Surface error, mm.
    pub surface_error_mm: Option<f64>,
    /// Bending stress, MPa.
    pub bending_stress_mpa: Option<f64>,
    /// Smallest chip thickness, mm.
    pub chip_thickness_min_mm: Option<f64>,
    /// Largest chip thickness, mm.
    pub chip_thickness_max_mm: Option<f64>,
    /// Lowest feed, mm/s.
    pub feed_min_mm_s: Option<f64>,
    /// Highest feed, mm/s.
    pub feed_max_mm_s: Option<f64>,
    /// Largest feed per tooth, mm.
    pub feed_per_tooth_max_mm: Option<f64>,
    /// Fastest change of the peak resultant, N/s.
    pub force_rate_n_s: Option<f64>,
    /// Lowest feed relative to the programmed one, in cuts.
    pub feed_change_min: Option<f64>,
    /// Highest feed relative to the programmed one, in cuts.
    pub feed_change_max: Option<f64>,
}

impl Limits {
    /// Is a load of the cut limited, or its chip?
    pub fn has_load(&self) -> bool {
        let loads = [
            self.force_xy_n,
            self.force_normal_mean_n,
            self.force_axial_n,
            self.power_w,
            self.torque_nmm,
            self.deflection_mm,
            self.surface_error_mm,
            self.bending_stress_mpa,
            self.chip_thickness_max_mm,
            self.feed_per_tooth_max_mm,
        ];
        loads.iter().any(Option::is_some)
    }

    /// These limits, with those that `over` gives put in their place.
    pub fn overridden_by(&self, over: &Limits) -> Limits {
        Limits {
            force_xy_n: over.force_xy_n.or(self.force_xy_n),
            force_normal_mean_n: over.force_normal_mean_n.or(self.force_normal_mean_n),
            force_axial_n: over.force_axial_n.or(self.force_axial_n),
            power_w: over.power_w.or(self.power_w),
            torque_nmm: over.torque_nmm.or(self.torque_nmm),
            deflection_mm: over.deflection_mm.or(self.deflection_mm),
            surface_error_mm: over.surface_error_mm.or(self.surface_error_mm),
            bending_stress_mpa: over.bending_stress_mpa.or(self.bending_stress_mpa),
            chip_thickness_min_mm: over.chip_thickness_min_mm.or(self.chip_thickness_min_mm),
            chip_thickness_max_mm: over.chip_thickness_max_mm.or(self.chip_thickness_max_mm),
            feed_min_mm_s: over.feed_min_mm_s.or(self.feed_min_mm_s),
            feed_max_mm_s: over.feed_max_mm_s.or(self.feed_max_mm_s),
            feed_per_tooth_max_mm: over.feed_per_tooth_max_mm.or(self.feed_per_tooth_max_mm),
            force_rate_n_s: over.force_rate_n_s.or(self.force_rate_n_s),
            feed_change_min: over.feed_change_min.or(self.feed_change_min),
            feed_change_max: over.feed_change_max.or(self.feed_change_max),
        }
    }

    /// These limits, with the loads that `other` bounds at the lower of both.
    pub fn lowered_to(&self, other: &Limits) -> Limits {
        let lower = |a: Option<f64>, b: Option<f64>| [a, b].into_iter().flatten().reduce(f64::min);
        Limits {
            force_xy_n: lower(self.force_xy_n, other.force_xy_n),
            force_normal_mean_n: lower(self.force_normal_mean_n, other.force_normal_mean_n),
            force_axial_n: lower(self.force_axial_n, other.force_axial_n),
            power_w: lower(self.power_w, other.power_w),
            torque_nmm: lower(self.torque_nmm, other.torque_nmm),
            deflection_mm: lower(self.deflection_mm, other.deflection_mm),
            ..*self
        }
    }

    /// True when a force, power, torque, deflection, stress or chip limit is in force: only then may a feed rise in a cut.
    pub fn bounds_a_load(&self) -> bool {
        [
            self.force_xy_n,
            self.force_normal_mean_n,
            self.force_axial_n,
            self.power_w,
            self.torque_nmm,
            self.deflection_mm,
            self.surface_error_mm,
            self.bending_stress_mpa,
            self.chip_thickness_max_mm,
            self.feed_per_tooth_max_mm,
        ]
        .iter()
        .any(Option::is_some)
    }
}
