//! OBJ files. The text is cut into pieces of whole lines. A first pass counts their vertices, because
//! negative indices count back from their own line; a second pass reads the pieces in parallel ([`reader`]).
//! Faces of one material become a [`Group`], whose polygons are triangulated ([`polygon`]).

mod polygon;
mod reader;

use super::error::LoadError;
use super::name::Name;
use super::notes::Notes;
use super::text::{self, Binary};
use rayon::prelude::*;
use reader::{ABSENT, Counts, Run};
use std::collections::HashMap;
use std::path::Path;

/// Bytes of a piece: small enough to give each thread some of a file of middle size.
const PIECE: usize = 1 << 20;

/// Content of an OBJ file, in the units of the file.
#[derive(Debug, Default)]
pub struct Obj {
    /// Triangles in the order of the file, in runs of one material.
    pub groups: Vec<Group>,
    /// Operands of the `usemtl` statements in use, in the order of their first use.
    pub materials: Vec<Name>,
    /// `mtllib` statements: line and operand.
    pub libraries: Vec<(u32, Name)>,
    /// Repairs.
    pub notes: Notes,
}

/// Triangles of one material over their own vertices.
#[derive(Debug, Default)]
pub struct Group {
    /// Index into [`Obj::materials`]; `None` before the first `usemtl`.
    pub material: Option<usize>,
    /// Positions of the file; some may not be finite.
    pub positions: Vec<[f64; 3]>,
    /// As long as `positions`, or empty. Not normalised; zero if a corner has none.
    pub normals: Vec<[f64; 3]>,
    /// As long as `positions`, or empty.
    pub texcoords: Vec<[f64; 2]>,
    /// Counter-clockwise; every index is in range.
    pub triangles: Vec<[u32; 3]>,
}

/// Reads the bytes of an OBJ file. `file` is for messages only; no other file is opened.
pub fn parse(bytes: Vec<u8>, file: &Path) -> Result<Obj, LoadError> {
    let text = text::normalise(bytes).map_err(|Binary| {
        LoadError::of_file(file, "this is not text", "an OBJ file is expected; is it a binary format?")
    })?;
    let texts = split(&text);
    let counts: Vec<(Counts, u32)> = texts.par_iter().map(|text| reader::count(text)).collect();
    let mut total: Counts = [0; 3];
    let mut line = 1;
    let mut jobs = Vec::with_capacity(texts.len());
    for (text, (own, lines)) in texts.into_iter().zip(counts) {
        jobs.push((text, line, total, own));
        line += lines;
        total = core::array::from_fn(|i| total[i] + own[i]);
    }
    total.into_iter().try_for_each(|count| super::count_vertices(file, count))?;
    let read = |(text, line, before, own)| reader::read(file, text, line, [before, own, total]);
    let pieces: Vec<Result<reader::Piece, LoadError>> = jobs.into_par_iter().map(read).collect();

    let mut obj = Obj::default();
    let (mut positions, mut texcoords, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    positions.reserve_exact(total[0]);
    texcoords.reserve_exact(total[1]);
    normals.reserve_exact(total[2]);
    let mut runs = Vec::new();
    for piece in pieces {
        // The first error in the order of the file counts, whichever thread is first.
        let piece = piece?;
        let [own_positions, own_texcoords, own_normals] = piece.vertices;
        positions.extend(own_positions);
        texcoords.extend(own_texcoords.into_iter().map(|[u, v, _]| [u, v]));
        normals.extend(own_normals);
        obj.notes.merge(piece.notes);
        obj.libraries.extend(piece.libraries);
        runs.extend(piece.runs);
    }
    let materials = number_materials(&mut runs, &mut obj.materials);
    if runs.is_empty() {
        let problem = match total[0] {
            0 => "there are neither vertices nor faces in it".to_string(),
            vertices => format!("there are {vertices} vertices but no faces in it: nothing to render"),
        };
        return Err(LoadError::of_file(file, problem, "an OBJ file with `f` statements is expected"));
    }
    let build = |(run, material)| group(&run, material, &positions, &texcoords, &normals);
    let built: Vec<(Group, Notes)> = runs.into_par_iter().zip(materials).map(build).collect();
    for (group, notes) in built {
        obj.groups.push(group);
        obj.notes.merge(notes);
    }
    Ok(obj)
}

/// Pieces of about [`PIECE`] bytes that end with a line.
fn split(text: &[u8]) -> Vec<&[u8]> {
    let mut pieces = Vec::with_capacity(text.len() / PIECE + 1);
    let mut rest = text;
    while rest.len() > PIECE {
        let end = rest[PIECE..].iter().position(|&b| b == b'\n').map_or(rest.len(), |at| PIECE + at + 1);
        let (piece, later) = rest.split_at(end);
        pieces.push(piece);
        rest = later;
    }
    pieces.push(rest);
    pieces
}

/// Drops runs without faces. Returns the material of each other run as an index into `names`.
fn number_materials(runs: &mut Vec<Run>, names: &mut Vec<Name>) -> Vec<Option<usize>> {
    let mut numbers: HashMap<Name, usize> = HashMap::new();
    let mut current: Option<Name> = None;
    let mut materials = Vec::new();
    runs.retain_mut(|run| {
        current = run.material.take().or(current.take());
        if run.arities.is_empty() {
            return false;
        }
        materials.push(current.as_ref().map(|name| {
            *numbers.entry(name.clone()).or_insert_with(|| {
                names.push(name.clone());
                names.len() - 1
            })
        }));
        true
    });
    materials
}

/// The faces of a run over vertices of their own: one for each distinct corner.
fn group(
    run: &Run,
    material: Option<usize>,
    positions: &[[f64; 3]],
    texcoords: &[[f64; 2]],
    normals: &[[f64; 3]],
) -> (Group, Notes) {
    let mut numbers: HashMap<[u32; 3], u32> = HashMap::new();
    let mut distinct = Vec::new();
    let number = |corner: &[u32; 3]| {
        *numbers.entry(*corner).or_insert_with(|| {
            distinct.push(*corner);
            distinct.len() as u32 - 1
        })
    };
    let indices: Vec<u32> = run.corners.iter().map(number).collect();
    let mut notes = Notes::default();
    let mut group = Group { material, ..Group::default() };
    group.positions = gather(&distinct, 0, positions);
    group.texcoords = gather(&distinct, 1, texcoords);
    group.normals = gather(&distinct, 2, normals);
    group.triangles = polygon::triangulate(&group.positions, &indices, &run.arities, &mut notes);
    (group, notes)
}

/// The values of all corners, zeros for absent ones; empty if the file has no values.
fn gather<const N: usize>(corners: &[[u32; 3]], part: usize, values: &[[f64; N]]) -> Vec<[f64; N]> {
    let value = |corner: &[u32; 3]| match corner[part] {
        ABSENT => [0.0; N],
        index => values[index as usize],
    };
    if values.is_empty() { Vec::new() } else { corners.iter().map(value).collect() }
}
