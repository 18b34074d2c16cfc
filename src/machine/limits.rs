//! Limits on loads and feeds. In: values from the setup. Out: [`Limits`], and a table with name, dimension, role and field of each kind of limit,
//! which setup file, schedule, check, report and annotation read.

use crate::units::Dimension;

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
    /// Torque at the tool, held in N·mm, told in N·m.
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
    /// The programmed feed itself: mode keep or slow-only, or a reason not to raise the feed.
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

    /// The loads of a station, in the order of the report.
    pub const LOADS: [LimitKind; loads_in_table()] = {
        let (mut found, mut k, mut filled) = ([LimitKind::ForceXy; loads_in_table()], 0, 0);
        while k < TABLE.len() {
            if matches!(TABLE[k].role, Role::Load { .. }) {
                found[filled] = LimitKind::ALL[k];
                filled += 1;
            }
            k += 1;
        }
        found
    };

    /// Loads whose values at the programmed feeds may serve as limits (`--reference`).
    pub fn references() -> impl Iterator<Item = LimitKind> {
        Self::ALL.into_iter().filter(|kind| kind.row().role == REFERENCE)
    }

    /// Everything that is the same wherever it is named.
    pub fn row(self) -> &'static LimitRow {
        &TABLE[self as usize]
    }

    /// Is it a load that is predicted, and so known no better than the prediction?
    pub fn is_load(self) -> bool {
        matches!(self.row().role, Role::Load { .. } | Role::Rate)
    }

    /// Name in the setup file and in the report.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// Unit of its value in the report.
    pub fn unit(self) -> &'static str {
        self.row().dimension.report_unit()
    }

    /// A value of [`Limits`] in that unit.
    pub fn in_report_unit(self, value: f64) -> f64 {
        self.row().dimension.in_report_unit(value)
    }
}

/// What a bound acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// A load of the cut at a station, which is a function of the feed.
    Load {
        /// Its values at the programmed feeds may serve as a limit (`--reference`).
        reference: bool,
    },
    /// The change of a load from one station to the next.
    Rate,
    /// The feed itself.
    Feed,
    /// The motion of the machine.
    Motion,
    /// The program as a whole.
    Whole,
}

/// Where a setup's value stands.
type Field = fn(&mut Limits) -> &mut Option<f64>;

/// One kind of bound, as setup file, schedule, check and report know it.
pub struct LimitRow {
    /// Name in the setup file and in the report.
    pub name: &'static str,
    /// What it measures: with it the unit of [`Limits`], and that of setup file and report.
    pub dimension: Dimension,
    /// What it acts on.
    pub role: Role,
    /// Where its value stands in [`Limits`]; `None`: elsewhere in the setup.
    pub field: Option<Field>,
}

const fn row(name: &'static str, dimension: Dimension, role: Role, field: Option<Field>) -> LimitRow {
    LimitRow { name, dimension, role, field }
}

const LOAD: Role = Role::Load { reference: false };
const REFERENCE: Role = Role::Load { reference: true };

/// Rows of the table that are loads of a station.
const fn loads_in_table() -> usize {
    let (mut k, mut count) = (0, 0);
    while k < TABLE.len() {
        count += matches!(TABLE[k].role, Role::Load { .. }) as usize;
        k += 1;
    }
    count
}

/// The rows, in the order of [`LimitKind::ALL`].
const TABLE: [LimitRow; LimitKind::ALL.len()] = [
    row("force_xy", Dimension::Force, REFERENCE, Some(|limits| &mut limits.force_xy_n)),
    row("force_normal_mean", Dimension::Force, REFERENCE, Some(|limits| &mut limits.force_normal_mean_n)),
    row("force_axial", Dimension::Force, REFERENCE, Some(|limits| &mut limits.force_axial_n)),
    row("power", Dimension::Power, REFERENCE, Some(|limits| &mut limits.power_w)),
    row("torque", Dimension::Torque, REFERENCE, Some(|limits| &mut limits.torque_nmm)),
    row("deflection", Dimension::Length, REFERENCE, Some(|limits| &mut limits.deflection_mm)),
    row("surface_error", Dimension::Length, LOAD, Some(|limits| &mut limits.surface_error_mm)),
    row("bending_stress", Dimension::Stress, LOAD, Some(|limits| &mut limits.bending_stress_mpa)),
    row("chip_thickness", Dimension::Length, LOAD, Some(|limits| &mut limits.chip_thickness_max_mm)),
    row("chip_thickness_min", Dimension::Length, Role::Feed, Some(|limits| &mut limits.chip_thickness_min_mm)),
    row("feed_per_tooth", Dimension::Length, LOAD, Some(|limits| &mut limits.feed_per_tooth_max_mm)),
    row("force_rate", Dimension::ForcePerTime, Role::Rate, Some(|limits| &mut limits.force_rate_n_s)),
    row("feed", Dimension::Feed, Role::Feed, Some(|limits| &mut limits.feed_max_mm_s)),
    row("feed_min", Dimension::Feed, Role::Feed, Some(|limits| &mut limits.feed_min_mm_s)),
    row("feed_change", Dimension::Ratio, Role::Feed, Some(|limits| &mut limits.feed_change_max)),
    row("air_feed", Dimension::Feed, Role::Feed, None),
    row("programmed", Dimension::Feed, Role::Feed, None),
    row("ramp", Dimension::Feed, Role::Feed, None),
    row("velocity", Dimension::Feed, Role::Motion, None),
    row("acceleration", Dimension::Acceleration, Role::Motion, None),
    row("jerk", Dimension::Jerk, Role::Motion, None),
    row("corner", Dimension::Length, Role::Motion, None),
    row("block_time", Dimension::Time, Role::Motion, None),
    row("budget", Dimension::Ratio, Role::Whole, None),
];

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
    /// The value of a kind; `None` where it does not bind or stands elsewhere in the setup.
    pub fn value(&self, kind: LimitKind) -> Option<f64> {
        // A field is named once, by a borrow that can write: reading it takes a copy.
        kind.row().field.and_then(|field| *field(&mut { *self }))
    }

    /// Puts a value in; a kind that stands elsewhere in the setup is left alone.
    pub fn set(&mut self, kind: LimitKind, value: Option<f64>) {
        if let Some(field) = kind.row().field {
            *field(self) = value;
        }
    }

    /// The loads of the cut that are bounded, each with its value, in the order of the report.
    pub fn loads(&self) -> Vec<(LimitKind, f64)> {
        let loads = LimitKind::ALL.into_iter().filter(|kind| matches!(kind.row().role, Role::Load { .. }));
        loads.filter_map(|kind| Some((kind, self.value(kind)?))).collect()
    }

    /// True when a load of the cut is limited, its chip included: only then may a feed rise in a cut.
    pub fn bounds_a_load(&self) -> bool {
        !self.loads().is_empty()
    }

    /// These limits, with those that `over` gives put in their place.
    pub fn overridden_by(&self, over: &Limits) -> Limits {
        let mut limits = Limits { feed_change_min: over.feed_change_min.or(self.feed_change_min), ..*self };
        for kind in LimitKind::ALL {
            limits.set(kind, over.value(kind).or(self.value(kind)));
        }
        limits
    }

    /// These limits, with the loads that may serve as a reference at the lower of both.
    pub fn lowered_to(&self, other: &Limits) -> Limits {
        let mut limits = *self;
        for kind in LimitKind::references() {
            let lower = [self.value(kind), other.value(kind)].into_iter().flatten().reduce(f64::min);
            limits.set(kind, lower);
        }
        limits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows are found by the place of their kind; each has its own name and its own field.
    #[test]
    fn every_kind_has_its_row() {
        for (place, kind) in LimitKind::ALL.into_iter().enumerate() {
            assert_eq!(kind as usize, place);
            assert!(LimitKind::ALL[..place].iter().all(|other| other.name() != kind.name()), "{}", kind.name());
            let mut limits = Limits::default();
            limits.set(kind, Some(1.0));
            let found: Vec<LimitKind> = LimitKind::ALL.into_iter().filter(|k| limits.value(*k).is_some()).collect();
            assert_eq!(found, if kind.row().field.is_some() { vec![kind] } else { vec![] });
            let loads: Vec<LimitKind> = limits.loads().into_iter().map(|(kind, _)| kind).collect();
            let is_load = matches!(kind.row().role, Role::Load { .. });
            assert_eq!(loads, if is_load { vec![kind] } else { vec![] });
        }
    }

    #[test]
    fn limits_are_overridden_and_lowered_one_by_one() {
        let own = Limits { force_xy_n: Some(5.0), feed_change_min: Some(0.2), ..Limits::default() };
        let other = Limits { force_xy_n: Some(7.0), power_w: Some(1.0), feed_change_min: Some(0.4), ..own };
        let over = own.overridden_by(&other);
        assert_eq!((over.force_xy_n, over.power_w, over.feed_change_min), (Some(7.0), Some(1.0), Some(0.4)));
        let lower = own.lowered_to(&other);
        assert_eq!((lower.force_xy_n, lower.power_w, lower.feed_change_min), (Some(5.0), Some(1.0), Some(0.2)));
        assert_eq!((LimitKind::Torque.unit(), LimitKind::Torque.in_report_unit(1500.0)), ("N·m", 1.5));
    }
}
