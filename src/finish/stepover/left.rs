//! What stays on a surface. In: the surface, the tool, its passes as they are read back. Out: places spread evenly over the machined area, with
//! the height that the tool cannot but leave there; the area on which passes leave more than they may.
//!
//! The height left at a place is its distance from the volume that the end sweeps, the least over its positions. Where the tool touches a
//! place with normal n, its tip is at p + r·n + a·n̂ − r·z (a: flat, r: corner radius, n̂: n seen from above, of unit length). If it rests
//! higher there, on something else, it may come closer a little aside, away from that.

use super::drop::{Contact, Dropper};
use super::near::{Near, nearest_mm};
use super::shape::Shape;
use super::surface::Surface;
use crate::numeric::golden_section;
use crate::path::{Curve, Vec3};
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_2;

/// Spacing of places on the surface, mm; at most a tenth of the radius of the tool. Judgement: less than a step-over.
const APART_MM: f64 = 0.2;
/// Most places; on a larger surface they lie farther apart.
const PLACES: f64 = 100_000.0;
/// Increments of the plastic sequence in two dimensions, which fills a square evenly (M. Roberts, 2018): 1/g and 1/g², with g³ = g + 1.
const PLASTIC: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
/// Positions tried aside, up to the radius of the tool, of a place on which the tool does not rest.
const ASIDE: f64 = 16.0;
/// How closely the position on a motion is found at which a flat end comes closest to a place, mm.
const NARROW_MM: f64 = 1e-4;
/// Share of the thickness of the stock from which a place counts as not cut.
const UNCUT: f64 = 0.99;

/// A place on the machined surface.
#[derive(Debug, Clone, Copy)]
struct Place {
    /// Its point, its normal, its triangle.
    contact: Contact,
    /// Height that the tool leaves there at best, mm.
    at_best_mm: f64,
}

/// Places on the machined surface.
#[derive(Debug)]
pub struct Places {
    each: Vec<Place>,
    /// Area that each stands for, mm².
    area_mm2: f64,
    shape: Shape,
}

/// What passes leave on the surface where the tool reaches it.
#[derive(Debug, Clone, PartialEq)]
pub struct Left {
    /// Area that the tool reaches, mm².
    pub reached_mm2: f64,
    /// The part of it on which more is left than the limit.
    pub beyond_mm2: f64,
    /// The part of it that no pass cuts.
    pub uncut_mm2: f64,
    /// Largest height left on it, mm, at most the thickness of the stock.
    pub most_mm: f64,
    /// Where that is, in the work frame, mm.
    pub at: Vec3,
    /// Where the tool would touch the places on which more is left than the limit, in the plane of the plan, and what is left there, mm.
    pub above: Vec<([f64; 2], f64)>,
}

/// Area out of reach of the tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutOfReach {
    /// Its share of the machined area.
    pub share: f64,
    /// The area, mm².
    pub area_mm2: f64,
    /// Largest height that stays there, mm.
    pub most_mm: f64,
}

impl Places {
    /// Places on the machined facets of a surface.
    pub fn new(surface: &Surface, dropper: &Dropper) -> Self {
        let shape = dropper.shape();
        let areas: Vec<(u32, f64)> = surface.machined().map(|(k, across)| (k, 0.5 * across.norm())).collect();
        let whole: f64 = areas.iter().map(|(_, area)| area).sum();
        let apart_mm = APART_MM.min(0.1 * shape.radius_mm()).max((whole / PLACES).sqrt());
        // A surface smaller than that has one place.
        let area_mm2 = (apart_mm * apart_mm).min(whole.max(f64::MIN_POSITIVE));
        let (mut spots, mut sum) = (Vec::new(), 0.5 * area_mm2);
        for (triangle, area) in areas {
            sum += area;
            while sum >= area_mm2 {
                sum -= area_mm2;
                spots.push(spot(surface, triangle, spots.len() as f64));
            }
        }
        let place = |contact: &Contact| Place { contact: *contact, at_best_mm: at_best_mm(dropper, contact) };
        Self { each: spots.par_iter().map(place).collect(), area_mm2, shape }
    }

    /// The part of the surface on which the tool leaves more than `tolerance_mm` at best.
    pub fn out_of_reach(&self, tolerance_mm: f64) -> OutOfReach {
        let out = || self.each.iter().map(|place| place.at_best_mm).filter(|mm| *mm > tolerance_mm);
        OutOfReach {
            share: out().count() as f64 / self.each.len().max(1) as f64,
            area_mm2: out().count() as f64 * self.area_mm2,
            most_mm: out().fold(0.0, f64::max),
        }
    }

    /// What motions leave on places that the tool reaches within `tolerance_mm`, with a normal of at most `most_z` along Z; `angle_rad`: from
    /// the frame of the places to the work frame.
    pub fn left(
        &self,
        curves: &[Curve],
        angle_rad: f64,
        stock_mm: &(dyn Fn(&Contact) -> f64 + Sync),
        [tolerance_mm, most_z, limit_mm]: [f64; 3],
    ) -> Left {
        let near = Near::new(curves, reach_mm(self.shape, limit_mm));
        let (sin, cos) = angle_rad.sin_cos();
        let turned = |p: Vec3| Vec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z);
        let height = |place: &&Place| {
            let Contact { point, normal, .. } = place.contact;
            let stock = stock_mm(&place.contact);
            let left = distance_mm(&near, self.shape, turned(point), turned(normal)).min(stock);
            (left, left > limit_mm + place.at_best_mm, stock > limit_mm && left >= UNCUT * stock)
        };
        let reached: Vec<&Place> = self
            .each
            .iter()
            .filter(|place| place.at_best_mm <= tolerance_mm && place.contact.normal.z <= most_z)
            .collect();
        let heights: Vec<(f64, bool, bool)> = reached.par_iter().map(height).collect();
        let area = |count: usize| count as f64 * self.area_mm2;
        let each = || heights.iter().zip(&reached);
        let most = each().reduce(|a, b| if b.0.0 > a.0.0 { b } else { a });
        let touched = |place: &Place| touching(self.shape, place.contact.point, place.contact.normal);
        let above = each().filter(|((left, ..), _)| *left > limit_mm);
        Left {
            reached_mm2: area(heights.len()),
            beyond_mm2: area(heights.iter().filter(|(_, beyond, _)| *beyond).count()),
            uncut_mm2: area(heights.iter().filter(|(.., uncut)| *uncut).count()),
            most_mm: most.map_or(0.0, |((left, ..), _)| *left),
            at: most.map_or(Vec3::zeros(), |(_, place)| turned(place.contact.point)),
            above: above.map(|((left, ..), place)| (touched(place).xy().into(), *left)).collect(),
        }
    }
}

/// Place number `number` on a triangle.
fn spot(surface: &Surface, triangle: u32, number: f64) -> Contact {
    let [a, b, c] = surface.triangles[triangle as usize];
    let [mut u, mut v] = PLASTIC.map(|step| (0.5 + step * (number + 1.0)).fract());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    let point = a + u * (b - a) + v * (c - a);
    Contact { tip_mm: point.z, point, normal: (b - a).cross(&(c - a)).normalize(), triangle, rim: false }
}

/// Height that the tool leaves at a place at best, mm.
fn at_best_mm(dropper: &Dropper, place: &Contact) -> f64 {
    let shape = dropper.shape();
    let tip = touching(shape, place.point, place.normal);
    let rest = |p: [f64; 2]| dropper.drop(p).map(|contact| (contact, Vec3::new(p[0], p[1], contact.tip_mm)));
    let left_mm = |rests: Vec3| shape.distance_mm(place.point - rests).max(0.0);
    // Off the surface nothing keeps the tool from the place.
    let Some((contact, rests)) = rest([tip.x, tip.y]) else { return 0.0 };
    let Some(aside) = contact.normal.xy().try_normalize(1e-6) else { return left_mm(rests) };
    let away = |k: u32| rest([0, 1].map(|axis| tip[axis] + shape.radius_mm() * f64::from(k) / ASIDE * aside[axis]));
    (1..=ASIDE as u32).filter_map(away).map(|(_, rests)| left_mm(rests)).fold(left_mm(rests), f64::min)
}

/// Tip of the tool that touches a point with a normal, mm.
fn touching(shape: Shape, point: Vec3, normal: Vec3) -> Vec3 {
    let level = Vec3::new(normal.x, normal.y, 0.0);
    let flat = level.try_normalize(1e-9).unwrap_or_default() * shape.flat_mm;
    point + shape.corner_mm * (normal - Vec3::z()) + flat
}

/// How far from where it would touch a point the tool may pass, if no more than a limit is to stay there, mm: over a plane, and as far
/// again as hollow ground is wider.
pub fn reach_mm(shape: Shape, limit_mm: f64) -> f64 {
    2.0 * (shape.flat_mm + (2.0 * shape.corner_mm * limit_mm).sqrt()).min(shape.radius_mm())
}

/// Distance of a point from the end of the tool along the motions near it, mm; infinite if there are none.
pub fn distance_mm(near: &Near, shape: Shape, point: Vec3, normal: Vec3) -> f64 {
    let closest = |curve: &Curve| closest_mm(curve, shape, point).max(0.0);
    near.about(touching(shape, point, normal)).map(closest).fold(f64::INFINITY, f64::min)
}

/// Distance of a point from the end of the tool along one motion, mm. A ball is closest where its centre is. A flat end may be closer on
/// either side of that, where it has come down along the motion and still covers the point; on each side, of an arc up to a quarter turn away,
/// the distance has one valley.
fn closest_mm(curve: &Curve, shape: Shape, point: Vec3) -> f64 {
    let at_mm = nearest_mm(curve, point - shape.corner_mm * Vec3::z());
    let left_mm = |s_mm: f64| shape.distance_mm(point - curve.point(s_mm));
    if shape.flat_mm <= 0.0 {
        return left_mm(at_mm);
    }
    let length = curve.length();
    let side_mm = if let Curve::Arc(arc) = curve { FRAC_PI_2 * arc.radius_mm } else { length };
    let sides = [[(at_mm - side_mm).max(0.0), at_mm], [at_mm, (at_mm + side_mm).min(length)]];
    sides.map(|[from, to]| golden_section(left_mm, from, to, NARROW_MM).1).into_iter().fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::{Arc, Plane};

    /// A bull-nose end down a shallow slope, over a crest and through a hollow, against positions 0.001 mm apart: it comes closest to a place where it has
    /// come down furthest and still covers it, up to its flat away from the place.
    #[test]
    fn a_flat_end_comes_closest_where_it_has_come_down_and_still_covers_the_place() {
        let shape = Shape { flat_mm: 2.0, corner_mm: 1.0 };
        let slope = Curve::Line { from: Vec3::new(0.0, 0.0, 1.15), to: Vec3::new(9.7, 0.0, 0.75) };
        // From x = 0 to 8 mm through z = 0.8 mm, the middle at x = 4 mm.
        let bent = |up: f64| {
            let half = f64::asin(4.0 / 45.0);
            let centre = Vec3::new(4.0, 0.0, 0.8 - 45.0 * up * half.cos());
            let [from, to] = [0.0, 8.0].map(|x| Vec3::new(x, 0.0, 0.8));
            Curve::Arc(Arc::new(Plane::Zx, from, to, centre, 2.0 * half * up))
        };
        for curve in [slope, bent(1.0), bent(-1.0)] {
            for k in 0..60 {
                let x = -1.0 + 0.2 * f64::from(k);
                let point = Vec3::new(x, 0.1 * f64::from(k % 7), 0.6);
                let positions = (0..=10_000).map(|k| curve.point(curve.length() * f64::from(k) / 1e4));
                let expected = positions.map(|tip| shape.distance_mm(point - tip)).fold(f64::INFINITY, f64::min);
                let found = closest_mm(&curve, shape, point);
                assert!((found - expected).abs() < 1e-4, "{curve:?} {point:?}: {found} {expected}");
            }
        }
    }
}
