//! Rays per second on one thread, for camera rays, diffuse bounces and shadow rays, and the time to
//! build the BVH.
//!
//! Each library is timed [`REPETITIONS`] times in turn by the wall clock, so other load of the machine
//! affects both; the median is reported. Rays come in batches. The conversion of a batch to a library's
//! format is not timed.

mod classes;
mod ours;
mod report;

pub use classes::{Class, SIZE};
pub use report::{ClassReport, RaysReport, RivalClass, RivalReport};

use super::{BenchError, REPETITIONS, median};
use crate::pages::Pages;
use classes::Rays;
use core::hint::black_box;
use halflight_core::Level;
use halflight_core::geometry::Ray;
use halflight_core::scene::{Mesh, Scene};
use std::time::Instant;

/// Rays per batch: the wavefront of a tile.
pub const BATCH: usize = 65536;

/// Function of a library that traces rays.
pub trait Entry {
    /// Name of the function.
    fn name(&self) -> &'static str;
    /// Converts the next rays; not timed.
    fn load(&mut self, rays: &[Ray]);
    /// Traces the rays.
    fn trace(&mut self);
    /// Number of rays with a hit.
    fn hits(&self) -> usize;
}

/// Ray tracer of another library.
pub trait Rival {
    /// Name and version.
    fn name(&self) -> String;
    /// Builds a new hierarchy.
    ///
    /// # Errors
    /// [`BenchError::Rival`] if it refuses the mesh.
    fn build(&mut self, mesh: &Mesh) -> Result<(), BenchError>;
    /// All functions for rays of `class`.
    fn entries(&self, class: Class) -> Vec<Box<dyn Entry + '_>>;
}

/// Measures `scene` from its camera with the kernels of `level`; `size` is the picture's width and height.
///
/// # Errors
/// [`BenchError`] without memory.
pub fn run(scene: &Scene, level: Level, size: [u32; 2]) -> Result<RaysReport, BenchError> {
    Ok(run_with_rival(scene, level, size, None)?.0)
}

/// [`run`] with a rival, measured in turn.
///
/// # Errors
/// [`BenchError`] without memory, or if the rival refuses the mesh.
pub fn run_with_rival(
    scene: &Scene,
    level: Level,
    size: [u32; 2],
    mut rival: Option<&mut dyn Rival>,
) -> Result<(RaysReport, Option<RivalReport>), BenchError> {
    let mesh = &scene.mesh;
    let (mut build, mut rival_build) = (Vec::new(), Vec::new());
    for _ in 0..REPETITIONS {
        let mut memory = Pages::default();
        let start = Instant::now();
        black_box(ours::build(mesh, level, &mut memory)?);
        build.push(start.elapsed().as_secs_f64());
        if let Some(rival) = &mut rival {
            let start = Instant::now();
            rival.build(mesh)?;
            rival_build.push(start.elapsed().as_secs_f64());
        }
    }

    let mut memory = Pages::default();
    let bvh = ours::build(mesh, level, &mut memory)?;
    let rays = Rays::of(scene, &bvh, level, size)?;
    let mut classes = Vec::new();
    let mut rival_classes = Vec::new();
    for class in Class::ALL {
        let mut entries = vec![ours::entry(&bvh, level, class)];
        entries.extend(rival.iter().flat_map(|rival| rival.entries(class)));
        let measured = measure(&mut entries, rays.of_class(class));
        if let Some((ours, theirs)) = measured.split_first() {
            classes.push(ClassReport {
                class,
                rays: rays.of_class(class).len(),
                hits: ours.hits,
                mrays_per_second: ours.mrays_per_second,
            });
            rival_classes.push(theirs.to_vec());
        }
    }
    let report = RaysReport {
        level,
        size,
        triangles: mesh.triangles.len(),
        build_seconds: median(build),
        bytes: bvh.used().bytes(),
        classes,
    };
    let theirs = rival.map(|rival| RivalReport {
        name: rival.name(),
        build_seconds: median(rival_build),
        classes: rival_classes,
    });
    Ok((report, theirs))
}

/// Speeds of all entries for `rays`, measured in turn.
fn measure(entries: &mut [Box<dyn Entry + '_>], rays: &[Ray]) -> Vec<RivalClass> {
    let mut seconds = vec![Vec::new(); entries.len()];
    let mut hits = vec![0; entries.len()];
    for _ in 0..REPETITIONS {
        for (i, entry) in entries.iter_mut().enumerate() {
            let (mut sum, mut batch_hits) = (0.0, 0);
            for batch in rays.chunks(BATCH) {
                entry.load(batch);
                let start = Instant::now();
                entry.trace();
                sum += start.elapsed().as_secs_f64();
                batch_hits += entry.hits();
            }
            seconds[i].push(sum);
            hits[i] = batch_hits;
        }
    }
    let mut measured = Vec::new();
    for ((entry, seconds), hits) in entries.iter().zip(seconds).zip(hits) {
        let mrays_per_second = rays.len() as f64 / median(seconds) * 1e-6;
        measured.push(RivalClass { entry: entry.name(), hits, mrays_per_second });
    }
    measured
}

#[cfg(test)]
mod tests;
