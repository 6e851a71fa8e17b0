//! The material libraries of an OBJ file: which files they are, and which of their materials a `usemtl` means.
//! Libraries are searched in the order in which they are named, and materials in that of the file: the first counts.

use super::files::{Found, Lookup};
use super::mtl::{self, MtlMaterial};
use super::name::{Kind, Name, folded, readings};
use super::notes::Notes;
use super::surface;
use super::text::{is_blank, trimmed};
use super::{read, weight};
use crate::memory::Budget;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// More words of one `mtllib` are not tried.
const MOST_WORDS: usize = 256;
/// Unless it is all of the statement, a name of a library has at most this many words.
const LONGEST_NAME: usize = 8;

/// The materials of all libraries.
#[derive(Debug, Default)]
pub(super) struct Library {
    materials: Vec<MtlMaterial>,
    by_reading: HashMap<Name, Known>,
    by_folded: HashMap<String, Known>,
    files: Vec<PathBuf>,
}

/// The material that comes first under a name, and whether there are others.
#[derive(Clone, Copy, Debug)]
struct Known {
    kind: Kind,
    number: usize,
    others: bool,
}

impl Known {
    fn one(kind: Kind, number: usize) -> Self {
        Self { kind, number, others: false }
    }

    fn or(&mut self, later: Known) {
        self.others |= self.number != later.number;
        if later.kind < self.kind {
            (self.kind, self.number) = (later.kind, later.number);
        }
    }
}

impl Library {
    /// Reads the libraries of the OBJ file `obj`: those of its `mtllib` statements, and the one of its own name where
    /// they lack one of the materials `used`.
    pub(super) fn read(
        obj: &Path,
        statements: &[(u32, Name)],
        used: &[Name],
        (lookup, budget): (&mut Lookup, &Budget),
        notes: &mut Notes,
    ) -> Self {
        let directory = obj.parent().unwrap_or(Path::new(""));
        let mut library = Self::default();
        for (line, operand) in statements {
            let place = format!("({}:{line})", obj.display());
            for file in named_files(operand, directory, lookup, &place, notes) {
                library.add(&file, directory, (lookup, budget), notes);
            }
        }
        if used.iter().any(|name| library.find(name).is_none()) {
            let own = obj.with_extension("mtl");
            let name = own.file_name().unwrap_or_default().as_encoded_bytes();
            let found = lookup.find(&[name], &[directory]);
            if let Some(own) = found.file()
                && !library.files.iter().any(|file| file == own)
            {
                notes.add(1, format!("{} is read for materials that no library has", own.display()));
                library.add(own, directory, (lookup, budget), notes);
            }
        }
        library
    }

    /// The material that the operand of a `usemtl` means, under the name that both sides have, and whether that is
    /// beyond doubt.
    pub(super) fn find(&self, used: &Name) -> Option<(MtlMaterial, bool)> {
        self.shared(used).or_else(|| Some((self.alike(used)?, false)))
    }

    /// The material that shares the longest reading. Where both sides have to lose what may be a comment, it has to
    /// be the only one: `Material #3` is neither `Material #1` nor `Material #2`.
    fn shared(&self, used: &Name) -> Option<(MtlMaterial, bool)> {
        readings(used.bytes()).into_iter().find_map(|reading| {
            let name = Name::from(reading.name);
            let known = self.by_reading.get(&name)?;
            let is_doubtful = reading.kind == Kind::Cut && known.kind == Kind::Cut;
            let material = MtlMaterial { name, ..self.materials[known.number].clone() };
            (!(is_doubtful && known.others)).then_some((material, !is_doubtful))
        })
    }

    /// The only material whose name differs in nothing but case or encoding.
    fn alike(&self, used: &Name) -> Option<MtlMaterial> {
        let known = self.by_folded.get(&folded(trimmed(used.bytes()))).filter(|known| !known.others)?;
        let material = self.materials[known.number].clone();
        Some(MtlMaterial { name: material.name.trimmed(), ..material })
    }

    fn add(
        &mut self,
        file: &Path,
        beside: &Path,
        (lookup, budget): (&mut Lookup, &Budget),
        notes: &mut Notes,
    ) {
        if self.files.iter().any(|known| known == file) {
            return;
        }
        self.files.push(file.into());
        let shown = file.display();
        let bytes = match read(file, budget, weight::of_mtl) {
            Ok(bytes) => bytes,
            Err(error) => {
                return notes.add(1, format!("material library {shown} is left out: {}", error.problem));
            }
        };
        let mut mtl = mtl::parse(bytes, &shown.to_string());
        let directories = [file.parent().unwrap_or(Path::new("")), beside];
        for mut material in mtl.materials {
            for map in surface::maps_mut(&mut material) {
                map.locate(lookup, &directories, &mut mtl.notes);
            }
            if self.by_reading.get(&material.name).is_some_and(|known| known.kind == Kind::Whole) {
                let what = format!("material defined again in {shown}: the first of its name counts");
                mtl.notes.add(1, what);
            }
            let number = self.materials.len();
            for reading in readings(material.name.bytes()) {
                let known = Known::one(reading.kind, number);
                self.by_reading
                    .entry(reading.name.into())
                    .and_modify(|first| first.or(known))
                    .or_insert(known);
            }
            let known = Known::one(Kind::Whole, number);
            let folded = folded(trimmed(material.name.bytes()));
            self.by_folded.entry(folded).and_modify(|first| first.or(known)).or_insert(known);
            self.materials.push(material);
        }
        notes.merge(mtl.notes);
    }
}

/// The files of an `mtllib` statement: names with blanks or quotes, one or several.
fn named_files(
    operand: &Name,
    directory: &Path,
    lookup: &mut Lookup,
    place: &str,
    notes: &mut Notes,
) -> Vec<PathBuf> {
    let operand = operand.bytes();
    let begins = |&i: &usize| !is_blank(operand[i]) && (i == 0 || is_blank(operand[i - 1]));
    let mut words: Vec<usize> = (0..operand.len()).filter(begins).take(MOST_WORDS).collect();
    words.push(operand.len());
    let last = words.len() - 1;
    let mut files = Vec::new();
    let mut missing: Option<usize> = None;
    let mut first = 0;
    while first < last {
        let mut find = |end: usize| {
            let readings = readings(&operand[words[first]..words[end]]);
            let names: Vec<&[u8]> = readings.iter().map(|reading| reading.name).collect();
            (end, lookup.find(&names, &[directory]))
        };
        // The longest name that is there; else the shortest that is there under another name, for the tail of a
        // longer one may be that of the next library.
        let ends = || (first + 1..last.min(first + 1 + LONGEST_NAME)).chain([last]);
        let exact = ends().rev().map(&mut find).find(|(_, found)| matches!(found, Found::Exact(..)));
        let found = exact.or_else(|| ends().map(&mut find).find(|(_, found)| *found != Found::Missing));
        let Some((end, found)) = found else {
            missing.get_or_insert(first);
            first += 1;
            continue;
        };
        let name = &operand[words[first]..words[end]];
        let gap = missing.take().map(|gap| &operand[words[gap]..words[first]]);
        let gap = gap.and_then(|gap| Found::Missing.note("material library", trimmed(gap)));
        for note in gap.into_iter().chain(found.note("material library", trimmed(name))) {
            notes.add(1, format!("{note} {place}"));
        }
        files.extend(found.file().map(Path::to_path_buf));
        first = end;
    }
    let gap = missing.map(|gap| &operand[words[gap]..]);
    if let Some(note) = gap.and_then(|gap| Found::Missing.note("material library", trimmed(gap))) {
        notes.add(1, format!("{note} {place}"));
    }
    files
}
