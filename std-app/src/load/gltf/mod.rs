//! glTF 2.0 files (`.glb`, `.gltf`): triangles of the meshes, placed by their nodes; materials as statements
//! of an MTL, which scene files can change; lights and cameras.

mod accessor;
mod container;
mod json;
mod light;
mod material;
mod mesh;
mod node;
mod texcoords;

use super::bytes::Bytes;
use super::error::LoadError;
use super::files::{Found, Lookup};
use super::mtl::MtlMaterial;
use super::notes::Notes;
use super::obj::Group;
use super::placed::Placement;
use super::placed_light::PlacedLight;
use super::scene::NamedCamera;
use super::too_large;
use crate::memory::{self, Budget};
use accessor::Buffers;
use json::Document;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Content of a glTF file, in its units.
#[derive(Debug, Default)]
pub struct Model {
    /// Triangles of each mesh, in groups of one material; those of skinned meshes are in their pose.
    pub meshes: Vec<Vec<Group>>,
    /// Materials of the groups.
    pub materials: Vec<MtlMaterial>,
    /// Name of each node with a mesh, index of the mesh, and its placement.
    pub(super) instances: Vec<(String, usize, Placement)>,
    /// Punctual lights.
    pub(super) lights: Vec<PlacedLight>,
    /// Perspective cameras.
    pub(super) cameras: Vec<NamedCamera>,
    /// Bytes of buffers that its pictures may need.
    pub(super) held: usize,
    /// Embedded pictures, by the names that their maps have.
    pub(super) pictures: HashMap<PathBuf, Bytes>,
    /// Repairs.
    pub notes: Notes,
}

/// A file under construction, and what reading it needs.
struct Source<'a> {
    file: &'a Path,
    /// `None` opens no other file.
    lookup: Option<&'a mut Lookup>,
    budget: &'a mut Budget,
    /// Bytes of buffers outside of the file.
    held: usize,
    notes: Notes,
}

/// Memory of [`parse`], bytes.
const MEMORY_OF_PARSE: usize = 1 << 30;

/// Reads the bytes of a glTF file. `file` is for messages only; no other file is opened.
pub fn parse(bytes: Vec<u8>, file: &Path) -> Result<Model, LoadError> {
    read(bytes, file, None, &mut Budget::new(Some(MEMORY_OF_PARSE)))
}

/// Reads a file of these bytes, which the budget has taken, and the buffers that it names.
pub(super) fn read(
    bytes: Vec<u8>,
    file: &Path,
    lookup: Option<&mut Lookup>,
    budget: &mut Budget,
) -> Result<Model, LoadError> {
    let mut source = Source { file, lookup, budget, held: 0, notes: Notes::of(file.display().to_string()) };
    let (json, binary) = container::chunks(file, bytes.into())?;
    let of_json = container::memory_of(&json);
    source.take(of_json)?;
    let document = container::document(file, &json)?;
    drop(json);
    source.extensions(&document)?;
    let bytes = (0..document.buffers.len()).map(|number| source.buffer(&document, number, &binary));
    let bytes = bytes.collect::<Result<_, _>>()?;
    let model = node::model(&Buffers { file, document: &document, bytes }, &mut source)?;
    source.budget.give_back(of_json);
    if model.meshes.iter().flatten().all(|group| group.triangles.is_empty()) {
        let problem = "there are no triangles in its scene: nothing to render";
        return Err(LoadError::of_file(file, problem, "a glTF file with a mesh in a node is expected"));
    }
    Ok(Model { notes: source.notes, held: source.held, ..model })
}

impl Source<'_> {
    fn take(&mut self, bytes: usize) -> Result<(), LoadError> {
        self.budget.take(bytes).map_err(|why| too_large(self.file, &why))
    }

    /// Takes memory until the pictures are decoded.
    fn take_held(&mut self, bytes: usize) -> Result<(), LoadError> {
        self.held += bytes;
        self.take(bytes)
    }

    /// Notes something once for each case.
    fn note(&mut self, what: impl Into<std::borrow::Cow<'static, str>>) {
        self.notes.at(0, what);
    }

    /// Refuses extensions that encode data, and notes those that are not read.
    fn extensions(&mut self, document: &Document) -> Result<(), LoadError> {
        for name in &document.extensions_required {
            if let Some((_, command)) = json::ENCODED.iter().find(|(encoded, _)| encoded == name) {
                return Err(self.encoded(name, command));
            }
        }
        let is_known = |name: &&String| {
            json::READ.contains(&&name[..]) || json::ENCODED.iter().any(|(encoded, _)| encoded == name)
        };
        let required = document.extensions_required.iter();
        let mut unread: Vec<&String> =
            document.extensions_used.iter().chain(required).filter(|name| !is_known(name)).collect();
        unread.sort();
        unread.dedup();
        for name in unread {
            let short: String = name.chars().take(64).collect();
            self.note(format!("extension `{short}` is not supported: left out"));
        }
        if !document.animations.is_empty() {
            self.note("animations are not played: everything is where the nodes place it");
        }
        Ok(())
    }

    /// The error of an extension that encodes data.
    fn encoded(&self, extension: &str, command: &str) -> LoadError {
        let name = self.file.file_name().unwrap_or_default().to_string_lossy();
        let help = format!("decode it with `npx @gltf-transform/cli {command} {name} decoded.glb`");
        LoadError::of_file(self.file, format!("its data are encoded by `{extension}`"), help)
    }

    /// Bytes of a buffer: the binary chunk, a data URI, or a file.
    fn buffer(
        &mut self,
        document: &Document,
        number: usize,
        binary: &Option<Bytes>,
    ) -> Result<Bytes, LoadError> {
        let buffer = &document.buffers[number];
        let fail = |problem: String| LoadError::of_file(self.file, problem, "export the file again");
        let bytes = match (&buffer.uri, binary) {
            (Some(uri), _) => match self.bytes(uri)? {
                Ok(bytes) => bytes,
                Err(why) => return Err(fail(format!("buffer {number} {why}"))),
            },
            (None, Some(binary)) if number == 0 => binary.clone(),
            // The buffer of a compression has no bytes without it.
            (None, _) => Bytes::from(Vec::new()),
        };
        match bytes.part(0, buffer.byte_length) {
            Some(part) => Ok(part),
            None if buffer.uri.is_none() && bytes.is_empty() => Ok(bytes),
            None => {
                let (claimed, has) = (buffer.byte_length, bytes.len());
                let problem = format!("buffer {number} claims {claimed} bytes and has {has}");
                Err(LoadError::of_file(self.file, problem, "it may have been cut off: copy it again"))
            }
        }
    }

    /// Bytes of a data URI or of a file; the inner error is the reason why there are none.
    fn bytes(&mut self, uri: &str) -> Result<Result<Bytes, String>, LoadError> {
        if let Some(payload) = container::data_uri(uri) {
            self.take_held(payload.len() / 4 * 3 + 3)?;
            return Ok(container::decoded(payload).ok_or("is no valid base64".into()));
        }
        let found = match self.locate(uri) {
            Found::Exact(found, _) | Found::Instead(found, _) => found,
            found => return Ok(Err(reason(&found, uri))),
        };
        let bytes = memory::read_file(&found, self.budget.left()).map_err(|error| {
            LoadError::of_file(&found, format!("cannot be read: {error}"), super::MORE_MEMORY)
        })?;
        self.take_held(bytes.len())?;
        Ok(Ok(bytes.into()))
    }

    /// The file of a URI, as written or without its percent signs.
    fn locate(&mut self, uri: &str) -> Found {
        let directory = self.file.parent().unwrap_or(Path::new(""));
        let unescaped = container::unescaped(uri);
        let Some(lookup) = &mut self.lookup else { return Found::Missing };
        let found = lookup.locate(&[&unescaped, uri.as_bytes()], &[directory]);
        if let (Some(_), Some(note)) = (found.file(), found.note("file", &unescaped)) {
            self.note(note);
        }
        found
    }
}

/// Reason why there is no file of a URI.
fn reason(found: &Found, uri: &str) -> String {
    let shown: String = uri.chars().take(200).collect();
    match (found, uri.split_once(':')) {
        (Found::Missing, Some((scheme, _))) if scheme.len() > 1 => {
            format!("is at `{scheme}:`, from where nothing is fetched")
        }
        (Found::Missing, _) => format!("is missing: there is no file `{shown}`"),
        (found, _) => found.note("file", uri.as_bytes()).unwrap_or_default(),
    }
}
