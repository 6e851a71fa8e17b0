//! OBJ files: any bytes give a mesh whose parts fit together, or an error.

use halflight::load::obj;
use std::path::Path;

/// One input.
pub fn run(data: &[u8]) {
    let Ok(read) = obj::parse(data.to_vec(), Path::new("fuzz.obj")) else { return };
    for group in &read.groups {
        let vertices = group.positions.len();
        assert!(group.material.is_none_or(|material| material < read.materials.len()));
        assert!(group.normals.is_empty() || group.normals.len() == vertices);
        assert!(group.texcoords.is_empty() || group.texcoords.len() == vertices);
        assert!(group.triangles.as_flattened().iter().all(|&vertex| (vertex as usize) < vertices));
    }
}
