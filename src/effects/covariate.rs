//! Covariates. In: a covariate and the [`State`] of a cut. Out: its value there, its name, and its unit for people.

use super::state::{State, heading};

/// A quantity that varies from cut to cut and that a residual may depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Covariate {
    /// Time since the start, s.
    Time,
    /// Distance that each tooth has slid through material, mm.
    Sliding,
    /// Volume removed so far, mm³.
    Volume,
    /// Feed per tooth, mm.
    FeedPerTooth,
    /// Mean chip thickness, mm.
    ChipThickness,
    /// Cutting speed, mm/s.
    CuttingSpeed,
    /// Spindle speed, rev/s.
    SpindleSpeed,
    /// Axial depth, mm.
    AxialDepth,
    /// Radial depth, mm.
    RadialDepth,
    /// Angle over which a tooth is in material, mean over the depth, rad.
    Immersion,
    /// Share of up-milling: −1 climb, +1 up.
    UpShare,
    /// X position, mm.
    X,
    /// Y position, mm.
    Y,
    /// Z position, mm.
    Z,
    /// Direction of the feed along X (cosine).
    DirectionX,
    /// Direction of the feed along Y (cosine).
    DirectionY,
    /// Angle of the feed in the plane from X, rad.
    Heading,
    /// Slope of the path: sine of its angle, negative downwards.
    Slope,
    /// Signed curvature of the path, 1/mm.
    Curvature,
    /// Actual over commanded feed.
    FeedRatio,
    /// Change of the load since the sample before.
    LoadChange,
    /// Predicted load.
    Load,
    /// Height of the cut along the cutting edge, mm.
    EdgePosition,
    /// Path since the tool met material, mm.
    SinceEntry,
    /// Speed along the path, mm/s.
    PathSpeed,
    /// Acceleration along the path, mm/s².
    PathAcceleration,
    /// Set-up or part.
    SetUp,
    /// Number of the tool.
    Tool,
    /// Coolant or mist: 1 on, 0 off.
    Coolant,
}

impl Covariate {
    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Covariate::Time => "time",
            Covariate::Sliding => "sliding distance",
            Covariate::Volume => "volume removed",
            Covariate::FeedPerTooth => "feed per tooth",
            Covariate::ChipThickness => "chip thickness",
            Covariate::CuttingSpeed => "cutting speed",
            Covariate::SpindleSpeed => "spindle speed",
            Covariate::AxialDepth => "axial depth",
            Covariate::RadialDepth => "radial depth",
            Covariate::Immersion => "immersion",
            Covariate::UpShare => "up/down milling",
            Covariate::X => "position x",
            Covariate::Y => "position y",
            Covariate::Z => "position z",
            Covariate::DirectionX => "direction x",
            Covariate::DirectionY => "direction y",
            Covariate::Heading => "direction of feed",
            Covariate::Slope => "slope of the path",
            Covariate::Curvature => "path curvature",
            Covariate::FeedRatio => "actual over commanded feed",
            Covariate::LoadChange => "change of load",
            Covariate::Load => "load",
            Covariate::EdgePosition => "distance along the cutting edge",
            Covariate::SinceEntry => "distance since entry",
            Covariate::PathSpeed => "speed along the path",
            Covariate::PathAcceleration => "acceleration along the path",
            Covariate::SetUp => "set-up",
            Covariate::Tool => "tool",
            Covariate::Coolant => "coolant",
        }
    }

    /// Does it exist only while something is cut? A residual that follows such a covariate comes from the cut.
    pub fn is_of_cut(self) -> bool {
        matches!(
            self,
            Covariate::FeedPerTooth
                | Covariate::ChipThickness
                | Covariate::AxialDepth
                | Covariate::RadialDepth
                | Covariate::Immersion
                | Covariate::UpShare
                | Covariate::EdgePosition
                | Covariate::SinceEntry
        )
    }

    /// Factor from the unit of [`State`] to the unit shown to people, and that unit.
    pub fn shown(self) -> (f64, &'static str) {
        match self {
            Covariate::Time => (1.0, "s"),
            Covariate::Sliding => (1e-3, "m"),
            Covariate::Volume => (1e-3, "cm³"),
            Covariate::CuttingSpeed => (0.06, "m/min"),
            Covariate::SpindleSpeed => (60.0, "rpm"),
            Covariate::PathSpeed => (60.0, "mm/min"),
            Covariate::PathAcceleration => (1.0, "mm/s²"),
            Covariate::Curvature => (1.0, "1/mm"),
            Covariate::Heading | Covariate::Immersion => (1.0_f64.to_degrees(), "°"),
            Covariate::UpShare
            | Covariate::DirectionX
            | Covariate::DirectionY
            | Covariate::Slope
            | Covariate::FeedRatio
            | Covariate::LoadChange
            | Covariate::Load
            | Covariate::SetUp
            | Covariate::Tool
            | Covariate::Coolant => (1.0, ""),
            _ => (1.0, "mm"),
        }
    }

    /// Its value in a state; NaN where it is not known, or is not part of a state.
    pub fn of(self, state: &State) -> f64 {
        match self {
            Covariate::Time => state.time_s,
            Covariate::Sliding => state.slid.0[0],
            Covariate::Volume => state.volume_mm3,
            Covariate::FeedPerTooth => state.feed_per_tooth_mm,
            Covariate::ChipThickness => state.chip_thickness_mm,
            Covariate::CuttingSpeed => state.cutting_speed_mm_s,
            Covariate::SpindleSpeed => state.rps,
            Covariate::AxialDepth => state.axial_depth_mm,
            Covariate::RadialDepth => state.radial_depth_mm,
            Covariate::Immersion => state.immersion_rad,
            Covariate::UpShare => state.up_share,
            Covariate::X => state.position.x,
            Covariate::Y => state.position.y,
            Covariate::Z => state.position.z,
            Covariate::DirectionX => state.direction.x,
            Covariate::DirectionY => state.direction.y,
            Covariate::Heading => heading(state),
            Covariate::Slope => state.direction.z,
            Covariate::Curvature => state.curvature_per_mm,
            Covariate::EdgePosition => state.along_edge.middle_mm(),
            Covariate::SinceEntry => state.since_entry_mm,
            Covariate::PathSpeed => state.path_speed_mm_s,
            Covariate::PathAcceleration => state.path_acceleration_mm_s2,
            Covariate::Tool => state.tool,
            Covariate::Coolant => state.coolant,
            Covariate::Load => state.load,
            _ => f64::NAN,
        }
    }
}
