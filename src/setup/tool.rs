//! `[[tool]]`. In: this table of the setup. Out: [`Tool`]. What every catalogue states (number, shape, diameter, flutes) is required; the rest has
//! defaults, each recorded as an assumption.

use super::file::{RunoutTable, ToolTable, ToolWearTable};
use super::forms::NameOr;
use super::library;
use super::limits::limits;
use super::material::{material, named_material};
use super::outline::{self, Sizes};
use super::quantity::Quantity;
use super::read::{Reader, Sense};
use crate::effects::wear::RATE_SCATTER;
use crate::machine::{Profile, Runout, Shape, Tool, ToolWear, WearRate};
use crate::units::{Dimension, deg_from_rad};

const SHAPES: [(&str, Shape); 12] = [
    ("flat", Shape::Flat),
    ("ball", Shape::Ball),
    ("bull", Shape::Bull),
    ("taper", Shape::Taper),
    ("drill", Shape::Drill),
    ("chamfer", Shape::Chamfer),
    ("face", Shape::Face),
    ("high-feed", Shape::HighFeed),
    ("profile", Shape::Profile),
    ("tap", Shape::Tap),
    ("reamer", Shape::Reamer),
    ("probe", Shape::Probe),
];

/// Is it a shape that a setup may name?
pub fn is_shape(word: &str) -> bool {
    SHAPES.iter().any(|(name, _)| *name == word)
}

/// One tool, or `None` when it has no number.
pub fn tool(reader: &mut Reader, table: &ToolTable, position: usize) -> Option<Tool> {
    let Some(number) = table.number else {
        reader.missing(
            &format!("tool[{}].number", position + 1),
            "write the number of its T word (0 when the program calls none)",
        );
        return None;
    };
    let name = format!("tool[T{number}]");
    let key = |what: &str| format!("{name}.{what}");
    let shape = shape(reader, &key("shape"), table.shape.as_deref())?;
    let diameter_mm = diameter(reader, &key("diameter"), table);
    let (length, positive) = (Dimension::Length, Sense::Positive);
    let reaches = table.overhang.as_ref().map(|written| reader.value(&key("overhang"), written, length, positive));
    // No longer than the tool reaches out of its holder: face mills and profile cutters are short.
    let usual = rounded(3.0 * diameter_mm).min(reaches.unwrap_or(f64::INFINITY));
    let flute_length_mm = reader.or(&key("flute_length"), table.flute_length.as_ref(), length, positive, usual);
    let overhang_mm = overhang(reader, &key("overhang"), reaches, flute_length_mm, diameter_mm);
    let flutes = flutes(reader, &key("flutes"), table.flutes, shape);
    Some(Tool {
        number,
        shape,
        profile: profile(reader, &name, table, shape, diameter_mm, flute_length_mm),
        diameter_mm,
        flutes,
        helix_rad: helix(reader, &key("helix"), table, shape),
        pitch_rad: pitch(reader, &key("pitch"), table.pitch.as_deref(), flutes),
        rake_rad: rake(reader, &key("rake"), table.rake.as_ref()),
        flute_length_mm,
        flute_length_given: table.flute_length.is_some(),
        overhang_mm,
        shank_diameter_mm: reader.or(
            &key("shank_diameter"),
            table.shank_diameter.as_ref(),
            Dimension::Length,
            Sense::Positive,
            rounded(diameter_mm),
        ),
        runout: table.runout.as_ref().map(|written| runout(reader, &key("runout"), written, diameter_mm)),
        youngs_modulus_mpa: youngs_modulus(reader, &name, table),
        allowable_stress_mpa: allowable_stress(table),
        holder_stiffness_n_mm: reader.optional(
            &key("holder_stiffness"),
            table.holder_stiffness.as_ref(),
            Dimension::ForcePerLength,
            Sense::Positive,
        ),
        holder: table.holder.as_deref().map_or_else(Vec::new, |rings| holder(reader, &key("holder"), rings)),
        centre_cutting: table.centre_cutting.unwrap_or(!matches!(shape, Shape::Face | Shape::HighFeed)),
        coefficients: match &table.coefficients {
            Some(NameOr::Name(wanted)) => named_material(reader, &key("coefficients"), wanted),
            Some(NameOr::Table(written)) => Some(material(reader, &key("coefficients"), written)),
            None => None,
        },
        limits: table.limits.as_ref().map(|l| limits(reader, &key("limits"), l)).unwrap_or_default(),
        wear: table.wear.as_ref().map(|written| wear(reader, &key("wear"), written)),
    })
}

fn wear(reader: &mut Reader, key: &str, written: &ToolWearTable) -> ToolWear {
    let at = |what: &str| format!("{key}.{what}");
    let share = Sense::Within(-1e-9, 1.0, "a relative standard deviation from tool to tool, like 0.2");
    let rate = wear_rate(reader, key, written);
    if rate.is_some() && written.end.is_none() {
        reader.missing(&at("end"), "the index of wear at which the tool is changed");
    }
    ToolWear {
        rate,
        end: reader.optional(&at("end"), written.end.as_ref(), Dimension::Ratio, Sense::Positive),
        rate_scatter: reader.or(
            &at("rate_scatter"),
            written.rate_scatter.as_ref(),
            Dimension::Ratio,
            share,
            RATE_SCATTER,
        ),
        end_scatter: reader.or(
            &at("end_scatter"),
            written.end_scatter.as_ref(),
            Dimension::Ratio,
            Sense::NotNegative,
            0.0,
        ),
        index: reader.optional(&at("index"), written.index.as_ref(), Dimension::Ratio, Sense::Positive),
    }
}

/// Rate, its feed and its power: all three or none.
fn wear_rate(reader: &mut Reader, key: &str, written: &ToolWearTable) -> Option<WearRate> {
    let at = |what: &str| format!("{key}.{what}");
    let power =
        Sense::Within(-1.001, 2.001, "from -1 (the way the teeth slide) to 2; above 0 a slower feed spares the edge");
    let three = [("rate", &written.rate), ("feed_per_tooth", &written.feed_per_tooth), ("exponent", &written.exponent)];
    if three.iter().all(|(_, value)| value.is_none()) {
        return None;
    }
    for (name, _) in three.iter().filter(|(_, value)| value.is_none()) {
        let help = "give rate, feed_per_tooth and exponent together; or leave all three out to use the process model";
        reader.missing(&at(name), help);
    }
    let per_m = reader.value(&at("rate"), written.rate.as_ref()?, Dimension::Ratio, Sense::Positive);
    let feed_mm =
        reader.value(&at("feed_per_tooth"), written.feed_per_tooth.as_ref()?, Dimension::Length, Sense::Positive);
    let exponent = reader.value(&at("exponent"), written.exponent.as_ref()?, Dimension::Ratio, power);
    Some(WearRate::along_path(1e-3 * per_m, feed_mm, exponent))
}

fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

fn shape(reader: &mut Reader, key: &str, word: Option<&str>) -> Option<Shape> {
    if let Some(word) = word {
        return reader.choice(key, word, &SHAPES);
    }
    let names: Vec<_> = SHAPES.iter().map(|(name, _)| *name).collect();
    reader.missing(key, format!("one of {}", names.join(", ")));
    None
}

/// Wider than any cutter, mm: the largest face mills and fly cutters have about a metre; a larger number is a slip or a wrong unit, and
/// would take hours to simulate.
const WIDEST_MM: f64 = 2000.0;

fn diameter(reader: &mut Reader, key: &str, table: &ToolTable) -> f64 {
    if let Some(written) = &table.diameter {
        let wide = Sense::Within(0.0, WIDEST_MM, "it is more than zero, and no mill turns a cutter of 2 m (80 in)");
        return reader.value(key, written, Dimension::Length, wide).max(1e-3);
    }
    reader.missing(key, "write the widest diameter of its cutting part");
    1.0
}

fn overhang(reader: &mut Reader, key: &str, written: Option<f64>, flute_length_mm: f64, diameter_mm: f64) -> f64 {
    let default = rounded(flute_length_mm + diameter_mm);
    let overhang = written.unwrap_or_else(|| reader.or(key, None, Dimension::Length, Sense::Positive, default));
    if overhang < flute_length_mm - 1e-9 {
        reader.complain(
            key,
            "the tool reaches less far out of its holder than its flutes are long",
            "it counts from the tip to the holder",
        );
    }
    overhang
}

fn flutes(reader: &mut Reader, key: &str, written: Option<u32>, shape: Shape) -> u32 {
    let cuts = !matches!(shape, Shape::Tap | Shape::Reamer | Shape::Probe);
    match written {
        Some(0) if cuts => reader.complain(key, "a tool without teeth cuts nothing", "count its teeth"),
        Some(count) if count > 200 => reader.complain(key, format!("{count} teeth make no sense"), "count its teeth"),
        None if cuts && shape == Shape::Drill => reader.assume(key, "2", "default"),
        None if cuts => reader.missing(key, "count its teeth: the chip thickness hangs on it"),
        _ => {}
    }
    written.unwrap_or(2).clamp(1, 200)
}

fn helix(reader: &mut Reader, key: &str, table: &ToolTable, shape: Shape) -> f64 {
    let default = if matches!(shape, Shape::Flat | Shape::Ball | Shape::Bull | Shape::Drill) { 30.0 } else { 0.0 };
    let limit = 80f64.to_radians();
    reader.or(
        key,
        table.helix.as_ref(),
        Dimension::Angle,
        Sense::Within(-limit, limit, "a helix lies between -80 and 80 deg; 30 is usual"),
        default,
    )
}

fn rake(reader: &mut Reader, key: &str, written: Option<&Quantity>) -> f64 {
    let limit = 60f64.to_radians();
    let sense = Sense::Within(-limit, limit, "a rake lies between -60 and 60 deg");
    written.map_or(0.0, |written| reader.value(key, written, Dimension::Angle, sense))
}

fn pitch(reader: &mut Reader, key: &str, written: Option<&[Quantity]>, flutes: u32) -> Vec<f64> {
    let Some(written) = written else { return Vec::new() };
    let angles: Vec<f64> = written.iter().map(|a| reader.value(key, a, Dimension::Angle, Sense::Positive)).collect();
    let sum = deg_from_rad(angles.iter().sum());
    if angles.len() != flutes as usize || (sum - 360.0).abs() > 0.1 {
        reader.complain(
            key,
            format!("{} angles sum to {sum:.1} deg", angles.len()),
            format!("give {flutes} angles that sum to 360 deg"),
        );
    }
    angles
}

fn runout(reader: &mut Reader, key: &str, written: &RunoutTable, diameter_mm: f64) -> Runout {
    let sense = Sense::Within(-1e-12, 0.5 * diameter_mm, "it is the offset of the axis: some hundredths of a mm");
    let offset_mm = reader.value(&format!("{key}.offset"), &written.offset, Dimension::Length, sense);
    let angle_rad = reader.or(&format!("{key}.angle"), written.angle.as_ref(), Dimension::Angle, Sense::Any, 0.0);
    Runout { offset_mm, angle_rad }
}

fn youngs_modulus(reader: &mut Reader, name: &str, table: &ToolTable) -> f64 {
    if let Some(written) = &table.youngs_modulus {
        return reader.value(&format!("{name}.youngs_modulus"), written, Dimension::Stress, Sense::Positive);
    }
    let key = format!("{name}.material");
    let entries = library::tool_materials();
    let Some(word) = &table.material else {
        reader.assume(&key, &entries[0].name, "default");
        return entries[0].youngs_modulus_mpa;
    };
    let known: Vec<(&str, f64)> = entries.iter().map(|entry| (entry.name.as_str(), entry.youngs_modulus_mpa)).collect();
    reader.choice(&key, word, &known).unwrap_or(known[0].1)
}

/// Of the material that the setup names; a Young's modulus alone does not say what breaks.
fn allowable_stress(table: &ToolTable) -> Option<f64> {
    let word = table.material.as_ref()?;
    library::tool_materials().iter().find(|entry| entry.name == *word).map(|entry| entry.bending_stress_mpa)
}

fn holder(reader: &mut Reader, key: &str, rings: &[[Quantity; 2]]) -> Vec<(f64, f64)> {
    let mut length = |q: &Quantity| reader.value(key, q, Dimension::Length, Sense::Positive);
    rings.iter().map(|[diameter, along]| (length(diameter), length(along))).collect()
}

fn profile(
    reader: &mut Reader,
    name: &str,
    table: &ToolTable,
    shape: Shape,
    diameter_mm: f64,
    length_mm: f64,
) -> Profile {
    let mut size = |what: &str, written: Option<&Quantity>, dimension| {
        reader.optional(&format!("{name}.{what}"), written, dimension, Sense::NotNegative)
    };
    let sizes = Sizes {
        diameter_mm,
        length_mm,
        corner_mm: size("corner_radius", table.corner_radius.as_ref(), Dimension::Length),
        insert_mm: size("insert_radius", table.insert_radius.as_ref(), Dimension::Length),
        tip_mm: size("tip_diameter", table.tip_diameter.as_ref(), Dimension::Length),
        point_rad: size("point_angle", table.point_angle.as_ref(), Dimension::Angle),
        taper_rad: size("taper_angle", table.taper_angle.as_ref(), Dimension::Angle),
        lead_rad: size("lead_angle", table.lead_angle.as_ref(), Dimension::Angle),
    };
    match (shape, &table.profile) {
        (Shape::Profile, Some(points)) => outline::written(reader, &format!("{name}.profile"), points),
        (Shape::Profile, None) => {
            reader
                .missing(&format!("{name}.profile"), "points [radius, height] from the axis at the tip outward and up");
            Profile::flat(diameter_mm, length_mm)
        }
        _ => outline::of_shape(reader, name, shape, &sizes),
    }
}
