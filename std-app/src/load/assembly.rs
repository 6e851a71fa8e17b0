//! A scene from its files: materials, one mesh in the coordinates of the core, and instances.

use super::buffers::Geometry;
use super::instances::{self, Palette, Shared};
use super::map::Map;
use super::memory_estimate::of_scene;
use super::mtl::MtlMaterial;
use super::notes::Notes;
use super::objects::{self, Objects};
use super::overlaps::Pair;
use super::scene::{LoadedScene, RenderSettings};
use super::scene_file::EnvironmentChange;
use super::texcoords::Texcoords;
use super::{LoadError, LoadOptions, SceneBuilder, count_vertices, too_large};
use super::{
    duplicate_emitters, fit, geometry, memory_estimate, open_glass, overlaps, surface, touching_glass,
};
use halflight_core::scene::Material;
use std::path::Path;

impl SceneBuilder {
    /// The scene with the buffers of the core.
    pub(super) fn build(
        mut self,
        path: &Path,
        options: &LoadOptions,
        environment: Option<EnvironmentChange>,
    ) -> Result<LoadedScene, LoadError> {
        for name in self.overrides.keys().filter(|name| !self.used_overrides.contains(*name)) {
            self.notes
                .add(1, format!("no mesh has a material `{name}`: its entry in the scene file is not used"));
        }
        let mut textures = self.textures(options, environment.as_ref())?;
        let notes = &mut self.notes;
        let texcoords = self.materials.iter_mut().map(|mtl| texcoords_of(mtl, options.keeps_texcoords));
        let texcoords: Vec<Texcoords> = texcoords.collect();
        let resolved = |(number, mtl): (u32, &MtlMaterial)| match self.given.get(&number) {
            Some(material) => *material,
            None => surface::resolve(mtl, &mut textures, notes),
        };
        let mut materials: Vec<Material> = (0..).zip(&self.materials).map(resolved).collect();
        notes.merge(core::mem::take(&mut textures.notes));
        let environment = environment.map(|entry| entry.in_core(&mut textures));
        self.budget.take(textures.derived_bytes()).map_err(|why| too_large(path, &why))?;
        let shared = match options.copies || options.keeps_texcoords {
            true => Shared::none(&self.meshes),
            false => Shared::of(&self.meshes, &self.objs, &materials, notes),
        };
        // Instances extend the scene as copies do.
        let objects = Objects::of(&self.meshes, &self.objs, &shared);
        let (mut parts, in_world) = shared.placed(&self.meshes, &self.objs, (&objects.of_meshes, &texcoords));
        let fit = fit::Fit::of(&parts);
        parts.truncate(in_world);
        count_vertices(path, parts.iter().map(|part| part.group.positions.len()).sum())?;
        let prototypes = shared.parts(&self.meshes, &self.objs, &texcoords);
        let pieces = geometry::pieces(&parts, &fit);
        let estimates = prototypes.iter().chain([&parts]).map(|parts| of_scene(parts, &materials));
        let bytes = estimates.sum::<usize>().saturating_add(memory_estimate::of_pieces(pieces));
        self.budget.take(bytes).map_err(|why| too_large(path, &why))?;
        let mut geometry = geometry::assemble(&parts, &fit, pieces, notes);
        count_vertices(path, geometry.positions.len())?;
        let mut names: Vec<String> = self.materials.iter().map(|mtl| mtl.name.to_string()).collect();
        let panes = may_be_panes(&self.materials, !prototypes.is_empty());
        let overlaps = repair(&mut geometry, &panes, (&mut materials, &mut names), notes);
        let mut instances = instances::Builder::default();
        for parts in &prototypes {
            instances.add(parts, (&mut materials, &mut names), notes);
        }
        let instances = instances
            .place(&shared, &self.meshes, &fit.transform, geometry.triangles.len())
            .map_err(|count| too_many_triangles(path, count))?;
        let lights = self.lights.iter().filter_map(|light| light.in_core(&fit.transform, notes)).collect();
        let mut triangle_objects = geometry.objects;
        triangle_objects.extend(objects.of_instances);
        let loaded = LoadedScene {
            positions: geometry.positions,
            normals: geometry.normals,
            texcoords: geometry.texcoords,
            second_texcoords: geometry.second_texcoords,
            colors: geometry.colors,
            triangles: geometry.triangles,
            overlaps: overlaps::both_orders(&overlaps),
            materials,
            material_names: names,
            instances,
            meshes: objects::meshes(&self.meshes, &self.objs, (&geometry.ends, &shared)),
            object_names: objects.names,
            triangle_objects,
            textures,
            lights,
            environment,
            camera: None,
            view: None,
            cameras: self.cameras,
            settings: RenderSettings::default(),
            transform: fit.transform,
            files: self.lookup.into_files().into_iter().chain([path.into()]).collect(),
            repairs: self.notes.sentences(),
        };
        Ok(loaded.with_first_camera())
    }
}

/// The transform of the first texture coordinates of a material, of which its maps are relieved.
fn texcoords_of(mtl: &mut MtlMaterial, keeps_texcoords: bool) -> Texcoords {
    let is_placed = |map: &&mut Map| map.found.is_some() && !map.options.second_set;
    let maps = mtl.maps.values_mut().filter(|map| is_placed(map) && !keeps_texcoords);
    Texcoords::of_maps(&mut maps.collect::<Vec<_>>())
}

/// True for materials whose flat sheets may be panes. Instances may be solid where other triangles of a
/// material are sheets.
fn may_be_panes(materials: &[MtlMaterial], has_instances: bool) -> Vec<bool> {
    let may_be = |mtl: &MtlMaterial| !has_instances && !mtl.exact && !mtl.surely_glass;
    materials.iter().map(may_be).collect()
}

/// Repairs open glass and triangles in one plane, and notes them. Returns the overlaps.
fn repair(
    geometry: &mut Geometry,
    may_be_panes: &[bool],
    (materials, names): Palette,
    notes: &mut Notes,
) -> Vec<Pair> {
    open_glass::repair(geometry, may_be_panes, materials, names, notes);
    let mut overlaps = overlaps::locate(geometry, materials);
    if duplicate_emitters::remove(geometry, &overlaps, materials, names, notes) {
        overlaps = overlaps::locate(geometry, materials);
    }
    overlaps::note(&overlaps, &geometry.triangles, materials, names, notes);
    touching_glass::relate(geometry, &overlaps, materials, names, notes);
    overlaps
}

fn too_many_triangles(path: &Path, count: u64) -> LoadError {
    let problem = format!("the scene has {count} triangles with its instances, more than 32 bits can count");
    LoadError::of_file(path, problem, "leave out some of its instances")
}
