//! Identity of a film or cache: everything that determines its content, as names with values. The parts of
//! its scene are fingerprints of 64 bits in hexadecimal.

use super::hash::Hash;
use halflight_core::method::Shard;
use halflight_core::scene::{Scene, Texels};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Adds a part of a scene to a hash.
type Put = fn(&Scene, &mut Hash);

/// Parts of a scene.
const PARTS: [(&str, Put); 5] = [
    ("geometry", geometry),
    ("materials", materials),
    ("textures", textures),
    ("lights", |scene, hash| section(hash, format_args!("{:?} {:?}", scene.lights, scene.environment))),
    ("camera", |scene, hash| section(hash, format_args!("{:?}", scene.camera))),
];

/// Names with values, in the order in which differences are named.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(in crate::render) struct Identity(Vec<(String, String)>);

impl Identity {
    /// Version of the program.
    pub(in crate::render) fn of_program() -> Self {
        Self(Vec::new()).with("version", env!("CARGO_PKG_VERSION"))
    }

    /// With a value.
    pub(in crate::render) fn with(mut self, name: &str, value: impl ToString) -> Self {
        self.0.push((name.into(), value.to_string()));
        self
    }

    /// With an optional value, or the word for none.
    pub(in crate::render) fn with_some<T: ToString>(self, name: &str, value: Option<T>, none: &str) -> Self {
        let value = value.map_or_else(|| none.into(), |value| value.to_string());
        self.with(name, value)
    }

    /// With the parts of `scene` except its camera.
    pub(in crate::render) fn with_scene(self, scene: &Scene) -> Self {
        let parts = PARTS.iter().filter(|(name, _)| *name != "camera");
        parts.fold(self, |identity, (name, _)| identity.with(name, fingerprint(scene, name)))
    }

    /// First difference between `self`, the identity of a file, and `other`, in words; all parts of the scene
    /// count as one.
    pub(super) fn difference(&self, other: &Self) -> Option<String> {
        let is_part = |name: &str| PARTS.iter().any(|(part, _)| *part == name);
        let differing = || self.0.iter().zip(&other.0).filter(|(own, other)| own != other);
        let Some(((name, own), (_, other))) = differing().next() else {
            return (self != other).then(|| "with other settings".into());
        };
        if !is_part(name) {
            return Some(format!("of {name} {own}, not {other}"));
        }
        let parts = differing().map(|((name, _), _)| name.as_str()).filter(|name| is_part(name));
        let parts: Vec<&str> = parts.collect();
        Some(format!("of another scene, or its {} changed since", parts.join(" and ")))
    }

    /// The reason why a file, a `kind` of this identity with a number of shards and samples, is not to be
    /// merged with another at a path.
    pub(super) fn difference_of_siblings(
        &self,
        kind: &str,
        (count, spp): (u32, u32),
        (identity, (first_count, first_spp), first): (&Self, (u32, u32), &Path),
    ) -> Option<String> {
        let difference = match self.difference(identity) {
            Some(difference) => format!("a {kind} {difference}"),
            None if count != first_count => format!("one of {count} shards, not of {first_count}"),
            None if spp != first_spp => format!("a {kind} of {spp} samples, not of {first_spp}"),
            None => return None,
        };
        Some(format!("does not belong to {}: it is {difference}", first.display()))
    }

    /// First difference between a file of this identity and shard and another, in words.
    pub(super) fn difference_of_shards(own: (&Self, Shard), other: (&Self, Shard)) -> Option<String> {
        let words = |shard: Shard| format!("shard {}/{}", shard.index + 1, shard.count);
        let shards = || format!("of {}, not of {}", words(own.1), words(other.1));
        own.0.difference(other.0).or_else(|| (own.1 != other.1).then(shards))
    }
}

/// Fingerprint of a part of `scene`.
pub(super) fn fingerprint(scene: &Scene, part: &str) -> String {
    let mut hash = Hash::default();
    PARTS.iter().filter(|(name, _)| *name == part).for_each(|(_, put)| put(scene, &mut hash));
    format!("{:016x}", hash.value())
}

/// Adds the text of values. Debug formatting is exact for floats.
fn section(hash: &mut Hash, text: core::fmt::Arguments) {
    hash.section(text.to_string().as_bytes());
}

fn geometry(scene: &Scene, hash: &mut Hash) {
    let mesh = &scene.mesh;
    hash.section(bytemuck::cast_slice(mesh.positions));
    hash.section(bytemuck::cast_slice(mesh.normals));
    hash.section(bytemuck::cast_slice(mesh.texcoords));
    hash.section(bytemuck::cast_slice(mesh.triangles));
    let instances = &mesh.instances;
    for texcoords in [mesh.second_texcoords, instances.second_texcoords] {
        if !texcoords.is_empty() {
            hash.section(bytemuck::cast_slice(texcoords));
        }
    }
    for colors in [mesh.colors, instances.colors] {
        if !colors.is_empty() {
            hash.section(bytemuck::cast_slice(colors));
        }
    }
    if !instances.is_empty() {
        hash.section(bytemuck::cast_slice(instances.positions));
        hash.section(bytemuck::cast_slice(instances.normals));
        hash.section(bytemuck::cast_slice(instances.texcoords));
        hash.section(bytemuck::cast_slice(instances.triangles));
        hash.section(bytemuck::cast_slice(instances.prototypes));
        hash.section(bytemuck::cast_slice(instances.placed));
    }
}

fn materials(scene: &Scene, hash: &mut Hash) {
    scene.materials.iter().for_each(|material| section(hash, format_args!("{material:?}")));
}

fn textures(scene: &Scene, hash: &mut Hash) {
    for texture in scene.textures {
        let (kind, texels) = match texture.texels {
            Texels::Srgb8(texels) => ("srgb", bytemuck::cast_slice(texels)),
            Texels::Linear8(texels) => ("linear", bytemuck::cast_slice(texels)),
            Texels::Float(texels) => ("float", bytemuck::cast_slice(texels)),
            Texels::Number(texels) => ("number", bytemuck::cast_slice(texels)),
        };
        section(hash, format_args!("{} {} {:?} {kind}", texture.width, texture.height, texture.wrap));
        hash.section(texels);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_difference_is_named_and_parts_of_a_scene_together() {
        let identity = |seed: u32, [geometry, lights]: [u32; 2]| {
            let identity = Identity::of_program().with("seed", seed);
            identity.with("geometry", geometry).with("lights", lights).with_some(
                "depth",
                None::<u32>,
                "no limit",
            )
        };
        let file = identity(0, [1, 2]);
        let words = |other: Identity| file.difference(&other).unwrap_or_default();
        assert_eq!(words(identity(0, [1, 2])), "");
        assert_eq!(words(identity(9, [3, 2])), "of seed 0, not 9");
        assert_eq!(words(identity(0, [3, 2])), "of another scene, or its geometry changed since");
        assert_eq!(words(identity(0, [3, 4])), "of another scene, or its geometry and lights changed since");
        assert_eq!(words(identity(0, [1, 2]).with("more", 1)), "with other settings");
    }
}
