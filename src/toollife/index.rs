//! The wear index from a reading. In: the load at a check point as a function of how far the edge is worn, and what was read
//! there. Out: the index, or why the reading can be none.
//!
//! A load rises with the index and with nothing else while the cut stays the same, so the index is where the predicted load
//! is the one read; for the response model that is β₀ = F − (b_l L + b_t t_m + …).

use crate::numeric::{bisect, middle};

/// A reading below this share of what a fresh edge loads, or above what a worn-out one does by the inverse, is no load of this
/// cut: force models are off by some ten per cent, units by a factor of 4 or more. Judgement.
pub const PLAUSIBLE: f64 = 0.4;
/// Load of a worn-out edge over that of a fresh one from which on a reading tells the wear: readings repeat to about 2 %, and a rise of
/// less than that is noise. Judgement.
pub const LEAST_RISE: f64 = 1.02;
/// Units that readings are taken for each other by, each with its factor on the unit expected.
const UNITS: [(f64, &str); 5] = [
    (1e-3, "thousands of the unit (kN, kW)"),
    (1e3, "thousandths of the unit (mN, mW)"),
    (1.0 / 4.448, "pounds-force"),
    (1.0 / 9.807, "kilograms-force"),
    (1.0 / 745.7, "horsepower"),
];

/// What a reading says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Seen {
    /// Rise of the index over that of a fresh edge; below 0 where the reading lies below a fresh edge's.
    Worn(f64),
    /// It is no load of this cut; the unit that it may be in.
    Implausible(Option<&'static str>),
    /// A worn-out edge would hardly load more than a fresh one: this reading cannot tell the wear.
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
