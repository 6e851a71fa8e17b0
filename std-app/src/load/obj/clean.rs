//! The first stage: checks a piece of an OBJ file and rewrites it as plain ASCII for tobj. All numbers are
//! valid; faces have three or more corners, absolute indices in range, and the same parts in every corner.

use crate::load::error::LoadError;
use crate::load::name::Name;
use crate::load::notes::Notes;
use crate::load::text::{Lines, Words, parse_number, words};
use core::num::IntErrorKind::{NegOverflow, PosOverflow};
use std::path::Path;

/// Numbers of `v`, `vt` and `vn` statements.
pub(super) type Counts = [usize; 3];

/// Index of a texture coordinate or normal that a corner does not have.
const ABSENT: usize = 0;

/// Statements appended to the file: texture coordinate and normal of corners that lack them. A zero
/// normal means flat shading.
pub(super) const DEFAULTS: &[u8] = b"vt 0 0\nvn 0 0 0\n";

/// Faces between two `usemtl` statements.
#[derive(Debug, Default)]
pub(super) struct Run {
    /// `None` continues the material of the previous run.
    pub(super) material: Option<Name>,
    /// `f` statements.
    pub(super) faces: Vec<u8>,
    /// Faces by the object that they belong to.
    pub(super) sections: Vec<Section>,
}

/// Faces after an `o` or `g` statement.
#[derive(Debug, Default)]
pub(super) struct Section {
    /// `None` continues the section before.
    pub(super) start: Option<SectionStart>,
    /// Number of faces.
    pub(super) faces: usize,
}

/// Statement that begins a section.
#[derive(Debug)]
pub(super) enum SectionStart {
    /// `o`.
    Object(Name),
    /// `g`.
    Group(Name),
}

/// A clean piece.
#[derive(Debug, Default)]
pub(super) struct Piece {
    /// `v`, `vt` and `vn` statements.
    pub(super) vertices: Vec<u8>,
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

/// Cleans a piece that starts at `line`. `counts`: vertices before the piece, and in the whole file.
pub(super) fn clean(file: &Path, text: &[u8], line: u32, counts: [Counts; 2]) -> Result<Piece, LoadError> {
    let [before, total] = counts;
    let piece = Piece {
        runs: vec![Run::default()],
        notes: Notes::of(file.display().to_string()),
        ..Piece::default()
    };
    let mut cleaner = Cleaner { indices: Indices { file, before, total }, corners: Vec::new(), piece };
    Lines::new(text, line).try_for_each(|(number, line)| cleaner.line(number, line))?;
    Ok(cleaner.piece)
}

struct Cleaner<'a> {
    indices: Indices<'a>,
    /// Corners of the current face.
    corners: Vec<[usize; 3]>,
    piece: Piece,
}

impl Cleaner<'_> {
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
                let sections = runs.pop_if(|run| run.faces.is_empty()).unwrap_or_default().sections;
                match runs.last_mut() {
                    Some(run) if run.material == material => run.sections.extend(sections),
                    _ => runs.push(Run { material, sections, ..Run::default() }),
                }
            }
            b"o" => self.section(SectionStart::Object(operands.rest().into())),
            b"g" => self.section(SectionStart::Group(operands.rest().into())),
            b"mtllib" => self.piece.libraries.push((number, operands.rest().into())),
            other => self.other(number, other),
        }
        Ok(())
    }

    fn section(&mut self, start: SectionStart) {
        let section = Section { start: Some(start), faces: 0 };
        if let Some(run) = self.piece.runs.last_mut() {
            run.sections.push(section);
        }
    }

    /// Statements without a surface.
    #[cold]
    fn other(&mut self, number: u32, keyword: &[u8]) {
        let what = match keyword {
            b"s" | b"usemap" | b"maplib" | b"lod" | b"mg" | b"bevel" => return,
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
        let Piece { vertices, notes, .. } = &mut self.piece;
        let mut values = [0.0; 3];
        vertices.extend_from_slice(keyword.as_bytes());
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
                vertices.push(b' ');
                if value.is_nan() {
                    vertices.extend_from_slice(b"nan");
                    notes.at(line, "number that is not finite: its faces are left out or lose their normals");
                } else {
                    vertices.extend_from_slice(word);
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
        (count..kept).for_each(|_| vertices.extend_from_slice(b" 0"));
        vertices.push(b'\n');
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
        Ok(())
    }

    /// `f v/vt/vn ...`
    #[inline]
    fn face(&mut self, line: u32, operands: Words) -> Result<(), LoadError> {
        let Self { indices, corners, piece: Piece { runs, notes, .. } } = self;
        let Some(Run { faces, sections, .. }) = runs.last_mut() else { return Ok(()) };
        corners.clear();
        for word in operands {
            corners.push(indices.corner(line, word)?);
            if word.last() == Some(&b'/') {
                notes.at(line, "corner of a face without an index after its last slash");
            }
        }
        if corners.len() < 3 {
            notes.at(line, "face with fewer than three corners left out");
            return Ok(());
        }
        let [without_uv, without_normal] =
            [TEXCOORD, NORMAL].map(|part| corners.iter().filter(|corner| corner[part] == ABSENT).count());
        if (1..corners.len()).contains(&without_uv) {
            notes.at(line, "face with a texture coordinate in only some corners, 0 0 in the others");
        }
        if (1..corners.len()).contains(&without_normal) {
            notes.at(line, "face with a normal in only some corners is shaded flat");
            corners.iter_mut().for_each(|corner| corner[NORMAL] = ABSENT);
        }
        match sections.last_mut() {
            Some(section) => section.faces += 1,
            None => sections.push(Section { start: None, faces: 1 }),
        }
        faces.push(b'f');
        corners.iter().for_each(|corner| write_corner(faces, *corner, indices.total));
        faces.push(b'\n');
        Ok(())
    }
}

/// Writes `v`, `v/vt`, `v//vn` or `v/vt/vn`: the parts that the file has, [`DEFAULTS`] for absent ones.
#[inline]
fn write_corner(out: &mut Vec<u8>, corner: [usize; 3], total: Counts) {
    let or_default = |part: usize| if corner[part] == ABSENT { total[part] + 1 } else { corner[part] };
    write_index(out, b' ', corner[POSITION]);
    if total[TEXCOORD] > 0 {
        write_index(out, b'/', or_default(TEXCOORD));
    }
    if total[NORMAL] > 0 {
        if total[TEXCOORD] == 0 {
            out.push(b'/');
        }
        write_index(out, b'/', or_default(NORMAL));
    }
}

/// Writes a separator and a decimal number.
#[inline]
fn write_index(out: &mut Vec<u8>, separator: u8, mut index: usize) {
    let mut digits = [0; 20];
    let mut start = digits.len();
    loop {
        start -= 1;
        digits[start] = b'0' + (index % 10) as u8;
        index /= 10;
        if index == 0 {
            break;
        }
    }
    out.push(separator);
    out.extend_from_slice(&digits[start..]);
}

/// Counts of vertices, which resolve indices.
struct Indices<'a> {
    file: &'a Path,
    /// Before the current line.
    before: Counts,
    total: Counts,
}

impl Indices<'_> {
    /// Indices from 1 of `v`, `v/vt`, `v//vn` or `v/vt/vn`; [`ABSENT`] for an absent part.
    #[inline]
    fn corner(&self, line: u32, word: &[u8]) -> Result<[usize; 3], LoadError> {
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
            let number = if index < 0 { before + 1 + index } else { index };
            if !(1..=total).contains(&number) {
                return Err(self.out_of_range(line, word, part));
            }
            corner[part] = number as usize;
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
