//! Irradiance precomputed at photons (Christensen 1999, "Faster Photon Map Global Illumination"): at every
//! [`STRIDE`]th photon, from the nearest photons.

use crate::bvh::Bvh;
use crate::light::luminance;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::photon::{Kernel, MIN_NORMAL_COSINE, Neighbours, Photon, PhotonMap, QueryDisc, Uniform};
use crate::sampling::mix;
use crate::transport::photon_mapping::density::kernel_boundary;
use crate::transport::settings::Counters;
use crate::{Level, Rgb};
use glam::Vec3;

/// Number of photons per irradiance.
pub const STRIDE: usize = 4;

/// Number of irradiances of one task.
pub const IRRADIANCES: usize = 256;

/// Number of photons of an irradiance estimate.
const NEAREST: usize = 64;

/// Maximum distance of the light's centroid of these photons from the centre of their disc, in radii. In even
/// light one of a hundred exceeds it by chance; at a straight edge of light it is 0.42.
const MAX_CENTROID_OFFSET: f32 = 0.2;

/// Minimum visible fraction of a disc: in a slit, a few photons would stand for all of it.
const MIN_VISIBLE_FRACTION: f32 = 0.1;

/// Height of the visibility test above the surface, in radii of the disc; lower obstacles are no walls.
pub(super) const TEST_HEIGHT: f32 = 1e-3;

/// Precomputation of irradiance at photons: a pass of tasks of [`IRRADIANCES`].
#[derive(Clone, Copy)]
pub struct PrecomputedIrradiance<'a> {
    bvh: Bvh<'a>,
    global: &'a PhotonMap<'a>,
    /// Maximum radius of a disc.
    farthest: f32,
    kernel: Kernel,
    level: Level,
}

impl<'a> PrecomputedIrradiance<'a> {
    /// Irradiances of `global`, a map of all photons, over discs of radius at most `farthest`.
    pub fn new(
        bvh: &Bvh<'a>,
        global: &'a PhotonMap<'a>,
        farthest: f32,
        kernel: Kernel,
        level: Level,
    ) -> Self {
        Self { bvh: *bvh, global, farthest, kernel, level }
    }

    /// Number of irradiances.
    pub fn count(&self) -> usize {
        self.global.len().div_ceil(STRIDE)
    }

    /// Scratch memory of one task.
    pub fn scratch() -> Footprint {
        Neighbours::footprint(NEAREST)
    }

    /// Irradiances of task `task`, as photons whose power is the irradiance. Their direction is the normal if
    /// no wall is near, otherwise the opposite. Fills the rest of `out` with photons without position.
    ///
    /// # Errors
    /// [`OutOfMemory`] if `scratch` has less than [`PrecomputedIrradiance::scratch`] bytes.
    #[inline(never)]
    pub fn run(&self, task: usize, scratch: &mut Arena, out: &mut [Photon]) -> Result<Counters, OutOfMemory> {
        let mut arena = scratch.scratch();
        let mut neighbours = Neighbours::new(NEAREST, &mut arena)?;
        for (i, slot) in out.iter_mut().enumerate() {
            let index = (task * IRRADIANCES + i) * STRIDE;
            let photon = u32::try_from(index).ok().and_then(|index| self.global.get(index));
            *slot = photon.map_or(Photon::NONE, |photon| self.at(&photon, index, &mut neighbours));
        }
        Ok(Counters::default())
    }

    fn at(&self, photon: &Photon, index: usize, neighbours: &mut Neighbours) -> Photon {
        let (place, normal) = (photon.position(), photon.normal());
        let (disc, factor) =
            self.global.disc_of_nearest(self.level, (place, normal), self.farthest, self.kernel, neighbours);
        let above = TEST_HEIGHT * disc.radius + 16.0 * f32::EPSILON * place.abs().max_element();
        let rotation = (mix(index as u64) >> 40) as f32 / (1u64 << 24) as f32;
        let boundary =
            kernel_boundary(&self.bvh, self.level, (place + above * normal, false), &disc, rotation);
        if boundary.visible_fraction(self.kernel, 1.0) < MIN_VISIBLE_FRACTION {
            return Photon::NONE;
        }
        if boundary.is_open() && !self.is_even(&disc, neighbours) {
            return Photon::NONE;
        }
        let response = Uniform(Rgb::splat(factor));
        let density = self.global.gather_within(self.level, &disc, &boundary, &response);
        let direction = if boundary.is_open() { normal } else { -normal };
        Photon::new(place, direction, normal, density.radiance)
    }

    /// True if the light of the nearest photons on `disc` is even around its centre.
    fn is_even(&self, disc: &QueryDisc, neighbours: &Neighbours) -> bool {
        let (mut sum, mut moment) = (0.0, Vec3::ZERO);
        for photon in neighbours.iter().filter_map(|(index, _)| self.global.get(index)) {
            if photon.normal().dot(disc.normal) >= MIN_NORMAL_COSINE {
                let power = luminance(photon.power());
                sum += power;
                moment += power * (photon.position() - disc.place);
            }
        }
        moment.length() <= MAX_CENTROID_OFFSET * disc.radius * sum
    }
}
