//! Lookup of the files that statements name. Names come from other machines: with other folders, with
//! backslashes, in another case or encoding. The exact name is tried first, then each tail of the path from
//! the longest on, then both without regard to case and encoding if exactly one file matches.
//!
//! In Shift-JIS, Big5 and GBK the second byte of a character may be a backslash, so a name that is not UTF-8
//! has several spellings; the existing files decide.

use super::name::{folded, path, shown};
use encoding_rs::{BIG5, EUC_KR, Encoding, GB18030, SHIFT_JIS};
use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Longest name that is tried, in bytes.
const LONGEST_NAME: usize = 4096;
/// Parts of a path that are tried, from its end.
const MOST_PARTS: usize = 64;

/// Result of a lookup, with the index of the matching name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Found {
    /// A file of exactly this name.
    Exact(PathBuf, usize),
    /// A file of a similar name.
    Instead(PathBuf, usize),
    /// Several files match equally well.
    Ambiguous(Vec<PathBuf>),
    /// No file matches.
    Missing,
}

impl Found {
    /// The file, if there is exactly one.
    pub(super) fn file(&self) -> Option<&Path> {
        match self {
            Found::Exact(file, _) | Found::Instead(file, _) => Some(file),
            Found::Ambiguous(_) | Found::Missing => None,
        }
    }

    /// A note, unless the name is exact.
    pub(super) fn note(&self, what: &str, name: &[u8]) -> Option<String> {
        let name = shown(name);
        Some(match self {
            Found::Exact(..) => return None,
            Found::Instead(file, _) => {
                format!("{what} `{name}` does not exist: {} is used instead", file.display())
            }
            Found::Ambiguous(files) => {
                let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
                format!("{what} `{name}` is missing: {} match equally well", files.join(" and "))
            }
            Found::Missing => format!("{what} `{name}` is missing"),
        })
    }
}

/// Locates files and caches the listings of directories.
#[derive(Debug, Default)]
pub(super) struct Lookup {
    /// Entries of a directory by folded name.
    listings: HashMap<PathBuf, HashMap<String, Vec<OsString>>>,
    /// All located files.
    files: BTreeSet<PathBuf>,
}

impl Lookup {
    /// The file of one of `names` in one of `directories`; the likeliest come first in both.
    pub(super) fn locate(&mut self, names: &[&[u8]], directories: &[&Path]) -> Found {
        let found = self.search(names, directories);
        match &found {
            Found::Ambiguous(files) => self.files.extend(files.iter().cloned()),
            found => self.files.extend(found.file().map(Path::to_path_buf)),
        }
        found
    }

    /// All files located so far.
    pub(super) fn into_files(self) -> BTreeSet<PathBuf> {
        self.files
    }

    fn search(&mut self, names: &[&[u8]], directories: &[&Path]) -> Found {
        let names = || names.iter().enumerate().filter(|(_, name)| name.len() <= LONGEST_NAME);
        for (number, name) in names() {
            if let Some(file) = directories.iter().find_map(|directory| exact(directory, name)) {
                return Found::Exact(file, number);
            }
        }
        let spellings: Vec<(usize, Spelling)> =
            names().flat_map(|(number, name)| spellings(name).map(move |text| (number, text))).collect();
        for (number, spelling) in &spellings {
            let parts = spelling.parts();
            let first = usize::from(spelling.is_written);
            for tail in (first..parts.len()).map(|first| path(&parts[first..].join(&b'/'))) {
                let mut files = directories.iter().map(|directory| directory.join(&tail));
                if let Some(file) = files.find(|file| file.is_file()) {
                    return Found::Instead(file, *number);
                }
            }
        }
        for (number, spelling) in &spellings {
            let parts = spelling.parts();
            for first in 0..parts.len() {
                for directory in directories {
                    let mut files = self.any_case(directory, &parts[first..]);
                    match files.len() {
                        0 => {}
                        1 => return Found::Instead(files.remove(0), *number),
                        _ => return Found::Ambiguous(files),
                    }
                }
            }
        }
        Found::Missing
    }

    /// All files at `parts` in `directory` without regard to case, in the order of their names.
    fn any_case(&mut self, directory: &Path, parts: &[&[u8]]) -> Vec<PathBuf> {
        let mut paths = vec![directory.to_path_buf()];
        for part in parts {
            let mut next = Vec::new();
            for path in paths {
                if *part == b".." {
                    next.push(path.join(".."));
                } else if let Some(entries) = self.listing(&path).get(&folded(part)) {
                    next.extend(entries.iter().map(|entry| path.join(entry)));
                }
            }
            paths = next;
        }
        paths.retain(|file| file.is_file());
        paths
    }

    fn listing(&mut self, directory: &Path) -> &HashMap<String, Vec<OsString>> {
        self.listings.entry(directory.into()).or_insert_with(|| {
            let here = if directory.as_os_str().is_empty() { Path::new(".") } else { directory };
            let mut listing: HashMap<String, Vec<OsString>> = HashMap::new();
            for entry in std::fs::read_dir(here).into_iter().flatten().flatten() {
                let name = entry.file_name();
                listing.entry(folded(name.as_encoded_bytes())).or_default().push(name);
            }
            listing.values_mut().for_each(|names| names.sort());
            listing
        })
    }
}

/// The file of exactly this name, or of this name with slashes for backslashes.
fn exact(directory: &Path, name: &[u8]) -> Option<PathBuf> {
    let with_slashes = |characters: Characters| {
        let is_separator = |at: &usize| name[*at] == b'\\';
        let mut slashes = name.to_vec();
        characters.starts(name).filter(is_separator).for_each(|at| slashes[at] = b'/');
        slashes
    };
    let slashes = [Characters::Bytes, Characters::Pairs].map(with_slashes);
    let names = [name, &slashes[0], &slashes[1]];
    names.into_iter().map(|name| directory.join(path(name))).find(|file| file.is_file())
}

/// Bytes of a character.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Characters {
    /// One, or UTF-8, in which only a backslash has the byte of a backslash.
    Bytes,
    /// One of ASCII, else two: Shift-JIS, Big5, GBK.
    Pairs,
}

impl Characters {
    /// Indices at which characters of `name` begin.
    fn starts(self, name: &[u8]) -> impl Iterator<Item = usize> {
        let mut next = 0;
        (0..name.len()).filter(move |&at| {
            let is_start = at >= next;
            let is_pair = self == Self::Pairs && name[at] >= 0x81;
            next = if is_start { at + 1 + usize::from(is_pair) } else { next };
            is_start
        })
    }
}

/// A possible text of a name.
struct Spelling<'a> {
    text: Cow<'a, [u8]>,
    characters: Characters,
    /// The whole text was tried as a name already.
    is_written: bool,
}

/// Spellings of a name, the likeliest first; more than one if it is not UTF-8.
fn spellings(name: &[u8]) -> impl Iterator<Item = Spelling<'_>> {
    const ENCODINGS: [&Encoding; 4] = [SHIFT_JIS, GB18030, BIG5, EUC_KR];
    let written = |characters| Spelling { text: name.into(), characters, is_written: true };
    let is_foreign = core::str::from_utf8(name).is_err();
    let decoded = ENCODINGS.into_iter().filter(move |_| is_foreign).filter_map(|encoding| {
        let text = encoding.decode_without_bom_handling_and_without_replacement(name)?;
        let text = text.into_owned().into_bytes().into();
        Some(Spelling { text, characters: Characters::Bytes, is_written: false })
    });
    let pairs = is_foreign.then(|| written(Characters::Pairs));
    [written(Characters::Bytes)].into_iter().chain(pairs).chain(decoded)
}

impl Spelling<'_> {
    /// The last parts of a path of any system, without empty ones and `.`.
    fn parts(&self) -> Vec<&[u8]> {
        let text = &self.text[..];
        let is_separator = |at: &usize| matches!(text[*at], b'/' | b'\\' | b':');
        let mut parts = Vec::new();
        let mut begin = 0;
        for end in self.characters.starts(text).filter(is_separator).chain([text.len()]) {
            let part = &text[begin..end];
            if !part.is_empty() && part != b"." {
                parts.push(part);
            }
            begin = end + 1;
        }
        let first = parts.len().saturating_sub(MOST_PARTS);
        parts.split_off(first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// Runs `check` in a directory with these files.
    fn with_files(test: &str, files: &[&str], check: impl Fn(&Path)) {
        let directory = std::env::temp_dir().join(format!("halflight-files-{}-{test}", std::process::id()));
        for file in files {
            let file = directory.join(file);
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, "").unwrap();
        }
        check(&directory);
        let _ = fs::remove_dir_all(directory);
    }

    #[test]
    fn exact_name_then_tails_then_any_case() {
        with_files("order", &["a/tex/x.png", "a/x.png", "b/x.png", "b/Tex/Y.png"], |root| {
            let (a, b) = (root.join("a"), root.join("b"));
            let locate = |name: &str| Lookup::default().locate(&[name.as_bytes()], &[&a, &b]);
            assert_eq!(locate("x.png"), Found::Exact(a.join("x.png"), 0));
            assert_eq!(locate("tex\\x.png"), Found::Exact(a.join("tex/x.png"), 0));
            assert_eq!(locate("Tex/Y.png"), Found::Exact(b.join("Tex/Y.png"), 0));
            assert_eq!(locate("C:\\art\\tex\\x.png"), Found::Instead(a.join("tex/x.png"), 0));
            assert_eq!(locate("Disk:art:x.png"), Found::Instead(a.join("x.png"), 0));
            assert_eq!(locate("//server/art/TEX/X.PNG"), Found::Instead(a.join("tex/x.png"), 0));
            assert_eq!(locate("art/tex/y.PNG"), Found::Instead(b.join("Tex/Y.png"), 0));
            assert_eq!(locate("../a/X.png"), Found::Instead(a.join("../a/x.png"), 0));
            assert_eq!(locate("z.png"), Found::Missing);
            assert_eq!(locate(&"x/".repeat(10_000)), Found::Missing);
        });
    }

    #[test]
    fn ambiguous_names_are_not_guessed() {
        with_files("twice", &["wood.png", "Wood.png", "t/stone.png", "T/Stone.png", "T/only.png"], |root| {
            let locate = |name: &str| Lookup::default().locate(&[name.as_bytes()], &[root]);
            assert_eq!(locate("wood.png"), Found::Exact(root.join("wood.png"), 0));
            let both = [root.join("Wood.png"), root.join("wood.png")].to_vec();
            assert_eq!(locate("WOOD.png"), Found::Ambiguous(both));
            assert!(matches!(locate("T/STONE.png"), Found::Ambiguous(files) if files.len() == 2));
            assert_eq!(locate("t/Only.png"), Found::Instead(root.join("T/only.png"), 0));
        });
    }

    #[test]
    fn latin_1_names_match_utf_8_files() {
        with_files("latin", &["grün.png"], |root| {
            let found = Lookup::default().locate(&[b"gr\xfcn.png"], &[root]);
            assert_eq!(found, Found::Instead(root.join("grün.png"), 0));
        });
    }

    /// A directory, and a file in it, in Shift-JIS: the second byte of the second character of each is a
    /// backslash.
    const SHIFT_JIS_PATH: &[u8] = b"\x90\x94\x94\x5c\\\x8e\x91\x97\x5c.png";

    #[test]
    #[cfg(unix)]
    fn double_byte_names_match_files_of_the_same_bytes() {
        with_files("bytes", &["here"], |root| {
            let [_, folder, file] =
                [&b"x"[..], b"\x90\x94\x94\x5c", b"\x8e\x91\x97\x5c.png"].map(|part| root.join(path(part)));
            let file = folder.join(file.file_name().unwrap());
            fs::create_dir_all(&folder).unwrap();
            fs::write(&file, "").unwrap();
            let locate = |name: &[u8], folder: &Path| Lookup::default().locate(&[name], &[folder]);
            assert_eq!(locate(SHIFT_JIS_PATH, root), Found::Exact(file.clone(), 0));
            assert_eq!(locate(b"\x8e\x91\x97\x5c.png", &folder), Found::Exact(file.clone(), 0));
            let absolute = [b"C:\\art\\", SHIFT_JIS_PATH].concat();
            assert_eq!(locate(&absolute, root), Found::Instead(file.clone(), 0));
            assert_eq!(locate(&absolute, &folder), Found::Instead(file.clone(), 0));
            assert_eq!(locate(b"\x8e\x91\x97\x5d.png", &folder), Found::Missing);
        });
    }

    #[test]
    fn double_byte_names_match_utf_8_files() {
        let decoded = SHIFT_JIS.decode(SHIFT_JIS_PATH).0.replace('\\', "/");
        let big5 = BIG5.encode("\u{8a31}\u{529f}.png").0.into_owned();
        assert!(big5.contains(&b'\\'));
        let gbk = GB18030.encode("\u{8a31}.png").0.into_owned();
        let files = [&decoded[..], "\u{8a31}\u{529f}.png", "\u{8a31}.png"];
        with_files("decoded", &files, |root| {
            for (name, file) in [SHIFT_JIS_PATH, &big5, &gbk].into_iter().zip(files) {
                let found = Lookup::default().locate(&[name], &[root]);
                assert_eq!(found, Found::Instead(root.join(file), 0), "{name:x?}");
            }
        });
    }

    #[test]
    fn likelier_name_wins() {
        with_files("likelier", &["a b", "a"], |root| {
            let mut lookup = Lookup::default();
            assert_eq!(lookup.locate(&[b"a b", b"a"], &[root]), Found::Exact(root.join("a b"), 0));
            assert_eq!(lookup.locate(&[b"c", b"a"], &[root]), Found::Exact(root.join("a"), 1));
        });
    }
}
