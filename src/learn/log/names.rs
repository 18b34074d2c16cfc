//! Names of columns. In: a header as written in a file. Out: words joined by `_`, their quantity and unit.

use crate::units::header_units;

/// Other names of quantities: (theirs, ours).
const ALIASES: &[(&str, &str)] = &[
    ("power", "spindle_power"),
    ("pm", "spindle_power"),
    ("torque", "spindle_torque"),
    ("current", "spindle_current"),
    ("load", "spindle_load"),
    ("spindle_speed", "spindle"),
    ("rotary_velocity", "spindle"),
    ("s", "spindle"),
    ("n", "spindle"),
    ("timestamp", "time"),
    ("t", "time"),
    ("feedrate", "feed"),
    ("feed_rate", "feed"),
    ("path_feedrate", "feed"),
    ("ft", "feed_per_tooth"),
    ("fz", "feed_per_tooth"),
    ("ap", "axial_depth"),
    ("da", "axial_depth"),
    ("axial", "axial_depth"),
    ("depth_of_cut", "axial_depth"),
    ("ae", "radial_depth"),
    ("rd", "radial_depth"),
    ("dw", "radial_depth"),
    ("radial", "radial_depth"),
    ("width_of_cut", "radial_depth"),
    ("tz", "layer_height"),
    ("qdot", "removal_rate"),
    ("adot", "contact_rate"),
    ("cutting_strategy", "side"),
    ("cut", "side"),
    ("tool_number", "tool"),
    ("fx", "force_x"),
    ("fy", "force_y"),
    ("fz_force", "force_z"),
    ("fxy", "force_xy"),
    ("line_number", "line"),
    ("block_number", "block"),
];

/// Does a name given to `--columns` mean this header, as written in the file or as printed in messages?
pub fn same(given: &str, header: &str) -> bool {
    given == header || plain(given) == plain(header)
}

/// Lower case, words joined by one `_`.
pub fn plain(name: &str) -> String {
    let spaced: String = name
        .to_lowercase()
        .replace('%', " percent ")
        .replace('µ', "u")
        .replace('³', "3")
        .replace('²', "2")
        .replace('¹', "1");
    let words: Vec<&str> =
        spaced.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty() && *w != "per").collect();
    words.join("_").replace("feed_tooth", "feed_per_tooth")
}

/// (quantity, unit) of a header.
pub fn quantity(name: &str) -> (String, Option<&'static str>) {
    let unit = header_units().into_iter().find(|unit| name.strip_suffix(unit).is_some_and(|head| head.ends_with('_')));
    let base = unit.map_or(name, |u| &name[..name.len() - u.len() - 1]);
    let alias = ALIASES.iter().find(|(theirs, _)| *theirs == base).map_or(base, |(_, ours)| ours);
    (alias.to_owned(), unit)
}

/// Readings a second that a counter of them has in its name, `sample_1000hz`.
pub fn counter_hz(name: &str) -> Option<f64> {
    let rate = name.strip_prefix("sample_")?.strip_suffix("hz")?.replace('_', ".");
    rate.parse().ok().filter(|hz: &f64| *hz > 0.0 && hz.is_finite())
}

/// Is a header a short or foreign name of a quantity (`t` for the time)? The full name goes before it.
pub fn is_alias(name: &str) -> bool {
    let (base, unit) = quantity(name);
    unit.map_or(name != base, |unit| *name != format!("{base}_{unit}"))
}

/// Our columns: (quantity, column).
pub const OURS: [(&str, &str); 25] = [
    ("time", "time_s"),
    ("x", "x_mm"),
    ("y", "y_mm"),
    ("z", "z_mm"),
    ("line", "line"),
    ("block", "block"),
    ("feed", "feed_mm_min"),
    ("feed_override", "feed_override_percent"),
    ("spindle", "spindle_rpm"),
    ("spindle_angle", "spindle_angle_deg"),
    ("tool", "tool"),
    ("spindle_power", "spindle_power_w"),
    ("spindle_torque", "spindle_torque_nm"),
    ("spindle_current", "spindle_current_a"),
    ("spindle_load", "spindle_load_percent"),
    ("x_load", "x_load_percent"),
    ("y_load", "y_load_percent"),
    ("z_load", "z_load_percent"),
    ("force_x", "force_x_n"),
    ("force_y", "force_y_n"),
    ("force_z", "force_z_n"),
    ("force_xy", "force_xy_n"),
    ("group", "group"),
    ("order", "order"),
    ("side", "side"),
];

/// Is the quantity of a header one of ours?
pub fn is_ours(header: &str) -> bool {
    let base = quantity(&plain(header)).0;
    OURS.iter().any(|(own, _)| *own == base) || counter_hz(&plain(header)).is_some()
}
