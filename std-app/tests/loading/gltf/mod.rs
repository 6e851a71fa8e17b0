//! glTF files, written by the tests.

mod attributes;
mod cornell;
mod hostile;
mod lights;
mod materials;
mod meshes;
mod textures;

use crate::support::Folder;
use halflight::load::{LoadError, LoadOptions, LoadedScene, load};
use serde_json::{Value, json};

/// Code of floats in accessors.
const FLOAT: u32 = 5126;

/// A file under construction.
pub(super) struct Gltf {
    pub(super) json: Value,
    pub(super) bytes: Vec<u8>,
}

impl Gltf {
    /// An empty scene with one node for each of `nodes`.
    pub(super) fn new(nodes: Value) -> Self {
        let count = nodes.as_array().map_or(0, Vec::len);
        let json = json!({
            "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": (0..count).collect::<Vec<_>>() }],
            "nodes": nodes, "accessors": [], "bufferViews": [], "buffers": [{ "byteLength": 0 }],
        });
        Self { json, bytes: Vec::new() }
    }

    /// A square of the corners (0, 0, 0) and (4, 4, 0) with texture coordinates and this material.
    pub(super) fn square(material: Value) -> Self {
        let mut file = Self::new(json!([{ "mesh": 0 }]));
        let position = file.floats("VEC3", &[0., 0., 0., 4., 0., 0., 4., 4., 0., 0., 4., 0.]);
        let texcoord = file.floats("VEC2", &[0., 1., 1., 1., 1., 0., 0., 0.]);
        let other = file.floats("VEC2", &[0.5, 0.25, 0., 0., 0., 0., 0., 0.]);
        let indices = file.indices(&[0, 1, 2, 0, 2, 3]);
        let attributes = json!({ "POSITION": position, "TEXCOORD_0": texcoord, "TEXCOORD_1": other });
        let primitive = json!({ "attributes": attributes, "indices": indices, "material": 0 });
        file.json["meshes"] = json!([{ "primitives": [primitive] }]);
        file.json["materials"] = json!([material]);
        file
    }

    /// Adds bytes as a buffer view.
    pub(super) fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }));
        views.len() - 1
    }

    /// Adds an accessor of `count` elements of these bytes.
    pub(super) fn accessor(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors
            .push(json!({ "bufferView": view, "componentType": component, "count": count, "type": kind }));
        accessors.len() - 1
    }

    pub(super) fn floats(&mut self, kind: &str, numbers: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "MAT4" => 16,
            vector => vector[3..].parse().unwrap(),
        };
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(kind, FLOAT, numbers.len() / width, &bytes)
    }

    pub(super) fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor("SCALAR", 5125, indices.len(), &bytes)
    }

    /// The bytes of a GLB.
    pub(super) fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"][0]["byteLength"] = self.bytes.len().into();
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let chunk =
            |kind: &[u8], bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes()[..], kind, bytes].concat();
        let chunks = [chunk(b"JSON", &text), chunk(b"BIN\0", &self.bytes)].concat();
        let length = 12 + chunks.len() as u32;
        [b"glTF", &2u32.to_le_bytes()[..], &length.to_le_bytes()[..], &chunks].concat()
    }

    pub(super) fn load(&self) -> Result<LoadedScene, LoadError> {
        load_files(&[("scene.glb", &self.glb())], "scene.glb")
    }

    pub(super) fn loaded(&self) -> LoadedScene {
        self.load().unwrap_or_else(|error| panic!("{error}"))
    }
}

/// Loads `name` in a folder of these files.
pub(super) fn load_files(files: &[(&str, &[u8])], name: &str) -> Result<LoadedScene, LoadError> {
    static NEXT: core::sync::atomic::AtomicU32 = core::sync::atomic::AtomicU32::new(0);
    let number = NEXT.fetch_add(1, core::sync::atomic::Ordering::Relaxed);
    let folder = Folder::new(&format!("gltf-{number}"));
    files.iter().for_each(|(name, bytes)| std::fs::write(folder.path(name), bytes).unwrap());
    load(&folder.path(name), &LoadOptions::default())
}

/// True if a note has all of these words.
pub(super) fn says(scene: &LoadedScene, words: &[&str]) -> bool {
    scene.repairs.iter().any(|note| words.iter().all(|word| note.contains(word)))
}

/// A PNG of one pixel.
pub(super) fn pixel(rgba: [u8; 4]) -> Vec<u8> {
    png(1, 1, &rgba)
}

/// A PNG of RGBA pixels.
pub(super) fn png(width: u32, height: u32, rgba: &[u8]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_raw(width, height, rgba.to_vec())
        .unwrap()
        .write_to(&mut bytes, image::ImageFormat::Png)
        .unwrap();
    bytes.into_inner()
}
