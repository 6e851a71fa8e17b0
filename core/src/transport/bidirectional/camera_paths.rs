//! Camera paths of a tile: path tracing whose vertices are connected to stored light vertices as well (Veach
//! 1997, section 10.2; light vertex cache of Davidovič et al. 2014). All paths of a sample advance together,
//! so that the tracer sees batches of rays.

use crate::Rgb;
use crate::bsdf::{Bsdf, Features};
use crate::bvh::Coherence;
use crate::film::{PIXELS_PER_TILE, Pixel, Tile};
use crate::geometry::{Hit, MISS, Ray};
use crate::light::EmissionSampler;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::Sampler;
use crate::scene::SurfacePoint;
use crate::transport::bidirectional::arrival::Arrival;
use crate::transport::bidirectional::camera_path::{CameraPath, Queue, Recorder, Vertex};
use crate::transport::bidirectional::contribution::{Class, Contribution};
use crate::transport::bidirectional::ends::{End, sums_from_camera};
use crate::transport::bidirectional::merge_photons::Merging;
use crate::transport::bidirectional::mis::{Counts, Sums};
use crate::transport::bidirectional::shaded::Shaded;
use crate::transport::bidirectional::vertex::{LightVertex, is_bent};
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::block::Block;
use crate::transport::walk::block_scatter::Sets;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::dimension;
use crate::transport::walk::points::Met;
use crate::transport::walk::termination::MAX_CROSSINGS;
use crate::transport::walk::visibility::ShadowRays;
use crate::transport::wavefront::BLOCK;
use core::ops::Range;
use glam::Vec3;

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
    pub(super) context: SceneContext<'a, F>,
    pub(super) emission: &'a EmissionSampler<'a>,
    pub(super) settings: PathSettings,
    pub(super) counts: Counts,
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

/// The paths of a tile that advance together.
struct Wave<'w> {
    paths: &'w mut [CameraPath],
    rays: &'w mut [Ray],
    hits: &'w mut [Hit],
    /// The light vertices that each is connected to: where they are stored, and as they are.
    indices: &'w mut [u32],
    drawn: &'w mut [LightVertex],
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
        Self { context, emission, settings, counts, connections, merging: None }
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
            .slice::<Ray>(shadows)
            .slice::<[f32; 3]>(shadows)
            .slice::<Hit>(shadows)
            .slice::<u8>(shadows)
    }

    /// Adds `samples` of tile `tile` to its pixels `out`, each with the light of `splats`, those of the
    /// tile's pixels.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`CameraPaths::scratch`].
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
        let mut queue = Queue {
            shadows: ShadowRays {
                rays: arena.slice(shadows)?,
                light: arena.slice(shadows)?,
                hits: arena.slice(shadows)?,
                hidden: arena.slice(shadows)?,
            },
            count: 0,
            recorder,
        };
        let tile = Tile::new(self.settings.width, self.settings.height, tile);
        let mut counters = Counters::default();
        for sample in samples {
            let count = self.start(&tile, sample, paths, rays);
            counters.paths += count as u64;
            let wave = Wave {
                paths: &mut *paths,
                rays: &mut *rays,
                hits: &mut *hits,
                indices: &mut *indices,
                drawn: &mut *drawn,
            };
            self.trace(sample, wave, count, &mut queue, &mut counters);
            done(sample, &paths[..count], &mut counters);
        }
        Ok((queue.recorder, counters))
    }

    /// Fills `paths` and `rays` with those of the camera; returns how many.
    fn start(&self, tile: &Tile, sample: u32, paths: &mut [CameraPath], rays: &mut [Ray]) -> usize {
        let PathSettings { width, height, seed, .. } = self.settings;
        let mut count = 0;
        for place in 0..PIXELS_PER_TILE {
            let Some((x, y)) = tile.pixel(place) else { continue };
            let pixel = y * width + x;
            let sampler = Sampler::new(seed, pixel, sample);
            let [dx, dy] = sampler.pair(dimension::PIXEL);
            let lens = sampler.pair(dimension::LENS);
            let ray = self.context.scene.camera.ray(width, height, x as f32 + dx, y as f32 + dy, lens);
            rays[count] = Ray { tag: count as u32, ..ray };
            paths[count] = CameraPath {
                throughput: [1.0; 3],
                pdf: f32::INFINITY,
                place: place as u32,
                pixel,
                segments: 1,
                triangle: MISS,
                eta_squared: 1.0,
                lens,
                ..CameraPath::default()
            };
            count += 1;
        }
        count
    }

    /// Advances the first `count` paths until none is left.
    fn trace(
        &self,
        sample: u32,
        Wave { paths, rays, hits, indices, drawn }: Wave,
        count: usize,
        queue: &mut Queue,
        counters: &mut Counters,
    ) {
        let mut active = count;
        let mut coherence = Coherence::Coherent;
        let mut block = Block::new();
        let has_lanes = self.context.has_lanes();
        while active > 0 {
            counters.rays += active as u64;
            self.context.nearest_batch(&rays[..active], coherence, &mut hits[..active]);
            coherence = Coherence::Incoherent;
            let sampler_of = |path: &CameraPath| Sampler::new(self.settings.seed, path.pixel, sample);
            let vertices = self.connections.vertices;
            let each = if vertices.is_empty() { 0 } else { self.connections.count as usize };
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
            let (mut left, mut sets) = (0, Sets::default());
            queue.count = 0;
            for i in 0..active {
                if i.is_multiple_of(BLOCK) {
                    let of_block = i..active.min(i + BLOCK);
                    let traced = (&rays[of_block.clone()], &hits[of_block]);
                    block.points.meet(&self.context, traced);
                    if has_lanes {
                        sets = self.shade(&mut block, (paths, sample), traced.0);
                    }
                }
                let met = block.points.at(i % BLOCK);
                let shaded = has_lanes.then_some(Shaded { block: &block, sets: &sets, i: i % BLOCK });
                let (ray, hit) = (rays[i], hits[i]);
                let Some(path) = paths.get_mut(ray.tag as usize) else { continue };
                let sampler = sampler_of(path);
                let drawn = drawn.get(i * each..(i + 1) * each).unwrap_or_default();
                if let Some(next) =
                    self.step(path, (sampler, drawn), (&ray, &hit, met, shaded), queue, counters)
                {
                    rays[left] = Ray { tag: ray.tag, ..next };
                    left += 1;
                }
            }
            active = left;
            let Queue { shadows, count, recorder } = queue;
            let arrive = |ray: &Ray, light: Rgb| {
                let (path, class) = Queue::of_tag(ray.tag);
                let Some(path) = paths.get_mut(path) else { return };
                path.add(light);
                if let Some(recorder) = recorder {
                    recorder.push(class, path.place, light);
                }
            };
            let rays = &mut counters.shadow_rays;
            counters.dropped.unfinished += self.context.trace_shadow_rays(shadows, *count, rays, arrive);
        }
    }

    /// One vertex of a path. The ray by which the path goes on.
    fn step(
        &self,
        path: &mut CameraPath,
        (sampler, drawn): (Sampler, &[LightVertex]),
        (ray, hit, met, shaded): (&Ray, &Hit, Met, Option<Shaded>),
        queue: &mut Queue,
        counters: &mut Counters,
    ) -> Option<Ray> {
        let direction = Vec3::from(ray.direction);
        let before = path.radiance;
        if !hit.is_some() {
            self.escape(path, direction);
            queue.record(Class::Paths, path.history.rest_of_hit(), path, before);
            return None;
        }
        let point = met.point()?;
        let opacity = || sampler.single(dimension::opacity(path.segments, path.crossings));
        let is_skipped = self.context.is_skipped(&point, hit, path.triangle, opacity)
            || path.segments == 1 && point.is_left_by(ray);
        if is_skipped {
            if path.crossings >= MAX_CROSSINGS {
                counters.dropped.unfinished += 1;
                return None;
            }
            path.crossings += 1;
            path.triangle = hit.triangle;
            return Some(point.spawn(direction));
        }
        self.emission(path, &point, hit, direction);
        queue.record(Class::Paths, path.history.rest_of_hit(), path, before);
        path.travelled += hit.t;
        if path.segments >= self.settings.max_depth {
            return None;
        }
        let own;
        let bsdf = match &shaded {
            Some(shaded) => shaded.bsdf(),
            None => {
                own = met.bsdf::<F>(self.context.scene);
                &own
            }
        };
        path.history = path.history.on_camera_path(bsdf);
        let wo = point.frame.to_local(-direction);
        let is_bent = is_bent(&point, wo);
        let sums = if is_bent { Sums::default() } else { self.arrive(path, &point, bsdf, direction) };
        let is_first_rough = path.has_rough == 0 && !bsdf.is_caustic_caster();
        let eta_vcm = match &self.merging {
            Some(merging) if is_first_rough && !is_bent => merging.radii.eta_vcm(bsdf, point.position),
            _ => 0.0,
        };
        let vertex =
            Vertex { point: &point, bsdf, wo, sums, is_first_rough, eta_vcm, is_bent, sampler, shaded };
        let before = path.radiance;
        self.merge(path, &vertex);
        queue.record(Class::Merges, path.history.rest_of_merge(), path, before);
        if !bsdf.is_delta() {
            self.light_sample(path, &vertex, ray.tag, queue);
            if !is_bent {
                self.connect(path, &vertex, drawn, ray.tag, queue);
            }
        }
        self.scatter(path, &vertex, hit, direction, counters)
    }

    /// The squared distance within which a rough vertex is near one whose merges count η.
    pub(super) fn near(&self, eta_vcm: f32) -> f32 {
        self.merging.as_ref().map_or(0.0, |merging| merging.radii.near(eta_vcm))
    }

    /// Sums where the path arrives at `point`.
    fn arrive(&self, path: &CameraPath, point: &SurfacePoint, bsdf: &Bsdf, direction: Vec3) -> Sums {
        let cos = direction.dot(point.geometric_normal).abs();
        let is_delta = bsdf.is_delta();
        if path.segments > 1 {
            let squared = point.position.distance_squared(path.position.into());
            let sums = path.sums.arrive(squared, cos, is_delta);
            let arrival = Arrival::of(bsdf.is_caustic_caster(), squared, self.near(path.eta_vcm));
            // The segment is that behind the vertex of the merge.
            let is_merged = arrival.is_some_and(|arrival| arrival.is_merged(path.segments - 1));
            return if is_merged { sums.with_merge() } else { sums };
        }
        let PathSettings { width, height, .. } = self.settings;
        sums_from_camera(&self.context, &self.counts, [width, height], path.lens, End { point, bsdf, cos })
    }
}
