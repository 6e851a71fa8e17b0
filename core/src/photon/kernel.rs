//! Kernel of a density estimate (Silverman 1986), and its disc.

use glam::Vec3;

/// Weight of a photon by its distance d from the centre of a disc of radius r. Its mean over the disc is one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kernel {
    /// Weight 1 everywhere.
    Constant,
    /// 3 (1 - d / r).
    Cone,
    /// 2 (1 - d² / r²): the least variance for its width (Epanechnikov 1969).
    #[default]
    Epanechnikov,
}

/// Oriented disc of a density estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QueryDisc {
    /// Centre.
    pub place: Vec3,
    /// Unit normal, on the side from which light arrives.
    pub normal: Vec3,
    /// Radius; the result is empty unless it is finite and positive.
    pub radius: f32,
    /// Weight of its photons.
    pub kernel: Kernel,
}
