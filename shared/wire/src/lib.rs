//! Messages to domain types and back, each direction checked.
#![forbid(unsafe_code)]
