//! M codes whose meaning is known: none of them moves the part or changes a frame. The others may be macros of the machine
//! builder or of the shop (Fanuc parameters 6071 to 6089 and LinuxCNC's M100 to M199 call programs).
//!
//! Sources: Haas Mill Operator's Manual, list of M-codes; LinuxCNC 2.9, "M-Codes"; Siemens 840D Programming Guide
//! Fundamentals, predefined M functions; HEIDENHAIN TNC 640 Klartext manual, overview of miscellaneous functions.

use crate::nc::dialect::Dialect;

/// Does this M code (times ten) leave part and frame alone on these controls? M0 and M60 are events of their own.
pub(super) fn known_m(dialect: Dialect, code: u16) -> bool {
    // M0–M9; clamps of rotary axes, spindle with coolant, orientation, ends; calls and returns.
    let everywhere = matches!(code / 10, 0..=11 | 13 | 14 | 19 | 30 | 48 | 49 | 60 | 97..=99);
    let own = match dialect {
        // Overrides, tool number, digital and analog outputs, wait for an input, saving the state.
        Dialect::LinuxCnc | Dialect::Grbl => matches!(code / 10, 50..=53 | 61..=68 | 70),
        // End of a subprogram, gear steps.
        Dialect::Siemens => matches!(code / 10, 17 | 40..=45 | 70),
        // Machine coordinates, contour behaviour, feed at arcs, tool tip, retract.
        Dialect::Heidenhain => {
            matches!(code / 10, 90..=92 | 101..=103 | 107..=118 | 120 | 124 | 126..=129 | 136..=138 | 140 | 141 | 145 | 148 | 149)
        }
        // Rigid tapping, chip conveyor, coolant, gears, air blast, door, graphics, through-spindle coolant, mist, call.
        Dialect::Generic | Dialect::Fanuc | Dialect::Haas => {
            matches!(code / 10, 12 | 29 | 31 | 33..=35 | 40..=45 | 73 | 74 | 80 | 81 | 83 | 84 | 88 | 89 | 135 | 138 | 139 | 158 | 159 | 198)
        }
    };
    code.is_multiple_of(10) && (everywhere || own)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn user_macros_and_pallets_are_not_known() {
        for (dialect, known, unknown) in [
            (Dialect::LinuxCnc, 640, 1010),
            (Dialect::Haas, 880, 500),
            (Dialect::Fanuc, 290, 770),
            (Dialect::Siemens, 410, 210),
            (Dialect::Heidenhain, 1400, 500),
        ] {
            assert!(known_m(dialect, known) && !known_m(dialect, unknown), "{dialect:?}");
            assert!(Dialect::ALL.into_iter().all(|dialect| known_m(dialect, 60)), "M6");
        }
        assert!(!known_m(Dialect::Generic, 61), "M6.1");
    }
}
