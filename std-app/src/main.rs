//! The command line. See `halflight --help`.
#![forbid(unsafe_code)]

fn main() {}
