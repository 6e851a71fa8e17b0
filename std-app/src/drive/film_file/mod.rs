//! Films in files: checkpoints of a render, and shards to be merged. The format is docs/film-file.md.
//!
//! A file is written beside its place and renamed into it when all of it is on the disk: whenever the program is
//! killed, the old file or the new one is there, whole.

mod hash;
mod header;
mod identity;

pub(super) use header::Header;
pub(super) use identity::Identity;

use super::MOST_PIXELS;
use super::canvas::{Canvas, Shard};
use super::error::FilmError;
use halflight_core::film::{PIXELS_PER_TILE, Pixel, Tile};
use hash::Hash;
use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

/// The first bytes: what it is, the version of the format, and a word that tells the order of bytes.
const MAGIC: [u8; 12] = {
    let [a, b, c, d] = 0x0102_0304u32.to_ne_bytes();
    [b'H', b'L', b'F', b'I', b'L', b'M', 0, 1, a, b, c, d]
};

/// A header is no longer than this, in bytes.
const LONGEST_HEADER: u32 = 1 << 28;

/// Writes `canvas` to `path`, whole or not at all.
pub(super) fn write(path: &Path, header: &Header, canvas: &Canvas) -> Result<(), FilmError> {
    let part = part(path);
    let written = write_part(&part, header, canvas).and_then(|()| fs::rename(&part, path));
    // The new name is on the disk when the folder is. Where folders cannot be opened there is nothing to do.
    if let (Ok(()), Ok(folder)) = (&written, File::open(folder(path))) {
        let _ = folder.sync_all();
    }
    written.map_err(|error| {
        let _ = fs::remove_file(&part);
        FilmError::new(path, format!("cannot be written: {error}"))
    })
}

fn write_part(part: &Path, header: &Header, canvas: &Canvas) -> io::Result<()> {
    let mut file = BufWriter::with_capacity(1 << 20, File::create(part)?);
    let mut hash = Hash::default();
    let mut put = |bytes: &[u8]| {
        hash.section(bytes);
        file.write_all(bytes)
    };
    put(&MAGIC)?;
    let header = serde_json::to_vec(header)?;
    put(&(header.len() as u32).to_le_bytes())?;
    put(&header)?;
    put(bytemuck::cast_slice(&canvas.taken))?;
    for (pixels, _) in tiles(canvas.film.pixels(), &canvas.taken) {
        put(bytemuck::cast_slice(pixels))?;
    }
    file.write_all(&hash.value().to_le_bytes())?;
    file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}

/// Tiles that have samples: the others are not stored.
fn tiles<'a>(pixels: &'a [Pixel], taken: &'a [u32]) -> impl Iterator<Item = (&'a [Pixel], u32)> {
    pixels.chunks(PIXELS_PER_TILE).zip(taken.iter().copied()).filter(|(_, taken)| *taken > 0)
}

/// Whether [`write()`] will find its way: the folder is there and takes files.
pub fn check_writable(path: &Path) -> Result<(), FilmError> {
    if path.is_dir() {
        return Err(FilmError::new(path, "cannot be written: it is a folder"));
    }
    let part = part(path);
    let created = File::create(&part).map(|_| ());
    let _ = fs::remove_file(&part);
    created.map_err(|error| FilmError::new(path, format!("cannot be written: {error}")))
}

/// A film file whose header has been read.
#[derive(Debug)]
pub(super) struct Reader {
    path: PathBuf,
    file: BufReader<File>,
    hash: Hash,
    pub(super) header: Header,
}

impl Reader {
    /// Opens `path` and reads its header.
    pub(super) fn open(path: &Path) -> Result<Self, FilmError> {
        let file = File::open(path).map_err(|error| FilmError::io(path, &error))?;
        let mut reader = BufReader::with_capacity(1 << 20, file);
        let mut hash = Hash::default();
        let mut get = |bytes: &mut [u8]| {
            reader.read_exact(bytes).map_err(|error| FilmError::io(path, &error))?;
            hash.section(bytes);
            Ok::<_, FilmError>(())
        };
        let mut magic = MAGIC;
        get(&mut magic)?;
        if magic[..6] != MAGIC[..6] {
            return Err(FilmError::new(path, "is no film file"));
        }
        if magic != MAGIC {
            return Err(FilmError::new(path, "is a film of another format: of another version or machine"));
        }
        let mut length = [0; 4];
        get(&mut length)?;
        let length = u32::from_le_bytes(length);
        if length > LONGEST_HEADER {
            return Err(FilmError::new(path, "is damaged: its header has no sensible length"));
        }
        let mut text = Vec::new();
        let limited = reader.by_ref().take(u64::from(length)).read_to_end(&mut text);
        limited.map_err(|error| FilmError::io(path, &error))?;
        if text.len() != length as usize {
            return Err(FilmError::new(path, "is damaged: it is too short"));
        }
        hash.section(&text);
        let header = serde_json::from_slice(&text);
        let header: Header =
            header.map_err(|error| FilmError::new(path, format!("is damaged: its header: {error}")))?;
        let Shard { index, count } = header.shard();
        let [width, height] = header.size();
        if index >= count || !(1..=MOST_PIXELS).contains(&(u64::from(width) * u64::from(height))) {
            return Err(FilmError::new(path, "is damaged: there is no such picture"));
        }
        Ok(Self { path: path.to_owned(), file: reader, hash, header })
    }

    /// Refuses a film that is of something else.
    pub(super) fn check(&self, identity: &Identity, shard: Shard) -> Result<(), FilmError> {
        let words = |shard: Shard| format!("shard {}/{}", shard.index + 1, shard.count);
        let own = self.header.shard();
        let difference = self.header.identity.difference(identity);
        let difference =
            difference.or((own != shard).then(|| format!("of {}, not of {}", words(own), words(shard))));
        difference
            .map_or(Ok(()), |difference| Err(FilmError::new(&self.path, format!("is a film {difference}"))))
    }

    /// Refuses a film that cannot be merged with that of `first`.
    pub(super) fn check_sibling(&self, first: &Self) -> Result<(), FilmError> {
        let (own, other) = (&self.header, &first.header);
        let refuse = |why: String| {
            Err(FilmError::new(
                &self.path,
                format!("does not belong to {}: it is {why}", first.path.display()),
            ))
        };
        if let Some(difference) = own.identity.difference(&other.identity) {
            return refuse(format!("a film {difference}"));
        }
        if own.shard().count != other.shard().count {
            return refuse(format!("one of {} shards, not of {}", own.shard().count, other.shard().count));
        }
        if own.spp != other.spp {
            return refuse(format!("a film of {} samples, not of {}", own.spp, other.spp));
        }
        Ok(())
    }

    /// Reads the pixels of its tiles into those of `canvas`, a film of the same size.
    pub(super) fn read_into(mut self, canvas: &mut Canvas) -> Result<(), FilmError> {
        let [width, height] = self.header.size();
        let mut taken = vec![0u32; Tile::count(width, height)];
        if taken.len() != canvas.taken.len() {
            return Err(FilmError::new(&self.path, "is damaged: it has another size than it says"));
        }
        self.get(bytemuck::cast_slice_mut(&mut taken))?;
        let shard = self.header.shard();
        for (task, pixels) in canvas.film.pixels_mut().chunks_mut(PIXELS_PER_TILE).enumerate() {
            if taken[task] == 0 {
                continue;
            }
            if !shard.owns(task) {
                return Err(FilmError::new(&self.path, "is damaged: it has tiles of other shards"));
            }
            self.get(bytemuck::cast_slice_mut(pixels))?;
            canvas.taken[task] = taken[task];
        }
        let mut sum = [0; 8];
        self.file.read_exact(&mut sum).map_err(|error| FilmError::io(&self.path, &error))?;
        let more = self.file.read(&mut [0]).map_err(|error| FilmError::io(&self.path, &error))?;
        if u64::from_le_bytes(sum) != self.hash.value() || more > 0 {
            return Err(FilmError::new(&self.path, "is damaged: its checksum is wrong"));
        }
        canvas.counters += self.header.counters();
        canvas.ledger.merge(&self.header.ledger());
        Ok(())
    }

    fn get(&mut self, bytes: &mut [u8]) -> Result<(), FilmError> {
        self.file.read_exact(bytes).map_err(|error| FilmError::io(&self.path, &error))?;
        self.hash.section(bytes);
        Ok(())
    }
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Where a file is while it is written: always the same, so that what a killed program leaves is used again.
fn part(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    folder(path).join(format!(".{name}.part"))
}
