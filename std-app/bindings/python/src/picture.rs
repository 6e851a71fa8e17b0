//! Renders, and their pictures with estimates of the error.

use crate::arrays::{array, image, pixels};
use crate::error::{invalid, raised, refused};
use crate::scene::Renderer;
use crate::watch::{State, watched};
use halflight::cli::Keywords;
use halflight::compare::compare;
use halflight::layers::{Facts, LayerSource, add_layers};
use halflight::load::LoadedScene;
use halflight::render::{Progress, RenderResult, Settings};
use halflight::report::{Provenance, Run, check_folder, write_folder};
use halflight::save::{Curve, ExrFile, Image, Patience, ViewTransform, automatic_stops, write_exr};
use halflight_core::scene::Camera;
use numpy::{PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray3};
use pyo3::exceptions::PyBaseException;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::path::PathBuf;
use std::sync::Arc;

/// Names of all settings of a render that flags of the program have.
#[pyfunction]
pub(crate) fn keywords() -> Vec<String> {
    Keywords::names()
}

/// A picture with its statistics.
#[pyclass(frozen, module = "halflight_render._halflight")]
pub(crate) struct Rendered {
    scene: Py<Renderer>,
    settings: Settings,
    camera: Camera,
    /// Without the arrays.
    result: RenderResult,
    image: Py<PyArray3<f32>>,
    variance: Py<PyArray3<f32>>,
    samples: Py<PyArray2<u32>>,
}

/// Renders with settings by keyword and value. Returns the picture, and what ended the render early.
#[pyfunction]
pub(crate) fn render<'py>(
    scene: Bound<'py, Renderer>,
    words: Vec<(String, String)>,
    reference: Option<PyReadonlyArray3<'py, f32>>,
    callback: Option<Bound<'py, PyAny>>,
) -> PyResult<(Rendered, Option<Py<PyBaseException>>)> {
    let (py, renderer) = (scene.py(), scene.get());
    let inner = renderer.inner()?;
    let reference = reference.map(|reference| image(py, &reference)).transpose()?.map(Arc::new);
    let parsed = Keywords::parse(renderer.name(), &words).map_err(|error| refused(py, &error))?;
    let chosen = parsed.settings(inner.scene(), reference);
    let (mut settings, camera) = chosen.map_err(|error| refused(py, &error))?;
    settings.memory = settings.memory.or(renderer.memory);
    if let Some((_, folder)) = words.iter().find(|(name, _)| name == "report") {
        check_folder(folder.as_ref()).map_err(|error| raised(py, error))?;
    }
    let (result, ended) = watched(py, callback.as_ref(), |reporter, interrupt| {
        let mut progress = |progress: &Progress| reporter.report(state(progress), || progress.picture());
        inner.render_with(camera, &settings, &mut progress, interrupt)
    })?;
    let result = result.map_err(|error| raised(py, error))?;
    let rendered = Rendered::new(py, scene.clone().unbind(), (settings, camera), result)?;
    Ok((rendered, ended.map(|error| error.into_value(py))))
}

/// Numbers of a progress.
fn state(progress: &Progress) -> State {
    State {
        seconds: progress.seconds,
        seconds_left: progress.seconds_left,
        spp: progress.spp,
        error: progress.error.map(|error| (error.relmse, error.lower, error.upper)),
        tiles: None,
    }
}

impl Rendered {
    /// Moves the pictures of `result` into arrays.
    fn new(
        py: Python<'_>,
        scene: Py<Renderer>,
        (settings, camera): (Settings, Camera),
        mut result: RenderResult,
    ) -> PyResult<Self> {
        let empty = || Image { width: 0, height: 0, pixels: Vec::new() };
        let shown = core::mem::replace(&mut result.image, empty());
        let variance = core::mem::replace(&mut result.variance, empty());
        let shape = (shown.height as usize, shown.width as usize);
        let samples = array(py, shape, core::mem::take(&mut result.samples))?;
        let (image, variance) = (pixels(py, shown)?.unbind(), pixels(py, variance)?.unbind());
        Ok(Self { scene, settings, camera, result, image, variance, samples: samples.unbind() })
    }

    /// The result with copies of its pictures.
    fn whole(&self, py: Python<'_>) -> PyResult<RenderResult> {
        Ok(RenderResult {
            image: image(py, &self.image.bind(py).readonly())?,
            variance: image(py, &self.variance.bind(py).readonly())?,
            samples: self.samples.bind(py).readonly().as_slice()?.to_vec(),
            ..self.result.clone()
        })
    }

    /// Calls `with` the facts of a report.
    fn described<T: Send>(
        &self,
        py: Python<'_>,
        with: impl FnOnce(&Run, &LoadedScene) -> T + Send,
    ) -> PyResult<T> {
        let result = self.whole(py)?;
        let renderer = self.scene.get();
        let scene = renderer.inner()?.scene();
        let name = renderer.name().file_name().unwrap_or_default().to_string_lossy();
        let described = || {
            let reference = self.settings.reference.as_deref();
            // Both have the same size.
            let comparison = reference.and_then(|reference| compare(&result.image, reference).ok());
            let views = scene.views();
            let run = Run {
                scene: &views.scene(self.camera),
                name: &name,
                repairs: &scene.repairs,
                settings: &self.settings,
                result: &result,
                comparison: comparison.as_ref(),
                outputs: &[],
                load_seconds: 0.0,
                total_seconds: result.seconds.build + result.seconds.render,
                provenance: &Provenance::here(),
            };
            with(&run, scene)
        };
        Ok(py.detach(described))
    }

    /// Calls `with` the picture, its layers and its facts as an OpenEXR file.
    fn exr<T: Send>(&self, py: Python<'_>, with: impl FnOnce(ExrFile) -> T + Send) -> PyResult<T> {
        self.described(py, |run, scene| {
            let mut file = ExrFile::of(&run.result.image);
            Facts::of_render(run.result, (run.name, run.settings), run.provenance).add_to(&mut file);
            if let Some(wanted) = &self.settings.layers {
                add_layers(&mut file, &wanted.layers, &LayerSource::new(run.result, scene));
            }
            with(file)
        })
    }
}

/// The picture as displays show it: stops of exposure, `None` for those that show it best, and a curve.
pub(crate) fn view(py: Python<'_>, image: &Image, stops: Option<f32>, curve: &str) -> PyResult<Image> {
    let Ok(curve) = curve.parse::<Curve>() else {
        return Err(invalid(py, &format!("there is no view `{curve}`: expected one of clamp, neutral, agx")));
    };
    let stops = stops.unwrap_or_else(|| automatic_stops(image));
    Ok(ViewTransform { stops, curve }.shown(image).into_owned())
}

#[pymethods]
impl Rendered {
    /// The picture: linear sRGB, rows from top to bottom.
    #[getter]
    fn image<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray3<f32>> {
        self.image.bind(py).clone()
    }

    /// Estimated variance of each channel of each pixel.
    #[getter]
    fn variance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray3<f32>> {
        self.variance.bind(py).clone()
    }

    /// Samples of each pixel.
    #[getter]
    fn samples<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<u32>> {
        self.samples.bind(py).clone()
    }

    /// relMSE and its 95 % interval.
    #[getter]
    fn error(&self) -> Option<(f64, f64, f64)> {
        self.result.error.map(|error| (error.relmse, error.lower, error.upper))
    }

    /// Samples per pixel.
    #[getter]
    fn spp(&self) -> u32 {
        self.result.spp
    }

    /// Name of the method.
    #[getter]
    fn method(&self) -> &'static str {
        self.result.method.name()
    }

    /// Seconds of rendering.
    #[getter]
    fn seconds(&self) -> f64 {
        self.result.seconds.render
    }

    /// Files whose last write failed, one sentence each.
    #[getter]
    fn unsaved(&self) -> Vec<String> {
        self.result.unsaved.iter().map(ToString::to_string).collect()
    }

    /// The object that `halflight render --json` prints, as text.
    fn object(&self, py: Python<'_>) -> PyResult<String> {
        self.described(py, |run, _| run.object().to_string())
    }

    /// Writes a report into a folder.
    fn report(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        check_folder(&folder).map_err(|error| raised(py, error))?;
        let files = self.described(py, |run, _| run.files())?;
        let written = py.detach(|| write_folder(&folder, &files, Patience::least()));
        let failed = written.err().and_then(|errors| errors.into_iter().next());
        failed.map_or(Ok(()), |error| Err(raised(py, error)))
    }

    /// The channels of the layers by name, (rows, columns) each.
    fn layers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let owned = |(name, values): (&str, Vec<f32>)| (name.to_owned(), values);
        let channels: Vec<_> = self.exr(py, |file| file.channels().map(owned).collect())?;
        let shape = (self.settings.height as usize, self.settings.width as usize);
        let dict = PyDict::new(py);
        for (name, values) in channels {
            dict.set_item(name, array(py, shape, values)?)?;
        }
        Ok(dict)
    }

    /// Writes an OpenEXR file with the layers and facts of the render.
    fn save_exr(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let written = self.exr(py, |file| write_exr(&path, file, Patience::least()))?;
        written.map_err(|error| raised(py, error))
    }

    /// The bytes of a PNG file.
    fn png<'py>(&self, py: Python<'py>, stops: Option<f32>, curve: &str) -> PyResult<Bound<'py, PyBytes>> {
        let shown = view(py, &image(py, &self.image.bind(py).readonly())?, stops, curve)?;
        crate::tools::encoded(py, &shown, halflight::save::Format::Png)
    }
}
