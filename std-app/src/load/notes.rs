//! Notes on repairs: one sentence for each kind, with its count and first line.

use std::borrow::Cow;
use std::collections::HashMap;

#[derive(Clone, Debug)]
struct Note {
    what: Cow<'static, str>,
    count: u64,
    /// File and line, or file, of the first case.
    first: Option<String>,
}

/// Notes in the order of their first appearance.
#[derive(Clone, Debug, Default)]
pub struct Notes {
    file: String,
    notes: Vec<Note>,
    /// Index of each kind in `notes`.
    numbers: HashMap<Cow<'static, str>, usize>,
}

impl Notes {
    /// An empty list; lines given to [`Notes::at`] belong to `file`.
    pub fn of(file: impl Into<String>) -> Self {
        Self { file: file.into(), ..Self::default() }
    }

    /// Adds a case of `what` at a line of the file, or 0.
    pub fn at(&mut self, line: u32, what: impl Into<Cow<'static, str>>) {
        let what = what.into();
        let is_known = self.numbers.get(&what).is_some_and(|number| self.notes[*number].first.is_some());
        let first = (!is_known).then(|| match line {
            0 => self.file.clone(),
            _ => format!("{}:{line}", self.file),
        });
        self.push(Note { what, count: 1, first });
    }

    /// Adds `count` cases of `what` without a line; none if `count` is 0.
    pub fn add(&mut self, count: u64, what: impl Into<Cow<'static, str>>) {
        if count > 0 {
            self.push(Note { what: what.into(), count, first: None });
        }
    }

    /// Appends all notes of `later`.
    pub fn merge(&mut self, later: Notes) {
        later.notes.into_iter().for_each(|note| self.push(note));
    }

    /// One sentence for each kind.
    pub fn sentences(&self) -> Vec<String> {
        let sentence = |Note { what, count, first }: &Note| match (count, first) {
            (1, None) => what.to_string(),
            (1, Some(first)) => format!("{what} ({first})"),
            (_, None) => format!("{what}, {count} times"),
            (_, Some(first)) => format!("{what}, {count} times (first: {first})"),
        };
        self.notes.iter().map(sentence).collect()
    }

    fn push(&mut self, note: Note) {
        match self.numbers.get(&note.what) {
            Some(&number) => {
                let known = &mut self.notes[number];
                known.count += note.count;
                known.first = known.first.take().or(note.first);
            }
            None => {
                self.numbers.insert(note.what.clone(), self.notes.len());
                self.notes.push(note);
            }
        }
    }
}
