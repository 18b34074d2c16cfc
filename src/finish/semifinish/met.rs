//! What a finishing station meets, and which semi-finishing move left it. In: the engagement of both programs, linked;
//! the paths of both balls. Out: for each station the shares of the knots in the stock it meets; for each knot the
//! normal of the surface.
//!
//! An engaged arc ends where the circle of its ring leaves the stock. An end x that lies on the surface left by the
//! semi-finish (least d(x, c(s)) = R of its ball, [`super::centres`]) tells the move and the place s that left it, and
//! the normal there, u = (c − x)/R. Moving that surface by δ along u moves the end of the arc by δ/|u·t|, t the tangent
//! of the circle: that times the height of the ring is the weight of the end. The normal of a knot is the mean of u
//! over what its piece of path left: a pass leaves its surface evenly to both sides of the contact.

use super::centres::{Centres, Nearest};
use super::knots::Knots;
use crate::engage::{EngagementMap, Station};
use crate::machine::Slice;
use crate::path::Vec3;
use rayon::prelude::*;

/// Distance from the surface within which an end of an arc counts as on it, mm. The arcs of a station belong to its
/// most engaged point, up to half a spacing from its middle: on a path that turns with 10 mm that is 0.01 mm. It is
/// less than the least stock.
const ON_SURFACE_MM: f64 = 0.03;
/// Where circle and surface run along each other, an end moves by no more than this times the surface.
const STEEPEST: f64 = 10.0;
/// Ends of arcs that are looked at per station; more tell nothing new.
const ENDS: usize = 24;

/// A stretch of the finishing path.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Its move, counted in the finishing program.
    pub of: u32,
    /// Its middle along the move, mm.
    pub s_mm: f64,
    /// Its length, mm.
    pub length_mm: f64,
    /// The cut begins or ends within the length of contact: no stock makes its force that of a full cut.
    pub edge: bool,
}

/// What a sample meets.
#[derive(Debug, Clone, Default)]
pub struct Met {
    /// Knots with their shares; they add up to 1, or there are none: nothing of the semi-finish is met.
    pub shares: Vec<(u32, f64)>,
    /// The place that left most of it: move and mm along it, in the semi-finishing program as it came.
    pub place: Option<(u32, f64)>,
    /// Sum of weight · u over the ends, by knot.
    pub normals: Vec<(u32, Vec3)>,
}

/// Where the tip is and which way it goes, in the common frame.
#[derive(Debug, Clone, Copy)]
pub struct Stand {
    /// Tip.
    pub tip: Vec3,
    /// Horizontal direction of the feed.
    pub dir: [f64; 2],
}

/// The semi-finish as it is in the linked program.
pub struct Left<'a> {
    /// Path of the centre of its ball, over curves with numbers.
    pub centres: &'a Centres,
    /// Radius of its ball, mm.
    pub radius_mm: f64,
    /// Of each curve: the move of the program as it came, and the part of it, mm.
    pub made_of: &'a [(u32, [f64; 2])],
    /// Length of each curve, mm.
    pub lengths_mm: &'a [f64],
    /// Knots of the program as it came.
    pub knots: &'a Knots,
}

/// What stations meet.
pub fn met(
    stations: &[Option<(&Station, Stand)>],
    map: &EngagementMap,
    slices: &[Slice],
    finish_radius_mm: f64,
    left: &Left,
) -> Vec<Met> {
    let of = |near: &mut Vec<u32>, station: &Option<(&Station, Stand)>| {
        let Some((station, stand)) = station else { return Met::default() };
        let centre = stand.tip + Vec3::new(0.0, 0.0, finish_radius_mm);
        left.centres.near(centre, left.radius_mm.max(finish_radius_mm), near);
        left.met(map, station, stand, slices, near)
    };
    stations.par_iter().map_init(Vec::new, of).collect()
}

impl Left<'_> {
    fn met(&self, map: &EngagementMap, station: &Station, stand: &Stand, slices: &[Slice], near: &[u32]) -> Met {
        let mut found = Met::default();
        let arcs = map.arcs_of(station);
        let step = (2 * arcs.len()).div_ceil(ENDS).max(1);
        let mut most = 0.0;
        for (k, arc) in arcs.iter().enumerate() {
            for (end, angle) in [arc.entry_rad, arc.exit_rad].into_iter().enumerate() {
                if !(2 * k + end).is_multiple_of(step) && step > 1 && end == 0 {
                    continue;
                }
                let slice = &slices[arc.slice as usize];
                let (sin, cos) = f64::from(angle).sin_cos();
                let [dx, dy] = stand.dir;
                let out = Vec3::new(sin * dx - cos * dy, sin * dy + cos * dx, 0.0);
                let tangent = Vec3::new(-out.y, out.x, 0.0);
                let x = stand.tip + out * slice.radius_mm + Vec3::new(0.0, 0.0, slice.z_mm);
                let Some(nearest) = self.centres.nearest(near, x) else { continue };
                if !is_on_surface(nearest.distance_mm, self.radius_mm) {
                    continue;
                }
                let normal = normal(&nearest, x);
                let weight = slice.dz_mm() * (1.0 / normal.dot(&tangent).abs().max(1e-9)).min(STEEPEST);
                let place = self.place(&nearest);
                if weight > most {
                    (most, found.place) = (weight, Some(place));
                }
                self.enter(&mut found, place, weight, normal);
            }
        }
        let whole: f64 = found.shares.iter().map(|(_, weight)| weight).sum();
        found.shares.iter_mut().for_each(|(_, weight)| *weight /= whole);
        found
    }

    /// The place in the program as it came.
    fn place(&self, nearest: &Nearest) -> (u32, f64) {
        let (of, [from, to]) = self.made_of[nearest.of as usize];
        let length = self.lengths_mm[nearest.of as usize];
        let share = if length > 0.0 { nearest.s_mm / length } else { 1.0 };
        (of, from + share * (to - from))
    }

    fn enter(&self, found: &mut Met, (of, s_mm): (u32, f64), weight: f64, normal: Vec3) {
        let ([a, b], share) = self.knots.around(of, s_mm);
        for (knot, part) in [(a, 1.0 - share), (b, share)] {
            if part <= 0.0 {
                continue;
            }
            if let Some(k) = found.shares.iter().position(|(known, _)| *known == knot) {
                found.shares[k].1 += weight * part;
                found.normals[k].1 += normal * (weight * part);
            } else {
                found.shares.push((knot, weight * part));
                found.normals.push((knot, normal * (weight * part)));
            }
        }
    }
}

/// From a point of the surface to the centre, or above the centre to the axis.
fn normal(nearest: &Nearest, x: Vec3) -> Vec3 {
    let away = nearest.centre - x;
    let away = if away.z < 0.0 { Vec3::new(away.x, away.y, 0.0) } else { away };
    away.try_normalize(0.0).unwrap_or_else(Vec3::z)
}

/// Does a point so far from the path of the ball's centre lie on the surface that the ball left?
fn is_on_surface(distance_mm: f64, radius_mm: f64) -> bool {
    (distance_mm - radius_mm).abs() <= ON_SURFACE_MM
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_end_of_an_arc_is_on_the_surface_within_three_hundredths() {
        assert!(is_on_surface(3.029, 3.0) && is_on_surface(2.971, 3.0));
        assert!(!is_on_surface(3.031, 3.0) && !is_on_surface(2.969, 3.0));
    }
}
