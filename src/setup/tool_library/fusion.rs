//! Tool libraries of Fusion and HSMWorks: `.json`, and `.tools`, a zip with `tools.json` in it. In: bytes. Out: tools.
//!
//! An entry has `type`, `unit` ("millimeters" or "inches", each tool its own), `description`, `BMC` (material of the body), `geometry`
//! (DC diameter, NOF teeth, LCF length of the flutes, LB length below the holder, SFDM shank, RE corner radius, SIG angle of the point,
//! TA angle of the taper), `holder.segments`, and the T word in `post-process.number`.

use super::{Library, Unreadable, length};
use crate::setup::draft::{Known, ToolKnown};
use serde_json::Value;
use std::io::Read;

/// Types of entries and their shapes.
const TYPES: [(&str, &str); 17] = [
    ("flat end mill", "flat"),
    ("slot mill", "flat"),
    ("ball end mill", "ball"),
    ("bull nose end mill", "bull"),
    ("face mill", "face"),
    ("tapered mill", "taper"),
    ("chamfer mill", "chamfer"),
    ("spot drill", "chamfer"),
    ("center drill", "drill"),
    ("counter sink", "chamfer"),
    ("engrave mill", "chamfer"),
    ("drill", "drill"),
    ("reamer", "reamer"),
    ("probe", "probe"),
    ("tap right hand", "tap"),
    ("tap left hand", "tap"),
    ("holder probe", "probe"),
];

/// Most that an unpacked library may take, bytes: a thousand tools are 5 MB.
const LARGEST: u64 = 256 << 20;

/// From `.tools`.
pub fn from_zip(bytes: &[u8], name: &str) -> Result<Library, Unreadable> {
    let help = "export the library from Fusion again, as .tools or .json";
    let unreadable = |why: String| Unreadable::new(format!("{name} is not a library of Fusion: {why}"), help);
    let mut archive =
        zip::ZipArchive::new(std::io::Cursor::new(bytes)).map_err(|error| unreadable(error.to_string()))?;
    let mut names = archive.file_names().flatten().map(|name| name.to_string());
    let inside = names.find(|name| name.to_lowercase().ends_with(".json"));
    drop(names);
    let inside = inside.ok_or_else(|| unreadable("there is no .json in it".into()))?;
    let file = archive.by_name(&inside).map_err(|error| unreadable(error.to_string()))?;
    let mut json = Vec::new();
    file.take(LARGEST + 1).read_to_end(&mut json).map_err(|error| unreadable(error.to_string()))?;
    if json.len() as u64 > LARGEST {
        return Err(unreadable(format!("the .json in it is larger than {} MiB", LARGEST >> 20)));
    }
    from_json(&json, name)
}

/// From `.json`.
pub fn from_json(bytes: &[u8], name: &str) -> Result<Library, Unreadable> {
    let help = "give the library as Fusion exports it";
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let value: Value =
        serde_json::from_slice(text).map_err(|error| Unreadable::new(format!("{name} is not JSON: {error}"), help))?;
    let entries = value.get("data").unwrap_or(&value).as_array();
    let entries = entries.ok_or_else(|| Unreadable::new(format!("{name} has no list `data` of tools"), help))?;
    let mut library = Library::default();
    for (index, entry) in entries.iter().enumerate() {
        match tool(entry, name) {
            Ok(tool) => library.tools.push(tool),
            Err(why) => library.notes.push(format!("entry {} is left out: {why}", index + 1)),
        }
    }
    Ok(library)
}

fn tool(entry: &Value, source: &str) -> Result<ToolKnown, String> {
    let text = |key: &str| entry.get(key).and_then(Value::as_str);
    let kind = text("type").ok_or("it has no type")?;
    if kind == "holder" {
        return Err("it is a holder alone".into());
    }
    let shape = TYPES.iter().find(|(name, _)| *name == kind).map(|(_, shape)| *shape);
    let inch = match text("unit") {
        Some("millimeters" | "mm") => false,
        Some("inches" | "inch" | "in") => true,
        other => return Err(format!("its unit is not stated ({})", other.unwrap_or("no `unit`"))),
    };
    let geometry = entry.get("geometry");
    let number = |key: &str| geometry?.get(key)?.as_f64().filter(|value| value.is_finite() && *value > 0.0);
    let sized = |key: &str| number(key).map(|value| length(value, inch));
    let called = text("description").filter(|words| !words.is_empty()).unwrap_or(kind);
    let mut tool = ToolKnown {
        number: entry.get("post-process").and_then(|post| post.get("number")?.as_u64()).map(|number| number as u32),
        name: called.trim().to_owned(),
        ..ToolKnown::default()
    };
    let mut set = |key: &'static str, value: Option<String>| {
        if let Some(value) = value {
            tool.set(key, Known::said(value, source));
        }
    };
    set("shape", shape.map(|shape| format!("\"{shape}\"")));
    set("diameter", sized("DC"));
    set("flutes", number("NOF").map(|count| (count as u32).to_string()));
    if shape == Some("bull") {
        set("corner_radius", sized("RE"));
    }
    if matches!(shape, Some("drill" | "chamfer")) {
        // A chamfer mill states the angle of its side, a drill that of its whole point.
        set("point_angle", number("SIG").or(number("TA").map(|side| 2.0 * side)).map(|angle| angle.to_string()));
    }
    if shape == Some("taper") {
        set("taper_angle", number("TA").map(|angle| angle.to_string()));
    }
    set("flute_length", sized("LCF"));
    set("overhang", sized("LB"));
    set("shank_diameter", sized("SFDM"));
    set("material", body(text("BMC").unwrap_or_default()).map(|name| format!("\"{name}\"")));
    set("holder", entry.get("holder").and_then(|holder| segments(holder, inch)));
    Ok(tool)
}

/// Material of the cutter's body; what is neither is not guessed.
fn body(name: &str) -> Option<&'static str> {
    match name.to_lowercase().as_str() {
        "carbide" => Some("carbide"),
        "hss" => Some("hss"),
        _ => None,
    }
}

/// Segments of a holder from the spindle downwards as rings [diameter, length] from the collet face up; a cone counts with its wider end.
fn segments(holder: &Value, inch: bool) -> Option<String> {
    let inch = match holder.get("unit").and_then(Value::as_str) {
        Some("millimeters") => false,
        Some("inches") => true,
        _ => inch,
    };
    let rings = holder.get("segments")?.as_array()?.iter().map(|segment| {
        let of = |key: &str| segment.get(key).and_then(Value::as_f64);
        let widest = of("lower-diameter")?.max(of("upper-diameter")?);
        let height = of("height").filter(|height| *height > 0.0)?;
        Some(format!("[{}, {}]", length(widest, inch), length(height, inch)))
    });
    let rings: Option<Vec<String>> = rings.collect();
    rings.filter(|rings| !rings.is_empty()).map(|rings| format!("[{}]", rings.join(", ")))
}
