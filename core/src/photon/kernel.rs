//! The kernel of a density estimate, and the disc over which it is taken.

use glam::Vec3;

/// How the weight of a photon falls with its distance from the middle of the disc. All of them integrate to
/// one over it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kernel {
    /// The same everywhere.
    Constant,
    /// 3 (1 - d / r).
    Cone,
    /// 2 (1 - d² / r²): the least variance for its width (Epanechnikov 1969).
    #[default]
    Epanechnikov,
}

/// Where the density of photons is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QueryDisc {
    /// Its middle.
    pub place: Vec3,
    /// Its normal, of unit length, on the side from which light is looked for.
    pub normal: Vec3,
    /// Its radius; finite and above zero, or nothing is found.
    pub radius: f32,
    /// How its photons are weighed.
    pub kernel: Kernel,
}
