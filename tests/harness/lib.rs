//! Starts services as real processes and stops them again.
