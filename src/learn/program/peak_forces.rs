//! Forces of a station, linearised for the diagnosis. In: stations, job. Out: [`Engaged`] with the derivatives of the
//! peak (or mean) force in the plane by each coefficient, and their changes by runout.
//!
//! A force F is homogeneous of first degree in its coefficients: F = Σ kᵢ ∂F/∂kᵢ (Euler). The rotation angle of the
//! peak changes with coefficients and runout; [`About`] is the point of linearisation.

use crate::engage::{EngagedArc, EngagementMap, Station};
use crate::force::contact::{Engaged, engaged as geometry};
use crate::force::fine_rings::FineRings;
use crate::force::{Cut, Cutter, Loads};
use crate::learn::program::declared::declared;

use crate::force::runout_forces::Turn;
use crate::learn::log::resultant::Sample;
use crate::learn::program::runout_grid::{RunoutGrid, Runouts};
use crate::machine::material::{ForceModel, LinearEdge, Material, Process};
use crate::machine::{Job, Runout};
use crate::nc::Move;
use std::collections::HashMap;

/// Cuts whose speeds differ by less than this share and whose arcs end within so many rad have the same forces.
const SAME_SPEED: f64 = 1e-3;
const SAME_RAD: f32 = 5e-4;

/// Point of linearisation: runouts and coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::learn) struct About {
    /// The runouts.
    pub(in crate::learn) grid: RunoutGrid,
    /// Coefficients in the plane instead of the declared ones.
    pub(in crate::learn) coefficients: Option<LinearEdge>,
}

/// Computes the forces of stations.
pub(in crate::learn) struct Forces<'a> {
    pub(in crate::learn) map: &'a EngagementMap,
    job: &'a Job,
    /// Peak force or magnitude of the mean vector; `None`: no forces.
    wanted: Option<Sample>,
    /// Point of linearisation; `None`: no changes by runout.
    about: Option<About>,
    /// Cutters by (tool, spindle speed).
    known: Vec<((u32, u64), Option<ToolCutters>)>,
    /// Forces computed so far: passes repeat each other, and a long pass has many equal spots.
    cached: HashMap<Vec<i32>, ([f64; 4], Runouts)>,
}

/// The cutters of one tool at one speed.
struct ToolCutters {
    fine: FineRings,
    /// As declared.
    declared: LinearEdge,
    nominal: Cutter,
    /// k_tc, k_rc, k_te, k_re increased one at a time, with the increase.
    larger: [(Cutter, f64); 4],
}

impl<'a> Forces<'a> {
    pub(in crate::learn) fn new(
        map: &'a EngagementMap,
        job: &'a Job,
        wanted: Option<Sample>,
        about: Option<About>,
    ) -> Self {
        Self { map, job, wanted, about, known: Vec::new(), cached: HashMap::new() }
    }

    pub(in crate::learn) fn engaged(
        &mut self,
        motion: &Move,
        station: &Station,
        tangent_z: f64,
        speed_mm_s: f64,
    ) -> (Engaged, Runouts) {
        let Some(tool) = self.job.tool(motion.tool) else { return Default::default() };
        let mut engaged = geometry(station, self.map, self.map.slices_of(motion.tool), tool.flutes, tangent_z);
        let mut runouts = Runouts::default();
        if self.wanted.is_some() && station.arc_count > 0 && motion.spin.rps > 0.0 {
            (engaged.peak, runouts) = self.cached(motion, station, tangent_z, speed_mm_s);
        }
        (engaged, runouts)
    }

    /// Forces of a cut, computed unless those of an equal one are known.
    fn cached(&mut self, motion: &Move, station: &Station, tangent_z: f64, speed_mm_s: f64) -> ([f64; 4], Runouts) {
        let speeds = [motion.spin.rps, speed_mm_s].map(|x| (x.max(1e-9).ln() / SAME_SPEED).round() as i32);
        let tilt = (tangent_z / f64::from(SAME_RAD)).round() as i32;
        let angle = |rad: f32| (rad / SAME_RAD).round() as i32;
        let arcs = self.map.arcs_of(station).iter();
        let arcs = arcs.flat_map(|arc| [arc.slice as i32, angle(arc.entry_rad), angle(arc.exit_rad)]);
        let key: Vec<i32> = [motion.tool as i32, tilt].into_iter().chain(speeds).chain(arcs).collect();
        if let Some(found) = self.cached.get(&key) {
            return *found;
        }
        let found = self.peak(motion, station, tangent_z, speed_mm_s);
        self.cached.insert(key, found);
        found
    }

    fn peak(&mut self, motion: &Move, station: &Station, tangent_z: f64, speed_mm_s: f64) -> ([f64; 4], Runouts) {
        let key = (motion.tool, motion.spin.rps.to_bits());
        if !self.known.iter().any(|(k, _)| *k == key) {
            let cutters = self.cutters(motion);
            self.known.push((key, cutters));
        }
        let cutters = self.known.iter().find(|(k, _)| *k == key).and_then(|(_, cutters)| cutters.as_ref());
        let Some(cutters) = cutters else { return Default::default() };
        let (mean, coarse) = (self.wanted == Some(Sample::Mean), self.map.arcs_of(station));
        let loads = |c: &Cutter, arcs: &[EngagedArc]| c.loads(&Cut { arcs, tangent_z, ..Cut::default() }, speed_mm_s);
        let force = |loads: &Loads| if mean { loads.force_xy_mean_n } else { loads.force_xy_peak_n };
        let fine = cutters.fine.arcs(coarse);
        let peak = force(&loads(&cutters.nominal, &fine));
        let slopes = cutters.larger.each_ref().map(|(larger, by)| (force(&loads(larger, &fine)) - peak) / by);
        let Some(about) = self.about.filter(|_| peak > 0.0) else { return (slopes, Runouts::default()) };
        let k = about.coefficients.unwrap_or(cutters.declared);
        let k = LinearEdge { k_ac: cutters.declared.k_ac, k_ae: cutters.declared.k_ae, ..k };
        let Some(tool) = self.job.tool(motion.tool) else { return (slopes, Runouts::default()) };
        let (slices, flutes) = (self.map.slices_of(motion.tool), f64::from(tool.flutes.max(1)));
        let feed_per_tooth_mm = speed_mm_s / (flutes * motion.spin.rps);
        let turn = |runout: Runout| Turn::new(tool, slices, coarse, tangent_z, feed_per_tooth_mm, runout);
        let round = turn(tool.runout.unwrap_or(Runout { offset_mm: 0.0, angle_rad: 0.0 }));
        let change = |offset_mm: f64, phase: f64| {
            let out = turn(Runout { offset_mm, angle_rad: phase * std::f64::consts::TAU / flutes });
            let force = out.slopes(&k, mean);
            // Runout does not change the volume that all teeth remove; the edge of a tooth that misses the cut has no
            // contact.
            let lost = (1.0 - out.idle) / (1.0 - round.idle).max(1e-9) - 1.0;
            [force[0] - slopes[0], force[1] - slopes[1], force[2] - slopes[2], force[3] - slopes[3], lost]
        };
        let mut runouts = Runouts::default();
        for (k, offset_mm) in about.grid.offsets_mm.into_iter().enumerate() {
            for (way, phase) in about.grid.phases().iter().enumerate() {
                runouts[k][way] = change(offset_mm, *phase);
            }
        }
        (slopes, runouts)
    }

    fn cutters(&self, motion: &Move) -> Option<ToolCutters> {
        let tool = self.job.tool(motion.tool)?;
        let k = declared(self.job, tool)?;
        let fine = FineRings::new(self.map.slices_of(motion.tool), tool);
        let cutter = |k: LinearEdge| {
            let material = Material { name: String::new(), model: ForceModel::LinearEdge(k), uncertainty: None };
            let spindle = &self.job.machine.spindle;
            Cutter::new(tool, &material, spindle, &Process::default(), &fine.slices, motion.spin.rps).ok()
        };
        let step = |value: f64| 1e-3 * value.abs().max(1.0);
        let (tc, rc, te, re) = (step(k.k_tc), step(k.k_rc), step(k.k_te), step(k.k_re));
        Some(ToolCutters {
            nominal: cutter(k)?,
            larger: [
                (cutter(LinearEdge { k_tc: k.k_tc + tc, ..k })?, tc),
                (cutter(LinearEdge { k_rc: k.k_rc + rc, ..k })?, rc),
                (cutter(LinearEdge { k_te: k.k_te + te, ..k })?, te),
                (cutter(LinearEdge { k_re: k.k_re + re, ..k })?, re),
            ],
            declared: k,
            fine,
        })
    }
}
