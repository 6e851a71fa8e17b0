//! What was repaired or left out on the way in: said once for each kind, with a count and the first place.

use core::fmt::Write;
use std::borrow::Cow;
use std::collections::HashMap;

/// Where a thing was first met: a file and a line of it, 0 where there is none.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Place {
    file: String,
    line: u32,
}

#[derive(Clone, Debug)]
struct Note {
    what: Cow<'static, str>,
    count: u64,
    first: Option<Place>,
}

/// A list of notes in the order of their first appearance.
#[derive(Clone, Debug, Default)]
pub struct Notes {
    file: String,
    notes: Vec<Note>,
    /// Where in `notes` each kind is.
    places: HashMap<Cow<'static, str>, usize>,
}

impl Notes {
    /// An empty list; lines given to [`Notes::at`] are those of `file`.
    pub fn of(file: impl Into<String>) -> Self {
        Self { file: file.into(), ..Self::default() }
    }

    /// One more of `what`, at `line` of the file.
    pub fn at(&mut self, line: u32, what: impl Into<Cow<'static, str>>) {
        let first = Place { file: self.file.clone(), line };
        self.push(Note { what: what.into(), count: 1, first: Some(first) });
    }

    /// `count` more of `what`, wherever they are; nothing where `count` is 0.
    pub fn add(&mut self, count: u64, what: impl Into<Cow<'static, str>>) {
        if count > 0 {
            self.push(Note { what: what.into(), count, first: None });
        }
    }

    /// Everything of `later`, after what is here.
    pub fn merge(&mut self, later: Notes) {
        later.notes.into_iter().for_each(|note| self.push(note));
    }

    /// One sentence for each kind.
    pub fn sentences(&self) -> Vec<String> {
        self.notes.iter().map(Note::sentence).collect()
    }

    fn push(&mut self, note: Note) {
        match self.places.get(&note.what).and_then(|place| self.notes.get_mut(*place)) {
            Some(known) => {
                known.count += note.count;
                known.first = known.first.take().or(note.first);
            }
            None => {
                self.places.insert(note.what.clone(), self.notes.len());
                self.notes.push(note);
            }
        }
    }
}

impl Note {
    fn sentence(&self) -> String {
        let mut sentence = self.what.to_string();
        if self.count > 1 {
            let _ = write!(sentence, ", {} times", self.count);
        }
        if let Some(Place { file, line }) = &self.first {
            let first = if self.count > 1 { "first: " } else { "" };
            let _ = match line {
                0 => write!(sentence, " ({first}{file})"),
                _ => write!(sentence, " ({first}{file}:{line})"),
            };
        }
        sentence
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_is_said_once_with_its_count_and_first_place() {
        let mut notes = Notes::of("a.obj");
        notes.at(7, "face with two corners left out");
        let mut later = Notes::of("a.obj");
        later.at(9, "face with two corners left out");
        later.add(3, "zero normal");
        later.add(0, "nothing");
        notes.merge(later);
        let expected = ["face with two corners left out, 2 times (first: a.obj:7)", "zero normal, 3 times"];
        assert_eq!(notes.sentences(), expected);
    }
}
