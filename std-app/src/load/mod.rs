//! Scenes from files: OBJ with MTL ([`obj`], [`mtl`], [`surface`]), pictures ([`crate::picture`]), and the scene
//! file that places meshes and adds camera, lights and settings ([`scene_file`]). Names are bytes ([`name`]), and
//! one lookup finds the files that they mean ([`files`]).
//!
//! A load repairs what it can and says each kind of repair once; what it cannot repair is a [`LoadError`]
//! with file, line and what to do. The table of both is `docs/loading.md`. The parsers take bytes, so that
//! they can be fed anything: [`obj::parse`], [`mtl::parse`], [`scene_file::parse`].

mod doubled;
mod error;
mod far_camera;
mod files;
mod fit;
mod geometry;
mod illum;
mod library;
mod map;
pub mod mtl;
mod name;
mod notes;
pub mod obj;
mod open_glass;
mod relief;
mod scene;
pub mod scene_file;
mod settings;
mod split;
mod surface;
mod texcoords;
mod text;
mod texture;
mod texture_set;
mod transform;
mod weight;

pub use error::LoadError;
pub use map::{Map, MapOptions};
pub use name::Name;
pub use notes::Notes;
pub use scene::{LoadedScene, SceneViews, View};
pub use settings::RenderSettings;
pub use texture_set::TextureSet;
pub use transform::{SceneTransform, direction};

use crate::memory::{self, Budget, Shortage};
use files::Lookup;
use geometry::{Placed, Placement};
use halflight_core::scene::{Environment, Material};
use library::Library;
use mtl::MtlMaterial;
use name::readings;
use scene_file::{EnvironmentChange, MaterialChange};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::io;
use std::path::{Path, PathBuf};
use texcoords::Texcoords;

/// What to load of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoadOptions {
    /// Whether to decode textures; without them, materials have their constant values.
    pub textures: bool,
    /// Most bytes to take, for what stays and for what is taken on the way; `None`: a share of what the machine has.
    pub memory: Option<usize>,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self { textures: true, memory: None }
    }
}

/// Loads a scene file (`.toml`) or a mesh with its materials (`.obj`).
pub fn load(path: &Path, options: &LoadOptions) -> Result<LoadedScene, LoadError> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("toml") => scene_file::load(path, options),
        Some("obj") => {
            let mut builder = SceneBuilder::new(options);
            builder.add_mesh(path, Placement::IDENTITY, None)?;
            builder.build(path, options, None)
        }
        _ => Err(LoadError::of_file(path, "unknown kind of scene", "scenes are .obj or .toml files")),
    }
}

/// Reads a whole text file, which `weight` must find room for in `budget`; with an error that names it.
fn read(path: &Path, budget: &Budget, weight: fn(&[u8]) -> usize) -> Result<Vec<u8>, LoadError> {
    let bytes = memory::read_file(path, budget.left()).map_err(|error| {
        let help = match error.kind() {
            io::ErrorKind::FileTooLarge => MORE_MEMORY,
            _ => "is the path right, relative to where you are?",
        };
        LoadError::of_file(path, format!("cannot be read: {error}"), help)
    })?;
    budget.has(weight(&bytes)).map_err(|why| too_large(path, &why))?;
    Ok(bytes)
}

const MORE_MEMORY: &str = "raise --memory, or leave out a part of the scene";

fn too_large(path: &Path, why: &Shortage) -> LoadError {
    LoadError::of_file(path, why.to_string(), MORE_MEMORY)
}

/// Meshes and materials on their way to a scene.
struct SceneBuilder {
    budget: Budget,
    meshes: Vec<PlacedMesh>,
    /// Each OBJ file once, however often it is placed.
    files: HashMap<PathBuf, usize>,
    objs: Vec<obj::Obj>,
    materials: Vec<MtlMaterial>,
    /// By file (none for materials of the scene file) and name.
    by_name: HashMap<(Option<usize>, Name), u32>,
    /// Changes by the scene file, by name of the material.
    overrides: BTreeMap<String, MaterialChange>,
    used_overrides: BTreeSet<String>,
    lookup: Lookup,
    notes: Notes,
}

struct PlacedMesh {
    obj: usize,
    placement: Placement,
    /// For each material of the OBJ, and last for faces without one: index into the materials of the scene.
    materials: Vec<u32>,
}

impl SceneBuilder {
    fn new(options: &LoadOptions) -> Self {
        Self {
            budget: Budget::new(options.memory),
            meshes: Vec::new(),
            files: HashMap::new(),
            objs: Vec::new(),
            materials: Vec::new(),
            by_name: HashMap::new(),
            overrides: BTreeMap::new(),
            used_overrides: BTreeSet::new(),
            lookup: Lookup::default(),
            notes: Notes::default(),
        }
    }

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
                let text = read(path, &self.budget, weight::of_obj)?;
                let mut obj = obj::parse(text, path)?;
                self.budget.take(weight::of_mesh(&obj)).map_err(|why| too_large(path, &why))?;
                self.notes.merge(core::mem::take(&mut obj.notes));
                self.objs.push(obj);
                self.files.insert(path.into(), self.objs.len() - 1);
                self.objs.len() - 1
            }
        };
        let names = self.objs[number].materials.clone();
        let mut library = Library::default();
        if material.is_none() {
            let statements = &self.objs[number].libraries;
            let sources = (&mut self.lookup, &self.budget);
            library = Library::read(path, statements, &names, sources, &mut self.notes);
        }
        let mut materials = Vec::with_capacity(names.len() + 1);
        for name in &names {
            materials.push(match material {
                Some(material) => self.material(None, material.into(), None),
                None => self.file_material(number, name, &library, path),
            });
        }
        materials.push(self.material(None, material.unwrap_or_default().into(), None));
        self.meshes.push(PlacedMesh { obj: number, placement, materials });
        Ok(())
    }

    /// The number of the material that the operand of a `usemtl` means.
    fn file_material(&mut self, file: usize, used: &Name, library: &Library, path: &Path) -> u32 {
        let found = library.find(used);
        let is_changed = |name: &Name| self.overrides.contains_key(&name.to_string());
        let place = path.display();
        let name = match &found {
            Some((material, _)) => material.name.clone(),
            None => {
                let names = readings(used.bytes());
                let mut names = names.iter().map(|reading| Name::from(reading.name));
                names.find(is_changed).unwrap_or_else(|| used.trimmed())
            }
        };
        match &found {
            Some((_, false)) => {
                let what =
                    format!("material `{}` of {place} is not there, `{name}` is taken", used.trimmed());
                self.notes.add(1, what);
            }
            None if !is_changed(&name) => {
                let what = format!("material `{name}` of {place} is not in its material libraries: grey");
                self.notes.add(1, what);
            }
            _ => {}
        }
        let found = found.map(|(material, _)| material);
        self.material(Some(file), name, found)
    }

    /// The number of a material; a new one unless this name of this file has one.
    fn material(&mut self, file: Option<usize>, name: Name, found: Option<MtlMaterial>) -> u32 {
        let key = (file, name.clone());
        if let Some(&number) = self.by_name.get(&key) {
            return number;
        }
        let shown = name.to_string();
        let mut material = found.unwrap_or(MtlMaterial { name, ..MtlMaterial::default() });
        if let Some(change) = self.overrides.get(&shown) {
            change.apply(&mut material);
            self.used_overrides.insert(shown);
        }
        let number = self.materials.len() as u32;
        self.materials.push(material);
        self.by_name.insert(key, number);
        number
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
        let by_scene_file = self.overrides.values().flat_map(|change| surface::maps(change.material()));
        let by_scene_file = by_scene_file.chain(environment.iter().flat_map(|e| &e.map));
        let required = by_scene_file.filter_map(|map| map.found.clone()).collect();
        let mut textures = TextureSet::decode(files, &required, &mut self.budget, &mut self.notes)?;
        let notes = &mut self.notes;
        let of_maps = |mtl: &mut MtlMaterial| {
            Texcoords::of_maps(
                &mut surface::maps_mut(mtl).filter(|map| map.found.is_some()).collect::<Vec<_>>(),
            )
        };
        let texcoords: Vec<Texcoords> = self.materials.iter_mut().map(of_maps).collect();
        let materials: Vec<Material> =
            self.materials.iter().map(|mtl| surface::resolve(mtl, &mut textures, notes)).collect();

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
        count_vertices(path, parts.iter().map(|part| part.group.positions.len()).sum())?;
        let fit = fit::Fit::of(&parts);
        let pieces = geometry::pieces(&parts, &fit);
        let weight = weight::of_scene(&parts, &materials).saturating_add(weight::of_pieces(pieces));
        self.budget.take(weight).map_err(|why| too_large(path, &why))?;
        let mut geometry = geometry::assemble(&parts, &fit, pieces, notes);
        count_vertices(path, geometry.positions.len())?;
        let names: Vec<String> = self.materials.iter().map(|mtl| mtl.name.to_string()).collect();
        doubled::leave_out(&mut geometry, &materials, &names, notes);
        open_glass::note(&geometry, &materials, &names, notes);
        Ok(LoadedScene {
            positions: geometry.positions,
            normals: geometry.normals,
            texcoords: geometry.texcoords,
            triangles: geometry.triangles,
            materials,
            material_names: names,
            textures,
            lights: Vec::new(),
            environment,
            camera: None,
            view: None,
            settings: RenderSettings::default(),
            transform: fit.transform,
            files: self.lookup.into_files().into_iter().chain([path.into()]).collect(),
            repairs: self.notes.sentences(),
        })
    }
}

/// Triangles refer to their vertices by 32 bits.
fn count_vertices(path: &Path, vertices: usize) -> Result<(), LoadError> {
    if u32::try_from(vertices).is_ok() {
        return Ok(());
    }
    let problem = format!("the scene has {vertices} vertices, more than 32 bits can count");
    Err(LoadError::of_file(path, problem, "leave out some of its meshes"))
}
