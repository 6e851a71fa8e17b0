//! Degrees of the lobes of metal within a tolerance, for both bases.

use super::Row;
use halflight::pages::Pages;
use halflight_core::cache::radiance::Basis;
use halflight_core::cache::radiance::lobes::LobeTable;
use halflight_core::memory::{Arena, OutOfMemory};
use serde_json::{Value, json};

/// Angles of the viewer, in degrees.
const ANGLES: [f32; 7] = [5.0, 35.0, 50.0, 62.0, 70.0, 76.0, 82.0];
/// GGX alphas of the metal.
const ALPHAS: [f32; 6] = [0.2, 0.25, 0.3, 0.4, 0.5, 0.7];
/// Expected errors.
const TOLERANCES: [f32; 3] = [0.01, 0.02, 0.05];

/// Degrees of one alpha and tolerance.
pub(super) struct LobeDegrees {
    /// The basis.
    basis: Basis,
    /// GGX alpha of the metal, of reflectance 1.
    alpha: f32,
    /// Expected error.
    tolerance: f32,
    /// Lowest degree for each of [`ANGLES`]; `None` beyond the largest of the basis.
    degrees: [Option<usize>; ANGLES.len()],
}

impl Row for LobeDegrees {
    fn head() -> String {
        let angles = ANGLES.map(|angle| format!("{angle:>4.0}")).concat();
        format!(
            "lowest degree of metal within an expected error, by angle of the viewer\nbasis    alpha error{angles}"
        )
    }

    fn line(&self) -> String {
        let degree = |degree: Option<usize>| degree.map_or("-".to_owned(), |degree| degree.to_string());
        let degrees = self.degrees.map(|found| format!("{:>4}", degree(found))).concat();
        format!("{:<8} {:>5.2} {:>5.2}{degrees}", self.basis.name(), self.alpha, self.tolerance)
    }

    fn object(&self) -> Value {
        let degrees: Vec<_> = ANGLES
            .into_iter()
            .zip(self.degrees)
            .map(|(angle, degree)| json!({ "angle": angle, "degree": degree }))
            .collect();
        json!({ "basis": self.basis.name(), "alpha": self.alpha, "tolerance": self.tolerance, "degrees": degrees })
    }
}

/// Degrees of all lobes.
pub(super) fn measure(each: &mut dyn FnMut(&LobeDegrees)) -> Result<(), OutOfMemory> {
    for basis in Basis::ALL {
        let mut memory = Pages::new(LobeTable::footprint(basis))?;
        let table = LobeTable::build(basis, &mut Arena::over(&mut memory))?;
        for (alpha, tolerance) in ALPHAS.into_iter().flat_map(|alpha| TOLERANCES.map(|t| (alpha, t))) {
            let degree = |angle: f32| {
                let lobe = table.lobe(angle.to_radians().cos(), alpha)?;
                lobe.degree(1.0, 0.0, tolerance, basis.degree_max())
            };
            each(&LobeDegrees { basis, alpha, tolerance, degrees: ANGLES.map(degree) });
        }
    }
    Ok(())
}
