//! Scattering vertex of a camera path.

use crate::Rgb;
use crate::bsdf::Bsdf;
use crate::sampling::Sampler;
use crate::scene::SurfacePoint;
use crate::transport::walk::path_classes::PathClasses;
use glam::Vec3;

/// Surface point of a path, its BSDF, and the quantities of the path so far.
pub struct PathVertex<'v, 'a> {
    /// Index of the path in its wave.
    pub(in crate::transport) path: usize,
    /// Index of the pixel in the picture, and number of the sample.
    pub(in crate::transport) pixel: u32,
    pub(in crate::transport) sample: u32,
    pub(in crate::transport) point: &'v SurfacePoint<'a>,
    pub(in crate::transport) bsdf: Bsdf,
    /// Random numbers of the path, and first dimension of this vertex.
    pub(in crate::transport) sampler: Sampler,
    pub(in crate::transport) first: u32,
    /// Number of segments of the path so far.
    pub(in crate::transport) segments: u32,
    /// Local direction to the previous vertex.
    pub(in crate::transport) wo: Vec3,
    /// Normal for light sampling; zero if the surface transmits.
    pub(in crate::transport) normal: Vec3,
    /// Length of the last segment, and of the path from the camera.
    pub(in crate::transport) distance: f32,
    pub(in crate::transport) travelled: f32,
    /// β, the throughput of the path so far.
    pub(in crate::transport) throughput: Rgb,
    /// True if an estimator supplies light of the base only, so that the narrow coat is sampled separately.
    pub(in crate::transport) apart: bool,
    /// Classes of light that the path had to find on its last segment.
    pub(in crate::transport) came: PathClasses,
    /// Classes to find from here without an estimator.
    pub(in crate::transport) rest: PathClasses,
}
