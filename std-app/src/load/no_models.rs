//! glTF files in a library without feature `gltf`: refused.

use super::placed::Placement;
use super::{LoadError, SceneBuilder};
use std::path::Path;

impl SceneBuilder {
    /// The error of a glTF file.
    pub(super) fn add_model(
        &mut self,
        path: &Path,
        _: Placement,
        _: Option<&str>,
        _: Option<bool>,
    ) -> Result<(), LoadError> {
        let problem = "this program is built without feature `gltf`, which reads glTF";
        Err(LoadError::of_file(path, problem, "build it with the feature, or export the scene as OBJ"))
    }
}
