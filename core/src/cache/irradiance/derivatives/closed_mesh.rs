//! Derivatives from the triangulated environment with both of its defects cured: the triangles of the rim
//! reach down to the horizon, so that a room of one radiance is flat; and where no occluder's edge crosses a
//! triangle, it has the mean of its vertices' radiances and not one of them. Costs more than the borders of
//! strata and is no better: another way to the same numbers.

use super::Derivatives;
use crate::Level;
use crate::cache::irradiance::hemisphere::Hemisphere;
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
