//! The geometry around a cutter position. In: elements, cutters, blanks, fixtures. Out: which elements and fixtures are near a sample; the types
//! for arcs and the area that they remove.

use super::cutter::{Cutter, MARGIN_CELLS};
use super::gaps::{Interval, span};
use super::nominate::{Mark, Sample};
use super::retraced::Retraced;
use crate::machine::{Box3, Slice};
use crate::stock::{Blank, Element, Form, along};

/// A part of a cutter counts as steep from this share of its radius outward.
const STEEP: f64 = 0.98;

/// The geometry that arcs are worked out from.
pub struct Scene<'a> {
    /// All elements: the cuts of earlier programs, then those of this one.
    pub elements: &'a [Element],
    /// All cutters.
    pub cutters: &'a [Cutter],
    /// Outlines of the cutters of earlier programs: elements count them on from the cutters.
    pub earlier: &'a [Form],
    /// The blanks.
    pub blanks: &'a [Blank],
    /// Keep-out boxes.
    pub fixtures: &'a [Box3],
    /// The elements by the walls that they leave.
    pub retraced: &'a Retraced,
}

impl Scene<'_> {
    /// Outline of the cutter of an element.
    pub fn form(&self, element: &Element) -> &Form {
        form_of(element, self.cutters, self.earlier)
    }
    /// Is a steep part of the cutter marked, which alone leaves walls?
    fn is_steep(&self, sample: &Sample, marks: &[Mark]) -> bool {
        let cutter = &self.cutters[sample.cutter as usize];
        marks.iter().any(|mark| cutter.bands[mark.band as usize].radius >= STEEP * cutter.form.radius)
    }
    /// Adds to the candidates, which are sorted, those that left a wall beside one of its walls before.
    pub fn add_retraced(&self, candidates: &mut Vec<u32>, sample: &Sample, marks: &[Mark]) {
        if !self.is_steep(sample, marks) {
            return;
        }
        let named = candidates.len();
        let radius_mm = |element: &Element| self.form(element).radius;
        self.retraced.add(self.elements, sample, radius_mm, candidates);
        if candidates.len() > named {
            candidates.sort_unstable();
            candidates.dedup();
        }
    }
    /// Adds to the candidates, which are sorted, the elements that follow one of them along the path; for ball cutters only where a steep part
    /// of the cutter is marked.
    pub fn add_along(&self, candidates: &mut Vec<u32>, sample: &Sample, marks: &[Mark]) {
        let named = candidates.len();
        let cutter = &self.cutters[sample.cutter as usize];
        let cell_mm = cutter.margin / MARGIN_CELLS;
        let steep = self.is_steep(sample, marks);
        for k in 0..named {
            let form = self.form(&self.elements[candidates[k] as usize]);
            candidates.extend(along(self.elements, candidates[k], (form, steep), cell_mm, sample.element));
        }
        if candidates.len() > named {
            candidates.sort_unstable();
            candidates.dedup();
        }
    }
    /// True when no fixture is within the clearance of a sample.
    pub fn clear_of_fixtures(&self, sample: &Sample) -> bool {
        let reach = self.cutters[sample.cutter as usize].form.radius + sample.clearance_mm;
        self.fixtures.iter().all(|fixture| {
            let beside =
                |axis: usize| (fixture.min[axis] - sample.tip[axis]).max(sample.tip[axis] - fixture.max[axis]).max(0.0);
            sample.tip.z - sample.clearance_mm >= fixture.max.z || beside(0).hypot(beside(1)) > reach
        })
    }
}

/// Outline of the cutter of an element, which is one of these cutters or of an earlier program.
pub fn form_of<'a>(element: &Element, cutters: &'a [Cutter], earlier: &'a [Form]) -> &'a Form {
    let cutter = element.cutter as usize;
    cutters.get(cutter).map_or_else(|| &earlier[cutter - cutters.len()], |cutter| &cutter.form)
}

/// An engaged arc of a part of a ring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawArc {
    /// Slice of the tool.
    pub slice: u16,
    /// Part of its edge, from below, in [0, 1].
    pub part: [f32; 2],
    /// Immersion angles, rad.
    pub angles: [f32; 2],
}

/// Removal area and reach of the arcs at a sample.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cut {
    /// Number of arcs.
    pub arcs: u32,
    /// Volume removed per mm of path, mm².
    pub area_mm2: f64,
    /// Height above the tip up to which it is engaged, mm.
    pub top_mm: f64,
    /// How far a wall stands up along a shank as wide as the cutter, mm.
    pub rub_mm: f64,
}

/// Volume removed per mm of path along an arc of a ring, mm².
pub fn area(ring: &Slice, [horizontal, vertical]: [f64; 2], arc: &Interval) -> f64 {
    let rising = ring.normal_z * vertical;
    let turn = if rising == 0.0 { 0.0 } else { rising * span(arc) };
    ring.edge_mm * ring.radius_mm * (ring.normal_r * horizontal * (arc[1].at[1] - arc[0].at[1]) + turn)
}
