//! Lower bound of the time of any passes over a surface. In: the tool on the surface, places on it with their areas, limits, allowed
//! headings. Out: a time that no plan of such passes can be below.
//!
//! A pass at feed f along heading d with step-over s clears the area f·s/l per second seen from above, with l the
//! length of the path over its length seen from above. With the best feed, heading and side at every place
//!
//! T ≥ Σ dA / max_d max_f (f·s(f, d)/l(d)).
//!
//! Of passes that alternate, as many run one way as the other at every place, and the force differs: the stock lies on
//! the left of the one and on the right of the other. Two of them, with feeds f₁, f₂ and step-overs s₁, s₂, clear
//! (s₁ + s₂)/l in the time 1/f₁ + 1/f₂, so that
//!
//! T ≥ Σ dA / max_d max_{f₁, f₂} ((s(f₁, d) + s(f₂, −d)) / ((1/f₁ + 1/f₂)·l(d))).
//!
//! It counts the area between the outermost passes alone, without leads, links, corners, accelerations or overlapping
//! passes. The surface within a step-over is approximated as in the plan: straight along the feed, a circle across it.

use super::contour::{along_surface, heading};
use super::levels::downhill;
use super::passes::Requirements;
use super::reach::{Bounds, Place, ToolOnSurface};
use rayon::prelude::*;

/// `count` headings spread evenly within ±`half_rad` of +X; all round if that is π or more.
pub fn headings(half_rad: f64, count: usize) -> Vec<[f64; 2]> {
    use std::f64::consts::{PI, TAU};
    let angle = |k: usize| match k as f64 {
        k if half_rad >= PI => TAU * k / count as f64,
        k if count > 1 => half_rad * (2.0 * k / (count - 1) as f64 - 1.0),
        _ => 0.0,
    };
    (0..count).map(|k| [angle(k).cos(), angle(k).sin()]).collect()
}

/// Requirements that differ in the reference force alone: the loads at a place serve all of them.
pub type Alike<'a, const N: usize> = [&'a Requirements; N];

/// Where the time is bounded: the tool, places, requirements.
pub struct Over<'a, const N: usize> {
    /// The tool on the surface.
    pub on_surface: &'a ToolOnSurface<'a>,
    /// The places; those that no pass can cut do not count.
    pub places: &'a [Place],
    /// What passes have to keep.
    pub required: Alike<'a, N>,
}

impl<const N: usize> Over<'_, N> {
    /// Least times of passes with any of the headings at each place, s.
    pub fn least_s(&self, headings: &[[f64; 2]]) -> [f64; N] {
        let time = |(p, area): &Place| {
            let ways = headings.iter().flat_map(|d| [1.0, -1.0].map(|side| (*d, [-side * d[1], side * d[0]])));
            let bounds = &self.required[0].bounds;
            times_s(*area, ways.filter_map(|way| rates(self.on_surface, *p, way, (self.required, bounds))))
        };
        summed(self.places, time)
    }

    /// Least times of passes that alternate and follow each other to the left of the headings, s.
    pub fn least_alternating_s(&self, headings: &[[f64; 2]]) -> [f64; N] {
        let bounded = (self.required, &self.required[0].bounds);
        let time = |(p, area): &Place| {
            let rates = headings.iter().filter_map(|d| {
                let left = [-d[1], d[0]];
                let choices = |way: f64| Choices::new(self.on_surface, *p, (d.map(|x| way * x), left), bounded);
                let [there, back] = [choices(1.0)?, choices(-1.0)?];
                let longer = there.longer.min(back.longer);
                Some(std::array::from_fn(|k| rate_of_two(&there.choices[k], &back.choices[k]) / longer))
            });
            times_s(*area, rates)
        };
        summed(self.places, time)
    }

    /// Least times of passes of one height, s; their step-overs are bounded along the surface.
    pub fn least_of_one_height_s(&self) -> [f64; N] {
        let time = |(p, area): &Place| {
            let Some(contact) = self.on_surface.dropper.drop(*p) else { return [0.0; N] };
            let bounds = along_surface(&self.required[0].bounds, &contact);
            let down = downhill(&contact);
            let way = |down| (heading(down), down);
            let rates = down.and_then(|down| rates(self.on_surface, *p, way(down), (self.required, &bounds)));
            times_s(*area, rates.into_iter())
        };
        summed(self.places, time)
    }
}

fn summed<const N: usize>(places: &[Place], times_s: impl Fn(&Place) -> [f64; N] + Sync + Send) -> [f64; N] {
    let times: Vec<[f64; N]> = places.par_iter().map(times_s).collect();
    times.iter().fold([0.0; N], |sum, times| std::array::from_fn(|k| sum[k] + times[k]))
}

/// Times of an area at the best of some rates, s; 0 without a rate.
fn times_s<const N: usize>(area_mm2: f64, rates: impl Iterator<Item = [f64; N]>) -> [f64; N] {
    let best = rates.fold([0.0f64; N], |best, rate| std::array::from_fn(|k| best[k].max(rate[k])));
    best.map(|best| if best > 0.0 { area_mm2 / best } else { 0.0 })
}

/// Largest areas per second that a pass clears at a place, seen from above, mm²/s.
fn rates<const N: usize>(
    on_surface: &ToolOnSurface,
    p: [f64; 2],
    way: ([f64; 2], [f64; 2]),
    (required, bounds): (Alike<N>, &Bounds),
) -> Option<[f64; N]> {
    let Choices { longer, choices } = Choices::new(on_surface, p, way, (required, bounds))?;
    Some(choices.map(|choices| choices.iter().map(|[feed, step]| feed * step).fold(0.0, f64::max) / longer))
}

/// What a pass may choose from at a place.
struct Choices<const N: usize> {
    /// Length of the path over its length seen from above.
    longer: f64,
    /// Feeds, mm/s, each with its step-over, mm.
    choices: [Vec<[f64; 2]>; N],
}

impl<const N: usize> Choices<N> {
    fn new(
        on_surface: &ToolOnSurface,
        p: [f64; 2],
        way: ([f64; 2], [f64; 2]),
        (required, bounds): (Alike<N>, &Bounds),
    ) -> Option<Self> {
        let reach = on_surface.reach(p, way, bounds)?;
        let choices = required.map(|required| {
            let by_feed = required.feeds_mm_s.iter().map(|feed| [*feed, reach.step_mm(*feed, required.reference_n).0]);
            let by_step = reach.steps().iter().map(|(step, line)| [required.fastest_mm_s(line), *step]);
            by_feed.chain(by_step).collect()
        });
        Some(Self { longer: reach.longer, choices })
    }
}

/// Largest area per second of a pass there and one back, each with one of its choices, mm²/s on level ground.
fn rate_of_two(there: &[[f64; 2]], back: &[[f64; 2]]) -> f64 {
    let rate = |[f1, s1]: [f64; 2], [f2, s2]: [f64; 2]| (s1 + s2) / (f1.recip() + f2.recip());
    let of_there = |there: &[f64; 2]| back.iter().map(|back| rate(*there, *back)).fold(0.0, f64::max);
    there.iter().map(of_there).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_4, PI};

    /// Alike both ways it is feed times step-over; a pass that must go slower or closer lowers it to the mean over the time.
    #[test]
    fn two_passes_clear_what_both_clear_in_the_time_of_both() {
        assert!((rate_of_two(&[[10.0, 0.4]], &[[10.0, 0.4]]) - 4.0).abs() < 1e-12);
        assert!((rate_of_two(&[[10.0, 0.4]], &[[10.0, 0.2]]) - 3.0).abs() < 1e-12);
        assert!((rate_of_two(&[[10.0, 0.4]], &[[5.0, 0.4]]) - 0.8 / 0.3).abs() < 1e-12);
        // Of several the best pair: here back at the fast feed, though on its own it clears less.
        assert!((rate_of_two(&[[10.0, 0.4]], &[[5.0, 0.4], [16.0, 0.12]]) - 0.52 / 0.1625).abs() < 1e-12);
    }

    #[test]
    fn headings_are_spread_over_what_passes_may_turn() {
        assert_eq!(headings(0.0, 1), [[1.0, 0.0]]);
        let fan = headings(FRAC_PI_4, 3);
        assert!((fan[0][1] + fan[2][1]).abs() < 1e-12 && (fan[2][1] - FRAC_PI_4.sin()).abs() < 1e-12);
        let round = headings(PI, 4);
        assert!((round[2][0] + 1.0).abs() < 1e-12 && (round[1][1] - 1.0).abs() < 1e-12);
    }
}
