//! The one lookup of files that statements name. Names come from other machines: with folders of theirs, with
//! backslashes, in another case or encoding. The exact name comes first, then each tail of the path, the longest
//! first, then the same without regard to case and encoding, where just one file fits.

use super::name::{folded, path, shown};
use std::collections::{BTreeSet, HashMap};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Longer names are those of no file.
const LONGEST_NAME: usize = 4096;
/// Parts of a path from its end that are tried.
const MOST_PARTS: usize = 64;

/// The file that one of several names means.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Found {
    /// Under exactly the name with this number.
    Exact(PathBuf, usize),
    /// Under another name than that with this number.
    Instead(PathBuf, usize),
    /// Several files fit equally well.
    Ambiguous(Vec<PathBuf>),
    /// No file fits.
    Missing,
}

impl Found {
    /// The file.
    pub(super) fn file(&self) -> Option<&Path> {
        match self {
            Found::Exact(file, _) | Found::Instead(file, _) => Some(file),
            Found::Ambiguous(_) | Found::Missing => None,
        }
    }

    /// A note for people unless the file has exactly this name.
    pub(super) fn note(&self, what: &str, name: &[u8]) -> Option<String> {
        let name = shown(name);
        match self {
            Found::Exact(..) => None,
            Found::Instead(file, _) => {
                Some(format!("{what} `{name}` is not there under this name, {} is taken", file.display()))
            }
            Found::Ambiguous(files) => {
                let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
                Some(format!("{what} `{name}` is missing, and {} fit equally well", files.join(" and ")))
            }
            Found::Missing => Some(format!("{what} `{name}` is missing")),
        }
    }
}

/// Looks for files, and remembers the directories that it had to read.
#[derive(Debug, Default)]
pub(super) struct Lookup {
    /// Entries of a directory by their folded names.
    listings: HashMap<PathBuf, HashMap<String, Vec<OsString>>>,
    /// All that was found, whatever became of it.
    files: BTreeSet<PathBuf>,
}

impl Lookup {
    /// The file that one of `names`, the likeliest first, means in one of `directories`, the likeliest first.
    pub(super) fn find(&mut self, names: &[&[u8]], directories: &[&Path]) -> Found {
        let found = self.search(names, directories);
        match &found {
            Found::Ambiguous(files) => self.files.extend(files.iter().cloned()),
            found => self.files.extend(found.file().map(Path::to_path_buf)),
        }
        found
    }

    /// All files that were found so far.
    pub(super) fn into_files(self) -> BTreeSet<PathBuf> {
        self.files
    }

    /// Counts what `other` has found as its own.
    pub(super) fn adopt(&mut self, other: Lookup) {
        self.files.extend(other.files);
    }

    fn search(&mut self, names: &[&[u8]], directories: &[&Path]) -> Found {
        let names = || names.iter().enumerate().filter(|(_, name)| name.len() <= LONGEST_NAME);
        for (number, name) in names() {
            for directory in directories {
                if let Some(file) = exact(directory, name) {
                    return Found::Exact(file, number);
                }
            }
        }
        for (number, name) in names() {
            let parts = parts(name);
            for tail in (1..parts.len()).map(|first| parts[first..].join(&b'/')) {
                let file =
                    directories.iter().map(|directory| directory.join(path(&tail))).find(|f| f.is_file());
                if let Some(file) = file {
                    return Found::Instead(file, number);
                }
            }
        }
        for (number, name) in names() {
            let parts = parts(name);
            for first in 0..parts.len() {
                for directory in directories {
                    let mut files = self.any_case(directory, &parts[first..]);
                    match files.len() {
                        0 => {}
                        1 => return Found::Instead(files.remove(0), number),
                        _ => return Found::Ambiguous(files),
                    }
                }
            }
        }
        Found::Missing
    }

    /// All files of `directory` whose path is `parts` without regard to case, in the order of their names.
    fn any_case(&mut self, directory: &Path, parts: &[&[u8]]) -> Vec<PathBuf> {
        let mut places = vec![directory.to_path_buf()];
        for part in parts {
            let mut next = Vec::new();
            for place in places {
                if *part == b".." {
                    next.push(place.join(".."));
                    continue;
                }
                let entries = self.listing(&place).get(&folded(part)).cloned().unwrap_or_default();
                next.extend(entries.iter().map(|entry| place.join(entry)));
            }
            places = next;
        }
        places.retain(|file| file.is_file());
        places
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

/// The file of exactly this name, or of this name with slashes for its backslashes.
fn exact(directory: &Path, name: &[u8]) -> Option<PathBuf> {
    let slashes: Vec<u8> = name.iter().map(|&byte| if byte == b'\\' { b'/' } else { byte }).collect();
    [name, &slashes].into_iter().map(|name| directory.join(path(name))).find(|file| file.is_file())
}

/// The parts of a path of any system, without those that say nothing.
fn parts(name: &[u8]) -> Vec<&[u8]> {
    let parts = name.split(|byte| matches!(byte, b'/' | b'\\' | b':'));
    let parts: Vec<&[u8]> = parts.filter(|part| !part.is_empty() && *part != b".").collect();
    let first = parts.len().saturating_sub(MOST_PARTS);
    parts[first..].to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// A directory with these files, in `check`.
    fn with(test: &str, files: &[&str], check: impl Fn(&Path)) {
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
    fn exact_then_tails_then_any_case() {
        with("order", &["a/tex/x.png", "a/x.png", "b/x.png", "b/Tex/Y.png"], |root| {
            let (a, b) = (root.join("a"), root.join("b"));
            let find = |name: &str| Lookup::default().find(&[name.as_bytes()], &[&a, &b]);
            assert_eq!(find("x.png"), Found::Exact(a.join("x.png"), 0));
            assert_eq!(find("tex\\x.png"), Found::Exact(a.join("tex/x.png"), 0));
            assert_eq!(find("Tex/Y.png"), Found::Exact(b.join("Tex/Y.png"), 0));
            assert_eq!(find("C:\\art\\tex\\x.png"), Found::Instead(a.join("tex/x.png"), 0));
            assert_eq!(find("Disk:art:x.png"), Found::Instead(a.join("x.png"), 0));
            assert_eq!(find("//server/art/TEX/X.PNG"), Found::Instead(a.join("tex/x.png"), 0));
            assert_eq!(find("art/tex/y.PNG"), Found::Instead(b.join("Tex/Y.png"), 0));
            assert_eq!(find("../a/X.png"), Found::Instead(a.join("../a/x.png"), 0));
            assert_eq!(find("z.png"), Found::Missing);
            assert_eq!(find(&"x/".repeat(10_000)), Found::Missing);
        });
    }

    #[test]
    fn what_fits_twice_is_not_guessed() {
        with("twice", &["wood.png", "Wood.png", "t/stone.png", "T/Stone.png", "T/only.png"], |root| {
            let find = |name: &str| Lookup::default().find(&[name.as_bytes()], &[root]);
            assert_eq!(find("wood.png"), Found::Exact(root.join("wood.png"), 0));
            let both = [root.join("Wood.png"), root.join("wood.png")].to_vec();
            assert_eq!(find("WOOD.png"), Found::Ambiguous(both));
            assert!(matches!(find("T/STONE.png"), Found::Ambiguous(files) if files.len() == 2));
            assert_eq!(find("t/Only.png"), Found::Instead(root.join("T/only.png"), 0));
        });
    }

    #[test]
    fn names_in_latin_1_find_files_in_utf_8() {
        with("latin", &["grün.png"], |root| {
            let found = Lookup::default().find(&[b"gr\xfcn.png"], &[root]);
            assert_eq!(found, Found::Instead(root.join("grün.png"), 0));
        });
    }

    #[test]
    fn the_likelier_name_wins_where_both_are_there() {
        with("likelier", &["a b", "a"], |root| {
            let mut lookup = Lookup::default();
            assert_eq!(lookup.find(&[b"a b", b"a"], &[root]), Found::Exact(root.join("a b"), 0));
            assert_eq!(lookup.find(&[b"c", b"a"], &[root]), Found::Exact(root.join("a"), 1));
        });
    }
}
