//! Tests of the program as a process, each in a folder of its own, and of the library by its public
//! functions.

mod audit;
mod bake;
mod caustics;
mod cli;
mod compare;
mod crop;
mod fair_schedule;
mod layers;
mod lightmaps;
mod live;
mod loading;
#[cfg(target_os = "linux")]
mod memory;
mod names;
mod outputs;
mod parts;
mod picture_files;
mod pictures;
#[cfg(unix)]
mod pipes;
mod probes;
#[cfg(target_os = "linux")]
mod process;
mod reconstruction;
mod renderer;
mod seams;
mod sky;
mod support;
