//! Loading of scenes: OBJ with MTL ([`obj`], [`mtl`]), glTF ([`gltf`]), pictures ([`crate::picture`]), and
//! the scene file that places meshes and adds camera, lights and settings ([`scene_file`]).
//!
//! A load repairs its input as far as possible and notes each kind of repair once; everything else is a
//! [`LoadError`] with file, line and help. `docs/loading.md` has the table of both. The parsers take
//! arbitrary bytes: [`obj::parse`], [`mtl::parse`], [`gltf::parse`], [`scene_file::parse`].

mod assembly;
mod buffers;
mod bytes;
mod coplanar;
mod duplicate_emitters;
mod error;
mod far_camera;
mod files;
mod fit;
mod geometry;
#[cfg(feature = "gltf")]
pub mod gltf;
mod illum;
mod instances;
mod library;
mod map;
mod memory_estimate;
#[cfg_attr(not(feature = "gltf"), path = "no_models.rs")]
mod models;
pub mod mtl;
mod name;
mod notes;
pub mod obj;
mod objects;
mod open_glass;
mod overlaps;
mod parts;
mod placed;
mod placed_light;
mod relief;
mod scene;
pub mod scene_file;
mod split;
mod surface;
mod texcoords;
mod text;
mod texture;
mod texture_set;
mod touching_glass;
mod transform;

pub use error::LoadError;
pub use halflight_core::scene::{Material, PointLight};
pub use instances::LoadedInstances;
pub use map::{Channel, Map, MapOptions};
pub use name::Name;
pub use notes::Notes;
pub use parts::{MaterialId, PartMesh, SceneParts};
pub use scene::{LoadedScene, NamedCamera, RenderSettings, SceneViews, View, ViewKind};
pub use texture_set::TextureSet;
pub use transform::{SceneTransform, direction};

use crate::memory::{self, Budget, Shortage};
use files::Lookup;
use library::{Library, Sources};
use mtl::MtlMaterial;
use name::readings;
use placed::{PlacedMesh, Placement};
use placed_light::PlacedLight;
use scene_file::{EnvironmentChange, MaterialChange};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use texture_set::Embedded;

/// Options of a load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoadOptions {
    /// True if to decode textures; without them, materials have their constant values.
    pub textures: bool,
    /// Memory limit in bytes, temporary memory included; `None`: 80 % of the machine's memory.
    pub memory: Option<usize>,
    /// True if the texture coordinates of the scene are to be those of the files, as charts of a lightmap.
    /// Otherwise a transform that all maps of a material share is applied to them.
    pub keeps_texcoords: bool,
    /// True if each placement of a mesh is to have triangles of its own, as charts and vertices have that are
    /// baked. Otherwise large meshes that are placed several times share their memory.
    pub copies: bool,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self { textures: true, memory: None, keeps_texcoords: false, copies: false }
    }
}

/// Loads a scene file (`.toml`), a mesh with its materials (`.obj`), or a scene of glTF (`.glb`, `.gltf`).
pub fn load(path: &Path, options: &LoadOptions) -> Result<LoadedScene, LoadError> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("toml") => scene_file::load(path, options),
        Some("obj" | "glb" | "gltf") => {
            let mut builder = SceneBuilder::new(options);
            builder.add_file(path, Placement::IDENTITY, None, None)?;
            builder.build(path, options, None)
        }
        _ => Err(LoadError::of_file(
            path,
            "unknown kind of scene",
            "scenes are .obj, .glb, .gltf or .toml files",
        )),
    }
}

/// Reads a text file; `estimate` returns the memory that parsing needs.
fn read(path: &Path, budget: &Budget, estimate: fn(&[u8]) -> usize) -> Result<Vec<u8>, LoadError> {
    let bytes = memory::read_file(path, budget.left()).map_err(|error| {
        let help = match error.kind() {
            io::ErrorKind::FileTooLarge => MORE_MEMORY,
            _ => "check the path, which is relative to the current folder",
        };
        LoadError::of_file(path, format!("cannot be read: {error}"), help)
    })?;
    budget.has(estimate(&bytes)).map_err(|why| too_large(path, &why))?;
    Ok(bytes)
}

const MORE_MEMORY: &str = "raise --memory, or leave out a part of the scene";

fn too_large(path: &Path, why: &Shortage) -> LoadError {
    LoadError::of_file(path, why.to_string(), MORE_MEMORY)
}

/// Meshes and materials of a scene under construction.
struct SceneBuilder {
    budget: Budget,
    meshes: Vec<PlacedMesh>,
    objs: Vec<obj::Obj>,
    /// Index into `objs` of each OBJ file; a file is read once, however often it is placed.
    obj_numbers: HashMap<PathBuf, usize>,
    /// Materials of each OBJ by its libraries, which are read once too.
    own_materials: HashMap<usize, Rc<[u32]>>,
    materials: Vec<MtlMaterial>,
    /// Materials of the core that take the places of those, by index.
    given: HashMap<u32, Material>,
    /// Pictures of those.
    given_textures: TextureSet,
    /// Index of each material by OBJ file (`None`: the scene file) and name.
    material_numbers: HashMap<(Option<usize>, Name), u32>,
    /// Changes by the scene file, by name of the material.
    overrides: BTreeMap<String, MaterialChange>,
    used_overrides: BTreeSet<String>,
    /// glTF files that are read.
    #[cfg(feature = "gltf")]
    models: HashMap<PathBuf, Rc<models::ReadModel>>,
    /// Pictures in glTF files, and the bytes of those files.
    embedded: Embedded,
    held: usize,
    lights: Vec<PlacedLight>,
    cameras: Vec<NamedCamera>,
    lookup: Lookup,
    notes: Notes,
}

impl SceneBuilder {
    fn new(options: &LoadOptions) -> Self {
        Self {
            budget: Budget::new(options.memory),
            meshes: Vec::new(),
            objs: Vec::new(),
            obj_numbers: HashMap::new(),
            own_materials: HashMap::new(),
            materials: Vec::new(),
            given: HashMap::new(),
            given_textures: TextureSet::default(),
            material_numbers: HashMap::new(),
            overrides: BTreeMap::new(),
            used_overrides: BTreeSet::new(),
            #[cfg(feature = "gltf")]
            models: HashMap::new(),
            embedded: HashMap::new(),
            held: 0,
            lights: Vec::new(),
            cameras: Vec::new(),
            lookup: Lookup::default(),
            notes: Notes::default(),
        }
    }

    /// Places a file by its extension; `material` replaces all of its materials, and `share` decides whether
    /// its placements share memory.
    fn add_file(
        &mut self,
        path: &Path,
        placement: Placement,
        material: Option<&str>,
        share: Option<bool>,
    ) -> Result<(), LoadError> {
        let extension = path.extension().unwrap_or_default();
        match ["glb", "gltf"].iter().any(|known| extension.eq_ignore_ascii_case(known)) {
            true => self.add_model(path, placement, material, share),
            false => self.add_mesh(path, placement, material, share),
        }
    }

    /// Places an OBJ file; `material` replaces all of its materials.
    fn add_mesh(
        &mut self,
        path: &Path,
        placement: Placement,
        material: Option<&str>,
        share: Option<bool>,
    ) -> Result<(), LoadError> {
        let number = match self.obj_numbers.get(path) {
            Some(&number) => number,
            None => {
                let text = read(path, &self.budget, memory_estimate::of_obj)?;
                let mut obj = obj::parse(text, path)?;
                self.budget.take(memory_estimate::of_mesh(&obj)).map_err(|why| too_large(path, &why))?;
                self.notes.merge(core::mem::take(&mut obj.notes));
                self.objs.push(obj);
                self.obj_numbers.insert(path.into(), self.objs.len() - 1);
                self.objs.len() - 1
            }
        };
        let materials = match material {
            Some(material) => {
                let material = self.material(None, material.into(), None);
                vec![material; self.objs[number].materials.len() + 1].into()
            }
            None => self.own_materials(number, path),
        };
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        self.meshes.push(PlacedMesh { name, obj: number, placement, materials, share });
        Ok(())
    }

    /// Materials of an OBJ file by its libraries.
    fn own_materials(&mut self, obj: usize, path: &Path) -> Rc<[u32]> {
        if let Some(known) = self.own_materials.get(&obj) {
            return known.clone();
        }
        let names = self.objs[obj].materials.clone();
        let Self { lookup, budget, notes, .. } = self;
        let library =
            Library::read(path, &self.objs[obj].libraries, &names, Sources { lookup, budget, notes });
        let mut materials: Vec<u32> =
            names.iter().map(|name| self.file_material(obj, name, &library, path)).collect();
        materials.push(self.material(None, "".into(), None));
        let materials: Rc<[u32]> = materials.into();
        self.own_materials.insert(obj, materials.clone());
        materials
    }

    /// The material of the operand of a `usemtl`.
    fn file_material(&mut self, obj: usize, used: &Name, library: &Library, path: &Path) -> u32 {
        let path = path.display();
        let is_overridden = |name: &Name| self.overrides.contains_key(&name.to_string());
        let (name, found) = match library.material(used) {
            Some((material, is_certain)) => {
                let name = material.name.clone();
                if !is_certain {
                    let used = used.trimmed();
                    let what = format!("material `{used}` of {path} is missing: `{name}` is used instead");
                    self.notes.add(1, what);
                }
                (name, Some(material))
            }
            None => {
                let readings = readings(used.bytes());
                let mut names = readings.iter().map(|reading| Name::from(reading.name));
                let name = names.find(is_overridden).unwrap_or_else(|| {
                    let used = used.trimmed();
                    let what =
                        format!("material `{used}` of {path} is in none of its libraries: grey is used");
                    self.notes.add(1, what);
                    used
                });
                (name, None)
            }
        };
        self.material(Some(obj), name, found)
    }

    /// The number of the material of this name of this file; a new one if there is none.
    fn material(&mut self, obj: Option<usize>, name: Name, found: Option<MtlMaterial>) -> u32 {
        let key = (obj, name.clone());
        if let Some(&number) = self.material_numbers.get(&key) {
            return number;
        }
        let number = self.new_material(found.unwrap_or(MtlMaterial { name, ..MtlMaterial::default() }));
        self.material_numbers.insert(key, number);
        number
    }

    /// Adds a material with the changes of the scene file.
    fn new_material(&mut self, mut material: MtlMaterial) -> u32 {
        let shown = material.name.to_string();
        if let Some(change) = self.overrides.get(&shown) {
            change.apply(&mut material);
            self.used_overrides.insert(shown);
        }
        self.materials.push(material);
        self.materials.len() as u32 - 1
    }

    /// Decodes the textures of all materials and of the environment.
    fn textures(
        &mut self,
        options: &LoadOptions,
        environment: Option<&EnvironmentChange>,
    ) -> Result<TextureSet, LoadError> {
        let of_environment = || environment.iter().flat_map(|environment| &environment.map);
        let file = |map: &Map| map.found.clone();
        let maps = self.materials.iter().flat_map(|mtl| mtl.maps.values()).chain(of_environment());
        let files = maps.filter_map(file).filter(|_| options.textures);
        let required = self.overrides.values().flat_map(|change| change.material().maps.values());
        let required = required.chain(of_environment()).filter_map(Map::required).collect();
        let given = core::mem::take(&mut self.given_textures);
        let set = given.decode(files, &required, &self.embedded, &mut self.budget, &mut self.notes)?;
        self.embedded.clear();
        self.budget.give_back(core::mem::take(&mut self.held));
        Ok(set)
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
