//! Points of primary sample space: the random numbers of a path, by the choices that they serve.

use crate::sampling::{Numbers, Random, Sampler};
use crate::transport::walk::dimension;
use crate::transport::walk::shading::VertexNumbers;

/// Numbers that a point stores at most.
pub(in crate::transport) const NUMBERS: usize = 128;

/// Slots of a point that every path has.
const PIXEL: usize = 0;
const LENS: usize = 2;

/// Slots of a point that makes one technique of a path: its choice, a light sample, the emission of light.
pub(super) const TECHNIQUE: usize = 4;
const LIGHT_CHOICE: usize = 5;
const LIGHT: usize = 6;
const EMISSION_PLACE: usize = 8;
const EMISSION_DIRECTION: usize = 10;
const EMISSION_CHOICE: usize = 12;

/// The first slot of the vertices, and the slots of each: directions in which the camera subpath and the
/// light subpath leave their n-th vertex, and lobes of both.
const VERTICES: usize = 14;
const VERTEX: usize = 6;

/// The same of a point that makes a whole path of path tracing: direction, point on a light, lobe, choice of
/// the light, roulette.
const PATH_VERTICES: usize = 4;
const PATH_VERTEX: usize = 8;

/// Slots of a technique of paths of `segments` segments.
pub(super) const fn slots_of_technique(segments: u32) -> usize {
    let slots = VERTICES + VERTEX * segments.saturating_sub(1) as usize;
    if slots < NUMBERS { slots } else { NUMBERS }
}

/// Slots of a path of path tracing: those of its first 12 vertices. Later ones are drawn anew.
pub(super) const SLOTS_OF_PATH: usize = PATH_VERTICES + 12 * PATH_VERTEX;

/// The numbers of a point that make one subpath from a vertex on; vertex 0 is its start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tail {
    pub from_light: bool,
    pub first: u32,
}

impl Tail {
    /// True if `slot` of a technique belongs to it. A light sample is at the end of a camera subpath.
    pub(super) fn has_slot_of_technique(self, slot: usize) -> bool {
        let (from_light, vertex) = match slot {
            PIXEL..TECHNIQUE => (false, 0),
            TECHNIQUE => return false,
            LIGHT_CHOICE..EMISSION_PLACE => (false, u32::MAX),
            EMISSION_PLACE..VERTICES => (true, 0),
            _ => {
                let vertex = (slot - VERTICES) / VERTEX;
                (matches!((slot - VERTICES) % VERTEX, 2 | 3 | 5), vertex as u32 + 1)
            }
        };
        from_light == self.from_light && vertex >= self.first
    }

    /// The same of a path of path tracing.
    pub(super) fn has_slot_of_path(self, slot: usize) -> bool {
        let vertex = if slot < PATH_VERTICES { 0 } else { (slot - PATH_VERTICES) / PATH_VERTEX + 1 };
        vertex as u32 >= self.first
    }
}

/// Slots of the place in the picture.
pub(super) const PLACE_IN_PICTURE: usize = LENS - PIXEL;

/// Dimension of numbers beyond the slots of a point, of which one is drawn anew with each proposal.
const BEYOND: u32 = 1 << 20;

/// Dimensions of surfaces with a cut-out, of the camera subpath and of the light subpath.
const CAMERA_CROSSING: u32 = 1 << 21;
const LIGHT_CROSSING: u32 = 1 << 22;

/// A source of numbers beyond the slots.
#[derive(Clone, Copy, Debug)]
pub(super) enum Source {
    /// Numbers of a point of a sequence.
    Sequence(Sampler),
    /// Numbers of a mutation.
    Mutation(Random),
}

/// A point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point<'p> {
    pub numbers: &'p [f32],
    pub source: Source,
}

impl Point<'_> {
    #[inline]
    fn draw(&self, dimension: u32) -> f32 {
        match &self.source {
            Source::Sequence(sampler) => sampler.single(dimension),
            Source::Mutation(random) => random.single(dimension),
        }
    }

    #[inline]
    fn at(&self, slot: usize) -> f32 {
        self.numbers.get(slot).copied().unwrap_or_else(|| self.draw(BEYOND + slot as u32))
    }

    #[inline]
    fn two(&self, slot: usize) -> [f32; 2] {
        [self.at(slot), self.at(slot + 1)]
    }

    pub(super) fn pixel(&self) -> [f32; 2] {
        self.two(PIXEL)
    }

    pub(super) fn lens(&self) -> [f32; 2] {
        self.two(LENS)
    }

    /// Point on a light and choice of the light, for the only light sample of a technique.
    pub(super) fn light_sample(&self) -> [f32; 3] {
        let [u, v] = self.two(LIGHT);
        [u, v, self.at(LIGHT_CHOICE)]
    }

    /// Direction and lobe at the vertex at the end of the `n`th segment of a camera or light subpath.
    pub(super) fn scattering(&self, n: u32, from_light: bool) -> [f32; 3] {
        let vertex = VERTICES + VERTEX * (n as usize - 1);
        let side = usize::from(from_light);
        let [u, v] = self.two(vertex + 2 * side);
        [u, v, self.at(vertex + 4 + side)]
    }

    /// Number of a surface with a cut-out after `n` others, scattered at or passed.
    pub(super) fn opacity(&self, n: u32, from_light: bool) -> f32 {
        self.draw(n + if from_light { LIGHT_CROSSING } else { CAMERA_CROSSING })
    }
}

/// The numbers of emission, by the dimensions of `light/emission`.
pub(super) struct EmissionNumbers<'p>(pub Point<'p>);

impl EmissionNumbers<'_> {
    fn slot(dimension: u32) -> usize {
        match dimension {
            0 => EMISSION_CHOICE,
            1 => EMISSION_PLACE,
            _ => EMISSION_DIRECTION,
        }
    }
}

impl Numbers for EmissionNumbers<'_> {
    fn single(&self, dimension: u32) -> f32 {
        self.0.at(Self::slot(dimension))
    }

    fn pair(&self, dimension: u32) -> [f32; 2] {
        self.0.two(Self::slot(dimension))
    }
}

/// The numbers of a whole path of path tracing.
pub(super) trait PathNumbers {
    /// Point of the lens.
    fn lens(&self) -> [f32; 2];
    /// Point on a light and choice of the light, at the vertex at the end of the `n`th segment.
    fn light(&self, n: u32) -> [f32; 3];
    /// Direction and lobe there.
    fn scattering(&self, n: u32) -> [f32; 3];
    /// Russian roulette there.
    fn roulette(&self, n: u32) -> f32;
    /// A surface with a cut-out after `n` others, scattered at or passed.
    fn opacity(&self, n: u32) -> f32;
    /// All numbers of a light sample and of scattering at the vertex at the end of the `n`th segment.
    fn vertex(&self, n: u32) -> VertexNumbers;
}

/// The numbers of a path of a pixel.
pub(super) struct PixelNumbers {
    sampler: Sampler,
    place: (u64, u32),
}

impl PixelNumbers {
    /// Those of sample number `sample` of `pixel` in the picture of `seed`.
    pub(super) fn new(seed: u32, pixel: u32, sample: u32) -> Self {
        Self { sampler: Sampler::new(seed, pixel, sample), place: Sampler::place(seed, pixel, sample) }
    }

    /// Position in the pixel.
    pub(super) fn pixel(&self) -> [f32; 2] {
        self.sampler.pair(dimension::PIXEL)
    }
}

impl PathNumbers for PixelNumbers {
    fn lens(&self) -> [f32; 2] {
        self.sampler.pair(dimension::LENS)
    }

    fn light(&self, n: u32) -> [f32; 3] {
        dimension::light_sample(&self.sampler, n)
    }

    fn scattering(&self, n: u32) -> [f32; 3] {
        dimension::bsdf_sample(&self.sampler, n)
    }

    fn roulette(&self, n: u32) -> f32 {
        self.sampler.single(dimension::vertex(n) + dimension::ROULETTE)
    }

    fn opacity(&self, n: u32) -> f32 {
        self.sampler.single(dimension::CROSSING + n)
    }

    fn vertex(&self, _: u32) -> VertexNumbers {
        VertexNumbers::Sequence(self.place)
    }
}

/// The slot of a path's vertex.
const fn path_vertex(n: u32) -> usize {
    PATH_VERTICES + PATH_VERTEX * (n as usize - 1)
}

impl PathNumbers for Point<'_> {
    fn lens(&self) -> [f32; 2] {
        self.two(LENS)
    }

    fn light(&self, n: u32) -> [f32; 3] {
        let vertex = path_vertex(n);
        let [u, v] = self.two(vertex + 2);
        [u, v, self.at(vertex + 5)]
    }

    fn scattering(&self, n: u32) -> [f32; 3] {
        let vertex = path_vertex(n);
        let [u, v] = self.two(vertex);
        [u, v, self.at(vertex + 4)]
    }

    fn roulette(&self, n: u32) -> f32 {
        self.at(path_vertex(n) + 6)
    }

    fn opacity(&self, n: u32) -> f32 {
        self.opacity(n, false)
    }

    fn vertex(&self, n: u32) -> VertexNumbers {
        VertexNumbers::Given {
            light: Some(self.light(n)),
            scattering: Some(PathNumbers::scattering(self, n)),
        }
    }
}
