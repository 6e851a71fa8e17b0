//! A loaded scene: the buffers that the core borrows, their files and repairs.

use super::far_camera::start;
use super::instances::LoadedInstances;
use super::texture_set::TextureSet;
use super::transform::{SceneTransform, direction};
use crate::values::{Depth, MethodName, Samples, Seconds, Size, TargetError};
use core::ops::Range;
use glam::{DVec3, Vec3};
use halflight_core::scene::{
    Camera, Environment, Material, Mesh, Overlap, PointLight, Scene, Texture, Triangle,
};
use serde::Deserialize;
use std::path::PathBuf;

/// A scene with its buffers, in the coordinates of the core.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// Vertex positions.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals or zeros; as long as `positions`, or empty.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates; as long as `positions`, or empty.
    pub texcoords: Vec<[f32; 2]>,
    /// Texture coordinates of a second set; as long as `positions`, or empty.
    pub second_texcoords: Vec<[f32; 2]>,
    /// Linear RGBA of the vertices; as long as `positions`, or empty.
    pub colors: Vec<[f32; 4]>,
    /// All triangles.
    pub triangles: Vec<Triangle>,
    /// Pairs of triangles that overlap in one plane, in both orders, ascending.
    pub overlaps: Vec<Overlap>,
    /// Meshes that are placed several times, in the memory of one.
    pub instances: LoadedInstances,
    /// Materials of the triangles.
    pub materials: Vec<Material>,
    /// Names of the materials.
    pub material_names: Vec<String>,
    /// Names of the meshes that are no instances, files without their extensions, and their vertices.
    pub meshes: Vec<(String, Range<u32>)>,
    /// Names of the objects, all different: `o` or `g` of OBJ files, nodes of glTF files, meshes of
    /// [`super::SceneParts`]; of faces without one, the file without its extension. Copies have a number.
    pub object_names: Vec<String>,
    /// Object of each triangle, and then of each instance.
    pub triangle_objects: Vec<u32>,
    /// Textures of the materials and the environment.
    pub textures: TextureSet,
    /// Lights without surface.
    pub lights: Vec<PointLight>,
    /// Light from infinity.
    pub environment: Option<Environment>,
    /// The camera of the scene file, or the first of a glTF file.
    pub camera: Option<Camera>,
    /// Its position and direction.
    pub view: Option<View>,
    /// Cameras of glTF files; the first is `camera` if the scene file has none.
    pub cameras: Vec<NamedCamera>,
    /// Settings of the scene file.
    pub settings: RenderSettings,
    /// Transform from file coordinates to buffer coordinates.
    pub transform: SceneTransform,
    /// All existing files that the scene names: itself, meshes, materials and pictures, unreadable ones
    /// included.
    pub files: Vec<PathBuf>,
    /// Repairs, one sentence for each kind.
    pub repairs: Vec<String>,
}

/// Render settings of a scene file, which flags of the command line override; `None` if not given.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RenderSettings {
    /// Width and height in pixels.
    pub size: Option<Size>,
    /// Samples per pixel.
    pub spp: Option<Samples>,
    /// Rendering time limit, in seconds.
    pub time: Option<Seconds>,
    /// relMSE at which to stop.
    pub error: Option<TargetError>,
    /// Longest path, in segments; 1: directly visible light.
    pub max_depth: Option<Depth>,
    /// Seed of all random numbers.
    pub seed: Option<u32>,
    /// Name of the method.
    pub method: Option<MethodName>,
}

/// Position and direction of a camera, in the coordinates of the files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Position.
    pub eye: [f64; 3],
    /// A point on the optical axis.
    pub look_at: [f64; 3],
    /// Direction that is up in the picture.
    pub up: [f64; 3],
}

/// A camera of a glTF file, in the coordinates of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedCamera {
    /// Name of its node, or its own; may be empty.
    pub name: String,
    /// Position and direction.
    pub view: View,
    /// The map to the picture.
    pub kind: ViewKind,
}

/// The map to the picture, in the units of the files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ViewKind {
    /// Perspective.
    Perspective {
        /// Vertical field of view in degrees.
        fov_degrees: f64,
    },
    /// Parallel rays.
    Orthographic {
        /// Vertical extent of the picture.
        height: f64,
    },
    /// All directions around the eye.
    Panorama,
}

/// Sine of the angle between view and up below which rounding errors would rotate the picture.
const PARALLEL: f64 = 1e-4;

impl View {
    /// True if no direction is up in the picture.
    pub fn looks_along_up(&self) -> bool {
        let along = direction(self.eye, self.look_at).unwrap_or_default();
        let up = direction([0.0; 3], self.up).unwrap_or_default();
        along.cross(up).length() < PARALLEL
    }
}

/// The scene with the texture views that [`Scene`] borrows.
#[derive(Debug)]
pub struct SceneViews<'a> {
    loaded: &'a LoadedScene,
    textures: Vec<Texture<'a>>,
}

impl LoadedScene {
    /// The scene with its texture views.
    pub fn views(&self) -> SceneViews<'_> {
        SceneViews { loaded: self, textures: self.textures.views() }
    }

    /// The triangles.
    pub fn mesh(&self) -> Mesh<'_> {
        Mesh {
            positions: &self.positions,
            normals: &self.normals,
            texcoords: &self.texcoords,
            second_texcoords: &self.second_texcoords,
            colors: &self.colors,
            triangles: &self.triangles,
            overlaps: &self.overlaps,
            instances: self.instances.of_core(),
        }
    }

    /// `camera` at `view`; if it is very far from the scene, its rays start before all visible surfaces.
    pub fn with_start(&self, camera: Camera, view: View) -> Camera {
        let eye = DVec3::from(self.transform.point_f64(view.eye));
        let along = direction(view.eye, view.look_at);
        Camera { start: along.and_then(|along| start(&self.mesh(), &camera, eye, along)), ..camera }
    }

    /// The centre of the scene in the coordinates of the core: of its bounding box or its detail.
    pub fn middle(&self) -> Vec3 {
        let bounds = self.mesh().bounds();
        if bounds.extent().max_element() > CENTRED { Vec3::ZERO } else { bounds.center() }
    }

    /// A pinhole camera at `view`; `None` if both of its points are equal.
    pub fn camera_at(&self, view: View, fov_degrees: f64) -> Option<Camera> {
        self.camera_of(view, ViewKind::Perspective { fov_degrees })
    }

    /// A camera of any kind without a lens at `view`; `None` if both of its points are equal, or if the
    /// height of an orthographic picture is not a positive number in f32.
    pub fn camera_of(&self, view: View, kind: ViewKind) -> Option<Camera> {
        direction(view.eye, view.look_at)?;
        let distance = DVec3::from(view.eye).distance(view.look_at.into());
        let fov_degrees = match kind {
            ViewKind::Perspective { fov_degrees } => fov_degrees,
            ViewKind::Orthographic { .. } | ViewKind::Panorama => DEFAULT_FOV,
        };
        let camera = self.transform.camera(view.eye, view.look_at, view.up, fov_degrees);
        let camera = Camera { focus_distance: self.transform.length(distance) as f32, ..camera };
        match kind {
            ViewKind::Perspective { .. } => Some(camera),
            ViewKind::Orthographic { height } => {
                let height = self.transform.length(height) as f32;
                (height > 0.0 && height < f32::INFINITY).then(|| camera.orthographic(height))
            }
            ViewKind::Panorama => Some(camera.panorama()),
        }
    }

    /// The scene as its first camera sees it.
    pub(super) fn with_first_camera(mut self) -> Self {
        if let Some(first) = self.cameras.first() {
            let camera = self.camera_of(first.view, first.kind);
            (self.camera, self.view) =
                (camera.map(|camera| self.with_start(camera, first.view)), Some(first.view));
        }
        self
    }

    /// `camera` with a lens of this radius and distance in focus, by default its own, in the units of the
    /// files; `None` if the lens is too wide for it.
    pub fn with_lens(&self, camera: Camera, radius: f64, focus: Option<f64>) -> Option<Camera> {
        let focus = focus.map_or(f64::from(camera.focus_distance), |focus| self.transform.length(focus));
        let focus = focus.min(FARTHEST_FOCUS);
        let radius = self.transform.length(radius);
        let lens = Camera { lens_radius: radius as f32, focus_distance: focus as f32, ..camera };
        (radius <= WIDEST_LENS * focus).then_some(lens)
    }

    /// The camera of the scene file, else one that frames the scene.
    pub fn camera_or_default(&self) -> Camera {
        self.camera.unwrap_or_else(|| Camera::framing(&self.mesh()))
    }
}

/// Vertical field of view in degrees of a perspective that replaces another kind of camera.
pub(super) const DEFAULT_FOV: f64 = 40.0;

/// Distance in focus from which all rays through a pixel are parallel in f32, and squares are finite.
const FARTHEST_FOCUS: f64 = 1e15;

/// Largest ratio of the radius of a lens to its distance in focus; of a real one it is below a half.
const WIDEST_LENS: f64 = 1e3;

/// Largest extent of a scene whose bounding box is centred at the origin.
const CENTRED: f32 = 4.0;

impl SceneViews<'_> {
    /// The scene for the core, with `camera`.
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
