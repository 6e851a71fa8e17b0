//! Lightmaps: irradiance of the texels of charts, each with its interval.

use crate::arrays::array;
use crate::error::{invalid, raised};
use crate::irradiance::{PointKeywords, state};
use crate::scene::Renderer;
use crate::watch::watched;
use core::sync::atomic::Ordering;
use halflight::bake::{self, BakeProgress, DirectionalLayout, LightMap, LightmapSettings, Quantity, Texel};
use halflight::save::{Format, Patience, write_bytes};
use numpy::{PyArray2, PyArray4};
use pyo3::exceptions::PyBaseException;
use pyo3::prelude::*;
use std::path::PathBuf;

/// A map of irradiances.
#[pyclass(frozen, module = "halflight_render._halflight")]
pub(crate) struct Lightmap {
    map: LightMap,
    #[pyo3(get)]
    charts: usize,
    #[pyo3(get)]
    notes: Vec<String>,
    #[pyo3(get)]
    seconds: f64,
}

/// Size, name of the meshes, objects or materials, points of a texel, rings around charts, and whether the
/// irradiance is a function of the normal.
type MapParts = ([u32; 2], Option<String>, u32, u32, bool);

/// Bakes a lightmap. Returns it, and what ended the work early.
#[pyfunction]
pub(crate) fn lightmap<'py>(
    scene: Bound<'py, Renderer>,
    parts: MapParts,
    keywords: PointKeywords,
    callback: Option<Bound<'py, PyAny>>,
) -> PyResult<(Lightmap, Option<Py<PyBaseException>>)> {
    let (py, renderer) = (scene.py(), scene.get());
    let inner = renderer.inner()?;
    let loaded = inner.scene();
    let (size, subject, points, padding, directional) = parts;
    let layout = DirectionalLayout::Linear;
    let settings = LightmapSettings { subject, size, points, padding, directional, layout };
    let views = loaded.views();
    let mut budget = bake::budget(&views.scene(loaded.camera_or_default()), renderer.memory);
    let before = budget.left();
    let (texels, ended) = watched(py, None, |_, interrupt| {
        let mut watch = |_| !interrupt.load(Ordering::Relaxed);
        bake::Lightmap::new(loaded, settings, &mut budget, &mut watch)
    })?;
    if let Some(error) = ended {
        return Err(error);
    }
    let texels = texels.map_err(|error| invalid(py, &format!("{error}\n  help: {}", error.advice())))?;
    let left = budget.limit() + budget.left() - before;
    let settings = keywords.settings(py, Some(left))?;
    let (baked, ended) = watched(py, callback.as_ref(), |reporter, interrupt| {
        let mut progress = |progress: &BakeProgress| reporter.report(state(progress), || None);
        inner.irradiance_with(texels.points(), &settings, &mut progress, interrupt)
    })?;
    let baked = baked.map_err(|error| raised(py, error))?;
    let lightmap = Lightmap {
        map: py.detach(|| texels.map(&baked, Quantity::Irradiance, &|| true)),
        charts: texels.charts(),
        notes: texels.notes,
        seconds: baked.seconds[1],
    };
    Ok((lightmap, ended.map(|error| error.into_value(py))))
}

#[pymethods]
impl Lightmap {
    /// Values, (layers, rows, columns, 3).
    fn layers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray4<f32>>> {
        let [width, height] = self.map.size.map(|side| side as usize);
        let layers = &self.map.layers;
        array(py, (layers.len(), height, width, 3), layers.concat().into_flattened())
    }

    /// Half-widths of the intervals of the luminances, (rows, columns).
    fn half_widths<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let [width, height] = self.map.size.map(|side| side as usize);
        array(py, (height, width), self.map.half_widths.clone())
    }

    /// 0 for empty texels, 1 for filled ones, 2 for computed ones, (rows, columns).
    fn coverage<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u8>>> {
        let [width, height] = self.map.size.map(|side| side as usize);
        let number = |texel: &Texel| match texel {
            Texel::Empty => 0,
            Texel::Filled => 1,
            Texel::Computed => 2,
        };
        array(py, (height, width), self.map.texels.iter().map(number).collect())
    }

    /// Writes the values, or the half-widths of their intervals.
    fn save(&self, py: Python<'_>, path: PathBuf, has_errors: bool) -> PyResult<()> {
        let format = Format::of(&path).map_err(|error| raised(py, error))?;
        let written = py.detach(|| {
            let bytes = if has_errors { self.map.encode_error(format) } else { self.map.encode(format) };
            let bytes = bytes.map_err(|error| error.at(&path))?;
            write_bytes(&path, |file| file.write_all(&bytes), Patience::least())
        });
        written.map_err(|error| raised(py, error))
    }
}
