//! A vertex at which a camera path is scattered.

use crate::Rgb;
use crate::bsdf::Bsdf;
use crate::sampling::Sampler;
use crate::scene::SurfacePoint;
use crate::transport::walk::component::Components;
use glam::Vec3;

/// A surface point of a path, with its BSDF and with the quantities of the path up to here.
pub struct PathVertex<'v, 'a> {
    /// Index of the path in its wave.
    pub(in crate::transport) path: usize,
    /// Index of the pixel in the picture, and number of its sample.
    pub(in crate::transport) pixel: u32,
    pub(in crate::transport) sample: u32,
    pub(in crate::transport) point: &'v SurfacePoint<'a>,
    pub(in crate::transport) bsdf: Bsdf,
    /// Random numbers of the path, and the first dimension of this vertex.
    pub(in crate::transport) sampler: Sampler,
    pub(in crate::transport) first: u32,
    /// Segments of the path up to here.
    pub(in crate::transport) segments: u32,
    /// Direction to the vertex before, local.
    pub(in crate::transport) wo: Vec3,
    /// The normal for light sampling: zero where light comes from both sides.
    pub(in crate::transport) normal: Vec3,
    /// Length of the last segment, and of the path from the camera.
    pub(in crate::transport) distance: f32,
    pub(in crate::transport) travelled: f32,
    /// β, the throughput of the path up to here.
    pub(in crate::transport) throughput: Rgb,
    /// Whether an estimator knows the base of the surface alone, so that its narrow coat is sampled apart.
    pub(in crate::transport) apart: bool,
    /// Classes of light that the path was to find when it came here.
    pub(in crate::transport) came: Components,
    /// Classes to find from here, if no estimator knows any.
    pub(in crate::transport) rest: Components,
}
