//! Objects of the faces of an OBJ file: named by `o`, or by `g` in a file without `o`.

use super::clean::{self, Piece, SectionStart};
use crate::load::name::Name;
use std::collections::HashMap;

/// Consecutive triangles of one object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::load) struct ObjectRun {
    /// Index of the first of its group.
    pub(in crate::load) first: usize,
    /// Index into [`super::Obj::objects`]; `None` before the first statement.
    pub(in crate::load) object: Option<usize>,
}

/// Adds a run, unless the last is of the same object.
pub(super) fn push(runs: &mut Vec<ObjectRun>, run: ObjectRun) {
    if runs.last().is_none_or(|last| last.object != run.object) {
        runs.push(run);
    }
}

/// Consecutive faces of one object.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section {
    /// Index into [`super::Obj::objects`].
    pub(super) object: Option<usize>,
    /// Number of faces.
    pub(super) faces: usize,
}

/// Objects of a file, collected in the order of its faces.
pub(super) struct Objects<'a> {
    /// True if `o` names objects, false if `g` does.
    by_object: bool,
    current: Option<&'a Name>,
    numbers: HashMap<&'a Name, usize>,
    names: Vec<Name>,
}

impl<'a> Objects<'a> {
    pub(super) fn of(pieces: &[Piece]) -> Self {
        let mut sections = pieces.iter().flat_map(|piece| &piece.runs).flat_map(|run| &run.sections);
        let by_object = sections.any(|section| matches!(section.start, Some(SectionStart::Object(_))));
        Self { by_object, current: None, numbers: HashMap::new(), names: Vec::new() }
    }

    /// Sections of the next run of a file.
    pub(super) fn sections(&mut self, of_run: &'a [clean::Section]) -> Vec<Section> {
        let mut sections: Vec<Section> = Vec::new();
        for section in of_run {
            match (&section.start, self.by_object) {
                (Some(SectionStart::Object(name)), true) | (Some(SectionStart::Group(name)), false) => {
                    self.current = Some(name).filter(|name| !name.bytes().trim_ascii().is_empty());
                }
                _ => {}
            }
            if section.faces == 0 {
                continue;
            }
            let object = self.current.map(|name| self.number(name));
            match sections.last_mut() {
                Some(last) if last.object == object => last.faces += section.faces,
                _ => sections.push(Section { object, faces: section.faces }),
            }
        }
        sections
    }

    fn number(&mut self, name: &'a Name) -> usize {
        *self.numbers.entry(name).or_insert_with(|| {
            self.names.push(name.trimmed());
            self.names.len() - 1
        })
    }

    pub(super) fn into_names(self) -> Vec<Name> {
        self.names
    }
}

/// Sections that are taken face by face.
pub(super) struct Sections {
    later: std::vec::IntoIter<Section>,
    current: Section,
}

impl Sections {
    pub(super) fn new(sections: Vec<Section>) -> Self {
        Self { later: sections.into_iter(), current: Section { object: None, faces: 0 } }
    }

    /// At most `faces` faces of one object, at least one.
    pub(super) fn take(&mut self, faces: usize) -> Section {
        while self.current.faces == 0 {
            // Faces that no section counts have no object.
            self.current = self.later.next().unwrap_or(Section { object: None, faces });
        }
        let faces = faces.min(self.current.faces);
        self.current.faces -= faces;
        Section { faces, ..self.current }
    }
}

#[cfg(test)]
mod tests {
    use crate::load::obj::{Obj, parse};
    use std::path::Path;

    fn objects(text: &str) -> Vec<(Option<String>, usize)> {
        let obj: Obj = parse(text.as_bytes().to_vec(), Path::new("a.obj")).unwrap();
        let mut counts = Vec::new();
        for group in &obj.groups {
            for (number, run) in group.objects.iter().enumerate() {
                let end = group.objects.get(number + 1).map_or(group.triangles.len(), |next| next.first);
                counts.push((run.object.map(|object| obj.objects[object].to_string()), end - run.first));
            }
        }
        counts
    }

    const QUAD: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn faces_have_the_object_of_the_last_statement() {
        let text = format!(
            "{QUAD}f 1 2 3\no a b \ng x\nf 1 2 3 4\nusemtl m\nf 1 2 3\ng y\nf 2 3 4\no c\nusemtl n\nf 1 2 3\n"
        );
        let name = |name: &str| Some(name.to_string());
        assert_eq!(objects(&text), [(None, 1), (name("a b"), 2), (name("a b"), 2), (name("c"), 1)]);
    }

    #[test]
    fn groups_are_objects_of_files_without_objects() {
        let text =
            format!("{QUAD}g left\nf 1 2 3\ng right\nf 1 2 3 4\nf 2 3 4\ng\nf 1 2 3\ng left\nf 1 2 3\n");
        let name = |name: &str| Some(name.to_string());
        assert_eq!(objects(&text), [(name("left"), 1), (name("right"), 3), (None, 1), (name("left"), 1)]);
    }

    #[test]
    fn large_files_keep_the_objects_of_all_faces() {
        let mut text = String::from(QUAD);
        for object in 0..300 {
            text += &format!("o object {object}\nusemtl {}\n", object % 7);
            text += &"f 1 2 3 4 \nf 1 2 3                             \n".repeat(100 + object);
        }
        assert!(text.len() > 3 << 20);
        let mut counts = vec![0; 300];
        for (name, count) in objects(&text) {
            counts[name.unwrap()["object ".len()..].parse::<usize>().unwrap()] += count;
        }
        assert!((0..).zip(counts).all(|(object, count)| count == 3 * (100 + object)));
    }
}
