//! glTF files in a library without feature `gltf`: refused.

use super::placed::Placement;
use super::{LoadError, SceneBuilder};
use std::path::Path;

impl SceneBuilder {
    /// Places a file by its extension; `material` replaces all of its materials, and `share` decides whether
    /// its placements share memory.
    pub(super) fn add_file(
        &mut self,
        path: &Path,
        placement: Placement,
        material: Option<&str>,
        share: Option<bool>,
    ) -> Result<(), LoadError> {
        let extension = path.extension().unwrap_or_default();
        if !["glb", "gltf"].iter().any(|known| extension.eq_ignore_ascii_case(known)) {
            return self.add_mesh(path, placement, material, share);
        }
        let problem = "this program is built without feature `gltf`, which reads glTF";
        Err(LoadError::of_file(path, problem, "build it with the feature, or export the scene as OBJ"))
    }
}
