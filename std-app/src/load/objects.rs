//! Objects of a scene: the named parts of its meshes, which layers and lightmaps choose by name.

use super::obj::Obj;
use super::placed::PlacedMesh;
use core::ops::Range;
use std::collections::HashMap;

/// Objects of a scene under construction.
#[derive(Default)]
pub(super) struct Objects {
    /// Names, all different.
    pub(super) names: Vec<String>,
    /// For each mesh, the object of each object of its OBJ, and last that of faces without one.
    pub(super) of_meshes: Vec<Vec<u32>>,
    /// Number of copies of each name.
    copies: HashMap<String, u32>,
}

impl Objects {
    /// Objects of all meshes. A copy of a mesh has objects of its own.
    pub(super) fn of(meshes: &[PlacedMesh], objs: &[Obj]) -> Self {
        let mut objects = Self::default();
        for mesh in meshes {
            let obj = &objs[mesh.obj];
            let mut of_mesh: Vec<u32> =
                obj.objects.iter().map(|name| objects.add(&name.to_string())).collect();
            let is_nameless = |group: &super::obj::Group| {
                group.objects.is_empty() || group.objects.iter().any(|run| run.object.is_none())
            };
            if obj.groups.iter().any(is_nameless) {
                of_mesh.push(objects.add(&mesh.name));
            }
            objects.of_meshes.push(of_mesh);
        }
        objects
    }

    /// The number of a new object.
    fn add(&mut self, name: &str) -> u32 {
        let mut unique = name.to_owned();
        while self.copies.contains_key(&unique) {
            let copies = self.copies.entry(name.to_owned()).or_insert(1);
            *copies += 1;
            unique = format!("{name}.{copies}");
        }
        self.copies.insert(unique.clone(), 1);
        self.names.push(unique);
        self.names.len() as u32 - 1
    }
}

/// Names and vertices of the meshes, whose parts have these ends.
pub(super) fn meshes(meshes: &[PlacedMesh], objs: &[Obj], ends: &[u32]) -> Vec<(String, Range<u32>)> {
    let (mut parts, mut first) = (0, 0);
    let range = |mesh: &PlacedMesh| {
        parts += objs[mesh.obj].groups.len();
        let end = ends[..parts].last().copied().unwrap_or_default();
        (mesh.name.clone(), core::mem::replace(&mut first, end)..end)
    };
    meshes.iter().map(range).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::placed::Placement;

    #[test]
    fn copies_of_a_mesh_have_names_of_their_own() {
        let objs = [Obj { groups: vec![Default::default()], ..Obj::default() }];
        let mesh = |name: &str| PlacedMesh {
            name: name.into(),
            obj: 0,
            placement: Placement::IDENTITY,
            materials: [0].into(),
        };
        let objects = Objects::of(&["chair", "chair.2", "chair", "chair", "table"].map(mesh), &objs);
        assert_eq!(objects.names, ["chair", "chair.2", "chair.3", "chair.4", "table"]);
        assert_eq!(objects.of_meshes, [[0], [1], [2], [3], [4]]);
    }
}
