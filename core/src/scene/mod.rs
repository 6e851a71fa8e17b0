//! Scene description: borrowed views of mesh, materials, textures, lights and camera. A scene owns no memory;
//! the application's buffers or a microcontroller's flash hold the data.

mod attributes;
mod camera;
mod class;
mod dark;
mod framing;
mod input;
mod instance;
mod light;
mod material;
mod mesh;
mod orthographic;
mod overlap;
mod panorama;
mod placed;
mod surface;
mod texture;

pub use attributes::Attributes;
pub use camera::{Camera, CameraKind, PixelWidth, Projection, StartPlane};
pub(crate) use class::{CAUSTIC_ALPHA, SMOOTH_ALPHA};
pub use input::{ColorInput, ScalarInput};
pub use instance::{Instance, Prototype};
pub(crate) use instance::{local_ray, placed};
pub use light::{DistantDisc, Environment, PointLight};
pub use material::{Material, NormalMap, Surface};
pub use mesh::{Instances, Mesh, Triangle};
pub use overlap::Overlap;
pub use surface::SurfacePoint;
pub(crate) use texture::load;
pub use texture::{Texels, Texture, TextureEdge, TextureId, TextureTransform, Wrap};

/// Everything that a picture shows.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// All triangles: those in world space, in one mesh, and those of instances.
    pub mesh: Mesh<'a>,
    /// Indexed by [`Triangle::material`].
    pub materials: &'a [Material],
    /// Indexed by [`TextureId`].
    pub textures: &'a [Texture<'a>],
    /// Lights without surface: point, spot, directional. The `materials` mark emissive triangles.
    pub lights: &'a [PointLight],
    /// Radiance of rays that leave the scene; `None` is black.
    pub environment: Option<Environment>,
    /// Camera.
    pub camera: Camera,
}

impl Default for Scene<'_> {
    /// Nothing in the dark, seen from (0, 0, 1).
    fn default() -> Self {
        Self {
            mesh: Mesh::default(),
            materials: &[],
            textures: &[],
            lights: &[],
            environment: None,
            camera: Camera::look_at(glam::Vec3::Z, glam::Vec3::ZERO, glam::Vec3::Y, 40.0),
        }
    }
}
