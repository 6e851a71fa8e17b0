//! Scenes: loading, building, rays, and the arrays of what was loaded.

use crate::arrays::{array, rows};
use crate::error::{invalid, raised};
use crate::parts::{EnvironmentParts, LightParts, MaterialParts, MeshParts, TextureParts, ViewParts, loaded};
use halflight::load::{LoadOptions, LoadedScene, load};
use halflight_core::geometry::{MISS, Ray};
use halflight_core::parts::rays::SurfacePoint;
use halflight_core::parts::scattering::All;
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::path::PathBuf;

/// A loaded scene with its structures.
#[pyclass(frozen, module = "halflight_render._halflight")]
pub(crate) struct Renderer {
    inner: halflight::Renderer,
    name: PathBuf,
    /// Limit of memory, bytes.
    pub(crate) memory: Option<usize>,
    /// The process whose threads it has.
    process: u32,
}

impl Renderer {
    fn new(py: Python<'_>, name: PathBuf, scene: LoadedScene, memory: Option<usize>) -> PyResult<Self> {
        let inner =
            py.detach(|| halflight::Renderer::new(scene, memory)).map_err(|error| raised(py, error))?;
        Ok(Self { inner, name, memory, process: std::process::id() })
    }

    /// The renderer, whose threads a fork does not copy.
    pub(crate) fn inner(&self) -> PyResult<&halflight::Renderer> {
        if self.process == std::process::id() {
            return Ok(&self.inner);
        }
        let problem = "this scene was opened before a fork of the process, which copies no threads: open it \
            in the new process, or start processes by `spawn`";
        Err(PyRuntimeError::new_err(problem))
    }

    /// File of the scene, or its name.
    pub(crate) fn name(&self) -> &PathBuf {
        &self.name
    }

    fn scene(&self) -> &LoadedScene {
        self.inner.scene()
    }
}

/// Loads a scene file or a mesh, and builds its structures within `memory` bytes. With `charts` its texture
/// coordinates are those of the files.
#[pyfunction]
pub(crate) fn open(py: Python<'_>, path: PathBuf, memory: Option<usize>, charts: bool) -> PyResult<Renderer> {
    let options = LoadOptions { memory, keeps_texcoords: charts, ..LoadOptions::default() };
    let scene = py.detach(|| load(&path, &options)).map_err(|error| raised(py, error))?;
    Renderer::new(py, path, scene, memory)
}

/// Makes a scene from arrays and builds its structures.
#[pyfunction]
pub(crate) fn build(
    py: Python<'_>,
    meshes: Vec<MeshParts<'_>>,
    materials: (Vec<TextureParts<'_>>, Vec<MaterialParts>),
    lights: Vec<LightParts>,
    environment: Option<EnvironmentParts<'_>>,
    view: Option<ViewParts>,
    memory: Option<usize>,
) -> PyResult<Renderer> {
    let scene = loaded(py, &meshes, materials, &lights, (environment, view), memory)?;
    Renderer::new(py, "scene".into(), scene, memory)
}

/// Positions and normals of a file of sensors, `x y z nx ny nz` a line.
#[pyfunction]
#[allow(clippy::type_complexity)]
pub(crate) fn read_sensors(
    py: Python<'_>,
    path: PathBuf,
) -> PyResult<(Bound<'_, PyArray2<f64>>, Bound<'_, PyArray2<f64>>)> {
    let sensors = py.detach(|| halflight::bake::read_sensors(&path, usize::MAX));
    let sensors = sensors.map_err(|error| raised(py, error))?;
    let positions = sensors.iter().flat_map(|sensor| sensor.position).collect();
    let normals = sensors.iter().flat_map(|sensor| sensor.normal).collect();
    Ok((array(py, (sensors.len(), 3), positions)?, array(py, (sensors.len(), 3), normals)?))
}

/// Nearest hits: distance in lengths of the directions, triangle or -1, weights of its second and third
/// corner, shading normal on the side of the ray, material or -1.
type Hits<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<i64>>,
);

#[pymethods]
impl Renderer {
    /// Notes of the loader, and that nothing emits light.
    #[getter]
    fn notes(&self) -> Vec<String> {
        let loaded = self.scene();
        let is_dark = loaded.views().scene(loaded.camera_or_default()).is_dark();
        let dark = is_dark.then(|| "nothing in this scene emits light: its pictures are black".to_owned());
        loaded.repairs.iter().cloned().chain(dark).collect()
    }

    /// Vertex positions in the coordinates of the files.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let scene = self.scene();
        let positions = scene.positions.iter().flat_map(|&at| scene.transform.to_user(at.into())).collect();
        array(py, (scene.positions.len(), 3), positions)
    }

    /// Texture coordinates of the vertices; none without textures or charts.
    #[getter]
    fn texcoords<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let texcoords = &self.scene().texcoords;
        array(py, (texcoords.len(), 2), texcoords.as_flattened().to_vec())
    }

    /// Names of the objects, to which numbers of layers refer.
    #[getter]
    fn object_names(&self) -> Vec<String> {
        self.scene().object_names.clone()
    }

    /// Corners of the triangles.
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let triangles = &self.scene().triangles;
        array(py, (triangles.len(), 3), triangles.iter().flat_map(|triangle| triangle.vertices).collect())
    }

    /// Material of each triangle.
    #[getter]
    fn triangle_materials<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let triangles = &self.scene().triangles;
        array(py, triangles.len(), triangles.iter().map(|triangle| triangle.material).collect())
    }

    /// Names of the materials.
    #[getter]
    fn material_names(&self) -> Vec<String> {
        self.scene().material_names.clone()
    }

    /// Names of the meshes, and the first vertex of each and of the next.
    #[getter]
    fn meshes(&self) -> Vec<(String, u32, u32)> {
        let meshes = self.scene().meshes.iter();
        meshes.map(|(name, vertices)| (name.clone(), vertices.start, vertices.end)).collect()
    }

    /// Lower and upper corner of the bounding box, in the coordinates of the files.
    #[getter]
    fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        let scene = self.scene();
        let points = scene.positions.iter().map(|&at| scene.transform.to_user(at.into()));
        points.fold(None, |bounds, at| {
            let (low, high) = bounds.unwrap_or((at, at));
            let pick = |of: fn(f64, f64) -> f64, a: [f64; 3]| core::array::from_fn(|i| of(a[i], at[i]));
            Some((pick(f64::min, low), pick(f64::max, high)))
        })
    }

    /// Nearest hits of rays.
    fn trace<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f64>,
        directions: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Hits<'py>> {
        let (rays, lengths) = self.rays(py, &origins, &directions, None)?;
        let inner = self.inner()?;
        let hits = py.detach(|| inner.nearest(&rays)).map_err(|error| raised(py, error))?;
        let scene = self.scene();
        let views = scene.views();
        let whole = views.scene(scene.camera_or_default());
        let count = rays.len();
        let (mut normals, mut materials) = (Vec::with_capacity(3 * count), Vec::with_capacity(count));
        for (ray, hit) in rays.iter().zip(&hits) {
            let point = SurfacePoint::at::<All>(&whole, ray, hit);
            normals.extend(point.map_or([f32::NAN; 3], |point| point.frame.normal.to_array()));
            let triangle = scene.triangles.get(hit.triangle as usize);
            materials.push(triangle.map_or(-1, |triangle| i64::from(triangle.material)));
        }
        let distances = hits.iter().zip(&lengths).map(|(hit, length)| f64::from(hit.t) * length).collect();
        let triangle = |triangle: u32| if triangle == MISS { -1 } else { i64::from(triangle) };
        Ok((
            array(py, count, distances)?,
            array(py, count, hits.iter().map(|hit| triangle(hit.triangle)).collect())?,
            array(py, (count, 2), hits.iter().flat_map(|hit| [hit.u, hit.v]).collect())?,
            array(py, (count, 3), normals)?,
            array(py, count, materials)?,
        ))
    }

    /// True for each ray that hits anything before `limits`, in lengths of its direction.
    fn occluded<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f64>,
        directions: PyReadonlyArray2<'py, f64>,
        limits: Option<Vec<f64>>,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let (rays, _) = self.rays(py, &origins, &directions, limits.as_deref())?;
        let inner = self.inner()?;
        let hidden = py.detach(|| inner.occluded(&rays)).map_err(|error| raised(py, error))?;
        array(py, hidden.len(), hidden.into_iter().map(|hidden| hidden != 0).collect())
    }
}

impl Renderer {
    /// Rays in the coordinates of the core, and their unit of length in lengths of the given directions.
    fn rays(
        &self,
        py: Python<'_>,
        origins: &PyReadonlyArray2<'_, f64>,
        directions: &PyReadonlyArray2<'_, f64>,
        limits: Option<&[f64]>,
    ) -> PyResult<(Vec<Ray>, Vec<f64>)> {
        let (origins, directions) = (rows(py, origins, "origins")?, rows(py, directions, "directions")?);
        let transform = self.scene().transform;
        let count = origins.len();
        if directions.len() != count || limits.is_some_and(|limits| limits.len() != count) {
            return Err(invalid(
                py,
                &format!("there are {count} origins and {} directions", directions.len()),
            ));
        }
        let ray = |index: usize| {
            let (origin, direction): ([f64; 3], [f64; 3]) = (origins[index], directions[index]);
            let largest = direction.iter().fold(0.0f64, |largest, part| largest.max(part.abs()));
            // A ray without a direction hits nothing.
            let unit = direction.map(|part| (part / largest) as f32);
            let length = 1.0 / (transform.length(1.0) * largest);
            let limit = limits.map_or(f32::INFINITY, |limits| (limits[index] / length) as f32);
            (Ray::segment(transform.point(origin), unit.into(), limit), length)
        };
        Ok((0..count).map(ray).unzip())
    }
}
