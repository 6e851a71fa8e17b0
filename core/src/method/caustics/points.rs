//! Points whose irradiance is estimated, as receivers of caustic photons. Their light is the radiance of a
//! surface of mean albedo in their place.

use super::receivers::Receivers;
use crate::bsdf::Features;
use crate::film::{PIXELS_PER_TILE, Pixel, TILE, Tile};
use crate::geometry::MISS;
use crate::light::EmissionSampler;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::method::pilot::PILOT_TILES;
use crate::method::{Executor, RenderContext};
use crate::photon::{Photon, PhotonMap, Photons};
use crate::transport::path::WAVE;
use crate::transport::path::reuse_pilot::SAMPLES;
use crate::transport::photon_mapping::focus::{FOCUS_POINTS, focus_on};
use crate::transport::{
    CausticMerging, Counters, IrradiancePoint, LightEstimator, LightPart, PathIntegrator, Pilot,
    RadiusSchedule,
};
use crate::{Level, Rgb};
use core::f32::consts::PI;
use core::f64;
use glam::Vec3;

/// Radiance per irradiance of a surface of the albedo that benefits of photons assume.
const REFLECTED: f32 = 0.5 / PI;

/// Radius of a kernel in distances between neighbouring points: kernels of neighbours do not overlap.
const RADIUS_IN_STEPS: f32 = 1.0 / 3.0;

/// Largest radius in diagonals of the scene, for points far apart.
const MOST_RADIUS: f32 = 0.005;

/// Points that share the light of photons.
pub struct PointReceivers<'p, 'a, F> {
    integrator: PathIntegrator<'a, F>,
    /// In the order of the film.
    points: &'a [IrradiancePoint],
    part: LightPart,
    map: PhotonMap<'p>,
    radii: RadiusSchedule,
    /// Mean number of points in a kernel around a point.
    in_kernel: f64,
}

impl<'p, 'a, F: Features> PointReceivers<'p, 'a, F> {
    /// Memory of so many points.
    pub fn footprint(points: usize) -> Footprint {
        Photons::footprint(points)
    }

    /// Working memory of a worker in pilots.
    pub fn scratch() -> Footprint {
        PathIntegrator::<F>::scratch_with::<((), CausticMerging), ()>(WAVE).slice::<Pixel>(PIXELS_PER_TILE)
    }

    /// Those of `points` that lie on surfaces; `None` where there are none, or the executor is over.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `arena` has less than [`PointReceivers::footprint`].
    pub fn new(
        context: &RenderContext<'a>,
        (points, part): (&'a [IrradiancePoint], LightPart),
        arena: &mut Arena<'p>,
        executor: &mut impl Executor,
    ) -> Result<Option<Self>, OutOfMemory> {
        let mut photons = Photons::new(points.len(), arena)?;
        for (slot, point) in photons.as_mut_slice().iter_mut().zip(points) {
            let normal = point.geometric_normal.into();
            *slot = match point.triangle {
                MISS => Photon::NONE,
                _ => Photon::new(point.position.into(), normal, normal, Rgb::ZERO),
            };
        }
        let map = photons.build_with(points.len(), executor.fork());
        if executor.is_over() || map.is_empty() {
            return Ok(None);
        }
        let farthest = MOST_RADIUS * context.bvh.bounds().diagonal();
        let radius = median_step(points).map_or(farthest, |step| farthest.min(RADIUS_IN_STEPS * step));
        let radii = RadiusSchedule::constant(radius, &context.bvh.bounds());
        let in_kernel = mean_within(&map, points, radius, context.level);
        Ok(Some(Self { integrator: context.integrator(), points, part, map, radii, in_kernel }))
    }

    fn mean_by<E: LightEstimator<F>>(
        &self,
        integrator: &PathIntegrator<F, E>,
        executor: &mut impl Executor,
    ) -> Result<f32, OutOfMemory> {
        let mean = |pixels: &[Pixel], _: &Counters| {
            let light = pixels.iter().map(|pixel| REFLECTED * pixel.mean().element_sum() / 3.0);
            light.sum::<f32>() / pixels.len().max(1) as f32
        };
        let means = for_pilot_tiles((integrator, 1), (self.points, self.part), executor, mean)?;
        Ok(means.iter().flatten().sum::<f32>() / means.iter().flatten().count().max(1) as f32)
    }

    fn pilot<E: LightEstimator<F>>(
        &self,
        (integrator, mean): (&PathIntegrator<F, E>, f32),
        executor: &mut impl Executor,
    ) -> Result<Pilot, OutOfMemory> {
        let of_tile =
            |pixels: &[Pixel], counters: &Counters| Pilot::of_points(pixels, (REFLECTED, mean), counters);
        let mut pilot = Pilot::default();
        let tiles = for_pilot_tiles((integrator, SAMPLES), (self.points, self.part), executor, of_tile)?;
        tiles.into_iter().flatten().for_each(|tile| pilot += tile);
        Ok(pilot)
    }
}

impl<'a, F: Features> Receivers<'a, F> for PointReceivers<'_, 'a, F> {
    fn radii(&self, _: &RenderContext<'a>) -> RadiusSchedule {
        self.radii
    }

    fn first_radius(&self) -> f64 {
        libm::sqrt(self.in_kernel / f64::consts::PI)
    }

    fn points(&self) -> Option<&PhotonMap<'_>> {
        Some(&self.map)
    }

    fn emission<'m>(
        &self,
        context: &RenderContext<'a>,
        arena: &mut Arena<'m>,
    ) -> Result<EmissionSampler<'m>, OutOfMemory> {
        let (mut positions, mut count) = ([Vec3::ZERO; FOCUS_POINTS], 0);
        for (slot, point) in positions.iter_mut().zip(spread_over(self.points)) {
            (*slot, count) = (self.points.get(point).map_or(*slot, |p| p.position.into()), count + 1);
        }
        context.emission_around(focus_on(&positions[..count]), arena)
    }

    fn mean(&mut self, executor: &mut impl Executor) -> Result<f32, OutOfMemory> {
        self.mean_by(&self.integrator, executor)
    }

    fn mean_beside(&self, merging: CausticMerging, executor: &mut impl Executor) -> Result<f32, OutOfMemory> {
        self.mean_by(&self.integrator.with_caustics(merging), executor)
    }

    fn noise(&self, (mean, _): (f32, bool), executor: &mut impl Executor) -> Result<f64, OutOfMemory> {
        Ok(self.pilot((&self.integrator, mean), executor)?.noise(false))
    }

    fn variance(
        &self,
        photons: Option<CausticMerging>,
        mean: f32,
        executor: &mut impl Executor,
    ) -> Result<Pilot, OutOfMemory> {
        match photons {
            None => self.pilot((&self.integrator, mean), executor),
            Some(photons) => self.pilot((&self.integrator.with_caustics(photons), mean), executor),
        }
    }

    fn has_reuse(&self) -> bool {
        false
    }
}

/// Runs `work` on the pixels of tiles that are spread over the film of `points`, with `samples` of each.
pub(in crate::method) fn for_pilot_tiles<F: Features, E: LightEstimator<F>, T: Send + Copy>(
    (integrator, samples): (&PathIntegrator<F, E>, u32),
    (points, part): (&[IrradiancePoint], LightPart),
    executor: &mut impl Executor,
    work: impl Fn(&[Pixel], &Counters) -> T + Sync,
) -> Result<[Option<T>; PILOT_TILES], OutOfMemory> {
    let mut out = [None; PILOT_TILES];
    let tiles = points.len().div_ceil(PIXELS_PER_TILE);
    let spread = Tile::spread_over(TILE, TILE * tiles as u32, PILOT_TILES).zip(out.iter_mut());
    let _ = executor.pass(spread, |_, (tile, out), worker| {
        let of_tile = points.chunks(PIXELS_PER_TILE).nth(tile).unwrap_or_default();
        let mut arena = worker.scratch.scratch();
        let pixels = arena.slice::<Pixel>(of_tile.len())?;
        pixels.fill(Pixel::default());
        let counters = integrator.sample_irradiance((of_tile, part), 0..samples, WAVE, &mut arena, pixels)?;
        *out = Some(work(pixels, &counters));
        Ok(Counters::default())
    })?;
    Ok(out)
}

/// Numbers of at most [`FOCUS_POINTS`] of `points`, evenly spread.
fn spread_over(points: &[IrradiancePoint]) -> impl Iterator<Item = usize> {
    (0..points.len()).step_by(points.len().div_ceil(FOCUS_POINTS).max(1))
}

/// Median distance of a point to the nearest one elsewhere in its tile; `None` where all are in one place.
pub(in crate::method) fn median_step(points: &[IrradiancePoint]) -> Option<f32> {
    let (mut steps, mut count) = ([f32::INFINITY; FOCUS_POINTS], 0);
    for (slot, number) in steps.iter_mut().zip(spread_over(points)) {
        let of_tile = points.chunks(PIXELS_PER_TILE).nth(number / PIXELS_PER_TILE).unwrap_or_default();
        let position = Vec3::from(points.get(number)?.position);
        let squared = of_tile.iter().map(|other| position.distance_squared(other.position.into()));
        *slot = libm::sqrtf(squared.filter(|square| *square > 0.0).fold(f32::INFINITY, f32::min));
        count += 1;
    }
    let middle = *steps.get_mut(..count)?.select_nth_unstable_by(count / 2, f32::total_cmp).1;
    middle.is_finite().then_some(middle)
}

/// Mean number of points of `map` within `radius` of one of `points` on a surface.
fn mean_within(map: &PhotonMap, points: &[IrradiancePoint], radius: f32, level: Level) -> f64 {
    let (mut sum, mut count) = (0, 0);
    for point in spread_over(points).filter_map(|number| points.get(number)).filter(|p| p.triangle != MISS) {
        sum += map.within(level, point.position.into(), radius, &mut []).max(1);
        count += 1;
    }
    if count == 0 { 1.0 } else { f64::from(sum as u32) / f64::from(count) }
}
