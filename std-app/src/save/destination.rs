//! Destinations of outputs, with links resolved: files, which are replaced, and pipes and devices, which are
//! written in place. Nothing is opened here, because opening and closing a pipe ends its reader.

use std::ffi::OsString;
use std::fs::{self, Metadata};
use std::io;
use std::path::{Path, PathBuf};

/// Longest chain of links; the limit of Linux.
const MOST_LINKS: usize = 40;

/// The target of all links of a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Destination {
    path: PathBuf,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// A file, which may not exist yet.
    File,
    /// A folder.
    Folder,
    /// A pipe or a device.
    Stream,
    /// A file descriptor inherited by the program.
    Descriptor(u32),
}

impl Destination {
    /// Resolves the links of `path`; the target need not exist.
    ///
    /// # Errors
    /// A cycle of links, or an error of the system.
    pub fn of(path: &Path) -> io::Result<Self> {
        // Without the slash at its end, which a new file cannot have.
        let mut path: PathBuf = path.components().collect();
        for _ in 0..MOST_LINKS {
            let kind = match fs::symlink_metadata(&path) {
                Ok(data) if data.is_symlink() => {
                    if let Some(number) = descriptor(&path) {
                        return Ok(Self { path, kind: Kind::Descriptor(number) });
                    }
                    path = folder(&path).join(fs::read_link(&path)?);
                    continue;
                }
                Ok(data) if data.is_file() => Kind::File,
                Ok(data) if data.is_dir() => Kind::Folder,
                Ok(_) => Kind::Stream,
                Err(error) if error.kind() == io::ErrorKind::NotFound => Kind::File,
                Err(error) => return Err(error),
            };
            return Ok(Self { path, kind });
        }
        Err(io::Error::other("its links form a circle"))
    }

    /// The name, with links resolved.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// True if it is written in place.
    pub fn is_stream(&self) -> bool {
        matches!(self.kind, Kind::Stream | Kind::Descriptor(_))
    }

    /// True if it is a file descriptor that the program has inherited, which is open.
    #[cfg(unix)]
    pub(crate) fn is_inherited(&self) -> bool {
        matches!(self.kind, Kind::Descriptor(_))
    }

    /// True if it is a folder.
    pub(crate) fn is_folder(&self) -> bool {
        self.kind == Kind::Folder
    }

    /// True if it is the standard output of the program.
    pub fn is_stdout(&self) -> bool {
        self.kind == Kind::Descriptor(1)
    }

    /// True if it is the standard error of the program.
    pub(crate) fn is_stderr(&self) -> bool {
        self.kind == Kind::Descriptor(2)
    }
}

/// N of `/proc/self/fd/N`, whose link may not be openable.
fn descriptor(path: &Path) -> Option<u32> {
    let folder = folder(path).canonicalize().ok()?;
    let is_open = folder.starts_with("/proc") && folder.ends_with("fd");
    path.file_name()?.to_str()?.parse().ok().filter(|_| is_open)
}

/// The folder of a file.
pub(crate) fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Identity of a file under all its spellings, links and hard links: device and inode, or those of the folder
/// and a name if the file does not exist yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    key: Key,
    name: Option<OsString>,
}

#[cfg(unix)]
type Key = (u64, u64);
#[cfg(not(unix))]
type Key = PathBuf;

impl Identity {
    /// Identity of the file at `path`. `None` for devices, and for files in missing folders.
    pub fn of(path: &Path) -> Option<Self> {
        if let Ok(data) = fs::metadata(path) {
            return Some(Self { key: key(path, &data)?, name: None });
        }
        let path = Destination::of(path).ok()?.path;
        let folder = folder(&path);
        let key = key(folder, &fs::metadata(folder).ok()?)?;
        Some(Self { key, name: Some(path.file_name()?.to_owned()) })
    }

    /// Identity of an open file or pipe.
    #[cfg(unix)]
    pub fn of_open(file: impl std::os::fd::AsFd) -> Option<Self> {
        let file = fs::File::from(file.as_fd().try_clone_to_owned().ok()?);
        Some(Self { key: key(Path::new(""), &file.metadata().ok()?)?, name: None })
    }

    /// Unknown on this system.
    #[cfg(not(unix))]
    pub fn of_open<T>(_: T) -> Option<Self> {
        None
    }
}

#[cfg(unix)]
fn key(_: &Path, data: &Metadata) -> Option<Key> {
    use std::os::unix::fs::{FileTypeExt, MetadataExt};
    (!data.file_type().is_char_device()).then(|| (data.dev(), data.ino()))
}

#[cfg(not(unix))]
fn key(path: &Path, _: &Metadata) -> Option<Key> {
    path.canonicalize().ok()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    /// Runs `check` in an empty folder.
    fn in_folder(name: &str, check: impl FnOnce(&Path)) {
        let folder =
            std::env::temp_dir().join(format!("halflight-destination-{name}-{}", std::process::id()));
        fs::create_dir_all(folder.join("sub")).unwrap();
        check(&folder);
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn names_of_one_file_have_one_identity() {
        in_folder("names", |folder| {
            let file = folder.join("a");
            fs::write(&file, "a").unwrap();
            fs::write(folder.join("b"), "a").unwrap();
            symlink("a", folder.join("link")).unwrap();
            symlink("../link", folder.join("sub/chain")).unwrap();
            fs::hard_link(&file, folder.join("hard")).unwrap();
            let identity = Identity::of(&file);
            assert!(identity.is_some());
            for name in ["./a", "sub/../a", "link", "sub/chain", "hard"] {
                assert_eq!(Identity::of(&folder.join(name)), identity, "{name}");
            }
            assert_ne!(Identity::of(&folder.join("b")), identity);
        });
    }

    #[test]
    fn missing_files_have_identities() {
        in_folder("missing", |folder| {
            symlink("new", folder.join("link")).unwrap();
            symlink("sub", folder.join("other")).unwrap();
            assert_eq!(Identity::of(&folder.join("link")), Identity::of(&folder.join("sub/../new")));
            assert_eq!(Identity::of(&folder.join("sub/x")), Identity::of(&folder.join("other/x")));
            assert_ne!(Identity::of(&folder.join("sub/x")), Identity::of(&folder.join("x")));
            assert_eq!(Identity::of(&folder.join("none/x")), None);
            assert_eq!(Identity::of(Path::new("/dev/null")), None, "nothing can be lost there");
        });
    }

    #[test]
    fn links_to_missing_files_and_circles() {
        in_folder("links", |folder| {
            symlink("sub/new", folder.join("link")).unwrap();
            symlink("y", folder.join("x")).unwrap();
            symlink("x", folder.join("y")).unwrap();
            let destination = Destination::of(&folder.join("link")).unwrap();
            assert_eq!((destination.path(), destination.is_stream()), (&*folder.join("sub/new"), false));
            assert!(Destination::of(&folder.join("x")).unwrap_err().to_string().contains("circle"));
            assert!(Destination::of(Path::new("/dev/null")).unwrap().is_stream());
            assert!(Destination::of(Path::new("/dev/stdout")).unwrap().is_stdout());
        });
    }
}
