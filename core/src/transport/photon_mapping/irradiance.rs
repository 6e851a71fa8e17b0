//! Irradiance precomputed at photons (Christensen 1999, "Faster Photon Map Global Illumination"): that of
//! every [`STRIDE`]th photon, from the photons nearest to it.

use crate::bvh::Bvh;
use crate::light::luminance;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::photon::{ALIKE, Kernel, Neighbours, Photon, PhotonMap, QueryDisc, Uniform};
use crate::sampling::mix;
use crate::transport::photon_mapping::density::fence;
use crate::transport::settings::Counters;
use crate::{Level, Rgb};
use glam::Vec3;

/// Of so many photons one gets an irradiance.
pub const STRIDE: usize = 4;

/// Irradiances of one task.
pub const IRRADIANCES: usize = 256;

/// Photons that an irradiance is estimated from.
const NEAREST: usize = 64;

/// Largest distance of the centroid of the light of those photons from the middle of their disc, in radii.
/// Chance puts one in a hundred farther off where all is even; on a straight edge of light it is at 0.42.
const EVEN: f32 = 0.2;

/// The least share of a disc that must be seen: in a slit a few photons would tell of all of it.
const LEAST_SEEN: f32 = 0.1;

/// How far above its surface a photon looks for walls, in radii of its disc: what is lower is no wall.
pub(super) const ABOVE: f32 = 1e-3;

/// Works out the irradiance of photons: a pass over tasks of [`IRRADIANCES`].
#[derive(Clone, Copy)]
pub struct PrecomputedIrradiance<'a> {
    bvh: &'a Bvh<'a>,
    global: &'a PhotonMap<'a>,
    /// Largest radius of a disc.
    farthest: f32,
    kernel: Kernel,
    level: Level,
}

impl<'a> PrecomputedIrradiance<'a> {
    /// For a map of all photons; discs of at most `farthest`.
    pub fn new(
        bvh: &'a Bvh<'a>,
        global: &'a PhotonMap<'a>,
        farthest: f32,
        kernel: Kernel,
        level: Level,
    ) -> Self {
        Self { bvh, global, farthest, kernel, level }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.global.len().div_ceil(STRIDE)
    }

    /// Working memory of one task.
    pub fn scratch() -> Footprint {
        Neighbours::footprint(NEAREST)
    }

    /// Those of task `task`: photons whose power is an irradiance, and which came from where their normal
    /// points if no wall is near, otherwise from the other side. What is not needed of `out` is filled with
    /// photons of no place.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`PrecomputedIrradiance::scratch`] bytes.
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
        let above = ABOVE * disc.radius + 16.0 * f32::EPSILON * place.abs().max_element();
        let turns = (mix(index as u64) >> 40) as f32 / (1u64 << 24) as f32;
        let fence = fence(self.bvh, self.level, (place + above * normal, false), &disc, turns);
        if fence.share(self.kernel, 1.0) < LEAST_SEEN {
            return Photon::NONE;
        }
        if fence.is_open() && !self.is_even(&disc, neighbours) {
            return Photon::NONE;
        }
        let response = Uniform(Rgb::splat(factor));
        let density = self.global.gather_within(self.level, &disc, &fence, &response);
        let tells = if fence.is_open() { normal } else { -normal };
        Photon::new(place, tells, normal, density.radiance)
    }

    /// Whether light comes to `disc`, of those nearest photons, on all sides of its middle alike.
    fn is_even(&self, disc: &QueryDisc, neighbours: &Neighbours) -> bool {
        let (mut sum, mut moment) = (0.0, Vec3::ZERO);
        for photon in neighbours.iter().filter_map(|(index, _)| self.global.get(index)) {
            if photon.normal().dot(disc.normal) >= ALIKE {
                let power = luminance(photon.power());
                sum += power;
                moment += power * (photon.position() - disc.place);
            }
        }
        moment.length() <= EVEN * disc.radius * sum
    }
}
