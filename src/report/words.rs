//! Names of limits and loads for machinists. In: a [`LimitKind`]. Out: its name on screen and page; files use the names of the setup.

use crate::machine::LimitKind;

/// A load or limit in the words of the shop.
pub fn plain(kind: LimitKind) -> &'static str {
    match kind {
        LimitKind::ForceXy => "cutting force",
        LimitKind::ForceNormalMean => "force on the wall",
        LimitKind::ForceAxial => "axial force",
        LimitKind::Power => "spindle power",
        LimitKind::Torque => "spindle torque",
        LimitKind::Deflection => "tool deflection",
        LimitKind::SurfaceError => "surface error",
        LimitKind::BendingStress => "bending stress of the tool",
        LimitKind::ChipThickness => "chip thickness",
        LimitKind::ChipThicknessMin => "least chip thickness",
        LimitKind::FeedPerTooth => "feed per tooth",
        LimitKind::ForceRate => "how fast the force may rise",
        LimitKind::Feed => "highest feed of the setup",
        LimitKind::FeedMin => "lowest feed of the setup",
        LimitKind::FeedChange => "how much a feed may change",
        LimitKind::AirFeed => "feed where nothing is cut",
        LimitKind::Programmed => "kept as programmed",
        LimitKind::Ramp => "slower at entry, exit or a turn",
        LimitKind::Velocity => "axis speed",
        LimitKind::Acceleration => "axis acceleration",
        LimitKind::Jerk => "axis jerk",
        LimitKind::Corner => "corner speed",
        LimitKind::BlockTime => "block time of the control",
        LimitKind::Budget => "tool life",
    }
}
