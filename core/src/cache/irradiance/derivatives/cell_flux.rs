//! Derivatives from strata borders, the default estimator.
//!
//! The strata of the concentric map are fixed; their content moves. Between two strata of radiance L₁ and L₂
//! runs the boundary of a surface, which belongs to the nearer of both and moves with its inverse distance u.
//! The boundary integrals of [`halflight_simd::kernels::edge`], with equal u at both ends of a border, give
//!
//!   grad E = Σ (L₁ - L₂) u g,   Hess E = Σ (L₁ - L₂) u² h,   grad_n E = Σ (L₁ - L₂) r,
//!
//! Here g, h, r depend on the border alone and are tabulated. Without triangulation there is no choice of
//! diagonals and no rule for the radiance of a triangle. There is no open rim either, since the rim of the
//! hemisphere lies in the horizon, where the flux is zero. All sums use the strata of the unbiased E. With
//! polar strata the first sum is that of Ward and Heckbert (1992).

use super::Derivatives;
use crate::Level;
use crate::cache::hemisphere::{Hemisphere, SIDE_MAX};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::warp::concentric_disk;
use halflight_simd::kernels::cells::{Borders, Cells};
use halflight_simd::kernels::edge::{Flux, flux_of};

/// Pieces of a border, since the map's image of a segment is no great circle.
const PIECES: usize = 4;

/// Tables of N × N strata, and the estimator over them.
#[derive(Clone, Copy, Debug)]
pub struct CellFlux<'m> {
    n: usize,
    /// For each row, for each sixteen columns: borders to the next column, borders to the next row.
    borders: &'m [Borders],
}

impl<'m> CellFlux<'m> {
    /// Footprint of the tables for n × n strata.
    pub fn footprint(n: usize) -> Footprint {
        Footprint::default().slice::<Borders>(2 * n.saturating_mul(n.div_ceil(16)))
    }

    /// Builds the tables for n × n strata.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than the footprint, or n is not in 1 ..= [`SIDE_MAX`].
    pub fn build(n: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        if !(1..=SIDE_MAX).contains(&n) {
            return Err(OutOfMemory { needed: usize::MAX, available: arena.available() });
        }
        let chunks = n.div_ceil(16);
        let borders: &mut [Borders] = arena.slice(2 * n * chunks)?;
        for (at, table) in borders.iter_mut().enumerate() {
            *table = [[0.0; 16]; 7];
            let (i, chunk, below) = (at / (2 * chunks), at / 2 % chunks, at % 2 == 1);
            for lane in 0..16 {
                let j = 16 * chunk + lane;
                // Counter-clockwise around the stratum (i, j).
                let ends = match below {
                    false if j + 1 < n => [[j + 1, i], [j + 1, i + 1]],
                    true if i + 1 < n && j < n => [[j + 1, i + 1], [j, i + 1]],
                    _ => continue,
                };
                let Flux { gradient: [gx, gy], rotation: [rx, ry], hessian: [xx, xy, yy] } = border(n, ends);
                for (row, value) in table.iter_mut().zip([gx, gy, rx, ry, xx, xy, yy]) {
                    row[lane] = value;
                }
            }
        }
        Ok(Self { n, borders })
    }

    /// Number of strata along a side.
    pub fn n(&self) -> usize {
        self.n
    }

    /// Irradiance and all its derivatives. `None` if the hemisphere has another number of strata.
    pub fn derivatives(&self, level: Level, hemisphere: &Hemisphere) -> Option<Derivatives> {
        (hemisphere.n() == self.n).then(|| {
            let cells = Cells {
                n: self.n,
                radiance: hemisphere.radiance(),
                inverse_distance: hemisphere.inverse_distance(),
                borders: self.borders,
            };
            Derivatives::of(hemisphere, &cells.sums(level))
        })
    }
}

/// Contribution of the border between two corners of the grid, at distance 1.
fn border(n: usize, [from, to]: [[usize; 2]; 2]) -> Flux<f32> {
    let along = |piece: usize| {
        let at = |k: usize| (from[k] * (PIECES - piece) + to[k] * piece) as f32 / (n * PIECES) as f32;
        direction([at(0), at(1)])
    };
    (0..PIECES).fold(Flux::default(), |sum, piece| sum + flux_of(along(piece), 1.0, along(piece + 1), 1.0))
}

/// Direction that the concentric map assigns to a point of the unit square, without loss of precision near
/// the horizon.
fn direction(u: [f32; 2]) -> [f32; 3] {
    let disk = concentric_disk(u);
    let radius = (2.0 * u[0] - 1.0).abs().max((2.0 * u[1] - 1.0).abs());
    [disk.x, disk.y, libm::sqrtf((1.0 - radius) * (1.0 + radius))]
}

#[cfg(test)]
mod tests {
    use super::super::Hessian;
    use super::*;
    use crate::memory::Line;
    use glam::Vec2;
    use std::vec;
    use std::vec::Vec;

    fn lines(n: usize) -> Vec<Line> {
        vec![Line([0; 64]); CellFlux::footprint(n).bytes() / 64]
    }

    #[test]
    fn the_footprint_is_exact() {
        for n in [1, 2, 16, 17, 32] {
            let mut lines = lines(n);
            let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut lines);
            let short = bytes.len() - 1;
            assert!(CellFlux::build(n, &mut Arena::new(bytes)).is_ok());
            assert!(CellFlux::build(n, &mut Arena::new(&mut bytes[..short])).is_err());
        }
        let mut lines = lines(1);
        for n in [0, SIDE_MAX + 1, usize::MAX] {
            assert!(CellFlux::build(n, &mut Arena::over(&mut lines)).is_err());
        }
    }

    /// A room of one radiance looks alike from everywhere, with any walls.
    #[test]
    fn one_radiance_has_no_derivatives() {
        let n = 16;
        let mut lines = lines(n);
        let tables = CellFlux::build(n, &mut Arena::over(&mut lines)).unwrap();
        let inverse: Vec<f32> = (0..n * n).map(|i| 1.0 + (i * 7 % 5) as f32).collect();
        let (radiance, directions) = (vec![[0.5; 3]; n * n], vec![[0.0, 0.0, 1.0]; n * n]);
        let hemisphere = Hemisphere::new(n, &radiance, &inverse, &directions).unwrap();
        let found = tables.derivatives(Level::BASELINE, &hemisphere).unwrap();
        assert_eq!((found.gradient, found.rotation), ([Vec2::ZERO; 3], [Vec2::ZERO; 3]));
        assert_eq!(found.hessian, Hessian::default());
        assert!((found.irradiance.x - 0.5 * core::f32::consts::PI).abs() < 1e-6);
        assert_eq!(found.min_distance, 0.2);
    }

    /// A sky of radiance 1 + s · w has the rotational gradient n × ∫ s · w w dω = n × 2π/3 s and the
    /// irradiance 2π/3 s_z + π; a sky does not move.
    #[test]
    fn a_sky_with_a_slope_turns_and_does_not_move() {
        let n = 64;
        let mut lines = lines(n);
        let tables = CellFlux::build(n, &mut Arena::over(&mut lines)).unwrap();
        let directions: Vec<_> = (0..n * n)
            .map(|i| direction([((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32]))
            .collect();
        let radiance: Vec<_> = directions.iter().map(|w| [1.0 + 0.3 * w[0], 1.0 + 0.3 * w[1], 1.0]).collect();
        let inverse = vec![0.0; n * n];
        let hemisphere = Hemisphere::new(n, &radiance, &inverse, &directions).unwrap();
        let found = tables.derivatives(Level::BASELINE, &hemisphere).unwrap();
        assert_eq!((found.gradient, found.hessian), ([Vec2::ZERO; 3], Hessian::default()));
        let slope = 0.3 * core::f32::consts::TAU / 3.0;
        // n × x = y, n × y = -x. The strata are 1/64 of the hemisphere wide.
        let wanted = [Vec2::new(0.0, slope), Vec2::new(-slope, 0.0), Vec2::ZERO];
        for (found, wanted) in found.rotation.iter().zip(wanted) {
            assert!((*found - wanted).length() < 0.01 * slope, "{found} {wanted}");
        }
    }
}
