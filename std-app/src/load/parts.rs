//! A scene from arrays, with the repairs and notes of the loader.

use super::obj::{Group, Obj};
use super::placed::{PlacedMesh, Placement};
use super::placed_light::PlacedLight;
use super::scene_file::{self, EnvironmentChange};
use super::texture::{self, Content};
use super::texture_set::LONGEST_SIDE;
use super::{LoadError, LoadOptions, LoadedScene, SceneBuilder, View, memory_estimate, too_large};
use crate::picture::Picture;
use glam::Mat3;
use halflight_core::Rgb;
use halflight_core::scene::{Material, PointLight, TextureId};
use std::path::Path;

/// A material of [`SceneParts`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaterialId(u32);

/// Triangles of one material, in arrays of the caller.
#[derive(Clone, Copy, Debug, Default)]
pub struct PartMesh<'a> {
    /// Vertex positions.
    pub positions: &'a [[f64; 3]],
    /// Shading normals of any length, one for each position, or empty.
    pub normals: &'a [[f64; 3]],
    /// Texture coordinates, one for each position, or empty.
    pub texcoords: &'a [[f64; 2]],
    /// Indices of vertices, counter-clockwise seen from the front.
    pub triangles: &'a [[u32; 3]],
}

/// Meshes, materials, lights and a view, from which the loader makes a scene: it centres and scales, repairs
/// normals and triangles, and notes what it changes.
///
/// ```
/// use halflight::load::{Material, PartMesh, PointLight, SceneParts, View};
/// use halflight::{Renderer, Rgb};
///
/// let mut parts = SceneParts::default();
/// let white = parts.material("white", Material::diffuse(Rgb::splat(0.7)));
/// let positions = [[-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]];
/// let triangles = [[0, 1, 2], [0, 2, 3]];
/// let mesh = PartMesh { positions: &positions, triangles: &triangles, ..PartMesh::default() };
/// parts.mesh("floor", &mesh, white)?;
/// parts.light(PointLight::Point { position: [0.0, 2.0, 0.0].into(), intensity: Rgb::splat(10.0) });
/// parts.view(View { eye: [0.0, 1.0, 3.0], look_at: [0.0; 3], up: [0.0, 1.0, 0.0] }, 40.0);
/// let renderer = Renderer::new(parts.build()?, None)?;
/// # Ok::<(), halflight::Error>(())
/// ```
pub struct SceneParts {
    builder: SceneBuilder,
    options: LoadOptions,
    environment: Option<EnvironmentChange>,
    view: Option<(View, f64)>,
}

impl Default for SceneParts {
    fn default() -> Self {
        Self::new(LoadOptions::default())
    }
}

impl SceneParts {
    /// No parts yet; `options` limit the memory.
    pub fn new(options: LoadOptions) -> Self {
        let builder = SceneBuilder::new(&options);
        Self { builder, options, environment: None, view: None }
    }

    /// Adds a material, or changes the one of this name.
    pub fn material(&mut self, name: &str, material: Material) -> MaterialId {
        let number = self.builder.material(None, name.into(), None);
        self.builder.given.insert(number, material);
        MaterialId(number)
    }

    /// Adds a mesh of one material.
    ///
    /// # Errors
    /// A [`LoadError`] with the name of the mesh where an index is out of range, or normals or texture
    /// coordinates are neither empty nor as many as positions; insufficient memory.
    pub fn mesh(&mut self, name: &str, mesh: &PartMesh, material: MaterialId) -> Result<(), LoadError> {
        let file = Path::new(name);
        let count = mesh.positions.len();
        let lists = [("normals", mesh.normals.len()), ("texture coordinates", mesh.texcoords.len())];
        let differs = |(_, length): &(&str, usize)| *length != 0 && *length != count;
        if let Some((list, length)) = lists.into_iter().find(differs) {
            let problem = format!("the mesh has {length} {list} and {count} positions");
            return Err(LoadError::of_file(file, problem, "give one for each position, or none"));
        }
        let is_out = |triangle: &[u32; 3]| triangle.iter().any(|&vertex| vertex as usize >= count);
        if let Some(triangle) = mesh.triangles.iter().position(is_out) {
            let problem = format!("triangle {triangle} refers to a vertex that does not exist");
            return Err(LoadError::of_file(
                file,
                problem,
                format!("indices are below {count}, and begin at 0"),
            ));
        }
        let group = Group {
            material: Some(0),
            positions: mesh.positions.to_vec(),
            normals: mesh.normals.to_vec(),
            texcoords: mesh.texcoords.to_vec(),
            triangles: mesh.triangles.to_vec(),
            ..Group::default()
        };
        let obj = Obj { groups: vec![group], materials: vec![name.into()], ..Obj::default() };
        let builder = &mut self.builder;
        builder.budget.take(memory_estimate::of_mesh(&obj)).map_err(|why| too_large(file, &why))?;
        builder.objs.push(obj);
        let materials = [material.0, material.0].into();
        builder.meshes.push(PlacedMesh {
            name: name.to_owned(),
            obj: builder.objs.len() - 1,
            placement: Placement::IDENTITY,
            materials,
            share: None,
        });
        Ok(())
    }

    /// Adds a light without surface, in the coordinates and units of the meshes.
    pub fn light(&mut self, light: PointLight) {
        self.builder.lights.push(PlacedLight::new(light));
    }

    /// Adds a picture as a texture: of colours, whose bytes are in the sRGB curve, or of numbers. Texture
    /// coordinates (0, 1) are the first pixel of the first row.
    ///
    /// # Errors
    /// A [`LoadError`] with `name`: a picture without pixels or with more than 32768 a side; insufficient
    /// memory.
    pub fn texture(
        &mut self,
        name: &str,
        picture: Picture,
        has_colours: bool,
    ) -> Result<TextureId, LoadError> {
        let picture = self.prepared(name, picture)?;
        let content = if has_colours { Content::Colour } else { Content::Data };
        Ok(self.builder.given_textures.add(picture, content))
    }

    /// A picture with finite texels, whose memory is taken.
    fn prepared(&mut self, name: &str, picture: Picture) -> Result<Picture, LoadError> {
        let name = Path::new(name);
        let Picture { width, height, .. } = picture;
        if width.min(height) == 0 || width.max(height) > LONGEST_SIDE || !picture.is_complete() {
            let problem = format!("the picture has {width}x{height} pixels");
            let help = format!("a texture has 1 to {LONGEST_SIDE} pixels a side");
            return Err(LoadError::of_file(name, problem, help));
        }
        let SceneBuilder { budget, notes, .. } = &mut self.builder;
        let mut picture = texture::prepared(picture);
        texture::note(&mut picture, name, notes);
        budget.take(picture.bytes()).map_err(|why| too_large(name, &why))?;
        Ok(picture)
    }

    /// Gives rays that leave the scene this radiance.
    pub fn environment(&mut self, radiance: Rgb) {
        self.environment = Some(EnvironmentChange::of_radiance(radiance));
    }

    /// Gives rays that leave the scene the radiances of a picture of all directions, as `map` of a scene file
    /// has them, times `radiance`. `to_world` is a rotation.
    ///
    /// # Errors
    /// Those of [`SceneParts::texture`].
    pub fn environment_map(
        &mut self,
        picture: Picture,
        radiance: Rgb,
        to_world: Mat3,
    ) -> Result<(), LoadError> {
        let picture = Some(self.prepared("environment", picture)?);
        let to_map = to_world.transpose();
        self.environment =
            Some(EnvironmentChange { picture, to_map, ..EnvironmentChange::of_radiance(radiance) });
        Ok(())
    }

    /// Sets the light from afar by `text`, which has the `[sky]` of a scene file.
    ///
    /// # Errors
    /// Those of a scene file called `sky`.
    pub fn sky(&mut self, text: &str) -> Result<(), LoadError> {
        self.environment = scene_file::environment(text, Path::new("sky"), &mut self.builder.budget)?;
        Ok(())
    }

    /// Sets the camera.
    pub fn view(&mut self, view: View, fov_degrees: f64) {
        self.view = Some((view, fov_degrees));
    }

    /// The scene.
    ///
    /// # Errors
    /// Insufficient memory, more vertices than 32 bits can count, or a camera that looks at its own position.
    pub fn build(self) -> Result<LoadedScene, LoadError> {
        let Self { builder, options, environment, view } = self;
        let name = Path::new("scene");
        let mut loaded = builder.build(name, &options, environment)?;
        loaded.files.clear();
        if let Some((view, fov_degrees)) = view {
            let camera = loaded.camera_at(view, fov_degrees).ok_or_else(|| {
                LoadError::of_file(name, "`eye` and `look_at` are the same point", "move one of them")
            })?;
            loaded.camera = Some(loaded.with_start(camera, view));
            loaded.view = Some(view);
        }
        Ok(loaded)
    }
}
