//! Engagement in stock that stands out and with a tool of another size. In: a program, its job, sizes. Out:
//! [`OtherGeometry`], first for usual sizes of each change, then for the sizes that were found as well: between two sizes that were
//! simulated the cut is taken as linear in the size.

use crate::effects::Change;
use crate::engage::{Again, EngagementMap, Loader, Options, engage, engage_again};
use crate::learn::log::resultant::Sample;
use crate::learn::program::timeline::{Timeline, engaged_otherwise};
use crate::learn::program::turned::path_at_turned_stock;
use crate::learn::program::unchanged_moves::unchanged_moves;
use crate::learn::program::variant::OtherGeometry;
use crate::learn::program::variant::Variant;
use crate::machine::Job;
use crate::nc::Toolpath;
use rayon::prelude::*;

/// Largest spacing of the engagement, mm.
const SPACING_MM: f64 = 0.5;
/// By how much each face of the stock is moved outward, mm, and the tool shrunk, to see what that changes. Inward is not the negative
/// of outward: passes beside the stock meet nothing however far the face is moved in, and something once it is moved out far enough.
/// Allowances of sawn and cast blanks are some 0.5 … 2 mm a side; judgement.
const STOCK_CHANGE_MM: [f64; 4] = [0.5, 1.5, -0.5, -1.5];
const DIAMETER_CHANGE: f64 = 0.04;
/// How far the stock is turned where a face is moved by a millimetre, rad: half a millimetre at the ends of a part 100 mm long.
const TURNED_PER_MM: f64 = 0.01;
/// Least change that is simulated, mm and rad, and least difference, as a share, from one that was.
const LEAST_MM: f64 = 0.01;
const LEAST_RAD: f64 = 1e-4;
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
    /// Stock turned by, rad.
    turn_rad: f64,
    /// Tools larger by, mm of diameter.
    diameter_mm: f64,
    /// The top is raised on stock with changed sides, not on the declared one.
    top_over_side: bool,
}

impl SizeChanges {
    /// The first of the usual ones.
    pub(in crate::learn) fn usual(job: &Job) -> Self {
        Self::by(job, STOCK_CHANGE_MM[0])
    }

    /// Every face moved outward by this, mm, and smaller tools.
    fn by(job: &Job, grown_mm: f64) -> Self {
        let diameters: Vec<f64> = job.tools.iter().map(|t| t.diameter_mm).collect();
        let diameter_mm = -DIAMETER_CHANGE * crate::learn::regress::statistics::median(&diameters);
        Self {
            top_mm: grown_mm,
            side_mm: grown_mm,
            faces_mm: [grown_mm; 4],
            turn_rad: TURNED_PER_MM * grown_mm,
            diameter_mm,
            top_over_side: false,
        }
    }

    /// Sums of these changes, typical sizes for those that are 0; `None` if all are.
    pub(in crate::learn) fn found(job: &Job, changes: &[Change]) -> Option<Self> {
        let beyond = |least: f64, of: &dyn Fn(&Change) -> f64| {
            Some(changes.iter().map(of).sum::<f64>()).filter(|v| v.abs() >= least)
        };
        let sum = |of: &dyn Fn(&Change) -> f64| beyond(LEAST_MM, of);
        let turn = beyond(LEAST_RAD, &|c| c.stock_turn_rad);
        let (top, side) = (sum(&|c| c.stock_top_mm), sum(&|c| c.stock_side_mm));
        let faces = [0, 1, 2, 3].map(|face| sum(&|c: &Change| c.stock_faces_mm[face]));
        let diameter = sum(&|c| c.diameter_mm);
        faces.into_iter().fold(top.or(side).or(diameter).or(turn), Option::or)?;
        let usual = Self::usual(job);
        Some(Self {
            top_mm: top.unwrap_or(usual.top_mm),
            side_mm: side.unwrap_or(usual.side_mm),
            faces_mm: faces.map(|face| face.unwrap_or(STOCK_CHANGE_MM[0])),
            turn_rad: turn.unwrap_or(usual.turn_rad),
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
            && near(self.turn_rad, other.turn_rad)
            && near(self.diameter_mm, other.diameter_mm)
            && self.top_over_side == other.top_over_side
    }
}

/// Engagement of the spots with each of the usual changes.
pub(in crate::learn) fn usual_geometries(
    path: &Toolpath,
    map: &EngagementMap,
    timeline: &Timeline,
    job: &Job,
    forces: Option<Sample>,
    loader: Option<Loader>,
) -> Vec<OtherGeometry> {
    let mut all: Vec<OtherGeometry> = Vec::new();
    for grown_mm in STOCK_CHANGE_MM {
        let others = other_geometries(path, map, timeline, job, SizeChanges::by(job, grown_mm), forces, loader);
        let is_new = |other: &OtherGeometry| !all.iter().any(|known| known.is_same(other));
        let new: Vec<OtherGeometry> = others.into_iter().filter(is_new).collect();
        all.extend(new);
    }
    all
}

/// What was found and, at other sizes, what was simulated before: `found` comes first, its `over` counts on its own places. A top that
/// was raised over wider sides stands alone, for at the other sizes it was raised on the declared stock.
pub(in crate::learn) fn beside_usual(found: Vec<OtherGeometry>, usual: &[OtherGeometry]) -> Vec<OtherGeometry> {
    let is_over = |variant: Variant| found.iter().any(|other| other.variant == variant && other.over.is_some());
    let is_new = |other: &&OtherGeometry| !is_over(other.variant) && !found.iter().any(|known| known.is_same(other));
    let more: Vec<OtherGeometry> = usual.iter().filter(is_new).cloned().collect();
    found.into_iter().chain(more).collect()
}

/// Engagement of the spots with each of these changes; `map` is that of the declared stock and tools.
pub(in crate::learn) fn other_geometries(
    path: &Toolpath,
    map: &EngagementMap,
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
        .filter_map(|(variant, size, other)| {
            let other = other?;
            let unchanged = unchanged_moves(path, map, job, &other);
            let again = unchanged.as_ref().map(|of_move| Again { known: map, of_move });
            let changed = match again {
                Some(again) => engage_again(path, &other, &options, again, &|_| ()),
                None => engage(path, &other, &options, &|_| ()),
            };
            let changed = changed.ok()?;
            let engaged = engaged_otherwise(path, &changed, &other, timeline, forces, unchanged.as_deref());
            Some(OtherGeometry { variant, size, engaged, over: None })
        })
        .collect();
    if let Some(turned) = path_at_turned_stock(path, job, sizes.turn_rad) {
        others.extend(engage(&turned, job, &options, &|_| ()).ok().map(|changed| OtherGeometry {
            variant: Variant::StockTurn,
            size: sizes.turn_rad,
            engaged: engaged_otherwise(&turned, &changed, job, timeline, forces, None),
            over: None,
        }));
    }
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
