//! Tests of the program as a process: each test starts it in a folder of its own.

mod audit;
mod caustics;
mod cli;
#[cfg(target_os = "linux")]
mod memory;
mod outputs;
mod parts;
mod pictures;
#[cfg(unix)]
mod pipes;
mod support;
