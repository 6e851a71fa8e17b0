//! Names of materials and files: bytes of any encoding, shown as text in messages. A name may contain blanks,
//! quotes and `#`, so an operand has several readings; the existing names decide among them.

use core::fmt;
use std::borrow::Cow;
use std::path::PathBuf;

use super::text::{is_blank, trimmed};

/// Name of a material or file, in the bytes of the file that contains it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Name(Vec<u8>);

impl Name {
    /// The bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }

    /// The name without blanks at its ends.
    pub(super) fn trimmed(&self) -> Name {
        trimmed(&self.0).into()
    }
}

impl From<&[u8]> for Name {
    fn from(bytes: &[u8]) -> Self {
        Self(bytes.into())
    }
}

impl From<&str> for Name {
    fn from(text: &str) -> Self {
        text.as_bytes().into()
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&shown(&self.0))
    }
}

/// Path of these bytes; on systems whose paths are text, of the text that they show.
pub(super) fn path(bytes: &[u8]) -> PathBuf {
    #[cfg(unix)]
    let path: &std::ffi::OsStr = std::os::unix::ffi::OsStrExt::from_bytes(bytes);
    #[cfg(not(unix))]
    let path = &*shown(bytes);
    PathBuf::from(path)
}

/// Bytes as text for messages: UTF-8, or Latin-1 if they are not UTF-8.
pub(super) fn shown(bytes: &[u8]) -> Cow<'_, str> {
    match core::str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect::<String>().into(),
    }
}

/// Equal for names that differ only in case or encoding.
pub(super) fn folded(bytes: &[u8]) -> String {
    shown(bytes).to_lowercase()
}

/// Part of an operand that a reading leaves out, the likeliest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// Nothing.
    Whole,
    /// Blanks at the ends.
    Trimmed,
    /// Quotes around it.
    Unquoted,
    /// A possible comment.
    Cut,
}

/// A possible name in an operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reading<'a> {
    pub(super) name: &'a [u8],
    pub(super) kind: Kind,
}

/// Possible comments of a line that are tried.
const MOST_COMMENTS: usize = 16;

/// Readings of an operand, the likeliest first: the whole operand, then parts of it.
pub(super) fn readings(operand: &[u8]) -> Vec<Reading<'_>> {
    let mut readings: Vec<Reading> = Vec::with_capacity(3);
    let mut add = |name, kind| {
        if !trimmed(name).is_empty() && readings.iter().all(|known| known.name != name) {
            readings.push(Reading { name, kind });
        }
    };
    let whole = trimmed(operand);
    add(operand, Kind::Whole);
    add(whole, Kind::Trimmed);
    add(unquoted(whole), Kind::Unquoted);
    for head in without_comments(operand) {
        add(head, Kind::Cut);
        add(unquoted(head), Kind::Cut);
    }
    readings
}

/// The text before each ` #`, trimmed, the longest first.
pub(super) fn without_comments(operand: &[u8]) -> impl Iterator<Item = &[u8]> {
    let starts = (0..operand.len()).rev().filter(|&i| operand[i..].starts_with(b"#"));
    let starts = starts.filter(|&i| i == 0 || is_blank(operand[i - 1]));
    starts.take(MOST_COMMENTS).map(|i| trimmed(&operand[..i]))
}

/// The name without quotes around it.
pub(super) fn unquoted(name: &[u8]) -> &[u8] {
    match name {
        [b'"', inner @ .., b'"'] | [b'\'', inner @ .., b'\''] => inner,
        _ => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(operand: &str) -> Vec<String> {
        readings(operand.as_bytes()).iter().map(|reading| shown(reading.name).into_owned()).collect()
    }

    #[test]
    fn whole_operand_comes_before_its_parts() {
        assert_eq!(names("wood"), ["wood"]);
        assert_eq!(names(" wood "), [" wood ", "wood"]);
        assert_eq!(names("\"old wood\""), ["\"old wood\"", "old wood"]);
        assert_eq!(names("Map #5 # a"), ["Map #5 # a", "Map #5", "Map"]);
        assert_eq!(names("\"a\" # b"), ["\"a\" # b", "\"a\"", "a"]);
        assert_eq!(names("a#b"), ["a#b"]);
        assert_eq!(names("# a"), ["# a"]);
        assert!(names("  ").is_empty());
    }

    #[test]
    fn invalid_utf_8_is_shown_as_latin_1() {
        assert_eq!(Name::from(&b"m\xe4"[..]).to_string(), "mä");
        assert_eq!(Name::from("mä").to_string(), "mä");
        assert_eq!(folded(b"M\xc4\xd6"), folded("mäö".as_bytes()));
    }
}
