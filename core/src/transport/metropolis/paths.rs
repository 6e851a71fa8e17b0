//! The path tracer beside Markov chains: it adds its part of the light of each path ([`Split`]). The same
//! paths by mutated numbers, with the other part, are the points of PSSMLT (Kelemen et al. 2002).

use super::numbers::{PathNumbers, PixelNumbers};
use super::split::Split;
use crate::Rgb;
use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::film::{PIXELS_PER_TILE, Pixel, Tile};
use crate::geometry::{Hit, Ray};
use crate::light::EmissionSampler;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::shading::{ShadedHit, Shading};
use crate::transport::walk::subpath::{Subpath, Walk};
use crate::transport::walk::techniques::Weighted;
use crate::transport::walk::vertex::Scatterer;
use crate::transport::walk::visibility::ShadowRays;
use bytemuck::{Pod, Zeroable};
use core::ops::Range;
use glam::{Vec2, Vec3};

/// A path between two of its vertices.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Path {
    subpath: Subpath,
    /// Light of the part that is asked for.
    pub radiance: [f32; 3],
    /// Position of the pixel in the film.
    pub pixel: u32,
    /// Product of the squared relative indices of refraction.
    eta_squared: f32,
    /// Probability with which roulette has let the path come so far.
    survival: f32,
}

impl Path {
    fn add(&mut self, radiance: Rgb) {
        if radiance.is_finite() {
            self.radiance = (Rgb::from(self.radiance) + radiance).to_array();
        }
    }
}

/// The part of a path's light that is added up.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// That of path tracing.
    Paths,
    /// That of chains.
    Chains,
}

/// Traces whole paths.
#[derive(Clone, Copy)]
pub struct Paths<'a, F> {
    pub(super) walk: Walk<'a, F>,
    split: Split<'a>,
    max_depth: u32,
    seed: u32,
}

impl<'a, F: Features> Paths<'a, F> {
    /// Paths of a picture by `settings`, whose light is divided by `split`.
    pub fn new(
        context: SceneContext<'a, F>,
        emission: &'a EmissionSampler<'a>,
        settings: PathSettings,
        split: Split<'a>,
    ) -> Self {
        let PathSettings { width, height, seed, max_depth } = settings;
        let counts = split.counts(width as f32 * height as f32);
        let walk = Walk { context, emission, size: [width, height], counts };
        Self { walk, split, max_depth, seed }
    }

    /// Working memory of a task.
    pub fn scratch() -> Footprint {
        Footprint::default()
            .slice::<Path>(PIXELS_PER_TILE)
            .slice::<Ray>(PIXELS_PER_TILE)
            .slice::<Hit>(PIXELS_PER_TILE)
            .and(ShadowRays::footprint(PIXELS_PER_TILE))
    }

    /// Adds `samples` of tile `tile` to its pixels `out`, each with the light of `splats`, those of the
    /// tile's pixels.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`Paths::scratch`].
    #[inline(never)]
    pub fn run(
        &self,
        tile: usize,
        samples: Range<u32>,
        splats: &[[f32; 3]],
        scratch: &mut Arena,
        out: &mut [Pixel],
    ) -> Result<Counters, OutOfMemory> {
        let mut arena = scratch.scratch();
        let paths: &mut [Path] = arena.slice(PIXELS_PER_TILE)?;
        let rays: &mut [Ray] = arena.slice(PIXELS_PER_TILE)?;
        let hits: &mut [Hit] = arena.slice(PIXELS_PER_TILE)?;
        let mut shadows = ShadowRays::new(PIXELS_PER_TILE, &mut arena)?;
        let [width, height] = self.walk.size;
        let corner = tile * PIXELS_PER_TILE;
        let tile = Tile::new(width, height, tile);
        let mut counters = Counters::default();
        for sample in samples {
            let sampler = |x, y| PixelNumbers::new(self.seed, y * width + x, sample);
            let mut count = 0;
            for place in 0..PIXELS_PER_TILE {
                let Some((x, y)) = tile.pixel(place) else { continue };
                let numbers = sampler(x, y);
                let raster = Vec2::new(x as f32, y as f32) + Vec2::from(numbers.pixel());
                (paths[count], rays[count]) = self.start((corner + place) as u32, raster, &numbers);
                rays[count].tag = count as u32;
                count += 1;
            }
            counters.paths += count as u64;
            let numbers = |path: &Path, _| {
                let (x, y) = tile.pixel(path.pixel as usize - corner).unwrap_or_default();
                sampler(x, y)
            };
            let memory = (&mut *paths, &mut *rays, &mut *hits);
            self.trace(memory, count, &mut shadows, numbers, Part::Paths, &mut counters);
            for path in &paths[..count] {
                let place = path.pixel as usize - corner;
                let splat = splats.get(place).copied().unwrap_or_default();
                if let Some(pixel) = out.get_mut(place) {
                    let radiance = Rgb::from(path.radiance) + Rgb::from(splat);
                    pixel.add(sample, radiance, &mut counters.dropped);
                }
            }
        }
        Ok(counters)
    }

    /// The path through `raster`, and its first ray.
    pub(super) fn start(&self, pixel: u32, raster: Vec2, numbers: &impl PathNumbers) -> (Path, Ray) {
        let (subpath, ray) = self.walk.start_at_camera(raster, numbers.lens());
        (Path { subpath, pixel, eta_squared: 1.0, survival: 1.0, ..Path::default() }, ray)
    }

    /// Advances the first `count` paths, whose rays have their numbers as tags, until none is left.
    pub(super) fn trace<N: PathNumbers>(
        &self,
        (paths, rays, hits): (&mut [Path], &mut [Ray], &mut [Hit]),
        count: usize,
        shadows: &mut ShadowRays,
        numbers: impl Fn(&Path, u32) -> N,
        part: Part,
        counters: &mut Counters,
    ) {
        let (context, mut active) = (&self.walk.context, count);
        let mut shading = Shading::new();
        let mut coherence = if part == Part::Paths { Coherence::Coherent } else { Coherence::Incoherent };
        while active > 0 {
            let vertex = |paths: &[Path], tag: u32| {
                let path = paths.get(tag as usize)?;
                let segments = path.subpath.segments;
                (segments < self.max_depth).then(|| (segments, numbers(path, tag).vertex(segments)))
            };
            let traced = (&mut rays[..active], &mut hits[..active], coherence);
            active = shading.advance(context, traced, counters, paths, vertex, |paths, _, end, counters| {
                let path = paths.get_mut(end.0.tag as usize)?;
                let numbers = numbers(path, end.0.tag);
                self.step(path, &numbers, end, shadows, part, counters)
            });
            coherence = Coherence::Incoherent;
            shadows.trace(context, counters, |ray, light| {
                if let Some(path) = paths.get_mut(ray.tag as usize) {
                    path.add(light);
                }
            });
        }
    }

    /// The part of the `light` of a path of `segments` segments that is added up.
    fn part(&self, path: &Path, segments: u32, part: Part, light: &Weighted) -> Rgb {
        // Roulette is no property of the path: the division does not know it.
        let alone = Weighted { radiance: light.radiance * path.survival, ..*light };
        let of_paths = self.split.of_paths(path.pixel, segments, &alone);
        // The light by path tracing alone, of which the weight among all techniques is a share.
        light.radiance / light.by_paths * if part == Part::Paths { of_paths } else { 1.0 - of_paths }
    }

    /// One vertex of a path. The ray by which the path goes on.
    fn step(
        &self,
        path: &mut Path,
        numbers: &impl PathNumbers,
        (ray, hit, shaded): (&Ray, &Hit, ShadedHit),
        shadows: &mut ShadowRays,
        part: Part,
        counters: &mut Counters,
    ) -> Option<Ray> {
        let Self { walk, .. } = self;
        let direction = Vec3::from(ray.direction);
        let segments = path.subpath.segments;
        if !hit.is_some() {
            let seen = walk.escape(&path.subpath, direction)?;
            path.add(self.part(path, segments, part, &seen));
            return None;
        }
        let point = shaded.met.point()?;
        let (met, opacity) = ((ray, hit, &point), |surfaces| numbers.opacity(surfaces));
        if let Err(behind) = walk.stop(&mut path.subpath, met, true, opacity, counters) {
            return behind;
        }
        if let Some(seen) = walk.emission(&path.subpath, &point, direction) {
            path.add(self.part(path, segments, part, &seen));
        }
        if segments >= self.max_depth {
            return None;
        }
        let bsdf = shaded.bsdf::<F>(walk.context.scene);
        let at = Scatterer { point: &point, bsdf: &bsdf };
        let vertex = walk.camera_vertex(&path.subpath, at, direction, [0.5; 2]);
        let sample = || walk.sample_light(&vertex, numbers.light(segments));
        if !bsdf.is_delta()
            && let Some(lit) = shaded.lit(&walk.context, sample)
        {
            let arrives = walk.light_sample(&path.subpath, &vertex, &lit);
            if arrives.is_some() {
                let light = self.part(path, segments + 1, part, &arrives);
                shadows.push(Ray { tag: ray.tag, ..lit.ray }, light);
            }
        }
        let sample = shaded.scattered(|| bsdf.sample::<F>(vertex.wo, numbers.scattering(segments)))?;
        let at = (&path.subpath, path.eta_squared);
        let (next, survival) = walk.next(at, &vertex, sample, || numbers.roulette(segments))?;
        path.survival *= survival;
        walk.go_on((&mut path.subpath, &mut path.eta_squared), &vertex, &next, None, counters)
    }
}
