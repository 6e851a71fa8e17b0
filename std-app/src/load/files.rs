//! Lookup of the files that statements name. Names come from other machines: with other folders, with
//! backslashes, in another case or encoding. The exact name is tried first, then each tail of the path from
//! the longest on, then both without regard to case and encoding if exactly one file matches.

use super::name::{folded, path, shown};
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
        for (number, name) in names() {
            let parts = parts(name);
            for tail in (1..parts.len()).map(|first| path(&parts[first..].join(&b'/'))) {
                let mut files = directories.iter().map(|directory| directory.join(&tail));
                if let Some(file) = files.find(|file| file.is_file()) {
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
    let slashes: Vec<u8> = name.iter().map(|&byte| if byte == b'\\' { b'/' } else { byte }).collect();
    [name, &slashes].into_iter().map(|name| directory.join(path(name))).find(|file| file.is_file())
}

/// The last parts of a path of any system, without empty ones and `.`.
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

    #[test]
    fn likelier_name_wins() {
        with_files("likelier", &["a b", "a"], |root| {
            let mut lookup = Lookup::default();
            assert_eq!(lookup.locate(&[b"a b", b"a"], &[root]), Found::Exact(root.join("a b"), 0));
            assert_eq!(lookup.locate(&[b"c", b"a"], &[root]), Found::Exact(root.join("a"), 1));
        });
    }
}
