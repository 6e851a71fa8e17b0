//! Tables of a basis for gather rays, and the coefficients of a record from them.

use super::basis::{Basis, Representation};
use super::coefficients::Coefficients;
use super::derivatives::{CoefficientDerivatives, border_flux};
use super::pool::{Expansion, PooledRecord, write};
use super::sh::{self, ShCoefficients, ShGradients, ShTables};
use super::strata::StrataTables;
use crate::Level;
use crate::cache::hemisphere::Hemisphere;
use crate::memory::{Arena, Footprint, OutOfMemory};

/// Tables of one basis for N × N strata.
#[derive(Clone, Copy, Debug)]
pub enum GatherTables<'m> {
    /// Zernike polynomials; gradients are those of the borders between strata.
    Zernike(StrataTables<'m>),
    /// Spherical harmonics; gradients are those of basis and solid angle, as in Křivánek et al. (2005).
    SphericalHarmonics(ShTables<'m>),
}

impl<'m> GatherTables<'m> {
    /// Footprint of the tables for n × n strata.
    pub fn footprint(n: usize, representation: Representation) -> Footprint {
        match representation.basis {
            Basis::Zernike => StrataTables::footprint(n, representation.degree),
            Basis::SphericalHarmonics => ShTables::footprint(n, representation.degree),
        }
    }

    /// Builds the tables.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than the footprint, or n is not in 1 ..=
    /// [`crate::cache::hemisphere::SIDE_MAX`].
    pub fn build(
        n: usize,
        representation: Representation,
        arena: &mut Arena<'m>,
    ) -> Result<Self, OutOfMemory> {
        let degree = representation.degree;
        Ok(match representation.basis {
            Basis::Zernike => Self::Zernike(StrataTables::build(n, degree, arena)?),
            Basis::SphericalHarmonics => Self::SphericalHarmonics(ShTables::build(n, degree, arena)?),
        })
    }

    /// Number of strata along a side.
    pub fn n(&self) -> usize {
        match self {
            Self::Zernike(tables) => tables.n(),
            Self::SphericalHarmonics(tables) => tables.n(),
        }
    }

    /// Basis and degree.
    pub fn representation(&self) -> Representation {
        match self {
            Self::Zernike(tables) => Representation { basis: Basis::Zernike, degree: tables.degree() },
            Self::SphericalHarmonics(tables) => {
                Representation { basis: Basis::SphericalHarmonics, degree: tables.order() }
            }
        }
    }

    /// True if gradients need the normals of the hits.
    pub fn needs_normals(&self) -> bool {
        matches!(self, Self::SphericalHarmonics(_))
    }

    /// Projects the light of `hemisphere`. `None` for another number of strata, or without normals that are
    /// needed.
    pub(crate) fn project(&self, level: Level, hemisphere: &Hemisphere) -> Option<Projection> {
        Some(match self {
            Self::Zernike(tables) => Projection::Zernike(
                Coefficients::project(level, tables, hemisphere)?,
                border_flux(level, tables, hemisphere)?,
            ),
            Self::SphericalHarmonics(tables) => Projection::SphericalHarmonics(
                ShCoefficients::project(level, tables, hemisphere)?,
                sh::unoccluded(tables, hemisphere)?,
            ),
        })
    }
}

/// Coefficients of the light of a hemisphere, with derivatives.
#[expect(clippy::large_enum_variant, reason = "one at a time, on the stack")]
pub(crate) enum Projection {
    /// Zernike polynomials.
    Zernike(Coefficients, CoefficientDerivatives),
    /// Spherical harmonics, whose Hessians are unknown.
    SphericalHarmonics(ShCoefficients, ShGradients),
}

impl Projection {
    /// Coefficients with first and second derivatives; `None` with spherical harmonics.
    pub(crate) fn change(&self) -> Option<(&Coefficients, &CoefficientDerivatives)> {
        match self {
            Self::Zernike(light, change) => Some((light, change)),
            Self::SphericalHarmonics(..) => None,
        }
    }

    /// Writes the coefficients and their gradients, times `gradient_scale`, to the registers of a record
    /// whose unit of length is `unit`. `None` for another number of registers.
    pub(crate) fn write(
        &self,
        (gradient_scale, unit): (f32, f32),
        out: &mut [[u16; 16]],
    ) -> Option<PooledRecord> {
        let expansion = match self {
            Self::Zernike(light, change) => Expansion::zernike(light, &change.gradients),
            Self::SphericalHarmonics(light, gradients) => Expansion::spherical_harmonics(light, gradients),
        };
        write(out, &expansion, (gradient_scale, unit))
    }
}
