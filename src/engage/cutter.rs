//! A tool as engagement sees it. In: a profile and the cell of the field. Out: its rings (slices), grouped into bands, and
//! a table from distance to the axis to the bands that pass there and the lowest height at which one does.
//!
//! A band is one ring, or all the rings of a cylindrical side: above each other with one radius, their engaged arcs can
//! only shrink with height, which saves most of the work.

use crate::machine::{Slice, Tool};
use crate::stock::Form;

/// Rings worked on together.
#[derive(Debug, Clone, Copy)]
pub struct Band {
    /// First and last slice.
    pub slices: [u16; 2],
    /// Radius, mm.
    pub radius: f64,
    /// Lowest height above the tip, mm.
    pub low: f64,
    /// Looks straight down: leads only in a descending move.
    pub bottom: bool,
}

/// A part of the tool that must not touch stock: the shank, or a cylinder of the holder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Holder, or shank?
    pub holder: bool,
    /// Radius, mm.
    pub radius: f64,
    /// Its lower end above the tip, mm.
    pub low: f64,
}

/// Which bands pass at a distance from the axis.
#[derive(Debug, Clone)]
pub struct Near {
    /// Bins per mm.
    per_mm: f64,
    first: Vec<u32>,
    bands: Vec<u16>,
    /// Lowest height above the tip of the bands in each bin; infinite where there is none.
    pub lowest: Vec<f32>,
}

/// A tool with its tables.
#[derive(Debug, Clone)]
pub struct Cutter {
    /// Its number.
    pub number: u32,
    /// Its form.
    pub form: Form,
    /// Its slices.
    pub slices: Vec<Slice>,
    /// Its bands.
    pub bands: Vec<Band>,
    /// Bands by distance: for level and rising moves, and with the bottom for descending ones.
    pub near: [Near; 2],
    /// Shank and holder, from below.
    pub bodies: Vec<Body>,
    /// Height at which the outline begins to narrow: above it a height field cannot hold what is cut.
    pub neck_mm: Option<f64>,
    /// May it plunge into material?
    pub centre_cutting: bool,
    /// Distance by which a cell may stand for a point of a ring, mm.
    pub margin: f64,
}

impl Cutter {
    /// Tables of a tool for cells whose longer side is `cell_mm`.
    pub fn new(tool: &Tool, cell_mm: f64) -> Self {
        let profile = &tool.profile;
        let slices = profile.rings();
        let bands = bands(&slices);
        let margin = 1.5 * cell_mm;
        let near = [false, true].map(|bottom| Near::new(&bands, profile.max_radius(), margin, cell_mm, bottom));
        Self {
            number: tool.number,
            form: Form::new(profile),
            slices,
            bands,
            near,
            bodies: bodies(tool),
            neck_mm: profile.neck(),
            centre_cutting: tool.centre_cutting,
            margin,
        }
    }
    /// Height above the tip of the lowest body; infinite without one.
    pub fn lowest_body(&self) -> f64 {
        self.bodies.iter().map(|body| body.low).fold(f64::INFINITY, f64::min)
    }
    /// Widest radius of the bodies, mm.
    pub fn widest_body(&self) -> f64 {
        self.bodies.iter().map(|body| body.radius).fold(0.0, f64::max)
    }
    /// Bands by distance for a move whose unit tangent rises by `tangent_z`.
    pub fn near(&self, tangent_z: f64) -> &Near {
        &self.near[usize::from(tangent_z < 0.0)]
    }
}

fn bodies(tool: &Tool) -> Vec<Body> {
    let mut bodies = Vec::new();
    let flutes = tool.flute_length_mm.max(tool.profile.height());
    if tool.overhang_mm > flutes && tool.shank_diameter_mm > 0.0 {
        bodies.push(Body { holder: false, radius: 0.5 * tool.shank_diameter_mm, low: flutes });
    }
    let mut low = tool.overhang_mm;
    for (diameter, length) in &tool.holder {
        bodies.push(Body { holder: true, radius: 0.5 * diameter, low });
        low += length;
    }
    bodies
}

fn bands(slices: &[Slice]) -> Vec<Band> {
    let mut bands: Vec<Band> = Vec::new();
    for (index, slice) in slices.iter().enumerate() {
        let upright = slice.normal_z.abs() < 1e-9;
        let low = slice.z_mm - 0.5 * slice.dz_mm().abs();
        let index = index as u16;
        match bands.last_mut() {
            Some(band) if upright && band.radius == slice.radius_mm && band.slices[1] + 1 == index && !band.bottom => {
                band.slices[1] = index;
            }
            _ => {
                bands.push(Band {
                    slices: [index, index],
                    radius: slice.radius_mm,
                    low,
                    bottom: slice.normal_r < 1e-9,
                });
            }
        }
    }
    bands
}

impl Near {
    fn new(bands: &[Band], radius: f64, margin: f64, cell_mm: f64, bottom: bool) -> Self {
        let per_mm = 2.0 / cell_mm;
        let count = ((radius + margin) * per_mm).ceil() as usize + 2;
        let (mut first, mut list, mut lowest) = (vec![0], Vec::new(), Vec::new());
        for bin in 0..count {
            let (from, to) = (bin as f64 / per_mm - margin, (bin + 1) as f64 / per_mm + margin);
            let mut low = f64::INFINITY;
            for (index, band) in bands.iter().enumerate() {
                if (bottom || !band.bottom) && (from..=to).contains(&band.radius) {
                    list.push(index as u16);
                    low = low.min(band.low);
                }
            }
            first.push(list.len() as u32);
            lowest.push(low as f32);
        }
        Self { per_mm, first, bands: list, lowest }
    }
    /// Bin of a distance.
    pub fn bin(&self, distance: f32) -> usize {
        ((distance * self.per_mm as f32) as usize).min(self.lowest.len() - 1)
    }
    /// Bands of a bin.
    pub fn bands(&self, bin: usize) -> &[u16] {
        &self.bands[self.first[bin] as usize..self.first[bin + 1] as usize]
    }
    /// Distances from the axis at which some band passes (first, last), mm.
    pub fn range_mm(&self) -> [f64; 2] {
        let first = self.lowest.iter().position(|low| low.is_finite()).unwrap_or(self.lowest.len());
        let last = self.lowest.iter().rposition(|low| low.is_finite()).map_or(0, |bin| bin + 1);
        [first as f64 / self.per_mm, last as f64 / self.per_mm]
    }
}
