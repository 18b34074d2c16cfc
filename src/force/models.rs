//! The list of force models. In: nothing. Out: for each model its name, source, and parameters with units, bounds and defaults. The setup file,
//! calibration and `library models` read this list.

use super::error::ForceError;
use crate::machine::material::SHARES;

/// A parameter of a force model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Key.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Value when it is not given; `None`: must be given.
    pub default: Option<f64>,
    /// Least sensible value.
    pub min: f64,
    /// Greatest sensible value.
    pub max: f64,
    /// What it is.
    pub meaning: &'static str,
}

/// A force model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// Name in the setup file.
    pub name: &'static str,
    /// One sentence.
    pub meaning: &'static str,
    /// Where it comes from.
    pub source: &'static str,
    /// Its parameters.
    pub parameters: &'static [Parameter],
}

const fn p(
    name: &'static str,
    unit: &'static str,
    default: Option<f64>,
    [min, max]: [f64; 2],
    meaning: &'static str,
) -> Parameter {
    Parameter { name, unit, default, min, max, meaning }
}

const CUTTING: [f64; 2] = [0.0, 50_000.0];
const CUTTING_SIGNED: [f64; 2] = [-50_000.0, 50_000.0];
const EDGE: [f64; 2] = [0.0, 1_000.0];
const EDGE_SIGNED: [f64; 2] = [-1_000.0, 1_000.0];
const ANY: [f64; 2] = [-1e12, 1e12];

/// `linear-edge`.
pub const LINEAR_EDGE: Model = Model {
    name: "linear-edge",
    meaning: "force per edge length k_c·h + k_e, tangential, radial and axial",
    source: "Xu, Jerard, Fussell 2007, Eqs 2.1–2.6; Altintas, Manufacturing Automation",
    parameters: &[
        p("k_tc", "N/mm²", None, CUTTING, "tangential cutting coefficient"),
        p("k_te", "N/mm", None, EDGE, "tangential edge coefficient"),
        p("k_rc", "N/mm²", Some(0.0), CUTTING_SIGNED, "radial cutting coefficient"),
        p("k_re", "N/mm", Some(0.0), EDGE_SIGNED, "radial edge coefficient"),
        p("k_ac", "N/mm²", Some(0.0), CUTTING_SIGNED, "axial cutting coefficient"),
        p("k_ae", "N/mm", Some(0.0), EDGE_SIGNED, "axial edge coefficient"),
    ],
};

/// `power`.
pub const POWER: Model = Model {
    name: "power",
    meaning: "linear edge model known from spindle power only: the normal coefficients follow from shares",
    source: "Xu, Jerard, Fussell 2007, Eq. 3.7; shares 0.395 and 0.566 measured there on 6061-T6, 0.7 is conservative",
    parameters: &[
        p("k_tc", "N/mm²", None, CUTTING, "tangential cutting coefficient"),
        p("k_te", "N/mm", None, EDGE, "tangential edge coefficient"),
        p(
            "normal_cutting_share",
            "-",
            Some(SHARES.radial_cutting),
            [0.0, 3.0],
            "radial over tangential cutting coefficient",
        ),
        p("normal_edge_share", "-", Some(SHARES.radial_edge), [0.0, 3.0], "radial over tangential edge coefficient"),
        p(
            "axial_cutting_share",
            "-",
            Some(SHARES.axial_cutting),
            [0.0, 3.0],
            "axial over tangential cutting coefficient",
        ),
        p("axial_edge_share", "-", Some(SHARES.axial_edge), [0.0, 3.0], "axial over tangential edge coefficient"),
    ],
};

/// `linear-edge-by-part`: [`LINEAR_EDGE`], and any of its keys with a part of the cutter in front.
pub const BY_PART: Model = Model {
    name: "linear-edge-by-part",
    meaning: "linear edge model whose keys may begin with a part: bottom_, corner_ (or ball), cone_, side_; a key without \
              one holds for every part that does not say otherwise",
    source: "as linear-edge",
    parameters: LINEAR_EDGE.parameters,
};

/// `kienzle`.
pub const KIENZLE: Model = Model {
    name: "kienzle",
    meaning: "force per edge length k_c11·h^(1−m_c) (h in mm): specific force falls as the chip thickens",
    source: "Kienzle 1952; VDI 3321",
    parameters: &[
        p("k_c11", "N/mm²", None, [1.0, 20_000.0], "specific cutting force at h = b = 1 mm"),
        p("m_c", "-", None, [0.0, 0.9], "exponent"),
        p("normal_share", "-", Some(0.5), [0.0, 3.0], "radial over tangential force"),
        p("axial_share", "-", Some(0.2), [0.0, 3.0], "axial over tangential force"),
        p("k_te", "N/mm", Some(0.0), EDGE, "tangential edge coefficient"),
        p("k_re", "N/mm", Some(0.0), EDGE, "radial edge coefficient"),
    ],
};

/// `sigmoid`.
pub const SIGMOID: Model = Model {
    name: "sigmoid",
    meaning: "normal pressure on the rake face as a sigmoid of chip thickness, friction along the chip",
    source: "Ko, Yun, Cho 2002, Eqs 3–9",
    parameters: &[
        p("a1", "ln(N/mm²)", None, [0.0, 20.0], "upper level of ln K_n"),
        p("a2", "ln(N/mm²)", None, [0.0, 20.0], "lower level of ln K_n"),
        p("x0", "-", None, [-10.0, 10.0], "middle of the sigmoid, in normalised chip thickness"),
        p("dx", "-", None, [1e-3, 10.0], "width of the sigmoid"),
        p("k_f", "-", None, [0.0, 3.0], "friction over normal force on the rake face"),
        p("chip_flow", "rad", None, [-1.5, 1.5], "chip flow angle on the rake face"),
        p("chip_range", "mm", Some(0.0), [0.0, 10.0], "chip thickness that normalises; 0: range of the cut itself"),
        p("deflection", "-", Some(0.0), [0.0, 1.0], "1: the tool's deflection changes the chip thickness"),
    ],
};

/// `response`.
pub const RESPONSE: Model = Model {
    name: "response",
    meaning: "resultant force of the whole cut from the largest chip thickness t_m and the length of contact L (mm)",
    source: "Kakino, Ibaraki: F = b0 + b_l L + b_t t_m + b_ll L² + b_tt t_m² + b_lt L t_m; b0 is the wear index",
    parameters: &[
        p("b0", "N", None, ANY, "constant: the index of wear"),
        p("b_l", "N/mm", None, ANY, "per length of contact"),
        p("b_t", "N/mm", None, ANY, "per chip thickness"),
        p("b_ll", "N/mm²", Some(0.0), ANY, "per length squared"),
        p("b_tt", "N/mm²", Some(0.0), ANY, "per chip thickness squared"),
        p("b_lt", "N/mm²", Some(0.0), ANY, "per product"),
        p("normal_share", "-", Some(0.7), [0.0, 10.0], "normal over tangential force"),
    ],
};

/// `layer`.
pub const LAYER: Model = Model {
    name: "layer",
    meaning: "force of a ball end summed over layers along the axis: C0 + C1 L + C2 t_m + C3 L t_m per mm of height",
    source: "Nishida and others, Eq. 1, with L in mm and t_m in µm",
    parameters: &[
        p("c0", "N/mm", None, ANY, "constant"),
        p("c1", "N/mm²", None, ANY, "per length of contact in mm"),
        p("c2", "N/(mm·µm)", None, ANY, "per chip thickness in µm"),
        p("c3", "N/(mm²·µm)", None, ANY, "per product"),
        p("radius_exponent", "-", Some(0.0), [-3.0, 3.0], "exponent of a layer's radius over the ball's, on its force"),
        p(
            "radius_from",
            "-",
            Some(0.0),
            [0.0, 1.0],
            "radius over the ball's below which that stays level: the least measured",
        ),
        p("normal_share", "-", Some(0.7), [0.0, 10.0], "normal over tangential force"),
    ],
};

/// `polynomial`.
pub const POLYNOMIAL: Model = Model {
    name: "polynomial",
    meaning: "K_t (a) and K_r (b) as polynomials: 1, a_p, f_t, a_e, a_p², f_t², a_e², a_p n, a_p f_t, a_p a_e, f_t a_e",
    source: "Niu, Wang, Zhao, Huang, Eq. 4; mm, mm per tooth, rev/min, N/mm²",
    parameters: &[
        p("a0", "N/mm²", None, ANY, "tangential: constant"),
        p("a1", "", Some(0.0), ANY, "a_p"),
        p("a2", "", Some(0.0), ANY, "f_t"),
        p("a3", "", Some(0.0), ANY, "a_e"),
        p("a4", "", Some(0.0), ANY, "a_p²"),
        p("a5", "", Some(0.0), ANY, "f_t²"),
        p("a6", "", Some(0.0), ANY, "a_e²"),
        p("a7", "", Some(0.0), ANY, "a_p n"),
        p("a8", "", Some(0.0), ANY, "a_p f_t"),
        p("a9", "", Some(0.0), ANY, "a_p a_e"),
        p("a10", "", Some(0.0), ANY, "f_t a_e"),
        p("b0", "N/mm²", None, ANY, "radial: constant"),
        p("b1", "", Some(0.0), ANY, "a_p"),
        p("b2", "", Some(0.0), ANY, "f_t"),
        p("b3", "", Some(0.0), ANY, "a_e"),
        p("b4", "", Some(0.0), ANY, "a_p²"),
        p("b5", "", Some(0.0), ANY, "f_t²"),
        p("b6", "", Some(0.0), ANY, "a_e²"),
        p("b7", "", Some(0.0), ANY, "a_p n"),
        p("b8", "", Some(0.0), ANY, "a_p f_t"),
        p("b9", "", Some(0.0), ANY, "a_p a_e"),
        p("b10", "", Some(0.0), ANY, "f_t a_e"),
    ],
};

/// Every force model.
pub const ALL: [&Model; 8] = [&LINEAR_EDGE, &POWER, &BY_PART, &KIENZLE, &SIGMOID, &RESPONSE, &LAYER, &POLYNOMIAL];

/// The parameters of a model, complete and checked.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Values(Vec<(&'static str, f64)>);

impl Values {
    /// Checks that `given` has every key without a default, no unknown one, and values within bounds.
    pub(super) fn checked(model: &Model, given: &[(String, f64)]) -> Result<Self, ForceError> {
        if let Some((key, _)) = given.iter().find(|(key, _)| model.parameters.iter().all(|known| known.name != key)) {
            return Err(ForceError::UnknownParameter { key: key.clone(), model: model.name });
        }
        let value = |parameter: &Parameter| {
            let found = given.iter().find(|(key, _)| key == parameter.name).map(|(_, value)| *value);
            let missing = ForceError::MissingParameter { key: parameter.name, model: model.name };
            let value = found.or(parameter.default).ok_or(missing)?;
            super::error::range(parameter.name, value, parameter.min, parameter.max)?;
            Ok((parameter.name, value))
        };
        model.parameters.iter().map(value).collect::<Result<_, _>>().map(Self)
    }
    /// Value of a parameter of the model.
    pub(super) fn get(&self, name: &str) -> f64 {
        self.0.iter().find(|(key, _)| *key == name).expect("a parameter of this model").1
    }
}
