//! A loaded scene: the buffers that the core borrows, and what is known of where they came from.

use super::far_camera::start;
use super::settings::RenderSettings;
use super::texture_set::TextureSet;
use super::transform::{SceneTransform, direction};
use glam::{DVec3, Vec3};
use halflight_core::geometry::Bounds;
use halflight_core::scene::{Camera, Environment, Material, Mesh, PointLight, Scene, Texture, Triangle};
use std::path::PathBuf;

/// Everything of a scene, owned, in the coordinates of the core.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// Vertex positions.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals or zeros; as long as `positions`, or empty.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates; as long as `positions`, or empty.
    pub texcoords: Vec<[f32; 2]>,
    /// All triangles.
    pub triangles: Vec<Triangle>,
    /// Referred to by the triangles.
    pub materials: Vec<Material>,
    /// Names of the materials, one for each.
    pub material_names: Vec<String>,
    /// Referred to by the materials and the environment.
    pub textures: TextureSet,
    /// Lights without surface.
    pub lights: Vec<PointLight>,
    /// What is seen where nothing is.
    pub environment: Option<Environment>,
    /// The camera of the scene file.
    pub camera: Option<Camera>,
    /// Where that stands and looks.
    pub view: Option<View>,
    /// Settings of the scene file.
    pub settings: RenderSettings,
    /// From the coordinates of the file to those of the buffers.
    pub transform: SceneTransform,
    /// Every file that was looked at: the scene, its meshes, their materials, all pictures that these name and that
    /// are there, whether they could be read or not.
    pub files: Vec<PathBuf>,
    /// What was repaired or left out, a sentence for each kind.
    pub repairs: Vec<String>,
}

/// Where a camera stands and looks, in the coordinates of the files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Where from.
    pub eye: [f64; 3],
    /// Where to.
    pub look_at: [f64; 3],
    /// Up in the picture.
    pub up: [f64; 3],
}

/// The scene with the texture views that [`Scene`] borrows.
#[derive(Debug)]
pub struct SceneViews<'a> {
    loaded: &'a LoadedScene,
    textures: Vec<Texture<'a>>,
}

impl LoadedScene {
    /// Views for the core.
    pub fn views(&self) -> SceneViews<'_> {
        SceneViews { loaded: self, textures: self.textures.views() }
    }

    /// The triangles.
    pub fn mesh(&self) -> Mesh<'_> {
        Mesh {
            positions: &self.positions,
            normals: &self.normals,
            texcoords: &self.texcoords,
            triangles: &self.triangles,
        }
    }

    /// `camera`, whose rays start before all that it sees, if it stands at `view` very far from there.
    pub fn with_start(&self, camera: Camera, view: View) -> Camera {
        Camera { start: start(self, &camera, view), ..camera }
    }

    /// The middle of the scene in the coordinates of the core: of its bounding box, or of what is fine in it.
    pub fn middle(&self) -> Vec3 {
        let bounds = self.bounds();
        if bounds.extent().max_element() > CENTRED { Vec3::ZERO } else { bounds.center() }
    }

    fn bounds(&self) -> Bounds {
        Bounds::around(self.positions.iter().map(|&p| p.into()))
    }

    /// A pinhole that stands and looks as said in the coordinates of the files; `None` where both points are the same.
    pub fn camera_at(&self, view: View, fov_degrees: f64) -> Option<Camera> {
        direction(view.eye, view.look_at)?;
        let distance = DVec3::from(view.eye).distance(view.look_at.into());
        let camera = self.transform.camera(view.eye, view.look_at, view.up, fov_degrees);
        Some(Camera { focus_distance: self.transform.length(distance) as f32, ..camera })
    }

    /// The camera of the scene file, else one that frames everything.
    pub fn camera_or_default(&self) -> Camera {
        self.camera.unwrap_or_else(|| Camera::framing(&self.mesh()))
    }
}

/// A scene whose bounding box is at the origin is not longer than this.
const CENTRED: f32 = 4.0;

impl SceneViews<'_> {
    /// The scene as the core sees it, looked at by `camera`.
    pub fn scene(&self, camera: Camera) -> Scene<'_> {
        let loaded = self.loaded;
        Scene {
            mesh: loaded.mesh(),
            materials: &loaded.materials,
            textures: &self.textures,
            lights: &loaded.lights,
            environment: loaded.environment,
            camera,
        }
    }
}
