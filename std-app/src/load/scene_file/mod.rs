//! The scene file: TOML that places meshes and adds materials, camera, lights, environment and settings, as
//! described in `docs/scene-file.md`. Errors have line and column. The error for an unknown key lists the
//! valid keys.

mod camera;
mod light;
mod material;
mod placement;
#[cfg_attr(not(feature = "sky"), path = "no_sky.rs")]
mod sky;
mod values;

pub use camera::{CameraEntry, KindOfCamera};
pub(super) use light::EnvironmentChange;
pub use light::{EnvironmentEntry, LightEntry, LightKind};
pub(super) use material::MaterialChange;
pub use material::{MaterialEntry, MaterialKind};
pub use placement::InstanceEntry;
pub use sky::SkyEntry;
pub(super) use values::BRIGHTEST;
pub use values::{Colour, Factors, Matrix, Reflectance, Rotation};

use super::error::{LoadError, TextPlace};
use super::files::{Found, Lookup};
use super::map::Map;
use super::notes::Notes;
use super::scene::{LoadedScene, RenderSettings};
use super::{LoadOptions, SceneBuilder, memory_estimate, read, too_large};
use crate::memory::Budget;
use crate::values::Number;
use core::cell::RefCell;
use core::ops::Range;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// A scene file as written.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// `[[mesh]]`: meshes and their placement.
    #[serde(default)]
    pub mesh: Vec<MeshEntry>,
    /// `[material.NAME]`: new materials, and changes to materials of the meshes.
    #[serde(default)]
    pub material: BTreeMap<String, Spanned<MaterialEntry>>,
    /// `[camera]`.
    pub camera: Option<Spanned<CameraEntry>>,
    /// `[[light]]`: lights without surface.
    #[serde(default)]
    pub light: Vec<Spanned<LightEntry>>,
    /// `[environment]`: infinitely distant light.
    pub environment: Option<EnvironmentEntry>,
    /// `[sky]`: a clear sky with a sun, instead of `[environment]`.
    pub sky: Option<Spanned<SkyEntry>>,
    /// `[render]`.
    #[serde(default)]
    pub render: RenderSettings,
}

/// A mesh and its placement: scaled, then rotated, then translated; or by a matrix.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshEntry {
    /// An OBJ or glTF file, relative to the scene file.
    pub file: Spanned<String>,
    /// One factor or three.
    #[serde(default)]
    pub scale: Factors,
    /// Rotation around an axis through the origin.
    pub rotate: Option<Rotation>,
    /// Translation in units of the scene.
    #[serde(default)]
    pub translate: [Number; 3],
    /// Three or four rows of four, instead of scale, rotation and translation.
    pub matrix: Option<Matrix>,
    /// Name of the `[material.NAME]` that replaces all materials of the file.
    pub material: Option<Spanned<String>>,
    /// Placements of the mesh, in addition to its own; one without them.
    pub instances: Option<Vec<Spanned<InstanceEntry>>>,
    /// True: all placements of the file share its memory. False: each has its own triangles. By default they
    /// share what saves memory.
    pub share: Option<bool>,
}

/// Parses a scene file; opens no other file. `file` is for messages only.
pub fn parse(text: &str, file: &Path) -> Result<SceneFile, LoadError> {
    toml::from_str(text).map_err(|error| {
        // serde writes `unknown field ..., expected one of ...`: the second half is the help.
        let message = error.message().replace('\n', " ");
        let (problem, help) = match message.split_once(", expected ") {
            Some((problem, expected)) => (problem.to_string(), format!("expected {}", in_words(expected))),
            None => (message, "docs/scene-file.md describes the scene file".into()),
        };
        Source::new(text, file).error(error.span().unwrap_or_default(), problem, help)
    })
}

/// The value that serde expects, without the names of types.
fn in_words(expected: &str) -> &str {
    match expected {
        "u32" => "a whole number from 0 to 4294967295",
        "f32" | "f64" => "a number",
        other => other,
    }
}

/// Text of a scene file, for errors with line and column, and the files that it names.
struct Source<'a> {
    text: &'a str,
    /// Byte at which each line starts.
    lines: Vec<usize>,
    file: &'a Path,
    lookup: RefCell<Lookup>,
    notes: RefCell<Notes>,
}

impl<'a> Source<'a> {
    fn new(text: &'a str, file: &'a Path) -> Self {
        let notes = Notes::of(file.display().to_string());
        let lines = [0].into_iter().chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        Self { text, lines, file, lookup: RefCell::default(), notes: notes.into() }
    }

    fn error(&self, span: Range<usize>, problem: impl Into<String>, help: impl Into<String>) -> LoadError {
        self.place(&span).error(problem, help)
    }

    fn place(&self, span: &Range<usize>) -> TextPlace {
        let line = self.line(span);
        let before = self.text.get(self.lines[line - 1]..span.start).unwrap_or_default();
        TextPlace { file: self.file.into(), line: line as u32, column: before.chars().count() as u32 + 1 }
    }

    /// Line of an entry, from 1.
    fn line(&self, span: &Range<usize>) -> usize {
        self.lines.partition_point(|start| *start <= span.start).max(1)
    }

    /// The file at a path of the scene file.
    fn resolve(&self, path: &Spanned<String>) -> Result<PathBuf, LoadError> {
        let directory = self.file.parent().unwrap_or(Path::new(""));
        let name = path.get_ref();
        let found = self.lookup.borrow_mut().locate(&[name.as_bytes()], &[directory]);
        let note = found.note("file", name.as_bytes());
        if let Some(file) = found.file() {
            if let Some(note) = note {
                self.notes.borrow_mut().at(self.line(&path.span()) as u32, note);
            }
            return Ok(file.into());
        }
        let problem = match found {
            Found::Missing => format!("there is no file {}", directory.join(name).display()),
            _ => note.unwrap_or_default(),
        };
        Err(self.error(path.span(), problem, "paths are relative to the scene file"))
    }

    /// The texture at a path of the scene file.
    fn map(&self, path: &Spanned<String>) -> Result<Map, LoadError> {
        let named = Some(self.place(&path.span()));
        Ok(Map { named, ..Map::of_file(path.get_ref(), self.resolve(path)?) })
    }
}

/// Loads a scene file and all files that it names.
pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<LoadedScene, LoadError> {
    let mut builder = SceneBuilder::new(options);
    let bytes = read(path, &builder.budget, memory_estimate::of_scene_file)?;
    builder.budget.take(memory_estimate::of_scene_file(&bytes)).map_err(|why| too_large(path, &why))?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = valid.iter().filter(|&&b| b == b'\n').count() as u32 + 1;
        LoadError::at(path, line, "this is not UTF-8 text", "save the scene file as UTF-8")
    })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let source = Source::new(text, path);
    let scene = parse(text, path)?;

    for (name, entry) in &scene.material {
        builder.overrides.insert(name.clone(), entry.get_ref().resolved(&source)?);
    }
    let mesh_files: Vec<PathBuf> =
        scene.mesh.iter().map(|mesh| mesh.checked_file(&scene, &source)).collect::<Result<_, _>>()?;
    let environment = scene.distant_light(&mut builder.budget, &source)?;
    builder.notes = source.notes.take();
    builder.lookup = source.lookup.take();
    for (mesh, file) in scene.mesh.iter().zip(mesh_files) {
        let material = mesh.material.as_ref().map(|name| name.get_ref().as_str());
        for placement in mesh.placements(&source)? {
            builder.add_file(&file, placement, material, mesh.share)?;
        }
    }
    let mut loaded = builder.build(path, options, environment)?;
    let transform = loaded.transform;
    for light in &scene.light {
        loaded.lights.push(light::light(light, &transform, &source)?);
    }
    if let Some(camera) = &scene.camera {
        camera::place(camera, &mut loaded, &source)?;
    }
    loaded.settings = scene.render;
    Ok(loaded)
}

/// The environment or sky of the text of a scene file whose other parts are left out.
pub(super) fn environment(
    text: &str,
    name: &Path,
    budget: &mut Budget,
) -> Result<Option<EnvironmentChange>, LoadError> {
    parse(text, name)?.distant_light(budget, &Source::new(text, name))
}

impl SceneFile {
    fn distant_light(
        &self,
        budget: &mut Budget,
        source: &Source,
    ) -> Result<Option<EnvironmentChange>, LoadError> {
        Ok(match (&self.environment, &self.sky) {
            (Some(_), Some(sky)) => {
                let problem = "this scene file has a [sky] and an [environment]";
                return Err(source.error(sky.span(), problem, "leave out one of them"));
            }
            (Some(entry), None) => Some(entry.resolved(source)?),
            (None, Some(entry)) => Some(sky::environment(entry, budget, source)?),
            (None, None) => None,
        })
    }
}

impl MeshEntry {
    /// The file; checks that the material exists.
    fn checked_file(&self, scene: &SceneFile, source: &Source) -> Result<PathBuf, LoadError> {
        let file = source.resolve(&self.file)?;
        match &self.material {
            Some(material) if !scene.material.contains_key(material.get_ref()) => {
                let name = material.get_ref();
                let problem = format!("there is no material `{name}` in this scene file");
                Err(source.error(material.span(), problem, format!("add a [material.{name}]")))
            }
            _ => Ok(file),
        }
    }
}
