//! OBJ files. The text is cut into pieces of whole lines. A first pass counts their vertices, because
//! negative indices count back from their own line; a second pass cleans the pieces in parallel ([`clean`]).
//! tobj reads the clean text ([`feed`]). Faces of one material become a [`Group`], whose polygons are
//! triangulated ([`polygon`]).

mod clean;
mod feed;
mod polygon;
mod sections;

use super::error::LoadError;
use super::name::Name;
use super::notes::Notes;
use super::text::{self, Binary};
use clean::{Counts, Piece};
use rayon::prelude::*;
pub(super) use sections::ObjectRun;
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
    /// Operands of the `o` statements in use, or of `g` if there is no `o`, in the order of their first use.
    pub objects: Vec<Name>,
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
    /// Not in OBJ: a second set of texture coordinates. As long as `positions`, or empty.
    pub second_texcoords: Vec<[f64; 2]>,
    /// Not in OBJ: linear RGBA of the vertices, 0 … 1. As long as `positions`, or empty.
    pub colors: Vec<[f32; 4]>,
    /// Counter-clockwise; every index is in range.
    pub triangles: Vec<[u32; 3]>,
    /// Objects of the triangles; empty if none has one.
    pub(super) objects: Vec<ObjectRun>,
}

/// Reads the bytes of an OBJ file. `file` is for messages only; no other file is opened.
pub fn parse(bytes: Vec<u8>, file: &Path) -> Result<Obj, LoadError> {
    let text = text::normalise(bytes).map_err(|Binary| {
        LoadError::of_file(file, "this is not text", "an OBJ file is expected; is it a binary format?")
    })?;
    let texts = split(&text);
    let counts: Vec<(Counts, u32)> = texts.par_iter().map(|text| clean::count(text)).collect();
    let mut total: Counts = [0; 3];
    let mut line = 1;
    let mut jobs = Vec::with_capacity(texts.len());
    for (text, (own, lines)) in texts.into_iter().zip(counts) {
        jobs.push((text, line, total));
        line += lines;
        total = core::array::from_fn(|i| total[i] + own[i]);
    }
    total.into_iter().try_for_each(|count| super::count_vertices(file, count))?;
    let clean = |(text, line, before)| clean::clean(file, text, line, [before, total]);
    let pieces: Vec<Result<Piece, LoadError>> = jobs.into_par_iter().map(clean).collect();
    // The first error in the order of the file is reported, whichever thread finishes first.
    let mut pieces = pieces.into_iter().collect::<Result<Vec<_>, _>>()?;

    let mut obj = Obj::default();
    for piece in &mut pieces {
        obj.notes.merge(core::mem::take(&mut piece.notes));
        obj.libraries.append(&mut piece.libraries);
    }
    if pieces.iter().flat_map(|piece| &piece.runs).all(|run| run.faces.is_empty()) {
        let problem = match total[0] {
            0 => "there are neither vertices nor faces in it".to_string(),
            vertices => format!("there are {vertices} vertices but no faces in it: nothing to render"),
        };
        return Err(LoadError::of_file(file, problem, "an OBJ file with `f` statements is expected"));
    }
    feed::read(file, &pieces, &mut obj)?;
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
