//! Derivatives from a closed triangulated environment, without two defects of the paper's: triangles of the
//! rim extend to the horizon, so that a room of one radiance has zero derivatives; and a triangle that no
//! occluder's edge crosses has the mean of its vertices' radiances instead of one of them. It costs more than
//! strata borders without being more precise, and serves as a comparison.

use super::Derivatives;
use crate::Level;
use crate::cache::hemisphere::Hemisphere;
use halflight_simd::kernels::mesh::{Mesh, Rule};

/// Irradiance and all its derivatives.
pub fn closed_mesh(level: Level, hemisphere: &Hemisphere) -> Derivatives {
    let mesh = Mesh {
        n: hemisphere.n(),
        radiance: hemisphere.radiance(),
        inverse_distance: hemisphere.inverse_distance(),
        directions: hemisphere.directions(),
        rule: Rule::DepthAware,
    };
    Derivatives::of(hemisphere, &mesh.sums(level))
}
