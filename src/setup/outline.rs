//! Outline of a cutter from the sizes a catalogue states. In: shape and sizes, mm and rad. Out: a [`Profile`].
//!
//! Taper, face and high-feed cutters share one outline: a flat to the tip radius, a corner arc, a straight side inclined
//! by `a` to the axis up to the widest radius, a cylinder. The corner of radius `c` has its centre at
//! (tip diameter / 2 − c, c), so that a tapered ball has a corner radius of half its tip diameter; it runs from straight
//! down to the normal of the side, −a.

use super::forms::ProfilePoint;
use super::read::{Reader, Sense};
use crate::machine::{Profile, Segment, Shape};
use crate::units::Dimension;
use std::f64::consts::FRAC_PI_2;

/// Sizes as far as they are given, mm and rad.
pub struct Sizes {
    /// Widest diameter.
    pub diameter_mm: f64,
    /// Length of the cutting edges.
    pub length_mm: f64,
    /// Corner radius.
    pub corner_mm: Option<f64>,
    /// Insert corner radius.
    pub insert_mm: Option<f64>,
    /// Diameter of the flat at the tip.
    pub tip_mm: Option<f64>,
    /// Full point angle.
    pub point_rad: Option<f64>,
    /// Side against the axis.
    pub taper_rad: Option<f64>,
    /// Main edge against the axis.
    pub lead_rad: Option<f64>,
}

/// Outline of every shape but `profile`.
pub fn of_shape(reader: &mut Reader, name: &str, shape: Shape, sizes: &Sizes) -> Profile {
    let (d, length) = (sizes.diameter_mm, sizes.length_mm);
    match shape {
        Shape::Ball => Profile::ball(d, length.max(0.5 * d)),
        Shape::Bull => bull(reader, name, sizes),
        Shape::Drill => pointed(reader, name, sizes, 118.0),
        Shape::Chamfer => pointed(reader, name, sizes, 90.0),
        Shape::Taper => taper(reader, name, sizes),
        Shape::Face | Shape::HighFeed => face(reader, name, sizes, if shape == Shape::Face { 45.0 } else { 80.0 }),
        _ => {
            if sizes.corner_mm.is_some_and(|c| c > 0.0) && shape == Shape::Flat {
                reader.complain(
                    &format!("{name}.corner_radius"),
                    "a flat end mill has no corner radius",
                    "write shape = \"bull\"",
                );
            }
            Profile::flat(d, length)
        }
    }
}

fn bull(reader: &mut Reader, name: &str, sizes: &Sizes) -> Profile {
    let key = format!("{name}.corner_radius");
    let d = sizes.diameter_mm;
    match sizes.corner_mm {
        Some(corner) if corner > 0.0 && corner <= 0.5 * d + 1e-9 => {
            Profile::bull(d, corner.min(0.5 * d), sizes.length_mm)
        }
        Some(corner) => {
            reader.complain(
                &key,
                format!("{corner} mm does not fit a diameter of {d} mm"),
                "it lies between 0 and half the diameter",
            );
            Profile::flat(d, sizes.length_mm)
        }
        None => {
            reader.missing(&key, "a bull-nose end mill has a corner radius; without one it is flat");
            Profile::flat(d, sizes.length_mm)
        }
    }
}

fn pointed(reader: &mut Reader, name: &str, sizes: &Sizes, default_deg: f64) -> Profile {
    let point_rad = angle(reader, &format!("{name}.point_angle"), sizes.point_rad, default_deg, 180.0);
    let tip = tip(reader, name, sizes).unwrap_or(0.0);
    Profile::cone(sizes.diameter_mm, tip, point_rad, sizes.length_mm)
}

fn taper(reader: &mut Reader, name: &str, sizes: &Sizes) -> Profile {
    let corner = sizes.corner_mm.unwrap_or(0.0);
    let tip_given = tip(reader, name, sizes);
    let side = match (sizes.taper_rad, tip_given) {
        (Some(side), _) => side,
        (None, Some(tip)) => (0.5 * (sizes.diameter_mm - tip)).atan2(sizes.length_mm),
        (None, None) => {
            reader
                .missing(&format!("{name}.taper_angle"), "give the angle of the side to the axis, or the tip_diameter");
            0.1
        }
    };
    let side = angle(reader, &format!("{name}.taper_angle"), Some(side), 0.0, 90.0);
    let tip = tip_given.unwrap_or_else(|| (sizes.diameter_mm - 2.0 * sizes.length_mm * side.tan()).max(2.0 * corner));
    inclined(0.5 * sizes.diameter_mm, 0.5 * tip, corner, side, sizes.length_mm)
}

fn face(reader: &mut Reader, name: &str, sizes: &Sizes, default_deg: f64) -> Profile {
    let lead = angle(reader, &format!("{name}.lead_angle"), sizes.lead_rad, default_deg, 90.0);
    let corner = sizes.insert_mm.or(sizes.corner_mm).unwrap_or(0.0);
    let radius = 0.5 * sizes.diameter_mm;
    let reach = (radius - sizes.length_mm * lead.tan()).max(0.5 * radius).max(corner);
    let tip = tip(reader, name, sizes).map_or(reach, |tip| 0.5 * tip);
    inclined(radius, tip, corner, lead, sizes.length_mm)
}

fn tip(reader: &mut Reader, name: &str, sizes: &Sizes) -> Option<f64> {
    let tip = sizes.tip_mm?;
    if tip >= sizes.diameter_mm {
        reader.complain(
            &format!("{name}.tip_diameter"),
            "the tip is as wide as the tool",
            "it is the smaller of the two diameters",
        );
    }
    Some(tip.min(0.999 * sizes.diameter_mm))
}

fn angle(reader: &mut Reader, key: &str, given: Option<f64>, default_deg: f64, below_deg: f64) -> f64 {
    match given {
        Some(value) if value < below_deg.to_radians() - 1e-9 => value,
        Some(_) => {
            reader.complain(key, "is too wide", format!("it is below {below_deg} deg"));
            default_deg.to_radians()
        }
        None => {
            reader.assume(key, format!("{default_deg} deg"), "default of the shape");
            default_deg.to_radians()
        }
    }
}

fn inclined(radius: f64, tip_radius: f64, corner: f64, side_rad: f64, length: f64) -> Profile {
    let mut segments = Vec::new();
    let centre = [(tip_radius - corner).max(0.0), corner];
    if centre[0] > 0.0 {
        segments.push(Segment::Line { from: [0.0, 0.0], to: [centre[0], 0.0] });
    }
    if corner > 0.0 {
        segments.push(Segment::Arc { centre, radius: corner, from_rad: -FRAC_PI_2, to_rad: -side_rad });
    }
    let start = [centre[0] + corner * side_rad.cos(), corner - corner * side_rad.sin()];
    let rise = if side_rad > 0.0 { (radius - start[0]) / side_rad.tan() } else { 0.0 };
    let top = (start[1] + rise.max(0.0)).min(length);
    let wide = start[0] + (top - start[1]) * side_rad.tan();
    if top > start[1] {
        segments.push(Segment::Line { from: start, to: [wide, top] });
    }
    if length > top {
        segments.push(Segment::Line { from: [wide, top], to: [wide, length] });
    }
    Profile { segments }
}

/// Outline written out by points.
pub fn written(reader: &mut Reader, key: &str, points: &[ProfilePoint]) -> Profile {
    let mut place = |q: &[_; 2]| [0, 1].map(|k| reader.value(key, &q[k], Dimension::Length, Sense::NotNegative));
    let mut segments = Vec::new();
    let mut last = [0.0, 0.0];
    for point in points {
        let to = match point {
            ProfilePoint::Line(to) => place(to),
            ProfilePoint::Arc(arc) => place(&arc.to),
        };
        match point {
            ProfilePoint::Line(_) if to != last => segments.push(Segment::Line { from: last, to }),
            ProfilePoint::Arc(arc) => segments.push(arc_between(last, to, place(&arc.centre))),
            ProfilePoint::Line(_) => {}
        }
        last = to;
    }
    let rises = segments.iter().all(|s| s.at(1.0).0[1] >= s.at(0.0).0[1] - 1e-9);
    if segments.is_empty() || !rises {
        reader.complain(key, "is no outline", "give points [radius, height] from the axis at the tip outward and up");
    }
    Profile { segments }
}

fn arc_between(from: [f64; 2], to: [f64; 2], centre: [f64; 2]) -> Segment {
    let polar = |p: [f64; 2]| (p[1] - centre[1]).atan2(p[0] - centre[0]);
    let radius = (to[0] - centre[0]).hypot(to[1] - centre[1]);
    Segment::Arc { centre, radius, from_rad: polar(from), to_rad: polar(to) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tapered_ball_is_smooth_where_the_ball_meets_the_side() {
        let profile = inclined(3.0, 1.0, 1.0, 0.1, 15.0);
        let [arc, side] = [profile.segments[0], profile.segments[1]];
        let ((end, n_end), (begin, n_begin)) = (arc.at(1.0), side.at(0.0));
        assert!((end[0] - begin[0]).abs() < 1e-12 && (end[1] - begin[1]).abs() < 1e-12);
        assert!((n_end[0] - n_begin[0]).abs() < 1e-12 && (n_end[1] - n_begin[1]).abs() < 1e-12);
        assert!(arc.at(0.0).0[0].abs() < 1e-12);
    }

    #[test]
    fn a_face_mill_is_widest_where_its_side_ends() {
        let profile = inclined(25.0, 20.0, 0.8, 45f64.to_radians(), 10.0);
        assert!((profile.max_radius() - 25.0).abs() < 1e-9);
        assert!((profile.height() - 10.0).abs() < 1e-12);
    }
}
