//! Prepass that learns the [`EnvironmentVisibility`]: the part of the environment that each place of the
//! scene sees. The environment is then sampled by these tables.
//!
//! 1. A few camera paths over the whole picture store a vertex at each scattering surface.
//! 2. Vertices are sorted by place: a cell of a grid and the side that the surface faces.
//! 3. Rays go from the vertices of each place, in turn, to the bins of the environment: one to every other
//!    bin, then several to each bin near visible light.
//!
//! Visibility tables pay if most of the environment is hidden, as in a room, and cost a little otherwise. The
//! same rays estimate the gain.

use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::geometry::{Bounds, Hit, Ray};
use crate::light::{Bins, EnvironmentVisibility, VisibilityGrid, VisibilityTable};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::Sampler;
use crate::transport::path::PathIntegrator;
use crate::transport::settings::Counters;
use crate::transport::walk::context::Segment;
use crate::transport::walk::dimension;
use crate::transport::walk::vertex::Scatterer;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Number of tasks of the prepass.
const TASKS: usize = 64;
/// Range of the number of paths per task; all tasks together have a quarter of the number of pixels.
const PATHS: core::ops::Range<usize> = 16..256;
/// Maximum number of vertices that a path stores, and of surfaces that it hits.
const VERTICES: usize = 3;
const SURFACES: usize = 8;

/// Minimum number of vertices of a place with a table.
const MIN_VERTICES: usize = 4;

/// Number of rays to the environment: per pixel; range of the total; maximum per bin of a table.
const RAYS_PER_PIXEL: usize = 64;
const RAYS: core::ops::Range<usize> = 1 << 18..1 << 22;
const MAX_PASSES: usize = 4;

/// Number of bins of a table.
const BINS: usize = size_of::<Bins>() / size_of::<f32>();

/// Minimum factor by which the variance of environment light has to fall.
const MIN_GAIN: f64 = 1.25;

/// Seed of the prepass, distinct from the seed of the picture: tables must be independent of the samples that
/// use them.
const STREAM: u32 = 0x6c00_7517;

/// Scattering vertex of a path. All normals are on the side of the viewer.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct VisibilityVertex {
    position: [f32; 3],
    /// Error bound of `position`.
    error: f32,
    geometric_normal: [f32; 3],
    /// Shading normal.
    normal: [f32; 3],
    /// Sort key: number of the place, then of the vertex.
    place: u32,
    index: u32,
}

/// Place of a missing vertex.
const NO_PLACE: u32 = u32::MAX;

/// Vertices of the prepass, and their range for each place with a table.
pub struct VisibilityPrepass<'m> {
    vertices: &'m mut [VisibilityVertex],
    ranges: &'m mut [[u32; 2]],
    /// For each pass, the direction to each bin of the environment, common to all places.
    directions: &'m mut [[f32; 3]],
}

/// Variance of environment light without and with visibility tables, summed over places.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VisibilityGain {
    before: f64,
    after: f64,
}

impl VisibilityGain {
    /// Factor by which the variance falls.
    pub fn factor(&self) -> f32 {
        if self.after > 0.0 { (self.before / self.after) as f32 } else { 1.0 }
    }

    /// True if the environment should be sampled by visibility tables.
    pub fn pays(&self) -> bool {
        self.before > MIN_GAIN * self.after
    }
}

impl core::ops::AddAssign for VisibilityGain {
    fn add_assign(&mut self, other: Self) {
        self.before += other.before;
        self.after += other.after;
    }
}

impl<'m> VisibilityPrepass<'m> {
    /// Footprint of [`VisibilityPrepass::new`].
    pub fn footprint() -> Footprint {
        Footprint::default()
            .slice::<VisibilityVertex>(TASKS * PATHS.end * VERTICES)
            .slice::<[u32; 2]>(EnvironmentVisibility::MAX_TABLES)
            .slice::<[f32; 3]>(MAX_PASSES * BINS)
    }

    /// Prepass without vertices.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than [`VisibilityPrepass::footprint`].
    pub fn new(arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let vertices = arena.slice(TASKS * PATHS.end * VERTICES)?;
        let ranges = arena.slice(EnvironmentVisibility::MAX_TABLES)?;
        Ok(Self { vertices, ranges, directions: arena.slice(MAX_PASSES * BINS)? })
    }

    /// Memory of each task, to be filled by [`PathIntegrator::store_vertices`].
    pub fn parts(&mut self) -> impl Iterator<Item = (usize, &mut [VisibilityVertex])> {
        self.vertices.chunks_mut(PATHS.end * VERTICES).enumerate()
    }

    /// Sorts the vertices by place and numbers the tables in `slots`. Returns the grid of places and the
    /// number of tables.
    pub fn assign_tables(&mut self, slots: &mut [u16]) -> Option<(VisibilityGrid, usize)> {
        let seen = || self.vertices.iter().filter(|vertex| vertex.place != NO_PLACE);
        let grid = VisibilityGrid::over(&Bounds::around(seen().map(|vertex| vertex.position.into())))?;
        for (index, vertex) in self.vertices.iter_mut().enumerate() {
            vertex.index = index as u32;
            if vertex.place != NO_PLACE {
                let place = grid.place(vertex.position.into(), vertex.normal.into());
                vertex.place = place.map_or(NO_PLACE, |place| place as u32);
            }
        }
        self.vertices.sort_unstable_by_key(|vertex| (vertex.place, vertex.index));
        let mut fewest = MIN_VERTICES;
        while self.places().filter(|range| range.len() >= fewest).count() > self.ranges.len() {
            fewest *= 2;
        }
        let mut count = 0;
        let Self { vertices, ranges, .. } = self;
        let places = vertices.chunk_by(|a, b| a.place == b.place);
        let mut start = 0;
        for place in places {
            let end = start + place.len();
            if place.len() >= fewest
                && let Some(slot) = slots.get_mut(place[0].place as usize)
                && let Some(range) = ranges.get_mut(count)
            {
                *range = [start as u32, end as u32];
                count += 1;
                *slot = count as u16;
            }
            start = end;
        }
        Some((grid, count))
    }

    fn places(&self) -> impl Iterator<Item = &[VisibilityVertex]> {
        self.vertices.chunk_by(|a, b| a.place == b.place).filter(|place| place[0].place != NO_PLACE)
    }

    fn vertices_of(&self, table: usize) -> &[VisibilityVertex] {
        let [start, end] = self.ranges.get(table).copied().unwrap_or_default();
        self.vertices.get(start as usize..end as usize).unwrap_or(&[])
    }
}

/// Rays from one place to the environment, at most one per bin. The tag of a ray is its bin.
struct EnvironmentRays<'m> {
    rays: &'m mut [Ray],
    cosines: &'m mut [f32],
    hits: &'m mut [Hit],
    count: usize,
}

impl<'m> EnvironmentRays<'m> {
    fn new(arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let (rays, cosines) = (arena.slice(BINS)?, arena.slice(BINS)?);
        Ok(Self { rays, cosines, hits: arena.slice(BINS)?, count: 0 })
    }

    /// Makes one ray to each of `bins` above the horizon, from the `vertices` in turn.
    fn generate(
        &mut self,
        bins: impl Iterator<Item = usize>,
        pass: usize,
        prepass: &VisibilityPrepass,
        vertices: &[VisibilityVertex],
    ) {
        self.count = 0;
        for bin in bins {
            let index = (bin * MAX_PASSES + pass) as u32;
            // Golden-ratio stride, which spreads neighbouring bins over the vertices.
            let pick = (u64::from(index.wrapping_mul(0x9e37_79b9)) * vertices.len() as u64) >> 32;
            let Some(vertex) = vertices.get(pick as usize) else { continue };
            let Some(&direction) = prepass.directions.get(pass * BINS + bin) else { continue };
            let (direction, normal) = (Vec3::from(direction), Vec3::from(vertex.geometric_normal));
            let cosine = direction.dot(vertex.normal.into());
            if cosine > 0.0 && direction.dot(normal) > 0.0 {
                let origin = Vec3::from(vertex.position) + vertex.error * normal;
                self.rays[self.count] = Ray { tag: bin as u32, ..Ray::new(origin, direction) };
                self.cosines[self.count] = cosine;
                self.count += 1;
            }
        }
    }
}

impl<F: Features> PathIntegrator<'_, F> {
    /// Paths of a task.
    pub fn visibility_paths(&self) -> usize {
        let pixels = self.settings.width as usize * self.settings.height as usize;
        (pixels / 4 / TASKS).clamp(PATHS.start, PATHS.end)
    }

    /// Stores the vertices of task `task`, which has this number of `paths`, in its part of the
    /// [`VisibilityPrepass`].
    #[inline(never)]
    pub fn store_vertices(&self, task: usize, paths: usize, part: &mut [VisibilityVertex]) {
        part.fill(VisibilityVertex { place: NO_PLACE, ..VisibilityVertex::default() });
        let crate::transport::PathSettings { width, height, seed, .. } = self.settings;
        for (path, vertices) in part.chunks_mut(VERTICES).take(paths).enumerate() {
            let sampler = Sampler::new(seed ^ STREAM, 0, (task * paths + path) as u32);
            let [x, y] = sampler.pair(0);
            let lens = sampler.pair(1);
            let ray = self.context.scene.camera.ray(width, height, x * width as f32, y * height as f32, lens);
            self.follow(ray, &sampler, vertices);
        }
    }

    /// Follows one path until all `vertices` are filled or the path ends.
    fn follow(&self, ray: Ray, sampler: &Sampler, vertices: &mut [VisibilityVertex]) {
        let (context, counters) = (self.context, &mut Counters::default());
        let mut segment = Segment::first(ray);
        let mut free = vertices.iter_mut();
        for surface in 0..SURFACES as u32 {
            let opacity = |n| sampler.single(dimension::CROSSING + n);
            let Some((hit, point)) = context.next_surface(&mut segment, opacity, counters) else { return };
            let bsdf = self.context.bsdf_at(&point);
            if !bsdf.is_delta() {
                let Some(vertex) = free.next() else { return };
                *vertex = VisibilityVertex {
                    position: point.position.to_array(),
                    error: point.error,
                    geometric_normal: point.geometric_normal.to_array(),
                    normal: point.frame.normal.to_array(),
                    place: 0,
                    index: 0,
                };
            }
            let first = 2 + 3 * surface;
            let ([u, v], lobe) = (sampler.pair(first + 1), sampler.single(first + 2));
            let at = Scatterer { point: &point, bsdf: &bsdf };
            let sampled = at.sample::<F>(segment.ray.direction.into(), [u, v, lobe]);
            let Some((_, direction)) = sampled else { return };
            segment = segment.onward(&point, &hit, direction);
        }
    }

    /// Writes the directions to the bins of the environment, which the scene must have, into `prepass`.
    pub fn write_bin_directions(&self, prepass: &mut VisibilityPrepass) {
        for (i, direction) in prepass.directions.iter_mut().enumerate() {
            let (bin, pass) = (i % BINS, i / BINS);
            let offset = Sampler::new(self.settings.seed ^ STREAM, 1 + bin as u32, pass as u32).pair(0);
            let at = self
                .context
                .lights
                .sample_environment(self.context.scene, VisibilityTable::place(bin, offset));
            *direction = at.unwrap_or(Vec3::ZERO).to_array();
        }
    }

    /// Scratch memory of [`PathIntegrator::learn_table`].
    pub fn learn_table_scratch() -> Footprint {
        Footprint::default().slice::<Ray>(BINS).slice::<f32>(BINS).slice::<Hit>(BINS)
    }

    /// Rays of all tables, beside one to every other bin of each.
    pub fn environment_rays(&self) -> usize {
        let pixels = self.settings.width as usize * self.settings.height as usize;
        (RAYS_PER_PIXEL * pixels).clamp(RAYS.start, RAYS.end)
    }

    /// Learns table `number` by one ray to every other bin and about this number of `rays`. Returns its
    /// variances, weighted by the number of vertices.
    ///
    /// # Errors
    /// [`OutOfMemory`] if `scratch` has less than [`PathIntegrator::learn_table_scratch`] bytes.
    #[inline(never)]
    pub fn learn_table(
        &self,
        prepass: &VisibilityPrepass,
        number: usize,
        rays: usize,
        scratch: &mut Arena,
        table: &mut VisibilityTable,
    ) -> Result<VisibilityGain, OutOfMemory> {
        let mut arena = scratch.scratch();
        let mut batch = EnvironmentRays::new(&mut arena)?;
        let vertices = prepass.vertices_of(number);

        // One ray to every other bin also stands for the neighbouring bins. Bins near visible light get more
        // rays.
        let mut squares: Bins = [0.0; _];
        batch.generate(
            (0..squares.len()).filter(|&bin| VisibilityTable::is_black(bin)),
            0,
            prepass,
            vertices,
        );
        self.trace_environment_rays(&mut batch, |bin, light| squares[bin] = light);
        let near = VisibilityTable::smoothed(&VisibilityTable::smoothed(&squares));
        let open = || (0..near.len()).filter(|&bin| near[bin] > 0.0);

        let passes = (rays / open().count().max(1)).clamp(1, MAX_PASSES);
        let mut sums: Bins = [0.0; _];
        squares.fill(0.0);
        for pass in 0..passes {
            batch.generate(open(), pass, prepass, vertices);
            self.trace_environment_rays(&mut batch, |bin, light| {
                sums[bin] += light / passes as f32;
                squares[bin] += light * light / passes as f32;
            });
        }
        let smooth = VisibilityTable::smoothed(&squares);
        let shares = smooth.map(libm::sqrtf);
        *table = VisibilityTable::new(&shares);

        let bins = sums.len() as f64;
        let mean = |values: &Bins| values.iter().map(|&x| f64::from(x)).sum::<f64>() / bins;
        let seen = mean(&sums);
        if seen <= 0.0 {
            return Ok(VisibilityGain::default());
        }
        // Second moments of the light in units of the environment's mean; `relative` divides by the squared
        // light.
        let cosine_sampled = self.context.lights.environment_is_constant() == Some(true);
        let before = if cosine_sampled { seen / 4.0 } else { mean(&smooth) };
        let shares = VisibilityTable::probabilities(&shares);
        let moment = |(&square, &share): (&f32, &f32)| f64::from(square) / f64::from(share);
        let after = smooth.iter().zip(&shares).map(moment).sum::<f64>() / bins / bins;
        let relative = |moment: f64| vertices.len() as f64 * (moment / seen / seen - 1.0).max(0.0);
        Ok(VisibilityGain { before: relative(before), after: relative(after) })
    }

    /// Traces all rays of `batch`, and calls `add` with the bin and with transmittance times cosine.
    fn trace_environment_rays(&self, batch: &mut EnvironmentRays, mut add: impl FnMut(usize, f32)) {
        let (rays, hits) = (&batch.rays[..batch.count], &mut batch.hits[..batch.count]);
        self.context.nearest_batch(rays, Coherence::Incoherent, hits);
        for ((ray, cosine), hit) in rays.iter().zip(&*batch.cosines).zip(&*hits) {
            add(ray.tag as usize, cosine * self.transmittance_to_environment(ray, hit));
        }
    }

    /// Transmittance along `ray`, whose first hit is `hit`.
    fn transmittance_to_environment(&self, ray: &Ray, hit: &Hit) -> f32 {
        if !hit.is_some() {
            return 1.0;
        }
        if !self.context.has_cutouts {
            return 0.0;
        }
        let Some((rest, light)) = self.context.pass_cutout(ray, hit) else { return 0.0 };
        self.context.transmit(rest, light, &mut 0).unwrap_or_default().max_element()
    }
}
