//! Kernels of `halflight bench` against other libraries in one run, alternating by repetition: `rivals rays
//! SCENE`, `rivals eigen`, `rivals knn`. Each library is a feature: `embree`, `nalgebra`, `kiddo`,
//! `nanoflann`.
#![forbid(unsafe_code)]

mod eigen;
#[cfg(feature = "embree")]
mod embree;
#[cfg(feature = "kiddo")]
mod kiddo;
mod knn;
#[cfg(feature = "nalgebra")]
mod nalgebra;
#[cfg(feature = "nanoflann")]
mod nanoflann;
#[cfg(feature = "embree")]
mod packets;
mod rays;

use clap::Parser;
use core::error::Error;
use halflight_simd::{Level, Tier};

/// Measure the kernels and the libraries that this program was built with, in turn, on one thread
#[derive(Parser)]
enum Rivals {
    /// Rays per second beside Embree
    Rays(Box<rays::Rays>),
    /// Eigen decompositions per second beside nalgebra
    Eigen(eigen::Eigen),
    /// Searches of the photon map per second beside kiddo and nanoflann
    Knn(knn::Knn),
}

fn main() -> Result<(), Box<dyn Error>> {
    let lines = match Rivals::parse() {
        Rivals::Rays(rays) => rays.run()?,
        Rivals::Eigen(eigen) => eigen.run(),
        Rivals::Knn(knn) => knn.run()?,
    };
    println!("{}", lines.join("\n"));
    Ok(())
}

/// The processor's instruction set, at most `simd`.
fn level(simd: Option<Tier>) -> Level {
    let level = Level::detect();
    simd.map_or(level, |tier| level.capped(tier))
}

fn tier(name: &str) -> Result<Tier, String> {
    Tier::named(name).ok_or("the levels are baseline, avx2, avx512".into())
}

/// One line of a table.
fn row(name: &str, cells: impl IntoIterator<Item = String>) -> String {
    cells.into_iter().fold(format!("{name:<18}"), |line, cell| line + &format!("{cell:>12}"))
}
