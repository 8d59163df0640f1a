//! Generators of cameras for the tests of this crate.
