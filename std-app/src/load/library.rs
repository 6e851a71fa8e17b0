//! Material libraries of an OBJ file: lookup of their files, and of the material of a `usemtl`. Libraries are
//! searched in the order of their statements, materials in the order of the file; the first match is used.

use super::files::{Found, Lookup};
use super::mtl::{self, MtlMaterial};
use super::name::{Kind, Name, folded, readings};
use super::notes::Notes;
use super::text::{trimmed, word_starts};
use super::{memory_estimate, read};
use crate::memory::Budget;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Words of an `mtllib` statement that are tried.
const MOST_WORDS: usize = 256;
/// Words of a library name, unless it is the whole statement.
const LONGEST_NAME: usize = 8;

/// Materials of all libraries.
#[derive(Debug, Default)]
pub(super) struct Library {
    materials: Vec<MtlMaterial>,
    by_reading: HashMap<Name, Known>,
    by_folded: HashMap<String, Known>,
    files: Vec<PathBuf>,
}

/// The first material of a name.
#[derive(Clone, Copy, Debug)]
struct Known {
    kind: Kind,
    number: usize,
    /// Other materials have this name too.
    is_shared: bool,
}

impl Known {
    fn merge(&mut self, later: Known) {
        self.is_shared |= self.number != later.number;
        if later.kind < self.kind {
            (self.kind, self.number) = (later.kind, later.number);
        }
    }
}

/// Everything that reading a library needs besides its file.
pub(super) struct Sources<'a> {
    pub(super) lookup: &'a mut Lookup,
    pub(super) budget: &'a Budget,
    pub(super) notes: &'a mut Notes,
}

impl Library {
    /// Reads the libraries of the OBJ file `obj`: those of its `mtllib` statements, and the one of its own
    /// name if they lack one of the `used` materials.
    pub(super) fn read(obj: &Path, statements: &[(u32, Name)], used: &[Name], mut sources: Sources) -> Self {
        let directory = obj.parent().unwrap_or(Path::new(""));
        let mut library = Self::default();
        for (line, operand) in statements {
            let position = format!("({}:{line})", obj.display());
            for file in named_files(operand.bytes(), directory, &position, &mut sources) {
                library.add(&file, directory, &mut sources);
            }
        }
        if used.iter().any(|name| library.material(name).is_none()) {
            let own = obj.with_extension("mtl");
            let name = own.file_name().unwrap_or_default().as_encoded_bytes();
            let found = sources.lookup.locate(&[name], &[directory]);
            if let Some(own) = found.file().filter(|own| !library.files.iter().any(|file| file == own)) {
                let note = format!("{} is read for materials that no library has", own.display());
                sources.notes.add(1, note);
                library.add(own, directory, &mut sources);
            }
        }
        library
    }

    /// The material of the operand of a `usemtl`, under the name that both have, and whether it is certain.
    pub(super) fn material(&self, used: &Name) -> Option<(MtlMaterial, bool)> {
        self.by_common_reading(used).or_else(|| Some((self.by_any_case(used)?, false)))
    }

    /// The material with the longest common reading. If both names lose a possible comment, it must be the
    /// only one: `Material #3` is neither `Material #1` nor `Material #2`.
    fn by_common_reading(&self, used: &Name) -> Option<(MtlMaterial, bool)> {
        readings(used.bytes()).into_iter().find_map(|reading| {
            let name = Name::from(reading.name);
            let known = self.by_reading.get(&name)?;
            let is_doubtful = reading.kind == Kind::Cut && known.kind == Kind::Cut;
            let material = MtlMaterial { name, ..self.materials[known.number].clone() };
            (!(is_doubtful && known.is_shared)).then_some((material, !is_doubtful))
        })
    }

    /// The only material whose name differs in nothing but case or encoding.
    fn by_any_case(&self, used: &Name) -> Option<MtlMaterial> {
        let known = self.by_folded.get(&folded(trimmed(used.bytes()))).filter(|known| !known.is_shared)?;
        let material = self.materials[known.number].clone();
        Some(MtlMaterial { name: material.name.trimmed(), ..material })
    }

    /// Reads a library; maps are relative to it, then to the folder `obj_folder`.
    fn add(&mut self, file: &Path, obj_folder: &Path, sources: &mut Sources) {
        if self.files.iter().any(|known| known == file) {
            return;
        }
        self.files.push(file.into());
        let shown = file.display();
        let bytes = match read(file, sources.budget, memory_estimate::of_mtl) {
            Ok(bytes) => bytes,
            Err(error) => {
                let note = format!("material library {shown} is left out: {}", error.problem);
                return sources.notes.add(1, note);
            }
        };
        let mut mtl = mtl::parse(bytes, &shown.to_string());
        let directories = [file.parent().unwrap_or(Path::new("")), obj_folder];
        for mut material in mtl.materials {
            for map in material.maps.values_mut() {
                map.locate(sources.lookup, &directories, &mut mtl.notes);
            }
            if self.by_reading.get(&material.name).is_some_and(|known| known.kind == Kind::Whole) {
                mtl.notes.add(1, format!("material defined again in {shown}: the first of its name counts"));
            }
            let number = self.materials.len();
            let known = |kind| Known { kind, number, is_shared: false };
            for reading in readings(material.name.bytes()) {
                let known = known(reading.kind);
                let entry = self.by_reading.entry(reading.name.into());
                entry.and_modify(|first| first.merge(known)).or_insert(known);
            }
            let known = known(Kind::Whole);
            let entry = self.by_folded.entry(folded(trimmed(material.name.bytes())));
            entry.and_modify(|first| first.merge(known)).or_insert(known);
            self.materials.push(material);
        }
        sources.notes.merge(mtl.notes);
    }
}

/// Files of an `mtllib` statement: one or several, names with blanks or quotes.
fn named_files(operand: &[u8], directory: &Path, position: &str, sources: &mut Sources) -> Vec<PathBuf> {
    const WHAT: &str = "material library";
    let mut words: Vec<usize> = word_starts(operand).take(MOST_WORDS).collect();
    words.push(operand.len());
    let last = words.len() - 1;
    let text = |first: usize, end: usize| trimmed(&operand[words[first]..words[end]]);
    let mut files = Vec::new();
    let mut missing: Option<usize> = None;
    let mut first = 0;
    while first < last {
        let mut locate = |end: usize| {
            let readings = readings(&operand[words[first]..words[end]]);
            let names: Vec<&[u8]> = readings.iter().map(|reading| reading.name).collect();
            (end, sources.lookup.locate(&names, &[directory]))
        };
        // The longest exact name; else the shortest similar one, because the tail of a longer one may belong
        // to the next library.
        let ends = || (first + 1..last.min(first + 1 + LONGEST_NAME)).chain([last]);
        let exact = ends().rev().map(&mut locate).find(|(_, found)| matches!(found, Found::Exact(..)));
        let found = exact.or_else(|| ends().map(&mut locate).find(|(_, found)| *found != Found::Missing));
        let Some((end, found)) = found else {
            missing.get_or_insert(first);
            first += 1;
            continue;
        };
        let gap = missing.take().and_then(|gap| Found::Missing.note(WHAT, text(gap, first)));
        for note in gap.into_iter().chain(found.note(WHAT, text(first, end))) {
            sources.notes.add(1, format!("{note} {position}"));
        }
        files.extend(found.file().map(Path::to_path_buf));
        first = end;
    }
    if let Some(note) = missing.and_then(|gap| Found::Missing.note(WHAT, text(gap, last))) {
        sources.notes.add(1, format!("{note} {position}"));
    }
    files
}
