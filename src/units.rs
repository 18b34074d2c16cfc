//! All conversions of units. In: a quantity in the unit of a text, a setup or a report. Out: the same in the units of the library (mm, s, N,
//! N·mm, W, rad, mm/s, rev/s), and back.

/// Millimetres in one inch.
pub const MM_PER_INCH: f64 = 25.4;

/// Units that headers of measured data may carry: name, dimension, value in the unit data are kept in.
const HEADER_UNITS: &[(&str, &str, f64)] = &[
    ("s", "time", 1.0),
    ("sec", "time", 1.0),
    ("ms", "time", 1e-3),
    ("msec", "time", 1e-3),
    ("us", "time", 1e-6),
    ("min", "time", 60.0),
    ("mm", "length", 1.0),
    ("um", "length", 1e-3),
    ("in", "length", MM_PER_INCH),
    ("inch", "length", MM_PER_INCH),
    ("mm_min", "feed", 1.0),
    ("mm_s", "feed", 60.0),
    ("mm_sec", "feed", 60.0),
    ("m_min", "feed", 1e3),
    ("in_min", "feed", MM_PER_INCH),
    ("rpm", "speed", 1.0),
    ("1_min", "speed", 1.0),
    ("min_1", "speed", 1.0),
    ("u_min", "speed", 1.0),
    ("rev_min", "speed", 1.0),
    ("1_s", "speed", 60.0),
    ("rps", "speed", 60.0),
    ("w", "power", 1.0),
    ("watt", "power", 1.0),
    ("watts", "power", 1.0),
    ("kw", "power", 1e3),
    ("hp", "power", 745.699_871_582_270_2),
    ("nm", "torque", 1.0),
    ("nmm", "torque", 1e-3),
    ("ncm", "torque", 1e-2),
    ("knm", "torque", 1e3),
    ("n", "force", 1.0),
    ("kn", "force", 1e3),
    ("lbf", "force", 4.448_221_615_260_5),
    ("a", "current", 1.0),
    ("ma", "current", 1e-3),
    ("percent", "load", 1.0),
    ("pct", "load", 1.0),
    ("deg", "angle", 1.0),
    ("rad", "angle", 180.0 / std::f64::consts::PI),
    ("mm3_s", "removal rate", 1.0),
    ("mm3_min", "removal rate", 1.0 / 60.0),
    ("cm3_min", "removal rate", 1e3 / 60.0),
    ("mm2_s", "contact rate", 1.0),
    ("mm3", "volume", 1.0),
    ("mm2", "area", 1.0),
];

/// What one `from` is in units of `to`, where both are units of a header and measure the same thing.
pub fn header_factor(from: &str, to: &str) -> Option<f64> {
    let find = |name: &str| HEADER_UNITS.iter().find(|(unit, _, _)| *unit == name);
    let ((_, a, from_value), (_, b, to_value)) = (find(from)?, find(to)?);
    (a == b).then_some(from_value / to_value)
}

/// Names of the units that headers may carry, longest first.
pub fn header_units() -> Vec<&'static str> {
    let mut names: Vec<_> = HEADER_UNITS.iter().map(|(name, _, _)| *name).collect();
    names.sort_by_key(|name| std::cmp::Reverse(name.len()));
    names
}

/// mm/min → mm/s.
pub fn mm_s_from_mm_min(feed_mm_min: f64) -> f64 {
    feed_mm_min / 60.0
}

/// mm/s → mm/min.
pub fn mm_min_from_mm_s(feed_mm_s: f64) -> f64 {
    feed_mm_s * 60.0
}

/// rev/min → rev/s.
pub fn rps_from_rpm(rpm: f64) -> f64 {
    rpm / 60.0
}

/// rev/s → rev/min.
pub fn rpm_from_rps(rps: f64) -> f64 {
    rps * 60.0
}

/// N·mm/s (which is mW) → W.
pub fn watts_from_n_mm_s(power_n_mm_s: f64) -> f64 {
    power_n_mm_s * 1e-3
}

/// W → N·mm/s.
pub fn n_mm_s_from_watts(power_w: f64) -> f64 {
    power_w * 1e3
}

/// N·mm → N·m.
pub fn nm_from_nmm(torque_nmm: f64) -> f64 {
    torque_nmm * 1e-3
}

/// N·m → N·mm.
pub fn nmm_from_nm(torque_nm: f64) -> f64 {
    torque_nm * 1e3
}

/// N per lbf.
const N_PER_LBF: f64 = 4.448_221_615_260_5;
/// W per mechanical horsepower.
const W_PER_HP: f64 = 745.699_871_582_270_2;
/// rad per degree.
const RAD_PER_DEG: f64 = std::f64::consts::PI / 180.0;

/// What a quantity of the setup file measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// mm
    Length,
    /// mm/s
    Feed,
    /// mm/s²
    Acceleration,
    /// mm/s³
    Jerk,
    /// N
    Force,
    /// W
    Power,
    /// N·mm
    Torque,
    /// MPa, which is N/mm²
    Stress,
    /// N/mm
    ForcePerLength,
    /// N/s
    ForcePerTime,
    /// rad
    Angle,
    /// rev/s
    Speed,
    /// s
    Time,
    /// A pure number
    Ratio,
}

impl Dimension {
    /// Units it may be written in, squeezed (no spaces, dots or carets, lower case), with the factor to the internal unit.
    pub fn units(self) -> &'static [(&'static str, f64)] {
        const PER_MIN: f64 = 1.0 / 60.0;
        match self {
            Dimension::Length => &[
                ("mm", 1.0),
                ("cm", 10.0),
                ("m", 1e3),
                ("um", 1e-3),
                ("µm", 1e-3),
                ("in", MM_PER_INCH),
                ("inch", MM_PER_INCH),
                ("\"", MM_PER_INCH),
                ("thou", MM_PER_INCH * 1e-3),
            ],
            Dimension::Feed => &[
                ("mm/min", PER_MIN),
                ("mm/s", 1.0),
                ("m/min", 1e3 * PER_MIN),
                ("m/s", 1e3),
                ("in/min", MM_PER_INCH * PER_MIN),
                ("ipm", MM_PER_INCH * PER_MIN),
                ("in/s", MM_PER_INCH),
            ],
            Dimension::Acceleration => {
                &[("mm/s2", 1.0), ("m/s2", 1e3), ("in/s2", MM_PER_INCH), ("g", 9_806.65), ("gn", 9_806.65)]
            }
            Dimension::Jerk => &[("mm/s3", 1.0), ("m/s3", 1e3), ("in/s3", MM_PER_INCH)],
            Dimension::Force => {
                &[("n", 1.0), ("kn", 1e3), ("dan", 10.0), ("lbf", N_PER_LBF), ("lb", N_PER_LBF), ("kgf", 9.806_65)]
            }
            Dimension::Power => &[("w", 1.0), ("kw", 1e3), ("hp", W_PER_HP), ("ps", 735.498_75)],
            Dimension::Torque => &[
                ("nm", 1e3),
                ("nmm", 1.0),
                ("ncm", 10.0),
                ("ftlbf", N_PER_LBF * 12.0 * MM_PER_INCH),
                ("ftlb", N_PER_LBF * 12.0 * MM_PER_INCH),
                ("lbfft", N_PER_LBF * 12.0 * MM_PER_INCH),
                ("lbft", N_PER_LBF * 12.0 * MM_PER_INCH),
                ("inlbf", N_PER_LBF * MM_PER_INCH),
                ("lbfin", N_PER_LBF * MM_PER_INCH),
            ],
            Dimension::Stress => &[
                ("mpa", 1.0),
                ("n/mm2", 1.0),
                ("gpa", 1e3),
                ("psi", N_PER_LBF / (MM_PER_INCH * MM_PER_INCH)),
                ("ksi", 1e3 * N_PER_LBF / (MM_PER_INCH * MM_PER_INCH)),
            ],
            Dimension::ForcePerLength => {
                &[("n/mm", 1.0), ("n/um", 1e3), ("n/µm", 1e3), ("n/m", 1e-3), ("lbf/in", N_PER_LBF / MM_PER_INCH)]
            }
            Dimension::ForcePerTime => &[("n/s", 1.0), ("kn/s", 1e3), ("lbf/s", N_PER_LBF)],
            Dimension::Angle => &[("deg", RAD_PER_DEG), ("°", RAD_PER_DEG), ("rad", 1.0)],
            Dimension::Speed => &[
                ("rpm", PER_MIN),
                ("rev/min", PER_MIN),
                ("1/min", PER_MIN),
                ("/min", PER_MIN),
                ("rev/s", 1.0),
                ("hz", 1.0),
            ],
            Dimension::Time => &[("s", 1.0), ("ms", 1e-3), ("min", 60.0)],
            Dimension::Ratio => &[("", 1.0), ("%", 1e-2)],
        }
    }

    /// The unit it is told in by a report.
    pub fn report_unit(self) -> &'static str {
        match self {
            Dimension::Length => "mm",
            Dimension::Feed => "mm/min",
            Dimension::Acceleration => "mm/s²",
            Dimension::Jerk => "mm/s³",
            Dimension::Force => "N",
            Dimension::Power => "W",
            Dimension::Torque => "N·m",
            Dimension::Stress => "MPa",
            Dimension::ForcePerLength => "N/mm",
            Dimension::ForcePerTime => "N/s",
            Dimension::Angle => "deg",
            Dimension::Speed => "rev/min",
            Dimension::Time => "s",
            Dimension::Ratio => "-",
        }
    }

    /// A value in the unit it is told in.
    pub fn in_report_unit(self, value: f64) -> f64 {
        match self {
            Dimension::Feed => mm_min_from_mm_s(value),
            Dimension::Torque => nm_from_nmm(value),
            Dimension::Angle => deg_from_rad(value),
            Dimension::Speed => rpm_from_rps(value),
            _ => value,
        }
    }

    /// The unit a bare number is in.
    pub fn bare(self, inch: bool) -> &'static str {
        match self {
            Dimension::Length if inch => "in",
            Dimension::Feed if inch => "in/min",
            Dimension::Acceleration if inch => "in/s2",
            Dimension::Jerk if inch => "in/s3",
            _ => self.units()[0].0,
        }
    }

    /// Factor from a unit as written ("ft lbf", "N·m", "mm/s²") to the internal one.
    pub fn factor(self, unit: &str) -> Option<f64> {
        let squeezed: String = unit
            .to_lowercase()
            .chars()
            .filter(|c| !c.is_whitespace() && !"·.*^-".contains(*c))
            .map(|c| match c {
                '²' => '2',
                '³' => '3',
                'μ' => 'µ',
                other => other,
            })
            .collect();
        self.units().iter().find(|(name, _)| *name == squeezed).map(|(_, factor)| *factor)
    }
}

/// rad → degrees.
pub fn deg_from_rad(angle_rad: f64) -> f64 {
    angle_rad / RAD_PER_DEG
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_as_shops_write_them() {
        let torque = Dimension::Torque.factor("ft lbf").unwrap();
        assert!((nm_from_nmm(35.0 * torque) - 47.4537).abs() < 1e-3);
        assert!((Dimension::Power.factor("hp").unwrap() * 6.0 - 4474.2).abs() < 0.1);
        assert!((Dimension::Feed.factor("in/min").unwrap() * 600.0 - 254.0).abs() < 1e-9);
        assert_eq!(Dimension::Acceleration.factor("mm/s²"), Some(1.0));
        assert_eq!(Dimension::Torque.factor("N·m"), Some(1e3));
        assert_eq!(Dimension::Force.factor("W"), None);
    }

    /// A number told in a report may be written into a setup with its unit, or bare.
    #[test]
    fn what_a_report_tells_a_setup_reads() {
        use Dimension::{Acceleration, Angle, Feed, Force, ForcePerLength, ForcePerTime, Jerk, Length};
        use Dimension::{Power, Ratio, Speed, Stress, Time, Torque};
        let all = [Length, Feed, Acceleration, Jerk, Force, Power, Torque, Stress, ForcePerLength];
        for one in all.into_iter().chain([ForcePerTime, Angle, Speed, Time, Ratio]) {
            let told = one.in_report_unit(1.0);
            let unit = if one == Ratio { "" } else { one.report_unit() };
            let factor = one.factor(unit).unwrap();
            assert!((told * factor - 1.0).abs() < 1e-12, "{one:?}: {told} {unit}");
            assert_eq!(one.factor(one.bare(false)), Some(factor), "{one:?}: bare");
        }
    }
}
