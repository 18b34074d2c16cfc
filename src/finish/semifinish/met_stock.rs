//! The stock that a finishing station meets, and the semi-finishing moves that left it. In: the engagement of both
//! programs, linked; the paths of both balls. Out: for each station the weights of the knots; for each knot the surface
//! normal.
//!
//! An engaged arc ends where the circle of its ring leaves the stock. If such an end x lies on the surface left by the
//! semi-finish (least d(x, c(s)) = R of its ball, [`super::centres`]), the move and place s that left it are known, and
//! the normal there, u = (c − x)/R. Moving that surface by δ along u moves the end of the arc by δ/|u·t|, with t the
//! tangent of the circle; the weight of the end is the height of the ring over |u·t|. The normal of a knot is the mean
//! of u over the ends it left, because a pass leaves its surface evenly on both sides of the contact.

use super::centres::{Centres, Near, Nearest};
use super::knots::Knots;
use crate::engage::{EngagementMap, Station};
use crate::machine::Slice;
use crate::path::Vec3;
use rayon::prelude::*;

/// Distance from the surface within which an end of an arc counts as on it, mm. Ends may belong to another place of the
/// station, up to half a spacing from its middle: on a path of radius 10 mm that is 0.01 mm off. Less than the least
/// stock.
const ON_SURFACE_MM: f64 = 0.03;
/// Largest 1/|u·t|, for circle and surface that are nearly parallel.
const STEEPEST: f64 = 10.0;
/// About as many ends of arcs are used per station.
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
    /// Does the cut begin or end within the length of contact? Then its force is not that of a full cut, whatever the
    /// stock.
    pub edge: bool,
}

/// The stock that a sample meets.
#[derive(Debug, Clone, Default)]
pub struct MetStock {
    /// Knots with weights that add up to 1; empty if no stock of the semi-finish is met.
    pub shares: Vec<(u32, f64)>,
    /// The place that left most of it: move and mm along it, in the original semi-finishing program.
    pub place: Option<(u32, f64)>,
    /// Sum of weight · u over the ends, for each knot.
    pub normals: Vec<(u32, Vec3)>,
}

/// Position and heading of the tool, in the common frame.
#[derive(Debug, Clone, Copy)]
pub struct ToolPlace {
    /// Tip.
    pub tip: Vec3,
    /// Horizontal direction of the feed.
    pub dir: [f64; 2],
}

/// The semi-finish as it is in the linked program.
pub struct SemiSurface<'a> {
    /// Path of the centre of its ball, over numbered curves.
    pub centres: &'a Centres,
    /// Radius of its ball, mm.
    pub radius_mm: f64,
    /// For each curve the move of the original program, and the part of it, mm.
    pub made_of: &'a [(u32, [f64; 2])],
    /// Length of each curve, mm.
    pub lengths_mm: &'a [f64],
    /// Knots of the original program.
    pub knots: &'a Knots,
}

/// The stock that each station meets.
pub fn met(
    stations: &[Option<(&Station, ToolPlace)>],
    map: &EngagementMap,
    slices: &[Slice],
    finish_radius_mm: f64,
    left: &SemiSurface,
) -> Vec<MetStock> {
    let of = |near: &mut Vec<Near>, station: &Option<(&Station, ToolPlace)>| {
        let Some((station, stand)) = station else { return MetStock::default() };
        let centre = stand.tip + Vec3::new(0.0, 0.0, finish_radius_mm);
        left.centres.near(centre, left.radius_mm.max(finish_radius_mm), near);
        left.met(map, station, stand, slices, near)
    };
    stations.par_iter().map_init(Vec::new, of).collect()
}

impl SemiSurface<'_> {
    fn met(
        &self,
        map: &EngagementMap,
        station: &Station,
        stand: &ToolPlace,
        slices: &[Slice],
        near: &mut Vec<Near>,
    ) -> MetStock {
        let mut found = MetStock::default();
        let arcs = map.arcs_of(station);
        let step = (2 * arcs.len()).div_ceil(ENDS).max(1);
        // Ends of arcs, with the tangent of the circle there and the height of its ring.
        let mut ends: Vec<(Vec3, f64)> = Vec::with_capacity(2 * arcs.len());
        let mut points = Vec::with_capacity(2 * arcs.len());
        for (k, arc) in arcs.iter().enumerate() {
            for (end, angle) in [arc.entry_rad, arc.exit_rad].into_iter().enumerate() {
                if !(2 * k + end).is_multiple_of(step) && step > 1 && end == 0 {
                    continue;
                }
                let slice = &slices[arc.slice as usize];
                let (sin, cos) = f64::from(angle).sin_cos();
                let [dx, dy] = stand.dir;
                let out = Vec3::new(sin * dx - cos * dy, sin * dy + cos * dx, 0.0);
                points.push(stand.tip + out * slice.radius_mm + Vec3::new(0.0, 0.0, slice.z_mm));
                ends.push((Vec3::new(-out.y, out.x, 0.0), slice.dz_mm()));
            }
        }
        self.centres.narrow(&points, near);
        let (mut most, mut first) = (0.0, 0);
        for (x, (tangent, height_mm)) in points.iter().zip(&ends) {
            let Some(nearest) = self.centres.nearest(near, *x, &mut first) else { continue };
            if !is_on_surface(nearest.distance_mm, self.radius_mm) {
                continue;
            }
            let normal = normal(&nearest, *x);
            let weight = height_mm * (1.0 / normal.dot(tangent).abs().max(1e-9)).min(STEEPEST);
            let place = self.place(&nearest);
            if weight > most {
                (most, found.place) = (weight, Some(place));
            }
            self.enter(&mut found, place, weight, normal);
        }
        let whole: f64 = found.shares.iter().map(|(_, weight)| weight).sum();
        found.shares.iter_mut().for_each(|(_, weight)| *weight /= whole);
        found
    }

    /// The place in the original program.
    fn place(&self, nearest: &Nearest) -> (u32, f64) {
        let (of, [from, to]) = self.made_of[nearest.of as usize];
        let length = self.lengths_mm[nearest.of as usize];
        let share = if length > 0.0 { nearest.s_mm / length } else { 1.0 };
        (of, from + share * (to - from))
    }

    fn enter(&self, found: &mut MetStock, (of, s_mm): (u32, f64), weight: f64, normal: Vec3) {
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

/// Unit vector from a point of the surface to the centre, or above the centre to the axis.
fn normal(nearest: &Nearest, x: Vec3) -> Vec3 {
    let away = nearest.centre - x;
    let away = if away.z < 0.0 { Vec3::new(away.x, away.y, 0.0) } else { away };
    away.try_normalize(0.0).unwrap_or_else(Vec3::z)
}

/// Does a point at this distance from the path of the ball's centre lie on the surface that the ball left?
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
