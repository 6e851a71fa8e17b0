//! Density estimate fused with the traversal: photons are weighted in their leaves, sixteen at a time, and
//! never listed (Jensen 1996, with the disc of Jensen 2001, section 7.2).
//!
//! L = sum over photons of f(w_p) Phi_p k(d / r) / (pi r²). The sphere around a place also holds photons of
//! other surfaces: behind a thin wall, around an edge, on the other side of a leaf. Three tests reject them:
//! 1. the photon lies in a flat disc, near the tangent plane of the place;
//! 2. the normal at the photon is close to the normal of the place;
//! 3. the photon arrived from the side to which the normal points.
//!
//! With a limit of length, a fourth rejects photons whose path would become too long.
//!
//! The tests need no normalised vectors: octahedral coordinates are integers, and the tests compare squares.
//!
//! The same traversal also estimates the density over finer discs, of half the radius and less. They serve
//! places where photons are dense, and they show the blur of the whole disc
//! (`docs/decisions/photon-map.md`).

use super::PhotonMap;
use super::kernel::{Kernel, QueryDisc};
use super::kernel_boundary::{KernelBoundary, splat};
use super::layout::{HALVES, Leaf};
use super::range::{Visit, leaves_within};
use super::record::{DIRECTION_BITS, DIRECTION_STEPS, NORMAL_STEPS, POWER_BITS, REMAINING_BITS};
use crate::Rgb;
use core::f32::consts::PI;
use glam::Vec3;
use halflight_simd::kernels::points::{Place16, squared};
use halflight_simd::{Kernel as SimdKernel, Lanes, Mask, Simd, dot};

/// Largest distance of a photon from the plane of its disc, in radii: the sagitta of a surface whose radius
/// of curvature is 2.5 times as large.
pub const FLATNESS: f32 = 0.2;

/// Cosine of the largest angle between the normals of a disc and of a photon in it.
pub const MIN_NORMAL_COSINE: f32 = 0.7;

/// Number of finer discs, each of half the radius of the previous one.
pub const FINER_DISCS: usize = 3;

/// Response of a surface to light from a direction: its BSDF towards the camera, without a cosine.
pub trait Response {
    /// True if the response is the same for all directions.
    const UNIFORM: bool = false;
    /// Response to light from the unit vector `direction`, which points away from the surface.
    fn of(&self, direction: Vec3) -> Rgb;
}

impl<F: Fn(Vec3) -> Rgb> Response for F {
    fn of(&self, direction: Vec3) -> Rgb {
        self(direction)
    }
}

/// Response that is the same for all directions: a / pi for a diffuse surface of albedo a; 1 for irradiance.
#[derive(Clone, Copy, Debug)]
pub struct Uniform(pub Rgb);

impl Response for Uniform {
    const UNIFORM: bool = true;
    fn of(&self, _: Vec3) -> Rgb {
        self.0
    }
}

/// Result of a density estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DensityEstimate {
    /// Response times power per area: W/(m² sr), or W/m² for a response of 1.
    pub radiance: Rgb,
    /// Estimates of the finer discs: less blur, more noise.
    pub finer: [Rgb; FINER_DISCS],
    /// Number of photons on the disc.
    pub photons: u32,
}

impl DensityEstimate {
    /// Radiance of the finest disc that has at least `min_photons` photons, assuming even density, and of the
    /// disc of half its radius. For the finest disc the second value is extrapolated: blur falls with the
    /// square of the radius.
    #[inline]
    pub fn of_finest_disc(&self, min_photons: f32) -> [Rgb; 2] {
        let (mut chosen, mut photons) = (self.radiance, self.photons as f32);
        let mut wider = chosen;
        for finer in self.finer {
            photons *= 0.25;
            if photons < min_photons {
                return [chosen, finer];
            }
            (wider, chosen) = (chosen, finer);
        }
        [chosen, chosen - (wider - chosen) * 0.25]
    }
}

/// Kernel of one density estimate.
pub(super) struct Gather<'a, 'm, R> {
    pub map: &'a PhotonMap<'m>,
    pub disc: &'a QueryDisc,
    pub boundary: Option<&'a KernelBoundary>,
    pub response: &'a R,
}

impl<R: Response> SimdKernel for Gather<'_, '_, R> {
    type Out = DensityEstimate;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> DensityEstimate {
        gather(simd, self.map, self.disc, self.boundary, self.response)
    }
}

/// Density over a disc and its finer discs.
#[inline(always)]
pub(super) fn gather<S: Simd, R: Response>(
    simd: S,
    map: &PhotonMap,
    disc: &QueryDisc,
    boundary: Option<&KernelBoundary>,
    response: &R,
) -> DensityEstimate {
    let Some(test) = DiscTest::new(simd, map, disc, boundary) else { return DensityEstimate::default() };
    let DiscTest { place, squared_radius, .. } = test;
    let mut sum = Sum {
        test,
        disc: KernelSum::new(simd, squared_radius, disc.kernel),
        finer: [
            KernelSum::new(simd, squared_radius / 4.0, disc.kernel),
            KernelSum::new(simd, squared_radius / 16.0, disc.kernel),
            KernelSum::new(simd, squared_radius / 64.0, disc.kernel),
        ],
        response,
    };
    leaves_within(simd, map, &place, squared_radius, &mut sum);
    let radiance = sum.disc.density((disc, 1.0), boundary, response);
    let mut density =
        DensityEstimate { radiance, finer: [Rgb::ZERO; FINER_DISCS], photons: sum.disc.photons };
    let mut part = 1.0;
    for (finer, radiance) in sum.finer.iter().zip(&mut density.finer) {
        part *= 0.5;
        *radiance = finer.density((disc, part), boundary, response);
    }
    density
}

/// Sum in the order of the lanes, which has the same bits at every level.
#[inline(always)]
fn sum_of_lanes(lanes: [f32; 16]) -> f32 {
    lanes.iter().fold(0.0, |sum, lane| sum + lane)
}

/// Test for the photons that lie on a disc.
pub(super) struct DiscTest<'a, S: Simd> {
    pub place: Place16<S>,
    pub squared_radius: f32,
    limit: S::F16,
    normal: [S::F16; 3],
    thickness: S::F16,
    /// Least number of segments that the path of a photon has left; `None` if any will do.
    remaining: Option<S::F16>,
    boundary: Option<&'a KernelBoundary>,
}

/// Squared distances to the centre of a disc, directions of arrival, and mask of the photons that count.
type OnDisc<S> = (<S as Simd>::F16, [<S as Simd>::F16; 3], <<S as Simd>::F16 as Lanes>::Mask);

impl<'a, S: Simd> DiscTest<'a, S> {
    /// Test for photons of `map`; `None` if the radius is not finite and positive.
    #[inline(always)]
    pub(super) fn new(
        simd: S,
        map: &PhotonMap,
        disc: &QueryDisc,
        boundary: Option<&'a KernelBoundary>,
    ) -> Option<Self> {
        let squared_radius = map.space.squared_to_map(disc.radius).unwrap_or(-1.0);
        (squared_radius > 0.0 && squared_radius < f32::MAX).then(|| Self {
            place: Place16::new(simd, map.space.to_map(disc.place.to_array())),
            squared_radius,
            limit: simd.splat16(squared_radius),
            normal: splat(simd, disc.normal),
            thickness: simd.splat16(FLATNESS * libm::sqrtf(squared_radius)),
            remaining: (map.least_remaining > 0).then(|| simd.splat16(map.least_remaining as f32)),
            boundary,
        })
    }

    /// Photons of half a leaf; `None` if none is on the disc.
    #[inline(always)]
    pub(super) fn photons(&self, simd: S, leaf: &Leaf, half: usize) -> Option<OnDisc<S>> {
        let offset = self.place.less(simd, leaf.half(half));
        let distance = squared(offset);
        let in_sphere = distance.le(self.limit);
        if !in_sphere.any() {
            return None;
        }
        let zero = simd.splat16(0.0);
        let in_disc = in_sphere & dot(offset, self.normal).abs().le(self.thickness);

        let [a, b] = &leaf.normal;
        let (a, b) = (simd.bytes16(&a[half % HALVES]), simd.bytes16(&b[half % HALVES]));
        let surface = unfolded(simd, a, b, NORMAL_STEPS);
        let along = dot(surface, self.normal);
        let alike = zero.lt(along)
            & (squared(surface) * simd.splat16(MIN_NORMAL_COSINE * MIN_NORMAL_COSINE)).le(along * along);

        let light = &leaf.light[half % HALVES];
        let u = simd.field16(light, 0, DIRECTION_BITS);
        let v = simd.field16(light, DIRECTION_BITS, DIRECTION_BITS);
        let came = unfolded(simd, u, v, DIRECTION_STEPS);
        let counted = in_disc & alike & zero.lt(dot(came, self.normal));
        let counted = match self.boundary {
            Some(boundary) => counted & boundary.contains(simd, offset, distance, self.squared_radius),
            None => counted,
        };
        let counted = match self.remaining {
            Some(least) => {
                let power = &leaf.power[half % HALVES];
                let low = simd.field16(power, 0, REMAINING_BITS);
                let high = simd.field16(power, POWER_BITS, REMAINING_BITS);
                counted & least.le(low + high * simd.splat16((1 << REMAINING_BITS) as f32))
            }
            None => counted,
        };
        counted.any().then_some((distance, came, counted))
    }
}

/// Sums of one density estimate, in lanes.
struct Sum<'a, S: Simd, R> {
    test: DiscTest<'a, S>,
    disc: KernelSum<S>,
    finer: [KernelSum<S>; FINER_DISCS],
    response: &'a R,
}

/// Kernel-weighted sum over the photons of one disc.
struct KernelSum<S: Simd> {
    /// Squared radius.
    limit: S::F16,
    /// One over the squared radius.
    reciprocal: S::F16,
    kernel: Kernel,
    /// Weighted power of a uniform response, lane by lane, without the response.
    lanes: [S::F16; 3],
    /// Weighted power times response of a response that depends on direction.
    singles: Rgb,
    photons: u32,
}

impl<S: Simd, R: Response> Visit<S> for Sum<'_, S, R> {
    #[inline(always)]
    fn leaf(&mut self, simd: S, _: usize, leaf: &Leaf) {
        for half in 0..HALVES {
            self.add(simd, leaf, half);
        }
    }
}

impl<S: Simd, R: Response> Sum<'_, S, R> {
    /// Adds the photons of half a leaf.
    #[inline(always)]
    fn add(&mut self, simd: S, leaf: &Leaf, half: usize) {
        let Some((distance, came, counted)) = self.test.photons(simd, leaf, half) else { return };
        let light = &leaf.light[half % HALVES];
        let power = &leaf.power[half % HALVES];
        let scale = simd.powers16(light);
        let blue = simd.field16(power, 2 * POWER_BITS, POWER_BITS - 1);
        let photons = Photons16 {
            distance,
            scale,
            power: [
                simd.field16(power, 0, POWER_BITS),
                simd.field16(power, POWER_BITS, POWER_BITS),
                blue + blue,
            ],
            came,
        };
        self.disc.add(simd, &photons, counted, self.response);
        let mut counted = counted;
        for finer in &mut self.finer {
            counted = counted & distance.le(finer.limit);
            if !counted.any() {
                return;
            }
            finer.add(simd, &photons, counted, self.response);
        }
    }
}

/// Sixteen photons, unpacked.
struct Photons16<S: Simd> {
    /// Squared distance to the centre of the disc.
    distance: S::F16,
    /// Unit of the power, from the common exponent.
    scale: S::F16,
    /// Mantissas of the power.
    power: [S::F16; 3],
    /// Directions of arrival, in whole steps.
    came: [S::F16; 3],
}

impl<S: Simd> KernelSum<S> {
    /// Empty sum of a disc of this squared radius.
    #[inline(always)]
    fn new(simd: S, squared_radius: f32, kernel: Kernel) -> Self {
        Self {
            limit: simd.splat16(squared_radius),
            reciprocal: simd.splat16((1.0 / squared_radius).min(f32::MAX)),
            kernel,
            lanes: [simd.splat16(0.0); 3],
            singles: Rgb::ZERO,
            photons: 0,
        }
    }

    /// Adds those of `photons` that are `counted`.
    #[inline(always)]
    fn add<R: Response>(
        &mut self,
        simd: S,
        photons: &Photons16<S>,
        counted: <S::F16 as Lanes>::Mask,
        response: &R,
    ) {
        let mut bits = counted.bits();
        self.photons += bits.count_ones();
        let weight = kernel_weight(simd, self.kernel, photons.distance * self.reciprocal) * photons.scale;
        let weight = weight.select(counted, simd.splat16(0.0));
        let [red, green, blue] = photons.power;
        let (red, green, blue) = (red * weight, green * weight, blue * weight);
        if R::UNIFORM {
            let [r, g, b] = self.lanes;
            self.lanes = [r + red, g + green, b + blue];
            return;
        }
        let [x, y, z] = photons.came;
        let (x, y, z) = (x.to_array(), y.to_array(), z.to_array());
        let (r, g, b) = (red.to_array(), green.to_array(), blue.to_array());
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize % 16;
            let direction = Vec3::new(x[lane], y[lane], z[lane]).normalize_or(Vec3::Z);
            self.singles += Rgb::new(r[lane], g[lane], b[lane]) * response.of(direction);
            bits &= bits - 1;
        }
    }

    /// Density over the disc of `part` of the radius of `disc`.
    #[inline(always)]
    fn density<R: Response>(
        &self,
        (disc, part): (&QueryDisc, f32),
        boundary: Option<&KernelBoundary>,
        response: &R,
    ) -> Rgb {
        if self.photons == 0 {
            return Rgb::ZERO;
        }
        let [r, g, b] = self.lanes;
        let total =
            Rgb::new(sum_of_lanes(r.to_array()), sum_of_lanes(g.to_array()), sum_of_lanes(b.to_array()));
        let responded = if R::UNIFORM { total * response.of(disc.normal) } else { self.singles };
        let seen = boundary.map_or(1.0, |boundary| boundary.visible_fraction(disc.kernel, part));
        let radius = part * disc.radius;
        let per_area = if seen > 0.0 { 1.0 / (PI * seen * radius) / radius } else { 0.0 };
        responded * per_area
    }
}

/// Kernel weights by squared distance, in squared radii.
#[inline(always)]
pub(super) fn kernel_weight<S: Simd>(simd: S, kernel: Kernel, squared: S::F16) -> S::F16 {
    let one = simd.splat16(1.0);
    // Rounding must not make a weight negative.
    let squared = squared.min(one);
    match kernel {
        Kernel::Constant => one,
        Kernel::Cone => simd.splat16(3.0) * (one - squared.sqrt()),
        Kernel::Epanechnikov => simd.splat16(2.0) * (one - squared),
    }
}

/// Directions of points of the octahedral grid, in whole steps.
#[inline(always)]
fn unfolded<S: Simd>(simd: S, u: S::F16, v: S::F16, steps: f32) -> [S::F16; 3] {
    let (zero, steps) = (simd.splat16(0.0), simd.splat16(steps));
    let (u, v) = (u - steps, v - steps);
    let z = (steps - u.abs()) - v.abs();
    let folded = (-z).max(zero);
    [(u + folded).select(u.lt(zero), u - folded), (v + folded).select(v.lt(zero), v - folded), z]
}
