//! What to render: borrowed views of meshes, materials, textures, lights and the camera.
//! A scene owns nothing; the app's buffers or a microcontroller's flash do.

mod camera;
mod class;
mod framing;
mod input;
mod light;
mod material;
mod mesh;
mod surface;
mod texture;

pub use camera::{Camera, Projection, StartPlane};
pub(crate) use class::{CAUSTIC_ALPHA, SMOOTH_ALPHA};
pub use input::{ColorInput, ScalarInput};
pub use light::{Environment, PointLight};
pub use material::{Material, NormalMap, Surface};
pub use mesh::{Mesh, Triangle};
pub use surface::SurfacePoint;
pub use texture::{Texels, Texture, TextureId, TextureTransform, Wrap};

/// All that a picture is made of.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// Every triangle, in one mesh, in world space.
    pub mesh: Mesh<'a>,
    /// Referred to by [`Triangle::material`].
    pub materials: &'a [Material],
    /// Referred to by [`TextureId`].
    pub textures: &'a [Texture<'a>],
    /// Lights without surface: point, spot, directional. Emissive triangles are found through `materials`.
    pub lights: &'a [PointLight],
    /// What a ray sees that leaves the scene; `None` is black.
    pub environment: Option<Environment>,
    /// Who looks.
    pub camera: Camera,
}
