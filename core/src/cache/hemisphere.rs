//! Gather rays of one point: radiance and distance per stratum of the hemisphere, in the frame of the normal
//! (+z).

use crate::Rgb;
use crate::bsdf::fresnel::schlick_weight;
use crate::light::luminance;
use core::f32::consts::PI;

pub use halflight_simd::kernels::jumps::SIDE_MAX;

/// N × N strata of the concentric map (Shirley and Chiu 1997), each with an equal share of irradiance.
/// Row-major: the stratum of row i and column j holds the directions mapped from the square [j/N, (j+1)/N] ×
/// [i/N, (i+1)/N], of which one was traced.
#[derive(Clone, Copy, Debug)]
pub struct Hemisphere<'a> {
    n: usize,
    radiance: &'a [[f32; 3]],
    inverse_distance: &'a [f32],
    directions: &'a [[f32; 3]],
    normals: Option<&'a [[f32; 3]]>,
}

impl<'a> Hemisphere<'a> {
    /// Hemisphere of n² strata: incident radiance, 1/distance of the hit (0 without a hit), and traced
    /// direction (unit, local: z is the cosine). `None` if n is not in 1 ..= [`SIDE_MAX`] or a slice does not
    /// have n² values. Values are not checked: one that is not finite only spoils the derivatives.
    pub fn new(
        n: usize,
        radiance: &'a [[f32; 3]],
        inverse_distance: &'a [f32],
        directions: &'a [[f32; 3]],
    ) -> Option<Self> {
        let lengths = [radiance.len(), inverse_distance.len(), directions.len()];
        let fits = (1..=SIDE_MAX).contains(&n) && lengths == [n * n; 3];
        fits.then_some(Self { n, radiance, inverse_distance, directions, normals: None })
    }

    /// This hemisphere with the unit normals of the hits (local frame, either side; any value without a hit),
    /// which only Hessians without occlusion need. `None` if there are not n² of them.
    pub fn with_normals(self, normals: &'a [[f32; 3]]) -> Option<Self> {
        (normals.len() == self.radiance.len()).then_some(Self { normals: Some(normals), ..self })
    }

    /// Number of strata along a side.
    pub fn n(&self) -> usize {
        self.n
    }

    /// Radiance of each stratum.
    pub fn radiance(&self) -> &'a [[f32; 3]] {
        self.radiance
    }

    /// 1/distance of each stratum, 0 without a hit.
    pub fn inverse_distance(&self) -> &'a [f32] {
        self.inverse_distance
    }

    /// Traced directions, in the local frame.
    pub fn directions(&self) -> &'a [[f32; 3]] {
        self.directions
    }

    /// Normals of the hits, if known.
    pub fn normals(&self) -> Option<&'a [[f32; 3]]> {
        self.normals
    }

    /// Irradiance π/N² Σ L, since strata have equal shares. Summed by rows for small rounding errors.
    pub fn irradiance(&self) -> Rgb {
        let rows = self.radiance.chunks_exact(self.n);
        let sum: Rgb = rows.map(|row| row.iter().map(|&l| Rgb::from(l)).sum::<Rgb>()).sum();
        sum * (PI / (self.n * self.n) as f32)
    }

    /// M₅ = ∫ L (1 - cos)⁵ cos dω: π/N² Σ L (1 - cos)⁵.
    pub fn edge_moment(&self) -> Rgb {
        let rows = self.radiance.chunks_exact(self.n).zip(self.directions.chunks_exact(self.n));
        let of_row = |(radiance, directions): (&[[f32; 3]], &[[f32; 3]])| -> Rgb {
            radiance.iter().zip(directions).map(|(&l, &[.., z])| Rgb::from(l) * schlick_weight(z)).sum()
        };
        rows.map(of_row).sum::<Rgb>() * (PI / (self.n * self.n) as f32)
    }

    /// Variance of the luminance of [`Hemisphere::irradiance`], estimated from second differences along the
    /// rows: a linear change between strata is no noise, a pattern finer than the strata is.
    pub fn variance(&self) -> f32 {
        let [squares, count] = second_differences(self.radiance, self.n);
        let strata = (self.n * self.n) as f32;
        squares * (PI * PI / (6.0 * strata * count))
    }

    /// This hemisphere with radiances, written to `limited`, scaled down where their luminance exceeds twice
    /// the mean: for decisions that must not follow the few strata that most of the noise comes from. `None`
    /// if `limited` does not have n² values.
    pub fn limited<'b>(&self, limited: &'b mut [[f32; 3]]) -> Option<Hemisphere<'b>>
    where
        'a: 'b,
    {
        let sum: f32 = self.radiance.iter().map(|&l| luminance(l.into())).sum();
        let most = MOST_OVER_MEAN * sum / self.radiance.len() as f32;
        for (limited, &radiance) in limited.iter_mut().zip(self.radiance) {
            let here = luminance(radiance.into());
            *limited = if here > most { radiance.map(|channel| channel * (most / here)) } else { radiance };
        }
        let found = Hemisphere::new(self.n, limited, self.inverse_distance, self.directions)?;
        Some(Hemisphere { normals: self.normals, ..found })
    }

    /// Statistics of the distances.
    pub(super) fn distances(&self) -> Distances {
        let (mut sum, mut squares, mut largest) = (0.0, 0.0, 0.0f32);
        for row in self.inverse_distance.chunks_exact(self.n) {
            sum += row.iter().sum::<f32>();
            squares += row.iter().map(|u| u * u).sum::<f32>();
            largest = row.iter().fold(largest, |largest, &u| largest.max(u));
        }
        let count = (self.n * self.n) as f32;
        Distances {
            mean_inverse: sum / count,
            mean_square_inverse: squares / count,
            largest_inverse: largest,
        }
    }
}

/// Maximum luminance of a limited stratum over the mean of all.
const MOST_OVER_MEAN: f32 = 2.0;

/// Sum of the squared second differences of luminance along rows of `side` values, and their number. For
/// independent values their mean is six times the variance of a value.
pub(super) fn second_differences(values: &[[f32; 3]], side: usize) -> [f32; 2] {
    let (mut squares, mut count) = (0.0, 0usize);
    for row in values.chunks_exact(side.max(1)) {
        let mut sum = 0.0;
        for three in row.windows(3) {
            let [a, b, c] = [0, 1, 2].map(|i: usize| three.get(i).map_or(0.0, |&l| luminance(Rgb::from(l))));
            sum += (a - 2.0 * b + c) * (a - 2.0 * b + c);
        }
        squares += sum;
        count += row.len().saturating_sub(2);
    }
    [squares, count.max(1) as f32]
}

/// Statistics of the inverse distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Distances {
    pub(super) mean_inverse: f32,
    pub(super) mean_square_inverse: f32,
    pub(super) largest_inverse: f32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Random;
    use crate::sampling::warp::cosine_hemisphere;
    use std::vec;

    /// Radiances uniform on [0, 1] have a variance of 1/12; a linear rise along the rows has none. The
    /// estimate from 4096 strata is good to 10 %, four of its standard deviations.
    #[test]
    fn the_variance_is_that_of_the_noise() {
        const N: usize = 64;
        let variance = |radiance: &[[f32; 3]]| {
            let (inverse, directions) = (vec![1.0; N * N], vec![[0.0, 0.0, 1.0]; N * N]);
            Hemisphere::new(N, radiance, &inverse, &directions).unwrap().variance()
        };
        let random = Random::new(1, 2);
        let noisy: vec::Vec<_> =
            (0..N * N).map(|i| [random.single(i as u32) + 0.1 * (i % N) as f32; 3]).collect();
        let wanted = PI * PI / 12.0 / (N * N) as f32;
        assert!((variance(&noisy) / wanted - 1.0).abs() < 0.1, "{} {wanted}", variance(&noisy));
        let even: vec::Vec<_> = (0..N * N).map(|i| [(i % N) as f32; 3]).collect();
        assert!(variance(&even) < 1e-6 * wanted);
    }

    /// Four strata of 1, 1, 2 and 12 have the mean 4: the last is limited to 8, in its own colour.
    #[test]
    fn bright_strata_are_limited_to_twice_the_mean() {
        let colour = Rgb::new(2.0, 0.5, 1.0) / luminance(Rgb::new(2.0, 0.5, 1.0));
        let radiance = [1.0, 1.0, 2.0, 12.0].map(|l| (l * colour).to_array());
        let hemisphere = |radiance| Hemisphere::new(2, radiance, &[1.0; 4], &[[0.0, 0.0, 1.0]; 4]).unwrap();
        let mut limited = [[0.0; 3]; 4];
        let found = hemisphere(&radiance).limited(&mut limited).unwrap();
        assert_eq!(found.radiance()[..3], radiance[..3]);
        assert!(Rgb::from(found.radiance()[3]).distance(8.0 * colour) < 1e-5, "{found:?}");
        assert_eq!(hemisphere(&[[0.0; 3]; 4]).limited(&mut limited).unwrap().radiance(), [[0.0; 3]; 4]);
        assert!(hemisphere(&radiance).limited(&mut limited[..3]).is_none());
    }

    /// In light 1 + s cos θ the moment is 2π (B(2, 6) + s B(3, 6)), with Euler's B(2, 6) = 1/42 and B(3, 6) =
    /// 1/168.
    #[test]
    fn the_edge_moment_is_that_of_linear_light() {
        const N: usize = 32;
        let random = Random::new(2, 2);
        let directions: vec::Vec<_> = (0..N * N)
            .map(|i| {
                let [u, v] = [0, 1].map(|k| random.single((2 * i + k) as u32));
                let (row, column) = ((i / N) as f32, (i % N) as f32);
                cosine_hemisphere([(column + u) / N as f32, (row + v) / N as f32]).to_array()
            })
            .collect();
        for slope in [0.0, 1.0, -0.9] {
            let radiance: vec::Vec<_> =
                directions.iter().map(|&[.., z]| [1.0 + slope * z, 1.0, 0.0]).collect();
            let inverse = vec![1.0; N * N];
            let found = Hemisphere::new(N, &radiance, &inverse, &directions).unwrap().edge_moment();
            let wanted = 2.0 * PI * (1.0 / 42.0 + slope / 168.0);
            assert!((found.x / wanted - 1.0).abs() < 0.02, "{slope}: {found} {wanted}");
            assert_eq!(found.z, 0.0);
        }
    }
}
