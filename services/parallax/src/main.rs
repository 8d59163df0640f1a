//! Entry point: parse the command line, then become what it names.
#![forbid(unsafe_code)]

mod deployment;

fn main() {}
