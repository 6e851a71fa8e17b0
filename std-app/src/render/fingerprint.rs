//! Fingerprints of 64 bits in hexadecimal, by which files identify their scene.

use super::sealed::Hash;
use halflight_core::scene::Camera;
use halflight_core::scene::{Scene, Texels};
use serde::{Deserialize, Serialize};

/// Fingerprints of a scene without its camera, part by part.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Parts {
    geometry: String,
    materials: String,
    textures: String,
    lights: String,
}

impl Parts {
    pub(super) fn of(scene: &Scene) -> Self {
        Self {
            geometry: sections(|hash| geometry(scene, hash)),
            materials: sections(|hash| materials(scene, hash)),
            textures: sections(|hash| textures(scene, hash)),
            lights: sections(|hash| lights(scene, hash)),
        }
    }

    /// Names of the parts that differ from `other`.
    pub(super) fn differences(&self, other: &Self) -> Vec<&'static str> {
        let parts = [
            ("geometry", self.geometry != other.geometry),
            ("materials", self.materials != other.materials),
            ("textures", self.textures != other.textures),
            ("lights", self.lights != other.lights),
        ];
        parts.into_iter().filter(|(_, differs)| *differs).map(|(name, _)| name).collect()
    }
}

/// Fingerprint of a scene without its camera.
pub(super) fn scene(scene: &Scene) -> String {
    sections(|hash| {
        geometry(scene, hash);
        materials(scene, hash);
        textures(scene, hash);
        lights(scene, hash);
    })
}

/// Fingerprint of a camera. Debug formatting is exact for floats.
pub(super) fn camera(camera: &Camera) -> String {
    sections(|hash| hash.section(format!("{camera:?}").as_bytes()))
}

fn sections(put: impl FnOnce(&mut Hash)) -> String {
    let mut hash = Hash::default();
    put(&mut hash);
    format!("{:016x}", hash.value())
}

fn geometry(scene: &Scene, hash: &mut Hash) {
    let mesh = &scene.mesh;
    hash.section(bytemuck::cast_slice(mesh.positions));
    hash.section(bytemuck::cast_slice(mesh.normals));
    hash.section(bytemuck::cast_slice(mesh.texcoords));
    hash.section(bytemuck::cast_slice(mesh.triangles));
}

fn materials(scene: &Scene, hash: &mut Hash) {
    scene.materials.iter().for_each(|material| hash.section(format!("{material:?}").as_bytes()));
}

fn textures(scene: &Scene, hash: &mut Hash) {
    for texture in scene.textures {
        hash.section(format!("{} {} {:?}", texture.width, texture.height, texture.wrap).as_bytes());
        match texture.texels {
            Texels::Srgb8(texels) => hash.section(bytemuck::cast_slice(texels)),
            Texels::Linear8(texels) => {
                hash.section(b"linear");
                hash.section(bytemuck::cast_slice(texels));
            }
            Texels::Float(texels) => {
                hash.section(b"float");
                hash.section(bytemuck::cast_slice(texels));
            }
            Texels::Number(texels) => {
                hash.section(b"number");
                hash.section(bytemuck::cast_slice(texels));
            }
        }
    }
}

fn lights(scene: &Scene, hash: &mut Hash) {
    hash.section(format!("{:?} {:?}", scene.lights, scene.environment).as_bytes());
}
