//! Engagement with larger stock and with a tool of another size. In: a program, its job, sizes of the changes. Out:
//! [`OtherGeometry`], first for a typical size of each change, then for the sizes found, because the load is linear in
//! a change only near the simulated size.

use crate::effects::Change;
use crate::engage::{Loader, Options, engage};
use crate::learn::log::resultant::Sample;
use crate::learn::program::timeline::{Timeline, engaged_otherwise};
use crate::learn::program::variant::OtherGeometry;
use crate::learn::program::variant::Variant;
use crate::machine::Job;
use crate::nc::Toolpath;
use rayon::prelude::*;

/// Largest spacing of the engagement, mm.
const SPACING_MM: f64 = 0.5;
/// Typical increase of the stock, mm, and relative decrease of the tool diameter.
const STOCK_CHANGE_MM: f64 = 0.5;
const DIAMETER_CHANGE: f64 = 0.04;
/// Least change that is simulated, mm, and least relative difference from a size already simulated.
const LEAST_MM: f64 = 0.01;
const LEAST_DIFFERENCE: f64 = 0.02;

/// How the stock and the tool differ from the declared ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::learn) struct SizeChanges {
    /// Stock higher by, mm.
    top_mm: f64,
    /// Stock wider on each side by, mm.
    side_mm: f64,
    /// Each face wider by, mm: −x, +x, −y, +y.
    faces_mm: [f64; 4],
    /// Tools larger by, mm of diameter.
    diameter_mm: f64,
    /// The top is raised on stock with changed sides, not on the declared one.
    top_over_side: bool,
}

impl SizeChanges {
    /// Typical sizes.
    pub(in crate::learn) fn usual(job: &Job) -> Self {
        let diameters: Vec<f64> = job.tools.iter().map(|t| t.diameter_mm).collect();
        let diameter_mm = -DIAMETER_CHANGE * crate::learn::regress::statistics::median(&diameters);
        Self {
            top_mm: STOCK_CHANGE_MM,
            side_mm: STOCK_CHANGE_MM,
            faces_mm: [STOCK_CHANGE_MM; 4],
            diameter_mm,
            top_over_side: false,
        }
    }

    /// Sums of these changes, typical sizes for those that are 0; `None` if all are.
    pub(in crate::learn) fn found(job: &Job, changes: &[Change]) -> Option<Self> {
        let sum =
            |of: &dyn Fn(&Change) -> f64| Some(changes.iter().map(of).sum::<f64>()).filter(|v| v.abs() >= LEAST_MM);
        let (top, side) = (sum(&|c| c.stock_top_mm), sum(&|c| c.stock_side_mm));
        let faces = [0, 1, 2, 3].map(|face| sum(&|c: &Change| c.stock_faces_mm[face]));
        let diameter = sum(&|c| c.diameter_mm);
        faces.into_iter().fold(top.or(side).or(diameter), Option::or)?;
        let usual = Self::usual(job);
        Some(Self {
            top_mm: top.unwrap_or(usual.top_mm),
            side_mm: side.unwrap_or(usual.side_mm),
            faces_mm: faces.map(|face| face.unwrap_or(STOCK_CHANGE_MM)),
            diameter_mm: diameter.unwrap_or(usual.diameter_mm),
            top_over_side: top.is_some() && side.is_some(),
        })
    }

    /// Are these sizes so close to the others that another simulation is not needed?
    pub(in crate::learn) fn is_near(&self, other: &Self) -> bool {
        let near = |a: f64, b: f64| (a - b).abs() <= LEAST_DIFFERENCE * b.abs();
        near(self.top_mm, other.top_mm)
            && near(self.side_mm, other.side_mm)
            && self.faces_mm.iter().zip(&other.faces_mm).all(|(a, b)| near(*a, *b))
            && near(self.diameter_mm, other.diameter_mm)
            && self.top_over_side == other.top_over_side
    }
}

/// Engagement of the spots with each of these changes alone.
pub(in crate::learn) fn other_geometries(
    path: &Toolpath,
    timeline: &Timeline,
    job: &Job,
    sizes: SizeChanges,
    forces: Option<Sample>,
    loader: Option<Loader>,
) -> Vec<OtherGeometry> {
    let options = options(loader);
    let below_mm = if sizes.top_over_side { sizes.side_mm } else { 0.0 };
    let face = |face: usize| {
        let mut sides_mm = [0.0; 4];
        sides_mm[face] = sizes.faces_mm[face];
        let moved = job.has_stock_with_faces().then(|| job.with_faces_moved(0.0, sides_mm));
        (Variant::StockFace(face), sizes.faces_mm[face], moved)
    };
    let jobs = [
        (Variant::StockTop, sizes.top_mm, Some(job.with_stock_grown(sizes.top_mm, below_mm))),
        (
            Variant::StockSide,
            sizes.side_mm,
            job.has_stock_with_sides().then(|| job.with_stock_grown(0.0, sizes.side_mm)),
        ),
        (Variant::Diameter, sizes.diameter_mm, job.with_mills_wider(sizes.diameter_mm)),
        face(0),
        face(1),
        face(2),
        face(3),
    ];
    let mut others: Vec<OtherGeometry> = jobs
        .into_par_iter()
        .filter_map(|(variant, size_mm, other)| {
            let other = other?;
            let changed = engage(path, &other, &options, &|_| ()).ok()?;
            let engaged = engaged_otherwise(path, &changed, &other, timeline, forces);
            Some(OtherGeometry { variant, size_mm, engaged, over: None })
        })
        .collect();
    if sizes.top_over_side {
        let side = others.iter().position(|o| o.variant == Variant::StockSide);
        others.iter_mut().filter(|o| o.variant == Variant::StockTop).for_each(|top| top.over = side);
    }
    others
}

/// Options of the engagement for a log.
pub(in crate::learn) fn options(loader: Option<Loader<'_>>) -> Options<'_> {
    Options { spacing_mm: SPACING_MM, loader, ..Options::default() }
}
