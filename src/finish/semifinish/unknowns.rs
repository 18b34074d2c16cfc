//! The unknowns: knots whose stock is chosen. In: the simulated programs, the stock that each stretch of the finish
//! meets. Out: the unknowns with their normals and stock; which of them each other knot follows, and which each stretch
//! depends on.

use super::least_squares::Pair;
use super::met_stock::{MetStock, Sample};
use super::pass_spacing::ACROSS;
use super::preconditions::nothing_free;
use super::programs::{Programs, Simulated};
use super::stock::left;
use super::task::SemifinishError;
use crate::engage::workpiece::shift;
use crate::nc::MoveKind;
use crate::path::Vec3;
use rayon::prelude::*;

/// Share of the stock a sample meets that must be free for it to count.
pub const FREE: f64 = 0.5;

/// The knots whose stock is chosen.
pub struct Unknowns {
    /// Knot of each unknown.
    pub knots: Vec<u32>,
    /// Unknown of each knot: its own, or that of the nearest knot whose stock the finish cuts.
    pub of_knot: Vec<Option<u32>>,
    /// Normal at each unknown.
    pub normals: Vec<Vec3>,
    /// Stock as programmed, mm.
    pub stock_mm: Vec<f64>,
    /// Bounds on the change of stock between neighbours.
    pub pairs: Vec<Pair>,
}

/// Sum of the normals at each knot, weighted by the length of the samples that meet it.
fn sum_of_normals<'a>(count: usize, seen: impl Iterator<Item = (&'a Sample, &'a MetStock)>) -> Vec<Vec3> {
    let mut normals = vec![Vec3::zeros(); count];
    for (sample, met) in seen {
        for (knot, normal) in &met.normals {
            normals[*knot as usize] += normal * sample.length_mm;
        }
    }
    normals
}

impl Unknowns {
    /// Chooses free knots whose stock the finish cuts.
    pub fn new(
        programs: &Programs,
        base: &Simulated,
        samples: &[Sample],
        met: &[MetStock],
    ) -> Result<Self, SemifinishError> {
        let count = programs.knots.list.len();
        let mut normals = sum_of_normals(count, samples.iter().zip(met).filter(|(sample, _)| !sample.edge));
        // Stations at the ends of a cut mix several places: their normals are used only for knots without others.
        let anywhere = sum_of_normals(count, samples.iter().zip(met));
        for (normal, any) in normals.iter_mut().zip(anywhere) {
            if normal.norm() <= 1e-9 {
                *normal = any;
            }
        }
        let known: Vec<u32> = (0..count as u32)
            .filter(|k| programs.knots.list[*k as usize].free && normals[*k as usize].norm() > 1e-9)
            .collect();
        let mut unknowns = Self {
            normals: known.iter().map(|k| normals[*k as usize].normalize()).collect(),
            of_knot: vec![None; count],
            knots: known,
            stock_mm: Vec::new(),
            pairs: Vec::new(),
        };
        unknowns.upright_to_passes(programs, base);
        let tips = unknowns.tips(programs, base);
        let finish = programs.finish_centres(&base.toolpath);
        let radii = [programs.semi_tool.radius_mm(), programs.finish_tool.radius_mm()];
        let stock = left(&tips, radii[0], &finish, radii[1]);
        let kept: Vec<usize> = (0..stock.len()).filter(|k| stock[*k].is_some()).collect();
        unknowns.stock_mm = kept.iter().filter_map(|k| stock[*k]).collect();
        unknowns.knots = kept.iter().map(|k| unknowns.knots[*k]).collect();
        unknowns.normals = kept.iter().map(|k| unknowns.normals[*k]).collect();
        if unknowns.knots.is_empty() {
            return Err(nothing_free(programs, base));
        }
        unknowns.spread(programs);
        unknowns.pair(programs);
        Ok(unknowns)
    }

    /// Makes the normals perpendicular to the vector to the next pass. In the first and last pass the ball also leaves
    /// a surface on its far side, which tilts the mean normal; moved along that it would cut into the far side.
    fn upright_to_passes(&mut self, programs: &Programs, base: &Simulated) {
        let centres = programs.semi_centres(base);
        let radius_mm = programs.semi_tool.radius_mm();
        let up = Vec3::new(0.0, 0.0, radius_mm);
        let set = |(tip, normal): (Vec3, Vec3)| {
            let way = centres.beside(tip + up, normal, radius_mm, ACROSS).and_then(|way| way.try_normalize(0.0));
            let level = way.map_or(normal, |way| normal - way * normal.dot(&way));
            level.try_normalize(0.0).unwrap_or(normal)
        };
        self.normals = self.tips(programs, base).into_par_iter().map(set).collect();
    }

    /// Tip of the semi-finishing tool at each unknown, in the common frame, with the normal there.
    pub fn tips(&self, programs: &Programs, base: &Simulated) -> Vec<(Vec3, Vec3)> {
        let tip = |knot: &u32| {
            let knot = &programs.knots.list[*knot as usize];
            knot.at + shift(programs.task.job, &base.toolpath, programs.task.semi.moves[knot.of as usize].wcs)
        };
        self.knots.iter().map(tip).zip(self.normals.iter().copied()).collect()
    }

    /// Assigns each free knot whose stock the finish does not cut to the nearest unknown along the path, without
    /// crossing a rapid.
    fn spread(&mut self, programs: &Programs) {
        let list = &programs.knots.list;
        let moves = &programs.task.semi.moves;
        for (unknown, knot) in self.knots.iter().enumerate() {
            self.of_knot[*knot as usize] = Some(unknown as u32);
        }
        let own = self.of_knot.clone();
        let mut way = vec![f64::INFINITY; list.len()];
        let length = |k: usize| if k == 0 { 0.0 } else { (list[k].at - list[k - 1].at).norm() };
        let rapid = |k: usize| moves.get(list[k].of as usize).is_none_or(|motion| motion.kind == MoveKind::Rapid);
        let mut carried: Option<(u32, f64)> = None;
        for k in 0..list.len() {
            carried = carried.filter(|_| !rapid(k)).map(|(of, far)| (of, far + length(k)));
            if let Some(of) = own[k] {
                carried = Some((of, 0.0));
            } else if let (Some((of, far)), true) = (carried, list[k].free) {
                (self.of_knot[k], way[k]) = (Some(of), far);
            }
        }
        carried = None;
        for k in (0..list.len()).rev() {
            if let Some(of) = own[k] {
                carried = Some((of, 0.0));
            } else if let Some((of, far)) = carried.filter(|(_, far)| list[k].free && *far < way[k]) {
                (self.of_knot[k], way[k]) = (Some(of), far);
            }
            carried = carried.filter(|_| !rapid(k)).map(|(of, far)| (of, far + length(k)));
        }
    }

    /// Adds the bounds on the change of stock between neighbours along the path.
    fn pair(&mut self, programs: &Programs) {
        let list = &programs.knots.list;
        for (j, two) in self.knots.windows(2).enumerate() {
            let [a, b] = [two[0] as usize, two[1] as usize];
            if b == a + 1 {
                let reach = programs.task.wanted.change * (list[b].at - list[a].at).norm();
                self.pairs.push(Pair { of: [j as u32, j as u32 + 1], centre: 0.0, reach });
            }
        }
    }

    /// Offsets of all knots for this stock at the unknowns, mm.
    pub fn offsets(&self, stock_mm: &[f64]) -> Vec<Vec3> {
        let of = |unknown: &Option<u32>| {
            unknown.map_or_else(Vec3::zeros, |k| {
                let k = k as usize;
                self.normals[k] * (stock_mm[k] - self.stock_mm[k])
            })
        };
        self.of_knot.iter().map(of).collect()
    }

    /// Unknowns that a sample depends on, with their weights.
    pub fn shares<'b>(&'b self, met: &'b MetStock) -> impl Iterator<Item = (usize, f64)> + 'b {
        met.shares.iter().filter_map(|(knot, share)| Some((self.of_knot[*knot as usize]? as usize, *share)))
    }

    /// Share of the stock that a sample meets which can be chosen.
    pub fn free_share(&self, met: &MetStock) -> f64 {
        self.shares(met).map(|(_, share)| share).sum()
    }
}
