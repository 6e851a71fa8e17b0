//! Parts that can be used alone: nearest photons, eigen decompositions, comparison of pictures, picture
//! files.

use crate::arrays::{array, image, pixels, rows};
use crate::error::{invalid, raised};
use crate::picture::view;
use halflight::pool::in_pool;
use halflight::save::{self, Format, Image};
use halflight_core::glam::Vec3;
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::parts::eigen::{Decomposed2, Decomposed3, Matrices2, Matrices3};
use halflight_core::parts::photons::{Neighbours, Photon, PhotonMap};
use halflight_core::photon::{PHOTONS_MAX, QueryOrder};
use halflight_core::{Level, parts};
use numpy::{PyArray2, PyArray3, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use self_cell::MutBorrow;
use std::path::PathBuf;

self_cell::self_cell!(
    struct OwnedMap {
        owner: MutBorrow<Vec<Line>>,
        #[covariant]
        dependent: PhotonMap,
    }
);

/// A k-d tree over points, for searches of the nearest.
#[pyclass(frozen, module = "halflight_render._halflight")]
pub(crate) struct Photons(OwnedMap);

/// Lines of a footprint, zeroed; memory that the system refuses is an exception.
fn lines(footprint: Footprint) -> PyResult<Vec<Line>> {
    let mut lines = Vec::new();
    let count = footprint.bytes().div_ceil(size_of::<Line>());
    lines.try_reserve_exact(count).map_err(|error| PyMemoryError::new_err(error.to_string()))?;
    lines.resize(count, Line::ZERO);
    Ok(lines)
}

/// Memory of a footprint always suffices.
fn short(_: halflight_core::memory::OutOfMemory) -> PyErr {
    PyMemoryError::new_err("the memory of the search does not suffice")
}

#[pymethods]
impl Photons {
    #[new]
    fn new(py: Python<'_>, positions: PyReadonlyArray2<'_, f32>) -> PyResult<Self> {
        let positions = rows::<f32, 3>(py, &positions, "positions")?;
        if positions.len() > PHOTONS_MAX {
            return Err(invalid(py, &format!("a map holds {PHOTONS_MAX} points at most")));
        }
        let owner = MutBorrow::new(lines(parts::photons::Photons::footprint(positions.len()))?);
        let build = || {
            OwnedMap::try_new(owner, |owner| {
                let mut photons =
                    parts::photons::Photons::new(positions.len(), &mut Arena::over(owner.borrow_mut()))?;
                for (tag, (slot, &at)) in (0..).zip(photons.as_mut_slice().iter_mut().zip(positions)) {
                    *slot = Photon::tagged(at.into(), Vec3::Y, Vec3::Y, tag);
                }
                Ok(photons.build(positions.len()))
            })
        };
        Ok(Self(py.detach(build).map_err(short)?))
    }

    /// Number of points, without those that are not finite.
    fn __len__(&self) -> usize {
        self.0.borrow_dependent().len()
    }

    /// Indices and squared distances of the `k` nearest points of each place within a radius, nearest first;
    /// -1 and infinity where there are fewer.
    #[allow(clippy::type_complexity)]
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        places: PyReadonlyArray2<'py, f32>,
        k: usize,
        radius: f32,
    ) -> PyResult<(Bound<'py, PyArray2<i64>>, Bound<'py, PyArray2<f32>>)> {
        let places: Vec<Vec3> = rows(py, &places, "points")?.iter().map(|&at: &[f32; 3]| at.into()).collect();
        let map = self.0.borrow_dependent();
        let k = k.min(map.len());
        let mut memory = lines(Neighbours::footprint(k))?;
        let search = || {
            let mut neighbours = Neighbours::new(k, &mut Arena::over(&mut memory))?;
            let mut order = vec![QueryOrder::default(); places.len()];
            let mut indices = vec![-1i64; k * places.len()];
            let mut distances = vec![f32::INFINITY; k * places.len()];
            map.nearest_batch(
                Level::detect(),
                &places,
                radius,
                &mut order,
                &mut neighbours,
                |place, found| {
                    let tag = |index: u32| map.get(index).map_or(-1, |photon| i64::from(photon.tag()));
                    let mut found: Vec<(f32, i64)> =
                        found.iter().map(|(i, distance)| (distance, tag(i))).collect();
                    found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                    for (slot, (distance, index)) in (k * place..).zip(found) {
                        (indices[slot], distances[slot]) = (index, distance);
                    }
                },
            );
            Ok((indices, distances))
        };
        let (indices, distances) = py.detach(search).map_err(short)?;
        Ok((array(py, (places.len(), k), indices)?, array(py, (places.len(), k), distances)?))
    }
}

/// Columns of sixteen matrices from rows of `N` entries.
fn columns<const N: usize>(matrices: &[[f32; N]]) -> Vec<[[f32; 16]; N]> {
    let of = |chunk: &[[f32; N]]| {
        core::array::from_fn(|entry| core::array::from_fn(|lane| chunk.get(lane).map_or(0.0, |m| m[entry])))
    };
    matrices.chunks(16).map(of).collect()
}

/// Rows of `N` results from columns of sixteen.
fn flat<const N: usize>(columns: &[[[f32; 16]; N]], count: usize) -> Vec<f32> {
    (0..count).flat_map(|i| core::array::from_fn::<f32, N, _>(|part| columns[i / 16][part][i % 16])).collect()
}

/// Eigen decompositions of matrices xx, xy, yy: rows of both values, the larger magnitude first, and the axis
/// of the first.
#[pyfunction]
pub(crate) fn decompose2<'py>(
    py: Python<'py>,
    matrices: PyReadonlyArray2<'py, f32>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let matrices = rows::<f32, 3>(py, &matrices, "matrices")?;
    let columns: Vec<Matrices2> = columns(matrices);
    let mut results: Vec<Decomposed2> = vec![[[0.0; 16]; 4]; columns.len()];
    py.detach(|| parts::eigen::decompose2(Level::detect(), &columns, &mut results));
    array(py, (matrices.len(), 4), flat(&results, matrices.len()))
}

/// Eigen decompositions of matrices xx, xy, xz, yy, yz, zz: rows of the values by magnitude, then the
/// vectors.
#[pyfunction]
pub(crate) fn decompose3<'py>(
    py: Python<'py>,
    matrices: PyReadonlyArray2<'py, f32>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let matrices = rows::<f32, 6>(py, &matrices, "matrices")?;
    let columns: Vec<Matrices3> = columns(matrices);
    let mut results: Vec<Decomposed3> = vec![[[0.0; 16]; 12]; columns.len()];
    py.detach(|| parts::eigen::decompose3(Level::detect(), &columns, &mut results));
    array(py, (matrices.len(), 12), flat(&results, matrices.len()))
}

/// Runs `work` on threads of its own, without the interpreter.
fn pooled<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| in_pool(None, work)).map_err(|error| invalid(py, &error.to_string()))
}

/// Errors of a picture against a reference: relmse, mse, rmse, flip, means.
#[pyfunction]
pub(crate) fn compare<'py>(
    py: Python<'py>,
    shown: PyReadonlyArray3<'py, f32>,
    reference: PyReadonlyArray3<'py, f32>,
) -> PyResult<Bound<'py, PyDict>> {
    let (shown, reference) = (image(py, &shown)?, image(py, &reference)?);
    let compared = pooled(py, || halflight::compare::compare(&shown, &reference))?;
    let compared = compared.map_err(|error| invalid(py, &error.to_string()))?;
    let linear = &compared.linear;
    let dict = PyDict::new(py);
    for (name, value) in [
        ("relmse", linear.relmse),
        ("mse", linear.mse),
        ("rmse", linear.rmse()),
        ("flip", compared.flip),
        ("mean", linear.mean),
        ("reference_mean", linear.reference_mean),
    ] {
        dict.set_item(name, value)?;
    }
    dict.set_item("non_finite", linear.non_finite)?;
    Ok(dict)
}

/// The FLIP error of each pixel, 0 … 1.
#[pyfunction]
pub(crate) fn flip<'py>(
    py: Python<'py>,
    shown: PyReadonlyArray3<'py, f32>,
    reference: PyReadonlyArray3<'py, f32>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let (shown, reference) = (image(py, &shown)?, image(py, &reference)?);
    let size = |image: &Image| (image.height as usize, image.width as usize);
    if size(&shown) != size(&reference) {
        return Err(invalid(py, "the pictures differ in size"));
    }
    let map = pooled(py, || halflight::compare::flip(&shown, &reference))?;
    array(py, size(&shown), map)
}

/// A picture file as an array.
#[pyfunction]
pub(crate) fn read_image(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyArray3<f32>>> {
    let read = pooled(py, || save::read(&path))?;
    pixels(py, read.map_err(|error| raised(py, error))?)
}

/// Writes a picture; PNG files as a display shows it.
#[pyfunction]
pub(crate) fn write_image(
    py: Python<'_>,
    path: PathBuf,
    picture: PyReadonlyArray3<'_, f32>,
    stops: Option<f32>,
    curve: &str,
) -> PyResult<()> {
    let format = Format::of(&path).map_err(|error| raised(py, error))?;
    let picture = image(py, &picture)?;
    let shown = view(py, &picture, stops, curve)?;
    let written = py.detach(|| save::write(&path, if format.is_linear() { &picture } else { &shown }));
    written.map_err(|error| raised(py, error))
}

/// The bytes of a PNG file with a picture.
#[pyfunction]
pub(crate) fn encode<'py>(
    py: Python<'py>,
    picture: PyReadonlyArray3<'py, f32>,
    stops: Option<f32>,
    curve: &str,
) -> PyResult<Bound<'py, PyBytes>> {
    let shown = view(py, &image(py, &picture)?, stops, curve)?;
    encoded(py, &shown, Format::Png)
}

/// The bytes of a picture file.
pub(crate) fn encoded<'py>(py: Python<'py>, image: &Image, format: Format) -> PyResult<Bound<'py, PyBytes>> {
    let bytes = py.detach(|| save::encode(image, format)).map_err(|error| raised(py, error))?;
    Ok(PyBytes::new(py, &bytes))
}
