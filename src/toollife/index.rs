//! The wear index from a reading. In: the predicted load at a check point as a function of wear, and the reading there. Out: the index, or why
//! the reading cannot be a load of this cut.
//!
//! As long as the cut stays the same, its load rises only with the index, so the index is the value at which the predicted load equals the
//! reading; for the response model that is β₀ = F − (b_l L + b_t t_m + …).

use crate::numeric::{bisect, middle};

/// A reading below this share of the load of a fresh edge, or above that of a worn-out edge divided by this share, is not a load of this cut:
/// force models are wrong by some ten per cent, a wrong unit is a factor of 4 or more. Our judgement.
pub const PLAUSIBLE: f64 = 0.4;
/// Least ratio of the load of a worn-out edge to that of a fresh one for which readings can show wear: readings repeat to about 2 %, so a
/// smaller rise is noise. Our judgement.
pub const LEAST_RISE: f64 = 1.02;
/// Units that are confused in readings, each with its factor on the expected unit.
const UNITS: [(f64, &str); 5] = [
    (1e-3, "thousands of the unit (kN, kW)"),
    (1e3, "thousandths of the unit (mN, mW)"),
    (1.0 / 4.448, "pounds-force"),
    (1.0 / 9.807, "kilograms-force"),
    (1.0 / 745.7, "horsepower"),
];

/// The result of a reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Seen {
    /// Rise of the index over that of a fresh edge; below 0 where the reading lies below a fresh edge's.
    Worn(f64),
    /// It is not a load of this cut; the unit that it may be in.
    Implausible(Option<&'static str>),
    /// A worn-out edge would have hardly more load than a fresh one, so the reading does not show the wear.
    Blind,
}

/// The index from a reading. `load(worn)`: the load at the check point with an edge whose index has risen by `worn` times that
/// of a fresh one; `end`: that rise of a worn-out edge.
pub fn seen(reading: f64, end: f64, load: &dyn Fn(f64) -> f64) -> Seen {
    let (fresh, worn_out) = (load(0.0), load(end));
    // Also where one of them is no number.
    if fresh.is_nan() || worn_out.is_nan() || worn_out <= LEAST_RISE * fresh {
        return Seen::Blind;
    }
    let plausible = |reading: f64| reading >= PLAUSIBLE * fresh && reading <= worn_out / PLAUSIBLE;
    if !plausible(reading) {
        let unit = UNITS.iter().find(|(factor, _)| plausible(reading / factor)).map(|(_, unit)| *unit);
        return Seen::Implausible(unit);
    }
    // The load is affine in the wear or nearly so: the secant from fresh to worn out, then bisection about it.
    let mut high = end.max(0.1);
    while load(high) < reading {
        high *= 2.0;
    }
    Seen::Worn(middle(bisect(|worn| load(worn) < reading, -1.0, high, 60)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(worn: f64) -> f64 {
        163.2 + 86.8 * (1.0 + worn)
    }

    #[test]
    fn the_index_is_where_the_predicted_load_is_the_one_read() {
        for worn in [-0.2, 0.0, 0.7, 3.0] {
            let Seen::Worn(found) = seen(load(worn), 1.7, &load) else { panic!("{worn}") };
            assert!((found - worn).abs() < 1e-9, "{found}");
        }
    }

    #[test]
    fn a_load_that_wear_hardly_changes_tells_nothing() {
        let with_tare = |tare: f64| move |worn: f64| tare + 10.0 * worn;
        assert_eq!(seen(1000.0, 1.0, &with_tare(1000.0)), Seen::Blind);
        assert!(matches!(seen(403.0, 1.0, &with_tare(400.0)), Seen::Worn(_)));
        assert_eq!(seen(1.0, 1.0, &|_| f64::NAN), Seen::Blind);
    }

    #[test]
    fn a_wrong_unit_is_named() {
        assert_eq!(seen(0.26, 1.7, &load), Seen::Implausible(Some("thousands of the unit (kN, kW)")));
        assert_eq!(seen(260e3, 1.7, &load), Seen::Implausible(Some("thousandths of the unit (mN, mW)")));
        assert_eq!(seen(58.0, 1.7, &load), Seen::Implausible(Some("pounds-force")));
        assert_eq!(seen(-250.0, 1.7, &load), Seen::Implausible(None));
        let bounds = [PLAUSIBLE * load(0.0), load(1.7) / PLAUSIBLE];
        assert!(matches!(seen(1.001 * bounds[0], 1.7, &load), Seen::Worn(_)));
        assert!(matches!(seen(0.999 * bounds[0], 1.7, &load), Seen::Implausible(_)));
        assert!(matches!(seen(0.999 * bounds[1], 1.7, &load), Seen::Worn(_)));
        assert!(matches!(seen(1.001 * bounds[1], 1.7, &load), Seen::Implausible(_)));
    }
}
