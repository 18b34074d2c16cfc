//! A tool as the simulation of engagement uses it. In: a profile and the cell of the field. Out: its rings (slices), grouped into bands, and
//! a table from the distance to the axis to the bands at that distance and the lowest height of any.
//!
//! A band is one ring, or all the rings of a cylindrical side. The latter have one radius, so their engaged arcs can only shrink with height,
//! which saves most of the work.

use crate::machine::{Profile, Segment, Slice, Tool};
use crate::stock::Form;

/// Distance by which a cell may stand for a point of a ring, in cells.
pub const MARGIN_CELLS: f64 = 1.5;

/// Rings worked on together.
#[derive(Debug, Clone, Copy)]
pub struct Band {
    /// First and last slice.
    pub slices: [u16; 2],
    /// Radius, mm.
    pub radius: f64,
    /// Material up to this distance from the ring counts, mm; for a bottom all over it, because no other ring covers its edge.
    pub reach: f64,
    /// Lowest height above the tip, mm.
    pub low: f64,
    /// Its normal points straight down, so that it is engaged only in a descending move.
    pub bottom: bool,
    /// A cell may matter in this many bins of the diamond angle (64 a turn) on either side of its own.
    pub spread: u32,
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

/// What nomination needs to know of a band.
#[derive(Debug, Clone, Copy)]
pub struct NearBand {
    /// Its index.
    pub index: u16,
    /// Its lowest height above the tip, mm.
    pub low: f32,
    /// Its [`Band::spread`].
    pub spread: u32,
    /// The distances at which it passes: the first bin, and one past the last.
    pub bins: [usize; 2],
}

/// The bands at each distance from the axis, in bins of the distance.
#[derive(Debug, Clone)]
pub struct Near {
    /// Bins per mm.
    per_mm: f64,
    /// Lowest height above the tip of the bands that pass in each bin; infinite where there is none.
    pub lowest: Vec<f32>,
    /// The bands.
    pub bands: Vec<NearBand>,
    /// Lower bounds of those heights: a + b d².
    pub bounds: [[f32; 2]; 4],
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
    /// Where each begins on its segment, and its share of it.
    spans: Vec<[f64; 2]>,
    /// Height above the tip of the upper end of each, mm.
    tops: Vec<f64>,
    /// Its bands.
    pub bands: Vec<Band>,
    /// Bands by distance: for level and rising moves, and with the bottom for descending ones.
    pub near: [Near; 2],
    /// Shank and holder, from below.
    pub bodies: Vec<Body>,
    /// Height above the tip from which a shank as wide as the cutter may rub along a wall.
    pub rubs_from_mm: Option<f64>,
    /// Height at which the outline begins to narrow: above it a height field cannot hold what is cut.
    pub neck_mm: Option<f64>,
    /// May it plunge into material?
    pub centre_cutting: bool,
    /// Distance by which a cell may stand for a point of a ring, mm.
    pub margin: f64,
}

impl Cutter {
    /// Tables of a tool for cells whose longer side is `cell_mm`, on rings cut into so many parts.
    pub fn new(tool: &Tool, cell_mm: f64, parts: u32) -> Self {
        let profile = &tool.profile;
        let slices = profile.rings(parts);
        let spans = spans(&slices, profile);
        let margin = MARGIN_CELLS * cell_mm;
        let bands = bands(&slices, margin);
        let near = [false, true].map(|bottom| Near::new(&bands, profile.max_radius() + margin, cell_mm, bottom));
        Self {
            number: tool.number,
            form: Form::new(profile),
            tops: tops(&slices, &spans, profile),
            spans,
            slices,
            bands,
            near,
            bodies: bodies(tool),
            rubs_from_mm: rubs_from(tool),
            neck_mm: profile.neck(),
            centre_cutting: tool.centre_cutting,
            margin,
        }
    }
    /// A part of a slice, from below in [0, 1], as a ring of its own at its middle.
    pub fn part(&self, index: u16, [from, to]: [f64; 2]) -> Slice {
        let slice = self.slices[index as usize];
        if (from, to) == (0.0, 1.0) {
            return slice;
        }
        let [begin, share] = self.spans[index as usize];
        let at = begin + 0.5 * (from + to) * share;
        let ([radius_mm, z_mm], [normal_r, normal_z]) = self.form.profile.segments[slice.segment as usize].at(at);
        Slice { z_mm, radius_mm, edge_mm: (to - from) * slice.edge_mm, normal_r, normal_z, segment: slice.segment }
    }
    /// Height above the tip of a place on a slice, from below in [0, 1], mm.
    pub fn height_at(&self, index: u16, part: f64) -> f64 {
        if part == 1.0 { self.tops[index as usize] } else { self.part(index, [part, part]).z_mm }
    }
    /// The part of a slice, from below in [0, 1], at a height above the tip.
    pub fn part_at(&self, index: u16, z_mm: f64) -> f64 {
        let slice = &self.slices[index as usize];
        let [begin, share] = self.spans[index as usize];
        match &self.form.profile.segments[slice.segment as usize] {
            Segment::Arc { centre, radius, from_rad, to_rad } => {
                let angle = ((z_mm - centre[1]) / radius).clamp(-1.0, 1.0).asin();
                ((angle - from_rad) / (to_rad - from_rad) - begin) / share
            }
            Segment::Line { .. } => 0.5 + (z_mm - slice.z_mm) / slice.dz_mm(),
        }
    }
    /// Does its outline begin on the axis, and not with a flat?
    pub fn pointed(&self) -> bool {
        self.form.profile.segments[0].at(0.0).0[0] < 1e-9 && !self.form.flat_bottom
    }
    /// Height above the tip of the lowest body; infinite without one.
    pub fn lowest_body(&self) -> f64 {
        self.bodies.iter().map(|body| body.low).fold(f64::INFINITY, f64::min)
    }
    /// Distance from its axis within which the stock has to be examined, mm, where air feed requires this clearance.
    pub fn asks_within(&self, clearance_mm: f64) -> f64 {
        (self.form.radius + clearance_mm.max(self.margin)).max(self.widest_body())
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

/// A shank narrower than the cutter by this much rubs nowhere, mm.
const RELIEF_MM: f64 = 0.01;

fn rubs_from(tool: &Tool) -> Option<f64> {
    let flutes = tool.flute_length_mm.max(tool.profile.height());
    let as_wide = 0.5 * tool.shank_diameter_mm > tool.profile.max_radius() - RELIEF_MM;
    (as_wide && tool.flute_length_given && tool.overhang_mm > flutes).then_some(flutes)
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

fn spans(slices: &[Slice], profile: &Profile) -> Vec<[f64; 2]> {
    let mut spans: Vec<[f64; 2]> = Vec::with_capacity(slices.len());
    for (index, slice) in slices.iter().enumerate() {
        let share = slice.edge_mm / profile.segments[slice.segment as usize].length();
        let goes_on = index > 0 && slices[index - 1].segment == slice.segment;
        let begin = if goes_on { spans[index - 1][0] + share } else { 0.0 };
        spans.push([begin, share]);
    }
    spans
}

fn tops(slices: &[Slice], spans: &[[f64; 2]], profile: &Profile) -> Vec<f64> {
    let top =
        |(slice, [begin, share]): (&Slice, &[f64; 2])| profile.segments[slice.segment as usize].at(begin + share).0[1];
    slices.iter().zip(spans).map(top).collect()
}

fn bands(slices: &[Slice], margin: f64) -> Vec<Band> {
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
                let bottom = slice.normal_r < 1e-9;
                bands.push(Band {
                    slices: [index, index],
                    radius: slice.radius_mm,
                    reach: if bottom { margin + 0.5 * slice.edge_mm } else { margin },
                    low,
                    bottom,
                    spread: spread(1.5 * margin / slice.radius_mm.max(1e-6)),
                });
            }
        }
    }
    bands
}

/// Bins (of 64) within an angle, either way.
fn spread(angle: f64) -> u32 {
    (16.0 * angle).ceil().min(32.0) as u32
}

/// Lower bounds of the lowest height, linear in the square of the distance (the value of a bin holds up to its end).
fn bounds(lowest: &[f32], per_mm: f64) -> [[f32; 2]; 4] {
    let points: Vec<[f64; 2]> = lowest
        .iter()
        .enumerate()
        .filter(|(_, low)| low.is_finite())
        .map(|(bin, low)| [((bin + 1) as f64 / per_mm).powi(2), f64::from(*low)])
        .collect();
    std::array::from_fn(|k| {
        let slope = match points.len() * k / 4 {
            0 => 0.0,
            at => {
                let ([x0, y0], [x1, y1]) = (points[at - 1], points[(at + points.len() / 8).min(points.len() - 1)]);
                ((y1 - y0) / (x1 - x0).max(1e-9)).max(0.0)
            }
        };
        let below = points.iter().map(|[x, y]| y - slope * x).fold(f64::INFINITY, f64::min);
        [(below - BOUND_MM) as f32, slope as f32]
    })
}

/// Margin of the bounds for rounding, mm.
const BOUND_MM: f64 = 1e-4;

impl Near {
    fn new(bands: &[Band], outermost: f64, cell_mm: f64, bottom: bool) -> Self {
        let per_mm = 2.0 / cell_mm;
        let count = (outermost * per_mm).ceil() as usize + 2;
        let passes = |band: &Band, bin: usize| {
            (bin as f64 / per_mm - band.reach..=(bin + 1) as f64 / per_mm + band.reach).contains(&band.radius)
        };
        let (mut lowest, mut list) = (vec![f32::INFINITY; count], Vec::new());
        for (index, band) in bands.iter().enumerate().filter(|(_, band)| bottom || !band.bottom) {
            let Some(first) = (0..count).find(|bin| passes(band, *bin)) else { continue };
            let end = (first..count).find(|bin| !passes(band, *bin)).unwrap_or(count);
            let low = band.low as f32;
            lowest[first..end].iter_mut().for_each(|lowest| *lowest = lowest.min(low));
            list.push(NearBand { index: index as u16, low, spread: band.spread, bins: [first, end] });
        }
        let bounds = bounds(&lowest, per_mm);
        Self { per_mm, lowest, bands: list, bounds }
    }
    /// Lowest height of all, mm.
    pub fn floor(&self) -> f32 {
        self.bounds[0][0]
    }
    /// Distance from the axis beyond which no band is lower than `height` above the tip, mm.
    pub fn outer_below(&self, height: f32) -> f64 {
        self.lowest.iter().rposition(|lowest| *lowest < height).map_or(0.0, |bin| (bin + 1) as f64 / self.per_mm)
    }
    /// Bins per mm.
    pub fn per_mm(&self) -> f32 {
        self.per_mm as f32
    }
    /// The bin of a distance, given in bins.
    #[inline]
    pub fn bin(&self, distance: f32) -> usize {
        (distance as usize).min(self.lowest.len() - 1)
    }
    /// Distance from the axis up to which no band passes, mm.
    pub fn inner(&self) -> f64 {
        let first = self.lowest.iter().position(|lowest| lowest.is_finite()).unwrap_or(self.lowest.len());
        first as f64 / self.per_mm
    }
}
