//! Ray tracing: a hierarchy over triangles (BVH with eight children per node), nearest and any hits of single
//! rays and of batches.
//!
//! ```
//! use halflight_core::glam::Vec3;
//! use halflight_core::parts::rays::{Bvh, Mesh, Ray, Triangle};
//! use halflight_core::{Arena, Level, Line};
//!
//! let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! let triangles = [Triangle { vertices: [0, 1, 2], material: 0 }];
//! let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
//! let mut memory = vec![Line::ZERO; Line::count(Bvh::footprint(triangles.len()).bytes())];
//! let bvh = Bvh::build(&mesh, &mut Arena::over(&mut memory))?;
//! let hit = bvh.nearest(Level::detect(), &Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z));
//! assert_eq!((hit.triangle, hit.t), (0, 1.0));
//! # Ok::<(), halflight_core::memory::OutOfMemory>(())
//! ```

pub use crate::bvh::clearance::{Clearance, ClearanceQuery};
pub use crate::bvh::{Bvh, Coherence, ForkJoin, Serial};
pub use crate::geometry::{Bounds, Frame, Hit, MISS, Ray};
pub use crate::scene::{Instance, Instances, Mesh, Prototype, SurfacePoint, Triangle};
