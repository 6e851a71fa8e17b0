//! glTF files: any bytes give meshes whose parts fit together, or an error that names the file.

use halflight::load::gltf;
use std::path::Path;

/// One input.
pub fn run(data: &[u8]) {
    let read = match gltf::parse(data.to_vec(), Path::new("fuzz.glb")) {
        Ok(read) => read,
        Err(error) => return assert!(error.to_string().starts_with("fuzz.glb")),
    };
    for group in read.meshes.iter().flatten() {
        let vertices = group.positions.len();
        assert!(group.material.is_some_and(|material| material < read.materials.len()));
        assert!(group.normals.is_empty() || group.normals.len() == vertices);
        assert!(group.texcoords.is_empty() || group.texcoords.len() == vertices);
        assert!(group.triangles.as_flattened().iter().all(|&vertex| (vertex as usize) < vertices));
    }
}
