//! The second stage: tobj reads the clean text, in parallel. Each worker reads all vertices, because a face
//! may refer to any of them, and its share of the faces.

use super::clean::{DEFAULTS, Piece};
use super::sections::{self, ObjectRun, Objects, Section, Sections};
use super::{Group, Obj, polygon};
use crate::load::error::LoadError;
use crate::load::name::Name;
use crate::load::notes::Notes;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::HashMap;
use std::io::{self, BufRead, Read};
use std::path::Path;

/// Each worker stores all vertices.
const MOST_SHARES: usize = 4;
/// Bytes of faces that are worth the vertices of a share.
const LEAST_SHARE: usize = 1 << 20;

const OPTIONS: tobj::LoadOptions =
    tobj::LoadOptions { single_index: true, triangulate: false, ignore_points: true, ignore_lines: true };

/// Adds the triangles of all pieces, their materials and notes to `obj`.
pub(super) fn read(file: &Path, pieces: &[Piece], obj: &mut Obj) -> Result<(), LoadError> {
    let mut objects = Objects::of(pieces);
    let runs = runs(pieces, &mut obj.materials, &mut objects);
    obj.objects = objects.into_names();
    // tobj knows materials by their numbers.
    let table: String = (0..obj.materials.len()).map(|number| format!("newmtl {number}\n")).collect();
    let read = |share: Share| {
        let materials = |_: &Path| tobj::load_mtl_buf(&mut table.as_bytes());
        let (models, _) = tobj::load_obj_buf(&mut Parts::new(share.text), &OPTIONS, materials)?;
        let mut notes = Notes::default();
        let mut sections = Sections::new(share.sections);
        let group = |model: tobj::Model| group(model.mesh, &mut sections, &mut notes);
        let groups: Vec<Group> = models.into_iter().map(group).collect();
        Ok((groups, notes))
    };
    let shares: Vec<Result<_, tobj::LoadError>> = shares(pieces, &runs).into_par_iter().map(read).collect();
    for share in shares {
        let (groups, notes) = share.map_err(|error| refused(file, error))?;
        obj.groups.extend(groups);
        obj.notes.merge(notes);
    }
    Ok(())
}

/// Clean text that tobj refuses is a fault of this program.
#[cold]
fn refused(file: &Path, error: tobj::LoadError) -> LoadError {
    LoadError::of_file(file, format!("the OBJ reader refuses it: {error}"), "please report this file")
}

/// Consecutive faces of one material.
struct Run<'a> {
    /// Index into [`Obj::materials`].
    material: Option<usize>,
    faces: &'a [u8],
    sections: Vec<Section>,
}

/// Runs with faces. Adds the names of their materials to `names`.
fn runs<'a>(pieces: &'a [Piece], names: &mut Vec<Name>, objects: &mut Objects<'a>) -> Vec<Run<'a>> {
    let mut numbers: HashMap<&Name, usize> = HashMap::new();
    let mut current = None;
    let mut runs = Vec::new();
    for run in pieces.iter().flat_map(|piece| &piece.runs) {
        current = run.material.as_ref().or(current);
        let sections = objects.sections(&run.sections);
        if run.faces.is_empty() {
            continue;
        }
        let material = current.map(|name| {
            *numbers.entry(name).or_insert_with(|| {
                names.push(name.clone());
                names.len() - 1
            })
        });
        runs.push(Run { material, faces: &run.faces, sections });
    }
    runs
}

/// Text of a worker, and the objects of its faces.
#[derive(Clone)]
struct Share<'a> {
    text: Vec<Cow<'a, [u8]>>,
    sections: Vec<Section>,
}

/// The share of each worker.
fn shares<'a>(pieces: &'a [Piece], runs: &[Run<'a>]) -> Vec<Share<'a>> {
    let bytes: usize = runs.iter().map(|run| run.faces.len()).sum();
    let count = (bytes / LEAST_SHARE).clamp(1, rayon::current_num_threads().min(MOST_SHARES));
    let mut vertices: Vec<Cow<[u8]>> = vec![Cow::Borrowed(b"mtllib materials\n")];
    vertices.extend(pieces.iter().map(|piece| Cow::Borrowed(&piece.vertices[..])));
    vertices.push(Cow::Borrowed(DEFAULTS));
    let mut shares = vec![Share { text: vertices, sections: Vec::new() }; count];
    let mut before = 0;
    for run in runs {
        // A name that is not in the table means no material.
        let name = run.material.map_or("none".to_string(), |number| number.to_string());
        let share = &mut shares[before * count / bytes];
        share.text.push(Cow::Owned(format!("usemtl {name}\n").into_bytes()));
        share.text.push(Cow::Borrowed(run.faces));
        share.sections.extend_from_slice(&run.sections);
        before += run.faces.len();
    }
    shares
}

fn group(mesh: tobj::Mesh, sections: &mut Sections, notes: &mut Notes) -> Group {
    let positions = vectors(&mesh.positions);
    let (mut triangles, mut objects) = (Vec::with_capacity(mesh.indices.len() / 3), Vec::new());
    let (mut indices, mut arities) = (&mesh.indices[..], &mesh.face_arities[..]);
    while !indices.is_empty() {
        let faces = if arities.is_empty() { indices.len() / 3 } else { arities.len() };
        let section = sections.take(faces);
        let of_section = arities.split_off(..section.faces.min(arities.len())).unwrap_or_default();
        let corners = match of_section {
            [] => 3 * section.faces,
            arities => arities.iter().map(|arity| *arity as usize).sum(),
        };
        let of_faces = indices.split_off(..corners.min(indices.len())).unwrap_or_default();
        sections::push(&mut objects, ObjectRun { first: triangles.len(), object: section.object });
        polygon::triangulate(&positions, of_faces, of_section, &mut triangles, notes);
    }
    Group {
        material: mesh.material_id,
        normals: vectors(&mesh.normals),
        texcoords: vectors(&mesh.texcoords),
        triangles,
        positions,
        objects,
        ..Group::default()
    }
}

fn vectors<const N: usize>(numbers: &[f64]) -> Vec<[f64; N]> {
    numbers.as_chunks().0.to_vec()
}

/// Parts of a text, read one after the other without a copy of all.
struct Parts<'a> {
    later: std::vec::IntoIter<Cow<'a, [u8]>>,
    part: Cow<'a, [u8]>,
    /// Bytes of `part` that are read.
    read: usize,
}

impl<'a> Parts<'a> {
    fn new(parts: Vec<Cow<'a, [u8]>>) -> Self {
        Self { later: parts.into_iter(), part: Cow::Borrowed(&[]), read: 0 }
    }
}

impl Read for Parts<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for Parts<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        while self.read == self.part.len()
            && let Some(part) = self.later.next()
        {
            (self.part, self.read) = (part, 0);
        }
        Ok(&self.part[self.read..])
    }

    fn consume(&mut self, count: usize) {
        self.read += count;
    }
}
