//! Which blocks of the written file are simulated again, at the finer spacing. In: where the stations of each block come from, and their
//! loads at the feeds of the file. Out: yes or no for each block.
//!
//! Engagement does not depend on feeds, and a block that was not split runs along the same path through the same stock as in the original. A
//! finer simulation of it can only find a peak of load *between* two stations of the first one, and such a peak makes the loads at its two sides
//! differ. So for a station with the load r (a share of its limit, at its feed v) whose neighbours along the path have the loads r′ at the
//! feeds v′, the load between them is estimated as
//!
//! ```text
//! r + max |r − r′·v/v′|
//! ```
//!
//! over both neighbours: as far above r as a neighbour differs from it. r′·v/v′ is an upper bound of the neighbour's load at this feed, if it
//! rises, because a part of the load does not grow with the feed. A neighbour in air has r′ = 0, so where a cut begins or ends its load
//! counts twice.
//!
//! | block | simulated again |
//! |---|---|
//! | split | every piece: its engagement is not known |
//! | whole | if the estimate at a station whose feed can be chosen reaches [`NEAR`] of its limit |
//! | any | if the rate of change of force is limited, which is a quantity between stations |
//! | simulated in an earlier round | no: its stations are kept |

use rayon::prelude::*;

use super::ratios::Ratios;
use super::written_engagement::{StationsFrom, WrittenEngagement};
use crate::nc::{MoveKind, Toolpath};
use crate::schedule::known_loads::KnownLoads;

/// Share of a limit from which on a block is simulated again. In 166,000 whole blocks of fourteen programs the finer simulation found loads up to
/// 1.13 times the estimate (near 0.3 of the limit; 1.07 times from 0.5 on). For a load above its limit to be missed, it would have to be 1.25
/// times the estimate.
const NEAR: f64 = 0.8;

/// Load over limit at one station, and its feed in mm/s.
type Load = Option<(f64, f64)>;

/// Which moves are to be simulated for the check.
pub fn to_simulate_again(known: &WrittenEngagement, ratios: &Ratios, carried: &KnownLoads) -> Vec<bool> {
    let stations = &known.map.stations;
    let load = |index: usize| ratios.nearest(index, carried).map(|(feed_mm_s, _, ratio)| (ratio, feed_mm_s));
    let loads: Vec<Load> = (0..stations.len()).into_par_iter().map(load).collect();
    let beside = |here: usize, there: Option<usize>| {
        let station = stations.get(there?)?;
        let [a, b] = [stations[here].move_id.ix(), station.move_id.ix()];
        loads[there?].filter(|_| run_on(&known.written, a.min(b), a.max(b)))
    };
    let near = |index: usize| {
        let reach = reaches(loads[index], [beside(index, index.checked_sub(1)), beside(index, Some(index + 1))]);
        reach > NEAR && !ratios.is_fixed(&stations[index])
    };
    let everything = ratios.limits_force_rate();
    let wanted = |(index, met): (usize, &StationsFrom)| match met {
        StationsFrom::NotYet => true,
        StationsFrom::AsOriginal => {
            everything || known.map.of_move[index].clone().any(|station| near(station as usize))
        }
        StationsFrom::Finer => false,
    };
    known.stations_from.par_iter().enumerate().map(wanted).collect()
}

/// Do these moves run on from one to the other, at feed and with one tool?
fn run_on(written: &Toolpath, first: usize, last: usize) -> bool {
    let moves = &written.moves[first..=last];
    moves.iter().all(|motion| motion.kind == MoveKind::Feed && motion.tool == moves[0].tool)
}

/// The estimate for a station, as a share of its limit (see the head of the file).
fn reaches(here: Load, beside: [Load; 2]) -> f64 {
    let Some((ratio, feed_mm_s)) = here else { return 0.0 };
    let at_this_feed = |load: Load| load.map_or(0.0, |(ratio, of_mm_s)| ratio * feed_mm_s / of_mm_s);
    let apart = |load: Load| {
        let other = at_this_feed(load);
        if other.is_finite() { (ratio - other).abs() } else { ratio }
    };
    ratio + apart(beside[0]).max(apart(beside[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_station_reaches_as_much_further_as_its_neighbours_differ() {
        let is = |found: f64, wanted: f64| (found - wanted).abs() < 1e-12;
        let at_10 = |ratio: f64| Some((ratio, 10.0));
        assert!(is(reaches(at_10(0.7), [at_10(0.7), at_10(0.7)]), 0.7), "a steady cut");
        assert!(is(reaches(at_10(0.5), [at_10(0.3), at_10(0.6)]), 0.7), "the larger step, up or down");
        assert!(is(reaches(at_10(0.4), [None, at_10(0.4)]), 0.8), "a cut begins");
        // The same engagement at half the feed is no step; half the engagement at half the feed is one.
        assert!(is(reaches(at_10(0.6), [Some((0.3, 5.0)), at_10(0.6)]), 0.6));
        assert!(is(reaches(at_10(0.6), [Some((0.15, 5.0)), at_10(0.6)]), 0.9));
        assert!(is(reaches(at_10(0.6), [Some((0.0, 0.0)), at_10(0.6)]), 1.2), "nothing is known of a feed of zero");
        assert!(is(reaches(None, [at_10(0.9), at_10(0.9)]), 0.0), "nothing is cut here");
    }
}
