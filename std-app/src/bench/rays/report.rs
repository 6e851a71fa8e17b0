//! Results of the measurement.

use super::Class;
use halflight_core::Level;

/// Our numbers.
#[derive(Clone, Debug)]
pub struct RaysReport {
    /// The instruction set of our kernels.
    pub level: Level,
    /// Pixels across and down: one camera ray for each.
    pub size: [u32; 2],
    /// Triangles of the scene.
    pub triangles: usize,
    /// Seconds to build the hierarchy, the memory for it included.
    pub build_seconds: f64,
    /// Bytes that the hierarchy keeps, its copy of the triangles included.
    pub bytes: usize,
    /// One for each of [`Class::ALL`].
    pub classes: Vec<ClassReport>,
}

/// Rays of one class, traced by us.
#[derive(Clone, Debug)]
pub struct ClassReport {
    /// Which.
    pub class: Class,
    /// How many there are.
    pub rays: usize,
    /// How many met something.
    pub hits: usize,
    /// Millions of rays per second; NaN where there are none.
    pub mrays_per_second: f64,
}

/// The rival's numbers.
#[derive(Clone, Debug)]
pub struct RivalReport {
    /// Its name and version.
    pub name: String,
    /// Seconds to build its best hierarchy.
    pub build_seconds: f64,
    /// All its ways, for each of [`Class::ALL`].
    pub classes: Vec<Vec<RivalClass>>,
}

/// Rays of one class, traced in one way.
#[derive(Clone, Debug)]
pub struct RivalClass {
    /// The function of the library.
    pub entry: &'static str,
    /// How many rays met something.
    pub hits: usize,
    /// Millions of rays per second; NaN where there are none.
    pub mrays_per_second: f64,
}

impl RaysReport {
    /// Bytes that the hierarchy keeps for each triangle.
    pub fn bytes_per_triangle(&self) -> f64 {
        self.bytes as f64 / self.triangles as f64
    }
}
