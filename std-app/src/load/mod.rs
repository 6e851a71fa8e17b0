//! Scenes from files: OBJ with MTL ([`obj`], [`mtl`], [`surface`]), pictures ([`texture`]), and the scene
//! file that places meshes and adds camera, lights and settings ([`scene_file`]).
//!
//! A load repairs what it can and says each kind of repair once; what it cannot repair is a [`LoadError`]
//! with file, line and what to do. The table of both is `docs/loading.md`. The parsers take bytes, so that
//! they can be fed anything: [`obj::parse`], [`mtl::parse`], [`scene_file::parse`], [`texture::decode`].

mod error;
mod geometry;
pub mod mtl;
mod notes;
pub mod obj;
mod scene;
pub mod scene_file;
mod settings;
mod surface;
mod text;
pub mod texture;
mod texture_set;
mod transform;

pub use error::LoadError;
pub use notes::Notes;
pub use scene::{LoadedScene, SceneViews};
pub use settings::RenderSettings;
pub use texture_set::TextureSet;
pub use transform::SceneTransform;

use geometry::{Placed, Placement};
use halflight_core::scene::{Environment, Material};
use mtl::MtlMaterial;
use scene_file::{EnvironmentChange, MaterialChange};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

/// What to load of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoadOptions {
    /// Whether to decode textures; without them, materials have their constant values.
    pub textures: bool,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self { textures: true }
    }
}

/// Loads a scene file (`.toml`) or a mesh with its materials (`.obj`).
pub fn load(path: &Path, options: &LoadOptions) -> Result<LoadedScene, LoadError> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("toml") => scene_file::load(path, options),
        Some("obj") => {
            let mut builder = SceneBuilder::default();
            builder.add_mesh(path, Placement::IDENTITY, None)?;
            builder.build(path, options, None)
        }
        _ => Err(LoadError::of_file(path, "unknown kind of scene", "scenes are .obj or .toml files")),
    }
}

/// Reads a whole file, with an error that names it.
fn read(path: &Path) -> Result<Vec<u8>, LoadError> {
    std::fs::read(path).map_err(|error| {
        LoadError::of_file(
            path,
            format!("cannot be read: {error}"),
            "is the path right, relative to where you are?",
        )
    })
}

/// Meshes and materials on their way to a scene.
#[derive(Default)]
struct SceneBuilder {
    meshes: Vec<PlacedMesh>,
    /// Each OBJ file once, however often it is placed.
    files: HashMap<PathBuf, usize>,
    objs: Vec<obj::Obj>,
    materials: Vec<MtlMaterial>,
    /// By file (none for materials of the scene file) and name.
    by_name: HashMap<(Option<usize>, String), u32>,
    /// Changes by the scene file, by name of the material.
    overrides: BTreeMap<String, MaterialChange>,
    used_overrides: BTreeSet<String>,
    notes: Notes,
}

struct PlacedMesh {
    obj: usize,
    placement: Placement,
    /// For each material of the OBJ, and last for faces without one: index into the materials of the scene.
    materials: Vec<u32>,
}

impl SceneBuilder {
    /// Places an OBJ file. `material` replaces those of the file;
    fn add_mesh(
        &mut self,
        path: &Path,
        placement: Placement,
        material: Option<&str>,
    ) -> Result<(), LoadError> {
        let number = match self.files.get(path) {
            Some(&number) => number,
            None => {
                let mut obj = obj::parse(read(path)?, path)?;
                self.notes.merge(core::mem::take(&mut obj.notes));
                self.objs.push(obj);
                self.files.insert(path.into(), self.objs.len() - 1);
                self.objs.len() - 1
            }
        };
        let names = self.objs[number].materials.clone();
        let library = if material.is_none() { self.library(number, path) } else { HashMap::new() };
        let mut materials = Vec::with_capacity(names.len() + 1);
        for name in names.iter().map(Some).chain([None]) {
            materials.push(match material {
                Some(material) => self.material(None, material, None),
                None => self.file_material(number, name.map(String::as_str), &library, path),
            });
        }
        self.meshes.push(PlacedMesh { obj: number, placement, materials });
        Ok(())
    }

    fn file_material(
        &mut self,
        file: usize,
        name: Option<&str>,
        library: &HashMap<String, MtlMaterial>,
        path: &Path,
    ) -> u32 {
        let Some(name) = name else {
            return self.material(None, "", None);
        };
        let found = library.get(name);
        if found.is_none() && !self.overrides.contains_key(name) {
            let what =
                format!("material `{name}` of {} is not in its material libraries: grey", path.display());
            self.notes.add(1, what);
        }
        self.material(Some(file), name, found)
    }

    /// The number of a material; a new one unless this name of this file has one.
    fn material(&mut self, file: Option<usize>, name: &str, found: Option<&MtlMaterial>) -> u32 {
        let key = (file, name.to_string());
        if let Some(&number) = self.by_name.get(&key) {
            return number;
        }
        let blank = || MtlMaterial { name: name.into(), ..MtlMaterial::default() };
        let mut material = found.cloned().unwrap_or_else(blank);
        if let Some(change) = self.overrides.get(name) {
            change.apply(&mut material);
            self.used_overrides.insert(name.to_string());
        }
        let number = self.materials.len() as u32;
        self.materials.push(material);
        self.by_name.insert(key, number);
        number
    }

    /// All materials of the libraries that an OBJ file names; the later of two with one name counts.
    fn library(&mut self, obj: usize, path: &Path) -> HashMap<String, MtlMaterial> {
        let directory = path.parent().unwrap_or(Path::new(""));
        let statements = self.objs[obj].libraries.clone();
        let mut files: Vec<PathBuf> = Vec::new();
        for (line, operand) in &statements {
            let mut found = find_libraries(directory, operand);
            if found.is_empty() {
                let place = format!("{}:{line}", path.display());
                let beside = path.with_extension("mtl");
                if beside.is_file() {
                    let name = beside.display();
                    self.notes.add(
                        1,
                        format!("material library `{operand}` is missing, {name} is read instead ({place})"),
                    );
                    found.push(beside);
                } else {
                    self.notes.add(1, format!("material library `{operand}` is missing ({place})"));
                }
            }
            found.retain(|file| !files.contains(file));
            files.append(&mut found);
        }
        let mut library = HashMap::new();
        for file in files {
            let bytes = match std::fs::read(&file) {
                Ok(bytes) => bytes,
                Err(error) => {
                    self.notes.add(1, format!("material library {} cannot be read: {error}", file.display()));
                    continue;
                }
            };
            let mut mtl = mtl::parse(bytes, &file.display().to_string());
            let directory = file.parent().unwrap_or(Path::new(""));
            for mut material in mtl.materials {
                Self::locate_maps(&mut material, directory, &mut mtl.notes);
                let name = material.name.clone();
                if library.insert(name, material).is_some() {
                    mtl.notes
                        .add(1, format!("material defined twice in {}: the later counts", file.display()));
                }
            }
            self.notes.merge(mtl.notes);
        }
        library
    }

    /// Finds the files that the maps name.
    fn locate_maps(material: &mut MtlMaterial, directory: &Path, notes: &mut Notes) {
        for map in surface::maps_mut(material) {
            map.found = texture_set::locate(directory, &map.file);
            if map.found.is_none() {
                notes.add(1, format!("texture {} is missing: constant value", map.file.display()));
            }
        }
    }

    /// Buffers for the core.
    fn build(
        mut self,
        path: &Path,
        options: &LoadOptions,
        environment: Option<EnvironmentChange>,
    ) -> Result<LoadedScene, LoadError> {
        for name in self.overrides.keys().filter(|name| !self.used_overrides.contains(*name)) {
            self.notes.add(
                1,
                format!("no mesh has a material `{name}`: what the scene file says of it is not used"),
            );
        }
        let maps =
            self.materials.iter().flat_map(surface::maps).chain(environment.iter().flat_map(|e| &e.map));
        let files = maps.filter_map(|map| map.found.clone()).filter(|_| options.textures);
        let mut textures = TextureSet::decode(files, &mut self.notes);
        let notes = &mut self.notes;
        let materials: Vec<Material> =
            self.materials.iter().map(|mtl| surface::resolve(mtl, &mut textures, notes)).collect();
        let texcoords: Vec<_> =
            self.materials.iter().map(|mtl| surface::texcoord_transform(mtl, notes)).collect();

        let environment = environment.map(|entry| Environment {
            radiance: entry.radiance,
            map: textures.colour(entry.map.as_ref()),
            to_map: entry.to_map,
        });

        let mut parts = Vec::new();
        for mesh in &self.meshes {
            for group in &self.objs[mesh.obj].groups {
                let last = mesh.materials.len() - 1;
                let material = mesh.materials[group.material.map_or(last, |number| number.min(last))];
                let texcoords = texcoords[material as usize];
                parts.push(Placed { group, placement: mesh.placement, material, texcoords });
            }
        }
        let vertices: usize = parts.iter().map(|part| part.group.positions.len()).sum();
        if u32::try_from(vertices).is_err() {
            let problem = format!("the scene has {vertices} vertices, more than 32 bits can count");
            return Err(LoadError::of_file(path, problem, "leave out some of its meshes"));
        }
        let (min, max) = geometry::bounds(&parts);
        let transform = SceneTransform::fitting(min, max);
        let geometry = geometry::assemble(&parts, &transform, notes);
        Ok(LoadedScene {
            positions: geometry.positions,
            normals: geometry.normals,
            texcoords: geometry.texcoords,
            triangles: geometry.triangles,
            materials,
            material_names: self.materials.into_iter().map(|mtl| mtl.name).collect(),
            textures,
            lights: Vec::new(),
            environment,
            camera: None,
            settings: RenderSettings::default(),
            transform,
            repairs: self.notes.sentences(),
        })
    }
}

/// The files of an `mtllib` statement: one name with blanks, or several names.
fn find_libraries(directory: &Path, operand: &str) -> Vec<PathBuf> {
    if let Some(file) = texture_set::locate(directory, Path::new(operand)) {
        return vec![file];
    }
    operand.split_whitespace().filter_map(|name| texture_set::locate(directory, Path::new(name))).collect()
}
