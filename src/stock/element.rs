//! Elements: moves in the form in which they sweep the stock, that is lines and level arcs. In: curves of the toolpath. Out: [`Element`]s in
//! order of execution; the index of an element is the provenance id of the cells that it lowers.
//!
//! Lines and level arcs are kept exactly. Everything else (helices, arcs in ZX and YZ, spirals) becomes chords whose
//! sagitta is at most [`SAGITTA_MM`].

use crate::ids::MoveId;
use crate::path::{Arc, Curve, Plane, Vec3};

/// Largest distance between a chord and the curve it stands for, mm.
pub const SAGITTA_MM: f64 = 5e-4;

/// Distance up to which one element ends where the next begins, mm.
const JOINED_MM: f64 = 1e-9;

/// The path of the tool's tip along an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Track {
    /// Straight.
    Line {
        /// Start, mm.
        from: Vec3,
        /// End, mm.
        to: Vec3,
    },
    /// Level arc; its radius runs linearly with the angle (a control tolerates a small mismatch).
    Arc {
        /// Centre in XY, mm.
        centre: [f64; 2],
        /// Height of the tip, mm.
        z: f64,
        /// Radius at start and end, mm.
        radius: [f64; 2],
        /// Angle of the start, rad.
        start: f64,
        /// Angle turned, rad; counter-clockwise positive.
        sweep: f64,
    },
}

/// One swept piece of a move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Element {
    /// Where its tip goes.
    pub track: Track,
    /// Where it begins, mm along its move.
    pub from_mm: f64,
    /// Its move.
    pub move_id: MoveId,
    /// Index of its tool in the list of cutters.
    pub cutter: u16,
    /// The element before it ends where this one begins, with the same cutter, so what lies behind that point is swept already.
    pub joined: bool,
}

impl Track {
    /// Length, mm.
    pub fn length(&self) -> f64 {
        match self {
            Track::Line { from, to } => (to - from).norm(),
            Track::Arc { radius, sweep, .. } => 0.5 * (radius[0] + radius[1]) * sweep.abs(),
        }
    }
    /// Smallest box that holds the track (min, max), mm.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        match *self {
            Track::Line { from, to } => (from.inf(&to), from.sup(&to)),
            Track::Arc { centre, z, radius, start, sweep } => arc_bounds(centre, z, radius, start, sweep),
        }
    }
    /// Point at a distance along it.
    pub fn point(&self, along_mm: f64) -> Vec3 {
        match self.until(along_mm) {
            Track::Line { to, .. } => to,
            arc @ Track::Arc { .. } => arc.ends().1,
        }
    }
    /// First and last point.
    pub fn ends(&self) -> (Vec3, Vec3) {
        match *self {
            Track::Line { from, to } => (from, to),
            Track::Arc { centre: [x, y], z, radius, start, sweep } => {
                let end = |angle: f64, r: f64| Vec3::new(x + r * angle.cos(), y + r * angle.sin(), z);
                (end(start, radius[0]), end(start + sweep, radius[1]))
            }
        }
    }
    /// The same track elsewhere.
    pub fn moved(&self, by: Vec3) -> Self {
        match *self {
            Track::Line { from, to } => Track::Line { from: from + by, to: to + by },
            Track::Arc { centre: [x, y], z, radius, start, sweep } => {
                Track::Arc { centre: [x + by.x, y + by.y], z: z + by.z, radius, start, sweep }
            }
        }
    }
    /// The track seen from `origin` with the unit vector `dir` as x axis; heights stay.
    pub fn seen_from(&self, origin: [f64; 2], dir: [f64; 2]) -> Self {
        let local = |x: f64, y: f64| {
            let (x, y) = (x - origin[0], y - origin[1]);
            [x * dir[0] + y * dir[1], y * dir[0] - x * dir[1]]
        };
        let point = |p: Vec3| {
            let [x, y] = local(p.x, p.y);
            Vec3::new(x, y, p.z)
        };
        match *self {
            Track::Line { from, to } => Track::Line { from: point(from), to: point(to) },
            Track::Arc { centre: [x, y], z, radius, start, sweep } => {
                Track::Arc { centre: local(x, y), z, radius, start: start - dir[1].atan2(dir[0]), sweep }
            }
        }
    }
    /// The beginning of the track, up to `length_mm` along it.
    pub fn until(&self, length_mm: f64) -> Self {
        let whole = self.length();
        let t = if whole > 0.0 { (length_mm / whole).clamp(0.0, 1.0) } else { 1.0 };
        match *self {
            Track::Line { from, to } => Track::Line { from, to: from + (to - from) * t },
            Track::Arc { centre, z, radius: [r0, r1], start, sweep } => {
                Track::Arc { centre, z, radius: [r0, r0 + t * (r1 - r0)], start, sweep: t * sweep }
            }
        }
    }
}

fn arc_bounds(centre: [f64; 2], z: f64, radius: [f64; 2], start: f64, sweep: f64) -> (Vec3, Vec3) {
    let point = |angle: f64, r: f64| Vec3::new(centre[0] + r * angle.cos(), centre[1] + r * angle.sin(), z);
    let (a, b) = (point(start, radius[0]), point(start + sweep, radius[1]));
    let (mut lo, mut hi) = (a.inf(&b), a.sup(&b));
    let quarter = std::f64::consts::FRAC_PI_2;
    let (first, last) = (start.min(start + sweep), start.max(start + sweep));
    let first = (first / quarter).ceil() as i64;
    for k in first..=((last / quarter).floor() as i64).min(first + 3) {
        let p = point(k as f64 * quarter, radius[0].max(radius[1]));
        (lo, hi) = (lo.inf(&p), hi.sup(&p));
    }
    (lo, hi)
}

/// Appends the elements of one move, shifted by `shift` into the frame of the stock.
pub fn append_elements(out: &mut Vec<Element>, curve: &Curve, shift: Vec3, move_id: MoveId, cutter: u16) {
    let mut push = |track: Track, from_mm: f64| {
        let runs_on =
            |before: &Element| (before.track.ends().1 - track.ends().0).norm_squared() < JOINED_MM * JOINED_MM;
        let joined = out.last().is_some_and(|before| before.cutter == cutter && runs_on(before));
        out.push(Element { track, from_mm, move_id, cutter, joined });
    };
    match curve {
        Curve::Line { from, to } => push(Track::Line { from: from + shift, to: to + shift }, 0.0),
        Curve::Arc(arc) if is_level(arc) => push(
            Track::Arc {
                centre: [arc.centre.x + shift.x, arc.centre.y + shift.y],
                z: arc.from.z + shift.z,
                radius: [arc.radius_mm, arc.radius_end_mm],
                start: arc.start_rad,
                sweep: arc.sweep_rad,
            },
            0.0,
        ),
        Curve::Arc(arc) => {
            let length = curve.length();
            let count = chords(arc);
            let at = |k: usize| length * k as f64 / count as f64;
            for k in 0..count {
                let (from, to) = (curve.point(at(k)), curve.point(at(k + 1)));
                push(Track::Line { from: from + shift, to: to + shift }, at(k));
            }
        }
    }
}

fn is_level(arc: &Arc) -> bool {
    arc.plane == Plane::Xy
        && arc.rise_mm.abs() < 1e-9
        && arc.radius_mm > 1e-6
        && (arc.radius_mm - arc.radius_end_mm).abs() < 0.01 * arc.radius_mm.min(1.0)
}

fn chords(arc: &Arc) -> usize {
    let radius = arc.radius_mm.max(arc.radius_end_mm).max(SAGITTA_MM);
    let step = 2.0 * (1.0 - SAGITTA_MM / radius).clamp(-1.0, 1.0).acos();
    ((arc.sweep_rad.abs() / step).ceil() as usize).max(1)
}
