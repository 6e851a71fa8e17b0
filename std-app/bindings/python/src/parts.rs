//! Materials, lights and meshes of Python as parts of a scene.

use crate::arrays::rows;
use crate::error::{invalid, raised};
use halflight::load::{LoadError, LoadOptions, LoadedScene, PartMesh, SceneParts, View};
use halflight::picture::{Picture, Samples};
use halflight_core::Rgb;
use halflight_core::glam::Mat3;
use halflight_core::scene::{ColorInput, Material, NormalMap, PointLight, ScalarInput, Surface, TextureId};
use numpy::{Element, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// A value, and the texture that it multiplies.
type Input<T> = (T, Option<usize>);

/// Attributes of a material.
#[derive(FromPyObject)]
pub(crate) struct MaterialParts {
    name: String,
    kind: String,
    color: Input<[f32; 3]>,
    specular: Input<[f32; 3]>,
    roughness: Input<f32>,
    metallic: Input<f32>,
    ior: Option<f32>,
    emission: Input<[f32; 3]>,
    two_sided: bool,
    opacity: Input<f32>,
    /// Texture of normals and its strength.
    normals: Option<(usize, f32)>,
    /// Texture of heights and its factor.
    heights: Option<(usize, f32)>,
}

/// Pixels in rows from the top, of one channel or three.
#[derive(FromPyObject)]
pub(crate) enum PixelParts<'py> {
    Bytes(PyReadonlyArray3<'py, u8>),
    Floats(PyReadonlyArray3<'py, f32>),
}

/// A texture: its name, pixels, and whether they are colours.
pub(crate) type TextureParts<'py> = (String, PixelParts<'py>, bool);

/// Light from afar.
#[derive(FromPyObject)]
pub(crate) enum EnvironmentParts<'py> {
    Radiance([f32; 3]),
    /// Pixels, a factor, and rows of the rotation from the map to the world.
    Map(PixelParts<'py>, [f32; 3], [[f32; 3]; 3]),
    /// The `[sky]` of a scene file.
    Sky(String),
}

/// Attributes of a light without surface.
#[derive(FromPyObject)]
pub(crate) struct LightParts {
    kind: String,
    position: [f32; 3],
    direction: [f32; 3],
    color: [f32; 3],
    /// Half-angles in degrees up to which a cone has full intensity, and from which it has none.
    angles: [f32; 2],
}

/// A mesh: name, positions, normals, texture coordinates, triangles, and the index of its material.
pub(crate) type MeshParts<'py> = (
    String,
    PyReadonlyArray2<'py, f64>,
    Option<PyReadonlyArray2<'py, f64>>,
    Option<PyReadonlyArray2<'py, f64>>,
    PyReadonlyArray2<'py, u32>,
    usize,
);

/// Position, point that the camera looks at, direction up, and vertical field of view in degrees.
pub(crate) type ViewParts = ([f64; 3], [f64; 3], [f64; 3], f64);

/// Pixels of three channels.
fn triples<T: Element + Copy>(py: Python<'_>, array: &PyReadonlyArray3<'_, T>) -> PyResult<Vec<[T; 3]>> {
    let flat = array.as_slice().map_err(|_| invalid(py, "a picture is not contiguous"))?;
    match array.shape()[2] {
        1 => Ok(flat.iter().map(|&value| [value; 3]).collect()),
        3 => Ok(flat.as_chunks().0.to_vec()),
        channels => Err(invalid(py, &format!("a texture has one channel or three, not {channels}"))),
    }
}

impl PixelParts<'_> {
    fn picture(&self, py: Python<'_>) -> PyResult<Picture> {
        let (samples, shape) = match self {
            Self::Bytes(bytes) => {
                let opaque = triples(py, bytes)?.into_iter().flat_map(|[r, g, b]| [r, g, b, u8::MAX]);
                (Samples::Bytes(opaque.collect()), bytes.shape())
            }
            Self::Floats(floats) => {
                (Samples::Floats { rgb: triples(py, floats)?, alpha: Vec::new() }, floats.shape())
            }
        };
        let side = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
        Ok(Picture {
            width: side(shape[1]),
            height: side(shape[0]),
            samples,
            has_alpha: false,
            notes: Vec::new(),
        })
    }
}

/// Light from afar without arrays of Python.
enum Distant {
    Radiance(Rgb),
    Map(Picture, Rgb, Mat3),
    Sky(String),
}

impl EnvironmentParts<'_> {
    fn read(self, py: Python<'_>) -> PyResult<Distant> {
        Ok(match self {
            Self::Radiance(radiance) => Distant::Radiance(radiance.into()),
            Self::Map(pixels, radiance, rows) => {
                let to_world = Mat3::from_cols_array_2d(&rows).transpose();
                Distant::Map(pixels.picture(py)?, radiance.into(), to_world)
            }
            Self::Sky(text) => Distant::Sky(text),
        })
    }
}

impl Distant {
    fn add_to(self, parts: &mut SceneParts) -> Result<(), LoadError> {
        match self {
            Self::Radiance(radiance) => parts.environment(radiance),
            Self::Map(picture, radiance, to_world) => parts.environment_map(picture, radiance, to_world)?,
            Self::Sky(text) => parts.sky(&text)?,
        }
        Ok(())
    }
}

/// A colour and its texture.
fn color(&(value, texture): &Input<[f32; 3]>, ids: &[TextureId]) -> ColorInput {
    ColorInput { texture: texture.and_then(|at| ids.get(at).copied()), ..Rgb::from(value).into() }
}

/// A number and the first channel of its texture.
fn scalar(&(value, texture): &Input<f32>, ids: &[TextureId]) -> ScalarInput {
    ScalarInput { texture: texture.and_then(|at| Some((*ids.get(at)?, 0))), ..value.into() }
}

impl MaterialParts {
    fn surface(&self, ids: &[TextureId]) -> Surface {
        let reflectance = || color(&self.color, ids);
        let tint = Rgb::from(self.color.0);
        let roughness = || scalar(&self.roughness, ids);
        let ior = self.ior.unwrap_or(1.5);
        match self.kind.as_str() {
            "mirror" => Surface::Mirror { reflectance: reflectance() },
            "metal" => Surface::Conductor { reflectance: reflectance(), roughness: roughness() },
            "coated" => Surface::Glossy {
                base: reflectance(),
                specular: color(&self.specular, ids),
                roughness: roughness(),
                metallic: scalar(&self.metallic, ids),
                ior: self.ior,
            },
            "glass" => Surface::Dielectric { ior, tint, roughness: roughness() },
            "pane" => Surface::Pane { ior, tint },
            // `Material` knows no other kind.
            _ => Surface::Diffuse { reflectance: reflectance() },
        }
    }

    fn material(&self, ids: &[TextureId]) -> Material {
        let relief = |part: Option<(usize, f32)>| part.and_then(|(at, scale)| Some((*ids.get(at)?, scale)));
        let normals = relief(self.normals).map(|(id, scale)| NormalMap::Tangent(id, scale));
        let heights = || relief(self.heights).map(|(id, scale)| NormalMap::Height(id, scale));
        Material {
            surface: self.surface(ids),
            emission: color(&self.emission, ids),
            two_sided: self.two_sided,
            opacity: scalar(&self.opacity, ids),
            normal_map: normals.or_else(heights),
        }
    }
}

impl LightParts {
    fn light(&self, py: Python<'_>) -> PyResult<PointLight> {
        let (position, direction, color) =
            (self.position.into(), self.direction.into(), Rgb::from(self.color));
        let [cos_inner, cos_outer] = self.angles.map(|degrees| degrees.to_radians().cos());
        Ok(match self.kind.as_str() {
            "point" => PointLight::Point { position, intensity: color },
            "spot" => PointLight::Spot { position, direction, intensity: color, cos_inner, cos_outer },
            "directional" => PointLight::Directional { direction, irradiance: color },
            kind => return Err(invalid(py, &format!("there is no kind of light `{kind}`"))),
        })
    }
}

/// The scene of these parts, with the repairs of the loader.
pub(crate) fn loaded(
    py: Python<'_>,
    meshes: &[MeshParts<'_>],
    (textures, materials): (Vec<TextureParts<'_>>, Vec<MaterialParts>),
    lights: &[LightParts],
    (environment, view): (Option<EnvironmentParts<'_>>, Option<ViewParts>),
    memory: Option<usize>,
) -> PyResult<LoadedScene> {
    let textures = textures
        .into_iter()
        .map(|(name, pixels, has_colours)| pixels.picture(py).map(|picture| (name, picture, has_colours)));
    let textures = textures.collect::<PyResult<Vec<_>>>()?;
    let environment = environment.map(|light| light.read(py)).transpose()?;
    let lights = lights.iter().map(|light| light.light(py)).collect::<PyResult<Vec<_>>>()?;
    let mut pieces = Vec::with_capacity(meshes.len());
    for (name, positions, normals, texcoords, triangles, material) in meshes {
        let normals = normals.as_ref().map(|normals| rows(py, normals, "normals")).transpose()?;
        let texcoords =
            texcoords.as_ref().map(|texcoords| rows(py, texcoords, "texture coordinates")).transpose()?;
        let mesh = PartMesh {
            positions: rows(py, positions, "positions")?,
            normals: normals.unwrap_or_default(),
            texcoords: texcoords.unwrap_or_default(),
            triangles: rows(py, triangles, "triangles")?,
        };
        if *material >= materials.len() {
            return Err(invalid(py, &format!("the mesh `{name}` has a material that does not exist")));
        }
        pieces.push((name, mesh, *material));
    }
    let build = || {
        let mut parts = SceneParts::new(LoadOptions { memory, ..LoadOptions::default() });
        let textures = textures.into_iter();
        let ids = textures.map(|(name, picture, has_colours)| parts.texture(&name, picture, has_colours));
        let ids = ids.collect::<Result<Vec<_>, _>>()?;
        environment.map_or(Ok(()), |light| light.add_to(&mut parts))?;
        let numbers: Vec<_> = materials
            .iter()
            .map(|material| parts.material(&material.name, material.material(&ids)))
            .collect();
        pieces.iter().try_for_each(|(name, mesh, material)| parts.mesh(name, mesh, numbers[*material]))?;
        lights.into_iter().for_each(|light| parts.light(light));
        if let Some((eye, look_at, up, fov_degrees)) = view {
            parts.view(View { eye, look_at, up }, fov_degrees);
        }
        parts.build()
    };
    py.detach(build).map_err(|error| raised(py, error))
}
