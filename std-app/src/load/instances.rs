//! Meshes that are placed several times, in the memory of one: prototypes and instances of the core.
//!
//! The loader repairs a prototype as it repairs a scene. Triangles of different instances, or of an instance
//! and the rest of the scene, are not compared: overlaps in one plane and dielectrics that touch are found
//! within each alone.

use super::buffers::Geometry;
use super::fit::Fit;
use super::geometry;
use super::notes::Notes;
use super::obj::Obj;
use super::open_glass;
use super::overlaps;
use super::placed::{Placed, PlacedMesh, Placement, bounds};
use super::texcoords::Texcoords;
use super::touching_glass;
use super::transform::SceneTransform;
use glam::{DMat3, DVec3};
use halflight_core::scene::{Instance, Instances, Material, Overlap, Prototype, Triangle};
use std::collections::HashMap;

/// Triangles of a mesh from which instances pay: smaller meshes are copied.
const LEAST_TRIANGLES: usize = 256;

/// Triangles that instances save from which they pay, 100 MB of memory during the build. Copies are traced
/// faster.
const LEAST_SAVED: usize = 1 << 18;

/// Buffers of [`Instances`], and the name of each instance.
#[derive(Clone, Debug, Default)]
pub struct LoadedInstances {
    /// Vertex positions of all prototypes.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals or zeros; as long as `positions`, or empty.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates; as long as `positions`, or empty.
    pub texcoords: Vec<[f32; 2]>,
    /// Texture coordinates of a second set; as long as `positions`, or empty.
    pub second_texcoords: Vec<[f32; 2]>,
    /// Linear RGBA of the vertices; as long as `positions`, or empty.
    pub colors: Vec<[f32; 4]>,
    /// Triangles of all prototypes.
    pub triangles: Vec<Triangle>,
    /// Overlaps of all prototypes.
    pub overlaps: Vec<Overlap>,
    /// Prototypes.
    pub prototypes: Vec<Prototype>,
    /// Instances.
    pub placed: Vec<Instance>,
    /// Names of the instances: those of their meshes.
    pub names: Vec<String>,
}

impl LoadedInstances {
    /// The instances for the core.
    pub fn of_core(&self) -> Instances<'_> {
        Instances {
            positions: &self.positions,
            normals: &self.normals,
            texcoords: &self.texcoords,
            second_texcoords: &self.second_texcoords,
            colors: &self.colors,
            triangles: &self.triangles,
            overlaps: &self.overlaps,
            prototypes: &self.prototypes,
            placed: &self.placed,
        }
    }
}

/// Choice of the meshes that become instances.
pub(super) struct Shared {
    /// Number of the prototype of each mesh; `None` for copies.
    of_mesh: Vec<Option<u32>>,
    /// First mesh of each prototype.
    prototypes: Vec<usize>,
}

impl Shared {
    /// Chooses among `meshes`. A mesh that emits is copied: its triangles are lights of their own.
    pub(super) fn of(meshes: &[PlacedMesh], objs: &[Obj], materials: &[Material], notes: &mut Notes) -> Self {
        let mut alike: HashMap<(usize, &[u32]), Vec<usize>> = HashMap::new();
        for (number, mesh) in meshes.iter().enumerate().filter(|(_, mesh)| mesh.share != Some(false)) {
            alike.entry((mesh.obj, &mesh.materials)).or_default().push(number);
        }
        let mut shared = Self { of_mesh: vec![None; meshes.len()], prototypes: Vec::new() };
        let mut groups: Vec<Vec<usize>> = alike.into_values().collect();
        groups.sort_unstable();
        for group in groups {
            let first = &meshes[group[0]];
            let count: usize = objs[first.obj].groups.iter().map(|group| group.triangles.len()).sum();
            let is_wanted = group.iter().any(|&number| meshes[number].share == Some(true));
            let pays = count >= LEAST_TRIANGLES && (group.len() - 1).saturating_mul(count) >= LEAST_SAVED;
            if count == 0 || !(is_wanted || pays) {
                continue;
            }
            let emits = |group: &super::obj::Group| materials[first.material_of(group) as usize].emits();
            if objs[first.obj].groups.iter().any(emits) {
                notes.add(1, format!("mesh `{}` emits: its instances are copies", first.name));
                continue;
            }
            for &number in &group {
                if has_inverse(&meshes[number].placement) {
                    shared.of_mesh[number] = Some(shared.prototypes.len() as u32);
                }
            }
            shared.prototypes.push(group[0]);
        }
        shared
    }

    /// No instances.
    pub(super) fn none(meshes: &[PlacedMesh]) -> Self {
        Self { of_mesh: vec![None; meshes.len()], prototypes: Vec::new() }
    }

    /// True if mesh `number` is an instance.
    pub(super) fn has(&self, number: usize) -> bool {
        self.of_mesh[number].is_some()
    }

    /// Parts of all meshes, placed; those that are no instances come first, and their number.
    pub(super) fn placed<'a>(
        &self,
        meshes: &[PlacedMesh],
        objs: &'a [Obj],
        (objects, texcoords): (&'a [Vec<u32>], &[Texcoords]),
    ) -> (Vec<Placed<'a>>, usize) {
        let (mut parts, mut placed) = (Vec::new(), Vec::new());
        for ((mesh, prototype), objects) in meshes.iter().zip(&self.of_mesh).zip(objects) {
            for group in &objs[mesh.obj].groups {
                let material = mesh.material_of(group);
                let texcoords = texcoords[material as usize];
                let part = Placed { group, placement: mesh.placement, material, texcoords, objects };
                if prototype.is_some() { placed.push(part) } else { parts.push(part) }
            }
        }
        let in_world = parts.len();
        parts.extend(placed);
        (parts, in_world)
    }

    /// Parts of all prototypes in their own spaces, prototype by prototype.
    pub(super) fn parts<'a>(
        &self,
        meshes: &[PlacedMesh],
        objs: &'a [Obj],
        texcoords: &[Texcoords],
    ) -> Vec<Vec<Placed<'a>>> {
        let parts = |&number: &usize| {
            let mesh = &meshes[number];
            let part = |group| {
                let material = mesh.material_of(group);
                let texcoords = texcoords[material as usize];
                let objects = &[];
                Placed { group, placement: Placement::IDENTITY, material, texcoords, objects }
            };
            objs[mesh.obj].groups.iter().map(part).collect()
        };
        self.prototypes.iter().map(parts).collect()
    }
}

/// True if a placement has an inverse in f32.
fn has_inverse(placement: &Placement) -> bool {
    let linear = placement.linear.to_cols_array_2d().map(|column| column.map(|x| x as f32));
    Instance::new(0, linear, [0.0; 3]).is_some()
}

/// Prototypes under construction, with the transform of each from the coordinates of its file.
#[derive(Default)]
pub(super) struct Builder {
    loaded: LoadedInstances,
    transforms: Vec<SceneTransform>,
}

/// Materials of the scene and their names, to which repairs add.
pub(super) type Palette<'a> = (&'a mut Vec<Material>, &'a mut Vec<String>);

impl Builder {
    /// Adds a prototype of `parts`, repaired.
    pub(super) fn add(&mut self, parts: &[Placed], (materials, names): Palette, notes: &mut Notes) {
        let (min, max) = bounds(parts);
        let transform = SceneTransform::fitting(min.into(), max.into());
        let mut geometry = geometry::assemble(parts, &Fit { transform, is_far: false }, 0.0, notes);
        open_glass::repair(&geometry, &[], materials, names, notes);
        let pairs = overlaps::locate(&geometry, materials);
        overlaps::note(&pairs, &geometry.triangles, materials, names, notes);
        touching_glass::relate(&mut geometry, &pairs, materials, names, notes);
        self.append(geometry, &overlaps::both_orders(&pairs));
        self.transforms.push(transform);
    }

    fn append(&mut self, geometry: Geometry, overlaps: &[Overlap]) {
        let all = &mut self.loaded;
        let first = [all.positions.len(), all.triangles.len(), all.overlaps.len()].map(|n| n as u32);
        all.positions.extend(geometry.positions);
        all.triangles.extend(geometry.triangles);
        all.overlaps.extend(overlaps);
        append(&mut all.normals, first[0], [0.0; 3], geometry.normals);
        append(&mut all.texcoords, first[0], [0.0; 2], geometry.texcoords);
        append(&mut all.second_texcoords, first[0], [0.0; 2], geometry.second_texcoords);
        append(&mut all.colors, first[0], [1.0; 4], geometry.colors);
        let end = [all.positions.len(), all.triangles.len(), all.overlaps.len()].map(|n| n as u32);
        let [vertices, triangles, overlaps] = [0, 1, 2].map(|i| [first[i], end[i]]);
        all.prototypes.push(Prototype::new(&all.positions, vertices, triangles, overlaps));
    }

    /// The instances of `meshes`, after `triangles` in world space. The error is the number of triangles if
    /// they are more than 32 bits can count.
    pub(super) fn place(
        self,
        shared: &Shared,
        meshes: &[PlacedMesh],
        world: &SceneTransform,
        triangles: usize,
    ) -> Result<LoadedInstances, u64> {
        let Self { mut loaded, transforms } = self;
        let vertices = loaded.positions.len();
        complete(&mut loaded.normals, vertices, [0.0; 3]);
        complete(&mut loaded.texcoords, vertices, [0.0; 2]);
        complete(&mut loaded.second_texcoords, vertices, [0.0; 2]);
        complete(&mut loaded.colors, vertices, [1.0; 4]);
        for (mesh, prototype) in meshes.iter().zip(&shared.of_mesh) {
            let Some(prototype) = *prototype else { continue };
            let own = &transforms[prototype as usize];
            if let Some(instance) = instance(prototype, &mesh.placement, own, world) {
                loaded.placed.push(instance);
                loaded.names.push(mesh.name.clone());
            }
        }
        Instances::number(triangles, &loaded.prototypes, &mut loaded.placed)
            .map_err(|_| triangles as u64 + loaded.of_core().triangle_count())?;
        Ok(loaded)
    }
}

/// Appends the values of the vertices from `first` on, if there are any; vertices before without a value
/// have `absent`.
fn append<T: Clone>(all: &mut Vec<T>, first: u32, absent: T, values: Vec<T>) {
    if !values.is_empty() {
        all.resize(first as usize, absent);
        all.extend(values);
    }
}

/// Gives the last vertices of `vertices` the value `absent`, if others have one.
fn complete<T: Clone>(all: &mut Vec<T>, vertices: usize, absent: T) {
    if !all.is_empty() {
        all.resize(vertices, absent);
    }
}

/// Instance from the space of a prototype, which `own` has from the file, to that of the scene.
fn instance(
    prototype: u32,
    placement: &Placement,
    own: &SceneTransform,
    world: &SceneTransform,
) -> Option<Instance> {
    let factor = world.length(1.0) / own.length(1.0);
    let linear: DMat3 = placement.linear * factor;
    let middle = DVec3::from(world.point_f64(placement.point(own.offset)));
    let columns = linear.to_cols_array_2d().map(|column| column.map(|x| x as f32));
    Instance::new(prototype, columns, middle.as_vec3().to_array())
}
