//! Degrees of the lobes of metal within a tolerance, for both bases.

use crate::memory::lines;
use halflight_core::cache::radiance::Basis;
use halflight_core::cache::radiance::lobes::LobeTable;
use halflight_core::memory::{Arena, OutOfMemory};

/// Angles of the viewer, in degrees.
pub const ANGLES: [f32; 7] = [5.0, 35.0, 50.0, 62.0, 70.0, 76.0, 82.0];
/// GGX alphas of the metal.
const ALPHAS: [f32; 6] = [0.2, 0.25, 0.3, 0.4, 0.5, 0.7];
/// Expected errors.
const TOLERANCES: [f32; 3] = [0.01, 0.02, 0.05];

/// Degrees of one alpha and tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeDegrees {
    /// The basis.
    pub basis: Basis,
    /// GGX alpha of the metal, of reflectance 1.
    pub alpha: f32,
    /// Expected error.
    pub tolerance: f32,
    /// Lowest degree for each of [`ANGLES`]; `None` beyond the largest of the basis.
    pub degrees: [Option<usize>; ANGLES.len()],
}

/// Degrees of all lobes.
pub(super) fn degrees() -> Result<Vec<LobeDegrees>, OutOfMemory> {
    let mut found = Vec::new();
    for basis in Basis::ALL {
        let mut memory = lines(LobeTable::footprint(basis))?;
        let table = LobeTable::build(basis, &mut Arena::over(&mut memory))?;
        for (alpha, tolerance) in ALPHAS.into_iter().flat_map(|alpha| TOLERANCES.map(|t| (alpha, t))) {
            let degree = |angle: f32| {
                let lobe = table.lobe(angle.to_radians().cos(), alpha)?;
                lobe.degree(1.0, 0.0, tolerance, basis.degree_max())
            };
            found.push(LobeDegrees { basis, alpha, tolerance, degrees: ANGLES.map(degree) });
        }
    }
    Ok(found)
}
