//! glTF files in a scene under construction: read once, placed as often as the scene file says.

use super::gltf;
use super::placed::{PlacedMesh, Placement};
use super::placed_light::PlacedLight;
use super::scene::{NamedCamera, View, ViewKind};
use super::{LoadError, MORE_MEMORY, SceneBuilder, obj, too_large};
use crate::memory;
use glam::{DVec3, Vec3};
use halflight_core::scene::PointLight;
use std::path::Path;
use std::rc::Rc;

/// A glTF file whose meshes and materials are in the scene.
pub(super) struct ReadModel {
    /// Name of each instance, index of its OBJ, and its placement in the file.
    instances: Vec<(String, usize, Placement)>,
    materials: Rc<[u32]>,
    lights: Vec<PlacedLight>,
    cameras: Vec<NamedCamera>,
}

impl SceneBuilder {
    /// Places a glTF file; `material` replaces all of its materials.
    pub(super) fn add_model(
        &mut self,
        path: &Path,
        placement: Placement,
        material: Option<&str>,
        share: Option<bool>,
    ) -> Result<(), LoadError> {
        let model = match self.models.get(path) {
            Some(model) => model.clone(),
            None => {
                let model = Rc::new(self.read_model(path)?);
                self.models.insert(path.into(), model.clone());
                model
            }
        };
        let materials = match material {
            Some(material) => {
                let material = self.material(None, material.into(), None);
                vec![material; model.materials.len()].into()
            }
            None => model.materials.clone(),
        };
        for (name, obj, own) in &model.instances {
            let (name, placement) = (name.clone(), placement.of(own));
            self.meshes.push(PlacedMesh { name, obj: *obj, placement, materials: materials.clone(), share });
        }
        self.lights.extend(model.lights.iter().map(|light| light.placed(&placement)));
        self.cameras.extend(model.cameras.iter().map(|camera| placed(camera, &placement)));
        Ok(())
    }

    fn read_model(&mut self, path: &Path) -> Result<ReadModel, LoadError> {
        let bytes = memory::read_file(path, self.budget.left())
            .map_err(|error| LoadError::of_file(path, format!("cannot be read: {error}"), MORE_MEMORY))?;
        self.budget.take(bytes.len()).map_err(|why| too_large(path, &why))?;
        self.held += bytes.len();
        let model = gltf::read(bytes, path, Some(&mut self.lookup), &mut self.budget)?;
        self.held += model.held;
        self.notes.merge(model.notes);
        self.embedded.extend(model.pictures);
        let first = self.objs.len();
        let obj = |groups| obj::Obj { groups, ..obj::Obj::default() };
        self.objs.extend(model.meshes.into_iter().map(obj));
        // The last is for faces without material, which glTF does not have.
        let mut materials: Vec<u32> =
            model.materials.into_iter().map(|material| self.new_material(material)).collect();
        materials.extend(materials.last().copied());
        Ok(ReadModel {
            instances: model
                .instances
                .into_iter()
                .map(|(name, mesh, own)| (name, first + mesh, own))
                .collect(),
            materials: materials.into(),
            lights: model.lights,
            cameras: model.cameras,
        })
    }
}

impl PlacedLight {
    /// The light of a file that is placed in the scene.
    fn placed(mut self, placement: &Placement) -> Self {
        self.position = placement.point(self.position);
        let turned = |direction: Vec3| {
            let turned = (placement.linear * direction.as_dvec3()).try_normalize();
            turned.map_or(direction, DVec3::as_vec3)
        };
        match &mut self.light {
            PointLight::Spot { direction, .. } | PointLight::Directional { direction, .. } => {
                *direction = turned(*direction);
            }
            PointLight::Point { .. } => {}
        }
        self
    }
}

/// A camera of a file that is placed in the scene.
fn placed(camera: &NamedCamera, placement: &Placement) -> NamedCamera {
    let View { eye, look_at, up } = camera.view;
    let scaled = placement.linear * DVec3::from(up);
    let kind = match camera.kind {
        ViewKind::Orthographic { height } => {
            ViewKind::Orthographic { height: height * scaled.length() / DVec3::from(up).length() }
        }
        other => other,
    };
    let up = scaled.into();
    NamedCamera {
        kind,
        view: View { eye: placement.point(eye), look_at: placement.point(look_at), up },
        ..camera.clone()
    }
}
