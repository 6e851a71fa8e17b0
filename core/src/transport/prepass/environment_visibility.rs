//! A first look from the surfaces of the scene to the sky: which of its light reaches which place. What is
//! learned are the [`EnvironmentVisibility`] through which the environment is then sampled.
//!
//! 1. Paths from the camera, few and in all of the picture, leave a vertex wherever they meet a surface that
//!    scatters.
//! 2. Vertices are sorted by their place, a cell of a grid and the side that the surface faces.
//! 3. From each place rays go to the bins of the sky, from one vertex after the other: one to every other
//!    bin, then some to each of those near which light was seen.
//!
//! Windows pay where most of the sky is hidden, as in a room, and cost a little where it is not: the same
//! rays tell which it is.

use crate::Rgb;
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
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Tasks of the look.
const TASKS: usize = 64;
/// Paths of a task: in all a quarter of the pixels, between these.
const PATHS: core::ops::Range<usize> = 16..256;
/// Vertices that a path leaves at most, and surfaces that it meets.
const VERTICES: usize = 3;
const SURFACES: usize = 8;

/// Places with fewer vertices have no window.
const FEWEST: usize = 4;

/// Rays to the sky: so many for each pixel, between these in all, and at most as many for each bin of a
/// window.
const RAYS_PER_PIXEL: usize = 64;
const RAYS: core::ops::Range<usize> = 1 << 18..1 << 22;
const PASSES: usize = 4;

/// Bins of a window.
const BINS: usize = size_of::<Bins>() / size_of::<f32>();

/// By how much the variance of the light from the sky has to fall.
const LEAST_GAIN: f64 = 1.25;

/// A look is not to know the random numbers of the picture: windows must not depend on what is then sampled
/// with them.
const STREAM: u32 = 0x6c00_7517;

/// Where a path was scattered. All normals are on the side that was seen.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Vertex {
    position: [f32; 3],
    /// Bound of the error of `position`.
    error: f32,
    geometric_normal: [f32; 3],
    /// The shading normal.
    normal: [f32; 3],
    /// The number of the place, and of the vertex: together they sort.
    place: u32,
    index: u32,
}

/// A vertex that is not there.
const NOWHERE: u32 = u32::MAX;

/// Vertices, and where those of one place begin and end.
pub struct Outlook<'m> {
    vertices: &'m mut [Vertex],
    ranges: &'m mut [[u32; 2]],
    /// For each pass, where in the sky each bin is looked at, from every place.
    directions: &'m mut [[f32; 3]],
}

/// What windows make of the variance of light from the sky.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct WindowGain {
    before: f64,
    after: f64,
}

impl WindowGain {
    /// By which factor the variance becomes smaller.
    pub fn factor(&self) -> f32 {
        if self.after > 0.0 { (self.before / self.after) as f32 } else { 1.0 }
    }

    /// Whether the sky should be sampled through windows.
    pub fn pays(&self) -> bool {
        self.before > LEAST_GAIN * self.after
    }
}

impl core::ops::AddAssign for WindowGain {
    fn add_assign(&mut self, other: Self) {
        self.before += other.before;
        self.after += other.after;
    }
}

impl<'m> Outlook<'m> {
    /// Bytes that [`Outlook::new`] takes.
    pub fn footprint() -> Footprint {
        Footprint::default()
            .slice::<Vertex>(TASKS * PATHS.end * VERTICES)
            .slice::<[u32; 2]>(EnvironmentVisibility::MOST)
            .slice::<[f32; 3]>(PASSES * BINS)
    }

    /// An empty one.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the arena has less than [`Outlook::footprint`].
    pub fn new(arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let vertices = arena.slice(TASKS * PATHS.end * VERTICES)?;
        let ranges = arena.slice(EnvironmentVisibility::MOST)?;
        Ok(Self { vertices, ranges, directions: arena.slice(PASSES * BINS)? })
    }

    /// What each task of the look fills, by [`PathIntegrator::look`].
    pub fn parts(&mut self) -> impl Iterator<Item = (usize, &mut [Vertex])> {
        self.vertices.chunks_mut(PATHS.end * VERTICES).enumerate()
    }

    /// Sorts the vertices by their places and numbers the windows that there will be in `slots`. Returns the
    /// grid of places and how many windows there are.
    pub fn settle(&mut self, slots: &mut [u16]) -> Option<(VisibilityGrid, usize)> {
        let seen = || self.vertices.iter().filter(|vertex| vertex.place != NOWHERE);
        let grid = VisibilityGrid::over(&Bounds::around(seen().map(|vertex| vertex.position.into())))?;
        for (index, vertex) in self.vertices.iter_mut().enumerate() {
            vertex.index = index as u32;
            if vertex.place != NOWHERE {
                let place = grid.place(vertex.position.into(), vertex.normal.into());
                vertex.place = place.map_or(NOWHERE, |place| place as u32);
            }
        }
        self.vertices.sort_unstable_by_key(|vertex| (vertex.place, vertex.index));
        let mut fewest = FEWEST;
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

    fn places(&self) -> impl Iterator<Item = &[Vertex]> {
        self.vertices.chunk_by(|a, b| a.place == b.place).filter(|place| place[0].place != NOWHERE)
    }

    fn of_window(&self, window: usize) -> &[Vertex] {
        let [start, end] = self.ranges.get(window).copied().unwrap_or_default();
        self.vertices.get(start as usize..end as usize).unwrap_or(&[])
    }
}

/// Rays from one place to the sky, at most one for each bin, which is their tag.
struct Glances<'m> {
    rays: &'m mut [Ray],
    cosines: &'m mut [f32],
    hits: &'m mut [Hit],
    count: usize,
}

impl<'m> Glances<'m> {
    fn new(arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let (rays, cosines) = (arena.slice(BINS)?, arena.slice(BINS)?);
        Ok(Self { rays, cosines, hits: arena.slice(BINS)?, count: 0 })
    }

    /// A ray into each of `bins` above the horizon, from one of the `vertices` after the other.
    fn ask(
        &mut self,
        bins: impl Iterator<Item = usize>,
        pass: usize,
        outlook: &Outlook,
        vertices: &[Vertex],
    ) {
        self.count = 0;
        for bin in bins {
            let index = (bin * PASSES + pass) as u32;
            // The golden ratio spreads neighbouring bins over the vertices.
            let pick = (u64::from(index.wrapping_mul(0x9e37_79b9)) * vertices.len() as u64) >> 32;
            let Some(vertex) = vertices.get(pick as usize) else { continue };
            let Some(&direction) = outlook.directions.get(pass * BINS + bin) else { continue };
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
    /// Leaves the vertices of task `task` of a look in its part of the [`Outlook`].
    pub fn look(&self, task: usize, part: &mut [Vertex]) {
        part.fill(Vertex { place: NOWHERE, ..Vertex::default() });
        let crate::transport::PathSettings { width, height, seed, .. } = self.settings;
        let pixels = width as usize * height as usize;
        let paths = (pixels / 4 / TASKS).clamp(PATHS.start, PATHS.end);
        for (path, vertices) in part.chunks_mut(VERTICES).take(paths).enumerate() {
            let sampler = Sampler::new(seed ^ STREAM, 0, (task * paths + path) as u32);
            let [x, y] = sampler.pair(0);
            let lens = sampler.pair(1);
            let ray = self.context.scene.camera.ray(width, height, x * width as f32, y * height as f32, lens);
            self.follow(ray, &sampler, vertices);
        }
    }

    /// Follows one path until all `vertices` are filled, or it ends.
    fn follow(&self, ray: Ray, sampler: &Sampler, vertices: &mut [Vertex]) {
        let (context, counters) = (self.context, &mut Counters::default());
        let mut segment = Segment::first(ray);
        let mut free = vertices.iter_mut();
        for surface in 0..SURFACES as u32 {
            let opacity = |n| sampler.single(dimension::CROSSING + n);
            let Some((hit, point)) = context.next_surface(&mut segment, opacity, counters) else { return };
            let bsdf = self.context.bsdf_at(&point);
            if !bsdf.is_delta() {
                let Some(vertex) = free.next() else { return };
                *vertex = Vertex {
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
            let wo = point.frame.to_local(-Vec3::from(segment.ray.direction));
            let Some(sample) = bsdf.sample::<F>(wo, [u, v, lobe]) else { return };
            let direction = point.frame.to_world(sample.direction);
            if !point.sides_agree(sample.direction, direction) {
                return;
            }
            segment = segment.onward(&point, &hit, direction);
        }
    }

    /// The directions in which a sky is asked for, into `outlook`. There is one.
    pub fn aim_at_sky(&self, outlook: &mut Outlook) {
        for (i, direction) in outlook.directions.iter_mut().enumerate() {
            let (bin, pass) = (i % BINS, i / BINS);
            let offset = Sampler::new(self.settings.seed ^ STREAM, 1 + bin as u32, pass as u32).pair(0);
            let at = self
                .context
                .lights
                .sample_environment(self.context.scene, VisibilityTable::place(bin, offset));
            *direction = at.unwrap_or(Vec3::ZERO).to_array();
        }
    }

    /// Bytes of working memory of [`PathIntegrator::learn`].
    pub fn learn_scratch() -> Footprint {
        Footprint::default().slice::<Ray>(BINS).slice::<f32>(BINS).slice::<Hit>(BINS)
    }

    /// Makes window number `number` of `count`. Returns what it does to the variance, by how much it matters.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`PathIntegrator::learn_scratch`] bytes.
    pub fn learn(
        &self,
        outlook: &Outlook,
        number: usize,
        count: usize,
        scratch: &mut Arena,
        window: &mut VisibilityTable,
    ) -> Result<WindowGain, OutOfMemory> {
        let mut arena = scratch.scratch();
        let mut glances = Glances::new(&mut arena)?;
        let vertices = outlook.of_window(number);

        // Every other bin has a ray, which speaks for its neighbours. Where light may come from has more.
        let mut squares: Bins = [0.0; _];
        glances.ask((0..squares.len()).filter(|&bin| VisibilityTable::is_black(bin)), 0, outlook, vertices);
        self.send(&mut glances, |bin, light| squares[bin] = light);
        let near = VisibilityTable::smoothed(&VisibilityTable::smoothed(&squares));
        let open = || (0..near.len()).filter(|&bin| near[bin] > 0.0);

        let pixels = self.settings.width as usize * self.settings.height as usize;
        let all = (RAYS_PER_PIXEL * pixels).clamp(RAYS.start, RAYS.end);
        let passes = (all / count.max(1) / open().count().max(1)).clamp(1, PASSES);
        let mut sums: Bins = [0.0; _];
        squares.fill(0.0);
        for pass in 0..passes {
            glances.ask(open(), pass, outlook, vertices);
            self.send(&mut glances, |bin, light| {
                sums[bin] += light / passes as f32;
                squares[bin] += light * light / passes as f32;
            });
        }
        let smooth = VisibilityTable::smoothed(&squares);
        let shares = smooth.map(libm::sqrtf);
        *window = VisibilityTable::new(&shares);

        let bins = sums.len() as f64;
        let mean = |values: &Bins| values.iter().map(|&x| f64::from(x)).sum::<f64>() / bins;
        let seen = mean(&sums);
        if seen <= 0.0 {
            return Ok(WindowGain::default());
        }
        // Second moments, of the light in units of the environment's mean over its square.
        let cosine_sampled = self.context.lights.environment_is_constant() == Some(true);
        let before = if cosine_sampled { seen / 4.0 } else { mean(&smooth) };
        let shares = VisibilityTable::probabilities(&shares);
        let moment = |(&square, &share): (&f32, &f32)| f64::from(square) / f64::from(share);
        let after = smooth.iter().zip(&shares).map(moment).sum::<f64>() / bins / bins;
        let relative = |moment: f64| vertices.len() as f64 * (moment / seen / seen - 1.0).max(0.0);
        Ok(WindowGain { before: relative(before), after: relative(after) })
    }

    /// Follows all rays of `glances`; tells the light, times the cosine, of each bin.
    fn send(&self, glances: &mut Glances, mut tell: impl FnMut(usize, f32)) {
        let (rays, hits) = (&glances.rays[..glances.count], &mut glances.hits[..glances.count]);
        self.context.nearest_batch(rays, Coherence::Incoherent, hits);
        for ((ray, cosine), hit) in rays.iter().zip(&*glances.cosines).zip(&*hits) {
            tell(ray.tag as usize, cosine * self.arriving(ray, hit));
        }
    }

    /// Which part of the light at the end of `ray` arrives, where it first meets `hit`.
    fn arriving(&self, ray: &Ray, hit: &Hit) -> f32 {
        if !hit.is_some() {
            return 1.0;
        }
        if !self.context.has_cutouts {
            return 0.0;
        }
        let Some((rest, transmittance)) = self.context.pass_cutout(ray, hit) else { return 0.0 };
        let light = Rgb::splat(transmittance);
        self.context.transmit(rest, light, &mut 0).unwrap_or_default().x
    }
}
