//! Our ray tracer in the benchmark.

use super::classes::Class;
use super::measure::{BATCH, Entry};
use halflight::pages::Pages;
use halflight_core::Level;
use halflight_core::bvh::{Bvh, Coherence, Serial};
use halflight_core::geometry::{Hit, Ray};
use halflight_core::memory::{Arena, OutOfMemory};
use halflight_core::scene::Mesh;

/// BVH as in a render: built in new memory, copied to `kept`; the memory of the build is freed.
pub(super) fn build<'m>(mesh: &Mesh, level: Level, kept: &'m mut Pages) -> Result<Bvh<'m>, OutOfMemory> {
    let mut working = Pages::new(Bvh::footprint_of(mesh))?;
    let mut arena = Arena::over(&mut working);
    let built = Bvh::build_with(mesh, &mut arena, level, &Serial)?;
    *kept = Pages::new(built.used())?;
    built.copied(&mut Arena::over(kept))
}

/// Our function for rays of `class`.
pub(super) fn entry<'a>(bvh: &'a Bvh<'a>, level: Level, class: Class) -> Box<dyn Entry + 'a> {
    let rays = Vec::with_capacity(BATCH);
    match class {
        Class::Primary => {
            Box::new(Nearest { bvh, level, coherence: Coherence::Coherent, rays, hits: Vec::new() })
        }
        Class::Diffuse => {
            Box::new(Nearest { bvh, level, coherence: Coherence::Incoherent, rays, hits: Vec::new() })
        }
        Class::Shadow => Box::new(Occluded { bvh, level, rays, occluded: Vec::new() }),
    }
}

struct Nearest<'a> {
    bvh: &'a Bvh<'a>,
    level: Level,
    coherence: Coherence,
    rays: Vec<Ray>,
    hits: Vec<Hit>,
}

impl Entry for Nearest<'_> {
    fn name(&self) -> &'static str {
        "nearest_batch"
    }

    fn load(&mut self, rays: &[Ray]) {
        self.rays.clear();
        self.rays.extend_from_slice(rays);
        self.hits.clear();
        self.hits.resize(rays.len(), Hit::NONE);
    }

    fn trace(&mut self) {
        self.bvh.nearest_batch(self.level, &self.rays, self.coherence, &mut self.hits);
    }

    fn hits(&self) -> usize {
        self.hits.iter().filter(|hit| hit.is_some()).count()
    }
}

struct Occluded<'a> {
    bvh: &'a Bvh<'a>,
    level: Level,
    rays: Vec<Ray>,
    occluded: Vec<u8>,
}

impl Entry for Occluded<'_> {
    fn name(&self) -> &'static str {
        "occluded_batch"
    }

    fn load(&mut self, rays: &[Ray]) {
        self.rays.clear();
        self.rays.extend_from_slice(rays);
        self.occluded.clear();
        self.occluded.resize(rays.len(), 0);
    }

    fn trace(&mut self) {
        self.bvh.occluded_batch(self.level, &self.rays, &mut self.occluded);
    }

    fn hits(&self) -> usize {
        self.occluded.iter().filter(|&&occluded| occluded != 0).count()
    }
}
