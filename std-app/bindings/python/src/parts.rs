//! Materials, lights and meshes of Python as parts of a scene.

use crate::arrays::rows;
use crate::error::{invalid, raised};
use halflight::load::{LoadOptions, LoadedScene, PartMesh, SceneParts, View};
use halflight_core::Rgb;
use halflight_core::scene::{ColorInput, Material, PointLight, Surface};
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;

/// Attributes of a material.
#[derive(FromPyObject)]
pub(crate) struct MaterialParts {
    name: String,
    kind: String,
    color: [f32; 3],
    specular: [f32; 3],
    roughness: f32,
    metallic: f32,
    ior: Option<f32>,
    emission: [f32; 3],
    two_sided: bool,
    opacity: f32,
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

impl MaterialParts {
    fn surface(&self, py: Python<'_>) -> PyResult<Surface> {
        let reflectance = || ColorInput::from(Rgb::from(self.color));
        let roughness = || self.roughness.into();
        let ior = self.ior.unwrap_or(1.5);
        Ok(match self.kind.as_str() {
            "diffuse" => Surface::Diffuse { reflectance: reflectance() },
            "mirror" => Surface::Mirror { reflectance: reflectance() },
            "metal" => Surface::Conductor { reflectance: reflectance(), roughness: roughness() },
            "coated" => Surface::Glossy {
                base: reflectance(),
                specular: ColorInput::from(Rgb::from(self.specular)),
                roughness: roughness(),
                metallic: self.metallic.into(),
                ior: self.ior,
            },
            "glass" => Surface::Dielectric { ior, tint: self.color.into(), roughness: roughness() },
            "pane" => Surface::Pane { ior, tint: self.color.into() },
            kind => return Err(invalid(py, &format!("there is no kind of material `{kind}`"))),
        })
    }

    fn material(&self, py: Python<'_>) -> PyResult<Material> {
        Ok(Material {
            surface: self.surface(py)?,
            emission: ColorInput::from(Rgb::from(self.emission)),
            two_sided: self.two_sided,
            opacity: self.opacity.into(),
            ..Material::GREY
        })
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
    (meshes, materials): (&[MeshParts<'_>], &[MaterialParts]),
    lights: &[LightParts],
    (environment, view): (Option<[f32; 3]>, Option<ViewParts>),
    memory: Option<usize>,
) -> PyResult<LoadedScene> {
    let surfaces = materials.iter().map(|material| material.material(py)).collect::<PyResult<Vec<_>>>()?;
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
        let named = materials.iter().zip(surfaces);
        let numbers: Vec<_> =
            named.map(|(material, surface)| parts.material(&material.name, surface)).collect();
        pieces.iter().try_for_each(|(name, mesh, material)| parts.mesh(name, mesh, numbers[*material]))?;
        lights.into_iter().for_each(|light| parts.light(light));
        if let Some(radiance) = environment {
            parts.environment(radiance.into());
        }
        if let Some((eye, look_at, up, fov_degrees)) = view {
            parts.view(View { eye, look_at, up }, fov_degrees);
        }
        parts.build()
    };
    py.detach(build).map_err(|error| raised(py, error))
}
