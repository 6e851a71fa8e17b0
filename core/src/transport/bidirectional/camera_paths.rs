//! Camera paths of a tile: path tracing whose vertices are connected to stored light vertices as well (Veach
//! 1997, section 10.2; light vertex cache of Davidovič et al. 2014). All paths of a sample advance together,
//! so that the tracer sees batches of rays.

use crate::Rgb;
use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::film::{PIXELS_PER_TILE, Pixel, Tile};
use crate::geometry::{Hit, Ray};
use crate::light::EmissionSampler;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::Sampler;
use crate::transport::bidirectional::camera_path::{CameraPath, CameraVertex, Queue, Recorder};
use crate::transport::bidirectional::contribution::{Class, Contribution};
use crate::transport::bidirectional::merge_photons::Merging;
use crate::transport::bidirectional::vertex::LightVertex;
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::dimension;
use crate::transport::walk::shading::{ShadedHit, Shading, VertexNumbers};
use crate::transport::walk::shadow_tag::ShadowTag;
use crate::transport::walk::subpath::{Next, Walk};
use crate::transport::walk::sums::{Arrival, Counts};
use crate::transport::walk::vertex::Scatterer;
use crate::transport::walk::visibility::ShadowRays;
use core::ops::Range;
use glam::{Vec2, Vec3};

/// The light vertices of a sample of the picture.
#[derive(Clone, Copy)]
pub struct Connections<'a> {
    /// All vertices.
    pub vertices: &'a [LightVertex],
    /// Vertices that a camera vertex is connected to.
    pub count: u32,
}

/// Traces camera paths.
#[derive(Clone, Copy)]
pub struct CameraPaths<'a, F> {
    pub(super) walk: Walk<'a, F>,
    pub(super) settings: PathSettings,
    pub(super) connections: Connections<'a>,
    pub(super) merging: Option<Merging<'a>>,
}

/// Counts of a recorded sample of a tile.
pub struct Recorded {
    /// Contributions in the list.
    pub contributions: usize,
    /// Shadow rays of connections.
    pub connections: u64,
    /// All work.
    pub counters: Counters,
}

impl<'a, F: Features> CameraPaths<'a, F> {
    /// Camera paths with the techniques of `counts`, connected to `connections`.
    pub fn new(
        context: SceneContext<'a, F>,
        emission: &'a EmissionSampler<'a>,
        settings: PathSettings,
        counts: Counts,
        connections: Connections<'a>,
    ) -> Self {
        let walk = Walk { context, emission, size: [settings.width, settings.height], counts };
        Self { walk, settings, connections, merging: None }
    }

    /// Camera paths that are merged with photons as well.
    pub fn with_merging(self, merging: Option<Merging<'a>>) -> Self {
        Self { merging, ..self }
    }

    /// Camera paths with the same weights whose merges bring no light; `None` without merging.
    pub fn without_light_of_merges(self) -> Option<Self> {
        let merging = self.merging.map(|merging| Merging { vertices: &[], ..merging });
        merging.map(|merging| self.with_merging(Some(merging)))
    }

    /// Working memory of a task with so many connections of a vertex.
    pub fn scratch(connections: u32) -> Footprint {
        let shadows = PIXELS_PER_TILE * (1 + connections as usize);
        Footprint::default()
            .slice::<CameraPath>(PIXELS_PER_TILE)
            .slice::<Ray>(PIXELS_PER_TILE)
            .slice::<Hit>(PIXELS_PER_TILE)
            .slice::<u32>(PIXELS_PER_TILE * connections as usize)
            .slice::<LightVertex>(PIXELS_PER_TILE * connections as usize)
            .and(ShadowRays::footprint(shadows))
    }

    /// Adds `samples` of tile `tile` to its pixels `out`, each with the light of `splats`, those of the
    /// tile's pixels.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`CameraPaths::scratch`].
    #[inline(never)]
    pub fn run(
        &self,
        tile: usize,
        samples: Range<u32>,
        splats: &[[f32; 3]],
        scratch: &mut Arena,
        out: &mut [Pixel],
    ) -> Result<Counters, OutOfMemory> {
        let (_, counters) = self.each_sample(tile, samples, scratch, None, |sample, paths, counters| {
            for path in paths {
                let splat = splats.get(path.place as usize).copied().unwrap_or_default();
                if let Some(pixel) = out.get_mut(path.place as usize) {
                    let radiance = Rgb::from(path.radiance) + Rgb::from(splat);
                    if pixel.add(sample, radiance, &mut counters.dropped) {
                        pixel.add_blur(sample, Rgb::from(path.blur));
                    }
                }
            }
        })?;
        Ok(counters)
    }

    /// Contributions of sample number `sample` to tile `tile`, into `list`.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`CameraPaths::scratch`].
    pub fn contributions(
        &self,
        tile: usize,
        sample: u32,
        list: &mut [Contribution],
        scratch: &mut Arena,
    ) -> Result<Recorded, OutOfMemory> {
        let recorder = Some(Recorder { list, count: 0, connections: 0 });
        let samples = sample..sample + 1;
        let (recorder, counters) = self.each_sample(tile, samples, scratch, recorder, |_, _, _| ())?;
        let (contributions, connections) = recorder.map_or((0, 0), |list| (list.count, list.connections));
        Ok(Recorded { contributions, connections, counters })
    }

    /// Traces the paths of `samples` of tile `tile`, and calls `done` with those of each sample.
    fn each_sample<'w>(
        &self,
        tile: usize,
        samples: Range<u32>,
        scratch: &'w mut Arena,
        recorder: Option<Recorder<'w>>,
        mut done: impl FnMut(u32, &[CameraPath], &mut Counters),
    ) -> Result<(Option<Recorder<'w>>, Counters), OutOfMemory> {
        let mut arena = scratch.scratch();
        let paths: &mut [CameraPath] = arena.slice(PIXELS_PER_TILE)?;
        let rays: &mut [Ray] = arena.slice(PIXELS_PER_TILE)?;
        let hits: &mut [Hit] = arena.slice(PIXELS_PER_TILE)?;
        let indices: &mut [u32] = arena.slice(PIXELS_PER_TILE * self.connections.count as usize)?;
        let drawn: &mut [LightVertex] = arena.slice(PIXELS_PER_TILE * self.connections.count as usize)?;
        let shadows = PIXELS_PER_TILE * (1 + self.connections.count as usize);
        let mut queue = Queue { shadows: ShadowRays::new(shadows, &mut arena)?, recorder };
        let tile = Tile::new(self.settings.width, self.settings.height, tile);
        let mut counters = Counters::default();
        for sample in samples {
            let count = self.start(&tile, sample, paths, rays);
            counters.paths += count as u64;
            let drawn = (&mut *indices, &mut *drawn);
            self.trace(sample, (&mut paths[..count], rays, hits), drawn, &mut queue, &mut counters);
            done(sample, &paths[..count], &mut counters);
        }
        Ok((queue.recorder, counters))
    }

    /// Fills `paths` and `rays` with those of the camera; returns how many.
    fn start(&self, tile: &Tile, sample: u32, paths: &mut [CameraPath], rays: &mut [Ray]) -> usize {
        let PathSettings { width, seed, .. } = self.settings;
        let mut count = 0;
        for place in 0..PIXELS_PER_TILE {
            let Some((x, y)) = tile.pixel(place) else { continue };
            let pixel = y * width + x;
            let sampler = Sampler::new(seed, pixel, sample);
            let [dx, dy] = sampler.pair(dimension::PIXEL);
            let lens = sampler.pair(dimension::LENS);
            let raster = Vec2::new(x as f32 + dx, y as f32 + dy);
            let (subpath, ray) = self.walk.start_at_camera(raster, lens);
            rays[count] = Ray { tag: count as u32, ..ray };
            paths[count] = CameraPath {
                subpath,
                place: place as u32,
                pixel,
                eta_squared: 1.0,
                lens,
                ..CameraPath::default()
            };
            count += 1;
        }
        count
    }

    /// Advances `paths` until none is left. Light vertices that they are connected to are drawn by `indices`.
    fn trace(
        &self,
        sample: u32,
        (paths, rays, hits): (&mut [CameraPath], &mut [Ray], &mut [Hit]),
        (indices, drawn): (&mut [u32], &mut [LightVertex]),
        queue: &mut Queue,
        counters: &mut Counters,
    ) {
        let mut active = paths.len();
        let mut coherence = Coherence::Coherent;
        let mut shading = Shading::new();
        let (context, PathSettings { seed, max_depth, .. }) = (&self.walk.context, self.settings);
        let sampler_of = |path: &CameraPath| Sampler::new(seed, path.pixel, sample);
        let vertices = self.connections.vertices;
        let each = if vertices.is_empty() { 0 } else { self.connections.count as usize };
        while active > 0 {
            for (i, ray) in rays[..active].iter().enumerate() {
                let indices = indices.get_mut(i * each..(i + 1) * each).unwrap_or_default();
                if let Some(path) = paths.get(ray.tag as usize) {
                    self.draw(path, &sampler_of(path), indices);
                }
            }
            // In a loop of their own, so that the memory is waited for once.
            for (index, drawn) in indices[..active * each].iter().zip(&mut *drawn) {
                *drawn = vertices.get(*index as usize).copied().unwrap_or_default();
            }
            let numbers = |paths: &[CameraPath], tag: u32| {
                let CameraPath { subpath, pixel, eta_squared, .. } = paths.get(tag as usize)?;
                let place = Sampler::place(seed, *pixel, sample);
                let numbers = VertexNumbers::Path(place, subpath.throughput, *eta_squared);
                (subpath.segments < max_depth).then_some((subpath.segments, numbers))
            };
            let traced = (&mut rays[..active], &mut hits[..active], coherence);
            active = shading.advance(context, traced, counters, paths, numbers, |paths, i, end, counters| {
                let path = paths.get_mut(end.0.tag as usize)?;
                let drawn = drawn.get(i * each..(i + 1) * each).unwrap_or_default();
                self.step(path, (sampler_of(path), drawn), end, queue, counters)
            });
            coherence = Coherence::Incoherent;
            let Queue { shadows, recorder } = queue;
            shadows.trace(context, counters, |ray, light| {
                let tag = ShadowTag(ray.tag);
                let Some(path) = paths.get_mut(tag.path()) else { return };
                path.add(light);
                if let Some(recorder) = recorder {
                    let class = if tag.is_flagged() { Class::Connections } else { Class::Paths };
                    recorder.push((class, tag.rest()), path.place, light);
                }
            });
        }
    }

    /// One vertex of a path. The ray by which the path goes on.
    #[inline]
    fn step(
        &self,
        path: &mut CameraPath,
        (sampler, drawn): (Sampler, &[LightVertex]),
        (ray, hit, shaded): (&Ray, &Hit, ShadedHit),
        queue: &mut Queue,
        counters: &mut Counters,
    ) -> Option<Ray> {
        let Self { walk, .. } = self;
        let direction = Vec3::from(ray.direction);
        let before = path.radiance;
        if !hit.is_some() {
            let light = walk.escape(&path.subpath, direction);
            path.add(light.map_or(Rgb::ZERO, |light| light.radiance));
            queue.record(Class::Paths, path.history.rest_of_hit(), path, before);
            return None;
        }
        let point = shaded.met.point()?;
        let opacity = |surfaces| sampler.single(dimension::CROSSING + surfaces);
        let met = (ray, hit, &point);
        if let Err(behind) = walk.stop(&mut path.subpath, met, true, opacity, counters) {
            return behind;
        }
        if let Some(light) = walk.emission(&path.subpath, &point, direction) {
            path.add(light.radiance);
        }
        queue.record(Class::Paths, path.history.rest_of_hit(), path, before);
        path.travelled += hit.t;
        let segments = path.subpath.segments;
        if segments >= self.settings.max_depth {
            return None;
        }
        let bsdf = shaded.bsdf::<F>(walk.context.scene);
        path.history = path.history.on_camera_path(&bsdf);
        let at = self.arrive(path, Scatterer { point: &point, bsdf: &bsdf }, direction, sampler);
        let vertex = &at.vertex;
        let before = path.radiance;
        self.merge(path, &at);
        queue.record(Class::Merges, path.history.rest_of_merge(), path, before);
        if !bsdf.is_delta() {
            let sample = || walk.sample_light(vertex, dimension::light_sample(&sampler, segments));
            if let Some(lit) = shaded.lit(&walk.context, sample) {
                let light = walk.light_sample(&path.subpath, vertex, &lit);
                let class = (Class::Paths, path.history.rest_of_sample());
                queue.push(class, ray.tag, lit.ray, light.radiance);
            }
            if !vertex.is_bent {
                self.connect(path, &at, drawn, ray.tag, queue);
            }
        }
        let next = shaded.next(|| {
            let sample = bsdf.sample::<F>(vertex.wo, dimension::bsdf_sample(&sampler, segments))?;
            let roulette = || sampler.single(dimension::vertex(segments) + dimension::ROULETTE);
            let next = walk.next((&path.subpath, path.eta_squared), vertex, sample, roulette)?;
            Some(next.0)
        })?;
        self.scatter(path, &at, &next, counters)
    }

    /// The vertex where the path arrives.
    #[inline]
    fn arrive<'v>(
        &self,
        path: &CameraPath,
        at: Scatterer<'v>,
        direction: Vec3,
        sampler: Sampler,
    ) -> CameraVertex<'v> {
        let is_caster = at.bsdf.is_caustic_caster();
        let (subpath, is_first_rough) = (&path.subpath, path.has_rough == 0 && !is_caster);
        let mut vertex = self.walk.camera_vertex(subpath, at, direction, path.lens);
        let mut eta_vcm = 0.0;
        if let Some(Merging { radii, .. }) = self.merging.as_ref().filter(|_| !vertex.is_bent) {
            if is_first_rough {
                eta_vcm = radii.eta_vcm(at.bsdf, at.point.position);
            }
            if subpath.segments > 1 {
                let squared = at.point.position.distance_squared(subpath.position.into());
                let arrival = Arrival::of(is_caster, squared, radii.near(path.eta_vcm));
                // The segment is that behind the vertex of the merge.
                if arrival.is_some_and(|arrival| arrival.is_merged(subpath.segments - 1)) {
                    vertex.sums = vertex.sums.with_merge();
                }
            }
        }
        CameraVertex { vertex, is_first_rough, eta_vcm, sampler }
    }

    /// The path goes on to `next`. Its ray.
    #[inline]
    fn scatter(
        &self,
        path: &mut CameraPath,
        CameraVertex { vertex, eta_vcm, .. }: &CameraVertex,
        next: &Next,
        counters: &mut Counters,
    ) -> Option<Ray> {
        let (mut vertex, is_delta) = (*vertex, next.sample.delta);
        if is_delta {
            // The next vertex is behind a caster.
            vertex.sums = vertex.sums.with_merge();
        }
        let is_rough = !vertex.at.bsdf.is_caustic_caster();
        let at = (&mut path.subpath, &mut path.eta_squared);
        let ray = self.walk.go_on(at, &vertex, next, is_rough.then_some(*eta_vcm), counters)?;
        path.eta_vcm = if is_delta { 0.0 } else { *eta_vcm };
        path.has_rough |= u32::from(is_rough && !is_delta);
        if is_delta {
            path.history = path.history.by_coat();
        }
        Some(ray)
    }
}
