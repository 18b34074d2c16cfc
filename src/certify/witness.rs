//! A coarse simulation of engagement, independent of [`crate::engage`]. In: the moves, the stock as declared. Out: the first place where there
//! is certainly material on the leading side of the cutter outside of the arcs in the certificate.
//!
//! A grid of heights is lowered along the path. At the middle of each station, points of the outline are tested: a point is in material if its
//! cell and the eight around it are higher, so that rounding to cells cannot cause a false alarm. The cut of the station itself is followed
//! up to three cells before its middle. Arcs that are too short by less than about four cells pass: the test finds arcs that are missing, it
//! does not measure their ends.

use std::f64::consts::{PI, TAU};

use super::cutter::{Part, Ring};
use super::limits::{Basis, tool_of};
use super::text::{Certificate, MovePart, Station};
use crate::machine::{Job, StockShape, Tool};
use crate::nc::{Move, Toolpath};
use crate::path::Vec3;

/// Cell, as a share of the diameter: 33 cells across the tool.
const CELL: f64 = 0.03;
/// Step along the path, as a share of the diameter.
const STEP: f64 = 0.08;
/// Most cells of the grid.
const MOST_CELLS: f64 = 4e6;
/// Smallest cell, mm.
const FINEST_MM: f64 = 0.05;
/// Material counts only if it is higher than a point by this and a tenth of a cell, mm: the steps along the path leave scallops.
const ABOVE_MM: f64 = 0.02;
/// A point counts as leading if its unit normal has at least this component along the feed.
const LEADS: f64 = 0.1;
/// Number of cells by which an arc may be too short without being reported.
const SHORT_CELLS: f64 = 4.0;
/// Distances of the tested points from the lower end of each piece of the outline, in diameters.
const LOOKED_AT: [f64; 6] = [0.02, 0.06, 0.18, 0.54, 1.6, 4.8];
/// Number of tested points on half a turn.
const ON_TURN: usize = 12;

/// Heights of the stock over a grid.
pub struct Field {
    cell_mm: f64,
    first: [f64; 2],
    size: [usize; 2],
    heights: Vec<f32>,
}

impl Field {
    /// Of boxes and cylinders in the frame of the program; `None` for other stock, or where work offsets shift it.
    pub fn new(job: &Job, toolpath: &Toolpath) -> Option<Self> {
        let wcs = toolpath.moves.first()?.wcs;
        let one_frame = toolpath.moves.iter().all(|motion| motion.wcs == wcs);
        let at_home = job
            .stocks
            .iter()
            .all(|stock| stock.moved_mm.norm() == 0.0 && stock.offset.is_none_or(|offset| offset == wcs));
        if !one_frame || !at_home || job.stocks.is_empty() {
            return None;
        }
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for stock in &job.stocks {
            let (from, to) = match &stock.shape {
                StockShape::Box(of) => ([of.min.x, of.min.y], [of.max.x, of.max.y]),
                StockShape::Cylinder { centre, diameter_mm, .. } => {
                    (centre.map(|at| at - 0.5 * diameter_mm), centre.map(|at| at + 0.5 * diameter_mm))
                }
                StockShape::Stl(_) | StockShape::Saved(_) => return None,
            };
            (low, high) = ([0, 1].map(|k| low[k].min(from[k])), [0, 1].map(|k| high[k].max(to[k])));
        }
        let least = job.tools.iter().map(|tool| tool.diameter_mm).fold(f64::INFINITY, f64::min);
        let area = (high[0] - low[0]) * (high[1] - low[1]);
        let cell_mm = (CELL * least).max(FINEST_MM).max((area / MOST_CELLS).sqrt());
        let size = [0, 1].map(|k| ((high[k] - low[k]) / cell_mm).ceil() as usize);
        if !(cell_mm.is_finite() && area > 0.0 && size[0] * size[1] < 10_000_000) {
            return None;
        }
        let mut field = Self { cell_mm, first: low, size, heights: vec![f32::NEG_INFINITY; size[0] * size[1]] };
        for stock in &job.stocks {
            field.fill(&stock.shape);
        }
        Some(field)
    }

    fn fill(&mut self, shape: &StockShape) {
        for k in 0..self.heights.len() {
            let [x, y] = [k % self.size[0], k / self.size[0]].map(|i| i as f64 + 0.5);
            let (x, y) = (self.first[0] + x * self.cell_mm, self.first[1] + y * self.cell_mm);
            let top = match shape {
                StockShape::Box(of) => {
                    (x > of.min.x && x < of.max.x && y > of.min.y && y < of.max.y).then_some(of.max.z)
                }
                StockShape::Cylinder { centre, diameter_mm, z_mm } => {
                    ((x - centre[0]).hypot(y - centre[1]) < 0.5 * diameter_mm).then_some(z_mm[1])
                }
                StockShape::Stl(_) | StockShape::Saved(_) => None,
            };
            self.heights[k] = self.heights[k].max(top.unwrap_or(f64::NEG_INFINITY) as f32);
        }
    }

    /// Does material certainly stand above a point?
    fn stands(&self, at: Vec3) -> bool {
        let place = [0, 1].map(|k| ((at[k] - self.first[k]) / self.cell_mm).floor());
        let inside = (0..2).all(|k| place[k] >= 1.0 && place[k] + 2.0 <= self.size[k] as f64);
        if !inside {
            return false;
        }
        let [i, j] = place.map(|p| p as usize);
        let least = (at.z + ABOVE_MM + 0.1 * self.cell_mm) as f32;
        (j - 1..=j + 1).all(|j| (i - 1..=i + 1).all(|i| self.heights[j * self.size[0] + i] > least))
    }

    /// Cuts away what a tool clears that stands with its tip here.
    fn stamp(&mut self, tip: Vec3, reach: f64, clears: &[f64]) {
        let per_square = clears.len() as f64 / (reach * reach);
        let span = |k: usize| {
            let low = (tip[k] - reach - self.first[k]) / self.cell_mm;
            let high = (tip[k] + reach - self.first[k]) / self.cell_mm;
            (low.floor().max(0.0) as usize)..(high.ceil().max(0.0) as usize).min(self.size[k])
        };
        for j in span(1) {
            let y = self.first[1] + (j as f64 + 0.5) * self.cell_mm - tip.y;
            for i in span(0) {
                let x = self.first[0] + (i as f64 + 0.5) * self.cell_mm - tip.x;
                if let Some(z) = clears.get(((x * x + y * y) * per_square) as usize) {
                    let height = &mut self.heights[j * self.size[0] + i];
                    *height = height.min((tip.z + z) as f32);
                }
            }
        }
    }
}

/// What a tool clears: heights of its outline on rings of equal area, each at its outer edge, where it is the highest.
fn clears(tool: &Tool) -> Vec<f64> {
    let at = |k: u32| tool.profile.height_at(tool.profile.max_radius() * (f64::from(k) / 128.0).sqrt().min(1.0));
    (1..=128).map(|k| at(k).unwrap_or(f64::INFINITY)).collect()
}

/// Follows the program; the line of the first move on which material is met outside of the arcs.
pub fn look(field: &mut Field, basis: &Basis, certificate: &Certificate) -> Option<u32> {
    let mut eye: Option<CoarseTool> = None;
    for stated in &certificate.moves {
        let motion = &basis.toolpath.moves[stated.index];
        if eye.as_ref().is_none_or(|eye| eye.number != motion.tool) {
            let tool = tool_of(basis.job, motion)?;
            let parts = certificate.parts_of(motion.tool);
            eye = Some(CoarseTool { number: motion.tool, clears: clears(tool), tool, parts });
        }
        if eye.as_ref()?.follow(field, motion, stated) {
            return Some(motion.line);
        }
    }
    None
}

/// A tool as this look sees it.
struct CoarseTool<'a> {
    number: u32,
    tool: &'a Tool,
    clears: Vec<f64>,
    parts: &'a [Part],
}

impl CoarseTool<'_> {
    /// Cuts along a move; is anything met outside of its arcs?
    fn follow(&self, field: &mut Field, motion: &Move, stated: &MovePart) -> bool {
        let curve = motion.curve();
        let step = STEP * self.tool.diameter_mm;
        let (mut done, length) = (0.0, curve.length());
        let reach = self.tool.profile.max_radius();
        let mut cut_to = |field: &mut Field, to: f64| {
            while done <= to {
                field.stamp(curve.point(done), reach, &self.clears);
                done += step;
            }
        };
        for station in &stated.stations {
            let middle = 0.5 * (station.over_mm[0] + station.over_mm[1]);
            cut_to(field, middle - 3.0 * field.cell_mm);
            if self.meets(field, curve.point(middle), curve.tangent(middle), station) {
                return true;
            }
        }
        cut_to(field, length);
        field.stamp(curve.point(length), reach, &self.clears);
        false
    }

    /// Does material stand at a point of the outline that leads and lies on none of the arcs?
    fn meets(&self, field: &Field, tip: Vec3, along: Vec3, station: &Station) -> bool {
        let across = along.x.hypot(along.y);
        if across < LEADS {
            return false;
        }
        let (ahead, left) = ([along.x / across, along.y / across], [-along.y / across, along.x / across]);
        for (segment, outline) in self.tool.profile.segments.iter().enumerate() {
            for place in LOOKED_AT {
                let at = place * self.tool.diameter_mm / outline.length();
                if at >= 1.0 {
                    break;
                }
                let Some(ring) = Ring::of(self.tool, &Part { segment, from: at - 1e-3, to: at + 1e-3 }) else {
                    continue;
                };
                let short = SHORT_CELLS * field.cell_mm / ring.r.max(field.cell_mm);
                // A part ends where a level passes: up to two cells of it may lie on the other side.
                let slack = 2.0 * field.cell_mm / outline.length();
                let on = |p: &Part| p.segment == segment && p.from - slack <= at && at <= p.to + slack;
                let arcs: Vec<_> = station.arcs.iter().filter(|arc| self.parts.get(arc.ring).is_some_and(on)).collect();
                for k in 0..ON_TURN {
                    let phi = (k as f64 + 0.5) * PI / ON_TURN as f64;
                    let leads = across * ring.normal[0] * phi.sin() + along.z * ring.normal[1];
                    let named = |phi: f64| arcs.iter().any(|arc| arc.entry - short <= phi && phi <= arc.exit + short);
                    let named = [-TAU, 0.0, TAU].into_iter().any(|turn| named(phi + turn));
                    if leads < LEADS || named {
                        continue;
                    }
                    let [a, b] = [0, 1].map(|k| ring.r * (phi.sin() * ahead[k] + phi.cos() * left[k]));
                    if field.stands(tip + Vec3::new(a, b, ring.z)) {
                        return true;
                    }
                }
            }
        }
        false
    }
}
