//! Coefficients of microfacet lobes for each direction of the viewer in either basis, and the degree that a
//! tolerance needs.
//!
//! A GGX lobe depends on alpha and on the viewer's angle θ_o alone, and Schlick's reflectance is linear in
//! the reflectance f0 at normal incidence: f = f0 W + (1 - f0) E, W with F = 1 and E with F = (1 - c)⁵. One
//! table of both serves every metal and every coat with Schlick's reflectance, whatever its colour and
//! texture. With the viewer in the plane of x and z a lobe is even in y, so that functions with a sine have
//! no coefficient; a viewer at azimuth φ multiplies c_{d,m} by (cos mφ, sin mφ). Another table has the
//! reflectance of a dielectric in place of F = 1; its lobes have the reflectance 1 at normal incidence.
//!
//! The radiance that leaves is Lo = Σ c_k λ_k. By Cauchy and Schwarz its error is at most the norm of the
//! lobe beyond degree d, in the inner product of the basis, times that of the light. With Zernike polynomials
//! τ_d = √π ‖f - P_d f‖/∫ f cos dω is thus the relative error for light of standard deviation 1, as bad as
//! can be; with spherical harmonics it is √(2π) ‖f cos - P_d f cos‖/∫ f cos dω. In rooms half of τ_d/(d + 2)
//! is the error that remains in the median, in both: the degree of a lobe is the lowest with that below the
//! tolerance (Křivánek et al. 2005, with a maximum of the error in its place).

use super::basis::{Basis, COUNT_MAX, DEGREE_MAX, ROWS_MAX};
use crate::bsdf::fresnel::{dielectric, schlick_weight};
use crate::bsdf::ggx::Ggx;
use crate::memory::{Arena, Footprint, OutOfMemory};
use core::f32::consts::{FRAC_PI_2, PI};
use glam::{Vec2, Vec3};

/// Smallest alpha of the table.
pub const ALPHA_MIN: f32 = 0.15;
/// Largest angle of the viewer, 88°, in radians.
pub const ANGLE_MAX: f32 = 88.0 / 180.0 * PI;

/// Nodes over the angle, even.
const ANGLES: usize = 32;
/// Nodes over alpha, geometric from [`ALPHA_MIN`] to 1.
const ROUGHNESSES: usize = 12;
/// Midpoints of the integrals over the angle of the light, and over half of its azimuth.
const POINTS: usize = 96;
/// Lobe for one angle and alpha: the table's node, and the interpolation between nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    basis: Basis,
    /// c_{d,m} for m >= 0 of W and E, by degree and m.
    rows: [[f32; ROWS_MAX]; 2],
    /// Inner product of g and h minus Σ c² up to each degree, for g h = W W, W E and E E.
    rests: [[f32; DEGREE_MAX + 1]; 3],
}

/// Coefficients of a lobe for a viewer at some azimuth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeCoefficients {
    /// With the reflectance 1 of microfacets.
    pub white: [f32; COUNT_MAX],
    /// With the reflectance (1 - c)⁵.
    pub edge: [f32; COUNT_MAX],
}

impl LobeCoefficients {
    /// Coefficients with the reflectance `f0` at normal incidence; zeros beyond those of the basis.
    pub fn of(&self, f0: f32) -> [f32; COUNT_MAX] {
        let mut found = [0.0; COUNT_MAX];
        found.iter_mut().zip(self.each(f0)).for_each(|(slot, coefficient)| *slot = coefficient);
        found
    }

    /// The same one by one.
    #[inline]
    pub(super) fn each(&self, f0: f32) -> impl Iterator<Item = f32> {
        self.white.iter().zip(&self.edge).map(move |(white, edge)| f0 * white + (1.0 - f0) * edge)
    }
}

/// Numbers of rows and of degrees of a basis.
fn sizes(basis: Basis) -> [usize; 2] {
    [basis.row_count(), basis.degree_max() + 1]
}

impl Lobe {
    fn none(basis: Basis) -> Self {
        Self { basis, rows: [[0.0; ROWS_MAX]; 2], rests: [[0.0; DEGREE_MAX + 1]; 3] }
    }

    /// Directional albedo with the reflectance `f0`: Lo under radiance 1.
    pub fn albedo(&self, f0: f32) -> f32 {
        let [white, edge] = self.rows.map(|rows| rows[0]);
        self.basis.inverse_of_constant() * (f0 * white + (1.0 - f0) * edge)
    }

    /// τ_d of the file for each degree, with the reflectance `f0` and `base`, the directional albedo of
    /// anything else that reflects.
    pub fn rests(&self, f0: f32, base: f32) -> [f32; DEGREE_MAX + 1] {
        let [ww, we, ee] = self.rests;
        let whole = self.albedo(f0) + base;
        let square = self.basis.square_of_one();
        core::array::from_fn(|d| {
            let rest = f0 * f0 * ww[d] + 2.0 * f0 * (1.0 - f0) * we[d] + (1.0 - f0) * (1.0 - f0) * ee[d];
            libm::sqrtf(square * rest.max(0.0)) / whole
        })
    }

    /// Lowest degree whose expected error is within `tolerance` of all that leaves, with `f0` and `base` as
    /// in [`Lobe::rests`]. `None` if it exceeds `most`: the lobe is then to be sampled.
    pub fn degree(&self, f0: f32, base: f32, tolerance: f32, most: usize) -> Option<usize> {
        let rests = self.rests(f0, base);
        (0..=most.min(self.basis.degree_max())).find(|&d| 0.5 * rests[d] <= tolerance * (d + 2) as f32)
    }

    /// Coefficients for a viewer at the azimuth of `towards`, of any length above 0; at azimuth 0 if it is
    /// zero.
    pub fn turned(&self, towards: Vec2) -> LobeCoefficients {
        let unit = towards.normalize_or(Vec2::X);
        // cos mφ and sin mφ.
        let mut turns = [Vec2::X; DEGREE_MAX + 1];
        for m in 1..turns.len() {
            turns[m] = unit.rotate(turns[m - 1]);
        }
        let mut found = LobeCoefficients { white: [0.0; COUNT_MAX], edge: [0.0; COUNT_MAX] };
        for (out, rows) in [&mut found.white, &mut found.edge].into_iter().zip(&self.rows) {
            for ((d, m), row) in self.basis.rows().zip(rows) {
                out[self.basis.index(d, -(m as isize))] = row * turns[m].y;
                out[self.basis.index(d, m as isize)] = row * turns[m].x;
            }
        }
        found
    }

    /// Integrates the lobe of one node.
    fn integrate(
        [angle, alpha]: [f32; 2],
        reflectance: impl Fn(f32) -> f32,
        Factors { basis, radial, around }: &Factors,
    ) -> Self {
        let ggx = Ggx::new(alpha);
        let wo = Vec3::new(libm::sinf(angle), 0.0, libm::cosf(angle));
        let mut lobe = Lobe::none(*basis);
        let [_, degrees] = sizes(*basis);
        let mut squares = [0.0; 3];
        for (i, radial) in radial.iter().enumerate() {
            let theta = midpoint(i, FRAC_PI_2);
            let (sin, cos) = (libm::sinf(theta), libm::cosf(theta));
            // Both halves of the azimuth.
            let weight = 2.0 * sin * cos * FRAC_PI_2 * PI / (POINTS * POINTS) as f32;
            let of_square = weight * basis.square_factor(cos);
            let mut fourier = [[0.0; DEGREE_MAX + 1]; 2];
            for around in around {
                let azimuth = Vec2::new(around[1], libm::sqrtf((1.0 - around[1] * around[1]).max(0.0)));
                let wi = (sin * azimuth).extend(cos);
                let h = wo + wi;
                let lobe = ggx.density(h.into()) * ggx.visibility(wo.into(), wi.into());
                let cos = wo.dot(h) / h.length();
                let (white, edge) = (lobe * reflectance(cos), lobe * schlick_weight(cos));
                for (sum, product) in squares.iter_mut().zip([white * white, white * edge, edge * edge]) {
                    *sum += of_square * product;
                }
                for (sums, f) in fourier.iter_mut().zip([white, edge]) {
                    for (sum, cos) in sums.iter_mut().zip(around) {
                        *sum += f * cos;
                    }
                }
            }
            for (rows, fourier) in lobe.rows.iter_mut().zip(&fourier) {
                for ((row, radial), (_, m)) in rows.iter_mut().zip(radial).zip(basis.rows()) {
                    *row += weight * radial * fourier[m];
                }
            }
        }
        let [white, edge] = lobe.rows;
        for (rest, (square, [a, b])) in
            lobe.rests.iter_mut().zip(squares.into_iter().zip([[white, white], [white, edge], [edge, edge]]))
        {
            rest.iter_mut().take(degrees).for_each(|rest| *rest = square);
            for ((a, b), (degree, _)) in a.iter().zip(b).zip(basis.rows()) {
                rest.iter_mut().take(degrees).skip(degree).for_each(|rest| *rest -= a * b);
            }
        }
        lobe
    }

    /// Adds a `node` of the table times `weight`.
    fn add(&mut self, node: &[f32], weight: f32) {
        let [rows, degrees] = sizes(self.basis);
        let (coefficients, rests) = node.split_at_checked(2 * rows).unwrap_or_default();
        let add = |(sums, node): (&mut [f32], &[f32])| {
            sums.iter_mut().zip(node).for_each(|(sum, number)| *sum += weight * number);
        };
        let own = self.rows.iter_mut().map(|own| &mut own[..]);
        own.zip(coefficients.chunks_exact(rows)).for_each(add);
        let own = self.rests.iter_mut().map(|own| &mut own[..]);
        own.zip(rests.chunks_exact(degrees)).for_each(add);
    }

    /// Writes the lobe to a `node` of the table.
    fn store(&self, node: &mut [f32]) {
        let [rows, degrees] = sizes(self.basis);
        let coefficients = self.rows.iter().flat_map(|row| row.iter().take(rows));
        let rests = self.rests.iter().flat_map(|rest| rest.iter().take(degrees));
        node.iter_mut().zip(coefficients.chain(rests)).for_each(|(slot, number)| *slot = *number);
    }
}

/// Factors of the functions with m >= 0 at the midpoints of angle and azimuth.
struct Factors {
    basis: Basis,
    radial: [[f32; ROWS_MAX]; POINTS],
    around: [[f32; DEGREE_MAX + 1]; POINTS],
}

impl Factors {
    fn of(basis: Basis) -> Self {
        let mut factors =
            Self { basis, radial: [[0.0; ROWS_MAX]; POINTS], around: [[0.0; DEGREE_MAX + 1]; POINTS] };
        for (i, (radial, around)) in factors.radial.iter_mut().zip(&mut factors.around).enumerate() {
            let angle = midpoint(i, FRAC_PI_2);
            let values = basis.values(Vec3::new(libm::sinf(angle), 0.0, libm::cosf(angle)));
            for (radial, (d, m)) in radial.iter_mut().zip(basis.rows()) {
                *radial = values[basis.index(d, m as isize)];
            }
            for (m, around) in around.iter_mut().enumerate() {
                *around = libm::cosf(m as f32 * midpoint(i, PI));
            }
        }
        factors
    }
}

/// Midpoint `i` of 0 … `end`.
fn midpoint(i: usize, end: f32) -> f32 {
    (i as f32 + 0.5) * end / POINTS as f32
}

/// Lobes over angle and alpha.
///
/// ```
/// use halflight_core::cache::radiance::{Basis, lobes::LobeTable};
/// use halflight_core::memory::{Arena, Line};
/// let mut lines = vec![Line([0; 64]); LobeTable::footprint(Basis::Zernike).bytes() / 64];
/// let table = LobeTable::build(Basis::Zernike, &mut Arena::over(&mut lines))?;
/// // Metal of alpha .4 seen at 50°: degree 6 is within 2 %. Metal of alpha .15 is left to paths.
/// let lobe = |alpha: f32| table.lobe(50f32.to_radians().cos(), alpha).unwrap();
/// assert!(lobe(0.4).degree(0.9, 0.0, 0.02, 6).is_some());
/// assert!(lobe(0.15).degree(0.9, 0.0, 0.02, 6).is_none());
/// # Ok::<(), halflight_core::memory::OutOfMemory>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct LobeTable<'m> {
    basis: Basis,
    /// Numbers of each lobe.
    nodes: &'m [f32],
    /// Nodes over alpha that are built.
    rows: Rows,
}

/// Range of nodes over alpha.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rows {
    first: usize,
    end: usize,
}

impl Rows {
    /// All nodes.
    pub const ALL: Self = Self { first: 0, end: ROUGHNESSES };
    /// No node.
    pub const NONE: Self = Self { first: ROUGHNESSES, end: 0 };

    /// Nodes for lobes of roughness `alpha`, which is rounded.
    pub fn of(alpha: f32) -> Self {
        const SLACK: f32 = 1e-3;
        let below = |alpha: f32| split(1.0 - libm::logf(alpha) / libm::logf(ALPHA_MIN), ROUGHNESSES).0;
        Self { first: below(alpha * (1.0 - SLACK)), end: below(alpha * (1.0 + SLACK)) + 2 }
    }

    /// Nodes of both and between them.
    pub fn and(self, other: Self) -> Self {
        Self { first: self.first.min(other.first), end: self.end.max(other.end) }
    }

    fn has(self, row: usize) -> bool {
        (self.first..self.end).contains(&row)
    }
}

/// The node below `at` in 0 … 1 of this number of `nodes`, and the weight of the one above it.
fn split(at: f32, nodes: usize) -> (usize, f32) {
    let at = at.clamp(0.0, 1.0) * (nodes - 1) as f32;
    let below = (at as usize).min(nodes - 2);
    (below, at - below as f32)
}

/// Numbers of a lobe.
fn numbers(basis: Basis) -> usize {
    let [rows, degrees] = sizes(basis);
    2 * rows + 3 * degrees
}

impl<'m> LobeTable<'m> {
    /// Footprint of a table.
    pub fn footprint(basis: Basis) -> Footprint {
        Footprint::default().slice::<f32>(ANGLES * ROUGHNESSES * numbers(basis))
    }

    /// Builds the table, in a fraction of a second.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than the footprint.
    pub fn build(basis: Basis, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        Self::build_rows(basis, None, Rows::ALL, arena)
    }

    /// Lobes of roughness between nodes of `rows`; with `eta` those of coats of a dielectric with this index
    /// of refraction in place of F = 1.
    ///
    /// # Errors
    /// Those of [`LobeTable::build`].
    pub fn build_rows(
        basis: Basis,
        eta: Option<f32>,
        rows: Rows,
        arena: &mut Arena<'m>,
    ) -> Result<Self, OutOfMemory> {
        match eta {
            Some(eta) => Self::build_with((basis, rows), |cos| dielectric(cos, eta), arena),
            None => Self::build_with((basis, rows), |_| 1.0, arena),
        }
    }

    fn build_with(
        (basis, rows): (Basis, Rows),
        reflectance: impl Fn(f32) -> f32,
        arena: &mut Arena<'m>,
    ) -> Result<Self, OutOfMemory> {
        let nodes: &mut [f32] = arena.slice(ANGLES * ROUGHNESSES * numbers(basis))?;
        let factors = Factors::of(basis);
        for (at, node) in nodes.chunks_exact_mut(numbers(basis)).enumerate() {
            if !rows.has(at / ANGLES) {
                continue;
            }
            let angle = (at % ANGLES) as f32 * ANGLE_MAX / (ANGLES - 1) as f32;
            let alpha =
                ALPHA_MIN * libm::powf(1.0 / ALPHA_MIN, (at / ANGLES) as f32 / (ROUGHNESSES - 1) as f32);
            Lobe::integrate([angle, alpha], &reflectance, &factors).store(node);
        }
        Ok(Self { basis, nodes, rows })
    }

    /// Lobe of a viewer at the cosine `cos` and of roughness `alpha`. `None` for alpha outside of
    /// [`ALPHA_MIN`] … 1 and of the rows, and for viewers beyond [`ANGLE_MAX`].
    pub fn lobe(&self, cos: f32, alpha: f32) -> Option<Lobe> {
        // Rounding of the ends.
        const SLACK: f32 = 1e-5;
        let angle = libm::acosf(cos.clamp(-1.0, 1.0)) / ANGLE_MAX;
        let roughness = 1.0 - libm::logf(alpha) / libm::logf(ALPHA_MIN);
        let inside = -SLACK..=1.0 + SLACK;
        if !inside.contains(&angle) || !inside.contains(&roughness) {
            return None;
        }
        let ((i, s), (j, t)) = (split(angle, ANGLES), split(roughness, ROUGHNESSES));
        if !self.rows.has(j) || !self.rows.has(j + 1) {
            return None;
        }
        let mut lobe = Lobe::none(self.basis);
        let count = numbers(self.basis);
        for (row, weight) in [(j, 1.0 - t), (j + 1, t)] {
            for (column, share) in [(i, 1.0 - s), (i + 1, s)] {
                let first = (row * ANGLES + column) * count;
                lobe.add(self.nodes.get(first..first + count)?, weight * share);
            }
        }
        Some(lobe)
    }
}

#[cfg(test)]
mod tests;
