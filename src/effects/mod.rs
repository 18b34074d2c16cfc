//! The list of effects. In: nothing. Out: [`ALL`], one [`Effect`] for each named cause why loads or readings differ from the base model:
//! its meaning, covariates, parameters with bounds, and law.
//!
//! An effect is a pure function from its parameters and the [`State`] of a cut to a [`Change`]: factors on the tare, on the cutting
//! coefficients (k_tc, k_rc, k_ac) and on the edge coefficients (k_te, k_re, k_ae), offsets of the geometry, or parameters of the motion and
//! of the measuring chain. The room on which an effect acts applies its change. Calibration, diagnosis, prediction and scheduling all
//! read this list.
//!
//! A new effect is a file here, its `mod`, and its line in [`ALL`]; no other room knows it by name.

mod along_edge;
mod axis_power;
mod change;
mod corner_feed;
mod covariate;
mod cutting_speed;
mod drive_efficiency;
mod edge_chipping;
mod edge_force;
mod edge_position;
mod effect;
mod entry;
mod flank_wear;
mod hard_zone;
mod path_curvature;
mod runout;
mod sensor_lag;
mod size_effect;
mod state;
mod stock_proud;
mod tare_speed;
mod tare_warm_up;
mod tool_diameter;
pub mod unnamed;
mod up_down;
pub mod wear;

pub use along_edge::{AlongEdge, EdgePiece};
pub use change::{Change, Excess};
pub use covariate::Covariate;
use effect::BARE;
pub use effect::{Acts, Effect, Geometry, Multiplies, Need, Parameter, Place, Way};
pub use state::{SECTORS, Sector, State};

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

/// The effect to which a covariate belongs, for residuals that follow it without fitting a law; `None`: several causes are possible.
pub fn family_of(covariate: Covariate, part: Multiplies) -> Option<&'static Effect> {
    ALL.iter().copied().find(|effect| effect.multiplies == part && effect.family.contains(&covariate))
}

/// The effect with this name, from the list or from the curves without a named cause.
pub fn named(name: &str) -> Option<&'static Effect> {
    let curves = unnamed::CURVES.iter().map(|(_, effect)| *effect);
    ALL.iter().copied().chain(curves).find(|effect| effect.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::Vec3;

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
