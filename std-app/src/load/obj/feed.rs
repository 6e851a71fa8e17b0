//! tobj at work on clean text, in parallel: every worker reads all the vertices and its share of the faces.
//! Reading a vertex costs a third of what a face costs, and the shares need no knowledge of each other.

use super::clean::Cleaned;
use super::{Group, STAND_INS, polygon};
use crate::load::error::LoadError;
use crate::load::name::Name;
use crate::load::notes::Notes;
use rayon::prelude::*;
use std::collections::HashMap;
use std::io::{self, BufRead, Read};
use std::path::Path;

/// More workers would mostly read the same vertices, each into memory of its own.
const MOST_SHARES: usize = 4;
/// Bytes of faces that are worth a share.
const LEAST_SHARE: usize = 1 << 20;

/// Triangles of all pieces, and the names of the materials that they use.
pub(super) fn read(
    file: &Path,
    pieces: &[Cleaned],
    notes: &mut Notes,
) -> Result<(Vec<Group>, Vec<Name>), LoadError> {
    let (runs, names) = runs(pieces);
    let table = material_table(names.len());
    let vertices: Vec<&[u8]> = pieces.iter().map(|piece| &piece.vertices[..]).chain([STAND_INS]).collect();

    let bytes: usize = runs.iter().map(|run| run.faces.len()).sum();
    let shares = (bytes / LEAST_SHARE).clamp(1, rayon::current_num_threads().min(MOST_SHARES));
    let mut parts = vec![vec![Part::Text(b"mtllib materials\n")]; shares];
    parts.iter_mut().for_each(|parts| parts.extend(vertices.iter().map(|text| Part::Text(text))));
    let mut read = 0;
    for run in &runs {
        let share = &mut parts[(read * shares / bytes.max(1)).min(shares - 1)];
        share.push(Part::Material(run.material));
        share.push(Part::Text(run.faces));
        read += run.faces.len();
    }

    let groups: Vec<Result<(Vec<Group>, Notes), tobj::LoadError>> = parts
        .into_par_iter()
        .map(|parts| {
            let materials = |_: &Path| tobj::load_mtl_buf(&mut table.as_bytes());
            let (models, _) = tobj::load_obj_buf(&mut Parts::new(parts), &OPTIONS, materials)?;
            let mut notes = Notes::default();
            Ok((models.into_iter().map(|model| group(model.mesh, &mut notes)).collect(), notes))
        })
        .collect();
    let mut all = Vec::new();
    for share in groups {
        let (mut groups, repairs) = share.map_err(|error| refused(file, error))?;
        all.append(&mut groups);
        notes.merge(repairs);
    }
    Ok((all, names))
}

const OPTIONS: tobj::LoadOptions =
    tobj::LoadOptions { single_index: true, triangulate: false, ignore_points: true, ignore_lines: true };

/// The cleaner leaves nothing to refuse, so this says what tobj says.
#[cold]
fn refused(file: &Path, error: tobj::LoadError) -> LoadError {
    LoadError::of_file(file, format!("the OBJ reader refuses it: {error}"), "please report this file")
}

/// Faces that follow each other in the file and share a material.
struct Run<'a> {
    material: Option<usize>,
    faces: &'a [u8],
}

/// Cuts the faces at the `usemtl` statements. Materials are numbered in the order of their first use.
fn runs(pieces: &[Cleaned]) -> (Vec<Run<'_>>, Vec<Name>) {
    let mut names: Vec<Name> = Vec::new();
    let mut numbers: HashMap<&Name, usize> = HashMap::new();
    let mut runs = Vec::new();
    let mut named: Option<&Name> = None;
    for piece in pieces {
        let ends = piece.materials.iter().map(|&(at, _)| at).chain([piece.faces.len()]);
        let mut starts = 0;
        for (i, end) in ends.enumerate() {
            if starts < end {
                let material = named.map(|name| {
                    *numbers.entry(name).or_insert_with(|| {
                        names.push(name.clone());
                        names.len() - 1
                    })
                });
                runs.push(Run { material, faces: &piece.faces[starts..end] });
            }
            starts = end;
            named = piece.materials.get(i).map_or(named, |(_, name)| Some(name));
        }
    }
    (runs, names)
}

/// The materials as tobj has to know them: their numbers are their names. What they are is read by
/// [`crate::load::mtl`].
fn material_table(count: usize) -> String {
    (0..count).map(|number| format!("newmtl {number}\n")).collect()
}

fn group(mesh: tobj::Mesh, notes: &mut Notes) -> Group {
    let triples = |flat: &[f64]| flat.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect::<Vec<_>>();
    let positions = triples(&mesh.positions);
    let mut normals = triples(&mesh.normals);
    let mut texcoords: Vec<[f64; 2]> = mesh.texcoords.chunks_exact(2).map(|c| [c[0], c[1]]).collect();
    // The cleaner gives every corner both or none; should that ever fail, rather none than a wrong one.
    if normals.len() != positions.len() {
        normals = Vec::new();
    }
    if texcoords.len() != positions.len() {
        texcoords = Vec::new();
    }
    let triangles = polygon::triangulate(&positions, &mesh.indices, &mesh.face_arities, notes);
    Group { material: mesh.material_id, positions, normals, texcoords, triangles }
}

/// A part of the text that a worker reads.
#[derive(Clone)]
enum Part<'a> {
    Text(&'a [u8]),
    Material(Option<usize>),
}

/// Parts of text one after the other, without copying them.
struct Parts<'a> {
    parts: std::vec::IntoIter<Part<'a>>,
    text: &'a [u8],
    statement: Vec<u8>,
    read: usize,
}

impl<'a> Parts<'a> {
    fn new(parts: Vec<Part<'a>>) -> Self {
        Self { parts: parts.into_iter(), text: &[], statement: Vec::new(), read: 0 }
    }
}

impl Read for Parts<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut text = self.fill_buf()?;
        let count = text.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for Parts<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        while self.text.is_empty() && self.read == self.statement.len() {
            match self.parts.next() {
                None => break,
                Some(Part::Text(text)) => self.text = text,
                Some(Part::Material(number)) => {
                    // A name that is not in the table means no material.
                    let name = number.map_or("none".to_string(), |number| number.to_string());
                    self.statement = format!("usemtl {name}\n").into_bytes();
                    self.read = 0;
                }
            }
        }
        Ok(if self.text.is_empty() { &self.statement[self.read..] } else { self.text })
    }

    fn consume(&mut self, count: usize) {
        if self.text.is_empty() {
            self.read = (self.read + count).min(self.statement.len());
        } else {
            self.text = self.text.get(count..).unwrap_or_default();
        }
    }
}
