//! Parts of the loader that read bytes without other files.

mod mtl;
mod notes;
mod scene_file;
