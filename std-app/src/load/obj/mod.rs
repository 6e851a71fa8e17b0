//! OBJ files: the bytes are split into pieces that are cleaned in parallel ([`clean`]); tobj reads what is
//! clean ([`feed`]); polygons become triangles ([`polygon`]). What comes out is in the units of the file.

mod clean;
mod feed;
mod polygon;

use super::error::LoadError;
use super::name::Name;
use super::notes::Notes;
use super::text::{self, Binary};
use clean::{Cleaned, Counts, Piece, Survey};
use rayon::prelude::*;
use std::path::Path;

/// Bytes of a piece: small enough that every worker gets some of a middling file.
const PIECE: usize = 1 << 20;

/// Lines that stand for the texture coordinate and the normal that a corner does not have: the origin, and
/// the zero normal that means flat.
const STAND_INS: &[u8] = b"vt 0 0\nvn 0 0 0\n";

/// What an OBJ file says.
#[derive(Debug, Default)]
pub struct Obj {
    /// Triangles, in the order of the file, in runs of one material.
    pub groups: Vec<Group>,
    /// Operands of the `usemtl` statements in use, in the order of their first use.
    pub materials: Vec<Name>,
    /// `mtllib` statements: line and operand.
    pub libraries: Vec<(u32, Name)>,
    /// What was repaired.
    pub notes: Notes,
}

/// Triangles of one material over their own vertices.
#[derive(Debug, Default)]
pub struct Group {
    /// Index into [`Obj::materials`]; `None` before the first `usemtl`.
    pub material: Option<usize>,
    /// Positions as the file has them; some may not be finite.
    pub positions: Vec<[f64; 3]>,
    /// As long as `positions`, or empty. Not normalised; zero where a corner has none.
    pub normals: Vec<[f64; 3]>,
    /// As long as `positions`, or empty.
    pub texcoords: Vec<[f64; 2]>,
    /// Counter-clockwise; every index is in range.
    pub triangles: Vec<[u32; 3]>,
}

/// Reads the bytes of an OBJ file. `file` is for messages only, nothing else is opened.
pub fn parse(bytes: Vec<u8>, file: &Path) -> Result<Obj, LoadError> {
    let text = text::normalise(bytes).map_err(|Binary| {
        LoadError::of_file(file, "this is not text", "an OBJ file is expected; is it a binary format?")
    })?;
    let pieces = split(&text);
    let surveys: Vec<Survey> = pieces.par_iter().map(|piece| clean::survey(piece)).collect();
    let mut total: Counts = [0; 3];
    let mut line = 1;
    let mut jobs = Vec::with_capacity(pieces.len());
    for (text, survey) in pieces.iter().zip(&surveys) {
        jobs.push((Piece { text, first_line: line }, total));
        line += survey.lines;
        total = core::array::from_fn(|i| total[i] + survey.counts[i]);
    }
    // The first error in the order of the file, whichever worker is first.
    let cleaned: Vec<Result<Cleaned, LoadError>> =
        jobs.into_par_iter().map(|(piece, before)| clean::clean(file, piece, before, total)).collect();
    let mut cleaned = cleaned.into_iter().collect::<Result<Vec<_>, _>>()?;

    let mut notes = Notes::default();
    let mut libraries = Vec::new();
    for piece in &mut cleaned {
        notes.merge(core::mem::take(&mut piece.notes));
        libraries.append(&mut piece.libraries);
    }
    if cleaned.iter().all(|piece| piece.faces.is_empty()) {
        let problem = match total[0] {
            0 => "there are neither vertices nor faces in it".to_string(),
            vertices => format!("there are {vertices} vertices but no faces in it: nothing to render"),
        };
        return Err(LoadError::of_file(file, problem, "an OBJ file with `f` statements is expected"));
    }
    let (groups, materials) = feed::read(file, &cleaned, &mut notes)?;
    Ok(Obj { groups, materials, libraries, notes })
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
