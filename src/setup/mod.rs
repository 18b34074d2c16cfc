//! Setup file, built-in library, JSON Schema (serde lives at this rim).
