//! The only unit conversions. Inside the library: mm, s, N, N·mm, W, rad, mm/s, rev/s.

/// Millimetres in one inch.
pub const MM_PER_INCH: f64 = 25.4;

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
