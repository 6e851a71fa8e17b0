//! The path tracer beside Markov chains: it adds its part of the light of each path ([`Split`]). The same
//! paths by mutated numbers, with the other part, are the points of PSSMLT (Kelemen et al. 2002).

use super::numbers::{PathNumbers, PixelNumbers};
use super::shading::{ShadedHit, Shading};
use super::split::{Contribution, Split};
use super::subpath::{Met, PATH_TRACING, Shadows, Subpath, Walk};
use crate::Rgb;
use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::film::{PIXELS_PER_TILE, Pixel, Tile};
use crate::geometry::{Hit, Ray};
use crate::light::EmissionSampler;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::termination::{continuation_probability, is_cut};
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
    walk: Walk<'a, F>,
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
        let walk = Walk { counts: PATH_TRACING, ..Walk::new(context, emission, [width, height]) };
        Self { walk, split, max_depth, seed }
    }

    /// Working memory of a task.
    pub fn scratch() -> Footprint {
        Footprint::default()
            .slice::<Path>(PIXELS_PER_TILE)
            .slice::<Ray>(PIXELS_PER_TILE)
            .slice::<Hit>(PIXELS_PER_TILE)
            .and(shadows_footprint(PIXELS_PER_TILE))
    }

    /// Adds `samples` of tile `tile` to its pixels `out`, each with the light of `splats`, those of the
    /// tile's pixels.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`Paths::scratch`].
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
        let mut shadows = shadows(PIXELS_PER_TILE, &mut arena)?;
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
        shadows: &mut Shadows,
        numbers: impl Fn(&Path, u32) -> N,
        part: Part,
        counters: &mut Counters,
    ) {
        let mut active = count;
        let mut shading = Shading::new();
        let mut coherence = if part == Part::Paths { Coherence::Coherent } else { Coherence::Incoherent };
        while active > 0 {
            counters.rays += active as u64;
            self.walk.context.nearest_batch(&rays[..active], coherence, &mut hits[..active]);
            coherence = Coherence::Incoherent;
            let mut left = 0;
            for i in 0..active {
                let vertex = |tag: u32| {
                    let path = paths.get(tag as usize)?;
                    let segments = path.subpath.segments;
                    (segments < self.max_depth).then(|| (segments, numbers(path, tag).vertex(segments)))
                };
                let traced = (&rays[..active], &hits[..active]);
                let met = shading.hit(&self.walk.context, traced, i, vertex);
                let (ray, hit) = (rays[i], hits[i]);
                let Some(path) = paths.get_mut(ray.tag as usize) else { continue };
                let numbers = numbers(path, ray.tag);
                let end = (&ray, &hit, met);
                if let Some(next) = self.step(path, &numbers, end, shadows, part, counters) {
                    rays[left] = Ray { tag: ray.tag, ..next };
                    left += 1;
                }
            }
            active = left;
            shadows.trace(&self.walk.context, counters, |ray, light| {
                if let Some(path) = paths.get_mut(ray.tag as usize) {
                    path.add(light);
                }
            });
        }
    }

    /// The part of a contribution of a path of `segments` segments that is added up.
    fn part(&self, path: &Path, segments: u32, part: Part, contribution: &Contribution) -> Rgb {
        // Roulette is no property of the path: the division does not know it.
        let alone = Contribution { radiance: contribution.radiance * path.survival, ..*contribution };
        let of_paths = self.split.of_paths(path.pixel, segments, &alone);
        contribution.radiance * if part == Part::Paths { of_paths } else { 1.0 - of_paths }
    }

    /// One vertex of a path. The ray by which the path goes on.
    fn step(
        &self,
        path: &mut Path,
        numbers: &impl PathNumbers,
        (ray, hit, shaded): (&Ray, &Hit, ShadedHit),
        shadows: &mut Shadows,
        part: Part,
        counters: &mut Counters,
    ) -> Option<Ray> {
        let direction = Vec3::from(ray.direction);
        let segments = path.subpath.segments;
        let opacity = |n| numbers.opacity(n);
        let met = (ray, hit, shaded.met);
        let point = match self.walk.meet(&mut path.subpath, met, true, opacity, counters) {
            Met::Surface(point) => point,
            Met::Passed(next) => return Some(next),
            Met::Lost => return None,
            Met::Nothing => {
                let seen = self.walk.escape(&path.subpath, direction)?;
                path.add(self.part(path, segments, part, &seen));
                return None;
            }
        };
        if let Some(seen) = self.walk.emission(&path.subpath, &point, direction) {
            path.add(self.part(path, segments, part, &seen));
        }
        if segments >= self.max_depth {
            return None;
        }
        let scene = self.walk.context.scene;
        let surface = (point, shaded.bsdf::<F>(scene));
        let vertex = self.walk.camera_vertex(&path.subpath, surface, direction, [0.5; 2]);
        let sample = || self.walk.sample_light(&vertex, numbers.light(segments));
        if !vertex.bsdf.is_delta()
            && let Some(lit) = shaded.lit(&self.walk.context, sample)
            && let Some((shadow, arrives)) = self.walk.light_sample(&path.subpath, &vertex, lit)
        {
            shadows.push(ray.tag, shadow, self.part(path, segments + 1, part, &arrives));
        }
        let sample = shaded.scattered(|| vertex.bsdf.sample::<F>(vertex.wo, numbers.scattering(segments)))?;
        let next = self.walk.scatter(&mut path.subpath, &vertex, false, &sample)?;
        path.eta_squared *= sample.eta * sample.eta;
        let throughput = Rgb::from(path.subpath.throughput);
        let probability = continuation_probability(segments, throughput * path.eta_squared);
        if probability < 1.0 {
            if numbers.roulette(segments) >= probability {
                return None;
            }
            path.subpath.throughput = (throughput / probability).to_array();
            path.survival *= probability;
        }
        if is_cut(segments, &vertex.bsdf, &sample) {
            counters.dropped.unfinished += 1;
            return None;
        }
        Some(next)
    }
}

/// Memory of shadow rays that are traced together.
pub(super) fn shadows_footprint(count: usize) -> Footprint {
    Footprint::default().slice::<Ray>(count).slice::<[f32; 3]>(count).slice::<Hit>(count).slice::<u8>(count)
}

/// Shadow rays in `arena`.
pub(super) fn shadows<'w>(count: usize, arena: &mut Arena<'w>) -> Result<Shadows<'w>, OutOfMemory> {
    let rays = ShadowRays {
        rays: arena.slice(count)?,
        light: arena.slice(count)?,
        hits: arena.slice(count)?,
        hidden: arena.slice(count)?,
    };
    Ok(Shadows { rays, count: 0 })
}
