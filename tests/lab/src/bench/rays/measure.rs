//! Times of builds and rays, ours and those of another library in turn. Rays come in batches; the conversion
//! of a batch to a library's format is not timed.

use super::classes::{Class, Rays};
use super::ours;
use super::report::{ClassReport, EntryReport, Report, RivalReport};
use crate::Result;
use crate::bench::{REPETITIONS, median};
use core::hint::black_box;
use halflight::pages::Pages;
use halflight_core::Level;
use halflight_core::geometry::Ray;
use halflight_core::scene::{Mesh, Scene};
use std::time::Instant;

/// Rays per batch: the wavefront of a tile.
pub(super) const BATCH: usize = 65536;

/// Function of a library that traces rays.
pub(super) trait Entry {
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
pub(super) trait Rival {
    /// Name and version.
    fn name(&self) -> String;
    /// Builds a new hierarchy.
    fn build(&mut self, mesh: &Mesh) -> Result<()>;
    /// All functions for rays of `class`.
    fn entries(&self, class: Class) -> Vec<Box<dyn Entry + '_>>;
}

/// Measures `scene` from its camera with the kernels of `level` and the library that the program is built
/// with; `size` is the picture's width and height.
pub(super) fn measure(scene: &Scene, level: Level, size: [u32; 2]) -> Result<Report> {
    let rivals: Vec<Box<dyn Rival>> = vec![
        #[cfg(feature = "embree")]
        Box::new(super::embree::Embree::new()?),
    ];
    measure_beside(scene, level, size, rivals)
}

fn measure_beside(
    scene: &Scene,
    level: Level,
    size: [u32; 2],
    mut rivals: Vec<Box<dyn Rival>>,
) -> Result<Report> {
    let mesh = &scene.mesh;
    let (mut build, mut rival_builds) = (Vec::new(), vec![Vec::new(); rivals.len()]);
    for _ in 0..REPETITIONS {
        let mut memory = Pages::default();
        let start = Instant::now();
        black_box(ours::build(mesh, level, &mut memory)?);
        build.push(start.elapsed().as_secs_f64());
        for (rival, builds) in rivals.iter_mut().zip(&mut rival_builds) {
            let start = Instant::now();
            rival.build(mesh)?;
            builds.push(start.elapsed().as_secs_f64());
        }
    }

    let mut memory = Pages::default();
    let bvh = ours::build(mesh, level, &mut memory)?;
    let rays = Rays::of(scene, &bvh, level, size)?;
    let reports = rivals.iter().zip(rival_builds).map(|(rival, builds)| RivalReport {
        name: rival.name(),
        build_seconds: median(builds),
        classes: Vec::new(),
    });
    let (mut classes, mut reports) = (Vec::new(), reports.collect::<Vec<_>>());
    for class in Class::ALL {
        let mut entries = vec![ours::entry(&bvh, level, class)];
        let mut counts = Vec::new();
        for rival in &rivals {
            let theirs = rival.entries(class);
            counts.push(theirs.len());
            entries.extend(theirs);
        }
        let mut measured = traced(&mut entries, rays.of_class(class)).into_iter();
        let Some(EntryReport { hits, mrays_per_second, .. }) = measured.next() else { continue };
        classes.push(ClassReport { class, rays: rays.of_class(class).len(), hits, mrays_per_second });
        for (report, count) in reports.iter_mut().zip(counts) {
            report.classes.push(measured.by_ref().take(count).collect());
        }
    }
    Ok(Report {
        level,
        size,
        triangles: mesh.triangles.len(),
        build_seconds: median(build),
        bytes: bvh.used().bytes(),
        classes,
        rivals: reports,
    })
}

/// Speeds of all entries for `rays`, measured in turn.
fn traced(entries: &mut [Box<dyn Entry + '_>], rays: &[Ray]) -> Vec<EntryReport> {
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
        measured.push(EntryReport { entry: entry.name(), hits, mrays_per_second });
    }
    measured
}
