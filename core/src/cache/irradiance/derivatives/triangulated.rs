//! Derivatives from the triangulated environment of Schwarzhaupt, Jensen and Jarosz (2012), as printed: each
//! quad of neighbouring samples is two triangles with the radiance of the farthest vertex, and the mesh ends
//! at the outermost samples. For comparison, and as an oracle of the other estimators.
//!
//! The open rim acts as the boundary of a light before a black sky: a room of radiance 1 has a nonzero
//! Hessian. [`Derivatives::open_hessian`] is this Hessian, the basis of the paper's rules for black
//! surroundings.

use super::{Derivatives, Hessian, rotation_by_samples};
use crate::Level;
use crate::cache::hemisphere::Hemisphere;
use core::ops::Add;
use halflight_simd::kernels::edge::{Flux, flux_of};
use halflight_simd::kernels::mesh::{Mesh, Rule};

/// Irradiance and all its derivatives; the rotational gradient by samples, since the mesh does not reach the
/// horizon.
pub fn triangulated(level: Level, hemisphere: &Hemisphere) -> Derivatives {
    let mesh = Mesh {
        n: hemisphere.n(),
        radiance: hemisphere.radiance(),
        inverse_distance: hemisphere.inverse_distance(),
        directions: hemisphere.directions(),
        rule: Rule::Farthest,
    };
    let mut found = Derivatives::of(hemisphere, &mesh.sums(level));
    found.rotation = rotation_by_samples(hemisphere);
    found.open_hessian = rim(hemisphere);
    found
}

/// Hessian of the mesh with radiance 1 everywhere: all edges except the rim cancel. Counter-clockwise.
fn rim(hemisphere: &Hemisphere) -> Hessian {
    let n = hemisphere.n();
    let last = n - 1;
    let vertex = |i: usize, j: usize| {
        let at = i * n + j;
        (hemisphere.directions().get(at).copied(), hemisphere.inverse_distance().get(at).copied())
    };
    let edge = |from: (usize, usize), to: (usize, usize)| match (vertex(from.0, from.1), vertex(to.0, to.1)) {
        ((Some(a), Some(u)), (Some(b), Some(v))) => flux_of(a, u, b, v),
        _ => Flux::default(),
    };
    let steps = (0..last).map(|k| {
        edge((0, k), (0, k + 1))
            + edge((k, last), (k + 1, last))
            + edge((last, k + 1), (last, k))
            + edge((k + 1, 0), (k, 0))
    });
    let [xx, xy, yy] = steps.fold(Flux::default(), Flux::add).hessian;
    Hessian { xx, xy, yy }
}
