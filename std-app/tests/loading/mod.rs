//! Parts of the loader that read bytes without other files, and glTF files.

mod cameras;
mod gltf;
mod mtl;
mod notes;
mod scene_file;
