//! The workpiece: height field with provenance.
