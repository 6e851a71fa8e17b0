//! Results of the ray benchmark.

use super::Class;
use halflight_core::Level;

/// Result of our ray tracer.
#[derive(Clone, Debug)]
pub struct RaysReport {
    /// Instruction set of our kernels.
    pub level: Level,
    /// Width and height of the picture, with one camera ray per pixel.
    pub size: [u32; 2],
    /// Triangles of the scene.
    pub triangles: usize,
    /// Seconds to allocate memory and build the BVH.
    pub build_seconds: f64,
    /// Bytes of the BVH with its copy of the triangles.
    pub bytes: usize,
    /// Results for each of [`Class::ALL`].
    pub classes: Vec<ClassReport>,
}

/// Result of our ray tracer for one class.
#[derive(Clone, Debug)]
pub struct ClassReport {
    /// Class.
    pub class: Class,
    /// Number of rays.
    pub rays: usize,
    /// Number of rays with a hit.
    pub hits: usize,
    /// Millions of rays per second, NaN without rays.
    pub mrays_per_second: f64,
}

/// Result of a rival.
#[derive(Clone, Debug)]
pub struct RivalReport {
    /// Name and version.
    pub name: String,
    /// Seconds to build the hierarchy.
    pub build_seconds: f64,
    /// Results of all functions, for each of [`Class::ALL`].
    pub classes: Vec<Vec<RivalClass>>,
}

/// Result of one function for one class.
#[derive(Clone, Debug)]
pub struct RivalClass {
    /// Name of the function.
    pub entry: &'static str,
    /// Number of rays with a hit.
    pub hits: usize,
    /// Millions of rays per second, NaN without rays.
    pub mrays_per_second: f64,
}

impl RaysReport {
    /// Bytes of the BVH per triangle.
    pub fn bytes_per_triangle(&self) -> f64 {
        self.bytes as f64 / self.triangles as f64
    }
}
