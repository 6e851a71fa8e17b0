//! The cleaning reader in front of tobj: checks a piece of an OBJ file line by line and rewrites it as plain
//! ASCII in which nothing is left to interpretation: numbers that are numbers, three or more corners a face,
//! absolute indices that are in range, and `v/vt/vn` in every corner of a file that has them.
//!
//! Pieces are cleaned in parallel. A piece has to know how many vertices stand before it, for negative
//! indices, hence two passes: [`survey`] counts, [`clean`] rewrites.

use crate::load::error::LoadError;
use crate::load::name::Name;
use crate::load::notes::Notes;
use crate::load::text::{Lines, Numeral, Words, is_zero, number, numeral, words};
use std::path::Path;

/// Numbers of `v`, `vt` and `vn` statements.
pub(super) type Counts = [usize; 3];

/// A run of whole lines.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece<'a> {
    pub(super) text: &'a [u8],
    pub(super) first_line: u32,
}

/// What [`survey`] found.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Survey {
    pub(super) counts: Counts,
    pub(super) lines: u32,
}

/// A piece that tobj can read.
#[derive(Debug, Default)]
pub(super) struct Cleaned {
    /// `v`, `vt` and `vn` lines.
    pub(super) vertices: Vec<u8>,
    /// `f` lines.
    pub(super) faces: Vec<u8>,
    /// `usemtl` statements: where in `faces`, and the name.
    pub(super) materials: Vec<(usize, Name)>,
    /// `mtllib` statements: line and operand.
    pub(super) libraries: Vec<(u32, Name)>,
    pub(super) notes: Notes,
}

/// Counts lines and vertices.
pub(super) fn survey(text: &[u8]) -> Survey {
    let mut survey = Survey::default();
    let mut lines = Lines::new(text, 0);
    for (_, line) in lines.by_ref() {
        match words(line).next() {
            Some(b"v") => survey.counts[0] += 1,
            Some(b"vt") => survey.counts[1] += 1,
            Some(b"vn") => survey.counts[2] += 1,
            _ => {}
        }
    }
    survey.lines = lines.number();
    survey
}

/// Cleans a piece; `before` counts the vertices of the pieces before it, `total` those of the whole file.
/// Index `total + 1` is the stand-in for a texture coordinate or normal that a corner does not have.
pub(super) fn clean(file: &Path, piece: Piece, before: Counts, total: Counts) -> Result<Cleaned, LoadError> {
    let out = Cleaned { notes: Notes::of(file.display().to_string()), ..Cleaned::default() };
    let mut cleaner = Cleaner { file, seen: before, total, corners: Vec::new(), out };
    for (number, line) in Lines::new(piece.text, piece.first_line) {
        cleaner.line(number, line)?;
    }
    Ok(cleaner.out)
}

struct Cleaner<'a> {
    file: &'a Path,
    seen: Counts,
    total: Counts,
    corners: Vec<[usize; 3]>,
    out: Cleaned,
}

impl Cleaner<'_> {
    #[inline]
    fn line(&mut self, number: u32, line: &[u8]) -> Result<(), LoadError> {
        let mut operands = words(line);
        let Some(keyword) = operands.next() else { return Ok(()) };
        match keyword {
            b"v" => self.vertex(number, 0, operands),
            b"vt" => self.vertex(number, 1, operands),
            b"vn" => self.vertex(number, 2, operands),
            b"f" | b"fo" => self.face(number, operands),
            b"usemtl" => {
                self.out.materials.push((self.out.faces.len(), operands.rest().into()));
                Ok(())
            }
            b"mtllib" => {
                self.out.libraries.push((number, operands.rest().into()));
                Ok(())
            }
            other => {
                self.other(number, other);
                Ok(())
            }
        }
    }

    /// Statements that have no surface in them.
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
                let mut word = String::from_utf8_lossy(unknown).into_owned();
                word.truncate(word.char_indices().nth(24).map_or(word.len(), |(end, _)| end));
                return self.out.notes.at(number, format!("unknown statement `{word}` left out"));
            }
        };
        self.out.notes.at(number, what);
    }

    /// `kind` 0: `v x y z [w]` or `v x y z r g b`; 1: `vt u [v [w]]`; 2: `vn x y z`. Polygons have no use for w.
    #[inline]
    fn vertex(&mut self, line: u32, kind: usize, operands: Words) -> Result<(), LoadError> {
        const KEYWORDS: [&str; 3] = ["v", "vt", "vn"];
        const NEEDED: [usize; 3] = [3, 1, 3];
        const KEPT: [usize; 3] = [3, 2, 3];
        let mut weight = None;
        self.seen[kind] += 1;
        let mut numbers: [&[u8]; 3] = [b"0"; 3];
        let mut found = 0;
        for word in operands {
            match numeral(word) {
                Numeral::Finite => {}
                Numeral::NotFinite if found < KEPT[kind] => {
                    self.out
                        .notes
                        .at(line, "number that is not finite, its faces are left out or lose their normals");
                    numbers[found] = b"nan";
                    found += 1;
                    continue;
                }
                Numeral::NotFinite => {}
                Numeral::Malformed => {
                    let word = String::from_utf8_lossy(word);
                    let problem = format!("`{word}` in a `{}` statement is not a number", KEYWORDS[kind]);
                    return Err(LoadError::at(self.file, line, problem, "write it like -1.25 or 3.1e-2"));
                }
            }
            if found < KEPT[kind] {
                numbers[found] = word;
            } else if found == 3 {
                weight = number(word);
            }
            found += 1;
        }
        if found < NEEDED[kind] {
            let problem = format!("`{}` needs {} numbers and has {found}", KEYWORDS[kind], NEEDED[kind]);
            return Err(LoadError::at(self.file, line, problem, "the file may have been cut off here"));
        }
        match (kind, found) {
            (0, 4) if weight != Some(1.0) => {
                self.out
                    .notes
                    .at(line, "weight of a `v` left out: only curves and free-form surfaces have weights");
            }
            (0, 5..) => self.out.notes.at(line, "vertex colours are not supported: left out"),
            _ => {}
        }
        let out = &mut self.out.vertices;
        out.extend_from_slice(KEYWORDS[kind].as_bytes());
        if kind == 2 && numbers[..3].iter().all(|number| is_zero(number)) {
            self.out.notes.at(line, "zero normal, its faces are shaded flat there");
        }
        for number in &numbers[..KEPT[kind]] {
            out.push(b' ');
            out.extend_from_slice(number);
        }
        out.push(b'\n');
        Ok(())
    }

    /// `f v/vt/vn ...`
    #[inline]
    fn face(&mut self, line: u32, operands: Words) -> Result<(), LoadError> {
        self.corners.clear();
        for word in operands {
            let corner = self.corner(line, word)?;
            self.corners.push(corner);
        }
        if self.corners.len() < 3 {
            self.out.notes.at(line, "face with fewer than three corners left out");
            return Ok(());
        }
        self.complete(line);
        let out = &mut self.out.faces;
        out.push(b'f');
        for corner in &self.corners {
            write_index(out, b' ', corner[0]);
            match (self.total[1] > 0, self.total[2] > 0) {
                (true, _) => write_index(out, b'/', corner[1]),
                (false, true) => out.push(b'/'),
                (false, false) => {}
            }
            if self.total[2] > 0 {
                write_index(out, b'/', corner[2]);
            }
        }
        out.push(b'\n');
        Ok(())
    }

    /// Gives stand-ins to corners without texture coordinate or normal (index 0 so far).
    #[inline]
    fn complete(&mut self, line: u32) {
        let missing = |corners: &[[usize; 3]], part: usize| corners.iter().filter(|c| c[part] == 0).count();
        let corners = self.corners.len();
        let without_uv = missing(&self.corners, 1);
        if without_uv > 0 {
            if without_uv < corners {
                self.out
                    .notes
                    .at(line, "face with a texture coordinate in only some corners, 0 0 in the others");
            }
            self.corners.iter_mut().filter(|c| c[1] == 0).for_each(|c| c[1] = self.total[1] + 1);
        }
        let without_normal = missing(&self.corners, 2);
        if without_normal > 0 {
            if without_normal < corners {
                self.out.notes.at(line, "face with a normal in only some corners is shaded flat");
            }
            self.corners.iter_mut().for_each(|c| c[2] = self.total[2] + 1);
        }
    }

    /// Absolute indices from 1 of `v`, `v/vt`, `v//vn` or `v/vt/vn`; 0 where a part is absent.
    #[inline]
    fn corner(&self, line: u32, word: &[u8]) -> Result<[usize; 3], LoadError> {
        let mut corner = [0; 3];
        let mut part = 0;
        let mut at = 0;
        loop {
            let start = at;
            let negative = word.get(at) == Some(&b'-');
            at += usize::from(negative || word.get(at) == Some(&b'+'));
            let digits = at;
            let mut value = 0usize;
            while let Some(digit @ b'0'..=b'9') = word.get(at) {
                value = value.saturating_mul(10).saturating_add(usize::from(digit - b'0'));
                at += 1;
            }
            if at > digits {
                let limit = if negative { self.seen[part] } else { self.total[part] };
                if value == 0 || value > limit {
                    return Err(self.out_of_range(line, word, part));
                }
                corner[part] = if negative { self.seen[part] + 1 - value } else { value };
            } else if at > start || part == 0 {
                return Err(self.bad_corner(line, word));
            }
            match word.get(at) {
                None => return Ok(corner),
                Some(b'/') if part < 2 => part += 1,
                Some(_) => return Err(self.bad_corner(line, word)),
            }
            at += 1;
        }
    }

    #[cold]
    fn bad_corner(&self, line: u32, word: &[u8]) -> LoadError {
        let word = String::from_utf8_lossy(word);
        let problem = format!("`{word}` is not a corner of a face");
        LoadError::at(self.file, line, problem, "write v, v/vt, v//vn or v/vt/vn, each an index")
    }

    #[cold]
    fn out_of_range(&self, line: u32, word: &[u8], part: usize) -> LoadError {
        const NAMES: [&str; 3] = ["vertex", "texture coordinate", "normal"];
        let word = String::from_utf8_lossy(word);
        let problem = format!(
            "`{word}` refers to a {} that is not there: the file has {}, {} of them before this line",
            NAMES[part], self.total[part], self.seen[part]
        );
        let help = "indices count from 1, negative ones back from the last; the file may have been cut off";
        LoadError::at(self.file, line, problem, help)
    }
}

#[inline]
fn write_index(out: &mut Vec<u8>, before: u8, mut index: usize) {
    let mut digits = [0; 21];
    let mut start = digits.len();
    loop {
        start -= 1;
        digits[start] = b'0' + (index % 10) as u8;
        index /= 10;
        if index == 0 {
            break;
        }
    }
    start -= 1;
    digits[start] = before;
    out.extend_from_slice(&digits[start..]);
}
