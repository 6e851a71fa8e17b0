//! The program as scripts and people run it: each test starts it as a process of its own, in a folder of its
//! own.

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
