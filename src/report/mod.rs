//! JSON, CSV, tables and pictures of a finished run.
