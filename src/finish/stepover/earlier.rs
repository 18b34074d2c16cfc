//! Thickness of the stock that an earlier program left. In: its height field, a contact on the surface. Out: thickness
//! along the normal there.
//!
//! With H the height of the stock, the thickness t solves H(c + t·n) = (c + t·n)_z, by Newton steps with the slope of
//! the surface instead of that of the stock (exact if the two are parallel).

use super::drop::Contact;
use crate::path::Vec3;
use crate::stock::{Piece, Relief};

/// Newton steps.
const STEPS: usize = 12;

/// Heights of stock in a frame rotated about Z.
pub struct Earlier {
    relief: Relief,
    /// Sine and cosine of the angle from the frame to the stock.
    turn: [f64; 2],
}

impl Earlier {
    /// The stock in a frame rotated by `angle_rad` from its own.
    pub fn new(piece: &Piece, angle_rad: f64) -> Self {
        let (sin, cos) = angle_rad.sin_cos();
        Self { relief: Relief::new(&piece.field), turn: [sin, cos] }
    }

    /// Thickness on the surface at a contact, mm, at most `most_mm`; 0 without stock.
    pub fn thickness_mm(&self, contact: &Contact, most_mm: f64) -> f64 {
        let [sin, cos] = self.turn;
        let mut t = 0.0f64;
        for _ in 0..STEPS {
            let at: Vec3 = contact.point + t * contact.normal;
            let over = self.relief.surface(cos * at.x - sin * at.y, sin * at.x + cos * at.y) - at.z;
            if over == f64::NEG_INFINITY {
                return 0.0;
            }
            t = (t + over * contact.normal.z).clamp(0.0, most_mm);
        }
        t
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Box3;
    use crate::stock::Blank;

    /// Stock 0.3 mm thick on a slope of 30 degrees, in a frame rotated by 90 degrees.
    #[test]
    fn thickness_is_measured_along_the_normal() {
        let (sin, cos) = 30f64.to_radians().sin_cos();
        let extent = Box3 { min: Vec3::new(0.0, 0.0, -10.0), max: Vec3::new(10.0, 10.0, 10.0) };
        let height = |k: usize| ((0.1 * (k % 100) as f64 + 0.05) * sin / cos + 0.3 / cos) as f32;
        let relief = Relief::from_rows(extent, [100, 100], (0..10_000).map(height).collect());
        let piece = Piece::uncut(Blank::Heights(Box::new(relief)), 0.1);
        let earlier = Earlier::new(&piece, std::f64::consts::FRAC_PI_2);
        let contact = |z: f64| Contact {
            tip_mm: 0.0,
            // X 5, Y 4 of the stock.
            point: Vec3::new(4.0, -5.0, 5.0 * sin / cos + z),
            normal: Vec3::new(0.0, sin, cos),
            triangle: 0,
            rim: false,
        };
        assert!((earlier.thickness_mm(&contact(0.0), 3.0) - 0.3).abs() < 1e-5);
        assert!(earlier.thickness_mm(&contact(1.0), 3.0) == 0.0);
        assert!((earlier.thickness_mm(&contact(-9.0), 3.0) - 3.0).abs() < 1e-12);
    }
}
