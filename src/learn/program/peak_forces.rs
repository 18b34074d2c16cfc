//! Forces of a station as a diagnosis needs them. In: stations, job. Out: [`Engaged`] with the derivatives of the peak
//! (or mean) force in the plane by each coefficient, and how runout changes these.
//!
//! A force is homogeneous of the first degree in its coefficients: its derivatives by them, times these, add up to it.
//! A peak jumps from one angle of the turn to another as coefficients and runout change: [`About`] says where the
//! changes are taken.

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

/// Cuts are alike whose speeds differ by less than this share and whose arcs end within so many rad.
const SAME_SPEED: f64 = 1e-3;
const SAME_RAD: f32 = 5e-4;

/// Runouts at which forces are taken.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::learn) struct About {
    /// The runouts.
    pub(in crate::learn) grid: RunoutGrid,
    /// Coefficients in the plane, in place of the declared ones.
    pub(in crate::learn) coefficients: Option<LinearEdge>,
}

/// Cutters with one coefficient at a time a little larger, round and with runout.
pub(in crate::learn) struct Forces<'a> {
    pub(in crate::learn) map: &'a EngagementMap,
    job: &'a Job,
    /// The force that is asked for: a peak, or the magnitude of the mean vector.
    wanted: Option<Sample>,
    /// Runouts whose change is asked for.
    about: Option<About>,
    /// (tool, speed) and the cutters.
    known: Vec<((u32, u64), Option<Probe>)>,
    /// Forces of the cuts met so far: passes repeat each other, and a long one is many spots.
    met: HashMap<Vec<i32>, ([f64; 4], Runouts)>,
}

/// The cutters of one tool at one speed.
struct Probe {
    fine: FineRings,
    /// As declared.
    declared: LinearEdge,
    nominal: Cutter,
    /// k_tc, k_rc, k_te, k_re larger, with by how much.
    larger: [(Cutter, f64); 4],
}

impl<'a> Forces<'a> {
    pub(in crate::learn) fn new(
        map: &'a EngagementMap,
        job: &'a Job,
        wanted: Option<Sample>,
        about: Option<About>,
    ) -> Self {
        Self { map, job, wanted, about, known: Vec::new(), met: HashMap::new() }
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
            (engaged.peak, runouts) = self.met(motion, station, tangent_z, speed_mm_s);
        }
        (engaged, runouts)
    }

    /// Forces of a cut, worked out where none like it was met.
    fn met(&mut self, motion: &Move, station: &Station, tangent_z: f64, speed_mm_s: f64) -> ([f64; 4], Runouts) {
        let speeds = [motion.spin.rps, speed_mm_s].map(|x| (x.max(1e-9).ln() / SAME_SPEED).round() as i32);
        let tilt = (tangent_z / f64::from(SAME_RAD)).round() as i32;
        let angle = |rad: f32| (rad / SAME_RAD).round() as i32;
        let arcs = self.map.arcs_of(station).iter();
        let arcs = arcs.flat_map(|arc| [i32::from(arc.slice), angle(arc.entry_rad), angle(arc.exit_rad)]);
        let key: Vec<i32> = [motion.tool as i32, tilt].into_iter().chain(speeds).chain(arcs).collect();
        if let Some(found) = self.met.get(&key) {
            return *found;
        }
        let found = self.peak(motion, station, tangent_z, speed_mm_s);
        self.met.insert(key, found);
        found
    }

    fn peak(&mut self, motion: &Move, station: &Station, tangent_z: f64, speed_mm_s: f64) -> ([f64; 4], Runouts) {
        let key = (motion.tool, motion.spin.rps.to_bits());
        if !self.known.iter().any(|(k, _)| *k == key) {
            let probe = self.probe(motion);
            self.known.push((key, probe));
        }
        let probe = self.known.iter().find(|(k, _)| *k == key).and_then(|(_, probe)| probe.as_ref());
        let Some(probe) = probe else { return Default::default() };
        let (mean, coarse) = (self.wanted == Some(Sample::Mean), self.map.arcs_of(station));
        let loads = |c: &Cutter, arcs: &[EngagedArc]| c.loads(&Cut { arcs, tangent_z, ..Cut::default() }, speed_mm_s);
        let force = |loads: &Loads| if mean { loads.force_xy_mean_n } else { loads.force_xy_peak_n };
        let fine = probe.fine.arcs(coarse);
        let peak = force(&loads(&probe.nominal, &fine));
        let slopes = probe.larger.each_ref().map(|(larger, by)| (force(&loads(larger, &fine)) - peak) / by);
        let Some(about) = self.about.filter(|_| peak > 0.0) else { return (slopes, Runouts::default()) };
        let k = about.coefficients.unwrap_or(probe.declared);
        let k = LinearEdge { k_ac: probe.declared.k_ac, k_ae: probe.declared.k_ae, ..k };
        let Some(tool) = self.job.tool(motion.tool) else { return (slopes, Runouts::default()) };
        let (slices, flutes) = (self.map.slices_of(motion.tool), f64::from(tool.flutes.max(1)));
        let feed_per_tooth_mm = speed_mm_s / (flutes * motion.spin.rps);
        let turn = |runout: Runout| Turn::new(tool, slices, coarse, tangent_z, feed_per_tooth_mm, runout);
        let round = turn(tool.runout.unwrap_or(Runout { offset_mm: 0.0, angle_rad: 0.0 }));
        let change = |offset_mm: f64, phase: f64| {
            let out = turn(Runout { offset_mm, angle_rad: phase * std::f64::consts::TAU / flutes });
            let force = out.slopes(&k, mean);
            // The chips of all teeth together stay; where a tooth misses the cut its edge rubs nothing.
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

    fn probe(&self, motion: &Move) -> Option<Probe> {
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
        Some(Probe {
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
