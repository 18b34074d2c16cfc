//! Tool bits (`.fctb`) and libraries (`.fctl`) of FreeCAD. In: bytes. Out: tools.
//!
//! A bit has `name`, `shape` ("endmill.fcstd" …, or `shape-type`), `parameter` and `attribute` with values like "6.00 mm" or "1/4\"". Its
//! T word stands in the library that lists it: `tools [{nr, path}]`.

use super::{Library, Unreadable, length};
use crate::setup::draft::{Known, ToolKnown};
use serde_json::Value;

/// Words in the name of a shape file and our shapes, the more particular first.
const SHAPES: [(&str, &str); 12] = [
    ("ballend", "ball"),
    ("bullnose", "bull"),
    ("torus", "bull"),
    ("taperedball", "taper"),
    ("tapered", "taper"),
    ("endmill", "flat"),
    ("drill", "drill"),
    ("chamfer", "chamfer"),
    ("v-bit", "chamfer"),
    ("vbit", "chamfer"),
    ("probe", "probe"),
    ("tap", "tap"),
];

/// A library and the bits it lists, each read beside it.
pub fn library(bytes: &[u8], name: &str, beside: &dyn Fn(&str) -> Option<Vec<u8>>) -> Result<Library, Unreadable> {
    let value = json(bytes, name)?;
    let listed = value.get("tools").and_then(Value::as_array);
    let listed = listed.ok_or_else(|| {
        Unreadable::new(format!("{name} has no list `tools`"), "give the .fctl of a library of FreeCAD")
    })?;
    let mut library = Library::default();
    for entry in listed {
        let Some(path) = entry.get("path").and_then(Value::as_str) else { continue };
        let Some(bytes) = beside(path) else {
            library.notes.push(format!("{path} is not beside {name}"));
            continue;
        };
        match bit(&bytes, path) {
            Ok(found) => library.tools.extend(found.tools.into_iter().map(|tool| ToolKnown {
                number: entry.get("nr").and_then(Value::as_u64).map(|number| number as u32),
                ..tool
            })),
            Err(error) => library.notes.push(error.text),
        }
    }
    Ok(library)
}

/// One bit; it has no number of its own.
pub fn bit(bytes: &[u8], name: &str) -> Result<Library, Unreadable> {
    let value = json(bytes, name)?;
    let value_of = |key: &str| ["parameter", "attribute"].iter().find_map(|group| value.get(group)?.get(key));
    let parameter = |key: &str| value_of(key).map(as_text);
    let sized = |key: &str| parameter(key).and_then(|text| in_unit(&text)).filter(|(size, _)| *size > 0.0);
    let text = |key: &str| value.get(key).and_then(Value::as_str).unwrap_or_default().to_lowercase();
    let (file, kind) = (text("shape"), text("shape-type"));
    let shape = SHAPES.iter().find(|(word, _)| file.contains(word) || kind.contains(word)).map(|(_, shape)| *shape);
    if file.is_empty() && kind.is_empty() {
        return Err(Unreadable::new(format!("{name} is no tool bit of FreeCAD: it has no `shape`"), "give a .fctb"));
    }
    let called = value.get("name").and_then(Value::as_str).unwrap_or(name);
    let mut tool = ToolKnown { name: called.to_owned(), ..ToolKnown::default() };
    let mut set = |key: &'static str, value: Option<String>| {
        if let Some(value) = value {
            tool.set(key, Known::said(value, name));
        }
    };
    let told = |key: &str| sized(key).map(|(size, inch)| length(size, inch));
    let angle = |key: &str| parameter(key)?.split([' ', '\u{b0}']).next()?.parse::<f64>().ok();
    set("shape", shape.map(|shape| format!("\"{shape}\"")));
    set("diameter", told("Diameter"));
    let flutes = parameter("Flutes").and_then(|text| text.trim().parse::<u32>().ok()).filter(|count| *count > 0);
    set("flutes", flutes.map(|count| count.to_string()));
    if shape == Some("bull") {
        let flat = sized("Diameter").zip(sized("FlatRadius"));
        let corner = flat.filter(|(d, f)| d.1 == f.1).map(|(d, f)| length(0.5 * d.0 - f.0, d.1));
        set("corner_radius", told("CornerRadius").or_else(|| told("TorusRadius")).or(corner));
    }
    let point = angle("TipAngle").or_else(|| angle("CuttingEdgeAngle")).filter(|angle| *angle > 0.0);
    match shape {
        Some("drill" | "chamfer") => set("point_angle", point.map(|angle| angle.to_string())),
        Some("taper") => set("taper_angle", point.map(|angle| (0.5 * angle).to_string())),
        _ => {}
    }
    set("tip_diameter", told("TipDiameter").filter(|_| matches!(shape, Some("chamfer" | "taper"))));
    set("flute_length", told("CuttingEdgeHeight"));
    set("shank_diameter", told("ShankDiameter"));
    let body = parameter("Material").map(|text| text.to_lowercase());
    let body = body.and_then(|text| ["carbide", "hss"].into_iter().find(|known| text.contains(known)));
    set("material", body.map(|name| format!("\"{name}\"")));
    Ok(Library { tools: vec![tool], notes: Vec::new() })
}

fn json(bytes: &[u8], name: &str) -> Result<Value, Unreadable> {
    serde_json::from_slice(bytes)
        .map_err(|error| Unreadable::new(format!("{name} is not JSON: {error}"), "give the file as FreeCAD writes it"))
}

fn as_text(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// `6.0000 mm`, `0.25 in`, `0.25"`: size, and whether it is in inches; a number without a unit is nothing.
fn in_unit(text: &str) -> Option<(f64, bool)> {
    let text = text.trim();
    let end = text.find(|c: char| !c.is_ascii_digit() && !".-".contains(c)).unwrap_or(text.len());
    let value: f64 = text[..end].parse().ok()?;
    match text[end..].trim() {
        "mm" => Some((value, false)),
        "cm" => Some((10.0 * value, false)),
        "in" | "\"" | "inch" => Some((value, true)),
        _ => None,
    }
}
