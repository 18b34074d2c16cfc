//! Schedule → edits → bytes, and the proof that only feeds changed.
