//! Irradiance of points, each value with its interval.

use crate::arrays::{array, rows};
use crate::error::{invalid, raised};
use crate::scene::Renderer;
use crate::watch::{State, watched};
use halflight::bake::{BakeProgress, BakeSettings, Quantity, Sensor};
use halflight::render::Stop;
use halflight_core::{IrradiancePoint, LightPart, PointMethod};
use numpy::PyReadonlyArray2;
use pyo3::exceptions::PyBaseException;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Settings of irradiance.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct PointKeywords {
    spp: Option<u32>,
    seconds: Option<f64>,
    error: Option<f64>,
    light: String,
    caustics: bool,
    seed: u32,
    max_depth: Option<u32>,
    threads: Option<usize>,
    back_faces: bool,
    method: String,
}

impl PointKeywords {
    pub(crate) fn settings(&self, py: Python<'_>, memory: Option<usize>) -> PyResult<BakeSettings> {
        let Self { spp, seconds, error, seed, max_depth, threads, back_faces, caustics, .. } = *self;
        let stop = Stop { spp, seconds, error };
        let light = match self.light.as_str() {
            "all" => LightPart::All,
            "direct" => LightPart::Direct,
            "indirect" => LightPart::Indirect,
            light => {
                let problem = format!("light={light}: expected one of all, direct, indirect");
                return Err(invalid(py, &problem));
            }
        };
        let method = match self.method.as_str() {
            "path" => PointMethod::Path,
            "irradiance-cache" => PointMethod::IrradianceCache,
            "auto" => PointMethod::Auto,
            method => {
                let problem = format!("method={method}: expected one of path, irradiance-cache, auto");
                return Err(invalid(py, &problem));
            }
        };
        Ok(BakeSettings {
            method,
            stop: if stop == Stop::default() { BakeSettings::SENSIBLE } else { stop },
            light,
            caustics,
            seed,
            max_depth,
            threads,
            memory,
            back_faces,
            ..BakeSettings::default()
        })
    }
}

/// Irradiance of points: a dictionary of arrays, and what ended the work early.
#[pyfunction]
pub(crate) fn irradiance<'py>(
    scene: Bound<'py, Renderer>,
    points: PyReadonlyArray2<'py, f64>,
    normals: PyReadonlyArray2<'py, f64>,
    keywords: PointKeywords,
    callback: Option<Bound<'py, PyAny>>,
) -> PyResult<(Bound<'py, PyDict>, Option<Py<PyBaseException>>)> {
    let (py, renderer) = (scene.py(), scene.get());
    let inner = renderer.inner()?;
    let points = renderer.points(py, &points, &normals)?;
    let settings = keywords.settings(py, renderer.memory)?;
    let (baked, ended) = watched(py, callback.as_ref(), |reporter, interrupt| {
        let mut progress = |progress: &BakeProgress| reporter.report(state(progress), || None);
        inner.irradiance_with(&points, &settings, &mut progress, interrupt)
    })?;
    let baked = baked.map_err(|error| raised(py, error))?;
    let values = &baked.values;
    let of = |quantity: Quantity, index: usize| {
        values.iter().map(|point| quantity.of(point).0[index]).collect::<Vec<f32>>()
    };
    let dict = PyDict::new(py);
    let rgb = values.iter().flat_map(|point| point.irradiance.to_array()).collect();
    dict.set_item("rgb", array(py, (values.len(), 3), rgb)?)?;
    for (name, quantity) in [("value", Quantity::Irradiance), ("lux", Quantity::Lux)] {
        for (index, end) in ["", "_lower", "_upper"].into_iter().enumerate() {
            dict.set_item(format!("{name}{end}"), array(py, values.len(), of(quantity, index))?)?;
        }
    }
    let samples = values.iter().map(|point| point.samples).collect();
    dict.set_item("samples", array(py, values.len(), samples)?)?;
    let back_faces = baked.back_faces.len();
    dict.set_item("back_faces", array(py, back_faces, baked.back_faces)?)?;
    dict.set_item("seconds", baked.seconds[1])?;
    dict.set_item("tiles", (baked.tiles[0], baked.tiles[1]))?;
    Ok((dict, ended.map(|error| error.into_value(py))))
}

/// Numbers of a progress.
pub(crate) fn state(progress: &BakeProgress) -> State {
    let [all, within] = progress.tiles;
    let (seconds, seconds_left) = (progress.seconds, progress.seconds_left);
    State { seconds, seconds_left, spp: progress.samples, error: None, tiles: Some((all, within)) }
}

impl Renderer {
    /// The points in the coordinates of the core.
    fn points(
        &self,
        py: Python<'_>,
        points: &PyReadonlyArray2<'_, f64>,
        normals: &PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Vec<IrradiancePoint>> {
        let (points, normals) =
            (rows::<f64, 3>(py, points, "points")?, rows::<f64, 3>(py, normals, "normals")?);
        if points.len() != normals.len() {
            let problem = format!("there are {} points and {} normals", points.len(), normals.len());
            return Err(invalid(py, &problem));
        }
        let scene = self.inner()?.scene();
        let point = |(index, (&position, &normal)): (usize, (&[f64; 3], &[f64; 3]))| {
            let is_good = position.iter().chain(&normal).all(|part| part.is_finite()) && normal != [0.0; 3];
            match is_good {
                true => Ok(Sensor { position, normal }.point(scene)),
                false => {
                    Err(invalid(py, &format!("point {index} is not finite, or its normal has no length")))
                }
            }
        };
        points.iter().zip(normals).enumerate().map(point).collect()
    }
}
