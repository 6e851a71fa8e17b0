//! Statements of a piece of an OBJ file: checked numbers, and faces of three or more corners whose indices
//! are absolute and in range.

use crate::load::error::LoadError;
use crate::load::name::Name;
use crate::load::notes::Notes;
use crate::load::text::{Lines, Words, parse_number, words};
use core::num::IntErrorKind::{NegOverflow, PosOverflow};
use std::path::Path;

/// Numbers of `v`, `vt` and `vn` statements.
pub(super) type Counts = [usize; 3];

/// Index of a texture coordinate or normal that a corner does not have.
pub(super) const ABSENT: u32 = u32::MAX;

/// Faces between two `usemtl` statements.
#[derive(Debug, Default)]
pub(super) struct Run {
    /// `None` continues the material of the previous run.
    pub(super) material: Option<Name>,
    /// Indices of position, texture coordinate and normal, from 0.
    pub(super) corners: Vec<[u32; 3]>,
    /// Numbers of corners of the faces.
    pub(super) arities: Vec<u32>,
}

/// Content of a piece.
#[derive(Debug, Default)]
pub(super) struct Piece {
    /// Values of `v`, `vt` and `vn`.
    pub(super) vertices: [Vec<[f64; 3]>; 3],
    pub(super) runs: Vec<Run>,
    /// `mtllib` statements: line and operand.
    pub(super) libraries: Vec<(u32, Name)>,
    pub(super) notes: Notes,
}

/// A statement of numbers.
struct VertexKind {
    keyword: &'static str,
    needed: usize,
    kept: usize,
}

const POSITION: usize = 0;
const TEXCOORD: usize = 1;
const NORMAL: usize = 2;

const KINDS: [VertexKind; 3] = [
    VertexKind { keyword: "v", needed: 3, kept: 3 },
    VertexKind { keyword: "vt", needed: 1, kept: 2 },
    VertexKind { keyword: "vn", needed: 3, kept: 3 },
];

/// Numbers of vertices and of lines.
pub(super) fn count(text: &[u8]) -> (Counts, u32) {
    let mut counts = Counts::default();
    let mut lines = Lines::new(text, 0);
    for (_, line) in lines.by_ref() {
        if let Some(keyword) = words(line).next()
            && let Some(kind) = KINDS.iter().position(|kind| kind.keyword.as_bytes() == keyword)
        {
            counts[kind] += 1;
        }
    }
    (counts, lines.number())
}

/// Reads a piece that starts at `line`. `counts`: vertices before the piece, in it, and in the whole file.
pub(super) fn read(file: &Path, text: &[u8], line: u32, counts: [Counts; 3]) -> Result<Piece, LoadError> {
    let [before, own, total] = counts;
    let piece = Piece {
        vertices: own.map(Vec::with_capacity),
        runs: vec![Run::default()],
        notes: Notes::of(file.display().to_string()),
        ..Piece::default()
    };
    let mut reader = Reader { indices: Indices { file, before, total }, piece };
    Lines::new(text, line).try_for_each(|(number, line)| reader.line(number, line))?;
    Ok(reader.piece)
}

struct Reader<'a> {
    indices: Indices<'a>,
    piece: Piece,
}

impl Reader<'_> {
    #[inline]
    fn line(&mut self, number: u32, line: &[u8]) -> Result<(), LoadError> {
        let mut operands = words(line);
        let Some(keyword) = operands.next() else { return Ok(()) };
        match keyword {
            b"v" => return self.vertex(number, POSITION, operands),
            b"vt" => return self.vertex(number, TEXCOORD, operands),
            b"vn" => return self.vertex(number, NORMAL, operands),
            b"f" | b"fo" => return self.face(number, operands),
            b"usemtl" => {
                let material = Some(operands.rest().into());
                let runs = &mut self.piece.runs;
                runs.pop_if(|run| run.arities.is_empty());
                if runs.last().is_none_or(|run| run.material != material) {
                    runs.push(Run { material, ..Run::default() });
                }
            }
            b"mtllib" => self.piece.libraries.push((number, operands.rest().into())),
            other => self.other(number, other),
        }
        Ok(())
    }

    /// Statements without a surface.
    #[cold]
    fn other(&mut self, number: u32, keyword: &[u8]) {
        let what = match keyword {
            b"o" | b"g" | b"s" | b"usemap" | b"maplib" | b"lod" | b"mg" | b"bevel" => return,
            b"l" | b"p" => "points and lines have no surface: left out",
            b"vp" | b"cstype" | b"deg" | b"bmat" | b"step" | b"curv" | b"curv2" | b"surf" | b"parm"
            | b"trim" | b"hole" | b"scrv" | b"sp" | b"end" | b"con" => {
                "curves and free-form surfaces are not supported: left out"
            }
            b"call" | b"csh" => "`call` and `csh` are not followed: left out",
            unknown => {
                let word: String = String::from_utf8_lossy(unknown).chars().take(24).collect();
                return self.piece.notes.at(number, format!("unknown statement `{word}` left out"));
            }
        };
        self.piece.notes.at(number, what);
    }

    /// `v x y z [w]` or `v x y z r g b`; `vt u [v [w]]`; `vn x y z`. Only curves have a use for w.
    #[inline]
    fn vertex(&mut self, line: u32, kind: usize, operands: Words) -> Result<(), LoadError> {
        let VertexKind { keyword, needed, kept } = KINDS[kind];
        let notes = &mut self.piece.notes;
        let mut values = [0.0; 3];
        let mut weight = 1.0;
        let mut count = 0;
        for word in operands {
            let Some(value) = parse_number(word) else {
                let word = String::from_utf8_lossy(word);
                let problem = format!("`{word}` in a `{keyword}` statement is not a number");
                return Err(LoadError::at(self.indices.file, line, problem, "write it like -1.25 or 3.1e-2"));
            };
            if count < kept {
                values[count] = value;
                if value.is_nan() {
                    notes.at(line, "number that is not finite: its faces are left out or lose their normals");
                }
            } else if count == 3 {
                weight = value;
            }
            count += 1;
        }
        if count < needed {
            let problem = format!("`{keyword}` needs {needed} numbers and has {count}");
            return Err(LoadError::at(
                self.indices.file,
                line,
                problem,
                "the file may have been cut off here",
            ));
        }
        match (kind, count) {
            (POSITION, 4) if weight != 1.0 => {
                notes.at(line, "weight of a `v` left out: only curves and free-form surfaces have weights");
            }
            (POSITION, 5..) => notes.at(line, "vertex colours are not supported: left out"),
            (NORMAL, _) if values == [0.0; 3] => {
                notes.at(line, "zero normal, its faces are shaded flat there");
            }
            _ => {}
        }
        self.indices.before[kind] += 1;
        self.piece.vertices[kind].push(values);
        Ok(())
    }

    /// `f v/vt/vn ...`
    #[inline]
    fn face(&mut self, line: u32, operands: Words) -> Result<(), LoadError> {
        let Piece { runs, notes, .. } = &mut self.piece;
        let Some(run) = runs.last_mut() else { return Ok(()) };
        let first = run.corners.len();
        for word in operands {
            run.corners.push(self.indices.corner(line, word)?);
        }
        let face = &mut run.corners[first..];
        if face.len() < 3 {
            notes.at(line, "face with fewer than three corners left out");
            run.corners.truncate(first);
            return Ok(());
        }
        let [without_uv, without_normal] =
            [TEXCOORD, NORMAL].map(|part| face.iter().filter(|corner| corner[part] == ABSENT).count());
        if (1..face.len()).contains(&without_uv) {
            notes.at(line, "face with a texture coordinate in only some corners, 0 0 in the others");
        }
        if (1..face.len()).contains(&without_normal) {
            notes.at(line, "face with a normal in only some corners is shaded flat");
            face.iter_mut().for_each(|corner| corner[NORMAL] = ABSENT);
        }
        run.arities.push(face.len() as u32);
        Ok(())
    }
}

/// Counts of vertices, which resolve indices.
struct Indices<'a> {
    file: &'a Path,
    /// Before the current line.
    before: Counts,
    total: Counts,
}

impl Indices<'_> {
    /// Indices from 0 of `v`, `v/vt`, `v//vn` or `v/vt/vn`; [`ABSENT`] for an absent part.
    #[inline]
    fn corner(&self, line: u32, word: &[u8]) -> Result<[u32; 3], LoadError> {
        let mut corner = [ABSENT; 3];
        for (part, text) in word.split(|&b| b == b'/').enumerate() {
            if text.is_empty() && (1..3).contains(&part) {
                continue;
            }
            let text = core::str::from_utf8(text).ok().filter(|_| part < 3);
            let index = match text.map(str::parse::<i64>) {
                Some(Ok(index)) => index,
                Some(Err(why)) if matches!(why.kind(), PosOverflow | NegOverflow) => i64::MAX,
                _ => return Err(self.bad_corner(line, word)),
            };
            let (before, total) = (self.before[part] as i64, self.total[part] as i64);
            let number = if index < 0 { before + index } else { index - 1 };
            if !(0..total).contains(&number) {
                return Err(self.out_of_range(line, word, part));
            }
            corner[part] = number as u32;
        }
        Ok(corner)
    }

    #[cold]
    fn bad_corner(&self, line: u32, word: &[u8]) -> LoadError {
        let problem = format!("`{}` is not a corner of a face", String::from_utf8_lossy(word));
        LoadError::at(self.file, line, problem, "write v, v/vt, v//vn or v/vt/vn, each an index")
    }

    #[cold]
    fn out_of_range(&self, line: u32, word: &[u8], part: usize) -> LoadError {
        const NAMES: [&str; 3] = ["vertex", "texture coordinate", "normal"];
        let problem = format!(
            "`{}` refers to a {} that does not exist: the file has {}, {} of them before this line",
            String::from_utf8_lossy(word),
            NAMES[part],
            self.total[part],
            self.before[part]
        );
        let help = "indices count from 1, negative ones back from the last; the file may have been cut off";
        LoadError::at(self.file, line, problem, help)
    }
}
