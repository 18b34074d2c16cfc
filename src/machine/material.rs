//! Material and process model as data. In: filled by the setup, by calibration and by diagnosis. Out: [`Material`], the force model with its
//! coefficients; [`Process`], named effects with parameters on top of it.

/// Coefficients of the linear edge model (Xu, Jerard, Fussell, Eqs 2.1–2.3): a force per length of cutting edge is
/// `k_?c · h + k_?e`, tangential (t), radial/normal (r) and axial (a).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LinearEdge {
    /// Tangential cutting coefficient, N/mm².
    pub k_tc: f64,
    /// Radial cutting coefficient, N/mm².
    pub k_rc: f64,
    /// Axial cutting coefficient, N/mm².
    pub k_ac: f64,
    /// Tangential edge coefficient, N/mm.
    pub k_te: f64,
    /// Radial edge coefficient, N/mm.
    pub k_re: f64,
    /// Axial edge coefficient, N/mm.
    pub k_ae: f64,
}

/// Coefficients over the tangential one of the same kind, where only spindle power was measured: a meter on the spindle sees
/// no other force. Radial: measured on 6061-T6 by Xu, Jerard, Fussell (0.3 is usual in the literature, 0.7 conservative);
/// axial: half of the radial one, assumed.
pub const SHARES: Shares = Shares { radial_cutting: 0.395, axial_cutting: 0.2, radial_edge: 0.566, axial_edge: 0.28 };

/// Shares of the tangential coefficients; see [`SHARES`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shares {
    /// k_rc / k_tc
    pub radial_cutting: f64,
    /// k_ac / k_tc
    pub axial_cutting: f64,
    /// k_re / k_te
    pub radial_edge: f64,
    /// k_ae / k_te
    pub axial_edge: f64,
}

/// Force models by the names of `library models`.
#[derive(Debug, Clone, PartialEq)]
pub enum ForceModel {
    /// `linear-edge` (also `power`, which leaves the normal coefficients to ratios).
    LinearEdge(LinearEdge),
    /// Any other model: its name and its named parameters; `force` holds the formulas.
    Named {
        /// Name, as in `library models`.
        name: String,
        /// Parameters by name, in the order of the model's description.
        parameters: Vec<(String, f64)>,
    },
}

impl ForceModel {
    /// Its name, as in `library models`.
    pub fn name(&self) -> &str {
        match self {
            ForceModel::LinearEdge(_) => "linear-edge",
            ForceModel::Named { name, .. } => name,
        }
    }
}

/// A material as a tool meets it.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name, for the report.
    pub name: String,
    /// Force model.
    pub model: ForceModel,
    /// Relative standard uncertainty of forces, where it is stated.
    pub uncertainty: Option<f64>,
}

/// One named effect with its parameters; the names are those of `library effects`.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectUse {
    /// Name of the effect.
    pub name: String,
    /// Parameter values by name.
    pub parameters: Vec<(String, f64)>,
}

/// Coefficients of a load in parts of a rating that is not known, as a drive shows it in percent or ampere: they predict such
/// readings, not forces, and no feed rests on them.
#[derive(Debug, Clone, PartialEq)]
pub struct RelativeLoad {
    /// Unit of the readings: "%" or "A".
    pub unit: String,
    /// Reading with nothing cut.
    pub tare: f64,
    /// Spindle speed that tare belongs to, rev/s.
    pub tare_rps: Option<f64>,
    /// Reading per removal rate, unit/(1000 mm³/s).
    pub k_tc: f64,
    /// Reading per contact rate, unit/(1000 mm²/s).
    pub k_te: f64,
}

/// What calibration and diagnosis found: replaces the base coefficients where given, and adds effects.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Process {
    /// Base model that replaces the material's.
    pub base: Option<ForceModel>,
    /// Tare that replaces the spindle's, W.
    pub tare_w: Option<f64>,
    /// Spindle speed that tare belongs to, rev/s: at other speeds it follows the spindle's curve.
    pub tare_rps: Option<f64>,
    /// In place of the base where the log had its load in percent or ampere.
    pub relative: Option<RelativeLoad>,
    /// Effects on top of it, in the order added.
    pub effects: Vec<EffectUse>,
    /// Covariance of the base parameters, row by row, where it is known.
    pub covariance: Vec<Vec<f64>>,
    /// The parameters its rows belong to.
    pub covariance_of: Vec<String>,
    /// Scatter: residual of the load of a cut on held-out data, as a share of the load; one standard deviation, without the noise of the sensor.
    pub scatter: Option<f64>,
    /// By tool: the highest feed per tooth of the cuts that the model rests on, mm.
    pub feed_per_tooth_mm: Vec<(u32, f64)>,
}

impl Process {
    /// Highest feed per tooth that was measured with a tool; of a tool that was not, the highest of any. `None` where none is known.
    pub fn measured_feed(&self, tool: u32) -> Option<f64> {
        let of = |own: &dyn Fn(u32) -> bool| {
            self.feed_per_tooth_mm.iter().filter(|(t, _)| own(*t)).map(|(_, f)| *f).max_by(f64::total_cmp)
        };
        of(&|t| t == tool).or_else(|| of(&|_| true))
    }

    /// Does it carry coefficients measured here, by `calibrate` or `learn`? A `[material]` written out by hand does not count:
    /// nothing tells whether its numbers were measured or copied.
    pub fn is_measured(&self) -> bool {
        self.base.is_some()
    }
}
