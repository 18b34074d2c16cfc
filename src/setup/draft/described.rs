//! A tool as a comment describes it: `T1 D=2 CR=0 - ZMIN=-5.9 - flat end mill`, `1/2 BULL ENDMILL 0.125 RAD`, `10 MM CARBIDE END MILL, 3
//! FLUTES`. In: the description. Out: shape, sizes and teeth; what is concluded rather than said is marked.

use super::figures::{Figure, Role, figures};
use super::header::TOOL_WORDS;
use super::known::{Known, ToolKnown};
use crate::units::MM_PER_INCH;

/// In an inch program a bare number from here on is no diameter, inch: end mills and drills end at 3 in. (Machinery's Handbook,
/// 31st ed., tables of end mills and of straight-shank drills), and whether it is in mm is not guessed.
const LARGEST_INCH: f64 = 4.0;

/// A tool as a comment describes it, lengths in the program's unit.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Told {
    pub number: u32,
    pub shape: Option<&'static str>,
    pub diameter: Option<f64>,
    pub corner: Option<f64>,
    pub point_deg: Option<f64>,
    pub flutes: Option<u32>,
    pub comment: String,
    /// What is concluded rather than said.
    pub guessed: Vec<&'static str>,
}

impl Told {
    /// As keys of `[[tool]]`.
    pub fn known(&self, source: &str) -> ToolKnown {
        let mut tool = ToolKnown { number: Some(self.number), name: self.comment.clone(), ..ToolKnown::default() };
        let mut set = |key: &'static str, value: Option<String>| {
            let Some(value) = value else { return };
            tool.set(key, Known { guessed: self.guessed.contains(&key), ..Known::said(value, source) });
        };
        set("shape", self.shape.map(|shape| format!("\"{shape}\"")));
        set("diameter", self.diameter.map(rounded));
        set("flutes", self.flutes.map(|count| count.to_string()));
        if self.shape == Some("bull") {
            set("corner_radius", self.corner.map(rounded));
        }
        if let (Some("drill" | "chamfer"), Some(angle)) = (self.shape, self.point_deg) {
            // A chamfer mill is described by the angle of its side (TAPER=45DEG), a spot drill and a V-bit by that of their point.
            let side = self.shape == Some("chamfer") && self.comment.contains("TAPER") && angle <= 60.0;
            set("point_angle", Some(rounded(if side { 2.0 * angle } else { angle })));
        }
        tool
    }
}

fn rounded(value: f64) -> String {
    format!("{}", (value * 1e5).round() / 1e5)
}

/// The sizes of a tool in the program's unit. A number that says its unit is converted; a fraction is in inches, as no metric
/// tool is sold by one. Nothing else is guessed: a bare number is in the program's unit, and one that no inch tool has is none.
pub fn told(number: u32, text: &str, inch: bool) -> Told {
    let mut told = Told { number, comment: text.trim().to_owned(), ..Told::default() };
    let mut figures = figures(text);
    if let Some(list) = text.strip_prefix("TOOL/MILL") {
        let sizes: Vec<f64> = list.split(',').filter_map(|part| part.trim().parse().ok()).collect();
        told.diameter = sizes.first().copied();
        told.corner = sizes.get(1).copied();
        figures.clear();
    }
    let thread_mill = text.contains("THREAD");
    let diameters = || figures.iter().filter(|figure| figure.role == Role::Diameter);
    let named = diameters().find(|figure| figure.spelt).or(diameters().next());
    let sized = || {
        let sizes = || figures.iter().filter(|figure| figure.role == Role::Size && !thread_mill);
        sizes().find(|figure| figure.metric.is_some() || figure.fraction).or(sizes().next())
    };
    // `DIA-0.5000 1/2 ENDMILL`: the fraction says that the number is in inches.
    let in_inches = |figure: &Figure| figures.iter().any(|other| other.fraction && other.value == figure.value);
    let metric = |figure: &Figure| figure.metric.or((figure.fraction || in_inches(figure)).then_some(false));
    let length = |figure: &Figure| match (metric(figure), inch) {
        (Some(true), true) => Some(figure.value / MM_PER_INCH),
        (Some(false), false) => Some(figure.value * MM_PER_INCH),
        (None, true) if figure.value >= LARGEST_INCH => None,
        _ => Some(figure.value),
    };
    if let Some(figure) = named.or_else(sized) {
        told.diameter = length(figure).filter(|diameter| *diameter > 0.0);
        // `( T1 : 6.0 )`: a number alone. Beside a word for a mill or a drill (`10. FLAT ENDMILL`) it is what the post calls the tool by.
        let named = TOOL_WORDS.iter().any(|word| text.contains(word));
        if figure.role == Role::Size && metric(figure).is_none() && !named {
            told.guessed.push("diameter");
        }
    }
    let first = |role| figures.iter().find(move |figure| figure.role == role);
    told.corner = told.corner.or(first(Role::Corner).and_then(length));
    told.point_deg = first(Role::Angle).map(|figure| figure.value).filter(|angle| (0.0..180.0).contains(angle));
    told.flutes = first(Role::Flutes).map(|figure| figure.value as u32).filter(|count| (1..100).contains(count));
    told.shape = shape(text, &told);
    if told.shape.is_some() && !TOOL_WORDS.iter().any(|word| text.contains(word)) && !text.starts_with("TOOL/") {
        told.guessed.push("shape");
    }
    told
}

fn shape(text: &str, told: &Told) -> Option<&'static str> {
    const WORDS: [(&str, &str); 31] = [
        ("PROBE", "probe"),
        ("REAM", "reamer"),
        ("SPOT", "chamfer"),
        ("CHAMFER", "chamfer"),
        ("COUNTERSINK", "chamfer"),
        ("SENKER", "chamfer"),
        ("V-BIT", "chamfer"),
        ("VBIT", "chamfer"),
        ("ENGRAV", "chamfer"),
        ("SLOT DRILL", "flat"),
        ("CENTER DRILL", "drill"),
        ("DRILL", "drill"),
        ("BOHRER", "drill"),
        ("TAPPING", "tap"),
        ("RIGHT HAND TAP", "tap"),
        (" TAP ", "tap"),
        ("TAP ", "tap"),
        ("BALL", "ball"),
        ("KUGEL", "ball"),
        ("BULL", "bull"),
        ("FACE MILL", "face"),
        ("FACEMILL", "face"),
        ("SHELL MILL", "face"),
        ("FLAT", "flat"),
        ("END MILL", "flat"),
        ("ENDMILL", "flat"),
        ("FRAESER", "flat"),
        ("FR\u{c4}SER", "flat"),
        ("FR\u{e4}SER", "flat"),
        ("FR\u{c3}", "flat"),
        (" EM", "flat"),
    ];
    if text.contains("THREAD") && text.contains("MILL") {
        return None;
    }
    let by_word =
        WORDS.iter().find(|(word, _)| text.contains(word) || text.ends_with(word.trim_end())).map(|(_, shape)| *shape);
    let by_corner = match (told.corner, told.diameter) {
        (Some(corner), Some(diameter)) if corner > 0.0 && (corner - 0.5 * diameter).abs() < 1e-6 => Some("ball"),
        (Some(corner), Some(_)) if corner > 0.0 => Some("bull"),
        (Some(_), Some(_)) | (None, _) if text.contains("MILL") => Some("flat"),
        (None, Some(_)) if by_word.is_none() && text.len() < 12 => Some("flat"),
        _ => None,
    };
    match by_word {
        Some("flat") => by_corner.or(by_word),
        other => other.or(by_corner),
    }
}
