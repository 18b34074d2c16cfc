//! What an effect changes. In: filled by the law of an effect ([`super::Effect::change`]). Out: applied by the room on which the effect
//! acts: `force/modifiers.rs` (loads), `job/learned.rs` (geometry and motion), `learn/model/design.rs` (readings).

/// What an effect changes in one cut. [`Change::default`] changes nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// Factor on the tare.
    pub tare: f64,
    /// Factor on the cutting coefficients.
    pub cutting: f64,
    /// Factor on the edge coefficients.
    pub edge: f64,
    /// Added to the chip thickness of the most loaded tooth (peaks only), mm.
    pub peak_chip_mm: f64,
    /// Offset of the tool's axis from that of the spindle, mm.
    pub runout_mm: f64,
    /// Direction of this offset as a share of the tooth pitch: 0 … 1 from one tooth to the next.
    pub runout_phase: f64,
    /// Stock stands higher by this, mm.
    pub stock_top_mm: f64,
    /// Stock stands out to the sides by this, mm.
    pub stock_side_mm: f64,
    /// The faces towards −x, +x, −y, +y stand out further by this each, mm.
    pub stock_faces_mm: [f64; 4],
    /// Stock is turned counter-clockwise about its middle by this, rad.
    pub stock_turn_rad: f64,
    /// Tool is larger by this, mm of diameter.
    pub diameter_mm: f64,
    /// Acceleration of the machine over the declared one.
    pub acceleration: f64,
    /// Relative excess of the reading at the reference load P_max.
    pub reading_excess: f64,
    /// Exponent p with which this excess grows with the load, (P/P_max)^p.
    pub reading_exponent: f64,
    /// Time constant of the reading, s.
    pub lag_s: f64,
    /// Geometry of the curved path instead of the straight one: 0 no … 1 yes.
    pub curved: f64,
}

impl Default for Change {
    fn default() -> Self {
        Self {
            tare: 1.0,
            cutting: 1.0,
            edge: 1.0,
            peak_chip_mm: 0.0,
            runout_mm: 0.0,
            runout_phase: 0.0,
            stock_top_mm: 0.0,
            stock_side_mm: 0.0,
            stock_faces_mm: [0.0; 4],
            stock_turn_rad: 0.0,
            diameter_mm: 0.0,
            acceleration: 1.0,
            reading_excess: 0.0,
            reading_exponent: 1.0,
            lag_s: 0.0,
            curved: 0.0,
        }
    }
}
