//! Tables of a basis for gather rays, and the coefficients of a record from them.

use super::basis::{Basis, Representation};
use super::coefficients::Coefficients;
use super::derivatives::{CoefficientDerivatives, border_flux};
use super::pool::{Expansion, PooledRecord, write};
use super::sh::{self, ShCoefficients, ShTables};
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

    /// Coefficients of the light of `hemisphere` with first and second derivatives. `None` for another number
    /// of strata, or with spherical harmonics, whose Hessians are unknown.
    pub(crate) fn change(
        &self,
        level: Level,
        hemisphere: &Hemisphere,
    ) -> Option<(Coefficients, CoefficientDerivatives)> {
        let Self::Zernike(tables) = self else { return None };
        Some((Coefficients::project(level, tables, hemisphere)?, border_flux(level, tables, hemisphere)?))
    }

    /// Projects the light of `hemisphere` and writes its coefficients and their gradients, times
    /// `gradient_scale`, to the registers of a record whose unit of length is `unit`. `None` for another
    /// number of strata or registers, or without normals that are needed.
    pub(crate) fn write(
        &self,
        level: Level,
        hemisphere: &Hemisphere,
        (gradient_scale, unit): (f32, f32),
        out: &mut [[u16; 16]],
    ) -> Option<PooledRecord> {
        let scale = |gradients: &mut [[f32; 2]]| {
            gradients.as_flattened_mut().iter_mut().for_each(|value| *value *= gradient_scale);
        };
        match self {
            Self::Zernike(tables) => {
                let light = Coefficients::project(level, tables, hemisphere)?;
                let mut gradients = border_flux(level, tables, hemisphere)?.gradients;
                scale(gradients.as_flattened_mut());
                write(out, &Expansion::zernike(&light, &gradients), unit)
            }
            Self::SphericalHarmonics(tables) => {
                let light = ShCoefficients::project(level, tables, hemisphere)?;
                let mut gradients = sh::unoccluded(tables, hemisphere)?;
                scale(gradients.as_flattened_mut());
                write(out, &Expansion::spherical_harmonics(&light, &gradients), unit)
            }
        }
    }
}
