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
    /// Its top rises by this towards +x and +y, mm/mm; its height at the zero point is that of `stock_top_mm`.
    pub stock_slope: [f64; 2],
    /// Tool is larger by this, mm of diameter.
    pub diameter_mm: f64,
    /// Acceleration of the machine over the declared one.
    pub acceleration: f64,
    /// Excess of the reading over the load.
    pub excess: Excess,
    /// Time constant of the reading, s.
    pub lag_s: f64,
    /// Geometry of the curved path instead of the straight one: 0 no … 1 yes.
    pub curved: f64,
}

/// Relative excess of a reading over its load P: c·(P/P₁)^p, P₁ being the full load; c for any load where no full load is known. There is
/// none below 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Excess {
    /// c.
    pub at_full: f64,
    /// p.
    pub exponent: f64,
    /// P₁ of readings of a power or of a relative load, W or their unit; 0: not known.
    pub full_power: f64,
    /// P₁ of readings of a torque, N·m; 0: not known.
    pub full_torque_nm: f64,
}

impl Default for Excess {
    fn default() -> Self {
        Self { at_full: 0.0, exponent: 1.0, full_power: 0.0, full_torque_nm: 0.0 }
    }
}

impl Excess {
    /// P₁ in the unit of the readings from which it was learned; `None`: it is not known.
    pub fn full(&self) -> Option<f64> {
        [self.full_power, self.full_torque_nm].into_iter().find(|full| *full > 0.0)
    }

    /// The excess of a load in that unit.
    pub fn of(&self, load: f64) -> f64 {
        match self.full() {
            _ if self.at_full == 0.0 || load <= 0.0 => 0.0,
            Some(full) => self.at_full * (load / full).powf(self.exponent),
            None => self.at_full,
        }
    }

    /// The reading of a load, and its slope over the load.
    pub fn reading_and_slope(&self, load: f64) -> [f64; 2] {
        let of = self.of(load);
        let exponent = if self.full().is_some() { self.exponent } else { 0.0 };
        [load * (1.0 + of), 1.0 + (1.0 + exponent) * of]
    }

    /// Slope of the reading over the load.
    pub fn slope(&self, load: f64) -> f64 {
        self.reading_and_slope(load)[1]
    }
}

impl Change {
    /// By how much the stock is higher at a place, mm.
    pub fn stock_top_at_mm(&self, x_mm: f64, y_mm: f64) -> f64 {
        let [along_x, along_y] = self.stock_slope;
        self.stock_top_mm + along_x * x_mm + along_y * y_mm
    }
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
            stock_slope: [0.0; 2],
            diameter_mm: 0.0,
            acceleration: 1.0,
            excess: Excess::default(),
            lag_s: 0.0,
            curved: 0.0,
        }
    }
}
