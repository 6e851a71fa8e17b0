//! Photon in 22 bytes: exact position, direction of arrival, power, and surface normal.
//!
//! Unit vectors are octahedral (Cigolle et al. 2014, "A Survey of Efficient Representations for Independent
//! Unit Vectors") on odd grids, which represent the axes exactly. The direction has 12 bits a side, error
//! below 0.06 degrees; the normal 8 bits, error below a degree. The channels of the power share an exponent
//! (Ward 1991, "Real Pixels") and have 11, 11 and 10 bits; the error is below 0.05 % of the largest channel,
//! 0.1 % in blue.
//!
//! With a limit of path length, the two lowest bits of red and of green hold the number of segments
//! that the path has left. Red and green then have an error below 0.35 % of the largest channel, without
//! bias.

use crate::Rgb;
use crate::sampling::mix;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Steps from the centre to the end of a side of the grid, of directions and of normals.
pub(super) const DIRECTION_STEPS: f32 = 2047.0;
pub(super) const NORMAL_STEPS: f32 = 127.0;

/// Bits of a side of the grid of directions.
pub(super) const DIRECTION_BITS: u32 = 12;

/// Mantissa bits of red and green; blue has one less.
pub(super) const POWER_BITS: u32 = 11;

/// Low bits of red, and of green, of the number of segments that a path has left.
pub(super) const REMAINING_BITS: u32 = 2;

/// Largest number of remaining segments that a photon stores; it stands for larger ones, too.
pub const MOST_REMAINING: u32 = (1 << (2 * REMAINING_BITS)) - 1;

/// Photon stored on a surface.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, packed(2))]
pub struct Photon {
    pub(super) position: [f32; 3],
    /// Direction in the low 24 bits, exponent of the power in the high eight.
    pub(super) light: u32,
    /// Mantissas of red, green, blue from the lowest bit on.
    pub(super) power: u32,
    pub(super) normal: [u8; 2],
}

const _: () = assert!(size_of::<Photon>() == 22);

impl Photon {
    /// Photon without a position, which maps reject.
    pub const NONE: Photon = Photon { position: [f32::NAN; 3], light: 0, power: 0, normal: [0; 2] };

    /// Photon of `power` (W per channel) from `direction`, which points away from the surface. Negative and
    /// NaN channels count as zero, and so does a power below 1e-35 W. `direction` and `normal` may have any
    /// length.
    pub fn new(position: Vec3, direction: Vec3, normal: Vec3, power: Rgb) -> Self {
        let [u, v] = octahedral(direction, DIRECTION_STEPS);
        let [a, b] = octahedral(normal, NORMAL_STEPS);
        let (exponent, mantissas) = shared_exponent(power);
        Self {
            position: position.to_array(),
            light: u | v << DIRECTION_BITS | exponent << 24,
            power: mantissas,
            normal: [a as u8, b as u8],
        }
    }

    /// Photon that stores a `tag`, an index into other data, in place of its power.
    pub fn tagged(position: Vec3, direction: Vec3, normal: Vec3, tag: u32) -> Self {
        Self { power: tag, ..Self::new(position, direction, normal, Rgb::ZERO) }
    }

    /// The tag of a photon made by [`Photon::tagged`].
    pub fn tag(&self) -> u32 {
        self.power
    }

    /// This photon with another `power`.
    pub(crate) fn with_power(self, power: Rgb) -> Self {
        let (exponent, mantissas) = shared_exponent(power);
        Self { light: self.light & !(0xff << 24) | exponent << 24, power: mantissas, ..self }
    }

    /// This photon with the number of `segments` that its path has left behind it. The mean of its power is
    /// kept over many photons: red and green are rounded up or down by chance.
    pub(crate) fn with_remaining(self, segments: u32) -> Self {
        const STEPS: u32 = 1 << REMAINING_BITS;
        const MOST: u32 = (1 << POWER_BITS) - 1;
        let [x, y, z, way] = self.key().map(u64::from);
        let random = mix(mix(x | y << 32) ^ (z | way << 32) ^ u64::from(self.power));
        let segments = segments.min(MOST_REMAINING);
        let fields = [(0, segments % STEPS, 20), (POWER_BITS, segments / STEPS, 40)];
        let power = fields.iter().fold(self.power, |power, &(from, bits, random_from)| {
            let mantissa = power >> from & MOST;
            let chance = (random >> random_from) as u32 % STEPS;
            // The next value above or below with these lowest bits.
            let above = (mantissa + STEPS - 1 - bits) / STEPS * STEPS + bits;
            let is_above = above < STEPS || above <= MOST && chance >= above - mantissa;
            let rounded = if is_above { above } else { above - STEPS };
            power & !(MOST << from) | rounded << from
        });
        Self { power, ..self }
    }

    /// Number of segments that the path has left, of [`Photon::with_remaining`].
    pub(crate) fn remaining(&self) -> u32 {
        let side = (1 << REMAINING_BITS) - 1;
        self.power & side | (self.power >> POWER_BITS & side) << REMAINING_BITS
    }

    /// Bits of position and direction.
    pub(crate) fn key(&self) -> [u32; 4] {
        let [x, y, z] = self.position;
        [x.to_bits(), y.to_bits(), z.to_bits(), self.light & !(0xff << 24)]
    }

    /// Position.
    pub fn position(&self) -> Vec3 {
        Vec3::from_array(self.position)
    }

    /// Unit direction towards the origin of the light.
    pub fn direction(&self) -> Vec3 {
        self.direction_in_steps().normalize_or(Vec3::Z)
    }

    /// Unit normal of the surface.
    pub fn normal(&self) -> Vec3 {
        self.normal_in_steps().normalize_or(Vec3::Z)
    }

    /// Direction in whole steps, not normalised.
    pub(super) fn direction_in_steps(&self) -> Vec3 {
        let side = (1 << DIRECTION_BITS) - 1;
        let [u, v] = [self.light & side, self.light >> DIRECTION_BITS & side];
        unfolded(u as f32, v as f32, DIRECTION_STEPS)
    }

    /// Normal in whole steps, not normalised.
    pub(super) fn normal_in_steps(&self) -> Vec3 {
        let [a, b] = self.normal;
        unfolded(f32::from(a), f32::from(b), NORMAL_STEPS)
    }

    /// Power, W per channel.
    pub fn power(&self) -> Rgb {
        let unit = f32::from_bits(self.light >> 24 << 23);
        let field = |from: u32, bits: u32| (self.power >> from & ((1 << bits) - 1)) as f32;
        let [r, g, b] =
            [field(0, POWER_BITS), field(POWER_BITS, POWER_BITS), field(2 * POWER_BITS, POWER_BITS - 1)];
        Rgb::new(r, g, b + b) * unit
    }
}

/// Nearest point of the octahedral grid; coordinates from its corner.
fn octahedral(direction: Vec3, steps: f32) -> [u32; 2] {
    let [x, y, z] = direction.to_array();
    let sum = x.abs() + y.abs() + z.abs();
    // Vectors that are zero, NaN or infinite become +z.
    if !(sum > 0.0 && sum < f32::INFINITY) {
        return [steps as u32; 2];
    }
    let [x, y, z] = [x / sum, y / sum, z / sum];
    let away = |value: f32, by: f32| (1.0 - by.abs()) * if value < 0.0 { -1.0 } else { 1.0 };
    let [u, v] = if z < 0.0 { [away(x, y), away(y, x)] } else { [x, y] };
    [u, v].map(|side| (side * steps + (steps + 0.5)) as u32)
}

/// Direction of a grid point in whole steps, not normalised.
fn unfolded(u: f32, v: f32, steps: f32) -> Vec3 {
    let [u, v] = [u - steps, v - steps];
    let z = (steps - u.abs()) - v.abs();
    let folded = (-z).max(0.0);
    let towards = |side: f32| if side < 0.0 { side + folded } else { side - folded };
    Vec3::new(towards(u), towards(v), z)
}

/// Biased exponent of the unit of the mantissas, and the mantissas.
fn shared_exponent(power: Rgb) -> (u32, u32) {
    let [r, g, b] = power.to_array().map(|channel| if channel > 0.0 { channel.min(f32::MAX) } else { 0.0 });
    let exponent = (r.max(g).max(b).to_bits() >> 23).saturating_sub(POWER_BITS - 1);
    if exponent == 0 {
        return (0, 0);
    }
    // Blue is halved before the product, because its unit is twice as large.
    let reciprocal = f32::from_bits((254 - exponent) << 23);
    let most = (1 << POWER_BITS) - 1;
    let [r, g, b] = [r, g, 0.5 * b].map(|channel| (channel * reciprocal + 0.5) as u32);
    (exponent, r.min(most) | g.min(most) << POWER_BITS | b.min(most >> 1) << (2 * POWER_BITS))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sphere(count: u32) -> impl Iterator<Item = Vec3> {
        (0..count).map(move |i| {
            let z = 1.0 - (2 * i + 1) as f32 / count as f32;
            let (sin, cos) = libm::sincosf(2.399_963 * i as f32);
            let r = libm::sqrtf(1.0 - z * z);
            Vec3::new(r * cos, r * sin, z)
        })
    }

    #[test]
    fn directions_and_normals_are_near_and_axes_exact() {
        // Half a step along both sides of the grid is sqrt(3/2) along the octahedron, and at most sqrt(3)
        // times as long on the sphere.
        let [direction_error, normal_error] = [DIRECTION_STEPS, NORMAL_STEPS].map(|steps| 2.13 / steps);
        for way in sphere(20_000) {
            let photon = Photon::new(Vec3::ZERO, way * 3.0, way * 0.01, Rgb::ONE);
            assert!(photon.direction().distance(way) < direction_error, "{way}");
            assert!(photon.normal().distance(way) < normal_error, "{way}");
        }
        for axis in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
            let photon = Photon::new(Vec3::ZERO, axis, axis, Rgb::ONE);
            assert_eq!((photon.direction(), photon.normal()), (axis, axis));
        }
        let odd = Photon::new(Vec3::ZERO, Vec3::NAN, Vec3::ZERO, Rgb::ONE);
        assert_eq!((odd.direction(), odd.normal()), (Vec3::Z, Vec3::Z));
    }

    #[test]
    fn remaining_segments_leave_the_mean_of_powers() {
        const COUNT: u32 = 20_000;
        for segments in 0..=MOST_REMAINING + 1 {
            let power = Rgb::new(1.0, 0.3, 0.01) * (1.0 + 0.05 * segments as f32);
            let mut sum = glam::DVec3::ZERO;
            for way in sphere(COUNT) {
                let photon = Photon::new(way, way, way, power);
                let photon = photon.with_remaining(segments);
                assert_eq!(photon.remaining(), segments.min(MOST_REMAINING));
                let error = (photon.power() - power).abs() / power.x;
                assert!(error.max_element() < 0.0035, "{segments} {error}");
                sum += photon.power().as_dvec3();
            }
            // The deviation of a mean is 2e-5 of the largest channel, the error of the eleven bits 5e-4.
            let error = (sum / f64::from(COUNT) - power.as_dvec3()).abs() / f64::from(power.x);
            assert!(error.truncate().max_element() < 6e-4, "{segments} {error}");
        }
    }

    #[test]
    fn powers_keep_their_precision_from_end_to_end_of_the_floats() {
        let mut unit = 1e-34f32;
        while unit < 1e38 {
            for (i, way) in sphere(400).enumerate() {
                let power = way.abs() * unit * (1.0 + i as f32 / 400.0);
                let got = Photon::new(Vec3::ZERO, Vec3::Z, Vec3::Z, power).power();
                let largest = power.max_element();
                let error = (got - power).abs() / largest;
                // Half a unit of 1 in 1024, and half of 1 in 512.
                assert!(error.x.max(error.y) <= 0.5 / 1024.0 && error.z <= 0.5 / 512.0, "{power} {got}");
            }
            unit *= 9.7;
        }
        let of = |power: Rgb| Photon::new(Vec3::ZERO, Vec3::Z, Vec3::Z, power).power();
        assert_eq!(of(Rgb::ZERO), Rgb::ZERO);
        assert_eq!(of(Rgb::new(-1.0, f32::NAN, 4.0)), Rgb::new(0.0, 0.0, 4.0));
        assert!(of(Rgb::INFINITY).is_finite() && of(Rgb::INFINITY).x > 3.4e38);
        assert_eq!(of(Rgb::splat(1e-40)), Rgb::ZERO);
    }
}
