//! The key of an engagement map: everything it was made from, as 32 bytes. In: moves, tools, stock with the bytes of its files, fixtures,
//! offsets, clearance, resolution, spacing. Out: the SHA-256 of all of these and of the sources that make the map.
//!
//! The sources are those of the rooms that `build.rs` names: any change in them makes maps of older builds stale. So the bytes hashed here
//! need to mean the same only within one state of the sources, and an enum may go in by the number of its variant.

use super::options::Options;
use crate::machine::{Box3, Job, Profile, Segment, Stock, StockShape, Tool};
use crate::nc::Toolpath;
use crate::path::{Curve, Vec3};
use sha2::{Digest, Sha256};

/// Key of the simulation of a toolpath.
pub type Key = [u8; 32];

/// SHA-256 of the sources that an engagement map depends on, in hexadecimal.
pub const SOURCES: &str = env!("FEEDWRIGHT_ENGAGEMENT_SOURCES");

/// Key of the map that [`super::engage()`] would make of these arguments.
pub fn key(path: &Toolpath, job: &Job, options: &Options) -> Key {
    let mut parts = Parts(Sha256::new());
    parts.bytes(SOURCES.as_bytes());
    parts.optional(options.cell_mm.or(job.cell_mm));
    parts.number(options.spacing_mm);
    parts.number(f64::from(options.ring_parts));
    parts.optional(job.air_feed.map(|air| air.approach_mm));
    parts.count(job.machine.offsets.len());
    for (offset, origin) in &job.machine.offsets {
        parts.count(usize::from(*offset));
        parts.point(*origin);
    }
    parts.count(job.fixtures.len());
    job.fixtures.iter().for_each(|fixture| parts.cuboid(fixture));
    parts.count(job.tools.len());
    job.tools.iter().for_each(|tool| parts.tool(tool));
    parts.count(job.stocks.len());
    job.stocks.iter().for_each(|stock| parts.stock(stock, options));
    for motion in &path.moves {
        parts.count(motion.tool as usize);
        parts.count(usize::from(motion.wcs));
        parts.kind(motion.kind as u8);
        parts.kind(u8::from(motion.spin.rps == 0.0));
        parts.curve(&motion.curve());
    }
    parts.0.finalize().into()
}

/// Feeds the parts of the key to the hash, each so that two different values never give the same bytes.
struct Parts(Sha256);

impl Parts {
    fn kind(&mut self, kind: u8) {
        self.0.update([kind]);
    }

    fn count(&mut self, count: usize) {
        self.0.update((count as u64).to_le_bytes());
    }

    fn bytes(&mut self, bytes: &[u8]) {
        self.count(bytes.len());
        self.0.update(bytes);
    }

    fn number(&mut self, value: f64) {
        self.0.update(value.to_bits().to_le_bytes());
    }

    fn numbers(&mut self, values: &[f64]) {
        for value in values {
            self.number(*value);
        }
    }

    fn optional(&mut self, value: Option<f64>) {
        self.kind(u8::from(value.is_some()));
        self.numbers(value.as_slice());
    }

    fn point(&mut self, point: Vec3) {
        self.numbers(&[point.x, point.y, point.z]);
    }

    fn cuboid(&mut self, cuboid: &Box3) {
        self.point(cuboid.min);
        self.point(cuboid.max);
    }

    /// Outline of a tool, and the parts of it that must not touch stock.
    fn tool(&mut self, tool: &Tool) {
        self.count(tool.number as usize);
        self.kind(tool.shape as u8);
        self.profile(&tool.profile);
        self.numbers(&[tool.flute_length_mm, tool.overhang_mm, tool.shank_diameter_mm]);
        self.kind(u8::from(tool.flute_length_given));
        self.kind(u8::from(tool.centre_cutting));
        self.count(tool.holder.len());
        tool.holder.iter().for_each(|(diameter_mm, length_mm)| self.numbers(&[*diameter_mm, *length_mm]));
    }

    fn profile(&mut self, profile: &Profile) {
        self.count(profile.segments.len());
        for segment in &profile.segments {
            match *segment {
                Segment::Line { from, to } => {
                    self.kind(0);
                    self.numbers(&[from[0], from[1], to[0], to[1]]);
                }
                Segment::Arc { centre, radius, from_rad, to_rad } => {
                    self.kind(1);
                    self.numbers(&[centre[0], centre[1], radius, from_rad, to_rad]);
                }
            }
        }
    }

    /// Shape, place and allowance of a blank; not its material.
    fn stock(&mut self, stock: &Stock, options: &Options) {
        match &stock.shape {
            StockShape::Box(cuboid) => {
                self.kind(0);
                self.cuboid(cuboid);
            }
            StockShape::Cylinder { centre, diameter_mm, z_mm } => {
                self.kind(1);
                self.numbers(&[centre[0], centre[1], *diameter_mm, z_mm[0], z_mm[1]]);
            }
            StockShape::Stl(file) | StockShape::Saved(file) => {
                self.kind(if matches!(stock.shape, StockShape::Stl(_)) { 2 } else { 3 });
                let read = options.loader.and_then(|load| load(file).ok());
                self.bytes(&read.unwrap_or_default());
            }
        }
        self.optional(stock.offset.map(f64::from));
        self.point(stock.moved_mm);
        self.number(stock.uncertainty_mm);
    }

    fn curve(&mut self, curve: &Curve) {
        match curve {
            Curve::Line { from, to } => {
                self.kind(0);
                self.point(*from);
                self.point(*to);
            }
            Curve::Arc(arc) => {
                self.kind(1);
                self.count(arc.plane.axes().2);
                for point in [arc.from, arc.to, arc.centre] {
                    self.point(point);
                }
                self.number(arc.sweep_rad);
            }
        }
    }
}
