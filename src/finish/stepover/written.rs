//! Scallops between the passes as they are written. In: the plan, the motions on passes as they are read back. Out: the
//! scallops that these leave.
//!
//! Passes are written as lines and arcs within a tolerance, with rounded coordinates. At every spot of the plan the tip lies on the nearest
//! place of the written passes, and so does the tip on the pass before; the scallop is the height left at the highest point of the surface
//! between the two: its distance from all written passes. Of passes of one height it is that of the section, as in their plan.

use super::drop::Contact;
use super::left::{distance_mm, reach_mm};
use super::near::Near;
use super::plan::{Plan, Spot};
use super::reach::ToolOnSurface;
use crate::path::{Curve, Vec3};
use rayon::prelude::*;

/// The plan with the scallops of the written motions instead of its own; `angle_rad`: from the frame of the plan to the
/// work frame.
pub fn with_scallops(
    on_surface: &ToolOnSurface,
    mut plan: Plan,
    (curves, angle_rad): (&[Curve], f64),
    limit_mm: f64,
) -> Plan {
    let near = Near::new(curves, reach_mm(on_surface.shape(), limit_mm));
    let turned = |p: Vec3, angle_rad: f64| {
        let (sin, cos) = angle_rad.sin_cos();
        Vec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z)
    };
    let written = |tip: Vec3| {
        let (at, tangent) = near.nearest(turned(tip, angle_rad))?;
        Some((turned(at, -angle_rad), turned(tangent, -angle_rad)))
    };
    let left_mm = |contact: Contact| {
        let [point, normal] = [contact.point, contact.normal].map(|v| turned(v, angle_rad));
        distance_mm(&near, on_surface.shape(), point, normal).min((on_surface.stock_mm)(&contact))
    };
    let scallop_mm = |spot: &Spot| {
        let before = spot.beside?;
        let (tip, tangent) = written(spot.tip)?;
        let level = tangent.xy().try_normalize(0.0)?;
        let (beside, _) = written(before)?;
        if on_surface.one_height {
            // A pass of one spot is not written: what is found then is another one.
            let is_other = (beside - before).norm() > 0.5 * (before - spot.tip).norm();
            let section = || on_surface.scallop_between_mm(spot.at, [level.x, level.y], [tip, beside]);
            return Some(()).filter(|()| !is_other).and_then(|()| section());
        }
        Some(on_surface.highest_between([beside, tip], tangent).map_or(0.0, |(_, contact)| left_mm(contact)))
    };
    let spots = plan.passes.iter_mut().flat_map(|pass| pass.stretches.iter_mut().flatten());
    spots.collect::<Vec<_>>().into_par_iter().for_each(|spot| {
        spot.scallop_mm = scallop_mm(spot).unwrap_or(spot.scallop_mm);
    });
    plan
}
