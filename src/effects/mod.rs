//! The open list of effects as data: what each means, its covariates, its parameters with bounds, and where it acts.
//!
//! An effect is a pure function from its parameters and the [`State`] of a cut to a [`Change`]: factors on the tare, on
//! the cutting coefficients (k_tc, k_rc, k_ac) and on the edge coefficients (k_te, k_re, k_ae), offsets of the
//! geometry, or the strength of what motion and measuring chain do. The room an effect acts on applies its change;
//! calibration, diagnosis, prediction and scheduling read the same list ([`ALL`]).
//!
//! A new effect is a file here, its `mod`, and its line in [`ALL`]; no other room knows it by name.

mod axis_power;
mod corner_feed;
mod cutting_speed;
mod drive_efficiency;
mod edge_chipping;
mod edge_force;
mod edge_position;
mod entry;
mod flank_wear;
mod hard_zone;
mod path_curvature;
mod runout;
mod sensor_lag;
mod size_effect;
mod stock_proud;
mod tare_speed;
mod tare_warm_up;
mod tool_diameter;
pub mod unnamed;
mod up_down;
pub mod wear;

use crate::machine::material::EffectUse;
use crate::machine::wear::{Lengths, WearRate};
use crate::path::Vec3;

/// Where an effect acts, and so which room applies it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acts {
    /// On the geometry of the cut (engage).
    Geometry,
    /// On the coefficients of the load (force).
    Load,
    /// On the motion of the machine (schedule).
    Motion,
    /// On the measuring chain (learn).
    Measuring,
}

impl Acts {
    /// Name in `library effects`.
    pub fn name(self) -> &'static str {
        match self {
            Acts::Geometry => "geometry",
            Acts::Load => "load",
            Acts::Motion => "motion",
            Acts::Measuring => "measuring",
        }
    }
}

/// Something that varies from cut to cut, along which a residual may show a pattern.
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
        }
    }

    /// Is it something that only a cut has? What a meter reads in its course is made by the cut.
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

    /// Factor to the unit that people read it in, and that unit.
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
            | Covariate::Tool => (1.0, ""),
            _ => (1.0, "mm"),
        }
    }

    /// Its value in a state; NaN where it is not known, or no matter of the state.
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
            Covariate::EdgePosition => state.edge_position_mm,
            Covariate::SinceEntry => state.since_entry_mm,
            Covariate::PathSpeed => state.path_speed_mm_s,
            Covariate::PathAcceleration => state.path_acceleration_mm_s2,
            Covariate::Tool => state.tool,
            Covariate::Load => state.load,
            _ => f64::NAN,
        }
    }
}

/// Sectors of 30° that the engaged arc is looked at in.
pub const SECTORS: usize = 6;

/// What a tooth meets in one sector of the engaged arc.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sector {
    /// Share of the cutting terms (by chip) and of the edge terms (by contact).
    pub share: [f64; 2],
    /// Mean chip thickness, mm.
    pub chip_thickness_mm: f64,
    /// Where it is, work coordinates, mm.
    pub at: [f64; 2],
}

/// What a cut is when an effect looks at it. Quantities that are not known are NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Time since the start, s.
    pub time_s: f64,
    /// Distance that each tooth of this tool has slid through material, mm, counted for each power of the feed; for −1 it is that
    /// distance itself.
    pub slid: Lengths,
    /// Rise of the wear index since the edge was fresh over the index of a fresh edge, by the law of the tool or of the model.
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
    /// The same by chip thickness.
    pub up_share_chip: f64,
    /// Tool tip in work coordinates, mm.
    pub position: Vec3,
    /// Unit vector of the feed.
    pub direction: Vec3,
    /// Signed curvature of the tool-centre path, 1/mm: positive concave.
    pub curvature_per_mm: f64,
    /// Height of the cut along the cutting edge, mm above the tip.
    pub edge_position_mm: f64,
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
    /// Predicted reading, in its unit: what a meter has to show here. Known in a diagnosis alone.
    pub load: f64,
    /// The engaged arc in sectors; all shares 0 where it is not known.
    pub sectors: [Sector; SECTORS],
}

impl State {
    /// Mean of a factor over the engaged arc, by chip and by contact. Where the arc is not known the cut is taken as
    /// one sector with its mean chip thickness.
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
            position: Vec3::repeat(nan),
            direction: Vec3::repeat(nan),
            curvature_per_mm: nan,
            edge_position_mm: nan,
            since_entry_mm: nan,
            tare_share: nan,
            path_speed_mm_s: nan,
            path_acceleration_mm_s2: nan,
            tool: nan,
            load: nan,
            sectors: [Sector::default(); SECTORS],
        }
    }
}

/// Angle of the feed in the plane: it is not known of a plunge.
fn heading(state: &State) -> f64 {
    let d = state.direction;
    if d.x.hypot(d.y) > 0.1 { d.y.atan2(d.x) } else { f64::NAN }
}

/// What an effect does to one cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// Factor on the tare.
    pub tare: f64,
    /// Factor on the cutting coefficients.
    pub cutting: f64,
    /// Factor on the edge coefficients.
    pub edge: f64,
    /// Added to the chip thickness of the most loaded tooth (peaks only), mm.
    pub peak_chip_mm: f64,
    /// Offset of the tool's axis from that of the spindle, mm, where the measurement is compared with it.
    pub runout_mm: f64,
    /// Which way it points, in pitches of the teeth: 0 … 1 from one tooth to the next.
    pub runout_phase: f64,
    /// Stock stands higher by this, mm.
    pub stock_top_mm: f64,
    /// Stock stands out to the sides by this, mm.
    pub stock_side_mm: f64,
    /// The faces towards −x, +x, −y, +y stand out by this beside it, mm.
    pub stock_faces_mm: [f64; 4],
    /// Tool is larger by this, mm of diameter.
    pub diameter_mm: f64,
    /// Acceleration of the machine over the declared one.
    pub acceleration: f64,
    /// Relative excess of the reading at the reference load.
    pub reading_excess: f64,
    /// Power of the load with which it grows.
    pub reading_exponent: f64,
    /// Time constant of the reading, s.
    pub lag_s: f64,
    /// Geometry of the curved path instead of the straight one: 0 no … 1 yes.
    pub curved: f64,
}

impl Default for Change {
    fn default() -> Self {
        Self {
            tare: 1.0,
            cutting: 1.0,
            edge: 1.0,
            peak_chip_mm: 0.0,
            runout_mm: 0.0,
            runout_phase: 0.0,
            stock_top_mm: 0.0,
            stock_side_mm: 0.0,
            stock_faces_mm: [0.0; 4],
            diameter_mm: 0.0,
            acceleration: 1.0,
            reading_excess: 0.0,
            reading_exponent: 1.0,
            lag_s: 0.0,
            curved: 0.0,
        }
    }
}

/// What data must show before an effect is looked for in them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Need {
    /// A covariate that ranges over more than this, in its own unit.
    Range(Covariate, f64),
    /// A covariate whose largest value is at least so many times the smallest of those above 2 % of it.
    Ratio(Covariate, f64),
    /// A covariate that is known at all.
    Known(Covariate),
    /// Readings with nothing cut.
    Tare,
    /// Base coefficients without an edge force.
    NoEdgeCoefficients,
    /// Enough samples to place an instant or a region.
    Samples,
    /// Samples that follow each other in time.
    Series,
}

/// What of the geometry an effect changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Geometry {
    /// The top face of the stock.
    StockTop,
    /// The side faces of the stock.
    StockSide,
    /// The diameter of the tool.
    Diameter,
    /// A curved path in place of a straight one.
    Curved,
    /// The axis of the tool, off that of the spindle.
    Runout,
}

/// An instant, or a side of a region, that is looked for in the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// An instant, s. The load jumps there and does not vary smoothly with it: it is scanned, not fitted.
    Instant,
    /// Least X of a region, mm.
    XMin,
    /// Greatest X.
    XMax,
    /// Least Y.
    YMin,
    /// Greatest Y.
    YMax,
    /// A knot of a curve over a covariate.
    Knot,
}

/// A parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Name in model files and reports.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Least physical value.
    pub min: f64,
    /// Greatest physical value.
    pub max: f64,
    /// Values at which a search begins.
    pub starts: &'static [f64],
    /// Value at which it adds nothing; a simpler form of the effect leaves it there, and so does a model that does not
    /// give it. `None`: always fitted.
    pub neutral: Option<f64>,
    /// What of an instant or a place it is, which is looked for in the data and does not begin at a given value.
    pub place: Option<Place>,
    /// What it is.
    pub meaning: &'static str,
}

impl Parameter {
    /// Is it found by scanning, and not fitted?
    pub fn is_scanned(&self) -> bool {
        matches!(self.place, Some(Place::Instant | Place::Knot))
    }
}

/// What of a reading an effect changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Multiplies {
    /// What the cut takes: cutting and edge terms.
    Load,
    /// What the spindle takes without a cut.
    Tare,
    /// All that the meter shows.
    Reading,
}

/// Which way a reading goes as a covariate grows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Up alone.
    Up,
    /// Down alone.
    Down,
    /// Any but with its largest value inside the range.
    NoPeak,
    /// Up, down, or both.
    Either,
}

/// One named effect: everything that any room needs to know of it stands in its file.
#[derive(Debug)]
pub struct Effect {
    /// Name in reports and model files.
    pub name: &'static str,
    /// One sentence.
    pub meaning: &'static str,
    /// Where it acts.
    pub acts: Acts,
    /// What it depends on.
    pub covariates: &'static [Covariate],
    /// What of a reading it changes.
    pub multiplies: Multiplies,
    /// Covariates that belong to this effect alone: a curve over one of them is this effect in another form than its law.
    pub family: &'static [Covariate],
    /// Which way the reading goes with those.
    pub way: Way,
    /// Its parameters.
    pub parameters: &'static [Parameter],
    /// Sets of parameters that are fitted together, the other optional ones neutral; empty: every set of the optional ones.
    pub forms: &'static [&'static [usize]],
    /// What it does to a cut.
    pub change: fn(&[f64], &State) -> Change,
    /// The law by which it wears edges, for an index whose fresh edge is 1. What it changes reaches predicted loads as wear of the tool
    /// ([`wear`]), and not as a change.
    pub wear: Option<fn(&[f64]) -> WearRate>,
    /// The cut that shows it apart from the others, one clause.
    pub separated_by: &'static str,
    /// What data must show before it is looked for; all of it.
    pub needs: &'static [Need],
    /// What of the geometry it changes; data that show none of it cannot show the effect.
    pub geometry: &'static [Geometry],
    /// Why these values are those of no such effect, in a log whose times are known to so many s; beside the bounds.
    pub refused: fn(&[f64], f64) -> Option<String>,
    /// True for what happened once and does not happen again when the program runs anew.
    pub is_accident: bool,
}

/// What an effect is where its file says nothing else.
const BARE: Effect = Effect {
    name: "",
    meaning: "",
    acts: Acts::Load,
    covariates: &[],
    multiplies: Multiplies::Load,
    family: &[],
    way: Way::Either,
    parameters: &[],
    forms: &[],
    change: |_, _| Change::default(),
    wear: None,
    separated_by: "",
    needs: &[],
    geometry: &[],
    refused: |_, _| None,
    is_accident: false,
};

impl Effect {
    /// Are these values inside their bounds?
    pub fn is_physical(&self, values: &[f64]) -> bool {
        let inside = |(p, v): (&Parameter, &f64)| v.is_finite() && *v >= p.min && *v <= p.max;
        values.len() == self.parameters.len() && self.parameters.iter().zip(values).all(inside)
    }

    /// Is an instant or a place of it looked for in the data?
    pub fn is_looked_for(&self) -> bool {
        self.parameters.iter().any(|p| p.place.is_some())
    }

    /// Does what it explains follow this covariate, in this part of the reading?
    pub fn knows(&self, covariate: Covariate, part: Multiplies) -> bool {
        self.multiplies == part && self.covariates.contains(&covariate)
    }

    /// Does it change this of the geometry?
    pub fn changes(&self, geometry: Geometry) -> bool {
        self.geometry.contains(&geometry)
    }

    /// Its parameters in order, from those that a model gives; `None` where one without a neutral value is missing.
    pub fn values(&self, used: &EffectUse) -> Option<Vec<f64>> {
        let given = |name: &str| used.parameters.iter().find(|(key, _)| key == name).map(|(_, value)| *value);
        self.parameters.iter().map(|p| given(p.name).or(p.neutral)).collect()
    }
}

/// Every effect.
pub const ALL: &[&Effect] = &[
    &flank_wear::EFFECT,
    &edge_chipping::EFFECT,
    &size_effect::EFFECT,
    &edge_force::EFFECT,
    &cutting_speed::EFFECT,
    &edge_position::EFFECT,
    &up_down::EFFECT,
    &entry::EFFECT,
    &hard_zone::EFFECT,
    &runout::EFFECT,
    &stock_proud::EFFECT,
    &tool_diameter::EFFECT,
    &path_curvature::EFFECT,
    &corner_feed::EFFECT,
    &tare_warm_up::EFFECT,
    &tare_speed::EFFECT,
    &axis_power::EFFECT,
    &drive_efficiency::EFFECT,
    &sensor_lag::EFFECT,
];

/// The effect whose form a curve over a covariate is; `None` where it could be anything.
pub fn family_of(covariate: Covariate, part: Multiplies) -> Option<&'static Effect> {
    ALL.iter().copied().find(|effect| effect.multiplies == part && effect.family.contains(&covariate))
}

/// The effect of this name, be it of the list or a curve that bears none.
pub fn named(name: &str) -> Option<&'static Effect> {
    let curves = unnamed::CURVES.iter().map(|(_, effect)| *effect);
    ALL.iter().copied().chain(curves).find(|effect| effect.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_starts_are_physical() {
        for (i, effect) in ALL.iter().enumerate() {
            assert!(ALL[..i].iter().all(|other| other.name != effect.name));
            for p in effect.parameters {
                assert!(p.starts.iter().all(|v| (p.min..=p.max).contains(v)), "{} {}", effect.name, p.name);
            }
        }
        assert!(named("flank-wear").is_some() && named("gremlins").is_none());
    }

    #[test]
    fn a_covariate_belongs_to_one_family_at_most() {
        for effect in ALL {
            for covariate in effect.family {
                assert_eq!(family_of(*covariate, effect.multiplies).map(|e| e.name), Some(effect.name));
                assert!(effect.covariates.contains(covariate));
            }
        }
        // Time and place may be anything.
        assert!(
            family_of(Covariate::Time, Multiplies::Load).is_none()
                && family_of(Covariate::X, Multiplies::Tare).is_none()
        );
    }

    #[test]
    fn what_is_looked_for_is_an_instant_or_a_whole_region() {
        for effect in ALL.iter().filter(|effect| effect.is_looked_for()) {
            let has = |place: Place| effect.parameters.iter().filter(|p| p.place == Some(place)).count();
            let sides = [Place::XMin, Place::XMax, Place::YMin, Place::YMax].map(has);
            assert!(matches!((has(Place::Instant), sides), (1, [0, 0, 0, 0]) | (0, [1, 1, 1, 1])), "{}", effect.name);
        }
    }

    #[test]
    fn a_covariate_that_an_effect_shows_along_is_one_of_the_state_or_of_the_reading() {
        let known = State { position: Vec3::zeros(), direction: Vec3::new(1.0, 0.0, 0.0), ..State::default() };
        assert_eq!([Covariate::X.of(&known), Covariate::Heading.of(&known)], [0.0, 0.0]);
        // The way of a plunge has no heading.
        assert!(Covariate::Heading.of(&State { direction: Vec3::new(0.0, 0.0, -1.0), ..known }).is_nan());
    }
}
